"""Exact rays through centred faces one after the other, in mpmath or in float64: what lenses are measured by.

It shares nothing with the package: no meshes, no bodies, no search. Coordinates are triples of columns,
arrays of dtype object for mpmath; z is the axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np

STEPS = 60


@dataclass(frozen=True)
class Face:
    """A face of revolution, and the index behind it; lengths in any one unit."""

    radius: float
    thickness: float  # to the next vertex; of the last face: to the plane where rays end
    index: Any
    conic: float = 0.0
    terms: tuple[float, ...] = ()


def _height(face, q):
    """Sag over q = x^2 + y^2, and its slope dz/dq."""
    c = 0 if math.isinf(face.radius) else 1 / (q[0] * 0 + face.radius)
    root = np.sqrt(1 - (1 + face.conic) * c * c * q)
    sag, slope = c * q / (1 + root), c / (2 * root)
    for i, a in enumerate(face.terms):
        sag, slope = sag + a * q ** (i + 2), slope + (i + 2) * a * q ** (i + 1)
    return sag, slope


def _cross(face, p, d, tiny):
    """Way from points `p` near the face onto it along `d`, and the unit normal there."""
    t = -p[2] / d[2]
    for _ in range(STEPS):
        x, y, z = (p[k] + t * d[k] for k in range(3))
        sag, slope = _height(face, x * x + y * y)
        normal = (-2 * slope * x, -2 * slope * y, 1 + 0 * x)
        step = -(z - sag) / sum(n * e for n, e in zip(normal, d, strict=True))
        t = t + step
        if max(abs(step)) <= tiny:
            break
    size = np.sqrt(sum(n * n for n in normal))
    return t, tuple(n / size for n in normal)


def trace(faces, points, directions, index=1, digits=None):
    """Rays from anywhere before the first vertex (z = 0) to the plane after the last face.

    `faces` of `Face`; `points`, `directions` (n, 3). Returns points (n, 3) on that plane with z from the
    first vertex, directions (n, 3), optical paths (n,); object arrays of mpf where `digits` are given.
    """
    with mpmath.workdps(digits or 15):
        number = mpmath.mpf if digits else float
        columns = [
            [np.array([number(v) for v in column], dtype=object if digits else float) for column in rows.T]
            for rows in (np.asarray(points), np.asarray(directions))
        ]
        p, d = columns
        size = np.sqrt(sum(v * v for v in d))
        d = [v / size for v in d]
        path, before, tiny = 0 * p[0], number(index), number(10) ** (5 - (digits or 21))
        for face in faces:
            after = number(face.index)
            t, n = _cross(face, p, d, tiny * abs(face.radius if math.isfinite(face.radius) else 1))
            p, path = [a + t * b for a, b in zip(p, d, strict=True)], path + before * t
            cosine = sum(a * b for a, b in zip(d, n, strict=True))
            ratio = before / after
            bend = np.sqrt(1 - ratio * ratio * (1 - cosine * cosine)) - ratio * cosine
            d = [ratio * a + bend * b for a, b in zip(d, n, strict=True)]
            p, before = [p[0], p[1], p[2] - face.thickness], after
        t = -p[2] / d[2]
        p, path = [a + t * b for a, b in zip(p, d, strict=True)], path + before * t
        end = p[2] + sum(number(face.thickness) for face in faces)
        return np.stack([p[0], p[1], end], axis=1), np.stack(d, axis=1), path


def crossing(points, directions):
    """Place on the axis that rays of the x-z plane cross, (n,)."""
    return points[:, 2] - points[:, 0] / directions[:, 0] * directions[:, 2]
