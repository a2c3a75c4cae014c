"""Masks of numpy.ma arrays are honoured wherever measured maps come in."""

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm, phase, um, views
from fringetrace.core.units import filled, path_phase, phase_path
from fringetrace.geometry import forms, shapes, zygo
from fringetrace.instruments import records, tiff
from fringetrace.optics import phase_plates
from fringetrace.scattering import colour
from fringetrace.scene.spectrum import Spectrum

# What lies under masks: far from all that is right.
JUNK = 1e3
RNG = np.random.default_rng(5)


def masked(values, share=0.2):
    """Values with junk under a mask, and the same with NaN."""
    hidden = RNG.uniform(size=np.shape(values)) < share
    return np.ma.array(np.where(hidden, JUNK, values), mask=hidden), np.where(hidden, np.nan, values)


ROWS, COLUMNS = np.mgrid[:12, :15]
SLOPE = 0.3 * ROWS - 0.2 * COLUMNS + 0.1


@pytest.mark.parametrize(
    "function",
    [
        phase.wrap, phase.unwrap, phase.remove_mean, phase.remove_plane,
        lambda map: phase.height(map, 633 * nm),
        lambda map: phase.two_wavelength(map, 0.9 * map, 633 * nm, 700 * nm),
        lambda map: path_phase(map, 633 * nm), lambda map: phase_path(map, 633 * nm),
    ],
)  # fmt: skip
def test_maps(function):
    one, other = (function(map) for map in masked(SLOPE))
    assert type(one) is np.ndarray
    np.testing.assert_array_equal(one, other)
    assert np.isnan(one).any()


@pytest.mark.parametrize(
    ("function", "count"),
    [
        (phase.four_step, 4), (phase.three_step, 3), (phase.hariharan, 5), (phase.carre, 4),
        (phase.stoilov, 5), (phase.n_bucket, 6), (phase.modulation, 6),
        (lambda frames: phase.least_squares(frames, [0.0, 1.0, 2.5, 4.0]), 4),
    ],
)  # fmt: skip
def test_frames(function, count):
    steps = 2 * np.pi * np.arange(count)[:, None, None] / count
    images = 1.0 + 0.5 * np.cos(SLOPE + steps)
    hidden, unknown = masked(images, 0.05)
    np.testing.assert_array_equal(function(hidden), function(unknown))
    # a list of masked frames, as a camera's driver may hand them on
    np.testing.assert_array_equal(function(list(hidden)), function(unknown))
    assert np.isnan(function(hidden)).any()


def test_a_plane_under_a_mask_is_that_of_the_rest():
    hidden, _ = masked(SLOPE)
    assert np.nanmax(np.abs(phase.remove_plane(hidden))) < 1e-13
    assert abs(np.nanmean(phase.remove_mean(hidden))) < 1e-13


@pytest.mark.parametrize("function", [phase.unwrap, phase.remove_mean, phase.remove_plane])
def test_masks_of_both_kinds_add(function):
    hidden, unknown = masked(SLOPE)
    mask = RNG.uniform(size=SLOPE.shape) < 0.2
    np.testing.assert_array_equal(function(hidden, mask), function(unknown, mask))
    # numpy.ma's word for no mask at all
    np.testing.assert_array_equal(function(SLOPE, np.ma.array(SLOPE).mask), function(SLOPE))
    with pytest.raises(ValueError, match="expected at least one valid pixel, got none of 180"):
        function(np.ma.masked_all(SLOPE.shape))


def test_surfaces():
    hidden, unknown = (1 * nm * map for map in masked(SLOPE))
    one, other = (shapes.height_map(map, 1 * um) for map in (hidden, unknown))
    assert np.array_equal(one.vertices, other.vertices)
    assert np.array_equal(one.faces, other.faces)
    with pytest.raises(ValueError, match="HeightField heights: expected 4 x 4 finite numbers"):
        forms.HeightField(hidden, 1 * um)
    with pytest.raises(ValueError, match="PhasePlate opd: expected a table of finite metres"):
        phase_plates.PhasePlate(opd=hidden, centre=(0, 0, 0), right=(1, 0, 0), up=(0, 1, 0), pitch=1 * um)


def test_files(tmp_path):
    hidden, unknown = (1 * nm * map for map in masked(SLOPE))
    for suffix in (".dat", ".datx"):
        for name, map in (("one", hidden), ("other", unknown)):
            zygo.write_height_map(map, 1 * um, tmp_path / f"{name}{suffix}")
        one, other = (zygo.read_height_map(tmp_path / f"{name}{suffix}")[0] for name in ("one", "other"))
        np.testing.assert_array_equal(one, other)
        np.testing.assert_array_equal(np.isnan(one), np.isnan(unknown))
    with pytest.raises(
        ValueError, match=r"frames: expected finite irradiances, .* at [1-9]\d* of 180 pixels"
    ):
        tiff.save(hidden, 1 * um, tmp_path / "frames.tif")
    assert not (tmp_path / "frames.tif").exists()


def test_records():
    hidden, unknown = masked(SLOPE)
    found = records.dataset({"height": hidden, "field": hidden + 1j, "count": hidden.astype(int)}, 1 * um)
    np.testing.assert_array_equal(found["height"], unknown)
    np.testing.assert_array_equal(found["field"], unknown + 1j)
    np.testing.assert_array_equal(np.isnan(found["count"]), np.isnan(unknown))


def test_pictures():
    hidden, unknown = (1 * nm * map for map in masked(SLOPE))
    for draw in (views.height, views.residual, views.phase, views.interferogram):
        one, other = (draw(map, 1 * um).images[0] for map in (hidden, unknown))
        assert np.array_equal(one.get_array().mask, other.get_array().mask)
        assert one.get_clim() == other.get_clim()


def test_masked_numbers_are_refused_where_all_are_needed():
    corners = np.ma.array([[0.0, 0, 0], [1, 0, 0], [0, 1, JUNK]], mask=[[0, 0, 0], [0, 0, 0], [0, 0, 1]])
    with pytest.raises(ValueError, match="vertices: expected finite numbers, got NaN or infinity in 1 of 3"):
        ft.Mesh(corners, [[0, 1, 2]])
    with pytest.raises(ValueError, match="faces: expected whole triangles, got 1 masked corners"):
        ft.Mesh(corners.data, np.ma.array([[0, 1, 2]], mask=[[0, 0, 1]]))
    with pytest.raises(ValueError, match="Rays origin"):
        ft.Rays(corners, np.ones((3, 3)))
    with pytest.raises(ValueError, match="Rays amplitude: expected finite numbers"):
        ft.Rays(corners.data, np.ones((3, 3)), amplitude=np.ma.array([1.0, 1, 1], mask=[0, 1, 0]))
    with pytest.raises(ValueError, match="Beam centre: expected finite numbers"):
        ft.Beam(np.ma.array([0.0, 0, 0], mask=[0, 0, 1]), (0, 0, -1), (0, 1, 0), (1 * mm, 1 * mm), (3, 3))
    with pytest.raises(ValueError, match="Spectrum weights: expected numbers"):
        Spectrum([500 * nm, 600 * nm], np.ma.array([1.0, 1.0], mask=[0, 1]))
    at = colour.resolving_wavelengths()
    with pytest.raises(ValueError, match="reflectance: expected finite numbers, got 1 others"):
        colour.xyz(np.ma.array(np.ones(len(at)), mask=np.arange(len(at)) == 3), at)


def test_filled_copies_nothing_that_is_whole():
    assert filled(SLOPE) is SLOPE
    whole = np.ma.array(SLOPE)
    assert np.shares_memory(filled(whole), SLOPE)
