"""Tables of rays under way and of paths that have ended: equal columns, as the kernels take them."""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray


class Batch(NamedTuple):
    """Rays under way, changed in place by each pass. Lengths in metres.

    Attributes
    ----------
    key : (n,) uint64
        Of the path so far, see `Paths.key`.
    ray : (n,) int64
        Number of the ray that was launched.
    bounces, reflections : (n,) int32
        Surfaces met, and mirrors among them.
    serial : (n,) int64
        Numbers the paths as they are born.
    lost : (n,) float64
        Power given off on the way.
    amplitude : (n,) complex128
    state : (n, 12) float64
        Its columns are named in `intersect.kernels`: origin, direction, normal of the face last left, optical
        path, distance of the start from that face's edge.
    last : (n,) int64
        Triangle last left; -1: none.
    came : (n, 3) float64
        Direction of the last segment that was longer than 0; 0: none was.
    crossed : (n, 16) int32
        The triangles that it went through where it stands, see `intersect.coincident`.
    """

    key: npt.NDArray[np.uint64]
    ray: npt.NDArray[np.int64]
    bounces: npt.NDArray[np.int32]
    reflections: npt.NDArray[np.int32]
    serial: npt.NDArray[np.int64]
    lost: FloatArray
    amplitude: ComplexArray
    state: FloatArray
    last: npt.NDArray[np.int64]
    came: FloatArray
    crossed: npt.NDArray[np.int32]


class Ends(NamedTuple):
    """Paths that have ended, where and why (a `Fate`); columns as in `Batch`."""

    key: npt.NDArray[np.uint64]
    ray: npt.NDArray[np.int64]
    bounces: npt.NDArray[np.int32]
    reflections: npt.NDArray[np.int32]
    serial: npt.NDArray[np.int64]
    lost: FloatArray
    amplitude: ComplexArray
    origin: FloatArray
    direction: FloatArray
    length: FloatArray
    fate: npt.NDArray[np.int8]


class Light(NamedTuple):
    """What rays carry through media, row by row beside a `Batch` or its `Ends`.

    Attributes
    ----------
    medium : (n,) int32
        Number of the medium that the ray is in, see `optics_table.scene_media`.
    real_index : (n,) float64
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
    real_index: FloatArray
    fade: FloatArray
    lengths: FloatArray
    field: ComplexArray
    dropped: FloatArray
    bend: FloatArray


Table = TypeVar("Table", Batch, Ends, Light)

# Types and widths of columns that are not (n,) float64.
TYPES = {
    "amplitude": np.complex128, "field": np.complex128, "key": np.uint64, "ray": np.int64, "last": np.int64,
    "serial": np.int64, "bounces": np.int32, "reflections": np.int32, "medium": np.int32, "fate": np.int8,
    "crossed": np.int32,
}  # fmt: skip
WIDTHS = {"origin": 3, "direction": 3, "came": 3, "fade": 3, "field": 3, "state": 12, "crossed": 16}


def blank(kind: type[Table], rows: int, **widths: int) -> Table:
    """A table of so many rows, not filled in; `widths` of columns that have none in `WIDTHS`, 0: no rows."""
    columns: dict[str, Array] = {}
    for name in kind._fields:
        width = widths.get(name, WIDTHS.get(name))
        shape = rows if width is None else (rows, width)
        columns[name] = np.empty(shape, TYPES.get(name, np.float64))
        if name in widths and not width:
            columns[name] = np.empty((0, WIDTHS[name]), TYPES.get(name, np.float64))
    return kind(**columns)


def _made(like: Table, columns: list[Array]) -> Table:
    """A table of the same kind."""
    made: Table = type(like)(*columns)
    return made


def part(table: Table, rows: slice | Array) -> Table:
    """Some rows; views for a slice."""
    return _made(table, [column[rows] if len(column) else column for column in table])


def grown(table: Table, rows: int) -> Table:
    """The same rows in arrays with room for more; columns without rows stay so."""
    columns: list[Array] = []
    column: Array
    for column in table:
        wider: Array = np.empty((rows if len(column) else 0, *column.shape[1:]), column.dtype)
        wider[: len(column)] = column
        columns.append(wider)
    return _made(table, columns)


def columns(table: Table | None) -> tuple[Array, ...] | None:
    """The columns of a table, if there is one, as the kernels take them."""
    return None if table is None else tuple(table)


def copy_rows(table: Table, rows: Array, to: Array) -> None:
    """Copy rows of a table to other rows of it."""
    for column in table:
        if len(column):
            column[to] = column[rows]
