"""Shapes: meshes of plates, steps, height maps, extrusions, spheres, corner cubes and rod lattices.

Everything built is a `fringetrace.geometry.mesh.Mesh` in metres, welded.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, checked_length, filled, unit
from fringetrace.geometry.mesh import Mesh
from fringetrace.geometry.topology import IndexArray, weld
from fringetrace.geometry.triangles import doubled_area, self_crossing, triangulate

_G = 0.5 + math.sqrt(1.25)  # golden ratio
# fmt: off
ICOSAHEDRON = np.array([
    [-1, _G, 0], [1, _G, 0], [-1, -_G, 0], [1, -_G, 0], [0, -1, _G], [0, 1, _G],
    [0, -1, -_G], [0, 1, -_G], [_G, 0, -1], [_G, 0, 1], [-_G, 0, -1], [-_G, 0, 1],
])
ICOSAHEDRON_FACES = np.array([
    [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4],
    [11, 10, 2], [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8],
    [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1],
])
# fmt: on


def _checked_count(value: int, what: str, least: int) -> int:
    if not isinstance(value, (int, np.integer)) or value < least:
        raise ValueError(f"{what}: expected a whole number from {least}, got {value!r}")
    return int(value)


def _checked_rise(value: float, what: str) -> float:
    if not (math.isfinite(value) and value != 0.0):
        raise ValueError(f"{what}: expected a length in metres other than 0, got {value!r}")
    return value


def _checked_pitch(pitch: float | tuple[float, float], what: str) -> tuple[float, float]:
    both = tuple(pitch) if isinstance(pitch, (tuple, list)) else (pitch, pitch)
    if len(both) != 2:
        raise ValueError(f"{what}: expected one length or two, got {len(both)}")
    return checked_length(both[0], what), checked_length(both[1], what)


def height_map(z: npt.ArrayLike, pitch: float | tuple[float, float], *, name: str = "height map") -> Mesh:
    """Mesh of a height map on a grid, centred on the z axis; its front is +z.

    Four neighbouring samples make two triangles, cut from the first to the last of them; where
    one is missing the other three make one. Triangles come cell by cell, row by row; vertices
    are the valid samples in the order of the array.

    Parameters
    ----------
    z : (rows, columns) float64, metres
        NaN, or masked as in numpy.ma: a hole.
    pitch : float, or (along x, along y), metres
        Distance of neighbouring samples.
    name : str
        For messages.

    Returns
    -------
    Mesh

    Raises
    ------
    ValueError
        If there are fewer than 2 x 2 samples or no three valid neighbours, or a pitch is not positive.
    """
    heights = filled(z)
    if heights.ndim != 2 or min(heights.shape) < 2:
        raise ValueError(f"{name}: expected 2 x 2 samples or more, got shape {heights.shape}")
    pitch_x, pitch_y = _checked_pitch(pitch, f"{name} pitch")
    rows, columns = heights.shape
    x = (np.arange(columns) - 0.5 * (columns - 1)) * pitch_x
    y = (np.arange(rows) - 0.5 * (rows - 1)) * pitch_y
    valid = ~np.isnan(heights)
    vertices = np.stack([*np.meshgrid(x, y), heights], axis=-1)[valid]
    number = (np.cumsum(valid) - 1).reshape(rows, columns)
    corners, there = _cells(number), _cells(valid)
    # corners 0 1 2 3 counter-clockwise; the cut 0-2 turns to 1-3 where 0 or 2 is missing
    one = np.where(there[:, :1], np.where(there[:, 2:3], (0, 1, 2), (0, 1, 3)), (1, 2, 3))
    picks = np.stack([one, np.broadcast_to((0, 2, 3), one.shape)], axis=1)
    whole = np.take_along_axis(there[:, None], picks, axis=2).all(axis=2)
    faces = np.take_along_axis(corners[:, None], picks, axis=2)[whole]
    if len(faces) == 0:
        raise ValueError(
            f"{name}: expected three valid neighbours somewhere, got {valid.sum()} valid samples"
        )
    return Mesh(vertices, faces, name)


def _cells(grid: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The four corners (cells, 4) of the cells of a grid, counter-clockwise."""
    return np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=-1).reshape(-1, 4)


def extrude(polyline: npt.ArrayLike, depth: float, *, closed: bool = False, name: str = "extrusion") -> Mesh:
    """Mesh of a profile in the x-z plane, extruded along y.

    Parameters
    ----------
    polyline : (k, 2) float64, metres
        Points (x, z). The front is to the left of somebody who walks along it, x to the right
        and z up: normal (-dz, dx).
    depth : float, metres
        From y = -depth/2 to +depth/2.
    closed : bool
        Join the last point to the first and cap both ends: a solid with its front outside,
        whichever way round the points go.
    name : str
        For messages.

    Returns
    -------
    Mesh
        Triangles 2i and 2i + 1 are the strip of segment i; the caps at -y and +y come last.

    Raises
    ------
    ValueError
        For fewer than 2 points (3 if closed), points that are not finite, neighbours that
        coincide, a depth that is not positive, a closed line that meets itself.
    """
    points = filled(polyline).copy()
    least = 3 if closed else 2
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < least:
        raise ValueError(f"{name}: expected points of shape (k, 2), k from {least}, got {points.shape}")
    if not np.isfinite(points).all():
        raise ValueError(f"{name}: expected finite points, got NaN or infinity")
    half = 0.5 * checked_length(depth, f"{name} depth")
    count = len(points)
    start = np.arange(count if closed else count - 1)
    end = (start + 1) % count
    still = np.flatnonzero((points[start] == points[end]).all(axis=1))
    if len(still):
        raise ValueError(
            f"{name}: expected points that differ from the next, got two alike at point {still[0]}"
        )
    sheet = np.stack([start, end, end + count, start, end + count, start + count], axis=1).reshape(-1, 3)
    faces = _with_caps(sheet, points, name) if closed else sheet
    near, far = (np.insert(points, 1, y, axis=1) for y in (-half, half))
    return Mesh(*weld(np.concatenate([near, far]), faces), name)


def _with_caps(sheet: IndexArray, polygon: FloatArray, name: str) -> IndexArray:
    """The strips turned to face outwards, and both ends filled."""
    meets = self_crossing(polygon)
    if meets:
        raise ValueError(
            f"{name}: expected a line that does not meet itself, got segments {meets[0]} and {meets[1]}"
        )
    if doubled_area(polygon) > 0.0:
        sheet = sheet[:, ::-1]
    cap = triangulate(polygon)  # counter-clockwise from x to z: seen from -y
    return np.concatenate([sheet, cap, cap[:, ::-1] + len(polygon)])


def plate(width: float, height: float, thickness: float | None = None) -> Mesh:
    """Mesh of a rectangle in the plane z = 0, centred, its front +z; with a thickness, a box below it.

    Parameters
    ----------
    width, height : float, metres
        Along x and y.
    thickness : float, metres, optional
        Of a closed box from z = -thickness to 0.

    Returns
    -------
    Mesh
        The first two triangles are the face at z = 0.

    Raises
    ------
    ValueError
        If a length is not positive.
    """
    half = 0.5 * checked_length(width, "plate width")
    line = [(-half, 0.0), (half, 0.0)]
    checked_length(height, "plate height")
    if thickness is None:
        return extrude(line, height, name="plate")
    below = -checked_length(thickness, "plate thickness")
    return extrude([*line, (half, below), (-half, below)], height, closed=True, name="plate")


def step(width: float, height: float, edge: float, rise: float) -> Mesh:
    """Mesh of a step: z = 0 for x < edge, z = rise beyond, with a vertical riser.

    Parameters
    ----------
    width, height : float, metres
        Along x and y, centred.
    edge : float, metres
        x of the riser.
    rise : float, metres
        Negative: a step down.

    Returns
    -------
    Mesh
        One open sheet of six triangles: lower face, riser, upper face.

    Raises
    ------
    ValueError
        If a side is not positive, the edge not on the mirror, or the rise 0.
    """
    half = 0.5 * checked_length(width, "step width")
    checked_length(height, "step height")
    if not -half < edge < half:
        raise ValueError(f"step edge: expected within {half:g} m of the centre, got {edge!r}")
    _checked_rise(rise, "step rise")
    return extrude([(-half, 0.0), (edge, 0.0), (edge, rise), (half, rise)], height, name="step")


def staircase(width: float, height: float, treads: int, rise: float) -> Mesh:
    """Mesh of a staircase of equal treads, the first at z = 0, each `rise` higher towards +x.

    Parameters
    ----------
    width, height : float, metres
        Along x and y, of the whole, centred.
    treads : int
        2 or more.
    rise : float, metres
        Negative: downwards.

    Returns
    -------
    Mesh
        One open sheet: tread, riser, tread, ..., two triangles each.

    Raises
    ------
    ValueError
        If a side is not positive, the rise 0, or there are fewer than 2 treads.
    """
    count = _checked_count(treads, "staircase treads", 2)
    checked_length(height, "staircase height")
    _checked_rise(rise, "staircase rise")
    edges = (np.arange(count + 1) / count - 0.5) * checked_length(width, "staircase width")
    x = np.stack([edges[:-1], edges[1:]], axis=1).ravel()
    z = np.repeat(np.arange(count) * rise, 2)
    return extrude(np.stack([x, z], axis=1), height, name="staircase")


def icosphere(radius: float, subdivisions: int) -> Mesh:
    """Mesh of a sphere about the origin by subdivided icosahedron, its front outside.

    Parameters
    ----------
    radius : float, metres
        Of the vertices.
    subdivisions : int
        The mesh has 20 * 4**subdivisions faces.

    Returns
    -------
    Mesh

    Raises
    ------
    ValueError
        If the radius is not positive or `subdivisions` no whole number from 0.
    """
    size = checked_length(radius, "icosphere radius")
    corners = unit(ICOSAHEDRON)[ICOSAHEDRON_FACES]
    for _ in range(_checked_count(subdivisions, "icosphere subdivisions", 0)):
        # a + b is b + a to the last bit: neighbours agree on their midpoints, and are welded below
        middle = unit(corners + np.roll(corners, -1, axis=1))
        tips = np.stack([corners, middle, np.roll(middle, 1, axis=1)], axis=2)
        corners = np.concatenate([tips, middle[:, None]], axis=1).reshape(-1, 3, 3)
    vertices, faces = weld(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    return Mesh(vertices * size, faces, "icosphere")


def corner_cube(size: float, subdivisions: int = 1) -> Mesh:
    """Mesh of a corner cube: three square mirrors at right angles, open towards (1, 1, 1).

    Parameters
    ----------
    size : float, metres
        Side of the squares.
    subdivisions : int
        Each square is divided into that many squares along each side, two triangles each.

    Returns
    -------
    Mesh
        The faces x = 0, y = 0, z = 0 in turn; their front, +x, +y, +z, is the hollow.

    Raises
    ------
    ValueError
        If the size is not positive or `subdivisions` no whole number from 1.
    """
    side = checked_length(size, "corner cube size")
    count = _checked_count(subdivisions, "corner cube subdivisions", 1)
    along = np.arange(count + 1) / count * side
    u, v = np.meshgrid(along, along)
    square = np.stack([np.zeros_like(u), u, v], axis=-1).reshape(-1, 3)
    faces = height_map(np.zeros_like(u), 1.0).faces
    squares = np.concatenate([np.roll(square, turn, axis=1) for turn in range(3)])
    return Mesh(
        *weld(squares, np.concatenate([faces + turn * len(square) for turn in range(3)])), "corner cube"
    )


def rod_lattice(
    columns: int,
    rows: int,
    radius: float,
    pitch: float | tuple[float, float],
    length: float,
    *,
    sides: int = 18,
    stagger: bool = True,
) -> Mesh:
    """Mesh of a lattice of closed prisms along y, their front outside.

    The axis of rod (column, row) is at x = column * pitch, z = row * pitch, in every second row
    (1, 3, ...) half a pitch further along x; y goes from -length/2 to +length/2. Vertex n of a
    rod, 1 to `sides`, is at n * 360/sides degrees from +x towards +z.

    Parameters
    ----------
    columns, rows : int
    radius : float, metres
        Of the vertices about the axis.
    pitch : float, or (along x, along z), metres
    length : float, metres
    sides : int
        3 or more. 18 puts the facets at multiples of 20 degrees.
    stagger : bool
        Shift every second row.

    Returns
    -------
    Mesh
        Rod after rod, column * rows + row; see `rod_of_triangle` for the triangles of each.

    Raises
    ------
    ValueError
        If a count is no whole number or too small, or a length is not positive.
    """
    across, up = _checked_count(columns, "rod columns", 1), _checked_count(rows, "rod rows", 1)
    count = _checked_count(sides, "rod sides", 3)
    pitch_x, pitch_z = _checked_pitch(pitch, "rod pitch")
    angle = 2.0 * np.pi * np.arange(1, count + 1) / count
    circle = checked_length(radius, "rod radius") * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    half = 0.5 * checked_length(length, "rod length")

    start = np.arange(count)
    end = (start + 1) % count
    facets = np.stack([start, end + count, end, start, start + count, end + count], axis=1).reshape(-1, 3)
    fan = np.stack([np.zeros_like(start), start, end], axis=1)[1:-1]
    rod = np.concatenate([facets, fan, fan[:, ::-1] + count])

    column, row = (index.ravel() for index in np.meshgrid(np.arange(across), np.arange(up), indexing="ij"))
    shift = 0.5 * (row % 2) if stagger else 0.0
    ring = np.stack([(column + shift) * pitch_x, row * pitch_z], axis=1)[:, None] + circle
    ends = np.stack([np.insert(ring, 1, y, axis=2) for y in (-half, half)], axis=1)
    faces = rod + 2 * count * np.arange(across * up)[:, None, None]
    return Mesh(ends.reshape(-1, 3), faces.reshape(-1, 3), "rod lattice")


def rod_of_triangle(triangle: npt.ArrayLike, sides: int = 18) -> tuple[IndexArray, IndexArray]:
    """Rod and facet numbers of the triangles of a `rod_lattice`.

    Each rod has two triangles a facet and sides - 2 in the cap at either end, 4 * sides - 4 in all.

    Parameters
    ----------
    triangle : int64, any shape
        Index of the face in the mesh.
    sides : int
        Of the rods.

    Returns
    -------
    rod : int64, shape of `triangle`
        column * rows + row.
    facet : int64, shape of `triangle`
        Facet f, 0 to sides - 1, lies between vertices f + 1 and f + 2; -1: a cap.
    """
    rod, place = np.divmod(np.asarray(triangle, dtype=np.int64), 4 * sides - 4)
    return rod, np.where(place < 2 * sides, place // 2, -1)
