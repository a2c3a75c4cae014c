"""Spectrum of the light: wavelengths, spectral lines and their degree of coherence.

Wavelengths do not interfere with each other: what a camera records is the sum over them. The complex
degree of coherence between two waves whose paths differ by D is g(D) = sum of w exp(2 pi i D / wavelength)
over a spectrum of weights w that add up to 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, FloatArray, checked_wavelength, filled, nm, short_repr

# What the sum over a line may be off its integral, relative to the line.
ERROR = 1e-6
# Each wavelength is an image of its own: so many are taken for a mistake.
MOST = 4096


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Spectrum: wavelengths and the share of the light that each has.

    Parameters
    ----------
    wavelengths : (n,) float64, metres
        In vacuum.
    weights : (n,) float64
        Shares of the irradiance, not negative; scaled to add up to 1.

    Raises
    ------
    ValueError
        If there are none, not as many of one as of the other, wavelengths that are none, weights that
        are negative or all 0.
    """

    wavelengths: FloatArray
    weights: FloatArray

    __repr__ = short_repr

    def __post_init__(self) -> None:
        wavelengths, weights = (np.atleast_1d(filled(v).copy()) for v in (self.wavelengths, self.weights))
        if wavelengths.ndim != 1 or not wavelengths.size or wavelengths.shape != weights.shape:
            raise ValueError(
                f"Spectrum: expected as many wavelengths as weights, at least one, got shapes "
                f"{wavelengths.shape} and {weights.shape}"
            )
        for wavelength in wavelengths:
            checked_wavelength(float(wavelength))
        if not (np.isfinite(weights).all() and (weights >= 0.0).all() and weights.sum() > 0.0):
            raise ValueError(f"Spectrum weights: expected numbers of at least 0, not all 0, got {weights}")
        object.__setattr__(self, "wavelengths", wavelengths)
        object.__setattr__(self, "weights", weights / weights.sum())

    def coherence(self, path: npt.ArrayLike) -> ComplexArray:
        """Complex degree of coherence of two waves over their path difference.

        Parameters
        ----------
        path : float64, metres, any shape
            By which their optical paths differ.

        Returns
        -------
        complex128, shape of `path`
        """
        waves = np.multiply.outer(np.asarray(path, dtype=np.float64), 1.0 / self.wavelengths)
        return np.asarray(np.exp(2j * np.pi * np.fmod(waves, 1.0)) @ self.weights, dtype=np.complex128)


@dataclass(frozen=True)
class Line:
    """Spectral line, Gaussian over the wavenumber.

    Its coherence is |g(D)| = exp(-(pi D width / centre^2)^2 / (4 ln 2)), one half at
    D = (2 ln 2 / pi) centre^2 / width (Born and Wolf, Principles of Optics, ch. 7.5.8).

    Parameters
    ----------
    centre : float, metres
        Vacuum wavelength.
    width : float, metres
        Full width at half maximum, as a small part of the centre: on the scale of wavenumbers it is
        width / centre^2.

    Raises
    ------
    ValueError
        If the centre is no wavelength, or the width not positive or so large that the line reaches
        wavenumber 0.
    """

    centre: float
    width: float

    __repr__ = short_repr

    def __post_init__(self) -> None:
        checked_wavelength(self.centre)
        wide = isinstance(self.width, Real) and math.isfinite(self.width) and self.width > 0.0
        if not wide or _reach(ERROR) * self.spread * self.centre >= 1.0:
            raise ValueError(
                f"Line width: expected a positive length, a part of {self.centre / nm:g} nm, "
                f"got {self.width!r} m"
            )

    @property
    def spread(self) -> float:
        """Standard deviation of the wavenumber 1 / wavelength, 1/m."""
        return self.width / self.centre**2 / math.sqrt(8.0 * math.log(2.0))

    @property
    def length(self) -> float:
        """Coherence length: path difference at which the coherence has fallen to one half, metres."""
        return 2.0 * math.log(2.0) / math.pi * self.centre**2 / self.width

    def coherence(self, path: npt.ArrayLike) -> ComplexArray:
        """Complex degree of coherence over the path difference, in closed form; see `Spectrum.coherence`."""
        away = np.asarray(path, dtype=np.float64)
        turns = np.exp(2j * np.pi * np.fmod(away / self.centre, 1.0))
        return np.asarray(turns * np.exp(-2.0 * (math.pi * self.spread * away) ** 2), dtype=np.complex128)

    def sampled(self, path: float, error: float = ERROR) -> Spectrum:
        """Spectrum of wavelengths that represents the line up to a path difference.

        Equal steps of wavenumber (the trapezoidal rule). A sum in steps of h repeats itself at a path
        difference of 1 / h: what it is off at D is the line's coherence at 1 / h - D, and what lies beyond
        its ends. Steps and ends are so that each is below `error`.

        Parameters
        ----------
        path : float, metres
            Largest path difference, of either sign.
        error : float
            What |g| may be off, at any path difference up to that.

        Returns
        -------
        Spectrum
            Some 10 wavelengths, and 10 more for each path of 1 / spread.

        Raises
        ------
        ValueError
            If the path is no length or the error not between 0 and 1; if it took over `MOST` wavelengths.
        """
        if not (math.isfinite(path) and path >= 0.0):
            raise ValueError(f"Line path: expected a length of at least 0 in metres, got {path!r}")
        if not 0.0 < error < 1.0:
            raise ValueError(f"Line error: expected a number between 0 and 1, got {error!r}")
        # |g| is below the error from here on
        dark = math.sqrt(0.5 * math.log(2.0 / error)) / (math.pi * self.spread)
        step = 1.0 / (path + dark)
        reach = _reach(error) * self.spread
        count = math.ceil(reach / step)
        if 2 * count + 1 > MOST:
            raise ValueError(
                f"Line: expected at most {MOST} wavelengths, got {2 * count + 1} for paths that differ by "
                f"{path:g} m; it is coherent over {self.length:g} m: give a Spectrum of your own"
            )
        offset = np.arange(-count, count + 1) * step
        wavelengths = np.asarray(1.0 / (1.0 / self.centre + offset), dtype=np.float64)
        weights = np.asarray(np.exp(-0.5 * (offset / self.spread) ** 2), dtype=np.float64)
        return Spectrum(wavelengths, weights)


def _reach(error: float) -> float:
    """Standard deviations beyond which less than this part of a Gaussian lies (Chernoff's bound)."""
    return math.sqrt(2.0 * math.log(2.0 / error))
