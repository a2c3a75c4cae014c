"""Segments and hits of recorded paths: media, directions, branches, optical path and phase on the way."""

from dataclasses import replace

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import Fate, instruments, mm, nm, um
from fringetrace.geometry import forms, shapes
from fringetrace.geometry.shapes import plate
from fringetrace.optics.gratings import Grating
from fringetrace.tracing.segments import Segments, surface_hits, surface_phase

EPS = float(np.finfo(np.float64).eps)
# Sums of a handful of segments: some roundings of the longest.
ROUNDED = 1e-14


def ball(form, radius=0.1, centre=(0.3, -0.2, 0.5), level=3):
    mesh = shapes.icosphere(radius, level).moved(centre)
    scene = ft.Scene([ft.Surface(mesh, ft.Mirror(), "ball", form=form)])
    beam = ft.Beam(np.add(centre, (0, 0, 0.5)), (0, 0, -1), (0, 1, 0), (0.06, 0.06), (20, 21))
    ccd = ft.CCD(np.add(centre, (0, 0, 0.4)), (0, 0, -1), (0, 1, 0), 0.01, (200, 200))
    return ft.trace(scene, beam, ccd, record=True).detected


SPHERE = forms.Sphere((0.3, -0.2, 0.5), 0.1)


def test_paths_have_to_be_recorded():
    paths = ft.trace(ft.Scene([ft.Surface(plate(1, 1), ft.Mirror())]), ft.Rays([(0, 0, 1)], [(0, 0, -1)]))
    with pytest.raises(ValueError, match="segments: expected paths traced with record=True"):
        Segments.of(paths)
    with pytest.raises(ValueError, match="surface_hits: expected paths traced with record=True"):
        list(surface_hits(paths))


def test_segments_are_those_of_the_path():
    paths = ball(SPHERE)
    segments = Segments.of(paths)
    length, direction = segments.length, segments.direction
    assert length.shape == (len(paths), 2)
    np.testing.assert_allclose(length.sum(axis=1).astype(float), paths.length, rtol=4 * EPS)
    np.testing.assert_allclose(direction[:, 1].astype(float), paths.direction, rtol=0, atol=8 * EPS)
    np.testing.assert_allclose(
        direction[:, 0].astype(float), np.tile([0, 0, -1.0], (len(paths), 1)), atol=1e-14
    )


def test_the_plane_in_focus_may_lie_behind_the_last_surface():
    paths = ball(SPHERE)
    behind = ft.trace(paths.scene, paths.source, replace(paths.ccd, focus=0.35), record=True).detected
    length = Segments.of(behind).length
    assert (length[:, 1] < 0.0).all()
    np.testing.assert_allclose(length.sum(axis=1).astype(float), behind.length, rtol=4 * EPS)


@pytest.fixture(scope="module")
def paths():
    return instruments.michelson(plate(8 * mm, 8 * mm), aperture=6 * mm, pixels=(6, 8)).sampled((3, 4))


@pytest.fixture(scope="module")
def window():
    """A slab of index 1.5, 2 mm thick, and a mirror 3 mm behind it; straight down and back."""
    slab = ft.Surface(plate(4 * mm, 4 * mm, 2 * mm), ft.Dielectric(follow="transmitted"), "slab", back=1.5)
    mirror = ft.Surface(plate(4 * mm, 4 * mm).moved([0, 0, -5 * mm]), ft.Mirror(), "mirror")
    scene = ft.Scene([slab, mirror])
    rays = ft.Rays([[0.1 * mm, 0.2 * mm, 1 * mm]], [[0, 0, -1.0]], length=[7 * mm])
    return ft.trace(scene, rays, wavelength=500 * nm, record=True)


def test_in_a_vacuum_the_optical_path_is_the_way(paths):
    segments = Segments.of(paths)
    found = segments.optical_path()
    assert not segments.medium.any()
    np.testing.assert_allclose(found[:, -1], paths.length, rtol=ROUNDED)
    ways = np.linalg.norm(np.diff(paths.points[:, :4], axis=1), axis=2)
    np.testing.assert_allclose(np.diff(found[:, :4], axis=1), ways, rtol=ROUNDED)
    through = segments.through
    assert through[paths.surface == 0].sum() == through.sum() == len(paths)  # once through the splitter


def test_the_last_segment_goes_back_to_the_plane_of_focus(paths):
    assert paths.ccd.focus > 0
    length = Segments.of(paths.detected).length.astype(float)
    np.testing.assert_allclose(length.sum(axis=1), paths.detected.length, rtol=ROUNDED)
    assert (length[:, -1] < 0).all()


def test_glass_is_longer_and_what_rays_bring_along_counts_from_the_start(window):
    segments = Segments.of(window)
    np.testing.assert_array_equal(segments.index[0, :6], [1, 1.5, 1, 1, 1.5, 1])
    np.testing.assert_array_equal(segments.through[0], [True, True, False, True, True])
    found = segments.optical_path(window.source.length[window.ray])[0]
    np.testing.assert_allclose(found[:6] / mm, [7, 8, 11, 14, 17, 20], rtol=ROUNDED)


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_optical_paths_of_all_branches_are_sums_over_their_segments():
    """Balls of glass, of all sizes of contact and order of branches: no segment's index is guessed."""
    rng = np.random.default_rng(5)
    surfaces = []
    for number in range(4):
        mesh = shapes.icosphere(0.3, 1).moved(np.add(rng.uniform(-0.5, 0.5, 3), (1.1 * number, 0, 0)))
        surfaces.append(ft.Surface(mesh, ft.Dielectric(), f"ball {number}", back=1.2 + 0.2 * number))
    surfaces.append(ft.Surface(plate(9.0, 9.0).moved((0, 0, -1.0)), ft.BeamSplitter(), "splitter"))
    start = rng.uniform((-0.5, -0.5, 2.0), (4.0, 0.5, 2.0), (200, 3))
    rays = ft.Rays(start, rng.uniform((-0.2, -0.2, -1.0), (0.2, 0.2, -1.0), (200, 3)))
    paths = ft.trace(ft.Scene(surfaces, 1.1), rays, max_bounces=6, min_amplitude=1e-2, record=True)
    segments = Segments.of(paths)
    assert len(np.unique(segments.index)) > 4
    np.testing.assert_allclose(segments.optical_path()[:, -1], paths.length, rtol=ROUNDED)
    for row in range(0, len(paths), 17):
        sequence = paths.sequence(row)
        assert [k for k, _ in sequence] == paths.surface[row, : paths.bounces[row]].tolist()
        assert [through for _, through in sequence] == (paths.branch[row, : paths.bounces[row]] > 0).tolist()
    ended = np.arange(len(paths)), paths.bounces
    np.testing.assert_array_equal(paths.media[ended], paths.medium)
    np.testing.assert_array_equal(paths.indices[ended], paths.index)


def test_the_branch_is_recorded_beyond_what_a_key_can_hold():
    """Between two mirrors, one of them a splitter, 60 bounces: keys have long gone round."""
    near = ft.Surface(plate(1.0, 1.0), ft.BeamSplitter(), "near")
    far = ft.Surface(plate(1.0, 1.0).moved((0, 0, -0.1)), ft.Mirror(), "far")
    rays = ft.Rays([(0, 0, 1.0)], [(0, 0, -1.0)])
    paths = ft.trace(ft.Scene([near, far]), rays, max_bounces=60, min_amplitude=0.0, record=True)
    deep = paths.bounces == 60
    assert deep.sum() == 1
    assert (paths.branch[:, 1::2] <= 0).all()
    last = np.flatnonzero(deep)[0]
    np.testing.assert_array_equal(paths.branch[last], [1, *[0] * 59])
    left = np.flatnonzero((paths.fate == Fate.LEFT) & (paths.bounces > 50))
    ends = paths.branch[left, paths.bounces[left] - 1]
    np.testing.assert_array_equal(ends, 1)


def test_orders_of_a_grating_are_branches_and_may_go_back():
    back = Grating((1, 0, 0), 2 * um, (-1, 0, 1), reflects=True)
    scene = ft.Scene([ft.Surface(plate(1.0, 1.0), back, "grating")])
    rays = ft.Rays([(0, 0, 1.0)], [(0, 0, -1.0)])
    paths = ft.trace(scene, rays, wavelength=500 * nm, record=True)
    assert sorted(paths.branch[:, 0].tolist()) == [1, 2, 3]
    assert not Segments.of(paths).through.any()
    assert (paths.direction[:, 2] > 0).all()


def test_what_elements_add_stands_behind_them():
    """A lens: its advance at the hit, no matter what is met before and behind."""
    lens = ft.optics.elements.IdealLens((0, 0, 0.0), (0, 0, -1.0), 0.1, 0.2)
    window = ft.Surface(
        plate(1.0, 1.0, 0.01).moved((0, 0, -0.05)), ft.Dielectric("transmitted"), "window", back=1.5
    )
    scene = ft.Scene([ft.Surface(plate(1.0, 1.0), lens, "lens"), window])
    rays = ft.Rays([(0.0, 0, 0.2), (0.0, 0, 0.2)], [(0.0, 0, -1.0), (0.05, 0.02, -1.0)])
    paths = ft.trace(scene, rays, record=True)
    segments = Segments.of(paths)
    assert segments.advance[1, 0] < -1e-4
    assert not segments.advance[:, 1:].any()
    np.testing.assert_allclose(segments.optical_path()[:, -1], paths.length, rtol=ROUNDED)


def test_what_surfaces_turn_ends_in_the_phase_of_the_amplitude(paths):
    turned = surface_phase(paths, Segments.of(paths).through)
    np.testing.assert_allclose(turned[:, 0], 0.0, atol=4 * EPS)
    np.testing.assert_allclose(
        np.exp(1j * turned[:, -1]), paths.amplitude / np.abs(paths.amplitude), rtol=1e-12
    )
    sample = paths.surface[:, 1] == 1
    # reflected by the splitter, then by the mirror: a quarter and a half turn
    np.testing.assert_allclose(turned[sample, 1:3], [[np.pi / 2, 3 * np.pi / 2]] * sample.sum(), rtol=1e-12)


def test_light_with_a_polarisation_has_the_phase_of_its_way_alone():
    scene = ft.Scene([ft.Surface(plate(1 * mm, 1 * mm), ft.Mirror())])
    rays = ft.Rays([[0, 0, 1 * mm]], [[0, 0, -1.0]], polarisation=[1, 0, 0])
    paths = ft.trace(scene, rays, record=True)
    assert not surface_phase(paths, Segments.of(paths).through).any()
