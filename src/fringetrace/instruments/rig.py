"""A rig: a scene, its beam and its CCD, traced once; the light of its arms on the pixels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, checked_wavelength
from fringetrace.field import centred, chosen, complex_field, mutual_intensity, products
from fringetrace.instruments.arms import Mark
from fringetrace.optics import Absorber
from fringetrace.scene import CCD, Beam, Line, Scene, Spectrum
from fringetrace.tracing import Paths, at_wavelength, needs, stream, trace

if TYPE_CHECKING:
    from fringetrace.optics import Material

Light = float | Spectrum | Line


@dataclass(frozen=True, eq=False)
class Rig:
    """An interferometer: a scene lit by one beam, seen by one CCD, with a reference arm.

    It is traced once; wavelengths and phase steps then re-use the paths. Where media bend or split light
    another way at another wavelength, it is traced once a wavelength (the last one is kept): `traced` says
    at which.

    Parameters
    ----------
    scene : Scene
    beam : Beam
    ccd : CCD
    reference : int
        Number of the surface that makes the reference wave, and that a phase step moves.
    tilt : (tilt_x, tilt_y), radians
        Tilt of that surface, see `michelson`.
    method : {"auto", "wavefront", "rays"}
        How arrivals become light on the pixels, see `complex_field`. "wavefront" averages over each
        pixel; with "rays" each ray counts at the centre of its part of the pixel, see `centred`.
    mark : Mark, optional
        Which light a phase step turns, and how often. None: by each visit to the reference.
    immersion : Material, optional
        What the reference is tilted in: its path rises by the index times that in a vacuum.
    max_bounces : int
    min_amplitude : float
        See `trace`.
    sample : int, optional
        Number of a surface that all light of the sample's arm, and of no other, meets; see `shut`.
    """

    scene: Scene
    beam: Beam
    ccd: CCD
    reference: int
    tilt: tuple[float, float] = (0.0, 0.0)
    method: str = "auto"
    mark: Mark | None = None
    immersion: Material | None = None
    max_bounces: int = 12
    min_amplitude: float = 1e-6
    sample: int | None = None
    # the paths once traced, at which wavelengths, and the light of the last one
    derived: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "derived": {}}

    @property
    def traced(self) -> tuple[float | None, ...]:
        """Wavelengths (metres) that it has been traced at, one after the other; None: one trace for all."""
        return tuple(self.derived.get("traced", ()))

    def trace(
        self,
        wavelength: float | None = None,
        *,
        progress: Callable[[int, int], None] | None = None,
        threads: int | None = None,
    ) -> Paths:
        """All paths of the bench, traced at the first call and kept.

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
        """
        kept: Paths | None = self.derived.get("paths")
        served = None if kept is None else _served(self.derived.get("served", kept), kept, wavelength)
        if served is None:
            at = None if needs(self.scene) is None else wavelength
            self.derived["paths"] = served = trace(
                self.scene, self.beam, self.ccd, wavelength=at, max_bounces=self.max_bounces,
                min_amplitude=self.min_amplitude, progress=progress, threads=threads,
            )  # fmt: skip
            self.derived["traced"] = [*self.traced, at]
        self.derived["served"] = served
        return served

    def shut(self, arm: str) -> Self:
        """The same bench with a black shutter in one arm: its light ends there and is not traced on.

        Parameters
        ----------
        arm : {"reference", "sample"}

        Returns
        -------
        Rig
            Of its own, not traced yet. What reaches the CCD does so to the bit as with both arms open.

        Raises
        ------
        ValueError
            For another arm, or one that shares its surfaces with the other.
        """
        arms = {
            # marked light parts from the rest where both meet
            "reference": self.reference if self.mark is None else None,
            "sample": self.sample,
        }
        if arm not in arms:
            raise ValueError(f"shut: expected {' or '.join(map(repr, arms))}, got {arm!r}")
        blocked = arms[arm]
        if blocked is None:
            raise ValueError(f"shut: expected an arm that light of the other does not pass, got {arm!r}")
        surfaces = list(self.scene.surfaces)
        surfaces[blocked] = replace(surfaces[blocked], interface=Absorber(), front=None, back=None)
        return replace(self, scene=replace(self.scene, surfaces=tuple(surfaces)))

    def sampled(self, shape: tuple[int, int], wavelength: float | None = None) -> Paths:
        """Paths of a coarser grid of rays over the same beam, with their polylines, to look at.

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
            min_amplitude=self.min_amplitude, record=True,
        )  # fmt: skip

    def reach(self, wavelength: float) -> float:
        """Largest difference between the optical paths of any light on the CCD.

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
        """The wavelengths that stand for light.

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
        """Mean fields on the pixels, one for each count of the `mark`: of visits to the reference mirror.

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
        return self._kept(wavelength, "fields", lambda: self._found(wavelength, complex_field))

    def mutual(self, light: Light) -> ComplexArray:
        """Mutual intensities on the pixels of the light with m and n visits to the reference mirror.

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
            return self._found(light, mutual_intensity)
        spectrum = self.spectrum(light)
        paths = self.trace(float(spectrum.wavelengths[0]))
        if needs(self.scene) is None and chosen(paths, self.method) == "wavefront":
            return _from_two(mutual_intensity(paths, spectrum, self._counted(paths), "wavefront"))
        total = np.zeros((2, 2, *self.ccd.shape), dtype=np.complex128)
        for wavelength, share in zip(spectrum.wavelengths.tolist(), spectrum.weights, strict=True):
            part = share * self._found(wavelength, mutual_intensity)
            short, total = sorted((part, total), key=len)
            total[: len(short), : len(short)] += short
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

    def _found(self, wavelength: float, find: Callable[..., ComplexArray]) -> ComplexArray:
        """Fields or mutual intensities."""
        paths = self.trace(wavelength)
        if chosen(paths, self.method) == "rays":
            if find is mutual_intensity:
                return products(self.fields(wavelength))
            return self._summed(paths.detected, wavelength)
        return _from_two(find(paths, wavelength, groups=self._counted(paths), method="wavefront"))

    def _counted(self, paths: Paths) -> npt.NDArray[np.int64]:
        """How often a phase step turns each path."""
        return paths.visits(self.reference) if self.mark is None else self.mark.count(paths)

    def _turns(self, step: float, orders: int) -> ComplexArray:
        """What a phase step multiplies the light of each count by."""
        sense = 1 if self.mark is None else self.mark.sense
        return np.asarray(np.exp(1j * (sense * step) * np.arange(orders)), dtype=np.complex128)

    def stream_fields(
        self,
        wavelength: float,
        *,
        progress: Callable[[int, int], None] | None = None,
        threads: int | None = None,
    ) -> ComplexArray:
        """`fields` by ray sum, while tracing: no path is kept, so memory does not grow with the rays.

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
            min_amplitude=self.min_amplitude, progress=progress, threads=threads,
        )  # fmt: skip
        for paths in chunks:
            part = self._summed(paths.detected, wavelength)
            if len(part) > len(total):
                total, part = part, total
            total[: len(part)] += part
        return total

    def _summed(self, paths: Paths, wavelength: float) -> ComplexArray:
        parts = max(1, self.beam.shape[1] // self.ccd.shape[1])
        count, paths = self._counted(paths), centred(paths, parts)
        orders = range(max(2, int(count.max(initial=0)) + 1))
        return np.stack([complex_field(paths.where(count == order), wavelength, "rays") for order in orders])


def _from_two(light: ComplexArray) -> ComplexArray:
    """Fields or mutual intensities of two groups at least."""
    missing = [(0, max(0, 2 - n)) for n in light.shape[:-2]]
    return np.pad(light, [*missing, (0, 0), (0, 0)])


def _served(latest: Paths, kept: Paths, wavelength: float | None) -> Paths | None:
    """Paths at a wavelength, those made latest or made of those kept; None where light goes another way."""
    if wavelength is None or wavelength == latest.wavelength:
        return latest
    try:
        return at_wavelength(kept, wavelength)
    except ValueError:
        return None
