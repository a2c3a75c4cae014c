"""Edges on the beam's grid: bent ones become strips, areas add up, and names tell what hangs together."""

import math
from dataclasses import replace

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm
from fringetrace.field.wavefront import boundary_search, curved_waves, patch_fit, quadtree, visibility
from fringetrace.geometry import forms, shapes
from fringetrace.scene import facet_groups

HENE = 632.8e-9
# An edge is known to 1e-4 of a pixel over its length.
EDGE = quadtree.PIXEL


def shadow(count=12, pixels=60):
    """A plane mirror of 4 mm with a form, in the shadow of a ball of 1 mm; and the paths on a CCD."""
    plane = ft.Surface(
        shapes.plate(4 * mm, 4 * mm), ft.Mirror(), "plane", form=forms.Conic((0, 0, 0), (0, 0, 1), np.inf)
    )
    place = (0.1 * mm, 0.2 * mm, 6 * mm)
    ball = ft.Surface(
        shapes.icosphere(1 * mm, 3).moved(place), ft.Absorber(), "ball", form=forms.Sphere(place, 1 * mm)
    )
    beam = ft.Beam((0, 0, 9 * mm), (0, 0, -1), (0, 1, 0), (3 * mm, 3 * mm), (count, count))
    ccd = ft.CCD((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), 3.2 * mm / pixels, (pixels, pixels))
    return ft.trace(ft.Scene([plane, ball]), beam, ccd)


def cut(paths):
    seen = visibility.survey(paths)
    lit = seen.corners(0)
    row, column = np.nonzero(visibility.widened(lit.any(axis=-1)))
    low = np.stack([column, row], axis=1).astype(float)
    scale = np.full(len(row), 60 / 12)
    cells = quadtree.Squares(
        np.zeros(len(row), dtype=int), row * lit.shape[1] + column, scale, low, lit[row, column], 1.0
    )
    return seen, boundary_search.cut(seen.probe, seen.names, cells)


def test_a_round_shadow_leaves_the_rest_of_the_beam():
    _, pieces = cut(shadow())
    _, _, along, bottom, top = patch_fit._trapezoids(pieces)
    area = (0.5 * (along[:, 1] - along[:, 0]) * (top - bottom).sum(axis=1)).sum()
    cell = 3 * mm / 12
    assert len(pieces.low) < 2000
    # strips are some tenths of a pixel, a fifth of a cell, long: off by a few times EDGE at most
    circle = 2 * math.pi * mm / cell
    assert area == pytest.approx(144 - math.pi * (mm / cell) ** 2, abs=circle * 3 * EDGE / 5)


def test_chords_are_lit_to_their_left():
    seen, pieces = cut(shadow())
    begin, end = np.moveaxis(pieces.chord[pieces.cut], 1, 0)
    along = end - begin
    left = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    middle, names = 0.5 * (begin + end), np.repeat(seen.names, len(begin))
    assert seen.probe.lit(middle + 1e-3 * left, names).all()
    assert not seen.probe.lit(middle - 1e-3 * left, names).any()


def test_fits_are_made_of_light_only():
    """Every ray of a fit starts where the pieces are lit, and spreads over all of it."""
    seen, pieces = cut(shadow())
    part = pieces.part(~pieces.whole)
    cells, owner = np.unique(part.cell, return_inverse=True)
    at, low, high = patch_fit.places(part, owner, len(cells))
    there = (high - low > 1e-6).all(axis=1)  # an edge through a node leaves pieces of no size
    assert there.sum() > 25
    at, low, high = at[there], low[there], high[there]
    assert seen.probe.lit(at.reshape(-1, 2), np.repeat(seen.names, at.size // 2)).mean() > 0.999
    assert ((at >= low[:, None]) & (at <= high[:, None])).all()
    assert (np.ptp(at, axis=1) / (high - low)).mean() > 0.9


def test_names_follow_the_form_and_its_parts():
    one = shapes.icosphere(1 * mm, 2)
    two = ft.Mesh(
        np.vstack([one.vertices, one.vertices + np.array([3 * mm, 0, 0])]),
        np.vstack([one.faces, one.faces + len(one.vertices)]),
    )
    surface = ft.Surface(two, ft.Mirror(), "balls", form=forms.Smooth())
    (parts,) = facet_groups.group_facets(ft.Scene([surface]))
    assert (parts < 0).all()
    assert len(np.unique(parts)) == 2
    assert (np.diff(parts)[: len(one.faces) - 1] == 0).all()


def test_the_caps_of_a_rod_are_facets():
    angle = 2 * math.pi * np.arange(24) / 24
    mesh = shapes.extrude(np.stack([np.cos(angle), np.sin(angle)], axis=1) * mm, 2 * mm, closed=True)
    rod = ft.Surface(mesh, ft.Mirror(), "rod", form=forms.Cylinder((0, 0, 0), (0, 1, 0), 1 * mm))
    (parts,) = facet_groups.group_facets(ft.Scene([rod]))
    caps = parts[parts >= 0]
    assert len(np.unique(caps)) == 2
    assert len(np.unique(parts[parts < 0])) == 1


def test_without_half_wave_loss_a_curved_sheet_changes_its_sign():
    paths = shadow(6, 16)
    with_loss = ft.complex_field(paths, HENE, "wavefront")
    without = ft.complex_field(paths, HENE, "wavefront", half_wave_loss=False)
    assert np.abs(with_loss).max() == pytest.approx(1.0, abs=1e-6)
    assert without == pytest.approx(-with_loss, abs=1e-12)


def test_a_profile_is_that_of_the_beam():
    waist = 0.8 * mm
    paths = shadow(16, 32)
    gaussian = replace(paths.source, profile=ft.Gaussian(waist))
    image = ft.irradiance(ft.trace(paths.scene, gaussian, paths.ccd), HENE)
    x = (np.arange(33) - 16) * paths.ccd.pitch
    line = np.diff([waist * math.sqrt(math.pi / 8) * math.erf(math.sqrt(2) * at / waist) for at in x])
    expected = np.outer(line, line) / paths.ccd.pitch**2
    x = x[:-1] + 0.5 * paths.ccd.pitch
    clear = (np.hypot(x - 0.1 * mm, x[:, None] - 0.2 * mm) > 1.15 * mm) & (abs(x) < 1.4 * mm)
    clear &= (abs(x) < 1.4 * mm)[:, None]
    # cells are a quarter of a waist: 4^-4 / 384 times the fourth derivative, 12; twice that for the square
    assert image[clear] == pytest.approx(expected[clear], abs=2.5e-4)
    assert expected[clear].max() > 0.05


def test_without_curved_sheets_there_are_none():
    plain = ft.Scene([ft.Surface(shapes.plate(4 * mm, 4 * mm), ft.Mirror())])
    paths = shadow(4, 8)
    found, segments = curved_waves.curved(visibility.survey(ft.trace(plain, paths.source, paths.ccd)))
    assert found == []
    assert len(segments) == 0
