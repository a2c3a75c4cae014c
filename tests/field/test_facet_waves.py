"""Plane waves off facets, averaged over pixels: closed forms, and rays that know nothing of polygons."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import fringetrace as ft
from fringetrace import mm, nm, um
from fringetrace.core import rotation
from fringetrace.field import facet_waves
from fringetrace.field.facet_waves import reconstruct_facet_waves
from fringetrace.geometry import shapes

LAMBDA = 633 * nm
WAVENUMBER = 2.0 * np.pi / LAMBDA
PITCH = 50 * um
# Means over pixels are exact for finer fringes, too; `test_checks` asks whether there are warnings.
pytestmark = pytest.mark.filterwarnings("ignore:fringes alias")
# Paths of some 30 mm, each of some ten steps rounded, as phases.
PHASE = 2.0 * np.pi * 10 * 30 * mm * 2.0**-52 / LAMBDA


def camera(shape=(6, 8)):
    return ft.CCD((0, 0, 10 * mm), (0, 0, -1), (0, 1, 0), PITCH, shape, focus=10 * mm)


def light(surfaces, shape=(6, 8), wide=2.0, **more):
    """Light from above, past the camera, that surfaces about z = 0 send back."""
    size = (wide * shape[1] * PITCH, wide * shape[0] * PITCH)
    beam = ft.Beam((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), size, (8 * shape[0], 8 * shape[1]), **more)
    return ft.trace(ft.Scene(surfaces), beam, camera(shape))


def tilted(tilt, offset=(0, 0, 0), **size):
    """A mirror whose normal leans by a tilt towards +x."""
    mesh = shapes.plate(4 * mm, 4 * mm).moved(size.get("corner", (0, 0, 0)))
    return ft.Surface(mesh.moved(offset, rotation((0, 1, 0), tilt)), ft.Mirror(), size.get("name", "mirror"))


def centres(count):
    return (np.arange(count) + 0.5 - 0.5 * count) * PITCH


@pytest.mark.parametrize("tilt", [0.0, 1e-9, 1e-5, 1e-3, 0.02])
def test_the_mean_field_of_a_tilted_mirror_is_a_sinc(tilt):
    field = ft.complex_field(light([tilted(tilt)]), LAMBDA, "facets")
    slope = WAVENUMBER * np.sin(2.0 * tilt)
    # the light falls obliquely on the plane of focus, which the mirror crosses at x = 0
    wave = -np.sqrt(np.cos(2.0 * tilt)) * np.exp(1j * (WAVENUMBER * 5 * mm + slope * centres(8)))
    expected = wave * np.sinc(slope * PITCH / (2.0 * np.pi))
    np.testing.assert_allclose(field, np.broadcast_to(expected, field.shape), atol=PHASE)


def test_two_mirrors_that_lean_together_make_fringes_averaged_over_the_pixel():
    tilt, low = 2e-3, 50 * mm
    left = tilted(tilt, (0, 0, -low), corner=(-2 * mm, 0, 0), name="left")
    right = tilted(-tilt, (0, 0, -low), corner=(2 * mm, 0, 0), name="right")
    paths = light([left, right])
    groups = paths.visits(1)
    mutual = ft.mutual_intensity(paths, LAMBDA, groups, "facets")
    # both send their light across the line that they share, by 0.2 mm: all of the image is lit by both
    slope = WAVENUMBER * np.sin(2.0 * tilt)
    expected = np.cos(2.0 * tilt) * np.exp(2j * slope * centres(8)) * np.sinc(slope * PITCH / np.pi)
    np.testing.assert_allclose(mutual[0, 1], np.broadcast_to(expected, (6, 8)), atol=10.0 * PHASE)
    image = ft.irradiance(paths, LAMBDA, "facets")
    both = 2.0 * np.cos(2.0 * tilt) + 2.0 * expected.real
    np.testing.assert_allclose(image, np.broadcast_to(both, (6, 8)), atol=10.0 * PHASE)


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.1])
def test_an_edge_takes_from_pixels_the_area_that_it_covers(angle):
    turn = rotation((0, 0, 1), angle)
    half = shapes.plate(40 * mm, 40 * mm).moved((20 * mm + 13 * um, 0, 0)).moved(turn=turn)
    image = ft.irradiance(light([ft.Surface(half, ft.Mirror(), "half")]), LAMBDA, "facets")
    fine = 400
    x = (np.arange(8 * fine) + 0.5) / fine - 4.0
    y = (np.arange(6 * fine) + 0.5) / fine - 3.0
    lit = (x * np.cos(angle) + y[:, None] * np.sin(angle)) * PITCH > 13 * um
    expected = lit.reshape(6, fine, 8, fine).mean(axis=(1, 3))
    # of 400 x 400 points a line mistakes some of those that it passes
    assert image == pytest.approx(expected, abs=2.0 / fine)


def forward(paths, wavelength, reference):
    """Cross term of sample and reference, and power of the sample, summed over rays of the sample's arm.

    Each ray stands for an area of the beam, wherever it lands: this knows no footprints. The reference is a
    plane wave, told by one of its rays.
    """
    seen = paths.detected
    rows, columns = seen.ccd.shape
    visits = seen.visits(reference)
    one = np.flatnonzero(visits == 1)[0]
    gradient = seen.direction[one]
    mine = np.flatnonzero(visits == 0)
    way = seen.length[one] + (seen.origin[mine] - seen.origin[one]) @ gradient
    turn = np.exp(2j * np.pi * np.remainder(seen.length[mine] - way, wavelength) / wavelength)
    weight = seen.area / seen.ccd.pitch**2
    pixel = np.floor(seen.pixel[mine]).astype(int)
    cross, power = np.zeros((rows, columns), dtype=complex), np.zeros((rows, columns))
    np.add.at(cross, tuple(pixel.T), weight * seen.amplitude[mine] * np.conj(seen.amplitude[one]) * turn)
    np.add.at(power, tuple(pixel.T), weight * np.abs(seen.amplitude[mine]) ** 2)
    return cross, power


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("height", [0.2 * um, 1 * um, 5 * um])
def test_a_relief_is_that_of_many_rays(height, seed):
    z = height * np.random.default_rng(seed).uniform(-1.0, 0.0, (9, 9))
    z[3:6, 3:6] -= height
    bench = ft.instruments.michelson(
        shapes.height_map(z, 0.5 * mm), aperture=3.5 * mm, reference_tilt=(1e-4, 5e-5), pixels=(16, 16)
    )
    rays = 32  # a pixel, either way
    paths = ft.trace(bench.scene, replace(bench.beam, shape=(16 * rays, 16 * rays)), bench.ccd)
    groups = paths.visits(2)
    mutual = ft.mutual_intensity(paths, LAMBDA, groups, "facets")
    cross, power = forward(paths, LAMBDA, 2)
    # rays by a pixel's side, or an edge of facets, count whole: a quarter of 32 ** -1.5 of a pixel
    assert np.sqrt(np.mean(np.abs(mutual[0, 1] - cross) ** 2)) < 1e-3
    if height < 1 * um:  # footprints hardly overlap
        assert np.sqrt(np.mean((mutual[0, 0].real - power) ** 2)) < 2e-3


@pytest.mark.parametrize("height", [1 * um, 0.05 * mm])
def test_it_agrees_with_the_wavefront_method(height):
    z = height * np.random.default_rng(5).uniform(-1.0, 0.0, (4, 4))
    bench = ft.instruments.michelson(
        shapes.height_map(z, 1 * mm), aperture=2.5 * mm, reference_tilt=(1e-4, 5e-5), pixels=(24, 24),
        profile=ft.Gaussian(2 * mm),
    )  # fmt: skip
    paths = bench.trace()
    groups = paths.visits(2)
    facets, wavefront = (ft.mutual_intensity(paths, LAMBDA, groups, way) for way in ("facets", "wavefront"))
    # the wavefront method knows edges to 1e-4 pixel; the profile is that of the middle of each part here
    assert np.sqrt(np.mean(np.abs(facets - wavefront) ** 2)) < 1e-4


def test_groups_signs_and_spectra():
    paths = light([tilted(1e-4)])
    waves = reconstruct_facet_waves(paths)
    assert reconstruct_facet_waves(paths) is waves
    assert repr(waves).startswith("FacetWaves(")
    plain = waves.complex_field(LAMBDA)
    np.testing.assert_array_equal(waves.complex_field(LAMBDA, half_wave_loss=False), -plain)
    spectrum = ft.Spectrum(np.array([LAMBDA, 1.1 * LAMBDA]), np.array([0.25, 0.75]))
    image = ft.irradiance(paths, spectrum, "facets")
    each = [ft.irradiance(paths, w, "facets") for w in spectrum.wavelengths]
    np.testing.assert_allclose(image, 0.25 * each[0] + 0.75 * each[1])


def test_coherent_beams_add_their_fields():
    one = light([tilted(1e-4)])
    other = replace(one.source, profile=lambda x, y: 0.5 * np.ones_like(x))
    both = [one, ft.trace(one.scene, other, one.ccd)]
    fields = [ft.complex_field(paths, LAMBDA, "facets") for paths in both]
    np.testing.assert_allclose(ft.complex_field(both, LAMBDA, "facets"), sum(fields), atol=1e-12)
    assert fields[1] == pytest.approx(0.5 * fields[0], abs=1e-12)


@pytest.mark.parametrize(
    ("surface", "beam", "why"),
    [
        ({"interface": ft.Dielectric(), "back": 1.5}, {}, "media, elements or polarisation"),
        ({"form": ft.forms.Smooth()}, {}, "the form of mirror"),
        ({}, {"polarisation": (1.0, 0.0)}, "media, elements or polarisation"),
        ({}, {"passes": "mirror"}, "a beam that passes over surfaces"),
    ],
)
def test_what_is_not_for_facets_alone_is_refused(surface, beam, why):
    flat = shapes.plate(4 * mm, 4 * mm)
    made = ft.Surface(**{"mesh": flat, "interface": ft.Mirror(), "name": "mirror", **surface})
    paths = light([made], **beam)
    with pytest.raises(ValueError, match=f"method: expected 'wavefront' or 'rays' with {why}, got 'facets'"):
        ft.irradiance(paths, LAMBDA, "facets")
    with pytest.raises(ValueError, match=f"with {why}, got 'facets'"):
        reconstruct_facet_waves(paths)


def test_no_paths_are_refused():
    with pytest.raises(ValueError, match="reconstruct_facet_waves: expected at least one Paths, got none"):
        reconstruct_facet_waves([])


@pytest.mark.parametrize("subdivided", [0, 2])
def test_no_light_is_lost_within_a_round_hole(subdivided):
    """A ring of many sides on a block: what is lit within it would have more corners than a polygon holds."""
    block, ring = trimesh.creation.box((10, 10, 2)), trimesh.creation.annulus(1.0, 1.8, 2e-4, sections=720)
    block.apply_translation((0, 0, -1))
    ring.apply_translation((2.2, -1.8, 1e-4))
    part = trimesh.util.concatenate([block, ring])
    for _ in range(subdivided):
        part = part.subdivide()
    part.apply_scale(mm)
    beam = ft.Beam((0, 0, 9 * mm), (0, 0, -1), (0, 1, 0), (8 * mm, 8 * mm), (80, 80))
    ccd = ft.CCD((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), 0.1 * mm, (64, 64))
    paths = ft.trace(ft.Scene([ft.Surface(part, ft.Mirror())]), beam, ccd)
    # all facets that are lit send light straight back: where pieces meet, to their roundings, it may be twice
    np.testing.assert_allclose(ft.irradiance(paths, LAMBDA, "facets"), 1.0, rtol=0, atol=1e-6)


def test_light_of_rays_that_no_footprint_reaches_is_counted():
    paths = light([tilted(1e-3)])
    waves = reconstruct_facet_waves(paths)
    assert facet_waves._unlit(paths, waves.footprints, waves.begin, waves.member) == 0.0
    dark = facet_waves._unlit(paths, waves.footprints, 0 * waves.begin, waves.member[:0])
    assert dark == pytest.approx(paths.ledger().detected, rel=1e-12)
