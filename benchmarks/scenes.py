"""Scenes that the benchmarks trace, and the same rays for raw embreex."""

from __future__ import annotations

import numpy as np

import fringetrace as ft


def rods() -> tuple[ft.Scene, ft.Beam]:
    """20 x 4 rods of 65 nm in a closed mirror box: every ray bounces as often as it may."""
    lattice = ft.shapes.rod_lattice(20, 4, 65e-9, 280e-9, 2e-6)
    lattice = lattice.moved(-lattice.bounds.mean(axis=0))
    size = np.ptp(lattice.bounds, axis=0) + np.array([0.6e-6, 0.4e-6, 1.2e-6])
    corners = 0.5 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * size[[0, 2]]
    box = ft.shapes.extrude(corners, size[1], closed=True)
    inward = box.faces[:, ::-1] + len(lattice.vertices)
    mesh = ft.Mesh(
        np.concatenate([lattice.vertices, box.vertices]), np.concatenate([lattice.faces, inward]), "rods"
    )
    beam = ft.Beam((0, 0, 0.75e-6), (0.1, 0.05, -1), (0, 1, 0), (5.0e-6, 1.5e-6), (1000, 1000))
    return ft.Scene([ft.Surface(mesh, ft.Mirror())]), beam


def corner_cube() -> tuple[ft.Scene, ft.Beam]:
    """A corner cube of 1e7 wavelengths (22k triangles) that faces two plates, one wedged to the other."""
    side = 5.0
    cube = ft.shapes.corner_cube(side, subdivisions=60)
    axis = np.ones(3) / np.sqrt(3.0)
    across = np.cross(axis, (0.0, 0.0, 1.0)) / np.linalg.norm(np.cross(axis, (0.0, 0.0, 1.0)))
    facing = np.stack([across, -np.cross(axis, across), -axis], axis=1)  # the plate's top to the cube
    plates = []
    for sign in (-1.0, 1.0):
        plate = ft.shapes.plate(0.98 * side, 2.0 * side, thickness=0.02 * side)
        wedge = ft.vectors.rotation(np.cross(axis, across), 0.5e-3 * sign)
        plates.append(plate.moved(1.8 * side * axis + sign * 0.5 * side * across, wedge @ facing))
    mesh = merged(cube, *plates)
    start = 1.2 * side * axis
    beam = ft.Beam(start, -axis + 0.05 * across, (0, 0, 1), (0.4 * side, 0.4 * side), (1000, 1000))
    return ft.Scene([ft.Surface(mesh, ft.Mirror())]), beam


def merged(*meshes: ft.Mesh) -> ft.Mesh:
    """Several meshes as one."""
    shift = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    faces = [mesh.faces + start for mesh, start in zip(meshes, shift, strict=False)]
    return ft.Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def joint(scene: ft.Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """All triangles of a scene as one float32 mesh in the unit box; vertices, faces, centre, scale."""
    mesh = merged(*(surface.mesh for surface in scene.surfaces))
    vertices, faces = mesh.vertices, mesh.faces
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    centre, scale = 0.5 * (low + high), 2.0 / float((high - low).max())
    return ((vertices - centre) * scale).astype(np.float32), faces.astype(np.int32), centre, scale


def michelson(side: int) -> ft.instruments.Interferometer:
    """A Michelson of side x side rays and pixels that looks at the elevation map."""
    relief, pitch = ft.meshes.elevation_sample(2e-6, 8e-3)
    sample = ft.meshes.height_map(relief, pitch)
    return ft.instruments.michelson(sample, aperture=6e-3, pixels=(side, side), reference_tilt=(200e-6, 0.0))


Segments = list[tuple[np.ndarray, np.ndarray]]


def segments(paths: ft.Paths, centre: np.ndarray, scale: float) -> Segments:
    """Float32 rays of every segment of recorded paths, pass by pass, a little off their surfaces.

    Branches of one ray share their first segments: each distinct one is kept once.
    """
    passes = []
    name = paths.ray.astype(np.int64)
    for k in range(int(paths.bounces.max()) + 1):
        alive = np.flatnonzero(paths.bounces >= k)
        start, end = paths.points[alive, k], paths.points[alive, k + 1]
        on = np.isfinite(end[:, :1])
        along = np.where(on, np.where(on, end, 0.0) - start, paths.direction[alive])
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        # a ray's branches differ in what they met before and in where they go
        if k:
            name = name * 1000003 + paths.triangle[:, k - 1]
        heading = np.round(along * 2**20).astype(np.int64) @ np.array([1, 1 << 21, 1 << 42])
        _, first = np.unique(name[alive] * 1000003 + heading, return_index=True)
        first.sort()
        start, along = start[first], along[first]
        begin = (start - centre) * scale + 2e-6 * along
        passes.append((begin.astype(np.float32), along.astype(np.float32)))
    return passes
