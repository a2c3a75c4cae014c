"""Finds the hit: Embree says which triangle, float64 says where. Nothing else knows Embree.

Surfaces are grouped into bodies. Each body has an Embree scene of its own, moved and scaled by
a power of two into the unit box, so that a lattice of 65 nm rods inside a 0.3 m instrument keeps
all the digits of float32; the nearest float64 hit over all bodies wins.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.rays import Batch
from fringetrace.scene import Scene, Surface
from fringetrace.waves import Array, FloatArray

IntArray = npt.NDArray[np.int64]
EPSILON = float(np.finfo(np.float64).eps)
# Scenes with no more surfaces than this keep one body for each.
FEW = 8
# A body may be this many times larger than the smallest surface in it: float32 has bits to spare.
SPREAD = 64.0


@dataclass(frozen=True, eq=False)
class Tree:
    """Bounding volume tree in float64: a complete binary tree over triangles."""

    corners: FloatArray  # (t, 9)
    order: npt.NDArray[np.int32]  # (4 * leaves,), -1 where empty
    lower: FloatArray  # (2 * leaves, 3); node 1 is the root
    upper: FloatArray


@dataclass(frozen=True, eq=False)
class Body:
    """Triangles that share an Embree scene, in their unit box.

    `frame` holds centre (3, metres), scale (1/m, a power of two), and, in the unit box, the radius
    of the bounding sphere, the distance from an edge below which a restart is doubtful, and the
    rounding of a point that lies on a face.
    """

    first: int  # number of its first triangle
    vertices: FloatArray  # (v, 3), unit box
    faces: IntArray
    planes: FloatArray  # (t, 16)
    frame: FloatArray  # (7,)
    oriented: bool
    closed: bool
    surfaces: tuple[int, ...]

    @property
    def stop(self) -> int:
        """One past the number of its last triangle."""
        return self.first + len(self.faces)

    @cached_property
    def embree(self) -> Any:
        """The committed Embree scene."""
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        scene = EmbreeScene(robust=True)
        TriangleMesh(scene, self.vertices.astype(np.float32), self.faces.astype(np.int32))
        one = np.zeros((1, 3), dtype=np.float32)
        scene.run(one, one + np.float32(1.0))  # commits, before threads share it
        return scene

    @cached_property
    def tree(self) -> Tree:
        """The float64 tree that decides doubtful hits."""
        return _tree(self.vertices[self.faces], self.frame[6])

    @cached_property
    def packed(self) -> tuple[Any, ...]:
        """The body as the kernels take it."""
        tree = self.tree
        return (
            self.first, self.stop, self.oriented, self.closed, self.frame, self.planes,
            tree.corners, tree.order, tree.lower, tree.upper,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Engine:
    """Bodies of a scene, and whose each triangle is.

    `owner` (t,) is the surface of a triangle, `offset` (surfaces,) the number of its first one.
    """

    bodies: tuple[Body, ...]
    owner: npt.NDArray[np.int32]
    offset: IntArray


@dataclass(frozen=True, eq=False)
class Hits:
    """What each row of a batch met last, and what Embree is asked (float32).

    `path` in metres, `triangle` (-1: nothing), `point`, its `facet` normal, distance from its `rim`.
    """

    path: FloatArray
    triangle: IntArray
    point: FloatArray
    facet: FloatArray
    rim: FloatArray
    origin32: npt.NDArray[np.float32]
    direction32: npt.NDArray[np.float32]
    sent: IntArray
    asked: IntArray

    @staticmethod
    def blank(rows: int) -> Hits:
        """Room for so many rows."""
        return Hits(
            path=np.empty(rows),
            triangle=np.empty(rows, dtype=np.int64),
            point=np.empty((rows, 3)),
            facet=np.empty((rows, 3)),
            rim=np.empty(rows),
            origin32=np.empty((rows, 3), dtype=np.float32),
            direction32=np.empty((rows, 3), dtype=np.float32),
            sent=np.empty(rows, dtype=np.int64),
            asked=np.empty(rows, dtype=np.int64),
        )


def _tree(corners: FloatArray, tolerance: float) -> Tree:
    from fringetrace import kernels

    count, leaf = len(corners), kernels.LEAF
    slack = 1e-9 + tolerance
    low, high = corners.min(axis=1) - slack, corners.max(axis=1) + slack
    leaves = 1 << max(0, (-(-count // leaf) - 1).bit_length())
    order = np.full(leaf * leaves, -1, dtype=np.int32)
    bounds = np.ascontiguousarray(low.T), np.ascontiguousarray(high.T)
    order[:count] = kernels.arrange(*bounds, bounds[0] + bounds[1], leaves)
    lower, upper = np.full((2 * leaves, 3), np.inf), np.full((2 * leaves, 3), -np.inf)
    filled = np.full((2, leaf * leaves, 3), np.array([np.inf, -np.inf])[:, None, None])
    filled[0, :count], filled[1, :count] = low[order[:count]], high[order[:count]]
    lower[leaves:] = filled[0].reshape(leaves, leaf, 3).min(axis=1)
    upper[leaves:] = filled[1].reshape(leaves, leaf, 3).max(axis=1)
    level = leaves
    while level > 1:
        level //= 2
        children = slice(2 * level, 4 * level)
        lower[level : 2 * level] = lower[children].reshape(level, 2, 3).min(axis=1)
        upper[level : 2 * level] = upper[children].reshape(level, 2, 3).max(axis=1)
    return Tree(np.ascontiguousarray(corners.reshape(count, 9)), order, lower, upper)


def _planes(corners: FloatArray) -> FloatArray:
    """Plane and three edge planes of each triangle; see `kernels`."""
    sides = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(sides[:, 0], sides[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    planes = np.empty((len(corners), 16))
    planes[:, :3] = normal
    planes[:, 3] = -np.einsum("ij,ikj->i", normal, corners) / 3.0
    for k in range(3):
        inward = np.cross(normal, sides[:, k])
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        planes[:, 4 * k + 4 : 4 * k + 7] = inward
        planes[:, 4 * k + 7] = -np.einsum("ij,ij->i", inward, corners[:, k])
    return planes


def _topology(faces: IntArray, normal: FloatArray) -> tuple[bool, bool, float]:
    """Whether faces are wound alike, whether they close, and cosine of the sharpest fold.

    The cosine is between the normals of two faces that share an edge: -1 is a knife's edge.
    """
    count = int(faces.max()) + 1
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edge, back = start * count + end, end * count + start
    order = np.argsort(edge, kind="stable")
    ordered = edge[order]
    oriented = bool((np.diff(ordered) > 0).all())
    partner = np.minimum(np.searchsorted(ordered, back), len(ordered) - 1)
    shared = ordered[partner] == back
    face, other = np.flatnonzero(shared) // 3, order[partner[shared]] // 3
    cosine = np.einsum("ij,ij->i", normal[face], normal[other])
    return oriented, oriented and bool(shared.all()), float(cosine.min(initial=1.0))


def _restart(cosine: float) -> float:
    """Distance from an edge, in the unit box, below which a restart is decided exactly.

    The step off the surface, up to `MARGIN` long, must not reach the other face of a fold.
    """
    from fringetrace.kernels import MARGIN

    angle = np.pi - np.arccos(np.clip(cosine, -1.0, 1.0))
    return float(MARGIN / max(np.sin(min(angle, 0.5 * np.pi)), 1e-3))


def _body(surfaces: tuple[Surface, ...], members: tuple[int, ...], first: int) -> Body:
    meshes = [surfaces[i].mesh for i in members]
    shift = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, shift, strict=False)])
    bounds = np.array([mesh.bounds for mesh in meshes])
    low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    centre = low + 0.5 * (high - low)
    scale = 2.0 ** -np.ceil(np.log2(0.5 * (high - low).max()))
    used, faces = np.unique(faces, return_inverse=True)
    faces = np.ascontiguousarray(faces.reshape(-1, 3))
    local = (vertices[used] - centre) * scale
    corners = local[faces]
    planes = _planes(corners)
    oriented, closed, cosine = _topology(faces, planes[:, :3])
    frame = np.empty(7)
    frame[:3], frame[3] = centre, scale
    frame[4] = np.sqrt((local**2).sum(axis=1).max()) * (1.0 + 1e-6) + 1e-5
    frame[5] = _restart(cosine)
    frame[6] = 32.0 * EPSILON * (1.0 + np.abs(centre).max() * scale)
    return Body(first, local, faces, planes, frame, oriented, closed, members)


def _groups(surfaces: tuple[Surface, ...], alone: frozenset[int]) -> list[tuple[int, ...]]:
    """Which surfaces share a body.

    Few surfaces: none. Many: those of a size that stand clear of each other; what touches or
    nests stays apart, so that thin gaps are between bodies, where float64 decides.
    """
    if len(surfaces) <= FEW:
        return [(i,) for i in range(len(surfaces))]
    groups: list[list[int]] = []
    boxes: list[FloatArray] = []
    for i, surface in enumerate(surfaces):
        box = surface.mesh.bounds
        size = (box[1] - box[0]).max()
        wide = box + np.array([[-1e-3], [1e-3]]) * size
        home = None
        for g in range(len(groups)) if i not in alone else ():
            members = boxes[g]
            if groups[g][0] in alone:
                continue
            smallest = min(size, (members[:, 1] - members[:, 0]).max(axis=1).min())
            extent = np.maximum(members[:, 1].max(axis=0), box[1]) - np.minimum(
                members[:, 0].min(axis=0), box[0]
            )
            overlap = ((members[:, 0] <= wide[1]) & (members[:, 1] >= wide[0])).all(axis=1)
            if extent.max() <= SPREAD * smallest and not overlap.any():
                home = g
                break
        if home is None:
            groups.append([i])
            boxes.append(box[None])
        else:
            groups[home].append(i)
            boxes[home] = np.concatenate([boxes[home], box[None]])
    return [tuple(group) for group in groups]


def build(scene: Scene, alone: frozenset[int] = frozenset()) -> Engine:
    """The engine of a scene; built once and kept with the scene.

    Parameters
    ----------
    scene : Scene
    alone : set of surface numbers
        Those that need a body of their own, because some rays pass over them.

    Returns
    -------
    Engine
    """
    name = f"engine {sorted(alone)}"
    if name not in scene.derived:
        bodies: list[Body] = []
        offset = np.zeros(len(scene.surfaces), dtype=np.int64)
        owner: list[Array] = []
        first = 0
        for members in _groups(scene.surfaces, alone):
            body = _body(scene.surfaces, members, first)
            for i in members:
                offset[i] = first
                first += len(scene.surfaces[i].mesh.faces)
                owner.append(np.full(len(scene.surfaces[i].mesh.faces), i, dtype=np.int32))
            bodies.append(body)
        scene.derived[name] = Engine(tuple(bodies), np.concatenate(owner), offset)
    engine: Engine = scene.derived[name]
    return engine


def find(engine: Engine, batch: Batch, rows: int, hits: Hits, passed: frozenset[int] = frozenset()) -> int:
    """Nearest hit of each ray, written into `hits`.

    Parameters
    ----------
    engine : Engine
    batch : Batch
    rows : int
        How many rays it holds.
    hits : Hits
        At least as many rows.
    passed : set of surface numbers
        Surfaces to be passed over; each must have a body of its own.

    Returns
    -------
    int
        How many rays were decided exactly.
    """
    from fringetrace import kernels

    origin32, direction32 = hits.origin32, hits.direction32
    doubtful = 0
    fresh = True
    for body in engine.bodies:
        if passed.issuperset(body.surfaces):
            continue
        count = kernels.aim(
            rows, batch.origin, batch.direction, batch.last, batch.normal, body.frame, body.first, body.stop,
            hits.path, hits.triangle, fresh, origin32, direction32, hits.sent,
        )  # fmt: skip
        fresh = False
        if count == 0:
            continue
        prim = body.embree.run(origin32[:count], direction32[:count])
        found = kernels.suspect(
            hits.sent, count, prim, batch.direction, batch.last, body.first, body.stop, body.closed,
            body.frame[4], body.planes, origin32, direction32, hits.asked,
        )  # fmt: skip
        if found:
            second = body.embree.run(origin32[:found], direction32[:found])
            rows_asked = hits.asked[:found]
            prim[rows_asked[second != prim[rows_asked]]] = -2
        doubtful += kernels.measure(
            hits.sent, count, prim, batch.origin, batch.direction, batch.last, batch.normal, batch.edge,
            batch.straight, *body.packed, hits.path, hits.triangle, hits.point, hits.facet, hits.rim,
        )  # fmt: skip
    if fresh:
        hits.path[:rows] = np.inf
        hits.triangle[:rows] = -1
    return doubtful
