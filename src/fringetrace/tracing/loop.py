"""Tracing loop of a chunk of rays: hit, interact, split, drop, until all paths have ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

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


class Record:
    """Recorded triangles and points of a chunk's paths, by serial number: one column per pass.

    `left` is where light went on from those points; None where it did so from the points themselves.
    """

    def __init__(self, start: FloatArray) -> None:
        self.points = [start.copy()]
        self.left: list[FloatArray | None] = [None]
        self.triangles: list[Array] = []

    def born(self, parents: Array) -> None:
        """Add paths that split off in the latest pass."""
        self.points = [np.concatenate([column, column[parents]]) for column in self.points]
        self.left = [c if c is None else np.concatenate([c, c[parents]]) for c in self.left]
        self.triangles = [np.concatenate([column, column[parents]]) for column in self.triangles]

    def add(self, parents: Array, serials: Array, triangle: Array, point: FloatArray) -> None:
        """Append a pass: new branches inherit, those named by `serials` met a triangle."""
        self.born(parents)
        total = len(self.points[0])
        met, where = np.full(total, -1, dtype=np.int64), np.full((total, 3), np.nan)
        met[serials], where[serials] = triangle, point
        self.triangles.append(met)
        self.points.append(where)
        self.left.append(None)

    def displaced(self, serials: Array, point: FloatArray) -> None:
        """Paths that continue from another point than their hit in the latest pass."""
        column = self.points[-1].copy() if self.left[-1] is None else self.left[-1]
        column[serials] = point
        self.left[-1] = column


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


def _noted(record: Record, plan: Plan, before: dict[str, Array], ends: Ends, old: int, hits: Hits) -> None:
    """Write down a pass: every path that met something, on its way or at its end."""
    count = len(before["serial"])
    met = (hits.triangle[:count] >= 0) & (before["bounces"] < plan.max_bounces)
    landed = ends.serial[old:][ends.fate[old:] == Fate.DETECTED]
    met &= ~np.isin(before["serial"], landed)
    splits = abs(plan.reflection) * abs(plan.transmission) > 0.0
    parents = np.flatnonzero(met)
    parents = parents[splits[plan.engine.owner[hits.triangle[parents]]]]
    first = len(record.points[0])
    serials = np.concatenate([before["serial"][met], np.arange(first, first + len(parents))])
    rows = np.concatenate([np.flatnonzero(met), parents])
    record.add(before["serial"][parents], serials, hits.triangle[rows], hits.met[rows, 1:4])


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
    record = Record(rays.origin) if plan.record else None
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
            _noted(record, plan, before, part(ends, 0, ended), old, hits)
    return Chunk(ends, ended, rays, segments, doubtful, record)


def tables(plan: Plan, record: Record, ends: Ends) -> dict[str, Array]:
    """Recorded paths of a chunk as padded tables of `Paths`: surface, triangle, points, departures.

    Parameters
    ----------
    plan : Plan
    record : Record
    ends : Ends
        In the order of the tables' rows.

    Returns
    -------
    dict of str to array
        (m, b) int64, (m, b) int64, (m, b + 2, 3) float64 in metres; in scenes with thin elements
        (m, b + 1, 3) float64 in metres, too.
    """
    depth = int(ends.bounces.max(initial=0))
    none = np.full(len(record.points[0]), -1, dtype=np.int64)
    triangle = np.stack([*record.triangles, none], axis=1)[ends.serial, :depth]
    surface = np.where(triangle >= 0, plan.engine.owner[triangle], -1).astype(np.int64)
    points = np.full((len(triangle), depth + 2, 3), np.nan)
    points[:, : depth + 1] = np.stack(record.points[: depth + 1], axis=1)[ends.serial]
    landed = np.flatnonzero(ends.fate == Fate.DETECTED)
    points[landed, ends.bounces[landed] + 1] = ends.origin[landed]
    local = np.where(triangle >= 0, triangle - plan.engine.offset[surface], -1)
    found = {"surface": surface, "triangle": local, "points": points}
    if plan.matter is not None and plan.matter.elements:
        left = [at if on is None else on for at, on in zip(record.points, record.left, strict=True)]
        found["departures"] = np.stack(left[: depth + 1], axis=1)[ends.serial]
    return found


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
