"""From arrivals to the complex field: the ray sum, its weights and its digits."""

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest

import fringetrace as ft
from fringetrace import nm, um
from fringetrace.field.coherent_sum import LONGEST, choose
from fringetrace.field.pixel_quadrature import mutual_products
from fringetrace.geometry import shapes
from fringetrace.tracing.paths import join

# Rays are cut off on purpose, and waves cross at any angle: that there are warnings of it `test_checks` asks.
pytestmark = [
    pytest.mark.filterwarnings("ignore:power is cut off"),
    pytest.mark.filterwarnings("ignore:fringes alias"),
]

# Sums of a few hundred terms of size 1.
ROUNDING = 1e-12
# What is asked of the phase of a path of 1 km.
LONG = 1e-6


def mirror_at(z, interface=None):
    return ft.Surface(shapes.plate(4.0, 4.0).moved((0, 0, z)), interface or ft.Mirror(), f"plate at {z}")


# Somewhere out of the way: a scene has at least one surface.
EMPTY = ft.Scene([mirror_at(-100.0)])


def ccd(pitch=1.0 / 16, shape=(8, 12), **more):
    return ft.CCD((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), pitch, shape, **more)


def scattered(count, seed=1, **more):
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(count, 3)) * [0.2, 0.2, 1.0]
    return ft.Rays(rng.uniform(-0.3, 0.3, (count, 3)) * [1, 1, 0], direction, **more)


@pytest.mark.parametrize("area", [None, 0.25])
def test_the_ray_sum_is_the_sum(area):
    rng = np.random.default_rng(3)
    amplitude = rng.normal(size=2000) + 1j * rng.normal(size=2000)
    rays = scattered(2000, length=rng.uniform(0, 3, 2000), amplitude=amplitude, area=area)
    paths = ft.trace(ft.Scene([mirror_at(-0.5)]), rays, ccd())
    seen = paths.detected
    assert len(seen) > 500
    for wavelength in (633 * nm, 10 * um, 0.3):
        expected = np.zeros((8, 12), dtype=complex)
        turn = np.remainder(seen.length, wavelength) / wavelength
        weight = 1.0 if area is None else area / paths.ccd.pitch**2
        place = np.floor(seen.pixel).astype(int)
        np.add.at(expected, (place[:, 0], place[:, 1]), weight * seen.amplitude * np.exp(2j * np.pi * turn))
        field = ft.complex_field(paths, wavelength)
        assert field.dtype == np.complex128
        np.testing.assert_allclose(field, expected, rtol=0, atol=ROUNDING * abs(expected).max())


@pytest.mark.parametrize("rays_per_pixel", [1, 2, 3])
def test_a_unit_beam_straight_on_the_ccd_gives_1(rays_per_pixel):
    shape = (8 * rays_per_pixel, 12 * rays_per_pixel)
    beam = ft.Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (12 / 16, 8 / 16), shape)
    paths = ft.trace(EMPTY, beam, ccd())
    field = ft.complex_field(paths, 633 * nm)
    np.testing.assert_allclose(np.abs(field) ** 2, 1.0, rtol=ROUNDING)
    # the phase of one metre
    turn = float(mpmath.frac(mpmath.mpf(1) / mpmath.mpf(633 * nm)))
    np.testing.assert_allclose(np.angle(field / np.exp(2j * np.pi * turn)), 0.0, atol=2 * np.pi * 1e-9)
    # the power of the ledger is that on the pixels
    assert paths.ledger().detected == pytest.approx((np.abs(field) ** 2).sum() / 16**2, rel=ROUNDING)


def test_an_oblique_beam_gives_the_square_of_the_cosine():
    # A pixel of side p catches the rays of p^2 cos of the beam's area, all in phase: E = cos,
    # where the phase does not change over the pixel; with N rays across it, slope d a ray:
    # E = cos sin(N d / 2) / (N sin(d / 2)).
    pitch, across = 1.0 / 16, 4
    direction = np.array([math.sqrt(0.75), 0.0, 0.5])  # 60 degrees
    spacing = pitch / 8  # on the CCD twice as far apart: four rays a pixel
    beam = ft.Beam((0, 0, 1) - 2 * direction, direction, (0, 1, 0), (64 * spacing, 64 * spacing), (64, 64))
    paths = ft.trace(ft.Scene([mirror_at(-3.0)]), beam, ccd(shape=(8, 16)))
    assert (paths.fate == ft.Fate.DETECTED).all()
    for wavelength in (1e6, 1.0, 0.3, 0.07):
        slope = 2 * np.pi * 2 * spacing * direction[0] / wavelength
        expected = 0.5 * np.sin(across * slope / 2) / (across * np.sin(slope / 2))
        field = ft.complex_field(paths, wavelength, "rays")
        np.testing.assert_allclose(np.abs(field), abs(expected), rtol=1e-10)
    assert ft.irradiance(paths, 1e6, "rays") == pytest.approx(np.full((8, 16), 0.25), rel=1e-9)
    # the wavefront keeps the power: irradiance cos
    assert ft.irradiance(paths, 633 * nm) == pytest.approx(np.full((8, 16), 0.5), rel=1e-9)


def test_the_half_wave_loss_can_be_left_out():
    # one, two, three mirrors and a splitter: the splitter's phase stays
    splitter = ft.BeamSplitter(0.6j, 0.8)
    scene = ft.Scene([mirror_at(0.0), mirror_at(0.75, splitter)])
    paths = ft.trace(scene, ft.Rays([(0, 0, 0.5)], [(0, 0, -1)]), ccd(shape=(1, 1)), max_bounces=9)
    assert sorted(set(paths.detected.reflections)) == [1, 2, 3, 4]
    for wavelength in (633 * nm, 0.37):
        with_loss, without = 0.0, 0.0
        for k in range(1, 5):
            path = 0.5 + 1.5 * (k - 1) + 0.75 + 0.25
            term = 0.8 * 0.6j ** (k - 1) * np.exp(2j * np.pi * math.fmod(path, wavelength) / wavelength)
            with_loss, without = with_loss + (-1) ** k * term, without + term
        assert ft.complex_field(paths, wavelength)[0, 0] == pytest.approx(with_loss, rel=ROUNDING)
        assert ft.complex_field(paths, wavelength, half_wave_loss=False)[0, 0] == pytest.approx(
            without, rel=ROUNDING
        )


@pytest.mark.parametrize("interface", [ft.Mirror(), ft.BeamSplitter()])
def test_chunks_and_streams_give_the_same_bits(interface):
    scene = ft.Scene([mirror_at(-0.5, interface), mirror_at(-1.5)])
    rays = scattered(1500, area=0.1)
    whole = ft.trace(scene, rays, ccd())
    expected = ft.complex_field(whole, 633 * nm)
    assert (np.abs(expected) > 0).mean() > 0.9
    for chunk in (1, 77, 1000):
        parts = list(ft.stream(scene, rays, ccd(), chunk=chunk, threads=2))
        assert np.array_equal(ft.complex_field(iter(parts), 633 * nm), expected)
        assert np.array_equal(ft.complex_field(join(parts), 633 * nm), expected)
    assert np.array_equal(ft.complex_field(ft.stream(scene, rays, ccd()), 633 * nm), expected)


@pytest.mark.parametrize("wavelength", [633 * nm, 400 * nm, 10.6 * um])
def test_a_path_of_1_km_keeps_its_phase(wavelength):
    lengths = 1000.0 * (1.0 + np.random.default_rng(5).uniform(size=20))
    for length in lengths:
        rays = ft.Rays([(0, 0, 0)], [(0, 0, 1)], length=[length])
        field = ft.complex_field(ft.trace(EMPTY, rays, ccd(shape=(1, 1))), wavelength)[0, 0]
        with mpmath.workdps(40):
            turns = mpmath.frac((mpmath.mpf(length) + 1) / mpmath.mpf(wavelength))
        off = np.angle(field * np.exp(-2j * np.pi * float(turns))) / (2 * np.pi)
        # length + 1 m is rounded to float64: 1.1e-13 m
        assert abs(off) < max(LONG, 1.2e-13 / wavelength)


def test_a_path_of_1_km_between_mirrors_loses_no_more_than_its_sum():
    # 4000 legs of a quarter of a metre: each addition rounds the sum by up to half an eps
    scene, legs = ft.Scene([mirror_at(0.0), mirror_at(0.25)]), 4000
    rays = ft.Rays([(-0.5, 0.0, 0.125)], [(1e-4, 0.0, 1.0)])
    paths = ft.trace(scene, rays, max_bounces=legs)
    with mpmath.workdps(40):
        dx, dz = (mpmath.mpf(float(x)) for x in rays.direction[0, [0, 2]])
        exact = (mpmath.mpf("0.125") + (legs - 1) * mpmath.mpf("0.25")) / dz * mpmath.sqrt(dx**2 + dz**2)
        off = abs(float((mpmath.mpf(paths.length[0]) - exact) / exact))
    assert off < 0.5 * legs * np.finfo(float).eps


def test_other_wavelengths_need_no_other_trace():
    rays = scattered(300, area=0.1)
    paths = ft.trace(ft.Scene([mirror_at(-0.5)]), rays, ccd())
    first = ft.complex_field(paths, 633 * nm)
    assert not np.allclose(ft.complex_field(paths, 532 * nm), first)
    assert np.array_equal(ft.complex_field(paths, 633 * nm), first)


def test_light_that_does_not_reach_the_ccd_leaves_no_trace():
    paths = ft.trace(EMPTY, ft.Rays([(0, 0, 2)], [(0, 0, 1)]), ccd())
    assert not ft.complex_field(paths, 633 * nm).any()


# The method by itself


@pytest.mark.filterwarnings("ignore:media contradict")
def test_the_method_is_chosen_by_what_it_can_do_and_what_it_costs():
    paths = ft.trace(EMPTY, scattered(2), ccd())
    assert choose(paths).method == "rays"
    beam = ft.Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (0.5, 0.5), (40, 40))
    glass = {"interface": ft.Dielectric(follow="reflected"), "back": 1.5}

    def choice(mesh, shape=(40, 40), interface=None, **more):
        scene = ft.Scene([ft.Surface(mesh, interface or ft.Mirror(), **more)])
        return choose(ft.trace(scene, replace(beam, shape=shape), ccd(), max_bounces=1))

    ball = shapes.icosphere(0.4, 3)  # 1280 facets
    # facets alone are exact, however many
    assert choice(shapes.plate(4.0, 4.0)).method == "facets"
    assert choice(ball).method == "facets"
    # beside media it depends on how many rays share one
    assert choice(shapes.plate(4.0, 4.0), **glass).method == "wavefront"
    assert choice(ball, **glass).method == "rays"
    assert choice(ball, shape=(160, 160), **glass).method == "wavefront"
    assert choice(ball, form=ft.forms.Sphere((0, 0, 0), 0.4)).method == "wavefront"
    # coplanar triangles are one facet
    assert choice(shapes.height_map(np.zeros((40, 40)), 0.1), **glass).method == "wavefront"
    # nothing is begun that takes too long
    long = choice(ball, shape=(800, 800), **glass)
    assert long.method == "rays"
    assert str(long) == "rays: wavefronts off 1,280 flat facets take 819 s; about 1 s"
    assert LONGEST < 1280 * 800 * 800 * 1e-6


def test_unknown_methods_are_refused():
    paths = ft.trace(EMPTY, scattered(2), ccd())
    with pytest.raises(ValueError, match=r"method: expected one of .*, got 'waves'"):
        choose(paths, "waves")


# Groups


@pytest.mark.parametrize("method", ["rays", "wavefront"])
def test_mutual_intensity_adds_up_to_the_irradiance(method):
    splitter = ft.BeamSplitter(0.6j, 0.8)
    scene = ft.Scene([mirror_at(0.0), mirror_at(0.75, splitter)])
    beam = ft.Beam((0, 0, 0.5), (0, 0, -1), (0, 1, 0), (12 / 16, 8 / 16), (16, 24))
    paths = ft.trace(scene, beam, ccd(), max_bounces=7)
    bounces = paths.visits(0) - 1
    groups = np.maximum(bounces, 0)
    count = groups.max() + 1
    fields = ft.complex_field(paths, 633 * nm, method, groups=groups)
    mutual = ft.mutual_intensity(paths, 633 * nm, groups, method)
    assert fields.shape == (count, 8, 12)
    assert mutual.shape == (count, count, 8, 12)
    np.testing.assert_allclose(fields.sum(axis=0), ft.complex_field(paths, 633 * nm, method), atol=ROUNDING)
    np.testing.assert_allclose(mutual.sum(axis=(0, 1)), ft.irradiance(paths, 633 * nm, method), atol=1e-9)
    np.testing.assert_allclose(mutual, np.conj(mutual.swapaxes(0, 1)), atol=ROUNDING)
    # plane waves straight on: no fringe to average
    np.testing.assert_allclose(mutual, mutual_products(fields), atol=1e-9)


@pytest.mark.parametrize("groups", [[0], [-1, 0], [0.0, 1.0]])
def test_groups_that_do_not_fit(groups):
    paths = ft.trace(EMPTY, scattered(2), ccd())
    with pytest.raises(ValueError, match="groups: expected 2 whole numbers from 0 on, one a path, got"):
        ft.complex_field(paths, 633 * nm, groups=groups)


# What is refused


@pytest.mark.parametrize("wavelength", [0.0, -633e-9, math.nan, math.inf])
def test_wavelengths_that_are_none(wavelength):
    paths = ft.trace(EMPTY, scattered(2), ccd())
    with pytest.raises(ValueError, match="wavelength: expected a positive length in metres, got"):
        ft.complex_field(paths, wavelength)


def test_a_wavelength_in_text():
    paths = ft.trace(EMPTY, scattered(2), ccd())
    with pytest.raises((TypeError, ValueError), match="wavelength: expected metres, got text '633 nm'"):
        ft.complex_field(paths, "633 nm")


def test_methods_that_are_none():
    paths = ft.trace(EMPTY, scattered(2), ccd())
    with pytest.raises(ValueError, match=r"method: expected one of .*, got 'waves'"):
        ft.complex_field(paths, 633 * nm, method="waves")


def test_a_field_needs_a_ccd():
    paths = ft.trace(EMPTY, scattered(2))
    for given in (paths, [paths], iter([paths])):
        with pytest.raises(
            ValueError, match="field: expected paths traced onto a CCD, got paths without one"
        ):
            ft.complex_field(given, 633 * nm)


def test_a_field_needs_paths():
    with pytest.raises(ValueError, match="field: expected at least one Paths, got none"):
        ft.complex_field([], 633 * nm)
