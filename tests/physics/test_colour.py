"""Colours against the CIE's tables as published, closed forms, and stacks computed by another program."""

import numpy as np
import pytest
import tmm
from scipy import constants

import fringetrace as ft
from fringetrace import nm, um
from fringetrace.optics import films
from fringetrace.scattering import colour, goniometer

W = np.arange(360, 831, 5) * nm
# Half a unit of the last digit printed, and as much again for the last digit of the tables.
PRINTED = 1.05e-6
# Two programs that sum the same numbers.
ROUNDING = 1e-12


@pytest.mark.parametrize(
    ("light", "x", "y"),
    [
        # white points of the CIE's illuminants under the 1931 observer, and of black bodies
        ("D65", 0.312712, 0.329008),
        ("E", 0.33331, 0.33329),
        ("A", 0.447573, 0.407440),
        ("2856 K", 0.447535, 0.407428),
        ("5000 K", 0.345101, 0.351608),
        ("6500 K", 0.313525, 0.323627),
        ("10000 K", 0.280633, 0.288286),
    ],
)
def test_white_points(light, x, y):
    # black bodies: c2 = 1.4388e-2 m K here, 1.438777e-2 there, or 4e-6 in x
    tolerance = {"E": 5.5e-6}.get(light, 4.5e-6 if "K" in light else PRINTED)
    assert colour.chromaticity(colour.white(light)) == pytest.approx([x, y], abs=tolerance)


def test_a_black_body_is_plancks():
    at, kelvin = W, 3210.0
    law = at**-5 / np.expm1(constants.h * constants.c / (at * constants.k * kelvin))
    found = colour.illuminant("3210 K", at)
    assert found / found[40] == pytest.approx(
        law / law[40], rel=1e-5 * 14
    )  # the rounding of c2, c2/(wl T) = 12


def test_equal_energy_is_one_third_each():
    # the CIE scaled its observers to equal sums over 5 nm, and rounded
    for degrees in (2, 10):
        assert colour.chromaticity(colour.white("E", degrees)) == pytest.approx([1 / 3, 1 / 3], abs=1.5e-4)


@pytest.mark.parametrize(
    ("path", "xyz", "rgb"),
    [
        (100, [0.272298, 0.289596, 0.442909], [128, 148, 174]),
        (300, [0.897272, 0.967402, 0.829339], [255, 253, 222]),
        (400, [0.576791, 0.582561, 0.161802], [243, 194, 82]),
        (500, [0.205479, 0.126874, 0.130647], [171, 59, 99]),
        (550, [0.133847, 0.052403, 0.420428], [106, 0, 177]),
        (575, [0.135064, 0.068442, 0.593880], [54, 41, 207]),
        (700, [0.403928, 0.531515, 1.012710], [0, 210, 253]),
        (900, [0.729031, 0.771812, 0.098521], [255, 224, 0]),
        (1000, [0.590361, 0.392255, 0.417523], [255, 118, 169]),
    ],
)
def test_newtons_scale_of_colours(path, xyz, rgb):
    found = colour.xyz(np.sin(np.pi * path * nm / W) ** 2, W)
    assert found == pytest.approx(np.array(xyz), abs=PRINTED)
    assert np.rint(255 * colour.srgb(found)) == pytest.approx(rgb)


def film(thickness, n, below, at):
    """Reflectance in air, straight on."""
    return films.reflectance(films.Film(((n, thickness),)), 1.0, below, 0.0, at).s


@pytest.mark.parametrize(
    ("thickness", "xyz"),
    [
        (100, [0.0704273, 0.0759371, 0.0779159]),
        (200, [0.0121229, 0.0051984, 0.0245141]),
        (300, [0.0515959, 0.0674916, 0.0417282]),
        (500, [0.0314570, 0.0552384, 0.0175920]),
    ],
)
def test_a_soap_film(thickness, xyz):
    found = colour.xyz(film(thickness * nm, 1.33, 1.0, W), W)
    assert found == pytest.approx(np.array(xyz), abs=0.1 * PRINTED)


def mirrored(surface, at, theta=0.0):
    """Of a flat sample the power that the goniometer sees where a mirror sends it, unpolarised."""
    looks = goniometer.Cones([-theta], 0.01)
    table = goniometer.brdf(
        ft.Scene([surface]), theta, looks, at, method="power", rays=(1, 1), polarisation="unpolarised"
    )
    return table.values.ravel() * looks.projected.item()


def test_a_soap_film_under_the_goniometer():
    """From a traced face with a film on it to a colour."""
    soap = ft.Dielectric(film=films.Film(((1.33, 300 * nm),)))
    found = colour.xyz(mirrored(ft.Surface(ft.shapes.plate(um, um), soap, back=1.0), W), W)
    assert found == pytest.approx(np.array([0.0515959, 0.0674916, 0.0417282]), abs=0.1 * PRINTED)


def test_a_black_film_is_black_and_a_thick_one_white():
    assert colour.xyz(film(5 * nm, 1.33, 1.0, W), W)[1] < 1e-3
    at = colour.resolving_wavelengths(2 * 1.33 * 40 * um)
    thick = colour.xyz(film(40 * um, 1.33, 1.0, at), at)
    # fringes within every band of the eye: Airy's mean, 2 R / (1 + R) of one face, has no colour
    face = (0.33 / 2.33) ** 2
    assert thick == pytest.approx(2 * face / (1 + face) * colour.white(), rel=0.01)


def test_oil_on_water_repeats_with_thickness_for_one_colour():
    # 2 n d = wavelength: one wavelength, so the same reflectance as no film at all
    sodium = 589.3 * nm
    assert film(sodium / (2 * 1.47), 1.47, 1.33, sodium) == pytest.approx(film(0.0, 1.47, 1.33, sodium))
    bare = colour.xyz(film(0.0, 1.47, 1.33, W), W)
    assert bare == pytest.approx((0.33 / 2.33) ** 2 * colour.white(), rel=1e-6)  # 4e-7: E tables


def morpho(angle):
    """Spectra of 8 chitin plates (65 nm) in air (140 nm), unpolarised, from tmm."""
    n, d = [1.0, *[1.56, 1.0] * 7, 1.56, 1.0], [np.inf, *[65.0, 140.0] * 7, 65.0, np.inf]
    both = [[tmm.coh_tmm(pol, n, d, angle, at / nm)["R"] for at in W] for pol in "sp"]
    return np.mean(both, axis=0)


def test_a_morpho_stack_turns_bluer_with_the_angle():
    straight, inclined = (morpho(np.radians(angle)) for angle in (0, 40))
    assert W[straight.argmax()] == pytest.approx(482.8 * nm, abs=5 * nm)  # 2 (n d + d'), on 5 nm
    turned = colour.lab(colour.xyz([straight, inclined], W))
    hue = np.degrees(np.arctan2(turned[:, 2], turned[:, 1])) % 360
    assert hue[0] < hue[1] < 320  # from cyan (200) over blue (280)
    assert 160 < hue[0] < 260


def test_a_morpho_stack_under_the_goniometer():
    """Traced and by the formula of stacks, beside tmm: of a scale its colour too."""
    scale = films.Film(((1.56, 65 * nm), (1.0, 140 * nm)) * 7 + ((1.56, 65 * nm),))
    inclined = np.radians(40)
    true = morpho(inclined)
    both = films.reflectance(scale, 1.0, 1.0, inclined, W)
    assert 0.5 * (both.s + both.p) == pytest.approx(true, rel=1e-9)
    plate = ft.Surface(ft.shapes.plate(um, um), ft.Dielectric(film=scale), back=1.0)
    found = mirrored(plate, W, inclined)
    assert found == pytest.approx(true, rel=1e-9)
    assert colour.xyz(found, W) == pytest.approx(colour.xyz(true, W), rel=1e-9)


def test_a_grating_shows_the_spectrum_in_order():
    """A CD under white light: sin o = m wavelength / pitch - sin i, at each angle one of the first order."""
    pitch, lit = 1.6 * um, np.radians(30)
    at = np.array([450, 550, 650]) * nm
    disc = ft.gratings.Grating((1, 0, 0), pitch, orders=(0, 1, 2), reflects=True)
    scene = ft.Scene([ft.Surface(ft.shapes.plate(20 * um, 20 * um), disc)])
    looks = goniometer.Cones(np.arcsin(at / pitch - np.sin(lit)), 1e-3)
    table = goniometer.brdf(scene, lit, looks, at, method="power", rays=(2, 2))
    seen = table.values[0, 0, :, 0] * looks.projected
    assert seen == pytest.approx(np.eye(3) / 3, abs=1e-9)  # three orders share the light
    xy = colour.chromaticity(seen @ colour.observer(2, at))
    # the spectrum locus of CIE 1931
    assert xy == pytest.approx(np.array([[0.1566, 0.0177], [0.3016, 0.6923], [0.7260, 0.2740]]), abs=6e-5)


def test_luminance_of_monochromatic_light():
    # 1 W/(m2 sr) at 555 nm is 683 cd/m2; given as a triangle 2 nm wide on 1 nm samples
    at = np.arange(360, 831) * nm
    radiance = np.zeros(len(at))
    radiance[555 - 360] = 1 / nm
    assert colour.luminance(radiance, at) == pytest.approx(683.0, rel=ROUNDING)
    assert colour.luminance(np.ones((2, len(at))), at).shape == (2,)


def test_of_a_lambertian_brdf_times_pi_the_colour_is_white():
    assert colour.xyz(np.pi * np.full(len(W), 1 / np.pi), W) == pytest.approx(colour.white(), rel=ROUNDING)
