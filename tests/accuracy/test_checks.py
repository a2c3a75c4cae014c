"""Guards: each fires with the right place and number, and stays silent just below."""

import math
import re
import warnings
from dataclasses import replace

import arrivals
import numpy as np
import pytest

import fringetrace as ft
from fringetrace import instruments, mm, nm, um
from fringetrace.accuracy import checks
from fringetrace.accuracy.error_budget import costly, judge
from fringetrace.core.warnings import FringetraceWarning
from fringetrace.field import aliasing
from fringetrace.geometry import shapes

HENE = 632.8 * nm


def bench(cycles, pixels=(24, 32), sample=None, **options):
    """A Michelson with so many fringes a pixel."""
    aperture = 6 * mm
    angle = 0.5 * math.asin(cycles * HENE * pixels[1] / aperture)
    sample = shapes.plate(12 * mm, 12 * mm) if sample is None else sample
    return instruments.michelson(
        sample, aperture=aperture, pixels=pixels, reference_tilt=(angle, 0.0), **options
    )


def number(text):
    return int(text.replace(",", ""))


def test_the_warning_is_a_user_warning():
    assert issubclass(ft.FringetraceWarning, UserWarning)
    assert ft.FringetraceWarning is FringetraceWarning


# Aliased fringes.


@pytest.mark.parametrize("cycles", [0.52, 0.8, 1.7])
def test_fringes_that_alias_are_told(cycles):
    with pytest.warns(
        FringetraceWarning, match="fringes alias: the phase steps by more than pi a pixel"
    ) as told:
        bench(cycles).interferogram(HENE)
    text = str(told[0].message)
    bad, total, step = re.search(r"at ([\d,]+) of ([\d,]+) pixels, by ([\d.]+) pi", text).groups()
    assert float(step) == pytest.approx(2 * cycles, rel=0.01)
    assert number(total) == 24 * 32
    # the light of the tilted mirror leaves one rim of the image
    assert number(bad) > 0.9 * 24 * 32
    assert f"take {math.ceil(2 * cycles)} times as many pixels" in text


@pytest.mark.parametrize("cycles", [0.0, 0.3, 0.49, -0.49])
def test_fringes_just_below_are_not(cycles):
    bench(cycles).interferogram(HENE)


def test_a_steep_part_of_a_sample_is_named_by_its_place():
    """A cone-like dent: slopes of 0.9 fringes a pixel in one corner of the image."""
    slope = 0.9 * HENE / (6 * mm / 32) / 2
    polyline = [(-6 * mm, 0), (1.6 * mm, 0), (6 * mm, -4.4 * mm * slope)]
    with pytest.warns(FringetraceWarning, match="fringes alias") as told:
        bench(0.0, sample=shapes.extrude(polyline, 12 * mm)).interferogram(HENE)
    row, column = map(int, re.search(r"about \[(\d+), (\d+)\]", str(told[0].message)).groups())
    assert 0 <= row < 24
    # x = 1.6 mm of 6 mm
    assert column >= (1.6 / 6 + 0.5) * 32 - 1


def test_few_rays_tell_of_fringes_on_many_pixels():
    one = bench(0.8, pixels=(64, 64))
    few = ft.trace(one.scene, replace(one.beam, shape=(8, 8)), one.ccd).detected
    assert "by 1.6 pi" in aliasing(few, HENE)
    assert aliasing(few, 2 * HENE) is None


def test_one_wave_has_no_fringes():
    beam = ft.Beam((0, 0, 0.1), (0, 0, -1), (0, 1, 0), (1 * mm, 1 * mm), (64, 64))
    ccd = ft.CCD((0, 0, 1 * um), (0, 0, -1), (0, 1, 0), 1 * mm / 32, (32, 32))
    steep = arrivals.reflected(beam, ccd, arrivals.plane(0.3)).detected
    assert aliasing(steep, HENE) is None


# Starved pixels.


def spread_light(rays, pixels=40):
    """Light that spreads to 1.4 times its width on the way."""
    beam = ft.Beam((0, 0, 30 * mm), (0, 0, -1), (0, 1, 0), (2 * mm, 2 * mm), (rays, rays))
    ccd = ft.CCD((0, 0, 20 * mm), (0, 0, -1), (0, 1, 0), 2.8 * mm / pixels, (pixels, pixels))
    return arrivals.reflected(beam, ccd, arrivals.paraboloid(-50 * mm)).detected


def test_pixels_without_rays_are_counted():
    paths = spread_light(36)
    counts = np.zeros((40, 40), dtype=int)
    np.add.at(counts, tuple(np.floor(paths.pixel).astype(int).T), 1)
    text = checks.starvation(paths)
    empty, lit, row, column = re.search(
        r"starve: ([\d,]+) of ([\d,]+) lit pixels .* first \[(\d+), (\d+)\]", text
    ).groups()
    assert counts[int(row), int(column)] == 0
    # 36 rays for 40 rows: 4 rows and 4 columns
    assert number(empty) == pytest.approx(40**2 - 36**2, rel=0.1)
    assert number(lit) == pytest.approx(40**2, rel=0.01)
    wanted = re.search(r"a beam of (\d+) x (\d+) rays", text).groups()
    assert checks.starvation(spread_light(int(wanted[0]))) is None


@pytest.mark.parametrize("rays", [40, 47, 80])
def test_pixels_with_rays_do_not_starve(rays):
    assert checks.starvation(spread_light(rays)) is None


def test_a_few_empty_pixels_are_let_pass():
    paths = spread_light(40)
    at = np.floor(paths.pixel).astype(int)
    number = at[:, 0] * 40 + at[:, 1]
    inner = [row * 40 + column for row in range(5, 35, 6) for column in range(5, 35, 8)]
    assert len(inner) > checks.FEW * 40**2
    some = paths.where(~np.isin(number, inner[: int(checks.FEW * 40**2)]))
    more = paths.where(~np.isin(number, inner))
    assert checks.starvation(some) is None
    assert f"starve: {len(inner)} of" in checks.starvation(more)


def test_an_image_may_have_dark_parts():
    paths = spread_light(40)
    assert checks.starvation(paths.where(paths.pixel[:, 1] < 20)) is None
    assert checks.starvation(paths.where(np.hypot(*(paths.pixel - 20).T) < 15)) is None


def test_what_one_wave_lacks_another_does_not_hide():
    paths = spread_light(36)
    full = spread_light(80)
    both = ft.tracing.join([replace(paths, area=None), replace(full, key=full.key + np.uint64(1), area=None)])
    assert "pixels starve" in checks.starvation(both)


# Folds.


def hollow(place, rays=61):
    """A cylinder mirror of 300 um, to a plane at `place` beyond its axis."""
    beam = ft.Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (300 * um, 60 * um), (15, rays))
    ccd = ft.CCD((0, 0, place), (0, 0, 1), (0, 1, 0), 5 * um, (12, 60))
    return arrivals.reflected(beam, ccd, arrivals.cylinder(300 * um)).detected


def test_a_fold_is_told():
    """Behind the cusp at R/2 rays cross: between the branches of x = R sin^3 t three arrive."""
    place = 160 * um
    text = checks.folding(hollow(place))
    cells, total, _, column = re.search(
        r"folds over the CCD: ([\d,]+) of its ([\d,]+) cells .* pixel \[(-?\d+), (\d+)\]", text
    ).groups()
    angle = np.arcsin(np.linspace(-0.5, 0.5, 61))
    way = (300 * um * np.cos(angle) - place) / np.cos(2 * angle)
    x = 300 * um * np.sin(angle) - way * np.sin(2 * angle)
    back = (np.diff(x) > 0).sum()
    less = min(back, 60 - back)
    assert number(cells) == 14 * less
    assert number(total) == 14 * 60
    assert abs((int(column) + 0.5) * 5 * um - 150 * um) <= np.abs(x).max() + 5 * um
    assert 'take method="wavefront"' in text


@pytest.mark.parametrize("place", [100 * um, 240 * um])
def test_before_the_caustic_and_beyond_it_nothing_folds(place):
    """The caustic of rays up to 30 degrees lies between z = R / 2 and z = .65 R."""
    assert checks.folding(hollow(place)) is None


def test_a_mirror_image_is_no_fold():
    assert checks.folding(bench(0.1).trace().detected) is None


def test_facets_that_cross_their_light_are_no_caustic():
    angle = 1.5e-3
    slope = math.tan(angle)
    mesh = shapes.extrude([(-9 * mm, 9 * mm * slope), (0, 0), (9 * mm, 9 * mm * slope)], 9 * mm)
    beam = ft.Beam((0, 0, 0.4), (0, 0, -1), (0, 1, 0), (5 * mm, 3 * mm), (20, 100))
    ccd = ft.CCD((0, 0, 0.5), (0, 0, -1), (0, 1, 0), 80 * um, (40, 64))
    paths = ft.trace(ft.Scene([ft.Surface(mesh, ft.Mirror())]), beam, ccd).detected
    assert checks.folding(paths) is None


def test_loose_rays_have_no_folds():
    paths = hollow(160 * um)
    assert checks.folding(replace(paths, source=ft.Rays([(0, 0, 0)], [(0, 0, 1)]))) is None


# Foci and cusps.


def place_told(text):
    number_, row, column = re.search(
        r"about ([\d,]+) of its rays, the first at pixel \[(\d+), (\d+)\]", text
    ).groups()
    return number(number_), int(row), int(column)


@pytest.mark.parametrize("rays", [60, 61])
def test_the_line_of_the_cusp_is_told(rays):
    """On the plane z = R / 2 rays arrive at x = R t^3, to lowest order, by 11 rows of the beam."""
    text = checks.focusing(hollow(150 * um, rays), HENE)
    count, _, column = place_told(text)
    assert text.startswith("a wave comes to a focus or a cusp on the CCD: ")
    assert count == 11 * (1 + (rays == 60))
    assert column in (29, 30)


@pytest.mark.parametrize("place", [20, 140, 149, 151, 160, 240])
def test_folds_and_what_is_before_them_are_not(place):
    """The wavefront method knows folds in their uniform form."""
    assert checks.focusing(hollow(place * um), HENE) is None


def test_a_cusp_is_told_by_its_place():
    """A plane across the line of cusps, z = R / 2 + y / 4: the folds meet in the middle of the image."""
    beam = ft.Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (300 * um, 60 * um), (16, 62))
    ccd = ft.CCD((0, 0, 150 * um), (0, -0.25, 1), (0, 1, 0), 5 * um, (16, 60))
    paths = arrivals.reflected(beam, ccd, arrivals.cylinder(300 * um)).detected
    count, row, column = place_told(checks.focusing(paths, HENE))
    assert count <= 6
    assert abs(row - 8) <= 1
    assert abs(column - 30) <= 1


@pytest.mark.parametrize("place", [45, 49.9, 50.1])
def test_a_point_focus_is_told_and_what_is_beside_it_is_not(place):
    def seen(z):
        beam = ft.Beam((0, 0, 30 * mm), (0, 0, -1), (0, 1, 0), (5 * mm, 5 * mm), (20, 20))
        ccd = ft.CCD((0, 0, z), (0, 0, -1), (0, 1, 0), 0.1 * mm, (64, 64))
        return arrivals.reflected(beam, ccd, arrivals.paraboloid(50 * mm))

    checks.check(seen(place * mm), HENE, "wavefront")
    with pytest.warns(
        FringetraceWarning, match=r"focus or a cusp on the CCD: about 400 of its rays, .* \[3[12], "
    ):
        checks.check(seen(50 * mm), HENE, "wavefront")


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_light_through_the_axis_of_a_sphere_is_told():
    """A ring of its rays meets in one point, for R / 2 < z < R / (2 cos t)."""
    sphere = ft.Surface(
        shapes.icosphere(1 * mm, 4), ft.Mirror(), "ball", form=ft.forms.Sphere((0, 0, 0), 1 * mm)
    )
    beam = ft.Beam((0, 0, 0.3 * mm), (0, 0, 1), (0, 1, 0), (0.8 * mm, 0.8 * mm), (30, 30))
    for place, told in ((0.3, False), (0.52, True), (0.8, False)):
        ccd = ft.CCD((0, 0, 0), (0, 0, 1), (0, 1, 0), 10 * um, (200, 200), focus=place * mm)
        paths = ft.trace(ft.Scene([sphere]), beam, ccd)
        assert len(paths.detected) > 880
        assert (checks.focusing(paths.detected, HENE) is not None) == told


def test_flat_facets_and_loose_rays_have_no_foci():
    assert checks.focusing(bench(0.1).trace().detected, HENE) is None
    paths = hollow(150 * um)
    assert checks.focusing(replace(paths, source=ft.Rays([(0, 0, 0)], [(0, 0, 1)])), HENE) is None


# Costly facets.


@pytest.mark.parametrize(("cost", "told"), [(0.0499, False), (0.0501, True), (0.2, True)])
def test_facets_over_a_twentieth_wave_are_told(cost, told):
    costs = ft.Budget(0.0, cost, 0.0, 0.0, HENE, "rays", ("lens", 4 * cost))
    text = costly(costs)
    assert (text is not None) == told
    if told:
        assert f"facets cost {cost:.2g} waves rms, over 1/20: those of 'lens' up to {4 * cost:.2g}; " in text
        # their sag falls as the square of their size
        assert f"facets {math.sqrt(20 * cost):.1f} times as small" in text


def test_a_bench_names_its_costly_surface():
    along = np.linspace(-6 * mm, 6 * mm, 13)
    mesh = shapes.height_map(-(along**2 + along[:, None] ** 2) / 10.0, 1 * mm)
    one = instruments.michelson(mesh, aperture=6 * mm, pixels=(48, 48))
    with pytest.warns(
        FringetraceWarning, match=r"facets cost 0\.\d+ waves rms, over 1/20: those of 'sample'"
    ):
        costs = one.budget(HENE)
    finer = np.linspace(-6 * mm, 6 * mm, 1 + 12 * math.ceil(math.sqrt(20 * costs.facets)))
    pitch = finer[1] - finer[0]
    better = shapes.height_map(-(finer**2 + finer[:, None] ** 2) / 10.0, pitch)
    instruments.michelson(better, aperture=6 * mm, pixels=(48, 48)).budget(HENE)


# All of them.


def test_the_wavefront_method_needs_no_ray_a_pixel():
    paths = spread_light(36)
    with pytest.warns(FringetraceWarning, match="pixels starve"):
        checks.check(paths, HENE, method="rays")
    checks.check(paths, HENE, method="wavefront")


def test_each_is_told_once():
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        bench(0.8).budget(HENE)
    assert [str(warning.message)[:13] for warning in told] == ["fringes alias"]
    # at the line that asked for it
    assert told[0].filename == __file__


def test_all_there_is_to_say_of_an_image_comes_at_once():
    """A hollow of a few facets, and fringes too fine: the budget, and a note of each."""
    along = np.linspace(-6 * mm, 6 * mm, 13)
    mesh = shapes.height_map(-(along**2 + along[:, None] ** 2) / 10.0, 1 * mm)
    bad = bench(0.8, pixels=(48, 48), sample=mesh)
    costs, notes = judge(bad.trace(), HENE, "rays")
    assert list(notes) == ["fringes alias", "facets cost"]
    assert all(text.startswith(name) for name, text in notes.items())
    assert checks.found(bad.trace(), HENE, "rays") == {"fringes alias": notes["fringes alias"]}
    with pytest.warns(FringetraceWarning) as told:
        assert costs == ft.budget(bad.trace(), HENE, "rays")
    assert [str(one.message) for one in told] == list(notes.values())
    good = bench(0.1)
    assert judge(good.trace(), HENE)[1] == {}


def test_an_image_without_light_has_nothing_to_tell():
    beside = shapes.plate(1 * mm, 1 * mm).moved((10 * mm, 0, 0))
    beam = ft.Beam((0, 0, 1), (0, 0, -1), (0, 1, 0), (1 * mm, 1 * mm), (4, 4))
    ccd = ft.CCD((0, 0, 2), (0, 0, -1), (0, 1, 0), 1 * mm, (4, 4))
    checks.check(ft.trace(ft.Scene([ft.Surface(beside, ft.Mirror())]), beam, ccd), HENE)


def test_guards_need_a_ccd():
    paths = replace(spread_light(36), ccd=None)
    with pytest.raises(ValueError, match="checks: expected paths traced onto a CCD, got paths without one"):
        checks.starvation(paths)
    checks.check(paths, HENE)  # of any trace
