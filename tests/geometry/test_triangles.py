"""Bare triangles: polygons cut into them, and heights above points."""

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from fringetrace.geometry import triangles

# Two routes to a height differ by rounding only: some 10 operations on numbers of size 1.
ROUNDING = 1e-12
# Beside an edge rounding decides who owns a point; the oracle looks only at points this far inside.
CLEAR = 1e-6

grid_number = st.integers(-8, 8).map(float)


def star(radii):
    """A polygon seen whole from the origin, so certainly simple; counter-clockwise."""
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    return np.asarray(radii)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def areas(polygon, faces):
    a, b, c = (polygon[faces[:, i]] for i in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def shoelace(polygon):
    x, y = polygon.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(0.2, 3.0), min_size=3, max_size=24), st.booleans())
def test_a_filled_polygon_has_its_area_and_its_sides(radii, clockwise):
    polygon = star(radii)[:: -1 if clockwise else 1]
    assume(not triangles.self_crossing(polygon))  # three or four spokes need not enclose the origin
    faces = triangles.triangulate(polygon)
    assert (areas(polygon, faces) > 0).all()
    assert areas(polygon, faces).sum() == pytest.approx(abs(shoelace(polygon)), rel=ROUNDING)
    sides = {tuple(sorted(side)) for face in faces for side in zip(face, np.roll(face, 1), strict=True)}
    assert {tuple(sorted((i, (i + 1) % len(polygon)))) for i in range(len(polygon))} <= sides


def test_corners_on_a_straight_side_are_used():
    # a square with two more points on each side: a rounding away from it, inwards or outwards
    corner = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    part = np.array([0.0, 1, 2])[:, None] / 3
    polygon = np.concatenate(
        [a + part * (b - a) for a, b in zip(corner, np.roll(corner, -1, 0), strict=True)]
    )
    turned = polygon @ np.array([[0.6, 0.8], [-0.8, 0.6]])
    faces = triangles.triangulate(turned)
    assert faces.shape == (10, 3)
    assert areas(turned, faces).min() > 1 / 100
    assert areas(turned, faces).sum() == pytest.approx(1, rel=ROUNDING)


@pytest.mark.parametrize("turn", [1, -1])
def test_a_polygon_far_from_the_origin_is_filled(turn):
    # so far that products of coordinates no longer tell which way round it goes
    polygon = np.array([(0.0, 0), (4, 0), (1, 1), (0, 4)])[::turn] + 2.0**30
    faces = triangles.triangulate(polygon)
    assert sorted(areas(polygon, faces).tolist()) == [2, 2]


def test_corners_in_a_line_enclose_nothing():
    with pytest.raises(ValueError, match=r"polygon: expected one with an area, got 4 corners"):
        triangles.triangulate(np.array([[0.0, 0], [1, 1], [2, 2], [3, 3]]))


@pytest.mark.parametrize(
    ("polygon", "meeting"),
    [
        ([(0, 0), (2, 2), (2, 0), (0, 2)], (0, 2)),  # bow tie
        ([(0, 0), (4, 0), (4, 4), (2, 0), (0, 4)], (0, 2)),  # a corner touches a side
        ([(0, 0), (2, 0), (1, 0), (1, 2)], (0, 1)),  # folds back on itself
        ([(0, 0), (4, 0), (4, 1), (3, 0), (1, 0), (0, 1)], (0, 2)),  # runs along another side
        ([(0, 0), (2, 0), (0, 0), (0, 2)], (0, 1)),  # out and back
        ([(0, 0), (3, 0), (3, 3), (0, 3)], None),
        ([(0, 0), (1, 0), (2, 0), (2, 2)], None),  # straight on is no fold
        ([(0, 0), (3, 0), (0, 3)], None),
        ([(0, 0), (6, 0), (6, 3), (5, 3), (5, 1), (1, 1), (1, 3), (0, 3)], None),  # level tops, apart
    ],
)
def test_sides_that_meet_are_found(polygon, meeting):
    assert triangles.self_crossing(np.array(polygon, dtype=float)) == meeting


def oracle(corners, point):
    """Topmost height by solving each triangle for its weights, and whether that is clear of edges."""
    best, clear = np.nan, True
    for corner in corners:
        matrix = np.vstack([corner[:, :2].T, np.ones(3)])
        if abs(np.linalg.det(matrix)) < CLEAR:
            continue
        weights = np.linalg.solve(matrix, [*point, 1.0])
        clear &= bool(np.abs(weights).min() > CLEAR)
        if (weights >= 0).all():
            best = np.fmax(best, weights @ corner[:, 2])
    return best, clear


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.float64, st.tuples(st.integers(1, 6), st.just(3), st.just(3)), elements=grid_number),
    arrays(np.float64, st.tuples(st.integers(1, 9), st.just(2)), elements=st.floats(-9, 9, width=16)),
)
def test_height_above_finds_what_solving_every_triangle_finds(corners, points):
    heights = triangles.height_above(corners, points)
    for point, height in zip(points, heights, strict=True):
        expected, clear = oracle(corners, point)
        if clear:
            assert height == pytest.approx(expected, abs=ROUNDING * 8, nan_ok=True)


def test_height_above_is_the_same_in_small_batches(monkeypatch):
    rng = np.random.default_rng(3)
    corners, points = rng.normal(size=(200, 3, 3)), rng.normal(size=(300, 2))
    whole = triangles.height_above(corners, points)
    monkeypatch.setattr(triangles, "PAIRS", 7)
    assert np.array_equal(triangles.height_above(corners, points), whole, equal_nan=True)
    assert 100 < np.isfinite(whole).sum() < 300


def test_points_in_one_row_one_column_or_one_place():
    corners = np.array([[[0.0, 0, 1], [4, 0, 1], [0, 4, 5]]])
    along = np.linspace(-1, 5, 13)
    on = (along >= 0) & (along <= 3)
    row = triangles.height_above(corners, np.stack([along, np.ones(13)], axis=1))
    assert np.array_equal(row, np.where(on, 2.0, np.nan), equal_nan=True)
    column = triangles.height_above(corners, np.stack([np.ones(13), along], axis=1))
    assert column == pytest.approx(np.where(on, 1 + along, np.nan), nan_ok=True)
    assert triangles.height_above(corners, np.array([[1.0, 1.0]])) == pytest.approx(2.0)


def test_points_on_the_rim_count_as_inside():
    corners = np.array([[[0.0, 0, 1], [1, 0, 1], [0, 1, 1]]])
    outside = np.array([0.5, -triangles.EDGE / 2])
    assert triangles.height_above(corners, np.array([outside, outside[::-1]])).tolist() == [1, 1]
    assert np.isnan(triangles.height_above(corners, np.array([[0.5, -2 * triangles.EDGE], [0.5, 1.0]]))).all()
