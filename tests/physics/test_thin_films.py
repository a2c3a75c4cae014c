"""Thin films: soap, MgF2, quarter-wave mirrors, the scales of Morpho; beside Airy's sum and tmm."""

import cmath
import math
from itertools import pairwise

import mpmath
import numpy as np
import pytest
import tmm
from hypothesis import given, settings, strategies as st

from fringetrace import nm
from fringetrace.core.units import degree
from fringetrace.optics import films, materials
from fringetrace.optics.film_kernels import stack_amplitudes
from fringetrace.optics.films import Film
from fringetrace.rigorous import effective_medium

EPS = float(np.finfo(np.float64).eps)
# Reference numbers are printed with nine decimals.
PRINTED = 0.51e-9
# Two programs, each with some hundred roundings; a resonance multiplies them.
RIVAL = 1e-12
# An amplitude of few layers has some ten roundings; at grazing incidence a power is as good.
GRAZING = 64 * EPS

SOAP = Film([(1.33, 300 * nm)])
SOAP_TABLE = [  # wavelength, normal incidence, 45 degrees s, 45 degrees p
    (450, 0.034445990, 0.188938334, 0.010883952),
    (500, 0.070790295, 0.156811922, 0.008708218),
    (550, 0.075430203, 0.091779117, 0.004750698),
    (600, 0.058295763, 0.033697372, 0.001644528),
    (700, 0.014921631, 0.002713456, 0.000128505),
]


def morpho(material):
    """Eight plates of 65 nm with seven gaps of 140 nm of air."""
    plate = (material, 65 * nm)
    return Film((plate, (1.0, 140 * nm)) * 7 + (plate,))


def straight(film, wavelength, last=1.0):
    """Reflectance in air at normal incidence."""
    return films.reflectance(film, 1.0, last, 0.0, wavelength).s


@pytest.mark.parametrize(("wavelength", "normal", "s", "p"), SOAP_TABLE)
def test_soap_film(wavelength, normal, s, p):
    assert straight(SOAP, wavelength * nm) == pytest.approx(normal, abs=PRINTED)
    got = films.reflectance(SOAP, 1.0, 1.0, 45 * degree, wavelength * nm)
    assert got == (pytest.approx(s, abs=PRINTED), pytest.approx(p, abs=PRINTED))


@pytest.mark.parametrize(("angle", "peak"), [(0.0, 532.0), (0.0, 319.2), (45.0, 450.582)])
def test_brightest_colours_of_soap(angle, peak):
    wave = peak * nm * np.array([0.999, 1.0, 1.001])
    bright = films.reflectance(SOAP, 1.0, 1.0, angle * degree, wave).s
    assert bright.argmax() == 1
    if angle == 0.0:
        assert bright[1] == pytest.approx(0.077112570, abs=PRINTED)


def test_black_film():
    assert straight(Film([(1.33, 10 * nm)]), 550 * nm) == pytest.approx(0.001910465, abs=PRINTED)


def test_sum_over_bounces_converges_to_the_film():
    """Each bounce more in a soap film brings Airy's sum nearer by |r01 r12|."""
    r = films.fresnel(1.0, 1.33, 0.0).rs
    e = cmath.exp(2j * (2 * math.pi / 500.0) * 1.33 * 300.0)
    whole = films.coefficients(SOAP, 1.0, 1.0, 0.0, 500 * nm).rs
    terms = [r, *((1 - r * r) * -r * e * (r * r * e) ** m for m in range(5))]
    errors = np.abs(np.cumsum(terms) - whole)
    printed = (0.1365, 2.739e-3, 5.493e-5, 1.102e-6, 2.21e-8, 4.43e-10)
    assert errors == pytest.approx(printed, rel=3e-3)  # three digits


def test_magnesium_fluoride_on_glass():
    coat = Film([(1.38, 550 * nm / 1.38 / 4)])
    assert straight(coat, 550 * nm, 1.52) == pytest.approx(0.012600790, abs=PRINTED)


def test_quarter_wave_mirror():
    mirror = films.quarter_wave_stack(2.3, 1.38, 4, 550 * nm)
    assert straight(mirror, 550 * nm, 1.52) == pytest.approx(0.980880520, abs=PRINTED)


def test_band_of_a_quarter_wave_mirror():
    """Born and Wolf 1.6: of many pairs, the band is 4/pi asin((nH - nL) / (nH + nL)) wide."""
    half = 0.5 * 0.3217
    mirror = films.quarter_wave_stack(2.3, 1.38, 400, 550 * nm)
    inside, outside = (550 * nm / (1 + half * part * np.array([-1, 1])) for part in (0.995, 1.02))
    assert (straight(mirror, inside, 1.52) > 1 - 1e-9).all()
    assert (straight(mirror, outside, 1.52) < 0.99).all()


def test_morpho():
    film = morpho(1.56)
    table = {
        400: 0.346474395, 450: 0.991849188, 480: 0.995960163, 500: 0.995226734, 550: 0.959970429,
        600: 0.107315786,
    }  # fmt: skip
    wave = np.array(list(table)) * nm
    assert straight(film, wave) == pytest.approx(list(table.values()), abs=PRINTED)
    s, p = films.reflectance(film, 1.0, 1.0, 30 * degree, 500 * nm)
    assert (s, p) == (pytest.approx(0.991147120, abs=PRINTED), pytest.approx(0.702550674, abs=PRINTED))


def test_peak_of_morpho():
    wave = np.arange(350.0, 650.0)  # whole nanometres, as the width is given
    bright = straight(morpho(1.56), wave * nm)
    assert bright.max() == pytest.approx(0.995970, abs=0.6e-6)
    assert wave[bright.argmax()] == 482.0
    half = wave[bright > 0.5 * bright.max()]
    assert half.max() - half.min() == 163.0


def test_morpho_with_pigment():
    table = {450: 0.829277822, 480: 0.793661144, 500: 0.752623321, 550: 0.533144490}
    wave = np.array(list(table)) * nm
    assert straight(morpho(1.56 + 0.06j), wave) == pytest.approx(list(table.values()), abs=PRINTED)


def test_morpho_of_measured_chitin():
    table = {450: 0.991869468, 480: 0.995750561, 500: 0.994695328}
    wave = np.array(list(table)) * nm
    assert straight(morpho("chitin"), wave) == pytest.approx(list(table.values()), abs=PRINTED)


def test_beside_tmm():
    """Random stacks, half of them absorbing, some in total reflection."""
    random = np.random.default_rng(4)
    for case in range(60):
        count = random.integers(0, 9)
        n = random.uniform(1.0, 3.0, count) + 1j * random.uniform(0.0, 0.5, count) * (case % 2)
        d = random.uniform(5.0, 400.0, count)
        first, last = random.uniform(1.0, 2.0), random.uniform(1.0, 2.0) + (3.0j if case % 5 == 0 else 0.0)
        angle, wavelength = random.uniform(0.0, 1.5), random.uniform(300.0, 900.0)
        film = Film([(complex(index), thick * nm) for index, thick in zip(n, d, strict=True)])
        got = films.coefficients(film, first, last, angle, wavelength * nm)
        power = films.transmittance(film, first, last, angle, wavelength * nm)
        for part, name in enumerate("sp"):
            rival = tmm.coh_tmm(name, [first, *n, last], [np.inf, *d, np.inf], angle, wavelength)
            assert got[part] == pytest.approx(rival["r"], abs=RIVAL)
            assert got[2 + part] == pytest.approx(rival["t"], abs=RIVAL * max(1.0, abs(rival["t"])))
            assert power[part] == pytest.approx(rival["T"], abs=RIVAL)


layers = st.lists(st.tuples(st.floats(1.0, 4.0), st.floats(0.0, 2000.0)), max_size=12)


@given(
    layers=layers, first=st.floats(1.0, 4.0), last=st.floats(1.0, 4.0),
    angle=st.floats(0.0, 89.9).map(math.radians),
)  # fmt: skip
@settings(max_examples=200)
def test_power_adds_up_in_lossless_stacks(layers, first, last, angle):
    film = Film([(n, d * nm) for n, d in layers])
    r = films.reflectance(film, first, last, angle, 550 * nm)
    t = films.transmittance(film, first, last, angle, 550 * nm)
    for part in (0, 1):
        assert r[part] + t[part] == pytest.approx(1.0, abs=1e-12)


@given(
    layers=layers, kappa=st.floats(0.0, 0.3), first=st.floats(1.0, 4.0), last=st.floats(1.0, 4.0),
    part=st.floats(0.0, 0.99),
)  # fmt: skip
@settings(max_examples=100)
def test_as_much_gets_through_from_behind(layers, kappa, first, last, part):
    """Reciprocity: the transmittance is the same either way, whatever the layers absorb."""
    sine = part * min(first, last)
    film = Film([(n + 1j * kappa, d * nm) for n, d in layers])
    there = films.transmittance(film, first, last, math.asin(sine / first), 550 * nm)
    back = films.transmittance(film.reversed(), last, first, math.asin(sine / last), 550 * nm)
    assert there == pytest.approx(back, rel=1e-11, abs=1e-300)


def test_light_sent_back_meets_the_incident_wave():
    """Time reversal of a lossless film: r12* t12 + t12* r21 = 0 with t carried as power."""
    film = Film([(2.3, 70 * nm), (1.38, 110 * nm), (1.8, 40 * nm)])
    sine2 = complex(0.6**2)
    n, d = film.indices(550 * nm), film.thickness
    q1, q2 = (cmath.sqrt(n * n - sine2) for n in (1.0, 1.52))
    there = stack_amplitudes(q1, 1 + 0j, n, d, 1.52 + 0j, 2 * math.pi / (550 * nm))
    back = stack_amplitudes(q2, 1.52 + 0j, n[::-1].copy(), d[::-1].copy(), 1 + 0j, 2 * math.pi / (550 * nm))
    for part in (0, 1):
        r, t, behind = there[part], there[2 + part], back[part]
        assert abs(r.conjugate() * t + t.conjugate() * behind) < 20 * EPS


def test_a_layer_at_its_critical_angle():
    """There kz = 0 and the layer's waves are straight lines: the limit from either side."""
    film = Film([(1.5, 80 * nm)])
    n, d, k0 = film.indices(550 * nm), film.thickness, 2 * math.pi / (550 * nm)
    at, below, above = (
        np.array(stack_amplitudes(complex(2.25 * (1 + shift)), 2 + 0j, n, d, 1.8 + 0j, k0))
        for shift in (0.0, -1e-6, 1e-6)
    )
    assert np.isfinite(at).all()
    # amplitudes are smooth in kz^2: the mean is off by the shift squared
    assert np.abs(0.5 * (below + above) - at).max() < 1e-11


def test_tunnelling_dies_out_without_overflow():
    """Frustrated total reflection: t falls as exp(-k0 |kz| d), and r becomes that of the bare face."""
    wave, angle = 550 * nm, 60 * degree
    decay = 2 * math.pi / wave * math.sqrt(1.5**2 * math.sin(angle) ** 2 - 1.0)
    gaps = np.array([2e-6, 3e-6])
    one, other = (films.coefficients(Film([(1.0, gap)]), 1.5, 1.5, angle, wave) for gap in gaps)
    # the waves that come back from behind are smaller by exp(-2 decay gap)
    left = math.exp(-2 * decay * gaps[0])
    assert other.ts / one.ts == pytest.approx(math.exp(-decay * 1e-6), rel=10 * left)
    thick, bare = (
        films.coefficients(film, 1.5, 1.5 if film else 1.0, angle, wave)
        for film in (Film([(1.0, 1.0)] * 3), None)
    )
    assert thick.rs == pytest.approx(bare.rs, rel=8 * EPS)
    assert thick.rp == pytest.approx(bare.rp, rel=8 * EPS)
    assert thick.ts == thick.tp == 0.0


def test_a_thick_absorber_hides_what_is_behind():
    melanin = materials.MELANIN
    thick = films.coefficients(Film([(melanin, 1e-2), (2.0, 1e-7)]), 1.0, 1.5, 0.5, 500 * nm)
    bare = films.coefficients(None, 1.0, melanin, 0.5, 500 * nm)
    assert thick.rs == pytest.approx(bare.rs, rel=8 * EPS)
    assert thick.rp == pytest.approx(bare.rp, rel=8 * EPS)


def test_thousands_of_layers_do_not_overflow():
    got = films.coefficients(films.quarter_wave_stack(4.0, 1.0, 2000, 550 * nm), 1.0, 1.5, 0.0, 550 * nm)
    assert abs(got.rs) == pytest.approx(1.0, rel=1e-12)
    assert got.ts == 0.0


def exact_stack(indices, thickness, grazing, wavelength):
    """R and T of s and of p light from products of interface matrices in 60 digits, grazing angles too."""
    with mpmath.workdps(60):
        n = [mpmath.mpc(index) for index in indices]
        along, up = n[0] * mpmath.cos(grazing), n[0] * mpmath.sin(grazing)
        kz = [up, *(mpmath.sqrt(m * m - along**2) for m in n[1:])]
        found = []
        for p in (False, True):
            whole = mpmath.eye(2)
            for j, (a, b) in enumerate(pairwise(range(len(n)))):
                one, other = (n[b] ** 2 * kz[a], n[a] ** 2 * kz[b]) if p else (kz[a], kz[b])
                r, t = (one - other) / (one + other), 2 * (n[b] / n[a] * one if p else one) / (one + other)
                t = 2 * n[a] * n[b] * kz[a] / (one + other) if p else t
                whole *= mpmath.matrix([[1, r], [r, 1]]) / t
                if j < len(thickness):
                    turn = mpmath.exp(2j * mpmath.pi * kz[b] * thickness[j] / mpmath.mpf(wavelength))
                    whole *= mpmath.matrix([[1 / turn, 0], [0, turn]])
            flow = [(n[k] * mpmath.conj(kz[k] / n[k])).real if p else kz[k].real for k in (0, -1)]
            r, t = whole[1, 0] / whole[0, 0], 1 / whole[0, 0]
            found.append((float(abs(r) ** 2), float(flow[1] / flow[0] * abs(t) ** 2)))
    return found


@pytest.mark.parametrize("grazing", [1.0, 1e-3, 2.0**-20, 2.0**-40])
@pytest.mark.parametrize(
    ("indices", "thickness"),
    [
        ((1.0, 1.5), ()),
        ((1.5, 1.0), ()),
        ((1.0, 2.3, 1.38, 1.0), (60 * nm, 90 * nm)),
        ((1.0, 0.05 + 3.0j, 1.5), (20 * nm,)),
        ((1.33, 0.2 + 3.4j), ()),
    ],
)
def test_grazing_incidence_keeps_its_digits(indices, thickness, grazing):
    # the angle is what its float is: 90 degrees less `grazing`, and what pi/2 is rounded by
    angle = 0.5 * math.pi - grazing
    with mpmath.workdps(60):
        exact = exact_stack(indices, thickness, mpmath.pi / 2 - mpmath.mpf(angle), 500 * nm)
    film = Film(list(zip(indices[1:-1], thickness, strict=True))) if thickness else None
    light = film, indices[0], indices[-1], angle, 500 * nm
    got = zip(films.reflectance(*light), films.transmittance(*light), strict=True)
    for (reflected, passed), (r, t) in zip(got, exact, strict=True):
        assert reflected == pytest.approx(r, rel=GRAZING)
        assert passed == pytest.approx(t, rel=GRAZING)


@pytest.mark.parametrize("last", [1.5, 1.0 + 1e-12, 0.7, 0.2 + 3.4j])
@pytest.mark.parametrize("film", [None, Film([(2.3, 60 * nm), (0.05 + 3.0j, 20 * nm)])])
def test_at_a_right_angle_all_light_comes_back(last, film):
    light = film, 1.0, last, 0.5 * math.pi, 500 * nm
    assert films.transmittance(*light) == (0.0, 0.0)
    assert films.reflectance(*light) == (1.0, 1.0)
    stacked = effective_medium.stack_powers([0.0], [1.0], 1.0, last, 500 * nm, 0.5 * math.pi, "p")
    assert (stacked.reflectance, stacked.transmittance) == (1.0, 0.0)


@pytest.mark.parametrize("film", [None, Film([(1.33, 100 * nm), (1.33, 1 * nm)])])
def test_light_along_a_face_that_is_none_goes_on(film):
    for angle in (0.0, 1.0, 0.5 * math.pi):
        light = film, 1.33, 1.33, angle, 500 * nm
        assert films.transmittance(*light) == pytest.approx((1.0, 1.0), rel=GRAZING)
        assert films.reflectance(*light) == pytest.approx((0.0, 0.0), abs=GRAZING**2)
