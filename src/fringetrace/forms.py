"""The exact surface behind the facets: the mesh finds a hit, the form decides where it is.

A form is the set of points where a smooth function, its level, is 0. Each fits itself to a mesh;
the fit moves hits along their rays onto the form and tells the true normal there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from fringetrace.vectors import checked_direction, checked_rotation, checked_vector, unit
from fringetrace.waves import Array, FloatArray

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
    """Where rays meet a form, one row each; NaN where they do not.

    `path` (n,) and `point` (n, 3) in metres, `normal` (n, 3) along the gradient, `face` (n,).
    """

    path: FloatArray
    point: FloatArray
    normal: FloatArray
    face: npt.NDArray[np.int64]


class Fit(Protocol):
    """A form that knows its mesh.

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
        """Move hits onto the form, along their rays.

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


class Form(Protocol):
    """Anything that can be fitted to a mesh."""

    def fit(self, vertices: FloatArray, faces: npt.NDArray[np.int64]) -> Fit:
        """Get to know the mesh, (v, 3) metres and (f, 3)."""

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Form:
        """The form turned about the origin, then shifted; as `Mesh.moved`."""


class Level(Protocol):
    """A form given by a function of the point."""

    def level(self, point: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The function (n,), its gradient (n, 3), and its second derivative along the directions (n,)."""


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ij,ij->i", a, b), dtype=np.float64)


def _along(a: FloatArray, axis: FloatArray) -> FloatArray:
    # not a matrix product: its last bits depend on how many rows there are
    return np.asarray(np.einsum("ij,j->i", a, axis), dtype=np.float64)


def _advance(value: FloatArray, slope: FloatArray, bend: FloatArray, side: FloatArray) -> FloatArray:
    """Way to the root of value + slope s + bend s^2 / 2 at which the slope has the sign of `side`.

    Where there is none: to the extremum.
    """
    root = side * np.sqrt(np.maximum(slope * slope - 2.0 * value * bend, 0.0))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        near = np.where(value == 0.0, 0.0, -2.0 * value / (slope + root))
        return np.where(side * slope >= 0.0, near, (root - slope) / bend)


@dataclass(frozen=True, eq=False)
class LevelFit:
    """A level function fitted to a mesh; fields as in `Fit`, and the size of the mesh in metres."""

    form: Level
    along: npt.NDArray[np.int8]
    sag: float
    complete: bool
    size: float

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
                step = _advance(value, _dot(gradient, along), bend, side[rows])
                path[rows] += step
                # each ray for itself: what others do must not matter
                rows = rows[np.abs(step) > 4.0 * EPSILON * np.abs(path[rows])]
                if len(rows) == 0:
                    break
            point = origin + path[:, None] * direction
            value, gradient, _ = self.form.level(point, direction)
            square = _dot(gradient, gradient)
            rounding = ROUNDINGS * EPSILON * (np.abs(point).max(axis=1) + self.size)
            missed = ~(np.abs(value) <= rounding * np.sqrt(square))
            path[missed] = np.nan
            point = point - (value / square)[:, None] * gradient
            return Meeting(path, point, gradient / np.sqrt(square)[:, None], np.asarray(face))


def _level_fit(form: Level, vertices: FloatArray, faces: npt.NDArray[np.int64], complete: bool) -> LevelFit:
    corners = vertices[faces]
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = unit(normal)
    samples = [corners[:, 0], corners[:, 1], corners[:, 2], corners.mean(axis=1)]
    samples += [0.5 * (corners[:, k] + corners[:, k - 1]) for k in range(3)]
    off, cosine = [], np.zeros(len(faces))
    with np.errstate(all="ignore"):
        for k, sample in enumerate(samples):
            value, gradient, _ = form.level(sample, normal)
            steep = np.sqrt(_dot(gradient, gradient))
            off.append(np.abs(value) / steep)
            if k == 3:
                cosine = _dot(normal, gradient) / steep
        on = (np.max(off[:3], axis=0) <= NEAR * size) & (np.abs(cosine) >= ALONG)
    along = np.where(on, np.sign(cosine), 0.0).astype(np.int8)
    if not along.any():
        raise ValueError(
            f"{type(form).__name__} form: expected faces that lie along it within {NEAR:g} of the mesh's "
            f"size, got none among {len(faces)}"
        )
    return LevelFit(form, along, float(np.max(np.stack(off)[:, along != 0])), complete, size)


def _positive(value: float, what: str) -> float:
    if isinstance(value, (str, bool)) or not (np.isfinite(value) and value > 0.0):
        raise ValueError(f"{what}: expected a positive length in metres, got {value!r}")
    return float(value)


def _turned(vector: FloatArray, turn: npt.ArrayLike | None) -> FloatArray:
    return vector if turn is None else np.asarray(checked_rotation(turn, "turn") @ vector, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Sphere:
    """A sphere.

    Parameters
    ----------
    centre : (3,) metres
    radius : float, metres

    Raises
    ------
    ValueError
        If the radius is not a positive length.
    """

    centre: FloatArray
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checked_vector(self.centre, "Sphere centre"))
        object.__setattr__(self, "radius", _positive(self.radius, "Sphere radius"))

    def level(self, point: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(rho^2 - r^2) / 2r, the distance from the surface near it; see `Level`."""
        spoke = (point - self.centre) / self.radius
        value = 0.5 * self.radius * (_dot(spoke, spoke) - 1.0)
        return value, spoke, np.full(len(point), 1.0 / self.radius)

    def fit(self, vertices: FloatArray, faces: npt.NDArray[np.int64]) -> Fit:
        """The sphere on a mesh; see `Form`."""
        return _level_fit(self, vertices, faces, complete=True)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Sphere:
        """The sphere turned about the origin, then shifted; as `Mesh.moved`."""
        return Sphere(_turned(self.centre, turn) + checked_vector(offset, "offset"), self.radius)


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A circular cylinder without ends.

    Parameters
    ----------
    point : (3,) metres
        Any point of the axis.
    axis : (3,)
    radius : float, metres

    Raises
    ------
    ValueError
        If the axis has no length, or the radius is not a positive length.
    """

    point: FloatArray
    axis: FloatArray
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", checked_vector(self.point, "Cylinder point"))
        object.__setattr__(self, "axis", checked_direction(self.axis, "Cylinder axis"))
        object.__setattr__(self, "radius", _positive(self.radius, "Cylinder radius"))

    def level(self, point: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(rho^2 - r^2) / 2r, the distance from the surface near it; see `Level`."""
        offset = point - self.point
        spoke = (offset - np.outer(_along(offset, self.axis), self.axis)) / self.radius
        value = 0.5 * self.radius * (_dot(spoke, spoke) - 1.0)
        return value, spoke, (1.0 - _along(direction, self.axis) ** 2) / self.radius

    def fit(self, vertices: FloatArray, faces: npt.NDArray[np.int64]) -> Fit:
        """The cylinder on a mesh; see `Form`."""
        return _level_fit(self, vertices, faces, complete=True)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Cylinder:
        """The cylinder turned about the origin, then shifted; as `Mesh.moved`."""
        point = _turned(self.point, turn) + checked_vector(offset, "offset")
        return Cylinder(point, _turned(self.axis, turn), self.radius)


@dataclass(frozen=True, eq=False)
class Conic:
    """A conic of revolution, with aspheric terms.

    Height over the vertex plane at a distance r from the axis:
    z = c r^2 / (1 + sqrt(1 - (1 + k) c^2 r^2)) + a_0 r^4 + a_1 r^6 + ..., c = 1 / radius.

    Parameters
    ----------
    vertex : (3,) metres
    axis : (3,)
        Direction of positive heights.
    radius : float, metres
        Of curvature at the vertex; positive if the surface bends towards the axis' direction,
        infinite for a plane.
    conic : float
        k = -eccentricity^2: 0 sphere, -1 parabola, below -1 hyperbola, above -1 ellipse.
    terms : (a_0, a_1, ...), m^-3, m^-5, ...

    Raises
    ------
    ValueError
        For an axis without length, a radius of 0, numbers that are not finite.
    """

    vertex: FloatArray
    axis: FloatArray
    radius: float
    conic: float = 0.0
    terms: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertex", checked_vector(self.vertex, "Conic vertex"))
        object.__setattr__(self, "axis", checked_direction(self.axis, "Conic axis"))
        if np.isnan(self.radius) or self.radius == 0.0:
            raise ValueError(f"Conic radius: expected a length in metres other than 0, got {self.radius!r}")
        object.__setattr__(self, "terms", tuple(float(a) for a in self.terms))
        if not np.isfinite([self.conic, *self.terms]).all():
            raise ValueError(
                f"Conic: expected a finite conic constant and terms, got {self.conic!r} and {self.terms!r}"
            )

    def level(self, point: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Height above the surface; z - (c r^2 + c (1 + k) z^2) / 2 without terms. See `Level`."""
        c, k = 1.0 / self.radius, self.conic
        offset = point - self.vertex
        z, dz = _along(offset, self.axis), _along(direction, self.axis)
        across = offset - np.outer(z, self.axis)
        aside = direction - np.outer(dz, self.axis)
        square = _dot(across, across)
        if not self.terms:
            value = z - 0.5 * c * (square + (1.0 + k) * z * z)
            gradient = np.outer(1.0 - (1.0 + k) * c * z, self.axis) - c * across
            return value, gradient, -c * (_dot(aside, aside) + (1.0 + k) * dz * dz)
        root = np.sqrt(1.0 - (1.0 + k) * c * c * square)
        sag, first, second = c * square / (1.0 + root), 0.5 * c / root, 0.25 * (1.0 + k) * c**3 / root**3
        for i, a in enumerate(self.terms):
            power = i + 2
            sag = sag + a * square**power
            first = first + a * power * square ** (power - 1)
            second = second + a * power * (power - 1) * square ** (power - 2)
        bend = -2.0 * first * _dot(aside, aside) - 4.0 * second * _dot(across, aside) ** 2
        return z - sag, self.axis - 2.0 * first[:, None] * across, bend

    def fit(self, vertices: FloatArray, faces: npt.NDArray[np.int64]) -> Fit:
        """The conic on a mesh; see `Form`."""
        return _level_fit(self, vertices, faces, complete=not self.terms)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Conic:
        """The conic turned about the origin, then shifted; as `Mesh.moved`."""
        vertex = _turned(self.vertex, turn) + checked_vector(offset, "offset")
        return Conic(vertex, _turned(self.axis, turn), self.radius, self.conic, self.terms)


@dataclass(frozen=True, eq=False)
class HeightField:
    """Heights on a grid, with a bicubic spline between them; lies as the mesh of `shapes.height_map`.

    Parameters
    ----------
    heights : (rows, columns) float64, metres
        4 x 4 or more; rows along y, columns along x, centred on the z axis.
    pitch : float, or (along x, along y), metres
    offset : (3,) metres
    turn : (3, 3), optional
        Rotation applied before the offset, as in `Mesh.moved`.

    Raises
    ------
    ValueError
        For fewer than 4 x 4 heights, or some that are not finite; for a pitch that is not positive.
    """

    heights: FloatArray
    pitch: float | tuple[float, float]
    offset: FloatArray = (0.0, 0.0, 0.0)  # type: ignore[assignment]
    turn: FloatArray | None = None

    def __post_init__(self) -> None:
        heights = np.array(self.heights, dtype=np.float64)
        if heights.ndim != 2 or min(heights.shape) < 4 or not np.isfinite(heights).all():
            raise ValueError(
                f"HeightField heights: expected 4 x 4 finite numbers or more, got shape {heights.shape}"
            )
        both = self.pitch if isinstance(self.pitch, tuple) else (self.pitch, self.pitch)
        pitch = tuple(_positive(value, "HeightField pitch") for value in both)
        turn = np.eye(3) if self.turn is None else checked_rotation(self.turn, "HeightField turn")
        object.__setattr__(self, "heights", heights)
        object.__setattr__(self, "pitch", pitch)
        object.__setattr__(self, "turn", turn)
        object.__setattr__(self, "offset", checked_vector(self.offset, "HeightField offset"))

    @cached_property
    def spline(self) -> Any:
        """The spline, of y and x."""
        from scipy.interpolate import RectBivariateSpline

        pitch_x, pitch_y = np.broadcast_to(self.pitch, 2)
        rows, columns = self.heights.shape
        y = (np.arange(rows) - 0.5 * (rows - 1)) * pitch_y
        x = (np.arange(columns) - 0.5 * (columns - 1)) * pitch_x
        return RectBivariateSpline(y, x, self.heights)

    def level(self, point: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Height above the spline; see `Level`."""
        turn = np.asarray(self.turn)
        x, y, z = (_along(point - self.offset, axis) for axis in turn.T)
        dx, dy = (_along(direction, axis) for axis in turn.T[:2])
        x, y = np.nan_to_num(x), np.nan_to_num(y)
        height = {
            (i, j): self.spline.ev(y, x, dx=j, dy=i) for i in range(3) for j in range(3) if i + j <= 2
        }  # by the number of derivatives along x and y
        gradient = turn[:, 2] - np.outer(height[1, 0], turn[:, 0]) - np.outer(height[0, 1], turn[:, 1])
        bend = -(height[2, 0] * dx * dx + 2.0 * height[1, 1] * dx * dy + height[0, 2] * dy * dy)
        return z - height[0, 0], gradient, bend

    def fit(self, vertices: FloatArray, faces: npt.NDArray[np.int64]) -> Fit:
        """The spline on a mesh; see `Form`."""
        return _level_fit(self, vertices, faces, complete=False)

    def moved(
        self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None
    ) -> HeightField:
        """The height field turned about the origin, then shifted; as `Mesh.moved`."""
        place = _turned(self.offset, turn) + checked_vector(offset, "offset")
        own = np.asarray(self.turn)
        both = own if turn is None else checked_rotation(turn, "turn") @ own
        return HeightField(self.heights, self.pitch, place, both)
