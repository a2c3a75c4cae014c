"""Thin optical elements: flat, without thickness; their protocol, ideal lens and annular stop.

A field here is the square root of a ray's power, so that an element is lossless where it keeps
|field|^2; how a bundle's cross section changes is in its rays. Fields go as exp(-i w t).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from typing import ClassVar, Literal, Protocol

import numpy as np
import numpy.typing as npt

from fringetrace.core import (
    Array,
    ComplexArray,
    FloatArray,
    checked_direction,
    checked_rotation,
    checked_vector,
    component,
    dot,
    short_repr,
)

# An axis nearer to a ray than its own rounding has no direction across it.
PARALLEL = 8.0 * float(np.finfo(np.float64).eps)

RealIndex = float | Callable[[float], float]
InterfaceKind = Literal["constant", "boundary", "element"]
Waves = Literal["plane", "curved", "torn"]


@dataclass(frozen=True, eq=False)
class IncidentRays:
    """Rays that hit an element, one row each.

    Parameters
    ----------
    point : (n, 3) float64, metres
        On the surface.
    direction : (n, 3) float64, unit
        Of arrival.
    normal : (n, 3) float64, unit
        Of the surface, on its front side.
    index : (n,) float64
        Real refractive index of the medium, the same on both sides.
    field : (n,) or (n, 3) complex128
        One number a ray, or its transverse vector; |field|^2 is the power.
    wavelength : float or None, metres
        In vacuum; asked for by chromatic elements only.
    """

    point: FloatArray
    direction: FloatArray
    normal: FloatArray
    index: FloatArray
    field: ComplexArray
    wavelength: float | None = None

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class Branch:
    """Branch in which rays leave an element; None: unchanged.

    Parameters
    ----------
    field : (n,) or (n, 3) complex128
        As that which arrived; 0 where blocked.
    direction : (n, 3) float64, unit, or None
    point : (n, 3) float64, metres, or None
        Shifted within the surface's plane.
    path : (n,) float64, metres, or None
        Optical path to add.
    """

    field: ComplexArray
    direction: FloatArray | None = None
    point: FloatArray | None = None
    path: FloatArray | None = None

    __repr__ = short_repr


class Element(Protocol):
    """Protocol of thin elements that send rays on in a fixed number of branches.

    `polarised`: it asks for vector fields. `chromatic`: it asks for the wavelength. `waves`: plane waves
    leave it plane, curved, or torn (neighbouring rays may fare differently).
    """

    @property
    def kind(self) -> InterfaceKind:
        """What a surface asks of it: "element"."""

    @property
    def waves(self) -> Waves:
        """Effect on plane waves: they stay plane, get curved, or are torn."""

    @property
    def branches(self) -> int:
        """Number of branches, the same for all rays."""

    @property
    def polarised(self) -> bool:
        """Whether the element needs fields as vectors."""

    @property
    def chromatic(self) -> bool:
        """Whether the branches depend on the wavelength."""

    def act(self, meeting: IncidentRays) -> tuple[Branch, ...]:
        """Branches of the rays, one row per ray."""

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Element:
        """The element rotated about the origin, then shifted; as `Mesh.moved`."""


def positive_length(value: float, what: str) -> float:
    """Checked positive length in metres; else ValueError."""
    if isinstance(value, bool) or not (isinstance(value, Real) and np.isfinite(value) and value > 0.0):
        raise ValueError(f"{what}: expected a positive length in metres, got {value!r}")
    return float(value)


def checked_number(value: float, what: str) -> float:
    """Checked finite real number; else ValueError."""
    if isinstance(value, bool) or not (isinstance(value, Real) and np.isfinite(value)):
        raise ValueError(f"{what}: expected a finite number, got {value!r}")
    return float(value)


def checked_index(value: RealIndex, what: str) -> RealIndex:
    """Checked refractive index, or function of the wavelength that gives it; else ValueError."""
    if callable(value):
        return value
    if isinstance(value, bool) or not (isinstance(value, Real) and np.isfinite(value) and value > 0.0):
        raise ValueError(f"{what}: expected a positive index or a function of the wavelength, got {value!r}")
    return float(value)


def index_at(index: RealIndex, wavelength: float | None, what: str) -> float:
    """Real refractive index at a wavelength (metres)."""
    return float(np.real(index(required_wavelength(wavelength, what)))) if callable(index) else index


def required_wavelength(wavelength: float | None, what: str) -> float:
    """Wavelength of rays in metres; ValueError if it is missing."""
    if wavelength is None:
        raise ValueError(f"{what}: expected a wavelength, which it depends on, got None")
    return wavelength


def vectors_of(meeting: IncidentRays, what: str) -> ComplexArray:
    """Field vectors of rays, (n, 3) complex128; ValueError if the light is scalar."""
    if meeting.field.ndim != 2:
        raise ValueError(f"{what}: expected polarised light, fields (n, 3), got shape {meeting.field.shape}")
    return meeting.field


def move_point(point: FloatArray, offset: npt.ArrayLike, turn: npt.ArrayLike | None) -> FloatArray:
    """Point (3,) rotated about the origin, then shifted."""
    return rotate_vector(point, turn) + checked_vector(offset, "offset")


def rotate_vector(vector: FloatArray, turn: npt.ArrayLike | None) -> FloatArray:
    """Vector (3,) rotated about the origin."""
    return vector if turn is None else np.asarray(checked_rotation(turn, "turn") @ vector, dtype=np.float64)


def scaled(rows: Array, factor: Array) -> Array:
    """Rows, (n,) or (n, 3), multiplied by one number each."""
    return np.asarray(rows * (factor if rows.ndim == 1 else factor[:, None]))


def tangential(vectors: FloatArray, normal: FloatArray) -> FloatArray:
    """Tangential part of vectors: without their component along unit normals, (n, 3)."""
    return np.asarray(vectors - scaled(normal, dot(vectors, normal)))


def transverse_axis(axis: FloatArray, direction: FloatArray) -> FloatArray:
    """Projection of an axis perpendicular to rays, scaled to unit length.

    Parameters
    ----------
    axis : (3,) or (n, 3) float64, unit
    direction : (n, 3) float64, unit

    Returns
    -------
    (n, 3) float64
        Unit, or 0 where the axis is along the ray.
    """
    # twice: what rounding leaves along a ray close to the axis
    part = tangential(tangential(np.broadcast_to(axis, direction.shape), direction), direction)
    size = np.sqrt(dot(part, part))
    seen = size > PARALLEL
    return np.where(seen[:, None], part / np.where(seen, size, 1.0)[:, None], 0.0)


def tangential_axis(axis: FloatArray, normal: FloatArray, what: str) -> FloatArray:
    """Projection of an axis into surfaces, (n, 3) unit; ValueError if it is normal to one of them."""
    lie = transverse_axis(axis, normal)
    if not lie.any(axis=1).all():
        raise ValueError(f"{what}: expected a direction along the surface, got its normal {axis.tolist()}")
    return lie


def rotate_fields(field: ComplexArray, before: FloatArray, after: FloatArray) -> ComplexArray:
    """Field vectors of deflected rays, rotated by the least rotation between the directions.

    Parameters
    ----------
    field : (n,) or (n, 3) complex128
        Vectors are across `before`.
    before, after : (n, 3) float64, unit
        Nowhere opposite to each other.

    Returns
    -------
    (n,) or (n, 3) complex128
        Of the same power, across `after`. What is across both directions stays as it is.
    """
    if field.ndim == 1:
        return field
    share = dot(field, after) / (1.0 + dot(before, after))
    return np.asarray(field - scaled(before + after, share))


def deflect(meeting: IncidentRays, gradient: FloatArray, back: bool) -> tuple[FloatArray, FloatArray]:
    """Directions behind a path gradient along the surface: tangential n d grows by the gradient.

    Parameters
    ----------
    meeting : Meeting
    gradient : (n, 3) float64
        Of the added path along the surface, metres per metre; what is along the normal is left out.
    back : bool
        Whether rays go back to the side that they came from.

    Returns
    -------
    direction : (n, 3) float64, unit
        That of arrival (or its mirror image) where none is possible.
    possible : (n,) float64
        1, or 0 where the wave is evanescent.
    """
    normal, side = meeting.normal, -1.0 if back else 1.0
    facing = dot(meeting.direction, normal)
    along = tangential(meeting.direction + gradient / meeting.index[:, None], normal)
    rest = 1.0 - dot(along, along)
    possible = rest > 0.0
    rise = side * np.copysign(np.sqrt(np.where(possible, rest, 0.0)), facing)
    straight = meeting.direction + scaled(normal, (side - 1.0) * facing)
    return np.where(possible[:, None], along + scaled(normal, rise), straight), possible.astype(np.float64)


def onward_fields(meeting: IncidentRays, direction: FloatArray, back: bool) -> ComplexArray:
    """Field vectors along new directions; reflected ones are inverted as by an ideal mirror, -1."""
    if not back:
        return rotate_fields(meeting.field, meeting.direction, direction)
    facing = dot(meeting.direction, meeting.normal)
    mirrored = meeting.direction - scaled(meeting.normal, 2.0 * facing)
    field = meeting.field
    if field.ndim == 2:
        field = field - scaled(meeting.normal, 2.0 * dot(field, meeting.normal))
    return rotate_fields(-field, mirrored, direction)


@dataclass(frozen=True, eq=False)
class Annulus:
    """Annular stop: transmits between two radii, absorbs the rest.

    Parameters
    ----------
    centre : (3,) metres
    inner, outer : float, metres
        Distances from the centre in the plane of the surface. `inner` may be 0, `outer` infinite.

    Raises
    ------
    ValueError
        If the radii are not 0 <= inner < outer.
    """

    centre: FloatArray
    inner: float
    outer: float

    kind: ClassVar[InterfaceKind] = "element"
    waves: ClassVar[Waves] = "torn"
    branches: ClassVar[int] = 1
    polarised: ClassVar[bool] = False
    chromatic: ClassVar[bool] = False

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checked_vector(self.centre, "Annulus centre"))
        radii = (self.inner, self.outer)
        if not (all(isinstance(r, Real) for r in radii) and 0.0 <= self.inner < self.outer):
            raise ValueError(f"Annulus radii: expected 0 <= inner < outer in metres, got {radii}")

    def act(self, meeting: IncidentRays) -> tuple[Branch, ...]:
        """Light between the radii; see `Element`."""
        radius = np.linalg.norm(tangential(meeting.point - self.centre, meeting.normal), axis=1)
        passes = (radius >= self.inner) & (radius <= self.outer)
        return (Branch(scaled(meeting.field, passes)),)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Annulus:
        """The stop rotated about the origin, then shifted; as `Mesh.moved`."""
        return Annulus(move_point(self.centre, offset, turn), self.inner, self.outer)


@dataclass(frozen=True, eq=False)
class IdealLens:
    """Ideal thin lens, free of aberrations for one pair of conjugate planes.

    Slopes change by offset / focal length, so that each plane across the axis has a sharp image,
    1/s + 1/s' = 1/f. From each point of the plane at the object distance all rays have the same
    optical path to its image, that of the ray through the centre, to which the lens adds nothing.
    The lens is the same for light that comes from the other side: that goes from the image to the object.

    Parameters
    ----------
    centre : (3,) metres
    axis : (3,)
        From the object's side to the image's. The surface is a plane across it through the centre.
    focal_length : float, metres
        In the medium around; negative for a diverging lens.
    object_distance : float, metres
        Of the plane whose image is exact, before the lens; negative for a virtual object, behind it.

    Raises
    ------
    ValueError
        If the focal length is not finite or is 0, or the object distance is 0 or no number.

    Notes
    -----
    No lens has an exact path for more than one pair of planes. For points elsewhere the rays are still
    sharp, and their paths differ by the spherical aberration of the image shift.
    """

    centre: FloatArray
    axis: FloatArray
    focal_length: float
    object_distance: float = np.inf

    kind: ClassVar[InterfaceKind] = "element"
    waves: ClassVar[Waves] = "curved"
    branches: ClassVar[int] = 1
    polarised: ClassVar[bool] = False
    chromatic: ClassVar[bool] = False

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checked_vector(self.centre, "IdealLens centre"))
        object.__setattr__(self, "axis", checked_direction(self.axis, "IdealLens axis"))
        if checked_number(self.focal_length, "IdealLens focal length") == 0.0:
            raise ValueError("IdealLens focal length: expected a length other than 0, got 0")
        distance = self.object_distance
        if not isinstance(distance, Real) or np.isnan(distance) or distance == 0.0:
            raise ValueError(f"IdealLens object distance: expected a length other than 0, got {distance!r}")

    def act(self, meeting: IncidentRays) -> tuple[Branch, ...]:
        """Light deflected towards the image; see `Element`."""
        facing = component(meeting.direction, self.axis)
        forward = facing > 0.0
        before = 1.0 / self.object_distance  # vergences, which are 0 for a plane at infinity
        after = 1.0 / self.focal_length - before
        near, far = np.where(forward, before, after), np.where(forward, after, before)
        q = meeting.point - self.centre
        met = facing != 0.0
        height = component(q, self.axis) * np.sign(facing)
        pace = (1.0 + near * height) / np.where(met, np.abs(facing), 1.0)
        # slope of the ray from the object point through the centre, and on to the image point
        chief = scaled(meeting.direction, pace) - scaled(q, near)
        out = chief - scaled(q, far)
        size = np.sqrt(dot(out, out))
        met &= size > 0.0
        direction = np.where(met[:, None], out / np.where(met, size, 1.0)[:, None], meeting.direction)
        path = self._path(q, chief, near, far) * meeting.index
        field = scaled(rotate_fields(meeting.field, meeting.direction, direction), met)
        return (Branch(field, direction, None, np.where(met, path, 0.0)),)

    @staticmethod
    def _path(q: FloatArray, chief: FloatArray, near: FloatArray, far: FloatArray) -> FloatArray:
        """By how much rays at q are shorter than the chief ray, in metres: |p| - |q - p| for both points.

        Differences of squares over sums, with p = -chief / near and chief / far: neither far planes nor
        planes at infinity cost digits.
        """
        size = np.sqrt(dot(chief, chief))
        skew, square = 2.0 * dot(chief, q), dot(q, q)
        arriving, leaving = chief + scaled(q, near), chief - scaled(q, far)
        both = [size + np.sqrt(dot(side, side)) for side in (arriving, leaving)]
        sums = [np.where(total > 0.0, total, 1.0) for total in both]
        return np.asarray((skew - far * square) / sums[1] - (skew + near * square) / sums[0])

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> IdealLens:
        """The lens rotated about the origin, then shifted; as `Mesh.moved`."""
        centre = move_point(self.centre, offset, turn)
        return IdealLens(centre, rotate_vector(self.axis, turn), self.focal_length, self.object_distance)
