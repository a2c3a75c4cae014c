"""Compiled geometry of folds (caustics) on the beam's grid: foot points, branches, continuation.

The map from the grid (p along its columns, q along its rows) to the CCD is that of the cells of a
sheet, see `raster`; `index` has the cell on each square of the grid, -1 where there is none.
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit, part
from fringetrace.field.wavefront.raster_kernels import patch, scalar

# Airy widths that the waves next to a fold and in the dark are continued from. Nearer than the first, the
# difference of two paths drowns in the error of either.
NODES = np.array([0.3, 1.0, 2.0, 3.2])
# They do if A is even to this factor: it rises towards another fold.
EVEN = 1.2


@part
def curved(cells, cell, f, s, t):
    """Value of field f of a cell, with first and second derivatives along s and t."""
    value, along_s, along_ss, along_t, along_st, along_tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3, -1, -1):
        c0, c1 = cells[cell, f, i, 0], cells[cell, f, i, 1]
        c2, c3 = cells[cell, f, i, 2], cells[cell, f, i, 3]
        along_ss = along_ss * s + along_s
        along_s = along_s * s + value
        value = value * s + (((c3 * t + c2) * t + c1) * t + c0)
        along_st = along_st * s + along_t
        along_t = along_t * s + ((3.0 * c3 * t + 2.0 * c2) * t + c1)
        along_tt = along_tt * s + (6.0 * c3 * t + 2.0 * c2)
    return value, along_s, along_t, 2.0 * along_ss, along_st, along_tt


@jit
def locate(index, p, q):
    """Cell at a point of the grid, -1 if there is none, and s, t in it; half a cell beyond the rim."""
    rows, columns = index.shape
    if not (-0.5 <= p <= columns + 0.5 and -0.5 <= q <= rows + 0.5):
        return -1, 0.0, 0.0
    column = min(max(int(np.floor(p)), 0), columns - 1)
    row = min(max(int(np.floor(q)), 0), rows - 1)
    return index[row, column], p - column, q - row


@jit
def follow(cells, index, p, q, dp, dq, sign, x, y):
    """Newton root of the map at (x, y) with J of one sign, from a step off a fold: found, p, q."""
    last = False
    for _ in range(40):
        cell, s, t = locate(index, p + dp, q + dq)
        area = 0.0
        if cell >= 0:
            px, xs, xt = patch(cells, cell, 0, s, t)
            py, ys, yt = patch(cells, cell, 1, s, t)
            area = sign * (xs * yt - xt * ys)
        if area <= 0.0:  # off the grid or beyond the fold
            if dp * dp + dq * dq < 1e-16:
                return False, p, q
            dp, dq = 0.5 * dp, 0.5 * dq
            last = False
            continue
        p, q = p + dp, q + dq
        if last:
            return True, p, q
        dx, dy = sign * (x - px) / area, sign * (y - py) / area
        dp, dq = yt * dx - xt * dy, xs * dy - ys * dx
        last = max(abs(dp), abs(dq)) < 1e-5
    return False, p, q


@jit
def foot(cells, index, p, q, x, y):
    """Foot point of (x, y) on a fold, by Newton from (p, q): found, p, q."""
    step = np.inf
    for _ in range(20):
        cell, s, t = locate(index, p, q)
        if cell < 0:
            return False, p, q
        px, xs, xt, xss, xst, xtt = curved(cells, cell, 0, s, t)
        py, ys, yt, yss, yst, ytt = curved(cells, cell, 1, s, t)
        if step < 1e-8:
            return True, p, q
        area = xs * yt - xt * ys
        area_s = xss * yt + xs * yst - xst * ys - xt * yss
        area_t = xst * yt + xs * ytt - xtt * ys - xt * yst
        dx, dy = x - px, y - py
        if xs * xs + ys * ys > xt * xt + yt * yt:
            off = dx * xs + dy * ys
            off_s = xs * xs + ys * ys - dx * xss - dy * yss
            off_t = xs * xt + ys * yt - dx * xst - dy * yst
        else:
            off = dx * xt + dy * yt
            off_s = xs * xt + ys * yt - dx * xst - dy * yst
            off_t = xt * xt + yt * yt - dx * xtt - dy * ytt
        bulk = area_s * off_t - area_t * off_s
        if bulk == 0.0:
            return False, p, q
        dp, dq = -(area * off_t + area_t * off) / bulk, (area_s * off + off_s * area) / bulk
        step = max(abs(dp), abs(dq))
        shrink = 0.5 / max(step, 0.5)
        p, q = p + dp * shrink, q + dq * shrink
    return False, p, q


@jit
def frame(cells, index, p, q):
    """Local frame of a fold: x, y; normal to its lit side; grid direction of growing J; bend; stretch.

    Half of `bend` times the square of a step across on the grid is the distance from the fold in pixels;
    `stretch` is how many pixels a step along the fold takes.
    """
    cell, s, t = locate(index, p, q)
    x, xs, xt, xss, xst, xtt = curved(cells, cell, 0, s, t)
    y, ys, yt, yss, yst, ytt = curved(cells, cell, 1, s, t)
    along_x, along_y = (xs, ys) if xs * xs + ys * ys > xt * xt + yt * yt else (xt, yt)
    length = np.hypot(along_x, along_y)
    along_x, along_y = along_x / length, along_y / length
    off_s, off_t = xs * along_x + ys * along_y, xt * along_x + yt * along_y
    steep = np.hypot(off_s, off_t)
    across_p, across_q = off_t / steep, -off_s / steep
    area_s = xss * yt + xs * yst - xst * ys - xt * yss
    area_t = xst * yt + xs * ytt - xtt * ys - xt * yst
    grow = area_s * across_p + area_t * across_q
    if grow < 0.0:
        across_p, across_q = -across_p, -across_q
    bend_x = (xss * across_p + 2.0 * xst * across_q) * across_p + xtt * across_q * across_q
    bend_y = (yss * across_p + 2.0 * yst * across_q) * across_p + ytt * across_q * across_q
    bend = bend_y * along_x - bend_x * along_y
    side = 1.0 if bend > 0.0 else -1.0
    stretch = abs(grow) / max(np.hypot(area_s, area_t), 1e-300) * steep
    return x, y, -side * along_y, side * along_x, across_p, across_q, abs(bend), stretch


@jit
def wave(cells, index, p, q):
    """Wave of a branch at a root: path, both gradients of it, J, amplitude, cell."""
    cell, s, t = locate(index, p, q)
    way, ws, wt = patch(cells, cell, 2, s, t)
    _, xs, xt = patch(cells, cell, 0, s, t)
    _, ys, yt = patch(cells, cell, 1, s, t)
    area = xs * yt - xt * ys
    amplitude = complex(scalar(cells, cell, 4, s, t), scalar(cells, cell, 5, s, t))
    return way, (ws * yt - wt * ys) / area, (wt * xs - ws * xt) / area, area, amplitude, cell


@jit
def pair(cells, index, turns, wavenumber, p, q, across_p, across_q, bend, height, x, y):
    """Two branches of a fold at (p, q), at (x, y), `height` beyond: found, roots, z, W, A, B, turns."""
    half = np.sqrt(2.0 * height / bend)
    up, p1, q1 = follow(cells, index, p, q, half * across_p, half * across_q, 1.0, x, y)
    down, p2, q2 = follow(cells, index, p, q, -half * across_p, -half * across_q, -1.0, x, y)
    if not (up and down):
        return False, p1, q1, p2, q2, 0.0, 0.0, 0.0j, 0.0j, 0
    way1, _, _, area1, amplitude1, cell1 = wave(cells, index, p1, q1)
    way2, _, _, area2, amplitude2, cell2 = wave(cells, index, p2, q2)
    one, other = amplitude1 / np.sqrt(area1), amplitude2 / np.sqrt(-area2)
    apart = way2 - way1
    z = (0.75 * wavenumber * abs(apart)) ** (2.0 / 3.0)
    root = np.sqrt(np.sqrt(z))
    later = other - one if apart > 0.0 else one - other
    passed = turns[cell1, 1] if apart > 0.0 else turns[cell2, 0]
    return z > 0.0, p1, q1, p2, q2, z, 0.5 * (way1 + way2), (one + other) * root, later / root, passed


@jit
def continued(cells, index, turns, wavenumber, p, q, width, height):
    """Branches `pair` at any height, by the polynomial through `NODES` widths."""
    x, y, normal_x, normal_y, across_p, across_q, bend, _ = frame(cells, index, p, q)
    rate, way, a, b, passed = 0.0, 0.0, 0.0j, 0.0j, 0
    least, most = np.inf, 0.0
    for i in range(len(NODES)):
        at = NODES[i] * width
        found, _, _, _, _, z, mean, one, other, passed = pair(
            cells, index, turns, wavenumber, p, q, across_p, across_q, bend, at,
            x + at * normal_x, y + at * normal_y,
        )  # fmt: skip
        if not found:
            return False, False, 0.0, 0.0, 0.0j, 0.0j, 0
        weight = 1.0
        for j in range(len(NODES)):
            if j != i:
                weight *= (height / width - NODES[j]) / (NODES[i] - NODES[j])
        rate += weight * z / at
        least, most = min(least, abs(one)), max(most, abs(one))
        way, a, b = way + weight * mean, a + weight * one, b + weight * other
    return rate > 0.0, most <= EVEN * least, rate * height, way, a, b, passed


@jit
def airy_width(cells, index, turns, wavenumber, p, q):
    """Airy width of a fold in pixels: distance over which z grows by 1; 0 without a lit side so wide."""
    x, y, normal_x, normal_y, across_p, across_q, bend, _ = frame(cells, index, p, q)
    height, aim = 0.125 * bend, 1.0
    for _ in range(20):
        found, _, _, _, _, z, _, _, _, _ = pair(
            cells, index, turns, wavenumber, p, q, across_p, across_q, bend, height,
            x + height * normal_x, y + height * normal_y,
        )  # fmt: skip
        if not found:
            aim, height = 0.5 * aim, 0.5 * height
        elif 0.7 * aim < z < 1.4 * aim:
            return height / z
        else:
            height *= aim / z
    return 0.0


@jit
def onto(cells, index, p, q, reach):
    """Fold point (J = 0) nearest to a point of the grid, within `reach` along p or q: found, p, q."""
    start_p, start_q = p, q
    for _ in range(12):
        cell, s, t = locate(index, p, q)
        if cell < 0:
            return False, p, q
        _, xs, xt, xss, xst, xtt = curved(cells, cell, 0, s, t)
        _, ys, yt, yss, yst, ytt = curved(cells, cell, 1, s, t)
        area = xs * yt - xt * ys
        area_s = xss * yt + xs * yst - xst * ys - xt * yss
        area_t = xst * yt + xs * ytt - xtt * ys - xt * yst
        steep = area_s * area_s + area_t * area_t
        if steep == 0.0:
            return False, p, q
        p, q = p - area * area_s / steep, q - area * area_t / steep
        if max(abs(p - start_p), abs(q - start_q)) > 3.0 * reach:
            return False, p, q
    return max(abs(p - start_p), abs(q - start_q)) <= reach, p, q
