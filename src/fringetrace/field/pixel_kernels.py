"""Compiled pixel quadrature: sample points, pixels cut along edges, and weighted means.

Sample points are in compressed rows: those of pixel i of a band are first[i] to first[i + 1].
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import grown, jit, part


@jit
def add_means(first, weight, field, where, share, total):
    """Add weighted means over the samples of some pixels of the fields to images, times `share`."""
    columns = where.shape[1]
    for pixel in range(len(first) - 1):
        i, j = pixel // columns, pixel % columns
        if where[i, j]:
            for m in range(len(field)):
                mean = 0.0j
                for k in range(first[pixel], first[pixel + 1]):
                    mean += weight[k] * field[m, k]
                total[m, i, j] += share * mean


@jit
def add_mean_products(first, weight, field, where, share, total):
    """Add those of E_m conj(E_n), (groups**2, rows, columns)."""
    groups, columns = len(field), where.shape[1]
    for pixel in range(len(first) - 1):
        i, j = pixel // columns, pixel % columns
        if not where[i, j]:
            continue
        for m in range(groups):
            for n in range(m, groups):
                real, imaginary = 0.0, 0.0
                for k in range(first[pixel], first[pixel + 1]):
                    one, other = field[m, k], field[n, k]
                    real += weight[k] * (one.real * other.real + one.imag * other.imag)
                    imaginary += weight[k] * (one.imag * other.real - one.real * other.imag)
                total[m * groups + n, i, j] += share * complex(real, imaginary)
                if n > m:
                    total[n * groups + m, i, j] += share * complex(real, -imaginary)


@part
def term(field, m, n, products, i, j):
    """E_m conj(E_n) of a pixel, or E_m."""
    one, other = field[m, i, j], field[n, i, j]
    if not products:
        return one
    real = one.real * other.real + one.imag * other.imag
    return complex(real, one.imag * other.real - one.real * other.imag)


@part
def correction(field, m, n, products, i, j):
    """(f_xx + f_yy) / 24 at a pixel of such an image, by differences; 0 at the rim."""
    _, rows, columns = field.shape
    if i == 0 or j == 0 or i == rows - 1 or j == columns - 1:
        return 0.0j
    beside = term(field, m, n, products, i, j + 1) + term(field, m, n, products, i, j - 1)
    above = term(field, m, n, products, i + 1, j) + term(field, m, n, products, i - 1, j)
    return (above + beside - 4.0 * term(field, m, n, products, i, j)) / 24.0


@jit
def largest(field, products):
    """Largest size of the corrections, and of the values, of fields (groups, rows, columns) or products."""
    groups, rows, columns = field.shape
    bend, value = np.zeros((rows, columns)), np.zeros((rows, columns))
    for i in range(rows):
        for j in range(columns):
            for m in range(groups):
                for n in range(m, groups if products else m + 1):
                    bent = correction(field, m, n, products, i, j)
                    here = term(field, m, n, products, i, j)
                    bend[i, j] = max(bend[i, j], bent.real**2 + bent.imag**2)
                    value[i, j] = max(value[i, j], here.real**2 + here.imag**2)
            bend[i, j], value[i, j] = np.sqrt(bend[i, j]), np.sqrt(value[i, j])
    return bend, value


@jit
def add_even(field, order, share, products, total):
    """Add corrected values at the centres of pixels without samples to images, times `share`."""
    groups, rows, columns = field.shape
    for i in range(rows):
        for j in range(columns):
            if order[i, j] > 0:
                continue
            for m in range(groups):
                for n in range(m, groups if products else m + 1):
                    mean = term(field, m, n, products, i, j) + correction(field, m, n, products, i, j)
                    total[m * groups + n if products else m, i, j] += share * mean
                    if n > m:
                        total[n * groups + m, i, j] += share * complex(mean.real, -mean.imag)


@jit
def lattice(order, columns, top, nodes, weights, first, x, y, weight):
    """Gauss points of the pixels of a band: order[i] x order[i] in pixel i, none where it is 0.

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
                    pairs = grown(pairs)
                pairs[count, 0], pairs[count, 1] = row * columns + column, segment
                count += 1
    return pairs[:count]


# A polygon is cut where a line leaves more than this on both sides, in pixels.
SLIVER = 1e-8
# Corners of a piece, and pieces of a part of a pixel, at most.
CORNERS, PIECES = 32, 1024


@part
def clip(polygon, corners, a, b, c, sign, result):
    """Clip a convex polygon to the half-plane sign (a x + b y - c) >= 0; its corners."""
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
    """Cut a square by the lines of segments; number of pieces."""
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
            for i in range(corners[q]):
                polygons[q, i, 0], polygons[q, i, 1] = spare[i, 0], spare[i, 1]
            count += 1
    return count


@jit
def cut(pixels, parts, begin, lines, segments, columns, rule):
    """Sample points of pixels that edges cross: columns x, y, weight, and a point certain to be on its side.

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
                        points = grown(points)
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
