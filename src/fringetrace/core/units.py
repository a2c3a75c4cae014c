"""Units: lengths and angles parsed from text, wavelength checks, optical path to phase and back."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]

nm: float = 1e-9
um: float = 1e-6
mm: float = 1e-3
degree: float = math.pi / 180.0

LENGTHS: dict[str, float] = {
    "pm": 1e-12,
    "nm": 1e-9,
    "um": 1e-6,
    "µm": 1e-6,  # micro sign
    "μm": 1e-6,  # Greek mu
    "mm": 1e-3,
    "cm": 1e-2,
    "m": 1.0,
    "km": 1e3,
    "in": 0.0254,
}
ANGLES: dict[str, float] = {
    "deg": degree,
    "°": degree,
    "degree": degree,
    "degrees": degree,
    "rad": 1.0,
    "mrad": 1e-3,
    "urad": 1e-6,
    "arcmin": degree / 60.0,
    "arcsec": degree / 3600.0,
}
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s]\S*)\s*")

# What lengths are shown in.
SHOWN: tuple[tuple[str, float], ...] = (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9), ("pm", 1e-12))


def filled(values: npt.ArrayLike, dtype: npt.DTypeLike = np.float64) -> Array:
    """Numbers as an array, with NaN for masked values of numpy.ma.

    Parameters
    ----------
    values : array-like, any shape
        `numpy.asarray` alone would take what lies under a mask for a number.
    dtype : float64 or complex128

    Returns
    -------
    of `dtype`, shape of `values`
        The same array if it is one of that type without a mask.
    """
    if type(values) is np.ndarray:
        return np.asarray(values, dtype=dtype)
    masked: Any = np.ma.asarray(values, dtype=dtype)
    return np.asarray(masked.filled(np.nan) if np.ma.is_masked(masked) else masked.data)


def unit_of(length: float) -> tuple[str, float]:
    """Unit in which a length has few digits before the decimal point.

    Parameters
    ----------
    length : float, metres

    Returns
    -------
    name : str
    metres : float
        How long one of it is.
    """
    size = abs(length)
    for name, metres in SHOWN:
        if size >= metres:
            return name, metres
    return SHOWN[-1] if size > 0.0 else SHOWN[0]


def _parse(text: str, what: str, units: dict[str, float]) -> float:
    """A number with a unit of one kind, in the SI unit."""
    match = _QUANTITY.fullmatch(text) if isinstance(text, str) else None
    if match is None or match[2] not in units:
        example = next(iter(units))
        raise ValueError(
            f"{what}: expected a number and a unit such as '1 {example}' "
            f"(units: {', '.join(units)}), got {text!r}"
        )
    value = float(match[1]) * units[match[2]]
    if not math.isfinite(value):
        raise ValueError(f"{what}: expected a finite number, got {text!r}")
    return value


def checked_length(value: float, what: str) -> float:
    """Checked finite length in metres.

    Parameters
    ----------
    value : float, metres
    what : str
        The name used in the error message.

    Returns
    -------
    float, metres

    Raises
    ------
    ValueError
        If it is not a positive finite number.
    """
    if isinstance(value, str) or not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{what}: expected a positive length in metres, got {value!r}")
    return float(value)


def checked_lengths(values: npt.ArrayLike, what: str) -> FloatArray:
    """Checked finite lengths in metres, as an array.

    Parameters
    ----------
    values : float64, metres, any shape
    what : str
        The name used in the error message.

    Returns
    -------
    float64, metres, shape of `values`

    Raises
    ------
    ValueError
        If one is not a positive finite number.
    """
    lengths = filled(values)
    wrong = ~((lengths > 0.0) & (lengths < math.inf))
    if wrong.any():
        raise ValueError(f"{what}: expected positive lengths in metres, got {lengths[wrong].flat[0]}")
    return lengths


def checked_angles(values: npt.ArrayLike, what: str) -> FloatArray:
    """Checked finite angles in radians, as an array.

    Parameters
    ----------
    values : float64, radians, any shape
    what : str
        The name used in the error message.

    Returns
    -------
    float64, radians, shape of `values`

    Raises
    ------
    ValueError
        If one is not finite.
    """
    angles = filled(values)
    wrong = ~np.isfinite(angles)
    if wrong.any():
        raise ValueError(f"{what}: expected finite angles in radians, got {angles[wrong].flat[0]}")
    return angles


def checked_whole(value: int, least: int, what: str) -> int:
    """Checked whole number, as a Python int.

    Parameters
    ----------
    value : int
    least : int
    what : str
        The name used in the error message.

    Returns
    -------
    int

    Raises
    ------
    ValueError
        If it is no integer, or below `least`.
    """
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise ValueError(f"{what}: expected a whole number of at least {least}, got {value!r}")
    return int(value)


def parse_length(text: str, what: str = "length") -> float:
    """Length in metres, parsed from text with a unit.

    Parameters
    ----------
    text : str
        A number and a unit, such as ``"633 nm"``.
    what : str
        The name used in the error message.

    Returns
    -------
    float, metres

    Raises
    ------
    ValueError
        If there is no finite number, no unit, or an unknown unit.
    """
    return _parse(text, what, LENGTHS)


def parse_angle(text: str, what: str = "angle") -> float:
    """Angle in radians, parsed from text with a unit; raises like `parse_length`.

    Parameters
    ----------
    text : str
        A number and a unit, such as ``"20 deg"``.
    what : str
        The name used in the error message.

    Returns
    -------
    float, radians
    """
    return _parse(text, what, ANGLES)


def unit_length(unit: str | None, what: str = "unit") -> float:
    """Metres per named length unit.

    Parameters
    ----------
    unit : str or None
        Name of the unit, such as ``"um"``. None is refused: mesh files carry no unit.
    what : str
        The name used in the error message.

    Returns
    -------
    float, metres

    Raises
    ------
    ValueError
        If the unit is missing or unknown.
    """
    if unit not in LENGTHS:
        raise ValueError(f"{what}: expected one of {', '.join(LENGTHS)}, got {unit!r}")
    return LENGTHS[unit]


def checked_wavelength(wavelength: float) -> float:
    """Checked wavelength in metres: finite and positive.

    Parameters
    ----------
    wavelength : float, metres
        Vacuum wavelength.

    Returns
    -------
    float, metres

    Raises
    ------
    ValueError
        If it is not a positive finite number.
    """
    if isinstance(wavelength, (str, bytes)):
        raise ValueError(f"wavelength: expected metres, got text {wavelength!r}; see parse_length")
    value = float(wavelength)
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"wavelength: expected a positive length in metres, got {wavelength!r}")
    return value


def wavenumber(wavelength: float) -> float:
    """Vacuum wavenumber k = 2 pi / wavelength.

    Parameters
    ----------
    wavelength : float, metres

    Returns
    -------
    float, rad/m
    """
    return 2.0 * math.pi / checked_wavelength(wavelength)


def path_phase(length: FloatArray | float, wavelength: float) -> FloatArray:
    """Phase of an optical path, reduced modulo the wavelength before scaling.

    Parameters
    ----------
    length : float64, metres, any shape
        Optical path length.
    wavelength : float, metres

    Returns
    -------
    float64, radians in [-pi, pi], shape of `length`
        The remainder is exact (IEEE), so a phase costs no digits on long paths.
    """
    period = checked_wavelength(wavelength)
    fold = np.fmod(filled(length), period)
    fold = np.where(np.abs(fold) > 0.5 * period, fold - np.copysign(period, fold), fold)
    return np.asarray(2.0 * math.pi * (fold / period), dtype=np.float64)


def phase_path(phase: FloatArray | float, wavelength: float) -> FloatArray:
    """Optical path of a phase: phase * wavelength / (2 pi).

    Parameters
    ----------
    phase : float64, radians, any shape
    wavelength : float, metres

    Returns
    -------
    float64, metres, shape of `phase`
    """
    turns = filled(phase) / (2.0 * math.pi)
    return np.asarray(turns * checked_wavelength(wavelength), dtype=np.float64)


def checked_wavelengths(wavelengths: npt.ArrayLike) -> FloatArray:
    """Checked wavelengths in metres, as an array.

    Parameters
    ----------
    wavelengths : float or (w,) array-like, metres

    Returns
    -------
    (w,) float64, metres

    Raises
    ------
    ValueError
        If there are none, or one is not a positive finite number.
    """
    values = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
    if values.ndim != 1 or values.size == 0:
        raise ValueError(f"wavelengths: expected numbers of shape (w,), got shape {values.shape}")
    for value in values[~(np.isfinite(values) & (values > 0.0))][:1]:
        checked_wavelength(value)
    return values
