"""Interferometer: a scene with beam, CCD and arms; traced once, then recorded at any wavelength."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fringetrace.accuracy import Budget, budget, checks
from fringetrace.core import (
    Array,
    ComplexArray,
    FloatArray,
    checked_wavelength,
    described,
    length_text,
    value_text,
)
from fringetrace.field import chosen, products
from fringetrace.instruments import records
from fringetrace.instruments.arm_light import add_orders, arm_fields, arm_mutual_intensity, ray_sums
from fringetrace.instruments.arms import Arms
from fringetrace.instruments.recording import (
    path_difference,
    phase_shifts,
    recorded,
    step_axis,
    wrapped_phase,
)
from fringetrace.optics import Absorber
from fringetrace.scene import CCD, Beam, Line, Scene, Spectrum
from fringetrace.tracing import Paths, at_wavelength, needs, stream, trace

if TYPE_CHECKING:
    from xarray import Dataset

Light = float | Spectrum | Line
Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Interferometer:
    """Interferometer: a scene lit by one beam, seen by one CCD, with a reference and a sample arm.

    It is traced once; wavelengths and phase steps then re-use the paths. Where media bend or split light
    another way at another wavelength, it is traced once a wavelength (the last one is kept): `traced` says
    at which.

    Parameters
    ----------
    scene : Scene
    beam : Beam
    ccd : CCD
    arms : Arms
        Which light is the reference's, and how its mirror is tilted.
    method : {"auto", "wavefront", "rays"}
        How arrivals become light on the pixels, see `complex_field`. "wavefront" averages over each
        pixel; with "rays" each ray counts at the centre of its part of the pixel, see `centred`.
    max_bounces : int
    min_amplitude : float
        See `trace`.

    Raises
    ------
    ValueError
        If the arms name surfaces that the scene does not have.
    """

    scene: Scene
    beam: Beam
    ccd: CCD
    arms: Arms
    method: str = "auto"
    max_bounces: int = 12
    min_amplitude: float = 1e-6
    # the paths once traced, at which wavelengths, and the light of the last one
    derived: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    def __repr__(self) -> str:
        names = [value_text(surface.name) for surface in self.scene.surfaces]
        (rows, columns), (across, along) = self.ccd.shape, self.beam.shape
        tilt = ", ".join(f"{1e6 * angle:.4g}" for angle in self.arms.tilt)
        at = ", ".join("any wavelength" if one is None else length_text(one) for one in self.traced)
        turned = f" tilted by ({tilt}) urad" if any(self.arms.tilt) else ""
        return described(
            self,
            f"reference {names[self.arms.reference.surface]}{turned}",
            "" if self.arms.sample is None else f"sample {names[self.arms.sample]}",
            f"{columns} x {rows} pixels of {length_text(self.ccd.pitch)}, {along} x {across} rays",
            f"traced at {at}" if self.traced else "not traced",
        )

    def __post_init__(self) -> None:
        count = len(self.scene.surfaces)
        for what, number in (("reference", self.arms.reference.surface), ("sample", self.arms.sample)):
            if number is not None and not 0 <= number < count:
                raise ValueError(f"arms {what}: expected a surface from 0 to {count - 1}, got {number}")

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "derived": {}}

    @property
    def traced(self) -> tuple[float | None, ...]:
        """Wavelengths (metres) of the traces so far; None: one trace for all wavelengths."""
        return tuple(self.derived.get("traced", ()))

    @property
    def warned(self) -> set[str]:
        """Names of the warnings that were given; none is given twice."""
        given: set[str] = self.derived.setdefault("warned", set())
        return given

    def _check(self, light: Light) -> None:
        """Warn of an image that cannot be trusted, at its shortest wavelength."""
        shortest = float(self.spectrum(light).wavelengths[0])
        checks.check(self.trace(shortest), shortest, self.method)

    def trace(
        self,
        wavelength: float | None = None,
        *,
        progress: Progress | None = None,
        threads: int | None = None,
    ) -> Paths:
        """Trace all paths at the first call, and keep them.

        Parameters
        ----------
        wavelength : float, metres, optional
            Needed at the first call where the scene depends on it. Paths of another one are used as long
            as no light goes another way; else it is traced again. None: the paths that there are.
        progress : callable, optional
            Called with the rays done and the rays in all.
        threads : int, optional
            Default: all cores.

        Returns
        -------
        Paths

        Raises
        ------
        ValueError
            For a wavelength that is missing, or outside the range of a material.

        Warns
        -----
        FringetraceWarning
            As `fringetrace.trace`.
        """
        kept: Paths | None = self.derived.get("paths")
        served = None if kept is None else _served(self.derived.get("served", kept), kept, wavelength)
        if served is None:
            at = None if needs(self.scene) is None else wavelength
            self.derived["paths"] = served = trace(
                self.scene, self.beam, self.ccd, wavelength=at, max_bounces=self.max_bounces,
                min_amplitude=self.min_amplitude, progress=progress, threads=threads, warn=self.warned,
            )  # fmt: skip
            self.derived["traced"] = [*self.traced, at]
        self.derived["served"] = served
        return served

    def sampled(self, shape: tuple[int, int], wavelength: float | None = None) -> Paths:
        """Recorded paths of a coarser ray grid over the same beam, for drawing.

        Parameters
        ----------
        shape : (rows, columns)
        wavelength : float, metres, optional
            Needed where the scene depends on it.

        Returns
        -------
        Paths
        """
        beam = replace(self.beam, shape=shape)
        return trace(
            self.scene, beam, self.ccd, wavelength=wavelength, max_bounces=self.max_bounces,
            min_amplitude=self.min_amplitude, record=True, warn=False,
        )  # fmt: skip

    def shut(self, arm: str) -> Interferometer:
        """The interferometer with a shutter in one arm, whose light ends there.

        Parameters
        ----------
        arm : {"reference", "sample"}

        Returns
        -------
        Interferometer
            Of its own, not traced yet. What reaches the CCD does so to the bit as with both arms open.

        Raises
        ------
        ValueError
            For another arm, or one that shares its surfaces with the other.
        """
        blocked = self.arms.blocked(arm)
        surfaces = list(self.scene.surfaces)
        surfaces[blocked] = replace(surfaces[blocked], interface=Absorber(), front=None, back=None)
        return replace(self, scene=replace(self.scene, surfaces=tuple(surfaces)))

    def reach(self, wavelength: float) -> float:
        """Largest optical path difference between any light on the CCD.

        Parameters
        ----------
        wavelength : float, metres

        Returns
        -------
        float, metres
        """
        length = self.trace(wavelength).detected.length
        return float(np.ptp(length)) if len(length) else 0.0

    def spectrum(self, light: Light) -> Spectrum:
        """Discrete spectrum that represents the light.

        Parameters
        ----------
        light : float, Spectrum or Line
            A wavelength in metres; a line is sampled so that its coherence is right, to `lines.ERROR`, for
            all path differences that there are, see `reach` and `Line.sampled`.

        Returns
        -------
        Spectrum
            From the shortest wavelength to the longest.
        """
        if isinstance(light, Line):
            light = light.sampled(self.reach(light.centre))
        if isinstance(light, Spectrum):
            order = np.argsort(light.wavelengths, kind="stable")
            return Spectrum(light.wavelengths[order], light.weights[order])
        return Spectrum(np.array([checked_wavelength(light)]), np.ones(1))

    def fields(self, wavelength: float) -> ComplexArray:
        """Mean fields on the pixels, one per count of the reference's mark.

        Parameters
        ----------
        wavelength : float, metres

        Returns
        -------
        (n, rows, columns) complex128, n at least 2; or (n, 3, rows, columns)
            [0] is the light that met the sample only, [1] the reference (unless the mark counts others). A
            phase step of delta on the reference multiplies [m] by exp(i m delta). Of polarised light, the
            components along the CCD's columns, rows and normal.
        """

        def find() -> ComplexArray:
            return arm_fields(self.trace(wavelength), self.arms.reference, wavelength, self.method)

        return self._kept(wavelength, "fields", find)

    def mutual(self, light: Light) -> ComplexArray:
        """Mutual intensities on the pixels of light with m and n counts of the reference's mark.

        Parameters
        ----------
        light : float, Spectrum or Line
            A wavelength in metres, or light of several; see `spectrum`.

        Returns
        -------
        (n, n, rows, columns) complex128, n at least 2
            Mean of E_m conj(E_n) over each pixel, see `mutual_intensity`: fringes finer than a
            pixel have lost their visibility. Summed over components of polarised light, and over wavelengths.
        """
        return self._kept(light, "mutual", lambda: self._mutual(light))

    def _mutual(self, light: Light) -> ComplexArray:
        if not isinstance(light, (Spectrum, Line)):
            paths = self.trace(light)
            if chosen(paths, self.method) == "rays":  # the fields are kept, too
                return products(self.fields(light))
            return arm_mutual_intensity(paths, self.arms.reference, light, self.method)
        spectrum = self.spectrum(light)
        paths = self.trace(float(spectrum.wavelengths[0]))
        if needs(self.scene) is None and chosen(paths, self.method) != "rays":
            return arm_mutual_intensity(paths, self.arms.reference, spectrum, self.method)
        total = np.zeros((2, 2, *self.ccd.shape), dtype=np.complex128)
        for wavelength, share in zip(spectrum.wavelengths.tolist(), spectrum.weights, strict=True):
            total = add_orders(share * self._mutual(wavelength), total, axes=2)
        return total

    def _kept(self, light: Light, what: str, find: Callable[[], Array]) -> Array:
        """What is found of some light, kept for the last one."""
        kept = self.derived.setdefault("light", {})
        if not isinstance(light, (Spectrum, Line)):
            light = checked_wavelength(light)
        if (light, what) not in kept:
            for key in [key for key in kept if key[0] != light]:
                del kept[key]
            kept[light, what] = find()
        found: Array = kept[light, what]
        return found

    def stream_fields(
        self, wavelength: float, *, progress: Progress | None = None, threads: int | None = None
    ) -> ComplexArray:
        """Fields by ray sum while tracing; memory does not grow with the number of rays.

        Parameters
        ----------
        wavelength : float, metres
        progress, threads
            See `trace`.

        Returns
        -------
        (n, rows, columns) complex128, or (n, 3, rows, columns)
        """
        components = () if self.beam.polarisation is None else (3,)
        total = np.zeros((2, *components, *self.ccd.shape), dtype=np.complex128)
        chunks = stream(
            self.scene, self.beam, self.ccd, wavelength=wavelength, max_bounces=self.max_bounces,
            min_amplitude=self.min_amplitude, progress=progress, threads=threads, warn=self.warned,
        )  # fmt: skip
        for paths in chunks:
            total = add_orders(total, ray_sums(paths, self.arms.reference, wavelength))
        return total

    def field(self, wavelength: float, step: float = 0.0) -> ComplexArray:
        """Complex field on the CCD.

        Parameters
        ----------
        wavelength : float, metres
        step : float, radians
            Phase added to the reference at each count of its mark.

        Returns
        -------
        (rows, columns) complex128, or (3, rows, columns) of polarised light
        """
        self._check(wavelength)
        fields = self.fields(wavelength)
        turns = self.arms.phasors(step, len(fields))
        return np.asarray(np.tensordot(turns, fields, axes=1), dtype=np.complex128)

    def interferogram(self, light: Light, *, modulus: bool = False, step: float = 0.0) -> FloatArray:
        """Interferogram: irradiance on the CCD.

        Parameters
        ----------
        light : float, Spectrum or Line
            A wavelength in metres. Several do not interfere: their irradiances add; see `spectrum`.
        modulus : bool
            Root of the irradiance, |E|, instead of the irradiance |E|^2.
        step : float, radians
            Phase added to the reference at each count of its mark.

        Returns
        -------
        (rows, columns) float64
            1 where a beam of unit irradiance would fall straight on the CCD.

        Warns
        -----
        FringetraceWarning
            Where fringes alias, pixels starve or waves fold, and as `fringetrace.trace`; each once, see
            `fringetrace.accuracy.checks`.
        """
        self._check(light)
        image = recorded(self.mutual(light), self.arms, step)
        return np.sqrt(image) if modulus else image

    def phase_steps(self, light: Light, steps: int = 4) -> FloatArray:
        """Phase-stepped frames: frame k adds 2 pi k / steps to the phase of the reference.

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

        Warns
        -----
        FringetraceWarning
            As `interferogram`.
        """
        shifts = phase_shifts(steps)
        self._check(light)

        def frames() -> FloatArray:
            return np.stack([recorded(self.mutual(light), self.arms, shift) for shift in shifts])

        return self._kept(light, f"{steps} steps", frames).copy()

    def carrier(self, wavelength: float) -> FloatArray:
        """Carrier phase of the tilted reference wave, see `Arms.carrier`: (rows, columns) float64."""
        return self.arms.carrier(self.ccd, wavelength)

    def wrapped(self, wavelength: float, steps: int = 4) -> FloatArray:
        """Wrapped phase of the reference relative to the sample, from phase-stepped frames.

        Parameters
        ----------
        wavelength : float, metres
        steps : int, at least 3

        Returns
        -------
        (rows, columns) float64, radians
            Carrier included; NaN where either arm brings no light.

        Warns
        -----
        FringetraceWarning
            As `interferogram`.
        """
        return wrapped_phase(self.phase_steps(wavelength, steps), self.mutual(wavelength))

    def path_difference(self, wavelength: float, steps: int = 4) -> FloatArray:
        """Optical path that the sample adds to its arm, from phase steps, unwrapped.

        Parameters
        ----------
        wavelength : float, metres
        steps : int, at least 3

        Returns
        -------
        (rows, columns) float64, metres
            Up to a constant (the piston, and whole wavelengths); NaN where either arm brings no light. It
            must change by less than wavelength / 2 between neighbouring pixels.

        Raises
        ------
        ValueError
            If there are fewer than 3 steps, or no pixel with light from both arms.

        Warns
        -----
        FringetraceWarning
            As `interferogram`.
        """
        return path_difference(self.wrapped(wavelength, steps), self.carrier(wavelength), wavelength)

    def height(self, wavelength: float, steps: int = 4) -> FloatArray:
        """Height of a reflecting sample, towards the light: -path_difference / (2 index of the immersion).

        Parameters
        ----------
        wavelength : float, metres
        steps : int, at least 3

        Returns
        -------
        (rows, columns) float64, metres
            Up to a constant; NaN where either arm brings no light. Steps between neighbouring pixels must
            stay under wavelength / 4 in the immersion.

        Raises
        ------
        ValueError
            As `path_difference`.

        Warns
        -----
        FringetraceWarning
            As `interferogram`.
        """
        path = self.path_difference(wavelength, steps)
        return np.asarray(path / (-2.0 * self.arms.index(wavelength)), dtype=np.float64)

    def budget(self, wavelength: float) -> Budget:
        """Error budget of the image, in waves: rounding, facets, sampling, pixels.

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
        return budget(self.trace(wavelength), wavelength, self.method)

    def dataset(self, wavelength: float, steps: int = 4) -> Dataset:
        """Labelled dataset of all that is recorded at a wavelength, for xarray and NetCDF.

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
            reference_tilt_rad=list(self.arms.tilt), method=self.method,
        )  # fmt: skip


def _served(latest: Paths, kept: Paths, wavelength: float | None) -> Paths | None:
    """Paths at a wavelength, those made latest or made of those kept; None where light goes another way."""
    if wavelength is None or wavelength == latest.wavelength:
        return latest
    try:
        return at_wavelength(kept, wavelength)
    except ValueError:
        return None
