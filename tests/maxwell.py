"""The tracer's twin through glass: one ray at a time, faces by brute force, fields from Maxwell's conditions.

It shares no code and no formula with the kernels: no Snell's law in angles, no Fresnel, no s and p light.
Tangential parts of wave vectors are kept, and the tangential parts of E and H on both sides of a face are
four linear equations for the four amplitudes that leave it.
"""

from dataclasses import dataclass, replace

import numpy as np


@dataclass
class Body:
    """A convex body of glass: planes n.p = c of a polyhedron, outwards, or a sphere."""

    index: complex
    planes: np.ndarray | None = None
    centre: np.ndarray | None = None
    radius: float = 0.0

    def crossings(self, origin, direction):
        """Paths at which a line crosses the surface, and the outward normals there."""
        if self.planes is None:
            reach = self.centre - origin
            half = reach @ direction
            square = self.radius**2 - (reach @ reach - half**2)
            if square <= 0.0:
                return []
            ways = [half - np.sqrt(square), half + np.sqrt(square)]
            return [(t, (origin + t * direction - self.centre) / self.radius) for t in ways]
        normal, height = self.planes[:, :3], self.planes[:, 3]
        facing = normal @ direction
        with np.errstate(divide="ignore"):
            way = (height - normal @ origin) / facing
        first = np.argmax(np.where(facing < 0.0, way, -np.inf))
        last = np.argmin(np.where(facing > 0.0, way, np.inf))
        if way[first] >= way[last]:
            return []
        return [(way[k], normal[k]) for k in (first, last)]


@dataclass
class Ray:
    """A ray under way: wave vector over k0, field, what turns |field| into power, optical path, way, key."""

    origin: np.ndarray
    wave: np.ndarray
    field: np.ndarray
    weight: float
    length: float
    key: tuple
    inside: int  # number of the body, or -1
    last: tuple  # body and normal left last

    @property
    def amplitude(self):
        """The field whose square is the power."""
        return self.field * self.weight


def leaving(wave, field, normal, first, second):
    """Waves that leave a face, reflected and transmitted: (wave vector, field) each, from four equations.

    Media of indices `first` and `second`; `normal` on the side that the wave comes from.
    """
    along = wave - (wave @ normal) * normal
    deep = np.sqrt(np.complex128(second**2 - along @ along))
    deep = -deep if deep.imag < 0.0 else deep
    waves = [wave - 2.0 * (wave @ normal) * normal, along - deep * normal]
    least = np.eye(3)[np.argmin(np.abs(normal))]
    x = np.cross(normal, least)
    axes = np.stack([x / np.linalg.norm(x), np.cross(normal, x / np.linalg.norm(x))])
    basis = []
    for k in waves:  # two fields across each wave vector (k.e = 0, without conjugation)
        one = np.cross(k, axes[0])
        one = one if np.linalg.norm(one) > 0.5 * np.linalg.norm(k) else np.cross(k, axes[1])
        basis += [(k, one), (k, np.cross(k, one))]

    def tangential(k, e):
        return np.concatenate([axes @ e, axes @ np.cross(k, e)])

    matrix = np.stack([tangential(k, e) for k, e in basis], axis=1).astype(complex)
    matrix[:, :2] *= -1.0
    found = np.linalg.solve(matrix, tangential(wave, field))
    return [(k, found[2 * n] * basis[2 * n][1] + found[2 * n + 1] * basis[2 * n + 1][1])
            for n, k in enumerate(waves)]  # fmt: skip


def trace(bodies, around, origin, direction, field, most, least=0.0):
    """All ends of a ray: those that left, or met `most` faces.

    Parameters
    ----------
    bodies : list of Body
        That do not overlap.
    around : float
        Index between them.
    origin, direction : (3,)
    field : (3,) complex, across the ray
    most : int
    least : float
        Amplitudes below are not followed.

    Returns
    -------
    dict of key to Ray
        Keys are tuples of (body, whether transmitted).
    """
    todo = [
        Ray(origin, around * direction.astype(complex), field.astype(complex), 1.0, 0.0, (), -1, (-2, None))
    ]
    ends = {}
    while todo:
        ray = todo.pop()
        index = around if ray.inside < 0 else bodies[ray.inside].index
        along = ray.wave.real / np.linalg.norm(ray.wave.real)
        best = (np.inf, None, None)
        for number, body in enumerate(bodies):
            for way, normal in body.crossings(ray.origin, along):
                same = ray.last[0] == number and (ray.last[1] @ normal > 1.0 - 1e-9 or number != ray.inside)
                if 0.0 < way < best[0] and not same:
                    best = (way, number, normal)
        way, number, normal = best
        if number is None or len(ray.key) >= most:
            ends[ray.key] = ray
            continue
        point = ray.origin + way * along
        inside = ray.inside == number
        towards = -normal if inside else normal
        beyond = around if inside else bodies[number].index
        length = ray.length + way * np.linalg.norm(ray.wave.real)
        pair = leaving(ray.wave, ray.field, towards, index, beyond)
        for through, (wave, out) in enumerate(pair):
            after = (-1 if inside else number) if through else ray.inside
            # power through the face: n cos |E|^2
            cosine = [abs(k.real @ normal) for k in (ray.wave, wave)]
            if np.abs(wave.imag).max() > 0.0:
                continue  # evanescent
            new = replace(
                ray, origin=point, wave=wave.real + 0j, field=out, length=length, inside=after,
                weight=ray.weight * np.sqrt(cosine[1] / cosine[0]), key=(*ray.key, (number, bool(through))),
                last=(number, normal),
            )  # fmt: skip
            if np.linalg.norm(new.amplitude) > least:
                todo.append(new)
    return ends
