"""The tracing loop of a chunk of rays: find hits, interact, split, end, again, until all paths have ended."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray
from fringetrace.tracing.batch import Batch, Ends, Light, columns, part
from fringetrace.tracing.checks import CROWD, EACH, warn_of_crowd
from fringetrace.tracing.fates import ABSORBED, ALIVE, DETECTED, FAINT
from fringetrace.tracing.plan import Plan
from fringetrace.tracing.record import Record
from fringetrace.tracing.workspace import Workspace


@dataclass(frozen=True, eq=False)
class Chunk:
    """Consecutive rays whose paths have all ended.

    `first` is the number of the first ray, `launched` their amplitudes; `sorted` tells that each ray has
    one end, in its own row.
    """

    first: int
    launched: ComplexArray
    ends: Ends
    light: Light | None
    segments: int
    doubtful: int
    contradictions: npt.NDArray[np.int64] | None = None
    record: Record | None = None
    sorted: bool = False


def advance(plan: Plan, space: Workspace, first: int, stop: int, ends: Ends | None = None) -> Chunk:
    """Follow rays to all their ends.

    Parameters
    ----------
    plan : Plan
    space : Workspace
    first, stop : int
        Which rays: from and to.
    ends : Ends, optional
        Where they end, a row for each ray, where no ray splits. Default: in the workspace.

    Returns
    -------
    Chunk
        What it holds is overwritten by the next chunk in the same workspace.
    """
    from fringetrace.tracing.intersect.embree import aim

    rays = plan.rays(first, stop)
    space.start(plan, rays, first)
    record = Record(rays.origin, plan) if plan.record else None
    passed, bounces = plan.passed, 0
    fused = plan.mirrors and ends is not None
    while space.count:
        space.segments += space.count
        if space.count > max(CROWD, EACH * len(rays)):
            _warn(plan, space, len(rays), bounces)
        if fused and bounces:
            assert ends is not None
            _rebound(plan, space, bounces, first, ends)
        else:
            _bounce(plan, space, passed, record, None if ends is None else (ends, first))
            passed = frozenset()
            if fused:
                aim(plan.engine, space.batch, space.count, space.hits, 0, True, cull=False)
        bounces += 1
    return Chunk(
        first=first,
        launched=np.asarray(rays.amplitude),
        ends=part(space.ends, slice(0, space.ended)) if ends is None else ends,
        light=None if space.end_light is None else part(space.end_light, slice(0, space.ended)),
        segments=space.segments,
        doubtful=space.doubtful,
        contradictions=None if plan.optics.vacuum else space.contradictions.copy(),
        record=record,
    )


def _warn(plan: Plan, space: Workspace, launched: int, bounces: int) -> None:
    """Warn of paths that multiply."""
    if plan.warned is not None:
        surface, faintest = plan.engine.owner[space.batch.last[: space.count]], math.sqrt(plan.limits.faint)
        warn_of_crowd(plan.scene, surface, launched, bounces, faintest, plan.warned)


def _bounce(
    plan: Plan,
    space: Workspace,
    passed: frozenset[int],
    record: Record | None,
    ordered: tuple[Ends, int] | None,
) -> None:
    """Bring all rays to what they meet and on from there.

    `ordered`: ends with a row for each ray, and the number of the first ray.
    """
    from fringetrace.tracing.kernels_loop import compact, interact

    count, optics = space.count, plan.optics
    if ordered is None:
        space.room((2 if optics.splits else 1) * count)
        space.room_for_ends((2 if optics.splits else 1) * count)
    space.doubtful += nearest(plan, space, passed)
    batch, hits, ended, serials = space.batch, space.hits, space.ended, space.serials
    before = batch.serial[:count].copy(), batch.bounces[:count].copy()
    ends, first = (space.ends, -1) if ordered is None else ordered
    space.count, space.ended, space.serials = interact(
        count, tuple(batch), columns(space.light), hits.met, hits.triangle, plan.engine.owner,
        tuple(optics.surfaces), tuple(plan.limits), tuple(ends), columns(space.end_light), ended, first,
        serials, space.fate, space.parent, space.contradictions,
    )  # fmt: skip
    if record is not None:
        _record_hits(plan, space, record, before, slice(ended, space.ended))
    if optics.elements:
        from fringetrace.tracing.elements_pass import act

        space.fate[: space.count] = ALIVE
        for number, element in optics.elements.items():
            act(plan, space, number, element, record)
    if record is not None:
        _record_branches(space, record, slice(ended, space.ended))
    if optics.elements:
        space.room_for_ends(space.count)
        space.count, space.ended = compact(
            tuple(space.batch), columns(space.light), 0, space.count, 0, space.fate, tuple(space.ends),
            columns(space.end_light), space.ended,
        )  # fmt: skip


def _rebound(plan: Plan, space: Workspace, bounces: int, first: int, ends: Ends) -> None:
    """`_bounce` of rays that have all just left the only body, all of ideal mirrors, in one pass."""
    from fringetrace.tracing.kernels_loop import rebound

    body, hits, count = plan.engine.bodies[0], space.hits, space.count
    contact = plan.engine.contact(space.batch, None)
    prim = body.embree.run(hits.origin32[:count], hits.direction32[:count])
    space.count, _, unsure = rebound(
        count, bounces, prim, tuple(space.batch), contact, body.packed, plan.engine.digit, tuple(plan.limits),
        tuple(ends), first, hits.origin32, hits.direction32,
    )  # fmt: skip
    space.doubtful += unsure


def nearest(plan: Plan, space: Workspace, passed: frozenset[int]) -> int:
    """Nearest hits of the rays of a workspace, see `embree.find`; on the form where there is one.

    Parameters
    ----------
    plan : Plan
    space : Workspace
    passed : set of surface numbers
        Surfaces to be passed over.

    Returns
    -------
    int
        How many rays were decided exactly.
    """
    medium = None if space.light is None else space.light.medium
    if plan.forms:
        from fringetrace.tracing.intersect import on_forms

        return on_forms.find(plan.engine, plan.forms, space.batch, space.count, space.hits, passed, medium)
    from fringetrace.tracing.intersect import embree

    return embree.find(plan.engine, space.batch, space.count, space.hits, passed, medium)


def _record_hits(
    plan: Plan, space: Workspace, record: Record, before: tuple[Array, Array], ended: slice
) -> None:
    """Write down a pass: every path that met something, on its way or at its end.

    `before` are the serial numbers and bounces of the rays before it, `ended` which ends it added.
    """
    (serial, bounces), hits, ends = before, space.hits, part(space.ends, ended)
    met = (hits.triangle[: len(serial)] >= 0) & (bounces < plan.limits.max_bounces)
    met &= ~np.isin(serial, ends.serial[ends.fate == DETECTED])
    known = len(record.key)
    parent = space.parent[: space.serials - known]
    rows = np.concatenate([np.flatnonzero(met), parent])
    record.born(serial[parent])
    serials = np.concatenate([serial[met], np.arange(known, space.serials)])
    record.met(serials, hits.triangle[rows], hits.met[rows, 1:4])


def _record_branches(space: Workspace, record: Record, ended: slice) -> None:
    """Write down how, from where and in what paths went on from their hits of this pass, or ended there."""
    ends, now = part(space.ends, ended), slice(0, space.count)
    stopped = np.flatnonzero(np.isin(ends.fate, (ABSORBED, FAINT)))
    _branches(record, part(ends, stopped), ends.origin[stopped], space.end_light, ended.start + stopped)
    _branches(record, part(space.batch, now), space.batch.state[now, :3], space.light, now)


def _branches(
    record: Record, table: Batch | Ends, departure: Array, light: Light | None, rows: Array | slice
) -> None:
    media: dict[str, Array] = (
        {} if light is None else {"medium": light.medium[rows], "index": light.real_index[rows]}
    )
    record.went_on(table.serial, table.key, departure=departure, **media)
