"""Errors of the recorded hit points, and the optical path errors they cause."""

from __future__ import annotations

import numpy as np

from fringetrace.core import Array, FloatArray, dot, unit
from fringetrace.geometry import standoff
from fringetrace.scene import Beam
from fringetrace.tracing import EXTENDED, Fate, Paths, Segments, SurfaceHits, path_change, surface_hits


def hit_offsets(hits: SurfaceHits) -> Array:
    """Distance of each hit from its facet, or from the exact form behind it.

    Parameters
    ----------
    hits : SurfaceHits

    Returns
    -------
    (n, 3) longdouble, metres
        Along the normal of the surface.
    """
    corner = hits.corners.astype(EXTENDED)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.sqrt((normal**2).sum(axis=1))[:, None]
    height = ((hits.point - corner[:, 0]) * normal).sum(axis=1)
    on = hits.formed
    if on.any():
        value, gradient, _ = hits.level(on, np.asarray(normal[on], dtype=np.float64))
        normal[on] = gradient / dot(gradient, gradient)[:, None]
        height[on] = value
    return np.asarray(height[:, None] * normal)


def flattening(hits: SurfaceHits) -> tuple[FloatArray, FloatArray]:
    """Sag and slope error of facets at hits, against the smooth surface behind; see `geometry.standoff`.

    Parameters
    ----------
    hits : SurfaceHits

    Returns
    -------
    (n, 3) float64, metres
        From the smooth surface to the hit; 0 where a form is behind the facet.
    (n, 3) float64
        The facet's normal less that of the smooth surface.
    """
    height, lean = np.zeros((len(hits.face), 3)), np.zeros((len(hits.face), 3))
    plain = ~hits.formed
    if plain.any():
        mesh, face = hits.surface.mesh, hits.face[plain]
        above, lean[plain] = standoff(mesh, face, hits.point[plain])
        height[plain] = -above[:, None] * mesh.normals[face]
    return height, lean


def curvature(hits: SurfaceHits) -> FloatArray:
    """Curvature of the surface at hits: dn = C dp; 0 on facets.

    Parameters
    ----------
    hits : SurfaceHits

    Returns
    -------
    (n, 3, 3) float64, 1/m
        Of `SurfaceHits.normal`.
    """
    bend = np.zeros((len(hits.face), 3, 3))
    on = hits.formed
    if not on.any():
        return bend
    normal = hits.normal[on]
    least = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    first = unit(np.cross(normal, least))
    second = np.cross(normal, first)
    steep = np.linalg.norm(hits.level(on, first)[1], axis=1)
    ways = (first, second, unit(first + second))
    along, across, between = (hits.level(on, way)[2] / steep for way in ways)
    twist = between - 0.5 * (along + across)
    bend[on] = np.einsum("n,ni,nj->nij", along, first, first)
    bend[on] += np.einsum("n,ni,nj->nij", across, second, second)
    bend[on] += np.einsum("n,ni,nj->nij", twist, first, second)
    bend[on] += np.einsum("n,ni,nj->nij", twist, second, first)
    return bend


def rounding(paths: Paths) -> FloatArray:
    """Rounding error of the optical path of each path, measured.

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
    segments = Segments.of(paths)
    direction, index = segments.direction, segments.index
    error = (
        paths.length.astype(EXTENDED) - segments.advance.sum(axis=1) - (segments.length * index).sum(axis=1)
    )
    for hits in surface_hits(paths):
        error += path_change(segments, hits, hit_offsets(hits))
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
