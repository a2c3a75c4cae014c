"""Feature edges of meshes (rims, creases, silhouettes), and where the beam passes them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray, unit
from fringetrace.field.wavefront.ray_tubes import along_grid
from fringetrace.scene import Scene, Surface, group_facets, once_per_scene
from fringetrace.tracing import Fate, Paths

# Rays go by an edge this many cells to either side of it and within its ends, so far apart along it.
SIDE, SPACING = 1e-3, 0.5
# Leads that are asked which ray comes nearest to a point, and steps from there.
LEADS, STEPS = 64, 4
# Steps along columns and rows that are this near to one line (sine squared) lead nowhere.
LOST = 1e-12
# Nodes that are looked at: so many squared of the grid, and so many along columns or rows of a leg,
# up to twice as many.
MOST, NODES = 128, 32
# Cells that a leg is carried on beyond its nodes.
NEAR = 1.5
# A leg's own start is known to this part of the scene's size. What it passes or meets does not lie
# farther beyond its end than this part of its length.
START, SLACK = 1e-9, 0.05


Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Creases:
    """Edges of meshes where light may be split.

    Attributes
    ----------
    ends : (n, 2, 3) float64, metres
    normals : (n, 2, 3) float64
        Of the faces on either side of an edge of a form, unit, which is a silhouette seen from
        where one shows its front and the other its back; NaN for rims and edges between facets.
    """

    ends: FloatArray
    normals: FloatArray

    def seen_along(self, direction: FloatArray) -> FloatArray:
        """End points (m, 2, 3) of the edges that split light of a direction (3,)."""
        facing = self.normals @ direction
        with np.errstate(invalid="ignore"):
            through = facing[:, 0] * facing[:, 1] > 0.0
        return self.ends[~through]


@once_per_scene
def creases(scene: Scene) -> Creases:
    """Feature edges: rims, edges between facets of different planes, and all edges within forms.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    Creases
    """
    found = [_of(surface, part) for surface, part in zip(scene.surfaces, group_facets(scene), strict=True)]
    return Creases(*(np.concatenate([getattr(one, f.name) for one in found]) for f in fields(Creases)))


def _of(surface: Surface, part: npt.NDArray[np.int64]) -> Creases:
    mesh, edges = surface.mesh, surface.mesh.topology.edges
    one, other = edges.rows.T // 3
    joined = (edges.count == 2) & (part[one] == part[other])
    normals = np.where(joined[:, None, None], mesh.normals[edges.rows // 3], np.nan)
    kept = ~joined | (part[one] < 0)
    return Creases(mesh.topology.vertices[edges.ends[kept]], normals[kept])


@dataclass(frozen=True, eq=False)
class Leg:
    """Segments of node rays that met the same surfaces so far: straight lines over the beam's grid.

    Attributes
    ----------
    corner, stride : (2,) int64
        Column and row of the first node of a grid, and cells from one to the next.
    number : (rows, columns) int64
        Of its nodes whose neighbours are there; -1 elsewhere.
    nodes : (n, 2) int64
        Their columns and rows.
    start, direction : (n, 3) float64
    reach : (n,) float64, metres
        Infinite for the last leg.
    steps : (n, 2, 6) float64
        Derivatives of start and direction along columns and rows of the beam's grid.
    """

    corner: npt.NDArray[np.int64]
    stride: npt.NDArray[np.int64]
    number: npt.NDArray[np.int64]
    nodes: npt.NDArray[np.int64]
    start: FloatArray
    direction: FloatArray
    reach: FloatArray
    steps: FloatArray

    def nearest(self, points: FloatArray) -> tuple[FloatArray, Mask, Mask]:
        """Point of the beam's grid whose light passes given points, interpolated between nodes.

        Parameters
        ----------
        points : (n, 3) float64, metres

        Returns
        -------
        at : (n, 2) float64
            Columns and rows, in cells; on the grid or beside it.
        there, near : (n,) bool
            Whether the points lie between the leg's ends, and whether a node is near.
        """
        parallel = bool((self.direction == self.direction[0]).all())
        leads = 1 if parallel else LEADS
        lead = np.unique(np.linspace(0, len(self.nodes) - 1, leads).astype(np.int64))
        off = points[:, None] - self.start[lead]
        along = np.einsum("pnk,nk->pn", off, self.direction[lead])
        node = lead[np.argmin((off**2).sum(axis=-1) - along**2, axis=1)]
        most = np.array(self.number.shape[::-1]) - 1
        for _ in range(2 if parallel else STEPS):
            off, direction = points - self.start[node], self.direction[node]
            along = np.einsum("pk,pk->p", off, direction)
            slope = self.steps[node, :, :3] + along[:, None, None] * self.steps[node, :, 3:]
            slope -= np.einsum("pik,pk->pi", slope, direction)[..., None] * direction[:, None]
            miss = off - along[:, None] * direction
            at = self.nodes[node] + _solved(slope, miss)
            place = np.clip((at - self.corner) / self.stride, 0, most)
            column, row = np.rint(place).astype(np.int64).T
            number = self.number[row, column]
            final = node
            node = np.where(number >= 0, number, node)
        there = along > START * np.abs(points).max(initial=0.0)
        there &= along < (1.0 + SLACK) * self.reach[final]
        near = (np.abs(at - self.nodes[final]) <= NEAR * self.stride).all(axis=1)
        return np.asarray(at, dtype=np.float64), there, np.asarray(near)


def _solved(slope: FloatArray, miss: FloatArray) -> FloatArray:
    """Steps (n, 2) whose slopes (n, 2, 3) come nearest to (n, 3); none where a slope is lost."""
    (a, b), (_, c) = np.moveaxis(np.einsum("pik,pjk->pij", slope, slope), 0, -1)
    u, v = np.einsum("pik,pk->ip", slope, miss)
    bend = a * c - b * b
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.stack([c * u - b * v, a * v - b * u], axis=1) / bend[:, None]
    return np.where((bend > LOST * a * c)[:, None], step, 0.0)


def segments_near_edges(paths: Paths, shape: tuple[int, int]) -> Iterator[tuple[Leg, FloatArray]]:
    """Segments of the rays from a beam's grid nodes, with the mesh edges near them.

    Parameters
    ----------
    paths : Paths
        Recorded; `ray` is the number of the node.
    shape : (rows, columns)
        Of the nodes.

    Yields
    ------
    Leg
        One for each sequence of surfaces, parts of them and branches that enough neighbours share.
    edges : (n, 2, 3) float64, metres
        At least one.
    """
    edges = creases(paths.scene)
    every = np.where(np.array(shape) > NODES, int(np.ceil(np.sqrt(shape[0] * shape[1]) / MOST)), 1)
    row, column = np.divmod(paths.ray, shape[1])
    paths = paths.where((row % every[0] == 0) & (column % every[1] == 0))
    for lines, ray in _lines(paths):
        near = _near(lines, edges.seen_along(lines[:, 3:6].mean(axis=0)))
        leg = _leg(lines, ray, shape[1], every[::-1]) if len(near) else None
        if leg is not None:
            yield leg, near


def _lines(paths: Paths) -> Iterator[tuple[FloatArray, Array]]:
    """Starts, directions and lengths (n, 7) of rays that met the same so far, and their numbers."""
    assert paths.surface is not None
    assert paths.triangle is not None
    assert paths.points is not None
    assert paths.starts is not None
    parts = group_facets(paths.scene)
    offset = np.cumsum([0] + [len(part) for part in parts])
    part = np.concatenate(parts)[(paths.triangle + offset[paths.surface]).clip(0)]
    part -= part.min(initial=0)
    so_far = np.zeros(len(paths), dtype=np.int64)
    before = np.zeros((len(paths), 3))
    for leg in range(paths.surface.shape[1] + 1):
        last = paths.bounces == leg
        rows = np.flatnonzero((paths.bounces > leg) | (last & (paths.fate <= Fate.LEFT)))
        if len(rows) == 0:
            return
        step = paths.points[rows, leg + 1] - paths.starts[rows, leg]
        final = last[rows]
        reach = np.where(final, np.inf, np.linalg.norm(step, axis=1))
        # a leg between touching surfaces may have no length, and passes no edge
        still = final | (reach == 0.0)
        step[still] = paths.direction[rows[still]]
        direction = unit(step)
        if leg > 0:
            turned = np.linalg.norm(direction - before[rows], axis=1) > START
            number = so_far[rows]
            for met in (paths.surface[rows, leg - 1], part[rows, leg - 1], turned):
                number = number * (int(met.max()) + 1) + met
            so_far[rows] = np.unique(number, return_inverse=True)[1]
        before[rows] = direction
        lines = np.column_stack([paths.starts[rows, leg], direction, reach])
        for group in np.unique(so_far[rows]):
            mine = so_far[rows] == group
            yield lines[mine], paths.ray[rows[mine]]


def _near(lines: FloatArray, ends: FloatArray) -> FloatArray:
    """Edges (m, 2, 3) of some, (n, 2, 3), that are in the box around lines (k, 7), or little beyond."""
    size = float((np.ptp(ends, axis=(0, 1)) + np.ptp(lines[:, :3], axis=0)).max()) if len(ends) else 0.0
    reach = np.minimum(lines[:, 6], 2.0 * size)[:, None]
    stops = np.stack([lines[:, :3], lines[:, :3] + reach * lines[:, 3:6]])
    low, high = stops.min(axis=(0, 1)), stops.max(axis=(0, 1))
    room = SLACK * (high - low).max()
    inside = (ends.max(axis=1) >= low - room) & (ends.min(axis=1) <= high + room)
    return np.asarray(ends[inside.all(axis=1)], dtype=np.float64)


def _leg(lines: FloatArray, ray: Array, wide: int, every: Array) -> Leg | None:
    """A leg of rays, `_lines`, from every so many of the nodes; None where too few are neighbours."""
    place = np.stack([ray % wide, ray // wide])
    corner = place.min(axis=1)
    stride = every * np.maximum(1, (place.max(axis=1) - corner) // (NODES * every))
    column, row = index = (place - corner[:, None]) // stride[:, None]
    kept = (index * stride[:, None] == place - corner[:, None]).all(axis=0)
    grid = np.full((int(row.max()) + 1, int(column.max()) + 1, 7), np.nan)
    grid[row[kept], column[kept]] = lines[kept]
    steps = along_grid(grid[..., :6]) / stride[:, None]
    known = np.isfinite(steps).all(axis=(2, 3))
    if not known.any():
        return None
    number = np.where(known, np.cumsum(known).reshape(known.shape) - 1, -1)
    nodes = corner + np.argwhere(known)[:, ::-1] * stride
    start, direction, reach = grid[known, :3], grid[known, 3:6], grid[known, 6]
    return Leg(corner, stride, number, nodes, start, direction, reach, steps[known])


def places_beside_edges(paths: Paths, shape: tuple[int, int], most: int) -> tuple[FloatArray, Mask]:
    """Points on the beam's grid from which light passes mesh edges, on either side.

    Found from the legs of the rays from the nodes: exactly where these are parallel, else to second
    order in the spacing of the nodes.

    Parameters
    ----------
    paths : Paths
        Recorded; `ray` is the number of the node.
    shape : (rows, columns)
        Of the nodes.
    most : int
        How many places there may be; of more, some are left out.

    Returns
    -------
    at : (n, 2) float64
        Columns and rows, in cells.
    goes_on : (n,) bool
        Whether the next one is on the same side of the same edge.
    """
    places, goes_on = [np.empty((0, 2))], [np.empty(0, dtype=np.bool_)]
    for leg, edges in segments_near_edges(paths, shape):
        at, on = _along(leg, edges, np.array(shape[::-1]) - 1.0)
        places.append(at)
        goes_on.append(on)
    at, on = np.concatenate(places), np.concatenate(goes_on)
    if len(at) > most:
        kept = np.linspace(0, len(at) - 1, most).astype(np.int64)
        return at[kept], np.zeros(most, dtype=np.bool_)
    return at, on


def _along(leg: Leg, ends: FloatArray, size: FloatArray) -> tuple[FloatArray, Mask]:
    """Places on a grid of a size beside edges (n, 2, 3) that a leg comes by, as `places_beside_edges`."""
    at, there, _ = leg.nearest(ends.reshape(-1, 3))
    at, there = at.reshape(-1, 2, 2), there.reshape(-1, 2)
    begin, end = _clipped(at, size)
    length = np.linalg.norm(at[:, 1] - at[:, 0], axis=1)
    kept = there.any(axis=1) & (begin < end) & (length > SIDE)
    ends, begin, end, length = ends[kept], begin[kept], end[kept], length[kept]
    tangent = (at[kept, 1] - at[kept, 0]) / length[:, None]
    count = np.ceil((end - begin) * length / SPACING).astype(np.int64) + 1
    edge = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    margin = np.minimum(SIDE / ((end - begin) * length), 0.25)[edge]
    f = margin + (1.0 - 2.0 * margin) * number / (count[edge] - 1)
    f = (begin[edge] + f * (end - begin)[edge])[:, None]
    at, _, near = leg.nearest(ends[edge, 0] * (1.0 - f) + ends[edge, 1] * f)
    across = SIDE * np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)[edge]
    both = np.concatenate([at - across, at + across])
    on = np.tile(number + 1 < count[edge], 2)
    inside = np.asarray(((both > 0.0) & (both < size)).all(axis=1) & np.tile(near, 2))
    on &= np.append(inside[1:], False)
    return both[inside], on[inside]


def _clipped(at: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """From and to which part of segments (n, 2, 2) they lie in the box from 0 to `size` (Liang, Barsky)."""
    along = at[:, 1] - at[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        f = np.sort(np.stack([-at[:, 0], size - at[:, 0]], axis=-1) / along[..., None], axis=-1)
    inside = (at[:, 0] >= 0.0) & (at[:, 0] <= size)
    still = along == 0.0
    f[still & inside] = (-np.inf, np.inf)
    f[still & ~inside] = (np.inf, -np.inf)
    begin, end = f[..., 0].max(axis=1), f[..., 1].min(axis=1)
    return np.clip(begin, 0.0, 1.0), np.clip(end, 0.0, 1.0)
