"""Diffraction gratings: each order is a branch of the rays.

The wave vector along the surface is kept, but for the gradient of the path. Where that leaves more than
the whole wave vector, the wave is evanescent: the ray is blocked. With `reflects` an element works as one in
front of an ideal mirror: light goes back, its field times -1, and the path is that of both ways.
"""

from __future__ import annotations

import cmath
from collections.abc import Iterable
from dataclasses import dataclass, replace
from numbers import Complex
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, checked_direction, checked_vector, dot, short_repr
from fringetrace.optics.elements import (
    Branch,
    IncidentRays,
    InterfaceKind,
    Waves,
    deflect,
    move_point,
    onward_fields,
    positive_length,
    required_wavelength,
    rotate_vector,
    scaled,
    tangential_axis,
)

# Orders may not carry more power than came; rounding is allowed for.
PASSIVE = 1.0 + 1e-12


def checked_orders(orders: Any, what: str) -> tuple[int, ...]:
    """Checked diffraction orders as a tuple; ValueError unless they are different whole numbers."""
    listed = tuple(orders) if isinstance(orders, Iterable) else (orders,)
    whole = all(isinstance(m, (int, np.integer)) and not isinstance(m, bool) for m in listed)
    if not (whole and listed and len(set(listed)) == len(listed)):
        raise ValueError(f"{what} orders: expected different whole numbers, at least one, got {orders!r}")
    return tuple(int(m) for m in listed)


def _checked_amplitudes(amplitudes: Any, count: int) -> tuple[complex, ...]:
    if amplitudes is None:
        return (complex(count**-0.5),) * count
    listed = tuple(amplitudes) if isinstance(amplitudes, Iterable) else (amplitudes,)
    if len(listed) != count or not all(isinstance(a, Complex) and cmath.isfinite(a) for a in listed):
        raise ValueError(
            f"Grating amplitudes: expected {count} finite numbers, one an order, got {amplitudes!r}"
        )
    gain = sum(abs(a) ** 2 for a in listed)
    if gain > PASSIVE:
        raise ValueError(f"Grating amplitudes: expected powers that add up to at most 1, got {gain:.6g}")
    return tuple(complex(a) for a in listed)


@dataclass(frozen=True, eq=False)
class Grating:
    """Plane diffraction grating that sends light into chosen orders.

    In order m the wave vector along the surface changes by m lambda / period along the axis,
    sin theta_m = sin theta_i + m lambda / period in the plane across the grooves, and the path by
    m lambda / period times the distance from the centre along it.

    Parameters
    ----------
    axis : (3,)
        Across the grooves; its part along the surface counts.
    period : float, metres
    orders : tuple of int
        A branch for each.
    amplitudes : tuple of complex, optional
        Of the orders, relative to the light that arrives; |.|^2 is the efficiency. None: equal parts of
        the whole power. `lamellar`, `sinusoidal` give those of phase gratings. What would be in
        evanescent orders is absorbed.
    centre : (3,) metres
        Where all orders are in phase, but for their amplitudes.
    reflects : bool

    Raises
    ------
    ValueError
        For an axis that is no direction, a period that is not positive, orders that are not different whole
        numbers, amplitudes of another number than the orders, not finite, or of more power than came.
    """

    axis: FloatArray
    period: float
    orders: tuple[int, ...] = (1,)
    amplitudes: tuple[complex, ...] | None = None
    centre: FloatArray | tuple[float, float, float] = (0.0, 0.0, 0.0)
    reflects: bool = False

    kind: ClassVar[InterfaceKind] = "element"
    waves: ClassVar[Waves] = "plane"
    polarised: ClassVar[bool] = False
    chromatic: ClassVar[bool] = True

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", checked_direction(self.axis, "Grating axis"))
        object.__setattr__(self, "centre", checked_vector(self.centre, "Grating centre"))
        object.__setattr__(self, "orders", checked_orders(self.orders, "Grating"))
        object.__setattr__(self, "amplitudes", _checked_amplitudes(self.amplitudes, len(self.orders)))
        positive_length(self.period, "Grating period")

    @property
    def branches(self) -> int:
        """Number of orders."""
        return len(self.orders)

    def act(self, meeting: IncidentRays) -> tuple[Branch, ...]:
        """One branch per order; see `Element`."""
        assert self.amplitudes is not None
        lie = tangential_axis(self.axis, meeting.normal, "Grating axis")
        along = dot(meeting.point - self.centre, lie)
        step = required_wavelength(meeting.wavelength, "Grating") / self.period
        return tuple(
            diffracted_branch(meeting, lie * (m * step), along * (m * step), amplitude, self.reflects)
            for m, amplitude in zip(self.orders, self.amplitudes, strict=True)
        )

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Grating:
        """The grating rotated about the origin, then shifted; as `Mesh.moved`."""
        centre = move_point(np.asarray(self.centre), offset, turn)
        return replace(self, axis=rotate_vector(self.axis, turn), centre=centre)


def diffracted_branch(
    meeting: IncidentRays, gradient: FloatArray, path: FloatArray, amplitude: complex, reflects: bool
) -> Branch:
    """Branch behind an added path with its gradient (n, 3), multiplied by an amplitude."""
    direction, possible = deflect(meeting, gradient, reflects)
    return Branch(
        scaled(amplitude * onward_fields(meeting, direction, reflects), possible), direction, None, path
    )


def lamellar(orders: Iterable[int], phase: float, fill: float = 0.5) -> tuple[complex, ...]:
    """Order amplitudes of a binary phase grating: exp(i phase) on the middle of each period, 1 elsewhere.

    Parameters
    ----------
    orders : iterable of int
    phase : float, radians
    fill : float
        The part, 0 to 1.

    Returns
    -------
    tuple of complex
        Fourier coefficients of the transmission.

    Raises
    ------
    ValueError
        If the part is not from 0 to 1.
    """
    if not 0.0 <= fill <= 1.0:
        raise ValueError(f"lamellar fill: expected a number from 0 to 1, got {fill!r}")
    step = complex(np.exp(1j * phase)) - 1.0
    return tuple(complex(m == 0) + step * fill * complex(np.sinc(m * fill)) for m in orders)


def sinusoidal(orders: Iterable[int], phase: float) -> tuple[complex, ...]:
    """Order amplitudes i^m J_m(phase) of a phase grating exp(i phase cos(2 pi x / period)).

    Parameters
    ----------
    orders : iterable of int
    phase : float, radians

    Returns
    -------
    tuple of complex
        Fourier coefficients of the transmission (Jacobi-Anger).
    """
    from scipy.special import jv

    return tuple(1j ** (m % 4) * complex(jv(m, phase)) for m in orders)


def blazed_amplitude(order: int, waves: float) -> complex:
    """Order amplitude of a blazed grating of a given depth in waves.

    Parameters
    ----------
    order : int
    waves : float
        Depth a over wavelength; 1 at the design wavelength.

    Returns
    -------
    complex
        exp(i pi (a - m)) sinc(a - m): the mean of exp(2 pi i (a - m) u) over u from 0 to 1
        (Swanson 1989, Binary optics technology, MIT Lincoln Laboratory TR 854).
    """
    off = waves - order
    return complex(np.exp(1j * np.pi * off) * np.sinc(off))
