"""Rays that meet the plane z = 0, whose front faces -z."""

import numpy as np

from fringetrace.optics.elements import IncidentRays

EPS = float(np.finfo(np.float64).eps)


def meeting(direction, point=(0.0, 0.0, 0.0), field=1.0, normal=(0.0, 0.0, -1.0), index=1.0, wavelength=None):
    """A meeting from single values, or rows of them; directions are scaled to unit length."""
    direction = np.atleast_2d(np.asarray(direction, dtype=float))
    count = len(direction)
    rows = [np.broadcast_to(np.asarray(v, dtype=float), (count, 3)).copy() for v in (point, normal)]
    field = np.asarray(field, dtype=complex)
    wide = field.shape[-1:] == (3,)
    return IncidentRays(
        rows[0],
        direction / np.linalg.norm(direction, axis=1)[:, None],
        rows[1],
        np.full(count, float(index)),
        np.broadcast_to(field, (count, 3) if wide else (count,)).copy(),
        wavelength,
    )


def shower(seed, count=12, steep=0.6, polarised=True, both=True, index=1.0, wavelength=None):
    """Random rays within `steep` (a sine) of the normal, from the front or from both sides, on 20 x 20 mm."""
    random = np.random.default_rng(seed)
    slant = random.uniform(-steep, steep, (count, 2)) / np.sqrt(2.0)
    side = random.choice([-1.0, 1.0], count) if both else np.ones(count)
    direction = np.column_stack([slant, side * np.sqrt(1.0 - (slant**2).sum(axis=1))])
    point = np.column_stack([random.uniform(-0.01, 0.01, (count, 2)), np.zeros(count)])
    field = random.normal(size=count) + 1j * random.normal(size=count)
    if polarised:
        vector = random.normal(size=(count, 3)) + 1j * random.normal(size=(count, 3))
        field = vector - np.einsum("ij,ij->i", vector, direction)[:, None] * direction
    return meeting(direction, point, field, index=index, wavelength=wavelength)


def power(field):
    """|field|^2 of rows."""
    return np.abs(field) ** 2 if field.ndim == 1 else (np.abs(field) ** 2).sum(axis=1)


def outcome(rays, branch):
    """Field, direction, point, and added path of a branch, those that did not change filled in."""
    path = np.zeros(len(rays.point)) if branch.path is None else branch.path
    direction = rays.direction if branch.direction is None else branch.direction
    return branch.field, direction, rays.point if branch.point is None else branch.point, path
