"""Sheets of arrivals: caustics counted, rims, profiles, what is refused."""

import math
from dataclasses import replace

import arrivals
import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.field import sample_points
from fringetrace.field.wavefront import patches

# Differences of numbers near 1 cancel to a few roundings.
ROUNDING = 1e-12
F = 50 * mm
HENE = 632.8 * nm


def beam(count=17, width=5 * mm, **options):
    return ft.Beam((0, 0, 60 * mm), (0, 0, -1), (0, 1, 0), (width, width), (count, count), **options)


def camera(z, pitch=20e-6, count=16):
    return ft.CCD((0, 0, z), (0, 0, -1), (0, 1, 0), pitch, (count, count))


@pytest.mark.parametrize(
    ("z", "focus", "turns"), [(20 * mm, 0.0, 0), (70 * mm, 0.0, 2), (20 * mm, -5 * mm, 0)]
)
def test_a_point_focus_counts_twice(z, focus, turns):
    paths = arrivals.reflected(beam(), replace(camera(z), focus=focus), arrivals.paraboloid(F))
    (sheet,) = patches.sheets(paths)
    assert (sheet.turns == turns).all()


def test_a_line_focus_counts_once_and_a_relay_takes_it_back():
    lit = ft.Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (2 * mm, 2 * mm), (9, 9))
    far = ft.CCD((0, 0, 10 * mm), (0, 0, 1), (0, 1, 0), 20e-6, (16, 16))
    mirror = arrivals.cylinder(100 * mm)
    for focus, turns in [(0.0, 1), (60 * mm, 0)]:
        (sheet,) = patches.sheets(arrivals.reflected(lit, replace(far, focus=focus), mirror))
        assert (sheet.turns == turns).all()


def test_a_wave_carried_back_through_a_focus_takes_the_caustics_off():
    # a virtual focus 50 mm behind a convex mirror, seen by a relay from beyond it
    virtual = replace(camera(10 * mm), focus=80 * mm)
    paths = arrivals.reflected(beam(), virtual, arrivals.paraboloid(-F))
    (sheet,) = patches.sheets(paths)
    assert (sheet.turns == -2).all()


def test_a_sheet_reaches_to_the_rim_of_its_beam():
    # a plane mirror: 1 where the beam falls, to half a ray's distance beyond the outer rays
    paths = arrivals.reflected(beam(8, 8 * mm), camera(10 * mm, 1 * mm, 10), arrivals.plane(0.0))
    expected = np.pad(np.ones((8, 8)), 1)
    assert ft.irradiance(paths, HENE) == pytest.approx(expected, abs=ROUNDING)


def test_samples_on_the_sides_of_cells_are_met_once():
    # nodes of the grid at the centres and corners of pixels
    for count in (8, 16, 32):
        paths = arrivals.reflected(beam(count, 16 * mm), camera(10 * mm, 1 * mm, 8), arrivals.plane(0.0))
        assert ft.irradiance(paths, HENE) == pytest.approx(np.ones((8, 8)), abs=ROUNDING)


def test_a_profile_is_interpolated():
    profile = ft.Gaussian(2 * mm)
    paths = arrivals.reflected(beam(65, profile=profile), camera(10 * mm, 0.1 * mm), arrivals.plane(0.0))
    x = (np.arange(16) - 7.5) * 0.1 * mm
    nodes, weights = np.polynomial.legendre.leggauss(5)
    line = (np.exp(-2 * (x[:, None] + 0.05 * mm * nodes) ** 2 / (2 * mm) ** 2) * weights / 2).sum(axis=1)
    # (0.04 waists)^4 / 384 times the fourth derivative, 12 / waist^4
    assert ft.irradiance(paths, HENE) == pytest.approx(np.outer(line, line), abs=5e-7)


def test_half_wave_loss_may_be_left_out():
    paths = arrivals.reflected(beam(), camera(10 * mm), arrivals.plane(0.0))
    with_loss = ft.complex_field(paths, HENE, "wavefront")
    without = ft.complex_field(paths, HENE, "wavefront", half_wave_loss=False)
    assert without == pytest.approx(-with_loss, abs=ROUNDING)


def test_parts_of_a_trace_are_one_wavefront():
    paths = arrivals.reflected(beam(), camera(10 * mm), arrivals.paraboloid(F))
    parts = [paths.where(paths.ray < 100), paths.where(paths.ray >= 100)]
    assert (ft.irradiance(parts, HENE) == ft.irradiance(paths, HENE)).all()


def test_what_is_refused():
    paths = arrivals.reflected(beam(), camera(10 * mm), arrivals.plane(0.0))
    with pytest.raises(ValueError, match="paths traced onto a CCD"):
        ft.irradiance(replace(paths, ccd=None), HENE)
    with pytest.raises(ValueError, match="paths of a Beam, got those of Rays"):
        ft.irradiance(replace(paths, source=ft.Rays([(0, 0, 0)], [(0, 0, 1)])), HENE, "wavefront")
    with pytest.raises(ValueError, match="at least one Paths, got none"):
        ft.complex_field([], HENE, "wavefront")
    with pytest.raises(ValueError, match=r"'rays'.*, got 'guess'"):
        ft.complex_field(paths, HENE, "guess")
    with pytest.raises(ValueError, match="wavelength"):
        ft.irradiance(paths, -1.0)


@pytest.mark.parametrize("cycles", [0.0, 0.05, 0.3, 1.0, 3.0, 7.7])
def test_gauss_points_resolve_their_fringes(cycles):
    order = int(sample_points.gauss_order(np.array(cycles)))
    nodes, weights = sample_points.gauss_table(np.array([order]))
    wave = np.exp(2j * math.pi * cycles * nodes[order, :order])
    exact = np.sinc(cycles) * np.exp(1j * math.pi * cycles)
    assert abs(wave @ weights[order, :order] - exact) < 2 * sample_points.ERROR
    assert order < sample_points.MOST
