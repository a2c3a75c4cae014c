"""Measurement of a sample compared with its mesh, and its files: PNG, TIFF, NetCDF."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray, short_repr, tables
from fringetrace.field import chosen
from fringetrace.geometry import Mesh, interpolate_height, write_height_map
from fringetrace.instruments import Interferometer, path_slope, records, step_axis, tiff
from fringetrace.scene import pixel_centres
from fringetrace.tracing import Ledger

if TYPE_CHECKING:
    from xarray import Dataset

# A bend of this many waves a pixel is a step.
STEP = 0.02
LIBRARIES = ("fringetrace", "numpy", "embreex", "numba", "scikit-image")


@dataclass(frozen=True, eq=False)
class Measurement:
    """Measurement of a sample: frames, height, and its residual against the mesh.

    Attributes
    ----------
    wavelength : float, metres
    pitch : float, metres
        Side of a pixel.
    tilt : (tilt_x, tilt_y), radians
    frames : (steps, rows, columns) float64
        |E|^2 at equal phase steps; the first is the interferogram.
    wrapped : (rows, columns) float64, radians
    height, truth : (rows, columns) float64, metres
        As measured, and of the mesh.
    residual : (rows, columns) float64, metres
        height - truth, less its mean (over pixels of the right fringe order): a height is measured
        up to a constant. NaN where either is unknown.
    smooth : (rows, columns) bool
        Away from steps: the mesh changes by less than wavelength / 4 to each neighbour, and, where
        pixels are averaged, evenly.
    ledger : Ledger
    """

    wavelength: float
    pitch: float
    tilt: tuple[float, float]
    frames: FloatArray
    wrapped: FloatArray
    height: FloatArray
    truth: FloatArray
    residual: FloatArray
    smooth: Array
    ledger: Ledger

    __repr__ = short_repr

    @property
    def interferogram(self) -> FloatArray:
        """Interferogram |E|^2, (rows, columns) float64."""
        return np.asarray(self.frames[0])

    @property
    def full_scale(self) -> float:
        """Irradiance of 65535 counts in the 16-bit files: 1, or that of the brightest pixel if above 1."""
        return max(1.0, float(self.frames.max()))

    @property
    def fringes(self) -> float:
        """Fringes across the image due to the tilt alone, along its steeper axis."""
        rows, columns = self.truth.shape
        slope_x, slope_y = path_slope(self.tilt)
        return float(max(abs(slope_x) * columns, abs(slope_y) * rows) * self.pitch / self.wavelength)

    @property
    def orders(self) -> FloatArray:
        """Half wavelengths by which the fringe order is missed, (rows, columns) float64, whole or NaN."""
        return np.asarray(np.round(2.0 * self.residual / self.wavelength))

    def rms(self, where: Array | None = None, but_for_orders: bool = False) -> float:
        """Root mean square of the residual, metres.

        Parameters
        ----------
        where : (rows, columns) bool, optional
            Default: wherever there is a residual.
        but_for_orders : bool
            Leave out whole half wavelengths, which one wavelength cannot tell.

        Returns
        -------
        float, metres
            NaN if there are none.
        """
        chosen = np.isfinite(self.residual) if where is None else where & np.isfinite(self.residual)
        left = self.residual - (0.5 * self.wavelength * self.orders if but_for_orders else 0.0)
        return float(np.sqrt(np.mean(left[chosen] ** 2))) if chosen.any() else math.nan


def heights(
    mesh: Mesh,
    shape: tuple[int, int],
    pitch: float,
    centre: npt.ArrayLike = (0.0, 0.0, 0.0),
    parts: int = 1,
) -> FloatArray:
    """Heights of a mesh at pixels, in their centres or as means.

    Parameters
    ----------
    mesh : Mesh
    shape : (rows, columns)
    pitch : float, metres
    centre : (3,) array-like, metres
        The point that is in the middle of the image, and at height 0.
    parts : int
        The mean of the heights at the centres of parts x parts parts of each pixel.

    Returns
    -------
    (rows, columns) float64, metres
        NaN where there is no mesh, or not in all of a pixel's parts.
    """
    rows, columns = shape
    x, y = pixel_centres((rows * parts, columns * parts), pitch / parts)
    x0, y0, z0 = np.asarray(centre, dtype=np.float64)
    fine = np.asarray(interpolate_height(mesh, x[None, :] + x0, y[:, None] + y0) - z0, dtype=np.float64)
    return np.asarray(fine.reshape(rows, parts, columns, parts).mean(axis=(1, 3)), dtype=np.float64)


def _smooth(truth: FloatArray, limit: float, bend: float) -> Array:
    """Where heights change by less than `limit` to all neighbours and evenly; steps and rims are left out."""
    padded = np.pad(truth, 1, mode="reflect", reflect_type="odd")  # even beyond the rim
    middle = padded[1:-1, 1:-1]
    pairs = ((padded[:-2, 1:-1], padded[2:, 1:-1]), (padded[1:-1, :-2], padded[1:-1, 2:]))
    with np.errstate(invalid="ignore"):
        small = [np.abs(side - middle) < limit for pair in pairs for side in pair]
        even = [np.abs(one + other - 2.0 * middle) < bend for one, other in pairs]
    return np.asarray(np.all([*small, *even], axis=0))


def _piston(differences: FloatArray, wavelength: float) -> float:
    """Mean of differences of height, leaving out those that are off by half a wavelength or more."""
    if not differences.size:
        return 0.0
    middle = float(np.median(differences))
    about = differences - middle
    return middle + float(about[np.abs(about) <= 0.25 * wavelength].mean())


def measure_height(
    bench: Interferometer, truth: FloatArray, wavelength: float, steps: int = 4
) -> Measurement:
    """Measure a sample: record phase-stepped frames, compute the height, compare it with the mesh.

    Parameters
    ----------
    bench : Interferometer
    truth : (rows, columns) float64, metres
        Heights at the pixels, see `heights`.
    wavelength : float, metres
    steps : int, at least 3

    Returns
    -------
    Measurement
    """
    # a pixel that is averaged shows a mean of both sides of a step
    averaged = chosen(bench.trace(wavelength), bench.method) != "rays"
    bend = STEP * wavelength if averaged else math.inf
    height = bench.height(wavelength, steps)
    both = np.isfinite(height) & np.isfinite(truth)
    residual = np.where(both, height - truth, np.nan)
    return Measurement(
        wavelength=wavelength,
        pitch=bench.ccd.pitch,
        tilt=bench.arms.tilt,
        frames=bench.phase_steps(wavelength, steps),
        wrapped=bench.wrapped(wavelength, steps),
        height=height,
        truth=truth,
        residual=residual - _piston(residual[both], wavelength),
        smooth=_smooth(truth, 0.25 * wavelength, bend),
        ledger=bench.trace(wavelength).ledger(),
    )


def measurement_dataset(measurement: Measurement) -> Dataset:
    """Labelled dataset of a measurement.

    Parameters
    ----------
    measurement : Measurement

    Returns
    -------
    xarray.Dataset
        Coordinates x, y (metres) and step (radians); units in the attributes of each variable.
    """
    m = measurement
    images = {
        "interferogram": m.interferogram,
        "frames": (("step",), m.frames),
        "wrapped_phase": m.wrapped,
        "height": m.height,
        "mesh_height": m.truth,
        "residual": m.residual,
    }
    attributes = {
        "title": "Michelson interferogram",
        "wavelength_m": m.wavelength,
        "reference_tilt_rad": list(m.tilt),
        "residual_rms_m": m.rms(),
        "residual_rms_away_from_steps_m": m.rms(m.smooth),
        **{f"power_{name}": value for name, value in vars(m.ledger).items()},
        **{f"version_{name}": version(name) for name in LIBRARIES},
    }
    return records.dataset(images, m.pitch, step_axis(len(m.frames)), **attributes)


def write_measurement(measurement: Measurement, path: Path) -> None:
    """Write the `dataset` of a measurement as NetCDF.

    Parameters
    ----------
    measurement : Measurement
    path : Path
    """
    tables.write_netcdf(measurement_dataset(measurement), path)


def write_camera(measurement: Measurement, folder: Path) -> None:
    """Write interferogram.tif and frames.tif: 16 bits, full scale in the description.

    Parameters
    ----------
    measurement : Measurement
    folder : Path
    """
    m = measurement
    for name, images in (("interferogram", m.interferogram), ("frames", m.frames)):
        path = folder / f"{name}.tif"
        tiff.save(images, m.pitch, path, full_scale=m.full_scale, wavelength_m=m.wavelength)


def write_heights(measurement: Measurement, folder: Path, kinds: Iterable[str]) -> None:
    """Write the measured height as a Zygo file: height.dat or height.datx.

    Parameters
    ----------
    measurement : Measurement
    folder : Path
    kinds : iterable of {"dat", "datx"}
    """
    m = measurement
    for kind in kinds:
        write_height_map(m.height, m.pitch, folder / f"height.{kind}", wavelength=m.wavelength)


def write_pictures(measurement: Measurement, folder: Path) -> None:
    """Write interferogram.png, and height.png with the residual beside the height.

    Parameters
    ----------
    measurement : Measurement
    folder : Path
    """
    from fringetrace import views

    m = measurement
    image = views.interferogram(m.interferogram, m.pitch, wavelength=m.wavelength, title="Interferogram")
    views.save(image, folder / "interferogram.png")
    left, right = views.side_by_side()
    views.height(m.height, m.pitch, left, title="Height, measured")
    views.residual(m.residual, m.pitch, right, wavelength=m.wavelength, title="Measured − mesh")
    views.save(left, folder / "height.png")
