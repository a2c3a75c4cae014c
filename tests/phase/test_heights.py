"""Unwrapping, heights, two wavelengths, planes: the interface, the edges, and every refusal."""

import math

import numpy as np
import pytest
from angles import turned
from hypothesis import given, settings, strategies as st

from fringetrace import nm, phase


@settings(max_examples=200, deadline=None)
@given(st.floats(-1e4, 1e4))
def test_wrap(angle):
    wrapped = float(phase.wrap(angle))
    assert -math.pi < wrapped <= math.pi
    # np.angle(np.exp) loses a unit in the last place of the unwrapped angle
    assert turned(wrapped - angle) <= 1e-15 + 2e-16 * abs(angle)


@settings(deadline=None)
@given(st.floats(-math.pi, math.pi, exclude_min=True))
def test_wrap_leaves_wrapped_phases_alone(angle):
    assert phase.wrap(angle) == angle


def test_wrap_at_its_edges():
    below = math.nextafter(math.pi, 0.0)
    found = phase.wrap([math.pi, -math.pi, -below, below, 3 * math.pi, np.nan, 2 * math.pi])
    np.testing.assert_array_equal(found[:4], [math.pi, math.pi, -below, below])
    assert turned(found[4] - math.pi) < 1e-15
    assert np.isnan(found[5])
    assert found[6] == 0.0


def bump(peak, shape=(60, 50), width=12.0):
    rows, columns = np.indices(shape)
    r2 = (rows - 0.5 * shape[0]) ** 2 + (columns - 0.5 * shape[1]) ** 2
    return peak * np.exp(-0.5 * r2 / width**2)


# Whole turns are added to a phase of up to some tens of radians: a few units in its last place.
TURNS = 1e-13


def whole_turns(difference):
    """The one number of turns that the whole of a map is off by."""
    turns = difference / (2.0 * math.pi)
    assert np.abs(turns - np.rint(turns)).max() < TURNS
    assert np.ptp(np.rint(turns)) == 0.0
    return float(np.rint(turns).flat[0])


def test_unwrap_keeps_the_piston_near_zero():
    true = bump(20.0)
    found = phase.unwrap(phase.wrap(true))
    whole_turns(found - true)
    assert abs(found.mean()) <= math.pi


def test_unwrap_leaves_a_continuous_map_alone():
    true = phase.remove_mean(bump(3.0))
    assert whole_turns(phase.unwrap(true) - true) == 0.0


def test_unwrap_accepts_phases_outside_a_turn():
    true = bump(20.0)
    np.testing.assert_allclose(
        phase.unwrap(true + 14.0), phase.unwrap(phase.wrap(true + 14.0)), rtol=0, atol=TURNS * 7
    )


def test_unwrap_around_holes_and_masks():
    true = bump(20.0)
    row, column = np.indices(true.shape)
    holes = (row % 4 == 1) & (column % 3 == 1) | (np.hypot(row - 20, column - 30) < 6)
    wrapped = phase.wrap(true)
    found = phase.unwrap(np.where(holes, np.nan, wrapped))
    assert np.isnan(found[holes]).all()
    whole_turns((found - true)[~holes])
    np.testing.assert_array_equal(phase.unwrap(np.where(holes, 1e5, wrapped), mask=holes), found)
    np.testing.assert_array_equal(phase.unwrap(np.where(holes, np.inf, wrapped)), found)


def test_unwrap_joins_separate_regions_by_the_nearest_turn():
    true = np.zeros((20, 41))
    true[:, 21:] = 2.5  # a step that is within half a turn
    wrapped = phase.wrap(true + 3.0)  # 3 and -0.78: another turn each
    wrapped[:, 20] = np.nan
    found = phase.unwrap(wrapped)
    np.testing.assert_allclose(found[:, 21:] - found[:, 20 - 1 :: -1], 2.5, rtol=0, atol=1e-14)
    assert abs(np.nanmean(found[:, :20])) <= math.pi


def test_unwrap_is_deterministic():
    noisy = np.random.default_rng(4).uniform(-math.pi, math.pi, (40, 40))  # a different way at every start
    np.testing.assert_array_equal(phase.unwrap(noisy), phase.unwrap(noisy))


@pytest.mark.parametrize("shape", [(1, 80), (80, 1), (1, 1), (2, 40), (1, 2)])
def test_unwrap_of_thin_maps(shape):
    row, column = np.indices(shape)
    true = 1.3 * (row + column)
    found = phase.unwrap(phase.wrap(true))
    assert found.shape == shape
    whole_turns(found - true)


def test_unwrap_of_a_line_with_a_gap():
    true = np.linspace(0.0, 30.0, 60)[None, :]
    wrapped = phase.wrap(true)
    wrapped[0, 40] = np.nan
    found = phase.unwrap(wrapped)
    whole_turns((found - true)[:, :40])
    whole_turns((found - true)[:, 41:])


MAPS = pytest.mark.parametrize("function", [phase.unwrap, phase.remove_mean, phase.remove_plane])


@MAPS
def test_maps_are_two_dimensional(function):
    with pytest.raises(
        ValueError, match=rf"{function.__name__}: expected a map of shape .* got shape \(5,\)"
    ):
        function(np.zeros(5))


@MAPS
def test_masks_fit_their_maps(function):
    with pytest.raises(ValueError, match=rf"{function.__name__} mask: expected shape \(4, 5\), got \(5, 4\)"):
        function(np.zeros((4, 5)), mask=np.zeros((5, 4), dtype=bool))


@MAPS
def test_maps_without_a_valid_pixel_are_refused(function):
    message = rf"{function.__name__}: expected at least one valid pixel, got none of 20"
    with pytest.raises(ValueError, match=message):
        function(np.full((4, 5), np.nan))
    with pytest.raises(ValueError, match=message):
        function(np.zeros((4, 5)), mask=np.ones((4, 5), dtype=bool))


@settings(max_examples=50, deadline=None)
@given(
    st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.integers(1, 12), st.integers(1, 12)
)
def test_remove_plane_leaves_nothing_of_a_plane(piston, row_slope, column_slope, rows, columns):
    row, column = np.indices((rows, columns))
    plane = piston + row_slope * row + column_slope * column
    assert np.abs(phase.remove_plane(plane)).max() <= 1e-12 * (1.0 + np.abs(plane).max())


def test_remove_plane_fits_valid_pixels_only_and_shows_the_rest():
    row, column = np.indices((30, 40))
    plane = 3.0 + 0.5 * row - 0.25 * column
    map_ = plane.copy()
    map_[5:10, 5:10] += 7.0
    map_[20, 20] = np.nan
    mask = np.zeros(map_.shape, dtype=bool)
    mask[5:10, 5:10] = True
    flat = phase.remove_plane(map_, mask)
    expected = np.where(mask, 7.0, 0.0)
    expected[20, 20] = np.nan
    np.testing.assert_allclose(flat, expected, rtol=0, atol=1e-12)


def test_remove_plane_is_least_squares():
    map_ = np.random.default_rng(7).standard_normal((20, 30))
    flat = phase.remove_plane(map_)
    row, column = np.indices(map_.shape)
    # what is left is orthogonal to everything that was taken away: 600 pixels, 30 columns, eps
    for part in (np.ones(map_.shape), row, column):
        assert abs((flat * part).sum()) < 1e-10


def test_remove_mean():
    map_ = np.array([[1.0, 2.0], [6.0, np.nan]])
    np.testing.assert_array_equal(phase.remove_mean(map_), map_ - 3.0)
    np.testing.assert_array_equal(phase.remove_mean(map_, map_ > 5.0), map_ - 1.5)


def test_inputs_are_left_alone():
    map_ = bump(20.0)
    map_[3, 3] = np.nan
    kept = map_.copy()
    for function in (phase.unwrap, phase.remove_mean, phase.remove_plane, phase.wrap):
        function(map_)
    np.testing.assert_array_equal(map_, kept)


def test_height():
    assert phase.height(2.0 * math.pi, 633 * nm) == pytest.approx(316.5 * nm, rel=1e-15, abs=0.0)
    assert phase.height(np.zeros((3, 4)), 633 * nm).shape == (3, 4)
    assert np.isnan(phase.height(np.nan, 633 * nm))


@pytest.mark.parametrize("wavelength", [0.0, -1e-9, np.nan, np.inf])
def test_wavelengths_are_checked(wavelength):
    for call in (
        lambda: phase.height(1.0, wavelength),
        lambda: phase.synthetic_wavelength(wavelength, 633 * nm),
        lambda: phase.synthetic_wavelength(633 * nm, wavelength),
        lambda: phase.two_wavelength(1.0, 1.0, wavelength, 633 * nm),
    ):
        with pytest.raises(ValueError, match="wavelength: expected a positive length in metres"):
            call()


def test_equal_wavelengths_have_no_beat():
    with pytest.raises(
        ValueError, match=r"synthetic wavelength: expected two different .* got 6\.33e-07 m twice"
    ):
        phase.synthetic_wavelength(633 * nm, 633 * nm)
    with pytest.raises(ValueError, match="synthetic wavelength: expected two different"):
        phase.two_wavelength(0.0, 0.0, 633 * nm, 633 * nm)
