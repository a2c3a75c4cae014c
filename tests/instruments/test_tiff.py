"""Frames as 16-bit TIFF files: what a count is worth, which row is first, and back."""

import json

import numpy as np
import pytest
import tifffile

from fringetrace import nm, um
from fringetrace.instruments import tiff

# Half a count.
HALF = 0.5 / tiff.COUNTS
IMAGES = np.random.default_rng(0).uniform(0.0, 1.0, (4, 3, 5))


def test_the_full_scale_follows_the_brightest_pixel():
    images = np.array([[0.0, 0.5], [1.0, 2.0]])
    assert tiff.counts(images, 2.0).tolist() == [[32768, 65535], [0, 16384]]
    assert tiff.counts(images, 1.0).tolist() == [[65535, 65535], [0, 32768]]


@pytest.mark.parametrize("images", [IMAGES[0], IMAGES, IMAGES[:, None, ::-1], 3.0 * IMAGES], ids=np.shape)
def test_there_and_back(tmp_path, images):
    file = tmp_path / "frames.tif"
    tiff.save(images, 2 * um, file, wavelength_m=532 * nm)
    back = tiff.load(file)
    assert back.shape == images.shape
    scale = back.attrs["full_scale"]
    assert scale == max(1.0, images.max())
    # a rounding over half a count
    assert np.abs(back.values - images).max() <= 1.000001 * HALF * scale
    assert back.dims == (*("set", "frame")[4 - images.ndim :], "y", "x")
    assert back.x.values == pytest.approx(np.arange(-2, 3) * 2 * um)
    assert (back.attrs["wavelength_m"], back.attrs["pixel_pitch_m"]) == (532 * nm, 2 * um)
    assert back.attrs["units"] == "1"
    assert [path.name for path in tmp_path.iterdir()] == ["frames.tif"]


def test_what_others_see(tmp_path):
    """The top row first, 16 bits, a resolution, and the description in JSON."""
    tiff.save(IMAGES, 2 * um, tmp_path / "frames.tif", full_scale=0.5)
    with tifffile.TiffFile(tmp_path / "frames.tif") as file:
        stored, page = file.asarray(), file.pages.first
        assert (page.dtype, stored.shape) == (np.uint16, (4, 3, 5))
        assert np.abs(stored[:, ::-1] * 0.5 / 65535 - IMAGES.clip(max=0.5)).max() <= 0.5 * 1.000001 * HALF
        numerator, denominator = page.tags["XResolution"].value
        assert json.loads(page.description)["full_scale"] == 0.5
    assert numerator / denominator == pytest.approx(5000.0)  # pixels of 2 um in a centimetre


def test_what_is_refused(tmp_path):
    file = tmp_path / "frames.tif"
    for images, options, message in (
        (np.zeros(3), {}, r"frames: expected shape .*, got \(3,\)"),
        (np.zeros((1, 1, 1, 2, 2)), {}, r"frames: expected shape .*, got \(1, 1, 1, 2, 2\)"),
        (np.where(IMAGES < 0.1, np.nan, IMAGES), {}, r"frames: expected finite .* at \d+ of 60 pixels"),
        (np.array([[1.0, np.inf]]), {"full_scale": 1.0}, r"frames: expected finite .* at 1 of 2 pixels"),
        (IMAGES, {"full_scale": 0.0}, "full scale: expected a positive irradiance, got 0"),
    ):
        with pytest.raises(ValueError, match=message):
            tiff.save(images, um, file, **options)
    assert not list(tmp_path.iterdir())
    with pytest.raises(FileNotFoundError, match=r"frames.tif: expected an existing file"):
        tiff.load(file)
    file.write_bytes(b"II*\x00")
    with pytest.raises(ValueError, match=r"frames.tif: expected a TIFF file with its full scale, got"):
        tiff.load(file)
    tifffile.imwrite(file, np.zeros((2, 2), np.uint16))
    with pytest.raises(ValueError, match=r"frames.tif: expected a TIFF file with its full scale, got"):
        tiff.load(file)
