"""A path in words."""

import pytest

import fringetrace as ft
from fringetrace import instruments, mm, nm, views
from fringetrace.geometry.shapes import plate


def test_a_path_through_glass_is_told_from_start_to_end():
    slab = ft.Surface(plate(4 * mm, 4 * mm, 2 * mm), ft.Dielectric(follow="transmitted"), "slab", back=1.5)
    end = ft.Surface(plate(4 * mm, 4 * mm).moved([0, 0, -5 * mm]), ft.Absorber(), "end")
    rays = ft.Rays([[0, 0, 1 * mm]], [[0, 0, -1.0]])
    paths = ft.trace(ft.Scene([slab, end]), rays, wavelength=500 * nm, record=True)
    assert views.describe_path(paths, -1).splitlines() == [
        "ray 0 is absorbed; lengths in µm",
        "start at (0, 0, 1000)",
        "1. through slab at (0, 0, 0)",
        "    after 1000; optical path so far 1000",
        "2. through slab at (0, 0, -2000)",
        "    after 2000, index 1.5; optical path so far 4000",
        "3. absorbed by end at (0, 0, -5000)",
        "    after 3000; optical path so far 7000",
        "optical path 7000 µm",
        "phase 0.0000 turns = 0.0° at 500 nm",
        "power 0 of the launched",
    ]


def test_a_path_to_the_ccd_says_which_plane_it_is_counted_to():
    bench = instruments.michelson(plate(8 * mm, 8 * mm), aperture=6 * mm, pixels=(2, 2))
    paths = bench.sampled((1, 1))
    told = views.describe_path(paths.detected, 0, 633 * nm)
    assert "ray 0 reaches the CCD" in told
    assert "4. CCD at (" in told
    assert "mm (to its plane of focus)" in told
    assert " turns = " in told
    assert "turns" not in views.describe_path(paths.detected, 0)


def test_there_is_no_other_path():
    scene = ft.Scene([ft.Surface(plate(1 * mm, 1 * mm), ft.Mirror())])
    paths = ft.trace(scene, ft.Rays([[0, 0, 1 * mm]], [[0, 0, -1.0]]), record=True)
    with pytest.raises(IndexError, match="itinerary row: expected one of 1 paths, got 1"):
        views.describe_path(paths, 1)
