"""Sample points on the pixels: their number, their positions, and means over them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray, short_repr

# Gauss points a pixel, along either axis: at least LEAST, for the curvature of a smooth irradiance.
LEAST, MOST = 2, 32
# What the quadrature of a fringe may be off, relative to its amplitude.
ERROR = 1e-6
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

    __repr__ = short_repr

    def blank(self, groups: int) -> ComplexArray:
        """Zero field at the sample points, (groups, points)."""
        return np.zeros((groups, len(self.x)), dtype=np.complex128)

    def add_means(
        self, field: ComplexArray, where: npt.NDArray[np.bool_], weight: float, products: bool,
        total: ComplexArray,
    ) -> None:  # fmt: skip
        """Add means over some pixels of the band to images.

        Parameters
        ----------
        field : (groups, points) complex128
        where : (rows, columns) bool
        weight : float
        products : bool
            Means of E_m conj(E_n) instead of those of the fields.
        total : (groups, rows, columns) complex128, or (groups**2, rows, columns)
        """
        from fringetrace.field import pixel_kernels

        add = pixel_kernels.add_mean_products if products else pixel_kernels.add_means
        add(self.first, self.weight, field, where, weight, total)


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

    __repr__ = short_repr


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
