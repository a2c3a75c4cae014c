"""Coherent sum of rays at many wavelengths by non-uniform FFT from optical path to wavenumber."""

from __future__ import annotations

from numbers import Real
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray, checked_wavelengths

# What a sum may be off by, relative to the root of the sum of |amplitude|^2.
TOLERANCE = 1e-12
# finufft's errors are a few times what it is asked for; below this float64 gives no more.
MARGIN, FINEST = 0.1, 1e-14
# Up to so many exponentials, rays times wavelengths, these themselves are quicker.
FEW = 2**11
# Exponentials at a time, 32 MB.
BLOCK = 2**21


def _checked(length: npt.ArrayLike, amplitude: npt.ArrayLike) -> tuple[FloatArray, ComplexArray]:
    """Lengths (n,) and amplitudes (..., n) that go together."""
    lengths, amplitudes = np.asarray(length, np.float64), np.asarray(amplitude, np.complex128)
    if lengths.ndim != 1 or amplitudes.shape[-1:] != lengths.shape:
        raise ValueError(
            f"spectrum amplitude: expected shape (..., n) for lengths of shape (n,), got "
            f"{amplitudes.shape} for {lengths.shape}"
        )
    return lengths, amplitudes


def spectrum(
    length: npt.ArrayLike,
    amplitude: npt.ArrayLike,
    wavelengths: npt.ArrayLike,
    tolerance: float = TOLERANCE,
) -> ComplexArray:
    """Coherent sum of rays at each wavelength: sum_j a_j exp(2 pi i L_j / lambda).

    A non-uniform FFT of type 3 (A. H. Barnett, J. Magland and L. af Klinteberg, SIAM J. Sci. Comput.
    41, C479 (2019)) from optical path to wavenumber: its cost is that of the rays, plus that of the
    wavelengths, not of their product. Lengths are taken from their middle, and the middle's phase by
    an exact remainder, so that a long way to the sample costs no digits.

    Parameters
    ----------
    length : (n,) float64, metres
        Optical path of each ray.
    amplitude : (..., n) complex128
        One or several sets of amplitudes over the same lengths.
    wavelengths : (w,) float64, metres
        In any order, at any distances.
    tolerance : float
        Error of a sum relative to the root of the sum of |amplitude|^2, 1e-13 to 0.1. Rounding of
        the lengths comes on top: 2 pi eps of L / lambda.

    Returns
    -------
    (..., w) complex128
        The same bits on any number of cores.

    Raises
    ------
    ValueError
        For shapes that do not fit, lengths that are not finite, wavelengths that are not positive, or
        another tolerance.
    """
    lengths, amplitudes = _checked(length, amplitude)
    waves = checked_wavelengths(wavelengths)
    if not (isinstance(tolerance, Real) and FINEST / MARGIN <= tolerance <= 0.1):
        raise ValueError(f"spectrum tolerance: expected a number from 1e-13 to 0.1, got {tolerance!r}")
    if not np.isfinite(lengths).all():
        raise ValueError("spectrum length: expected finite lengths in metres, got NaN or infinity")
    if len(lengths) * len(waves) <= FEW:
        return direct(lengths, amplitudes, waves)
    import finufft

    middle = 0.5 * (lengths.min() + lengths.max())
    sets: Any = np.ascontiguousarray(amplitudes.reshape(-1, len(lengths)))
    sums = finufft.nufft1d3(
        lengths - middle, sets, 2.0 * np.pi / waves, eps=MARGIN * tolerance, isign=1, nthreads=1
    )
    shift = np.exp(2j * np.pi * (np.fmod(middle, waves) / waves))
    return np.asarray(sums.reshape(*amplitudes.shape[:-1], len(waves)) * shift, dtype=np.complex128)


def direct(length: npt.ArrayLike, amplitude: npt.ArrayLike, wavelengths: npt.ArrayLike) -> ComplexArray:
    """Coherent sum of rays at each wavelength like `spectrum`, by all exponentials.

    Parameters
    ----------
    length, amplitude, wavelengths
        As in `spectrum`.

    Returns
    -------
    (..., w) complex128

    Raises
    ------
    ValueError
        For shapes that do not fit, or wavelengths that are not positive.
    """
    lengths, amplitudes = _checked(length, amplitude)
    waves = checked_wavelengths(wavelengths)
    sums = np.zeros((*amplitudes.shape[:-1], len(waves)), dtype=np.complex128)
    rows = max(1, BLOCK // len(waves))
    for first in range(0, len(lengths), rows):
        some: Array = lengths[first : first + rows, None]
        turns = np.fmod(some, waves) / waves
        sums += amplitudes[..., first : first + rows] @ np.exp(2j * np.pi * turns)
    return sums
