"""Curved sheets of a traced beam: whole cells, cells on edges, what is drawn of them."""

import math

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, um
from fringetrace.field.wavefront import curved_waves, quadtree, visibility
from fringetrace.geometry import forms, shapes

# An edge is off by so many pixels at most.
EDGE = quadtree.PIXEL


def plane(*blockers, pixels=60, count=6, ccd_at=5 * mm, shift=0.0):
    """A survey of a plane mirror that has a form, 10 mm wide, in a beam of 3 mm; cells of half a mm."""
    form = forms.Conic((0, 0, 0), (0, 0, 1), np.inf)
    flat = ft.Surface(shapes.plate(10 * mm, 10 * mm), ft.Mirror(), "flat", form=form)
    beam = ft.Beam((0, 0, 9 * mm), (0, 0, -1), (0, 1, 0), (3 * mm, 3 * mm), (count, count))
    ccd = ft.CCD((shift, 0, ccd_at), (0, 0, -1), (0, 1, 0), 0.05 * mm, (pixels, pixels))
    return visibility.survey(ft.trace(ft.Scene([flat, *blockers]), beam, ccd))


def screen(left, right):
    width = right - left
    return ft.Surface(
        shapes.plate(width, 20 * mm).moved((0.5 * (left + right), 0, 7 * mm)), ft.Absorber(), "screen"
    )


def test_without_edges_cells_are_those_of_the_grid():
    ((_, sheet),), segments = curved_waves.curved(plane())
    assert len(sheet.coefficients) == 36
    assert (sheet.place == [[i, j] for i in range(6) for j in range(6)]).all()
    assert not sheet.folded.any()
    assert sheet.base == pytest.approx(14 * mm)
    # the rim of the beam, 60 pixels a side, along the rim of the CCD
    length = np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1])
    assert length.sum() == pytest.approx(4 * 60)
    assert length.max() <= 1.0 + 1e-9


def test_cells_on_an_edge_are_cut():
    """A screen from x = 0.2 mm on: 3.4 cells, 34 pixels."""
    ((_, sheet),), segments = curved_waves.curved(plane(screen(0.2 * mm, 5 * mm)))
    cut = sheet.place[:, 0] < 0
    assert cut.sum() == 6
    assert (~cut).sum() == 18
    upright = segments[np.abs(segments[:, 2] - segments[:, 0]) < 0.01]
    at = upright[:, 0]
    edge = at[np.abs(at - 34) < 1]
    assert len(edge) >= 60
    assert edge == pytest.approx(34, abs=EDGE)


def test_a_wire_within_cells_leaves_light_on_both_its_sides():
    """From 3.40 to 3.44 cells, which no node of the grid sees."""
    ((_, sheet),), segments = curved_waves.curved(plane(screen(0.2 * mm, 0.22 * mm)))
    upright = segments[np.abs(segments[:, 2] - segments[:, 0]) < 1e-3]
    for edge in (34.0, 34.4):
        there = upright[np.abs(upright[:, 0] - edge) < 1e-3]
        assert np.abs(there[:, 3] - there[:, 1]).sum() == pytest.approx(60, rel=1e-3)
    assert len(sheet.leaves) > 36


def test_cells_whose_light_passes_the_ccd_by_are_left_out():
    """Only the middle 10 pixels of 60, half a millimetre: two columns and rows of cells, and what is next."""
    ((_, sheet),), _ = curved_waves.curved(plane(pixels=10))
    assert 4 <= len(sheet.coefficients) <= 16
    none, segments = curved_waves.curved(plane(pixels=10, shift=3 * mm))
    assert none == []
    assert segments.shape == (0, 4)


def test_too_few_rays_for_differences_are_fitted():
    """Three nodes a side: no differences of fourth order; a plane is found all the same."""
    ((_, sheet),), _ = curved_waves.curved(plane(count=2))
    assert len(sheet.coefficients) == 4
    x = sheet.coefficients[:, 0, 0, 0]
    assert np.sort(x) == pytest.approx([0, 0, 30, 30], abs=1e-6)


def test_a_form_that_no_light_leaves_has_no_sheet():
    facets = ft.Surface(shapes.plate(10 * mm, 10 * mm), ft.Mirror(), "facets")
    beam = ft.Beam((0, 0, 9 * mm), (0, 0, -1), (0, 1, 0), (3 * mm, 3 * mm), (6, 6))
    ccd = ft.CCD((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), 50 * um, (60, 60))
    found, segments = curved_waves.curved(visibility.survey(ft.trace(ft.Scene([facets]), beam, ccd)))
    assert found == []
    assert segments.shape == (0, 4)


def test_a_round_rim_is_drawn_round():
    """The shadow of a ball of 1 mm: a circle of 20 pixels."""
    place = (0.1 * mm, 0.05 * mm, 7 * mm)
    ball = ft.Surface(
        shapes.icosphere(1 * mm, 3).moved(place), ft.Absorber(), "ball", form=forms.Sphere(place, 1 * mm)
    )
    _, segments = curved_waves.curved(plane(ball))
    middle = np.array([30 + 2.0, 30 + 1.0])
    radius = np.hypot(*(segments[:, :2] - middle).T)
    rim = np.abs(radius - 20) < 0.5
    assert rim.sum() > 100
    # ends of chords lie on the edge, to a part of the 1e-4 of a pixel that chords may be off
    assert radius[rim] == pytest.approx(20, abs=1e-3)
    along = segments[rim]
    around = np.hypot(along[:, 2] - along[:, 0], along[:, 3] - along[:, 1]).sum()
    assert around == pytest.approx(2 * math.pi * 20, rel=1e-3)
