"""Dispersion formulas and tables: refractive index over the vacuum wavelength.

Wavelengths are in micrometres here, as in all published coefficients; `materials` has metres.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fringetrace.core import FloatArray, short_repr

Coefficients = tuple[float, ...]


def _pairs(c: Coefficients) -> list[tuple[float, float]]:
    return list(zip(c[0::2], c[1::2], strict=True))


def _constant(w: FloatArray, c: Coefficients) -> FloatArray:
    """Constant c0."""
    return np.full_like(w, c[0])


def _sellmeier(w: FloatArray, c: Coefficients) -> FloatArray:
    """Sellmeier formula n^2 = 1 + c0 + sum of ci w^2 / (w^2 - cj^2) (formula 1)."""
    return np.sqrt(1.0 + c[0] + sum(b * w**2 / (w**2 - r**2) for b, r in _pairs(c[1:])))


def sellmeier2(w: FloatArray, c: Coefficients) -> FloatArray:
    """Sellmeier formula n^2 = 1 + c0 + sum of ci w^2 / (w^2 - cj), as in glass catalogues (formula 2)."""
    return np.sqrt(1.0 + c[0] + sum(b * w**2 / (w**2 - r) for b, r in _pairs(c[1:])))


def polynomial(w: FloatArray, c: Coefficients) -> FloatArray:
    """Polynomial n^2 = c0 + sum of ci w^cj (formula 3)."""
    return np.sqrt(c[0] + sum(b * w**p for b, p in _pairs(c[1:])))


def mixed(w: FloatArray, c: Coefficients) -> FloatArray:
    """Dispersion formula n^2 = c0 + up to two of ci w^cj / (w^2 - ck^cl) + sum of ci w^cj (formula 4)."""
    square = np.full_like(w, c[0])
    poles = min(len(c) - 1, 8) // 4 * 4
    for first in range(1, poles + 1, 4):
        b, p, r, q = c[first : first + 4]
        square += b * w**p / (w**2 - r**q)
    return np.sqrt(square + sum(b * w**p for b, p in _pairs(c[1 + poles :])))


def _cauchy(w: FloatArray, c: Coefficients) -> FloatArray:
    """Cauchy formula n = c0 + sum of ci w^cj (formula 5)."""
    return np.asarray(c[0] + sum(b * w**p for b, p in _pairs(c[1:])), dtype=np.float64)


def gas(w: FloatArray, c: Coefficients) -> FloatArray:
    """Dispersion formula of gases, n = 1 + c0 + sum of ci / (cj - w^-2) (formula 6)."""
    return np.asarray(1.0 + c[0] + sum(b / (r - w**-2) for b, r in _pairs(c[1:])), dtype=np.float64)


def herzberger(w: FloatArray, c: Coefficients) -> FloatArray:
    """Herzberger formula n = c0 + c1 L + c2 L^2 + c3 w^2 + ..., L = 1 / (w^2 - 0.028) (formula 7)."""
    pole = 1.0 / (w**2 - 0.028)
    even = sum(b * w ** (2 * k + 2) for k, b in enumerate(c[3:]))
    return np.asarray(c[0] + c[1] * pole + c[2] * pole**2 + even, dtype=np.float64)


def retro(w: FloatArray, c: Coefficients) -> FloatArray:
    """Dispersion formula (n^2 - 1) / (n^2 + 2) = c0 + c1 w^2 / (w^2 - c2) + c3 w^2 (formula 8)."""
    ratio = c[0] + c[1] * w**2 / (w**2 - c[2]) + c[3] * w**2
    return np.sqrt((1.0 + 2.0 * ratio) / (1.0 - ratio))


def exotic(w: FloatArray, c: Coefficients) -> FloatArray:
    """Dispersion formula n^2 = c0 + c1 / (w^2 - c2) + c3 (w - c4) / ((w - c4)^2 + c5) (formula 9)."""
    return np.sqrt(c[0] + c[1] / (w**2 - c[2]) + c[3] * (w - c[4]) / ((w - c[4]) ** 2 + c[5]))


def exponential(w: FloatArray, c: Coefficients) -> FloatArray:
    """Exponential c0 exp(-w / c1), the absorption of melanin."""
    return np.asarray(c[0] * np.exp(-w / c[1]), dtype=np.float64)


# By name: the function, and the numbers of coefficients that it takes.
FORMS: dict[str, tuple[Callable[[FloatArray, Coefficients], FloatArray], range]] = {
    "constant": (_constant, range(1, 2)),
    "formula 1": (_sellmeier, range(1, 18, 2)),
    "formula 2": (sellmeier2, range(1, 18, 2)),
    "formula 3": (polynomial, range(1, 18, 2)),
    "formula 4": (mixed, range(1, 18, 2)),
    "formula 5": (_cauchy, range(1, 18, 2)),
    "formula 6": (gas, range(1, 18, 2)),
    "formula 7": (herzberger, range(3, 7)),
    "formula 8": (retro, range(4, 5)),
    "formula 9": (exotic, range(6, 7)),
    "exponential": (exponential, range(2, 3)),
}


@dataclass(frozen=True)
class IndexFormula:
    """Dispersion curve by one of `FORMS`; numbers 1 to 9 are those of refractiveindex.info.

    Parameters
    ----------
    form : str
    coefficients : tuple of float
        For wavelengths in micrometres.
    range : (float, float) or None, micrometres
        Where it was measured; None: anywhere.

    Raises
    ------
    ValueError
        If the form is unknown, or takes another number of coefficients.
    """

    form: str
    coefficients: Coefficients
    range: tuple[float, float] | None = None

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if self.form not in FORMS:
            raise ValueError(f"dispersion: expected one of {', '.join(FORMS)}, got {self.form!r}")
        allowed, got = FORMS[self.form][1], len(self.coefficients)
        if got not in allowed:
            numbers = ", ".join(str(number) for number in allowed)
            raise ValueError(f"dispersion {self.form}: expected {numbers} coefficients, got {got}")
        if not np.isfinite(self.coefficients).all():
            raise ValueError(f"dispersion {self.form}: expected finite coefficients, got {self.coefficients}")
        checked_range(self.range, f"dispersion {self.form}")

    def at(self, wavelength: FloatArray) -> FloatArray:
        """Value at wavelengths in micrometres, any shape; NaN where the formula has none."""
        with np.errstate(all="ignore"):
            return np.asarray(FORMS[self.form][0](wavelength, self.coefficients), dtype=np.float64)


@dataclass(frozen=True)
class IndexTable:
    """Dispersion curve by linear interpolation between measured points.

    Parameters
    ----------
    wavelength : tuple of float, micrometres
        Rising, two or more.
    value : tuple of float
        As many.

    Raises
    ------
    ValueError
        If wavelengths do not rise from above 0, or values are not as many and finite.
    """

    wavelength: tuple[float, ...]
    value: tuple[float, ...]

    __repr__ = short_repr

    def __post_init__(self) -> None:
        w, v = np.array(self.wavelength), np.array(self.value)
        if len(w) != len(v) or len(w) < 2:
            raise ValueError(
                f"table: expected as many values as wavelengths, 2 or more, got {len(v)} and {len(w)}"
            )
        if not (np.isfinite(w).all() and w[0] > 0.0 and (np.diff(w) > 0.0).all()):
            bad = 1 + int(np.argmin(np.diff(w) > 0.0)) if np.isfinite(w).all() and w[0] > 0.0 else 0
            raise ValueError(
                f"table: expected wavelengths that rise from above 0, got {w[bad]:g} in row {bad}"
            )
        if not np.isfinite(v).all():
            raise ValueError(f"table: expected finite values, got {v[~np.isfinite(v)][0]}")

    @property
    def range(self) -> tuple[float, float]:
        """First and last wavelength, micrometres."""
        return self.wavelength[0], self.wavelength[-1]

    def at(self, wavelength: FloatArray) -> FloatArray:
        """Value at wavelengths in micrometres, any shape."""
        return np.asarray(np.interp(wavelength, self.wavelength, self.value), dtype=np.float64)


Curve = IndexFormula | IndexTable


def checked_range(limits: tuple[float, float] | None, what: str) -> None:
    """Checked wavelength range, from a positive wavelength to a longer one; else ValueError.

    Parameters
    ----------
    limits : (float, float) or None
    what : str
        The name used in the error message.

    Raises
    ------
    ValueError
        If it is none.
    """
    if limits is not None and not 0.0 < limits[0] < limits[1] < np.inf:
        raise ValueError(f"{what}: expected a range from a positive wavelength to a longer one, got {limits}")
