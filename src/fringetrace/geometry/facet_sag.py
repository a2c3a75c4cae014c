"""Facet sag: distance of facets from the smooth surface that they approximate, estimated from neighbours."""

from __future__ import annotations

import numpy as np

from fringetrace.core import FloatArray, dot, unit
from fringetrace.geometry.mesh import Mesh
from fringetrace.geometry.topology import IndexArray

# Facets whose normals are more than 30 degrees (cosine) apart meet in an edge of the part.
SHARP = 0.8660254037844387


def standoff(mesh: Mesh, chosen: IndexArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sag and slope error of facets at points on them, against the smooth surface behind them.

    Along each side of a facet the surface bends as the normals at its two ends say; each is the
    mean over the facets around the vertex that make no sharp edge with this one. The lesser of the
    two counts, and none if they bend apart: a crease between flat parts, where only one end leans,
    is the part's own. Linear interpolation of a quadric misses sum of w_i w_j k_ij s_ij^2 / 2
    (w barycentric, k curvature along the side of length s).

    Parameters
    ----------
    mesh : Mesh
    chosen : (n,) int64
        The facet of each point.
    points : (n, 3) float64, metres

    Returns
    -------
    height : (n,) float64, metres
        Positive on the front. 0 on flat parts, and along the rim of the mesh.
    lean : (n, 3) float64
        Its gradient along the facet: the normal of the surface less that of the facet is -lean.
    """
    used, place = np.unique(chosen, return_inverse=True)
    lean = (_corner_normals(mesh, used) - mesh.normals[used, None])[place]
    corners, normal = mesh.vertices[mesh.faces[chosen]], mesh.normals[chosen]
    weight, rise = _barycentric(corners, normal, points)
    height, slope = np.zeros(len(points)), np.zeros_like(points)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        side = corners[:, j] - corners[:, i]
        one, other = -dot(lean[:, i], side), dot(lean[:, j], side)
        bend = np.where(one * other > 0.0, np.sign(one) * np.minimum(np.abs(one), np.abs(other)), 0.0)
        height += bend * weight[:, i] * weight[:, j]
        slope += bend[:, None] * (weight[:, i, None] * rise[:, j] + weight[:, j, None] * rise[:, i])
    return height, slope


def _corner_normals(mesh: Mesh, used: IndexArray) -> FloatArray:
    """Normals (n, 3, 3) at the corners of some faces, over the facets that go on smoothly from each."""
    # files may give each facet vertices of its own: what is one vertex is told by its place
    normal, (order, ends) = mesh.normals, mesh.topology.fans
    mine = mesh.topology.faces[used].ravel()
    count = ends[mine + 1] - ends[mine]
    owner = np.repeat(np.arange(len(mine)), count)
    step = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    face, corner = np.divmod(order[ends[mine][owner] + step], 3)
    goes_on = dot(normal[face], normal[used[owner // 3]]) > SHARP
    face, corner, owner = face[goes_on], corner[goes_on], owner[goes_on]
    # exact on a sphere: N. Max, J. Graphics Tools 4 (1999) 1
    here, one, other = (mesh.vertices[mesh.faces[face, corner - k]] for k in (0, 2, 1))
    one, other = one - here, other - here
    share = np.cross(one, other) / (dot(one, one) * dot(other, other))[:, None]
    columns = [np.bincount(owner, share[:, axis], len(mine)) for axis in range(3)]
    total = np.stack(columns, axis=1).astype(np.float64)
    return unit(total).reshape(-1, 3, 3)


def _barycentric(
    corners: FloatArray, normal: FloatArray, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Weights (n, 3) of points in triangles, and their gradients (n, 3, 3)."""
    rise = []
    for k in range(3):
        opposite = corners[:, k - 1] - corners[:, k - 2]
        across = np.cross(normal, opposite)
        rise.append(across / dot(across, corners[:, k] - corners[:, k - 2])[:, None])
    weight = [dot(rise[k], points - corners[:, k - 2]) for k in range(3)]
    return np.clip(np.stack(weight, axis=1), 0.0, 1.0), np.stack(rise, axis=1)
