"""Lattices of rods, ordered and disordered, and how their BRDF changes with their parameters."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fringetrace.detectors import Cones, checked_angles
from fringetrace.farfield import FATES
from fringetrace.goniometer import AXES, brdf
from fringetrace.interfaces import Mirror
from fringetrace.mesh import Mesh
from fringetrace.nufft import checked_wavelengths
from fringetrace.scene import Scene, Surface
from fringetrace.shapes import rod_lattice
from fringetrace.sweeps import grid, sweep
from fringetrace.tables import array
from fringetrace.waves import FloatArray, checked_length, degree

if TYPE_CHECKING:
    from fringetrace.tables import DataArray

# Distance of the rows in pitches, and how far every second one is shifted.
ARRANGEMENTS = {"square": (1.0, 0.0), "staggered": (1.0, 0.5), "hexagonal": (0.5 * np.sqrt(3.0), 0.5)}


@dataclass(frozen=True)
class Lattice:
    """Rods along y in rows across z, the topmost row highest.

    Parameters
    ----------
    columns, rows : int
    radius, pitch, length : float, metres
        Of the rods; the distance of neighbours in a row; along y.
    arrangement : {"square", "staggered", "hexagonal"}
        Rows a pitch apart; every second one shifted by half a pitch; and sqrt(3)/2 of a pitch apart.
    spacing : float, metres, optional
        Distance of the rows. Default: by the arrangement.
    disorder : float
        Root mean square of the displacement of rods along x and along z, in pitches; normally
        distributed. Rods may come to overlap.
    seed : int
        Of the displacements.
    sides : int
        Of each rod.
    reflectance : float

    Raises
    ------
    ValueError
        For counts, lengths, arrangements or disorder that cannot be.
    """

    columns: int = 20
    rows: int = 4
    radius: float = 65e-9
    pitch: float = 280e-9
    length: float = 2e-6
    arrangement: str = "staggered"
    spacing: float | None = None
    disorder: float = 0.0
    seed: int = 0
    sides: int = 18
    reflectance: float = 1.0

    def __post_init__(self) -> None:
        if self.arrangement not in ARRANGEMENTS:
            names = ", ".join(ARRANGEMENTS)
            raise ValueError(f"lattice arrangement: expected one of {names}, got {self.arrangement!r}")
        for count, what in ((self.columns, "columns"), (self.rows, "rows")):
            if not (isinstance(count, (int, np.integer)) and count > 0):
                raise ValueError(f"lattice {what}: expected a whole number from 1, got {count!r}")
        for length, what in ((self.pitch, "pitch"), (self.spacing, "spacing")):
            if length is not None:
                checked_length(length, f"lattice {what}")
        if not (np.isfinite(self.disorder) and self.disorder >= 0.0):
            raise ValueError(f"lattice disorder: expected a number of at least 0, got {self.disorder!r}")

    @property
    def centres(self) -> FloatArray:
        """(columns * rows, 2) float64, metres: x and z of the axes, column by column, about the origin."""
        apart, shift = ARRANGEMENTS[self.arrangement]
        spacing = apart * self.pitch if self.spacing is None else self.spacing
        column, row = (
            i.ravel() for i in np.meshgrid(*map(np.arange, (self.columns, self.rows)), indexing="ij")
        )
        x = (column + shift * (row % 2)) * self.pitch
        places = np.stack([x, row * spacing], axis=1)
        places -= 0.5 * (places.min(axis=0) + places.max(axis=0))
        wander = np.random.default_rng(self.seed).standard_normal(places.shape)
        return np.asarray(places + self.disorder * self.pitch * wander)

    @property
    def mesh(self) -> Mesh:
        """The rods, as `shapes.rod_lattice` has them; `shapes.rod_of_triangle` tells which is which."""
        rod = rod_lattice(1, 1, self.radius, self.pitch, self.length, sides=self.sides)
        offset = np.insert(self.centres, 1, 0.0, axis=1)
        vertices = offset[:, None] + rod.vertices
        faces = rod.faces + len(rod.vertices) * np.arange(len(offset))[:, None, None]
        return Mesh(vertices.reshape(-1, 3), faces.reshape(-1, 3), f"{self.arrangement} lattice")

    @property
    def scene(self) -> Scene:
        """The rods as mirrors."""
        return Scene((Surface(self.mesh, Mirror(self.reflectance), "rods"),))


def _cell(
    theta_i: npt.ArrayLike, theta_o: npt.ArrayLike, half_angle: float, wavelengths: npt.ArrayLike,
    method: str, rays: int, max_bounces: int, **parameters: Any,
) -> dict[str, FloatArray]:  # fmt: skip
    """One lattice: its BRDF in the plane across the rods, and where the power went."""
    table = brdf(
        Lattice(**parameters).scene, theta_i, Cones(np.asarray(theta_o), half_angle), wavelengths,
        method=method, rays=(1, rays), max_bounces=max_bounces, threads=1,
    )  # fmt: skip
    return {"brdf": table.values, **{name: table[name].values for name in FATES}}


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
        "method": method, "rays": rays, "max_bounces": max_bounces,
    }  # fmt: skip
    cells = [vars(replace(lattice, **values)) | fixed for values in grid(**axes)]
    done = sweep(_cell, cells, folder, **sweeping)
    shape = tuple(len(values) for values in axes.values())
    coordinates: dict[str, Any] = {name: (name, list(values)) for name, values in axes.items()} | {
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
        f"lattice_{name}": value
        for name, value in vars(lattice).items()
        if name not in axes and value is not None
    }
    return array(values.reshape(*shape, *values.shape[1:]), (*axes, *AXES), coordinates, "brdf", attributes)
