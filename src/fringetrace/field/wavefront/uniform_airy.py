"""Uniform Airy field across folds (caustics on the CCD), after Chester, Friedman and Ursell.

Where the Jacobian J of the map from the beam's grid to the CCD changes its sign, two branches of a
sheet end. On the lit side of a fold they add to

    E = sqrt(pi) exp(i (k W - pi/4 - m pi/2)) (A Ai(-z) + i B Ai'(-z)),  z = (3/4 k dW)^(2/3),
    A = (a + a') z^(1/4),  B = (a' - a) z^(-1/4),

with the amplitudes a, a' and caustics passed m, m + 1 of the earlier and the later, W the mean of
their paths, dW the difference. A, B, W and z / h are smooth in the distance h from the fold; next
to it and on its dark side they go on as polynomials from the lit side. Source: C. Chester, B. Friedman,
F. Ursell, Proc. Camb. Phil. Soc. 53 (1957) 599; D. Ludwig, Commun. Pure Appl. Math. 19 (1966) 215.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, FloatArray, jit, part
from fringetrace.field.sample_points import Samples
from fringetrace.field.wavefront import raster_kernels
from fringetrace.field.wavefront.fold_branches import (
    CLEAR,
    IM_A,
    IM_B,
    OWNS,
    PART,
    RE_A,
    RE_B,
    SAMPLE,
    TURNS,
    WAY,
    Z,
    branches_beside_folds,
    resolve,
    seeds,
    taken,
    widen_beside,
)
from fringetrace.field.wavefront.patches import PatchCells
from fringetrace.field.wavefront.raster_kernels import (
    CELL,
    HIGH,
    LEFT,
    LOW,
    NUDGE_S,
    NUDGE_T,
    RIGHT,
    S0,
    S1,
    SIGN,
    T0,
    T1,
    A,
    B,
    C,
    gradient,
    newton,
    patch,
    plain,
    scalar,
    widen,
)


@dataclass(frozen=True, eq=False)
class Folds:
    """Folds of a wavefront at a wavelength, with its `PatchCells`.

    Attributes
    ----------
    index : (rows - 1, columns - 1) int64
        Cell on each square of the beam's grid, -1 where there is none.
    place : (cells, 2) int64
        Row and column of each cell; negative if it is no square of the grid: no fold is followed there.
    lines : (cells, 3) float64
        The sheet is there where a s + b t >= c.
    seeds : (n, 11) float64
        Points of folds; empty where nothing folds.
    period : float, metres
        Wavelength.
    unit : float
        Beam area of a cell in pixels.
    """

    coefficients: FloatArray
    leaves: FloatArray
    folded: npt.NDArray[np.bool_]
    turns: npt.NDArray[np.int64]
    place: npt.NDArray[np.int64]
    index: npt.NDArray[np.int64]
    lines: FloatArray
    seeds: FloatArray
    period: float
    unit: float


def folds(sheet: PatchCells, period: float, unit: float, component: int = 0) -> Folds:
    """Find the folds of a wavefront.

    Parameters
    ----------
    sheet : PatchCells
    period : float, metres
        Wavelength.
    unit : float
        Beam area of a cell in pixels.
    component : int
        Of light with a polarisation.

    Returns
    -------
    Folds
    """
    coefficients, leaves, turns, place = sheet.component(component), sheet.leaves, sheet.turns, sheet.place
    squares = np.flatnonzero((place >= 0).all(axis=1))
    index = np.full(place.max(axis=0, initial=-1) + 1, -1, dtype=np.int64)
    index[tuple(place[squares].T)] = squares
    lines = np.tile([0.0, 0.0, -1.0], (len(place), 1))
    lines[leaves[:, CELL].astype(np.int64)] = leaves[:, A : C + 1]
    crossed = np.flatnonzero(sheet.crossed)
    found = np.empty((0, 11))
    if len(crossed):
        found = seeds(coefficients, index, turns, place, crossed, 2.0 * np.pi / period)
    return Folds(coefficients, leaves, sheet.folded, turns, place, index, lines, found, period, unit)


def light(sheet: Folds, points: Samples, slope: FloatArray) -> ComplexArray:
    """Field of a wavefront at sample points.

    Parameters
    ----------
    sheet : Folds
    points : Samples
    slope : (points, 4) or (0, 4) float64, metres a pixel
        Lowest and highest gradient of the path along x and y; where there are rows, they are widened
        to what each sample has seen, or would see beside the fold in its pixel.

    Returns
    -------
    (points,) complex128
    """
    field = points.blank(1)[0]
    grid = points.top, points.columns, points.first, points.x, points.y
    cells = sheet.coefficients, sheet.folded, sheet.turns, sheet.unit, sheet.period
    near = sheet.leaves[:, SIGN] == 0.0
    rows, latest = np.empty((0, 18)), np.full(len(points.x), -1)
    if len(slope):
        widen_beside(sheet.seeds, 2.0 * np.pi / sheet.period, *grid[:3], points.x, points.y, slope)
    if len(sheet.seeds):
        wavenumber = 2.0 * np.pi / sheet.period
        rows = branches_beside_folds(
            sheet.seeds, sheet.coefficients, sheet.index, sheet.lines, sheet.turns, wavenumber, *grid, latest
        )
        resolve(rows, latest)
        near |= touched(latest, points, sheet.leaves)
    apart = raster_kernels.leaf_contributions(sheet.leaves[~near], *cells[:4], *grid, slope)
    one = np.array([1.0 + 0.0j])
    raster_kernels.add_waves(
        apart, np.array([0, len(apart)]), 0, sheet.period, np.zeros(1, np.int64), one, field[None]
    )
    if near.any():
        add_folds(sheet.leaves[near], *cells, sheet.place, rows, latest, *grid, field, slope)
    np.add.at(field, rows[:, SAMPLE].astype(np.int64), np.sqrt(sheet.unit) * uniform(rows, sheet.period))
    return np.asarray(field, dtype=np.complex128)


def uniform(rows: FloatArray, period: float) -> ComplexArray:
    """Uniform Airy field of two branches, or its difference from the ray field (Airy's asymptotes)."""
    from scipy.special import airy

    ai, slope, _, _ = airy(-rows[:, Z])
    z = np.maximum(rows[:, Z], CLEAR * 1e-3)
    phase = 2.0 / 3.0 * z**1.5 - 0.25 * np.pi
    beyond = np.where(rows[:, OWNS] == 1.0, 0.0, 1.0 / np.sqrt(np.pi))
    ai = rows[:, PART] * (ai - beyond * np.cos(phase) / z**0.25)
    slope = rows[:, PART] * (slope - beyond * np.sin(phase) * z**0.25)
    turn = np.fmod(rows[:, WAY], period) / period - 0.125 - 0.25 * rows[:, TURNS]
    value = (rows[:, RE_A] + 1j * rows[:, IM_A]) * ai + 1j * (rows[:, RE_B] + 1j * rows[:, IM_B]) * slope
    return np.asarray(np.sqrt(np.pi) * np.exp(2j * np.pi * turn) * value)


def touched(latest: npt.NDArray[np.int64], points: Samples, leaves: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether the box of each leaf contains a pixel with a sample beside a fold."""
    sample = np.concatenate([[0], np.cumsum(latest >= 0)])
    pixels = (np.diff(sample[points.first]) > 0).reshape(-1, points.columns)
    total = np.pad(pixels.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    rows, columns = pixels.shape
    left, right = (np.clip(np.floor(leaves[:, k]), -1, columns).astype(np.int64) for k in (LEFT, RIGHT))
    low, high = (np.clip(np.floor(leaves[:, k]) - points.top, -1, rows).astype(np.int64) for k in (LOW, HIGH))
    left, low = np.clip(left, 0, columns), np.clip(low, 0, rows)
    right, high = np.clip(right + 1, left, columns), np.clip(high + 1, low, rows)
    return np.asarray(total[high, right] - total[low, right] - total[high, left] + total[low, left] > 0)


@part
def inside(cells, cell, leaf, sign, s, t, x, y):
    """Root (s, t) of the map at (x, y) in a leaf, with the Jacobian there."""
    wide, tall = leaf[S1] - leaf[S0], leaf[T1] - leaf[T0]
    leave = 2.0 if leaf[SIGN] == 0.0 else 0.5
    area = 0.0
    for _ in range(12):
        px, xs, xt = patch(cells, cell, 0, s, t)
        py, ys, yt = patch(cells, cell, 1, s, t)
        area = xs * yt - xt * ys
        if area * sign <= 0.0:
            return False, s, t, area
        ds, dt, stretch = newton(px, py, xs, xt, ys, yt, area, x, y, wide, tall)
        if leaf[SIGN] == 0.0:
            ds, dt = halved(cells, cell, sign, s, t, ds, dt)
        s, t = s + ds, t + dt
        if stretch < 1e-6:
            break
        if s < leaf[S0] - leave * wide or s > leaf[S1] + leave * wide:
            return False, s, t, area
        if t < leaf[T0] - leave * tall or t > leaf[T1] + leave * tall:
            return False, s, t, area
    u, v = s + NUDGE_S, t + NUDGE_T
    return (leaf[S0] <= u < leaf[S1] and leaf[T0] <= v < leaf[T1]), s, t, area


@jit
def halved(cells, cell, sign, s, t, ds, dt):
    """Newton step halved until it does not cross the fold."""
    for _ in range(6):
        _, xs, xt = patch(cells, cell, 0, s + ds, t + dt)
        _, ys, yt = patch(cells, cell, 1, s + ds, t + dt)
        if (xs * yt - xt * ys) * sign > 0.0:
            break
        ds, dt = 0.5 * ds, 0.5 * dt
    return ds, dt


@part
def probe(cells, cell, leaf, sign):
    """Start of the root search in a leaf: its middle, or the point with the largest J of one sign."""
    best, at_s, at_t = 0.0, 0.5 * (leaf[S0] + leaf[S1]), 0.5 * (leaf[T0] + leaf[T1])
    if leaf[SIGN] != 0.0:
        return True, at_s, at_t
    for i in range(5):
        for j in range(5):
            s = leaf[S0] + 0.25 * i * (leaf[S1] - leaf[S0])
            t = leaf[T0] + 0.25 * j * (leaf[T1] - leaf[T0])
            _, xs, xt = patch(cells, cell, 0, s, t)
            _, ys, yt = patch(cells, cell, 1, s, t)
            area = sign * (xs * yt - xt * ys)
            if area > best:
                best, at_s, at_t = area, s, t
    return best > 0.0, at_s, at_t


@jit
def add_folds(
    leaves, cells, folded, turns, unit, period, place, rows, latest, top, columns, first, x, y, field, slope
):
    """Add the waves of leaves on and beside folds, except `rows`; see `leaf_contributions`."""
    for leaf in leaves:
        cell = int(leaf[CELL])
        low, above = max(int(np.floor(leaf[LOW])), top), int(np.floor(leaf[HIGH]))
        above = min(above, top + (len(first) - 1) // columns - 1)
        begin, end = max(int(np.floor(leaf[LEFT])), 0), min(int(np.floor(leaf[RIGHT])), columns - 1)
        if low > above:
            continue
        for branch in range(2):
            sign = 2.0 * branch - 1.0
            if leaf[SIGN] == -sign:
                continue
            there, s, t = probe(cells, cell, leaf, sign)
            if not there:
                continue
            phase = np.exp(-0.5j * np.pi * turns[cell, branch])
            for i in range(low, above + 1):
                for j in range(begin, end + 1):
                    pixel = (i - top) * columns + j
                    for k in range(first[pixel], first[pixel + 1]):
                        found, a, b, area = inside(cells, cell, leaf, sign, s, t, x[k], y[k])
                        if not found or leaf[A] * a + leaf[B] * b < leaf[C]:
                            continue
                        if leaf[SIGN] != 0.0:  # the next sample is near
                            s, t = a, b
                        if len(slope) > 0:
                            across, up = gradient(cells, cell, a, b)
                            widen(slope[k], across, up)
                        if taken(rows, latest[k], place[cell, 1] + a, place[cell, 0] + b):
                            continue
                        spreading = area if folded[cell] else scalar(cells, cell, 3, a, b)
                        field[k] += phase * plain(cells, cell, a, b, spreading, unit, period)
