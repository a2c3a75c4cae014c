"""Curved patches through the vertices of a mesh and across to their normals: a smooth form for any mesh.

Over each face stands a cubic Bezier triangle whose rim depends only on the two vertices and normals
at its ends, so that neighbours meet along it. Source: Vlachos et al., "Curved PN triangles" (2001),
with handles as long as those of a circle's arc.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.crossings import EPSILON, ROUNDINGS, STEPS, Meeting, advance, dot
from fringetrace.vectors import unit
from fringetrace.waves import Array, FloatArray

# Vertex normals may lean this far (cosine) from a face's: beyond, the mesh has an edge there.
LEAN = 0.75
# A parameter this far outside its patch is a rounding.
OUTSIDE = 1e-12
# A ray slides over so many patches in search of the one that it meets.
WALKS = 16
# Newton steps from a point to the foot of its height on a patch.
FEET = 8


def vertex_normals(vertices: FloatArray, faces: npt.NDArray[np.int64]) -> FloatArray:
    """Normals at the vertices, exact where the vertices lie on a sphere.

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
    """Faces (f, 3) across the side opposite to each corner, -1 where the mesh ends.

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


# Powers of the three barycentric coordinates in a cubic, and how often each stands.
POWERS = np.array(
    [
        (3, 0, 0),
        (0, 3, 0),
        (0, 0, 3),
        (2, 1, 0),
        (1, 2, 0),
        (0, 2, 1),
        (0, 1, 2),
        (1, 0, 2),
        (2, 0, 1),
        (1, 1, 1),
    ]
)
TIMES = np.array([1.0, 1.0, 1.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 6.0])


def _control(vertices: FloatArray, faces: npt.NDArray[np.int64], normals: FloatArray) -> FloatArray:
    """Control points (f, 10, 3) in the order of `POWERS`."""
    corner, up = [vertices[faces[:, k]] for k in range(3)], [normals[faces[:, k]] for k in range(3)]
    points = list(corner)
    for k in range(3):
        j = (k + 1) % 3
        points += [_handle(corner[k], corner[j], up[k]), _handle(corner[j], corner[k], up[j])]
    middle, flat = np.mean(points[3:], axis=0), np.mean(corner, axis=0)
    return np.stack([*points, middle + 0.5 * (middle - flat)], axis=1)


def _weights(u: FloatArray, v: FloatArray, along_u: int, along_v: int) -> FloatArray:
    """Weights (n, 10) of the control points, differentiated so many times along u and v (w = 1 - u - v)."""
    w = 1.0 - u - v
    terms = [(TIMES, POWERS)]
    for axis in [0] * along_u + [1] * along_v:
        # d/du = d/da - d/dc
        new = []
        for factor, power in terms:
            for which, sign in ((axis, 1.0), (2, -1.0)):
                lower = power.copy()
                lower[:, which] -= 1
                new.append((sign * factor * power[:, which], np.maximum(lower, 0)))
        terms = new
    powers = [np.stack([np.ones_like(x), x, x * x, x * x * x], axis=1) for x in (u, v, w)]
    total = np.zeros((len(u), 10))
    for factor, power in terms:
        total += factor * powers[0][:, power[:, 0]] * powers[1][:, power[:, 1]] * powers[2][:, power[:, 2]]
    return total


@dataclass(frozen=True, eq=False)
class Patches:
    """Curved patches of a mesh; a `forms.Fit`.

    `control` (f, 10, 3) metres from the centre of each face, `frame` (f, 3, 3) rows: two axes in the
    face's plane, its normal; `flat` (f, 3, 2): from places in that plane to parameters.
    """

    centre: FloatArray
    control: FloatArray
    frame: FloatArray
    flat: FloatArray
    beside: npt.NDArray[np.int64]
    along: npt.NDArray[np.int8]
    sag: float
    size: float
    complete: bool = False

    def _surface(self, face: Array, u: FloatArray, v: FloatArray, along_u: int, along_v: int) -> FloatArray:
        weights = _weights(u, v, along_u, along_v)
        return np.asarray(np.einsum("ni,nij->nj", weights, self.control[face]), dtype=np.float64)

    def level(
        self, point: FloatArray, direction: FloatArray, face: Array
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Height over a patch along its face's normal, and the parameters (n, 2) of its foot; cf. `Level`."""
        frame = self.frame[face]
        local = point - self.centre[face]
        place = np.einsum("nij,nj->ni", frame[:, :2], local)
        u, v = (
            np.einsum("ni,ni->n", self.flat[face, k, :2], place) + self.flat[face, k, 2] for k in range(2)
        )
        for step in range(FEET + 1):
            du, dv = self._surface(face, u, v, 1, 0), self._surface(face, u, v, 0, 1)
            if step == FEET:
                break
            miss = place - np.einsum("nij,nj->ni", frame[:, :2], self._surface(face, u, v, 0, 0))
            u, v = (x + y for x, y in zip((u, v), _solved(frame, du, dv, miss), strict=True))
        normal = unit(np.cross(du, dv))
        upright = dot(normal, frame[:, 2])
        value = dot(frame[:, 2], local - self._surface(face, u, v, 0, 0))
        p, q = _solved(frame, du, dv, np.einsum("nij,nj->ni", frame[:, :2], direction))
        second = (p * p)[:, None] * self._surface(face, u, v, 2, 0)
        second += (2.0 * p * q)[:, None] * self._surface(face, u, v, 1, 1)
        second += (q * q)[:, None] * self._surface(face, u, v, 0, 2)
        bend = -dot(normal, second) / upright
        return value, normal / upright[:, None], bend, np.stack([u, v], axis=1)

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
            rows = rows[np.abs(step) > 4.0 * EPSILON * np.abs(path[rows])]
            if len(rows) == 0:
                break
        return self.level(origin + path[:, None] * direction, direction, face)[3]

    def meet(
        self, origin: FloatArray, direction: FloatArray, path: FloatArray, side: FloatArray, face: Array
    ) -> Meeting:
        """Move hits onto the patches, over to their neighbours where they slide off; see `Fit.meet`."""
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


def _solved(
    frame: FloatArray, du: FloatArray, dv: FloatArray, goal: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Steps p, q with p du + q dv above the place `goal` (n, 2) of the face's plane."""
    a, b = np.einsum("nij,nj->ni", frame[:, :2], du), np.einsum("nij,nj->ni", frame[:, :2], dv)
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    p = (goal[:, 0] * b[:, 1] - goal[:, 1] * b[:, 0]) / area
    q = (a[:, 0] * goal[:, 1] - a[:, 1] * goal[:, 0]) / area
    return p, q


def patched(vertices: FloatArray, faces: npt.NDArray[np.int64], normals: FloatArray) -> Patches:
    """Curved patches over a mesh.

    Parameters
    ----------
    vertices : (v, 3) float64, metres
    faces : (f, 3) int64
    normals : (v, 3) float64, unit

    Returns
    -------
    Patches

    Raises
    ------
    ValueError
        If faces are not wound alike, or lean too far from the normals.
    """
    corners = vertices[faces]
    sides = [corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]]
    upright = unit(np.cross(sides[0], sides[1]))
    cosine = np.einsum("ni,nki->nk", upright, normals[faces]).min(axis=1)
    if not (cosine > LEAN).all():
        raise ValueError(
            f"Smooth form: expected normals within 41 degrees of the faces', got others in "
            f"{(~(cosine > LEAN)).sum()} of {len(faces)} (face {np.argmin(cosine)}); make what lies on "
            "either side of a sharp edge a surface of its own"
        )
    centre = corners.mean(axis=1)
    first = unit(sides[0])
    frame = np.stack([first, np.cross(upright, first), upright], axis=1)
    local = np.einsum("nij,nkj->nki", frame[:, :2], corners - centre[:, None])
    # parameters are 1 at their own corner, 0 at the two others
    system = np.concatenate([local, np.ones((len(faces), 3, 1))], axis=2)
    flat = np.swapaxes(np.linalg.inv(system), 1, 2)[:, :2]
    control = _control(vertices, faces, normals) - centre[:, None]
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    # no patch is farther off than its control points
    sag = float(np.abs(np.einsum("nj,nkj->nk", upright, control)).max())
    along = np.ones(len(faces), dtype=np.int8)
    return Patches(centre, control, frame, flat, neighbours(faces), along, sag, size)
