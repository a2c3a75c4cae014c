"""Named materials, and materials from files, numbers or names.

Kinds: `constant`, `cauchy`, `sellmeier`, `tabulated`; with an absorption that falls off: `absorbing`.
"""

from __future__ import annotations

import difflib
from numbers import Complex
from pathlib import Path

from fringetrace.core import nm, um
from fringetrace.optics.materials import files
from fringetrace.optics.materials.dispersion import IndexFormula
from fringetrace.optics.materials.material import Material, absorbing, cauchy, constant, sellmeier, tabulated

__all__ = [
    "AIR", "ALUMINIUM", "BK7", "CALCITE_E", "CALCITE_O", "CHITIN", "FUSED_SILICA", "GOLD", "KERATIN",
    "MELANIN", "NAMED", "QUARTZ_E", "QUARTZ_O", "SF11", "SILVER", "VACUUM", "WATER", "Material", "absorbing",
    "as_material", "cauchy", "constant", "load", "named", "sellmeier", "tabulated",
]  # fmt: skip


def load(path: str | Path, *, unit: str | None = None, name: str | None = None) -> Material:
    """Load a material from a file.

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
        n, kappa, source = files.read_yaml(file)
    elif file.suffix.lower() in (".csv", ".txt"):
        n, kappa, source = files.read_index_csv(file, unit)
    else:
        raise ValueError(f"{file}: expected a .csv, .txt, .yml or .yaml file, got {file.suffix!r}")
    if n is None:
        raise ValueError(f"{file}: expected a refractive index n, got kappa alone")
    return Material(name or file.stem, n, kappa, source)


VACUUM = constant(1.0, "vacuum")
AIR = Material(
    "air",
    IndexFormula("formula 6", (0.0, 0.05792105, 238.0185, 0.00167917, 57.362), (0.23, 1.69)),
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
    IndexFormula("formula 2", (0.73358749, 0.96464345, 1.94325203e-2, 1.82831454, 120.0), (0.204, 2.172)),
    source=f"{_GHOSH}, ordinary",
)
CALCITE_E = Material(
    "calcite e",
    IndexFormula("formula 2", (0.35859695, 0.82427830, 1.06689543e-2, 0.14429128, 120.0), (0.204, 2.172)),
    source=f"{_GHOSH}, extraordinary",
)
QUARTZ_O = Material(
    "quartz o",
    IndexFormula("formula 2", (0.28604141, 1.07044083, 1.00585997e-2, 1.10202242, 100.0), (0.198, 2.0531)),
    source=f"{_GHOSH}, ordinary",
)
QUARTZ_E = Material(
    "quartz e",
    IndexFormula("formula 2", (0.28851804, 1.09509924, 1.02101864e-2, 1.15662475, 100.0), (0.198, 2.0531)),
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
    """Material by its name; case, spaces and hyphens do not matter.

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
    """Material from a material, a name or an index.

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
