"""Units, and the phase of long paths to the last digit."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace.core import units

EPS = float(np.finfo(np.float64).eps)
# The fold is exact; scaling it takes a division and two products, pi itself is rounded.
ROUNDINGS = 4 * EPS
# Numbers below have fewer digits.
TINY = float(np.finfo(np.float64).tiny)


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        ("633 nm", 633e-9),
        ("633nm", 633e-9),
        ("  0.633   um ", 633e-9),
        ("0.633 µm", 633e-9),
        ("0.633 μm", 633e-9),
        ("633e3 pm", 633e-9),
        ("6.33E-4mm", 633e-9),
        ("+1. mm", 1e-3),
        ("-.5 cm", -5e-3),
        ("2 m", 2.0),
        ("1.5 km", 1500.0),
        ("1 in", 0.0254),
        ("0 m", 0.0),
    ],
)
def test_lengths_in_text(text, metres):
    assert units.parse_length(text) == pytest.approx(metres, rel=2 * EPS, abs=0.0)


@pytest.mark.parametrize(
    ("text", "radians"),
    [
        ("180 deg", math.pi),
        ("180°", math.pi),
        ("90 degrees", math.pi / 2),
        ("1 degree", math.pi / 180),
        ("1 rad", 1.0),
        ("-2 mrad", -2e-3),
        ("50 urad", 50e-6),
        ("60 arcmin", math.pi / 180),
        ("3600 arcsec", math.pi / 180),
    ],
)
def test_angles_in_text(text, radians):
    assert units.parse_angle(text) == pytest.approx(radians, rel=4 * EPS, abs=0.0)


@settings(deadline=None)
@given(st.floats(-1e6, 1e6), st.sampled_from(sorted(units.LENGTHS)))
def test_any_number_with_any_unit(value, unit):
    assert units.parse_length(f"{value!r} {unit}") == value * units.unit_length(unit)


BAD_LENGTHS = [
    "633",
    "nm",
    "",
    "633 furlong",
    "6,33 nm",
    "1 000 nm",
    "nan nm",
    "inf nm",
    "--1 nm",
    "1e nm",
    "2 NM",
]


@pytest.mark.parametrize("text", [*BAD_LENGTHS, None, 633e-9, b"633 nm"])
def test_text_without_number_or_unit_is_refused(text):
    with pytest.raises(ValueError, match=r"wavelength: expected a number and a unit such as '1 pm'.*got"):
        units.parse_length(text, "wavelength")


def test_an_angle_is_no_length():
    with pytest.raises(ValueError, match=r"length: expected a number and a unit .*got '20 deg'"):
        units.parse_length("20 deg")
    with pytest.raises(ValueError, match=r"tilt: expected a number and a unit such as '1 deg'.*got '20 nm'"):
        units.parse_angle("20 nm", "tilt")


def test_numbers_beyond_float64_are_refused():
    with pytest.raises(ValueError, match="length: expected a finite number, got '1e999 m'"):
        units.parse_length("1e999 m")


def test_unit_length():
    assert units.unit_length("um") == 1e-6
    for unit in (None, "", "furlong"):
        with pytest.raises(ValueError, match=r"mesh unit: expected one of pm, nm, .* got"):
            units.unit_length(unit, "mesh unit")


def test_exported_multipliers():
    assert (ft.nm, ft.um, ft.mm) == (1e-9, 1e-6, 1e-3)
    assert 180 * ft.degree == pytest.approx(math.pi, rel=EPS, abs=0.0)


@pytest.mark.parametrize("bad", [0, -1e-9, math.nan, math.inf])
def test_wavelengths_are_positive_lengths(bad):
    calls = (
        units.checked_wavelength,
        units.wavenumber,
        lambda bad: units.path_phase(1.0, bad),
        lambda bad: units.phase_path(1.0, bad),
    )
    for call in calls:
        with pytest.raises(ValueError, match="wavelength: expected a positive length in metres, got"):
            call(bad)


@pytest.mark.parametrize("text", ["633 nm", "1", b"1"])
def test_wavelengths_are_no_text(text):
    with pytest.raises(ValueError, match=r"wavelength: expected metres, got text .*see parse_length"):
        units.checked_wavelength(text)


def test_wavenumber():
    assert units.wavenumber(500e-9) == pytest.approx(4e6 * math.pi, rel=2 * EPS, abs=0.0)
    assert isinstance(units.checked_wavelength(1), float)


def exact_phase(length, wavelength):
    """2 pi (length / wavelength) modulo 2 pi, in [-pi, pi], of the two float64 numbers as they are."""
    with mpmath.workdps(60):
        turns = mpmath.mpf(length) / mpmath.mpf(wavelength)
        return float(2 * mpmath.pi * (turns - mpmath.nint(turns)))


@settings(max_examples=300, deadline=None)
@given(st.floats(-1e3, 1e3), st.floats(1e-12, 1e-3))
def test_phase_of_long_paths_costs_no_digits(length, wavelength):
    found = float(units.path_phase(length, wavelength))
    expected = exact_phase(length, wavelength)
    assert abs(found) <= math.pi
    if abs(expected) < 3.1415:  # at half a turn either sign is right
        assert found == pytest.approx(expected, rel=ROUNDINGS, abs=TINY)
    else:
        assert abs(found) == pytest.approx(abs(expected), rel=ROUNDINGS, abs=0.0)


def test_phase_of_short_paths_keeps_its_digits_on_both_sides():
    for length in (1e-20, -1e-20, 1e-9, -1e-9):
        assert units.path_phase(length, 633e-9) == pytest.approx(
            2 * math.pi * length / 633e-9, rel=ROUNDINGS, abs=0.0
        )


@settings(deadline=None)
@given(st.floats(-1e3, 1e3))
def test_phase_is_odd(length):
    assert units.path_phase(-length, 633e-9) == -units.path_phase(length, 633e-9)


def test_whole_waves_have_no_phase():
    wavelength = 2.0**-21  # of which whole multiples are exact
    np.testing.assert_array_equal(units.path_phase(wavelength * np.arange(-5, 6), wavelength), np.zeros(11))
    np.testing.assert_array_equal(units.path_phase(wavelength * 0.5, wavelength), math.pi)


@settings(deadline=None)
@given(st.floats(-1e3, 1e3), st.floats(1e-12, 1e-3))
def test_phase_path_and_back(phase, wavelength):
    length = units.phase_path(phase, wavelength)
    assert length == pytest.approx(phase * wavelength / (2 * math.pi), rel=ROUNDINGS, abs=TINY)
    assert 2 * math.pi * length / wavelength == pytest.approx(phase, rel=ROUNDINGS, abs=TINY / 1e-12)


def test_shapes_pass_through():
    lengths = np.linspace(-1.0, 1.0, 24).reshape(2, 3, 4)
    for function in (units.path_phase, units.phase_path):
        found = function(lengths, 633e-9)
        assert found.shape == (2, 3, 4)
        assert found.dtype == np.float64
        assert function(0.25, 633e-9).shape == ()
