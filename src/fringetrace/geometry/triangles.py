"""Geometry of bare triangles: polygon triangulation, height above a point."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fringetrace.core import FloatArray
from fringetrace.geometry.mesh import Mesh
from fringetrace.geometry.topology import IndexArray, connected

# A point may stand this part of a triangle outside it, for the rounding of its coordinates.
EDGE = 1e-9
# Seen from above a wall has no area: less than this part of its longest side squared.
WALL = 1e-12
# Pairs of point and triangle that are compared at a time; bounds the memory.
PAIRS = 1 << 17


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Last component of the cross product of plane vectors, (..., 2) each."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def doubled_area(polygon: FloatArray) -> float:
    """Doubled signed area of a polygon (k, 2), positive if counter-clockwise."""
    spokes = polygon - polygon[0]
    return float(_cross(spokes, np.roll(spokes, -1, axis=0)).sum())


def self_crossing(polygon: FloatArray) -> tuple[int, int] | None:
    """Pair of sides at which a closed polygon intersects itself.

    Parameters
    ----------
    polygon : (k, 2) float64
        Side i goes from corner i to corner i + 1, the last one back to corner 0.

    Returns
    -------
    (i, j) or None
        Sides that cross or touch, or neighbours that fold back; None for a simple polygon.
    """
    count = len(polygon)
    start, end = polygon, np.roll(polygon, -1, axis=0)
    along = end - start
    onward = np.roll(along, -1, axis=0)
    folds = (_cross(along, onward) == 0.0) & ((along * onward).sum(axis=1) < 0.0)
    if folds.any():
        i = int(np.argmax(folds))
        return i, (i + 1) % count
    for i in range(count - 2):
        others = slice(i + 2, count - 1 if i == 0 else count)
        a, b, c, d = start[i], end[i], start[others], end[others]
        apart = (np.minimum(a, b) > np.maximum(c, d)) | (np.maximum(a, b) < np.minimum(c, d))
        across = np.sign(_cross(b - a, c - a)) * np.sign(_cross(b - a, d - a)) <= 0.0
        back = np.sign(_cross(d - c, a - c)) * np.sign(_cross(d - c, b - c)) <= 0.0
        meets = across & back & ~apart.any(axis=1)
        if meets.any():
            return i, i + 2 + int(np.argmax(meets))
    return None


def _is_ear(ring: IndexArray, polygon: FloatArray, k: int) -> bool:
    """Whether the corner at place k of the ring turns left and its triangle holds no other corner."""
    here = np.array([k - 1, k, (k + 1) % len(ring)])
    corners = polygon[ring[here]]
    sides = np.roll(corners, -1, axis=0) - corners
    least = WALL * (sides**2).sum(axis=1).max()
    if not _cross(sides[0], sides[1]) > least:
        return False
    others = polygon[np.delete(ring, here)]
    left = _cross(sides[:, None], others - corners[:, None])
    return not (left >= -least).all(axis=0).any()


def triangulate(polygon: FloatArray) -> IndexArray:
    """Triangulate a simple polygon by ear clipping (Meisters 1975).

    Parameters
    ----------
    polygon : (k, 2) float64
        Corners, either way round; some may lie on a straight side.

    Returns
    -------
    (k - 2, 3) int64
        Counter-clockwise; each side of the polygon is a side of one triangle.

    Raises
    ------
    ValueError
        If no ear is left, which does not happen for a simple polygon with an area.
    """
    ring = np.arange(len(polygon))
    if doubled_area(polygon) < 0.0:
        ring = ring[::-1]
    triangles = []
    place = 0
    while len(ring) > 2:
        places = (place + np.arange(len(ring))) % len(ring)
        ear = next((int(k) for k in places if _is_ear(ring, polygon, int(k))), None)
        if ear is None:
            raise ValueError(f"polygon: expected one with an area, got {len(ring)} corners that enclose none")
        triangles.append((ring[ear - 1], ring[ear], ring[(ear + 1) % len(ring)]))
        ring = np.delete(ring, ear)
        place = ear + 1  # passing over the next corner keeps the triangles stout
    return np.array(triangles, dtype=np.int64)


def _batches(counts: IndexArray) -> Iterator[slice]:
    """Runs of items whose counts add up to PAIRS or less, at least one item each."""
    total = np.cumsum(counts)
    start = 0
    while start < len(counts):
        done = total[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(total, done + PAIRS, side="right")))
        yield slice(start, stop)
        start = stop


def _ranges(first: IndexArray, counts: IndexArray) -> tuple[IndexArray, IndexArray]:
    """Whole numbers first[i] ... first[i] + counts[i] - 1 of all i in a row, and the i of each."""
    owner = np.repeat(np.arange(len(counts)), counts)
    step = np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]
    return first[owner] + step, owner


def _weights(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Barycentric weights (n, 3) of points (n, 2) in triangles (n, 3, 2), exact at corners."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    parts = np.stack(
        [_cross(c - b, points - b), _cross(a - c, points - c), _cross(b - a, points - a)], axis=1
    )
    return np.asarray(parts / parts.sum(axis=1, keepdims=True))


def _lying(corners: FloatArray) -> FloatArray:
    """The triangles (f, 3, 3) that are not seen edge on from above."""
    sides = np.roll(corners[:, :, :2], -1, axis=1) - corners[:, :, :2]
    area = np.abs(_cross(sides[:, 0], sides[:, 1]))
    return np.asarray(corners[area > WALL * (sides**2).sum(axis=2).max(axis=1)])


def height_above(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Height of the topmost triangle at each point of the x-y plane.

    The points are sorted into rows and, in each, by x; what a triangle may cover is then one
    run of points in each row that it reaches.

    Parameters
    ----------
    corners : (f, 3, 3) float64
        x, y, z of the corners of each triangle. Those that stand upright are passed over.
    points : (n, 2) float64, finite

    Returns
    -------
    (n,) float64
        Linear within each triangle; NaN where there is none.
    """
    height = np.full(len(points), -np.inf)
    origin, farthest = points.min(axis=0), points.max(axis=0)
    corners = _lying(corners)
    lower, upper = corners[:, :, :2].min(axis=1), corners[:, :, :2].max(axis=1)
    slack = EDGE * (upper - lower)
    near = (upper + slack >= origin).all(axis=1) & (lower - slack <= farthest).all(axis=1)
    corners, lower, upper = corners[near], (lower - slack)[near], (upper + slack)[near]

    rows = np.ceil(np.sqrt(len(points)))
    scale = np.array([1.0, rows]) / (float((farthest - origin).max()) or 1.0)
    place = (points - origin) * scale
    key = 2.0 * np.floor(place[:, 1]) + place[:, 0]
    order = np.argsort(key)
    key = key[order]
    low = np.clip((lower - origin) * scale, 0.0, [1.0, rows])
    high = np.clip((upper - origin) * scale, 0.0, [1.0, rows])
    bottom = np.floor(low[:, 1]).astype(np.int64)
    reached = np.floor(high[:, 1]).astype(np.int64) - bottom + 1
    for part in _batches(reached):
        row, triangle = _ranges(bottom[part], reached[part])
        triangle += part.start
        first = np.searchsorted(key, 2.0 * row + low[triangle, 0], side="left")
        count = np.searchsorted(key, 2.0 * row + high[triangle, 0], side="right") - first
        for run in _batches(count):
            position, owner = _ranges(first[run], count[run])
            point, corner = order[position], corners[triangle[run][owner]]
            weights = _weights(corner[:, :, :2], points[point])
            inside = (weights >= -EDGE).all(axis=1)
            z = (weights * corner[:, :, 2]).sum(axis=1)
            np.maximum.at(height, point[inside], z[inside])
    return np.where(np.isneginf(height), np.nan, height)


def breadth(mesh: Mesh) -> float:
    """Breadth of the smallest connected part of a mesh: second largest extent along x, y, z, metres.

    Of rods their diameter; of plates and reliefs, however shallow, a side.
    """
    part = connected(mesh.topology.faces)
    order = np.argsort(part, kind="stable")
    first, corners = np.flatnonzero(np.diff(part[order], prepend=-1)), mesh.corners[order]
    lower = np.minimum.reduceat(corners.min(axis=1), first)
    second = np.sort(np.maximum.reduceat(corners.max(axis=1), first) - lower, axis=1)[:, 1]
    return float(second[second > 0.0].min())
