"""The truths of the standards: against other integrals, mpmath, conservation, and traces of single rays."""

import math

import mpmath
import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm
from fringetrace.validation import standards
from fringetrace.validation.standards import STANDARDS, WAVELENGTH

PIXELS, CELLS = 12, 4
# Paths of up to 4 m in float64, in radians: 4 m * 2^-52 * 2 pi / lambda, and some roundings more.
ROUNDING = 5e-8
K = 2 * math.pi / WAVELENGTH


@pytest.fixture(params=STANDARDS)
def standard(request):
    return STANDARDS[request.param](PIXELS, CELLS)


def test_a_truth_is_a_mean_over_each_pixel(standard):
    field, bright = standard.truth()
    assert field.shape == bright.shape == standard.ccd.shape
    # the mean of |E|^2 is at least that of the mean, by Jensen
    assert (np.abs(field) ** 2 <= bright * (1 + 1e-12)).all()


def single_rays(standard, count=41):
    """Field of single rays at the points where they meet the CCD, and the pixel of each."""
    paths = ft.trace(standard.scene, standard.lit(count), standard.ccd).detected
    return paths, np.floor(paths.pixel).astype(int)


@pytest.mark.parametrize("name", ["paraboloid", "sphere"])
def test_the_field_off_a_curved_mirror_has_the_paths_of_its_rays(name):
    standard = STANDARDS[name](PIXELS, CELLS)
    paths, _ = single_rays(standard)
    u, v, _ = standard.ccd.axes
    offset = paths.origin - standard.ccd.centre
    if name == "paraboloid":
        there = standards.converging(offset @ u, offset @ v, 150 * mm, 60 * mm, 90 * mm)
    else:
        there = standards.diverging(offset @ u, offset @ v, 400 * mm, 80 * mm, 100 * mm)
    off = np.angle(there / (-np.exp(1j * K * np.fmod(paths.length, WAVELENGTH))))
    # the rays' own, hits on forms included
    assert abs(off).max() < 10 * ROUNDING


@pytest.mark.parametrize(("name", "rim"), [("paraboloid", 0.9 * mm), ("sphere", 1.8 * mm)])
def test_a_curved_mirror_gives_back_the_light_that_it_gets(name, rim):
    """Power through a disc of the plane is that of the disc of the beam that comes there."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    rho = 0.5 * rim * (nodes + 1)
    if name == "paraboloid":
        field = standards.converging(rho, 0 * rho, 150 * mm, 60 * mm, 90 * mm)
        r = 2 * 150 * mm * math.tan(0.5 * math.atan2(rim, 90 * mm))
    else:
        field = standards.diverging(rho, 0 * rho, 400 * mm, 80 * mm, 100 * mm)
        r = exact_ray(rim, 0.4, 0.08)
    power = (weights * 0.5 * rim * rho * abs(field) ** 2).sum() * 2 * math.pi
    assert power == pytest.approx(math.pi * float(r) ** 2, rel=1e-11)


def exact_ray(rho, radius, z):
    """Where a ray comes in that a convex sphere sends to rho in the plane z, in 40 digits."""
    with mpmath.workdps(40):

        def there(r):
            angle = mpmath.asin(r / radius)
            return r + (z + radius * (1 - mpmath.cos(angle))) * mpmath.tan(2 * angle) - rho

        return mpmath.findroot(there, rho / (1 + 2 * z / radius))


@pytest.mark.parametrize("rho", [0.1 * mm, 1 * mm, 2.7 * mm])
@pytest.mark.parametrize(("radius", "z"), [(0.4, 0.08), (0.5, 0.0)])
def test_the_path_off_a_sphere_is_that_of_mpmath(rho, radius, z):
    start = 0.1
    with mpmath.workdps(40):
        r = exact_ray(rho, radius, z)
        angle = mpmath.asin(r / radius)
        sag = radius * (1 - mpmath.cos(angle))
        path = start + sag + (z + sag) / mpmath.cos(2 * angle)
        turn = float(mpmath.fmod(path, mpmath.mpf(WAVELENGTH)) / mpmath.mpf(WAVELENGTH))
    field = standards.diverging(np.array(rho), np.array(0.0), radius, z, start)
    assert abs(np.angle(field / -np.exp(2j * math.pi * turn))) < ROUNDING


def test_pixel_means_agree_with_twice_the_points():
    for name in ("paraboloid", "sphere"):
        standard = STANDARDS[name](PIXELS, CELLS)
        ccd = standard.ccd
        wave = {
            "paraboloid": lambda x, y: standards.converging(x, y, 150 * mm, 60 * mm, 90 * mm),
            "sphere": lambda x, y: standards.diverging(x, y, 400 * mm, 80 * mm, 100 * mm),
        }[name]
        # 12 pixels are ten times as large as those of a bench: 16 and 24 points here for its 8
        coarse, fine = (standards.means(wave, ccd, points) for points in (16, 24))
        assert coarse[0] == pytest.approx(fine[0], abs=1e-8)
        assert coarse[1] == pytest.approx(fine[1], rel=1e-12)


def midpoints(function, low, high, count=200_000):
    """Mean of a function over an interval by many midpoints."""
    x = low + (np.arange(count) + 0.5) / count * (high - low)
    return function(x).mean()


def test_the_valley_is_two_plane_waves_within_their_rims():
    standard = STANDARDS["valley"](PIXELS, CELLS)
    field, bright = standard.truth()
    angle, height = 0.2e-3, 2.0
    rim, slope = height * math.tan(2 * angle), math.sin(2 * angle)
    way = 1.5 + height * math.cos(2 * angle)

    def wave(x):
        left = (x < rim) * np.exp(1j * K * slope * x)
        right = (x > -rim) * np.exp(-1j * K * slope * x)
        turn = np.exp(2j * math.pi * math.fmod(way, WAVELENGTH) / WAVELENGTH)
        return -math.sqrt(math.cos(2 * angle)) * turn * (left + right)

    for column in range(PIXELS):
        low, high = ((column + side - PIXELS / 2) * standard.ccd.pitch for side in (0, 1))
        # midpoints err by 1 / 200,000 of a jump
        assert field[0, column] == pytest.approx(midpoints(wave, low, high), abs=1e-5)
        total = midpoints(lambda x: abs(wave(x)) ** 2, low, high)
        assert bright[-1, column] == pytest.approx(total, abs=3e-5)


def test_the_step_mixes_both_sides_by_area():
    standard = STANDARDS["step"](PIXELS, CELLS)
    field, bright = standard.truth()
    pitch, many = standard.ccd.pitch, 400
    x = ((np.arange(PIXELS * many) + 0.5) / many - PIXELS / 2) * pitch
    lower = (x * math.cos(0.3) + x[:, None] * math.sin(0.3) < 0.4 * mm).reshape(PIXELS, many, PIXELS, many)
    part = lower.mean(axis=(1, 3))
    assert 0 < part.min(initial=1, where=part > 0) < part.max(initial=0, where=part < 1) < 1
    lifted = math.cos(K * 50e-9) ** 2
    assert bright == pytest.approx(part + (1 - part) * lifted, abs=2 / many)
    relative = field / field[part == 1][0]
    expected = part + (1 - part) * 0.5 * (1 + np.exp(-2j * K * 50e-9))
    assert relative == pytest.approx(expected, abs=2 / many)


def test_tilt_fringes_have_the_visibility_of_their_pixels():
    standard = STANDARDS["tilt"](64, CELLS)
    field, bright = standard.truth()
    x = (np.arange(64) - 31.5) * standard.ccd.pitch
    turn = K * math.sin(0.04) * x
    basis = np.stack([np.ones(64), np.cos(turn), np.sin(turn)], axis=1)
    mean, *wave = np.linalg.lstsq(basis, bright[0], rcond=None)[0]
    assert math.hypot(*wave) / mean == pytest.approx(0.62952984, abs=1e-7)  # tabulated for 20 mrad and 8 um
    assert (field[0] == field[-1]).all()


def test_a_corner_cube_sends_all_of_a_plane_wave_back():
    standard = STANDARDS["corner_cube"](PIXELS, CELLS)
    _, bright = standard.truth()
    assert bright == pytest.approx(math.cos(0.2e-3), rel=1e-12)
    paths, pixel = single_rays(standard)
    assert (paths.bounces == 3).all()
    assert len(np.unique(pixel, axis=0)) == PIXELS**2  # lit everywhere
    # one path for all: to the plane across the beam through its start
    along, start = standard.beam.direction, standard.beam.centre
    back = paths.length - (paths.origin - start) @ -along
    assert np.ptp(back) < 1e-14
    assert back.mean() == pytest.approx(-2 * start @ along, rel=1e-14)


def test_facets_leave_the_forms_out():
    standard = STANDARDS["sphere"](PIXELS, CELLS)
    assert standard.curved
    assert standard.triangles == 2 * CELLS**2
    assert not standard.faceted().curved
    assert standard.faceted().triangles == 2 * CELLS**2
    assert not STANDARDS["step"](PIXELS, CELLS).curved
