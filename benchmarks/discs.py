"""Geometric optics of two conducting discs, summed over sequences of bounces: a closed form for rays."""

import math
from typing import NamedTuple

import numpy as np


class Bounces(NamedTuple):
    """One ray: the discs that it meets, its optical path between planes through the origin, d theta / d x."""

    discs: tuple
    path: float
    spread: float


def ray(centres, radius, discs, incidence, direction):
    """The ray that meets discs in this order, from and to given directions (radians), or None.

    Discs are strictly convex, so the path length has one minimum over the points of reflection (Fermat),
    which Newton's method finds from the points half-way between the way in and out.
    """
    centre = np.asarray(centres, float)[list(discs)]
    into, out = (np.array([math.cos(v), math.sin(v)]) for v in (incidence, direction))
    middle = np.vstack([centre[0] - 1e3 * radius * into, centre, centre[-1] + 1e3 * radius * out])
    back, on = middle[:-2] - centre, middle[2:] - centre
    start = back / np.hypot(*back.T)[:, None] + on / np.hypot(*on.T)[:, None]
    angle = np.arctan2(start[:, 1], start[:, 0])
    for _ in range(60):
        gradient, hessian, path = _length(angle, centre, radius, into, out)
        step = np.linalg.solve(hessian, gradient)
        angle -= step / max(1.0, np.abs(step).max() / 0.3)
        if np.abs(step).max() < 1e-15:
            break
    points, normal = _points(angle, centre, radius)
    ways = np.vstack([into, *(v / np.hypot(*v) for v in np.diff(points, axis=0)), out])
    cosine = -(ways[:-1] * normal).sum(1)
    if np.any(cosine <= 0) or np.any((ways[1:] * normal).sum(1) <= 0):
        return None
    wide, turn = 1.0, 0.0  # a strip of parallel rays, one metre wide
    for j, each in enumerate(cosine):
        wide += turn * (np.hypot(*(points[j] - points[j - 1])) if j else 0.0)
        turn += 2.0 * wide / (radius * each)
    return Bounces(tuple(discs), path, turn)


def _points(angle, centre, radius):
    normal = np.stack([np.cos(angle), np.sin(angle)], 1)
    return centre + radius * normal, normal


def _length(angle, centre, radius, into, out):
    """Gradient and Hessian by the angles, and the length itself."""
    points, normal = _points(angle, centre, radius)
    tangent = np.stack([-normal[:, 1], normal[:, 0]], 1)
    n = len(angle)
    legs = np.diff(points, axis=0)
    length = np.hypot(*legs.T)
    unit = legs / length[:, None]
    pull = np.zeros_like(points)  # d length / d point
    pull[0] += into
    pull[-1] -= out
    pull[1:] += unit
    pull[:-1] -= unit
    gradient = radius * (pull * tangent).sum(1)
    hessian = np.diag(-radius * (pull * normal).sum(1))
    for j in range(n - 1):
        across = (np.eye(2) - np.outer(unit[j], unit[j])) / length[j]
        for a, b, sign in ((j, j, 1), (j + 1, j + 1, 1), (j, j + 1, -1), (j + 1, j, -1)):
            hessian[a, b] += sign * radius**2 * tangent[a] @ across @ tangent[b]
    return gradient, hessian, points[0] @ into + length.sum() - points[-1] @ out


def rays(centres, radius, incidence, direction, bounces):
    """All rays of up to so many bounces between two discs that do not hide one another on the way."""
    found = [
        ray(centres, radius, [(first + j) % 2 for j in range(count)], incidence, direction)
        for count in range(1, bounces + 1)
        for first in (0, 1)
    ]
    return [each for each in found if each is not None]


def amplitude(found, k):
    """Scattering amplitude f of perfectly conducting discs, E along them: a sign for each bounce."""
    parts = [(-1) ** len(r.discs) / math.sqrt(r.spread) * np.exp(1j * k * r.path) for r in found]
    return math.sqrt(math.pi * k / 2) * np.exp(0.25j * math.pi) * sum(parts)
