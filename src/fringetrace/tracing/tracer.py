"""Ray tracer: a beam or rays through a scene, chunk by chunk on a thread pool."""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from numbers import Real
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from fringetrace.core import Array, ComplexArray, checked_whole
from fringetrace.scene import CCD, Beam, Scene, screen
from fringetrace.tracing.batch import Carried, Ends, blank, part
from fringetrace.tracing.loop import Plan, Record, Workspace, advance, tables
from fringetrace.tracing.paths import Paths, join
from fringetrace.tracing.rays import Rays

if TYPE_CHECKING:
    from fringetrace.tracing.intersect.embree import Engine
    from fringetrace.tracing.intersect.on_forms import Formed

Progress = Callable[[int, int], None]
Result = TypeVar("Result")
# Fewer rays: what a pass costs in Python shows (30 us each). More: memory, 10 MB a thread here.
CHUNK = 32768
# Bounces are counted in 32 bits; no trace lives to see so many.
MOST = 2**31 - 2


def _forms(scene: Scene, engine: Engine) -> tuple[Formed, ...]:
    if all(surface.form is None for surface in scene.surfaces):
        return ()
    from fringetrace.tracing.intersect.on_forms import formed

    return formed(scene, engine)


def _plan(
    scene: Scene, source: Beam | Rays, ccd: CCD | None, wavelength: float | None, max_bounces: int,
    min_amplitude: float, record: bool,
) -> Plan:  # fmt: skip
    if not isinstance(scene, Scene):
        raise TypeError(f"trace: expected a Scene, got {type(scene).__name__}")
    if not isinstance(source, (Beam, Rays)):
        raise TypeError(f"trace: expected a Beam or Rays, got {type(source).__name__}")
    if ccd is not None and not isinstance(ccd, CCD):
        raise TypeError(f"trace: expected a CCD or None, got {type(ccd).__name__}")
    most = min(checked_whole(max_bounces, 0, "max_bounces"), MOST)
    if not (isinstance(min_amplitude, Real) and np.isfinite(min_amplitude) and min_amplitude >= 0.0):
        raise ValueError(f"min_amplitude: expected a number of at least 0, got {min_amplitude!r}")
    from fringetrace.tracing.intersect.embree import build
    from fringetrace.tracing.optics_table import constants, optics

    matter = optics(scene, wavelength, source.polarisation is not None)
    passed = frozenset(scene.index(name) for name in source.passes)
    engine = build(
        scene, passed | {i for i, surface in enumerate(scene.surfaces) if surface.form is not None}
    )
    reflection, transmission = constants(scene)
    return Plan(
        scene=scene,
        source=source,
        ccd=ccd,
        engine=engine,
        forms=_forms(scene, engine),
        passed=passed,
        reflection=reflection,
        transmission=transmission,
        screen=(0.0,) * 15 if ccd is None else screen(ccd),
        max_bounces=most,
        faint=float(min_amplitude) ** 2,
        record=record,
        plain=matter is None and bool((reflection == -1.0).all() and not transmission.any()),
        splits=matter is not None or bool((abs(reflection) * abs(transmission)).any()),
        matter=matter,
    )


def _paths(
    plan: Plan, ends: Ends, first: int, launched: ComplexArray, segments: int, doubtful: int,
    record: Record | None = None, whole: bool = False, matter: Carried | None = None,
    contradictions: Array | None = None,
) -> Paths:  # fmt: skip
    """The table of what has ended, sorted by ray; `launched` are the amplitudes from ray `first` on.

    `whole`: each ray is in its row already, and the arrays may be kept.
    """
    if not whole:
        from fringetrace.tracing.kernels_mirrors import sort

        # a ray's ends come in an order that does not depend on other rays: a stable sort keeps it
        order = sort(ends.ray, first, len(launched))
        ends = Ends(**{name: column[order] for name, column in vars(ends).items()})
        matter = None if matter is None else matter.rows(order)
    # a broadcast 1 (no strides) stands for amplitudes that are all 1
    relative = launched[ends.ray - first] if len(ends.ray) > len(launched) else launched
    if plan.plain:
        reflections, lost = ends.bounces, np.zeros(len(ends.ray))
        amplitude = np.array([1.0, -1.0], dtype=np.complex128)[ends.bounces & 1]
        if launched.strides != (0,):  # not all 1
            amplitude *= relative
    else:
        reflections, lost = ends.reflections, ends.lost * np.abs(relative) ** 2
        amplitude = (abs(relative) if _polarised(plan) else relative) * ends.amplitude
    extra: dict[str, Any] = {} if record is None else dict(tables(plan, record, ends))
    if matter is not None:
        extra |= _matter(plan, matter, relative)
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
        segments=segments,
        doubtful=doubtful,
        scene=plan.scene,
        source=plan.source,
        ccd=plan.ccd,
        contradictions=contradictions,
        min_amplitude=math.sqrt(plan.faint),
        **extra,
    )


def _polarised(plan: Plan) -> bool:
    return plan.matter is not None and plan.matter.polarised


def _matter(plan: Plan, matter: Carried, relative: ComplexArray) -> dict[str, Any]:
    """What paths through matter bring along."""
    assert plan.matter is not None
    return {
        "wavelength": plan.matter.wavelength,
        "medium": matter.medium,
        "index": matter.index,
        "lengths": matter.lengths,
        "field": matter.field * relative[:, None] if plan.matter.polarised else None,
        "dropped": matter.dropped * np.abs(relative) ** 2,
        "bend": matter.bend,
    }


def _chunk(plan: Plan, chunk: int | None) -> int:
    """Rays to be followed at a time: fewer where each may become several."""
    if chunk is None:
        return CHUNK // 4 if plan.splits else CHUNK
    return checked_whole(chunk, 1, "chunk")


def _pooled(
    work: Callable[[int, int], Result], total: int, threads: int | None, chunk: int, progress: Progress | None
) -> Iterator[Result]:
    """Work on chunks, some ahead of the reader on as many threads; the results in order."""
    if total <= chunk:  # a thread takes longer to start than a few rays to trace
        yield work(0, total)
        if progress is not None:
            progress(total, total)
        return
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


def _in_chunks(plan: Plan, threads: int | None, chunk: int, progress: Progress | None) -> Iterator[Paths]:
    """Paths of consecutive rays."""
    spaces = _Workspaces(plan, chunk)

    def work(first: int, stop: int) -> Paths:
        with spaces.one() as space:
            if plan.matter is None:
                done = advance(plan, space, None, first, stop)
            else:
                from fringetrace.tracing.loop_media import traverse

                done = traverse(plan, space, first, stop)
            launched = np.asarray(done.rays.amplitude)
            ends = part(done.ends, 0, done.rows)
            return _paths(
                plan, ends, first, launched, done.segments, done.doubtful, done.record,
                matter=done.matter, contradictions=done.contradictions,
            )  # fmt: skip

    return _pooled(work, plan.total, threads, chunk, progress)


def _at_once(plan: Plan, threads: int | None, chunk: int, progress: Progress | None) -> Paths:
    """All rays in one table from the start: where no ray splits, each has its row."""
    spaces = _Workspaces(plan, chunk)
    ends = blank(Ends, plan.total)
    uniform = isinstance(plan.source, Beam) and plan.source.profile is None
    launched = np.broadcast_to(np.complex128(1.0), (plan.total,))
    if not uniform:
        launched = np.empty(plan.total, dtype=np.complex128)

    def work(first: int, stop: int) -> tuple[int, int]:
        with spaces.one() as space:
            done = advance(plan, space, part(ends, first, stop), first, stop)
        if not uniform:
            launched[first:stop] = done.rays.amplitude
        return done.segments, done.doubtful

    counts = list(_pooled(work, plan.total, threads, chunk, progress))
    segments, doubtful = (sum(count) for count in zip(*counts, strict=True))
    return _paths(plan, ends, 0, launched, segments, doubtful, whole=True)


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
) -> Iterator[Paths]:
    """Trace in chunks, which need not fit into memory together; arguments as for `trace`.

    Parameters
    ----------
    scene, source, ccd, wavelength, max_bounces, min_amplitude, record, threads, chunk, progress
        See `trace`.

    Yields
    ------
    Paths
        Of consecutive rays, in their order.
    """
    plan = _plan(scene, source, ccd, wavelength, max_bounces, min_amplitude, record)
    workers = None if threads is None else checked_whole(threads, 1, "threads")
    return _in_chunks(plan, workers, _chunk(plan, chunk), progress)


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
    """
    plan = _plan(scene, source, ccd, wavelength, max_bounces, min_amplitude, record)
    workers = None if threads is None else checked_whole(threads, 1, "threads")
    size = _chunk(plan, chunk)
    if not (plan.splits or record):
        return _at_once(plan, workers, size, progress)
    return join(list(_in_chunks(plan, workers, size, progress)))
