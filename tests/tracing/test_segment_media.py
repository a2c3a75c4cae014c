"""Legs of paths: what they go through, and what the phase is on the way."""

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import instruments, mm, nm
from fringetrace.geometry.shapes import plate
from fringetrace.tracing import segment_media

# Sums of a handful of legs: some roundings of the longest.
ROUNDED = 1e-14


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
    through, medium = segment_media.media(paths)
    found = segment_media.opl(paths, segment_media.ways(paths), medium, None)
    assert not medium.any()
    np.testing.assert_allclose(found[:, -1], paths.length, rtol=ROUNDED)
    ways = np.linalg.norm(np.diff(paths.points[:, :4], axis=1), axis=2)
    np.testing.assert_allclose(np.diff(found[:, :4], axis=1), ways, rtol=ROUNDED)
    assert through[paths.surface == 0].sum() == through.sum() == len(paths)  # once through the splitter


def test_the_last_leg_goes_back_to_the_plane_of_focus(paths):
    assert paths.ccd.focus > 0
    ways = segment_media.ways(paths.detected)
    last = ways[:, -1]
    np.testing.assert_allclose(last, paths.detected.length - ways[:, :-1].sum(axis=1), rtol=1e-9)
    assert (last < 0).all()


def test_glass_is_longer_and_what_rays_bring_along_counts_from_the_start(window):
    through, medium = segment_media.media(window)
    index = segment_media.indices(window, 500 * nm)[medium][0]
    np.testing.assert_array_equal(index[:6], [1, 1.5, 1, 1, 1.5, 1])
    np.testing.assert_array_equal(through[0], [True, True, False, True, True])
    found = segment_media.opl(window, segment_media.ways(window), medium, 500 * nm)[0]
    np.testing.assert_allclose(found[:6] / mm, [7, 8, 11, 14, 17, 20], rtol=ROUNDED)


def test_what_surfaces_turn_ends_in_the_phase_of_the_amplitude(paths):
    turned = segment_media.turned(paths, segment_media.media(paths)[0])
    np.testing.assert_array_equal(turned[:, 0], 0.0)
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
    assert not segment_media.turned(paths, segment_media.media(paths)[0]).any()
