"""Regions of the beam that facets cut out: planes, names, edges, corners, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import Phase, given, settings, strategies as st

import fringetrace as ft
from fringetrace import instruments, mm, nm
from fringetrace.core.vectors import rotation
from fringetrace.field.wavefront import boundary_search, plane_waves, visibility
from fringetrace.geometry import shapes
from fringetrace.optics.gratings import Grating
from fringetrace.scene import facet_groups
from fringetrace.tracing.rays import launch, launch_at

HENE = 632.8 * nm
# What is left of a corner in a cell, 4^-10 of it, in a rectangle of some cells.
CORNER = 2e-6
ROUNDING = 1e-12


def lit(mesh, shape=(12, 12), pixels=40, **options):
    """Paths off a mesh as a mirror, lit straight down, seen straight from above."""
    beam = ft.Beam((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), (3 * mm, 3 * mm), shape, **options)
    ccd = ft.CCD((0, 0, 8 * mm), (0, 0, -1), (0, 1, 0), 4 * mm / pixels, (pixels, pixels))
    return ft.trace(ft.Scene([ft.Surface(mesh, ft.Mirror(), "sample")]), beam, ccd)


def flux(paths):
    return ft.irradiance(paths, HENE).sum() * paths.ccd.pitch**2


def test_triangles_of_one_plane_have_one_number():
    mesh = shapes.staircase(3 * mm, 2 * mm, 3, 70 * nm).moved((1e-3, 0, 2e-3), rotation((1, 2, 3), 0.7))
    (planes,) = facet_groups.group_facets(ft.Scene([ft.Surface(mesh, ft.Mirror())]))
    assert (planes[::2] == planes[1::2]).all()
    assert len(np.unique(planes)) == 5


def test_rays_from_anywhere_are_those_of_the_grid_at_its_centres():
    beam = ft.Beam((1, 2, 3), (0.1, 0.2, -1), (0, 1, 0), (3 * mm, 2 * mm), (4, 6), passes=("sample",))
    rays = launch(beam)
    number = np.arange(24)
    again = launch_at(beam, number % 6 + 0.5, number // 6 + 0.5)
    assert again.origin == pytest.approx(rays.origin, rel=ROUNDING)
    assert (again.direction == rays.direction).all()
    assert again.passes == rays.passes


@settings(max_examples=5, phases=[Phase.explicit, Phase.reuse, Phase.generate], deadline=None)
@given(
    st.floats(0.9, 1.6),
    st.floats(0.9, 1.6),
    st.floats(0, math.pi),
    st.floats(-0.3, 0.3),
    st.floats(-0.3, 0.3),
)
def test_a_rectangle_reflects_what_falls_on_it(width, height, turn, x, y):
    mesh = shapes.plate(width * mm, height * mm).moved((x * mm, y * mm, 0), rotation((0, 0, 1), turn))
    assert flux(lit(mesh)) == pytest.approx(width * height * mm * mm, rel=CORNER)


def test_the_rim_of_the_beam_is_an_edge():
    paths = lit(shapes.plate(9 * mm, 9 * mm), pixels=41)
    image = ft.irradiance(paths, HENE)
    # 3 mm of beam on pixels of 4/41 mm: 15.375 of them either way from the middle
    line = np.pad(np.ones(31), 5)
    line[[4, 36]] = 0.0
    line[5], line[35] = 0.875 - 0.5 + 0.5, 0.875
    x = np.abs(np.arange(41) - 20.0)
    line = np.clip(15.375 + 0.5 - x, 0.0, 1.0)
    assert image == pytest.approx(np.outer(line, line), abs=1e-6)


def test_a_mirror_off_the_camera_brings_nothing():
    mesh = shapes.plate(0.5 * mm, 0.5 * mm).moved(turn=rotation((0, 1, 0), 0.6))
    assert (ft.irradiance(lit(mesh), HENE) == 0.0).all()
    assert (ft.complex_field(lit(mesh), HENE, "wavefront") == 0.0).all()


def test_a_corner_inside_a_cell_is_found_by_quartering():
    mesh = shapes.plate(1.07 * mm, 1.07 * mm).moved((0.4 * mm, 0.4 * mm, 0))
    ((wave, region),) = plane_waves.plane_waves_of(visibility.survey(lit(mesh, (5, 5))))
    assert abs(wave.amplitude) == pytest.approx([1.0], rel=ROUNDING)
    assert (region.pieces[:, 2] - region.pieces[:, 0]).min() == 0.5**boundary_search.DEPTH
    # each quartering of the four corners leaves a few pieces, not all of the edge
    assert len(region.pieces) < 4 * 4 * (boundary_search.DEPTH + 2)


def test_a_straight_edge_costs_one_piece_a_cell():
    step = shapes.step(9 * mm, 9 * mm, 0.1 * mm, 80 * nm).moved(turn=rotation((0, 0, 1), 0.4))
    found = list(plane_waves.plane_waves_of(visibility.survey(lit(step))))
    assert len(found) == 2
    for _, region in found:
        assert (region.pieces[:, 2:4] - region.pieces[:, :2] == 1.0).all()


def test_parts_of_the_paths_bring_their_part_of_the_light():
    bench = instruments.michelson(
        shapes.step(9 * mm, 9 * mm, 0.4 * mm, 80 * nm), aperture=3 * mm, pixels=(8, 9)
    )
    paths = bench.trace().detected
    visits = paths.visits(bench.arms.reference.surface)
    parts = [ft.complex_field(paths.where(visits == n), HENE, "wavefront") for n in (0, 1)]
    assert abs(parts[1]) == pytest.approx(np.full((8, 9), 0.5), abs=1e-9)
    whole = ft.complex_field(paths, HENE, "wavefront")
    assert whole == pytest.approx(parts[0] + parts[1], abs=1e-9)


def test_half_wave_loss_may_be_left_out():
    paths = lit(shapes.plate(9 * mm, 9 * mm))
    with_loss = ft.complex_field(paths, HENE, "wavefront")
    without = ft.complex_field(paths, HENE, "wavefront", half_wave_loss=False)
    assert np.abs(with_loss).max() == pytest.approx(1.0, abs=1e-9)
    assert without == pytest.approx(-with_loss, abs=ROUNDING)


def test_a_gaussian_beam_is_not_interpolated():
    waist = 0.7 * mm
    paths = lit(shapes.plate(9 * mm, 9 * mm), (4, 4), profile=ft.Gaussian(waist))
    edge = np.clip((np.arange(41) / 40 - 0.5) * 4 * mm, -1.5 * mm, 1.5 * mm)
    total = [waist * math.sqrt(math.pi / 8) * math.erf(math.sqrt(2) * x / waist) for x in edge]
    line = np.diff(total) / paths.ccd.pitch
    # two Gauss points on a seventh of a waist: (1/7)^4 / 4320 times the fourth derivative, 48
    assert ft.irradiance(paths, HENE, "wavefront") == pytest.approx(np.outer(line, line), abs=1e-5)
    # five points on each of two halves of a pixel, exact to the third order
    assert ft.irradiance(paths, HENE, "facets") == pytest.approx(np.outer(line, line), abs=2e-5)


def test_what_is_refused():
    paths = lit(shapes.plate(9 * mm, 9 * mm))
    with pytest.raises(ValueError, match="paths traced onto a CCD"):
        ft.irradiance(replace(paths, ccd=None), HENE)
    with pytest.raises(ValueError, match="paths of a Beam, got those of Rays"):
        ft.irradiance(replace(paths, source=ft.Rays([(0, 0, 0)], [(0, 0, 1)])), HENE, "wavefront")


def waves_of(surfaces, collapsed, order, ccd, polarisation=None):
    """Plane waves of all ways of some bounces, as they are and with segments of no length."""
    beam = ft.Beam((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), (1 * mm, 1 * mm), (3, 3), polarisation=polarisation)
    paths = ft.trace(ft.Scene(surfaces, medium=1.0), beam, ccd, record=True, wavelength=HENE)
    ways = np.flatnonzero((paths.bounces == order) & (paths.fate == ft.Fate.DETECTED) & (paths.ray == 4))
    points = paths.points.copy()
    for k in collapsed:
        points[ways, k + 1] = points[ways, k]
    starts = None if paths.departures is None else points[:, :-1].copy()
    touching = replace(paths, points=points, departures=starts)
    assert len(ways)
    return [
        [plane_waves._wave(some, row, np.uint64(1), np.zeros(2), beam, ccd) for some in (paths, touching)]
        for row in ways
    ]


def alike(one, other):
    assert other.matrix == pytest.approx(one.matrix, rel=ROUNDING)
    assert other.gradient == pytest.approx(one.gradient, abs=ROUNDING * mm)
    assert other.amplitude == pytest.approx(one.amplitude, rel=ROUNDING)


BELOW = ft.CCD((0, 0, -5 * mm), (0, 0, 1), (0, 1, 0), 0.1 * mm, (8, 8))
ABOVE = ft.CCD((0, 0, 8 * mm), (0, 0, -1), (0, 1, 0), 0.5 * mm, (8, 8))


def plate(interface, z, name, **sides):
    return ft.Surface(shapes.plate(4 * mm, 4 * mm).moved((0, 0, z)), interface, name, **sides)


def test_segments_of_no_length_divide_nothing():
    """Between faces at the same place light goes on as its branches say."""
    glass = [plate(ft.Dielectric(), -z, f"{z}", front=n, back=m) for z, n, m in (
        (0.0, 1.0, 1.5), (1e-6, 1.5, 1.7), (1e-3, 1.7, 1.0),
    )]  # fmt: skip
    tilted = [surface.moved(turn=rotation((1, 0, 0), 0.1)) for surface in glass]
    for one, other in waves_of(tilted, [1], 3, BELOW):
        alike(one, other)


@pytest.mark.parametrize("polarisation", [None, (1.0, 0.5j)])
def test_behind_an_element_the_direction_is_what_it_makes_of_the_light(polarisation):
    grating = Grating((1, 0, 0), 20e-6, orders=(0, 1))
    top, tiny = plate(grating, 0.0, "grating"), 1e-9
    for below, order, ccd in (
        (plate(ft.Mirror(), -tiny, "mirror"), 3, ABOVE),
        (plate(ft.Dielectric(), -tiny, "glass", back=1.5), 2, BELOW),
        (plate(grating, -tiny, "other grating"), 2, BELOW),
    ):
        for one, other in waves_of([top, below], range(1, order), order, ccd, polarisation):
            alike(one, other)
