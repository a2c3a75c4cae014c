"""A measurement next to the truth: residuals, where they count, and every file that is written."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import tifffile
import xarray
from matplotlib.image import imread

from fringetrace import instruments, mm, nm
from fringetrace.core.files import staged
from fringetrace.geometry.shapes import height_map, plate, step
from fringetrace.validation import measurement

HENE = 632.8 * nm


def measured(mesh, **options):
    bench = instruments.michelson(
        mesh, **{"aperture": 6 * mm, "pixels": (30, 40), "reference_tilt": (2e-4, 1e-4), **options}
    )
    truth = measurement.heights(mesh, bench.ccd.shape, bench.ccd.pitch)
    return measurement.measure_height(bench, truth, HENE)


@pytest.fixture(scope="module")
def bumpy():
    at = np.linspace(-1, 1, 41)
    z = 400 * nm * np.cos(2.0 * at[None, :]) * np.cos(1.5 * at[:, None])
    return measured(height_map(z, 8 * mm / 40))


def test_the_residual_of_a_smooth_sample_is_small(bumpy):
    assert np.isfinite(bumpy.residual).all()
    assert np.ptp(bumpy.truth) > 200 * nm
    assert bumpy.rms() < HENE / 1000
    assert abs(bumpy.residual.mean()) < 1e-6 * HENE
    assert bumpy.smooth.all()
    assert bumpy.interferogram.shape == (30, 40)
    np.testing.assert_array_equal(bumpy.interferogram, bumpy.frames[0])


def test_a_step_of_over_a_quarter_wave_is_named_and_left_out():
    """300 nm cannot be told from 300 nm - lambda/2; away from the step both sides are flat."""
    found = measured(step(8 * mm, 8 * mm, 1.06 * mm, 300 * nm))
    beyond = np.abs(found.residual) > 0.25 * HENE
    # a pixel on the step shows a mean of both phases; one that the tilted beam only partly lights, at the
    # rim, that of the lit part
    assert np.abs(np.abs(found.residual[beyond]) - HENE / 2).max() < 0.01 * HENE
    inner = np.zeros_like(beyond)
    inner[1:-1, 1:-1] = found.smooth[1:-1, 1:-1]
    np.testing.assert_allclose(np.abs(found.residual[beyond & inner]), HENE / 2, rtol=1e-6)
    assert beyond.all(axis=0).sum() == 13
    columns = np.nonzero(~found.smooth)[1]
    assert sorted(set(columns)) == [26, 27]
    assert found.rms() > 100 * nm
    assert found.rms(~beyond & inner) < 1e-6 * HENE


def test_whole_half_wavelengths_may_be_left_out(bumpy):
    rng = np.random.default_rng(5)
    orders = rng.integers(-3, 4, bumpy.residual.shape)
    missed = replace(bumpy, residual=bumpy.residual + 0.5 * HENE * orders)
    assert np.array_equal(missed.orders, np.where(np.isnan(missed.residual), np.nan, orders), equal_nan=True)
    assert missed.rms() > HENE / 2
    assert missed.rms(but_for_orders=True) == pytest.approx(bumpy.rms(), rel=1e-4)  # roundings of HENE / 2


def test_the_rms_is_that_of_the_residual(bumpy):
    where = np.zeros(bumpy.residual.shape, dtype=bool)
    where[3, 4:6] = True
    expected = math.sqrt((bumpy.residual[3, 4] ** 2 + bumpy.residual[3, 5] ** 2) / 2)
    assert bumpy.rms(where) == pytest.approx(expected)
    assert math.isnan(bumpy.rms(np.zeros_like(where)))


def test_beside_the_sample_nothing_is_compared():
    found = measured(plate(3 * mm, 8 * mm))
    assert np.isnan(found.residual[:, :10]).all()
    assert np.isnan(found.truth[:, :10]).all()
    assert np.isfinite(found.residual[:, 10:30]).all()
    assert not found.smooth[:, 9:11].any()
    assert found.smooth[:, 11:29].all()


def test_fringes_are_counted_along_the_steeper_axis(bumpy):
    slope = math.sin(2 * math.hypot(2e-4, 1e-4)) * 2 / math.sqrt(5)
    assert bumpy.fringes == pytest.approx(slope * 6 * mm / HENE, rel=1e-9)


def test_heights_are_those_of_the_mesh_about_a_point():
    mesh = height_map(np.outer(np.ones(5), np.arange(5.0)), 1.0)
    shifted = measurement.heights(mesh, (2, 2), 1.0, (0.5, 0.5, 2.0))
    np.testing.assert_allclose(shifted, [[0.0, 1.0], [0.0, 1.0]])
    assert np.isnan(measurement.heights(mesh, (2, 2), 10.0)).all()


def test_the_netcdf_holds_everything_with_units(bumpy, tmp_path):
    measurement.write_measurement(bumpy, tmp_path / "result.nc")
    with xarray.open_dataset(tmp_path / "result.nc", engine="h5netcdf") as data:
        for name, array in (
            ("interferogram", bumpy.interferogram), ("frames", bumpy.frames),
            ("wrapped_phase", bumpy.wrapped), ("height", bumpy.height),
            ("mesh_height", bumpy.truth), ("residual", bumpy.residual),
        ):  # fmt: skip
            np.testing.assert_array_equal(data[name], array)
        assert data["frames"].dims == ("step", "y", "x")
        units = {name: data[name].attrs["units"] for name in data.variables}
        assert units == {
            "interferogram": "1", "frames": "1", "wrapped_phase": "rad", "height": "m", "mesh_height": "m",
            "residual": "m", "x": "m", "y": "m", "step": "rad",
        }  # fmt: skip
        pitch = 6 * mm / 40
        np.testing.assert_allclose(data["x"], (np.arange(40) - 19.5) * pitch)
        np.testing.assert_allclose(data["y"], (np.arange(30) - 14.5) * pitch)
        np.testing.assert_allclose(data["step"], np.arange(4) * np.pi / 2)
        assert data.attrs["wavelength_m"] == HENE
        np.testing.assert_array_equal(data.attrs["reference_tilt_rad"], [2e-4, 1e-4])
        assert data.attrs["residual_rms_m"] == bumpy.rms()
        assert data.attrs["power_incident"] == bumpy.ledger.incident
        assert data.attrs["version_fringetrace"] == __import__("fringetrace").__version__


def test_the_camera_files_are_the_frames_in_16_bits(bumpy, tmp_path):
    measurement.write_camera(bumpy, tmp_path)
    frames = tifffile.imread(tmp_path / "frames.tif")
    assert frames.dtype == np.uint16
    assert frames.shape == (4, 30, 40)
    # half a count, and the first row of a picture is the top one
    np.testing.assert_allclose(frames[:, ::-1] / 65535 * bumpy.full_scale, bumpy.frames, atol=0.51 / 65535)
    np.testing.assert_array_equal(tifffile.imread(tmp_path / "interferogram.tif"), frames[0])
    with tifffile.TiffFile(tmp_path / "interferogram.tif") as file:
        notes = json.loads(file.pages[0].description)
        numerator, denominator = file.pages[0].tags["XResolution"].value
    assert notes["full_scale"] == bumpy.full_scale == 1.0
    assert notes["pixel_pitch_m"] == pytest.approx(6 * mm / 40)
    assert numerator / denominator == pytest.approx(0.01 / (6 * mm / 40), rel=1e-6)


def test_the_pictures_show_something(bumpy, tmp_path):
    measurement.write_pictures(bumpy, tmp_path)
    for name, width in (("interferogram.png", 1050), ("height.png", 1800)):
        image = imread(tmp_path / name)
        assert image.shape[1] == width
        assert image[:, :, :3].std() > 0.1


def test_staged_files_arrive_together(tmp_path):
    out = tmp_path / "new" / "out"
    with staged(out) as folder:
        (folder / "a").write_text("1")
        (folder / "b").write_text("2")
        assert {path.name for path in out.iterdir()} == {folder.name}
    assert {path.name for path in out.iterdir()} == {"a", "b"}


def test_a_failure_leaves_nothing_behind(tmp_path):
    out = tmp_path / "new" / "out"
    with pytest.raises(ZeroDivisionError), staged(out) as folder:  # noqa: PT012
        (folder / "a").write_text("1")
        1 / 0
    assert not list(tmp_path.iterdir())


def test_a_failure_keeps_what_was_there(tmp_path):
    (tmp_path / "a").write_text("before")
    with pytest.raises(KeyboardInterrupt), staged(tmp_path) as folder:  # noqa: PT012
        (folder / "a").write_text("after")
        raise KeyboardInterrupt
    assert (tmp_path / "a").read_text() == "before"
    assert len(list(tmp_path.iterdir())) == 1


def test_a_folder_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(FileExistsError), staged(tmp_path / "out"):
        pass
    with pytest.raises(NotADirectoryError), staged(tmp_path / "out" / "deeper"):
        pass
