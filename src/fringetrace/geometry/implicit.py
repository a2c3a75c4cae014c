"""Implicit surfaces: intersection of rays with the zero level of a function, by Newton steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray, dot, short_repr
from fringetrace.geometry.mesh import Mesh

EPSILON = float(np.finfo(np.float64).eps)
# Vertices this part of the mesh's size off the form are not meant to lie on it.
NEAR = 0.05
# Faces whose normal is more than 60 degrees from the form's are not meant for it: end caps of a rod.
ALONG = 0.5
# Steps along the ray. One is exact on a quadric, the others polish; elsewhere each cubes the error.
STEPS = 12
# A hit is on the form if it is within this many roundings of the coordinates.
ROUNDINGS = 256.0


@dataclass(frozen=True, eq=False)
class Meeting:
    """Intersections of rays with a form, one row each; NaN where a ray misses.

    `path` (n,) and `point` (n, 3) in metres, `normal` (n, 3) along the gradient, `face` (n,).
    """

    path: FloatArray
    point: FloatArray
    normal: FloatArray
    face: npt.NDArray[np.int64]

    __repr__ = short_repr


class Fit(Protocol):
    """Protocol of forms that are fitted to a mesh.

    `along` (f,) tells for each face whether its front is on the side that the gradient points to (1)
    or not (-1); 0: the face is not part of the form. `sag` is the largest distance in metres of the
    faces from the form. `complete`: `meet` finds its way to the form from any point of a ray.
    """

    @property
    def along(self) -> npt.NDArray[np.int8]: ...  # noqa: D102

    @property
    def sag(self) -> float: ...  # noqa: D102

    @property
    def complete(self) -> bool: ...  # noqa: D102

    def meet(
        self, origin: FloatArray, direction: FloatArray, path: FloatArray, side: FloatArray, face: Array
    ) -> Meeting:
        """Move hits along their rays onto the form.

        Parameters
        ----------
        origin, direction : (n, 3) float64, metres, unit
        path : (n,) float64, metres
            A guess, such as that of the hit on a face.
        side : (n,) float64
            1 for the crossing where the ray goes along the gradient, -1 for the one against it.
        face : (n,) int64
            The faces met; -1 where not known.

        Returns
        -------
        Meeting
        """


class Level(Protocol):
    """Protocol of forms given by a level function of the point."""

    def level(self, point: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Level function (n,), its gradient (n, 3), and its second derivative along directions (n,)."""


def advance(value: FloatArray, slope: FloatArray, bend: FloatArray, side: FloatArray) -> FloatArray:
    """Root of value + slope s + bend s^2 / 2 at which the slope has the sign of `side`.

    Where there is none: to the extremum.
    """
    root = side * np.sqrt(np.maximum(slope * slope - 2.0 * value * bend, 0.0))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        near = np.where(value == 0.0, 0.0, -2.0 * value / (slope + root))
        return np.where(side * slope >= 0.0, near, (root - slope) / bend)


@dataclass(frozen=True, eq=False)
class LevelFit:
    """Level function fitted to a mesh; fields as in `Fit`, and the size of the mesh in metres."""

    form: Level
    along: npt.NDArray[np.int8]
    sag: float
    complete: bool
    size: float

    __repr__ = short_repr

    def guess(self, origin: FloatArray, direction: FloatArray, side: FloatArray) -> FloatArray:
        """Distance (n,) in metres along rays to a quadric, one step from `origin`; NaN if there is none."""
        with np.errstate(all="ignore"):
            value, gradient, bend = self.form.level(origin, direction)
            return advance(value, dot(gradient, direction), bend, side)

    def meet(
        self, origin: FloatArray, direction: FloatArray, path: FloatArray, side: FloatArray, face: Array
    ) -> Meeting:
        """Move hits onto the form; see `Fit.meet`."""
        path = path.copy()
        rows = np.arange(len(path))
        with np.errstate(all="ignore"):
            for _ in range(STEPS):
                along = direction[rows]
                value, gradient, bend = self.form.level(origin[rows] + path[rows, None] * along, along)
                step = advance(value, dot(gradient, along), bend, side[rows])
                path[rows] += step
                # each ray for itself: what others do must not matter
                rows = rows[np.abs(step) > 4.0 * EPSILON * (np.abs(path[rows]) + self.size)]
                if len(rows) == 0:
                    break
            point = origin + path[:, None] * direction
            value, gradient, _ = self.form.level(point, direction)
            square = dot(gradient, gradient)
            rounding = ROUNDINGS * EPSILON * (np.abs(point).max(axis=1) + self.size)
            missed = ~(np.abs(value) <= rounding * np.sqrt(square))
            path[missed] = np.nan
            point = point - (value / square)[:, None] * gradient
            return Meeting(path, point, gradient / np.sqrt(square)[:, None], np.asarray(face))


def fit_level(form: Level, mesh: Mesh, complete: bool) -> LevelFit:
    """Fit of a form to a mesh: which faces lie on the form.

    Parameters
    ----------
    form : Level
    mesh : Mesh
    complete : bool
        Whether the level is a quadratic function.

    Returns
    -------
    LevelFit

    Raises
    ------
    ValueError
        If none does.
    """
    corners, size, normal = mesh.corners, float(np.ptp(mesh.bounds, axis=0).max()), mesh.normals
    samples = [corners[:, 0], corners[:, 1], corners[:, 2], corners.mean(axis=1)]
    samples += [0.5 * (corners[:, k] + corners[:, k - 1]) for k in range(3)]
    off, cosine = [], np.zeros(len(corners))
    with np.errstate(all="ignore"):
        for k, sample in enumerate(samples):
            value, gradient, _ = form.level(sample, normal)
            steep = np.sqrt(dot(gradient, gradient))
            off.append(np.abs(value) / steep)
            if k == 3:
                cosine = dot(normal, gradient) / steep
        on = (np.max(off[:3], axis=0) <= NEAR * size) & (np.abs(cosine) >= ALONG)
    along = np.where(on, np.sign(cosine), 0.0).astype(np.int8)
    along[along == -np.sign((mesh.areas * along).sum())] = 0  # the other side of a lens, not of this form
    if not along.any():
        raise ValueError(
            f"{type(form).__name__} form: expected faces that lie along it within {NEAR:g} of the mesh's "
            f"size, got none among {len(corners)}"
        )
    return LevelFit(form, along, float(np.max(np.stack(off)[:, along != 0])), complete, size)
