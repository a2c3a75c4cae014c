"""Compiled geometry of convex polygons in the plane, and the integral of a plane wave over one.

A polygon is a table of `CORNERS` points with its number of corners beside it, in either sense. A line is
(a, b, c): inside where a x + b y + c >= 0. An affine function is (f0, f1, f2): f0 + f1 x + f2 y.
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit, lean, part

# Corners of a polygon, at most: a triangle cut by the sides of several more.
CORNERS = 24
# Returned where it would have more.
MANY = -1
# Below this squared phase (radians) across a polygon its integral is a series: 1e-4 squared remains.
FLAT_PHASE = 1e-4


@part
def copied(polygon, corners, into):
    """Copy a polygon."""
    for i in range(corners):
        into[i, 0], into[i, 1] = polygon[i, 0], polygon[i, 1]


@jit
def grown_polygons(polygons):
    """A full table of polygons, and as many blank ones after them."""
    larger = np.empty((2 * len(polygons), CORNERS, 2))
    for k in range(len(polygons)):
        copied(polygons[k], CORNERS, larger[k])
    return larger


@part
def turn(polygon, corners):
    """Twice the signed area, positive if counter-clockwise."""
    total = 0.0
    for i in range(1, corners - 1):
        total += (polygon[i, 0] - polygon[0, 0]) * (polygon[i + 1, 1] - polygon[0, 1])
        total -= (polygon[i, 1] - polygon[0, 1]) * (polygon[i + 1, 0] - polygon[0, 0])
    return total


@part
def area(polygon, corners):
    """Area of a polygon."""
    return 0.5 * abs(turn(polygon, corners))


@part
def box(polygon, corners):
    """Least and largest x, least and largest y."""
    left, right, low, high = polygon[0, 0], polygon[0, 0], polygon[0, 1], polygon[0, 1]
    for i in range(1, corners):
        left, right = min(left, polygon[i, 0]), max(right, polygon[i, 0])
        low, high = min(low, polygon[i, 1]), max(high, polygon[i, 1])
    return left, right, low, high


@part
def span(affine, polygon, corners):
    """Least and largest value of an affine function on a polygon."""
    least, most = np.inf, -np.inf
    for i in range(corners):
        value = affine[0] + affine[1] * polygon[i, 0] + affine[2] * polygon[i, 1]
        least, most = min(least, value), max(most, value)
    return least, most


@lean
def sides(polygon, corners, lines):
    """Lines of the sides of a polygon, a and b of unit length; how many."""
    sign = 1.0 if turn(polygon, corners) > 0.0 else -1.0
    count = 0
    for i in range(corners):
        j = i + 1 if i + 1 < corners else 0
        a, b = polygon[i, 1] - polygon[j, 1], polygon[j, 0] - polygon[i, 0]
        length = np.sqrt(a * a + b * b)
        if length > 0.0:
            a, b = sign * a / length, sign * b / length
            lines[count, 0], lines[count, 1] = a, b
            lines[count, 2] = -(a * polygon[i, 0] + b * polygon[i, 1])
            count += 1
    return count


@lean
def apart(lines, count, polygon, corners, slack):
    """Whether a polygon lies beyond one of some lines, reaching back over it by no more than `slack`."""
    for k in range(count):
        out = True
        for i in range(corners):
            if lines[k, 0] * polygon[i, 0] + lines[k, 1] * polygon[i, 1] + lines[k, 2] > slack:
                out = False
                break
        if out:
            return True
    return False


@lean
def clip(polygon, corners, a, b, c, result):
    """The part of a polygon inside a line; its corners (Sutherland and Hodgman 1974)."""
    count = 0
    for i in range(corners):
        j = i + 1 if i + 1 < corners else 0
        here = a * polygon[i, 0] + b * polygon[i, 1] + c
        there = a * polygon[j, 0] + b * polygon[j, 1] + c
        if here >= 0.0:
            result[count, 0], result[count, 1] = polygon[i, 0], polygon[i, 1]
            count += 1
        if (here > 0.0 and there < 0.0) or (here < 0.0 and there > 0.0):
            f = here / (here - there)
            result[count, 0] = polygon[i, 0] + f * (polygon[j, 0] - polygon[i, 0])
            result[count, 1] = polygon[i, 1] + f * (polygon[j, 1] - polygon[i, 1])
            count += 1
    return count


@lean
def clipped(polygon, corners, lines, count, spare):
    """Keep of a polygon what lies inside some lines, in place; its corners, 0 for none, or `MANY`."""
    for k in range(count):
        a, b, c = lines[k, 0], lines[k, 1], lines[k, 2]
        inside = True
        for i in range(corners):
            inside &= a * polygon[i, 0] + b * polygon[i, 1] + c >= 0.0
        if inside:
            continue
        corners = clip(polygon, corners, a, b, c, spare)
        if corners < 3 or corners >= CORNERS:
            return MANY if corners >= CORNERS else 0
        copied(spare, corners, polygon)
    return corners


@part
def sinc(x):
    """sin(x) / x."""
    return np.sin(x) / x if abs(x) > 1e-8 else 1.0


@lean
def series(polygon, corners, size, gx, gy):
    """Integral of exp(i (gx x + gy y)) over a polygon of an area, where the phase hardly varies.

    The phase at the centroid, and the mean square of the phase about it.
    """
    first, second, total = 0.0, 0.0, 0.0
    start = gx * polygon[0, 0] + gy * polygon[0, 1]
    for i in range(1, corners - 1):
        ax, ay = polygon[i, 0] - polygon[0, 0], polygon[i, 1] - polygon[0, 1]
        bx, by = polygon[i + 1, 0] - polygon[0, 0], polygon[i + 1, 1] - polygon[0, 1]
        double = ax * by - ay * bx
        p, q = gx * ax + gy * ay, gx * bx + gy * by
        total += double
        first += double * (p + q) / 3.0
        second += double * (p * p + q * q + p * q) / 6.0
    if total == 0.0:
        return 0.0j
    mean = first / total
    size *= 1.0 - 0.5 * (second / total - mean * mean)
    return complex(size * np.cos(start + mean), size * np.sin(start + mean))


@lean
def integral(polygon, corners, size, gx, gy):
    """Integral of exp(i (gx x + gy y)) over a polygon of an area.

    By Gauss's theorem a sum over its sides, each the phase at its middle times a sinc (Lee and Mittra,
    IEEE Trans. Antennas Propag. 31 (1983) 99).
    """
    left, right, low, high = box(polygon, corners)
    square = gx * gx + gy * gy
    wide = max(right - left, high - low)
    if square * wide * wide < FLAT_PHASE:
        return series(polygon, corners, size, gx, gy)
    real, imaginary = 0.0, 0.0
    for i in range(corners):
        j = i + 1 if i + 1 < corners else 0
        ex, ey = polygon[j, 0] - polygon[i, 0], polygon[j, 1] - polygon[i, 1]
        phase = 0.5 * (gx * (polygon[i, 0] + polygon[j, 0]) + gy * (polygon[i, 1] + polygon[j, 1]))
        flux = (gx * ey - gy * ex) * sinc(0.5 * (gx * ex + gy * ey))
        real += np.sin(phase) * flux
        imaginary -= np.cos(phase) * flux
    sign = 1.0 if turn(polygon, corners) > 0.0 else -1.0
    return complex(sign * real / square, sign * imaginary / square)
