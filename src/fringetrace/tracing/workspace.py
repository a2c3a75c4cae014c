"""Tables of rays, hits and ends that a thread keeps from chunk to chunk."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fringetrace.tracing.batch import Batch, Ends, Light, blank, grown
from fringetrace.tracing.plan import Plan
from fringetrace.tracing.rays import Rays

if TYPE_CHECKING:
    from fringetrace.tracing.intersect.embree import Hits


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
        """Uninitialised arrays for so many rays, and for their branches where they split."""
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
        begin(rays.origin, rays.direction, rays.length, first, tuple(self.batch))
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
