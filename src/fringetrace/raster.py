"""Fused float64 passes from sheets of arrivals to sample points on the pixels, compiled by numba.

A sheet maps grid coordinates (s along columns, t along rows) to CCD coordinates in pixels. A cell of
a curved sheet has the fields X, Y, W, J, and the two parts of the amplitude, each as the 4 x 4
coefficients of s^i t^j. A leaf is a part of a cell on which J keeps its sign: its columns are the
cell, s and t from and to, the sign of J (0: unknown, a fold), the box around it in pixels, and a line:
the sheet is there where a s + b t >= c only.

Sample points are in compressed rows: those of pixel i of a band are first[i] to first[i + 1].
"""

from __future__ import annotations

import numpy as np

from fringetrace.exact import jit, part

# Columns of a leaf.
CELL, S0, S1, T0, T1, SIGN, LEFT, RIGHT, LOW, HIGH, A, B, C = range(13)
# A leaf is regular when its least |J| is at least this part of its largest: Newton then stays in it.
REGULAR = 0.35
# A regular leaf reaches this part of its width beyond its probes at most, a fold a few times that.
MARGIN = 0.03
# A cell is halved this often at most.
DEPTH = 6
# Cells own their sides shifted by this part of a cell: a sample exactly on a side has one owner.
NUDGE_S, NUDGE_T = 1.2345e-9, 2.7183e-9


@part
def patch(cells, cell, f, s, t):
    """Value of field f of a cell and its derivatives along s and t."""
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
    """Least and largest J, and the box, of part of a cell: of 5 x 5 probes, the box with a margin."""
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
def split(cells, domain, lines, rows, columns):
    """Leaves of cells, from their domains (s from and to, t from and to) and lines (a, b, c).

    Those that no pixel sees are left out.
    """
    leaves = np.empty((2 * len(cells) + 64, 13))
    count = 0
    stack = np.empty((4 * DEPTH + 8, 5))
    for cell in range(len(cells)):
        stack[0, :4], stack[0, 4] = domain[cell], 0.0
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
                larger = np.empty((2 * count, 13))
                larger[:count] = leaves
                leaves = larger
            leaves[count, :5] = np.array([float(cell), s0, s1, t0, t1])
            more = 0.0 if even else 0.1 * max(right - left, high - low)
            leaves[count, 5:10] = np.array([sign, left - more, right + more, low - more, high + more])
            leaves[count, 10:] = lines[cell]
            count += 1
    return leaves[:count]


# A step of this part of a leaf is the last: the next would be its square.
CLOSE = 1e-4


@part
def root(cells, cell, s0, s1, t0, t1, sign, s, t, x, y):
    """Where in a regular leaf the map meets (x, y), from (s, t) on: found, s, t and the Jacobian there."""
    wide, tall = s1 - s0, t1 - t0
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
    """The wave of one branch: amplitude, spread over |area|, and path."""
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
def spread(leaves, cells, folded, turns, unit, period, top, columns, first, x, y, field, slope):
    """Add the waves of regular leaves to the sample points of a band of pixels that begins at row `top`.

    `folded` marks cells in which J changes its sign, `turns` has their caustics passed where J < 0
    and where J > 0, `unit` is the beam area of a cell in pixels. `slope` (lowest and highest of both
    gradients of the path, metres a pixel) is widened to what each sample has seen.
    """
    rows = (len(first) - 1) // columns
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
                    found, a, b, area = root(cells, cell, s0, s1, t0, t1, sign, s, t, x[k], y[k])
                    if not found or leaf[A] * a + leaf[B] * b < leaf[C]:
                        continue
                    s, t = a, b  # the next sample is near
                    spreading = area if bent else scalar(cells, cell, 3, a, b)
                    field[k] += phase * plain(cells, cell, a, b, spreading, unit, period)
                    if len(slope) > 0:
                        across, up = gradient(cells, cell, a, b)
                        widen(slope[k], across, up)


@part
def widen(slope, across, up):
    """Let a range take in one more gradient."""
    slope[0], slope[1] = min(slope[0], across), max(slope[1], across)
    slope[2], slope[3] = min(slope[2], up), max(slope[3], up)


@jit
def average(first, weight, field, mean, mutual):
    """Weighted means over the samples of each pixel of the fields, and of E_m conj(E_n)."""
    groups = len(field)
    for pixel in range(len(first) - 1):
        for m in range(groups):
            total = 0.0j
            for k in range(first[pixel], first[pixel + 1]):
                total += weight[k] * field[m, k]
            mean[m, pixel] = total
            for n in range(m, groups):
                real, imaginary = 0.0, 0.0
                for k in range(first[pixel], first[pixel + 1]):
                    one, other = field[m, k], field[n, k]
                    real += weight[k] * (one.real * other.real + one.imag * other.imag)
                    imaginary += weight[k] * (one.imag * other.real - one.real * other.imag)
                mutual[m, n, pixel] = complex(real, imaginary)
                mutual[n, m, pixel] = complex(real, -imaginary)


@jit
def lattice(order, columns, top, nodes, weights, first, x, y, weight):
    """Gauss points of the pixels of a band: order[i] x order[i] of them in pixel i, none where it is 0.

    `nodes`, `weights` are tables by order, on [0, 1].
    """
    for pixel in range(len(order)):
        n = order[pixel]
        row, column = top + pixel // columns, pixel % columns
        k = first[pixel]
        for i in range(n):
            for j in range(n):
                x[k], y[k] = column + nodes[n, j], row + nodes[n, i]
                weight[k] = weights[n, i] * weights[n, j]
                k += 1


@jit
def spread_flat(
    inverse, origin, path, gradient, amplitude, kind, low_s, low_t, begin, pieces, period, first,
    x, y, where_x, where_y, shape, field, slope, pixels,
):  # fmt: skip
    """Add a plane wave to the sample points that its region of the beam reaches.

    (s, t) = inverse (point - origin); the path at the origin is `path`, its gradient `gradient`.
    `kind` of each cell from (low_s, low_t) on: 0 dark, 1 lit, 2 in pieces, those of the cell from
    begin[cell] on. A piece is s, t from, s, t to, and a, b, c: lit where a s + b t > c. A point belongs
    to the region if (where_x, where_y) does. `pixels` of the band: first and last row, column.
    """
    rows, columns = kind.shape
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
                way = path + gradient[0] * dx + gradient[1] * dy
                turn = 2.0 * np.pi * ((way % period) / period)
                size = amplitude[k] if len(amplitude) > 1 else amplitude[0]
                field[k] += size * complex(np.cos(turn), np.sin(turn))
                if len(slope) > 0:
                    widen(slope[k], gradient[0], gradient[1])


@jit
def crossed(segments, rows, columns):
    """Pixels that segments cross: (pixel, segment) pairs. Segments are x, y, x, y in pixels."""
    slack = 1e-6
    pairs = np.empty((4 * len(segments) + 64, 2), np.int64)
    count = 0
    for segment in range(len(segments)):
        ax, ay, bx, by = segments[segment]
        if ay > by:
            ax, ay, bx, by = bx, by, ax, ay
        below = min(max(np.floor(ay - slack), 0.0), float(rows))
        above = min(max(np.floor(by + slack), -1.0), rows - 1.0)
        for row in range(int(below), int(above) + 1):
            rise = by - ay
            low = min(max((row - slack - ay) / rise, 0.0), 1.0) if rise > slack else 0.0
            high = min(max((row + 1.0 + slack - ay) / rise, 0.0), 1.0) if rise > slack else 1.0
            x0, x1 = ax + low * (bx - ax), ax + high * (bx - ax)
            left = min(max(np.floor(min(x0, x1) - slack), 0.0), float(columns))
            right = min(max(np.floor(max(x0, x1) + slack), -1.0), columns - 1.0)
            for column in range(int(left), int(right) + 1):
                if count == len(pairs):
                    larger = np.empty((2 * count, 2), np.int64)
                    larger[:count] = pairs
                    pairs = larger
                pairs[count, 0], pairs[count, 1] = row * columns + column, segment
                count += 1
    return pairs[:count]


# A polygon is cut where a line leaves more than this on both sides, in pixels.
SLIVER = 1e-8
# Corners of a piece, and pieces of a part of a pixel, at most.
CORNERS, PIECES = 32, 1024


@part
def clip(polygon, corners, a, b, c, sign, result):
    """The part of a convex polygon where sign (a x + b y - c) >= 0; its corners."""
    count = 0
    for i in range(corners):
        j = i + 1 if i + 1 < corners else 0
        here = sign * (a * polygon[i, 0] + b * polygon[i, 1] - c)
        there = sign * (a * polygon[j, 0] + b * polygon[j, 1] - c)
        if here >= 0.0:
            result[count, 0], result[count, 1] = polygon[i, 0], polygon[i, 1]
            count += 1
        if (here > 0.0 and there < 0.0) or (here < 0.0 and there > 0.0):
            f = here / (here - there)
            result[count, 0] = polygon[i, 0] + f * (polygon[j, 0] - polygon[i, 0])
            result[count, 1] = polygon[i, 1] + f * (polygon[j, 1] - polygon[i, 1])
            count += 1
    return count


@jit
def shatter(x, y, size, lines, segments, polygons, corners):
    """Cut a square by the lines of some segments; how many pieces."""
    for i in range(4):
        polygons[0, i, 0] = x + (size if i == 1 or i == 2 else 0.0)
        polygons[0, i, 1] = y + (size if i >= 2 else 0.0)
    corners[0] = 4
    count = 1
    spare = np.empty((CORNERS, 2))
    for line in lines:
        ax, ay, bx, by = segments[line]
        length = np.hypot(bx - ax, by - ay)
        if length == 0.0:
            continue
        a, b = (ay - by) / length, (bx - ax) / length
        c = a * ax + b * ay
        for q in range(count):
            most, least = -np.inf, np.inf
            for i in range(corners[q]):
                height = a * polygons[q, i, 0] + b * polygons[q, i, 1] - c
                most, least = max(most, height), min(least, height)
            if not (most > SLIVER and least < -SLIVER) or count == PIECES or corners[q] + 2 > CORNERS:
                continue
            corners[count] = clip(polygons[q], corners[q], a, b, c, 1.0, polygons[count])
            corners[q] = clip(polygons[q], corners[q], a, b, c, -1.0, spare)
            polygons[q, : corners[q]] = spare[: corners[q]]
            count += 1
    return count


@jit
def cut(pixels, parts, begin, lines, segments, columns, rule):
    """Sample points of pixels that edges cross: columns x, y, weight, and a point sure of its side.

    Each pixel, in parts x parts squares, is cut by the lines of its segments into convex pieces,
    those into triangles with the points of `rule`: barycentric a, b, c and weight. Also returns how
    many points each pixel has.
    """
    points = np.empty((64 * len(pixels) + 64, 5))
    counts = np.zeros(len(pixels), np.int64)
    polygons, corners = np.empty((PIECES, CORNERS, 2)), np.empty(PIECES, np.int64)
    total = 0
    for n in range(len(pixels)):
        row, column = pixels[n] // columns, pixels[n] % columns
        size = 1.0 / parts[n]
        for square in range(parts[n] * parts[n]):
            pieces = shatter(
                column + (square % parts[n]) * size, row + (square // parts[n]) * size, size,
                lines[begin[n] : begin[n + 1]], segments, polygons, corners,
            )  # fmt: skip
            for q in range(pieces):
                p = polygons[q]
                for i in range(1, corners[q] - 1):
                    double = (p[i, 0] - p[0, 0]) * (p[i + 1, 1] - p[0, 1])
                    double -= (p[i, 1] - p[0, 1]) * (p[i + 1, 0] - p[0, 0])
                    if total + len(rule) > len(points):
                        larger = np.empty((2 * len(points), 5))
                        larger[:total] = points[:total]
                        points = larger
                    for k in range(len(rule)):
                        for axis in range(2):
                            points[total, axis] = (
                                rule[k, 0] * p[0, axis]
                                + rule[k, 1] * p[i, axis]
                                + rule[k, 2] * p[i + 1, axis]
                            )
                            points[total, 3 + axis] = (p[0, axis] + p[i, axis] + p[i + 1, axis]) / 3.0
                        points[total, 2] = 0.5 * abs(double) * rule[k, 3]
                        total += 1
                        counts[n] += 1
    return points[:total], counts
