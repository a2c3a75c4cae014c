"""Tubes of rays: differences on grids with holes, and caustics counted."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fringetrace.field.wavefront import ray_tubes

# Differences of numbers near 1 cancel to a few roundings.
ROUNDING = 1e-12


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-2, 2), min_size=5, max_size=5), st.integers(5, 12), st.integers(0, 1))
def test_differences_of_a_quartic_are_exact(coefficients, count, axis):
    x = np.linspace(-1, 1, count)
    values = np.polyval(coefficients, x)
    grid = np.tile(values[:, None], 3) if axis == 0 else np.tile(values, (3, 1))
    expected = np.polyval(np.polyder(coefficients), x) * (x[1] - x[0])
    found = ray_tubes.differences(grid, axis)
    assert (found if axis == 0 else found.T) == pytest.approx(np.tile(expected[:, None], 3), abs=ROUNDING)


def test_differences_go_up_to_a_hole_and_no_further():
    values = np.arange(14.0) ** 4
    values[8] = np.nan
    found = ray_tubes.differences(values[None], 1)[0]
    assert np.isnan(found[8])
    exact = 4 * np.arange(14.0) ** 3
    long = np.r_[0:8, 9:14]
    assert found[long] == pytest.approx(exact[long], rel=ROUNDING, abs=1e-9)


@pytest.mark.parametrize(("run", "degree"), [(2, 1), (3, 2)])
def test_short_runs_are_differenced_to_lower_order(run, degree):
    values = np.full((1, 9), np.nan)
    at = np.arange(run) + 3.0
    values[0, 3 : 3 + run] = at**degree
    found = ray_tubes.differences(values, 1)[0]
    assert found[3 : 3 + run] == pytest.approx(degree * at ** (degree - 1), abs=ROUNDING)
    assert np.isnan(found[:3]).all()


def test_a_lone_value_has_no_derivative():
    assert np.isnan(ray_tubes.differences(np.array([[np.nan, 1.0, np.nan]]), 1)).all()


def test_along_a_grid_columns_come_first():
    row, column = np.indices((5, 6)).astype(float)
    found = ray_tubes.along_grid(np.stack([3 * column, row - column], axis=-1))
    assert found == pytest.approx(np.broadcast_to([[3.0, -1.0], [0.0, 1.0]], (5, 6, 2, 2)), abs=ROUNDING)


def passed(curve_x, curve_y, reach):
    """Caustics of rays that start on a plane with directions (-curve_x x, -curve_y y, 1)."""
    row, column = np.indices((5, 5)) - 2.0
    start = np.stack([column, row, 0 * row], axis=-1) * 1e-3
    direction = np.stack([-curve_x * start[..., 0], -curve_y * start[..., 1], np.ones_like(row)], axis=-1)
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    way = np.stack([start, start + reach * direction], axis=2)
    return ray_tubes.caustics(way, direction, np.full(row.shape, reach), ray_tubes.along_grid)


@pytest.mark.parametrize(
    ("curves", "reach", "count"),
    [((1, 1), 0.9, 0), ((1, 1), 1.1, 2), ((1, 0.5), 1.5, 1), ((1, 0.5), 2.1, 2), ((-1, -1), 9.0, 0),
     ((-1, -1), -1.1, -2), ((0, 0), 9.0, 0)],
)  # fmt: skip
def test_each_principal_focus_passed_is_a_caustic(curves, reach, count):
    assert (passed(*curves, reach) == count).all()


def test_where_there_is_no_path_there_is_no_caustic():
    nothing = np.full((3, 3, 2, 3), np.nan)
    assert (ray_tubes.caustics(nothing, nothing[:, :, 0], np.zeros((3, 3)), ray_tubes.along_grid) == 0).all()
