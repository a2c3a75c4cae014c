"""The field across caustics on the CCD against Kirchhoff integrals: folds, and on towards a cusp."""

import math
from dataclasses import replace

import arrivals
import numpy as np
import pytest
from scipy.special import hankel1

import fringetrace as ft
from fringetrace import mm, um

R, LAM = 300 * um, 0.06 * um
# Points of a pixel, on [-1/2, 1/2], and weights.
AT, WEIGHT = (v / 2 for v in np.polynomial.legendre.leggauss(4))


def fold(t):
    """Where the caustic x = R sin^3 t, z = R cos t (1 + 2 sin^2 t) / 2 of a cylinder mirror is."""
    return R * math.sin(t) ** 3, R * math.cos(t) * (1 + 2 * math.sin(t) ** 2) / 2


def airy_width(t):
    """(rho / 2 k^2)^(1/3) across the caustic, whose radius of curvature is 3/4 R sin t, along x."""
    return (0.75 * R * math.sin(t) / 2 * (LAM / 2 / math.pi) ** 2) ** (1 / 3) / math.cos(2 * t)


def kirchhoff(x, z, light, points=12001):
    """Field at (x, z) by Green's theorem over the mirror, in two dimensions, lit by light(angle)."""
    angle = np.linspace(-0.62, 0.62, points)
    angle = angle[light(angle) > 1e-12]
    k, found = 2 * math.pi / LAM, []
    source = -np.exp(1j * k * R * np.cos(angle)) * light(angle)
    for at in x:
        dx, dz = at - R * np.sin(angle), z - R * np.cos(angle)
        distance = np.hypot(dx, dz)
        facing = -(dx * np.sin(angle) + dz * np.cos(angle)) / distance
        green, slope = 0.25j * hankel1(0, k * distance), 0.25j * k * hankel1(1, k * distance) * facing
        found.append(np.trapezoid(source * (slope - 1j * k * np.cos(angle) * green), angle) * R)
    return np.array(found)


def expected(x, z, pitch, light):
    """Mean field and mean irradiance of pixels around x."""
    field = kirchhoff((x[:, None] + pitch * AT).ravel(), z, light).reshape(-1, len(AT))
    return field @ WEIGHT, abs(field) ** 2 @ WEIGHT


def image(x, z, pitch, light, rays):
    """The same of the wavefront method, from the paths off the mirror."""
    beam = ft.Beam(
        (0, 0, 0), (0, 0, 1), (0, -1, 0), (2 * R * math.sin(0.62), 10 * um), (5, rays),
        lambda u, v: light(np.arcsin(u / R)),
    )  # fmt: skip
    ccd = ft.CCD((x.mean(), 0, z), (0, 0, 1), (0, -1, 0), pitch, (1, len(x)))
    paths = arrivals.reflected(beam, ccd, arrivals.cylinder(R))
    # the amplitude of the wave, not the root of the flux through a plane aslant
    aslant = replace(paths, amplitude=paths.amplitude / np.sqrt(abs(paths.direction[:, 2])))
    return ft.complex_field(aslant, LAM, "wavefront")[0], ft.irradiance(aslant, LAM)[0]


def one_side(angle):
    """Light on the arc around .3 rad: two rays inside the caustic, none beyond."""
    return np.exp(-(((angle - 0.3) / 0.26) ** 8))


def both_sides(angle):
    """Light on the whole arc, with no rim: three rays inside, one beyond."""
    return np.exp(-((angle / 0.5) ** 8))


@pytest.fixture(scope="module")
def across():
    """From 5 Airy widths in the dark to 20 in the light, in quarters of a width."""
    (edge, z), pitch = fold(0.3), airy_width(0.3) / 4
    x = edge + pitch * (np.arange(-80, 20) + 0.5)
    return x, z, pitch, *expected(x, z, pitch, one_side)


@pytest.mark.slow
@pytest.mark.parametrize(("rays", "off"), [(65, 2e-3), (257, 2e-3)])
def test_the_field_across_a_fold(across, rays, off):
    """Airy's function to .1 % of the peak, dark side included. Rays would be infinite.

    Beyond 12 widths they add as rays, off by up to 5 / 72 of 2/3 12^(3/2): .25 % of them, .16 % of the peak.
    """
    x, z, pitch, field, irradiance = across
    found, bright = image(x, z, pitch, one_side, rays)
    peak = abs(field).max()
    error = abs(found - field) / peak
    assert error.max() < off
    # what 65 rays leave of the path's interpolation; with 257, 2e-5
    assert error[-20:].max() < off * (0.75 if rays == 65 else 0.03)
    assert abs(field[-20:]).max() > 0.4 * peak  # the dark side is not dark at first
    assert abs(bright - irradiance).max() < off * peak**2


@pytest.mark.slow
@pytest.mark.parametrize("wide", [4, 10, 50])
def test_a_pixel_that_holds_a_fold(across, wide):
    """Irradiance averaged over pixels of 1, 2.5 and 12.5 Airy widths, with the fold in or between them."""
    x, z, pitch, _, irradiance = across
    reference = irradiance.reshape(-1, wide).mean(axis=1)
    _, bright = image(x.reshape(-1, wide).mean(axis=1), z, pitch * wide, one_side, 257)
    assert abs(bright - reference).max() < 2e-4 * reference.max()


@pytest.mark.slow
@pytest.mark.parametrize(("t", "off"), [(0.15, 2e-3), (0.1, 6e-3), (0.06, 0.07), (0.045, 0.25)])
def test_towards_a_cusp_two_folds_meet(t, off):
    """A branch that two folds part from others: .2 % of the peak where they are 17 Airy widths apart.

    Those of t = .15, .1, .06, .045 are 17, 6, 1.6, .7 Airy widths apart. Two waves are
    no picture of the third then: Pearcey's function would be.
    """
    edge, z = fold(t)
    pitch = 3.6 * edge / 48
    x = pitch * (np.arange(48) - 23.5)
    field, _ = expected(x, z, pitch, both_sides)
    found, _ = image(x, z, pitch, both_sides, 257)
    assert (abs(found - field) / abs(field).max()).max() < off


@pytest.mark.slow
def test_the_round_caustic_of_a_sphere():
    """It is as round as the pixels let it be, and no sample is left out: whatever the rays' grid."""
    radius, count = 20 * mm, 64
    t = 0.13
    edge, z = (value * radius / R for value in fold(t))
    ccd = ft.CCD((0, 0, z), (0, 0, 1), (0, 1, 0), 2.4 * edge / count, (count, count))
    images = []
    for rays in (80, 128):
        beam = ft.Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (0.34 * radius, 0.34 * radius), (rays, rays))
        images.append(ft.irradiance(arrivals.reflected(beam, ccd, arrivals.sphere(radius)), 10 * LAM))
    at = np.arange(count) - 0.5 * (count - 1)
    ring = np.hypot(at[:, None], at) > 6  # the axis is a caustic too, no fold
    peak = images[1][ring].max()
    for turned in (images[1].T, images[1][::-1], images[1][:, ::-1]):
        assert abs(images[1] - turned)[ring].max() < 1e-7 * peak
    assert abs(images[0] - images[1])[ring].max() < 1e-3 * peak
