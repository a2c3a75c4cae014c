"""Errors of the recorded hit points, and the optical path errors they cause."""

from __future__ import annotations

import numpy as np

from fringetrace.core import Array, FloatArray, dot, unit
from fringetrace.geometry import standoff
from fringetrace.scene import Beam
from fringetrace.tracing import (
    EXTENDED,
    Fate,
    Met,
    Paths,
    corners,
    indices,
    legs,
    level,
    met,
    normals,
    scene_media,
    shifted,
)


def hit_offsets(bounces: Met) -> Array:
    """Rounding of the hits: how far each stands off its facet, or off the form behind it.

    Parameters
    ----------
    bounces : Met

    Returns
    -------
    (n, 3) longdouble, metres
        Along the normal of the surface.
    """
    corner = corners(bounces).astype(EXTENDED)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.sqrt((normal**2).sum(axis=1))[:, None]
    height = ((bounces.point - corner[:, 0]) * normal).sum(axis=1)
    on = bounces.formed
    if on.any():
        value, gradient, _ = level(bounces, on, np.asarray(normal[on], dtype=np.float64))
        normal[on] = gradient / dot(gradient, gradient)[:, None]
        height[on] = value
    return np.asarray(height[:, None] * normal)


def flattening(bounces: Met) -> tuple[FloatArray, FloatArray]:
    """What facets leave out of the smooth surface that they may stand for; see `facets.standoff`.

    Parameters
    ----------
    bounces : Met

    Returns
    -------
    (n, 3) float64, metres
        From the smooth surface to the hit; 0 where a form is behind the facet.
    (n, 3) float64
        The facet's normal less that of the smooth surface.
    """
    height, lean = np.zeros((len(bounces.face), 3)), np.zeros((len(bounces.face), 3))
    plain = ~bounces.formed
    if plain.any():
        mesh, face = bounces.surface.mesh, bounces.face[plain]
        corner = mesh.vertices[mesh.faces[face]]
        normal = unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
        above, lean[plain] = standoff(mesh.vertices, mesh.faces, face, bounces.point[plain])
        height[plain] = -above[:, None] * normal
    return height, lean


def curvature(bounces: Met) -> FloatArray:
    """How the normal of the surface turns from place to place: dn = C dp; 0 on facets.

    Parameters
    ----------
    bounces : Met

    Returns
    -------
    (n, 3, 3) float64, 1/m
        Of the normal that `normals` gives.
    """
    bend = np.zeros((len(bounces.face), 3, 3))
    on = bounces.formed
    if not on.any():
        return bend
    normal = normals(bounces)[on]
    least = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    first = unit(np.cross(normal, least))
    second = np.cross(normal, first)
    steep = np.linalg.norm(level(bounces, on, first)[1], axis=1)
    ways = (first, second, unit(first + second))
    along, across, between = (level(bounces, on, way)[2] / steep for way in ways)
    twist = between - 0.5 * (along + across)
    bend[on] = np.einsum("n,ni,nj->nij", along, first, first)
    bend[on] += np.einsum("n,ni,nj->nij", across, second, second)
    bend[on] += np.einsum("n,ni,nj->nij", twist, first, second)
    bend[on] += np.einsum("n,ni,nj->nij", twist, second, first)
    return bend


def _lengths(paths: Paths) -> FloatArray:
    """Optical paths, without what thin elements add."""
    if paths.lengths is None or not any(hasattr(s.interface, "act") for s in paths.scene.surfaces):
        return paths.length
    known = [complex(m.index(paths.wavelength or 1.0)).real for m in scene_media(paths.scene)]
    return np.asarray(paths.lengths @ np.array(known), dtype=np.float64)


def rounding(paths: Paths) -> FloatArray:
    """Error of the optical path of each path by the rounding of float64, measured.

    The recorded points are compared with the facets and forms that they should lie on, and the
    optical path with the way from point to point, in longer numbers. A path whose points lie on the
    surfaces and that has the length of the way between them is, by Fermat's principle, the true
    path to where it arrives, to second order.

    Parameters
    ----------
    paths : Paths
        Traced with record=True.

    Returns
    -------
    (m,) float64, metres
        Optical path less the true one to the same place. Where numbers have no more digits than
        float64 (some machines), or behind a form, as large as the roundings of this comparison.
    """
    length, direction = legs(paths)
    index = indices(paths)
    error = _lengths(paths).astype(EXTENDED) - (length * index).sum(axis=1)
    for bounces in met(paths):
        error += shifted(paths, bounces, hit_offsets(bounces), direction)
    assert paths.points is not None
    if isinstance(paths.source, Beam):  # the phase is 0 on its rectangle
        start = paths.points[:, 0].astype(EXTENDED) - paths.source.centre
        along = paths.source.axes[2].astype(EXTENDED)
        error -= index[:, 0] * (start @ (along / np.sqrt((along**2).sum())))
    elif paths.source.length is not None:
        error -= paths.source.length[paths.ray]
    if paths.ccd is not None:
        seen = np.flatnonzero(paths.fate == Fate.DETECTED)
        normal = paths.ccd.axes[2].astype(EXTENDED)
        beyond = (paths.origin[seen].astype(EXTENDED) - paths.ccd.centre) @ normal - paths.ccd.focus
        last = paths.bounces[seen]
        error[seen] += beyond * (direction[seen, last] @ normal) * index[seen, last]
    return np.asarray(error, dtype=np.float64)
