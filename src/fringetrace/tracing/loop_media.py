"""Tracing loop of a chunk of rays through matter: arrive, meet boundaries and elements, leave."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray
from fringetrace.tracing.batch import Batch, Carried, Ends, grown
from fringetrace.tracing.fates import ABSORBED, ALIVE, FAINT
from fringetrace.tracing.loop import Chunk, Plan, Record, Workspace, nearest, start
from fringetrace.tracing.rays import Rays

if TYPE_CHECKING:
    from fringetrace.optics import Branch, Element
    from fringetrace.tracing.optics_table import Optics


@dataclass(eq=False)
class _State:
    """A chunk on its way: its tables, how many rows of them are filled, and what is counted."""

    space: Workspace
    batch: Batch
    carried: Carried
    ends: Ends
    brought: Carried
    why: npt.NDArray[np.int8]
    parent: npt.NDArray[np.int64]
    contradictions: npt.NDArray[np.int64]
    count: int
    ended: int
    serials: int

    def room(self, rows: int) -> None:
        """Make room for so many rows under way, and as many more that end."""
        from fringetrace.tracing.intersect.embree import Hits

        if rows > len(self.batch.ray):
            self.batch, self.carried = grown(self.batch, 2 * rows), self.carried.grown(2 * rows)
            self.space.state, self.space.carried = self.batch, self.carried
            self.space.hits = Hits.blank(2 * rows)
        if len(self.why) < len(self.batch.ray):
            self.why = np.concatenate([self.why, np.empty(len(self.batch.ray) - len(self.why), np.int8)])
            self.parent = np.empty(len(self.batch.ray), dtype=np.int64)
        if self.ended + rows > len(self.ends.ray):
            more = 2 * (self.ended + rows)
            self.ends, self.brought = grown(self.ends, more), self.brought.grown(more)
            self.space.ends, self.space.brought = self.ends, self.brought


def traverse(plan: Plan, space: Workspace, first: int, stop: int) -> Chunk:
    """Trace rays through matter to all their ends.

    Parameters
    ----------
    plan : Plan
    space : Workspace
    first, stop : int
        Which rays: from and to.

    Returns
    -------
    Chunk
    """
    from fringetrace.tracing.intersect.embree import Limits
    from fringetrace.tracing.kernels_media import arrive, leave

    optics = plan.matter
    assert optics is not None
    rays = plan.rays(first, stop)
    state = _begun(plan, space, len(rays))
    start(state.batch, rays, first)
    _fill(state.carried, rays, optics)
    record = Record(rays.origin, plan) if plan.record else None
    limits = Limits(plan.screen, plan.ccd is not None, plan.max_bounces, first)
    segments, doubtful, passed = 0, 0, plan.passed
    while state.count:
        state.room(2 * state.count)
        segments += state.count
        doubtful += nearest(plan, space, state.count, passed)
        passed = frozenset()
        hits = space.hits
        state.count, state.ended = arrive(
            state.count, state.batch.columns, state.carried.columns, hits.met, hits.triangle, limits.packed,
            optics.k0, state.ends.columns, state.brought.columns, state.ended,
        )  # fmt: skip
        _meet(plan, state, record)
        for number, element in optics.elements.items():
            _act(plan, state, number, element, record)
        if record is not None:
            _went_on(state, record)
        state.room(state.count)
        state.count, state.ended = leave(
            state.count, state.batch.columns, state.carried.columns, state.why, state.ends.columns,
            state.brought.columns, state.ended,
        )  # fmt: skip
    brought = state.brought.rows(slice(0, state.ended))
    return Chunk(state.ends, state.ended, rays, segments, doubtful, record, brought, state.contradictions)


def _begun(plan: Plan, space: Workspace, count: int) -> _State:
    """The tables of a workspace, for so many rays."""
    assert space.carried is not None
    assert space.brought is not None
    rows = len(space.state.ray)
    state = _State(
        space, space.state, space.carried, space.ends, space.brought,
        why=np.empty(rows, dtype=np.int8), parent=np.empty(rows, dtype=np.int64),
        contradictions=np.zeros(len(plan.scene.surfaces), dtype=np.int64),
        count=count, ended=0, serials=count,
    )  # fmt: skip
    state.room(count)
    return state


def _fill(carried: Carried, rays: Rays, optics: Optics) -> None:
    """Rays at their start, in the scene's medium."""
    count = len(rays)
    carried.medium[:count], carried.index[:count] = 0, optics.media[0].real
    carried.lengths[:count], carried.dropped[:count], carried.bend[:count] = 0.0, 0.0, 0.0
    if optics.fading:
        carried.fade[:count] = optics.media[0].imag * rays.direction
    if optics.polarised:
        assert rays.polarisation is not None
        carried.field[:count] = rays.polarisation


def _meet(plan: Plan, state: _State, record: Record | None) -> None:
    """Boundaries and surfaces of constant amplitudes."""
    from fringetrace.tracing.kernels_media import meet

    optics, batch, count = plan.matter, state.batch, state.count
    assert optics is not None
    born = meet(
        count, batch.columns, state.carried.columns, plan.engine.owner, optics.columns, optics.film,
        optics.k0, np.uint64(len(plan.scene.digits) + 1), plan.faint, state.serials, state.why, state.parent,
        state.contradictions,
    )  # fmt: skip
    state.count, state.serials = count + born, state.serials + born
    if record is not None:
        rows, now = state.parent[:born], slice(0, count + born)
        record.born(batch.serial[rows])
        record.met(batch.serial[now], batch.last[now], batch.state[now, :3])


def _went_on(state: _State, record: Record) -> None:
    """Write down in what, and from where, the rays go on, those that end here too."""
    batch, carried, now = state.batch, state.carried, slice(0, state.count)
    record.went_on(
        batch.serial[now], batch.key[now], medium=carried.medium[now], index=carried.index[now],
        departure=batch.state[now, :3],
    )  # fmt: skip


def _field(carried: Carried, batch: Batch, rows: Array) -> ComplexArray:
    return carried.field[rows] if len(carried.field) else batch.amplitude[rows]


def _power(field: ComplexArray) -> FloatArray:
    squares = field.real**2 + field.imag**2
    return np.asarray(squares if field.ndim == 1 else squares.sum(axis=1), dtype=np.float64)


def _act(plan: Plan, state: _State, number: int, element: Element, record: Record | None) -> None:
    """Send the rays that stand at a thin element through it."""
    from fringetrace.optics import IncidentRays

    batch, optics = state.batch, plan.matter
    assert optics is not None
    surface = plan.engine.owner[batch.last[: state.count]]
    rows = np.flatnonzero((surface == number) & (state.why[: state.count] == ALIVE))
    if len(rows) == 0:
        return
    table = batch.state[rows]
    meeting = IncidentRays(
        point=table[:, :3], direction=table[:, 3:6], normal=table[:, 6:9], index=state.carried.index[rows],
        field=_field(state.carried, batch, rows), wavelength=optics.wavelength,
    )  # fmt: skip
    branches = element.act(meeting)
    batch.lost[rows] += _power(meeting.field) - sum(_power(branch.field) for branch in branches)
    if element.chromatic:
        state.carried.bend[rows] = 2.0
    digit = np.uint64(2 * len(plan.scene.surfaces) + 1 + _further(plan, number))
    for further, branch in enumerate(branches[1:]):
        lit = np.flatnonzero(_power(branch.field) > 0.0)
        to = _cloned(state, rows[lit])
        batch = state.batch
        batch.key[to] += digit + np.uint64(further) - np.uint64(2 * number + 2)
        if record is not None:
            record.born(batch.serial[rows[lit]])
        _write(state, to, branch, lit, plan.faint, record)
    _write(state, rows, branches[0], np.arange(len(rows)), plan.faint, record)


def _further(plan: Plan, number: int) -> int:
    """How many digits there are of further branches of elements before this one."""
    surfaces = plan.scene.surfaces[:number]
    return sum(getattr(surface.interface, "branches", 1) - 1 for surface in surfaces)


def _cloned(state: _State, rows: Array) -> Array:
    """Copies of rows behind all others."""
    first, count = state.count, len(rows)
    state.room(first + count)
    to = np.arange(first, first + count)
    for table in (state.batch.columns, state.carried.columns):
        for column in table:
            if len(column):
                column[to] = column[rows]
    state.batch.lost[to], state.carried.dropped[to] = 0.0, 0.0
    state.batch.serial[to] = np.arange(state.serials, state.serials + count)
    state.count, state.serials = first + count, state.serials + count
    return to


def _write(
    state: _State, rows: Array, branch: Branch, which: Array, faint: float, record: Record | None
) -> None:
    """Let rows go on as a branch says: `which` of its rows is that of each."""
    batch, field = state.batch, branch.field[which]
    power = _power(field)
    if field.ndim == 2:
        state.carried.field[rows] = field
        batch.amplitude[rows] = np.sqrt(power)
    else:
        batch.amplitude[rows] = field
    if branch.direction is not None:
        batch.state[rows, 3:6] = branch.direction[which]
    if branch.point is not None:
        batch.state[rows, :3] = branch.point[which]
    if branch.path is not None:
        batch.state[rows, 9] += branch.path[which]
        if record is not None:
            record.write(batch.serial[rows], advance=branch.path[which])
    dark = np.where(power > 0.0, FAINT, ABSORBED)
    state.why[rows] = np.where((power > 0.0) & (power >= faint), ALIVE, dark)
