"""The bounce passes: hit, interact, split, drop the finished, again; in chunks, on a thread pool."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

from fringetrace.engine import Engine, Hits, build, find
from fringetrace.paths import Fate, Paths, join, pixels
from fringetrace.rays import Batch, Rays, blank, launch, start
from fringetrace.scene import CCD, Beam, Scene
from fringetrace.vectors import frame
from fringetrace.waves import Array, ComplexArray, FloatArray

Progress = Callable[[int, int], None]
Result = TypeVar("Result")
# 16k rays keep a chunk's columns in the cache and Embree's traversal coherent.
CHUNK = 16384


@dataclass(frozen=True, eq=False)
class Plan:
    """All that a chunk needs to know, the same for every thread.

    `plain`: all surfaces reflect with -1, so that amplitudes follow from the number of bounces.
    `splits`: some surface sends light both ways, so that a ray may have many ends.
    """

    scene: Scene
    source: Beam | Rays
    ccd: CCD | None
    engine: Engine
    passed: frozenset[int]
    reflection: ComplexArray
    transmission: ComplexArray
    screen: FloatArray
    max_bounces: int
    faint: float
    record: bool
    plain: bool
    splits: bool

    @property
    def total(self) -> int:
        """How many rays there are."""
        source = self.source
        return source.shape[0] * source.shape[1] if isinstance(source, Beam) else len(source)

    def rays(self, first: int, stop: int) -> Rays:
        """Some of the rays."""
        source = self.source
        return launch(source, first, stop) if isinstance(source, Beam) else source.part(first, stop)


def _screen(ccd: CCD | None) -> FloatArray:
    """A CCD as the kernels read it: centre, normal, u, v, half width, half height, focus."""
    if ccd is None:
        return np.zeros(15)
    u, v, n = frame(ccd.normal, ccd.up, "CCD")
    width, height = ccd.size
    return np.concatenate([ccd.centre, n, u, v, [0.5 * width, 0.5 * height, ccd.focus]])


def _whole(value: int, least: int, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise ValueError(f"{what}: expected a whole number of at least {least}, got {value!r}")
    return int(value)


def _plan(
    scene: Scene, source: Beam | Rays, ccd: CCD | None, max_bounces: int, min_amplitude: float, record: bool
) -> Plan:
    if not isinstance(scene, Scene):
        raise TypeError(f"trace: expected a Scene, got {type(scene).__name__}")
    if not isinstance(source, (Beam, Rays)):
        raise TypeError(f"trace: expected a Beam or Rays, got {type(source).__name__}")
    if ccd is not None and not isinstance(ccd, CCD):
        raise TypeError(f"trace: expected a CCD or None, got {type(ccd).__name__}")
    _whole(max_bounces, 0, "max_bounces")
    if not (np.isfinite(min_amplitude) and min_amplitude >= 0.0):
        raise ValueError(f"min_amplitude: expected a number of at least 0, got {min_amplitude!r}")
    passed = frozenset(scene.index(name) for name in source.passes)
    interfaces = [surface.interface for surface in scene.surfaces]
    reflection = np.array([complex(interface.reflection) for interface in interfaces])
    transmission = np.array([complex(interface.transmission) for interface in interfaces])
    return Plan(
        scene=scene,
        source=source,
        ccd=ccd,
        engine=build(scene, passed),
        passed=passed,
        reflection=reflection,
        transmission=transmission,
        screen=_screen(ccd),
        max_bounces=max_bounces,
        faint=float(min_amplitude) ** 2,
        record=record,
        plain=bool((reflection == -1.0).all() and not transmission.any()),
        splits=bool((abs(reflection) * abs(transmission)).any()),
    )


class _Record:
    """Surfaces, triangles and points of a chunk, one column for each pass."""

    def __init__(self, start: FloatArray) -> None:
        self.points = [start]
        self.triangles: list[Array] = []

    def add(self, state: Batch, before: Array, rows: int) -> None:
        """Append a pass: each row that met something since had `before` bounces; new rows inherit."""
        old = len(before)
        new = np.arange(old, rows)
        parent = state.parent[old:rows]
        self.points = [np.concatenate([column, column[parent]]) for column in self.points]
        self.triangles = [np.concatenate([column, column[parent]]) for column in self.triangles]
        met = np.flatnonzero(state.bounces[:old] > before)
        met = np.concatenate([met, new])
        triangle, point = np.full(rows, -1, dtype=np.int64), np.full((rows, 3), np.nan)
        triangle[met] = state.last[met]
        # where the ray is now, and not at the CCD: rows that landed met nothing in this pass
        point[met] = state.origin[met]
        self.triangles.append(triangle)
        self.points.append(point)


@dataclass(frozen=True, eq=False)
class Ends:
    """What is known of a chunk beside its batch."""

    rays: Rays
    segments: int
    doubtful: int
    record: _Record | None


def _advance(plan: Plan, state: Batch, first: int, stop: int) -> tuple[Batch, Ends]:
    """Follow the rays from `first` up to `stop` to all their ends, in the rows of a batch.

    Returns the batch (a larger one, if rays split) and what else is known of the chunk.
    """
    from fringetrace import kernels

    rays = plan.rays(first, stop)
    start(state, rays, first, kernels.ALIVE)
    hits = Hits.empty(len(rays))
    record = _Record(state.origin.copy()) if plan.record else None
    rows, count, segments, doubtful = len(rays), len(rays), 0, 0
    active = np.arange(rows)
    passed = plan.passed
    while count:
        if plan.splits and rows + count > len(state.ray):
            capacity = 2 * (rows + count)
            state, hits = state.grown(capacity), Hits.empty(capacity)
        segments += count
        doubtful += find(plan.engine, state, active[:count], hits, passed)
        passed = frozenset()
        before = state.bounces[:rows].copy() if record else None
        kept, top = kernels.interact(
            active, count, rows, state.origin, state.direction, state.length, state.amplitude, state.bounces,
            state.reflections, state.key, state.fate, state.ray, state.last, state.normal, state.edge,
            state.straight, state.lost, state.parent, hits.path, hits.triangle, hits.point, hits.facet,
            hits.rim, plan.engine.owner, plan.reflection, plan.transmission, plan.plain, plan.screen,
            plan.ccd is not None, plan.max_bounces, plan.faint,
        )  # fmt: skip
        if record is not None and before is not None:
            record.add(state, before, top)
        if top > rows:
            born = np.arange(rows, top)
            active = np.concatenate([active[:kept], born[state.fate[rows:top] == kernels.ALIVE]])
            kept = len(active)
        rows, count = top, kept
    return state.part(0, rows), Ends(rays, segments, doubtful, record)


def _recorded(plan: Plan, record: _Record, state: Batch, order: Array | slice) -> dict[str, Array]:
    """The record as the padded tables of `Paths`."""
    none = np.empty((len(state.ray), 0), dtype=np.int64)
    hits = np.stack(record.triangles, axis=1)[order] if record.triangles else none
    depth = int(state.bounces.max(initial=0))
    triangle = hits[:, :depth]
    surface = np.where(triangle >= 0, plan.engine.owner[triangle], -1).astype(np.int64)
    points = np.full((len(hits), depth + 2, 3), np.nan)
    points[:, : depth + 1] = np.stack(record.points[: depth + 1], axis=1)[order]
    ends = np.flatnonzero(state.fate[order] == Fate.DETECTED)
    points[ends, state.bounces[order][ends] + 1] = state.origin[order][ends]
    local = np.where(triangle >= 0, triangle - plan.engine.offset[surface], -1)
    return {"surface": surface, "triangle": local, "points": points}


def _paths(
    plan: Plan, state: Batch, first: int, launched: ComplexArray, segments: int, doubtful: int,
    record: _Record | None = None,
) -> Paths:  # fmt: skip
    """The table of a finished batch, sorted by ray; `launched` are the amplitudes from ray `first` on."""
    order: Array | slice = slice(None)
    if plan.splits:
        # branches were made in an order that does not depend on the other rays: a stable sort keeps it
        order = np.argsort(state.ray, kind="stable")
    fate, origin, bounces = state.fate[order], state.origin[order], state.bounces[order]
    amplitude, reflections = state.amplitude[order], state.reflections[order]
    if plan.plain:
        reflections = bounces
        amplitude = 1.0 - 2.0 * (bounces % 2)
    relative = launched[state.ray[order] - first]
    pixel = np.full((len(fate), 2), np.nan)
    if plan.ccd is not None:
        seen = np.flatnonzero(fate == Fate.DETECTED)
        pixel[seen] = pixels(plan.ccd, origin[seen])
    return Paths(
        ray=state.ray[order],
        fate=fate,
        bounces=bounces,
        reflections=reflections,
        length=state.length[order],
        origin=origin,
        direction=state.direction[order],
        amplitude=relative * amplitude,
        lost=state.lost[order] * np.abs(relative) ** 2,
        key=state.key[order],
        pixel=pixel,
        area=plan.source.area,
        incident=float((np.abs(launched) ** 2).sum()),
        segments=segments,
        doubtful=doubtful,
        scene=plan.scene,
        source=plan.source,
        ccd=plan.ccd,
        **({} if record is None else _recorded(plan, record, state, order)),
    )


def _chunk(plan: Plan, first: int, stop: int) -> Paths:
    """Paths of the rays from `first` up to `stop`."""
    state, ends = _advance(plan, blank(stop - first), first, stop)
    launched = np.asarray(ends.rays.amplitude)
    return _paths(plan, state, first, launched, ends.segments, ends.doubtful, ends.record)


def _pooled(
    work: Callable[[int, int], Result], total: int, threads: int | None, chunk: int, progress: Progress | None
) -> Iterator[Result]:
    """Work on chunks, some ahead of the reader on as many threads; the results in order."""
    workers = (os.cpu_count() or 1) if threads is None else threads
    starts = iter(range(0, max(total, 1), chunk))
    with ThreadPoolExecutor(workers, thread_name_prefix="fringetrace") as pool:
        waiting: deque[tuple[int, Future[Result]]] = deque()
        try:
            while True:
                while len(waiting) < 2 * workers and (first := next(starts, None)) is not None:
                    stop = min(first + chunk, total)
                    waiting.append((stop, pool.submit(work, first, stop)))
                if not waiting:
                    return
                done, future = waiting.popleft()
                yield future.result()
                if progress is not None:
                    progress(done, total)
        finally:
            for _, future in waiting:
                future.cancel()


def _at_once(plan: Plan, threads: int | None, chunk: int, progress: Progress | None) -> Paths:
    """All rays in one table from the start: where no ray splits, each has its row."""
    state, launched = blank(plan.total), np.empty(plan.total, dtype=np.complex128)

    def work(first: int, stop: int) -> tuple[int, int]:
        _, ends = _advance(plan, state.part(first, stop), first, stop)
        launched[first:stop] = ends.rays.amplitude
        return ends.segments, ends.doubtful

    counts = list(_pooled(work, plan.total, threads, chunk, progress))
    segments, doubtful = (sum(count) for count in zip(*counts, strict=True))
    return _paths(plan, state, 0, launched, segments, doubtful)


def stream(
    scene: Scene,
    source: Beam | Rays,
    ccd: CCD | None = None,
    *,
    max_bounces: int = 12,
    min_amplitude: float = 1e-6,
    record: bool = False,
    threads: int | None = None,
    chunk: int = CHUNK,
    progress: Progress | None = None,
) -> Iterator[Paths]:
    """Trace in chunks that need not fit into memory together; arguments as for `trace`.

    Parameters
    ----------
    scene, source, ccd, max_bounces, min_amplitude, record, threads, chunk, progress
        See `trace`.

    Yields
    ------
    Paths
        Of consecutive rays, in their order.
    """
    plan = _plan(scene, source, ccd, max_bounces, min_amplitude, record)
    workers = None if threads is None else _whole(threads, 1, "threads")
    return _pooled(partial(_chunk, plan), plan.total, workers, _whole(chunk, 1, "chunk"), progress)


def trace(
    scene: Scene,
    source: Beam | Rays,
    ccd: CCD | None = None,
    *,
    max_bounces: int = 12,
    min_amplitude: float = 1e-6,
    record: bool = False,
    threads: int | None = None,
    chunk: int = CHUNK,
    progress: Progress | None = None,
) -> Paths:
    """Follow rays through a scene until they are detected, leave, or are cut off.

    Parameters
    ----------
    scene : Scene
    source : Beam or Rays
    ccd : CCD, optional
        None: rays are followed until they leave.
    max_bounces : int
        Surfaces that a path may meet; a path that would meet one more is `TRUNCATED`.
    min_amplitude : float
        A branch whose amplitude falls below this part of the launched one is `FAINT`.
    record : bool
        Keep every hit (`Paths.polyline`, `surface`, `triangle`).
    threads : int, optional
        Default: one for each core. Results are the same bits for any number.
    chunk : int
        Rays a thread follows at a time. Results are the same bits for any number.
    progress : callable, optional
        Called with (rays done, rays in all) after each chunk.

    Returns
    -------
    Paths

    Raises
    ------
    TypeError
        If an argument is of the wrong kind.
    ValueError
        For counts or amplitudes below 0, or names of unknown surfaces in the source's `passes`.
    """
    plan = _plan(scene, source, ccd, max_bounces, min_amplitude, record)
    workers = None if threads is None else _whole(threads, 1, "threads")
    size = _whole(chunk, 1, "chunk")
    if not (plan.splits or record):
        return _at_once(plan, workers, size, progress)
    return join(list(_pooled(partial(_chunk, plan), plan.total, workers, size, progress)))
