"""Edges of meshes: which there are, and from where on the beam light comes by them."""

import math

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm
from fringetrace.field.wavefront import feature_edges
from fringetrace.geometry import forms, shapes
from fringetrace.tracing.paths import Paths

# Rays go by an edge this far on either side of it.
SIDE = feature_edges.SIDE


def mirror(mesh, form=None):
    return ft.Surface(mesh, ft.Mirror(), "mirror", form=form)


def nodes(surfaces, count=8, size=4 * mm) -> tuple[Paths, tuple[int, int]]:
    """Paths from the nodes of a beam straight down, and how many nodes there are."""
    tall = count + 1
    wide = size * tall / count
    beam = ft.Beam((0, 0, 9 * mm), (0, 0, -1), (0, 1, 0), (wide, wide), (tall, tall))
    ccd = ft.CCD((0, 0, 12 * mm), (0, 0, -1), (0, 1, 0), 0.1 * mm, (64, 64))
    return ft.trace(ft.Scene(surfaces), beam, ccd, record=True), (tall, tall)


def lengths(found):
    return np.sort(np.linalg.norm(found.ends[:, 1] - found.ends[:, 0], axis=1))


def test_a_plate_has_four_edges_and_no_diagonal():
    found = feature_edges.creases(ft.Scene([mirror(shapes.plate(2 * mm, 1 * mm))]))
    assert lengths(found) == pytest.approx([1 * mm, 1 * mm, 2 * mm, 2 * mm])
    assert np.isnan(found.normals).all()


def test_a_step_has_its_riser():
    found = feature_edges.creases(ft.Scene([mirror(shapes.step(2 * mm, 1 * mm, 0, 0.1 * mm))]))
    # two treads with three rims each, the riser's two short sides, and both folds
    assert len(found.ends) == 10


def test_a_closed_form_has_silhouettes_alone():
    ball = mirror(shapes.icosphere(1 * mm, 3), forms.Sphere((0, 0, 0), 1 * mm))
    found = feature_edges.creases(ft.Scene([ball]))
    assert np.isfinite(found.normals).all()
    along = np.array([0.36, 0.48, -0.8])
    outline = found.seen_along(along)
    assert 0 < len(outline) < len(found.ends) / 10
    # around a great circle, no farther off than a facet is wide, in zigzag at up to 60 degrees
    assert np.abs(outline @ along).max() < np.linalg.norm(np.diff(outline, axis=1), axis=2).max()
    around = np.linalg.norm(np.diff(outline, axis=1), axis=2).sum() / (2 * math.pi * mm)
    assert 0.95 < around < 2.0


def test_edges_are_kept_with_their_scene():
    scene = ft.Scene([mirror(shapes.plate(2 * mm, 1 * mm))])
    assert feature_edges.creases(scene) is feature_edges.creases(scene)


def test_rays_go_by_an_edge_on_either_side():
    """A plate to the right of x = 0.3 mm: 0.6 cells right of the middle, which is node 4."""
    plate = mirror(shapes.plate(6 * mm, 60 * mm).moved((3.3 * mm, 0, 1 * mm)))
    floor = mirror(shapes.plate(60 * mm, 60 * mm))
    paths, shape = nodes([floor, plate])
    at, goes_on = feature_edges.places_beside_edges(paths, shape, 1000)
    edge = 4.0 + 0.3 / 0.5
    first = np.abs(np.abs(at[:, 0] - edge) - SIDE) < 1e-9
    assert first.all()
    assert (at[:, 0] > edge).sum() == (at[:, 0] < edge).sum()
    # along all of the grid, half a cell apart
    here = np.sort(at[at[:, 0] > edge][:, 1])
    assert here[0] < 2 * SIDE
    assert here[-1] > 8 - 2 * SIDE
    assert np.diff(here).max() <= feature_edges.SPACING
    follows = at[1:][goes_on[:-1]] - at[:-1][goes_on[:-1]]
    assert np.abs(follows[:, 0]).max() < 1e-9
    assert np.abs(follows[:, 1]).max() <= feature_edges.SPACING


def test_edges_beside_the_beam_cost_nothing():
    paths, shape = nodes([mirror(shapes.plate(60 * mm, 60 * mm))])
    at, goes_on = feature_edges.places_beside_edges(paths, shape, 1000)
    assert at.shape == (0, 2)
    assert goes_on.shape == (0,)


def test_no_more_places_than_asked_for():
    paths, shape = nodes([mirror(shapes.staircase(4 * mm, 60 * mm, 6, 0.01 * mm))])
    every, _ = feature_edges.places_beside_edges(paths, shape, 10_000)
    assert len(every) > 50
    some, goes_on = feature_edges.places_beside_edges(paths, shape, 50)
    assert len(some) == 50
    assert not goes_on.any()


def test_a_leg_off_a_curved_mirror_is_followed_back():
    """A point that light passes after a paraboloid, back to where it started: x F / (F - z) off the axis."""
    focus, up = 50 * mm, 6 * mm
    along = (np.arange(41) - 20) * 0.2 * mm
    mesh = shapes.height_map((along**2 + along[:, None] ** 2) / (4 * focus), 0.2 * mm)
    form = forms.Conic((0, 0, 0), (0, 0, 1), 2 * focus, conic=-1.0)
    tape = ft.Surface(shapes.plate(0.2 * mm, 60 * mm).moved((1 * mm, 0, up)), ft.Absorber(), "tape")
    paths, shape = nodes([mirror(mesh, form), tape])
    last = [leg for leg, _ in feature_edges.segments_near_edges(paths, shape) if np.isinf(leg.reach).all()]
    at, there, near = last[0].nearest(np.array([[0.5 * mm, 0.25 * mm, up]]))
    assert there.all()
    assert near.all()
    r = np.hypot(0.5, 0.25) * mm
    start = 2 * focus * np.tan(0.5 * np.arctan(r / (focus - up)))
    expected = 4.0 + np.array([0.5, 0.25]) * mm * start / r / (0.5 * mm)
    # a paraboloid of f / 12 bends the map by 1e-4 of a cell
    assert at[0] == pytest.approx(expected, abs=1e-3)
