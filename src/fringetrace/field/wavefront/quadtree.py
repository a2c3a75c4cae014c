"""Quadtree squares of the beam's grid and their lit pieces."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray
from fringetrace.field.wavefront.probe import Probe
from fringetrace.field.wavefront.visibility import Witnesses

# An edge may be off by this many pixels over a pixel's length: the area of a pixel that it mistakes.
PIXEL = 1e-4
# Known in cells: no better than this part of one, which single rays tell, no worse than that.
STRAIGHT, COARSE = 1e-7, 1e-2
CORNERS = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
# Columns of squares that are counted in a row, of any beam's.
STRIDE = 1 << 24


def numbers(wave: Array, at: FloatArray, size: float) -> npt.NDArray[np.int64]:
    """Numbers of the squares of one size that contain points of the beam's grid.

    Parameters
    ----------
    wave : (n,) int64
    at : (n, 2) float64
        Columns and rows, in cells.
    size : float

    Returns
    -------
    (n,) int64
    """
    column, row = np.floor(at / size).astype(np.int64).T
    return np.asarray((wave * STRIDE + row + 1) * STRIDE + column + 1, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Pieces:
    """Lit pieces of cells: rectangles, lit to the left of a chord.

    Attributes
    ----------
    wave, cell : (n,) int64
        Numbers of the sequence of surfaces and of the cell, row * columns + column.
    low, high : (n, 2) float64
        Corners of the rectangle, in cells (column, row).
    chord : (n, 2, 2) float64
        Its ends; NaN where all of the rectangle is lit.
    """

    wave: npt.NDArray[np.int64]
    cell: npt.NDArray[np.int64]
    low: FloatArray
    high: FloatArray
    chord: FloatArray

    @property
    def cut(self) -> npt.NDArray[np.bool_]:
        """Which pieces have a chord."""
        return np.isfinite(self.chord[:, 0, 0])

    @property
    def whole(self) -> npt.NDArray[np.bool_]:
        """Which pieces fill their cell."""
        return np.asarray(~self.cut & (self.high - self.low == 1.0).all(axis=1))

    @property
    def lines(self) -> FloatArray:
        """Chords (n, 3) a, b, c: lit where a s + b t >= c."""
        begin, end = self.chord[:, 0], self.chord[:, 1]
        a, b = begin[:, 1] - end[:, 1], end[:, 0] - begin[:, 0]
        line = np.stack([a, b, a * begin[:, 0] + b * begin[:, 1]], axis=1)
        return np.where(self.cut[:, None], line, (0.0, 0.0, -1.0))

    def numbers(self, size: float) -> npt.NDArray[np.int64]:
        """Numbers of the squares of one size that contain the pieces."""
        return numbers(self.wave, 0.5 * (self.low + self.high), size)

    def part(self, rows: Array) -> Pieces:
        """Subset of the pieces."""
        return Pieces(*(getattr(self, field.name)[rows] for field in fields(self)))

    @staticmethod
    def joined(parts: list[Pieces]) -> Pieces:
        """Concatenation of at least one table of pieces."""
        columns = ([getattr(part, field.name) for part in parts] for field in fields(Pieces))
        return Pieces(*(np.concatenate(column) for column in columns))


@dataclass(frozen=True, eq=False)
class Squares:
    """Squares of one size: `lit` (n, 4) at the corners, from (0, 0) around.

    `scale` (n,) is how many pixels a cell is wide.
    """

    wave: npt.NDArray[np.int64]
    cell: npt.NDArray[np.int64]
    scale: FloatArray
    low: FloatArray
    lit: npt.NDArray[np.bool_]
    size: float

    @property
    def numbers(self) -> npt.NDArray[np.int64]:
        """Numbers (n,) that identify the squares."""
        return numbers(self.wave, self.low + 0.5 * self.size, self.size)

    @property
    def whole(self) -> Pieces:
        """Each whole square as a piece."""
        blank = np.full((len(self.low), 2, 2), np.nan)
        return Pieces(self.wave, self.cell, self.low, self.low + self.size, blank)

    def beside(self, chosen: Array) -> npt.NDArray[np.bool_]:
        """Which squares of a wave touch a chosen one, (n,) bool."""
        steps = np.array([i * STRIDE + j for i in (-1, 0, 1) for j in (-1, 0, 1)])
        return np.isin(self.numbers, (self.numbers[chosen][:, None] + steps).ravel())

    def numbered(self, wave: int) -> Squares:
        """All of them, of a wave."""
        return replace(self, wave=np.full(len(self.cell), wave))

    def part(self, rows: Array) -> Squares:
        """Subset of the squares."""
        return Squares(
            self.wave[rows], self.cell[rows], self.scale[rows], self.low[rows], self.lit[rows], self.size
        )

    @staticmethod
    def joined(parts: list[Squares]) -> Squares:
        """Concatenation of at least one table of squares of one size."""
        return Squares(
            wave=np.concatenate([part.wave for part in parts]),
            cell=np.concatenate([part.cell for part in parts]),
            scale=np.concatenate([part.scale for part in parts]),
            low=np.concatenate([part.low for part in parts]),
            lit=np.concatenate([part.lit for part in parts]),
            size=parts[0].size,
        )


def allowed(length: FloatArray, scale: FloatArray, size: float) -> FloatArray:
    """Tolerance of chords.

    Parameters
    ----------
    length : (n,) float64
        Of the chords, in cells.
    scale : (n,) float64
        Pixels that a cell is wide.
    size : float
        Of the squares that they cross, in cells.

    Returns
    -------
    (n,) float64, cells
    """
    with np.errstate(divide="ignore"):
        off = PIXEL / scale / np.minimum(length * scale, 1.0)
    return np.clip(off, STRAIGHT * size, np.maximum(COARSE * length, STRAIGHT * size))


def quarters(probe: Probe, names: Array, squares: Squares) -> Squares:
    """Quarters of squares, with the lit state of their corners.

    Parameters
    ----------
    probe : Probe
    names : (waves,) uint64
    squares : Squares

    Returns
    -------
    Squares
    """
    low, size = squares.low, squares.size
    nodes = np.zeros((len(low), 3, 3), dtype=np.bool_)  # [row, column]
    nodes[:, 0, 0], nodes[:, 0, 2], nodes[:, 2, 2], nodes[:, 2, 0] = squares.lit.T
    new = np.array([(1, 0), (0, 1), (1, 1), (2, 1), (1, 2)])  # column, row
    at = (low[:, None] + 0.5 * size * new).reshape(-1, 2)
    lit = probe.lit(at, np.repeat(names[squares.wave], len(new)))
    nodes[:, new[:, 1], new[:, 0]] = lit.reshape(-1, len(new))
    corner = [np.stack([nodes[:, j, i], nodes[:, j, i + 1], nodes[:, j + 1, i + 1], nodes[:, j + 1, i]], 1)
              for j in (0, 1) for i in (0, 1)]  # fmt: skip
    place = [low + 0.5 * size * np.array((i, j)) for j in (0, 1) for i in (0, 1)]
    return Squares(
        wave=np.tile(squares.wave, 4), cell=np.tile(squares.cell, 4), scale=np.tile(squares.scale, 4),
        low=np.concatenate(place), lit=np.concatenate(corner), size=0.5 * size,
    )  # fmt: skip


def denied(
    probe: Probe, names: Array, squares: Squares, pieces: Pieces, witnesses: Witnesses
) -> npt.NDArray[np.bool_]:
    """Squares whose pieces are contradicted by rays.

    Parameters
    ----------
    probe : Probe
    names : (waves,) uint64
    squares : Squares
        At least one.
    pieces : Pieces
        What of them is lit.
    witnesses : Witnesses
        Where to look.

    Returns
    -------
    (squares,) bool
    """
    row, at = witnesses.points(0.5 * squares.size)
    number = numbers(witnesses.wave[row], at, squares.size)
    order = np.argsort(own := squares.numbers)
    square = order[np.searchsorted(own[order], number).clip(max=len(order) - 1)]
    here = own[square] == number
    at, lit, square = at[here], witnesses.lit[row[here]], square[here]
    inwards = _inwards(at, number[here], pieces, squares.size)
    unsure = 2.0 * allowed(np.full(len(at), squares.size), squares.scale[square], squares.size)
    odd = np.flatnonzero((lit != (inwards > 0.0)) & (np.abs(inwards) > unsure + probe.fuzz.sum()))
    wave = squares.wave[square[odd]]
    told = probe.lit(at[odd], names[wave])
    denied = np.zeros(len(order), dtype=np.bool_)
    denied[square[odd[told == lit[odd]]]] = True
    return denied


def _inwards(at: FloatArray, number: Array, pieces: Pieces, size: float) -> FloatArray:
    """How far points (n, 2), in squares of a number, lie within a lit piece; less than 0 beside all."""
    own = pieces.numbers(size)
    order = np.argsort(own, kind="stable")
    first, last = (np.searchsorted(own[order], number, side) for side in ("left", "right"))
    count = last - first
    point = np.repeat(np.arange(len(at)), count)
    piece = order[np.arange(len(point)) + np.repeat(first - np.cumsum(count) + count, count)]
    here = at[point]
    a, b, c = pieces.lines[piece].T
    with np.errstate(divide="ignore", invalid="ignore"):
        chord = (a * here[:, 0] + b * here[:, 1] - c) / np.hypot(a, b)
    inside = ((here >= pieces.low[piece]) & (here <= pieces.high[piece])).all(axis=1)
    chord = np.where(pieces.cut[piece], chord, size)
    inwards = np.full(len(at), -size)
    np.maximum.at(inwards, point[inside], chord[inside])
    return inwards
