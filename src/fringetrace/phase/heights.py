"""Height from wrapped phase: unwrapping, synthetic wavelength, piston and tilt removal.

What a numpy.ma array masks is unknown, and comes out as NaN.

References
----------
- Cheng 1984: Y.-Y. Cheng, J. C. Wyant, Applied Optics 23, 4539.
- Herraez 2002: M. A. Herraez et al., Applied Optics 41, 7437.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, checked_wavelength, filled
from fringetrace.phase.stepping import (
    carre,
    four_step,
    hariharan,
    least_squares,
    modulation,
    n_bucket,
    stoilov,
    three_step,
)

__all__ = [
    "carre",
    "four_step",
    "hariharan",
    "height",
    "least_squares",
    "modulation",
    "n_bucket",
    "remove_mean",
    "remove_plane",
    "stoilov",
    "synthetic_wavelength",
    "three_step",
    "two_wavelength",
    "unwrap",
    "wrap",
]

BoolArray = npt.NDArray[np.bool_]


def wrap(phase: npt.ArrayLike) -> FloatArray:
    """Wrap a phase modulo 2 pi into (-pi, pi].

    Parameters
    ----------
    phase : float64, radians, any shape

    Returns
    -------
    float64, radians in (-pi, pi], shape of `phase`
    """
    turn = 2.0 * math.pi
    folded = np.fmod(filled(phase), turn)
    folded = np.where(folded > math.pi, folded - turn, folded)
    return np.where(folded <= -math.pi, folded + turn, folded)


def _checked_map(
    values: npt.ArrayLike, mask: npt.ArrayLike | None, what: str
) -> tuple[FloatArray, BoolArray]:
    """A map, and which of its pixels count."""
    pixels = filled(values)
    if pixels.ndim != 2:
        raise ValueError(f"{what}: expected a map of shape (rows, columns), got shape {pixels.shape}")
    valid = np.isfinite(pixels)
    if mask is not None and mask is not np.ma.nomask:
        left_out = np.asarray(mask, dtype=np.bool_)
        if left_out.shape != pixels.shape:
            raise ValueError(f"{what} mask: expected shape {pixels.shape}, got {left_out.shape}")
        valid &= ~left_out
    if not valid.any():
        raise ValueError(f"{what}: expected at least one valid pixel, got none of {pixels.size}")
    return pixels, valid


def _unwrapped(phase: FloatArray, valid: BoolArray) -> FloatArray:
    """Sorted by reliability (scikit-image); every region up to whole turns of its own."""
    from skimage.restoration import unwrap_phase

    # scikit-image has no reliability for a row or column that stands alone: give it neighbours like itself
    margin = [(1, 1) if n == 1 else (0, 0) for n in phase.shape]
    image = np.ma.array(np.pad(phase, margin, mode="edge"), mask=np.pad(~valid, margin, mode="edge"))
    middle = tuple(slice(before, before + n) for n, (before, _) in zip(phase.shape, margin, strict=True))
    return np.asarray(unwrap_phase(image, rng=0).data[middle], dtype=np.float64)  # type: ignore[no-untyped-call]


def unwrap(phase: npt.ArrayLike, mask: npt.ArrayLike | None = None) -> FloatArray:
    """Unwrap a phase map into a continuous one.

    The true phase must change by less than pi from pixel to pixel along enough ways through the map: a step
    higher than a quarter of the wavelength (in reflection) needs `two_wavelength`. Herraez 2002, as in
    scikit-image; deterministic.

    Parameters
    ----------
    phase : (rows, columns) float64, radians
        NaN where unknown.
    mask : (rows, columns) bool, optional
        True where a pixel is left out, as in numpy.ma.

    Returns
    -------
    (rows, columns) float64, radians
        NaN where unknown or left out. The mean is within half a turn of 0. Regions that touch at most at
        corners are unwrapped each by itself: the turns between them are not in the data, and are chosen
        such that the mean of each is within half a turn of that of the largest.

    Raises
    ------
    ValueError
        If the map is not 2D, the mask's shape differs, or no pixel is valid.
    """
    from scipy.ndimage import label

    values, valid = _checked_map(phase, mask, "unwrap")
    # the values under the mask must be numbers: scikit-image sorts them with the others
    continuous = _unwrapped(wrap(np.where(valid, values, 0.0)), valid)
    regions, _ = label(valid)
    inside = regions[valid] - 1
    counts = np.bincount(inside)
    means = np.bincount(inside, weights=continuous[valid]) / counts
    turns = np.rint((means - wrap(means[np.argmax(counts)])) / (2.0 * math.pi))
    result = np.full(values.shape, np.nan)
    result[valid] = continuous[valid] - 2.0 * math.pi * turns[inside]
    return result


def optical_path(phase: npt.ArrayLike, wavelength: float) -> FloatArray:
    """Optical path difference of a phase difference: phase * wavelength / (2 pi).

    Parameters
    ----------
    phase : float64, radians, any shape
    wavelength : float, metres

    Returns
    -------
    float64, metres, shape of `phase`

    Raises
    ------
    ValueError
        If the wavelength is not a positive length.
    """
    scale = checked_wavelength(wavelength) / (2.0 * math.pi)
    return np.asarray(filled(phase) * scale, dtype=np.float64)


def height(phase: npt.ArrayLike, wavelength: float) -> FloatArray:
    """Height of a reflecting surface from its phase, phase * wavelength / (4 pi), towards the light.

    Parameters
    ----------
    phase : float64, radians, any shape
        Of the reference arm minus the sample's; unwrapped where the surface is higher than wavelength / 4.
    wavelength : float, metres

    Returns
    -------
    float64, metres, shape of `phase`

    Raises
    ------
    ValueError
        If the wavelength is not a positive length.
    """
    return np.asarray(0.5 * optical_path(phase, wavelength), dtype=np.float64)


def synthetic_wavelength(wavelength1: float, wavelength2: float) -> float:
    """Synthetic (beat) wavelength of two others: l1 l2 / |l1 - l2| (Cheng 1984).

    Parameters
    ----------
    wavelength1, wavelength2 : float, metres

    Returns
    -------
    float, metres

    Raises
    ------
    ValueError
        If one is not a positive length, or they are equal.
    """
    first, second = checked_wavelength(wavelength1), checked_wavelength(wavelength2)
    if first == second:
        raise ValueError(f"synthetic wavelength: expected two different wavelengths, got {first:g} m twice")
    return first * (second / abs(first - second))


def two_wavelength(
    phase1: npt.ArrayLike, phase2: npt.ArrayLike, wavelength1: float, wavelength2: float
) -> FloatArray:
    """Height of a reflecting surface from wrapped phases at two wavelengths.

    The beat phase gives a coarse height, L wrap(phi1 - phi2) / (4 pi) with L the synthetic wavelength; the
    coarse height chooses the order of the phase at the shorter wavelength, which gives the fine one.
    Cheng 1984; raises like `synthetic_wavelength`.

    Parameters
    ----------
    phase1, phase2 : float64, radians, shapes that broadcast
        With the same zero of height.
    wavelength1, wavelength2 : float, metres

    Returns
    -------
    float64, metres
        Right between -L/4 and L/4. With phase noise sigma the order is wrong with the probability
        erfc(pi / (sqrt(2) sigma q)), q**2 = (L / l - 1)**2 + (L / l)**2, l the shorter wavelength.
    """
    beat = synthetic_wavelength(wavelength1, wavelength2)
    fine, other = filled(phase1), filled(phase2)
    shorter = float(wavelength1)
    if wavelength1 > wavelength2:
        fine, other, shorter = other, fine, float(wavelength2)
    coarse = wrap(fine - other) * (beat / shorter)
    order = np.rint((coarse - fine) / (2.0 * math.pi))
    return height(fine + 2.0 * math.pi * order, shorter)


def remove_mean(values: npt.ArrayLike, mask: npt.ArrayLike | None = None) -> FloatArray:
    """Remove the piston from a map.

    Parameters
    ----------
    values : (rows, columns) float64
        Phase or height; NaN where unknown.
    mask : (rows, columns) bool, optional
        True where a pixel is left out of the mean, as in numpy.ma.

    Returns
    -------
    (rows, columns) float64, unit of `values`

    Raises
    ------
    ValueError
        If the map is not 2D, the mask's shape differs, or no pixel is valid.
    """
    pixels, valid = _checked_map(values, mask, "remove_mean")
    return np.asarray(pixels - pixels[valid].mean(), dtype=np.float64)


def remove_plane(values: npt.ArrayLike, mask: npt.ArrayLike | None = None) -> FloatArray:
    """Remove piston and tilt from a map: subtract its least-squares plane.

    Raises like `remove_mean`.

    Parameters
    ----------
    values : (rows, columns) float64
        Phase or height; NaN where unknown.
    mask : (rows, columns) bool, optional
        True where a pixel is left out of the fit, as in numpy.ma.

    Returns
    -------
    (rows, columns) float64, unit of `values`
        Where all valid pixels are on one line, the plane does not slope across it.
    """
    pixels, valid = _checked_map(values, mask, "remove_plane")
    row, column = np.nonzero(valid)
    centre = row.mean(), column.mean()
    known = np.column_stack([row - centre[0], column - centre[1]])
    mean = pixels[valid].mean()
    slope = np.linalg.lstsq(known, pixels[valid] - mean, rcond=None)[0]
    rows, columns = np.ogrid[: pixels.shape[0], : pixels.shape[1]]
    plane = mean + slope[0] * (rows - centre[0]) + slope[1] * (columns - centre[1])
    return np.asarray(pixels - plane, dtype=np.float64)
