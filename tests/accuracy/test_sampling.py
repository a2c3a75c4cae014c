"""Errors by the number of rays and of points a pixel: what makes none, and which pixels stand for all."""

import math
from dataclasses import replace
from itertools import pairwise

import arrivals
import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm, um
from fringetrace.accuracy import sampling

HENE = 632.8 * nm


def plane(count, pixels, angle=0.0, size=1 * mm):
    """A plane wave that leans; `size` of beam and CCD."""
    beam = ft.Beam((0, 0, 0.1), (0, 0, -1), (0, 1, 0), (size, size), (count, count))
    ccd = ft.CCD((0, 0, 1 * um), (0, 0, -1), (0, 1, 0), size / pixels, (pixels, pixels))
    return arrivals.reflected(beam, ccd, arrivals.plane(angle))


def test_rays_are_continued_to_the_centre_of_their_part_of_a_pixel():
    """A plane wave, sampled anywhere: after centring its phase is that of the centres, exactly."""
    ccd = ft.CCD([0, 0, 0], [0, 0, -1], [0, 1, 0], pitch=1 * mm, shape=(4, 5))
    random = np.random.default_rng(7)
    slope = np.array([0.3, -0.2, math.sqrt(1 - 0.13)])
    at = np.column_stack([random.uniform(-2.4, 2.4, 50), random.uniform(-1.9, 1.9, 50), np.full(50, -1)]) * mm
    floor = ft.Scene([ft.Surface(ft.shapes.plate(1 * mm, 1 * mm).moved((1.0, 1.0, 1.0)), ft.Mirror())])
    starts = at - slope * 1e-3 * random.uniform(1, 2, (50, 1))
    paths = ft.trace(floor, ft.Rays(starts, np.tile(slope, (50, 1)), length=starts @ slope), ccd).detected
    assert len(paths) > 30
    for parts in (1, 3):
        moved = sampling.centred(paths, parts)
        cell = (np.floor(paths.pixel * parts) + 0.5) / parts * mm - [2 * mm, 2.5 * mm]
        wave = cell[:, 1] * slope[0] + cell[:, 0] * slope[1]
        np.testing.assert_allclose(moved.length, wave, rtol=0, atol=1e-15)


def test_paths_without_a_ccd_cannot_be_centred():
    with pytest.raises(ValueError, match="centred: expected paths traced onto a CCD"):
        sampling.centred(replace(plane(4, 4), ccd=None))


@pytest.mark.parametrize(("rays", "pixels"), [(16, 16), (25, 25), (48, 16), (32, 16)])
def test_rays_that_fill_the_pixels_cost_nothing(rays, pixels):
    paths = plane(rays, pixels)
    assert sampling.count_error(paths, HENE) < 1e-9
    assert sampling.offset_error(paths, HENE) < 1e-9


@pytest.mark.parametrize("shape", [(1, 9), (9, 1)])
def test_an_image_of_one_row_cannot_be_halved(shape):
    paths = plane(9, 9)
    one = replace(paths, ccd=replace(paths.ccd, shape=shape))
    assert sampling.count_error(one, HENE) == 0.0


def test_rays_stand_for_parts_of_a_pixel():
    """2 x 2 rays a pixel, each with the mean over a quarter of it, are the mean over it."""
    angle, pixels = 3e-3, 16
    for rays in (16, 32, 48):
        paths = plane(rays, pixels, angle).detected
        field = ft.complex_field(sampling.spread_over_pixels(paths, HENE), HENE, "rays")
        cycles = math.sin(2 * angle) / 16 * mm / HENE
        # rays that lean leave the CCD at one rim
        inner = np.abs(field[:, 2:-2])
        np.testing.assert_allclose(inner, abs(np.sinc(cycles)), rtol=1e-6)


@pytest.mark.parametrize("rows", [1, 12, 13, 100])
def test_bands_lie_in_the_image(rows):
    bands = sampling.sample_bands((rows, 5))
    assert len(bands) == (1 if rows <= 12 else 3)
    assert bands[0][0] >= 0
    assert bands[-1][1] <= rows
    assert all(stop - top == min(rows, sampling.ROWS if rows > 12 else rows) for top, stop in bands)
    assert all(one[1] <= other[0] for one, other in pairwise(bands))


def test_parts_of_a_ccd_are_its_bands():
    ccd = ft.CCD((1, 2, 3), (1, 0, 0), (0, 0, 1), 1.0, (100, 5), focus=2.0)
    _, v, _ = ccd.axes
    for part, (top, stop) in zip(
        sampling._parts(ccd), sampling.sample_bands(ccd.shape, sampling.MANY), strict=True
    ):
        assert part.shape == (stop - top, 5)
        assert (part.centre - ccd.centre) @ v + 50 == pytest.approx(0.5 * (top + stop))
        assert part.focus == 2.0


def test_fields_on_bands_are_those_of_the_image():
    paths = plane(16, 20, 0.3e-3)
    image = ft.complex_field(paths, HENE, "wavefront")
    for field, (top, stop) in zip(
        sampling._in_bands(paths, HENE), sampling.sample_bands((20, 20)), strict=True
    ):
        np.testing.assert_allclose(field[0], image[top:stop], rtol=0, atol=1e-9)


def test_grids_that_agree_cost_nothing():
    paths = plane(16, 8)
    assert sampling.sampling_error([paths] * 3, HENE) == 0.0
    dark = replace(paths, amplitude=0.0 * paths.amplitude)
    assert sampling.sampling_error([dark] * 3, HENE) == 0.0


def test_a_grid_that_is_not_the_finest_costs_more():
    grids = [
        arrivals.reflected(
            ft.Beam((0, 0, 30 * mm), (0, 0, -1), (0, 1, 0), (5 * mm, 5 * mm), (n, n)),
            ft.CCD((0, 0, 20 * mm), (0, 0, -1), (0, 1, 0), 50 * um, (8, 8)),
            arrivals.paraboloid(50 * mm),
        )
        for n in (32, 16, 8)
    ]
    fine = sampling.sampling_error(grids, HENE)
    assert sampling.sampling_error(grids, HENE, steps=-1.0) == pytest.approx(16.0 * fine)
    assert sampling.sampling_error(grids, HENE, steps=2.0) == pytest.approx(fine / 256.0)
