"""Far field of a sample lit from one direction: one trace, summed at a detector."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, FloatArray, checked_wavelengths, short_repr, warn_once
from fringetrace.field import TOLERANCE, spectrum
from fringetrace.scattering.detectors import Detector, Pixels, fraunhofer_paths, sides, towards
from fringetrace.scattering.illumination import Illumination
from fringetrace.scene import Beam, Scene
from fringetrace.tracing import Fate, Losses, Paths, Rays, needs, stream

FATES = ("reflected", "transmitted", "missed", "absorbed", "truncated")
# Rays whose sums are taken at once: 100 MB of paths.
CHUNK = 2**17


@dataclass(frozen=True, eq=False)
class Far:
    """Far field of a sample lit from one direction.

    Attributes
    ----------
    amplitude : (theta, phi, parts, wavelength) complex128, m^2 (rays, where they have no area)
        Sum of area * amplitude * exp(i k length) over the rays that arrive; of one number a ray, or
        of s and p light, see `detectors.sides`. Powers of several parts add.
    power : (theta, phi, wavelength) float64, m^2 (rays)
        Sum of area * |amplitude|^2 over them.
    rays : (theta, phi) int64
        Their number.
    shares : dict
        Parts of the incident power by what became of it, see `FATES`; means over wavelengths.
    incident : float, m^2 (rays)
    losses : Losses
        What was not followed to its end.
    """

    amplitude: ComplexArray
    power: FloatArray
    rays: npt.NDArray[np.int64]
    shares: dict[str, float]
    incident: float
    losses: Losses

    __repr__ = short_repr


def _shares(paths: Paths) -> FloatArray:
    """Power by fate, in the order of `FATES`."""
    power, left, met = np.abs(paths.amplitude) ** 2, paths.fate == Fate.LEFT, paths.bounces > 0
    up = paths.direction[:, 2] > 0.0
    ledger = paths.ledger()
    unit = 1.0 if paths.area is None else paths.area
    sums = [unit * power[left & which].sum() for which in (met & up, met & ~up, ~met)]
    return np.array([*sums, ledger.absorbed, ledger.truncated])


def _bands(scene: Scene, waves: FloatArray) -> list[tuple[float | None, slice]]:
    """Wavelengths that one trace serves: all of them, or each its own where rays or amplitudes hang on it."""
    if needs(scene) is None:
        return [(None, slice(None))]
    return [(float(wave), slice(i, i + 1)) for i, wave in enumerate(waves)]


@dataclass(frozen=True)
class FarFieldOptions:
    """How far light is traced, and how its paths are added up; see `brdf`.

    Parameters
    ----------
    method : {"rays", "diffraction", "power"}
    max_bounces : int
    min_amplitude : float
    max_reflections : int, optional
    half_wave_loss : bool
    tolerance : float
    threads : int, optional
    """

    method: str = "rays"
    max_bounces: int = 100
    min_amplitude: float = 1e-6
    max_reflections: int | None = None
    half_wave_loss: bool = True
    tolerance: float = TOLERANCE
    threads: int | None = None


@dataclass(frozen=True, eq=False)
class _Adding:
    """How paths are added up at a detector."""

    lighting: Illumination
    detector: Detector
    options: FarFieldOptions
    wanted: npt.NDArray[np.bool_]

    def chunk(
        self, paths: Paths, start: float, waves: FloatArray
    ) -> tuple[ComplexArray, FloatArray, npt.NDArray[np.int64]]:
        """Amplitudes (theta, phi, parts, wavelength), powers and numbers (theta, phi) of some paths."""
        size, centre = self.wanted.shape, np.asarray(self.lighting.centre)
        total = np.zeros((self.wanted.size, parts(paths.source), len(waves)), dtype=np.complex128)
        power, count = np.zeros(self.wanted.size), np.zeros(self.wanted.size, dtype=np.int64)
        unit = 1.0 if paths.area is None else paths.area
        arrivals = self.detector.arrivals(paths, centre)
        if self.options.method == "diffraction":
            arrivals = fraunhofer_paths(paths, self.detector, centre)
        since = 0.0 if isinstance(self.detector, Pixels) else start
        for i, (rows, length) in enumerate(arrivals):
            count[i], power[i] = len(rows), unit * (np.abs(paths.amplitude[rows]) ** 2).sum()
            if self.wanted.flat[i] and len(rows):
                amplitude = self._seen(paths, rows, i)
                total[i] = unit * spectrum(length - since, amplitude, waves, self.options.tolerance)
        return total.reshape(*size, *total.shape[1:]), power.reshape(size), count.reshape(size)

    def _seen(self, paths: Paths, rows: npt.NDArray[np.int64], place: int) -> ComplexArray:
        """(parts, n) amplitudes of some paths, as seen from one of the detector's directions."""
        amplitude = paths.amplitude[None, rows]
        if paths.field is not None:
            theta, phi = (
                float(angles.flat[place])
                for angles in np.meshgrid(self.detector.theta, self.detector.phi, indexing="ij")
            )
            amplitude = sides(towards(theta, phi), phi) @ paths.field[rows].T
        if not self.options.half_wave_loss:
            amplitude = np.where(paths.reflections[rows] % 2 == 1, -amplitude, amplitude)
        return amplitude


def parts(source: Beam | Rays) -> int:
    """Number of field components: one for scalar light, two (s and p) for polarised light."""
    return 1 if source.polarisation is None else 2


def mean(fars: Sequence[Far]) -> Far:
    """Mean far field of mutually incoherent states of light.

    Parameters
    ----------
    fars : sequence of Far
        Lit from the same direction by the same power.

    Returns
    -------
    Far
        Parts of the amplitude of all, so scaled that their powers add up to the mean.
    """
    if len(fars) == 1:
        return fars[0]
    return Far(
        np.concatenate([far.amplitude for far in fars], axis=2) / np.sqrt(len(fars)),
        np.mean([far.power for far in fars], axis=0),
        np.sum([far.rays for far in fars], axis=0),
        {name: float(np.mean([far.shares[name] for far in fars])) for name in FATES},
        fars[0].incident,
        reduce(add, (far.losses for far in fars)),
    )


def far_field(
    lighting: Illumination,
    theta: float,
    phi: float,
    detector: Detector,
    wavelengths: npt.ArrayLike,
    options: FarFieldOptions = FarFieldOptions(),
    *,
    jones: npt.ArrayLike | None = None,
    chosen: npt.NDArray[np.bool_] | None = None,
) -> Far:
    """Far field of one incidence: trace the sample once, sum the paths at a detector.

    Parameters
    ----------
    lighting : Illumination
    theta, phi : float, radians
        Where the light comes from.
    detector : Cones, Cells or Pixels
    wavelengths : (w,) float64, metres
    options : FarFieldOptions
    jones : (2,) complex, optional
        Amplitudes of s and p of the light, see `Illumination.light`.
    chosen : (theta, phi) bool, optional
        The directions whose amplitudes are wanted; the others stay 0. Default: all.

    Returns
    -------
    Far
    """
    waves, size = checked_wavelengths(wavelengths), (len(detector.theta), len(detector.phi))
    wanted = np.ones(size, dtype=bool) if chosen is None else chosen
    source = lighting.light(theta, phi, jones)
    total = np.zeros((*size, parts(source), len(waves)), dtype=np.complex128)
    power, count = np.zeros((*size, len(waves))), np.zeros(size, dtype=np.int64)
    shares, incident = np.zeros(len(FATES)), 0.0
    losses: list[Losses] = []
    bands = _bands(lighting.scene, waves)
    adding = _Adding(lighting, detector, options, wanted & (options.method != "power"))
    for wavelength, band in bands:
        start = lighting.start(source, wavelength)
        for paths in stream(
            lighting.scene, source, wavelength=wavelength, max_bounces=options.max_bounces,
            min_amplitude=options.min_amplitude, threads=options.threads, chunk=CHUNK, warn=False,
        ):  # fmt: skip
            shares, incident, kept = shares + _shares(paths), incident + paths.ledger().incident, paths
            losses.append(Losses.of(paths))
            if options.max_reflections is not None:
                kept = paths.where(paths.reflections <= options.max_reflections)
            sums, powers, counts = adding.chunk(kept, start, waves[band])
            total[..., band] += sums
            power[..., band] += powers[..., None]
            count += counts
    fates = dict(zip(FATES, (shares / incident).tolist(), strict=True))
    return Far(total, power, count, fates, incident / len(bands), reduce(add, losses))


def warn_of_losses(fars: Sequence[Far], given: set[str]) -> None:
    """Warn of light that was not followed to its end, or came to boundaries in the wrong medium, once each.

    Parameters
    ----------
    fars : sequence of Far
    given : set of str
        Names of warnings that were given before; those given now are added.

    Warns
    -----
    FringetraceWarning
        Of the one that lost most.
    """
    for far in sorted(fars, key=lambda far: -far.losses.share):
        warn_once(far.losses.problems, given)
