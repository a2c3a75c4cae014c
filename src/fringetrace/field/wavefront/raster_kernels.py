"""Compiled rasterisation of wavefront patches onto sample points of the pixels.

A sheet maps grid coordinates (s along columns, t along rows) to CCD coordinates in pixels. A cell of
a curved sheet has the fields X, Y, W, J, and the two parts of the amplitude, each as the 4 x 4
coefficients of s^i t^j. A leaf is a part of a cell on which J keeps its sign: its columns are the
cell, s and t from and to, the sign of J (0: unknown, a fold), the box around it in pixels, and a line:
the sheet is there where a s + b t >= c only.

Sample points are those of `tiles`.
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import grown, jit, part

# Columns of a leaf.
CELL, S0, S1, T0, T1, SIGN, LEFT, RIGHT, LOW, HIGH, A, B, C = range(13)
# A leaf is regular when its least |J| is at least this part of its largest: Newton then stays in it.
REGULAR = 0.35
# A regular leaf reaches this part of its width beyond its probes at most, a fold a few times that.
MARGIN = 0.03
# The remainder of a path in wavelengths is exact by a product of halves of float64's digits for fewer than
# MANY of them: 2^26 and 2^27 + 1.
MANY, SPLITTER = 67108864.0, 134217729.0
# A cell is halved this often at most.
DEPTH = 6
# Cells own their sides shifted by this part of a cell: a sample exactly on a side has one owner.
NUDGE_S, NUDGE_T = 1.2345e-9, 2.7183e-9


@part
def patch(cells, cell, f, s, t):
    """Value of field f of a cell, with derivatives along s and t."""
    value, along_s, along_t = 0.0, 0.0, 0.0
    for i in range(3, -1, -1):
        c0, c1 = cells[cell, f, i, 0], cells[cell, f, i, 1]
        c2, c3 = cells[cell, f, i, 2], cells[cell, f, i, 3]
        line = ((c3 * t + c2) * t + c1) * t + c0
        slope = (3.0 * c3 * t + 2.0 * c2) * t + c1
        along_s = along_s * s + value
        value = value * s + line
        along_t = along_t * s + slope
    return value, along_s, along_t


@part
def scalar(cells, cell, f, s, t):
    """Value of field f of a cell."""
    value = 0.0
    for i in range(3, -1, -1):
        c0, c1 = cells[cell, f, i, 0], cells[cell, f, i, 1]
        c2, c3 = cells[cell, f, i, 2], cells[cell, f, i, 3]
        value = value * s + (((c3 * t + c2) * t + c1) * t + c0)
    return value


@jit
def survey(cells, cell, s0, s1, t0, t1):
    """Range of J and bounding box over part of a cell, from 5 x 5 points, the box with a margin."""
    least, most = np.inf, -np.inf
    left, right, low, high = np.inf, -np.inf, np.inf, -np.inf
    for i in range(5):
        for j in range(5):
            x, xs, xt = patch(cells, cell, 0, s0 + 0.25 * i * (s1 - s0), t0 + 0.25 * j * (t1 - t0))
            y, ys, yt = patch(cells, cell, 1, s0 + 0.25 * i * (s1 - s0), t0 + 0.25 * j * (t1 - t0))
            area = xs * yt - xt * ys
            least, most = min(least, area), max(most, area)
            left, right, low, high = min(left, x), max(right, x), min(low, y), max(high, y)
    margin = MARGIN * max(right - left, high - low)
    return least, most, left - margin, right + margin, low - margin, high + margin


@jit
def split_cells(cells, domain, lines, rows, columns):
    """Quadtree leaves of cells, from their domains (s from and to, t from and to) and chords (a, b, c).

    Those that no pixel sees are left out.
    """
    leaves = np.empty((2 * len(cells) + 64, 13))
    count = 0
    stack = np.empty((4 * DEPTH + 8, 5))
    for cell in range(len(cells)):
        for k in range(4):
            stack[0, k] = domain[cell, k]
        stack[0, 4] = 0.0
        waiting = 1
        while waiting > 0:
            waiting -= 1
            s0, s1, t0, t1, depth = stack[waiting]
            least, most, left, right, low, high = survey(cells, cell, s0, s1, t0, t1)
            if right <= 0.0 or left >= columns or high <= 0.0 or low >= rows:
                continue
            sign = 0.0
            if least > 0.0:
                sign = 1.0
            elif most < 0.0:
                sign = -1.0
            even = sign != 0.0 and min(abs(least), abs(most)) >= REGULAR * max(abs(least), abs(most))
            if not even and depth < DEPTH:
                s, t = 0.5 * (s0 + s1), 0.5 * (t0 + t1)
                for i in range(2):
                    for j in range(2):
                        stack[waiting, 0], stack[waiting, 1] = (s0, s) if i == 0 else (s, s1)
                        stack[waiting, 2], stack[waiting, 3] = (t0, t) if j == 0 else (t, t1)
                        stack[waiting, 4] = depth + 1.0
                        waiting += 1
                continue
            if count == len(leaves):
                leaves = grown(leaves)
            more = 0.0 if even else 0.1 * max(right - left, high - low)
            leaf = leaves[count]
            leaf[CELL], leaf[S0], leaf[S1], leaf[T0], leaf[T1], leaf[SIGN] = cell, s0, s1, t0, t1, sign
            leaf[LEFT], leaf[RIGHT] = left - more, right + more
            leaf[LOW], leaf[HIGH] = low - more, high + more
            leaf[A], leaf[B], leaf[C] = lines[cell, 0], lines[cell, 1], lines[cell, 2]
            count += 1
    return leaves[:count]


# A step of this part of a leaf is the last: the next would be its square.
CLOSE = 1e-4


@part
def newton(px, py, xs, xt, ys, yt, area, x, y, wide, tall):
    """Newton step to (x, y) from a point of the map, limited to 3/4 leaf, and its full length in leaves."""
    dx, dy = x - px, y - py
    ds, dt = (yt * dx - xt * dy) / area, (xs * dy - ys * dx) / area
    stretch = max(abs(ds) / wide, abs(dt) / tall)
    if stretch > 0.75:
        ds, dt = ds * 0.75 / stretch, dt * 0.75 / stretch
    return ds, dt, stretch


@part
def root(cells, cell, s0, s1, t0, t1, sign, s, t, x, y):
    """Root (s, t) of the map at (x, y) in a regular leaf: found, s, t and the Jacobian there."""
    wide, tall = s1 - s0, t1 - t0
    area = 0.0
    for _ in range(12):
        px, xs, xt = patch(cells, cell, 0, s, t)
        py, ys, yt = patch(cells, cell, 1, s, t)
        area = xs * yt - xt * ys
        if area * sign <= 0.0:
            return False, s, t, area
        ds, dt, stretch = newton(px, py, xs, xt, ys, yt, area, x, y, wide, tall)
        s, t = s + ds, t + dt
        if stretch < CLOSE:
            break
        # a regular leaf bends too little to throw a step from inside it out by half its width
        if s < s0 - 0.5 * wide or s > s1 + 0.5 * wide or t < t0 - 0.5 * tall or t > t1 + 0.5 * tall:
            return False, s, t, area
    u, v = s + NUDGE_S, t + NUDGE_T
    return (s0 <= u < s1 and t0 <= v < t1), s, t, area


@part
def plain(cells, cell, s, t, area, unit, period):
    """Wave of one branch: amplitude, spread over |area|, and path."""
    way = scalar(cells, cell, 2, s, t)
    amplitude = complex(scalar(cells, cell, 4, s, t), scalar(cells, cell, 5, s, t))
    turn = 2.0 * np.pi * ((way % period) / period)
    return np.sqrt(unit / abs(area)) * amplitude * complex(np.cos(turn), np.sin(turn))


@part
def gradient(cells, cell, s, t):
    """Gradient of the path on the CCD, along x and y."""
    _, xs, xt = patch(cells, cell, 0, s, t)
    _, ys, yt = patch(cells, cell, 1, s, t)
    _, ws, wt = patch(cells, cell, 2, s, t)
    area = xs * yt - xt * ys
    return (ws * yt - wt * ys) / area, (wt * xs - ws * xt) / area


@jit
def leaf_contributions(leaves, cells, folded, turns, unit, top, columns, first, x, y, slope):
    """Contributions of regular leaves at the sample points of a band of pixels from row `top` on.

    A row for each: the number of the point, the optical path, real and imaginary part of each component
    of the amplitude. `folded` marks cells in which J changes its sign, `turns` has their caustics passed
    where J < 0 and where J > 0, `unit` is the beam area of a cell in pixels. `slope` (lowest and highest
    of both gradients of the path, metres a pixel) is widened to what each point has seen.
    """
    rows, components = (len(first) - 1) // columns, (cells.shape[1] - 4) // 2
    found = np.empty((len(x) + 16, 2 + 2 * components))
    count = 0
    for row in range(len(leaves)):
        leaf = leaves[row]
        cell = int(leaf[CELL])
        bottom = max(int(np.floor(leaf[LOW])), top)
        above = min(int(np.floor(leaf[HIGH])), top + rows - 1)
        begin, end = max(int(np.floor(leaf[LEFT])), 0), min(int(np.floor(leaf[RIGHT])), columns - 1)
        if bottom > above:
            continue
        s0, s1, t0, t1, sign = leaf[S0], leaf[S1], leaf[T0], leaf[T1], leaf[SIGN]
        bent = folded[cell]
        s, t = 0.5 * (s0 + s1), 0.5 * (t0 + t1)
        phase = np.exp(-0.5j * np.pi * turns[cell, 1 if sign > 0.0 else 0])
        for i in range(bottom, above + 1):
            for j in range(begin, end + 1):
                pixel = (i - top) * columns + j
                for k in range(first[pixel], first[pixel + 1]):
                    there, a, b, area = root(cells, cell, s0, s1, t0, t1, sign, s, t, x[k], y[k])
                    if not there or leaf[A] * a + leaf[B] * b < leaf[C]:
                        continue
                    s, t = a, b  # the next sample is near
                    size = np.sqrt(unit / abs(area if bent else scalar(cells, cell, 3, a, b))) * phase
                    if count == len(found):
                        found = grown(found)
                    found[count, 0], found[count, 1] = k, scalar(cells, cell, 2, a, b)
                    for c in range(2, 2 + 2 * components, 2):
                        real, imaginary = (
                            scalar(cells, cell, c + 2, a, b),
                            scalar(cells, cell, c + 3, a, b),
                        )
                        light = size * complex(real, imaginary)
                        found[count, c], found[count, c + 1] = light.real, light.imag
                    count += 1
                    if len(slope) > 0:
                        across, up = gradient(cells, cell, a, b)
                        widen(slope[k], across, up)
    return found[:count]


@jit
def add_waves(rows, begin, component, period, group, factor, field):
    """Add waves at a wavelength to the fields of their groups; `rows` as in `leaf_contributions`.

    Those of wave w are rows begin[w] to begin[w + 1]; they are multiplied by factor[w].
    """
    c = 2 + 2 * component
    # the wavelength in two parts (T. J. Dekker, Numer. Math. 18 (1971) 224): n times the longer is exact
    long = period * SPLITTER
    long -= long - period
    short = period - long
    for wave in range(len(begin) - 1):
        light, there = factor[wave], field[group[wave]]
        for row in range(begin[wave], begin[wave + 1]):
            way = rows[row, 1]
            number = np.rint(way / period)
            rest = (way - number * long) - number * short if abs(number) < MANY else way % period
            turn = 2.0 * np.pi * (rest / period)
            wave_here = complex(rows[row, c], rows[row, c + 1]) * complex(np.cos(turn), np.sin(turn))
            there[int(rows[row, 0])] += light * wave_here


@part
def widen(slope, across, up):
    """Extend a range by one gradient."""
    slope[0], slope[1] = min(slope[0], across), max(slope[1], across)
    slope[2], slope[3] = min(slope[2], up), max(slope[3], up)


@jit
def plane_wave_contributions(
    inverse, origin, path, gradient, amplitude, kind, low_s, low_t, begin, pieces, first,
    x, y, where_x, where_y, shape, slope, pixels,
):  # fmt: skip
    """Contributions of a plane wave at the sample points that its region of the beam reaches.

    (s, t) = inverse (point - origin); the path at the origin is `path`, its gradient `gradient`.
    `kind` of each cell from (low_s, low_t) on: 0 dark, 1 lit, 2 in pieces, those of the cell from
    begin[cell] on. A piece is s, t from, s, t to, and a, b, c: lit where a s + b t > c. A point belongs
    to the region if (where_x, where_y) does. `pixels` of the band: first and last row, column.
    `amplitude` is (points or 1, components). Rows are as those of `leaf_contributions`.
    """
    rows, columns = kind.shape
    components = amplitude.shape[1]
    most = 0
    for i in range(pixels[0], pixels[1]):
        most += first[i * shape + pixels[3]] - first[i * shape + pixels[2]]
    found = np.empty((most, 2 + 2 * components))
    count = 0
    for i in range(pixels[0], pixels[1]):
        for pixel in range(i * shape + pixels[2], i * shape + pixels[3]):
            for k in range(first[pixel], first[pixel + 1]):
                dx, dy = where_x[k] - origin[0], where_y[k] - origin[1]
                s = inverse[0, 0] * dx + inverse[0, 1] * dy
                t = inverse[1, 0] * dx + inverse[1, 1] * dy
                if not (low_s <= s < low_s + columns and low_t <= t < low_t + rows):
                    continue
                row, column = int(t - low_t), int(s - low_s)
                if kind[row, column] == 0:
                    continue
                if kind[row, column] == 2:
                    lit = False
                    cell = row * columns + column
                    for p in range(begin[cell], begin[cell + 1]):
                        if pieces[p, 0] <= s <= pieces[p, 2] and pieces[p, 1] <= t <= pieces[p, 3]:
                            lit = pieces[p, 4] * s + pieces[p, 5] * t > pieces[p, 6]
                            break
                    if not lit:
                        continue
                dx, dy = x[k] - origin[0], y[k] - origin[1]
                found[count, 0], found[count, 1] = k, path + gradient[0] * dx + gradient[1] * dy
                light = amplitude[k] if len(amplitude) > 1 else amplitude[0]
                for c in range(components):
                    found[count, 2 + 2 * c], found[count, 3 + 2 * c] = light[c].real, light[c].imag
                count += 1
                if len(slope) > 0:
                    widen(slope[k], gradient[0], gradient[1])
    return found[:count]
