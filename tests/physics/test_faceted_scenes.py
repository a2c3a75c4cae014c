"""Scenes of flat facets in full field, by the wavefront method, against closed forms over each pixel."""

import math
from dataclasses import replace

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import instruments, mm, nm, um
from fringetrace.core.vectors import rotation
from fringetrace.field.wavefront import plane_waves, visibility
from fringetrace.geometry import shapes

HENE = 632.8 * nm
# What the quadrature of a pixel may be off.
QUADRATURE = 3e-6
# Edges are found to 2e-10 of a cell, areas of pixels with them.
AREA = 1e-8


# The study's Michelson: a slope, a step up, a flat; two beams; a mirror, passed by at first, as splitter.
# The study's plane is x, z here, in its own units, and so is its wavelength.

WAVE = 0.054
SLOPE, EDGE, LOW, HIGH = 0.01, 0.2, 0.012, 0.1


def wall(*ends):
    return ft.Surface(shapes.extrude(ends, 1.0), ft.Mirror(), f"{ends[0]}")


def michelson(rays, pixels=100, depth=0.5):
    """Paths of the measurement and of the reference beam."""
    splitter = wall((-1.2, 0.8), (1.2, 3.2))
    sample = [wall((-1, 0), (EDGE, LOW)), wall((EDGE, LOW), (EDGE, HIGH)), wall((EDGE, HIGH), (1, HIGH))]
    scene, passes = ft.Scene([*sample, splitter]), (splitter.name,)
    ccd = ft.CCD((3, 0, 2), (-1, 0, 0), (0, 0, 1), 2.02 / pixels, (pixels, 1))
    down = ft.Beam((0, 0, 3.5), (0, 0, -1), (0, 1, 0), (2, depth), (2, rays), passes=passes)
    along = ft.Beam((-1.5, 0, 2), (1, 0, 0), (0, 0, 1), (depth, 2), (rays, 2), passes=passes)
    return [ft.trace(scene, beam, ccd) for beam in (down, along)]


def arm(x, slope, height):
    """Where a ray that starts at x arrives, and its path; height is that of the sample there."""
    c, s = math.cos(2 * math.atan(slope)), math.sin(2 * math.atan(slope))
    back = (x + 2 - height) / (c + s)  # to the splitter, z = x + 2
    across = x - back * s
    on = (3 - across) / c
    return across + 2 - on * s, 3.5 - height + back + on


def expected(pixels=100):
    """Irradiance of each pixel, and its part that only the reference lights."""
    sides = 2 + (np.arange(pixels + 1) - pixels / 2) * 2.02 / pixels
    low, high = sides[:-1], sides[1:]
    reference = np.clip(high, 1, 3) - np.clip(low, 1, 3)
    total, alone = reference.copy(), reference.copy()
    for begin, end, slope, heights in ((-1, EDGE, SLOPE, (0, LOW)), (EDGE, 1, 0.0, (HIGH, HIGH))):
        (z0, path0), (z1, path1) = (arm(x, slope, h) for x, h in zip((begin, end), heights, strict=True))
        squeeze = (end - begin) / (z1 - z0)
        a, b = np.clip(low, z0, z1), np.clip(high, z0, z1)
        total += squeeze * (b - a)
        # fringes only where the reference is too
        a, b = np.clip(a, 1, 3), np.clip(b, 1, 3)
        k, rise = 2 * math.pi / WAVE, (path1 - path0) / (z1 - z0)
        middle = k * (path0 + rise * (0.5 * (a + b) - z0) - 4.5)
        total += (
            2 * math.sqrt(squeeze) * (b - a) * np.sinc(k * rise * (b - a) / (2 * math.pi)) * np.cos(middle)
        )
        alone -= b - a
    return total / (high - low), alone / (high - low)


@pytest.mark.parametrize("rays", [5, 16, 100])
def test_the_study_s_michelson_in_full_field(rays):
    """Its dark band, where the step splits the measurement beam, is the reference alone."""
    image = ft.irradiance(michelson(rays), WAVE, "wavefront")[:, 0]
    bright, alone = expected()
    assert abs(image - bright).max() < QUADRATURE
    assert (alone > 1 - AREA).sum() >= 3
    np.testing.assert_allclose(image[alone > 1 - AREA], 1.0, atol=AREA)
    assert np.ptp(image) > 3.5


def test_the_ray_sum_of_the_study_s_michelson_comes_near():
    bright, _ = expected()
    error = []
    for rays in (100, 1600):
        image = ft.irradiance(michelson(rays, depth=2.02 / 100), WAVE, "rays")[:, 0]
        error.append(np.sqrt(np.mean((image - bright) ** 2)))
    assert error[1] < 0.3 * error[0]
    assert error[1] > 1e3 * QUADRATURE


# A staircase across the pixels


def covered(u):
    """Integral of the part of a unit pixel left of u."""
    return np.where(u < 0, 0.0, np.where(u < 1, 0.5 * u * u, u - 0.5))


def stairs(treads, cells, turn=0.3, width=6 * mm, pixels=30, rise=47 * nm):
    mesh = shapes.staircase(4 * width, 4 * width, treads, rise).moved(turn=rotation((0, 0, 1), turn))
    bench = instruments.michelson(mesh, aperture=width, pixels=(pixels, pixels))
    return replace(bench, beam=replace(bench.beam, shape=(cells, cells)))


@pytest.mark.parametrize(("treads", "cells"), [(8, 7), (15, 12), (31, 9)])
def test_a_staircase_is_seen_in_each_of_its_treads(treads, cells):
    turn, width, pixels, rise = 0.3, 6 * mm, 30, 47 * nm
    image = stairs(treads, cells).interferogram(HENE)
    slope, pitch = -math.tan(turn), width / pixels
    across = np.arange(pixels) - pixels / 2

    def left(k):
        """Part of each pixel below edge k."""
        edge = (k / treads - 0.5) * 4 * width
        at = edge / math.cos(turn) / pitch + slope * across[:, None] - across
        return (covered(at + slope) - covered(at)) / slope

    bright = sum(
        (left(k + 1) - left(k)) * math.cos(2 * math.pi * k * rise / HENE) ** 2 for k in range(treads)
    )
    assert abs(image - bright).max() < AREA


# The study's lattice of rods, which are prisms of 18 sides


def lattice(cells):
    """Its light in full field, from rays so many to a side of the beam."""
    scene = ft.Scene([ft.Surface(shapes.rod_lattice(6, 3, 65 * nm, 280 * nm, 2 * um), ft.Mirror())])
    beam = ft.Beam((0.7 * um, 0, 2 * um), (0.1, 0, -1), (0, 1, 0), (1.2 * um, 0.5 * um), (3, cells))
    ccd = ft.CCD((0.7 * um, 0, 1.8 * um), (0, 0, -1), (0, 1, 0), 0.05 * um, (10, 120))
    return ft.trace(scene, beam, ccd, max_bounces=3)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_a_lattice_of_rods_is_the_same_from_any_number_of_rays():
    """Facets that no ray of the coarse grid meets are what is missing there; the rest is exact."""
    images = [ft.irradiance(lattice(cells), 500 * nm, "wavefront") for cells in (500, 2000)]
    assert np.sqrt(np.mean((images[0] - images[1]) ** 2)) < 1e-4 * images[1].mean()
    assert images[1].max() > 2 * images[1].mean()


# Cost


def pieces(bench):
    """Cells that edges cut."""
    found = plane_waves.plane_waves_of(visibility.survey(bench.trace()))
    return sum((region.kind == 2).sum() for _, region in found)


def test_the_cost_follows_the_length_of_the_edges_not_the_area():
    few, many = (pieces(stairs(8, cells)) for cells in (16, 64))
    # four times finer cells: four times as many along each edge, not sixteen
    assert many / few == pytest.approx(4, rel=0.2)
    # edges in the image: one every 24 / 8 mm, then every 24 / 32
    assert pieces(stairs(32, 64)) / many == pytest.approx(4, rel=0.35)
