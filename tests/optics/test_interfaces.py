"""What surfaces do to light: amplitudes that never gain power, and the law of reflection."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace.optics import interfaces

# Amplitudes are square roots of rounded numbers, and the door lets 1e-12 of gain through.
POWER = 1e-11
# Reflection takes a product of three terms and a difference of numbers below 2.
ROUNDING = 16 * float(np.finfo(np.float64).eps)

disc = st.complex_numbers(max_magnitude=1.2)


def gain(r, t, a, b):
    """Power out over power in, with amplitudes a and b at the two sides of a splitter."""
    out = abs(r * a + t * b) ** 2 + abs(t * a + r * b) ** 2
    return out / (abs(a) ** 2 + abs(b) ** 2)


@settings(deadline=None)
@given(r=disc, t=disc, b=st.complex_numbers(max_magnitude=10.0))
def test_splitters_that_are_let_in_are_passive(r, t, b):
    worst = max(gain(r, t, 1.0, 1.0), gain(r, t, 1.0, -1.0))
    if worst > 1.0 + POWER:
        with pytest.raises(ValueError, match=r"BeamSplitter: expected \|r \+ t\|\^2 .* \(passive\), got"):
            ft.BeamSplitter(r, t)
    elif worst < 1.0 - POWER:
        splitter = ft.BeamSplitter(r, t)
        assert (splitter.reflection, splitter.transmission) == (r, t)
        assert gain(r, t, 1.0, b) <= 1.0


@settings(deadline=None)
@given(reflected=st.floats(0.0, 1.0), common=st.floats(-4.0, 4.0), side=st.sampled_from([1j, -1j]))
def test_a_quarter_wave_apart_every_division_is_lossless(reflected, common, side):
    turn = cmath.exp(1j * common)
    splitter = ft.BeamSplitter(side * math.sqrt(reflected) * turn, math.sqrt(1.0 - reflected) * turn)
    r, t = splitter.reflection, splitter.transmission
    for phase in np.linspace(0.0, 6.0, 7):
        assert gain(r, t, 1.0, cmath.exp(1j * phase)) == pytest.approx(1.0, rel=POWER, abs=0.0)


def test_default_splitter():
    splitter = ft.BeamSplitter()
    assert splitter.reflection == pytest.approx(1j / math.sqrt(2.0), rel=1e-15, abs=0.0)
    assert splitter.transmission == pytest.approx(1.0 / math.sqrt(2.0), rel=1e-15, abs=0.0)
    # a Michelson's two ports, cos^2 and sin^2 of half the phase between the arms
    r, t = splitter.reflection, splitter.transmission
    for phase in np.linspace(0.0, 6.0, 7):
        camera = abs(r * t + t * r * cmath.exp(1j * phase)) ** 2
        source = abs(r * r + t * t * cmath.exp(1j * phase)) ** 2
        assert camera == pytest.approx(math.cos(phase / 2) ** 2, abs=ROUNDING)
        assert source == pytest.approx(math.sin(phase / 2) ** 2, abs=ROUNDING)


@pytest.mark.parametrize(
    ("r", "t"), [(0.8, 0.6), (1.0, 1e-3), (2j, 0.0), (1e200, 0.0), (1e308 + 1e308j, 1e308)]
)
def test_splitters_that_gain_power_are_refused(r, t):
    with pytest.raises(ValueError, match=r"BeamSplitter: expected \|r \+ t\|\^2 and \|r - t\|\^2 up to 1"):
        ft.BeamSplitter(r, t)


@pytest.mark.parametrize("bad", [math.nan, math.inf, complex(0.0, math.nan), "0.5", None])
def test_splitter_amplitudes_are_finite_numbers(bad):
    for pair in ((bad, 0.1), (0.1, bad)):
        with pytest.raises(ValueError, match="BeamSplitter: expected finite amplitudes, got r="):
            ft.BeamSplitter(*pair)


@settings(deadline=None)
@given(st.floats(0.0, 1.0))
def test_mirror(reflectance):
    mirror = ft.Mirror(reflectance)
    assert mirror.reflection.real <= 0.0
    assert mirror.reflection.imag == 0.0
    assert abs(mirror.reflection) ** 2 == pytest.approx(reflectance, rel=ROUNDING, abs=1e-300)
    assert mirror.transmission == 0.0


def test_mirrors_take_numbers_of_numpy():
    assert ft.Mirror(np.float32(0.25)).reflection == -0.5
    assert ft.Mirror(np.int64(1)).reflection == -1.0
    assert ft.Mirror().reflection == -1.0


@pytest.mark.parametrize("bad", [-1e-9, 1.0 + 1e-9, math.nan, math.inf, "0.5", None, 0.5j])
def test_reflectances_are_fractions(bad):
    with pytest.raises(ValueError, match="Mirror reflectance: expected a number from 0 to 1, got"):
        ft.Mirror(bad)


def test_absorber():
    assert (ft.Absorber().reflection, ft.Absorber().transmission) == (0.0, 0.0)


def test_interfaces_are_values():
    assert ft.Mirror(0.5) == ft.Mirror(0.5) != ft.Mirror(0.6)
    with pytest.raises(AttributeError, match="cannot assign"):
        ft.Mirror().reflectance = 0.5


def random_units(rng, count):
    vectors = rng.standard_normal((count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_reflect():
    rng = np.random.default_rng(11)
    direction, normal = random_units(rng, 1000), random_units(rng, 1000)
    away = interfaces.reflect(direction, normal)
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), 1.0, rtol=0, atol=ROUNDING)
    # the part along the normal turns round, the part across it stays
    along, along_away = (direction * normal).sum(axis=1), (away * normal).sum(axis=1)
    np.testing.assert_allclose(along_away, -along, rtol=0, atol=ROUNDING)
    across = direction - along[:, None] * normal
    np.testing.assert_allclose(away - along_away[:, None] * normal, across, rtol=0, atol=ROUNDING)
    # either side of the normal, and back again
    np.testing.assert_array_equal(interfaces.reflect(direction, -normal), away)
    np.testing.assert_allclose(interfaces.reflect(away, normal), direction, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(-interfaces.reflect(-away, normal), direction, rtol=0, atol=ROUNDING)


def test_reflect_is_the_householder_matrix():
    rng = np.random.default_rng(12)
    direction, normal = random_units(rng, 100), random_units(rng, 100)
    matrices = np.eye(3) - 2.0 * normal[:, :, None] * normal[:, None, :]
    expected = (matrices @ direction[:, :, None])[:, :, 0]
    np.testing.assert_allclose(interfaces.reflect(direction, normal), expected, rtol=0, atol=ROUNDING)


def test_reflect_at_normal_incidence_and_in_passing():
    z, x = np.array([[0.0, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0]])
    np.testing.assert_array_equal(interfaces.reflect(z, z), -z)
    np.testing.assert_array_equal(interfaces.reflect(x, z), x)


KINDS = {
    "constant": [ft.Mirror(), ft.optics.Absorber(), ft.BeamSplitter()],
    "boundary": [ft.Dielectric(), ft.Metal(), ft.Dielectric(film=ft.optics.Film([(1.4, 1e-7)]))],
    "element": [
        ft.optics.elements.Annulus((0, 0, 0), 0.0, 1.0),
        ft.optics.elements.IdealLens((0, 0, 0), (0, 0, 1), 0.1),
        ft.optics.Polariser((1, 0, 0)),
    ],
}


@pytest.mark.parametrize("kind", KINDS)
def test_interfaces_answer_the_same_questions(kind):
    for interface in KINDS[kind]:
        assert interface.kind == kind
        assert interface.branches >= 1
        assert interface.polarised in (True, False)
        assert interface.chromatic == (getattr(interface, "film", None) is not None)
        assert interface.waves in ("plane", "curved", "torn")


def test_interfaces_of_your_own_need_but_two_amplitudes():
    class Half(ft.optics.ConstantInterface):
        reflection = -0.6 + 0j
        transmission = 0.8j

    surface = ft.Surface(ft.shapes.plate(1.0, 1.0), Half())
    paths = ft.trace(ft.Scene([surface]), ft.Rays([(0, 0, 1)], [(0, 0, -1)]))
    assert sorted(abs(paths.amplitude)) == pytest.approx([0.6, 0.8])
