"""The tracing loop of a chunk of rays: find hits, interact, split, end, again, until all paths have ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray
from fringetrace.scene import CCD, Beam, Scene
from fringetrace.tracing.batch import Batch, Ends, Light, blank, grown, part
from fringetrace.tracing.fates import ABSORBED, ALIVE, DETECTED, FAINT
from fringetrace.tracing.rays import Rays, launch
from fringetrace.tracing.record import Record

if TYPE_CHECKING:
    from fringetrace.tracing.intersect.embree import Engine, Hits
    from fringetrace.tracing.intersect.on_forms import Formed
    from fringetrace.tracing.optics_table import Optics


class Limits(NamedTuple):
    """Where paths end, as the kernels take it.

    Attributes
    ----------
    screen : 15 floats
        The CCD, see `fringetrace.scene.screen`; zeros if there is none.
    has_screen : bool
    max_bounces : int
    faint : float
        Power, relative to unit amplitude, below which branches are not followed.
    key_base : int
        Base of path keys.
    """

    screen: tuple[float, ...]
    has_screen: bool
    max_bounces: int
    faint: float
    key_base: int


@dataclass(frozen=True, eq=False)
class Plan:
    """All that a chunk needs to know, the same for every thread.

    `passed` are surfaces that rays pass over on their first segment.
    """

    scene: Scene
    source: Beam | Rays
    ccd: CCD | None
    engine: Engine
    forms: tuple[Formed, ...]
    passed: frozenset[int]
    optics: Optics
    limits: Limits
    record: bool

    @property
    def total(self) -> int:
        """How many rays there are."""
        source = self.source
        return source.shape[0] * source.shape[1] if isinstance(source, Beam) else len(source)

    @property
    def mirrors(self) -> bool:
        """Whether all are ideal mirrors in one body, without forms."""
        return self.optics.surfaces.ideal and len(self.engine.bodies) == 1 and not self.forms

    def rays(self, first: int, stop: int) -> Rays:
        """Some of the rays."""
        source = self.source
        return launch(source, first, stop) if isinstance(source, Beam) else source.part(first, stop)


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


@dataclass(eq=False)
class Workspace:
    """Tables of a thread, kept from chunk to chunk, and where its chunk stands.

    `count` rows of the batch and `ended` rows of the ends are filled; `serials` paths were born. `fate` is
    what becomes of each row, `parent` the row that each branch born in a pass came from.
    """

    batch: Batch
    light: Light | None
    hits: Hits
    ends: Ends
    end_light: Light | None
    fate: npt.NDArray[np.int8]
    parent: npt.NDArray[np.int64]
    contradictions: npt.NDArray[np.int64]
    count: int = 0
    ended: int = 0
    serials: int = 0
    segments: int = 0
    doubtful: int = 0

    @staticmethod
    def blank(plan: Plan, rows: int) -> Workspace:
        """Room for so many rays, and for some branches of each where they split."""
        from fringetrace.tracing.intersect.embree import Hits

        optics, rows = plan.optics, max(1, rows * (4 if plan.optics.splits else 1))

        def light() -> Light | None:
            if optics.vacuum:
                return None
            widths = {"fade": 3 * optics.fading, "field": 3 * optics.polarised}
            return blank(Light, rows, lengths=len(optics.surfaces.media), **widths)

        return Workspace(
            batch=blank(Batch, rows),
            light=light(),
            hits=Hits.blank(rows),
            ends=blank(Ends, rows),
            end_light=light(),
            fate=np.empty(rows, dtype=np.int8),
            parent=np.empty(rows, dtype=np.int64),
            contradictions=np.zeros(len(plan.scene.surfaces), dtype=np.int64),
        )

    def start(self, plan: Plan, rays: Rays, first: int) -> None:
        """Fill in rays that have met nothing yet; the first of them has the number `first`."""
        from fringetrace.tracing.kernels_rays import begin

        self.count = self.serials = count = len(rays)
        self.ended = self.segments = self.doubtful = 0
        self.contradictions[:] = 0
        self.room(count)
        begin(rays.origin, rays.direction, rays.length, first, self.batch)
        if (light := self.light) is None:
            return
        index = plan.optics.surfaces.media[0]
        light.medium[:count], light.real_index[:count] = 0, index.real
        light.lengths[:count], light.dropped[:count], light.bend[:count] = 0.0, 0.0, 0.0
        if len(light.fade):
            light.fade[:count] = index.imag * rays.direction
        if len(light.field):
            assert rays.polarisation is not None
            light.field[:count] = rays.polarisation

    def room(self, rows: int) -> None:
        """Make room for so many rows under way; what `hits` held is forgotten then."""
        from fringetrace.tracing.intersect.embree import Hits

        if rows > len(self.fate):
            self.batch = grown(self.batch, 2 * rows)
            self.light = None if self.light is None else grown(self.light, 2 * rows)
            self.hits = Hits.blank(2 * rows)
            self.fate = np.concatenate([self.fate, np.empty(2 * rows - len(self.fate), dtype=np.int8)])
            self.parent = np.empty(2 * rows, dtype=np.int64)

    def room_for_ends(self, rows: int) -> None:
        """Make room for so many more paths that end."""
        if self.ended + rows > len(self.ends.ray):
            more = 2 * (self.ended + rows)
            self.ends = grown(self.ends, more)
            self.end_light = None if self.end_light is None else grown(self.end_light, more)


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
        count, batch, space.light, hits.met, hits.triangle, plan.engine.owner, optics.surfaces, plan.limits,
        ends, space.end_light, ended, first, serials, space.fate, space.parent, space.contradictions,
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
            space.batch, space.light, 0, space.count, 0, space.fate, space.ends, space.end_light, space.ended
        )


def _rebound(plan: Plan, space: Workspace, bounces: int, first: int, ends: Ends) -> None:
    """`_bounce` of rays that have all just left the only body, all of ideal mirrors, in one pass."""
    from fringetrace.tracing.intersect.embree import second_opinion
    from fringetrace.tracing.kernels_loop import rebound

    body, hits, count = plan.engine.bodies[0], space.hits, space.count
    prim = body.embree.run(hits.origin32[:count], hits.direction32[:count])
    if not body.closed and prim.min() < 0:
        second_opinion(body, space.batch, count, prim, hits)
    space.count, _, unsure = rebound(
        count, bounces, prim, space.batch, body.packed, plan.engine.digit, plan.limits, ends, first,
        hits.origin32, hits.direction32,
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
    if plan.forms:
        from fringetrace.tracing.intersect import on_forms

        return on_forms.find(plan.engine, plan.forms, space.batch, space.count, space.hits, passed)
    from fringetrace.tracing.intersect import embree

    return embree.find(plan.engine, space.batch, space.count, space.hits, passed)


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
