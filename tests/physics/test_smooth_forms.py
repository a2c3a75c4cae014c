"""Curved patches from vertex normals: how near they come to what was meant, and no leak between them."""

import math

import numpy as np
import pytest

import fringetrace as ft
from fringetrace.core.vectors import unit
from fringetrace.geometry import forms, shapes

MIRROR = ft.Mirror()


def directions(rng, count):
    return unit(rng.normal(size=(count, 3)))


def torus(large, small, around, across, kind):
    """A torus about z of so many cells, its front outside; and its exact normals."""
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    if kind == "skew":  # nothing about the grid is symmetric
        u = u + 0.2 * np.sin(2.0 * np.pi * v / across) + 0.15 * np.cos(4 * np.pi * u / around)
        v = v + 0.2 * np.sin(2.0 * np.pi * 3 * u / around)
    a, b = 2.0 * np.pi * u / around, 2.0 * np.pi * v / across
    normal = np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=-1)
    centre = large * np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=-1)
    number = np.arange(around * across).reshape(around, across)
    p, q = number, np.roll(number, -1, axis=0)
    r, s = np.roll(q, -1, axis=1), np.roll(p, -1, axis=1)
    faces = np.concatenate(
        [np.stack([p, q, r], axis=-1).reshape(-1, 3), np.stack([p, r, s], -1).reshape(-1, 3)]
    )
    return ft.Mesh((centre + small * normal).reshape(-1, 3), faces), normal.reshape(-1, 3)


def off_torus(point, large, small):
    return np.hypot(np.hypot(point[:, 0], point[:, 1]) - large, point[:, 2]) - small


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_patches_come_nearer_to_a_sphere_as_the_fourth_power():
    rng = np.random.default_rng(1)
    rays = ft.Rays(rng.uniform(-0.4, 0.4, (4000, 3)), directions(rng, 4000))
    along = np.einsum("ij,ij->i", rays.origin, rays.direction)
    exact = np.sqrt(along**2 - (rays.origin**2).sum(axis=1) + 1.0) - along
    out = rays.direction - 2.0 * np.sqrt(along**2 - (rays.origin**2).sum(axis=1) + 1.0)[:, None] * (
        rays.origin + exact[:, None] * rays.direction
    )
    worst, tilt = [], []
    for level in (2, 3, 4):
        mesh = shapes.icosphere(1.0, level)
        inside = ft.Mesh(mesh.vertices, mesh.faces[:, ::-1])
        paths = ft.trace(ft.Scene([ft.Surface(inside, MIRROR, form=forms.Smooth())]), rays, max_bounces=1)
        assert (paths.bounces == 1).all()
        worst.append(np.abs(paths.length - exact).max())
        tilt.append(np.abs(paths.direction - out).max())
    assert worst[0] / worst[1] > 13.0
    assert worst[1] / worst[2] > 13.0
    assert worst[2] < 1e-6  # 1e-3 with facets
    assert tilt[1] / tilt[2] > 7.0


@pytest.mark.parametrize(
    ("kind", "given"), [("even", True), ("skew", True), pytest.param("skew", False, marks=pytest.mark.slow)]
)
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_patches_come_nearer_to_a_torus_as_the_third_power_or_better(kind, given):
    rng = np.random.default_rng(2)
    count = 1500
    start = 4.0 * directions(rng, count)
    a = rng.uniform(0, 2 * np.pi, count)
    goal = np.stack([np.cos(a), np.sin(a), 0 * a], axis=1) + rng.uniform(-0.2, 0.2, (count, 3))
    rays = ft.Rays(start, goal - start)
    worst = []
    for cells in (24, 48, 96):
        mesh, normal = torus(1.0, 0.4, 2 * cells, cells, kind)
        form = forms.Smooth(normal if given else None)
        paths = ft.trace(ft.Scene([ft.Surface(mesh, MIRROR, form=form)]), rays, max_bounces=1, record=True)
        met = paths.bounces == 1
        assert met.mean() > 0.95
        worst.append(np.abs(off_torus(paths.points[met, 1], 1.0, 0.4)).max())
    assert worst[0] / worst[1] > 7.0
    assert worst[1] / worst[2] > 7.0


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_patches_are_continuous_across_the_sides_of_faces():
    # rays a hair to the left and to the right of each side of the faces
    mesh, normal = torus(1.0, 0.4, 24, 16, "skew")
    corners = mesh.vertices[mesh.faces]
    middle, along = 0.3 * corners[:, 0] + 0.7 * corners[:, 1], corners[:, 1] - corners[:, 0]
    upright = unit(np.cross(along, corners[:, 2] - corners[:, 0]))
    aside = unit(np.cross(upright, along))
    tilted = unit(upright + 0.3 * aside)
    hair = 1e-9
    scene = ft.Scene([ft.Surface(mesh, MIRROR, form=forms.Smooth(normal))])
    plain = ft.Scene([ft.Surface(mesh, MIRROR)])
    jumps = []
    for one in (scene, plain):
        left, right = (
            ft.trace(
                one, ft.Rays(middle + 0.1 * tilted + s * hair * aside, -tilted), max_bounces=1, record=True
            )
            for s in (-1.0, 1.0)
        )
        assert (left.bounces == 1).all()
        assert (right.bounces == 1).all()
        first = [np.linalg.norm(p.points[:, 1] - p.points[:, 0], axis=1) for p in (left, right)]
        jumps.append((np.abs(first[0] - first[1]).max(), np.abs(left.direction - right.direction).max()))
    assert jumps[0][0] < 2.0 * hair  # what the slope of the surface makes of two hairs
    assert jumps[0][1] < 0.15 * jumps[1][1]  # normals are nearly so


@pytest.mark.parametrize("grazing", [False, pytest.param(True, marks=pytest.mark.slow)])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_a_room_of_patches_keeps_every_ray(grazing):
    rng = np.random.default_rng(3)
    count, bounces = (200, 10) if grazing else (400, 40)
    mesh = shapes.icosphere(1.0, 3)
    inside = ft.Mesh(mesh.vertices, mesh.faces[:, ::-1])
    start, direction = rng.uniform(-0.4, 0.4, (count, 3)), directions(rng, count)
    if grazing:
        spoke = directions(rng, count)
        tangent = unit(np.cross(spoke, direction))
        cosine = 10.0 ** rng.uniform(-2.0, -0.5, count)[:, None]
        start, direction = 0.99 * spoke, tangent * np.sqrt(1 - cosine**2) - cosine * spoke
    paths = ft.trace(
        ft.Scene([ft.Surface(inside, MIRROR, form=forms.Smooth())]),
        ft.Rays(start, direction),
        max_bounces=bounces,
    )
    assert (paths.bounces == bounces).all()
    # the distance of the lines from the centre is kept by a sphere
    aside, then = (
        np.linalg.norm(np.cross(o, d), axis=1)
        for o, d in ((start, unit(direction)), (paths.origin, paths.direction))
    )
    drift = np.abs(then - aside).max()
    assert drift < 1e-2


def test_smooth_moves_with_its_mesh():
    mesh, normal = torus(1.0, 0.4, 24, 16, "even")
    turn = ft.vectors.rotation((1, 2, 3), 0.4)
    surface = ft.Surface(mesh, MIRROR, form=forms.Smooth(normal))
    start, along = np.array([[1.05, 0.1, 2.0]]), np.array([[0.02, 0.0, -1.0]])
    one = ft.trace(ft.Scene([surface]), ft.Rays(start, along))
    offset = np.array([0.3, 0.2, 0.1])
    other = ft.trace(
        ft.Scene([surface.moved(offset, turn)]), ft.Rays(start @ turn.T + offset, along @ turn.T)
    )
    assert other.length == pytest.approx(one.length, rel=1e-13)
    assert other.direction == pytest.approx(one.direction @ turn.T, abs=1e-12)
    assert forms.Smooth().moved(offset, turn).normals is None
    assert math.isclose(np.linalg.norm(surface.moved(turn=turn).form.normals[0]), 1.0)
