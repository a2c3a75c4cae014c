"""The float32 tracer: right as far as float32 goes, and no further."""

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm
from fringetrace.validation import float32_tracer
from fringetrace.validation.standards import STANDARDS, WAVELENGTH

# Of a few roundings of float32 for a path.
ROUNDINGS = 30 * 2.0**-24


@pytest.mark.parametrize("name", ["sphere", "newton", "tilt", "step", "valley", "corner_cube"])
def test_it_finds_the_paths_of_float64_but_for_float32(name):
    standard = STANDARDS[name](16, 8).faceted()
    # no ray on an edge: there float32 loses some
    beam = standard.lit(14 if name == "corner_cube" else 13)
    ours = ft.trace(standard.scene, beam, standard.ccd).detected
    theirs = float32_tracer.trace_float32(standard.scene, beam, standard.ccd)
    assert len(theirs) == len(ours) > 60
    for column in ("ray", "bounces"):
        a, b = (np.sort(getattr(paths, column)) for paths in (ours, theirs))
        np.testing.assert_array_equal(a, b)
    assert theirs.amplitude == pytest.approx(ours.amplitude, abs=1e-12)  # of both arms the same
    # the arms of a ray come in either order: the nearer match counts
    length = theirs.length[np.argsort(theirs.ray, kind="stable")]
    arms = len(ours) // len(np.unique(ours.ray))
    pairs = ours.length.reshape(-1, arms), length.reshape(-1, arms)
    off = np.min([abs(pairs[0] - turned).max(axis=1) for turned in (pairs[1], pairs[1][:, ::-1])], axis=0)
    size = ours.length.max() + 2 * standard.ccd.focus
    worst = off.max() / size
    assert worst < ROUNDINGS
    # single precision it is: nobody has that many digits by chance
    assert worst > 2.0**-28
    assert (theirs.length == theirs.length.astype(np.float32)).all()


def test_a_ray_that_misses_all_is_gone():
    scene = ft.Scene([ft.Surface(ft.shapes.plate(1 * mm, 1 * mm), ft.Mirror())])
    beam = ft.Beam((0, 0, 1 * mm), (0, 0, -1), (0, 1, 0), (2 * mm, 2 * mm), (8, 8))
    ccd = ft.CCD((0, 0, 2 * mm), (0, 0, -1), (0, 1, 0), 1 * mm, (4, 4))
    paths = float32_tracer.trace_float32(scene, beam, ccd)
    assert len(paths) == 16
    assert paths.length == pytest.approx(3 * mm, rel=1e-6)
    assert paths.incident == 64


def test_black_ends_rays_and_bounces_are_counted():
    black = ft.Scene([ft.Surface(ft.shapes.plate(1 * mm, 1 * mm), ft.Absorber())])
    beam = ft.Beam((0, 0, 1 * mm), (0, 0, -1), (0, 1, 0), (0.5 * mm, 0.5 * mm), (4, 4))
    ccd = ft.CCD((0, 0, 2 * mm), (0, 0, -1), (0, 1, 0), 1 * mm, (4, 4))
    assert len(float32_tracer.trace_float32(black, beam, ccd)) == 0
    mirror = ft.Scene([ft.Surface(ft.shapes.plate(1 * mm, 1 * mm), ft.Mirror())])
    assert len(float32_tracer.trace_float32(mirror, beam, ccd, max_bounces=0)) == 0
    assert (float32_tracer.trace_float32(mirror, beam, ccd, max_bounces=1).bounces == 1).all()


def test_its_phase_is_wrong_where_ours_is_right():
    standard = STANDARDS["corner_cube"](16, 1)
    ours = ft.trace(standard.scene, standard.lit(14), standard.ccd).detected
    theirs = float32_tracer.trace_float32(standard.scene, standard.lit(14), standard.ccd)
    along, start = standard.beam.direction, standard.beam.centre
    spread = [np.ptp(p.length + (p.origin - start) @ along) / WAVELENGTH for p in (ours, theirs)]
    assert spread[0] < 1e-8
    assert spread[1] > 1e-3
