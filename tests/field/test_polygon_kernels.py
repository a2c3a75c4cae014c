"""Convex polygons: cuts lose no area, and integrals of plane waves are those of a fine quadrature."""

import numpy as np
import pytest

from fringetrace.field import polygon_kernels, visibility_kernels
from fringetrace.field.polygon_kernels import CORNERS, MANY

# Rounding of a few hundred operations on numbers about 1.
ROUNDING = 1e-13
# A series to the second order in a phase of 1e-2 misses a skewness of its cube over six.
SERIES = 2e-7


def convex(rng, count=6):
    """A convex polygon about the origin, of size 1, in either sense."""
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))[:: rng.choice([-1, 1])]
    table = np.zeros((CORNERS, 2))
    table[:count] = np.stack([np.cos(angle), rng.uniform(0.3, 1.0) * np.sin(angle)], axis=1)
    table[:count] += rng.uniform(-0.5, 0.5, 2)
    return table


def quadrature(polygon, corners, gx, gy, parts=64):
    """The same integral by 64 Gauss points along either axis of each triangle of a fan."""
    node, weight = np.polynomial.legendre.leggauss(parts)
    u, v = np.meshgrid(0.5 * (node + 1.0), 0.5 * (node + 1.0), indexing="ij")
    w = 0.25 * np.outer(weight, weight)
    total = 0.0
    for i in range(1, corners - 1):
        a, b = polygon[i] - polygon[0], polygon[i + 1] - polygon[0]
        at = polygon[0] + u[..., None] * a + (u * v)[..., None] * (b - a)  # Duffy's map
        total += (w * u * np.exp(1j * (at @ [gx, gy]))).sum() * abs(a[0] * b[1] - a[1] * b[0])
    return total


@pytest.mark.parametrize("slope", [0.0, 1e-9, 1e-3, 1e-2, 0.1, 1.0, 10.0, 40.0])
def test_the_integral_of_a_plane_wave_is_that_of_a_fine_quadrature(slope):
    rng = np.random.default_rng(7)
    for _ in range(50):
        count = int(rng.integers(3, 9))
        polygon = convex(rng, count)
        angle = rng.uniform(0.0, 2.0 * np.pi)
        gx, gy = slope * np.cos(angle), slope * np.sin(angle)
        size = polygon_kernels.area(polygon, count)
        found = polygon_kernels.integral(polygon, count, size, gx, gy)
        assert abs(found - quadrature(polygon, count, gx, gy)) < (SERIES if 0 < slope < 0.1 else 1e-12)


def test_a_polygon_cut_in_two_keeps_its_area():
    rng = np.random.default_rng(1)
    for _ in range(500):
        polygon, one, other = convex(rng), np.zeros((CORNERS, 2)), np.zeros((CORNERS, 2))
        a, b, c = rng.normal(size=3)
        here = polygon_kernels.clip(polygon, 6, a, b, 0.5 * c, one)
        there = polygon_kernels.clip(polygon, 6, -a, -b, -0.5 * c, other)
        sizes = [polygon_kernels.area(piece, n) if n else 0.0 for piece, n in ((one, here), (other, there))]
        assert sum(sizes) == pytest.approx(polygon_kernels.area(polygon, 6), abs=ROUNDING)


def test_a_polygon_with_too_many_corners_is_said_to_have_them():
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
    polygon = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    corner = np.array([[-1.0, 0.0, 0.9999]])  # cuts one corner off, and makes two
    assert (
        polygon_kernels.clipped(polygon[:-1].copy(), CORNERS - 1, corner, 1, np.zeros((CORNERS, 2))) == MANY
    )


def test_what_is_taken_from_polygons_and_what_is_left_add_up():
    rng = np.random.default_rng(2)
    for _ in range(300):
        pieces, sizes = np.zeros((64, CORNERS, 2)), np.zeros((64, 1), dtype=np.int64)
        pieces[0], sizes[0, 0] = convex(rng), 6
        whole, count, taken = polygon_kernels.area(pieces[0], 6), 1, 0.0
        spare, rest = np.zeros((CORNERS, 2)), np.zeros((CORNERS, 2))
        for _ in range(3):
            hole, lines = convex(rng, 4), np.zeros((CORNERS, 3))
            many = polygon_kernels.sides(hole, 4, lines)
            for k in range(count):
                inside = pieces[k].copy()
                n = polygon_kernels.clipped(inside, sizes[k, 0], lines, many, spare)
                taken += polygon_kernels.area(inside, n) if n >= 3 else 0.0
            count = visibility_kernels.subtract(pieces, sizes, count, lines, many, 0.0, spare, rest)
        left = sum(polygon_kernels.area(pieces[k], sizes[k, 0]) for k in range(count))
        assert left + taken == pytest.approx(whole, abs=ROUNDING)
