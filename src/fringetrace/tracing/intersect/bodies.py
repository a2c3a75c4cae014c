"""Bodies: groups of surfaces, each with an Embree scene and a float64 tree of its own.

A body is moved and scaled by a power of two into the unit box, so that a lattice of 65 nm rods inside
a 0.3 m instrument keeps all the digits of float32. Nothing else knows Embree.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from threading import Lock
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray
from fringetrace.geometry import Mesh, weld

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
# A corner is moved out no farther than this many times what the sides are: it would be far for needles.
SHARP = 64.0
# How many faces lend their planes to the test for that, and from how many vertices on a box stands in.
FACES, MANY = 16, 10000


@dataclass(frozen=True, eq=False)
class Tree:
    """Bounding volume tree in float64: a complete binary tree of triangles."""

    corners: FloatArray  # (t, 9)
    order: npt.NDArray[np.int32]  # (4 * leaves,), -1 where empty
    lower: FloatArray  # (2 * leaves, 3); node 1 is the root
    upper: FloatArray


@dataclass(frozen=True, eq=False)
class Body:
    """Body: triangles that share an Embree scene, scaled into the unit box.

    `frame` holds centre (3, metres), scale (1/m, a power of two), and, in the unit box, the radius
    of the bounding sphere, the distance from an edge below which a restart is doubtful, and the
    rounding of a point that lies on a face.
    """

    first: int  # number of its first triangle
    vertices: FloatArray  # (v, 3), unit box
    faces: IntArray
    planes: FloatArray  # (t, 16)
    gentle: npt.NDArray[np.uint8]  # (t,), a bit for each shared edge with a fold of 26 degrees or less
    beside: IntArray  # (t, 3), the triangle across each edge, -1 if none or several
    frame: FloatArray  # (7,)
    oriented: bool
    closed: bool
    surfaces: tuple[int, ...]
    flat: npt.NDArray[np.bool_]  # (s,), a surface that is one plane
    boxes: tuple[FloatArray, FloatArray]  # (s, 3) each, lower and upper, a little larger than the surfaces
    lock: Lock = field(default_factory=Lock, repr=False)

    @property
    def stop(self) -> int:
        """Number after the body's last triangle."""
        return self.first + len(self.faces)

    def prepare(self) -> None:
        """Build both trees before threads share them; bodies that no ray comes near have none."""
        if "embree" not in vars(self):
            with self.lock:
                _ = self.packed, self.embree

    @cached_property
    def embree(self) -> Any:
        """Committed Embree scene."""
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        scene = EmbreeScene(_device(), robust=True)
        corners = _grown(self.vertices[self.faces], self.planes, self.beside)
        TriangleMesh(scene, corners, np.arange(3 * len(self.faces), dtype=np.int32).reshape(-1, 3))
        one = np.zeros((1, 3), dtype=np.float32)
        scene.run(one, one + np.float32(1.0))  # commits, before threads share it
        return scene

    @cached_property
    def tree(self) -> Tree:
        """Bounding volume tree in float64 that decides doubtful hits."""
        return _tree(self.vertices[self.faces], self.frame[6])

    @property
    def sheet(self) -> npt.NDArray[np.bool_]:
        """(s,) Which surfaces are one plane, of one layer as far as is known: no ray comes back to them."""
        layered = "crowd" in vars(self) and len(self.crowd) > 0
        return np.zeros_like(self.flat) if layered else self.flat

    @cached_property
    def crowd(self) -> FloatArray:
        """(t, 6) Where others are too near to each triangle for float32, as boxes; (0, 6) if nowhere."""
        from fringetrace.tracing.intersect import crowds

        tree = self.tree
        boxes = crowds.near(self.planes, tree.corners, tree.order, tree.lower, tree.upper, self.beside)
        return np.asarray(boxes if np.isfinite(boxes[:, 0]).any() else boxes[:0])

    @cached_property
    def packed(self) -> tuple[Any, ...]:
        """Body data in the form that the kernels read."""
        tree = (self.tree.corners, self.tree.order, self.tree.lower, self.tree.upper)
        return (
            self.first, self.stop, self.oriented, self.closed, self.frame, self.planes, self.gentle,
            self.crowd, tree,
        )  # fmt: skip


@cache
def _device() -> Any:
    """Embree itself, once a process."""
    # Each takes one of the 1024 keys that POSIX has for data of threads. Beyond these Embree gives none,
    # and a scene without one ends the interpreter.
    from embreex.rtcore import EmbreeDevice

    return EmbreeDevice()


def _tree(corners: FloatArray, tolerance: float) -> Tree:
    from fringetrace.tracing.intersect import exact

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


def _normals(sides: FloatArray) -> FloatArray:
    """Unit normals (t, 3) of triangles with sides (t, 3, 3), to all digits.

    From the two short sides: beside the longest one, a needle's third corner is lost in rounding.
    """
    longest = np.argmax((sides**2).sum(axis=2), axis=1)
    each = np.arange(len(sides))
    normal = np.cross(sides[each, (longest + 1) % 3], sides[each, (longest + 2) % 3])
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))


def _planes(corners: FloatArray) -> FloatArray:
    """Plane and three edge planes of each triangle; see `kernels`."""
    sides = np.roll(corners, -1, axis=1) - corners
    normal = _normals(sides)
    planes = _aligned(len(corners))
    planes[:, :3] = normal
    planes[:, 3] = -np.einsum("ij,ikj->i", normal, corners) / 3.0
    for k in range(3):
        inward = np.cross(normal, sides[:, k])
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        planes[:, 4 * k + 4 : 4 * k + 7] = inward
        planes[:, 4 * k + 7] = -np.einsum("ij,ij->i", inward, corners[:, k])
    return planes


def _grown(corners: FloatArray, planes: FloatArray, beside: IntArray) -> Float32:
    """Corners (3 t, 3) of triangles grown in their planes by `GROWN` on all sides, less at sharp corners.

    At each edge one of the two triangles grows, or both: Embree is a little slower where both do.
    """
    from fringetrace.tracing.intersect.crowds import spared
    from fringetrace.tracing.intersect.kernels import GROWN

    inward = planes[:, 4:].reshape(-1, 3, 4)[:, :, :3]
    between = inward + np.roll(inward, 1, axis=1)  # of the two edges at each corner
    least = 2.0 / SHARP**2
    outward = between / np.maximum((between**2).sum(axis=2, keepdims=True) * 0.5, least)
    outward[spared(beside)] = 0.0
    return np.asarray((corners - GROWN * outward).reshape(-1, 3), dtype=np.float32)


def _aligned(rows: int) -> FloatArray:
    """Room for 16 numbers a row, each row in two cache lines."""
    raw = np.empty(16 * rows + 8)
    begin = (-raw.ctypes.data // 8) % 8
    return raw[begin : begin + 16 * rows].reshape(rows, 16)


def _topology(faces: IntArray, normal: FloatArray) -> tuple[bool, bool, FloatArray, IntArray]:
    """Whether faces are wound alike, whether they close, the cosines of the folds, and who is beside whom.

    The cosine (f, 3) is between the normals of two faces that share an edge: -1 is a knife's edge. An edge
    that is not shared, or by more than two faces, has NaN, and -1 in the table of neighbours (f, 3).
    Faces are wound alike where each edge is used as often one way as the other, or once.
    """
    count = int(faces.max()) + 1
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edge, back = start * count + end, end * count + start
    order = np.argsort(edge, kind="stable")
    ordered = edge[order]
    partner = np.minimum(np.searchsorted(ordered, back), len(ordered) - 1)
    shared = ordered[partner] == back
    simple = bool((np.diff(ordered) > 0).all())
    oriented, closed = simple, simple and bool(shared.all())
    if not simple:  # several faces at an edge
        uses, returns = (
            np.searchsorted(ordered, key, side="right") - np.searchsorted(ordered, key)
            for key in (edge, back)
        )
        closed = bool((uses == returns).all())
        oriented = bool(((uses == returns) | ((uses == 1) & (returns == 0))).all())
        shared &= (uses == 1) & (returns == 1)
    face, other = np.flatnonzero(shared) // 3, order[partner[shared]] // 3
    cosine, beside = np.full(len(edge), np.nan), np.full(len(edge), -1, dtype=np.int64)
    cosine[shared], beside[shared] = np.einsum("ij,ij->i", normal[face], normal[other]), other
    return oriented, closed, cosine.reshape(-1, 3), beside.reshape(-1, 3)


def _restart(cosine: float) -> float:
    """Distance from an edge, in the unit box, below which a restart is decided exactly.

    The step off the surface, up to `MARGIN` long, must not reach the other face of a fold.
    """
    from fringetrace.tracing.intersect.kernels import MARGIN

    angle = np.pi - np.arccos(np.clip(cosine, -1.0, 1.0))
    return float(MARGIN / max(np.sin(min(angle, 0.5 * np.pi)), 1e-3))


def _joined(meshes: Sequence[Mesh]) -> tuple[FloatArray, IntArray]:
    """Vertices (metres) and faces of several meshes as one, without the vertices that no face uses."""
    shift = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, shift, strict=False)])
    used, faces = np.unique(faces, return_inverse=True)
    return vertices[used], np.ascontiguousarray(faces.reshape(-1, 3))


def unite(meshes: Sequence[Mesh], members: tuple[int, ...], first: int) -> Body:
    """Body of some of a scene's meshes.

    Parameters
    ----------
    meshes : sequence of Mesh
        Of all surfaces of the scene.
    members : tuple of int
        Which of them.
    first : int
        Number of its first triangle.

    Returns
    -------
    Body
    """
    from fringetrace.tracing.intersect.kernels import GENTLE

    own = [meshes[i] for i in members]
    vertices, faces = _joined(own)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    centre = low + 0.5 * (high - low)
    scale = 2.0 ** -np.ceil(np.log2(0.5 * (high - low).max()))
    local = (vertices - centre) * scale
    corners = local[faces]
    planes = _planes(corners)
    oriented, closed, cosine, beside = _topology(faces, planes[:, :3])
    if not closed:  # perhaps only because equal vertices have different numbers
        oriented, closed, cosine, beside = _topology(weld(local, faces)[1], planes[:, :3])
    sharpest = float(np.fmin.reduce(cosine, axis=None, initial=1.0))
    frame = np.empty(7)
    frame[:3], frame[3] = centre, scale
    frame[4] = np.sqrt((local**2).sum(axis=1).max()) * (1.0 + 1e-6) + 1e-5
    frame[5] = _restart(sharpest)
    frame[6] = 32.0 * EPSILON * (1.0 + np.abs(centre).max() * scale)
    gentle = np.packbits((cosine > GENTLE) & oriented, axis=1, bitorder="little")[:, 0]
    shells = _shells(own, planes, corners)
    return Body(first, local, faces, planes, gentle, beside, frame, oriented, closed, members, *shells)


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


def group(meshes: Sequence[Mesh], alone: frozenset[int] = frozenset()) -> list[tuple[int, ...]]:
    """Group meshes into bodies: closed or flat ones of similar size that do not touch share one.

    What touches or nests stays apart, so that thin gaps are between bodies, where float64 decides.

    Parameters
    ----------
    meshes : sequence of Mesh
        Of all surfaces of a scene.
    alone : set of int
        Those that need a body of their own.

    Returns
    -------
    list of tuple of int
    """
    apart = alone | {i for i, mesh in enumerate(meshes) if _leaky(mesh)}
    groups: list[list[int]] = []
    for i, mesh in enumerate(meshes):
        home = None
        for some in groups if i not in apart else ():
            if some[0] in apart:
                continue
            bounds = np.array([meshes[k].bounds for k in [*some, i]])
            smallest = np.ptp(bounds, axis=1).max(axis=1).min()
            extent = (bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)).max()
            if extent <= SPREAD * smallest and all(_apart(mesh, meshes[k]) for k in some):
                home = some
                break
        if home is None:
            groups.append([i])
        else:
            home.append(i)
    return [tuple(some) for some in groups]


def float32_hits(
    vertices: Float32, faces: IntArray
) -> Callable[[Float32, Float32], tuple[Array, Float32, Float32]]:
    """Hits by Embree alone, in float32, for comparison.

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
