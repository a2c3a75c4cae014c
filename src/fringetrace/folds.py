"""Folds of sheets (caustics on the CCD): the waves beside them, uniform across (Airy).

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

from fringetrace import raster
from fringetrace.caustics import NODES, airy_width, continued, foot, frame, locate, onto, pair, wave
from fringetrace.exact import jit, part
from fringetrace.quadrature import Samples
from fringetrace.raster import (
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
    patch,
    plain,
    scalar,
    widen,
)  # fmt: skip
from fringetrace.waves import ComplexArray, FloatArray

# Airy widths from a fold: how far into the dark (where Ai is 1e-6), and how far to the lit side. There the
# branches as rays take them are corrected from CLEAR on, by less and less.
DARK, CLEAR, LIT = 7.0, 6.0, 12.0
# Where a cusp or an edge is near, a part of the nodes' widths will do.
SCALES = np.array([1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125])
# A cell has a seed of a fold in each of so many squares a side; it stretches so many cells either way.
SQUARES, STRETCH = 3, 0.75
# A sample that lacks a node which its seed has tries again, so often, with nodes half as far.
TRIES = 3
# A branch diverges as z^(-1/4) at its own fold: there it is not corrected for another.
SHARED = 0.125
# Places on the grid so many cells apart are one.
SAME = 1e-4
# The slope of the first fringe beside a fold is that of two waves at this z.
FIRST = 2.0
# Columns of a seed: its place on the grid, on the CCD, normal to the lit side, Airy width in pixels,
# half a stretch in pixels, scale of the nodes, gradient of the path.
P, Q, X, Y, NORMAL_X, NORMAL_Y, WIDTH, REACH, SCALE, SLOPE_X, SLOPE_Y = range(11)
# Columns of two branches at a sample: the sample, z, W, A, B, turns; foot on the fold; the two roots, and
# how near to them a root is one of them; the row before at this sample; whether the row stands for both
# branches, or how much of what it says beyond rays is added to them.
SAMPLE, Z, WAY, RE_A, IM_A, RE_B, IM_B, TURNS, FOOT_P, FOOT_Q, P1, Q1, P2, Q2, NEAR, BEFORE, OWNS, PART = (
    range(18)
)


@dataclass(frozen=True, eq=False)
class Folds:
    """Cells of a sheet as `sheets.Cells` has them, and the folds on it.

    Attributes
    ----------
    index : (rows - 1, columns - 1) int64
        Cell on each square of the beam's grid, -1 where there is none.
    place : (cells, 2) int64
        Row and column of each cell; negative for one that is no square of the grid: no fold is followed there.
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


def folds(
    coefficients: FloatArray, leaves: FloatArray, folded: npt.NDArray[np.bool_], turns: npt.NDArray[np.int64],
    place: npt.NDArray[np.int64], period: float, unit: float,
) -> Folds:  # fmt: skip
    """Find the folds of a sheet.

    Parameters
    ----------
    coefficients, leaves, folded, turns, place
        Of `sheets.Cells`.
    period : float, metres
        Wavelength.
    unit : float
        Beam area of a cell in pixels.

    Returns
    -------
    Folds
    """
    squares = np.flatnonzero((place >= 0).all(axis=1))
    index = np.full(place.max(axis=0, initial=-1) + 1, -1, dtype=np.int64)
    index[tuple(place[squares].T)] = squares
    lines = np.tile([0.0, 0.0, -1.0], (len(place), 1))
    lines[leaves[:, CELL].astype(np.int64)] = leaves[:, A : C + 1]
    # J at the corners of each cell
    corner = np.array([[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]])
    corners = np.einsum("si,nij,tj->nst", corner, coefficients[:, 3], corner)
    signs = (corners.min(axis=(1, 2)) <= 0.0) & (corners.max(axis=(1, 2)) >= 0.0)
    crossed = np.flatnonzero(signs & (place >= 0).all(axis=1))
    found = np.empty((0, 11))
    if len(crossed):
        found = seeds(coefficients, index, turns, place, crossed, 2.0 * np.pi / period)
    return Folds(coefficients, leaves, folded, turns, place, index, lines, found, period, unit)


def light(sheet: Folds, points: Samples, slope: FloatArray) -> ComplexArray:
    """Field of a sheet at sample points.

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
        rows = beside(
            sheet.seeds, sheet.coefficients, sheet.index, sheet.lines, sheet.turns, wavenumber, *grid, latest
        )
        resolve(rows, latest)
        near |= touched(latest, points, sheet.leaves)
    raster.spread(sheet.leaves[~near], *cells, *grid, field, slope)
    if near.any():
        spread(sheet.leaves[near], *cells, sheet.place, rows, latest, *grid, field, slope)
    np.add.at(field, rows[:, SAMPLE].astype(np.int64), np.sqrt(sheet.unit) * uniform(rows, sheet.period))
    return np.asarray(field, dtype=np.complex128)


def uniform(rows: FloatArray, period: float) -> ComplexArray:
    """The field of two branches by the formula above, or what it has beyond rays' (Airy's asymptotes)."""
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
    """Whether the box of each leaf holds a pixel with a sample beside a fold."""
    sample = np.concatenate([[0], np.cumsum(latest >= 0)])
    pixels = (np.diff(sample[points.first]) > 0).reshape(-1, points.columns)
    total = np.pad(pixels.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    rows, columns = pixels.shape
    left, right = (np.clip(np.floor(leaves[:, k]), -1, columns).astype(np.int64) for k in (LEFT, RIGHT))
    low, high = (np.clip(np.floor(leaves[:, k]) - points.top, -1, rows).astype(np.int64) for k in (LOW, HIGH))
    left, low = np.clip(left, 0, columns), np.clip(low, 0, rows)
    right, high = np.clip(right + 1, left, columns), np.clip(high + 1, low, rows)
    return np.asarray(total[high, right] - total[low, right] - total[high, left] + total[low, left] > 0)


@jit
def seeds(cells, index, turns, place, crossed, wavenumber):
    """Points of the folds in some cells."""
    found = np.empty((SQUARES * SQUARES * len(crossed), 11))
    count = 0
    for cell in crossed:
        for square in range(SQUARES * SQUARES):
            middle_s, middle_t = (square % SQUARES + 0.5) / SQUARES, (square // SQUARES + 0.5) / SQUARES
            p, q = place[cell, 1] + middle_s, place[cell, 0] + middle_t
            there, p, q = onto(cells, index, p, q, 0.6 / SQUARES)
            if not there:
                continue
            x, y, normal_x, normal_y, across_p, across_q, bend, stretch = frame(cells, index, p, q)
            width = airy_width(cells, index, turns, wavenumber, p, q)
            if not (width > 0.0 and stretch > 0.0):
                continue
            for scale in SCALES:
                there, even, _, _, _, _, _ = continued(
                    cells, index, turns, wavenumber, p, q, width * scale, 0.0
                )
                if there and even:
                    at = width * scale * NODES[0]
                    _, p1, q1, p2, q2, _, _, _, _, _ = pair(
                        cells, index, turns, wavenumber, p, q, across_p, across_q, bend, at,
                        x + at * normal_x, y + at * normal_y,
                    )  # fmt: skip
                    _, one_x, one_y, _, _, _ = wave(cells, index, p1, q1)
                    _, two_x, two_y, _, _, _ = wave(cells, index, p2, q2)
                    found[count] = np.array([
                        p, q, x, y, normal_x, normal_y, width, STRETCH * stretch, scale,
                        0.5 * (one_x + two_x), 0.5 * (one_y + two_y),
                    ])  # fmt: skip
                    count += 1
                    break
    return found[:count]


@jit
def window(seed, depth, height, slack, top, rows, columns):
    """Pixels that may lie in the strip across a fold at a seed: rows and columns, from and to."""
    left, right, low, high = np.inf, -np.inf, np.inf, -np.inf
    reach = seed[REACH] + slack
    for side in (-reach, reach):
        for far in (-depth * seed[WIDTH] - slack, height * seed[WIDTH] + slack):
            x = seed[X] + far * seed[NORMAL_X] - side * seed[NORMAL_Y]
            y = seed[Y] + far * seed[NORMAL_Y] + side * seed[NORMAL_X]
            left, right, low, high = min(left, x), max(right, x), min(low, y), max(high, y)
    return (
        int(min(max(np.floor(low), top), top + rows)), int(min(max(np.floor(high) + 1.0, top), top + rows)),
        int(min(max(np.floor(left), 0.0), columns)), int(min(max(np.floor(right) + 1.0, 0.0), columns)),
    )  # fmt: skip


@jit
def widen_beside(seeds, wavenumber, top, columns, first, x, y, slope):
    """Widen the gradients in pixels beside folds, which may cross them anywhere, by the first fringe's."""
    rows = (len(first) - 1) // columns
    for seed in seeds:
        fringe = np.sqrt(FIRST) / (wavenumber * seed[WIDTH])
        low, high, begin, end = window(seed, FIRST, FIRST, 1.0, top, rows, columns)
        for i in range(low, high):
            for j in range(begin, end):
                for k in range(first[(i - top) * columns + j], first[(i - top) * columns + j + 1]):
                    dx, dy = x[k] - seed[X], y[k] - seed[Y]
                    if abs(dy * seed[NORMAL_X] - dx * seed[NORMAL_Y]) > seed[REACH] + 1.0:
                        continue
                    if abs(dx * seed[NORMAL_X] + dy * seed[NORMAL_Y]) > FIRST * seed[WIDTH] + 1.0:
                        continue
                    for sign in (-fringe, fringe):
                        across = seed[SLOPE_X] + sign * seed[NORMAL_X]
                        up = seed[SLOPE_Y] + sign * seed[NORMAL_Y]
                        widen(slope[k], across, up)


@jit
def beside(seeds, cells, index, lines, turns, wavenumber, top, columns, first, x, y, latest):
    """Two branches at each sample beside a fold, in the dark too: rows; `latest` of each sample."""
    found = np.empty((1024, 18))
    count = 0
    rows = (len(first) - 1) // columns
    for seed in seeds:
        low, high, begin, end = window(seed, DARK, 1.1 * LIT, 0.0, top, rows, columns)
        for i in range(low, high):
            for j in range(begin, end):
                for k in range(first[(i - top) * columns + j], first[(i - top) * columns + j + 1]):
                    dx, dy = x[k] - seed[X], y[k] - seed[Y]
                    height = (dx * seed[NORMAL_X] + dy * seed[NORMAL_Y]) / seed[WIDTH]
                    if abs(dy * seed[NORMAL_X] - dx * seed[NORMAL_Y]) > seed[REACH]:
                        continue
                    if height < -DARK or height > 1.1 * LIT:
                        continue
                    # another seed of the same stretch may have been there
                    if known(found, latest[k], seed[P], seed[Q], STRETCH):
                        continue
                    there, p, q = foot(cells, index, seed[P], seed[Q], x[k], y[k])
                    if not there or max(abs(p - seed[P]), abs(q - seed[Q])) > 2.0 * STRETCH:
                        continue
                    if known(found, latest[k], p, q, SAME):
                        continue
                    if count == len(found):
                        larger = np.empty((2 * count, 18))
                        larger[:count] = found
                        found = larger
                    found[count, SAMPLE], found[count, BEFORE] = k, latest[k]
                    if branches(seed, cells, index, lines, turns, wavenumber, p, q, x[k], y[k], found[count]):
                        latest[k] = count
                        count += 1
    return found[:count]


@jit
def known(found, row, p, q, reach):
    """Whether one of the rows of a sample has its foot on a fold within reach of (p, q)."""
    while row >= 0:
        if abs(found[row, FOOT_P] - p) + abs(found[row, FOOT_Q] - q) < reach:
            return True
        row = int(found[row, BEFORE])
    return False


@jit
def branches(seed, cells, index, lines, turns, wavenumber, p, q, x, y, row):
    """Fill in the two branches at a sample whose foot on the fold is (p, q); whether there are any."""
    if not within(index, lines, p, q):
        return False
    at_x, at_y, normal_x, normal_y, across_p, across_q, bend, _ = frame(cells, index, p, q)
    height = (x - at_x) * normal_x + (y - at_y) * normal_y
    width = seed[WIDTH] * seed[SCALE]
    if height > NODES[0] * width:
        there, p1, q1, p2, q2, z, way, a, b, passed = pair(
            cells, index, turns, wavenumber, p, q, across_p, across_q, bend, height, x, y
        )
        there = there and within(index, lines, p1, q1) and within(index, lines, p2, q2)
        near = SAME
    else:
        there, z, way, a, b, passed = False, 0.0, 0.0, 0.0j, 0.0j, 0
        for _ in range(TRIES):
            there, _, z, way, a, b, passed = continued(cells, index, turns, wavenumber, p, q, width, height)
            if there:
                break
            width *= 0.5
        p1, q1, p2, q2 = p, q, p, q
        near = 2.0 * np.sqrt(2.0 * NODES[0] * width / bend)
    even = height / seed[WIDTH]
    # not another fold's, nor out of the polynomial's depth
    if not there or z > LIT or not 0.3 < z / even < 3.0:
        return False
    row[Z : TURNS + 1] = np.array([z, way, a.real, a.imag, b.real, b.imag, float(passed)])
    row[FOOT_P : NEAR + 1] = np.array([p, q, p1, q1, p2, q2, near])
    row[OWNS], row[PART] = (1.0, 1.0) if z < CLEAR else (0.0, (LIT - z) / (LIT - CLEAR))
    return True


@jit
def resolve(found, latest):
    """A branch between two folds (near a cusp) is the nearer one's, and corrected for the other."""
    for k in range(len(latest)):
        row = latest[k]
        while row >= 0:
            other = latest[k]
            while other >= 0:
                if found[other, OWNS] == 1.0 and found[row, Z] > found[other, Z]:
                    shared = owns(found[other], found[row, P1], found[row, Q1])
                    if shared or owns(found[other], found[row, P2], found[row, Q2]):
                        found[row, OWNS] = 0.0
                        found[row, PART] *= 1.0 - np.exp(-SHARED * max(found[other, Z], 0.0) ** 3)
                other = int(found[other, BEFORE])
            row = int(found[row, BEFORE])


@jit
def owns(row, p, q):
    """Whether a root is one of the two of a row."""
    one = max(abs(row[P1] - p), abs(row[Q1] - q)) < row[NEAR]
    return one or max(abs(row[P2] - p), abs(row[Q2] - q)) < row[NEAR]


@jit
def taken(found, row, p, q):
    """Whether a root is one of two that a row of its sample has."""
    while row >= 0:
        if found[row, OWNS] == 1.0 and owns(found[row], p, q):
            return True
        row = int(found[row, BEFORE])
    return False


@jit
def within(index, lines, p, q):
    """Whether the sheet is there at a place of the grid."""
    cell, s, t = locate(index, p, q)
    return cell >= 0 and lines[cell, 0] * s + lines[cell, 1] * t >= lines[cell, 2]


@part
def inside(cells, cell, leaf, sign, s, t, x, y):
    """Where in a leaf a branch of the map meets (x, y), from (s, t) on: found, s, t and the Jacobian."""
    wide, tall = leaf[S1] - leaf[S0], leaf[T1] - leaf[T0]
    leave = 2.0 if leaf[SIGN] == 0.0 else 0.5
    area = 0.0
    for _ in range(12):
        px, xs, xt = patch(cells, cell, 0, s, t)
        py, ys, yt = patch(cells, cell, 1, s, t)
        area = xs * yt - xt * ys
        if area * sign <= 0.0:
            return False, s, t, area
        dx, dy = x - px, y - py
        ds, dt = (yt * dx - xt * dy) / area, (xs * dy - ys * dx) / area
        stretch = max(abs(ds) / wide, abs(dt) / tall)
        if stretch > 0.75:
            ds, dt = ds * 0.75 / stretch, dt * 0.75 / stretch
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
    """A step, halved until it does not cross the fold."""
    for _ in range(6):
        _, xs, xt = patch(cells, cell, 0, s + ds, t + dt)
        _, ys, yt = patch(cells, cell, 1, s + ds, t + dt)
        if (xs * yt - xt * ys) * sign > 0.0:
            break
        ds, dt = 0.5 * ds, 0.5 * dt
    return ds, dt


@part
def probe(cells, cell, leaf, sign):
    """Where to start in a leaf: its middle, or in a fold the probe with the largest J of that sign."""
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
def spread(
    leaves, cells, folded, turns, unit, period, place, rows, latest, top, columns, first, x, y, field, slope
):
    """Add the waves of leaves on and beside folds, but those that `rows` have, see `raster.spread`."""
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
