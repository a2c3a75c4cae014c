"""Least-squares fit of wavefront patches to rays in the lit parts of cells."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray
from fringetrace.field.wavefront.boundary_search import main_axis
from fringetrace.field.wavefront.patches import Arrivals
from fringetrace.field.wavefront.probe import RIM
from fringetrace.field.wavefront.quadtree import Pieces
from fringetrace.field.wavefront.ray_tubes import caustics

# Rays that each cell is fitted to: three for each coefficient of a polynomial of degree 5, and one.
RAYS = 64
# Rays keep this part of the lit width from its edges.
INSIDE = 0.02
# Combinations of coefficients that rays tell less of than this (relative) are left at 0.
RANK = 1e-8
# Degree of the polynomials whose slopes give the Jacobian, one more than cubic patches resolve.
DEGREE = 5
# Between rays is no more than this part of what half of them span.
NEAR = 0.5
# Fewer rays do not tell a Jacobian.
FEWEST = 6
# Powers of s in the Legendre polynomials of 2 s - 1.
POWERS = np.array([[1.0, 0, 0, 0], [-1, 2, 0, 0], [1, -6, 6, 0], [-1, 12, -30, 20]])
# Cells are fitted so many at a time: 50 MB.
CHUNK = 1024


@dataclass(frozen=True, eq=False)
class PatchFit:
    """Fitted patches of a wavefront, and the pieces of cells that they cover.

    Attributes
    ----------
    pieces : Pieces
    owner : (n,) int64
        The patch of each piece.
    coefficients : (m, 4 + 2 components, 4, 4) float64
        See `raster`; s and t run from 0 to 1 over the patch.
    turns : (m, 2) int64
        Caustics passed where J < 0 and where J > 0.
    low, high : (m, 2) float64
        Corners of each patch on the beam's grid.
    """

    pieces: Pieces
    owner: npt.NDArray[np.int64]
    coefficients: FloatArray
    turns: npt.NDArray[np.int64]
    low: FloatArray
    high: FloatArray

    def local(self, at: FloatArray, owner: Array) -> FloatArray:
        """Patch coordinates of points (n, ..., 2) of the beam's grid."""
        spread = (len(at), *[1] * (at.ndim - 2), 2)
        low, high = (corner[owner].reshape(spread) for corner in (self.low, self.high))
        return np.asarray((at - low) / (high - low), dtype=np.float64)

    @property
    def domain(self) -> FloatArray:
        """Domain of each piece, (n, 4): s from and to, t from and to."""
        box = self.local(np.stack([self.pieces.low, self.pieces.high], axis=1), self.owner)
        return np.clip(np.swapaxes(box, 1, 2).reshape(-1, 4), 0.0, 1.0)

    @property
    def lines(self) -> FloatArray:
        """Chord of each patch, (n, 3) a, b, c: lit where a s + b t >= c."""
        here = self.pieces
        return Pieces(here.wave, here.cell, here.low, here.high, self.local(here.chord, self.owner)).lines

    @property
    def place(self) -> npt.NDArray[np.int64]:
        """Row and column (m, 2) of patches that are fully lit cells of the grid; else -1."""
        whole = (self.high - self.low == 1.0).all(axis=1) & (self.low == np.floor(self.low)).all(axis=1)
        whole[self.owner[~self.pieces.whole]] = False
        return np.where(whole[:, None], self.low[:, ::-1], -1.0).astype(np.int64)

    def where(self, good: npt.NDArray[np.bool_]) -> PatchFit:
        """Subset of the patches."""
        kept = good[self.owner]
        number = np.cumsum(good) - 1
        return PatchFit(
            self.pieces.part(kept), number[self.owner[kept]], self.coefficients[good], self.turns[good],
            self.low[good], self.high[good],
        )  # fmt: skip

    def pixels(self, at: FloatArray, owner: Array) -> FloatArray:
        """CCD coordinates of points (n, 2) of the beam's grid, by patches `owner` (n,)."""
        s, t = (np.stack([u**i for i in range(4)], axis=-1) for u in self.local(at, owner).T)
        lines = np.einsum("nfij,nj->nfi", self.coefficients[owner, :2], t)
        return np.asarray(np.einsum("nfi,ni->nf", lines, s), dtype=np.float64)

    def drawn(self, ends: FloatArray, owner: Array, most: int) -> FloatArray:
        """CCD segments (m, 4) of lines (n, 2, 2) on the beam's grid, a pixel long, at most `most` each."""
        begin, end = np.moveaxis(ends, 1, 0)
        stops = [self.pixels(begin + f * (end - begin), owner) for f in (0.0, 0.5, 1.0)]
        length = sum(np.linalg.norm(b - a, axis=1) for a, b in pairwise(stops))
        count = np.clip(np.ceil(length), 1, most).astype(np.int64)
        line = np.repeat(np.arange(len(count)), count)
        step = np.arange(len(line)) - np.repeat(np.cumsum(count) - count, count)
        f = np.stack([step, step + 1]) / count[line]
        way = (end - begin)[line]
        return np.hstack([self.pixels(begin[line] + g[:, None] * way, owner[line]) for g in f])


def _trapezoids(pieces: Pieces) -> tuple[Array, Array, FloatArray, FloatArray, FloatArray]:
    """Lit parts of pieces: piece, axis, from and to along it (n, 2), and across it at both ends, (n, 2)."""
    rows, cut = np.arange(len(pieces.low)), pieces.cut
    axis = main_axis(pieces.chord)
    across = 1 - axis
    least, most = pieces.low[rows, axis], pieces.high[rows, axis]
    floor, roof = pieces.low[rows, across], pieces.high[rows, across]
    order = np.argsort(pieces.chord[rows, :, axis], axis=1)
    ends, height = (np.take_along_axis(pieces.chord[rows, :, k], order, axis=1) for k in (axis, across))
    above = (order[:, 0] == 0) != (axis == 1)  # lit on the left
    bottom = np.where((cut & above)[:, None], height, floor[:, None])
    top = np.where((cut & ~above)[:, None], height, roof[:, None])
    parts: list[tuple[Array, ...]] = [
        (rows, axis, np.where(cut[:, None], ends, np.stack([least, most], axis=1)), bottom, top)
    ]
    # beside a chord that does not reach from end to end, all is lit or nothing
    a, b, c = pieces.lines.T
    for begin, end in ((least, ends[:, 0]), (ends[:, 1], most)):
        middle = np.empty((len(rows), 2))
        middle[rows, axis], middle[rows, across] = 0.5 * (begin + end), 0.5 * (floor + roof)
        lit = np.flatnonzero(cut & (a * middle[:, 0] + b * middle[:, 1] > c))
        wide = np.stack([begin, end], axis=1)
        bottom, top = (np.repeat(level[lit, None], 2, axis=1) for level in (floor, roof))
        parts.append((lit, axis[lit], wide[lit], bottom, top))
    piece, axis, along, bottom, top = (np.concatenate(column) for column in zip(*parts, strict=True))
    kept = (along[:, 1] > along[:, 0]) & ((top - bottom).max(axis=1) > 0.0)
    return piece[kept], axis[kept], along[kept], bottom[kept], top[kept]


def _halton(count: int) -> FloatArray:
    """Numbers 0 to 1 whose order has no pattern: the digits of 0, 1, 2, ... mirrored (van der Corput)."""
    number, place, total = np.arange(count), 0.5, np.zeros(count)
    while number.any():
        total += place * (number % 2)
        number, place = number // 2, 0.5 * place
    return total + place


def places(pieces: Pieces, owner: Array, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points spread evenly over the lit parts of cells.

    Parameters
    ----------
    pieces : Pieces
    owner : (n,) int64
        The patch of each piece.
    count : int
        How many patches there are.

    Returns
    -------
    at : (count, RAYS, 2) float64
        On the beam's grid.
    low, high : (count, 2) float64
        Corners of the box around what is lit.
    """
    piece, axis, along, bottom, top = _trapezoids(pieces)
    order = np.lexsort((along[:, 0], axis, owner[piece]))  # side by side: no pattern of theirs
    axis, along, bottom, top = axis[order], along[order], bottom[order], top[order]
    unit = owner[piece][order]
    area = 0.5 * (along[:, 1] - along[:, 0]) * (top - bottom).sum(axis=1)
    total = np.bincount(unit, area, count)
    # areas of each patch in units of its own, one after the other
    share = area / total[unit]
    upto = np.cumsum(share)
    first = np.searchsorted(unit, np.arange(count))
    start = np.append(0.0, upto)[first]
    goal = start[:, None] + (np.arange(RAYS) + 0.5) / RAYS
    last = np.searchsorted(unit, np.arange(count), side="right") - 1
    which = np.clip(np.searchsorted(upto, goal), first[:, None], last[:, None])
    f = np.clip((goal - (upto - share)[which]) / share[which], 0.0, 1.0)
    g = INSIDE + (1.0 - 2.0 * INSIDE) * _halton(RAYS)
    u = along[which, 0] + f * (along[which, 1] - along[which, 0])
    floor, roof = (level[which, 0] + f * (level[which, 1] - level[which, 0]) for level in (bottom, top))
    v = floor + g * (roof - floor)
    flat = (axis[which] == 0)[..., None]
    at = np.where(flat, np.stack([u, v], axis=-1), np.stack([v, u], axis=-1))
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    across = np.stack([bottom.min(axis=1), top.max(axis=1)], axis=1)
    for k in (0, 1):
        reach = np.where((axis == k)[:, None], along, across)
        np.minimum.at(low[:, k], unit, reach[:, 0])
        np.maximum.at(high[:, k], unit, reach[:, 1])
    return at, low, high


def fitted(
    at: FloatArray, low: FloatArray, high: FloatArray, ray: Array, arrived: Arrivals, amplitude: ComplexArray,
    base: float, shape: tuple[int, int],
) -> tuple[FloatArray, npt.NDArray[np.int64], npt.NDArray[np.bool_], FloatArray]:  # fmt: skip
    """Wavefront patches fitted by least squares.

    Parameters
    ----------
    at : (n, RAYS, 2) float64
        Where rays of each patch started on the beam's grid.
    low, high : (n, 2) float64
        Corners of the patches there.
    ray : (m,) int64
        Which of them arrived, counted through.
    arrived : Arrivals
    amplitude : (m, components) complex128
    base : float, metres
        Paths are fitted less this.
    shape : (rows, columns)
        Of the CCD.

    Returns
    -------
    coefficients : (n, 4 + 2 components, 4, 4) float64
        See `raster`.
    turns : (n, 2) int64
        Caustics passed where J < 0 and where J > 0.
    good : (n,) bool
        Patches that enough rays arrived of, some of them near the CCD.
    off : (n,) float64, pixels
        What the rays are off the patches, root mean square.
    """
    count = len(at)
    known = np.isin(np.arange(count * RAYS), ray).reshape(count, RAYS)
    good = (known.sum(axis=1) >= FEWEST) & (high - low > RIM).all(axis=1)
    # any other ray of the patch stands in for one that is missing, without weight
    number = np.zeros(count * RAYS, dtype=np.int64)
    number[ray] = np.arange(len(ray))
    row: Array = number.reshape(count, RAYS)
    row = np.where(known, row, row[np.arange(count), np.argmax(known, axis=1)][:, None])
    good &= _near(arrived.x[row], shape[1]) & _near(arrived.y[row], shape[0]) if len(ray) else False
    coefficients = np.zeros((count, 4 + 2 * amplitude.shape[1], 4, 4))
    turns = np.zeros((count, 2), dtype=np.int64)
    off = np.zeros(count)
    chosen = np.flatnonzero(good)
    for some in np.split(chosen, range(CHUNK, len(chosen), CHUNK)):
        if len(some):
            size = (high - low)[some]
            place = (at[some] - low[some, None]) / size[:, None]
            coefficients[some], turns[some], off[some] = _patches(
                place, np.sqrt(size.prod(axis=1)), known[some], row[some], arrived, amplitude, base
            )
    return coefficients, turns, good, off


def _near(x: FloatArray, count: int) -> npt.NDArray[np.bool_]:
    """Whether rays (n, RAYS) span some of the pixels from 0 to `count`, or are near it."""
    least, middle, most = (f(x, axis=1) for f in (np.min, np.median, np.max))
    return np.asarray((least - NEAR * (middle - least) < count) & (most + NEAR * (most - middle) > 0.0))


def _patches(
    place: FloatArray, root: FloatArray, known: Array, row: Array, arrived: Arrivals,
    amplitude: ComplexArray, base: float,
) -> tuple[FloatArray, npt.NDArray[np.int64], FloatArray]:  # fmt: skip
    """Coefficients, turns, residuals; `root` of the part of a cell that patches are, `row` of their rays."""
    (s, slope_s), (t, slope_t) = (_legendre(2.0 * u - 1.0) for u in np.moveaxis(place, -1, 0))
    i, j = (index.ravel() for index in np.indices((DEGREE + 1, DEGREE + 1)))
    i, j = i[(low := i + j <= DEGREE)], j[low]
    fine = np.linalg.pinv(s[..., i] * t[..., j] * known[..., None], rcond=RANK)
    along = np.stack([slope_s[..., i] * t[..., j], s[..., i] * slope_t[..., j]], axis=2)

    def slopes(values: FloatArray) -> FloatArray:
        found = np.einsum("nrkp,npv->nrkv", along, fine @ (values * known[..., None]))
        return np.asarray(found, dtype=np.float64)

    x, y, w = arrived.x[row], arrived.y[row], arrived.length[row] - base
    steps = slopes(np.stack([x, y], axis=-1))
    area = np.linalg.det(steps)
    light = np.ascontiguousarray(amplitude[row] * root[:, None, None]).view(np.float64)
    values = np.concatenate([np.stack([x, y, w, area], axis=-1), light], axis=-1) * known[..., None]
    cubic = (s[..., :4, None] * t[..., None, :4]).reshape(*s.shape[:2], 16)
    cubic *= known[..., None]
    found = np.linalg.pinv(cubic, rcond=RANK) @ values
    left = (cubic @ found - values)[..., :2]
    off = np.sqrt((left**2).sum(axis=(1, 2)) / known.sum(axis=1))
    found = np.swapaxes(found, 1, 2).reshape(len(x), -1, 4, 4)
    turns = np.zeros((len(x), 2), dtype=np.int64)
    if arrived.way is not None:
        passed = caustics(arrived.way[row], arrived.direction[row], arrived.last[row], slopes)
        for branch, sign in enumerate((-1.0, 1.0)):
            size = np.where(known, sign * area, 0.0)
            best = np.argmax(size, axis=1)
            surest = np.arange(len(best)), best
            turns[:, branch] = np.where(size[surest] > 0.0, passed[surest], 0)
    return POWERS.T @ found @ POWERS, turns, off


def _legendre(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Legendre polynomials up to `DEGREE` at x, and their derivatives by (x + 1) / 2."""
    from numpy.polynomial import legendre

    value = legendre.legvander(x, DEGREE)
    slope = np.zeros((DEGREE + 1, DEGREE + 1))
    for k in range(1, DEGREE + 1):
        slope[:k, k] = 2.0 * legendre.legder(np.eye(DEGREE + 1)[k])[:k]
    return np.asarray(value, dtype=np.float64), np.asarray(value @ slope, dtype=np.float64)
