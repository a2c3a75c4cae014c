"""Hits moved from facets onto the exact form behind them, beside closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace.geometry import forms, shapes
from fringetrace.tracing.intersect import embree, on_forms

EPS = float(np.finfo(np.float64).eps)
seeds = st.integers(0, 2**32 - 1)
# A hit on a sphere of radius 1 from some radii away: roundings of the point, over the cosine of incidence.
HIT = 64 * EPS


def ball(radius, centre, level=2, interface=None, **media):
    mesh = shapes.icosphere(radius, level).moved(centre)
    interface = ft.Mirror() if interface is None else interface
    return ft.Surface(mesh, interface, "ball", forms.Sphere(centre, radius), **media)


def to_sphere(start, direction, centre, radius):
    """Path of rays to a sphere from outside, and the discriminant over radius^2 (below 0: they miss it)."""
    offset = start - centre
    along = (offset * direction).sum(axis=1)
    across = offset - along[:, None] * direction
    inside = 1.0 - (across**2).sum(axis=1) / radius**2
    return -along - radius * np.sqrt(np.maximum(inside, 0.0)), inside


@settings(max_examples=25)
@given(seed=seeds, scale=st.sampled_from([1e-6, 1e-3, 1.0, 30.0]), level=st.integers(1, 3))
def test_rays_meet_a_sphere_where_it_is(seed, scale, level):
    """Balls of any size and facets, anywhere: each ray that meets the sphere does so, at its distance."""
    rng = np.random.default_rng(seed)
    centre = scale * rng.uniform(-2, 2, 3)
    start = centre + scale * 3.0 * ft.core.unit(rng.normal(size=(200, 3)))
    direction = ft.core.unit(centre + scale * rng.uniform(-1.2, 1.2, (200, 3)) - start)
    scene = ft.Scene([ball(scale, centre, level)])
    paths = ft.trace(scene, ft.Rays(start, direction), max_bounces=1, record=True)
    path, inside = to_sphere(start, direction, centre, scale)
    clear = np.abs(inside) > 1e-6  # grazing rays are decided by rounding
    np.testing.assert_array_equal((paths.bounces > 0)[clear], (inside > 0.0)[clear])
    hit = np.flatnonzero(clear & (inside > 0.0))
    found = (paths.length[hit] - path[hit]) * np.sqrt(inside[hit]) / scale
    np.testing.assert_allclose(found, 0.0, rtol=0, atol=HIT)
    offset = paths.points[hit, 1] - centre
    np.testing.assert_allclose(np.linalg.norm(offset, axis=1) / scale, 1.0, rtol=0, atol=HIT)


@pytest.mark.parametrize("level", [1, 3])
def test_rays_inside_a_ball_leave_through_the_other_side(level):
    """Chords of a sphere of index 1: in and out once, though the facets cut off a part of most chords."""
    rng = np.random.default_rng(level)
    start = np.column_stack([rng.uniform(-0.999, 0.999, (400, 2)), np.full(400, 2.0)])
    start = start[np.hypot(start[:, 0], start[:, 1]) < 0.999]
    glass = ball(1.0, (0.0, 0.0, 0.0), level, ft.Dielectric("transmitted"), back=1.0)
    rays = ft.Rays(start, np.tile([0.0, 0.0, -1.0], (len(start), 1)))
    paths = ft.trace(ft.Scene([glass]), rays, record=True)
    assert (paths.bounces == 2).all()
    depth = np.sqrt(1.0 - start[:, 0] ** 2 - start[:, 1] ** 2)
    np.testing.assert_allclose(paths.points[:, 1, 2] * depth, depth**2, rtol=0, atol=HIT)
    np.testing.assert_allclose(paths.points[:, 2, 2] * depth, -(depth**2), rtol=0, atol=HIT)


def test_a_form_hides_what_is_behind_it_and_no_more():
    """A plate just behind a ball, and one that the sphere stands out of though the facets do not."""
    plate = ft.Surface(shapes.plate(4.0, 4.0).moved((0, 0, 0.999)), ft.Absorber(), "plate")
    scene = ft.Scene([ball(1.0, (0.0, 0.0, 0.0), 1), plate])
    radii = np.array([0.0, 0.02, 0.04, 0.05, 0.1, 0.9])
    start = np.column_stack([radii, np.zeros(6), np.full(6, 2.0)])
    paths = ft.trace(scene, ft.Rays(start, np.tile([0, 0, -1.0], (6, 1))), max_bounces=1, record=True)
    above = np.sqrt(1.0 - radii**2) > 0.999
    np.testing.assert_array_equal(paths.surface[:, 0], np.where(above, 0, 1))


def test_forms_are_fitted_once_a_scene_and_know_their_longest_side():
    scene = ft.Scene(
        [ft.Surface(shapes.plate(1, 1).moved((0, 0, -3)), ft.Mirror(), "flat"), ball(1.0, (0, 0, 0))]
    )
    engine = embree.build(scene, frozenset({1}))
    (form,) = on_forms.formed(scene, engine)
    assert on_forms.formed(scene, engine)[0] is form
    assert form.surface == 1
    corners = scene.surfaces[1].mesh.vertices[scene.surfaces[1].mesh.faces]
    assert form.side == np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()


def test_a_form_that_is_passed_over_is_not_met():
    scene = ft.Scene([ball(1.0, (0.0, 0.0, 0.0))])
    rays = ft.Rays([(0.1, 0.2, 2.0)], [(0.0, 0.0, -1.0)], passes=("ball",))
    assert ft.trace(scene, rays).fate.tolist() == [ft.Fate.LEFT]
