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


def amplitude(found, k, sign=-1):
    """Scattering amplitude f of perfectly conducting discs; each bounce turns the sign if E is along them."""
    parts = [sign ** len(each.discs) / math.sqrt(each.spread) * np.exp(1j * k * each.path) for each in found]
    return math.sqrt(math.pi * k / 2) * np.exp(0.25j * math.pi) * sum(parts)


def through(index, k, polarisation, turn, passes=4):
    """Scattering amplitude f of one clear rod of radius 1: rays reflected, and let out after each pass.

    A ray with angle of incidence i, inside r, turns by (1 - p) pi - 2 i + 2 p r after p passes and goes
    through p foci, one less where its turn falls with i (H. C. van de Hulst, Light Scattering by Small
    Particles, 12.2).
    """
    start = np.linspace(-math.pi / 2, math.pi / 2, 8001)[1:-1]
    total = np.zeros(len(turn), complex)
    for p in range(passes + 1):
        off = _wrapped(
            (1 - p) * math.pi - 2 * start + 2 * p * np.arcsin(np.sin(start) / index) - turn[:, None]
        )
        way, j = np.nonzero((off[:, :-1] * off[:, 1:] <= 0) & (abs(np.diff(off)) < 1))
        i = start[j] + (start[1] - start[0]) * off[way, j] / (off[way, j] - off[way, j + 1])
        for _ in range(3):  # Newton, but not away from where two solutions meet
            miss = _wrapped((1 - p) * math.pi - 2 * i + 2 * p * np.arcsin(np.sin(i) / index) - turn[way])
            step = miss / (2 * p * np.cos(i) / np.sqrt(index**2 - np.sin(i) ** 2) - 2)
            i = np.clip(i - np.where(abs(step) < 0.01, step, 0.0), start[0], start[-1])
        cosine, inner = np.cos(i), np.sqrt(1 - (np.sin(i) / index) ** 2)
        growth = 2 - 2 * p * cosine / (index * inner)
        one, other = (cosine, index * inner) if polarisation == "s" else (index * cosine, inner)
        reflected = (one - other) / (one + other)
        strength = reflected if p == 0 else (1 - reflected**2) * (-reflected) ** (p - 1)
        phase = k * (2 * p * index * inner - 2 * cosine) - math.pi / 2 * (p - (growth < 0))
        np.add.at(total, way, strength * np.sqrt(cosine / abs(growth)) * np.exp(1j * phase))
    return math.sqrt(math.pi * k / 2) * np.exp(0.25j * math.pi) * total


def _wrapped(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi
