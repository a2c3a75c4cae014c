"""Squares of the beam's grid: numbers, neighbours, quarters, and rays that say otherwise."""

import numpy as np
import pytest
from taped import tape, traced

from fringetrace import mm
from fringetrace.field.wavefront import boundary_search, quadtree, visibility


def cells(seen, index=0):
    lit = seen.corners(index)
    row, column = np.nonzero(seen.cells(index))
    low = np.stack([column, row], axis=1).astype(float)
    none = np.zeros(len(row), dtype=np.int64)
    return quadtree.Squares(
        none, row * lit.shape[1] + column, np.full(len(row), 5.0), low, lit[row, column], 1.0
    )


def test_squares_and_pieces_of_them_have_one_number():
    wave = np.array([0, 0, 1, 0])
    at = np.array([[0.5, 0.5], [1.5, 0.5], [0.5, 0.5], [0.5, 1.5]])
    numbers = quadtree.numbers(wave, at, 1.0)
    assert len(np.unique(numbers)) == 4
    assert (quadtree.numbers(wave, at + 0.25, 1.0) == numbers).all()
    assert len(np.unique(quadtree.numbers(wave[:2] * 0, at[:2] * 0 + [[0.2, 0.2], [0.3, 0.2]], 0.25))) == 2


def test_neighbours_touch_and_are_of_the_same_wave():
    low = np.array([[0.0, 0], [1, 1], [2, 2], [0, 0]])
    some = quadtree.Squares(
        np.array([0, 0, 0, 1]), np.zeros(4, int), np.ones(4), low, np.ones((4, 4), bool), 1.0
    )
    assert some.beside(np.array([True, False, False, False])).tolist() == [True, True, False, False]


def test_chords_may_be_off_by_a_part_of_a_pixel_and_of_themselves():
    off = quadtree.allowed(np.array([1.0, 1e-3, 0.0]), np.array([10.0, 10.0, 10.0]), 1.0)
    assert off == pytest.approx([quadtree.PIXEL / 10, quadtree.COARSE * 1e-3, quadtree.STRAIGHT])


def test_quarters_have_the_corners_of_their_square():
    seen = visibility.survey(traced(tape(0.25 * mm, 0.5 * mm)))  # all of the cells from 3 to 4
    whole = cells(seen)
    four = quadtree.quarters(seen.probe, seen.names, whole)
    count = len(whole.low)
    assert four.size == 0.5
    assert len(four.low) == 4 * count
    for quarter, corner in ((0, 0), (1, 1), (3, 2), (2, 3)):
        mine = slice(quarter * count, (quarter + 1) * count)
        assert (four.lit[mine][:, corner] == whole.lit[:, corner]).all()
        assert four.low[mine] == pytest.approx(whole.low + 0.5 * quadtree.CORNERS[corner])
    # corners of quarters within the shadow are dark
    at = four.low[:, None] + 0.5 * quadtree.CORNERS
    assert not four.lit[(at[..., 0] > 3.1) & (at[..., 0] < 3.9)].any()


def test_rays_deny_what_corners_say():
    seen = visibility.survey(traced(tape(0.2 * mm)))
    whole = cells(seen)
    denied = quadtree.denied(seen.probe, seen.names, whole, whole.whole, seen.witnesses)
    assert (whole.low[denied, 0] == 3.0).all()
    assert denied.sum() == 6
    # once they are cut, nothing is left to say
    pieces = boundary_search.cut(seen.probe, seen.names, whole, seen.witnesses)
    assert not quadtree.denied(seen.probe, seen.names, whole, pieces, seen.witnesses).any()


def test_witnesses_who_are_wrong_are_not_believed():
    """Lines between rays are but a guess: rays from there decide."""
    seen = visibility.survey(traced())
    line = visibility.Witnesses(
        np.array([0]), np.array([[0.5, 0.5]]), np.array([[5.5, 0.5]]), np.array([False])
    )
    whole = cells(seen)
    assert not quadtree.denied(seen.probe, seen.names, whole, whole.whole, line).any()
