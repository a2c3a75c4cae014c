"""Compiled search for folds of a wavefront, and for the two branches at samples beside a fold.

See `folds` for the field that they make, `raster` for cells and samples.
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import grown, jit
from fringetrace.field.wavefront.fold_geometry import (
    NODES,
    airy_width,
    continued,
    foot,
    frame,
    locate,
    onto,
    pair,
    wave,
)
from fringetrace.field.wavefront.raster_kernels import widen

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


@jit
def seeds(cells, index, turns, place, crossed, wavenumber):
    """Points on the folds of cells."""
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
                    seed = found[count]
                    seed[P], seed[Q], seed[X], seed[Y] = p, q, x, y
                    seed[NORMAL_X], seed[NORMAL_Y] = normal_x, normal_y
                    seed[WIDTH], seed[REACH], seed[SCALE] = width, STRETCH * stretch, scale
                    seed[SLOPE_X], seed[SLOPE_Y] = 0.5 * (one_x + two_x), 0.5 * (one_y + two_y)
                    count += 1
                    break
    return found[:count]


@jit
def window(seed, depth, height, slack, top, rows, columns):
    """Pixel range (rows and columns, from and to) that may lie in the strip across a fold at a seed."""
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
    """Widen the phase gradients of pixels beside folds by those of the first Airy fringe."""
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
def branches_beside_folds(seeds, cells, index, lines, turns, wavenumber, top, columns, first, x, y, latest):
    """Two branches at each sample beside a fold, on its dark side too: rows; `latest` of each sample."""
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
                        found = grown(found)
                    found[count, SAMPLE], found[count, BEFORE] = k, latest[k]
                    if branches(seed, cells, index, lines, turns, wavenumber, p, q, x[k], y[k], found[count]):
                        latest[k] = count
                        count += 1
    return found[:count]


@jit
def known(found, row, p, q, reach):
    """Whether one of a sample's rows has its foot on a fold within reach of (p, q)."""
    while row >= 0:
        if abs(found[row, FOOT_P] - p) + abs(found[row, FOOT_Q] - q) < reach:
            return True
        row = int(found[row, BEFORE])
    return False


@jit
def branches(seed, cells, index, lines, turns, wavenumber, p, q, x, y, row):
    """Fill in the two branches at a sample whose foot on the fold is (p, q); whether they exist."""
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
    row[Z], row[WAY], row[TURNS] = z, way, passed
    row[RE_A], row[IM_A], row[RE_B], row[IM_B] = a.real, a.imag, b.real, b.imag
    row[FOOT_P], row[FOOT_Q], row[NEAR] = p, q, near
    row[P1], row[Q1], row[P2], row[Q2] = p1, q1, p2, q2
    row[OWNS], row[PART] = (1.0, 1.0) if z < CLEAR else (0.0, (LIT - z) / (LIT - CLEAR))
    return True


@jit
def resolve(found, latest):
    """Assign a branch between two folds (near a cusp) to the nearer one, corrected for the other."""
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
def within(index, lines, p, q):
    """Whether the wavefront exists at a point of the grid."""
    cell, s, t = locate(index, p, q)
    return cell >= 0 and lines[cell, 0] * s + lines[cell, 1] * t >= lines[cell, 2]


@jit
def taken(found, row, p, q):
    """Whether a root belongs to a row of its sample."""
    while row >= 0:
        if found[row, OWNS] == 1.0 and owns(found[row], p, q):
            return True
        row = int(found[row, BEFORE])
    return False
