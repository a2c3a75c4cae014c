"""A bench: what is recorded with a rig, and what follows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from fringetrace import phase
from fringetrace.accuracy import Budget, budget, checks
from fringetrace.core import ComplexArray, FloatArray, wavenumber
from fringetrace.instruments import records
from fringetrace.instruments.arms import path_slope
from fringetrace.instruments.rig import Light, Rig
from fringetrace.scene import pixel_centres

if TYPE_CHECKING:
    from xarray import Dataset

    from fringetrace.core import Coordinates


def step_axis(steps: int) -> Coordinates:
    """The axis of phase-stepped frames: a period in equal steps, radians."""
    return {"step": (2.0 * math.pi * np.arange(steps) / steps, "rad")}


class Bench(Rig):
    """An interferometer: what its CCD records, phase steps, heights.

    It is traced once; wavelengths and phase steps then re-use the paths. Parameters are those of `Rig`.
    """

    def field(self, wavelength: float, step: float = 0.0) -> ComplexArray:
        """Field on the CCD.

        Parameters
        ----------
        wavelength : float, metres
        step : float, radians
            Phase added to the reference at each visit to its mirror.

        Returns
        -------
        (rows, columns) complex128, or (3, rows, columns) of polarised light
        """
        fields = self.fields(wavelength)
        turns = self._turns(step, len(fields))
        return np.asarray(np.tensordot(turns, fields, axes=1), dtype=np.complex128)

    def interferogram(self, light: Light, *, modulus: bool = False, step: float = 0.0) -> FloatArray:
        """What the CCD records.

        Parameters
        ----------
        light : float, Spectrum or Line
            A wavelength in metres. Several do not interfere: their irradiances add; see `spectrum`.
        modulus : bool
            Root of the irradiance, |E|, instead of the irradiance |E|^2.
        step : float, radians
            Phase added to the reference at each visit to its mirror.

        Returns
        -------
        (rows, columns) float64
            1 where a beam of unit irradiance would fall straight on the CCD.

        Warns
        -----
        FringetraceWarning
            Where fringes alias, pixels starve or waves fold, see `fringetrace.accuracy.checks`.
        """
        shortest = float(self.spectrum(light).wavelengths[0])
        checks.check(self.trace(shortest), shortest, self.method)
        image = self._recorded(light, step)
        return np.sqrt(image) if modulus else image

    def _recorded(self, light: Light, step: float) -> FloatArray:
        """Irradiance with a phase step."""
        mutual = self.mutual(light)
        turns = self._turns(step, len(mutual))
        # what rounding leaves of a dark pixel may be negative
        image = np.maximum(np.einsum("m,n,mnij->ij", turns, turns.conj(), mutual).real, 0.0)
        return np.asarray(image, dtype=np.float64)

    def budget(self, wavelength: float) -> Budget:
        """What rounding, facets, rays and pixels cost the image, in waves.

        Parameters
        ----------
        wavelength : float, metres

        Returns
        -------
        Budget

        Warns
        -----
        FringetraceWarning
            As `interferogram`, and where facets cost over 1/20 wave.
        """
        checks.check(self.trace(wavelength), wavelength, self.method)
        costs = budget(self.trace(wavelength), wavelength, self.method)
        checks.check_budget(costs)
        return costs

    def phase_steps(self, light: Light, steps: int = 4) -> FloatArray:
        """Frames of a phase-stepped recording: frame k adds 2 pi k / steps to the reference.

        Parameters
        ----------
        light : float, Spectrum or Line
            A wavelength in metres, or light of several, all stepped by the same phase.
        steps : int, at least 3

        Returns
        -------
        (steps, rows, columns) float64
            |E|^2; nothing is traced again.

        Raises
        ------
        ValueError
            If there are fewer than 3 steps.
        """
        if steps < 3:
            raise ValueError(f"phase steps: expected at least 3, got {steps}")
        shifts = step_axis(steps)["step"][0]

        def frames() -> FloatArray:
            return np.stack([self._recorded(light, shift) for shift in shifts])

        return self._kept(light, f"{steps} steps", frames).copy()

    def carrier(self, wavelength: float) -> FloatArray:
        """Phase of the tilted reference wave over the pixels, 0 at the centre of the image.

        A plane wave off a plane mirror turned by a: its path on the CCD rises by sin 2a a metre
        along the tilt, exactly (times the index of the `immersion`).

        Parameters
        ----------
        wavelength : float, metres

        Returns
        -------
        (rows, columns) float64, radians, not wrapped
        """
        x, y = pixel_centres(self.ccd.shape, self.ccd.pitch)
        slope_x, slope_y = path_slope(self.tilt)
        path = slope_x * x[None, :] + slope_y * y[:, None]
        if self.immersion is not None:
            path *= complex(self.immersion.index(wavelength)).real
        return np.asarray(wavenumber(wavelength) * path, dtype=np.float64)

    def wrapped(self, wavelength: float, steps: int = 4) -> FloatArray:
        """Phase by which the reference leads the sample, from phase-stepped frames, wrapped.

        Parameters
        ----------
        wavelength : float, metres
        steps : int, at least 3

        Returns
        -------
        (rows, columns) float64, radians
            Carrier included; NaN where either arm brings no light.
        """
        frames = self.phase_steps(wavelength, steps)
        mutual = self.mutual(wavelength)
        lit = (mutual[0, 0] != 0.0) & (mutual[1, 1] != 0.0)
        return np.where(lit, phase.n_bucket(frames), np.nan)

    def height(self, wavelength: float, steps: int = 4) -> FloatArray:
        """Height of the sample, the way one measures it: phase steps, carrier off, unwrap, scale.

        Parameters
        ----------
        wavelength : float, metres
        steps : int, at least 3

        Returns
        -------
        (rows, columns) float64, metres
            Up to a constant (the piston, and whole half wavelengths); NaN where either arm brings
            no light. Steps between neighbouring pixels must stay under wavelength / 4.

        Raises
        ------
        ValueError
            If there are fewer than 3 steps, or no pixel with light from both arms.
        """
        measured = self.wrapped(wavelength, steps)
        if np.isnan(measured).all():
            raise ValueError("height: expected pixels with light from both arms, got none")
        flat = phase.wrap(measured - self.carrier(wavelength))
        return phase.height(phase.unwrap(flat), wavelength)

    def path_difference(self, wavelength: float, steps: int = 4) -> FloatArray:
        """Optical path that the sample adds to its arm: phase steps, carrier off, unwrapped.

        Parameters
        ----------
        wavelength : float, metres
        steps : int, at least 3

        Returns
        -------
        (rows, columns) float64, metres
            Up to a constant; NaN where either arm brings no light. It must change by less than
            wavelength / 2 between neighbouring pixels.

        Raises
        ------
        ValueError
            As `height`.
        """
        return np.asarray(-2.0 * self.height(wavelength, steps), dtype=np.float64)

    def dataset(self, wavelength: float, steps: int = 4) -> Dataset:
        """Everything that is recorded at a wavelength, labelled: for xarray, plots, and NetCDF files.

        Parameters
        ----------
        wavelength : float, metres
        steps : int, at least 3

        Returns
        -------
        xarray.Dataset
            interferogram, frames, wrapped_phase, and the field as field_real and field_imag (of polarised
            light with an axis component), over y and x in metres; wavelength, pitch, tilt and convention in
            the attributes. `fringetrace.core.tables.write_netcdf` writes it.

        Warns
        -----
        FringetraceWarning
            As `interferogram`.
        """
        field = self.field(wavelength)
        axes = ("component",) * (field.ndim - 2)
        images = {
            "interferogram": self.interferogram(wavelength),
            "frames": (("step",), self.phase_steps(wavelength, steps)),
            "wrapped_phase": self.wrapped(wavelength, steps),
            "field_real": (axes, field.real),
            "field_imag": (axes, field.imag),
        }
        return records.dataset(
            images, self.ccd.pitch, step_axis(steps), wavelength_m=wavelength,
            reference_tilt_rad=list(self.tilt), method=self.method,
        )  # fmt: skip
