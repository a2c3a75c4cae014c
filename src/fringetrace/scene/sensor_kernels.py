"""Compiled intersection of rays with the CCD, and pixel coordinates.

A `screen` is 15 floats in metres: centre, normal, u, v, half width, half height, focus.
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit, part


@part
def lands(screen, path, x, y, z, dx, dy, dz):
    """Path length to the CCD if a ray reaches its front within `path` metres, else infinity."""
    x, y, z = x - screen[0], y - screen[1], z - screen[2]
    facing = dx * screen[3] + dy * screen[4] + dz * screen[5]
    reach = -(x * screen[3] + y * screen[4] + z * screen[5]) / facing
    if not (facing < 0.0 and reach > 0.0 and reach < path):
        return np.inf
    reach += screen[14] / facing  # back along the ray to the plane in focus
    u = (x + reach * dx) * screen[6] + (y + reach * dy) * screen[7] + (z + reach * dz) * screen[8]
    v = (x + reach * dx) * screen[9] + (y + reach * dy) * screen[10] + (z + reach * dz) * screen[11]
    inside = -screen[12] <= u < screen[12] and -screen[13] <= v < screen[13]
    return reach if inside else np.inf


@part
def place(screen, pitch, rows, columns, x, y, z):
    """CCD coordinates (row, column) in pixels of a point in its plane of focus."""
    x, y, z = x - screen[0], y - screen[1], z - screen[2]
    v = (x * screen[9] + y * screen[10] + z * screen[11]) / pitch + 0.5 * rows
    u = (x * screen[6] + y * screen[7] + z * screen[8]) / pitch + 0.5 * columns
    return v, u


@jit
def locate(screen, pitch, rows, columns, point, pixel):
    """`place` for points (n, 3)."""
    for i in range(len(point)):
        pixel[i, 0], pixel[i, 1] = place(screen, pitch, rows, columns, point[i, 0], point[i, 1], point[i, 2])
