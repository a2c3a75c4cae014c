"""The record of a chunk of rays: what each path met, pass by pass, and how it went on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray
from fringetrace.tracing.batch import Ends
from fringetrace.tracing.fates import Fate

if TYPE_CHECKING:
    from fringetrace.tracing.plan import Plan

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
        optics = plan.optics
        self.columns = HIT | ({} if optics.vacuum else IN_MEDIA) | (AT_ELEMENTS if optics.elements else {})
        # branch that each digit of a key stands for
        numbers = [number for number, _ in plan.scene.digits]
        first = 2 * len(plan.scene.surfaces)
        further = [2 + numbers[first:k].count(numbers[k]) for k in range(first, len(numbers))]
        self.branches = np.array([0, *[0, 1] * len(plan.scene.surfaces), *further], dtype=np.int8)

    def born(self, parents: Array) -> None:
        """Paths that part from others."""

        def grown(column: Array) -> Array:
            return np.concatenate([column, column[parents]])

        if len(parents):
            self.start, self.key = grown(self.start), grown(self.key)
            self.passes = [{name: grown(column) for name, column in one.items()} for one in self.passes]

    def met(self, serials: Array, triangle: Array, point: FloatArray) -> None:
        """Add a pass, in which some paths met a triangle."""
        rows = len(self.key)
        blank: dict[str, Array] = {
            n: np.full((rows, *shape), fill, kind) for n, (fill, kind, shape) in self.columns.items()
        }
        self.passes.append(blank)
        self.write(serials, triangle=triangle, point=point)

    def went_on(self, serials: Array, key: npt.NDArray[np.uint64], **columns: Array) -> None:
        """What some paths did in the pass that was added last: their keys now, and more."""
        base = np.uint64(len(self.branches))
        digit = key - base * self.key[serials]  # modulo 2^64, as keys are
        self.key[serials] = key
        self.write(serials, branch=self.branches[digit.astype(np.int64)], **columns)

    def write(self, serials: Array, **columns: Array) -> None:
        """Fill columns of the pass that was added last."""
        for name, values in columns.items():
            if name in self.columns:
                self.passes[-1][name][serials] = values

    def table(self, name: str, serials: Array, depth: int) -> Array:
        """A column of the first passes for some paths, (m, depth, ...)."""
        fill, kind, shape = self.columns[name]
        table: Array = np.full((len(serials), depth, *shape), fill, kind)
        for k, one in enumerate(self.passes[:depth]):
            table[:, k] = one[name][serials]
        return table


def tables(plan: Plan, record: Record, ends: Ends) -> dict[str, Array]:
    """The record of a chunk as the padded tables of `Paths`, from `surface` to `advances`.

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
    if not plan.optics.vacuum:
        media = np.zeros((len(rows), 1), dtype=np.int32), found.pop("medium")
        index = np.full((len(rows), 1), plan.optics.surfaces.media[0].real), found.pop("index")
        kept |= {"media": np.concatenate(media, axis=1), "indices": np.concatenate(index, axis=1)}
    if "departure" in found:
        kept["departures"] = np.concatenate([points[:, :1], found["departure"]], axis=1)
        kept["advances"] = found["advance"]
    return kept
