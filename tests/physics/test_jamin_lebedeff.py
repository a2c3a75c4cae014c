"""The Jamin-Lebedeff interferometer as a chain of elements, Senarmont's compensator, and half-wave plates."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from meetings import EPS, meeting, power

from fringetrace.optics.birefringent import ShearPlate
from fringetrace.optics.polarisers import Polariser, wave_plate

# Printed with so many digits after the point.
NINE = 0.5e-9
MILLI = 0.5e-3

LAMBDA = 589.3e-9
X, Z, DIAGONAL = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 0.0)
# Paths through two calcite plates of 5 mm are known to some roundings, in waves of 589 nm.
PATHS = 16 * EPS * 2 * 5e-3 * 1.66 / LAMBDA * 2 * np.pi


def chain(delta, number=0):
    """Field behind the second plate: sum over the paths that meet again, one of them delayed by delta."""
    plate, half = ShearPlate((1, 0, 1), 5e-3, 1.6584, 1.4864), wave_plate(DIAGONAL, 0.5)
    total, places = np.zeros(3, dtype=complex), []
    start = meeting(Z, field=np.array(DIAGONAL) / np.sqrt(2.0))
    for sample, first in enumerate(plate.act(start)):
        (turned,) = half.act(meeting(Z, first.point, first.field))
        delayed = turned.field * np.exp(1j * delta * (sample == number))
        for last in plate.act(meeting(Z, first.point, delayed)):
            if power(last.field)[0] < EPS:
                continue
            total += last.field[0] * np.exp(2j * np.pi * (first.path[0] + last.path[0]) / LAMBDA)
            places.append(last.point[0, 0])
    assert len(places) == 2
    assert places[0] == pytest.approx(places[1], rel=8 * EPS)  # the shear is taken back
    return total


def behind(field, axis):
    (branch,) = Polariser(axis).act(meeting(Z, field=field))
    return power(branch.field)[0]


@pytest.mark.parametrize(
    ("delta", "parallel", "crossed"),
    [(0.5, 0.938791281, 0.061208719), (1.0, 0.770151153, 0.229848847), (2.0, 0.291926582, 0.708073418)],
)
def test_the_analyser_shows_the_phase(delta, parallel, crossed):
    # the half-wave plate swaps the beams: their retardances in the two plates cancel
    field = chain(delta)
    assert behind(field, DIAGONAL) == pytest.approx(parallel, abs=NINE)
    assert behind(field, (1, -1, 0)) == pytest.approx(crossed, abs=NINE)


@settings(deadline=None, max_examples=25)
@given(delta=st.floats(-3.0, 3.0))
def test_the_analyser_follows_the_cosine(delta):
    field = chain(delta)
    assert behind(field, DIAGONAL) == pytest.approx(np.cos(0.5 * delta) ** 2, abs=PATHS)
    assert behind(field, (1, -1, 0)) == pytest.approx(np.sin(0.5 * delta) ** 2, abs=PATHS)


@pytest.mark.parametrize(("delta", "degrees"), [(0.5, 120.676), (2.0, 77.704)])
def test_senarmont(delta, degrees):
    # slow axis along the polariser: extinction at 135 degrees - delta/2, for a delay of the x component
    plate = wave_plate(DIAGONAL, 0.25)
    field = np.array([np.exp(1j * delta), 1.0, 0.0]) / np.sqrt(2.0)
    (linear,) = plate.act(meeting(Z, field=field))
    dark = np.radians(degrees)
    assert behind(linear.field[0], (np.cos(dark), np.sin(dark), 0.0)) < np.radians(MILLI) ** 2
    exact = 0.75 * np.pi - 0.5 * delta
    assert behind(linear.field[0], (np.cos(exact), np.sin(exact), 0.0)) < (8 * EPS) ** 2
    assert np.degrees(exact) == pytest.approx(degrees, abs=MILLI)


@settings(deadline=None, max_examples=25)
@given(delta=st.floats(-3.0, 3.0))
def test_senarmont_behind_the_interferometer(delta):
    # of the two beams the one that was extraordinary in the first plate lies along y in the end
    (linear,) = wave_plate(DIAGONAL, 0.25).act(meeting(Z, field=chain(delta, number=0)))
    dark = 0.75 * np.pi - 0.5 * delta
    assert behind(linear.field[0], (np.cos(dark), np.sin(dark), 0.0)) < PATHS**2


@pytest.mark.parametrize(
    ("wavelength", "leak"),
    [(450e-9, 0.116977778), (500e-9, 0.024471742), (600e-9, 0.017037087), (650e-9, 0.057271987)],
)
def test_a_half_wave_plate_leaks_at_other_wavelengths(wavelength, leak):
    # cos^2(pi design / (2 lambda)) stays where it was
    plate = wave_plate(DIAGONAL, 0.5, design=550e-9)
    (branch,) = plate.act(meeting(Z, field=X, wavelength=wavelength))
    assert behind(branch.field[0], X) == pytest.approx(leak, abs=NINE)
    assert behind(branch.field[0], (0, 1, 0)) == pytest.approx(1.0 - leak, abs=NINE)
