"""Complex field sampled on the pixels of a plane, with its plane, wavelength and components."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, FloatArray, checked_wavelength, tables
from fringetrace.field.coherent_sum import complex_field
from fringetrace.scene import CCD, pixel_centres
from fringetrace.tracing import Paths

if TYPE_CHECKING:
    from xarray import DataArray

# Components of a field with a polarisation: along a row, from row to row, along the normal.
COMPONENTS = ("x", "y", "normal")
# What `from_xarray` reads.
ATTRIBUTES = ("wavelength_m", "pixel_pitch_m", "centre_m", "normal", "up", "focus_m")


@dataclass(frozen=True, eq=False)
class Field:
    """Complex field on the pixels of a plane at one wavelength.

    NumPy takes it for its array of values: `np.abs(field)`. The phase grows along the optical path,
    exp(+2 pi i OPL / wavelength).

    Parameters
    ----------
    values : (rows, columns) complex128, or (2 or 3, rows, columns)
        1 is the field of a beam of unit irradiance. With a polarisation its components along the plane's
        columns (x), rows (y) and, if there are three, normal.
    plane : CCD
        Where the pixels are; with a `focus` the plane that is imaged onto them.
    wavelength : float, metres
        In a vacuum.

    Raises
    ------
    ValueError
        For values of another shape than the plane's, or that are not finite; a wavelength that is none.
    TypeError
        For a plane that is no CCD.
    """

    values: ComplexArray
    plane: CCD
    wavelength: float

    def __post_init__(self) -> None:
        if not isinstance(self.plane, CCD):
            raise TypeError(f"Field plane: expected a CCD, got {type(self.plane).__name__}")
        values = np.asarray(self.values, dtype=np.complex128)
        shape = self.plane.shape
        if values.shape not in (shape, (2, *shape), (3, *shape)):
            raise ValueError(
                f"Field values: expected shape {shape}, or 2 or 3 components before it, got {values.shape}"
            )
        if not np.isfinite(values).all():
            raise ValueError("Field values: expected finite numbers, got NaN or infinity")
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "wavelength", checked_wavelength(self.wavelength))

    @classmethod
    def of(
        cls,
        paths: Paths | Iterable[Paths],
        wavelength: float,
        method: str = "auto",
        half_wave_loss: bool = True,
    ) -> Field:
        """Field that traced paths bring to their CCD.

        Parameters
        ----------
        paths, wavelength, method, half_wave_loss
            See `complex_field`.

        Returns
        -------
        Field

        Raises
        ------
        ValueError
            As `complex_field`.
        """
        parts = [paths] if isinstance(paths, Paths) else list(paths)
        values = complex_field(parts, wavelength, method, half_wave_loss)
        assert parts[0].ccd is not None
        return cls(values, parts[0].ccd, wavelength)

    def __repr__(self) -> str:
        rows, columns = self.plane.shape
        parts = f", components {', '.join(self.components)}" if self.components else ""
        pitch, wavelength = self.plane.pitch * 1e6, self.wavelength * 1e9
        return f"Field({rows} x {columns} pixels of {pitch:.4g} um at {wavelength:.6g} nm{parts})"

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> npt.NDArray[Any]:
        return np.array(self.values, dtype=dtype, copy=copy)

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components of light with a polarisation; none of scalar light."""
        return COMPONENTS[: len(self.values)] if self.values.ndim == 3 else ()

    @property
    def irradiance(self) -> FloatArray:
        """(rows, columns) float64: |E|^2, summed over components; of a mean field that of the mean."""
        power = np.abs(self.values) ** 2
        return np.asarray(power if power.ndim == 2 else power.sum(axis=0), dtype=np.float64)

    def to_xarray(self) -> DataArray:
        """Field as a labelled array over y and x in metres; `from_xarray` reads it.

        Returns
        -------
        xarray.DataArray
            complex128, over (component,) y, x; the plane and the wavelength are attributes.
        """
        x, y = pixel_centres(self.plane.shape, self.plane.pitch)
        axes = {"y": (y, "m"), "x": (x, "m")}
        labelled = {"component": (list(self.components), ""), **axes} if self.components else axes
        plane = self.plane
        return tables.labelled(
            self.values, labelled, name="field", unit="1", wavelength_m=self.wavelength,
            pixel_pitch_m=plane.pitch, centre_m=plane.centre.tolist(), normal=plane.normal.tolist(),
            up=plane.up.tolist(), focus_m=plane.focus,
        )  # fmt: skip

    @classmethod
    def from_xarray(cls, table: DataArray) -> Field:
        """Field from the labelled array that `to_xarray` made.

        Parameters
        ----------
        table : xarray.DataArray
            Over y and x, or component, y and x, in any order.

        Returns
        -------
        Field

        Raises
        ------
        ValueError
            If axes, or attributes of the plane or the wavelength, are missing.
        """
        wanted = [axis for axis in ("component", "y", "x") if axis in table.dims]
        if not {"y", "x"} <= set(wanted) or len(wanted) != table.ndim:
            got = ", ".join(map(str, table.dims))
            raise ValueError(f"field table: expected axes y and x, or component, y and x, got {got}")
        about = table.attrs
        missing = [name for name in ATTRIBUTES if name not in about]
        if missing:
            raise ValueError(f"field table: expected attributes {', '.join(ATTRIBUTES)}, missing {missing}")
        values = table.transpose(*wanted).values
        plane = CCD(
            about["centre_m"], about["normal"], about["up"], float(about["pixel_pitch_m"]),
            values.shape[-2:], float(about["focus_m"]),
        )  # fmt: skip
        return cls(values, plane, float(about["wavelength_m"]))
