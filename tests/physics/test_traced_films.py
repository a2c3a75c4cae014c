"""Layers as faces that rays go back and forth between, and as films on one face; beside Airy and tmm."""

import math

import glass
import numpy as np
import pytest
import tmm
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace import nm, um
from fringetrace.core.units import degree
from fringetrace.optics.films import Film, quarter_wave_stack

# Reference numbers are printed with nine decimals.
PRINTED = 0.51e-9
# Two programs, each with some hundred roundings; a film's phase is exact, that of a traced layer is that of
# a path of 0.1 m: 1e-17 m.
RIVAL = 1e-9
LEDGER = 1e-12


def rival(indices, thickness, angle, wavelength, state):
    """r and t of tmm, t of power: on both sides of it fields are in real media."""
    found = tmm.coh_tmm(
        "p" if state == "p" else "s", list(indices), [math.inf, *thickness, math.inf], angle, wavelength
    )
    before, behind = indices[0], indices[-1]
    sine = before * math.sin(angle) / behind
    power = math.sqrt((behind * math.sqrt(1.0 - sine**2)) / (before * math.cos(angle)))
    return found["r"], found["t"] * power


def bounced(indices, thickness, angle, wavelength, state, least=1e-10, most=400):
    """r and t of a stack by the coherent sum over traced bounces."""
    scene = glass.stack(indices, thickness)
    paths = ft.trace(
        scene, glass.aimed(angle, state), wavelength=wavelength, min_amplitude=least, max_bounces=most
    )
    depth = -sum(thickness)
    return (
        glass.summed(paths, wavelength, state),
        glass.summed(paths, wavelength, state, upwards=False, point=(0.0, 0.0, depth)),
    )


def coated(film, first, last, angle, wavelength, state):
    """r and t of a film on one face."""
    scene = glass.stack([first, last], films=[film])
    paths = ft.trace(scene, glass.aimed(angle, state), wavelength=wavelength, min_amplitude=0.0)
    assert paths.ledger().error < LEDGER
    got = glass.branches(paths, state)
    return got[((0, False),)], got[((0, True),)]


SOAP = [  # wavelength, normal incidence, 45 degrees s, 45 degrees p
    (450, 0.034445990, 0.188938334, 0.010883952),
    (500, 0.070790295, 0.156811922, 0.008708218),
    (550, 0.075430203, 0.091779117, 0.004750698),
    (600, 0.058295763, 0.033697372, 0.001644528),
    (700, 0.014921631, 0.002713456, 0.000128505),
]


@pytest.mark.parametrize(("wavelength", "normal", "s", "p"), SOAP)
@pytest.mark.parametrize("traced", [True, False])
def test_soap_film(wavelength, normal, s, p, traced):
    for angle, state, expected in ((0.0, None, normal), (45 * degree, "s", s), (45 * degree, "p", p)):
        if traced:
            r, t = bounced([1.0, 1.33, 1.0], [300 * nm], angle, wavelength * nm, state)
        else:
            r, t = coated(Film([(1.33, 300 * nm)]), 1.0, 1.0, angle, wavelength * nm, state)
        assert abs(r) ** 2 == pytest.approx(expected, abs=PRINTED + RIVAL * traced)
        assert abs(r) ** 2 + abs(t) ** 2 == pytest.approx(1.0, abs=RIVAL)


def test_black_film():
    r, _ = bounced([1.0, 1.33, 1.0], [10 * nm], 0.0, 550 * nm, None)
    assert abs(r) ** 2 == pytest.approx(0.001910465, abs=PRINTED)


def test_sum_over_traced_bounces_converges_to_the_film():
    """Each bounce more in a soap film brings the sum nearer by |r01 r12|, as printed for 500 nm."""
    whole = rival([1.0, 1.33, 1.0], [300 * nm], 0.0, 500 * nm, "s")[0]
    paths = ft.trace(
        glass.stack([1.0, 1.33, 1.0], [300 * nm]), glass.aimed(0.0), min_amplitude=0.0, max_bounces=16
    )
    errors = []
    for extra in range(6):
        some = paths.where(paths.bounces <= 1 + 2 * extra)
        errors.append(abs(glass.summed(some, 500 * nm) - whole))
    assert errors == pytest.approx((0.1365, 2.739e-3, 5.493e-5, 1.102e-6, 2.21e-8, 4.43e-10), rel=3e-3)


def test_magnesium_fluoride_on_glass():
    depth = 550 * nm / 1.38 / 4
    for r, _ in (
        bounced([1.0, 1.38, 1.52], [depth], 0.0, 550 * nm, None),
        coated(Film([(1.38, depth)]), 1.0, 1.52, 0.0, 550 * nm, None),
    ):
        assert abs(r) ** 2 == pytest.approx(0.012600790, abs=PRINTED)


def test_quarter_wave_mirror():
    film = quarter_wave_stack(2.3, 1.38, 4, 550 * nm)
    for state in (None, "s", "p"):
        r, t = coated(film, 1.0, 1.52, 0.0, 550 * nm, state)
        assert abs(r) ** 2 == pytest.approx(0.980880520, abs=PRINTED)
        assert abs(r) ** 2 + abs(t) ** 2 == pytest.approx(1.0, abs=1e-13)


@pytest.mark.parametrize("state", ["s", "p"])
def test_two_layers_by_bounces(state):
    """A broad antireflection coating: all ways back and forth through both layers."""
    indices, thickness = [1.0, 1.38, 1.7, 1.52], [100 * nm, 160 * nm]
    for angle in (0.0, 0.7):
        found = bounced(indices, thickness, angle, 550 * nm, state, least=1e-12)
        np.testing.assert_allclose(
            found, rival(indices, thickness, angle, 550 * nm, state), rtol=0, atol=RIVAL
        )


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_quarter_wave_mirror_by_bounces():
    """Three layers: at the wavelength they are made for all ways add in phase, the faint ones too."""
    indices = [1.0, 2.3, 1.38, 2.3, 1.52]
    thickness = [550 * nm / 4 / n for n in indices[1:-1]]
    exact = rival(indices, thickness, 0.0, 550 * nm, "s")
    errors = [
        np.abs(np.subtract(bounced(indices, thickness, 0.0, 550 * nm, None, least), exact)).max()
        for least in (1e-3, 1e-4, 1e-5, 1e-6)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 3e-3


MORPHO = [(400, 0.346474395), (450, 0.991849188), (480, 0.995960163), (500, 0.995226734), (600, 0.107315786)]


@pytest.mark.parametrize(("wavelength", "expected"), MORPHO)
def test_scales_of_morpho_as_a_film(wavelength, expected):
    film = Film(((1.56, 65 * nm), (1.0, 140 * nm)) * 7 + ((1.56, 65 * nm),))
    r, _ = coated(film, 1.0, 1.0, 0.0, wavelength * nm, None)
    assert abs(r) ** 2 == pytest.approx(expected, abs=PRINTED)
    absorbing = Film(((1.56 + 0.06j, 65 * nm), (1.0, 140 * nm)) * 7 + ((1.56 + 0.06j, 65 * nm),))
    with_pigment = {450: 0.829277822, 480: 0.793661144, 500: 0.752623321}
    if wavelength in with_pigment:
        r, _ = coated(absorbing, 1.0, 1.0, 0.0, wavelength * nm, None)
        assert abs(r) ** 2 == pytest.approx(with_pigment[wavelength], abs=PRINTED)


def test_scales_of_morpho_at_30_degrees():
    film = Film(((1.56, 65 * nm), (1.0, 140 * nm)) * 7 + ((1.56, 65 * nm),))
    for state, expected in (("s", 0.991147120), ("p", 0.702550674)):
        r, _ = coated(film, 1.0, 1.0, 30 * degree, 500 * nm, state)
        assert abs(r) ** 2 == pytest.approx(expected, abs=PRINTED)


@pytest.mark.parametrize("state", ["s", "p", None])
@pytest.mark.parametrize(
    ("indices", "thickness"),
    [
        ([1.0, 1.7428 + 0.0879j, 1.0], [130 * nm]),
        ([1.0, 0.2 + 3.4j, 1.0], [30 * nm]),
        ([1.33, 1.5 + 0.02j, 1.0], [2 * um]),
        ([1.0, 0.2 + 3.4j, 1.5], [30 * nm]),
    ],
)
def test_absorbing_layers_by_bounces(indices, thickness, state):
    """Inhomogeneous waves: with real angles a metal film would be wrong in its first digit."""
    for angle in (0.0, 0.6, 0.8):
        if (indices[0] * math.sin(angle)) >= indices[-1]:
            continue
        found = bounced(indices, thickness, angle, 600 * nm, state)
        exact = rival(indices, thickness, angle, 600 * nm, state)
        np.testing.assert_allclose(found, exact, rtol=0, atol=RIVAL)


@given(
    layers=st.lists(
        st.tuples(st.floats(1.0, 3.0), st.sampled_from([0.0, 0.0, 0.1, 2.0]), st.floats(1.0, 900.0)),
        max_size=5,
    ),
    first=st.floats(1.0, 2.0),
    last=st.floats(2.0, 3.0),
    angle=st.floats(0.0, 1.5),
    state=st.sampled_from([None, "s", "p"]),
)
@settings(max_examples=25)
def test_any_film_beside_tmm(layers, first, last, angle, state):
    film = Film([(complex(n, k), d * nm) for n, k, d in layers])
    scene = glass.stack([first, last], films=[film])
    paths = ft.trace(scene, glass.aimed(angle, state), wavelength=600 * nm, min_amplitude=0.0)
    got = glass.branches(paths, state)
    indices = [first, *(complex(n, k) for n, k, _ in layers), last]
    r, t = rival(indices, [d * nm for _, _, d in layers], angle, 600 * nm, state)
    assert got.get(((0, False),), 0.0) == pytest.approx(r, abs=RIVAL)
    assert got.get(((0, True),), 0.0) == pytest.approx(t, abs=RIVAL)
    assert paths.ledger().error < LEDGER


def test_a_film_is_met_the_other_way_round_from_behind():
    """High then low from the front; t is the same both ways, r is not."""
    film = Film([(2.3, 40 * nm), (1.38, 90 * nm)])
    inside = math.asin(math.sin(0.5) / 1.5)
    scene = glass.stack([1.0, 1.5], films=[film])
    behind = ft.Scene(scene.surfaces, medium=1.5)
    for state in ("s", "p"):
        there = glass.branches(
            ft.trace(scene, glass.aimed(0.5, state), wavelength=600 * nm, min_amplitude=0.0), state
        )
        rays = glass.aimed(inside, state, upwards=True)
        back = glass.branches(ft.trace(behind, rays, wavelength=600 * nm, min_amplitude=0.0), state)
        assert back[((0, True),)] == pytest.approx(there[((0, True),)], abs=1e-14)
        r, _ = rival([1.5, 1.38, 2.3, 1.0], [90 * nm, 40 * nm], inside, 600 * nm, state)
        assert back[((0, False),)] == pytest.approx(r, abs=1e-13)
        assert abs(back[((0, False),)] - there[((0, False),)]) > 0.1


def test_frustrated_total_reflection():
    """A gap of 100 nm between glass lets light through beyond the critical angle: as a film, not as rays."""
    for state in ("s", "p"):
        r, t = coated(Film([(1.0, 100 * nm)]), 1.5, 1.5, 1.0, 600 * nm, state)
        exact = rival([1.5, 1.0, 1.5], [100 * nm], 1.0, 600 * nm, state)
        np.testing.assert_allclose((r, t), exact, rtol=0, atol=1e-13)
        assert 0.01 < abs(t) ** 2 < 0.99
