"""BRDF of a sample over angles and wavelengths, from one trace per incidence."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fringetrace.accuracy import hit_error
from fringetrace.core import FloatArray, FringetraceWarning, array, checked_wavelengths
from fringetrace.optics import PolarisationLike, jones_states
from fringetrace.scattering.detectors import Cells, Cones, Detector, Pixels, checked_angles
from fringetrace.scattering.far_fields import FATES, Far, FarFieldOptions, far_field, mean, warn_of_losses
from fringetrace.scattering.illumination import (
    Illumination,
    SourceFunction,
    footprint,
    scene_validity,
)
from fringetrace.scene import Scene
from fringetrace.tracing import Fate, needs, trace

if TYPE_CHECKING:
    from xarray import DataArray

__all__ = [
    "Cells",
    "Cones",
    "Illumination",
    "Pixels",
    "amplitudes",
    "brdf",
    "brdf_sampling_error",
    "far_field",
    "footprint",
    "reciprocity",
    "rounding_error",
]

# Rays along y and x, unless asked for others; and those that are followed in longer numbers.
RAYS, PROBES = (256, 256), 1009
METHODS = ("rays", "diffraction", "power")
AXES = ("theta_i", "phi_i", "theta_o", "phi_o", "wavelength")

Incidence = npt.ArrayLike | tuple[npt.ArrayLike, npt.ArrayLike]


def _angles(incidence: Incidence) -> tuple[FloatArray, FloatArray]:
    """Angles theta and phi of a grid of incidences; phi is 0 unless given."""
    theta, phi = incidence if isinstance(incidence, tuple) else (incidence, 0.0)
    return checked_angles(theta, "incidence theta", 0.5 * np.pi), checked_angles(phi, "incidence phi")


def _check_method(method: str, detector: Detector) -> None:
    if method not in METHODS:
        raise ValueError(f"method: expected one of {', '.join(METHODS)}, got {method!r}")
    if method == "diffraction" and isinstance(detector, Pixels):
        raise ValueError("method: expected 'rays' or 'power' with Pixels, got 'diffraction'")


def _check_spacing(lighting: Illumination, waves: FloatArray) -> None:
    """Fraunhofer's sum over a grid of rays has orders of the grid, unless it is fine."""
    if lighting.source is not None:
        return
    assert lighting.aperture is not None
    sides = zip(lighting.aperture, lighting.rays[::-1], strict=True)
    spacing = max((side / count for side, count in sides if count > 1), default=0.0)
    if spacing > 0.5 * waves.min():
        warnings.warn(
            f"goniometer: rays are {spacing:.3g} m apart, and are a grating with orders of its own unless "
            f"it is less than half of the shortest wavelength, {waves.min():.3g} m; take more rays",
            FringetraceWarning,
            stacklevel=3,
        )


def _squared(far: Far) -> FloatArray:
    """|amplitude|^2 of all parts together."""
    return np.asarray((np.abs(far.amplitude) ** 2).sum(axis=2))


def _density(far: Far, detector: Detector, waves: FloatArray, method: str) -> FloatArray:
    """(theta, phi, wavelength) float64, 1/sr: power a projected solid angle, over the incident one."""
    projected = detector.projected[..., None]
    if method == "power":
        density = far.power / projected
    elif isinstance(detector, Pixels):
        density = _squared(far) / (detector.width**2 * projected)
    else:
        density = _squared(far) / (waves**2 * np.cos(detector.theta)[:, None, None])
    return np.asarray(density / far.incident)


def _coordinates(theta: FloatArray, phi: FloatArray, detector: Detector, waves: FloatArray) -> dict[str, Any]:
    angle = {"units": "rad"}
    return {
        "theta_i": ("theta_i", theta, {**angle, "long_name": "light from: angle from the normal"}),
        "phi_i": ("phi_i", phi, {**angle, "long_name": "light from: angle about the normal"}),
        "theta_o": ("theta_o", detector.theta, {**angle, "long_name": "light to: angle from the normal"}),
        "phi_o": ("phi_o", detector.phi, {**angle, "long_name": "light to: angle about the normal"}),
        "wavelength": ("wavelength", waves, {"units": "m", "long_name": "vacuum wavelength"}),
    }


def amplitudes(
    scene: Scene,
    incidence: Incidence,
    detector: Detector,
    wavelengths: npt.ArrayLike,
    *,
    method: str = "rays",
    aperture: tuple[float, float] | None = None,
    rays: tuple[int, int] = RAYS,
    centre: npt.ArrayLike | None = None,
    source: SourceFunction | None = None,
    polarisation: PolarisationLike = None,
    **options: Any,
) -> DataArray:
    """Complex far-field amplitudes from each direction into each: the BRDF before squaring.

    Parameters
    ----------
    scene, incidence, detector, wavelengths, method, aperture, rays, centre, source, polarisation, options
        As in `brdf`.

    Returns
    -------
    xarray.DataArray, complex128, m^2 (rays, where a source's rays have no area)
        Axes theta_i, phi_i, theta_o, phi_o, wavelength; sum of area * amplitude * exp(i k length).
        In the far field lengths are those between the planes through the centre. Of polarised light
        there is one axis more before the last: polarisation, s and p about the direction of observation.

    Raises
    ------
    ValueError
        As in `brdf`; for unpolarised light, which has no amplitude.
    """
    theta, phi = _angles(incidence)
    waves = checked_wavelengths(wavelengths)
    _check_method(method, detector)
    lighting, summed = Illumination(scene, aperture, rays, centre, source), FarFieldOptions(method, **options)
    lights = jones_states(polarisation, (len(theta), len(phi)), "goniometer")
    if len(lights[0]) > 1:
        raise ValueError(f"amplitudes polarisation: expected one state of light, got {polarisation!r}")
    pairs = [(t, p) for t in theta for p in phi]
    fars = [
        far_field(lighting, *pair, detector, waves, summed, jones=jones)
        for pair, (jones,) in zip(pairs, lights, strict=True)
    ]
    warn_of_losses(fars, set())
    sums = np.reshape([far.amplitude for far in fars], (len(theta), len(phi), *fars[0].amplitude.shape))
    unit = {"units": "m2", "long_name": "sum of area * amplitude", "method": method}
    where = _coordinates(theta, phi, detector, waves)
    if sums.shape[4] == 1:
        return array(sums[..., 0, :], AXES, where, "amplitude", unit)
    where["polarisation"] = ("polarisation", ["s", "p"])
    return array(sums, (*AXES[:4], "polarisation", AXES[4]), where, "amplitude", unit)


def brdf(
    scene: Scene,
    incidence: Incidence,
    detector: Detector,
    wavelengths: npt.ArrayLike,
    *,
    method: str = "rays",
    aperture: tuple[float, float] | None = None,
    rays: tuple[int, int] = RAYS,
    centre: npt.ArrayLike | None = None,
    source: SourceFunction | None = None,
    polarisation: PolarisationLike = None,
    reciprocal: bool = False,
    progress: Callable[[int, int], None] | None = None,
    warned: set[str] | None = None,
    **options: Any,
) -> DataArray:
    """Bidirectional reflectance distribution function (BRDF), radiance over incident irradiance.

    One trace an incidence serves all directions and all wavelengths; where media are dispersive, absorb,
    or have films, it is one trace a wavelength. Light that meets nothing is left
    out of the BRDF, but not of the incident power: the aperture is the sample.

    Parameters
    ----------
    scene : Scene
        The sample's normal is +z.
    incidence : (a,) radians, or ((a,) theta, (b,) phi)
        Where light comes from, position angles: specular light goes to -theta.
    detector : Cones, Cells or Pixels
        Where light goes to.
    wavelengths : (w,) float64, metres
    method : {"rays", "diffraction", "power"}
        "rays": rays that go into a direction's cone, cell or pixel add coherently, as in the 2013
        study. In the far field |sum of area * amplitude|^2 / wavelength^2 is their power a solid
        angle (Fraunhofer) in the middle of the cone; a pixel shows the square of its mean field.
        "diffraction": all rays add coherently in every direction, so that each facet has its lobe;
        it is of the direction itself, whatever is accepted around it, and takes rays less than half
        a wavelength apart. "power": powers add, the mean over what is accepted; the same at all
        wavelengths.
    aperture, rays, centre, source
        See `Illumination`.
    polarisation : None, "s", "p", "unpolarised", or (2,) or (a, b, 2) complex
        None: light of one number a ray, with the amplitudes of light whose field lies along each
        boundary. Else s lies across the plane of light and normal (at angle 0: across that of `phi`),
        p = direction x s in it; numbers are amplitudes of s and p, for all or for each incidence.
        "unpolarised": the mean of s and p, two traces. What is observed is power of any polarisation.
    reciprocal : bool
        Sum only pairs with the second direction at or behind the first, and fill in the others by
        reciprocity; incidence and detector need the same angles, and light no polarisation, for s may
        become p and not go back as s. See `reciprocity`.
    progress : callable, optional
        Called with (incidences done, incidences in all).
    warned : set of str, optional
        Names of warnings that were given before, and are not given again; see `trace`.
    options
        max_bounces : int, surfaces that a path may meet, default 100;
        min_amplitude : float, branches below this part of the launched amplitude are cut off, default 1e-6;
        max_reflections : int, paths with more are left out of the sums, default none;
        half_wave_loss : bool, count the -1 of each reflection, default True;
        tolerance : float, of the sums, see `nufft.spectrum`, default 1e-12;
        threads : int, of the trace.

    Returns
    -------
    xarray.DataArray, float64, 1/sr
        Axes theta_i, phi_i, theta_o, phi_o, wavelength. With it, at each incidence, the parts of the
        power that were reflected (upwards), transmitted (downwards), missed, absorbed, truncated: they
        add up to 1. `collected` (incidence, wavelength) is what the table itself holds, the BRDF
        summed over its projected solid angles: with "power" and `Cells` it is `reflected`; with
        `Cones` or `Pixels` it is what falls into them. `ray_count` says how many there were. What rays
        are worth on the smallest part, at the longest wavelength, is among the attributes: size
        parameter, phase across, error, and in words `validity`.

    Raises
    ------
    ValueError
        For angles, wavelengths or lengths out of range, an unknown method, "diffraction" onto pixels,
        a polarisation that is none or beside a source, `reciprocal` without the same angles on both
        sides or with polarised light.

    Warns
    -----
    FringetraceWarning
        As `trace`, once of all incidences; with "diffraction", if rays are too far apart.

    Notes
    -----
    F. E. Nicodemus et al., NBS Monograph 160 (1977): f = dL_o / (L_i cos theta_i dw_i).
    """
    theta, phi = _angles(incidence)
    waves = checked_wavelengths(wavelengths)
    _check_method(method, detector)
    lighting, summed = Illumination(scene, aperture, rays, centre, source), FarFieldOptions(method, **options)
    if method == "diffraction":
        _check_spacing(lighting, waves)
    pairs = [(t, p) for t in theta for p in phi]
    lights = jones_states(polarisation, (len(theta), len(phi)), "goniometer")
    if reciprocal:
        _check_same(theta, phi, detector)
        if polarisation is not None and len(lights[0]) == 1:
            raise ValueError(f"reciprocity: expected light without polarisation, got {polarisation!r}")
    order = np.arange(len(pairs)).reshape(len(theta), len(phi))
    fars = []
    for i, (t, p) in enumerate(pairs):
        chosen = order >= i if reciprocal else None
        each = [
            far_field(lighting, t, p, detector, waves, summed, jones=jones, chosen=chosen)
            for jones in lights[i]
        ]
        fars.append(mean(each))
        if progress is not None:
            progress(i + 1, len(pairs))
    warn_of_losses(fars, set() if warned is None else warned)
    values = np.stack([_density(far, detector, waves, method) for far in fars])
    if reciprocal:
        square = values.reshape(len(pairs), len(pairs), -1)
        later = np.tri(len(pairs), k=-1, dtype=bool)
        square[later] = square.transpose(1, 0, 2)[later]
    table = _table(values, fars, theta, phi, detector, waves, method)
    return table.assign_attrs(scene_validity(scene, float(waves.max())).attributes)


def _table(
    values: FloatArray, fars: list[Far], theta: FloatArray, phi: FloatArray, detector: Detector,
    waves: FloatArray, method: str,
) -> DataArray:  # fmt: skip
    """The BRDF with its coordinates, and the power beside it."""
    grid, into = (len(theta), len(phi)), ("theta_o", "phi_o")
    collected = np.einsum("iabw,ab->iw", values, detector.projected)
    coordinates = _coordinates(theta, phi, detector, waves) | {
        "solid_angle": (into, detector.solid_angle, {"units": "sr"}),
        "projected": (into, detector.projected, {"units": "sr", "long_name": "solid angle * cos(theta_o)"}),
        "ray_count": (AXES[:4], np.reshape([far.rays for far in fars], (*grid, *values.shape[1:3]))),
        "collected": (("theta_i", "phi_i", "wavelength"), collected.reshape(*grid, -1), {"units": "1"}),
    }
    for name in FATES:
        share = np.reshape([far.shares[name] for far in fars], grid)
        coordinates[name] = (AXES[:2], share, {"units": "1", "long_name": f"power {name} / incident"})
    attributes = {
        "units": "1/sr", "long_name": "BRDF", "method": method, "detector": type(detector).__name__,
        "power_unaccounted": max(abs(sum(far.shares.values()) - 1.0) for far in fars),
    }  # fmt: skip
    return array(values.reshape(*grid, *values.shape[1:]), AXES, coordinates, "brdf", attributes)


def _check_same(theta: FloatArray, phi: FloatArray, detector: Detector) -> None:
    if not (np.array_equal(theta, detector.theta) and np.array_equal(phi, detector.phi)):
        raise ValueError(
            f"reciprocity: expected the same angles on both sides, got {len(theta)} x {len(phi)} incidences "
            f"and {len(detector.theta)} x {len(detector.phi)} observations, or others"
        )


def reciprocity(table: DataArray) -> float:
    """Reciprocity error of a BRDF: deviation from f(i, o) = f(o, i), relative to its maximum.

    It holds for whole samples, lit to beyond their edges, and for parts of even ones; not for pixels
    at a finite distance, nor for what rays miss between them.

    Parameters
    ----------
    table : xarray.DataArray
        From `brdf`, with the same angles on both sides.

    Returns
    -------
    float
        Largest difference over the largest value; 0 if all are 0.

    Raises
    ------
    ValueError
        If the angles differ.
    """
    values = np.asarray(table.values)
    angles = [np.asarray(table[name]) for name in AXES[:4]]
    if not (np.array_equal(angles[0], angles[2]) and np.array_equal(angles[1], angles[3])):
        raise ValueError(f"reciprocity: expected the same angles on both sides, got shape {values.shape}")
    other = values.transpose(2, 3, 0, 1, 4)
    top = float(np.abs(values).max())
    return float(np.abs(values - other).max()) / top if top else 0.0


def brdf_sampling_error(table: DataArray, scene: Scene, detector: Detector, **options: Any) -> float:
    """Sampling error of a BRDF: relative change with half the rays either way, at its middle incidence.

    An estimate of what the table is off, where rays are many enough that twice as many change it less.

    Parameters
    ----------
    table : xarray.DataArray
        From `brdf`, its light from phi_i[0] at least.
    scene, detector, options
        As given to `brdf`, with one polarisation for all incidences.

    Returns
    -------
    float
        Root mean square of the difference, relative to that of the table there.
    """
    there = table.isel(theta_i=[len(table.theta_i) // 2], phi_i=[0])
    rows, columns = options.get("rays", RAYS)
    fewer = max(1, rows // 2), max(1, columns // 2)
    incidence = there.theta_i.values, there.phi_i.values
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FringetraceWarning)  # of rays too far apart: so they are meant to be
        again = brdf(scene, incidence, detector, table.wavelength.values, **options | {"rays": fewer})
    size = float(np.sqrt((there.values**2).mean()))
    return float(np.sqrt(((again.values - there.values) ** 2).mean())) / size if size > 0.0 else 0.0


def rounding_error(scene: Scene, theta: float, wavelength: float, **options: Any) -> float:
    """Rounding error of the optical paths of light that leaves a sample, in waves; see `hit_error`.

    Parameters
    ----------
    scene : Scene
    theta : float, radians
        Where light comes from.
    wavelength : float, metres
    options
        aperture, centre, source, max_bounces, min_amplitude, as for `brdf`.

    Returns
    -------
    float, waves, rms over the power
    """
    known = {name: options[name] for name in ("aperture", "centre", "source") if name in options}
    limits: dict[str, Any] = {"max_bounces": 100, "min_amplitude": 1e-6}
    limits |= {name: options[name] for name in limits if name in options}
    lighting = Illumination(scene, rays=(1, PROBES), **known)
    at = None if needs(scene) is None else wavelength
    paths = trace(scene, lighting.light(theta, 0.0), wavelength=at, record=True, warn=False, **limits)
    return hit_error(paths.where((paths.fate == Fate.LEFT) & (paths.bounces > 0)), wavelength)
