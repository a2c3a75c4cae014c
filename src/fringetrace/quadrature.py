"""Sample points on the pixels: how many a fringe needs, where they lie, and the means over pixels."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from fringetrace.waves import Array, ComplexArray, FloatArray

# Gauss points a pixel, along either axis: at least LEAST, for the curvature of a smooth irradiance.
LEAST, MOST = 2, 32
# What the quadrature of a fringe may be off, relative to its amplitude.
ERROR = 1e-6
# Samples worked on at a time: what fits into a core's cache a few times over.
BAND = 1 << 18


def gauss_order(cycles: FloatArray) -> npt.NDArray[np.int64]:
    """Gauss points that integrate so many cycles of a wave over an interval.

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
    limits = 4.0 * n / (np.e * np.pi) * ERROR ** (0.5 / n)
    return np.minimum(LEAST + np.searchsorted(limits, cycles), MOST).astype(np.int64)


def gauss_table() -> tuple[FloatArray, FloatArray]:
    """Nodes and weights on [0, 1] of the Gauss-Legendre rules.

    Returns
    -------
    nodes, weights : (MOST + 1, MOST) float64
        Row n is the rule of n points.
    """
    nodes, weights = np.zeros((MOST + 1, MOST)), np.zeros((MOST + 1, MOST))
    for n in range(1, MOST + 1):
        at, weight = np.polynomial.legendre.leggauss(n)
        nodes[n, :n], weights[n, :n] = 0.5 + 0.5 * at, 0.5 * weight
    return nodes, weights


@dataclass(frozen=True, eq=False)
class Samples:
    """Sample points of a band of pixel rows from row `top` on; positions in pixels.

    Those of pixel i are first[i] to first[i + 1]; their weights add up to 1.
    """

    top: int
    columns: int
    first: npt.NDArray[np.int64]
    x: FloatArray
    y: FloatArray
    weight: FloatArray

    def blank(self) -> ComplexArray:
        """No light yet, at each point."""
        return np.zeros(len(self.x), dtype=np.complex128)

    def means(self, field: ComplexArray) -> tuple[ComplexArray, FloatArray]:
        """Mean field and mean irradiance of each pixel of the band.

        Parameters
        ----------
        field : (points,) complex128

        Returns
        -------
        mean : (rows, columns) complex128
        irradiance : (rows, columns) float64
        """
        from fringetrace import raster

        mean = np.empty(len(self.first) - 1, dtype=np.complex128)
        irradiance = np.empty(len(mean))
        raster.average(self.first, self.weight, field, mean, irradiance)
        return mean.reshape(-1, self.columns), irradiance.reshape(-1, self.columns)


def gauss_samples(order: npt.NDArray[np.int64], top: int) -> Samples:
    """Gauss points of a band of pixels.

    Parameters
    ----------
    order : (rows, columns) int64
        Points along either axis of each pixel.
    top : int
        The band's first row.

    Returns
    -------
    Samples
    """
    from fringetrace import raster

    columns = order.shape[1]
    first = np.concatenate([[0], np.cumsum(order.ravel() ** 2)]).astype(np.int64)
    x, y, weight = (np.empty(first[-1]) for _ in range(3))
    raster.lattice(order.ravel(), columns, top, *gauss_table(), first, x, y, weight)
    return Samples(top, columns, first, x, y, weight)


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
    """Steepest change of phase over each pixel and its neighbours, as a path.

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
    steepest = np.pad(np.where(np.isfinite(slope[..., 0]), spans.max(axis=-1), 0.0), 1)
    rows, columns = slope.shape[:2]
    around = [steepest[i : i + rows, j : j + columns] for i in range(3) for j in range(3)]
    return np.asarray(np.max(around, axis=0), dtype=np.float64)


def averaged(
    order: npt.NDArray[np.int64], light: Callable[[Samples], ComplexArray]
) -> tuple[ComplexArray, FloatArray]:
    """Means over the pixels of a field, band by band on all cores.

    Parameters
    ----------
    order : (rows, columns) int64
        Gauss points along either axis of each pixel.
    light : callable
        The field at the points of a band.

    Returns
    -------
    mean : (rows, columns) complex128
    irradiance : (rows, columns) float64
        The same bits for any number of cores.
    """

    def means(band: tuple[int, int]) -> tuple[ComplexArray, FloatArray]:
        samples = gauss_samples(order[slice(*band)], band[0])
        return samples.means(light(samples))

    with ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="fringetrace") as pool:
        means_, irradiances = zip(*pool.map(means, bands(order)), strict=True)
    return np.concatenate(means_), np.concatenate(irradiances)
