"""Phase stepping: interferogram frames to wrapped phase.

Frames are I_k = A + B cos(phi + alpha_k), with the steps alpha_k added to the reference arm. Phases that
cannot be determined (no modulation above rounding, frames that are not finite, or masked as in numpy.ma)
are NaN.

References
----------
- Bruning 1974: J. H. Bruning et al., Applied Optics 13, 2693.
- Carre 1966: P. Carre, Metrologia 2, 13.
- Creath 1988: K. Creath, Progress in Optics 26, 349.
- Greivenkamp 1984: J. E. Greivenkamp, Optical Engineering 23, 350.
- Hariharan 1987: P. Hariharan, B. F. Oreb, T. Eiju, Applied Optics 26, 2504.
- Schwider 1983: J. Schwider et al., Applied Optics 22, 3421.
- Stoilov 1997: G. Stoilov, T. Dragostinov, Optics and Lasers in Engineering 28, 61.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, filled

# Sums of frames that cancel leave a few units in the last place of their largest term.
ROUNDING = 4.0 * float(np.finfo(np.float64).eps)
# The largest sum of |weights| in the algorithms with fixed steps (Carre: 3 + 3 + 1 + 1).
FIXED_GAIN = 8.0


def _checked_frames(frames: npt.ArrayLike, what: str, count: int | None = None) -> FloatArray:
    """Real frames along the first axis: `count` of them, or 3 or more."""
    if np.iscomplexobj(frames):
        raise ValueError(f"{what} frames: expected real intensities, got complex numbers; take |E|**2")
    values = filled(frames)
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
    """Phase from four steps of 0, 90, 180, 270 degrees: tan phi = (I4 - I2) / (I1 - I3).

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
    """Phase from three steps of -120, 0, 120 degrees: tan phi = sqrt(3) (I1 - I3) / (2 I2 - I1 - I3).

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
    """Phase from five steps of -180 to 180 degrees (Hariharan): tan phi = 2 (I2 - I4) / (2 I3 - I1 - I5).

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
    """Phase by Carre's algorithm from steps of -3a, -a, a, 3a, for any constant 0 < a < 90 degrees.

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
    """Phase by Stoilov's algorithm from steps of -2a, -a, 0, a, 2a, for any constant 0 < a < 180 degrees.

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
    """Phase from known steps of any size, by least squares on A + C cos alpha_k + S sin alpha_k.

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
    alpha = filled(steps)
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
    """Fringe visibility B / A from n equal steps 2 pi k / n, n >= 3.

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
