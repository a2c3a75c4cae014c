"""Compiled loops from footprints of beams to pixels: which pixel sees which, and exact means over pixels.

Footprints are convex polygons in pixels, those of footprint n from corners[first[n]] to
corners[first[n + 1]]; in each the light is a plane wave, a row of `beam_tables.WAVE`. Members of pixel i
are members[begin[i]] to members[begin[i + 1]].
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit, lean, part
from fringetrace.field.beam_tables import (
    DERIVATIVES,
    GRADIENT,
    IMAGINARY,
    PATH,
    REAL,
    S,
    T,
    X,
    Y,
)  # fmt: skip
from fringetrace.field.polygon_kernels import (
    CORNERS,
    apart,
    area,
    box,
    clipped,
    copied,
    integral,
    sides,
)  # fmt: skip

# A smaller part of a pixel is rounding; one that misses no more fills it.
NONE, ALL = 1e-12, 1.0 - 1e-9
# Points are this much nearer the middle than those that stand for a triangle, which lie on its sides.
WITHIN = 0.9
# Step of a slope (radians a pixel) for a derivative: its square, times 1e-2, is what it misses.
STEP = 1e-3


@lean
def columns_of(corners, begin, end, row, columns):
    """First and last column that a convex polygon reaches in a row of pixels; none if last < first."""
    low, high = np.inf, -np.inf
    for i in range(begin, end):
        j = i + 1 if i + 1 < end else begin
        ax, ay, bx, by = corners[i, 0], corners[i, 1], corners[j, 0], corners[j, 1]
        if ay > by:
            ax, ay, bx, by = bx, by, ax, ay
        if by < row or ay > row + 1.0:
            continue
        rise = by - ay
        f = min(max((row - ay) / rise, 0.0), 1.0) if rise > 0.0 else 0.0
        g = min(max((row + 1.0 - ay) / rise, 0.0), 1.0) if rise > 0.0 else 1.0
        x0, x1 = ax + f * (bx - ax), ax + g * (bx - ax)
        low, high = min(low, x0, x1), max(high, x0, x1)
    if low > high:
        return 0, -1
    return int(max(np.floor(low), 0.0)), int(min(np.floor(high), columns - 1.0))


@lean
def cover(corners, first, rows, columns, place, members):
    """Add each footprint to the pixels that it reaches, at place[pixel] of `members`, and step that on."""
    for n in range(len(first) - 1):
        low, high = np.inf, -np.inf
        for i in range(first[n], first[n + 1]):
            low, high = min(low, corners[i, 1]), max(high, corners[i, 1])
        for row in range(int(max(np.floor(low), 0.0)), int(min(np.floor(high), rows - 1.0)) + 1):
            left, right = columns_of(corners, first[n], first[n + 1], row, columns)
            for pixel in range(row * columns + left, row * columns + right + 1):
                if len(members) > 0:
                    members[place[pixel]] = n
                place[pixel] += 1


@jit
def pixel_sides():
    """The lines around a pixel, about its centre."""
    return np.array([[1.0, 0.0, 0.5], [-1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, -1.0, 0.5]])


@part
def cut(corners, first, n, x, y, square, polygon, spare):
    """The part of a footprint that lies in a pixel, about the pixel's centre; its corners."""
    for i in range(first[n + 1] - first[n]):
        polygon[i, 0], polygon[i, 1] = corners[first[n] + i, 0] - x, corners[first[n] + i, 1] - y
    return clipped(polygon, first[n + 1] - first[n], square, 4, spare)


@lean
def moments(polygon, corners):
    """Centroid of a polygon, and the variances and the covariance of x and y on it."""
    area2, cx, cy, xx, yy, xy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(1, corners - 1):
        ax, ay = polygon[i, 0] - polygon[0, 0], polygon[i, 1] - polygon[0, 1]
        bx, by = polygon[i + 1, 0] - polygon[0, 0], polygon[i + 1, 1] - polygon[0, 1]
        double = ax * by - ay * bx
        area2 += double
        cx, cy = cx + double * (ax + bx) / 3.0, cy + double * (ay + by) / 3.0
        xx += double * (ax * ax + bx * bx + ax * bx) / 6.0
        yy += double * (ay * ay + by * by + ay * by) / 6.0
        xy += double * (2.0 * ax * ay + 2.0 * bx * by + ax * by + bx * ay) / 12.0
    if area2 == 0.0:
        return polygon[0, 0], polygon[0, 1], 0.0, 0.0, 0.0
    cx, cy = cx / area2, cy / area2
    xx, yy, xy = xx / area2 - cx * cx, yy / area2 - cy * cy, xy / area2 - cx * cy
    return polygon[0, 0] + cx, polygon[0, 1] + cy, max(xx, 0.0), max(yy, 0.0), xy


@jit
def sources(columns, corners, first, begin, members, waves, middle, at):
    """Points of the part of a pixel that each member lights, and where in the source they come from.

    `middle` (members, 5) is its centroid about the pixel's centre, and along, shear, up: four points lie by
    (along, shear) and by (0, up) to either side of it, the last in it; `at` (members, 5, 2) is s, t. Farther
    out by 1 / `WITHIN` the four would have the variances of the part.
    """
    polygon, spare, square = np.empty((CORNERS, 2)), np.empty((CORNERS, 2)), pixel_sides()
    for pixel in range(len(begin) - 1):
        x, y = pixel % columns + 0.5, pixel // columns + 0.5
        for k in range(begin[pixel], begin[pixel + 1]):
            n = members[k]
            count = cut(corners, first, n, x, y, square, polygon, spare)
            cx, cy, xx, yy, xy = moments(polygon, max(count, 1))
            # a root of twice the covariance (Cholesky)
            along = np.sqrt(2.0 * xx) * WITHIN
            shear = 2.0 * xy * WITHIN**2 / along if along > 0.0 else 0.0
            up = np.sqrt(max(2.0 * yy * WITHIN**2 - shear * shear, 0.0))
            middle[k, 0], middle[k, 1], middle[k, 2], middle[k, 3], middle[k, 4] = cx, cy, along, shear, up
            for j in range(5):
                sign = 1.0 - 2.0 * (j % 2) if j < 4 else 0.0
                u = x + cx + (sign * along if j < 2 else 0.0) - waves[n, X]
                v = y + cy + (sign * shear if j < 2 else sign * up) - waves[n, Y]
                at[k, j, 0] = waves[n, S] + waves[n, DERIVATIVES] * u + waves[n, DERIVATIVES + 1] * v
                at[k, j, 1] = waves[n, T] + waves[n, DERIVATIVES + 2] * u + waves[n, DERIVATIVES + 3] * v


@part
def phasor(waves, n, x, y, period):
    """A wave at a point: the remainder is exact, so long paths cost no digits."""
    way = waves[n, PATH] + waves[n, GRADIENT] * (x - waves[n, X]) + waves[n, GRADIENT + 1] * (y - waves[n, Y])
    angle = 2.0 * np.pi * ((way % period) / period)
    return complex(waves[n, REAL], waves[n, IMAGINARY]) * complex(np.cos(angle), np.sin(angle))


@lean
def leaning(polygon, corners, size, gx, gy, tx, ty, lift):
    """Integral of (1 + t.x - lift) exp(i g.x) over a polygon: t.x is a derivative along t of that without."""
    value = integral(polygon, corners, size, gx, gy)
    if tx == 0.0 and ty == 0.0:
        return value
    step = STEP / max(abs(tx), abs(ty))
    more = integral(polygon, corners, size, gx + step * tx, gy + step * ty)
    less = integral(polygon, corners, size, gx - step * tx, gy - step * ty)
    return (1.0 - lift) * value + (more - less) * complex(0.0, -0.5 / step)


@lean
def overlap(polygons, sizes, areas, boxes, lines, many, tilt, a, b, gx, gy, spare, rest):
    """Integral of exp(i g.x) over what two parts of a pixel share, for amplitudes that tilt."""
    tx, ty, lift = tilt[a, 0] + tilt[b, 0], tilt[a, 1] + tilt[b, 1], tilt[a, 2] + tilt[b, 2]
    if boxes[a, 0] >= boxes[b, 1] or boxes[b, 0] >= boxes[a, 1]:
        return 0.0j
    if boxes[a, 2] >= boxes[b, 3] or boxes[b, 2] >= boxes[a, 3]:
        return 0.0j
    if areas[b] > ALL:
        return leaning(polygons[a], sizes[a], areas[a], gx, gy, tx, ty, lift)
    if areas[a] > ALL:
        return leaning(polygons[b], sizes[b], areas[b], gx, gy, tx, ty, lift)
    for k in (a, b):
        if many[k] == 0:
            many[k] = sides(polygons[k], sizes[k], lines[k])
    if apart(lines[b], many[b], polygons[a], sizes[a], NONE) or apart(
        lines[a], many[a], polygons[b], sizes[b], NONE
    ):
        return 0.0j
    copied(polygons[a], sizes[a], rest)
    corners = clipped(rest, sizes[a], lines[b], many[b], spare)
    if corners < 3:
        return 0.0j
    return leaning(rest, corners, area(rest, corners), gx, gy, tx, ty, lift)


@jit
def means(
    top, bottom, columns, corners, first, begin, members, waves, group, sign, profile, period, carrier, mean,
    mutual
):  # fmt: skip
    """Mean fields of groups over the pixels of some rows (if `carrier`), and means of E_m conj(E_n)."""
    most = 1
    for pixel in range(top * columns, bottom * columns):
        most = max(most, begin[pixel + 1] - begin[pixel])
    polygons, lines = np.empty((most, CORNERS, 2)), np.empty((most, CORNERS, 3))
    sizes, many, whose = np.zeros(most, np.int64), np.zeros(most, np.int64), np.zeros(most, np.int64)
    areas, boxes, slope = np.zeros(most), np.empty((most, 4)), np.empty((most, 2))
    amplitude, tilt = np.empty(most, np.complex128), np.empty((most, 3))
    spare, rest, square = np.empty((CORNERS, 2)), np.empty((CORNERS, 2)), pixel_sides()
    for pixel in range(top * columns, bottom * columns):
        x, y = pixel % columns + 0.5, pixel // columns + 0.5
        count = 0
        for k in range(begin[pixel], begin[pixel + 1]):
            n = members[k]
            sizes[count] = cut(corners, first, n, x, y, square, polygons[count], spare)
            if sizes[count] < 3:
                continue
            areas[count] = area(polygons[count], sizes[count])
            if areas[count] < NONE:
                continue
            boxes[count, 0], boxes[count, 1], boxes[count, 2], boxes[count, 3] = box(
                polygons[count], sizes[count]
            )
            amplitude[count] = phasor(waves, n, x, y, period) * sign[n]
            tilt[count, 0], tilt[count, 1], tilt[count, 2] = 0.0, 0.0, 0.0
            if len(profile) > 0:
                amplitude[count] *= complex(profile[k, 0], profile[k, 1])
                for j in range(3):
                    tilt[count, j] = profile[k, 2 + j]
            for axis in range(2):
                slope[count, axis] = 2.0 * np.pi * waves[n, GRADIENT + axis] / period
            many[count], whose[count] = 0, group[n]
            count += 1
        for a in range(count):
            one, m = amplitude[a], whose[a]
            if carrier:
                mean[m, pixel] += one * leaning(
                    polygons[a],
                    sizes[a],
                    areas[a],
                    slope[a, 0],
                    slope[a, 1],
                    tilt[a, 0],
                    tilt[a, 1],
                    tilt[a, 2],
                )
            mutual[m, m, pixel] += areas[a] * (one.real * one.real + one.imag * one.imag)
            for b in range(a):
                gx, gy = slope[a, 0] - slope[b, 0], slope[a, 1] - slope[b, 1]
                product = overlap(polygons, sizes, areas, boxes, lines, many, tilt, a, b, gx, gy, spare, rest)
                product *= one * amplitude[b].conjugate()
                mutual[m, whose[b], pixel] += product
                mutual[whose[b], m, pixel] += product.conjugate()
