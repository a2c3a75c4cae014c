"""Exact surface forms behind facets: the mesh finds a hit, the form moves it onto the exact surface.

Each form fits itself to a mesh; the fit moves hits along their rays onto the form and tells the
true normal there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from fringetrace.core import (
    ROUNDED,
    FloatArray,
    checked_direction,
    checked_rotation,
    checked_vector,
    component,
    dot,
    filled,
    short_repr,
    unit,
)
from fringetrace.geometry.implicit import EPSILON, Fit, fit_level
from fringetrace.geometry.mesh import Mesh
from fringetrace.geometry.pn_triangles import patched, vertex_normals

# Past its equator by no more than this, in radii squared, a conic is at it.
EQUATOR = 4.0 * EPSILON


class Form(Protocol):
    """Protocol of exact surfaces that can be fitted to a mesh."""

    def fit(self, mesh: Mesh) -> Fit:
        """Fit of the form to a mesh."""

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Form:
        """The form rotated about the origin, then shifted; as `Mesh.moved`."""


def _positive(value: float, what: str) -> float:
    if isinstance(value, (str, bool)) or not (np.isfinite(value) and value > 0.0):
        raise ValueError(f"{what}: expected a positive length in metres, got {value!r}")
    return float(value)


def _turned(vector: FloatArray, turn: npt.ArrayLike | None) -> FloatArray:
    return vector if turn is None else np.asarray(checked_rotation(turn, "turn") @ vector, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Sphere:
    """Sphere as the exact form of a surface.

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

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checked_vector(self.centre, "Sphere centre"))
        object.__setattr__(self, "radius", _positive(self.radius, "Sphere radius"))

    def level(self, point: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Level function (rho^2 - r^2) / 2r, the distance to the surface near it; see `Level`."""
        spoke = (point - self.centre) / self.radius
        value = 0.5 * self.radius * (dot(spoke, spoke) - 1.0)
        return value, spoke, np.full(len(point), 1.0 / self.radius)

    def fit(self, mesh: Mesh) -> Fit:
        """Fit of the sphere to a mesh; see `Form`."""
        return fit_level(self, mesh, complete=True)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Sphere:
        """The sphere rotated about the origin, then shifted; as `Mesh.moved`."""
        return Sphere(_turned(self.centre, turn) + checked_vector(offset, "offset"), self.radius)


@dataclass(frozen=True, eq=False)
class Cylinder:
    """Infinite circular cylinder as the exact form of a surface.

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

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", checked_vector(self.point, "Cylinder point"))
        object.__setattr__(self, "axis", checked_direction(self.axis, "Cylinder axis"))
        object.__setattr__(self, "radius", _positive(self.radius, "Cylinder radius"))

    def level(self, point: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Level function (rho^2 - r^2) / 2r, the distance to the surface near it; see `Level`."""
        offset = point - self.point
        spoke = (offset - np.outer(component(offset, self.axis), self.axis)) / self.radius
        value = 0.5 * self.radius * (dot(spoke, spoke) - 1.0)
        return value, spoke, (1.0 - component(direction, self.axis) ** 2) / self.radius

    def fit(self, mesh: Mesh) -> Fit:
        """Fit of the cylinder to a mesh; see `Form`."""
        return fit_level(self, mesh, complete=True)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Cylinder:
        """The cylinder rotated about the origin, then shifted; as `Mesh.moved`."""
        point = _turned(self.point, turn) + checked_vector(offset, "offset")
        return Cylinder(point, _turned(self.axis, turn), self.radius)


@dataclass(frozen=True, eq=False)
class Conic:
    """Conic of revolution with even aspheric terms.

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

    __repr__ = short_repr

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

    def sag(self, square: FloatArray) -> FloatArray:
        """Sag: height of the surface over its vertex plane.

        Parameters
        ----------
        square : float64, any shape, m^2
            Distance from the axis, squared.

        Returns
        -------
        float64, same shape, metres
            NaN beyond the equator.
        """
        square, c = np.asarray(square, dtype=np.float64), 1.0 / self.radius
        under = 1.0 - (1.0 + self.conic) * c * c * square
        root = np.sqrt(np.where(under > -EQUATOR, np.maximum(under, 0.0), np.nan))
        height = c * square / (1.0 + root)
        for i, a in enumerate(self.terms):
            height = height + a * square ** (i + 2)
        return np.asarray(height, dtype=np.float64)

    def level(self, point: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Level function: height over the surface; z - (c r^2 + c (1 + k) z^2) / 2 without terms."""
        c, k = 1.0 / self.radius, self.conic
        offset = point - self.vertex
        z, dz = component(offset, self.axis), component(direction, self.axis)
        across = offset - np.outer(z, self.axis)
        aside = direction - np.outer(dz, self.axis)
        square = dot(across, across)
        if not self.terms:
            value = z - 0.5 * c * (square + (1.0 + k) * z * z)
            gradient = np.outer(1.0 - (1.0 + k) * c * z, self.axis) - c * across
            return value, gradient, -c * (dot(aside, aside) + (1.0 + k) * dz * dz)
        root = np.sqrt(1.0 - (1.0 + k) * c * c * square)
        first, second = 0.5 * c / root, 0.25 * (1.0 + k) * c**3 / root**3
        for i, a in enumerate(self.terms):
            power = i + 2
            first = first + a * power * square ** (power - 1)
            second = second + a * power * (power - 1) * square ** (power - 2)
        bend = -2.0 * first * dot(aside, aside) - 4.0 * second * dot(across, aside) ** 2
        return z - self.sag(square), self.axis - 2.0 * first[:, None] * across, bend

    def fit(self, mesh: Mesh) -> Fit:
        """Fit of the conic to a mesh; see `Form`."""
        return fit_level(self, mesh, complete=not self.terms)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Conic:
        """The conic rotated about the origin, then shifted; as `Mesh.moved`."""
        vertex = _turned(self.vertex, turn) + checked_vector(offset, "offset")
        return Conic(vertex, _turned(self.axis, turn), self.radius, self.conic, self.terms)


@dataclass(frozen=True, eq=False)
class HeightField:
    """Height field: bicubic spline over a grid of heights, placed as `shapes.height_map` places its mesh.

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

    __repr__ = short_repr

    def __post_init__(self) -> None:
        heights = filled(self.heights).copy()
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
        """Bicubic spline of the heights over (y, x)."""
        from scipy.interpolate import RectBivariateSpline

        pitch_x, pitch_y = np.broadcast_to(self.pitch, 2)
        rows, columns = self.heights.shape
        y = (np.arange(rows) - 0.5 * (rows - 1)) * pitch_y
        x = (np.arange(columns) - 0.5 * (columns - 1)) * pitch_x
        return RectBivariateSpline(y, x, self.heights)

    def level(self, point: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Level function: height over the spline; see `Level`."""
        turn = np.asarray(self.turn)
        x, y, z = (component(point - self.offset, axis) for axis in turn.T)
        dx, dy = (component(direction, axis) for axis in turn.T[:2])
        x, y = np.nan_to_num(x), np.nan_to_num(y)
        height = {
            (i, j): self.spline.ev(y, x, dx=j, dy=i) for i in range(3) for j in range(3) if i + j <= 2
        }  # by the number of derivatives along x and y
        gradient = turn[:, 2] - np.outer(height[1, 0], turn[:, 0]) - np.outer(height[0, 1], turn[:, 1])
        bend = -(height[2, 0] * dx * dx + 2.0 * height[1, 1] * dx * dy + height[0, 2] * dy * dy)
        return z - height[0, 0], gradient, bend

    def fit(self, mesh: Mesh) -> Fit:
        """Fit of the spline to a mesh; see `Form`."""
        return fit_level(self, mesh, complete=False)

    def moved(
        self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None
    ) -> HeightField:
        """The height field rotated about the origin, then shifted; as `Mesh.moved`."""
        place = _turned(self.offset, turn) + checked_vector(offset, "offset")
        own = np.asarray(self.turn)
        both = own if turn is None else checked_rotation(turn, "turn") @ own
        return HeightField(self.heights, self.pitch, place, both)


@dataclass(frozen=True, eq=False)
class Smooth:
    """Smooth form of any mesh: a curved PN triangle over each face, from vertex normals.

    Hits are off the part that was meant by the fourth power of the length of the facets' sides where
    the normals are right, the third at worst; facets themselves, by the second.

    Parameters
    ----------
    normals : (v, 3), optional
        Normals at the vertices, to the front; None: from the faces around each vertex.

    Raises
    ------
    ValueError
        If normals are not rows of three finite numbers; at a `Surface`, if there is not one for each
        vertex, faces are not wound alike, or the mesh has sharp edges.
    """

    normals: FloatArray | None = None

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if self.normals is None:
            return
        normals = filled(self.normals).copy()
        if (
            normals.ndim != 2
            or normals.shape[1] != 3
            or not (np.isfinite(normals).all() and normals.any(1).all())
        ):
            raise ValueError(
                f"Smooth normals: expected directions of shape (v, 3), got shape {normals.shape}"
            )
        with np.errstate(over="ignore", under="ignore"):
            rough = np.abs(np.linalg.norm(normals, axis=1) - 1.0) > ROUNDED
        normals[rough] = unit(normals[rough])
        object.__setattr__(self, "normals", normals)

    def fit(self, mesh: Mesh) -> Fit:
        """Curved patches fitted to a mesh; see `Form`."""
        normals = vertex_normals(mesh.vertices, mesh.faces) if self.normals is None else self.normals
        if len(normals) != len(mesh.vertices):
            raise ValueError(
                f"Smooth normals: expected {len(mesh.vertices)}, one for each vertex, got {len(normals)}"
            )
        return patched(mesh, normals)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Form:
        """The normals rotated; as `Mesh.moved`."""
        if self.normals is None or turn is None:
            return self
        return Smooth(np.asarray(self.normals @ checked_rotation(turn, "turn").T))
