"""A Mach-Zehnder bench against closed forms (slab, wedge, cylinder, ball), and waves in a cylinder."""

import math
from dataclasses import replace

import numpy as np
import pytest
from imaged import refocused, waves

import fringetrace as ft
from fringetrace import Dielectric, Surface, instruments, mm, nm, um
from fringetrace.geometry import forms
from fringetrace.geometry.shapes import extrude, icosphere, plate

RED = 633 * nm
CELL, WATER = 1.38, 1.335
# A path of some millimetres in float64, after a few dozen roundings.
WAVES = 1e-9
# What rays miss of the waves in a cylinder of 80 wavelengths, radians: the printed figures reach 0.0009.
RAYS = 0.005
NINE = 0.5e-9


def arms(bench, wavelength=RED):
    """Rays by the sample, and the path of the reference at each place of the image (untilted: one number)."""
    seen = bench.trace(wavelength).detected
    visits = seen.visits(bench.arms.reference.surface)
    reference = seen.where(visits == 1).length
    assert np.ptp(reference) / wavelength < WAVES
    return seen.where(visits == 0), float(reference.mean())


def turned(mesh, angle):
    return mesh.moved(turn=ft.vectors.rotation((0, 1, 0), angle))


@pytest.mark.parametrize(
    ("n", "medium", "depth", "degrees", "path", "shift"),
    [
        (CELL, WATER, 5 * um, 0.0, 0.225, 0.0),
        (CELL, WATER, 5 * um, 10.0, 0.228355287066, None),
        (CELL, WATER, 5 * um, 30.0, 0.258410644430, 0.106973453),
        (1.5, 1.0, 1 * mm, 30.0, 548.188158588656, 193.813782152),
    ],
)
def test_a_tilted_slab(n, medium, depth, degrees, path, shift):
    wide = 40 * depth
    slab = turned(plate(wide, wide, depth), math.radians(degrees))
    bench = instruments.mach_zehnder(slab, aperture=4 * depth, index=n, medium=medium, pixels=(4, 4))
    sample, reference = arms(bench)
    np.testing.assert_allclose((sample.length - reference) / um, path, rtol=0, atol=1e-12 + WAVES * RED / um)
    if shift is not None:
        moved = np.abs(sample.pixel[:, 1] - (3.5 - sample.ray % 4)) * depth / um
        np.testing.assert_allclose(moved, shift, rtol=0, atol=NINE + 1e-9 * shift)


def test_the_recorded_phase_is_that_of_the_slab():
    slab = plate(60 * um, 60 * um, 5 * um)
    bench = instruments.mach_zehnder(slab, aperture=20 * um, index=CELL, medium=WATER, pixels=(4, 4))
    # the reference leads
    np.testing.assert_allclose(bench.wrapped(RED), -2.233359706, rtol=0, atol=NINE)
    np.testing.assert_allclose(bench.path_difference(RED), 0.225 * um, rtol=0, atol=WAVES * RED)


def test_a_tilted_reference_makes_a_carrier_in_the_medium():
    slab = plate(60 * um, 60 * um, 5 * um)
    bench = instruments.mach_zehnder(
        slab, aperture=20 * um, index=CELL, medium=WATER, pixels=(4, 16), reference_tilt=(0.03, -0.02)
    )
    seen = bench.trace(RED).detected
    reference = seen.where(seen.visits(bench.arms.reference.surface) == 1)
    angle = math.hypot(0.03, 0.02)
    slope = WATER * math.sin(2 * angle) / angle * np.array([0.03, -0.02])
    at = (reference.pixel[:, ::-1] - [8.0, 2.0]) * bench.ccd.pitch
    assert np.ptp(reference.length - at @ slope) / RED < WAVES
    inner = np.s_[1:-1, 2:-2]
    np.testing.assert_allclose(bench.path_difference(RED)[inner], 0.225 * um, rtol=0, atol=1e-6 * RED)


def test_a_wedge_turns_light_by_its_exact_angle():
    """Normal to the first face, A = 0.05, n = 1.5: asin(n sin A) - A."""
    wide = 1 * mm
    mesh = extrude(
        [(-wide, 0.0), (-wide, 0.3 * mm), (wide, 0.3 * mm + 2 * wide * math.tan(0.05)), (wide, 0.0)],
        wide,
        closed=True,
    )
    sample, _ = arms(instruments.mach_zehnder(mesh, aperture=0.2 * mm, index=1.5, pixels=(4, 4)))
    angle = np.arctan2(np.abs(sample.direction[:, 0]), sample.direction[:, 2])
    np.testing.assert_allclose(angle, 0.025039156767523857, rtol=0, atol=1e-15)


def rod(radius):
    angle = np.linspace(0.0, 2 * np.pi, 361)[:-1]
    mesh = extrude(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1), 4 * radius, closed=True)
    return Surface(
        mesh, Dielectric("transmitted"), "rod", forms.Cylinder((0, 0, 0), (0, 1, 0), radius), back=CELL
    )


@pytest.mark.parametrize("sample", ["rod", "ball"])
@pytest.mark.filterwarnings("ignore:media contradict")
def test_a_refocused_cylinder_and_a_ball(sample):
    """R = 10 um, to the printed digits; across the middle a ball bends light as a cylinder does."""
    radius = 10 * um
    form = forms.Sphere((0, 0, 0), radius)
    ball = Surface(icosphere(radius, 3), Dielectric("transmitted"), "ball", form, back=CELL)
    bench = instruments.mach_zehnder(
        rod(radius) if sample == "rod" else ball, aperture=18 * um, medium=WATER, na=0.8, pixels=(9, 9)
    )
    rays, reference = arms(bench)
    row, column = np.divmod(rays.ray, 9)
    middle = rays.where((row == 4) & (column < 4))  # b = 8, 6, 4, 2 um
    x = (middle.pixel[:, 1] - 4.5) * 2
    table = {8: (8.028711932, 0.553202894), 6: (6.007057021, 0.726259291),
             4: (4.001610969, 0.827379393), 2: (2.000176996, 0.882413003)}  # fmt: skip
    np.testing.assert_allclose(x, [place for place, _ in table.values()], rtol=0, atol=NINE)
    np.testing.assert_allclose(
        (middle.length - reference) / um, [path for _, path in table.values()], rtol=0, atol=NINE
    )
    for height, (place, path) in table.items():
        assert refocused(height, 10.0, CELL, WATER) == (
            pytest.approx(place, abs=NINE),
            pytest.approx(path, abs=NINE),
        )


def test_facets_err_by_their_sag():
    """Both faces of a ball together: (n_s - n_m) 2 sag at its middle, a quarter of it from level to level."""
    radius, errors = 10 * um, []
    for level, sag in ((3, 4.528e-3), (4, 1.138e-3)):
        ball = instruments.mach_zehnder(
            icosphere(radius, level), aperture=8 * um, index=CELL, medium=WATER, pixels=(24, 24)
        )
        rays, reference = arms(ball)
        at = (rays.pixel - 12) * ball.ccd.pitch
        height = np.hypot(*at.T)
        place, path = refocused(np.linspace(0.0, 6 * um, 1001), radius, CELL, WATER)
        off = rays.length - reference - np.interp(height, place, path)
        limit = 2 * (CELL - WATER) * sag * radius
        assert -1.5 * limit < off.min() < -0.5 * limit
        errors.append(math.sqrt(np.mean(off**2)))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize("parallel", [True, False])
def test_rays_are_within_five_milliradians_of_the_waves(parallel):
    """R = 50 um, NA 0.8: up to 0.8 R; without refraction at the faces it would be 0.8 rad."""
    radius = 50 * um
    bench = instruments.mach_zehnder(rod(radius), aperture=90 * um, medium=WATER, na=0.8, pixels=(1, 9))
    rays, reference = arms(bench)
    x = (rays.pixel[:, 1] - 4.5) * bench.ccd.pitch
    assert np.ptp(x) > 1.6 * radius
    wave = waves(x, radius, CELL, WATER, RED, 0.8, parallel)
    phase = 2 * np.pi * (rays.length - reference) / RED
    np.testing.assert_allclose(np.angle(np.exp(1j * phase) / wave), 0.0, atol=RAYS)
    projected = 2 * np.pi * 2 * (CELL - WATER) * np.sqrt(radius**2 - x**2) / RED
    assert np.abs(projected - phase).max() > 100 * RAYS


def test_the_recorded_field_is_that_of_the_waves():
    radius = 50 * um
    bench = instruments.mach_zehnder(
        rod(radius), aperture=110 * um, medium=WATER, na=0.8, pixels=(5, 110), rays=1
    )
    bench = replace(bench, ccd=replace(bench.ccd, pitch=0.2 * um, shape=(1, 401)))
    sample, reference = bench.fields(RED)
    x = (np.arange(401) - 200) * 0.2 * um
    wave = waves(x, radius, CELL, WATER, RED, 0.8)
    ratio = sample[0] / reference[0]
    assert np.abs(np.angle(ratio / wave)).max() < RAYS
    # diffraction at the aperture's edge leaves ripples in the brightness that rays do not have
    np.testing.assert_allclose(np.abs(ratio), np.abs(wave), rtol=0.03)


def test_steep_rays_are_dropped():
    """A ray at b is turned by 2 (i - r); an NA of 0.15 takes those below some 0.9 R."""
    radius, start = 10 * um, {}
    for na in (0.15, 0.8):
        bench = instruments.mach_zehnder(rod(radius), aperture=20 * um, medium=WATER, na=na, pixels=(1, 200))
        start[na] = np.sort(np.abs(arms(bench)[0].ray - 99.5)) * 0.1 * um
    height = start[0.8]
    turn = 2 * (np.arcsin(height / radius) - np.arcsin(WATER * height / (CELL * radius)))
    np.testing.assert_array_equal(start[0.15], height[WATER * np.sin(turn) <= 0.15])
    assert 0.8 * radius < start[0.15].max() < 0.95 * radius < start[0.8].max()


def test_power_adds_up_with_all_reflections():
    slab = Surface(turned(plate(400 * um, 400 * um, 5 * um), 0.2), Dielectric(), "slab", back=1.5)
    bench = instruments.mach_zehnder(slab, aperture=20 * um, pixels=(4, 4))
    assert bench.trace(RED).ledger().error < 1e-12
