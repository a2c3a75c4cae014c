"""PN triangles: curved patches through the vertices of a mesh and normal to its vertex normals.

Over each face stands a cubic Bezier triangle whose rim depends only on the two vertices and normals
at its ends, so that neighbours meet along it. Source: Vlachos et al., "Curved PN triangles" (2001),
with handles as long as those of a circle's arc.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray, dot, short_repr, unit
from fringetrace.geometry.implicit import EPSILON, ROUNDINGS, STEPS, Meeting, advance
from fringetrace.geometry.mesh import Mesh

# Vertex normals may lean this far (cosine) from a face's: beyond, the mesh has an edge there.
LEAN = 0.75
# A parameter this far outside its patch is a rounding.
OUTSIDE = 1e-12
# A ray slides over so many patches in search of the one that it meets.
WALKS = 16
# Newton steps from a point to the foot of its height on a patch.
FEET = 4


def vertex_normals(vertices: FloatArray, faces: npt.NDArray[np.int64]) -> FloatArray:
    """Vertex normals of a mesh, exact where the vertices lie on a sphere.

    Parameters
    ----------
    vertices : (v, 3) float64, metres
    faces : (f, 3) int64

    Returns
    -------
    (v, 3) float64, unit; 0 where no face is. Source: N. Max, J. Graphics Tools 4 (1999) 1.
    """
    corners = vertices[faces] / np.ptp(vertices[faces].reshape(-1, 3), axis=0).max()
    normal = np.zeros((len(vertices), 3))
    for k in range(3):
        one, other = corners[:, k - 2] - corners[:, k], corners[:, k - 1] - corners[:, k]
        cross = np.cross(one, other) / (dot(one, one) * dot(other, other))[:, None]
        for axis in range(3):
            normal[:, axis] += np.bincount(faces[:, k], weights=cross[:, axis], minlength=len(vertices))
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.asarray(np.divide(normal, size, out=np.zeros_like(normal), where=size > 0.0))


def neighbours(faces: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Neighbouring faces (f, 3), opposite to each corner; -1 at the boundary of the mesh.

    Raises
    ------
    ValueError
        If faces are not wound alike.
    """
    count = int(faces.max()) + 1
    start, end = np.roll(faces, -1, axis=1).ravel(), np.roll(faces, -2, axis=1).ravel()
    side, back = start * count + end, end * count + start
    order = np.argsort(side, kind="stable")
    ordered = side[order]
    if (np.diff(ordered) == 0).any():
        raise ValueError("Smooth form: expected faces wound alike, two to a side at most, got others")
    place = np.minimum(np.searchsorted(ordered, back), len(ordered) - 1)
    return np.where(ordered[place] == back, order[place] // 3, -1).reshape(-1, 3)


def _handle(start: FloatArray, end: FloatArray, normal: FloatArray) -> FloatArray:
    """Control point next to `start` of the cubic from `start` to `end`, across the normal at `start`."""
    chord = end - start
    across = chord - dot(chord, normal)[:, None] * normal
    cosine = np.sqrt(dot(across, across) / dot(chord, chord))[:, None]
    return np.asarray(start + across * (2.0 / (3.0 * cosine * (1.0 + cosine))), dtype=np.float64)


def _control(vertices: FloatArray, faces: npt.NDArray[np.int64], normals: FloatArray) -> FloatArray:
    """Control points (f, 10, 3): corners, two on each of the sides 01, 12, 20, one in the middle."""
    corner, up = [vertices[faces[:, k]] for k in range(3)], [normals[faces[:, k]] for k in range(3)]
    points = list(corner)
    for k in range(3):
        j = (k + 1) % 3
        points += [_handle(corner[k], corner[j], up[k]), _handle(corner[j], corner[k], up[j])]
    middle, flat = np.mean(points[3:], axis=0), np.mean(corner, axis=0)
    return np.stack([*points, middle + 0.5 * (middle - flat)], axis=1)


def _powers(control: FloatArray) -> FloatArray:
    """Coefficients (f, 10, 3) of 1, u, v, u^2, uv, v^2, u^3, u^2 v, u v^2, v^3; u is 1 at corner 0."""
    a, b, c = (control[:, k] for k in range(3))
    ab, ba, bc, cb, ca, ac = (3.0 * control[:, k] for k in range(3, 9))
    middle = 6.0 * control[:, 9]
    one_u, one_v = ca - 3.0 * c, cb - 3.0 * c
    two_u, two_v = 3.0 * c - 2.0 * ca + ac, 3.0 * c - 2.0 * cb + bc
    both = 6.0 * c - 2.0 * ca - 2.0 * cb + middle
    three_u, three_v = a - c + ca - ac, b - c + cb - bc
    mixed_u = ab - ac + 2.0 * ca - 3.0 * c + cb - middle
    mixed_v = ba - bc + 2.0 * cb - 3.0 * c + ca - middle
    return np.stack([c, one_u, one_v, two_u, both, two_v, three_u, mixed_u, mixed_v, three_v], axis=1)


def _slopes(u: FloatArray, v: FloatArray) -> FloatArray:
    """The powers of `_powers` and their derivatives along u and v, (n, 3, 10)."""
    none, one = np.zeros_like(u), np.ones_like(u)
    uu, uv, vv = u * u, u * v, v * v
    return np.array(
        [
            *[one, u, v, uu, uv, vv, uu * u, uu * v, u * vv, vv * v],
            *[none, one, none, 2.0 * u, v, none, 3.0 * uu, 2.0 * uv, vv, none],
            *[none, none, one, none, u, 2.0 * v, none, uu, 2.0 * uv, 3.0 * vv],
        ]
    ).T.reshape(-1, 3, 10)


def _bends(u: FloatArray, v: FloatArray, p: FloatArray, q: FloatArray) -> FloatArray:
    """Second derivative (n, 10) of the powers along (p, q)."""
    none, two_u, two_v = np.zeros_like(u), 2.0 * u, 2.0 * v
    pp, pq, qq = p * p, 2.0 * p * q, q * q
    mixed = two_v * pp + two_u * pq, two_u * qq + two_v * pq
    return np.array([none, none, none, 2.0 * pp, pq, 2.0 * qq, 3.0 * two_u * pp, *mixed, 3.0 * two_v * qq]).T


@dataclass(frozen=True, eq=False)
class Patches:
    """Curved patches over a mesh; a `forms.Fit`.

    `frame` (f, 3, 3) rows: two axes in the face's plane, its normal; `powers` (f, 10, 3) metres: the
    patch in that frame, from the centre of the face; `flat` (f, 2, 3): from places to parameters.
    """

    centre: FloatArray
    powers: FloatArray
    frame: FloatArray
    flat: FloatArray
    beside: npt.NDArray[np.int64]
    along: npt.NDArray[np.int8]
    sag: float
    size: float
    complete: bool = False

    __repr__ = short_repr

    def level(
        self, point: FloatArray, direction: FloatArray, face: Array
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Height over a patch along its face normal, and parameters (n, 2) of its foot point; cf. `Level`."""
        frame, powers, flat = self.frame[face], self.powers[face], self.flat[face]
        local = np.einsum("nij,nj->ni", frame, point - self.centre[face])
        along = np.einsum("nij,nj->ni", frame, direction)
        u, v = (flat[:, k, 0] * local[:, 0] + flat[:, k, 1] * local[:, 1] + flat[:, k, 2] for k in range(2))
        for _ in range(FEET):
            place, du, dv = np.swapaxes(_slopes(u, v) @ powers, 0, 1)
            p, q = _solved(du, dv, local - place)
            u, v = u + p, v + q
        place, du, dv = np.swapaxes(_slopes(u, v) @ powers, 0, 1)
        normal = np.cross(du, dv)
        normal /= normal[:, 2:]
        second = np.einsum("ni,nij->nj", _bends(u, v, *_solved(du, dv, along)), powers)
        gradient = np.einsum("nij,ni->nj", frame, normal)
        return local[:, 2] - place[:, 2], gradient, -dot(normal, second), np.stack([u, v], axis=1)

    def _settled(
        self, origin: FloatArray, direction: FloatArray, path: FloatArray, side: FloatArray, face: Array
    ) -> FloatArray:
        """Steps `path` along the rays onto the patches of `face`, far out if need be; their parameters."""
        rows = np.arange(len(path))
        for _ in range(STEPS):
            value, gradient, bend, _ = self.level(
                origin[rows] + path[rows, None] * direction[rows], direction[rows], face[rows]
            )
            step = advance(value, dot(gradient, direction[rows]), bend, side[rows])
            path[rows] += step
            rows = rows[np.abs(step) > 4.0 * EPSILON * (np.abs(path[rows]) + self.size)]
            if len(rows) == 0:
                break
        return self.level(origin + path[:, None] * direction, direction, face)[3]

    def meet(
        self, origin: FloatArray, direction: FloatArray, path: FloatArray, side: FloatArray, face: Array
    ) -> Meeting:
        """Move hits onto the patches, across to neighbours where they leave theirs; see `Fit.meet`."""
        path, face = path.copy(), np.array(face, dtype=np.int64)
        rows = np.arange(len(path))
        with np.errstate(all="ignore"):
            for _ in range(WALKS):
                moved = path[rows]
                foot = self._settled(origin[rows], direction[rows], moved, side[rows], face[rows])
                path[rows] = moved
                weight = np.concatenate([foot, 1.0 - foot.sum(axis=1, keepdims=True)], axis=1)
                beyond = self.beside[face[rows], np.argmin(np.nan_to_num(weight), axis=1)]
                walks = (weight.min(axis=1) < -OUTSIDE) & (beyond >= 0)
                rows, beyond = rows[walks], beyond[walks]
                if len(rows) == 0:
                    break
                face[rows] = beyond
            point = origin + path[:, None] * direction
            value, gradient, _, foot = self.level(point, direction, face)
            steep = np.sqrt(dot(gradient, gradient))
            least = np.minimum(foot.min(axis=1), 1.0 - foot.sum(axis=1))
            rounding = ROUNDINGS * EPSILON * (np.abs(point).max(axis=1) + self.size)
            path[~((np.abs(value) <= rounding * steep) & (least > -1.0))] = np.nan
            point = point - value[:, None] * self.frame[face, 2]
            return Meeting(path, point, gradient / steep[:, None], face)


def _solved(du: FloatArray, dv: FloatArray, goal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Steps p, q with p du + q dv above the place `goal`, all in the frame of a face."""
    area = du[:, 0] * dv[:, 1] - du[:, 1] * dv[:, 0]
    p = (goal[:, 0] * dv[:, 1] - goal[:, 1] * dv[:, 0]) / area
    return p, (du[:, 0] * goal[:, 1] - du[:, 1] * goal[:, 0]) / area


def patched(mesh: Mesh, normals: FloatArray) -> Patches:
    """Fit curved patches to a mesh.

    Parameters
    ----------
    mesh : Mesh
    normals : (v, 3) float64, unit

    Returns
    -------
    Patches

    Raises
    ------
    ValueError
        If faces are not wound alike, or lean too far from the normals.
    """
    faces, corners, upright = mesh.faces, mesh.corners, mesh.normals
    cosine = np.einsum("ni,nki->nk", upright, normals[faces]).min(axis=1)
    if not (cosine > LEAN).all():
        raise ValueError(
            f"Smooth form: expected normals within 41 degrees of the faces', got others in "
            f"{(~(cosine > LEAN)).sum()} of {len(faces)} (face {np.argmin(cosine)}); make what lies on "
            "either side of a sharp edge a surface of its own"
        )
    centre = corners.mean(axis=1)
    first = unit(corners[:, 1] - corners[:, 0])
    frame = np.stack([first, np.cross(upright, first), upright], axis=1)
    local = np.einsum("nij,nkj->nki", frame[:, :2], corners - centre[:, None])
    # parameters are 1 at their own corner, 0 at the two others
    system = np.concatenate([local, np.ones((len(faces), 3, 1))], axis=2)
    flat = np.swapaxes(np.linalg.inv(system), 1, 2)[:, :2]
    control = _control(mesh.vertices, faces, normals) - centre[:, None]
    size = float(np.ptp(mesh.bounds, axis=0).max())
    # no patch is farther off than its control points
    sag = float(np.abs(np.einsum("nj,nkj->nk", upright, control)).max())
    along = np.ones(len(faces), dtype=np.int8)
    return Patches(
        centre,
        _powers(np.einsum("nij,nkj->nki", frame, control)),
        frame,
        flat,
        neighbours(faces),
        along,
        sag,
        size,
    )
