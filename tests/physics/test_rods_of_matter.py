"""Rods and lattices: tables computed with treams and with long multipole series; rays against these."""

import math

import discs
import numpy as np
import pytest
from rods import FEATHERS, feather, keratin, melanin

from fringetrace import nm
from fringetrace.rigorous import validity
from fringetrace.rigorous.cylinder_gratings import reflectance_spectrum
from fringetrace.rigorous.cylinders import Cylinders, amplitude, differential_width, scatter
from fringetrace.rigorous.cylindrical_waves import CONDUCTOR

DIGITS = 6e-9  # eight decimals
TABLE = (
    3e-4  # relative: the table's orders went only so far (its R2 at 480 nm is 2e-4 off its own better value)
)
PAIR = [(0, 0), (13, -4)]
IN = -math.pi / 2


def test_clear_lattice_in_air_and_keratin():
    wavelength = np.array([420, 450, 480, 500, 520]) * nm
    lattice = feather(150, 150, 100, 90, 0, 8, index=1.75, host=1.55)
    for polarisation, expected in (
        ("s", [0.07455966, 0.23992057, 0.28111708, 0.09531645, 0.04261329]),
        ("p", [0.06520142, 0.22631745, 0.22707138, 0.05740897, 0.03670615]),
    ):
        found = reflectance_spectrum(lattice, wavelength, 0.0, polarisation)
        np.testing.assert_allclose(found.reflectance, expected, atol=DIGITS)
        np.testing.assert_allclose(found.reflectance + found.transmittance, 1, rtol=1e-12)


# peak (nm), its reflectance, peak and reflectance of the multilayer, reflectance at 450, 500, 550, 600 nm
TABLES = {
    "R1": (440, 0.3902, 440, 0.4118, 0.37673, 0.01183, 0.02463, 0.02083),
    "R2": (500, 0.3348, 500, 0.3503, 0.10528, 0.33482, 0.00625, 0.00982),
    "R3": (660, 0.1948, 660, 0.2025, 0.08312, 0.07942, 0.11471, 0.10551),
    "R4": (580, 0.3716, 580, 0.3859, 0.04057, 0.06713, 0.27652, 0.34068),
    "R5": (530, 0.2460, 530, 0.2610, 0.03642, 0.20761, 0.22997, 0.10777),
    "R6": (550, 0.3740, 540, 0.3879, 0.03404, 0.21949, 0.37403, 0.21345),
    "blue": (450, 0.2918, 450, 0.2987, 0.29179, 0.01340, 0.01944, 0.02050),
    "green": (480, 0.2769, 480, 0.2829, 0.09551, 0.15512, 0.02123, 0.03311),
    "yellow": (510, 0.1834, 510, 0.1863, 0.07234, 0.16292, 0.07407, 0.01526),
    "brown": (540, 0.1253, 540, 0.1261, 0.07346, 0.08057, 0.11803, 0.02103),
    "study": (490, 0.2100, 490, 0.2162, 0.07585, 0.20185, 0.02059, 0.01995),
}


@pytest.mark.parametrize("name", TABLES)
def test_feathers(name):
    peak, height, flat_peak, flat_height, *rest = TABLES[name]
    lattice = feather(*FEATHERS[name])
    wavelength = np.array([450, 500, 550, 600, peak - 10, peak, peak + 10]) * nm
    found = reflectance_spectrum(lattice, wavelength).reflectance
    np.testing.assert_allclose(found[:4], rest, rtol=TABLE, atol=6e-6)
    assert found[5] == pytest.approx(height, rel=TABLE, abs=6e-5)
    assert found[5] > max(found[4], found[6])
    near = np.array([flat_peak - 10, flat_peak, flat_peak + 10]) * nm
    flat = reflectance_spectrum(lattice, near, method="multilayer").reflectance
    # how thin its layers were is not said
    assert flat[1] == pytest.approx(flat_height, rel=2e-3)
    assert flat[1] > max(flat[0], flat[2])
    assert flat[1] == pytest.approx(height, rel=0.065)


def test_a_blue_green_feather_against_angle():
    lattice, wavelength = feather(*FEATHERS["R2"]), 480 * nm
    found = [
        reflectance_spectrum(lattice, wavelength, math.radians(angle)).reflectance
        for angle in (0, 20, 40, 60)
    ]
    np.testing.assert_allclose(found, [0.232607, 0.307132, 0.170053, 0.033458], rtol=TABLE)
    assert reflectance_spectrum(lattice, wavelength, 0.0, "s").reflectance == pytest.approx(
        0.2004505, abs=1e-7
    )
    assert reflectance_spectrum(lattice, wavelength, 0.0, "p").reflectance == pytest.approx(
        0.264846, abs=1e-6
    )


@pytest.mark.parametrize(
    ("polarisation", "expected"),
    [("s", [302.56, 781.58, 1140.59, 1155.01, 891.15]), ("p", [334.12, 815.46, 1145.88, 1129.74, 852.56])],
)
def test_backscatter_of_twenty_by_four_melanin_rods(polarisation, expected):
    centres = [(i * 150 * nm, j * 150 * nm) for i in range(20) for j in range(4)]
    rods = Cylinders(centres, 65 * nm, melanin, keratin)
    for wavelength, width in zip((450, 475, 500, 525, 550), expected, strict=True):
        found = scatter(rods, wavelength * nm, IN, polarisation, orders=6)
        assert differential_width(found, math.pi / 2)[0, 0] / nm == pytest.approx(width, abs=6e-3)


def test_conducting_rods_in_air_reflect_without_a_band():
    # a mesh of wires is a mirror: 55e3 to 73e3 nm/rad whatever the wavelength
    centres = [(i * 280 * nm, j * 280 * nm) for i in range(20) for j in range(4)]
    rods = Cylinders(centres, 65 * nm, CONDUCTOR)
    found = [
        differential_width(scatter(rods, wavelength * nm, IN, "s", orders=5), math.pi / 2)[0, 0] / nm
        for wavelength in (400, 475, 550)
    ]
    assert 54.5e3 < min(found) < max(found) < 73.5e3


def test_rays_between_two_discs():
    found = {ray.discs: ray for ray in discs.rays(PAIR, 5, IN, math.pi / 3, 4)}
    for sequence, path, spread in (
        ((0,), -9.659258262891, 0.4141104722),
        ((1,), -8.695156647753, 0.4141104722),
        ((0, 1), -1.607015862292, 4.565122879),
        ((1, 0), 1.738174599374, 2.451761383),
        ((0, 1, 0), 4.536115344406, 15.67927453),
        ((1, 0, 1), 4.917873538738, 13.77123123),
        ((0, 1, 0, 1), 7.245220100950, 84.78546654),
        ((1, 0, 1, 0), 9.959834448030, 31.19344062),
    ):
        assert found[sequence].path == pytest.approx(path, abs=2e-12)
        assert found[sequence].spread == pytest.approx(spread, rel=5e-10)


def test_geometric_optics_of_two_discs():
    found = discs.rays(PAIR, 5, IN, math.pi / 3, 25)
    for most, expected in (
        (5, -3.513934 + 9.276179j), (10, -3.648473 + 9.332073j), (25, -3.636302 + 9.327506j),
    ):  # fmt: skip
        some = [ray for ray in found if len(ray.discs) <= most]
        assert abs(discs.amplitude(some, 4 * math.pi) - expected) < 1e-6


@pytest.mark.parametrize(
    # rays against the exact wave as the discs grow, in per cent
    ("direction", "percent"),
    [(60, (0.6, 2.4, 0.6, 0.65)), (90, (0.8, 1.8, 1.4, 0.4))],
)
def test_rays_against_the_exact_wave(direction, percent):
    out = math.radians(direction)
    found = discs.rays(PAIR, 5, IN, out, 25)
    for wavelength, expected in zip((1.0, 0.5, 0.25, 0.125), percent, strict=True):
        exact = amplitude(scatter(Cylinders(PAIR, 5, CONDUCTOR), wavelength, IN), out)[0, 0]
        if (direction, wavelength) == (60, 0.5):
            assert abs(exact - (-3.487641 + 9.148322j)) < 1e-6
        error = abs(discs.amplitude(found, 2 * math.pi / wavelength) / exact - 1)
        assert 100 * error == pytest.approx(expected, abs=0.051)
        assert error < validity(5, wavelength, CONDUCTOR).ray_error


@pytest.mark.parametrize("size", [100.0, 1000.0])
def test_first_correction_to_rays_off_one_disc(size):
    # exact over geometric optics is 1 + 5 i / (16 k a), straight back
    exact = amplitude(scatter(Cylinders([(0, 0)], 1.0, CONDUCTOR), 2 * math.pi / size, IN), -IN)[0, 0]
    rays = discs.amplitude([discs.ray([(0, 0)], 1.0, (0,), IN, -IN)], size)
    # the next term is of order 1 / (k a)^2, about 1/4 of it
    assert abs(exact / rays - 1 - 5j / (16 * size)) < 0.3 / size**2
