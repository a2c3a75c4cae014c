"""Lenses by form: exact rays, published focal lengths, a rival program, equal paths."""

import json
import math
from dataclasses import replace
from pathlib import Path

import mpmath
import numpy as np
import pytest
from sequential import Face, crossing, trace as exact

import fringetrace as ft
from fringetrace import mm
from fringetrace.core.vectors import rotation
from fringetrace.instruments import lenses

INF = math.inf
N = 1.5168
# Printed digits of back focal lengths, computed with mpmath; millimetres.
PRINTED = 5.1e-10
# Faces (radius, thickness, index), and back focal length over the height of the ray; 0: next to the axis.
TABLE = {
    "flat first": (
        [(INF, 4.0, N), (-51.68, 0.0, 1.0)],
        {0: 100.000000000, 1: 99.956922135, 5: 98.918695457, 10: 95.618161341},
    ),
    "convex first": (
        [(51.68, 4.0, N), (INF, 0.0, 1.0)],
        {0: 97.362869198, 1: 97.351978737, 5: 97.089884306, 10: 96.261677654},
    ),
    "biconvex": (
        [(103.36, 4.0, N), (-103.36, 0.0, 1.0)],
        {0: 99.336341917, 1: 99.320582649, 5: 98.941089235, 10: 97.739112918},
    ),
    "ball": (
        [(5.0, 10.0, 1.5), (-5.0, 0.0, 1.0)],
        {0: 2.5, 1: 2.416160093, 2: 2.158222349, 3: 1.703901493},
    ),
}
# Height of a ray next to the axis: its focus is off by some h^2 / f.
PARAXIAL = 1e-6
# Some tens of roundings of float64, relative to the path.
ROUNDING = 1e-14
# What facets do beyond their sag: rays that they turn take other ways through the glass.
SECOND = 0.1
THROUGH = ft.Dielectric(follow="transmitted")
RIVAL = json.loads((Path(__file__).parents[1] / "data" / "optiland.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("lens", TABLE)
def test_the_exact_tracer_prints_the_table(lens):
    faces, table = TABLE[lens]
    heights = [(height or PARAXIAL, 0, -10) for height in table]
    points, directions, _ = exact(
        [Face(*face) for face in faces], heights, [(0, 0, 1)] * len(table), digits=30
    )
    found = crossing(points, directions) - sum(thickness for _, thickness, _ in faces)
    assert [float(v) for v in found] == pytest.approx(list(table.values()), abs=PRINTED)


def test_the_exact_tracer_finds_the_paths_to_a_focus_equal():
    index, focus = mpmath.mpf(3) / 2, 20
    faces = [Face(INF, 8, index), Face(-(index - 1) * focus, focus, 1, -index * index)]
    points, _, path = exact(faces, [(h, 0, -10) for h in (0, 1, 5, 9)], [(0, 0, 1)] * 4, digits=40)
    assert max(abs(path - 42)) < 1e-36
    assert max(abs(points[:, 0])) < 1e-28


@pytest.mark.parametrize("lens", RIVAL["lenses"])
def test_the_exact_tracer_agrees_with_optiland(lens):
    """Two programs that know nothing of each other; both have 16 digits of 100 mm."""
    there = RIVAL["lenses"][lens]
    faces = [Face(INF if radius is None else radius, *more) for radius, *more in there["faces"]]
    end, out, path = exact(faces, RIVAL["points"], RIVAL["directions"])
    assert np.abs(path - there["path"]).max() < 1e-12
    assert np.abs(end - there["end"]).max() < 1e-12
    assert np.abs(out - there["out"]).max() < 1e-14
    in_full, _, _ = exact(faces, RIVAL["points"][:4], RIVAL["directions"][:4], digits=30)
    assert np.abs((in_full - end[:4]).astype(float)).max() < 1e-12


def system(faces, diameter, **more):
    """A lens in metres of faces in millimetres."""
    radii, thicknesses, indices = zip(*faces, strict=True)
    return lenses.lens(
        [radius * mm for radius in radii], [thickness * mm for thickness in thicknesses[:-1]], indices[:-1],
        diameter * mm, interface=THROUGH, **more,
    )  # fmt: skip


def landed(paths, z):
    """Where rays cross a plane across the axis, and the optical path to there; beyond the glass."""
    way = (z - paths.origin[:, 2]) / paths.direction[:, 2]
    return paths.origin + way[:, None] * paths.direction, paths.length + way


@pytest.mark.parametrize("lens", TABLE)
def test_traced_focal_lengths_to_the_printed_digits(lens):
    faces, table = TABLE[lens]
    ball = lenses.ball(10 * mm, 1.5, centre=(0, 0, 5 * mm), interface=THROUGH)
    surfaces = [ball] if lens == "ball" else system(faces, 25.4)
    start = [((height or PARAXIAL) * mm, 0.0, -10 * mm) for height in table]
    paths = ft.trace(ft.Scene(surfaces), ft.Rays(start, [(0.0, 0.0, 1.0)] * len(table)))
    assert (paths.bounces == 2).all()
    found = crossing(paths.origin, paths.direction) - sum(thickness for _, thickness, _ in faces) * mm
    assert found / mm == pytest.approx(list(table.values()), abs=PRINTED)


@pytest.mark.parametrize("lens", RIVAL["lenses"])
def test_singlet_and_doublet_agree_with_optiland(lens):
    """To 1e-9 m is asked; what is left is rounding, of both."""
    there = RIVAL["lenses"][lens]
    faces = [(INF if radius is None else radius, *more) for radius, *more in there["faces"]]
    rays = ft.Rays(np.array(RIVAL["points"]) * mm, RIVAL["directions"])
    paths = ft.trace(ft.Scene(system(faces, 25.4)), rays)
    end, length = landed(paths, sum(thickness for _, thickness, _ in faces) * mm)
    assert np.abs(length - np.array(there["path"]) * mm).max() < ROUNDING * 0.1
    assert np.abs(end - np.array(there["end"]) * mm).max() < ROUNDING * 0.1
    assert np.abs(paths.direction - there["out"]).max() < ROUNDING


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.6, 0.0, -0.8)])
def test_aspheres_of_three_glasses_as_mpmath_has_them(axis):
    """A cemented triplet with conics and terms, anywhere in space, on skew rays."""
    faces = [
        Face(30.0, 5.0, 1.5168, -0.6, (1e-6, -4e-9)),
        Face(-45.0, 2.0, 1.6727, 0.5, (2e-6,)),
        Face(60.0, 4.0, 1.62, -2.0),
        Face(-80.0, 20.0, 1.0, 0.0, (-1e-6, 2e-8, 1e-11)),
    ]
    points, directions = np.array(RIVAL["points"]), np.array(RIVAL["directions"])
    end, out, path = (v.astype(float) for v in exact(faces, points, directions, digits=30))
    place = np.array([0.02, -0.01, 0.03])
    turn = rotation(np.cross((0, 0, 1), axis), math.acos(axis[2])) if axis[0] else np.eye(3)
    surfaces = lenses.lens(
        [face.radius * mm for face in faces], [face.thickness * mm for face in faces[:-1]],
        [face.index for face in faces[:-1]], 22 * mm, conics=[face.conic for face in faces],
        terms=[[a * mm ** (-3 - 2 * i) for i, a in enumerate(face.terms)] for face in faces],
        vertex=place, axis=axis, interface=THROUGH,
    )  # fmt: skip
    rays = ft.Rays(points * mm @ turn.T + place, directions @ turn.T)
    paths = ft.trace(ft.Scene(surfaces), rays)
    assert (paths.bounces == 4).all()
    way = np.linalg.norm(end * mm @ turn.T + place - paths.origin, axis=1)
    assert np.abs(paths.length + way - path * mm).max() < ROUNDING * 0.1
    assert np.abs(paths.direction - out @ turn.T).max() < ROUNDING


def test_a_plano_hyperbola_has_equal_paths_to_its_focus():
    surfaces = lenses.plano_hyperbola(20 * mm, 1.5, 8 * mm, 1.5, 20 * mm, interface=THROUGH)
    beam = ft.Beam((0, 0, -10 * mm), (0, 0, 1), (0, 1, 0), (13 * mm, 13 * mm), (40, 40))
    paths = ft.trace(ft.Scene(surfaces), beam)
    assert (paths.bounces == 2).all()
    end, length = landed(paths, 28 * mm)
    assert np.abs(length - 42 * mm).max() < 1e-14 * 42 * mm
    assert np.abs(end[:, :2]).max() < ROUNDING * 28 * mm


def test_light_goes_back_the_way_it_came():
    faces = [(62.8, 4.0, 1.5168), (-45.7, 2.5, 1.6727), (-128.2, 97.225, 1.0)]
    scene = ft.Scene(system(faces, 25.4))
    rays = ft.Rays(np.array(RIVAL["points"]) * mm, RIVAL["directions"])
    paths = ft.trace(scene, rays)
    end, length = landed(paths, 0.05)
    back = ft.trace(scene, ft.Rays(end, -paths.direction))
    assert (back.bounces == 3).all()
    assert back.direction == pytest.approx(-rays.direction, abs=ROUNDING)
    start, whole = landed(back, -10 * mm)
    assert start == pytest.approx(rays.origin, abs=ROUNDING * 0.1)
    assert whole == pytest.approx(length, abs=ROUNDING * 0.1)


def test_a_mirror_on_the_back_of_a_lens():
    """Mangin's: a meniscus silvered behind; a ray along the axis comes back with the path it must have."""
    surfaces = lenses.lens(
        (-80 * mm, -120 * mm), (4 * mm,), (N,), 25 * mm, interface=(THROUGH, ft.Mirror()), edge=ft.Absorber()
    )
    paths = ft.trace(ft.Scene(surfaces), ft.Rays([(0, 0, -10 * mm)], [(0, 0, 1)]))
    assert paths.bounces[0] == 3
    assert paths.length[0] == pytest.approx((10 + 2 * 4 * N) * mm, rel=ROUNDING)


def test_light_beside_the_faces_ends_at_the_edge():
    surfaces = system(TABLE["biconvex"][0], 25.4)
    depth = surfaces[2].mesh.bounds[:, 2].mean()
    rays = ft.Rays([(0.05, 0.0, depth)], [(-1.0, 0.0, 0.0)])
    paths = ft.trace(ft.Scene(surfaces), rays)
    assert paths.fate[0] == ft.Fate.ABSORBED
    assert paths.length[0] == pytest.approx(0.05 - 12.7 * mm, rel=ROUNDING)


@pytest.mark.slow
def test_facets_cost_what_their_sag_does_to_a_path():
    """(n1 cos i - n2 cos t) times how far the facets stand behind the form, summed over both faces."""
    rng = np.random.default_rng(41)
    start = np.stack([*rng.uniform(-6 * mm, 6 * mm, (2, 2000)), np.full(2000, -10 * mm)], axis=1)
    rays, largest = ft.Rays(start, np.tile([0.0, 0.0, 1.0], (2000, 1))), []
    for rings in (16, 32, 64):
        lens = system([(30.0, 4.0, N), (-30.0, 0.0, 1.0)], 20.0, rings=rings)
        smooth = ft.trace(ft.Scene(lens), rays, record=True)
        flat = ft.trace(ft.Scene([replace(surface, form=None) for surface in lens]), rays, record=True)
        assert (flat.bounces == 2).all()
        (there, length), (here, expected) = landed(flat, 5 * mm), landed(smooth, 5 * mm)
        # the wave behind the smooth lens, looked at where the other ray is
        error = length - expected - np.einsum("ij,ij->i", there - here, smooth.direction)
        inside = smooth.points[:, 2] - smooth.points[:, 1]
        inside /= np.linalg.norm(inside, axis=1, keepdims=True)
        waves = [rays.direction, N * inside, smooth.direction]
        law = np.zeros(2000)
        for i in range(2):
            height, normal, _ = lens[i].form.level(flat.points[:, i + 1], rays.direction)
            _, across, _ = lens[i].form.level(smooth.points[:, i + 1], rays.direction)
            change = np.einsum("ij,ij->i", waves[i + 1] - waves[i], across)
            law -= change * height / np.einsum("ij,ij->i", normal, normal)
        assert np.abs(error - law).max() < SECOND * np.abs(law).max()
        largest.append(np.sqrt(np.mean(error**2)))
    assert largest[0] / largest[1] == pytest.approx(4.0, rel=0.05)
    assert largest[1] / largest[2] == pytest.approx(4.0, rel=0.05)
