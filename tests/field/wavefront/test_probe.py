"""Probes: names of the ways that light takes, parts of surfaces, profiles of beams."""

import numpy as np
import pytest
from taped import tape, traced

import fringetrace as ft
from fringetrace import mm
from fringetrace.field.wavefront import probe as probes, visibility
from fringetrace.geometry import forms, shapes
from fringetrace.scene import facet_groups


def probe(*blockers):
    return visibility.survey(traced(*blockers)).probe


def test_a_probe_tells_where_light_takes_a_sequence():
    look = probe(tape(0.25 * mm, 0.5 * mm))  # dark from column 3 to 4
    at = np.array([[1.0, 1.0], [2.99, 3.0], [3.01, 3.0], [3.99, 3.0], [4.01, 3.0]])
    _, rows, names, curved = look.paths(at)
    assert len(rows) == 3
    assert len(np.unique(names)) == 1
    assert not curved.any()
    assert look.lit(at, np.repeat(names[:1], 5)).tolist() == [True, True, False, False, True]
    assert not look.lit(at, np.repeat(names[:1] + np.uint64(1), 5)).any()
    assert look.lit(at[:0], names[:0]).shape == (0,)


def test_rays_at_the_rim_start_within_it():
    paths, rows, _, _ = probe().paths(np.array([[0.0, 0.0], [6.0, 6.0], [9.0, -1.0]]))
    assert len(rows) == 3
    assert paths.points[:, 0, :2] == pytest.approx(
        np.array([[-1.5, -1.5], [1.5, 1.5], [1.5, -1.5]]) * mm, abs=1e-9 * mm
    )


def test_names_tell_parts_apart_that_keys_do_not():
    step = ft.Surface(shapes.step(20 * mm, 20 * mm, 0, 0.1 * mm), ft.Mirror(), "flat")
    paths = traced()
    again = ft.trace(ft.Scene([step]), paths.source, paths.ccd)
    look = visibility.survey(again).probe
    at = np.array([[1.0, 1.0], [2.0, 4.0], [5.0, 1.0]])
    found, rows, names, _ = look.paths(at)
    assert len(np.unique(found.key[rows])) == 1
    assert names[0] == names[1] != names[2]


def test_edges_are_known_to_a_part_of_the_scene():
    # 20 mm of scene, cells of half a millimetre
    assert probe().fuzz == pytest.approx(probes.FUZZ * 20 / 0.5 * np.ones(2))


def test_a_uniform_beam_has_the_profile_1():
    beam = traced().source
    assert (probes.profile(beam, np.zeros((3, 2))) == 1.0).all()


def test_a_profile_is_that_of_the_place():
    beam = ft.Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (4 * mm, 2 * mm), (4, 8), profile=lambda x, y: x + 10 * y)
    at = np.array([[0.0, 0.0], [4.0, 2.0], [8.0, 1.0]])
    assert probes.profile(beam, at) == pytest.approx(np.array([-2 - 10, 0, 2 - 5]) * mm)
    constant = ft.Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 1), (1, 1), profile=lambda x, y: 0.5)
    assert probes.profile(constant, at).tolist() == [0.5] * 3


def test_parts_are_kept_with_their_scene():
    scene = ft.Scene([ft.Surface(shapes.plate(2 * mm, 1 * mm), ft.Mirror())])
    assert facet_groups.group_facets(scene) is facet_groups.group_facets(scene)


def test_a_flat_form_is_a_facet():
    """A conic without curvature at its edge still is a form: below 0; plates are 0 or more."""
    plate = shapes.plate(4 * mm, 4 * mm)
    form = forms.Conic((0, 0, 0), (0, 0, 1), np.inf)
    flat, formed = facet_groups.group_facets(
        ft.Scene([ft.Surface(plate, ft.Mirror(), "a"), ft.Surface(plate, ft.Mirror(), "b", form=form)])
    )
    assert (flat == 0).all()
    assert (formed < 0).all()
    assert len(np.unique(formed)) == 1


def test_waves_beside_media_that_absorb_are_not_plane():
    """Each facet stays a part of its own; on metals, and on glass, facets are planes."""
    box = shapes.plate(1.0, 1.0, 0.5)
    smoke = ft.Scene([ft.Surface(box, ft.Dielectric(), "smoke", back=1.5 + 1e-6j)])
    clear = ft.Scene([ft.Surface(box, ft.Dielectric(), "glass", back=1.5)])
    gold = ft.Scene([ft.Surface(box, ft.Metal(), "gold", back="gold")])
    murk = ft.Scene([ft.Surface(box, ft.Mirror(), "mirror")], medium=1.3 + 1e-9j)
    for scene, plane in ((smoke, False), (clear, True), (gold, True), (murk, False)):
        (parts,) = facet_groups.group_facets(scene)
        assert len(np.unique(parts)) == 6
        assert (parts >= 0).all() if plane else (parts < 0).all()
