"""Groups of coplanar facets, each of which reflects one plane wave."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fringetrace.geometry import connected
from fringetrace.scene.coplanar import planes
from fringetrace.scene.derived import once_per_scene
from fringetrace.scene.model import Scene, Surface


@once_per_scene
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
    return [
        _parts(surface) if _even(surface, scene) else _bent(_parts(surface)) for surface in scene.surfaces
    ]


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
    if surface.fit is not None:
        flat = surface.fit.along == 0
    elif surface.interface.waves != "plane":
        flat[:] = False
    parts[~flat] = -1 - connected(mesh.topology.faces[~flat])
    parts[flat] = planes(mesh.corners[flat])
    return parts
