"""Errors of recorded hits: how far they are off, how surfaces bend there, what facets leave out."""

from dataclasses import replace

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.accuracy import path_errors
from fringetrace.core.vectors import rotation, unit
from fringetrace.geometry import forms, shapes
from fringetrace.tracing.segments import surface_hits

EPS = float(np.finfo(np.float64).eps)


def ball(form, radius=0.1, centre=(0.3, -0.2, 0.5), level=3):
    mesh = shapes.icosphere(radius, level).moved(centre)
    scene = ft.Scene([ft.Surface(mesh, ft.Mirror(), "ball", form=form)])
    beam = ft.Beam(np.add(centre, (0, 0, 0.5)), (0, 0, -1), (0, 1, 0), (0.06, 0.06), (20, 21))
    ccd = ft.CCD(np.add(centre, (0, 0, 0.4)), (0, 0, -1), (0, 1, 0), 0.01, (200, 200))
    return ft.trace(scene, beam, ccd, record=True).detected


SPHERE = forms.Sphere((0.3, -0.2, 0.5), 0.1)


def test_hits_are_off_their_facets_by_roundings():
    for form in (None, SPHERE):
        (hits,) = surface_hits(ball(form))
        assert hits.formed.all() == (form is not None)
        offset = np.linalg.norm(path_errors.hit_offsets(hits).astype(float), axis=1)
        assert 0.0 < offset.max() < 4 * EPS


def test_a_hit_that_is_off_is_seen():
    paths = ball(None)
    (hits,) = surface_hits(paths)
    normal = hits.normal
    lifted = replace(hits, point=hits.point + 5 * nm * normal)
    np.testing.assert_allclose(
        path_errors.hit_offsets(lifted).astype(float), 5 * nm * normal, rtol=0, atol=4 * EPS
    )


FORMS = {
    "sphere": (SPHERE, 1.0, 1.0),
    "cylinder": (forms.Cylinder((0.3, 0.0, 0.5), (0, 1, 0), 0.1), 1.0, 0.0),
    "ellipsoid": (forms.Conic((0.3, -0.2, 0.4), (0, 0, 1), 0.1, 0.0), 1.0, 1.0),
}


@pytest.mark.parametrize("name", FORMS)
def test_curvature_is_that_of_the_form(name):
    form, across, along = FORMS[name]
    if name == "cylinder":
        mesh = shapes.rod_lattice(1, 1, 0.1, 0.3, 0.4, sides=90).moved((0.3, -0.2, 0.5))
    else:
        mesh = shapes.icosphere(0.1, 3).moved((0.3, -0.2, 0.5))
    scene = ft.Scene([ft.Surface(mesh, ft.Mirror(), form=form)])
    rays = ft.Rays([(0.3, -0.2, 1.0), (0.32, -0.21, 1.0)], [(0, 0, -1.0)] * 2)
    paths = ft.trace(scene, rays, max_bounces=1, record=True)
    (hits,) = surface_hits(paths)
    bend, normal = path_errors.curvature(hits), hits.normal
    np.testing.assert_allclose(np.einsum("nij,nj->ni", bend, normal), 0.0, atol=1e-9)
    if name == "ellipsoid":
        normal = -normal  # heights grow inwards
        bend = -bend
    np.testing.assert_allclose(bend[0] * 0.1, np.diag([across, along, 0.0]), atol=1e-9)
    # n(p + dp) = n + C dp
    moved = replace(hits, point=hits.point + 1e-6 * unit(np.cross(normal, (0, 1.0, 0.2))))
    turned = (moved.normal * np.sign((moved.normal * normal).sum(1))[:, None] - normal) / 1e-6
    step = unit(np.cross(normal, (0, 1.0, 0.2)))
    np.testing.assert_allclose(turned, np.einsum("nij,nj->ni", bend, step), atol=1e-3)


def test_patches_bend_like_the_ball_they_were_made_for():
    for form, near in ((forms.Smooth(), 0.1), (None, None)):
        (hits,) = surface_hits(ball(form, level=4))
        bend = path_errors.curvature(hits) * 0.1
        values = np.sort(np.linalg.eigvalsh(bend), axis=1)
        if form is None:
            assert (bend == 0.0).all()
        else:
            np.testing.assert_allclose(np.abs(values), np.tile([0.0, 1.0, 1.0], (len(bend), 1)), atol=near)


def test_facets_leave_out_what_a_form_gives():
    (plain,) = surface_hits(ball(None))
    height, lean = path_errors.flattening(plain)
    assert np.linalg.norm(height, axis=1).max() == pytest.approx(0.1 * 4.528e-3, rel=0.1)
    assert np.linalg.norm(lean, axis=1).max() > 0.05
    (formed,) = surface_hits(ball(SPHERE))
    assert not np.any(path_errors.flattening(formed))


@pytest.mark.parametrize("longer", [0.0, 3 * nm])
def test_rounding_is_what_the_path_lacks(longer):
    """A path made longer by 3 nm is off by 3 nm, for beams and for rays that bring a path along."""
    turn = rotation((1, 2, 3), 0.7)
    scene = ft.Scene([ft.Surface(shapes.plate(1.0, 1.0).moved(turn=turn), ft.Mirror())])
    rays = ft.Rays([(0.1, 0.0, 1.0), (0.0, 0.1, 1.0)], [(0, 0, -1.0)] * 2, length=[0.5, 0.25])
    beam = ft.Beam((0, 0, 1), (0, 0, -1), (0, 1, 0), (1 * mm, 1 * mm), (3, 3))
    for source in (rays, beam):
        paths = ft.trace(scene, source, record=True)
        error = path_errors.rounding(replace(paths, length=paths.length + longer))
        np.testing.assert_allclose(error, longer, rtol=0, atol=16 * EPS)
