"""Gratings by the grating equation, in plane and conical, and the efficiencies of thin phase gratings."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from meetings import EPS, meeting, power

from fringetrace.optics.gratings import Grating, lamellar, sinusoidal

# Angles from sines near 1 lose a factor tan(65 degrees) of some ten roundings.
ROUNDING = 64 * EPS
# Printed with so many digits after the point.
DEGREES = 0.5e-8
NINE = 0.5e-9

PERIOD = 1e-3 / 600
LAMBDA = 0.5e-6
X = (1.0, 0.0, 0.0)

# arcsin(sin theta_i + m lambda / period), computed with mpmath
STRAIGHT = [17.45760312, 36.86989765, 64.15806724]
AT_35 = [-67.88400465, -38.78674969, -19.05184349, -1.51413491, 15.87719702, 35.0, 60.87694246]


def angles(degrees, orders, **options):
    """Angles of orders, NaN where evanescent, of light that comes in the plane across the grooves."""
    slant = np.radians(degrees)
    rays = meeting((np.sin(slant), 0.0, np.cos(slant)), wavelength=LAMBDA)
    return np.array([
        np.degrees(np.arcsin(branch.direction[0, 0])) if branch.field[0] else np.nan
        for branch in Grating(X, PERIOD, orders=orders, **options).act(rays)
    ])  # fmt: skip


def test_six_hundred_lines_to_the_millimetre():
    assert angles(0.0, (1, 2, 3)) == pytest.approx(STRAIGHT, abs=DEGREES)
    assert angles(0.0, (-1, -2, -3)) == pytest.approx(-np.array(STRAIGHT), abs=DEGREES)
    assert np.isnan(angles(0.0, (-4, 4))).all()


@pytest.mark.parametrize("reflects", [False, True])
def test_six_hundred_lines_to_the_millimetre_at_35_degrees(reflects):
    assert angles(35.0, tuple(range(-5, 2)), reflects=reflects) == pytest.approx(AT_35, abs=DEGREES)
    assert np.isnan(angles(35.0, (-6, 2), reflects=reflects)).all()


def test_in_littrow_light_goes_back_the_way_it_came():
    slant = np.arcsin(0.5 * LAMBDA / PERIOD)
    rays = meeting((np.sin(slant), 0.0, np.cos(slant)), wavelength=LAMBDA)
    (branch,) = Grating(X, PERIOD, orders=(-1,), reflects=True).act(rays)
    assert np.abs(branch.direction + rays.direction).max() < ROUNDING


@settings(deadline=None, max_examples=40)
@given(theta=st.floats(0.0, 1.2), azimuth=st.floats(-3.1, 3.1), m=st.integers(-2, 2))
def test_conical_diffraction_keeps_the_part_along_the_grooves(theta, azimuth, m):
    u, v = np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth)
    rays = meeting((u, v, np.cos(theta)), wavelength=LAMBDA)
    (branch,) = Grating(X, PERIOD, orders=(m,)).act(rays)
    out = u + m * LAMBDA / PERIOD
    if out * out + v * v < 1.0 - ROUNDING:
        assert branch.direction[0, :2] == pytest.approx([out, v], abs=ROUNDING)
        assert branch.direction[0, 2] > 0.0
    elif out * out + v * v > 1.0 + ROUNDING:
        assert branch.field[0] == 0.0


def test_glass_shortens_the_wave():
    rays = meeting((0.0, 0.0, 1.0), index=1.5, wavelength=LAMBDA)
    (branch,) = Grating(X, PERIOD, orders=(4,)).act(rays)
    assert branch.direction[0, 0] == pytest.approx(4.0 * LAMBDA / (1.5 * PERIOD), rel=ROUNDING)


def test_efficiencies_of_thin_phase_gratings():
    rays = meeting((0.0, 0.0, 1.0), wavelength=LAMBDA)
    orders = (0, 1, 3)
    binary = Grating(X, 10e-6, orders, amplitudes=lamellar(orders, np.pi)).act(rays)
    assert [power(b.field)[0] for b in binary] == pytest.approx(
        [0.0, 4 / np.pi**2, 4 / (9 * np.pi**2)], abs=4 * EPS
    )
    orders = (0, 1, 2)
    wavy = Grating(X, 10e-6, orders, amplitudes=sinusoidal(orders, 0.5)).act(rays)
    # squares of the Bessel functions at 0.5 (Abramowitz and Stegun, table 9.1)
    assert [power(b.field)[0] for b in wavy] == pytest.approx(
        [0.880725579, 0.058694006, 0.000936606], abs=NINE
    )


def test_a_modulator_repeats_itself_at_the_angle_of_its_pixels():
    (branch,) = Grating(X, 8e-6).act(meeting((0.0, 0.0, 1.0), wavelength=632.8e-9))
    assert np.degrees(np.arcsin(branch.direction[0, 0])) == pytest.approx(4.536835593, abs=NINE)
