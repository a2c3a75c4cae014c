"""Batch of rays that a tracing loop advances, as columns of equal length."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray


@dataclass(frozen=True, eq=False)
class Tracks:
    """Columns shared by paths under way and paths that have ended, one row each.

    `lost` is the power given off on the way, `serial` numbers the paths as they are born.
    """

    lost: FloatArray
    amplitude: ComplexArray
    key: npt.NDArray[np.uint64]
    ray: npt.NDArray[np.int64]
    bounces: npt.NDArray[np.int32]
    reflections: npt.NDArray[np.int32]
    serial: npt.NDArray[np.int64]

    @property
    def columns(self) -> tuple[Array, ...]:
        """All columns, in the order of the kernels."""
        return tuple(vars(self).values())


@dataclass(frozen=True, eq=False)
class Batch(Tracks):
    """Rays under way, changed in place by the tracing loop. Lengths in metres.

    `state` has the columns that `kernels` names: origin, direction, normal of the face last left,
    optical path, distance of the start from that face's edge. `last` is the triangle last left
    (-1: none), `came` (n, 3) the direction of the last leg that was longer than 0.
    """

    state: FloatArray
    last: npt.NDArray[np.int64]
    came: FloatArray


@dataclass(frozen=True, eq=False)
class Ends(Tracks):
    """Ended paths, and the reason."""

    origin: FloatArray
    direction: FloatArray
    length: FloatArray
    fate: npt.NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class Carried:
    """State of rays in matter, beside a batch or its ends, row by row.

    Attributes
    ----------
    medium : (n,) int32
        Number of the medium that the ray is in, see `media.Optics`.
    index : (n,) float64
        Its real index for the ray: |Re k| / k0.
    fade : (n, 3) float64, or (0, 3) where no medium absorbs
        Im k / k0.
    lengths : (n, media) float64, metres
        Way in each medium.
    field : (n, 3) complex128, or (0, 3) where light is scalar
    dropped : (n,) float64
        Power of branches that were not followed.
    bend : (n,) float64
        Largest sin^2 of incidence at a boundary of media; 2 behind elements that depend on the wavelength.
    """

    medium: npt.NDArray[np.int32]
    index: FloatArray
    fade: FloatArray
    lengths: FloatArray
    field: ComplexArray
    dropped: FloatArray
    bend: FloatArray

    @property
    def columns(self) -> tuple[Array, ...]:
        """All columns, in the order of the kernels."""
        return tuple(vars(self).values())

    @staticmethod
    def blank(rows: int, media: int, polarised: bool, fading: bool) -> Carried:
        """Uninitialised table of so many rows."""
        return Carried(
            medium=np.empty(rows, dtype=np.int32),
            index=np.empty(rows),
            fade=np.empty((rows if fading else 0, 3)),
            lengths=np.empty((rows, media)),
            field=np.empty((rows if polarised else 0, 3), dtype=np.complex128),
            dropped=np.empty(rows),
            bend=np.empty(rows),
        )

    def rows(self, which: Array | slice) -> Carried:
        """Subset of the rows."""
        return Carried(*(column[which] if len(column) else column for column in vars(self).values()))

    def grown(self, rows: int) -> Carried:
        """Larger table that starts with the same rows."""
        larger = Carried.blank(rows, self.lengths.shape[1], len(self.field) > 0, len(self.fade) > 0)
        for column, wider in zip(self.columns, larger.columns, strict=True):
            wider[: len(column)] = column
        return larger


Table = TypeVar("Table", Batch, Ends)


TYPES = {
    "amplitude": np.complex128, "key": np.uint64, "ray": np.int64, "last": np.int64, "serial": np.int64,
    "bounces": np.int32, "reflections": np.int32, "fate": np.int8,
}  # fmt: skip


def blank(kind: type[Table], rows: int) -> Table:
    """Uninitialised table of so many rows."""
    wide = {"origin": (rows, 3), "direction": (rows, 3), "came": (rows, 3), "state": (rows, 12)}
    names = [column.name for column in fields(kind)]
    return kind(**{name: np.empty(wide.get(name, rows), TYPES.get(name, np.float64)) for name in names})


def part(table: Table, start: int, stop: int) -> Table:
    """Views of a range of rows."""
    return type(table)(**{name: column[start:stop] for name, column in vars(table).items()})


def grown(table: Table, rows: int) -> Table:
    """Larger table that starts with the same rows."""
    larger = blank(type(table), rows)
    for name, column in vars(table).items():
        getattr(larger, name)[: len(column)] = column
    return larger
