"""Compiled loops from footprints of beams to pixels: which pixel sees which, and exact means over pixels.

Footprints are convex polygons in pixels, those of footprint n from corners[first[n]] to
corners[first[n + 1]]; in each the light is a plane wave, a row of `beam_kernels.WAVE`. Members of pixel i
are members[begin[i]] to members[begin[i + 1]].
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit, lean, part
from fringetrace.field.beam_kernels import (
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


@jit
def sources(columns, corners, first, begin, members, waves, at):
    """Where in the source the light of each member comes from: s and t of the middle of its part."""
    polygon, spare, square = np.empty((CORNERS, 2)), np.empty((CORNERS, 2)), pixel_sides()
    for pixel in range(len(begin) - 1):
        for k in range(begin[pixel], begin[pixel + 1]):
            wave = waves[members[k]]
            x, y = pixel % columns + 0.5, pixel // columns + 0.5
            count = cut(corners, first, members[k], x, y, square, polygon, spare)
            x, y = x - wave[X], y - wave[Y]
            for i in range(count):
                x, y = x + polygon[i, 0] / count, y + polygon[i, 1] / count
            at[k, 0] = wave[S] + wave[DERIVATIVES] * x + wave[DERIVATIVES + 1] * y
            at[k, 1] = wave[T] + wave[DERIVATIVES + 2] * x + wave[DERIVATIVES + 3] * y


@part
def phasor(waves, n, x, y, period):
    """A wave at a point: the remainder is exact, so long paths cost no digits."""
    way = waves[n, PATH] + waves[n, GRADIENT] * (x - waves[n, X]) + waves[n, GRADIENT + 1] * (y - waves[n, Y])
    angle = 2.0 * np.pi * ((way % period) / period)
    return complex(waves[n, REAL], waves[n, IMAGINARY]) * complex(np.cos(angle), np.sin(angle))


@lean
def overlap(polygons, sizes, areas, boxes, lines, many, a, b, gx, gy, spare, rest):
    """Integral of exp(i g.x) over what two parts of a pixel share."""
    if boxes[a, 0] >= boxes[b, 1] or boxes[b, 0] >= boxes[a, 1]:
        return 0.0j
    if boxes[a, 2] >= boxes[b, 3] or boxes[b, 2] >= boxes[a, 3]:
        return 0.0j
    if areas[b] > ALL:
        return integral(polygons[a], sizes[a], areas[a], gx, gy)
    if areas[a] > ALL:
        return integral(polygons[b], sizes[b], areas[b], gx, gy)
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
    return integral(rest, corners, area(rest, corners), gx, gy)


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
    amplitude = np.empty(most, np.complex128)
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
            if len(profile) > 0:
                amplitude[count] *= profile[k]
            for axis in range(2):
                slope[count, axis] = 2.0 * np.pi * waves[n, GRADIENT + axis] / period
            many[count], whose[count] = 0, group[n]
            count += 1
        for a in range(count):
            one, m = amplitude[a], whose[a]
            if carrier:
                mean[m, pixel] += one * integral(polygons[a], sizes[a], areas[a], slope[a, 0], slope[a, 1])
            mutual[m, m, pixel] += areas[a] * (one.real * one.real + one.imag * one.imag)
            for b in range(a):
                gx, gy = slope[a, 0] - slope[b, 0], slope[a, 1] - slope[b, 1]
                product = overlap(polygons, sizes, areas, boxes, lines, many, a, b, gx, gy, spare, rest)
                product *= one * amplitude[b].conjugate()
                mutual[m, whose[b], pixel] += product
                mutual[whose[b], m, pixel] += product.conjugate()
