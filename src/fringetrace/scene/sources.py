"""Coherent light sources: beams, their profile and polarisation."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from fringetrace.core import (
    ComplexArray,
    FloatArray,
    checked_direction,
    checked_vector,
    described,
    frame,
    length_text,
    value_text,
)
from fringetrace.optics import checked_jones
from fringetrace.scene.planes import PlaneAxes, checked_grid, checked_positive, checked_size


@dataclass(frozen=True)
class Gaussian:
    """Gaussian beam profile: amplitude exp(-r^2 / waist^2).

    Parameters
    ----------
    waist : float, metres
        Radius at which the amplitude is 1/e of the centre's.

    Raises
    ------
    ValueError
        If the waist is not a positive length.
    """

    waist: float

    def __post_init__(self) -> None:
        checked_positive(self.waist, "Gaussian waist")

    def __call__(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Amplitude at beam coordinates x, y (metres), each (n,) float64."""
        return np.asarray(np.exp(-(x * x + y * y) / self.waist**2), dtype=np.float64)


Profile = Callable[[FloatArray, FloatArray], FloatArray]


def as_names(names: str | Iterable[str]) -> tuple[str, ...]:
    """Tuple of surface names, from one name or several.

    Parameters
    ----------
    names : str or iterable of str

    Returns
    -------
    tuple of str
    """
    return (names,) if isinstance(names, str) else tuple(names)


@dataclass(frozen=True, eq=False)
class Beam:
    """Collimated coherent beam: a plane wave, launched as a grid of parallel rays.

    Parameters
    ----------
    centre : (3,) metres
        Centre of the rectangle it starts from; the phase is 0 on that rectangle.
    direction : (3,)
    up : (3,)
        Direction of the rows of its ray grid.
    size : (width, height), metres
    shape : (rows, columns)
        Rays start at the centres of the cells of this grid.
    profile : callable, optional
        Amplitude at beam coordinates (x, y) in metres; None is uniform, 1 everywhere.
    passes : names of surfaces that the rays pass over on their first leg.
    polarisation : (2,) complex, optional
        Jones vector along columns and rows, scaled to unit length; the field is then traced as a
        vector. None: as one number.

    Raises
    ------
    ValueError
        For a direction of length 0, an `up` along it, sizes or shapes that are not positive, a
        polarisation that is none.
    TypeError
        If the profile is no function.
    """

    centre: FloatArray
    direction: FloatArray
    up: FloatArray
    size: tuple[float, float]
    shape: tuple[int, int]
    profile: Profile | None = None
    passes: tuple[str, ...] = ()
    polarisation: ComplexArray | None = None
    axes: PlaneAxes = field(init=False, repr=False)  # of columns, rows, and the direction

    def __repr__(self) -> str:
        (rows, columns), (width, height) = self.shape, self.size
        return described(
            self,
            f"{columns} x {rows} rays, {length_text(width)} x {length_text(height)}",
            f"centre {value_text(self.centre)} m, direction {value_text(self.axes[2])}",
            "" if self.profile is None else f"profile {value_text(self.profile)}",
            "" if self.polarisation is None else f"polarisation {value_text(self.polarisation)}",
            f"passes {value_text(self.passes)}" if self.passes else "",
        )

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checked_vector(self.centre, "Beam centre"))
        object.__setattr__(self, "direction", checked_direction(self.direction, "Beam direction"))
        object.__setattr__(self, "up", checked_direction(self.up, "Beam up"))
        object.__setattr__(self, "axes", frame(self.direction, self.up, "Beam"))
        object.__setattr__(self, "size", checked_size(self.size, "Beam"))
        object.__setattr__(self, "shape", checked_grid(self.shape, "Beam shape"))
        if self.profile is not None and not callable(self.profile):
            raise TypeError(f"Beam profile: expected None or a function of (x, y), got {self.profile!r}")
        object.__setattr__(self, "passes", as_names(self.passes))
        if self.polarisation is not None:
            object.__setattr__(self, "polarisation", checked_jones(self.polarisation, "Beam"))

    @property
    def area(self) -> float:
        """Beam area per ray, m^2."""
        return self.size[0] * self.size[1] / (self.shape[0] * self.shape[1])
