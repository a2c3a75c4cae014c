"""Paths off mirrors in closed form, which no facet stands for: what a trace of smooth surfaces brings."""

import numpy as np

import fringetrace as ft
from fringetrace.core.vectors import frame
from fringetrace.tracing.paths import Paths
from fringetrace.tracing.rays import launch

SCENE = ft.Scene([ft.Surface(ft.shapes.plate(1.0, 1.0), ft.Mirror(), "mirror")])


def reflected(beam, ccd, mirror, key=1):
    """Paths of a beam with one reflection; `mirror` gives (path, unit normal) for (origin, direction)."""
    rays = launch(beam)
    count = len(rays)
    path, normal = mirror(rays.origin, rays.direction)
    hit = rays.origin + path[:, None] * rays.direction
    out = rays.direction - 2 * np.einsum("ij,ij->i", rays.direction, normal)[:, None] * normal
    u, v, n = frame(ccd.normal, ccd.up, "CCD")
    reach = ((ccd.centre - hit) @ n + ccd.focus) / (out @ n)
    end = hit + reach[:, None] * out
    offset = end - ccd.centre
    seen = (abs(offset @ u) < ccd.size[0] / 2) & (abs(offset @ v) < ccd.size[1] / 2)
    return Paths(
        ray=np.arange(count),
        fate=np.where(seen, ft.Fate.DETECTED, ft.Fate.LEFT).astype(np.int8),
        bounces=np.ones(count, dtype=np.int32),
        reflections=np.ones(count, dtype=np.int32),
        length=np.where(seen, path + reach, path),
        origin=np.where(seen[:, None], end, hit),
        direction=out,
        amplitude=-rays.amplitude,
        lost=np.zeros(count),
        key=np.full(count, key, dtype=np.uint64),
        area=beam.area,
        incident=float(count),
        segments=2 * count,
        doubtful=0,
        scene=SCENE,
        source=beam,
        ccd=ccd,
        points=np.stack([rays.origin, hit, np.where(seen[:, None], end, np.nan)], axis=1),
    )


def paraboloid(focal_length):
    """z = r^2 / 4f, lit straight down: every ray goes on through (0, 0, f)."""

    def mirror(origin, direction):
        x, y, z = origin.T
        normal = np.stack([-x, -y, np.full_like(z, 2 * focal_length)], axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return z - (x * x + y * y) / (4 * focal_length), normal

    return mirror


def cylinder(radius):
    """x^2 + z^2 = R^2, z > 0, lit straight up from its axis' side."""

    def mirror(origin, direction):
        x, _, z = origin.T
        height = np.sqrt(radius**2 - x * x)
        return height - z, -np.stack([x, 0 * x, height], axis=1) / radius

    return mirror


def plane(angle):
    """A plane through the origin whose normal leans by an angle from z towards x, lit straight down."""

    def mirror(origin, direction):
        normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
        return -(origin @ normal) / (direction @ normal), np.broadcast_to(normal, origin.shape)

    return mirror


def sphere(radius):
    """x^2 + y^2 + z^2 = R^2, z > 0, lit straight up from its centre's side."""

    def mirror(origin, direction):
        x, y, z = origin.T
        height = np.sqrt(radius**2 - x * x - y * y)
        return height - z, -np.stack([x, y, height], axis=1) / radius

    return mirror
