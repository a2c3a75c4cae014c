"""Lattices of rods, ordered and disordered, and how their BRDF changes with their parameters."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fringetrace.detectors import Cones, checked_angles
from fringetrace.farfield import FATES
from fringetrace.goniometer import AXES, brdf
from fringetrace.nufft import checked_wavelengths
from fringetrace.rods import MEDIA
from fringetrace.rods import Lattice as Lattice
from fringetrace.sweeps import grid, sweep
from fringetrace.tables import array
from fringetrace.waves import FloatArray, degree

if TYPE_CHECKING:
    from fringetrace.indices import Material
    from fringetrace.tables import DataArray


def _cell(
    theta_i: npt.ArrayLike, theta_o: npt.ArrayLike, half_angle: float, wavelengths: npt.ArrayLike,
    method: str, rays: int, max_bounces: int, min_amplitude: float, indices: FloatArray,
    media: Mapping[str, Material], **parameters: Any,
) -> dict[str, FloatArray]:  # fmt: skip
    """One lattice: its BRDF in the plane across the rods, and where the power went."""
    lattice = Lattice(**parameters | {name: media.get(parameters[name]) for name in MEDIA})
    table = brdf(
        lattice.scene, theta_i, Cones(np.asarray(theta_o), half_angle), wavelengths, method=method,
        rays=(1, rays), max_bounces=max_bounces, min_amplitude=min_amplitude, threads=1, **lattice.lighting,
    )  # fmt: skip
    return {"brdf": table.values, **{name: table[name].values for name in FATES}}


def _spoken(lattice: Lattice) -> dict[str, Any]:
    """Parameters of a lattice, materials by name."""
    return vars(lattice) | {
        name: medium.name for name in MEDIA if (medium := getattr(lattice, name)) is not None
    }


def _indices(lattice: Lattice, waves: FloatArray) -> npt.NDArray[np.complex128]:
    """Of rod and host at each wavelength, 0 for none: names alone do not tell materials apart."""
    media = [getattr(lattice, name) for name in MEDIA]
    return np.array([np.zeros(len(waves)) if medium is None else medium.index(waves) for medium in media])


def study(
    lattice: Lattice,
    axes: Mapping[str, Sequence[Any]],
    theta_i: npt.ArrayLike,
    theta_o: npt.ArrayLike,
    wavelengths: npt.ArrayLike,
    *,
    half_angle: float = 1.0 * degree,
    method: str = "rays",
    rays: int = 2000,
    max_bounces: int = 100,
    min_amplitude: float = 1e-3,
    folder: str | os.PathLike[str] | None = None,
    **sweeping: Any,
) -> DataArray:
    """BRDF of many lattices in the plane across their rods.

    Parameters
    ----------
    lattice : Lattice
        What stays the same.
    axes : dict of sequences
        Values of each parameter that changes, by the names of `Lattice`; every combination is traced.
    theta_i, theta_o : (n,) radians
        From where and to where, see `goniometer.brdf`.
    wavelengths : (w,) float64, metres
    half_angle : float, radians
        Acceptance, see `goniometer.Cones`.
    method, max_bounces
        See `goniometer.brdf`.
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
        For a parameter that a lattice does not have, and as `Lattice` and `goniometer.brdf`.
    """
    known = [field.name for field in fields(Lattice)]
    for name in axes:
        if name not in known:
            raise ValueError(f"lattice study: expected parameters among {', '.join(known)}, got {name!r}")
    incidence, waves = checked_angles(theta_i, "lattice study theta_i"), checked_wavelengths(wavelengths)
    observation = checked_angles(theta_o, "lattice study theta_o")
    fixed = {
        "theta_i": incidence, "theta_o": observation, "half_angle": half_angle, "wavelengths": waves,
        "method": method, "rays": rays, "max_bounces": max_bounces, "min_amplitude": min_amplitude,
    }  # fmt: skip
    kinds = [replace(lattice, **values) for values in grid(**axes)]
    media = {m.name: m for kind in kinds for m in (kind.rod, kind.host) if m is not None}
    cells = [_spoken(kind) | fixed | {"indices": _indices(kind, waves)} for kind in kinds]
    done = sweep(partial(_cell, media=media), cells, folder, **sweeping)
    shape = tuple(len(values) for values in axes.values())
    coordinates: dict[str, Any] = {
        name: (name, [str(v) for v in values] if name in MEDIA else list(values))
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
    attributes = {"units": "sr-1", "long_name": "BRDF", "method": method, "half_angle_rad": half_angle} | {
        f"lattice_{name}": int(value) if isinstance(value, bool) else value
        for name, value in _spoken(lattice).items()
        if name not in axes and value is not None
    }
    return array(values.reshape(*shape, *values.shape[1:]), (*axes, *AXES), coordinates, "brdf", attributes)
