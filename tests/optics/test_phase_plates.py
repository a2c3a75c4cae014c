"""Phase plates: functions, samples, pixels, folding, and lenses made of them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from meetings import EPS, meeting, power, shower

from fringetrace.optics.phase_plates import PhasePlate, zone_plate

ROUNDING = 64 * EPS
ORIGIN, X, Y = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
seeds = st.integers(0, 2**32 - 1)

# metres per power of metres: some micrometres over a centimetre
CUBIC = np.array(
    [[1e-6, 1e-3, 0.05, 3.0], [2e-3, 0.08, 2.0, 0.0], [0.03, -5.0, 0.0, 0.0], [4.0, 0.0, 0.0, 0.0]]
)


def cubic(x, y):
    return np.polynomial.polynomial.polyval2d(x, y, CUBIC)


def cubic_gradient(x, y):
    d = np.polynomial.polynomial.polyder
    value = np.polynomial.polynomial.polyval2d
    return value(x, y, d(CUBIC, axis=0)), value(x, y, d(CUBIC, axis=1))


def grid(count, pitch):
    return (np.arange(count) - 0.5 * (count - 1)) * pitch


@settings(deadline=None, max_examples=30)
@given(seed=seeds)
def test_maps_are_the_same_however_they_are_given(seed):
    rays = shower(seed, index=1.2)
    x, y = np.meshgrid(grid(9, 2e-3), grid(8, 2e-3))
    plates = [
        PhasePlate(cubic, ORIGIN, X, Y, gradient=cubic_gradient),
        PhasePlate(cubic, ORIGIN, X, Y, pitch=1e-3),  # fourth-order differences know cubics
        PhasePlate(cubic(x, y), ORIGIN, X, Y, pitch=2e-3),  # and so do cubic splines, beyond the samples too
    ]
    (exact,) = plates[0].act(rays)
    assert np.array_equal(exact.path, cubic(rays.point[:, 0], rays.point[:, 1]))
    along = rays.index[:, None] * (exact.direction - rays.direction)[:, :2]
    slope = np.column_stack(cubic_gradient(rays.point[:, 0], rays.point[:, 1]))
    assert np.abs(along - slope).max() < ROUNDING
    for plate in plates[1:]:
        (branch,) = plate.act(rays)
        assert (
            np.abs(branch.path - exact.path).max() < 1e-4 * ROUNDING
        )  # of some micrometres, outside the grid too
        assert np.abs(branch.direction - exact.direction).max() < ROUNDING
        assert np.abs(branch.field - exact.field).max() < 4 * ROUNDING


def test_samples_lie_with_columns_along_x_and_rows_along_y():
    samples = np.arange(12.0).reshape(3, 4) * 1e-7
    plate = PhasePlate(samples, (1.0, 2.0, 0.0), Y, (-1, 0, 0), pitch=1e-3, interpolation="nearest")
    # x is along Y, y along -X
    centres = [(row, column) for row in range(3) for column in range(4)]
    point = [(1.0 - (row - 1) * 1e-3, 2.0 + (column - 1.5) * 1e-3, 0.0) for row, column in centres]
    (branch,) = plate.act(meeting(np.tile((0.1, 0.0, 1.0), (12, 1)), point))
    assert np.array_equal(branch.path, samples.ravel())
    assert branch.direction is None


def test_the_nearest_pixel_goes_on_beyond_the_array():
    plate = PhasePlate([[1e-7, 2e-7]], ORIGIN, X, Y, pitch=1e-3, interpolation="nearest")
    point = [(-5.0, 0.0, 0.0), (-1e-9, 3.0, 0.0), (1e-9, -3.0, 0.0), (1e-3, 0.0, 0.0)]
    (branch,) = plate.act(meeting(np.tile((0.0, 0.0, 1.0), (4, 1)), point))
    assert branch.path.tolist() == [1e-7, 1e-7, 2e-7, 2e-7]


def test_a_modulator_folds_its_path_at_the_design_wavelength():
    samples = np.array([[-0.1, 0.0, 0.4, 1.3, 7.25]]) * 500e-9
    plate = PhasePlate(samples, ORIGIN, X, Y, pitch=1e-3, interpolation="nearest", design=500e-9)
    assert not plate.chromatic
    point = np.column_stack([grid(5, 1e-3), np.zeros((5, 2))])
    (branch,) = plate.act(meeting(np.tile((0.0, 0.0, 1.0), (5, 1)), point))
    assert branch.path / 500e-9 == pytest.approx([0.9, 0.0, 0.4, 0.3, 0.25], abs=ROUNDING)


def test_a_plate_before_a_mirror_sends_light_back():
    rays = shower(3)
    (there,) = PhasePlate(cubic, ORIGIN, X, Y, gradient=cubic_gradient).act(rays)
    (back,) = PhasePlate(cubic, ORIGIN, X, Y, gradient=cubic_gradient, reflects=True).act(rays)
    assert np.abs(back.direction - there.direction * [1, 1, -1]).max() < ROUNDING
    assert np.array_equal(back.path, there.path)
    assert np.abs(back.field + there.field * [1, 1, -1]).max() < 4 * ROUNDING
    flat = PhasePlate([[3e-7]], ORIGIN, X, Y, pitch=1.0, interpolation="nearest", reflects=True)
    (mirrored,) = flat.act(rays)
    assert np.abs(mirrored.direction - rays.direction * [1, 1, -1]).max() < ROUNDING
    assert mirrored.path.tolist() == [3e-7] * 12


def test_what_is_bent_beyond_grazing_is_blocked():
    steep = PhasePlate(lambda x, y: 0.8 * x, ORIGIN, X, Y, gradient=lambda x, y: (0.8 + 0 * x, 0 * y))
    rays = meeting([(0.0, 0.0, 1.0), (0.5, 0.0, 1.0), (-0.5, 0.0, 1.0)])
    (branch,) = steep.act(rays)
    assert power(branch.field).tolist() == [1.0, 0.0, 1.0]


@settings(deadline=None, max_examples=30)
@given(seed=seeds, wavelength=st.floats(400e-9, 700e-9))
def test_a_folded_map_at_other_wavelengths_is_a_blazed_grating(seed, wavelength):
    rays = shower(seed, wavelength=wavelength)
    smooth = PhasePlate(cubic, ORIGIN, X, Y, gradient=cubic_gradient)
    orders = (0, 1, 2)
    folded = replace(smooth, design=550e-9, orders=orders)
    assert folded.chromatic
    for m, branch in zip(orders, folded.act(rays), strict=True):
        scale = m * wavelength / 550e-9
        other = PhasePlate(
            lambda x, y, s=scale: s * cubic(x, y), ORIGIN, X, Y,
            gradient=lambda x, y, s=scale: tuple(s * g for g in cubic_gradient(x, y)),
        ).act(rays)[0]  # fmt: skip
        assert np.abs(branch.direction - other.direction).max() < ROUNDING
        assert np.abs(branch.path - other.path).max() < 1e-4 * ROUNDING
        share = power(branch.field) / power(rays.field)
        assert share == pytest.approx(np.full(12, np.sinc(550e-9 / wavelength - m) ** 2), abs=ROUNDING)


def test_at_its_design_wavelength_folding_does_not_show():
    rays = shower(6, wavelength=550e-9)
    lens = {"centre": ORIGIN, "axis": (0, 0, 1), "focal_length": 0.2, "object_distance": 0.5}
    (folded,) = zone_plate(**lens, design=550e-9).act(rays)
    (plain,) = zone_plate(**lens).act(rays)
    for name in ("field", "direction", "path"):
        assert np.array_equal(getattr(folded, name), getattr(plain, name))


def test_doors_of_the_map():
    with pytest.raises(ValueError, match=r"PhasePlate interpolation: expected one of .*, got 'linear'"):
        PhasePlate(np.zeros((4, 4)), ORIGIN, X, Y, pitch=1.0, interpolation="linear")
    for given_both in ({}, {"pitch": 1e-3, "gradient": cubic_gradient}):
        with pytest.raises(
            ValueError, match="PhasePlate: expected either a gradient or a pitch beside a function"
        ):
            PhasePlate(cubic, ORIGIN, X, Y, **given_both)
    for in_vain in ({}, {"pitch": 1e-3, "gradient": cubic_gradient}):
        with pytest.raises(ValueError, match="PhasePlate: expected a pitch and no gradient beside samples"):
            PhasePlate(np.zeros((4, 4)), ORIGIN, X, Y, **in_vain)
    for bad in (np.zeros(4), np.zeros((0, 4)), np.full((4, 4), np.nan)):
        with pytest.raises(ValueError, match="PhasePlate opd: expected a table of finite metres, got shape"):
            PhasePlate(bad, ORIGIN, X, Y, pitch=1e-3)
    with pytest.raises(ValueError, match=r"PhasePlate opd: expected at least 4 x 4 samples, got \(3, 4\)"):
        PhasePlate(np.zeros((3, 4)), ORIGIN, X, Y, pitch=1e-3)
    with pytest.raises(ValueError, match="PhasePlate pitch: expected a positive length in metres, got 0"):
        PhasePlate(np.zeros((4, 4)), ORIGIN, X, Y, pitch=0)


def test_doors_of_the_plate():
    with pytest.raises(
        ValueError, match=r"PhasePlate orders: expected \(1,\) unless a smooth map is folded, got"
    ):
        PhasePlate(cubic, ORIGIN, X, Y, gradient=cubic_gradient, orders=(0, 1))
    with pytest.raises(ValueError, match="PhasePlate orders: expected different whole numbers, at least one"):
        PhasePlate(cubic, ORIGIN, X, Y, gradient=cubic_gradient, design=5e-7, orders=())
    with pytest.raises(ValueError, match="PhasePlate design: expected a positive length in metres, got -1"):
        PhasePlate(cubic, ORIGIN, X, Y, gradient=cubic_gradient, design=-1)
    with pytest.raises(ValueError, match="PhasePlate up: expected a direction across the normal"):
        PhasePlate(cubic, ORIGIN, X, X, gradient=cubic_gradient)


def test_doors_of_the_zone_plate():
    with pytest.raises(ValueError, match="zone_plate focal length: expected a length other than 0, got 0"):
        zone_plate(ORIGIN, X, 0.0)
    with pytest.raises(ValueError, match="zone_plate focal length: expected a finite number, got nan"):
        zone_plate(ORIGIN, X, math.nan)
    for bad in (0.0, math.nan):
        with pytest.raises(
            ValueError, match="zone_plate object distance: expected a length other than 0, got"
        ):
            zone_plate(ORIGIN, X, 0.1, bad)
    with pytest.raises(ValueError, match="zone_plate index: expected a positive number, got 0"):
        zone_plate(ORIGIN, X, 0.1, index=0)
