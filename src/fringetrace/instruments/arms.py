"""Arms of an interferometer: which light a phase step shifts, and the slope of a tilted reference."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, FloatArray, short_repr, wavenumber
from fringetrace.scene import CCD, pixel_centres
from fringetrace.tracing import Paths

if TYPE_CHECKING:
    from fringetrace.optics import Material


@dataclass(frozen=True)
class Mark:
    """Marker of an arm: how often light met a surface.

    Parameters
    ----------
    surface : int
        Number of the surface in its scene.
    branch : int, optional
        Counts only where light left it so: 0 reflected, 1 transmitted (or by the first branch of a thin
        element), 2 and on by its further branches. None: however.
    then : int, optional
        Counts only where this is the next surface, as at the entrance of a cavity.
    sense : {1, -1}
        A phase step of delta multiplies light with a count of m by exp(i sense m delta).
    """

    surface: int
    branch: int | None = None
    then: int | None = None
    sense: int = 1

    __repr__ = short_repr

    def count(self, paths: Paths) -> npt.NDArray[np.int64]:
        """Number of times each path met the marked surface.

        Parameters
        ----------
        paths : Paths

        Returns
        -------
        (m,) int64

        Raises
        ------
        ValueError
            If a path has too many bounces for its key to tell.
        """
        digits, which = paths.kinds()
        mine = np.isin(digits, self._digits(paths, self.surface, self.branch))
        if self.then is not None:
            after = np.isin(digits, self._digits(paths, self.then, None))
            mine[:, :-1] &= after[:, 1:]
            mine[:, -1:] = False
        return np.asarray(mine.sum(axis=1)[which], dtype=np.int64)

    @staticmethod
    def _digits(paths: Paths, surface: int, branch: int | None) -> list[int]:
        """Digits of path keys that stand for a surface, or for one of its branches."""
        mine = [number for number, (there, _) in enumerate(paths.scene.digits, start=1) if there == surface]
        return mine if branch is None else mine[branch : branch + 1]


def path_slope(tilt: tuple[float, float]) -> tuple[float, float]:
    """Slope of the optical path of a beam off a tilted plane mirror, on a plane across the beam.

    A mirror tilted by a turns the beam by 2a; the plane wave's path then rises by sin 2a a
    metre in the direction of the tilt.

    Parameters
    ----------
    tilt : (tilt_x, tilt_y), radians

    Returns
    -------
    (slope_x, slope_y), metres a metre
    """
    angle = math.hypot(*tilt)
    scale = math.sin(2.0 * angle) / angle if angle > 0.0 else 2.0
    return scale * tilt[0], scale * tilt[1]


@dataclass(frozen=True)
class Arms:
    """Reference arm and sample arm of an interferometer.

    Parameters
    ----------
    reference : Mark
        Which light is the reference's, and is turned by a phase step.
    tilt : (tilt_x, tilt_y), radians
        Tilt of the surface that makes the reference wave, see `michelson`.
    sample : int, optional
        Number of a surface that all light of the sample's arm, and of no other, meets; see `blocked`.
    immersion : Material, optional
        The medium in front of the reference and of the sample; None: a vacuum.
    """

    reference: Mark
    tilt: tuple[float, float] = (0.0, 0.0)
    sample: int | None = None
    immersion: Material | None = None

    __repr__ = short_repr

    def phasors(self, step: float, orders: int) -> ComplexArray:
        """Factors exp(i m delta) by which a phase step multiplies the light of each count m of the mark.

        Parameters
        ----------
        step : float, radians
        orders : int
            Counts from 0 to orders - 1.

        Returns
        -------
        (orders,) complex128
        """
        turn = 1j * (self.reference.sense * step)
        return np.asarray(np.exp(turn * np.arange(orders)), dtype=np.complex128)

    def blocked(self, arm: str) -> int:
        """Number of the surface at which a shutter ends the light of one arm.

        Parameters
        ----------
        arm : {"reference", "sample"}

        Returns
        -------
        int

        Raises
        ------
        ValueError
            For another arm, or one that shares its surfaces with the other.
        """
        alone = self.reference == Mark(self.reference.surface, sense=self.reference.sense)
        # light that is marked by a branch, or by what it meets next, parts from the rest where both meet
        arms = {"reference": self.reference.surface if alone else None, "sample": self.sample}
        if arm not in arms:
            raise ValueError(f"shut: expected {' or '.join(map(repr, arms))}, got {arm!r}")
        surface = arms[arm]
        if surface is None:
            raise ValueError(f"shut: expected an arm that light of the other does not pass, got {arm!r}")
        return surface

    def index(self, wavelength: float) -> float:
        """Real refractive index of the immersion at a wavelength in metres."""
        return 1.0 if self.immersion is None else complex(self.immersion.index(wavelength)).real

    def carrier(self, ccd: CCD, wavelength: float) -> FloatArray:
        """Carrier phase of the tilted reference wave over the pixels, 0 at the centre of the image.

        A plane wave off a plane mirror turned by a: its path on the CCD rises by sin 2a a metre
        along the tilt, exactly (times the index of the immersion).

        Parameters
        ----------
        ccd : CCD
        wavelength : float, metres

        Returns
        -------
        (rows, columns) float64, radians, not wrapped
        """
        x, y = pixel_centres(ccd.shape, ccd.pitch)
        slope_x, slope_y = path_slope(self.tilt)
        path = slope_x * x[None, :] + slope_y * y[:, None]
        path *= self.index(wavelength)
        return np.asarray(wavenumber(wavelength) * path, dtype=np.float64)
