"""Labelled tables: arrays with named axes and units, as xarray, NetCDF and CSV."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fringetrace.core.files import whole
from fringetrace.core.units import FloatArray, nm, unit_length

if TYPE_CHECKING:
    from xarray import DataArray, Dataset

# Axes: name to values and unit.
Coordinates = Mapping[str, tuple[Any, str]]
# "wavelength / nm", "Wavelength (nm)", "lambda [um]", "wavelength_nm"
_HEAD = re.compile(r".*?[\s/_(\[]\s*([a-zµμ]+)\s*[)\]]?\s*", re.IGNORECASE)


def labelled(
    values: npt.ArrayLike, axes: Coordinates, *, name: str, unit: str, **attributes: Any
) -> DataArray:
    """Array with named axes, coordinates and units (xarray.DataArray).

    Parameters
    ----------
    values : array-like
    axes : dict of (values, unit)
        By name, in the order of the axes; unit "" for none.
    name, unit : str
        Of the values.
    **attributes
        Kept with them.

    Returns
    -------
    xarray.DataArray
    """
    import xarray

    coordinates = {axis: (axis, along, {"units": of} if of else {}) for axis, (along, of) in axes.items()}
    return xarray.DataArray(values, coordinates, list(axes), name=name, attrs={"units": unit, **attributes})


def array(
    values: Any,
    axes: tuple[str, ...],
    coordinates: Mapping[str, Any],
    name: str,
    attributes: Mapping[str, Any],
) -> DataArray:
    """Array with named axes and any number of coordinates (xarray.DataArray).

    Parameters
    ----------
    values : array
    axes : tuple of str
        One name an axis.
    coordinates : mapping
        By name: (axes, values) or (axes, values, attributes).
    name : str
    attributes : mapping
        Unit and meaning, and what else is worth knowing.

    Returns
    -------
    xarray.DataArray
    """
    import xarray

    return xarray.DataArray(values, dict(coordinates), axes, name=name, attrs=dict(attributes))


def labelled_dataset(
    variables: Mapping[str, Any], coordinates: Mapping[str, Any], attributes: Mapping[str, Any]
) -> Dataset:
    """Dataset of several arrays that share axes (xarray.Dataset).

    Parameters
    ----------
    variables, coordinates : dict
        By name, as xarray.Dataset takes them: (axes, values, attributes).
    attributes : dict

    Returns
    -------
    xarray.Dataset
    """
    import xarray

    return xarray.Dataset(dict(variables), dict(coordinates), dict(attributes))


def write_netcdf(table: DataArray | Dataset, path: str | os.PathLike[str]) -> None:
    """Write a table as a NetCDF file, atomically.

    Parameters
    ----------
    table : xarray.DataArray or xarray.Dataset
    path : path
    """
    with whole(path) as part:
        table.to_netcdf(part, engine="h5netcdf")


def write_rows(table: DataArray, path: str | os.PathLike[str]) -> None:
    """Write a table of any number of axes as CSV: coordinates and value per row, in SI units.

    Parameters
    ----------
    table : xarray.DataArray
    path : path
        The file is there in full or not at all.
    """
    import pandas

    along = np.meshgrid(*(np.asarray(table[name]) for name in table.dims), indexing="ij")
    columns = {str(name): grid.ravel() for name, grid in zip(table.dims, along, strict=True)}
    with whole(path) as part:
        pandas.DataFrame({**columns, str(table.name): table.values.ravel()}).to_csv(part, index=False)


def read_netcdf(path: str | os.PathLike[str]) -> DataArray:
    """Read a table from a NetCDF file that holds one.

    Parameters
    ----------
    path : path

    Returns
    -------
    xarray.DataArray
        In memory.
    """
    import xarray

    return xarray.load_dataarray(path, engine="h5netcdf")


def _metres(head: str, unit: str | None) -> float:
    """Metres in a unit, or in that which the head of a column names."""
    if unit is None:
        match = _HEAD.fullmatch(head)
        unit = "nm" if head == "wl" else match[1] if match else None
    return unit_length(unit, f"unit of column {head!r}")


def _numbers(path: str | os.PathLike[str]) -> tuple[list[str], FloatArray]:
    """Heads and numbers of a CSV file, rows in the order of its first column."""
    import pandas

    lines = [line for line in Path(path).read_text("utf-8-sig").splitlines() if line.strip()]
    first = next((line for line in lines if not line.startswith("#")), "")
    if not any(mark in first for mark in ",;\t"):
        raise ValueError(f"{path}: expected a column of wavelengths and others of values, got {first!r}")
    separator = max(",;\t", key=first.count)
    frame = pandas.read_csv(path, sep=separator, comment="#", skipinitialspace=True, encoding="utf-8-sig")
    heads = [str(head).strip() for head in frame.columns]
    numbers = frame.apply(pandas.to_numeric, errors="coerce").to_numpy(dtype=np.float64)
    if not np.isfinite(numbers).all():
        row, column = np.argwhere(~np.isfinite(numbers))[0]
        found = str(frame.iat[row, column])
        raise ValueError(f"{path}: expected numbers, got {found!r} in row {row + 1} of {heads[column]!r}")
    numbers = numbers[np.argsort(numbers[:, 0], kind="stable")]
    if (twice := np.flatnonzero(np.diff(numbers[:, 0]) == 0.0)).size:
        raise ValueError(f"{path}: expected each wavelength once, got {numbers[twice[0], 0]:g} twice")
    return heads, numbers


def read_csv(path: str | os.PathLike[str], unit: str | None = None, percent: bool | None = None) -> DataArray:
    """Read measured spectra from a CSV file: a wavelength column, and one column per sample.

    Parameters
    ----------
    path : path
        Separated by commas, semicolons or tabs; the first line holds heads, # starts a comment.
    unit : str, optional
        Of the wavelengths. Default: what the head of their column says, as in "wavelength / nm"; a
        column `wl` is in nm, as pavo (R) has it.
    percent : bool, optional
        Whether reflectances are in percent. Default: if wavelengths are called `wl`, or a head has a %.

    Returns
    -------
    xarray.DataArray
        reflectance (sample, wavelength); wavelengths in metres, increasing.

    Raises
    ------
    ValueError
        If there is no unit, or there are blanks, text, or wavelengths that come twice.
    """
    (head, *names), numbers = _numbers(path)
    if percent is None:
        percent = head == "wl" or any("%" in name for name in (head, *names))
    axes = {"sample": (names, ""), "wavelength": (numbers[:, 0] * _metres(head, unit), "m")}
    values = numbers[:, 1:].T * (0.01 if percent else 1.0)
    return labelled(values, axes, name="reflectance", unit="1")


def write_csv(spectra: DataArray, path: str | os.PathLike[str]) -> None:
    """Write spectra as CSV for pavo (R): `wl` in nm, then one column of percent per sample.

    In R: `as.rspec(read.csv(path))`, which interpolates them to whole nm.

    Parameters
    ----------
    spectra : xarray.DataArray
        reflectance (sample, wavelength), wavelengths in metres.
    path : path
        The file is there in full or not at all; numbers have 10 digits.

    Raises
    ------
    ValueError
        If the axes are others.
    """
    import pandas

    if set(spectra.dims) != {"sample", "wavelength"}:
        found = ", ".join(map(str, spectra.dims))
        raise ValueError(f"spectra: expected axes sample and wavelength, got {found}")
    rows = 100.0 * np.asarray(spectra.transpose("sample", "wavelength"))
    names = [str(name) for name in spectra["sample"].values]
    columns = {"wl": np.asarray(spectra["wavelength"]) / nm, **dict(zip(names, rows, strict=True))}
    with whole(path) as part:
        pandas.DataFrame(columns).to_csv(part, index=False, float_format="%.10g")
