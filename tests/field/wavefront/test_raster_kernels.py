"""Compiled rasterisation: polynomials of cells, their leaves, and phases at any number of wavelengths."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.polynomial import polynomial

from fringetrace.field.wavefront import raster_kernels as raster

seeds = st.integers(0, 2**32 - 1)
# Sums of 16 terms of size 1, each some roundings.
ROUNDED = 1e-14
# Phase of a path of 1e9 wavelengths: roundings of cos, sin and of the remainder over the period.
PHASE = 1e-14


def cells_of(x, y):
    """Cells (n, 6, 4, 4) whose fields 0 and 1 have such coefficients of s^i t^j."""
    cells = np.zeros((1, 6, 4, 4))
    for field, terms in enumerate((x, y)):
        for (i, j), value in terms.items():
            cells[0, field, i, j] = value
    return cells


def leaves_of(cells, shape=(100, 100)):
    whole = np.tile([0.0, 1.0, 0.0, 1.0], (len(cells), 1))
    return raster.split_cells(cells, whole, np.zeros((len(cells), 3)), *shape)


@given(seed=seeds)
def test_a_cell_is_its_polynomial(seed):
    rng = np.random.default_rng(seed)
    cells, (s, t) = rng.uniform(-1, 1, (3, 6, 4, 4)), rng.uniform(0, 1, 2)
    cell, field = int(rng.integers(3)), int(rng.integers(6))
    c = cells[cell, field]
    expected = (
        polynomial.polyval2d(s, t, c),
        polynomial.polyval2d(s, t, polynomial.polyder(c, axis=0)),
        polynomial.polyval2d(s, t, polynomial.polyder(c, axis=1)),
    )
    np.testing.assert_allclose(raster.patch(cells, cell, field, s, t), expected, rtol=0, atol=ROUNDED)
    assert raster.scalar(cells, cell, field, s, t) == pytest.approx(expected[0], abs=ROUNDED)


@given(seed=seeds)
def test_the_gradient_of_a_path_is_that_on_the_ccd(seed):
    """W = a X + b Y has the gradient (a, b), whatever the cell does."""
    rng = np.random.default_rng(seed)
    cells = cells_of({(1, 0): 3.0, (0, 1): 0.5}, {(1, 0): -0.3, (0, 1): 2.0})
    cells[0, :2] += rng.uniform(-0.02, 0.02, (2, 4, 4))
    a, b = rng.uniform(-1, 1, 2)
    cells[0, 2] = a * cells[0, 0] + b * cells[0, 1]
    found = raster.gradient(cells, 0, *rng.uniform(0, 1, 2))
    np.testing.assert_allclose(found, (a, b), rtol=0, atol=10 * ROUNDED)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_even_cell_is_one_leaf_around_its_corners(sign):
    cells = cells_of({(0, 0): 20.0, (1, 0): 5.0, (0, 1): 1.0}, {(0, 0): 30.0, (0, 1): sign * 4.0})
    (leaf,) = leaves_of(cells)
    assert leaf[raster.SIGN] == sign
    np.testing.assert_array_equal(leaf[[raster.S0, raster.S1, raster.T0, raster.T1]], [0, 1, 0, 1])
    assert leaf[raster.LEFT] < 20.0
    assert leaf[raster.RIGHT] > 26.0
    low, high = sorted((30.0, 30.0 + sign * 4.0))
    assert leaf[raster.LOW] < low
    assert leaf[raster.HIGH] > high


@pytest.mark.parametrize("corner", [(-30.0, 30.0), (130.0, 30.0), (30.0, -30.0), (30.0, 130.0)])
def test_a_cell_beside_the_ccd_has_no_leaves(corner):
    cells = cells_of({(0, 0): corner[0], (1, 0): 5.0}, {(0, 0): corner[1], (0, 1): 4.0})
    assert len(leaves_of(cells)) == 0


def test_leaves_of_a_fold_cover_it_once_and_lie_on_either_side():
    """X = 40 (s - 0.3)^2: the Jacobian changes sign at s = 0.3."""
    cells = cells_of({(0, 0): 3.6 + 20, (1, 0): -24.0, (2, 0): 40.0}, {(0, 0): 20.0, (0, 1): 10.0})
    leaves = leaves_of(cells)
    area = (leaves[:, raster.S1] - leaves[:, raster.S0]) * (leaves[:, raster.T1] - leaves[:, raster.T0])
    assert area.sum() == 1.0
    assert set(leaves[:, raster.SIGN]) == {-1.0, 0.0, 1.0}
    assert (leaves[leaves[:, raster.SIGN] < 0.0, raster.S1] <= 0.3).all()
    assert (leaves[leaves[:, raster.SIGN] > 0.0, raster.S0] >= 0.3).all()
    fold = leaves[leaves[:, raster.SIGN] == 0.0]
    assert ((fold[:, raster.S0] <= 0.3) & (fold[:, raster.S1] >= 0.3)).all()
    assert (fold[:, raster.S1] - fold[:, raster.S0]).max() == 2.0**-raster.DEPTH


@given(seed=seeds)
def test_phases_of_many_wavelengths_are_exact(seed):
    """Beside fractions: the remainder of a path is exact from none to far beyond 2^26 wavelengths."""
    rng = np.random.default_rng(seed)
    period = rng.uniform(0.3e-6, 1e-6)
    ways = np.concatenate([[0.0, period], period * 10.0 ** rng.uniform(-1, 9, 20)])
    rows = np.zeros((len(ways), 4))
    rows[:, 0], rows[:, 1], rows[:, 2] = np.arange(len(ways)), ways, 1.0
    field = np.zeros((1, len(ways)), dtype=np.complex128)
    begin, group = np.array([0, len(ways)]), np.array([0])
    raster.add_waves(rows, begin, 0, period, group, np.array([1.0 + 0.0j]), field)
    rest = [float(Fraction(way) / Fraction(period) % 1) for way in ways]
    np.testing.assert_allclose(field[0], np.exp(2j * np.pi * np.array(rest)), rtol=0, atol=PHASE)


def test_waves_of_one_group_add_up():
    rows = np.array([[0, 0.0, 1.0, 0.0], [1, 0.25, 1.0, 0.0], [0, 0.5, 2.0, 0.0]])
    field = np.zeros((2, 2), dtype=np.complex128)
    raster.add_waves(rows, np.array([0, 2, 3]), 0, 1.0, np.array([1, 1]), np.array([1.0, 1j]), field)
    np.testing.assert_allclose(field, [[0, 0], [1 - 2j, 1j]], atol=1e-15)
