"""Pixel CCD: its plane, pixel coordinates and pixel centres."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from numbers import Real

import numpy as np
import numpy.typing as npt

from fringetrace.core import (
    FloatArray,
    checked_direction,
    checked_vector,
    described,
    frame,
    length_text,
    value_text,
)
from fringetrace.scene.planes import PlaneAxes, checked_grid, checked_positive


@dataclass(frozen=True, eq=False)
class CCD:
    """CCD: a rectangle of square pixels that records light on its front.

    Images are arrays [row, column] = [v, u], origin lower: u = normal x up is to the right of
    somebody who looks out of the chip along its normal, v is up. Light from behind passes.

    Parameters
    ----------
    centre : (3,) metres
    normal : (3,)
        Points to where the light comes from.
    up : (3,)
        Direction of increasing row.
    pitch : float, metres
        Side of the square pixels.
    shape : (rows, columns)
    focus : float, metres
        Distance in front of the chip of the plane that an ideal 1:1 relay images onto it;
        field positions and optical paths are those in that plane. 0: the bare chip.

    Raises
    ------
    ValueError
        For a normal of length 0, an `up` along it, a pitch or shape that is not positive.
    """

    centre: FloatArray
    normal: FloatArray
    up: FloatArray
    pitch: float
    shape: tuple[int, int]
    focus: float = 0.0
    axes: PlaneAxes = field(init=False, repr=False)  # of columns, rows, and the normal

    def __repr__(self) -> str:
        rows, columns = self.shape
        return described(
            self,
            f"{columns} x {rows} pixels of {length_text(self.pitch)}",
            f"centre {value_text(self.centre)} m, normal {value_text(self.axes[2])}",
            f"focused {length_text(self.focus)} in front" if self.focus else "",
        )

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checked_vector(self.centre, "CCD centre"))
        object.__setattr__(self, "normal", checked_direction(self.normal, "CCD normal"))
        object.__setattr__(self, "up", checked_direction(self.up, "CCD up"))
        object.__setattr__(self, "axes", frame(self.normal, self.up, "CCD"))
        object.__setattr__(self, "pitch", checked_positive(self.pitch, "CCD pitch"))
        object.__setattr__(self, "shape", checked_grid(self.shape, "CCD shape"))
        if not (isinstance(self.focus, Real) and np.isfinite(self.focus)):
            raise ValueError(f"CCD focus: expected a length in metres, got {self.focus!r}")

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the CCD, metres."""
        return self.shape[1] * self.pitch, self.shape[0] * self.pitch


def screen(ccd: CCD) -> tuple[float, ...]:
    """Parameters of a CCD for the kernels: centre, normal, u, v, half width, half height, focus.

    Parameters
    ----------
    ccd : CCD

    Returns
    -------
    15 floats, metres
    """
    u, v, n = ccd.axes
    width, height = ccd.size
    numbers = [*ccd.centre, *n, *u, *v, 0.5 * width, 0.5 * height, ccd.focus]
    return tuple(float(number) for number in numbers)


def pixels(ccd: CCD, point: FloatArray) -> FloatArray:
    """CCD coordinates (row, column) of points in its plane of focus.

    Parameters
    ----------
    ccd : CCD
    point : (n, 3) float64, metres

    Returns
    -------
    (n, 2) float64
        (row, column) in pixels; pixel [i, j] spans [i, i+1) x [j, j+1).
    """
    from fringetrace.scene import sensor_kernels

    pixel = np.empty((len(point), 2))
    sensor_kernels.pixels(screen(ccd), ccd.pitch, *ccd.shape, np.ascontiguousarray(point), pixel)
    return pixel


def pixel_indices(ccd: CCD, pixel: FloatArray) -> npt.NDArray[np.int64]:
    """Row and column of the pixel that points fall in; of points beside the CCD, the nearest.

    Parameters
    ----------
    ccd : CCD
    pixel : (n, 2) float64
        CCD coordinates, see `pixels`.

    Returns
    -------
    (n, 2) int64
    """
    return np.clip(np.floor(pixel).astype(np.int64), 0, np.array(ccd.shape) - 1)


def cross(ccd: CCD, origin: FloatArray, direction: FloatArray) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Where rays cross the CCD's plane, as it is seen in the plane of focus.

    Parameters
    ----------
    ccd : CCD
    origin : (n, 3) float64, metres
    direction : (n, 3) float64, unit

    Returns
    -------
    reach : (n,) float64, metres
        Way along the ray to the plane of focus; infinite where it does not reach the chip's plane from in
        front.
    hit : (n,) bool
        Whether it crosses on the CCD, not beside it.
    """
    from fringetrace.scene import sensor_kernels

    reach, hit = np.empty(len(origin)), np.empty(len(origin), dtype=np.bool_)
    sensor_kernels.cross(
        screen(ccd), np.ascontiguousarray(origin), np.ascontiguousarray(direction), reach, hit
    )
    return reach, hit


def crop(ccd: CCD, row: int, rows: int, columns: int, binning: int = 1) -> CCD:
    """Part of a CCD: rows from one on, columns from the first on, squares of pixels as one.

    Parameters
    ----------
    ccd : CCD
    row : int
        The first.
    rows, columns : int
        How many, in pixels of the CCD.
    binning : int
        Pixels of the CCD along the side of one of the part's.

    Returns
    -------
    CCD
    """
    u, v, _ = ccd.axes
    middle_u = 0.5 * (columns - ccd.shape[1]) * ccd.pitch
    middle_v = (row + 0.5 * (rows - ccd.shape[0])) * ccd.pitch
    return replace(
        ccd,
        centre=ccd.centre + middle_u * u + middle_v * v,
        pitch=ccd.pitch * binning,
        shape=(rows // binning, columns // binning),
    )


def pixel_centres(shape: tuple[int, int], pitch: float) -> tuple[FloatArray, FloatArray]:
    """Positions of pixel centres relative to the centre of the image.

    Parameters
    ----------
    shape : (rows, columns)
    pitch : float, metres

    Returns
    -------
    x : (columns,) float64, metres
    y : (rows,) float64, metres
    """
    y, x = ((np.arange(n, dtype=np.float64) + 0.5 - 0.5 * n) * pitch for n in shape)
    return np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
