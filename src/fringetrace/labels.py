"""Arrays with names on their axes, and the files that keep them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
    target = Path(path)
    beside = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        data.to_netcdf(beside, engine="h5netcdf")
        os.replace(beside, target)
    finally:
        beside.unlink(missing_ok=True)
