"""Curved mirrors with edges against closed forms: rims, shadows, steps, Newton's rings."""

import math
from dataclasses import replace

import numpy as np
import pytest
from converging import COVERAGE, HENE, SIDE, F, between, landing, paraboloid, rms, scanned, seen

import fringetrace as ft
from fringetrace import instruments, mm
from fringetrace.geometry import forms, shapes


@pytest.mark.slow
@pytest.mark.parametrize("count", [8, 12, 24])
def test_a_ball_casts_a_round_shadow_on_a_paraboloid(count):
    """Cells of 17, 11 and 6 pixels: the error is that of the edge, whatever the rays."""
    radius, centre = 1 * mm, np.array([0.1, 0.05]) * mm
    place = (*centre, 25 * mm)
    ball = ft.Surface(
        shapes.icosphere(radius, 3).moved(place), ft.Absorber(), "ball", form=forms.Sphere(place, radius)
    )
    angle = np.linspace(0, 2 * math.pi, 100_001)[:-1]
    curve = landing(centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))

    def ranges(y):
        left, right = between(y, curve)
        beyond = np.full_like(y, SIDE)
        yield -beyond, np.where(np.isnan(left), beyond, left)
        yield np.where(np.isnan(right), beyond, right), beyond

    image = ft.irradiance(seen([paraboloid(), ball], count, 96), HENE)
    assert rms(image, scanned(96, ranges)) < COVERAGE


def disc(sides, rings=8, radius=2 * mm):
    """A paraboloid with a round rim, that of a polygon."""
    angle = 2 * math.pi * np.arange(sides) / sides
    r = np.linspace(0, radius, rings + 1)[1:, None]
    x, y = (r * np.cos(angle)).ravel(), (r * np.sin(angle)).ravel()
    vertices = np.vstack([(0, 0, 0), np.stack([x, y, (x * x + y * y) / (4 * F)], axis=1)])
    here = np.arange(sides)
    on = (here + 1) % sides
    faces = [np.stack([0 * here, 1 + here, 1 + on], axis=1)]
    for ring in range(rings - 1):
        a, b = 1 + ring * sides, 1 + (ring + 1) * sides
        faces += [
            np.stack([a + here, b + here, b + on], axis=1),
            np.stack([a + here, b + on, a + on], axis=1),
        ]
    mesh = ft.Mesh(vertices, np.concatenate(faces))
    return ft.Surface(mesh, ft.Mirror(), "mirror", form=forms.Conic((0, 0, 0), (0, 0, 1), 2 * F, conic=-1.0))


def test_a_round_mirror_sends_on_what_falls_on_it():
    sides = 64
    paths = seen([disc(sides)], 16, 96)
    image = ft.irradiance(paths, HENE)
    area = 0.5 * sides * math.sin(2 * math.pi / sides) * (2 * mm) ** 2
    assert image.sum() * paths.ccd.pitch**2 == pytest.approx(area, rel=1e-5)
    rim = np.stack(
        [np.cos(np.arange(sides) * 2 * math.pi / sides), np.sin(np.arange(sides) * 2 * math.pi / sides)], 1
    )
    f = np.linspace(0, 1, 200, endpoint=False)[:, None]
    curve = landing(
        2 * mm * np.concatenate([a + f * (b - a) for a, b in zip(rim, np.roll(rim, -1, axis=0), strict=True)])
    )

    def ranges(y):
        left, right = between(y, curve)
        yield np.where(np.isnan(left), SIDE, left), np.where(np.isnan(right), SIDE, right)

    assert rms(image, scanned(96, ranges)) < COVERAGE


def test_a_half_plane_shadows_part_of_a_curved_mirror():
    edge = 0.3 * mm
    plate = ft.Surface(
        shapes.plate(6 * mm, 9 * mm).moved((3 * mm + edge, 0, 25 * mm)), ft.Absorber(), "plate"
    )
    y = np.linspace(-3 * mm, 3 * mm, 20_001)
    curve = landing(np.stack([np.full_like(y, edge), y], axis=1))

    def ranges(at):
        yield np.full_like(at, -SIDE), np.interp(at, curve[:, 1], curve[:, 0])

    image = ft.irradiance(seen([paraboloid(), plate], 16, 64), HENE)
    assert rms(image, scanned(64, ranges)) < COVERAGE


def test_a_flat_mirror_in_front_of_a_curved_one():
    """Where the flat one's light falls alone, and where the curved one's does; a gap between."""
    edge, up = 1.0 * mm, 2 * mm
    plate = ft.Surface(shapes.plate(6 * mm, 9 * mm).moved((3 * mm + edge, 0, up)), ft.Mirror(), "plate")
    paths = seen([paraboloid(), plate], 16, 64)
    image = ft.irradiance(paths, HENE)
    x = (np.arange(64) - 31.5) * SIDE / 64
    curved = landing(np.array([[edge, 1e-9]]))[0, 0]
    both = [x < curved - SIDE / 32, x > edge + SIDE / 32, (x > curved + SIDE / 32) & (x < edge - SIDE / 32)]
    alone = scanned(64, lambda y: [(np.full_like(y, -SIDE), np.full_like(y, SIDE))], rows=8)
    assert image[:, both[0]] == pytest.approx(alone[:, both[0]], rel=1e-6)
    assert image[:, both[1]] == pytest.approx(1.0, rel=1e-9)
    # the curved mirror draws its edge in to the axis: a gap between them
    assert both[2].sum() > 0
    middle = slice(16, 48)
    assert (image[middle][:, both[2]] == 0.0).all()


def test_a_sphere_in_a_michelson_makes_rings():
    """The reference mirror tilted, a sphere of 0.5 m as the sample, seen at z = 0: rays in closed form."""
    radius, width, pixels = 500 * mm, 3 * mm, 64
    along = (np.arange(41) - 20) * 0.2 * mm
    height = np.sqrt(radius**2 - along**2 - along[:, None] ** 2) - radius
    mesh = shapes.height_map(height, 0.2 * mm)
    sample = ft.Surface(mesh, ft.Mirror(), "sample", form=forms.Sphere((0, 0, -radius), radius))
    tilt = 0.5e-3
    bench = instruments.michelson(sample, aperture=width, pixels=(pixels, pixels), reference_tilt=(tilt, 0))
    wide = replace(bench.beam, size=(1.2 * width, 1.2 * width), shape=(12, 12))
    image = ft.irradiance(ft.trace(bench.scene, wide, bench.ccd), HENE)
    # a ray at r meets z = sqrt(R^2 - r^2) - R at sin t = r / R, and is carried back to the plane z = 0
    r = np.linspace(1e-9, 2.5 * mm, 20_001)
    angle = np.arcsin(r / radius)
    sag = radius * np.cos(angle) - radius
    place = r - sag * np.tan(2 * angle)
    path = -sag - sag / np.cos(2 * angle)
    spread = np.sqrt(r / place * np.gradient(r, place))
    nodes, weights = np.polynomial.legendre.leggauss(6)
    x = ((np.arange(pixels)[:, None] + 0.5 + 0.5 * nodes).ravel() - 0.5 * pixels) * width / pixels
    rho = np.hypot(x, x[:, None])
    turn = 2 * math.pi / HENE * (np.interp(rho, place, path) - x * math.sin(2 * tilt))
    squeeze = math.sqrt(math.cos(2 * tilt))
    light = np.abs(0.5 * np.interp(rho, place, spread) * np.exp(1j * turn) + 0.5 * squeeze) ** 2
    light = light.reshape(pixels, 6, pixels, 6)
    expected = np.einsum("iajb,a,b->ij", light, weights / 2, weights / 2)
    assert np.ptp(expected) > 0.9
    # a piston of 1e-6 of a fringe, from the arms; 2e-5 from reading the table
    assert image == pytest.approx(expected, abs=5e-5)


def test_the_error_falls_as_the_fourth_power_where_no_edge_is():
    full = scanned(24, lambda y: [(np.full_like(y, -SIDE), np.full_like(y, SIDE))], rows=64)
    errors = [rms(ft.irradiance(seen([paraboloid()], count, 24), HENE), full) for count in (5, 7, 10, 14)]
    # 2^4 = 16 for each halving
    assert errors[0] / errors[2] > 12
    assert errors[1] / errors[3] > 12
    assert errors[3] < 1e-8


def test_a_ball_in_a_beam_scatters_as_it_should():
    """Seen from as far as it is wide: few rays are off by much there, but by h^4."""
    radius, pixels, side, z = 1 * mm, 32, 2 * mm, 2 * mm
    ball = ft.Surface(shapes.icosphere(radius, 3), ft.Mirror(), "ball", form=forms.Sphere((0, 0, 0), radius))
    ccd = ft.CCD((0, 0, z), (0, 0, -1), (0, 1, 0), side / pixels, (pixels, pixels))
    nodes, weights = np.polynomial.legendre.leggauss(6)
    fine = ((np.arange(pixels)[:, None] + 0.5 + 0.5 * nodes).ravel() - 0.5 * pixels) * ccd.pitch
    rho = np.hypot(fine, fine[:, None])
    angle = rho / (2 * (2 * z - radius))
    for _ in range(8):  # Newton's method, to the ray that meets the point
        sine, cosine = radius * np.sin(angle), radius * np.cos(angle)
        slope = cosine + sine * np.tan(2 * angle) + 2 * (z - cosine) / np.cos(2 * angle) ** 2
        angle -= (sine + (z - cosine) * np.tan(2 * angle) - rho) / slope
    light = (radius * np.sin(angle) * radius * np.cos(angle) / (slope * rho)).reshape(pixels, 6, pixels, 6)
    expected = np.einsum("iajb,a,b->ij", light, weights / 2, weights / 2)
    errors = []
    for count in (24, 48):
        beam = ft.Beam((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), (0.8 * mm, 0.8 * mm), (count, count))
        image = ft.irradiance(ft.trace(ft.Scene([ball]), beam, ccd), HENE)
        errors.append(abs(image / expected - 1).max())
    assert errors[1] < 2e-5
    assert errors[0] / errors[1] > 12
