"""Camera frames as 16-bit TIFF files with the value of one count: writing and reading."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray, checked_length, filled, tables, whole
from fringetrace.instruments import records

if TYPE_CHECKING:
    from xarray import DataArray

# What a 16-bit camera counts at full scale.
COUNTS = 65535
# Axes before rows and columns.
LEADING = ("set", "frame")


def counts(images: FloatArray, full_scale: float) -> Array:
    """Irradiance in 16-bit camera counts, top row first.

    Parameters
    ----------
    images : (..., rows, columns) float64
        |E|^2.
    full_scale : float
        |E|^2 of 65535 counts.

    Returns
    -------
    (..., rows, columns) uint16
        Rounded; first the row with the largest y, as picture files have it.
    """
    return np.rint(images[..., ::-1, :] * (COUNTS / full_scale)).clip(0, COUNTS).astype(np.uint16)


def save(
    images: npt.ArrayLike,
    pitch: float,
    path: str | os.PathLike[str],
    *,
    full_scale: float | None = None,
    **notes: Any,
) -> None:
    """Save irradiances as a 16-bit TIFF file, atomically.

    Parameters
    ----------
    images : ([[set,] frame,] rows, columns) array-like
        |E|^2; row 0 is the bottom one, which a picture file has last. Below 0, as noise may be, counts 0.
    pitch : float, metres
        Side of a pixel, which becomes the resolution of the file.
    path : path-like
    full_scale : float, optional
        |E|^2 of 65535 counts; brighter pixels are cut off. Default: 1, or that of the brightest pixel if it
        is above 1.
    **notes
        For the description, such as wavelength_m.

    Raises
    ------
    ValueError
        If the array has fewer than 2 axes or more than 4, a pixel is NaN, infinite or masked, or the full
        scale is not positive.
    """
    import tifffile

    values, pitch = filled(images), checked_length(pitch, "pitch")
    if not 2 <= values.ndim <= 2 + len(LEADING) or values.size == 0:
        raise ValueError(f"frames: expected shape ([[sets,] frames,] rows, columns), got {values.shape}")
    unknown = int(np.count_nonzero(~np.isfinite(values)))
    if unknown:
        raise ValueError(
            f"frames: expected finite irradiances, got NaN, infinity or a mask at "
            f"{unknown:,} of {values.size:,} pixels; fill them first, such as by numpy.nan_to_num"
        )
    scale = max(1.0, float(values.max())) if full_scale is None else float(full_scale)
    if not (np.isfinite(scale) and scale > 0.0):
        raise ValueError(f"full scale: expected a positive irradiance, got {scale:g}")
    described = {
        "full_scale": scale,
        "full_scale_meaning": "|E|^2 of 65535 counts; 1 is the incident irradiance",
        **notes,
        "pixel_pitch_m": pitch,
        "shape": values.shape,
        "first_row": "largest y",
    }
    per_centimetre = 0.01 / pitch
    with whole(path) as part:
        tifffile.imwrite(
            part, counts(values, scale), photometric="minisblack", description=json.dumps(described),
            metadata=None, resolution=(per_centimetre, per_centimetre), resolutionunit="CENTIMETER",
            software="fringetrace",
        )  # fmt: skip


def load(path: str | os.PathLike[str]) -> DataArray:
    """Load irradiances from a TIFF file that `save` or the command wrote.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    xarray.DataArray, float64
        |E|^2 to half a count, ([set, frame,] y, x), coordinates in metres; row 0 is the bottom one. What
        the file says besides (`full_scale`, `wavelength_m`, ...) is in its attributes.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If it is no TIFF file, or does not say what a count is worth: read those with tifffile.
    """
    import tifffile

    if not Path(path).is_file():
        raise FileNotFoundError(f"{path}: expected an existing file, got none there")
    try:
        with tifffile.TiffFile(path) as file:
            notes = json.loads(file.pages.first.description)
            scale, pitch = float(notes["full_scale"]), float(notes["pixel_pitch_m"])
            stored = file.asarray().reshape(notes["shape"])
    except Exception as error:  # tifffile and json raise kinds of their own
        raise ValueError(f"{path}: expected a TIFF file with its full scale, got another: {error}") from error
    values = stored[..., ::-1, :] * (scale / COUNTS)
    dims = (*LEADING[len(LEADING) + 2 - values.ndim :], *records.IMAGE)
    about = {**records.NOTES["interferogram"], **notes, "convention": records.CONVENTION}
    del about["first_row"], about["shape"]
    return tables.array(values, dims, records.coordinates(values.shape[-2:], pitch), "frames", about)
