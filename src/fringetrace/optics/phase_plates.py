"""Phase plates: a map of optical path over a plane; spatial light modulators and zone plates.

Rays get the path at the point where they meet the plate, whatever their angle, and are bent by its gradient
as by a grating of that period.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from fringetrace.core import (
    ROUNDED,
    FloatArray,
    checked_direction,
    checked_vector,
    component,
    filled,
    frame,
    short_repr,
)
from fringetrace.optics.elements import (
    Branch,
    IncidentRays,
    InterfaceKind,
    Waves,
    checked_number,
    move_point,
    positive_length,
    required_wavelength,
    rotate_vector,
)
from fringetrace.optics.gratings import blazed_amplitude, checked_orders, diffracted_branch

Map = Callable[[FloatArray, FloatArray], FloatArray]
Slopes = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
Relief = tuple[FloatArray, FloatArray, FloatArray]  # path, and its derivatives by x and y

INTERPOLATIONS = ("bicubic", "nearest")
LEAST = 4  # samples that a cubic spline takes, each way


@dataclass(frozen=True, eq=False)
class FormulaRelief:
    """Optical path map by a function, with its gradient or a finite-difference step (fourth order)."""

    opd: Map
    gradient: Slopes | None
    step: float | None

    __repr__ = short_repr

    def __call__(self, x: FloatArray, y: FloatArray) -> Relief:
        """Path in metres, and its gradient, at points in metres."""
        if self.gradient is not None:
            return self.opd(x, y), *self.gradient(x, y)
        f, h = self.opd, self.step or 0.0
        east = [f(x + k * h, y) - f(x - k * h, y) for k in (1, 2)]
        north = [f(x, y + k * h) - f(x, y - k * h) for k in (1, 2)]
        return f(x, y), (8.0 * east[0] - east[1]) / (12.0 * h), (8.0 * north[0] - north[1]) / (12.0 * h)


@dataclass(frozen=True, eq=False)
class PixelRelief:
    """Optical path map of flat square pixels, [row, column] = [y, x], extended by the nearest pixel."""

    samples: FloatArray
    pitch: float
    fold: float | None

    __repr__ = short_repr

    def __call__(self, x: FloatArray, y: FloatArray) -> Relief:
        """Path in metres, modulo the fold if there is one, and a gradient of 0."""
        rows, columns = self.samples.shape
        column = np.clip(np.floor(x / self.pitch + 0.5 * columns), 0, columns - 1).astype(np.int64)
        row = np.clip(np.floor(y / self.pitch + 0.5 * rows), 0, rows - 1).astype(np.int64)
        path = self.samples[row, column]
        still = np.zeros_like(path)
        return (path if self.fold is None else np.mod(path, self.fold)), still, still


@dataclass(frozen=True, eq=False)
class SplineRelief:
    """Optical path map by a bicubic spline through samples at pixel centres."""

    samples: FloatArray
    pitch: float

    __repr__ = short_repr

    @cached_property
    def fit(self) -> Any:
        """Bicubic spline over (y, x) in metres from the centre."""
        from scipy.interpolate import NdBSpline, make_interp_spline

        y, x = ((np.arange(n) - 0.5 * (n - 1)) * self.pitch for n in self.samples.shape)
        lines = make_interp_spline(y, self.samples, axis=0)
        both = make_interp_spline(x, lines.c, axis=1)
        return NdBSpline((lines.t, both.t), np.ascontiguousarray(both.c.T), 3, extrapolate=True)

    def __call__(self, x: FloatArray, y: FloatArray) -> Relief:
        """Path in metres, and its gradient."""
        yx = np.stack([y, x], axis=-1)
        path, east, north = (np.asarray(self.fit(yx, nu=nu)) for nu in ((0, 0), (0, 1), (1, 0)))
        return path, east, north

    def __getstate__(self) -> dict[str, Any]:
        return {"samples": self.samples, "pitch": self.pitch}


@dataclass(frozen=True, eq=False)
class PhasePlate:
    """Phase plate: a map of optical path over a plane (aberration, modulator, diffractive element).

    What the plate does to the whole wave, such as the orders that the pixels of a modulator send out,
    takes a diffraction integral, and is not in the rays.

    Parameters
    ----------
    opd : callable or (rows, columns) array-like, metres
        Function of (x, y), or samples at the centres of square pixels about the centre,
        [row, column] = [y, x]. Beyond the array the nearest pixel goes on, or the spline does.
    centre : (3,) metres
    right, up : (3,)
        Directions of x and y, along the surface; y is `up` without its part along x.
    pitch : float, metres, optional
        Side of the pixels. For a function without `gradient`, the step over which it is differenced.
    gradient : callable, optional
        (d opd/dx, d opd/dy) as a function of (x, y).
    interpolation : str
        Of samples: "bicubic" spline, or "nearest": flat pixels, which do not bend rays.
    design : float, metres, optional
        Wavelength at which the path is folded to less than one wave. Flat pixels then have opd mod
        design. A smooth map becomes a blazed diffractive one: its orders have the path
        m lambda / design times the map, and the amplitude of `gratings.blazed_amplitude`. None: not folded.
    orders : tuple of int
        Branches of a folded smooth map; 1 is the wanted one, and has all light at the design wavelength.
    reflects : bool
        Whether light goes back, as from a plate before an ideal mirror: the field times -1, and the map
        is that of both ways.

    Raises
    ------
    ValueError
        For samples that are not finite or no table, a pitch or gradient missing or in vain, an
        unknown interpolation, or orders where there are none.
    """

    opd: Map | FloatArray
    centre: FloatArray
    right: FloatArray
    up: FloatArray
    pitch: float | None = None
    gradient: Slopes | None = None
    interpolation: str = "bicubic"
    design: float | None = None
    orders: tuple[int, ...] = (1,)
    reflects: bool = False
    relief: FormulaRelief | PixelRelief | SplineRelief = field(init=False, repr=False)

    kind: ClassVar[InterfaceKind] = "element"
    polarised: ClassVar[bool] = False

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checked_vector(self.centre, "PhasePlate centre"))
        right, up = _plane_axes(self.right, self.up)
        object.__setattr__(self, "right", right)
        object.__setattr__(self, "up", up)
        object.__setattr__(self, "orders", checked_orders(self.orders, "PhasePlate"))
        if self.design is not None:
            positive_length(self.design, "PhasePlate design")
        object.__setattr__(self, "relief", self._checked_relief())
        if self.orders != (1,) and not self.chromatic:
            raise ValueError(
                f"PhasePlate orders: expected (1,) unless a smooth map is folded, got {self.orders}"
            )

    def _checked_relief(self) -> FormulaRelief | PixelRelief | SplineRelief:
        if self.interpolation not in INTERPOLATIONS:
            raise ValueError(
                f"PhasePlate interpolation: expected one of {INTERPOLATIONS}, got {self.interpolation!r}"
            )
        pitch = None if self.pitch is None else positive_length(self.pitch, "PhasePlate pitch")
        if callable(self.opd):
            if (pitch is None) == (self.gradient is None):
                raise ValueError("PhasePlate: expected either a gradient or a pitch beside a function")
            return FormulaRelief(self.opd, self.gradient, pitch)
        samples = filled(self.opd).copy()
        if samples.ndim != 2 or not samples.size or not np.isfinite(samples).all():
            raise ValueError(f"PhasePlate opd: expected a table of finite metres, got shape {samples.shape}")
        if pitch is None or self.gradient is not None:
            raise ValueError("PhasePlate: expected a pitch and no gradient beside samples")
        if self.interpolation == "nearest":
            return PixelRelief(samples, pitch, self.design)
        if min(samples.shape) < LEAST:
            raise ValueError(f"PhasePlate opd: expected at least 4 x 4 samples, got {samples.shape}")
        return SplineRelief(samples, pitch)

    @property
    def chromatic(self) -> bool:
        """Whether directions and paths depend on the wavelength."""
        return self.design is not None and not isinstance(self.relief, PixelRelief)

    @property
    def waves(self) -> Waves:
        """Effect on plane waves: pixels tear them, smooth maps curve them."""
        return "torn" if isinstance(self.relief, PixelRelief) else "curved"

    @property
    def branches(self) -> int:
        """Number of orders."""
        return len(self.orders)

    def act(self, meeting: IncidentRays) -> tuple[Branch, ...]:
        """Light with its path changed, deflected by the gradient; see `Element`."""
        offset = meeting.point - self.centre
        path, east, north = self.relief(component(offset, self.right), component(offset, self.up))
        if isinstance(self.relief, PixelRelief) and not self.reflects:
            return (Branch(meeting.field, path=path),)
        gradient = np.outer(east, self.right) + np.outer(north, self.up)
        if not self.chromatic:
            return (diffracted_branch(meeting, gradient, path, 1.0, self.reflects),)
        waves = (self.design or 0.0) / required_wavelength(meeting.wavelength, "PhasePlate")
        return tuple(
            diffracted_branch(
                meeting, gradient * (m / waves), path * (m / waves), blazed_amplitude(m, waves), self.reflects
            )
            for m in self.orders
        )

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> PhasePlate:
        """The plate rotated about the origin, then shifted; as `Mesh.moved`."""
        centre = move_point(self.centre, offset, turn)
        return replace(
            self, centre=centre, right=rotate_vector(self.right, turn), up=rotate_vector(self.up, turn)
        )


def _plane_axes(right: npt.ArrayLike, up: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Unit vectors of x and y."""
    _, y, x = frame(right, up, "PhasePlate")
    given = checked_direction(up, "PhasePlate up")
    # axes that are at right angles stay as they are, to the last bit
    return x, (given if abs(float(given @ x)) <= ROUNDED else y)


@dataclass(frozen=True)
class Focusing:
    """Optical path map that turns the spherical wave from one axial point into that to another.

    Parameters
    ----------
    focal_length, object_distance : float, metres
        1/s + 1/s' = 1/f.
    index : float
    """

    focal_length: float
    object_distance: float
    index: float

    __repr__ = short_repr

    @property
    def distances(self) -> tuple[float, ...]:
        """Object and image distance in metres, those that are finite."""
        vergences = 1.0 / self.object_distance, 1.0 / self.focal_length - 1.0 / self.object_distance
        return tuple(1.0 / vergence for vergence in vergences if vergence != 0.0)

    def __call__(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """N (|s| - sqrt(s^2 + r^2)) sign s, of both distances, without the difference of large lengths."""
        square = x * x + y * y
        path = np.zeros_like(square)
        for s in self.distances:
            path -= np.copysign(square / (np.sqrt(s * s + square) + abs(s)), s)
        return self.index * path

    def slopes(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the path along x and y."""
        square = x * x + y * y
        slope = np.zeros_like(square)
        for s in self.distances:
            slope -= np.copysign(self.index / np.sqrt(s * s + square), s)
        return slope * x, slope * y


def zone_plate(
    centre: npt.ArrayLike,
    axis: npt.ArrayLike,
    focal_length: float,
    object_distance: float = np.inf,
    design: float | None = None,
    orders: tuple[int, ...] = (1,),
    index: float = 1.0,
    reflects: bool = False,
) -> PhasePlate:
    """Zone plate: a phase plate that images one axial point exactly onto another.

    Parameters
    ----------
    centre : (3,) metres
    axis : (3,)
        Across the surface.
    focal_length : float, metres
        In the medium around; negative for a diverging one.
    object_distance : float, metres
        Before the plate; negative for a virtual object, infinite for a collimated beam along the axis.
    design : float, metres, optional
        Wavelength at which it is folded into zones: it is a blazed diffractive lens then, with about the
        focal length f design / (m lambda) in order m. None: refractive, the same at all wavelengths.
    orders : tuple of int
        Branches, if folded.
    index : float
        Refractive index of the medium around.
    reflects : bool

    Returns
    -------
    PhasePlate

    Raises
    ------
    ValueError
        For a focal length or an object distance of 0, or no number.
    """
    if checked_number(focal_length, "zone_plate focal length") == 0.0:
        raise ValueError("zone_plate focal length: expected a length other than 0, got 0")
    if np.isnan(object_distance) or object_distance == 0.0:
        raise ValueError(
            f"zone_plate object distance: expected a length other than 0, got {object_distance!r}"
        )
    if not checked_number(index, "zone_plate index") > 0.0:
        raise ValueError(f"zone_plate index: expected a positive number, got {index!r}")
    normal = checked_direction(axis, "zone_plate axis")
    guide = np.eye(3)[int(np.argmin(np.abs(normal)))]
    right, up, _ = frame(normal, guide, "zone_plate")
    lens = Focusing(float(focal_length), float(object_distance), float(index))
    return PhasePlate(
        lens, checked_vector(centre, "zone_plate centre"), right, up, gradient=lens.slopes, design=design,
        orders=orders, reflects=reflects,
    )  # fmt: skip
