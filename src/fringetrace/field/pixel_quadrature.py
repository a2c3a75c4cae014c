"""Quadrature over pixels: number and position of sample points, and means over each pixel."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray

# Gauss points a pixel, along either axis: at least LEAST, for the curvature of a smooth irradiance.
LEAST, MOST = 2, 32
# What the quadrature of a fringe may be off, relative to its amplitude.
ERROR = 1e-6
# A cosine's mean over c cycles is its centre less (2 pi c)^2 / 24 of it, to (2 pi c)^4 / 1920: up to so
# many cycles, and so large a correction, what remains is a tenth of ERROR (light bends along two axes,
# and more in places than a cosine does).
GENTLE = (192.0 * ERROR) ** 0.25 / (2.0 * np.pi)
BENT = (192.0 * ERROR) ** 0.5 / 24.0
# Barycentric points and weights on a triangle, exact to degree 5 (Radon 1948).
_A, _B = (6.0 - np.sqrt(15.0)) / 21.0, (6.0 + np.sqrt(15.0)) / 21.0
TRIANGLE = np.array(
    [(1 / 3, 1 / 3, 1 / 3, 9 / 40)]
    + [
        (*np.roll((1.0 - 2.0 * at, at, at), turn), weight)
        for at, weight in ((_A, (155.0 - np.sqrt(15.0)) / 1200.0), (_B, (155.0 + np.sqrt(15.0)) / 1200.0))
        for turn in range(3)
    ]
)
# Samples worked on at a time: what fits into a core's cache a few times over.
BAND = 1 << 18

T = TypeVar("T")


def gauss_order(cycles: FloatArray) -> npt.NDArray[np.int64]:
    """Number of Gauss points that integrate so many cycles of a wave over an interval.

    n points miss exp(i pi c u) over -1 < u < 1 by about (e pi c / 4 n)^2n (remainder of the Gauss
    rule, with Stirling's formula).

    Parameters
    ----------
    cycles : float64, any shape
        Cycles over the interval, not negative.

    Returns
    -------
    int64, shape of `cycles`
        From `LEAST` to `MOST`; where that is too few, fringes average out to within a few percent.
    """
    n = np.arange(LEAST, MOST + 1)
    limits = 4.0 * n / (math.e * np.pi) * ERROR ** (0.5 / n)
    return np.minimum(LEAST + np.searchsorted(limits, cycles), MOST).astype(np.int64)


def gauss_table(orders: Array) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights of the Gauss-Legendre rules on [0, 1].

    Parameters
    ----------
    orders : int64, any shape
        Which rules are wanted.

    Returns
    -------
    nodes, weights : (n + 1, n) float64
        n is the largest of `orders`. Row m is the rule of m points; 0 where it is not wanted.
    """
    most = int(orders.max(initial=1))
    nodes, weights = np.zeros((most + 1, most)), np.zeros((most + 1, most))
    for n in np.flatnonzero(np.bincount(orders.ravel(), minlength=1)[1:]) + 1:
        at, weight = np.polynomial.legendre.leggauss(n)
        nodes[n, :n], weights[n, :n] = 0.5 + 0.5 * at, 0.5 * weight
    return nodes, weights


@dataclass(frozen=True, eq=False)
class Samples:
    """Sample points of a band of pixel rows from row `top` on; positions in pixels.

    Those of pixel i are first[i] to first[i + 1]; their weights add up to 1. A point is on the same
    side of every edge as its (where_x, where_y), which keeps a distance from them.
    """

    top: int
    columns: int
    first: npt.NDArray[np.int64]
    x: FloatArray
    y: FloatArray
    weight: FloatArray
    where_x: FloatArray
    where_y: FloatArray

    def blank(self, groups: int) -> ComplexArray:
        """Zero field at the sample points, (groups, points)."""
        return np.zeros((groups, len(self.x)), dtype=np.complex128)

    def means(self, field: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Means over each pixel of the band.

        Parameters
        ----------
        field : (groups, points) complex128

        Returns
        -------
        mean : (groups, rows, columns) complex128
        mutual : (groups, groups, rows, columns) complex128
            See `averaged`.
        """
        from fringetrace.field import pixel_kernels

        groups, pixels = len(field), len(self.first) - 1
        mean = np.empty((groups, pixels), dtype=np.complex128)
        mutual = np.empty((groups, groups, pixels), dtype=np.complex128)
        pixel_kernels.average(self.first, self.weight, field, mean, mutual)
        return mean.reshape(groups, -1, self.columns), mutual.reshape(groups, groups, -1, self.columns)


Light = Callable[[Samples, FloatArray], ComplexArray]


@dataclass(frozen=True, eq=False)
class Edges:
    """Edges of wavefronts as line segments on the pixels.

    Attributes
    ----------
    segments : (n, 4) float64, pixels
        x, y of either end.
    pixel : (m,) int64
        Each pixel (row * columns + column) that one crosses, sorted.
    begin : (m + 1,) int64
        Where its segments begin among `lines`.
    lines : (k,) int64
        Numbers of segments.
    """

    segments: FloatArray
    pixel: npt.NDArray[np.int64]
    begin: npt.NDArray[np.int64]
    lines: npt.NDArray[np.int64]


def edges(segments: FloatArray, shape: tuple[int, int]) -> Edges:
    """Pixels that each segment crosses.

    Parameters
    ----------
    segments : (n, 4) float64, pixels
        x, y of either end.
    shape : (rows, columns)

    Returns
    -------
    Edges
    """
    from fringetrace.field import pixel_kernels

    pairs = pixel_kernels.crossed(np.ascontiguousarray(segments), *shape)
    pairs = pairs[np.argsort(pairs[:, 0], kind="stable")]
    pixel, begin = np.unique(pairs[:, 0], return_index=True)
    return Edges(segments, pixel, np.append(begin, len(pairs)).astype(np.int64), pairs[:, 1].copy())


def samples(order: npt.NDArray[np.int64], top: int, cuts: Edges | None = None) -> Samples:
    """Sample points of a band of pixels: Gauss points, or points of the pieces where edges cross.

    Parameters
    ----------
    order : (rows, columns) int64
        Gauss points along either axis of each pixel.
    top : int
        The band's first row.
    cuts : Edges, optional

    Returns
    -------
    Samples
    """
    from fringetrace.field import pixel_kernels

    columns = order.shape[1]
    order = order.ravel()
    count = order**2
    pieces, cut = np.empty((0, 5)), np.empty(0, dtype=np.int64)
    if cuts is not None:
        mine = slice(*np.searchsorted(cuts.pixel, [top * columns, top * columns + len(order)]))
        cut = cuts.pixel[mine] - top * columns
        # the triangles' points do for a quarter of a cycle: squares enough for the fringes of so many points
        parts = np.maximum(1, (3 * (order[cut] - 3) + 1) // 2)
        begin = cuts.begin[mine.start : mine.stop + 1]
        pieces, count[cut] = pixel_kernels.cut(
            cuts.pixel[mine], parts, begin, cuts.lines, cuts.segments, columns, TRIANGLE
        )
        order = order.copy()
        order[cut] = 0
    first = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    x, y, weight = (np.empty(first[-1]) for _ in range(3))
    pixel_kernels.lattice(order, columns, top, *gauss_table(order), first, x, y, weight)
    # rows of the cut pixels, in their order
    into = np.repeat(first[cut], count[cut]) + np.arange(len(pieces))
    into -= np.repeat(np.cumsum(count[cut]) - count[cut], count[cut])
    x[into], y[into], weight[into] = pieces[:, 0], pieces[:, 1], pieces[:, 2]
    where_x, where_y = x.copy(), y.copy()
    where_x[into], where_y[into] = pieces[:, 3], pieces[:, 4]
    return Samples(top, columns, first, x, y, weight, where_x, where_y)


def bands(order: Array) -> list[tuple[int, int]]:
    """Bands of pixel rows with about `BAND` samples each.

    Parameters
    ----------
    order : (rows, columns) int64
        Points along either axis of each pixel.

    Returns
    -------
    list of (first row, row after the last)
    """
    total = np.cumsum((order**2).sum(axis=1))
    cuts = np.searchsorted(total, np.arange(BAND, total[-1], BAND)) + 1
    edges = np.unique(np.concatenate([[0], cuts, [len(order)]]))
    return [(int(a), int(b)) for a, b in pairwise(edges)]


def fringes(slope: FloatArray, carrier: bool) -> FloatArray:
    """Steepest change of optical path over each pixel and its neighbours.

    Parameters
    ----------
    slope : (rows, columns, 4) float64, metres a pixel
        Lowest and highest gradient of the path at the centres of the pixels, along x, then along y,
        of the waves that overlap there.
    carrier : bool
        Count the gradient itself, which a mean field needs; else only differences, which make fringes.

    Returns
    -------
    (rows, columns) float64, metres
        0 where there is no wave. The neighbours stand for what bends within a pixel.
    """
    spans = np.abs(slope) if carrier else slope[..., 1::2] - slope[..., ::2]
    steepest = np.where(np.isfinite(slope[..., 0]), spans.max(axis=-1), 0.0)
    return np.asarray(_around(steepest), dtype=np.float64)


def averaged(
    shape: tuple[int, int],
    light: Light,
    period: float,
    carrier: bool,
    cuts: Edges | None = None,
    more: int = 0,
) -> tuple[ComplexArray, ComplexArray]:
    """Means over the pixels of the fields of groups, and of their products.

    Where light is even its value at the centre will do, with a quarter of a quarter of its curvature:
    the mean of f over a pixel is f + (f_xx + f_yy) / 24 to fourth order (Euler and Maclaurin).
    Elsewhere there are as many sample points as the fringes ask for, or what bends as they do.

    Parameters
    ----------
    shape : (rows, columns)
    light : callable
        The fields (groups, points) complex128 at the points of a band; it also widens `slope`, unless
        that is empty: a row for each point, see `fringes`.
    period : float, metres
        Wavelength of the light.
    carrier : bool
        Whether the mean fields matter: else only fringes between waves are resolved.
    cuts : Edges, optional
        Edges of sheets.
    more : int
        Points along either axis beyond those asked for, in every pixel: to see what they are worth.

    Returns
    -------
    mean : (groups, rows, columns) complex128
        Meaningless where a carrier averages out, unless `carrier`.
    mutual : (groups, groups, rows, columns) complex128
        Means of E_m conj(E_n); on the diagonal, the irradiances. The same bits for any number of cores.
    """
    centre, slope = _centres(shape, light)
    product = mutual_products(centre)
    cycles = fringes(slope, carrier) / period
    bend, cut = _curvature(product), _cut(shape, cuts)
    even = (cycles <= GENTLE) & ~cut & _small(bend, product)
    if carrier:
        bent = _curvature(centre)
        even &= _small(bent, centre)
        centre += bent
    if more:
        even[:] = False
    cycles = np.maximum(cycles, np.where(cut, 0.0, _swing(bend, product)))
    order = np.where(even, 0, gauss_order(cycles) + more)
    mean, mutual = _sampled(order, light, cuts)
    np.copyto(mean, centre, where=even)
    np.copyto(mutual, product + bend, where=even)
    return mean, mutual


def mutual_products(field: ComplexArray) -> ComplexArray:
    """Products E_m conj(E_n) of fields.

    Parameters
    ----------
    field : (groups, ...) complex128

    Returns
    -------
    (groups, groups, ...) complex128
    """
    return np.asarray(field[:, None] * np.conj(field[None]), dtype=np.complex128)


def _curvature(values: ComplexArray) -> ComplexArray:
    """(f_xx + f_yy) / 24 of images (..., rows, columns), by differences; 0 at the rim."""
    result = np.zeros_like(values)
    inner = result[..., 1:-1, 1:-1]
    np.add(values[..., 2:, 1:-1], values[..., :-2, 1:-1], out=inner)
    inner += values[..., 1:-1, 2:]
    inner += values[..., 1:-1, :-2]
    inner -= 4.0 * values[..., 1:-1, 1:-1]
    inner /= 24.0
    return result


def _small(bend: ComplexArray, values: ComplexArray) -> npt.NDArray[np.bool_]:
    """Where a correction (..., rows, columns) is a small part of the largest value around; not at the rim."""
    bend, values = (np.abs(f).reshape(-1, *f.shape[-2:]).max(axis=0) for f in (bend, values))
    small = np.zeros(values.shape, dtype=np.bool_)
    small[1:-1, 1:-1] = (_around(bend) <= BENT * _around(values))[1:-1, 1:-1]
    return small


def _swing(bend: ComplexArray, values: ComplexArray) -> FloatArray:
    """Cycles a pixel of a cosine that bends as much: (2 pi c)^2 / 24 of the largest value around."""
    bend, values = (np.abs(f).reshape(-1, *f.shape[-2:]).max(axis=0) for f in (bend, values))
    part = np.divide(bend, values := _around(values), out=np.zeros_like(values), where=values > 0.0)
    return np.asarray(np.sqrt(24.0 * _around(part)) / (2.0 * np.pi), dtype=np.float64)


def _cut(shape: tuple[int, int], cuts: Edges | None) -> npt.NDArray[np.bool_]:
    """Pixels that an edge crosses, and their neighbours."""
    crossed = np.zeros(shape, dtype=np.bool_)
    if cuts is not None:
        crossed.ravel()[cuts.pixel] = True
    return np.asarray(_around(crossed), dtype=np.bool_)


def _around(values: Array) -> Array:
    """The largest value of each pixel and its neighbours."""
    rows, columns = values.shape
    padded = np.pad(values, 1)
    wide = np.maximum(np.maximum(padded[:, :columns], padded[:, 1:-1]), padded[:, 2:])
    return np.asarray(np.maximum(np.maximum(wide[:rows], wide[1:-1]), wide[2:]))


def _centres(shape: tuple[int, int], light: Light) -> tuple[ComplexArray, FloatArray]:
    """Fields (groups, rows, columns) and slopes (rows, columns, 4) at the centres of the pixels."""
    order = np.ones(shape, dtype=np.int64)

    def centres(band: tuple[int, int]) -> tuple[ComplexArray, FloatArray]:
        points = samples(order[slice(*band)], band[0])
        slope = np.tile([np.inf, -np.inf, np.inf, -np.inf], (len(points.x), 1))
        return light(points, slope), slope

    field, slope = zip(*_each(centres, bands(order)), strict=True)
    return np.concatenate(field, axis=1).reshape(-1, *shape), np.concatenate(slope).reshape(*shape, 4)


def _sampled(
    order: npt.NDArray[np.int64], light: Light, cuts: Edges | None
) -> tuple[ComplexArray, ComplexArray]:
    """Means over pixels from order x order points in each; 0 where there are none."""
    none = np.empty((0, 4))

    def means(band: tuple[int, int]) -> tuple[ComplexArray, ComplexArray]:
        points = samples(order[slice(*band)], band[0], cuts)
        return points.means(light(points, none))

    mean, mutual = zip(*_each(means, bands(order)), strict=True)
    return np.concatenate(mean, axis=-2), np.concatenate(mutual, axis=-2)


def _each(work: Callable[[tuple[int, int]], T], parts: list[tuple[int, int]]) -> list[T]:
    """Results of all parts, in their order, worked on by all cores."""
    with ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="fringetrace") as pool:
        return list(pool.map(work, parts))
