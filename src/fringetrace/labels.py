"""Arrays with names on their axes, and the files that keep them."""

from __future__ import annotations

import contextlib
import csv
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from xarray import DataArray as DataArray
    from xarray import Dataset as Dataset


def labelled(
    values: Any,
    axes: tuple[str, ...],
    coordinates: Mapping[str, Any],
    name: str,
    attributes: Mapping[str, Any],
) -> DataArray:
    """An array whose axes have names and coordinates.

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


def dataset(
    variables: Mapping[str, Any], coordinates: Mapping[str, Any], attributes: Mapping[str, Any]
) -> Dataset:
    """Several arrays on common axes.

    Parameters
    ----------
    variables, coordinates : mapping
        By name: (axes, values, attributes).
    attributes : mapping

    Returns
    -------
    xarray.Dataset
    """
    import xarray

    return xarray.Dataset(dict(variables), dict(coordinates), dict(attributes))


def write_netcdf(data: DataArray | Dataset, path: str | os.PathLike[str]) -> None:
    """Write labelled arrays to a NetCDF file; it is there in full or not at all.

    Parameters
    ----------
    data : xarray.DataArray or xarray.Dataset
    path : path-like
    """
    with _beside(path) as part:
        data.to_netcdf(part, engine="h5netcdf")


def write_csv(data: DataArray, path: str | os.PathLike[str]) -> None:
    """Write a labelled array as text: a row for each value, after those of its coordinates, in SI units.

    Parameters
    ----------
    data : xarray.DataArray
    path : path-like
    """
    axes = [np.asarray(data[name]) for name in data.dims]
    columns = [grid.ravel() for grid in np.meshgrid(*axes, indexing="ij")]
    with _beside(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        lines = csv.writer(file)
        lines.writerow([*map(str, data.dims), str(data.name)])
        lines.writerows(
            zip(*(column.tolist() for column in columns), data.values.ravel().tolist(), strict=True)
        )


@contextlib.contextmanager
def _beside(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A file to write, moved into place once it is whole."""
    target = Path(path)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        yield part
        os.replace(part, target)
    finally:
        part.unlink(missing_ok=True)
