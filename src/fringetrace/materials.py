"""Refractive indices n + i kappa over the vacuum wavelength: formulas, tables, and materials by name.

With fields as exp(+i k n x), kappa > 0 absorbs. Outside the range that was measured there is no index.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Complex
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fringetrace import catalogue
from fringetrace.dispersion import Curve, Formula, Table
from fringetrace.waves import ComplexArray, nm, um

# Wavelengths in metres are rounded: the ends of a range belong to it.
SLACK = 1e-12


@dataclass(frozen=True)
class Material:
    """A refractive index with a name.

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

    name: str
    n: Curve
    kappa: Curve | None = None
    source: str = ""

    def __post_init__(self) -> None:
        if self.range is not None and self.range[0] > self.range[1]:
            assert self.kappa is not None
            raise ValueError(
                f"{self.name}: expected n and kappa over common wavelengths, "
                f"got {self.n.range} um and {self.kappa.range} um"
            )

    @property
    def dispersive(self) -> bool:
        """Whether the index may change with the wavelength."""
        return any(
            not (isinstance(curve, Formula) and curve.form == "constant")
            for curve in (self.n, self.kappa)
            if curve is not None
        )

    @property
    def range(self) -> tuple[float, float] | None:
        """First and last wavelength with an index, metres; None: any."""
        ranges = [
            curve.range for curve in (self.n, self.kappa) if curve is not None and curve.range is not None
        ]
        if not ranges:
            return None
        return max(low for low, _ in ranges) * um, min(high for _, high in ranges) * um

    def index(self, wavelength: npt.ArrayLike) -> ComplexArray:
        """Complex refractive index.

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
    """The same index at every wavelength.

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
    kappa = Formula("constant", (value.imag,)) if value.imag > 0.0 else None
    text = f"n={value.real:.6g}" + (f"+{value.imag:.6g}i" if kappa else "")
    return Material(name or text, Formula("constant", (value.real,)), kappa)


def cauchy(
    a: float,
    *terms: float,
    name: str = "Cauchy",
    range: tuple[float, float] | None = None,
    source: str = "",
) -> Material:
    """Cauchy's n = a + b / w^2 + c / w^4 + ...

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
    return Material(name, Formula("formula 5", coefficients, _in_um(range)), source=source)


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
    """Sellmeier's n^2 = 1 + offset + sum of B w^2 / (w^2 - C).

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
    return Material(name, Formula(form, (float(offset), *pairs), _in_um(range)), source=source)


def tabulated(
    wavelength: npt.ArrayLike,
    n: npt.ArrayLike,
    kappa: npt.ArrayLike | None = None,
    *,
    name: str = "table",
    source: str = "",
) -> Material:
    """An index through measured points; n and kappa each run straight from one point to the next.

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
    absorption = None if kappa is None else Table(w, numbers(kappa))
    return Material(name, Table(w, numbers(n)), absorption, source)


def absorbing(material: Material, strength: float, length: float) -> Material:
    """A material with an absorption that falls off, kappa = strength exp(-w / length).

    Parameters
    ----------
    material : Material
    strength : float
    length : float, metres

    Returns
    -------
    Material
    """
    kappa = Formula("exponential", (float(strength), length / um), material.n.range)
    return Material(material.name, material.n, kappa, material.source)


def load(path: str | Path, *, unit: str | None = None, name: str | None = None) -> Material:
    """A material from a file.

    Parameters
    ----------
    path : str or Path
        ``.csv`` (or ``.txt``): columns wavelength, n and, optionally, kappa. ``.yml`` (or ``.yaml``): a
        page of refractiveindex.info. Tables run straight from point to point.
    unit : str, optional
        Unit of a CSV's wavelengths, such as ``"um"``, unless its first line says it: ``wavelength (nm),n,k``.
    name : str, optional
        Default: that of the file.

    Returns
    -------
    Material

    Raises
    ------
    FileNotFoundError
    ValueError
        If the file is not of these; says file, key, what was expected and what was found.
    """
    file = Path(path)
    if file.suffix.lower() in (".yml", ".yaml"):
        if unit is not None:
            raise ValueError(f"{file}: expected no unit (such pages are in micrometres), got {unit!r}")
        n, kappa, source = catalogue.read_yaml(file)
    elif file.suffix.lower() in (".csv", ".txt"):
        n, kappa, source = catalogue.read_csv(file, unit)
    else:
        raise ValueError(f"{file}: expected a .csv, .txt, .yml or .yaml file, got {file.suffix!r}")
    if n is None:
        raise ValueError(f"{file}: expected a refractive index n, got kappa alone")
    return Material(name or file.stem, n, kappa, source)


VACUUM = constant(1.0, "vacuum")
AIR = Material(
    "air",
    Formula("formula 6", (0.0, 0.05792105, 238.0185, 0.00167917, 57.362), (0.23, 1.69)),
    source="P. E. Ciddor, Appl. Opt. 35 (1996) 1566: dry, 15 C, 101325 Pa, 450 ppm CO2",
)
WATER = sellmeier(
    (5.684027565e-1, 1.726177391e-1, 2.086189578e-2, 1.130748688e-1),
    squares=tuple(c * um**2 for c in (5.101829712e-3, 1.821153936e-2, 2.620722293e-2, 1.069792721e1)),
    name="water",
    range=(182 * nm, 1129 * nm),
    source="M. Daimon, A. Masumura, Appl. Opt. 46 (2007) 3811: distilled, 20 C; absorption left out",
)
BK7 = sellmeier(
    (1.03961212, 0.231792344, 1.01046945),
    squares=tuple(c * um**2 for c in (0.00600069867, 0.0200179144, 103.560653)),
    name="BK7",
    range=(300 * nm, 2500 * nm),
    source="SCHOTT N-BK7, catalogue; absorption left out",
)
SF11 = sellmeier(
    (1.73759695, 0.313747346, 1.89878101),
    squares=tuple(c * um**2 for c in (0.013188707, 0.0623068142, 155.23629)),
    name="SF11",
    range=(370 * nm, 2500 * nm),
    source="SCHOTT N-SF11, catalogue; absorption left out",
)
FUSED_SILICA = sellmeier(
    (0.6961663, 0.4079426, 0.8974794),
    lengths=tuple(c * um for c in (0.0684043, 0.1162414, 9.896161)),
    name="fused silica",
    range=(210 * nm, 3710 * nm),
    source="I. H. Malitson, J. Opt. Soc. Am. 55 (1965) 1205: 20 C",
)
_GHOSH = "G. Ghosh, Opt. Commun. 163 (1999) 95: room temperature"
CALCITE_O = Material(
    "calcite o",
    Formula("formula 2", (0.73358749, 0.96464345, 1.94325203e-2, 1.82831454, 120.0), (0.204, 2.172)),
    source=f"{_GHOSH}, ordinary",
)
CALCITE_E = Material(
    "calcite e",
    Formula("formula 2", (0.35859695, 0.82427830, 1.06689543e-2, 0.14429128, 120.0), (0.204, 2.172)),
    source=f"{_GHOSH}, extraordinary",
)
QUARTZ_O = Material(
    "quartz o",
    Formula("formula 2", (0.28604141, 1.07044083, 1.00585997e-2, 1.10202242, 100.0), (0.198, 2.0531)),
    source=f"{_GHOSH}, ordinary",
)
QUARTZ_E = Material(
    "quartz e",
    Formula("formula 2", (0.28851804, 1.09509924, 1.02101864e-2, 1.15662475, 100.0), (0.198, 2.0531)),
    source=f"{_GHOSH}, extraordinary",
)
_VISIBLE = (400 * nm, 700 * nm)
CHITIN = cauchy(
    1.517,
    8800 * nm**2,
    name="chitin",
    range=_VISIBLE,
    source="H. L. Leertouwer, B. D. Wilts, D. G. Stavenga, Opt. Express 19 (2011) 24061: Graphium sarpedon",
)
KERATIN = cauchy(
    1.532,
    5890 * nm**2,
    name="keratin",
    range=_VISIBLE,
    source="H. L. Leertouwer, B. D. Wilts, D. G. Stavenga, Opt. Express 19 (2011) 24061: Anas anas",
)
MELANIN = absorbing(
    cauchy(
        1.648,
        23700 * nm**2,
        name="melanin",
        range=_VISIBLE,
        source="D. G. Stavenga et al., PLoS ONE 7 (2012) e49743, and Phil. Trans. R. Soc. B 370 (2015)",
    ),
    0.56,
    270 * nm,
)
_METALS = Path(__file__).parent / "metals"
GOLD = load(_METALS / "gold.csv")
SILVER = load(_METALS / "silver.csv")
ALUMINIUM = load(_METALS / "aluminium.csv")

NAMED: tuple[Material, ...] = (
    VACUUM, AIR, WATER, BK7, SF11, FUSED_SILICA, CALCITE_O, CALCITE_E, QUARTZ_O, QUARTZ_E,
    CHITIN, KERATIN, MELANIN, GOLD, SILVER, ALUMINIUM,
)  # fmt: skip
_ALIASES = {"nbk7": "bk7", "nsf11": "sf11", "silica": "fusedsilica", "aluminum": "aluminium"}


def _plain(text: str) -> str:
    return "".join(letter for letter in text.lower() if letter.isalnum())


def named(text: str) -> Material:
    """A material by its name; case, spaces and hyphens do not matter.

    Parameters
    ----------
    text : str
        One of `NAMED`, such as ``"BK7"`` or ``"calcite o"``.

    Returns
    -------
    Material

    Raises
    ------
    ValueError
        If there is none of that name; says the nearest one.
    """
    known = {_plain(material.name): material for material in NAMED}
    plain = _plain(text)
    found = known.get(_ALIASES.get(plain, plain))
    if found is None:
        near = difflib.get_close_matches(plain, known, n=1, cutoff=0.0)
        names = ", ".join(material.name for material in NAMED)
        raise ValueError(
            f"material: expected one of {names}, got {text!r}; did you mean {known[near[0]].name!r}?"
        )
    return found


def as_material(value: Material | complex | str, what: str = "material") -> Material:
    """A material from what stands for one.

    Parameters
    ----------
    value : Material, number, or str
        An index n + i kappa, or a name.
    what : str
        The name used in the error message.

    Returns
    -------
    Material

    Raises
    ------
    TypeError
        If it is none of these.
    ValueError
        If the number is no index of a passive medium, or the name is not known.
    """
    if isinstance(value, Material):
        return value
    if isinstance(value, str):
        return named(value)
    if isinstance(value, Complex) and not isinstance(value, bool):
        return constant(complex(value))
    raise TypeError(f"{what}: expected a Material, an index n + i kappa or a name, got {value!r}")
