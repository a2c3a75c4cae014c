"""Recorded images as labelled datasets: coordinates in metres, units, wavelength, orientation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fringetrace.core import Array, filled, tables
from fringetrace.scene import pixel_centres

if TYPE_CHECKING:
    from xarray import Dataset

IMAGE = ("y", "x")
CONVENTION = (
    "row 0 has the smallest y (origin lower); x to the right and y up for somebody who looks out of the CCD"
)
_LIGHT = {"units": "1", "long_name": "irradiance / incident irradiance, |E|^2"}
_FIELD = {"units": "1", "comment": "field ~ exp(+i k OPL); components along columns, rows, normal"}
# What is known of arrays by their names.
NOTES: dict[str, dict[str, str]] = {
    "interferogram": _LIGHT,
    "frames": {**_LIGHT, "comment": "phase-stepped: step is added to the reference"},
    "field_real": _FIELD,
    "field_imag": _FIELD,
    "wrapped_phase": {"units": "rad", "long_name": "reference - sample, with carrier"},
    "height": {"units": "m", "comment": "positive towards the light, up to a constant"},
    "mesh_height": {"units": "m", "long_name": "height of the mesh"},
    "path_difference": {"units": "m", "comment": "optical path that the sample adds, up to a constant"},
    "residual": {"units": "m", "long_name": "height - mesh_height - mean"},
}


def coordinates(shape: tuple[int, int], pitch: float) -> dict[str, Any]:
    """Pixel coordinates for xarray.

    Parameters
    ----------
    shape : (rows, columns)
    pitch : float, metres

    Returns
    -------
    dict
        "x" and "y": name of the axis, metres from the middle of the image, unit.
    """
    x, y = pixel_centres(shape, pitch)
    return {
        "x": ("x", x, {"units": "m", "long_name": "along a row"}),
        "y": ("y", y, {"units": "m", "long_name": "from row to row, upwards"}),
    }


def _without_mask(values: Any) -> Array:
    """An array, of a type that knows NaN where there was a mask."""
    masked = np.ma.is_masked(values)
    return filled(values, np.result_type(values, np.float64)) if masked else np.asarray(values)


def dataset(
    images: Mapping[str, Any], pitch: float, axes: tables.Coordinates | None = None, **attributes: Any
) -> Dataset:
    """Labelled dataset of images of one CCD: interferograms, fields, phase and height maps.

    Parameters
    ----------
    images : dict
        By name: arrays (rows, columns); or (axes, array), with the names of further axes before these.
        Those named as in `NOTES` get unit and meaning.
    pitch : float, metres
        Side of a pixel.
    axes : dict of (values, unit), optional
        The further axes: step in radians, wavelength in metres.
    **attributes
        Of the whole, such as wavelength_m.

    Returns
    -------
    xarray.Dataset
        Coordinates x and y in metres; "convention" says which way is up.

    Raises
    ------
    ValueError
        If images have other shapes.
    """
    named: dict[str, tuple[tuple[str, ...], Array, dict[str, str]]] = {}
    for name, given in images.items():
        leading, values = given if isinstance(given, tuple) else ((), given)
        named[name] = ((*leading, *IMAGE), _without_mask(values), NOTES.get(name, {}))
    shapes = {values.shape[-2:] for _, values, _ in named.values()}
    if len(shapes) != 1 or any(values.ndim != len(dims) for dims, values, _ in named.values()):
        found = ", ".join(f"{name} {values.shape}" for name, (_, values, _) in named.items())
        raise ValueError(
            f"images: expected (rows, columns) after their axes, all alike, got {found or 'none'}"
        )
    further = {name: (name, values, {"units": unit}) for name, (values, unit) in (axes or {}).items()}
    about = {**attributes, "pixel_pitch_m": pitch, "convention": CONVENTION}
    (shape,) = shapes
    return tables.labelled_dataset(named, {**further, **coordinates(shape, pitch)}, about)
