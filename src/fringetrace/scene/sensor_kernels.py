"""Compiled geometry of the pixel sensor: where rays cross its plane, whether inside, and in which pixel.

A `screen` is 15 floats in metres: centre, normal, u, v, half width, half height, focus; see `sensor.screen`.
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit, part


@part
def across(screen, x, y, z):
    """Coordinates (u, v) along columns and rows, metres, of an offset from the centre."""
    u = x * screen[6] + y * screen[7] + z * screen[8]
    v = x * screen[9] + y * screen[10] + z * screen[11]
    return u, v


@part
def crossing(screen, path, x, y, z, dx, dy, dz):
    """Path to the plane of focus if a ray reaches the sensor's plane within `path` metres, else infinity.

    From in front; x, y, z is the ray's start, from the centre of the sensor.
    """
    facing = dx * screen[3] + dy * screen[4] + dz * screen[5]
    reach = -(x * screen[3] + y * screen[4] + z * screen[5]) / facing
    if not (facing < 0.0 and reach > 0.0 and reach < path):
        return np.inf
    return reach + screen[14] / facing  # back along the ray to the plane in focus


@part
def inside(screen, u, v):
    """Whether coordinates are on the sensor: half open, so that a point is in one pixel."""
    return -screen[12] <= u < screen[12] and -screen[13] <= v < screen[13]


@part
def lands(screen, path, x, y, z, dx, dy, dz):
    """Path to the sensor if a ray reaches its front within `path` metres, else infinity."""
    x, y, z = x - screen[0], y - screen[1], z - screen[2]
    reach = crossing(screen, path, x, y, z, dx, dy, dz)
    if reach == np.inf:
        return reach
    u, v = across(screen, x + reach * dx, y + reach * dy, z + reach * dz)
    return reach if inside(screen, u, v) else np.inf


@part
def place(screen, pitch, rows, columns, x, y, z):
    """Sensor coordinates (row, column) in pixels of a point in its plane of focus."""
    u, v = across(screen, x - screen[0], y - screen[1], z - screen[2])
    return v / pitch + 0.5 * rows, u / pitch + 0.5 * columns


@jit
def pixels(screen, pitch, rows, columns, point, pixel):
    """`place` for points (n, 3)."""
    for i in range(len(point)):
        pixel[i, 0], pixel[i, 1] = place(screen, pitch, rows, columns, point[i, 0], point[i, 1], point[i, 2])


@jit
def cross(screen, origin, direction, reach, hit):
    """`crossing` for rays (n, 3), however long their path; whether they are `inside` there."""
    for i in range(len(origin)):
        x, y, z = origin[i, 0] - screen[0], origin[i, 1] - screen[1], origin[i, 2] - screen[2]
        dx, dy, dz = direction[i, 0], direction[i, 1], direction[i, 2]
        reach[i] = crossing(screen, np.inf, x, y, z, dx, dy, dz)
        hit[i] = False
        if reach[i] < np.inf:
            u, v = across(screen, x + reach[i] * dx, y + reach[i] * dy, z + reach[i] * dz)
            hit[i] = inside(screen, u, v)
