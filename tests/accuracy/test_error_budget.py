"""The budget as a whole: its terms, its text, what it refuses, and where a bench gives it."""

import math
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import instruments, mm, nm
from fringetrace.accuracy.error_budget import FEWEST, FINEST, _halved, _within, again, narrowing
from fringetrace.geometry import forms, shapes

HENE = 632.8 * nm


@pytest.fixture(scope="module")
def bench():
    return instruments.michelson(
        shapes.step(8 * mm, 8 * mm, 1 * mm, 100 * nm), aperture=6 * mm, pixels=(24, 32)
    )


@pytest.fixture(scope="module")
def costs(bench):
    return ft.budget(bench.trace(), HENE, method="wavefront")


def test_a_flat_bench_costs_roundings_only():
    flat = instruments.michelson(shapes.plate(8 * mm, 8 * mm), aperture=6 * mm, pixels=(24, 32))
    costs = ft.budget(flat.trace(), HENE, "rays")
    assert 0.0 < costs.hit < 1e-9
    assert costs.facets <= costs.hit
    assert max(costs.sampling, costs.pixels) < 1e-9  # a ray a pixel, on its middle; no tilt
    assert costs.total == pytest.approx(math.hypot(costs.hit, costs.facets, costs.sampling, costs.pixels))
    assert (costs.wavelength, costs.method) == (HENE, "rays")


def test_pixels_across_an_edge_cost_sampling(bench):
    # one ray takes either side of the edge for all of its pixel: 1 of 32 columns, by half of it at the rms
    rise = abs(1.0 - np.exp(4j * math.pi * 100 * nm / HENE)) / 2
    edge = math.sqrt(1 / 32) * 0.5 * rise / 2 / math.pi
    assert 0.5 * edge < ft.budget(bench.trace(), HENE, "rays").sampling < 10.0 * edge


def test_a_bench_gives_that_of_its_paths(bench):
    assert bench.budget(HENE) == ft.budget(bench.trace(), HENE)


def test_tilt_costs_pixels():
    """1 - sinc of the fringes a pixel, on the half of the light that leans."""
    plain = shapes.plate(8 * mm, 8 * mm)
    bench = instruments.michelson(plain, aperture=6 * mm, pixels=(64, 64), reference_tilt=(5e-4, 0.0))
    cycles = math.sin(1e-3) * bench.ccd.pitch / HENE
    arms = (1.0 - np.sinc(cycles)) / 2 / (2 * math.pi) / math.sqrt(0.5)
    assert ft.budget(bench.trace(), HENE, "rays").pixels == pytest.approx(arms, rel=0.05)


def test_by_the_wavefront_method(costs):
    assert costs.method == "wavefront"
    # flat facets: edges are known to 1e-9 of a cell, the phase to rounding
    assert max(costs.sampling, costs.pixels) < 1e-7


def test_it_reads_as_a_table():
    costs = ft.Budget(1.2e-10, 3.4e-3, 5.6e-4, 0.0, HENE, "rays")
    lines = str(costs).splitlines()
    assert lines[0] == "error budget in waves of 632.8 nm, rms, rays"
    assert [line.split()[:2] for line in lines[1:]] == [
        ["hit", "1.2e-10"], ["facets", "3.4e-03"], ["sampling", "5.6e-04"], ["pixels", "0.0e+00"],
        ["total", "3.4e-03"],
    ]  # fmt: skip
    assert (
        costs.line == "hit 1.2e-10, facets 3.4e-03, sampling 5.6e-04, pixels 0.0e+00, total 3.4e-03 waves rms"
    )
    with pytest.raises(FrozenInstanceError):
        costs.hit = 0.0


@pytest.mark.filterwarnings("ignore:(fringes alias|facets cost)")
def test_a_form_takes_the_facets_off_the_bill():
    along = np.linspace(-4 * mm, 4 * mm, 17)
    mesh = shapes.height_map(-(along**2 + along[:, None] ** 2) / 2.0, 0.5 * mm)
    costs = {}
    for form in (None, forms.Conic((0, 0, 0), (0, 0, -1), 1.0, -1.0), forms.Smooth()):
        sample = ft.Surface(mesh, ft.Mirror(), "hollow", form=form)
        paths = instruments.michelson(sample, aperture=6 * mm, pixels=(24, 24)).trace()
        costs[type(form).__name__] = ft.budget(paths, HENE, "rays")  # facets and hits are of any method
    assert costs["NoneType"].facets > 0.05
    assert costs["NoneType"].costliest[0] == "hollow"
    assert costs["NoneType"].costliest[1] > costs["NoneType"].facets
    assert costs["Conic"].facets < 1e-9
    assert costs["Smooth"].facets < 1e-9
    assert costs["Smooth"].hit < 1e-9


def test_another_wavelength_counts_in_other_waves(bench, costs):
    other = ft.budget(bench.trace(), 2 * HENE, "rays")
    assert other.hit == pytest.approx(0.5 * costs.hit)


def test_a_dark_image_costs_nothing():
    beside = shapes.plate(1 * mm, 1 * mm).moved((10 * mm, 0, 0))
    beam = ft.Beam((0, 0, 1), (0, 0, -1), (0, 1, 0), (1 * mm, 1 * mm), (4, 4))
    ccd = ft.CCD((0, 0, 2), (0, 0, -1), (0, 1, 0), 1 * mm, (4, 4))
    dark = ft.trace(ft.Scene([ft.Surface(beside, ft.Mirror())]), beam, ccd)
    assert ft.budget(dark, HENE).total == 0.0


def test_what_has_no_budget(bench):
    paths = bench.trace()
    rays = ft.Rays([(0, 0, 0)], [(1, 0, 0)])
    with pytest.raises(ValueError, match="budget: expected paths traced onto a CCD, got paths without one"):
        ft.budget(ft.trace(bench.scene, bench.beam), HENE)
    with pytest.raises(ValueError, match="budget: expected paths of a Beam, got those of Rays"):
        ft.budget(ft.trace(bench.scene, rays, bench.ccd), HENE)
    with pytest.raises(ValueError, match=r"method: expected one of .*, got 'guess'"):
        ft.budget(paths, HENE, method="guess")
    with pytest.raises(ValueError, match="wavelength: expected a positive length"):
        ft.budget(paths, -HENE)


def test_the_same_rays_again_are_the_same(bench):
    paths = bench.trace()
    twin = again(paths, bench.beam.shape)
    seen, same = paths.detected, twin.detected
    np.testing.assert_array_equal(seen.length, same.length)
    np.testing.assert_array_equal(seen.key, same.key)


@pytest.mark.parametrize(("faintest", "waves"), [(0.1, 1), (1e-3, 2)])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_light_as_faint_is_followed_again(faintest, waves):
    """A sample that sends back a hundredth of an amplitude."""
    faint = ft.Surface(shapes.plate(8 * mm, 8 * mm), ft.Mirror(1e-4), "sample")
    one = replace(instruments.michelson(faint, aperture=6 * mm, pixels=(4, 4)), min_amplitude=faintest)
    twin = again(one.trace(), one.beam.shape)
    assert twin.min_amplitude == faintest
    assert len(np.unique(twin.detected.key)) == waves
    np.testing.assert_array_equal(one.trace().detected.key, twin.detected.key)


@pytest.mark.parametrize(
    ("shape", "fitting"), [((10, 10), (10, 10)), ((300, 100), (53, 18)), ((1, 500), (1, 53))]
)
def test_grids_keep_their_proportions(shape, fitting):
    assert _within(shape, 53) == fitting


@pytest.mark.parametrize(("rays", "finest"), [(FEWEST - 1, 2 * FEWEST - 2), (40, 40), (4 * FINEST, FINEST)])
def test_grids_are_halved_twice(rays, finest):
    mesh = shapes.plate(8 * mm, 8 * mm)
    paths = instruments.michelson(mesh, aperture=6 * mm, pixels=(rays, rays)).trace()
    assert [p.source.shape[0] for p in _halved(paths)] == [finest, round(finest / 2), round(finest / 4)]


def test_light_narrows_towards_a_focus():
    focal = 50 * mm
    along = np.linspace(-4 * mm, 4 * mm, 65)
    mesh = shapes.height_map((along**2 + along[:, None] ** 2) / (4 * focal), 0.125 * mm)
    scene = ft.Scene([ft.Surface(mesh, ft.Mirror())])
    beam = ft.Beam((0, 0, 48 * mm), (0, 0, -1), (0, 1, 0), (6 * mm, 6 * mm), (31, 33))
    for place, part in ((10 * mm, 0.8), (40 * mm, 0.2)):
        far = 49 * mm
        ccd = ft.CCD((0, 0, far), (0, 0, -1), (0, 1, 0), 0.2 * mm, (64, 64), focus=far - place)
        found = narrowing(ft.trace(scene, beam, ccd).detected)
        np.testing.assert_allclose(found, part, rtol=0.02)


def test_a_few_paths_do_not_tell_how_light_narrows(bench):
    few = again(bench.trace(), (2, 2)).detected
    np.testing.assert_array_equal(narrowing(few), 1.0)
