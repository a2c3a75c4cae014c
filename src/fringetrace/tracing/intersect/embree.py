"""Nearest hit: Embree finds the triangle, float64 measures it, the nearest over all bodies wins."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray
from fringetrace.scene import Scene, once_per_scene
from fringetrace.tracing.batch import Batch
from fringetrace.tracing.intersect.bodies import Body, IntArray, group, unite
from fringetrace.tracing.optics_table import sides


@dataclass(frozen=True, eq=False)
class Engine:
    """Intersection engine: the bodies of a scene, and the surface of each triangle.

    `owner` (t,) is the surface of a triangle, `offset` (surfaces,) the number of its first one, `sides`
    (surfaces, 2) the media beside it, see `optics_table.sides`.
    """

    bodies: tuple[Body, ...]
    owner: npt.NDArray[np.int32]
    offset: IntArray
    sides: npt.NDArray[np.int32]

    @cached_property
    def grain(self) -> FloatArray:
        """(surfaces,) metres: how far rounding may take a hit off each surface."""
        table = np.empty(len(self.offset))
        for body in self.bodies:
            table[list(body.surfaces)] = body.frame[6] / body.frame[3]
        return table

    def contact(self, batch: Batch, medium: Array | None) -> tuple[Array, ...]:
        """What decides about faces at the same place, as the kernels take it."""
        if medium is None:
            medium = np.zeros(len(batch.last), dtype=np.int32)
        return self.owner, self.sides, self.grain, medium, batch.crossed, batch.last

    @property
    def base(self) -> int:
        """Base of path keys, whose digits name surface and branch."""
        return 2 * len(self.offset) + 1

    @cached_property
    def digit(self) -> Array:
        """Path-key digit of a reflection at each triangle, (t,), in a small dtype."""
        return (2 * self.owner + 1).astype(np.min_scalar_type(self.base))


@dataclass(frozen=True, eq=False)
class Hits:
    """Last hit of each row of a batch, and the queries to Embree (float32).

    `met` has the columns that `kernels` names: path (metres), point, normal, distance from the edge;
    `triangle` is -1 where nothing was met.
    """

    met: FloatArray
    triangle: IntArray
    origin32: npt.NDArray[np.float32]
    direction32: npt.NDArray[np.float32]
    sent: IntArray

    @staticmethod
    def blank(rows: int) -> Hits:
        """Uninitialised table of so many rows."""
        return Hits(
            met=np.empty((rows, 8)),
            triangle=np.empty(rows, dtype=np.int64),
            origin32=np.empty((rows, 3), dtype=np.float32),
            direction32=np.empty((rows, 3), dtype=np.float32),
            sent=np.empty(rows, dtype=np.int64),
        )


@once_per_scene
def build(scene: Scene, alone: frozenset[int] = frozenset()) -> Engine:
    """Build the intersection engine of a scene, once; it is kept with the scene.

    Parameters
    ----------
    scene : Scene
    alone : set of surface numbers
        Those that need a body of their own, because some rays pass over them.

    Returns
    -------
    Engine
    """
    bodies: list[Body] = []
    offset = np.zeros(len(scene.surfaces), dtype=np.int64)
    owner: list[Array] = []
    first = 0
    meshes = [surface.mesh for surface in scene.surfaces]
    for members in group(meshes, alone):
        body = unite(meshes, members, first)
        for i in members:
            offset[i] = first
            first += len(meshes[i].faces)
            owner.append(np.full(len(meshes[i].faces), i, dtype=np.int32))
        bodies.append(body)
    return Engine(tuple(bodies), np.concatenate(owner), offset, sides(scene))


def aim(
    engine: Engine, batch: Batch, rows: int, hits: Hits, number: int, fresh: bool, cull: bool = True
) -> int:
    """Write float32 rays towards a body into `hits`; number of rays that can meet it."""
    from fringetrace.tracing.intersect import kernels

    body = engine.bodies[number]
    count: int = kernels.aim(
        rows, batch.state, batch.last, body.frame, body.first, body.stop, engine.owner,
        np.array(body.surfaces), body.sheet, *body.boxes, cull, hits.met, hits.triangle,
        fresh, hits.origin32, hits.direction32, hits.sent,
    )  # fmt: skip
    return count


def find(
    engine: Engine,
    batch: Batch,
    rows: int,
    hits: Hits,
    passed: frozenset[int] = frozenset(),
    medium: Array | None = None,
) -> int:
    """Find the nearest hit of each ray, into `hits`.

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
    medium : int32, optional
        Number of the medium that each ray is in, at least as many rows; default all 0.

    Returns
    -------
    int
        How many rays were decided exactly.
    """
    from fringetrace.tracing.intersect import kernels

    origin32, direction32 = hits.origin32, hits.direction32
    contact = engine.contact(batch, medium)
    doubtful = 0
    fresh = True
    for number, body in enumerate(engine.bodies):
        if passed.issuperset(body.surfaces):
            continue
        count = aim(engine, batch, rows, hits, number, fresh)
        fresh = False
        if count == 0:
            continue
        body.prepare()
        prim = body.embree.run(origin32[:count], direction32[:count])
        doubtful += kernels.measure(
            hits.sent, count, prim, batch.state, batch.last, batch.came, contact, body.packed, hits.met,
            hits.triangle,
        )  # fmt: skip
    if fresh:
        hits.met[:rows, 0] = np.inf
        hits.triangle[:rows] = -1
    return doubtful
