"""Finds the hit: Embree says which triangle, float64 says where. Nothing else knows Embree.

Surfaces are grouped into bodies. Each body has an Embree scene of its own, moved and scaled by
a power of two into the unit box, so that a lattice of 65 nm rods inside a 0.3 m instrument keeps
all the digits of float32; the nearest float64 hit over all bodies wins.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.rays import Batch, Ends
from fringetrace.scene import Mesh, Scene, Surface
from fringetrace.triangles import weld
from fringetrace.waves import Array, FloatArray

IntArray = npt.NDArray[np.int64]
Float32 = npt.NDArray[np.float32]
EPSILON = float(np.finfo(np.float64).eps)
# A body may be this many times larger than the smallest surface in it: float32 has bits to spare.
SPREAD = 64.0
# Surfaces share a body only with this part of their size between them: far more than float32 blurs.
CLEAR = 1e-3
# A surface is a plane if no vertex stands off it by more than this part of the unit box; around a
# surface there is this much room, beyond all that float32 and restarts move a ray.
FLAT, ROOM = 1e-14, 1e-4
# How many faces lend their planes to the test for that, and from how many vertices on a box stands in.
FACES, MANY = 16, 10000


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
    gentle: npt.NDArray[
        np.uint8
    ]  # (t,), a bit for each edge that is shared, with a fold of 26 degrees or less
    frame: FloatArray  # (7,)
    oriented: bool
    closed: bool
    surfaces: tuple[int, ...]
    flat: npt.NDArray[np.bool_]  # (s,), a surface that is one plane
    boxes: tuple[FloatArray, FloatArray]  # (s, 3) each, lower and upper, a little larger than the surfaces

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
            self.gentle, tree.corners, tree.order, tree.lower, tree.upper,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Engine:
    """Bodies of a scene, and whose each triangle is.

    `owner` (t,) is the surface of a triangle, `offset` (surfaces,) the number of its first one.
    """

    bodies: tuple[Body, ...]
    owner: npt.NDArray[np.int32]
    offset: IntArray

    @property
    def base(self) -> int:
        """Base of a path key, whose digits name surface and branch."""
        return 2 * len(self.offset) + 1

    @cached_property
    def digit(self) -> Array:
        """(t,) What a reflection off each triangle adds to a path key; small, to stay in the cache."""
        return (2 * self.owner + 1).astype(np.min_scalar_type(self.base))


@dataclass(frozen=True, eq=False)
class Hits:
    """What each row of a batch met last, and what Embree is asked (float32).

    `met` has the columns that `kernels` names: path (metres), point, normal, distance from the edge;
    `triangle` is -1 where nothing was met.
    """

    met: FloatArray
    triangle: IntArray
    origin32: npt.NDArray[np.float32]
    direction32: npt.NDArray[np.float32]
    sent: IntArray
    asked: IntArray

    @staticmethod
    def blank(rows: int) -> Hits:
        """Room for so many rows."""
        return Hits(
            met=np.empty((rows, 8)),
            triangle=np.empty(rows, dtype=np.int64),
            origin32=np.empty((rows, 3), dtype=np.float32),
            direction32=np.empty((rows, 3), dtype=np.float32),
            sent=np.empty(rows, dtype=np.int64),
            asked=np.empty(rows, dtype=np.int64),
        )


@dataclass(frozen=True, eq=False)
class Limits:
    """Where paths end: on a screen (as `kernels` read it), after so many bounces; the first ray's number."""

    screen: tuple[float, ...]
    has_screen: bool
    max_bounces: int
    first: int


def _tree(corners: FloatArray, tolerance: float) -> Tree:
    from fringetrace import exact

    count, leaf = len(corners), exact.LEAF
    slack = 1e-9 + tolerance
    low, high = corners.min(axis=1) - slack, corners.max(axis=1) + slack
    leaves = 1 << max(0, (-(-count // leaf) - 1).bit_length())
    order = np.full(leaf * leaves, -1, dtype=np.int32)
    order[:count] = exact.arrange(np.ascontiguousarray((low + high).T), leaves)
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
    planes = _aligned(len(corners))
    planes[:, :3] = normal
    planes[:, 3] = -np.einsum("ij,ikj->i", normal, corners) / 3.0
    for k in range(3):
        inward = np.cross(normal, sides[:, k])
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        planes[:, 4 * k + 4 : 4 * k + 7] = inward
        planes[:, 4 * k + 7] = -np.einsum("ij,ij->i", inward, corners[:, k])
    return planes


def _aligned(rows: int) -> FloatArray:
    """Room for 16 numbers a row, each row in two cache lines."""
    raw = np.empty(16 * rows + 8)
    begin = (-raw.ctypes.data // 8) % 8
    return raw[begin : begin + 16 * rows].reshape(rows, 16)


def _topology(faces: IntArray, normal: FloatArray) -> tuple[bool, bool, FloatArray]:
    """Whether faces are wound alike, whether they close, and the cosines of the folds (f, 3).

    The cosine is between the normals of two faces that share an edge: -1 is a knife's edge. An edge
    that is not shared has NaN.
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
    cosine = np.full(len(edge), np.nan)
    cosine[shared] = np.einsum("ij,ij->i", normal[face], normal[other])
    return oriented, oriented and bool(shared.all()), cosine.reshape(-1, 3)


def _restart(cosine: float) -> float:
    """Distance from an edge, in the unit box, below which a restart is decided exactly.

    The step off the surface, up to `MARGIN` long, must not reach the other face of a fold.
    """
    from fringetrace.kernels import MARGIN

    angle = np.pi - np.arccos(np.clip(cosine, -1.0, 1.0))
    return float(MARGIN / max(np.sin(min(angle, 0.5 * np.pi)), 1e-3))


def _body(surfaces: tuple[Surface, ...], members: tuple[int, ...], first: int) -> Body:
    from fringetrace.kernels import GENTLE

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
    if not closed:  # perhaps only because equal vertices have different numbers
        oriented, closed, cosine = _topology(weld(local, faces)[1], planes[:, :3])
    sharpest = float(np.fmin.reduce(cosine, axis=None, initial=1.0))
    frame = np.empty(7)
    frame[:3], frame[3] = centre, scale
    frame[4] = np.sqrt((local**2).sum(axis=1).max()) * (1.0 + 1e-6) + 1e-5
    frame[5] = _restart(sharpest)
    frame[6] = 32.0 * EPSILON * (1.0 + np.abs(centre).max() * scale)
    gentle = np.packbits((cosine > GENTLE) & oriented, axis=1, bitorder="little")[:, 0]
    shells = _shells(meshes, planes, corners)
    return Body(first, local, faces, planes, gentle, frame, oriented, closed, members, *shells)


def _shells(
    meshes: list[Mesh], planes: FloatArray, corners: FloatArray
) -> tuple[npt.NDArray[np.bool_], tuple[FloatArray, FloatArray]]:
    """Which surfaces of a body are planes, and the box of each, in the unit box."""
    flat, lower, upper = [], [], []
    begin = 0
    for mesh in meshes:
        own = slice(begin, begin + len(mesh.faces))
        begin = own.stop
        height = corners[own] @ planes[own.start, :3] + planes[own.start, 3]
        flat.append(bool(np.abs(height).max() < FLAT))
        lower.append(corners[own].min(axis=(0, 1)) - ROOM)
        upper.append(corners[own].max(axis=(0, 1)) + ROOM)
    return np.array(flat), (np.array(lower), np.array(upper))


def _apart(one: Mesh, other: Mesh) -> bool:
    """Whether a plane stands clearly between two meshes: across an axis, or along a face of either."""
    normals = [np.eye(3)]
    for mesh in (one, other):
        corners = mesh.vertices[mesh.faces[:: max(1, len(mesh.faces) // FACES)]]
        normals.append(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    axes = np.concatenate(normals)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    hulls = [mesh.bounds if len(mesh.vertices) > MANY else mesh.vertices for mesh in (one, other)]
    # a large mesh is taken for its box, all eight corners of it
    points = [h if len(h) != 2 else np.stack(np.meshgrid(*h.T), axis=-1).reshape(-1, 3) for h in hulls]
    spans = [p @ axes.T for p in points]
    gap = np.maximum(
        spans[0].min(axis=0) - spans[1].max(axis=0), spans[1].min(axis=0) - spans[0].max(axis=0)
    ).max()
    size = max(float(np.ptp(mesh.bounds, axis=0).max()) for mesh in (one, other))
    return bool(gap > CLEAR * size)


def _leaky(mesh: Mesh) -> bool:
    """Whether a ray may slip through one of Embree's holes at vertices to what is behind: open, not flat."""
    corners = mesh.vertices[mesh.faces]
    first = corners[0]
    normal = np.cross(first[1] - first[0], first[2] - first[0])
    normal /= np.linalg.norm(normal)
    size = np.ptp(mesh.bounds, axis=0).max()
    if np.abs((corners - first[0]) @ normal).max() < FLAT * size:
        return False
    edges = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    number = np.sort(edges[:, 0] * len(mesh.vertices) + edges[:, 1])
    return bool(len(number) % 2 or (number[::2] != number[1::2]).any())


def _groups(surfaces: tuple[Surface, ...], alone: frozenset[int]) -> list[tuple[int, ...]]:
    """Which surfaces share a body: closed or flat ones of a size that stand clear of each other.

    What touches or nests stays apart, so that thin gaps are between bodies, where float64 decides.
    """
    apart = alone | {i for i, surface in enumerate(surfaces) if _leaky(surface.mesh)}
    groups: list[list[int]] = []
    for i, surface in enumerate(surfaces):
        home = None
        for group in groups if i not in apart else ():
            if group[0] in apart:
                continue
            bounds = np.array([surfaces[k].mesh.bounds for k in [*group, i]])
            smallest = np.ptp(bounds, axis=1).max(axis=1).min()
            extent = (bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)).max()
            if extent <= SPREAD * smallest and all(_apart(surface.mesh, surfaces[k].mesh) for k in group):
                home = group
                break
        if home is None:
            groups.append([i])
        else:
            home.append(i)
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
            # before threads share them
            _ = body.packed, body.embree
            bodies.append(body)
        scene.derived[name] = Engine(tuple(bodies), np.concatenate(owner), offset)
    engine: Engine = scene.derived[name]
    return engine


def plain(vertices: Float32, faces: IntArray) -> Callable[[Float32, Float32], tuple[Array, Float32, Float32]]:
    """Embree alone, all of it in float32: what others trace with, to compare with.

    Parameters
    ----------
    vertices : (v, 3) float32
    faces : (f, 3) int64

    Returns
    -------
    callable
        From origins and directions (n, 3) float32 to the triangles met (n,) int32, -1 for none,
        the paths to them (n,) float32, and their normals (n, 3) float32, not of unit length.
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, vertices, faces.astype(np.int32))

    def hits(origin: Float32, direction: Float32) -> tuple[Array, Float32, Float32]:
        answer = scene.run(origin, direction, output=1)
        return answer["primID"], answer["tfar"], answer["Ng"]

    return hits


def aim(
    engine: Engine, batch: Batch, rows: int, hits: Hits, number: int, fresh: bool, cull: bool = True
) -> int:
    """Float32 rays towards a body, into `hits`; returns how many of the batch can meet it."""
    from fringetrace import kernels

    body = engine.bodies[number]
    count: int = kernels.aim(
        rows, batch.state, batch.last, body.frame, body.first, body.stop, engine.owner,
        np.array(body.surfaces), body.flat, *body.boxes, cull, hits.met, hits.triangle,
        fresh, hits.origin32, hits.direction32, hits.sent,
    )  # fmt: skip
    return count


def _second(body: Body, batch: Batch, count: int, prim: npt.NDArray[np.int32], hits: Hits) -> None:
    """Other opinions, a little aside, on suspicious answers; -2 where one of them differs.

    Three of rays that come from elsewhere, one of rays that have just left this body.
    """
    from fringetrace import kernels

    for leaving, turns in ((False, 3), (True, 0 if body.closed else 1)):
        if turns == 0:
            continue
        found = kernels.suspect(
            hits.sent, count, prim, batch.state, batch.last, body.first, body.stop, body.closed,
            body.frame[4], body.planes, hits.origin32, leaving, hits.asked,
        )  # fmt: skip
        rows = hits.asked[:found]
        moved, heading = np.empty((2, found, 3), dtype=np.float32)
        first = prim[rows]
        for turn in range(turns if found else 0):
            kernels.beside(
                hits.sent, hits.asked, found, batch.state, batch.last, body.first, body.stop,
                hits.origin32, turn, moved, heading,
            )  # fmt: skip
            prim[rows[body.embree.run(moved, heading) != first]] = -2


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
    for number, body in enumerate(engine.bodies):
        if passed.issuperset(body.surfaces):
            continue
        count = aim(engine, batch, rows, hits, number, fresh)
        fresh = False
        if count == 0:
            continue
        prim = body.embree.run(origin32[:count], direction32[:count])
        _second(body, batch, count, prim, hits)
        doubtful += kernels.measure(
            hits.sent, count, prim, batch.state, batch.last, batch.straight, *body.packed, hits.met,
            hits.triangle,
        )  # fmt: skip
    if fresh:
        hits.met[:rows, 0] = np.inf
        hits.triangle[:rows] = -1
    return doubtful


def follow(
    engine: Engine, batch: Batch, rows: int, bounces: int, hits: Hits, ends: Ends, limits: Limits
) -> tuple[int, int, int]:
    """One more bounce of rays that have all just left the only body, all of ideal mirrors.

    Does what `find` and `kernels.interact` do, without amplitudes and in one pass over the rays.

    Parameters
    ----------
    engine : Engine
        Of one body.
    batch : Batch
    rows : int
        How many rays it holds.
    bounces : int
        How often each has been reflected.
    hits : Hits
        Its float32 rays are those of the batch; they are brought up to date.
    ends : Ends
    limits : Limits

    Returns
    -------
    rows, ended, doubtful : int
        How many rays go on, have ended now, were decided exactly.
    """
    from fringetrace import kernels

    body = engine.bodies[0]
    prim = body.embree.run(hits.origin32[:rows], hits.direction32[:rows])
    if not body.closed and prim.min() < 0:
        _second(body, batch, rows, prim, hits)
    result: tuple[int, int, int] = kernels.rebound(
        rows, bounces, prim, batch.state, batch.key, batch.ray, batch.last, batch.straight,
        *body.packed[2:], engine.digit, np.uint64(engine.base),
        limits.screen, limits.has_screen, limits.max_bounces, ends.origin, ends.direction, ends.length,
        ends.key, ends.ray, ends.bounces, ends.fate, 0, limits.first, hits.origin32, hits.direction32,
    )  # fmt: skip
    return result
