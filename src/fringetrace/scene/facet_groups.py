"""Groups of coplanar facets, each of which reflects one plane wave."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray
from fringetrace.geometry import weld
from fringetrace.scene.coplanar import planes
from fringetrace.scene.model import Scene, Surface


def group_facets(scene: Scene) -> list[npt.NDArray[np.int64]]:
    """Facet groups of each surface: facets of one plane, or connected facets on a form.

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
    return not (all(absorbs) if surface.opaque else any(absorbs))


def _bent(parts: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Parts as numbers below 0, each still a part of its own."""
    return np.where(parts < 0, parts, parts.min(initial=0) - 1 - parts)


def _parts(surface: Surface) -> npt.NDArray[np.int64]:
    mesh = surface.mesh
    parts = np.empty(len(mesh.faces), dtype=np.int64)
    flat = np.ones(len(mesh.faces), dtype=np.bool_)
    if surface.form is not None:
        flat = surface.form.fit(mesh.vertices, mesh.faces).along == 0
    elif surface.interface.waves != "plane":
        flat[:] = False
    parts[~flat] = -1 - _hanging_together(mesh.vertices, mesh.faces[~flat])
    parts[flat] = planes(mesh.vertices[mesh.faces[flat]])
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
