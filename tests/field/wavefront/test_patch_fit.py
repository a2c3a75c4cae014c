"""Patches by least squares: places inside what is lit, polynomials found again, patches that are none."""

import math

import numpy as np
import pytest

from fringetrace.field.wavefront import patch_fit
from fringetrace.field.wavefront.patches import Arrivals
from fringetrace.field.wavefront.quadtree import Pieces

# Least squares of 64 rays on polynomials of degree 3: some hundred roundings.
ROUNDING = 1e-10
NONE = np.full((2, 2), np.nan)


def pieces(*parts):
    """Pieces (low, high, chord or None) of as many cells."""
    low, high, chord = zip(*parts, strict=True)
    count = len(parts)
    chords = np.array([NONE if one is None else one for one in chord], dtype=float)
    return Pieces(
        np.zeros(count, dtype=np.int64), np.arange(count), np.array(low, float), np.array(high, float), chords
    )


WHOLE = ((2, 3), (3, 4), None)
# lit to the left of a chord that goes up: left of x = 0.4
LEFT = ((0, 0), (1, 1), [(0.4, 0.0), (0.4, 1.0)])
# lit above a slanted chord
ABOVE = ((5, 5), (6, 6), [(5.0, 5.2), (6.0, 5.7)])


def polynomial(at, low, high):
    """x, y, W, and their rays, as arrivals: cubics of the place in a patch."""
    s, t = np.moveaxis((at - low[:, None]) / (high - low)[:, None], -1, 0)
    x = 10 + 5 * s + 0.3 * s**2 * t
    y = 20 + 4 * t - 0.2 * s * t**2
    w = 1e-3 * s * t + 2e-3 * s**3
    zero = np.zeros(x.size)
    direction = np.tile([0.0, 0.0, -1.0], (x.size, 1))
    return Arrivals(x.ravel(), y.ravel(), zero, zero, w.ravel() + 7.0, None, direction, zero)


def test_places_lie_in_what_is_lit_and_fill_it():
    some = pieces(WHOLE, LEFT, ABOVE)
    at, low, high = patch_fit.places(some, np.arange(3), 3)
    assert at.shape == (3, patch_fit.RAYS, 2)
    assert low == pytest.approx(np.array([[2, 3], [0, 0], [5, 5.2]]))
    assert high == pytest.approx(np.array([[3, 4], [0.4, 1], [6, 6]]))
    assert ((at >= low[:, None]) & (at <= high[:, None])).all()
    assert (at[1, :, 0] < 0.4).all()
    assert (at[2, :, 1] > 5.2 + 0.5 * (at[2, :, 0] - 5)).all()
    # as many in either half of the cell
    assert abs((at[0, :, 0] > 2.5).sum() - patch_fit.RAYS / 2) <= 2
    assert abs((at[0, :, 1] > 3.5).sum() - patch_fit.RAYS / 2) <= 2


def test_pieces_of_one_patch_share_its_places():
    both = pieces(((0, 0), (0.5, 1), None), ((0.5, 0), (1, 0.5), None))
    at, low, high = patch_fit.places(both, np.zeros(2, dtype=int), 1)
    assert (low, high) == (pytest.approx(np.zeros((1, 2))), pytest.approx(np.ones((1, 2))))
    right = at[0, :, 0] > 0.5
    assert right.mean() == pytest.approx(1 / 3, abs=1 / patch_fit.RAYS)
    assert (at[0, right, 1] < 0.5).all()


def fitted(some, lost=(), shape=(40, 40), arrived=None):
    at, low, high = patch_fit.places(some, np.arange(len(some.low)), len(some.low))
    arrivals = polynomial(at, low, high) if arrived is None else arrived
    ray = np.delete(np.arange(at.shape[0] * patch_fit.RAYS), list(lost))
    kept = Arrivals(
        arrivals.x[ray], arrivals.y[ray], arrivals.slope_x[ray], arrivals.slope_y[ray], arrivals.length[ray],
        None, arrivals.direction[ray], arrivals.last[ray],
    )  # fmt: skip
    result = patch_fit.fitted(at, low, high, ray, kept, np.full((len(ray), 1), 2.0 + 0j), 7.0, shape)
    return at, low, high, *result


def test_a_cubic_is_found_again():
    some = pieces(WHOLE, LEFT)
    *_, coefficients, turns, good, off = fitted(some)
    assert good.all()
    assert off.max() < ROUNDING
    assert (turns == 0).all()
    x, y, w = (np.zeros((4, 4)) for _ in range(3))
    x[0, 0], x[1, 0], x[2, 1] = 10, 5, 0.3
    y[0, 0], y[0, 1], y[1, 2] = 20, 4, -0.2
    w[1, 1], w[3, 0] = 1e-3, 2e-3
    for found, expected in zip(coefficients[0, :3], (x, y, w), strict=True):
        assert found == pytest.approx(expected, abs=ROUNDING)
    # the amplitude is that of the part of a cell: the Jacobian is by s and t of the patch
    assert coefficients[0, 4, 0, 0] == pytest.approx(2.0)
    assert coefficients[1, 4, 0, 0] == pytest.approx(2.0 * math.sqrt(0.4))
    assert coefficients[:, 3, 0, 0] == pytest.approx([20.0, 20.0], rel=1e-6)


def test_rays_that_are_lost_do_not_matter_until_too_few_are_left():
    some = pieces(WHOLE)
    few = range(patch_fit.RAYS - patch_fit.FEWEST + 1)
    *_, good, off = fitted(some, lost=range(30))
    assert good.all()
    assert off.max() < ROUNDING
    *_, good, off = fitted(some, lost=few)
    assert not good.any()


def test_patches_far_from_the_ccd_are_left_out():
    assert fitted(pieces(WHOLE))[5].all()
    assert not fitted(pieces(WHOLE), shape=(40, 5))[5].any()
    assert not fitted(pieces(WHOLE), shape=(10, 40))[5].any()


def test_what_is_no_cubic_tells():
    at, low, high = patch_fit.places(pieces(WHOLE), np.arange(1), 1)
    arrived = polynomial(at, low, high)
    arrived.x[:] += 0.01 * np.sign(at[0, :, 0] - 2.5)
    *_, good, off = fitted(pieces(WHOLE), arrived=arrived)
    assert good.all()
    assert 1e-3 < off[0] < 0.01


def fit():
    some = pieces(WHOLE, LEFT)
    _, low, high, coefficients, turns, _, _ = fitted(some)
    return patch_fit.PatchFit(some, np.arange(2), coefficients, turns, low, high)


def test_a_fit_knows_its_pieces_on_its_patches():
    one = fit()
    assert one.domain == pytest.approx(np.array([[0, 1, 0, 1]] * 2))
    assert one.place.tolist() == [[3, 2], [-1, -1]]
    a, b, c = one.lines[1]
    assert a * 0.5 + b * 0.5 > c  # all of the patch is left of the chord
    assert one.lines[0].tolist() == [0.0, 0.0, -1.0]
    other = one.where(np.array([False, True]))
    assert other.owner.tolist() == [0]
    assert len(other.coefficients) == len(other.pieces.low) == 1


def test_a_fit_draws_its_lines_a_pixel_long():
    one = fit()
    found = one.pixels(np.array([[2.0, 3.0], [3.0, 4.0]]), np.array([0, 0]))
    assert found == pytest.approx(np.array([[10, 20], [15.3, 23.8]]))
    ends = np.array([[[2.0, 3.0], [3.0, 3.0]]])
    drawn = one.drawn(ends, np.array([0]), 64)
    assert np.hypot(drawn[:, 2] - drawn[:, 0], drawn[:, 3] - drawn[:, 1]).max() < 1 + ROUNDING
    assert len(drawn) in (5, 6)  # five pixels, but for rounding
    assert drawn[0, :2] == pytest.approx([10, 20])
    assert drawn[-1, 2:] == pytest.approx([15, 20])
    assert (drawn[1:, :2] == drawn[:-1, 2:]).all()
    assert len(one.drawn(ends, np.array([0]), 3)) == 3
