"""Materials: complex refractive index n + i kappa over the vacuum wavelength.

With fields as exp(+i k n x), kappa > 0 absorbs. Outside the range that was measured there is no index.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, described, nm, um, value_text
from fringetrace.optics.materials.dispersion import Curve, IndexFormula, IndexTable

# Wavelengths in metres are rounded: the ends of a range belong to it.
SLACK = 1e-12


@dataclass(frozen=True)
class Material:
    """Material: a complex refractive index with a name. Equal indices make equal materials.

    Parameters
    ----------
    name : str
    n : Formula or Table
        The real part.
    kappa : Formula or Table, optional
        The imaginary part, 0 or more; None: transparent.
    source : str
        Where the numbers were published.

    Raises
    ------
    ValueError
        If n and kappa are known at no common wavelength.
    """

    name: str = field(compare=False)
    n: Curve
    kappa: Curve | None = None
    source: str = field(default="", compare=False)

    def __repr__(self) -> str:
        index = getattr(self.n, "form", "tabulated") if self.dispersive else value_text(self.index(1.0))
        reach = "" if self.range is None else f"{self.range[0] / um:.4g} to {self.range[1] / um:.4g} um"
        return described(self, value_text(self.name), index, reach, "" if self.kappa is None else "absorbs")

    def __post_init__(self) -> None:
        if self.range is not None and self.range[0] > self.range[1]:
            assert self.kappa is not None
            raise ValueError(
                f"{self.name}: expected n and kappa over common wavelengths, "
                f"got {self.n.range} um and {self.kappa.range} um"
            )

    @property
    def dispersive(self) -> bool:
        """Whether the index may depend on the wavelength."""
        return any(
            not (isinstance(curve, IndexFormula) and curve.form == "constant")
            for curve in (self.n, self.kappa)
            if curve is not None
        )

    @property
    def range(self) -> tuple[float, float] | None:
        """Wavelength range of the index, metres: first and last; None: any."""
        ranges = [
            curve.range for curve in (self.n, self.kappa) if curve is not None and curve.range is not None
        ]
        if not ranges:
            return None
        return max(low for low, _ in ranges) * um, min(high for _, high in ranges) * um

    def index(self, wavelength: npt.ArrayLike) -> ComplexArray:
        """Complex refractive index at wavelengths.

        Parameters
        ----------
        wavelength : float64, metres, any shape
            Vacuum wavelength.

        Returns
        -------
        complex128, shape of `wavelength` (a scalar for a scalar)

        Raises
        ------
        ValueError
            If a wavelength is not positive, is outside the measured range, or has no index by the formula.
        """
        w = np.asarray(wavelength, dtype=np.float64)
        limits = self.range
        low, high = (0.0, math.inf) if limits is None else limits
        outside = ~((w > 0.0) & (w >= low * (1.0 - SLACK)) & (w <= high * (1.0 + SLACK)) & (w < math.inf))
        if outside.any():
            known = (
                "a positive wavelength" if limits is None else f"{_nanometres(low)} to {_nanometres(high)}"
            )
            raise ValueError(
                f"{self.name}: expected {known}, got {_nanometres(w[outside].flat[0])} (not extrapolated)"
            )
        value = self.n.at(w / um) + 1j * (0.0 if self.kappa is None else self.kappa.at(w / um))
        wrong = ~(np.isfinite(value) & (value.imag >= 0.0))
        if wrong.any():
            raise ValueError(
                f"{self.name}: expected a finite index with kappa >= 0, "
                f"got {value[wrong].flat[0]} at {_nanometres(w[wrong].flat[0])}"
            )
        return np.complex128(value) if w.ndim == 0 else value  # type: ignore[return-value]


def _nanometres(wavelength: float) -> str:
    return f"{wavelength / nm:.7g} nm"


def _in_um(limits: tuple[float, float] | None) -> tuple[float, float] | None:
    return None if limits is None else (limits[0] / um, limits[1] / um)


def constant(n: complex, name: str = "") -> Material:
    """Material of the same index at every wavelength.

    Parameters
    ----------
    n : complex
        n + i kappa; kappa >= 0 (a negative one would amplify: the other sign convention has n - i kappa).
    name : str

    Returns
    -------
    Material

    Raises
    ------
    ValueError
        If it is not finite, zero, or has a negative part.
    """
    value = complex(n)
    if not (np.isfinite(value) and value.real >= 0.0 and value.imag >= 0.0 and value != 0.0):
        raise ValueError(f"constant index {name}: expected n + i kappa with n, kappa >= 0, got {n!r}")
    kappa = IndexFormula("constant", (value.imag,)) if value.imag > 0.0 else None
    text = f"n={value.real:.6g}" + (f"+{value.imag:.6g}i" if kappa else "")
    return Material(name or text, IndexFormula("constant", (value.real,)), kappa)


def cauchy(
    a: float,
    *terms: float,
    name: str = "Cauchy",
    range: tuple[float, float] | None = None,
    source: str = "",
) -> Material:
    """Material by Cauchy's formula n = a + b / w^2 + c / w^4 + ...

    Parameters
    ----------
    a : float
    terms : float, m^2, m^4, ...
        b, c, and so on; 8800 nm^2 is ``8800 * nm**2``.
    name : str
    range : (float, float), metres, optional
        Where it was measured.
    source : str

    Returns
    -------
    Material
    """
    powers = [(term * um ** -(2 * k + 2), -(2.0 * k + 2.0)) for k, term in enumerate(terms)]
    coefficients = (float(a), *(float(number) for pair in powers for number in pair))
    return Material(name, IndexFormula("formula 5", coefficients, _in_um(range)), source=source)


def sellmeier(
    strengths: Sequence[float],
    *,
    lengths: Sequence[float] | None = None,
    squares: Sequence[float] | None = None,
    offset: float = 0.0,
    name: str = "Sellmeier",
    range: tuple[float, float] | None = None,
    source: str = "",
) -> Material:
    """Material by Sellmeier's formula n^2 = 1 + offset + sum of B w^2 / (w^2 - C).

    Parameters
    ----------
    strengths : sequence of float
        B.
    lengths : sequence of float, metres
        The resonances, C = length^2; or
    squares : sequence of float, m^2
        C, as glass catalogues print it (in um^2: ``0.006 * um**2``).
    offset : float
    name : str
    range : (float, float), metres, optional
        Where it was measured.
    source : str

    Returns
    -------
    Material

    Raises
    ------
    ValueError
        If not exactly one of `lengths` and `squares` is given, with one number a strength.
    """
    given = [values for values in (lengths, squares) if values is not None]
    if len(given) != 1 or len(given[0]) != len(strengths):
        raise ValueError(
            f"{name}: expected lengths or squares, one for each of {len(strengths)} strengths, "
            f"got lengths={lengths}, squares={squares}"
        )
    form, scale = ("formula 1", um) if squares is None else ("formula 2", um**2)
    pairs = [float(number) for b, c in zip(strengths, given[0], strict=True) for number in (b, c / scale)]
    return Material(name, IndexFormula(form, (float(offset), *pairs), _in_um(range)), source=source)


def tabulated(
    wavelength: npt.ArrayLike,
    n: npt.ArrayLike,
    kappa: npt.ArrayLike | None = None,
    *,
    name: str = "table",
    source: str = "",
) -> Material:
    """Material by linear interpolation of measured n and kappa.

    Parameters
    ----------
    wavelength : (m,) float64, metres
        Rising.
    n, kappa : (m,) float64
    name : str
    source : str

    Returns
    -------
    Material

    Raises
    ------
    ValueError
        If lengths differ, wavelengths do not rise, or values are not finite.
    """

    def numbers(values: npt.ArrayLike) -> tuple[float, ...]:
        return tuple(np.asarray(values, dtype=np.float64).tolist())

    w = numbers(np.asarray(wavelength, dtype=np.float64) / um)
    absorption = None if kappa is None else IndexTable(w, numbers(kappa))
    return Material(name, IndexTable(w, numbers(n)), absorption, source)


def absorbing(material: Material, strength: float, length: float) -> Material:
    """Material with an exponential absorption, kappa = strength exp(-w / length).

    Parameters
    ----------
    material : Material
    strength : float
    length : float, metres

    Returns
    -------
    Material
    """
    kappa = IndexFormula("exponential", (float(strength), length / um), material.n.range)
    return Material(material.name, material.n, kappa, material.source)
