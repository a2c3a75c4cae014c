"""Interferogram frames to phase, phase to height: phase stepping, unwrapping, two wavelengths.

Frames are I_k = A + B cos(phi + alpha_k), with the steps alpha_k added to the reference arm. Phases that
cannot be determined (no modulation above rounding, frames that are not finite) are NaN.

References
----------
- Bruning 1974: J. H. Bruning et al., Applied Optics 13, 2693.
- Carre 1966: P. Carre, Metrologia 2, 13.
- Cheng 1984: Y.-Y. Cheng, J. C. Wyant, Applied Optics 23, 4539.
- Creath 1988: K. Creath, Progress in Optics 26, 349.
- Greivenkamp 1984: J. E. Greivenkamp, Optical Engineering 23, 350.
- Hariharan 1987: P. Hariharan, B. F. Oreb, T. Eiju, Applied Optics 26, 2504.
- Herraez 2002: M. A. Herraez et al., Applied Optics 41, 7437.
- Schwider 1983: J. Schwider et al., Applied Optics 22, 3421.
- Stoilov 1997: G. Stoilov, T. Dragostinov, Optics and Lasers in Engineering 28, 61.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from fringetrace.waves import FloatArray, checked_wavelength

BoolArray = npt.NDArray[np.bool_]

# Sums of frames that cancel leave a few units in the last place of their largest term.
ROUNDING = 4.0 * float(np.finfo(np.float64).eps)
# The largest sum of |weights| in the algorithms with fixed steps (Carre: 3 + 3 + 1 + 1).
FIXED_GAIN = 8.0


def _checked_frames(frames: npt.ArrayLike, what: str, count: int | None = None) -> FloatArray:
    """Real frames along the first axis: `count` of them, or 3 or more."""
    if np.iscomplexobj(frames):
        raise ValueError(f"{what} frames: expected real intensities, got complex numbers; take |E|**2")
    values = np.asarray(frames, dtype=np.float64)
    found = len(values) if values.ndim else 0
    if found < 3 or (count is not None and found != count):
        expected = "3 or more" if count is None else str(count)
        raise ValueError(
            f"{what} frames: expected {expected} along the first axis, got {found} (shape {values.shape})"
        )
    return np.where(np.isfinite(values), values, np.nan)


def _angle(sine: FloatArray, cosine: FloatArray, frames: FloatArray, gain: float = FIXED_GAIN) -> FloatArray:
    """Angle in (-pi, pi]; NaN where both parts are within the rounding of the frames they are sums of."""
    angle = np.arctan2(sine, cosine)
    angle = np.where(angle <= -math.pi, math.pi, angle)
    rounding = ROUNDING * gain * np.abs(frames).max(axis=0)
    return np.where(np.hypot(sine, cosine) > rounding, angle, np.nan)


def _root(square: FloatArray) -> FloatArray:
    """Square root of what noise may have made slightly negative."""
    return np.asarray(np.sqrt(np.maximum(square, 0.0)), dtype=np.float64)


def four_step(frames: npt.ArrayLike) -> FloatArray:
    """Phase from steps of 0, 90, 180, 270 degrees: tan phi = (I4 - I2) / (I1 - I3).

    Creath 1988.

    Parameters
    ----------
    frames : (4, ...) float64
        Intensities, any unit.

    Returns
    -------
    (...) float64, radians in (-pi, pi]

    Raises
    ------
    ValueError
        If there are not 4 frames, or they are complex.
    """
    values = _checked_frames(frames, "four_step", 4)
    i1, i2, i3, i4 = values
    return _angle(i4 - i2, i1 - i3, values)


def three_step(frames: npt.ArrayLike) -> FloatArray:
    """Phase from steps of -120, 0, 120 degrees: tan phi = sqrt(3) (I1 - I3) / (2 I2 - I1 - I3).

    Creath 1988; raises like `four_step`.

    Parameters
    ----------
    frames : (3, ...) float64
        Intensities, any unit.

    Returns
    -------
    (...) float64, radians in (-pi, pi]
    """
    values = _checked_frames(frames, "three_step", 3)
    i1, i2, i3 = values
    return _angle(math.sqrt(3.0) * (i1 - i3), 2.0 * i2 - i1 - i3, values)


def hariharan(frames: npt.ArrayLike) -> FloatArray:
    """Phase from steps of -180, -90, 0, 90, 180 degrees: tan phi = 2 (I2 - I4) / (2 I3 - I1 - I5).

    A step that is wrong by e shifts the phase only by up to e**2 / 4.
    Schwider 1983, Hariharan 1987; raises like `four_step`.

    Parameters
    ----------
    frames : (5, ...) float64
        Intensities, any unit.

    Returns
    -------
    (...) float64, radians in (-pi, pi]
    """
    values = _checked_frames(frames, "hariharan", 5)
    i1, i2, i3, i4, i5 = values
    return _angle(2.0 * (i2 - i4), 2.0 * i3 - i1 - i5, values)


def carre(frames: npt.ArrayLike) -> FloatArray:
    """Phase from steps of -3a, -a, a, 3a, for any a that is the same throughout, 0 < a < 90 degrees.

    With p = 3 (I2 - I3) - (I1 - I4) and q = (I2 - I3) + (I1 - I4),
    |tan phi| = sqrt(p q) / ((I2 + I3) - (I1 + I4)); the sign of sin phi is that of I2 - I3.
    Noise disturbs it least near a = 55 degrees. Carre 1966; raises like `four_step`.

    Parameters
    ----------
    frames : (4, ...) float64
        Intensities, any unit.

    Returns
    -------
    (...) float64, radians in (-pi, pi]
        Where noise makes p q negative, |sin phi| is below that noise, and taken as 0.
    """
    values = _checked_frames(frames, "carre", 4)
    i1, i2, i3, i4 = values
    inner, outer = i2 - i3, i1 - i4
    sine = np.copysign(_root((3.0 * inner - outer) * (inner + outer)), inner)
    return _angle(sine, (i2 + i3) - (i1 + i4), values)


def stoilov(frames: npt.ArrayLike) -> FloatArray:
    """Phase from steps of -2a, -a, 0, a, 2a, for any a that is the same throughout, 0 < a < 180 degrees.

    tan phi = 2 (I2 - I4) sin a / (2 I3 - I1 - I5), where cos a = (I1 - I5) / (2 (I2 - I4)).
    Stoilov 1997; raises like `four_step`.

    Parameters
    ----------
    frames : (5, ...) float64
        Intensities, any unit.

    Returns
    -------
    (...) float64, radians in (-pi, pi]
        Where noise makes |cos a| larger than 1, |sin phi| is below that noise, and taken as 0.
    """
    values = _checked_frames(frames, "stoilov", 5)
    i1, i2, i3, i4, i5 = values
    inner, outer = 2.0 * (i2 - i4), i1 - i5
    # inner * sin a, written so that nothing is divided by an inner that vanishes with sin phi
    sine = np.copysign(_root((inner - outer) * (inner + outer)), inner)
    return _angle(sine, 2.0 * i3 - i1 - i5, values)


def _bucket_sums(frames: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The sums n B/2 times sin phi and cos phi, for n equal steps over one period."""
    steps = 2.0 * math.pi * np.arange(len(frames)) / len(frames)
    return -np.tensordot(np.sin(steps), frames, axes=1), np.tensordot(np.cos(steps), frames, axes=1)


def n_bucket(frames: npt.ArrayLike) -> FloatArray:
    """Phase from n equal steps alpha_k = 2 pi k / n, k = 0 ... n - 1, n >= 3.

    tan phi = - sum I_k sin alpha_k / sum I_k cos alpha_k. With n = 4 it is `four_step`. Bruning 1974.

    Parameters
    ----------
    frames : (n, ...) float64
        Intensities, any unit.

    Returns
    -------
    (...) float64, radians in (-pi, pi]

    Raises
    ------
    ValueError
        If there are fewer than 3 frames, or they are complex.
    """
    values = _checked_frames(frames, "n_bucket")
    sine, cosine = _bucket_sums(values)
    return _angle(sine, cosine, values, gain=len(values))


def least_squares(frames: npt.ArrayLike, steps: npt.ArrayLike) -> FloatArray:
    """Phase from known steps of any size: least squares on A + C cos alpha_k + S sin alpha_k.

    Greivenkamp 1984.

    Parameters
    ----------
    frames : (n, ...) float64
        Intensities, any unit.
    steps : (n,) float64, radians
        alpha_k, three of them different (modulo 2 pi) at least.

    Returns
    -------
    (...) float64, radians in (-pi, pi]

    Raises
    ------
    ValueError
        If there are fewer than 3 frames, they are complex, the steps are not one finite number a frame, or
        fewer than three steps differ.
    """
    values = _checked_frames(frames, "least_squares")
    alpha = np.asarray(steps, dtype=np.float64)
    if alpha.shape != (len(values),) or not np.isfinite(alpha).all():
        raise ValueError(
            f"least_squares steps: expected {len(values)} finite angles in radians, one a frame, "
            f"got {alpha.tolist()}"
        )
    model = np.column_stack([np.ones_like(alpha), np.cos(alpha), np.sin(alpha)])
    if np.linalg.matrix_rank(model) < 3:
        raise ValueError(f"least_squares steps: expected three different angles, got {alpha.tolist()}")
    _, to_cosine, to_sine = np.linalg.pinv(model)
    sine, cosine = -np.tensordot(to_sine, values, axes=1), np.tensordot(to_cosine, values, axes=1)
    return _angle(sine, cosine, values, gain=float(np.abs(to_sine).sum() + np.abs(to_cosine).sum()))


def modulation(frames: npt.ArrayLike) -> FloatArray:
    """Visibility B / A of the fringes, from n equal steps 2 pi k / n, n >= 3.

    Creath 1988; raises like `n_bucket`.

    Parameters
    ----------
    frames : (n, ...) float64
        Intensities, any unit.

    Returns
    -------
    (...) float64
        NaN where the mean intensity is not positive.
    """
    values = _checked_frames(frames, "modulation")
    sine, cosine = _bucket_sums(values)
    total = values.sum(axis=0)
    lit = np.where(total > 0.0, total, np.nan)
    return np.asarray(2.0 * np.hypot(sine, cosine) / lit, dtype=np.float64)


def wrap(phase: npt.ArrayLike) -> FloatArray:
    """Phase modulo 2 pi.

    Parameters
    ----------
    phase : float64, radians, any shape

    Returns
    -------
    float64, radians in (-pi, pi], shape of `phase`
    """
    turn = 2.0 * math.pi
    folded = np.fmod(np.asarray(phase, dtype=np.float64), turn)
    folded = np.where(folded > math.pi, folded - turn, folded)
    return np.where(folded <= -math.pi, folded + turn, folded)


def _checked_map(
    values: npt.ArrayLike, mask: npt.ArrayLike | None, what: str
) -> tuple[FloatArray, BoolArray]:
    """A map, and which of its pixels count."""
    pixels = np.asarray(values, dtype=np.float64)
    if pixels.ndim != 2:
        raise ValueError(f"{what}: expected a map of shape (rows, columns), got shape {pixels.shape}")
    valid = np.isfinite(pixels)
    if mask is not None:
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
    """Continuous phase of a wrapped map.

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


def height(phase: npt.ArrayLike, wavelength: float) -> FloatArray:
    """Height of a reflecting surface: phase * wavelength / (4 pi), towards the light.

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
    scale = checked_wavelength(wavelength) / (4.0 * math.pi)
    return np.asarray(np.asarray(phase, dtype=np.float64) * scale, dtype=np.float64)


def synthetic_wavelength(wavelength1: float, wavelength2: float) -> float:
    """Wavelength of the beat of two others: l1 l2 / |l1 - l2| (Cheng 1984).

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
    """Height of a reflecting surface from its wrapped phases at two wavelengths.

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
    fine, other = np.asarray(phase1, dtype=np.float64), np.asarray(phase2, dtype=np.float64)
    shorter = float(wavelength1)
    if wavelength1 > wavelength2:
        fine, other, shorter = other, fine, float(wavelength2)
    coarse = wrap(fine - other) * (beat / shorter)
    order = np.rint((coarse - fine) / (2.0 * math.pi))
    return height(fine + 2.0 * math.pi * order, shorter)


def remove_mean(values: npt.ArrayLike, mask: npt.ArrayLike | None = None) -> FloatArray:
    """A map without its piston.

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
    """A map without its piston and tilt: minus the plane that fits it best in least squares.

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
