"""Groups of coplanar facets that reflect one plane wave."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray
from fringetrace.geometry import weld
from fringetrace.optics import Metal
from fringetrace.scene.model import Scene, Surface

# Normals and heights of facets this near (relative to the mesh) are those of one plane.
COPLANAR = 1e-9


def group_facets(scene: Scene) -> list[npt.NDArray[np.int64]]:
    """Which triangles of each surface are one: those in a plane, those that hang together on a form.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    list of (triangles,) int64
        A number for the part that each triangle belongs to, one array a surface; below 0 on a form, and
        beside media that absorb and on elements that curve waves: waves off there are not plane, or not even.
    """
    if "parts" not in scene.derived:
        scene.derived["parts"] = [
            _parts(surface) if _even(surface, scene) else _bent(_parts(surface)) for surface in scene.surfaces
        ]
    parts: list[npt.NDArray[np.int64]] = scene.derived["parts"]
    return parts


def _even(surface: Surface, scene: Scene) -> bool:
    """Whether light beside a surface keeps its power on the way; in a metal there is none."""
    sides = (surface.front or scene.around, surface.back or scene.around)
    absorbs = [medium.kappa is not None for medium in sides]
    return not (all(absorbs) if isinstance(surface.interface, Metal) else any(absorbs))


def _bent(parts: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Parts as numbers below 0, each still a part of its own."""
    return np.where(parts < 0, parts, parts.min(initial=0) - 1 - parts)


def _parts(surface: Surface) -> npt.NDArray[np.int64]:
    mesh = surface.mesh
    parts = np.empty(len(mesh.faces), dtype=np.int64)
    flat = np.ones(len(mesh.faces), dtype=np.bool_)
    if surface.form is not None:
        flat = surface.form.fit(mesh.vertices, mesh.faces).along == 0
    elif getattr(surface.interface, "waves", "plane") != "plane":
        flat[:] = False
    parts[~flat] = -1 - _hanging_together(mesh.vertices, mesh.faces[~flat])
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces[flat]], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    size = float(np.ptp(mesh.bounds, axis=0).max())
    height = np.einsum("ij,ij->i", normal, a - mesh.bounds.mean(axis=0)) / size
    # off the middle between round numbers, where most designs have their planes
    rounded = np.floor(np.column_stack([normal, height]) / COPLANAR + 0.377).astype(np.int64)
    parts[flat] = np.unique(rounded, axis=0, return_inverse=True)[1].ravel()
    return parts


def _hanging_together(vertices: FloatArray, faces: Array) -> npt.NDArray[np.int64]:
    """The least vertex of all faces that each face hangs together with."""
    welded, faces = weld(vertices, faces)
    label = np.arange(len(welded))
    while True:
        least = label[faces].min(axis=1)
        lower = label.copy()
        np.minimum.at(lower, faces.ravel(), np.repeat(least, 3))
        lower = lower[lower]
        if (lower == label).all():
            return np.asarray(least, dtype=np.int64)
        label = lower
