"""Derivatives of the optical path: what it does to move a surface along its normal."""

import numpy as np

import fringetrace as ft
from fringetrace import nm
from fringetrace.geometry import forms, shapes
from fringetrace.tracing.segments import Segments, surface_hits
from fringetrace.tracing.sensitivity import leverage, path_change


def ball(form, radius=0.1, centre=(0.3, -0.2, 0.5), level=3):
    mesh = shapes.icosphere(radius, level).moved(centre)
    scene = ft.Scene([ft.Surface(mesh, ft.Mirror(), "ball", form=form)])
    beam = ft.Beam(np.add(centre, (0, 0, 0.5)), (0, 0, -1), (0, 1, 0), (0.06, 0.06), (20, 21))
    ccd = ft.CCD(np.add(centre, (0, 0, 0.4)), (0, 0, -1), (0, 1, 0), 0.01, (200, 200))
    return ft.trace(scene, beam, ccd, record=True).detected


SPHERE = forms.Sphere((0.3, -0.2, 0.5), 0.1)


def test_a_mirror_moved_along_its_normal_changes_the_path_by_twice_the_cosine():
    paths = ball(SPHERE)
    (hits,) = surface_hits(paths)
    change = path_change(Segments.of(paths), hits, 1 * nm * hits.normal)
    cosine = np.abs(hits.normal[:, 2])
    # a hit in front of the mirror has a path that is too short
    np.testing.assert_allclose(change.astype(float), -2 * nm * cosine, rtol=1e-12)


def test_a_mirror_turns_rays_by_twice_its_own_turn_and_glass_by_less():
    paths = ball(None)
    (hits,) = surface_hits(paths)
    np.testing.assert_allclose(leverage(Segments.of(paths), hits), 2.0, rtol=1e-12)
    face = ft.Surface(shapes.plate(1.0, 1.0), ft.Dielectric("transmitted"), "face", back=1.5)
    straight = ft.trace(ft.Scene([face]), ft.Rays([(0, 0, 1.0)], [(0, 0, -1.0)]), record=True)
    (hits,) = surface_hits(straight)
    # n' - n over n', at normal incidence
    np.testing.assert_allclose(leverage(Segments.of(straight), hits), 1.0 / 3.0, rtol=1e-12)
