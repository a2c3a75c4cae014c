"""Folds of sheets: where their seeds lie, how wide they are, and that only what folds pays."""

import math

import arrivals
import numpy as np
import pytest

import fringetrace as ft
from fringetrace import um
from fringetrace.field import sample_points
from fringetrace.field.wavefront import fold_branches, patches, uniform_airy

R, LAM = 300 * um, 0.06 * um
T = 0.3
EDGE, DEPTH = R * math.sin(T) ** 3, R * math.cos(T) * (1 + 2 * math.sin(T) ** 2) / 2


def folded(mirror, z=DEPTH):
    pitch = 0.5 * um
    beam = ft.Beam((0, 0, 0), (0, 0, 1), (0, -1, 0), (2 * R * math.sin(0.6), 10 * um), (5, 257))
    ccd = ft.CCD((0, 0, z), (0, 0, 1), (0, -1, 0), pitch, (1, 64))
    (sheet,) = patches.sheets(arrivals.reflected(beam, ccd, mirror))
    part = patches.cells(sheet, ccd)
    unit = beam.area / pitch**2
    return uniform_airy.folds(part, LAM, unit)


def test_seeds_lie_on_the_caustic():
    found = folded(arrivals.cylinder(R)).seeds
    assert len(found) > 0
    place = (found[:, fold_branches.X] - 32) * 0.5 * um
    # the rays' interpolation: 2e-6 of a pixel
    assert abs(place) == pytest.approx(np.full(len(place), EDGE), rel=1e-6)
    assert (found[:, fold_branches.NORMAL_X] * place < 0).all()  # lit on the inside


def test_the_airy_width_is_that_of_the_caustics_curvature():
    found = folded(arrivals.cylinder(R)).seeds[:, fold_branches.WIDTH] * 0.5 * um
    curvature, wavenumber = 0.75 * R * math.sin(T), 2 * math.pi / LAM
    expected = (curvature / 2 / wavenumber**2) ** (1 / 3) / math.cos(2 * T)
    # z is proportional to the distance within a width to width / R
    assert found == pytest.approx(np.full(len(found), expected), rel=5e-3)


def test_a_sheet_without_folds_has_no_seeds():
    assert len(folded(arrivals.cylinder(R), z=250 * um).seeds) == 0


def test_the_pixels_beside_a_fold_have_points_for_its_first_fringe():
    sheet = folded(arrivals.cylinder(R))
    points = sample_points.samples(np.ones((1, 64), dtype=np.int64), 0)
    slope = np.tile([np.inf, -np.inf, np.inf, -np.inf], (64, 1))
    uniform_airy.light(sheet, points, slope)
    spans = slope[:, 1] - slope[:, 0]
    width = sheet.seeds[0, fold_branches.WIDTH]
    at = int(np.floor(32 + EDGE / (0.5 * um)))
    # two waves at z = 2: 2 sqrt(2) / width radians a pixel
    assert spans[at] >= 2 * math.sqrt(2) / width * LAM / (2 * math.pi) * (1 - 1e-9)


def test_far_too_long_a_wave_is_left_to_rays():
    # no lit side is an Airy width wide
    sheet = folded(arrivals.cylinder(R))
    found = fold_branches.seeds(
        sheet.coefficients,
        sheet.index,
        sheet.turns,
        sheet.place,
        np.arange(len(sheet.place)),
        2 * math.pi / 1.0,
    )
    assert len(found) == 0
