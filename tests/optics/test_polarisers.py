"""Polariser, retarder, Jones plate: their signs, axes, and doors."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from meetings import EPS, meeting, power, shower

from fringetrace.optics.birefringent import ShearPlate
from fringetrace.optics.polarisers import Birefringence, JonesPlate, Polariser, Retarder, wave_plate

# A handful of products of numbers up to 1.
ROUNDING = 16 * EPS

X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
angles = st.floats(-math.pi, math.pi)


def at(angle):
    """Direction in the xy plane."""
    return np.array([math.cos(angle), math.sin(angle), 0.0])


def through(element, field, direction=(0.0, 0.0, 1.0), wavelength=None):
    (branch,) = element.act(meeting(direction, field=field, wavelength=wavelength))
    return branch.field[0]


@settings(deadline=None, max_examples=30)
@given(angle=angles, extinction=st.floats(0.0, 1.0))
def test_malus(angle, extinction):
    passed = power(through(Polariser(at(angle), extinction), X)[None])[0]
    law = math.cos(angle) ** 2 + extinction * math.sin(angle) ** 2
    assert passed == pytest.approx(law, abs=ROUNDING)


def test_a_polariser_shows_slanted_rays_its_axis_across_them():
    slanted = (0.6, 0.0, 0.8)
    assert through(Polariser(X), (0.8, 0.0, -0.6), slanted) == pytest.approx([0.8, 0.0, -0.6], abs=ROUNDING)
    assert through(Polariser(X), Y, slanted) == pytest.approx([0.0, 0.0, 0.0], abs=ROUNDING)
    assert through(Polariser(slanted, 0.25), Y, slanted) == pytest.approx([0.0, 0.5, 0.0], abs=ROUNDING)


@settings(deadline=None, max_examples=30)
@given(angle=angles)
def test_a_half_wave_plate_turns_by_twice_its_angle(angle):
    field = through(wave_plate(at(angle), 0.5), X)
    # along its axis the sign changes, across it does not: minus the direction at twice the angle
    assert np.abs(field + at(2.0 * angle)).max() < ROUNDING


def test_a_half_wave_plate_at_an_eighth_of_a_right_angle_is_the_hadamard_matrix():
    plate = wave_plate(at(math.pi / 8), 0.5)
    columns = np.array([through(plate, X)[:2], through(plate, Y)[:2]]).T
    # up to the common sign: the axis is the slow one
    assert np.abs(columns + np.array([[1.0, 1.0], [1.0, -1.0]]) / math.sqrt(2.0)).max() < ROUNDING


def test_a_quarter_wave_plate_makes_light_of_positive_helicity():
    # slow axis half way from x to y: (1, i) with exp(-i w t), left circular in Born and Wolf's words
    field = through(wave_plate((1, 1, 0), 0.25), X)
    assert field[1] / field[0] == pytest.approx(1j, rel=ROUNDING)
    assert power(field[None])[0] == pytest.approx(1.0, rel=ROUNDING)


def test_a_retarder_delays_as_a_crystal_does():
    # quartz cut along its optic axis: the same phases as from the paths of the two beams in the plate
    wavelength, thickness = 589.3e-9, 137e-6
    rays = meeting((0, 0, 1), field=(1.0, 1.0, 0.0), wavelength=wavelength)
    ordinary, extraordinary = ShearPlate(X, thickness, 1.54424, 1.55335).act(rays)
    turns = (extraordinary.path - ordinary.path)[0] / wavelength
    (branch,) = Retarder(X, Birefringence(1.54424, 1.55335, thickness)).act(rays)
    phase = branch.field[0, 0] / branch.field[0, 1]
    assert phase == pytest.approx(np.exp(2j * math.pi * turns), rel=2.0 * math.pi * 400 * EPS)
    assert turns > 0.0  # positive crystal: the optic axis is the slow one


def test_retardance_goes_as_the_design_wavelength_over_the_wavelength():
    plate = wave_plate(X, 0.5, design=550e-9)
    assert plate.chromatic
    assert plate.at(550e-9) == pytest.approx(math.pi, rel=EPS)
    assert plate.at(440e-9) == pytest.approx(1.25 * math.pi, rel=2 * EPS)
    assert not wave_plate(X, 0.5).chromatic
    assert wave_plate(X, 0.5).at(None) == math.pi


def test_indices_of_a_retarder_may_depend_on_the_wavelength():
    plate = Retarder(X, Birefringence(lambda w: 1.5 + 1e-15 / w**2, lambda w: 1.51 + 1e-15 / w**2, 1e-5))
    assert plate.at(500e-9) == pytest.approx(2.0 * math.pi * 0.01 * 1e-5 / 500e-9, rel=1000 * EPS)


@settings(deadline=None, max_examples=30)
@given(angle=angles, retardance=st.floats(-10.0, 10.0), seed=st.integers(0, 2**32 - 1))
def test_a_retarder_as_a_jones_matrix(angle, retardance, seed):
    rays = shower(seed)
    (one,) = Retarder(at(angle), retardance).act(rays)
    (other,) = JonesPlate(np.diag([np.exp(1j * retardance), 1.0]), at(angle)).act(rays)
    assert np.abs(one.field - other.field).max() < 16 * ROUNDING


def test_a_jones_matrix_has_its_axes_right_handed_with_the_ray():
    swap = JonesPlate([[0.0, 0.0], [1.0, 0.0]], X)
    assert through(swap, X) == pytest.approx(Y, abs=ROUNDING)
    # from behind the transpose on the same two axes
    assert through(swap, X, (0, 0, -1)) == pytest.approx([0, 0, 0], abs=ROUNDING)
    assert through(swap, Y, (0, 0, -1)) == pytest.approx(X, abs=ROUNDING)


def test_optical_activity_is_undone_on_the_way_back():
    c, s = math.cos(0.3), math.sin(0.3)
    rotator = JonesPlate([[c, -s], [s, c]], X)
    there = through(rotator, X)
    assert there == pytest.approx([c, s, 0.0], abs=ROUNDING)
    assert through(rotator, there, (0, 0, -1)) == pytest.approx(X, abs=ROUNDING)


@pytest.mark.parametrize("bad", [-0.1, 1.1])
def test_extinctions_are_fractions(bad):
    with pytest.raises(ValueError, match="Polariser extinction: expected a number from 0 to 1, got"):
        Polariser(X, bad)


def test_doors_of_the_retarder():
    with pytest.raises(ValueError, match="Retarder retardance: expected a finite number, got nan"):
        Retarder(X, math.nan)
    with pytest.raises(
        ValueError, match="Retarder design: expected None beside a function of the wavelength"
    ):
        Retarder(X, lambda w: 1.0, 500e-9)
    with pytest.raises(ValueError, match=r"Retarder design: expected a positive length in metres, got 0\.0"):
        Retarder(X, 1.0, 0.0)
    with pytest.raises(ValueError, match="wave_plate waves: expected a finite number, got '1/2'"):
        wave_plate(X, "1/2")
    with pytest.raises(ValueError, match="Birefringence extraordinary index: expected a positive index or a"):
        Birefringence(1.5, 0.0, 1e-3)
    with pytest.raises(ValueError, match="Birefringence thickness: expected a positive length in metres"):
        Birefringence(1.5, 1.6, -1e-3)


@pytest.mark.parametrize("bad", ["one", np.eye(3), [[np.nan, 0.0], [0.0, 1.0]], [[1.0], [1.0, 2.0]]])
def test_jones_matrices_are_2_x_2(bad):
    with pytest.raises(ValueError, match="JonesPlate matrix: expected 2 x 2"):
        JonesPlate(bad, X)


def test_jones_matrices_gain_no_power():
    with pytest.raises(
        ValueError, match=r"JonesPlate matrix: expected a passive one, gain up to 1, got 1\.21"
    ):
        JonesPlate([[1.1, 0.0], [0.0, 0.1]], X)
