"""Paths to look at: the sample, its phases, its ends."""

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import instruments, mm, nm
from fringetrace.geometry.shapes import plate
from fringetrace.views.scene3d.polylines import start_of, strands

# A phase from a path of centimetres by two ways: some roundings of the path, in turns.
ROUNDED = 1e-9


@pytest.fixture(scope="module")
def bench():
    return instruments.michelson(
        plate(8 * mm, 8 * mm), aperture=6 * mm, pixels=(6, 8), reference_tilt=(200e-6, 0.0)
    )


@pytest.fixture(scope="module")
def paths(bench):
    return bench.sampled((8, 10))


@pytest.fixture(scope="module")
def floor():
    scene = ft.Scene([ft.Surface(plate(1 * mm, 1 * mm), ft.Mirror(), "floor")])
    rays = ft.Rays([[0, 0, 1 * mm], [5 * mm, 0, 1 * mm]], [[0, 0, -1.0], [0, 0, -1.0]])
    return ft.trace(scene, rays, record=True)


def turns(paths, wavelength):
    return np.angle(paths.amplitude * np.exp(2j * np.pi * (paths.length % wavelength) / wavelength)) / (
        2 * np.pi
    )


def test_the_last_phase_is_that_of_the_amplitude_at_any_wavelength(paths):
    shown = strands(paths, 633 * nm, sweep=9)
    assert len(shown.wavelengths) == 9
    assert shown.wavelengths[shown.chosen] == 633 * nm
    for number, wavelength in enumerate(shown.wavelengths):
        there = turns(paths.where(shown.row), wavelength)
        off = shown.phase[number, :, -1] - there
        np.testing.assert_allclose(off, np.round(off), atol=ROUNDED)


def test_where_light_is_bent_elsewhere_there_is_one_wavelength():
    glass = ft.Surface(plate(4 * mm, 4 * mm), ft.Dielectric(follow="transmitted"), "glass", back="BK7")
    rays = ft.Rays([[0, 0, 1 * mm]], [[0, 0.2, -1.0]])
    ccd = ft.CCD([0, 0, -3 * mm], [0, 0, 1], [0, 1, 0], 1 * mm, (4, 4))
    paths = ft.trace(ft.Scene([glass]), rays, ccd, wavelength=550 * nm, record=True)
    assert len(strands(paths, sweep=9).wavelengths) == 1
    with pytest.raises(ValueError, match="light is bent"):
        strands(paths, 600 * nm)


def test_a_phase_step_turns_the_reference_once_it_is_met(bench, paths):
    shown = strands(paths, reference=bench.arms.reference)
    met = (shown.surface == bench.arms.reference.surface).any(axis=1)
    assert 0 < met.sum() < len(met)
    assert not shown.steps[~met].any()
    np.testing.assert_array_equal(shown.steps[met], [[0, 0, 1, 1, 1]] * met.sum())
    assert (strands(paths).steps == 1).all()


def test_every_ray_is_on_one_route_and_the_routes_share_them(paths):
    shown = strands(paths)
    assert shown.routes == ("splitter, sample, splitter", "splitter, reference, splitter")
    assert len(shown) == shown.shown == 80
    assert shown.caption == "80 rays"
    np.testing.assert_array_equal(np.bincount(shown.route), [40, 40])
    assert len(strands(paths, every=True)) == len(paths) == 320


def test_of_many_rays_a_fixed_sample_is_shown_and_said_to_be(paths):
    shown, again = strands(paths, most=30), strands(paths, most=30)
    assert shown.caption == "30 of 80 rays"
    assert len(np.unique(shown.ray)) == 30
    np.testing.assert_array_equal(shown.ray, again.ray)
    assert len(strands(paths, most=30, every=True)) == 4 * 30


def test_more_routes_than_names_share_the_last(monkeypatch, paths):
    monkeypatch.setattr("fringetrace.views.scene3d.polylines.ROUTES", 1)
    assert strands(paths).routes == ("splitter, sample, splitter", "other paths")


def test_ends_are_on_the_chip_and_not_in_its_plane_of_focus(bench, paths):
    shown = strands(paths)
    assert bench.ccd.focus != 0.0
    assert shown.focused
    np.testing.assert_allclose(shown.points[:, -1, 2], bench.ccd.centre[2], rtol=1e-12)
    np.testing.assert_allclose(shown.points[:, 0, 0], bench.beam.centre[0], rtol=1e-12)
    np.testing.assert_allclose(shown.opl[:, -1], paths.where(shown.row).length, rtol=1e-14)


def test_light_that_leaves_is_drawn_a_bit_on(floor):
    shown = strands(floor, onward=0.3 * mm)
    assert set(shown.routes) == {"floor", "straight"}
    np.testing.assert_allclose(shown.points[0, :, 2] / mm, [1, 0, 0.3])
    np.testing.assert_allclose(shown.opl[0] / mm, [0, 1, 1.3])
    np.testing.assert_allclose(shown.points[1, :2, 2] / mm, [1, 0.7])
    assert np.isnan(shown.points[1, 2]).all()
    path, bounce = shown.legs()
    assert (path.tolist(), bounce.tolist()) == ([0, 0, 1], [0, 1, 0])


def test_several_beams_are_shown_side_by_side(floor):
    straight = ft.trace(floor.scene, ft.Rays([[5 * mm, 0, 0]], [[0, 0, 1.0]]), record=True)
    shown = strands([straight, floor])
    assert shown.points.shape == (3, 3, 3)
    assert shown.beam.tolist() == [0, 1, 1]
    assert (shown.rays, shown.shown) == (3, 3)
    assert shown.surface.tolist() == [[-1], [0], [-1]]


def test_rays_start_on_average_where_they_do(floor, paths, bench):
    centre, direction, size = start_of(floor.source, strands(floor, onward=1 * mm).points)
    np.testing.assert_allclose(centre, [2.5 * mm, 0, 1 * mm])
    np.testing.assert_allclose(direction, [0, 0, -1])
    assert size == pytest.approx(5 * mm)
    assert start_of(bench.beam, paths.points)[1].tolist() == bench.beam.direction.tolist()


def test_what_cannot_be_shown_is_refused(bench, paths, floor):
    with pytest.raises(ValueError, match="expected at least one Paths, got none"):
        strands([])
    with pytest.raises(ValueError, match="rays to draw: expected at least 1, got 0"):
        strands(paths, most=0)
    with pytest.raises(ValueError, match="expected paths traced with record=True"):
        strands(bench.trace())
