"""Ray tracer: a beam or rays through a scene, chunk by chunk on a thread pool."""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from numbers import Real
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

import numpy as np

from fringetrace.core import ComplexArray, checked_whole, warn_once
from fringetrace.scene import CCD, Beam, Scene, screen
from fringetrace.tracing.batch import Ends, Light, blank, part
from fringetrace.tracing.checks import Losses
from fringetrace.tracing.loop import Chunk, advance
from fringetrace.tracing.paths import Paths, join
from fringetrace.tracing.plan import Plan, TraceLimits
from fringetrace.tracing.rays import Rays
from fringetrace.tracing.record import tables
from fringetrace.tracing.workspace import Workspace

Progress = Callable[[int, int], None]
Result = TypeVar("Result")
# Fewer rays: what a pass costs in Python shows (30 us each). More: memory, 10 MB a thread here.
CHUNK = 32768
# Bounces are counted in 32 bits; no trace lives to see so many.
MOST = 2**31 - 2


@dataclass(frozen=True)
class Options:
    """How to trace; see `trace`."""

    wavelength: float | None
    max_bounces: int
    min_amplitude: float
    record: bool
    threads: int | None
    chunk: int | None
    progress: Progress | None

    def __post_init__(self) -> None:
        checked_whole(self.max_bounces, 0, "max_bounces")
        least = self.min_amplitude
        if not (isinstance(least, Real) and np.isfinite(least) and least >= 0.0):
            raise ValueError(f"min_amplitude: expected a number of at least 0, got {least!r}")
        for name in ("threads", "chunk"):
            if getattr(self, name) is not None:
                checked_whole(getattr(self, name), 1, name)

    def rays_at_a_time(self, splits: bool) -> int:
        """Rays that a thread follows at a time: fewer where each may become several."""
        return self.chunk or (CHUNK // 4 if splits else CHUNK)


def _plan(
    scene: Scene, source: Beam | Rays, ccd: CCD | None, options: Options, warned: set[str] | None
) -> Plan:
    if not isinstance(scene, Scene):
        raise TypeError(f"trace: expected a Scene, got {type(scene).__name__}")
    if not isinstance(source, (Beam, Rays)):
        raise TypeError(f"trace: expected a Beam or Rays, got {type(source).__name__}")
    if ccd is not None and not isinstance(ccd, CCD):
        raise TypeError(f"trace: expected a CCD or None, got {type(ccd).__name__}")
    from fringetrace.tracing.intersect.embree import build
    from fringetrace.tracing.intersect.on_forms import formed
    from fringetrace.tracing.optics_table import optics

    met = optics(scene, options.wavelength, source.polarisation is not None)
    passed = frozenset(scene.index(name) for name in source.passes)
    engine = build(
        scene, passed | {i for i, surface in enumerate(scene.surfaces) if surface.form is not None}
    )
    limits = TraceLimits(
        screen=(0.0,) * 15 if ccd is None else screen(ccd),
        has_screen=ccd is not None,
        max_bounces=min(int(options.max_bounces), MOST),
        faint=float(options.min_amplitude) ** 2,
        key_base=len(scene.digits) + 1,
    )
    forms = formed(scene, engine)
    return Plan(scene, source, ccd, engine, forms, passed, met, limits, options.record, warned)


def _paths(plan: Plan, chunk: Chunk) -> Paths:
    """The table of what has ended, sorted by ray."""
    ends, light, launched = chunk.ends, chunk.light, chunk.launched
    if not chunk.sorted:
        from fringetrace.tracing.kernels_rays import sort

        # a ray's ends come in an order that does not depend on other rays: a stable sort keeps it
        order = sort(ends.ray, chunk.first, len(launched))
        ends = part(ends, order)
        light = None if light is None else part(light, order)
    # a broadcast 1 (no strides) stands for amplitudes that are all 1
    relative = launched[ends.ray - chunk.first] if len(ends.ray) > len(launched) else launched
    if plan.optics.surfaces.ideal:
        reflections, lost = ends.bounces, np.zeros(len(ends.ray))
        amplitude = np.array([1.0, -1.0], dtype=np.complex128)[ends.bounces & 1]
        if launched.strides != (0,):  # not all 1
            amplitude *= relative
    else:
        reflections, lost = ends.reflections, ends.lost * np.abs(relative) ** 2
        polarised = plan.optics.polarised and light is not None
        amplitude = (abs(relative) if polarised else relative) * ends.amplitude
    extra: dict[str, Any] = {} if chunk.record is None else dict(tables(plan, chunk.record, ends))
    if light is not None:
        extra |= _in_media(plan, light, relative)
    return Paths(
        ray=ends.ray,
        fate=ends.fate,
        bounces=ends.bounces,
        reflections=reflections,
        length=ends.length,
        origin=ends.origin,
        direction=ends.direction,
        amplitude=amplitude,
        lost=lost,
        key=ends.key,
        area=plan.source.area,
        incident=float(len(launched) if launched.strides == (0,) else (np.abs(launched) ** 2).sum()),
        segments=chunk.segments,
        doubtful=chunk.doubtful,
        scene=plan.scene,
        source=plan.source,
        ccd=plan.ccd,
        contradictions=chunk.contradictions,
        min_amplitude=math.sqrt(plan.limits.faint),
        **extra,
    )


def _in_media(plan: Plan, light: Light, relative: ComplexArray) -> dict[str, Any]:
    """What paths through media bring along."""
    return {
        "wavelength": plan.optics.wavelength,
        "medium": light.medium,
        "index": light.real_index,
        "lengths": light.lengths,
        "field": light.field * relative[:, None] if plan.optics.polarised else None,
        "dropped": light.dropped * np.abs(relative) ** 2,
        "bend": light.bend,
    }


def _pooled(work: Callable[[int, int], Result], total: int, chunk: int, options: Options) -> Iterator[Result]:
    """Work on chunks, some ahead of the reader on as many threads; the results in order."""
    if total <= chunk:  # a thread takes longer to start than a few rays to trace
        yield work(0, total)
        if options.progress is not None:
            options.progress(total, total)
        return
    workers = options.threads or os.cpu_count() or 1
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
                if options.progress is not None:
                    options.progress(done, total)
        finally:
            for _, future in waiting:
                future.cancel()


class _Workspaces:
    """One workspace for each thread, handed on from chunk to chunk."""

    def __init__(self, plan: Plan, chunk: int) -> None:
        self.plan, self.rows = plan, min(chunk, plan.total)
        self.idle: SimpleQueue[Workspace] = SimpleQueue()

    @contextmanager
    def one(self) -> Iterator[Workspace]:
        """A workspace that nobody else has."""
        try:
            space = self.idle.get_nowait()
        except Empty:
            space = Workspace.blank(self.plan, self.rows)
        yield space
        self.idle.put(space)


def _in_chunks(plan: Plan, options: Options) -> Iterator[Paths]:
    """Paths of consecutive rays."""
    chunk = options.rays_at_a_time(plan.optics.splits)
    spaces = _Workspaces(plan, chunk)

    def work(first: int, stop: int) -> Paths:
        with spaces.one() as space:
            return _paths(plan, advance(plan, space, first, stop))

    return _pooled(work, plan.total, chunk, options)


def _at_once(plan: Plan, options: Options) -> Paths:
    """All rays in one table from the start: where no ray splits, each has its row."""
    chunk = options.rays_at_a_time(False)
    spaces = _Workspaces(plan, chunk)
    ends = blank(Ends, plan.total)
    uniform = isinstance(plan.source, Beam) and plan.source.profile is None
    launched = np.broadcast_to(np.complex128(1.0), (plan.total,))
    if not uniform:
        launched = np.empty(plan.total, dtype=np.complex128)

    def work(first: int, stop: int) -> tuple[int, int]:
        with spaces.one() as space:
            done = advance(plan, space, first, stop, part(ends, slice(first, stop)))
        if not uniform:
            launched[first:stop] = done.launched
        return done.segments, done.doubtful

    counts = list(_pooled(work, plan.total, chunk, options))
    segments, doubtful = (sum(count) for count in zip(*counts, strict=True))
    return _paths(plan, Chunk(0, launched, ends, None, segments, doubtful, sorted=True))


def stream(
    scene: Scene,
    source: Beam | Rays,
    ccd: CCD | None = None,
    *,
    wavelength: float | None = None,
    max_bounces: int = 12,
    min_amplitude: float = 1e-6,
    record: bool = False,
    threads: int | None = None,
    chunk: int | None = None,
    progress: Progress | None = None,
    warn: bool | set[str] = True,
) -> Iterator[Paths]:
    """Trace in chunks, which need not fit into memory together; arguments as for `trace`.

    Parameters
    ----------
    scene, source, ccd, wavelength, max_bounces, min_amplitude, record, threads, chunk, progress, warn
        See `trace`.

    Yields
    ------
    Paths
        Of consecutive rays, in their order.

    Warns
    -----
    FringetraceWarning
        Behind the last of them, as `trace`.
    """
    options = Options(wavelength, max_bounces, min_amplitude, record, threads, chunk, progress)
    plan = _plan(scene, source, ccd, options, _given(warn))
    chunks = _in_chunks(plan, options)
    return chunks if plan.warned is None else _warned(chunks, plan.warned)


def trace(
    scene: Scene,
    source: Beam | Rays,
    ccd: CCD | None = None,
    *,
    wavelength: float | None = None,
    max_bounces: int = 12,
    min_amplitude: float = 1e-6,
    record: bool = False,
    threads: int | None = None,
    chunk: int | None = None,
    progress: Progress | None = None,
    warn: bool | set[str] = True,
) -> Paths:
    """Trace rays through a scene until they are detected, leave, or are cut off.

    Parameters
    ----------
    scene : Scene
    source : Beam or Rays
    ccd : CCD, optional
        None: rays are followed until they leave.
    wavelength : float, metres, optional
        Vacuum wavelength, needed where a medium is dispersive or absorbs, behind films, for some
        elements. Where nothing is bent by it, fields at others need no new trace.
    max_bounces : int
        Surfaces that a path may meet; a path that would meet one more is `TRUNCATED`.
    min_amplitude : float
        A branch whose amplitude falls below this part of the launched one is `FAINT`.
    record : bool
        Keep every hit (`Paths.polyline`, `surface`, `triangle`).
    threads : int, optional
        Default: one for each core. Results are the same bits for any number.
    chunk : int, optional
        Rays a thread follows at a time; default 32768, or 8192 where rays split. Results are the
        same bits for any number.
    progress : callable, optional
        Called with (rays done, rays in all) after each chunk.
    warn : bool or set of str
        False: warn of nothing. A set: the names of warnings that were given before, and are not given again;
        those given now are added.

    Returns
    -------
    Paths

    Raises
    ------
    TypeError
        If an argument is of the wrong kind.
    ValueError
        For counts or amplitudes below 0, or names of unknown surfaces in the source's `passes`; for a
        wavelength that is missing, or outside the range of a material.

    Warns
    -----
    FringetraceWarning
        If over a millionth of the power is cut off, media contradict, a boundary is open, or paths multiply;
        see `fringetrace.tracing.checks`.
    """
    options = Options(wavelength, max_bounces, min_amplitude, record, threads, chunk, progress)
    plan = _plan(scene, source, ccd, options, _given(warn))
    parted = plan.optics.splits or record
    paths = join(list(_in_chunks(plan, options))) if parted else _at_once(plan, options)
    if plan.warned is not None:
        paths.derived["warned"] = plan.warned
        warn_once(Losses.of(paths).problems, plan.warned)
    return paths


def _given(warn: bool | set[str]) -> set[str] | None:
    """Names of the warnings that were given before; None: there are to be no warnings."""
    if isinstance(warn, set):
        return warn
    return set() if warn else None


def _warned(chunks: Iterator[Paths], given: set[str]) -> Iterator[Paths]:
    """Chunks of a trace, and warnings behind the last of them."""
    losses: Losses | None = None
    for paths in chunks:
        paths.derived["warned"] = given
        losses = Losses.of(paths) if losses is None else losses + Losses.of(paths)
        yield paths
    if losses is not None:
        warn_once(losses.problems, given)
