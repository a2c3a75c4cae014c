"""The engine's brute-force twin: every triangle, in float64, no tree and no float32.

It shares no code with the engine. Ties within `TIE` (of the scene's size) are shared edges.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange


@njit(cache=True)
def _near(o, d, centre, square):
    """Whether a ray's line passes within a sphere."""
    w = centre - o
    along = w @ d
    return w @ w - along * along <= square


@njit(parallel=True, cache=True)
def first_hits(origin, direction, left, corners, centre, square, group, path, triangle, slack):
    """Nearest crossing of each ray, by Moeller and Trumbore over all triangles but the one left.

    `group` (g + 1,) splits the triangles into runs, each inside a sphere (`centre`, `square`).
    """
    for i in prange(len(origin)):
        o, d = origin[i], direction[i]
        best, which = np.inf, -1
        for g in range(len(centre)):
            if not _near(o, d, centre[g], square[g]):
                continue
            for k in range(group[g], group[g + 1]):
                if k == left[i]:
                    continue
                ax, ay, az = corners[k, 0, 0], corners[k, 0, 1], corners[k, 0, 2]
                ux, uy, uz = corners[k, 1, 0] - ax, corners[k, 1, 1] - ay, corners[k, 1, 2] - az
                vx, vy, vz = corners[k, 2, 0] - ax, corners[k, 2, 1] - ay, corners[k, 2, 2] - az
                px, py, pz = d[1] * vz - d[2] * vy, d[2] * vx - d[0] * vz, d[0] * vy - d[1] * vx
                det = ux * px + uy * py + uz * pz
                if det == 0.0:
                    continue
                sx, sy, sz = o[0] - ax, o[1] - ay, o[2] - az
                a = (sx * px + sy * py + sz * pz) / det
                if a < 0.0 or a > 1.0:
                    continue
                qx, qy, qz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
                b = (d[0] * qx + d[1] * qy + d[2] * qz) / det
                if b < 0.0 or a + b > 1.0:
                    continue
                t = (vx * qx + vy * qy + vz * qz) / det
                if slack < t < best:
                    best, which = t, k
        path[i], triangle[i] = best, which


def spheres(corners: np.ndarray, run: int = 32) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bounding spheres of runs of triangles (in the order of the mesh)."""
    group = np.append(np.arange(0, len(corners), run), len(corners))
    centre = np.empty((len(group) - 1, 3))
    square = np.empty(len(group) - 1)
    for g in range(len(centre)):
        points = corners[group[g] : group[g + 1]].reshape(-1, 3)
        centre[g] = 0.5 * (points.min(axis=0) + points.max(axis=0))
        square[g] = ((points - centre[g]) ** 2).sum(axis=1).max() * (1 + 1e-9)
    return centre, square, group


def nearest(corners, origin, direction, left, slack=0.0):
    """Path (inf: none) and triangle (-1: none) of each ray's first hit; see `first_hits`."""
    path, triangle = np.empty(len(origin)), np.empty(len(origin), dtype=np.int64)
    first_hits(
        np.ascontiguousarray(origin), np.ascontiguousarray(direction), np.asarray(left, dtype=np.int64),
        np.ascontiguousarray(corners), *spheres(corners), path, triangle, slack,
    )  # fmt: skip
    return path, triangle
