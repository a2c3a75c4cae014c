"""Pupil of an objective: the numerical aperture limits ray directions, wherever rays cross its plane."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, checked_direction, dot, short_repr
from fringetrace.optics.elements import (
    Branch,
    IncidentRays,
    InterfaceKind,
    Waves,
    checked_number,
    rotate_vector,
    scaled,
    tangential,
)


@dataclass(frozen=True, eq=False)
class Pupil:
    """Pupil: transmits rays within a numerical aperture, absorbs the rest.

    Parameters
    ----------
    axis : (3,)
        Of the objective, in the sense of travel or against it.
    aperture : float
        Numerical aperture: index times the sine of the angle to the axis.

    Raises
    ------
    ValueError
        If the axis is no direction, or the aperture not positive.
    """

    axis: FloatArray
    aperture: float

    # a plane wave has one direction: all of it passes, or none
    kind: ClassVar[InterfaceKind] = "element"
    waves: ClassVar[Waves] = "plane"
    branches: ClassVar[int] = 1
    polarised: ClassVar[bool] = False
    chromatic: ClassVar[bool] = False

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", checked_direction(self.axis, "Pupil axis"))
        if not checked_number(self.aperture, "Pupil aperture") > 0.0:
            raise ValueError(f"Pupil aperture: expected a positive number, got {self.aperture!r}")

    def act(self, meeting: IncidentRays) -> tuple[Branch, ...]:
        """Light within the aperture; see `Element`."""
        aside = tangential(meeting.direction, np.broadcast_to(self.axis, meeting.direction.shape))
        passes = meeting.index**2 * dot(aside, aside) <= self.aperture**2
        return (Branch(scaled(meeting.field, passes)),)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Pupil:
        """The pupil rotated; as `Mesh.moved`."""
        return replace(self, axis=rotate_vector(self.axis, turn))
