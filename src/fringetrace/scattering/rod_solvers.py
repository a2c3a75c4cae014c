"""Rod lattices as the rigorous solvers take them."""

from __future__ import annotations

import numpy as np

from fringetrace.rigorous import CONDUCTOR, Cylinders, Index, Validity, cylinder_gratings, validity
from fringetrace.scattering.rod_lattice import ARRANGEMENTS, RodLattice


def lattice_cylinders(lattice: RodLattice) -> Cylinders:
    """Rods and channels of a lattice as cylinders in a host without end; x and z there are x and y.

    Parameters
    ----------
    lattice : RodLattice

    Returns
    -------
    Cylinders

    Raises
    ------
    ValueError
        For mirrors that absorb, and rods that overlap.
    """
    count = len(lattice.centres), len(lattice.channels)
    radii = np.repeat([lattice.radius, lattice.channel or 0.0], count)
    index = [_rod_index(lattice)] * count[0] + [1.0] * count[1]
    return Cylinders(np.concatenate([lattice.centres, lattice.channels]), radii, index, _host_index(lattice))


def lattice_gratings(lattice: RodLattice) -> cylinder_gratings.CylinderGratings:
    """Rows of a lattice without end, on the host.

    Parameters
    ----------
    lattice : RodLattice
        Its columns do not matter.

    Returns
    -------
    CylinderGratings

    Raises
    ------
    ValueError
        With disorder; for mirrors that absorb.
    """
    if lattice.disorder:
        raise ValueError(f"endless rows: expected no disorder, got {lattice.disorder}")
    shift = ARRANGEMENTS[lattice.arrangement][1]
    depth = lattice.cortex + lattice.radius + lattice.gap * np.arange(lattice.rows)[::-1]
    rows = [
        cylinder_gratings.Row(float(d), lattice.radius, _rod_index(lattice), shift * (j % 2) * lattice.pitch)
        for j, d in enumerate(depth)
    ]
    if lattice.channel is not None:
        rows += [
            cylinder_gratings.Row(float(d), lattice.channel, 1.0, 0.5 * (1.0 + shift) * lattice.pitch)
            for d in 0.5 * (depth[1:] + depth[:-1])
        ]
    thickness = float(depth[0]) + 2.0 * lattice.radius
    return cylinder_gratings.CylinderGratings(lattice.pitch, thickness, rows, _host_index(lattice))


def lattice_validity(lattice: RodLattice, wavelength: float) -> Validity:
    """Validity of ray optics for one rod of a lattice, see `fringetrace.validity`.

    Parameters
    ----------
    lattice : RodLattice
    wavelength : float, metres

    Returns
    -------
    Validity
    """
    index = CONDUCTOR if lattice.rod is None else lattice.rod.index
    return validity(lattice.radius, wavelength, index, _host_index(lattice))


def _host_index(lattice: RodLattice) -> Index:
    return 1.0 if lattice.host is None else lattice.host.index


def _rod_index(lattice: RodLattice) -> Index:
    if lattice.rod is not None:
        return lattice.rod.index
    if lattice.reflectance != 1.0:
        raise ValueError(f"rigorous methods: expected mirrors of reflectance 1, got {lattice.reflectance}")
    return CONDUCTOR
