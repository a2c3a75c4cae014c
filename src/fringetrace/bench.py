"""A bench: a scene, its beam and its CCD, traced once; what is recorded with it, and what follows."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fringetrace import guards, phase
from fringetrace.budget import Budget, budget
from fringetrace.field import chosen, complex_field, mutual_intensity
from fringetrace.paths import Paths
from fringetrace.quadrature import mutual_products
from fringetrace.sampling import centred
from fringetrace.scene import CCD, Beam, Scene
from fringetrace.trace import stream, trace
from fringetrace.waves import Array, ComplexArray, FloatArray, checked_wavelength, wavenumber


@dataclass(frozen=True, eq=False)
class Bench:
    """An interferometer: a scene lit by one beam, seen by one CCD, with a reference mirror.

    It is traced once; wavelengths and phase steps then re-use the paths.

    Parameters
    ----------
    scene : Scene
    beam : Beam
    ccd : CCD
    reference : int
        Number of the surface that sends the reference wave back, and that a phase step moves.
    tilt : (tilt_x, tilt_y), radians
        Tilt of that mirror, see `michelson`.
    method : {"auto", "wavefront", "rays"}
        How arrivals become light on the pixels, see `complex_field`. "wavefront" averages over each
        pixel; with "rays" each ray counts at the centre of its part of the pixel, see `centred`.
    """

    scene: Scene
    beam: Beam
    ccd: CCD
    reference: int
    tilt: tuple[float, float] = (0.0, 0.0)
    method: str = "auto"
    # the paths once traced, and the light of the last wavelength
    derived: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "derived": {}}

    def trace(
        self, *, progress: Callable[[int, int], None] | None = None, threads: int | None = None
    ) -> Paths:
        """All paths of the bench, traced at the first call and kept.

        Parameters
        ----------
        progress : callable, optional
            Called with the rays done and the rays in all.
        threads : int, optional
            Default: all cores.

        Returns
        -------
        Paths
        """
        if "paths" not in self.derived:
            self.derived["paths"] = trace(self.scene, self.beam, self.ccd, progress=progress, threads=threads)
        paths: Paths = self.derived["paths"]
        return paths

    def sampled(self, shape: tuple[int, int]) -> Paths:
        """Paths of a coarser grid of rays over the same beam, with their polylines, to look at.

        Parameters
        ----------
        shape : (rows, columns)

        Returns
        -------
        Paths
        """
        beam = replace(self.beam, shape=shape)
        return trace(self.scene, beam, self.ccd, record=True)

    def fields(self, wavelength: float) -> ComplexArray:
        """Mean fields on the pixels, one for each number of visits to the reference mirror.

        Parameters
        ----------
        wavelength : float, metres

        Returns
        -------
        (n, rows, columns) complex128, n at least 2
            [0] is the light that met the sample only, [1] the reference. A phase step of delta
            on the reference multiplies [m] by exp(i m delta).
        """
        return self._kept(wavelength, "fields", lambda: self._found(wavelength, complex_field))

    def mutual(self, wavelength: float) -> ComplexArray:
        """Mutual intensities on the pixels of the light with m and n visits to the reference mirror.

        Parameters
        ----------
        wavelength : float, metres

        Returns
        -------
        (n, n, rows, columns) complex128, n at least 2
            Mean of E_m conj(E_n) over each pixel, see `mutual_intensity`: fringes finer than a
            pixel have lost their visibility.
        """
        return self._kept(wavelength, "mutual", lambda: self._found(wavelength, mutual_intensity))

    def _kept(self, wavelength: float, what: str, find: Callable[[], Array]) -> Array:
        """What is found of the light of a wavelength, kept for the last one."""
        kept = self.derived.setdefault("light", {})
        wavelength = checked_wavelength(wavelength)
        if (wavelength, what) not in kept:
            for key in [key for key in kept if key[0] != wavelength]:
                del kept[key]
            kept[wavelength, what] = find()
        light: Array = kept[wavelength, what]
        return light

    def _found(self, wavelength: float, find: Callable[..., ComplexArray]) -> ComplexArray:
        """Fields or mutual intensities."""
        paths = self.trace()
        if chosen(paths, self.method) == "rays":
            if find is mutual_intensity:
                return mutual_products(self.fields(wavelength))
            return self._summed(paths.detected, wavelength)
        visits = paths.visits(self.reference)
        light = find(paths, wavelength, groups=visits, method="wavefront")
        groups = light.shape[:-2]
        missing = [(0, max(0, 2 - n)) for n in groups]
        return np.pad(light, [*missing, (0, 0), (0, 0)])

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
        (n, rows, columns) complex128
        """
        total = np.zeros((2, *self.ccd.shape), dtype=np.complex128)
        chunks = stream(self.scene, self.beam, self.ccd, progress=progress, threads=threads)
        for paths in chunks:
            part = self._summed(paths.detected, wavelength)
            if len(part) > len(total):
                total, part = part, total
            total[: len(part)] += part
        return total

    def _summed(self, paths: Paths, wavelength: float) -> ComplexArray:
        parts = max(1, self.beam.shape[1] // self.ccd.shape[1])
        visits, paths = paths.visits(self.reference), centred(paths, parts)
        orders = range(max(2, int(visits.max(initial=0)) + 1))
        return np.stack([complex_field(paths.where(visits == order), wavelength, "rays") for order in orders])

    def field(self, wavelength: float, step: float = 0.0) -> ComplexArray:
        """Field on the CCD.

        Parameters
        ----------
        wavelength : float, metres
        step : float, radians
            Phase added to the reference at each visit to its mirror.

        Returns
        -------
        (rows, columns) complex128
        """
        fields = self.fields(wavelength)
        turns = np.exp(1j * step * np.arange(len(fields)))
        return np.asarray(np.tensordot(turns, fields, axes=1), dtype=np.complex128)

    def interferogram(self, wavelength: float, *, modulus: bool = False, step: float = 0.0) -> FloatArray:
        """What the CCD records.

        Parameters
        ----------
        wavelength : float, metres
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
            Where fringes alias, pixels starve or waves fold, see `fringetrace.guards`.
        """
        guards.check(self.trace(), wavelength, self.method)
        light = self._recorded(wavelength, step)
        return np.sqrt(light) if modulus else light

    def _recorded(self, wavelength: float, step: float) -> FloatArray:
        """Irradiance with a phase step."""
        mutual = self.mutual(wavelength)
        turns = np.exp(1j * step * np.arange(len(mutual)))
        # what rounding leaves of a dark pixel may be negative
        light = np.maximum(np.einsum("m,n,mnij->ij", turns, turns.conj(), mutual).real, 0.0)
        return np.asarray(light, dtype=np.float64)

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
        guards.check(self.trace(), wavelength, self.method)
        costs = budget(self.trace(), wavelength, self.method)
        guards.check_budget(costs)
        return costs

    def phase_steps(self, wavelength: float, steps: int = 4) -> FloatArray:
        """Frames of a phase-stepped recording: frame k adds 2 pi k / steps to the reference.

        Parameters
        ----------
        wavelength : float, metres
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
        shifts = 2.0 * math.pi * np.arange(steps) / steps

        def frames() -> FloatArray:
            return np.stack([self._recorded(wavelength, shift) for shift in shifts])

        return self._kept(wavelength, f"{steps} steps", frames).copy()

    def carrier(self, wavelength: float) -> FloatArray:
        """Phase of the tilted reference wave over the pixels, 0 at the centre of the image.

        A plane wave off a plane mirror turned by a: its path on the CCD rises by sin 2a a metre
        along the tilt, exactly.

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


def path_slope(tilt: tuple[float, float]) -> tuple[float, float]:
    """Rise of the optical path of a beam off a tilted plane mirror, on a plane across the beam.

    A mirror tilted by a turns the beam by 2a; the plane wave's path then rises by sin 2a a
    metre in the direction of the tilt.

    Parameters
    ----------
    tilt : (tilt_x, tilt_y), radians

    Returns
    -------
    (slope_x, slope_y), metres a metre
    """
    angle = math.hypot(*tilt)
    scale = math.sin(2.0 * angle) / angle if angle > 0.0 else 2.0
    return scale * tilt[0], scale * tilt[1]


def pixel_centres(shape: tuple[int, int], pitch: float) -> tuple[FloatArray, FloatArray]:
    """Positions of pixels about the centre of their image.

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
