"""Tracing loop of a chunk of rays: hit, interact, split, drop, until all paths have ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray
from fringetrace.scene import CCD, Beam, Scene
from fringetrace.tracing.batch import Batch, Carried, Ends, blank, grown, part
from fringetrace.tracing.fates import Fate
from fringetrace.tracing.rays import Rays, launch

if TYPE_CHECKING:
    from fringetrace.tracing.intersect.embree import Engine, Hits
    from fringetrace.tracing.intersect.on_forms import Formed
    from fringetrace.tracing.optics_table import Optics


@dataclass(frozen=True, eq=False)
class Plan:
    """Settings of a trace, shared by all threads.

    `plain`: all surfaces reflect with -1, so that amplitudes follow from the number of bounces.
    `splits`: some surface sends light both ways, so that a ray may have many ends. `matter` is None where
    light meets nothing but constant amplitudes in a vacuum.
    """

    scene: Scene
    source: Beam | Rays
    ccd: CCD | None
    engine: Engine
    forms: tuple[Formed, ...]
    passed: frozenset[int]
    reflection: ComplexArray
    transmission: ComplexArray
    screen: tuple[float, ...]
    max_bounces: int
    faint: float
    record: bool
    plain: bool
    splits: bool
    matter: Optics | None = None

    @property
    def total(self) -> int:
        """Number of rays."""
        source = self.source
        return source.shape[0] * source.shape[1] if isinstance(source, Beam) else len(source)

    def rays(self, first: int, stop: int) -> Rays:
        """Range of the rays."""
        source = self.source
        return launch(source, first, stop) if isinstance(source, Beam) else source.part(first, stop)


# What a record keeps of each hit, and what stands where there is none.
Column = tuple[float, type, tuple[int, ...]]  # fill, dtype, shape of an entry
HIT: dict[str, Column] = {
    "triangle": (-1, np.int64, ()),
    "point": (np.nan, np.float64, (3,)),
    "branch": (-1, np.int8, ()),
}
IN_MEDIA: dict[str, Column] = {
    "medium": (-1, np.int32, ()),
    "index": (np.nan, np.float64, ()),
}
AT_ELEMENTS: dict[str, Column] = {
    "departure": (np.nan, np.float64, (3,)),
    "advance": (0.0, np.float64, ()),
}


class Record:
    """Hits of the paths of a chunk, by serial number: a table for each pass.

    A path that parts from another inherits what that has met.
    """

    def __init__(self, start: FloatArray, plan: Plan) -> None:
        self.start = start.copy()
        self.key = np.zeros(len(start), dtype=np.uint64)
        self.passes: list[dict[str, Array]] = []
        matter = plan.matter
        self.columns = (
            HIT | (IN_MEDIA if matter else {}) | (AT_ELEMENTS if matter and matter.elements else {})
        )
        # branch that each digit of a key stands for
        numbers = [number for number, _ in plan.scene.digits]
        first = 2 * len(plan.scene.surfaces)
        further = [2 + numbers[first:k].count(numbers[k]) for k in range(first, len(numbers))]
        self.branches = np.array([0, *[0, 1] * len(plan.scene.surfaces), *further], dtype=np.int8)

    def born(self, parents: Array) -> None:
        """Add paths that split off."""

        def grown(column: Array) -> Array:
            return np.concatenate([column, column[parents]])

        if len(parents):
            self.start, self.key = grown(self.start), grown(self.key)
            self.passes = [{name: grown(column) for name, column in one.items()} for one in self.passes]

    def met(self, serials: Array, triangle: Array, point: FloatArray) -> None:
        """Add a pass in which paths hit triangles."""
        rows = len(self.key)
        blank: dict[str, Array] = {
            n: np.full((rows, *shape), fill, kind) for n, (fill, kind, shape) in self.columns.items()
        }
        self.passes.append(blank)
        self.write(serials, triangle=triangle, point=point)

    def went_on(self, serials: Array, key: npt.NDArray[np.uint64], **columns: Array) -> None:
        """Write the branches that paths took in the latest pass: their keys, and more."""
        base = np.uint64(len(self.branches))
        digit = key - base * self.key[serials]  # modulo 2^64, as keys are
        self.key[serials] = key
        self.write(serials, branch=self.branches[digit.astype(np.int64)], **columns)

    def write(self, serials: Array, **columns: Array) -> None:
        """Fill columns of the latest pass."""
        for name, values in columns.items():
            if name in self.columns:
                self.passes[-1][name][serials] = values

    def table(self, name: str, serials: Array, depth: int) -> Array:
        """Column of the first passes for some paths, (m, depth, ...)."""
        fill, kind, shape = self.columns[name]
        table: Array = np.full((len(serials), depth, *shape), fill, kind)
        for k, one in enumerate(self.passes[:depth]):
            table[:, k] = one[name][serials]
        return table


@dataclass(frozen=True, eq=False)
class Chunk:
    """Ended paths of a chunk of rays, as many as `rows`."""

    ends: Ends
    rows: int
    rays: Rays
    segments: int
    doubtful: int
    record: Record | None
    matter: Carried | None = None
    contradictions: Array | None = None


@dataclass(eq=False)
class Workspace:
    """Arrays that a thread reuses from chunk to chunk."""

    state: Batch
    hits: Hits
    ends: Ends
    carried: Carried | None = None
    brought: Carried | None = None

    @staticmethod
    def blank(plan: Plan, rows: int) -> Workspace:
        """Uninitialised arrays for so many rays, and for their branches where they split."""
        from fringetrace.tracing.intersect.embree import Hits

        room = rows * (4 if plan.splits else 1)
        space = Workspace(blank(Batch, room), Hits.blank(room), blank(Ends, room))
        if (matter := plan.matter) is not None:
            shape = len(matter.media), matter.polarised, matter.fading
            space.carried, space.brought = Carried.blank(room, *shape), Carried.blank(room, *shape)
        return space


def _noted(
    record: Record, plan: Plan, before: dict[str, Array], space: Workspace, rows: int, ended: slice
) -> None:
    """Write down a pass: every path that met something, on its way or at its end."""
    hits, ends = space.hits, part(space.ends, ended.start, ended.stop)
    count = len(before["serial"])
    met = (hits.triangle[:count] >= 0) & (before["bounces"] < plan.max_bounces)
    met &= ~np.isin(before["serial"], ends.serial[ends.fate == Fate.DETECTED])
    splits = abs(plan.reflection) * abs(plan.transmission) > 0.0
    parents = np.flatnonzero(met)
    parents = parents[splits[plan.engine.owner[hits.triangle[parents]]]]
    first = len(record.key)
    serials = np.concatenate([before["serial"][met], np.arange(first, first + len(parents))])
    chosen = np.concatenate([np.flatnonzero(met), parents])
    record.born(before["serial"][parents])
    record.met(serials, hits.triangle[chosen], hits.met[chosen, 1:4])
    stopped = np.isin(ends.fate, (Fate.ABSORBED, Fate.FAINT))
    record.went_on(
        np.concatenate([space.state.serial[:rows], ends.serial[stopped]]),
        np.concatenate([space.state.key[:rows], ends.key[stopped]]),
    )


def nearest(plan: Plan, space: Workspace, count: int, passed: frozenset[int]) -> int:
    """Find the nearest hits of the rays of a workspace, on exact forms where there are any.

    Parameters
    ----------
    plan : Plan
    space : Workspace
    count : int
        How many rays it holds.
    passed : set of surface numbers
        Surfaces to be passed over.

    Returns
    -------
    int
        How many rays were decided exactly.
    """
    if plan.forms:
        from fringetrace.tracing.intersect import on_forms

        return on_forms.find(plan.engine, plan.forms, space.state, count, space.hits, passed)
    from fringetrace.tracing.intersect import embree

    return embree.find(plan.engine, space.state, count, space.hits, passed)


def advance(plan: Plan, space: Workspace, ends: Ends | None, first: int, stop: int) -> Chunk:
    """Trace rays to all their ends.

    Parameters
    ----------
    plan : Plan
    space : Workspace
    ends : Ends, optional
        Where they end, a row for each ray, where no ray splits. Default: in the workspace.
    first, stop : int
        Which rays: from and to.

    Returns
    -------
    Chunk
    """
    from fringetrace.tracing.intersect.embree import Hits, Limits, aim, follow
    from fringetrace.tracing.kernels_mirrors import interact

    rays = plan.rays(first, stop)
    if len(space.state.ray) < len(rays):
        space.state, space.hits = blank(Batch, len(rays)), Hits.blank(len(rays))
    start(space.state, rays, first)
    record = Record(rays.origin, plan) if plan.record else None
    ordered = ends is not None
    ends = space.ends if ends is None else ends
    count, ended, serials, segments, doubtful, bounces = len(rays), 0, len(rays), 0, 0, 1
    passed = plan.passed
    limits = Limits(plan.screen, plan.ccd is not None, plan.max_bounces, first)
    simple = plan.plain and ordered and len(plan.engine.bodies) == 1 and not plan.forms
    while count:
        if simple and segments:
            segments += count
            count, _, unsure = follow(plan.engine, space.state, count, bounces, space.hits, ends, limits)
            bounces += 1
            doubtful += unsure
            continue
        if plan.splits and 2 * count > len(space.state.ray):
            space.state, space.hits = grown(space.state, 4 * count), Hits.blank(4 * count)
        if not ordered and ended + (2 if plan.splits else 1) * count > len(ends.ray):
            space.ends = ends = grown(ends, 2 * (ended + 2 * count))
        state, hits = space.state, space.hits
        segments += count
        doubtful += nearest(plan, space, count, passed)
        passed = frozenset()
        before: dict[str, Array] = {}
        if record is not None:
            before = {"serial": state.serial[:count].copy(), "bounces": state.bounces[:count].copy()}
        old = ended
        count, ended, serials = interact(
            count, state.columns, hits.met, hits.triangle, plan.engine.owner, plan.reflection,
            plan.transmission, plan.plain, limits.packed, plan.faint, ends.columns, ended,
            first if ordered else -1, serials,
        )  # fmt: skip
        if simple:
            aim(plan.engine, state, count, hits, 0, True, cull=False)
        if record is not None:
            _noted(record, plan, before, space, count, slice(old, ended))
    return Chunk(ends, ended, rays, segments, doubtful, record)


def tables(plan: Plan, record: Record, ends: Ends) -> dict[str, Array]:
    """Recorded paths of a chunk as the padded tables of `Paths`, from `surface` to `advances`.

    Parameters
    ----------
    plan : Plan
    record : Record
    ends : Ends
        In the order of the tables' rows.

    Returns
    -------
    dict of str to array
        See `Paths`.
    """
    depth, rows = int(ends.bounces.max(initial=0)), ends.serial
    found = {name: record.table(name, rows, depth) for name in record.columns}
    triangle = found.pop("triangle")
    surface = np.where(triangle >= 0, plan.engine.owner[triangle], -1).astype(np.int64)
    points = np.full((len(rows), depth + 2, 3), np.nan)
    points[:, 0], points[:, 1 : depth + 1] = record.start[rows], found.pop("point")
    landed = np.flatnonzero(ends.fate == Fate.DETECTED)
    points[landed, ends.bounces[landed] + 1] = ends.origin[landed]
    local = np.where(triangle >= 0, triangle - plan.engine.offset[surface], -1)
    kept = {"surface": surface, "triangle": local, "points": points, "branch": found.pop("branch")}
    if plan.matter is not None:
        media = np.zeros((len(rows), 1), dtype=np.int32), found.pop("medium")
        index = np.full((len(rows), 1), plan.matter.media[0].real), found.pop("index")
        kept |= {"media": np.concatenate(media, axis=1), "indices": np.concatenate(index, axis=1)}
    if "departure" in found:
        kept["departures"] = np.concatenate([points[:, :1], found["departure"]], axis=1)
        kept["advances"] = found["advance"]
    return kept


def start(state: Batch, rays: Rays, first: int) -> None:
    """Initialise a batch with rays at their start.

    Parameters
    ----------
    state : Batch
        At least as many rows as there are rays.
    rays : Rays
    first : int
        Number of the first of them.
    """
    from fringetrace.tracing.kernels_mirrors import begin

    begin(rays.origin, rays.direction, rays.length, first, state.columns)
