"""What lights a sample: the same rectangle at all angles, a plane wave."""

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import nm
from fringetrace.geometry.triangles import breadth
from fringetrace.scattering.detectors import towards
from fringetrace.scattering.illumination import Illumination, footprint, scene_validity
from fringetrace.scattering.rod_lattice import RodLattice
from fringetrace.scattering.rod_solvers import lattice_validity

CENTRE = np.array([1.0, 2.0, 3.0])


@pytest.mark.parametrize(("theta", "phi"), [(0.0, 0.0), (0.7, 0.0), (-1.2, 0.5)])
def test_rays_cross_the_plane_of_the_sample_in_one_grid(theta, phi):
    rays = footprint(theta, phi, (4.0, 2.0), (2, 4), CENTRE, 10.0)
    axis = towards(theta, phi)
    assert rays.direction == pytest.approx(np.tile(-axis, (8, 1)))
    assert (rays.origin - CENTRE) @ axis == pytest.approx(10.0)  # a wavefront
    reach = (rays.origin[:, 2] - CENTRE[2]) / axis[2]
    ground = rays.origin - reach[:, None] * axis - CENTRE
    assert ground[:, 2] == pytest.approx(0.0, abs=1e-12)
    assert ground[:, 0] == pytest.approx(np.tile([-1.5, -0.5, 0.5, 1.5], 2))
    assert ground[:, 1] == pytest.approx(np.repeat([-0.5, 0.5], 4))
    assert rays.area == pytest.approx(np.cos(theta))


def test_the_sample_s_box_is_lit():
    setup = Illumination(ft.Scene([ft.Surface(ft.shapes.plate(4.0, 2.0).moved((1, 2, 3)), ft.Mirror())]))
    assert setup.aperture == (4.0, 2.0)
    assert setup.centre == pytest.approx([1.0, 2.0, 3.0])
    light = setup.light(0.3, 0.0)
    assert len(light) == 256**2
    assert light.area * 256**2 == pytest.approx(8.0 * np.cos(0.3))
    assert setup.start(light) == pytest.approx((CENTRE - light.origin[5]) @ light.direction[5], rel=1e-12)


def test_light_of_one_s_own():
    beam = ft.Beam((0, 0, 5), (0, 0, -1), (0, 1, 0), (1, 1), (2, 2))
    scene = ft.Scene([ft.Surface(ft.shapes.plate(4.0, 2.0), ft.Mirror())])
    setup = Illumination(scene, centre=(0, 0, 1), source=lambda theta, phi: beam)
    assert setup.light(0.1, 0.2) is beam
    assert setup.start(beam) == pytest.approx(4.0)


def test_the_breadth_of_the_smallest_part():
    """Of rods their diameter, of a plate or a shallow relief a side."""
    assert breadth(RodLattice(3, 2).mesh) == pytest.approx(130 * nm, rel=1e-9)
    assert breadth(ft.shapes.plate(3e-6, 2e-6)) == pytest.approx(2e-6)
    relief = ft.shapes.height_map(np.array([[0.0, 1e-9], [2e-9, 0.0], [0.0, 0.0]]), 1e-6)
    assert breadth(relief) > 0.9e-6


def test_what_rays_are_worth_is_that_of_the_smallest_part():
    matter = RodLattice(2, 2, rod="melanin", host="keratin", channel=20 * nm)
    found = scene_validity(matter.scene, 500 * nm)
    assert found.size_parameter == pytest.approx(
        lattice_validity(matter, 500 * nm).size_parameter * 20 / 65, rel=1e-2
    )
    assert found.phase < 0.0  # of air
    mirrors = RodLattice(2, 2)
    found, true = scene_validity(mirrors.scene, 500 * nm), lattice_validity(mirrors, 500 * nm)
    assert found.size_parameter == pytest.approx(true.size_parameter, rel=1e-9)
    assert found.label == true.label
