"""Which light a phase step turns; the slope of a tilted reference."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace import mm
from fringetrace.geometry.shapes import plate
from fringetrace.instruments.arms import Mark, path_slope
from fringetrace.scene.sensor import pixel_centres


def cavity():
    """A half mirror at z = 1 mm over a mirror at z = 0."""
    half = ft.Surface(plate(1 * mm, 1 * mm).moved((0.0, 0.0, 1 * mm)), ft.BeamSplitter(), "half")
    return ft.Scene([half, ft.Surface(plate(1 * mm, 1 * mm), ft.Mirror(), "mirror")])


@pytest.fixture(scope="module")
def trips():
    """Light that left a cavity upwards, by the number of its round trips: 0, 1, 2, 3."""
    paths = ft.trace(cavity(), ft.Rays([[0.0, 0.0, 2 * mm]], [[0.0, 0.0, -1.0]]), max_bounces=8)
    up = paths.where((paths.fate == ft.Fate.LEFT) & (paths.direction[:, 2] > 0.0))
    return up.where(np.argsort(up.length))


@pytest.mark.parametrize(
    ("mark", "counts"),
    [
        (Mark(0), [1, 2, 3, 4]),
        (Mark(0, branch=0), [1, 0, 1, 2]),
        (Mark(0, branch=1), [0, 2, 2, 2]),
        (Mark(0, then=1), [0, 1, 2, 3]),
        (Mark(0, branch=0, then=1), [0, 0, 1, 2]),
        (Mark(1, then=0), [0, 1, 2, 3]),
        (Mark(0, then=0), [0, 0, 0, 0]),
    ],
)
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_a_mark_counts_what_light_met(trips, mark, counts):
    assert mark.count(trips).tolist() == counts


def test_a_further_branch_of_an_element_has_its_own_count():
    """A shear plate: the ordinary beam is branch 1, the extraordinary one branch 2."""
    shear = ft.birefringent.ShearPlate((1, 0, 1), 1 * mm, 1.6, 1.5)
    beam = ft.Beam([0, 0, -1 * mm], [0, 0, 1], [0, 1, 0], (1e-6, 1e-6), (1, 1), polarisation=(1, 1))
    paths = ft.trace(ft.Scene([ft.Surface(plate(1 * mm, 1 * mm), shear, "shear")]), beam)
    aside = paths.origin[:, 0] != 0.0
    assert sorted(aside.tolist()) == [False, True]
    np.testing.assert_array_equal(Mark(0, branch=1).count(paths), np.where(aside, 0, 1))
    np.testing.assert_array_equal(Mark(0, branch=2).count(paths), np.where(aside, 1, 0))
    np.testing.assert_array_equal(Mark(0).count(paths), 1)


@settings(max_examples=30, deadline=None)
@given(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05))
def test_the_slope_of_a_tilted_wave_is_that_of_the_reflected_ray(tilt_x, tilt_y):
    angle = math.hypot(tilt_x, tilt_y)
    normal = np.array([0.0, 0.0, 1.0])
    if angle > 0.0:
        across = np.array([tilt_x, tilt_y]) / angle
        normal = np.array([*(math.sin(angle) * across), math.cos(angle)])
    down = np.array([0.0, 0.0, -1.0])
    reflected = down - 2 * (down @ normal) * normal
    np.testing.assert_allclose(path_slope((tilt_x, tilt_y)), reflected[:2], rtol=1e-12, atol=1e-17)


def test_pixel_centres_lie_about_the_middle():
    x, y = pixel_centres((2, 3), 0.5)
    np.testing.assert_array_equal(x, [-0.5, 0.0, 0.5])
    np.testing.assert_array_equal(y, [-0.25, 0.25])
