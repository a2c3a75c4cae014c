"""Faces between two media: Snell and Fresnel, total reflection with its phase, metals, absorbing media."""

import cmath
import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fringetrace import nm
from fringetrace.core.units import degree
from fringetrace.optics import film_kernels, films

EPS = float(np.finfo(np.float64).eps)
# Reference numbers are printed with nine decimals.
PRINTED = 0.51e-9
# An amplitude is a quotient of sums of two products.
ROUNDINGS = 8 * EPS

angles = st.floats(0.0, 89.9).map(math.radians)
indices = st.floats(1.0, 4.0)


def face(first, last, angle):
    """Amplitudes at an angle in degrees, with the phases that fields get."""
    return films.fresnel(first, last, angle * degree)


@pytest.mark.parametrize(
    ("angle", "rs", "rp"), [(45.0, -0.303337045, 0.092013363), (60.0, -0.420204103, -0.042449235)]
)
def test_air_to_glass(angle, rs, rp):
    got = face(1.0, 1.5, angle)
    assert (got.rs, got.rp) == (pytest.approx(rs, abs=PRINTED), pytest.approx(rp, abs=PRINTED))


def test_powers_at_45_degrees():
    s, p = films.reflectance(None, 1.0, 1.5, 45.0 * degree, 500 * nm)
    assert (s, p) == (pytest.approx(0.092013363, abs=PRINTED), pytest.approx(0.008466459, abs=PRINTED))
    assert p == pytest.approx(s**2, rel=ROUNDINGS)  # a law of 45 degrees


def test_normal_incidence():
    got = face(1.0, 1.5, 0.0)
    assert got.rs == pytest.approx(-0.2, rel=ROUNDINGS)
    assert got.rp == pytest.approx(0.2, rel=ROUNDINGS)
    assert got.ts == got.tp == pytest.approx(0.8, rel=ROUNDINGS)


def test_brewster():
    angle = math.degrees(math.atan(1.5))
    assert angle == pytest.approx(56.309932474, abs=PRINTED)
    assert abs(face(1.0, 1.5, angle).rp) < ROUNDINGS


@pytest.mark.parametrize(("n", "angle"), [(1.5, 41.810314896), (1.33, 48.753466631)])
def test_critical_angle(n, angle):
    below, above = (face(n, 1.0, angle + shift) for shift in (-2 * PRINTED, 2 * PRINTED))
    assert abs(below.rs) < 1.0 - 1e-6
    assert abs(above.rs) == pytest.approx(1.0, rel=ROUNDINGS)


def test_total_reflection_and_its_phase():
    got = face(1.5, 1.0, 60.0)
    for amplitude, printed in zip(got, (-0.1 - 0.994987437j, -0.721739130 - 0.692165174j), strict=False):
        assert amplitude.real == pytest.approx(printed.real, abs=PRINTED)
        assert amplitude.imag == pytest.approx(printed.imag, abs=PRINTED)


@given(n=st.floats(1.01, 4.0), part=st.floats(1e-3, 0.999))
@settings(max_examples=100)
def test_total_reflection_loses_nothing(n, part):
    critical = math.asin(1.0 / n)
    got = films.fresnel(n, 1.0, critical + part * (0.5 * math.pi - critical))
    assert abs(got.rs) == pytest.approx(1.0, abs=1e-15)
    assert abs(got.rp) == pytest.approx(1.0, abs=1e-15)


def test_total_reflection_beside_mpmath():
    with mpmath.workdps(40):
        for n, angle in ((1.5, 0.75), (1.51, 1.2), (3.5, 0.3), (1.33, 1.5)):
            c = mpmath.cos(angle)
            q = mpmath.sqrt((n * mpmath.sin(angle)) ** 2 - 1)
            exact = [-2 * mpmath.atan(q / (n * c)), -2 * mpmath.atan(n * q / c)]
            got = films.fresnel(n, 1.0, angle)
            # n sin(angle) is rounded, and its square is taken from 1: the steeper, the nearer to critical
            slope = float(n**2 / q**2)
            assert cmath.phase(got.rs) == pytest.approx(float(exact[0]), abs=slope * ROUNDINGS)
            assert cmath.phase(got.rp) == pytest.approx(float(exact[1]), abs=slope * ROUNDINGS)


@pytest.mark.parametrize("angle", [48.624359160, 54.623105441])
def test_fresnel_rhomb(angle):
    got = face(1.51, 1.0, angle)
    turn = math.degrees(cmath.phase(got.rs / got.rp))
    assert turn == pytest.approx(45.0, abs=20 * PRINTED)  # degrees, of an angle with nine decimals


def test_largest_phase_between_s_and_p():
    around = 51.339100020 + np.array([-1e-3, 0.0, 1e-3])
    got = face(1.51, 1.0, around)
    turn = np.degrees(np.angle(got.rs / got.rp))
    assert turn[1] == pytest.approx(45.941666807, abs=PRINTED)
    assert turn.argmax() == 1


def test_goos_haenchen():
    """Artmann: the ray comes back -d(arg rs)/d(kx) farther on."""
    k = 1.5 * 2.0 * math.pi / 633.0
    step = 1e-4
    before, after = films.fresnel(1.5, 1.0, math.pi / 3 + np.array([-step, step])).rs
    slope = cmath.phase(after / before) / (2.0 * step)
    # the difference quotient is off by step^2 in relative terms
    assert -slope / (k * math.cos(math.pi / 3)) == pytest.approx(420.8992, rel=10 * step**2 + 1.2e-7)


def test_gold():
    gold = 0.18344 + 3.4332j
    assert films.reflectance(None, 1.0, gold, 0.0, 633 * nm).s == pytest.approx(0.944358978, abs=PRINTED)
    s, p = films.reflectance(None, 1.0, gold, 45.0 * degree, 633 * nm)
    assert (s, p) == (pytest.approx(0.961122032, abs=PRINTED), pytest.approx(0.923755560, abs=PRINTED))


def test_keratin_to_melanin():
    s, p = films.reflectance(None, 1.55556, 1.7428 + 0.08789j, 30.0 * degree, 500 * nm)
    assert (s, p) == (pytest.approx(0.006503985, abs=PRINTED), pytest.approx(0.001999897, abs=PRINTED))


def test_into_an_absorbing_medium():
    kz = film_kernels.beneath(1.0 + 0j, 1.7428 + 0.08789j, cmath.sqrt(0.5))
    assert kz == pytest.approx(1.593383 + 0.096132j, abs=0.71e-6)


@given(first=indices, last=indices, angle=angles)
@settings(max_examples=100)
def test_power_adds_up(first, last, angle):
    r = films.reflectance(None, first, last, angle, 500 * nm)
    t = films.transmittance(None, first, last, angle, 500 * nm)
    for part in (0, 1):
        assert r[part] + t[part] == pytest.approx(1.0, abs=1e-12)


@given(first=indices, last=indices, angle=st.floats(0.0, 89.0).map(math.radians))
@settings(max_examples=100)
def test_stokes_relations(first, last, angle):
    """Light sent back along both paths gives the incident wave: r12 = -r21, t12 t21 - r12 r21 = 1."""
    sine2 = complex((first * math.sin(angle)) ** 2)
    if sine2.real > (0.999 * last) ** 2:  # total reflection: there is no wave to send back
        return
    none, nothing = np.empty(0, np.complex128), np.empty(0)
    q1, q2 = (cmath.sqrt(n * n - sine2) for n in (first, last))
    there = film_kernels.stack_amplitudes(q1, complex(first), none, nothing, complex(last), 1.0)
    back = film_kernels.stack_amplitudes(q2, complex(last), none, nothing, complex(first), 1.0)
    for part in (0, 1):
        # kz of each side is off by the rounding of n^2 - sine2
        worst = 20 * EPS * max(first**2 / abs(first**2 - sine2), last**2 / abs(last**2 - sine2))
        assert back[part] == pytest.approx(-there[part], abs=worst)
        product = there[2 + part] * back[2 + part] - there[part] * back[part]
        assert product == pytest.approx(1.0, abs=worst)


def test_out_of_a_weakly_absorbing_medium():
    """A trace of absorption changes the amplitudes by a trace: the wave behind still goes on."""
    clear, dim = (face(n, 1.0, np.array([10.0, 30.0, 41.0, 42.5, 60.0])) for n in (1.5, 1.5 + 1e-9j))
    for one, other in zip(clear, dim, strict=True):
        assert np.abs(one - other).max() < 1e-6  # 1e-9 n^2 / kz^2, near the critical angle


def test_equal_media_do_nothing():
    got = face(1.5, 1.5, np.array([0.0, 60.0, 90.0]))
    for amplitude, nothing in zip(got, (0.0, 0.0, 1.0, 1.0), strict=True):
        assert (amplitude == nothing).all()
