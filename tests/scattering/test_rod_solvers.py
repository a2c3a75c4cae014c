"""Rod lattices as cylinders and as gratings: the same rods, in the same places."""

import numpy as np
import pytest

from fringetrace import nm
from fringetrace.rigorous import CONDUCTOR
from fringetrace.scattering import RodLattice, lattice_cylinders, lattice_gratings, lattice_validity

HOSTED = RodLattice(4, 3, rod="melanin", host="keratin", cortex=100 * nm, channel=20 * nm)


def test_cylinders_stand_where_the_rods_do():
    found = lattice_cylinders(HOSTED)
    np.testing.assert_array_equal(found.centres[:12], HOSTED.centres)
    np.testing.assert_array_equal(found.centres[12:], HOSTED.channels)
    np.testing.assert_array_equal(found.radii, [65 * nm] * 12 + [20 * nm] * 6)
    assert found.host == HOSTED.host.index
    assert found.index == [HOSTED.rod.index] * 12 + [1.0] * 6


def test_gratings_have_a_row_for_each_row_and_between_them_channels():
    """Depths from the front face, and offsets modulo the pitch, are those of the rods."""
    found = lattice_gratings(HOSTED)
    depth = HOSTED.front - np.concatenate([HOSTED.centres, HOSTED.channels])[:, 1]
    rows = np.array([row.depth for row in found.rows])
    np.testing.assert_allclose(rows, np.unique(np.round(depth, 15)), atol=1e-15)
    assert [row.radius for row in found.rows] == [65 * nm, 20 * nm, 65 * nm, 20 * nm, 65 * nm]
    assert found.pitch == HOSTED.pitch


def test_mirrors_are_conductors():
    assert set(lattice_cylinders(RodLattice(2, 2)).index) == {CONDUCTOR}
    assert lattice_validity(RodLattice(2, 2), 500 * nm).size_parameter == pytest.approx(2 * np.pi * 65 / 500)


@pytest.mark.parametrize("solver", [lattice_cylinders, lattice_gratings])
def test_mirrors_that_absorb_are_refused(solver):
    with pytest.raises(ValueError, match=r"rigorous methods: expected mirrors of reflectance 1, got 0\.9"):
        solver(RodLattice(2, 2, reflectance=0.9))


def test_rows_without_end_have_no_disorder():
    with pytest.raises(ValueError, match=r"endless rows: expected no disorder, got 0\.1"):
        lattice_gratings(RodLattice(2, 2, rod=1.5, disorder=0.1))
