"""Flat faces, slabs and stacks that rays meet in the plane y = 0, and what becomes of s and p light there."""

import math

import numpy as np

import fringetrace as ft
from fringetrace.geometry import shapes

Y = np.array([0.0, 1.0, 0.0])


def stack(indices, thickness=(), size=1.0, films=None, interface=None):
    """Faces one below the other from z = 0 down: media `indices`, layers between of `thickness` (metres)."""
    depth = -np.concatenate([[0.0], np.cumsum(thickness)])
    films = [None] * len(depth) if films is None else films
    surfaces = [
        ft.Surface(
            shapes.plate(size, size).moved((0.0, 0.0, z)),
            ft.Dielectric(film=film) if interface is None else interface,
            f"face {k}",
            front=indices[k],
            back=indices[k + 1],
        )
        for k, (z, film) in enumerate(zip(depth, films, strict=True))
    ]
    return ft.Scene(surfaces, medium=indices[0])


def towards(angle, upwards=False):
    """Direction at an angle of incidence in radians, downwards."""
    return np.array([math.sin(angle), 0.0, math.cos(angle) if upwards else -math.cos(angle)])


def aimed(angle, polarisation=None, point=(0.0, 0.0, 0.0), away=0.1, upwards=False):
    """One ray at a point: scalar (None), "s", or "p" (p = k x s)."""
    direction = towards(angle, upwards)
    field = {None: None, "s": Y, "p": np.cross(direction, Y)}[polarisation]
    start = np.asarray(point) - away * direction
    return ft.Rays([start], [direction], polarisation=None if field is None else field[None])


def amplitude(paths, polarisation=None):
    """Complex amplitude of each path: scalar, or the field along s or p of the path itself."""
    if polarisation is None:
        return paths.amplitude
    if polarisation == "s":
        return paths.field @ Y
    return np.einsum("ij,ij->i", paths.field, np.cross(paths.direction, Y))


def branches(paths, polarisation=None):
    """Amplitudes by sequence of (face, transmitted)."""
    return dict(
        zip(
            (tuple(paths.sequence(k)) for k in range(len(paths))), amplitude(paths, polarisation), strict=True
        )
    )


def summed(paths, wavelength, polarisation=None, upwards=True, point=(0.0, 0.0, 0.0), away=0.1):
    """Coherent sum of what left up or down, as plane waves at a point: amplitude of power."""
    out = (paths.fate == ft.Fate.LEFT) & ((paths.direction[:, 2] > 0.0) == upwards)
    some = paths.where(out)
    back = ((np.asarray(point) - some.origin) * some.gradient).sum(axis=1)
    start = away * paths.scene.around.index(wavelength).real
    phase = 2.0 * math.pi / wavelength * (some.length + back - start)
    return (amplitude(some, polarisation) * np.exp(1j * phase)).sum()
