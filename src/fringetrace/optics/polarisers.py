"""Polarising elements: polariser, retarder and Jones matrices.

The retarder's sign is fixed here: the component along its axis goes as exp(+i retardance), the one across
as 1. With fields exp(-i w t) a positive retardance delays it: the axis is the slow one, as the optic axis
of a positive crystal (n_e > n_o).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, FloatArray, checked_direction, dot, filled, short_repr
from fringetrace.optics.elements import (
    Branch,
    IncidentRays,
    InterfaceKind,
    RealIndex,
    Waves,
    checked_index,
    checked_number,
    index_at,
    positive_length,
    required_wavelength,
    rotate_vector,
    scaled,
    transverse_axis,
    vectors_of,
)

# A passive plate may not send on more power than it got; rounding is allowed for.
PASSIVE = 1.0 + 1e-12


@dataclass(frozen=True, eq=False)
class Polariser:
    """Linear polariser: transmits the component along its axis, absorbs the one across.

    Parameters
    ----------
    axis : (3,)
        Of transmission. Rays see its part across them; one along the axis counts as crossed.
    extinction : float
        Power that passes crossed, relative to that which passes parallel, 0 to 1.

    Raises
    ------
    ValueError
        If the axis is no direction, or the extinction not from 0 to 1.
    """

    axis: FloatArray
    extinction: float = 0.0

    kind: ClassVar[InterfaceKind] = "element"
    waves: ClassVar[Waves] = "plane"
    branches: ClassVar[int] = 1
    polarised: ClassVar[bool] = True
    chromatic: ClassVar[bool] = False

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", checked_direction(self.axis, "Polariser axis"))
        if not 0.0 <= checked_number(self.extinction, "Polariser extinction") <= 1.0:
            raise ValueError(f"Polariser extinction: expected a number from 0 to 1, got {self.extinction!r}")

    def act(self, meeting: IncidentRays) -> tuple[Branch, ...]:
        """Component along the axis; see `Element`."""
        return (Branch(scale_components(meeting, "Polariser", self.axis, 1.0, self.extinction**0.5)),)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Polariser:
        """The polariser rotated; as `Mesh.moved`."""
        return replace(self, axis=rotate_vector(self.axis, turn))


@dataclass(frozen=True, eq=False)
class Retarder:
    """Retarder: delays the component along its axis relative to the one across.

    Parameters
    ----------
    axis : (3,)
        The slow axis, if the retardance is positive. Rays see its part across them.
    retardance : float or callable, radians
        A number, or a function of the wavelength in metres.
    design : float, metres, optional
        Wavelength of a retardance given as a number, which goes as design / wavelength elsewhere
        (a plate whose birefringence does not disperse). None: the same at all wavelengths.

    Raises
    ------
    ValueError
        If the retardance is neither a finite number nor a function, the design no length, or both are given
        where the retardance is a function.
    """

    axis: FloatArray
    retardance: float | Callable[[float], float]
    design: float | None = None

    kind: ClassVar[InterfaceKind] = "element"
    waves: ClassVar[Waves] = "plane"
    branches: ClassVar[int] = 1
    polarised: ClassVar[bool] = True

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", checked_direction(self.axis, "Retarder axis"))
        if not callable(self.retardance):
            checked_number(self.retardance, "Retarder retardance")
        elif self.design is not None:
            raise ValueError(
                f"Retarder design: expected None beside a function of the wavelength, got {self.design}"
            )
        if self.design is not None:
            positive_length(self.design, "Retarder design")

    @property
    def chromatic(self) -> bool:
        """Whether the retardance depends on the wavelength."""
        return callable(self.retardance) or self.design is not None

    def at(self, wavelength: float | None) -> float:
        """Retardance at a wavelength.

        Parameters
        ----------
        wavelength : float, metres, or None

        Returns
        -------
        float, radians

        Raises
        ------
        ValueError
            If it depends on the wavelength, and that is None.
        """
        if callable(self.retardance):
            return float(self.retardance(required_wavelength(wavelength, "Retarder")))
        return self.retardance * (
            self.design / required_wavelength(wavelength, "Retarder") if self.design else 1.0
        )

    def act(self, meeting: IncidentRays) -> tuple[Branch, ...]:
        """Both components, one delayed; see `Element`."""
        delay = complex(np.exp(1j * self.at(meeting.wavelength)))
        return (Branch(scale_components(meeting, "Retarder", self.axis, delay, 1.0)),)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Retarder:
        """The retarder rotated; as `Mesh.moved`."""
        return replace(self, axis=rotate_vector(self.axis, turn))


@dataclass(frozen=True)
class Birefringence:
    """Retardance of a crystal plate over the wavelength, 2 pi (n_e - n_o) thickness / wavelength.

    Parameters
    ----------
    ordinary, extraordinary : float or callable
        Indices, or functions of the wavelength in metres.
    thickness : float, metres

    Raises
    ------
    ValueError
        If an index or the thickness is not positive.
    """

    ordinary: RealIndex
    extraordinary: RealIndex
    thickness: float

    __repr__ = short_repr

    def __post_init__(self) -> None:
        checked_index(self.ordinary, "Birefringence ordinary index")
        checked_index(self.extraordinary, "Birefringence extraordinary index")
        positive_length(self.thickness, "Birefringence thickness")

    def __call__(self, wavelength: float) -> float:
        """Retardance in radians at a wavelength in metres."""
        difference = index_at(self.extraordinary, wavelength, "") - index_at(self.ordinary, wavelength, "")
        return 2.0 * np.pi * difference * self.thickness / wavelength


def wave_plate(axis: npt.ArrayLike, waves: float, design: float | None = None) -> Retarder:
    """Wave plate: retarder by waves; 1/2 half-wave, 1/4 quarter-wave, 10.25 quarter-wave of tenth order.

    Parameters
    ----------
    axis : (3,)
        Slow axis.
    waves : float
    design : float, metres, optional
        The wavelength at which it has that many waves; None: at all.

    Returns
    -------
    Retarder
    """
    retardance = 2.0 * np.pi * checked_number(waves, "wave_plate waves")
    return Retarder(checked_direction(axis, "wave_plate axis"), retardance, design)


@dataclass(frozen=True, eq=False)
class JonesPlate:
    """Jones matrix element: any passive linear action on the two field components.

    Parameters
    ----------
    matrix : (2, 2) complex
        On the components (along the axis, along `direction` x axis), for light that goes against the
        surface's normal. Light from behind meets the transposed matrix on the same two axes: reciprocity.
    axis : (3,)
        Rays see its part across them; a ray along the axis is blocked.

    Raises
    ------
    ValueError
        If the matrix is not (2, 2) and finite, or some state would gain power.
    """

    matrix: ComplexArray
    axis: FloatArray

    kind: ClassVar[InterfaceKind] = "element"
    waves: ClassVar[Waves] = "plane"
    branches: ClassVar[int] = 1
    polarised: ClassVar[bool] = True
    chromatic: ClassVar[bool] = False

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", _checked_matrix(self.matrix))
        object.__setattr__(self, "axis", checked_direction(self.axis, "JonesPlate axis"))

    def act(self, meeting: IncidentRays) -> tuple[Branch, ...]:
        """Field times the matrix; see `Element`."""
        field = vectors_of(meeting, "JonesPlate")
        behind = dot(meeting.direction, meeting.normal) > 0.0
        first = transverse_axis(self.axis, meeting.direction)
        second = scaled(np.cross(meeting.direction, first), np.where(behind, -1.0, 1.0))
        a, b = dot(field, first), dot(field, second)
        m = self.matrix
        upper, lower = np.where(behind, m[1, 0], m[0, 1]), np.where(behind, m[0, 1], m[1, 0])
        return (Branch(scaled(first, m[0, 0] * a + upper * b) + scaled(second, lower * a + m[1, 1] * b)),)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> JonesPlate:
        """The plate rotated; as `Mesh.moved`."""
        return replace(self, axis=rotate_vector(self.axis, turn))


def _checked_matrix(value: Any) -> ComplexArray:
    try:
        matrix = filled(value, np.complex128).copy()
    except (TypeError, ValueError) as error:
        raise ValueError(f"JonesPlate matrix: expected 2 x 2 complex numbers, got {value!r}") from error
    if matrix.shape != (2, 2) or not np.isfinite(matrix).all():
        raise ValueError(f"JonesPlate matrix: expected 2 x 2 finite complex numbers, got {value!r}")
    gain = float(np.linalg.norm(matrix, 2)) ** 2
    if gain > PASSIVE:
        raise ValueError(f"JonesPlate matrix: expected a passive one, gain up to 1, got {gain:.6g}")
    return matrix


def scale_components(
    meeting: IncidentRays, what: str, axis: FloatArray, along: complex, rest: complex
) -> ComplexArray:
    """Fields with the component along an axis multiplied by one number, the rest by another."""
    field = vectors_of(meeting, what)
    seen = transverse_axis(axis, meeting.direction)
    return np.asarray(rest * field + scaled(seen, (along - rest) * dot(field, seen)))
