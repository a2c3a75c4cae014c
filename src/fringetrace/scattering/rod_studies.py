"""Parameter studies of rod lattices: BRDF by rays, by multiple scattering, and as a multilayer."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, array, checked_wavelengths, degree, grid, sweep, warn
from fringetrace.optics import Polarisation, PolarisationName
from fringetrace.rigorous import differential_width, reflectance_spectrum, scatter
from fringetrace.scattering.detectors import Cones, checked_angles
from fringetrace.scattering.far_fields import FATES
from fringetrace.scattering.goniometer import AXES, METHODS, brdf
from fringetrace.scattering.rod_lattice import MEDIA, RodLattice as RodLattice
from fringetrace.scattering.rod_solvers import lattice_cylinders, lattice_gratings, lattice_validity
from fringetrace.tracing import CUT, CUT_OFF

if TYPE_CHECKING:
    from xarray import DataArray

    from fringetrace.optics import Material


# Surfaces that light may meet, and the least amplitude of a branch.
BOUNCES, FAINT = 100, 1e-3
# Materials by name and by index at the wavelengths: names alone do not tell them apart.
Media = Mapping[tuple[str | None, bytes], "Material"]
# As the goniometer traces it: s light stays s across rods, and one number a ray has its amplitudes.
TRACED = {"s": None, "p": "p", "unpolarised": "unpolarised"}


def _cell(
    theta_i: npt.ArrayLike, theta_o: npt.ArrayLike, half_angle: float, wavelengths: npt.ArrayLike,
    method: str, polarisation: PolarisationName, rays: int, max_bounces: int, min_amplitude: float,
    indices: npt.NDArray[np.complex128], media: Media, **parameters: Any,
) -> dict[str, FloatArray]:  # fmt: skip
    """One lattice: its BRDF in the plane across the rods, and where the power went."""
    found = {name: media.get(_known(parameters[name], at)) for name, at in zip(MEDIA, indices, strict=True)}
    lattice = RodLattice(**parameters | found)
    if method == "rods":
        values = cluster(lattice, theta_i, theta_o, wavelengths, polarisation)
        unknown = np.full((len(values), 1), np.nan)
        return {"brdf": values[:, None, :, None], **dict.fromkeys(FATES, unknown)}
    table = brdf(
        lattice.scene, theta_i, Cones(np.asarray(theta_o), half_angle), wavelengths, method=method,
        polarisation=TRACED[polarisation], rays=(1, rays), max_bounces=max_bounces,
        min_amplitude=min_amplitude, threads=1, warned={CUT_OFF}, **lattice.lighting,
    )  # fmt: skip
    return {"brdf": table.values, **{name: table[name].values for name in FATES}}


def cluster(
    lattice: RodLattice,
    theta_i: npt.ArrayLike,
    theta_o: npt.ArrayLike,
    wavelengths: npt.ArrayLike,
    polarisation: PolarisationName = "s",
) -> FloatArray:
    """BRDF of a finite lattice in the plane across its rods, by rigorous multiple scattering.

    f = (length / wavelength) (d sigma / d theta) / (width cos theta_i cos theta_o): rods of a length of
    many waves send d sigma / d theta into a lobe that is wavelength / length wide along them, and its
    middle is what ray sums give in the same plane. A host's front face lets light in and out (Snell,
    Fresnel); what it throws back, of the incident light or from below, is left out.

    Parameters
    ----------
    lattice : RodLattice
        Rods may not overlap.
    theta_i, theta_o : (n,) radians
        Position angles, outside of the host.
    wavelengths : (w,) float64, metres
    polarisation : ``"s"``, ``"p"`` or ``"unpolarised"``
        The electric field along the rods, or across them; the mean of both.

    Returns
    -------
    (theta_i, theta_o, wavelength) float64, 1/sr

    Raises
    ------
    ValueError
        As `cylinders.Cylinders` and `cylinders.scatter`; for mirrors that absorb.
    """
    if polarisation == "unpolarised":
        e, h = (cluster(lattice, theta_i, theta_o, wavelengths, each) for each in get_args(Polarisation))
        return 0.5 * (e + h)
    start, end = checked_angles(theta_i, "cluster theta_i"), checked_angles(theta_o, "cluster theta_o")
    rods, (width, _) = lattice_cylinders(lattice), lattice.footprint
    values = []
    for wave in checked_wavelengths(wavelengths):
        host = 1.0 if lattice.host is None else float(lattice.host.index(wave).real)
        (inward, into), (outward, out) = (_through(host, angle, polarisation) for angle in (start, end))
        scattered = scatter(rods, float(wave), -np.pi / 2 - inward, polarisation)
        sent = differential_width(scattered, np.pi / 2 - outward)
        # a width is over the irradiance inside; an angle outside is wider than that inside
        wider = np.cos(end) / (host * np.cos(outward))
        entered = into * np.cos(start) / np.cos(inward)
        whole = lattice.length / wave * entered[:, None] * sent * out * wider
        values.append(whole / (width * np.cos(start)[:, None] * np.cos(end)))
    return np.stack(values, axis=-1)


def _through(host: float, angle: FloatArray, polarisation: Polarisation) -> tuple[FloatArray, FloatArray]:
    """Angles inside of a host, and the parts of the power that pass its face."""
    inside = np.arcsin(np.sin(angle) / host)
    here, there = np.cos(angle), host * np.cos(inside)
    if polarisation == "p":
        here, there = here * host, there / host
    return inside, 4.0 * here * there / (here + there) ** 2


def specular(
    lattice: RodLattice,
    theta_i: npt.ArrayLike,
    wavelengths: npt.ArrayLike,
    *,
    method: str = "rods",
    polarisation: PolarisationName = "unpolarised",
) -> DataArray:
    """Specular reflectance of a lattice with infinite rows, rigorously or as a multilayer.

    Parameters
    ----------
    lattice : RodLattice
        Without disorder; its columns do not matter.
    theta_i : (n,) radians
        From where, outside of the host.
    wavelengths : (w,) float64, metres
    method, polarisation
        See `cylinder_gratings.reflectance_spectrum`.

    Returns
    -------
    xarray.DataArray, float64, 1
        Axes theta_i, wavelength: reflected over incident power, all diffraction orders together; with
        the transmitted part, and what rays would be worth.

    Raises
    ------
    ValueError
        As `lattice_gratings` and `cylinder_gratings.reflectance_spectrum`.
    """
    start, waves = checked_angles(theta_i, "specular theta_i"), checked_wavelengths(wavelengths)
    found = reflectance_spectrum(lattice_gratings(lattice), waves, start[:, None], polarisation, method)
    axes = ("theta_i", "wavelength")
    coordinates = {
        "theta_i": ("theta_i", start, {"units": "rad"}),
        "wavelength": ("wavelength", waves, {"units": "m"}),
        "transmitted": (axes, found.transmittance, {"units": "1"}),
    }
    attributes: dict[str, Any] = {
        "units": "1",
        "long_name": "reflectance",
        "method": method,
        "polarisation": polarisation,
    }
    attributes |= validity_attributes([lattice], waves)
    return array(found.reflectance, axes, coordinates, "reflectance", attributes)


def validity_attributes(kinds: Sequence[RodLattice], waves: FloatArray) -> dict[str, float | str]:
    """Validity attributes for the smallest of some rods at the longest of some wavelengths."""
    return min(
        (lattice_validity(kind, waves.max()) for kind in kinds), key=lambda v: v.size_parameter
    ).attributes


def _spoken(lattice: RodLattice) -> dict[str, Any]:
    """Parameters of a lattice, materials by name."""
    return vars(lattice) | {
        name: medium.name for name in MEDIA if (medium := getattr(lattice, name)) is not None
    }


def _known(name: str | None, indices: npt.NDArray[np.complex128]) -> tuple[str | None, bytes]:
    """A material in `Media`."""
    return name, np.asarray(indices, np.complex128).tobytes()


def _indices(lattice: RodLattice, waves: FloatArray) -> npt.NDArray[np.complex128]:
    """Of rod and host at each wavelength, 0 for none."""
    media = [getattr(lattice, name) for name in MEDIA]
    return np.array([np.zeros(len(waves)) if medium is None else medium.index(waves) for medium in media])


def study(
    lattice: RodLattice,
    axes: Mapping[str, Sequence[Any]],
    theta_i: npt.ArrayLike,
    theta_o: npt.ArrayLike,
    wavelengths: npt.ArrayLike,
    *,
    half_angle: float = 1.0 * degree,
    method: str = "rays",
    polarisation: PolarisationName = "s",
    rays: int = 2000,
    max_bounces: int = BOUNCES,
    min_amplitude: float = FAINT,
    folder: str | os.PathLike[str] | None = None,
    **sweeping: Any,
) -> DataArray:
    """BRDF of lattices over combinations of parameters, in the plane across their rods.

    Parameters
    ----------
    lattice : RodLattice
        What stays the same.
    axes : dict of sequences
        Values of each parameter that changes, by the names of `RodLattice`; every combination is traced.
    theta_i, theta_o : (n,) radians
        From where and to where, see `goniometer.brdf`.
    wavelengths : (w,) float64, metres
    half_angle : float, radians
        Acceptance, see `goniometer.Cones`.
    method, max_bounces
        See `goniometer.brdf`; or "rods": the rigorous answer in the same unit, see `cluster`. It has no
        use for half angle, rays and bounces, and does not say where the power went (NaN). For endless
        rows, and as a multilayer, see `specular`.
    polarisation : ``"s"``, ``"p"`` or ``"unpolarised"``
        The electric field along the rods, or across them; the mean of both takes twice the time.
    rays : int
        Across the lattice.
    min_amplitude : float
        Branches below this part of the launched amplitude are cut off, see `trace`: matter splits rays
        at each boundary.
    folder, sweeping
        See `sweeps.sweep`: kept results, executor, scheduler, processes, progress.

    Returns
    -------
    xarray.DataArray, float64, 1/sr
        Axes: the parameters, then those of `goniometer.brdf`; with the parts of the power by what
        became of it.

    Raises
    ------
    ValueError
        For a parameter that a lattice does not have, and as `RodLattice` and `goniometer.brdf`.

    Warns
    -----
    FringetraceWarning
        If over a millionth of the power is cut off, once of all lattices.
    """
    known = [field.name for field in fields(RodLattice)]
    for name in axes:
        if name not in known:
            raise ValueError(f"lattice study: expected parameters among {', '.join(known)}, got {name!r}")
    if method not in (*METHODS, "rods"):
        raise ValueError(f"lattice study method: expected {', '.join(METHODS)} or rods, got {method!r}")
    if polarisation not in TRACED:
        raise ValueError(f"lattice study polarisation: expected {', '.join(TRACED)}, got {polarisation!r}")
    incidence, waves = checked_angles(theta_i, "lattice study theta_i"), checked_wavelengths(wavelengths)
    observation = checked_angles(theta_o, "lattice study theta_o")
    fixed = {
        "theta_i": incidence, "theta_o": observation, "half_angle": half_angle, "wavelengths": waves,
        "method": method, "polarisation": polarisation, "rays": rays, "max_bounces": max_bounces,
        "min_amplitude": min_amplitude,
    }  # fmt: skip
    kinds = [replace(lattice, **values) for values in grid(**axes)]
    indices = [_indices(kind, waves) for kind in kinds]
    media = {
        _known(medium.name, at): medium
        for kind, each in zip(kinds, indices, strict=True)
        for medium, at in zip((kind.rod, kind.host), each, strict=True)
        if medium is not None
    }
    cells = [_spoken(kind) | fixed | {"indices": each} for kind, each in zip(kinds, indices, strict=True)]
    done = sweep(partial(_cell, media=media), cells, folder, **sweeping)
    _warn_of_losses(done, [{name: _spoken(kind)[name] for name in axes} for kind in kinds], fixed)
    attributes = {"method": method, "polarisation": polarisation, "half_angle_rad": half_angle}
    attributes |= validity_attributes(kinds, waves) | {
        f"lattice_{name}": int(value) if isinstance(value, bool) else value
        for name, value in _spoken(lattice).items()
        if name not in axes and value is not None
    }
    return _table(done, axes, (incidence, observation, waves), attributes)


def _warn_of_losses(
    done: Sequence[Mapping[str, FloatArray]], kinds: Sequence[Mapping[str, Any]], fixed: Mapping[str, Any]
) -> None:
    """Warn of power that was cut off: of how many lattices, and of the one that lost most."""
    shares = np.array([np.nan_to_num(one["truncated"]).max() for one in done])
    if (lossy := shares > CUT).any():
        warn(
            f"{CUT_OFF}: up to {shares.max():.2g} of the incident power in {lossy.sum()} of {len(shares)} "
            f"lattices, most at {kinds[int(shares.argmax())]}; allow more bounces than "
            f"{fixed['max_bounces']}, or a smaller least amplitude than {fixed['min_amplitude']:g}"
        )


def _table(
    done: Sequence[Mapping[str, FloatArray]], axes: Mapping[str, Sequence[Any]],
    along: tuple[FloatArray, FloatArray, FloatArray], attributes: Mapping[str, Any],
) -> DataArray:  # fmt: skip
    """The cells of a study, `along` theta_i, theta_o and wavelength, with the power beside the BRDF."""
    incidence, observation, waves = along
    shape = tuple(len(values) for values in axes.values())
    coordinates: dict[str, Any] = {
        name: (name, [getattr(v, "name", str(v)) for v in values] if name in MEDIA else list(values))
        for name, values in axes.items()
    } | {
        "theta_i": ("theta_i", incidence, {"units": "rad"}),
        "phi_i": ("phi_i", np.zeros(1), {"units": "rad"}),
        "theta_o": ("theta_o", observation, {"units": "rad"}),
        "phi_o": ("phi_o", np.zeros(1), {"units": "rad"}),
        "wavelength": ("wavelength", waves, {"units": "m"}),
    }
    for name in FATES:
        share = np.stack([one[name] for one in done])
        coordinates[name] = ((*axes, *AXES[:2]), share.reshape(*shape, *share.shape[1:]), {"units": "1"})
    values = np.stack([one["brdf"] for one in done])
    unit = {"units": "1/sr", "long_name": "BRDF", **attributes}
    return array(values.reshape(*shape, *values.shape[1:]), (*axes, *AXES), coordinates, "brdf", unit)
