"""Refractive index files: CSV tables, and YAML pages of refractiveindex.info."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from fringetrace.core import FloatArray, um, unit_length
from fringetrace.optics.materials.dispersion import Curve, IndexFormula, IndexTable

# Columns of the tables in YAML.
COLUMNS = {"tabulated nk": 3, "tabulated n": 2, "tabulated k": 2}
IndexData = tuple[Curve | None, Curve | None, str]


def _rows(text: str, columns: tuple[int, ...], what: str) -> FloatArray:
    """Lines of numbers, between commas, semicolons or spaces; the count of columns is one of those given."""
    rows: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        cells = [cell for cell in re.split(r"[,;\s]+", line.partition("#")[0].strip()) if cell]
        if not cells:
            continue
        try:
            rows.append([float(cell) for cell in cells])
        except ValueError:
            raise ValueError(f"{what} line {number}: expected numbers, got {line!r}") from None
        if len(cells) not in columns or len(cells) != len(rows[0]):
            wanted = " or ".join(str(count) for count in columns)
            raise ValueError(f"{what} line {number}: expected {wanted} columns in each, got {line!r}")
    if not rows:
        raise ValueError(f"{what}: expected lines of numbers, got none")
    return np.array(rows)


def _table(wavelength: FloatArray, value: FloatArray, what: str) -> IndexTable:
    try:
        return IndexTable(tuple(wavelength.tolist()), tuple(value.tolist()))
    except ValueError as error:
        raise ValueError(f"{what}: {error}") from None


def read_index_csv(path: Path, unit: str | None) -> IndexData:
    """Read n and kappa from a CSV table: wavelength, n and, if there is a third column, kappa.

    Lines from # on are remarks; those before the table are its source. A first line of words
    names the columns; the unit stands in it behind the wavelength, as ``wavelength (nm),n,k``.

    Parameters
    ----------
    path : Path
    unit : str or None
        Unit of the wavelengths; None: the one in the first line.

    Returns
    -------
    n : Table
    kappa : Table or None
    source : str

    Raises
    ------
    ValueError
        If no unit is known, two units contradict, or the table is none.
    """
    lines = path.read_text(encoding="utf-8-sig").splitlines()
    remarks = [line.lstrip("# ").rstrip() for line in lines if line.startswith("#")]
    first = next((k for k, line in enumerate(lines) if line.partition("#")[0].strip()), 0)
    header = re.match(r"\s*\"?[^\W\d]\w*\"?[^,;]*", lines[first]) if lines else None
    if header is not None:
        lines[first] = ""
        found = re.search(r"[(\[_/ ]\s*(\w+)\s*[)\]]?\s*\"?$", header[0].strip())
        stated = found[1] if found else None
        if unit and stated and unit_length(stated, f"{path} unit of the wavelength") != unit_length(unit):
            raise ValueError(f"{path} unit of the wavelength: the file says {stated!r}, got {unit!r}")
        unit = unit or stated
    metres = unit_length(unit, f"{path} unit of the wavelength")
    rows = _rows("\n".join(lines), (2, 3), str(path))
    w = rows[:, 0] * (metres / um)
    kappa = _table(w, rows[:, 2], f"{path} column kappa") if rows.shape[1] == 3 else None
    return _table(w, rows[:, 1], f"{path} column n"), kappa, " ".join(remarks)


def _numbers(value: Any, what: str) -> tuple[float, ...]:
    try:
        return tuple(float(number) for number in str(value).split())
    except ValueError:
        raise ValueError(f"{what}: expected numbers, got {value!r}") from None


def _entry(entry: Any, what: str) -> tuple[Curve | None, Curve | None]:
    """Curves of n and kappa in one entry of DATA."""
    kind = entry.get("type") if isinstance(entry, dict) else None
    if kind in COLUMNS:
        key = f"{what} data"
        rows = _rows(str(entry.get("data", "")), (COLUMNS[kind],), key)
        last = _table(rows[:, 0], rows[:, -1], key)
        if kind == "tabulated nk":
            return _table(rows[:, 0], rows[:, 1], key), last
        return (last, None) if kind == "tabulated n" else (None, last)
    if not re.fullmatch(r"formula [1-9]", str(kind)):
        raise ValueError(
            f"{what} type: expected 'formula 1' to 'formula 9' or {sorted(COLUMNS)}, got {kind!r}"
        )
    for key in ("coefficients", "wavelength_range"):
        if key not in entry:
            raise ValueError(f"{what}: expected the key {key!r}, got {sorted(entry)}")
    limits = _numbers(entry["wavelength_range"], f"{what} wavelength_range")
    if len(limits) != 2:
        raise ValueError(f"{what} wavelength_range: expected 2 numbers, got {entry['wavelength_range']!r}")
    coefficients = _numbers(entry["coefficients"], f"{what} coefficients")
    if kind == "formula 7":  # even powers of the wavelength may be left out
        coefficients += (0.0,) * (3 - len(coefficients))
    try:
        return IndexFormula(str(kind), coefficients, (limits[0], limits[1])), None
    except ValueError as error:
        raise ValueError(f"{what}: {error}") from None


def read_yaml(path: Path) -> IndexData:
    """Read n and kappa from a page of refractiveindex.info: formulas 1 to 9, tables of n, k or both.

    Parameters
    ----------
    path : Path

    Returns
    -------
    n, kappa : Formula, Table or None
    source : str

    Raises
    ------
    ValueError
        If it is no such page; says file, key, what was expected and what was found.
    """
    import yaml

    try:
        page = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: expected YAML, got {' '.join(str(error).split())}") from None
    data = page.get("DATA") if isinstance(page, dict) else None
    if not isinstance(data, list) or not data:
        raise ValueError(f"{path} DATA: expected a list of formulas and tables, got {data!r}")
    curves: list[Curve | None] = [None, None]
    for k, entry in enumerate(data):
        for part, curve in enumerate(_entry(entry, f"{path} DATA[{k}]")):
            if curve is not None and curves[part] is not None:
                raise ValueError(f"{path} DATA[{k}]: expected one {'nk'[part]}, got another")
            curves[part] = curve or curves[part]
    source = " ".join(re.sub(r"<[^>]*>", "", str(page.get("REFERENCES", ""))).split())
    return curves[0], curves[1], source
