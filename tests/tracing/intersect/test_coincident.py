"""Faces at one place, nearly at one place, and rays that start on faces: nothing is lost or met twice."""

import math
from itertools import pairwise

import numpy as np
import pytest
from random_scenes import GLASS, PASS, block, inverted, merged

import fringetrace as ft
from fringetrace import Fate
from fringetrace.core.vectors import rotation
from fringetrace.geometry import forms, shapes
from fringetrace.tracing.intersect import coincident

# Rays are stopped where the tests have seen enough of them.
pytestmark = pytest.mark.filterwarnings("ignore:power is cut off")
MIRROR = ft.Mirror()
# Some straight down onto the middle, on edges between triangles, beside them; some slanting.
START = np.array([(0.1, 0.2, 2.0), (0.05, 0.05, 2.0), (0.0, 0.0, 2.0), (0.11, -0.2, 2.0)])
DOWN = np.array([(0, 0, -1.0), (0, 0, -1.0), (0, 0, -1.0), (0.05, 0.03, -1.0)])


def both_ways(surfaces, interface_count=None, **options):
    """Paths of rays from above and from below."""
    scene = ft.Scene(surfaces)
    flip = np.array([1.0, 1.0, -1.0])
    return [
        ft.trace(scene, ft.Rays(START * side, DOWN * side), max_bounces=40, record=True, **options)
        for side in (np.ones(3), flip)
    ]


def sheet(interface=PASS, name="sheet", **media):
    return ft.Surface(shapes.plate(1.0, 1.0), interface, name, **media)


def solid(low, high, index, name="solid", interface=GLASS, front=None):
    mesh = block((-0.5, -0.5, low), (0.5, 0.5, high))
    return ft.Surface(mesh, interface, name, front=front, back=index)


def assert_each_once(paths, count, contradictions=True):
    assert (paths.fate == Fate.LEFT).all()
    assert (paths.bounces == count).all()
    if contradictions and paths.contradictions is not None:
        assert not paths.contradictions.any()


@pytest.mark.parametrize("indices", [(1.5, 1.7), (1.7, 1.5), (1.5, 1.5)])
def test_glass_on_glass(indices):
    for paths in both_ways([solid(0, 0.5, indices[0]), solid(-0.5, 0, indices[1])]):
        assert_each_once(paths, 4)


def test_a_pile_of_plates_in_one_mesh_or_in_many():
    plates = [block((-0.5, -0.5, -0.1 * i - 0.1), (0.5, 0.5, -0.1 * i)) for i in range(5)]
    one = [ft.Surface(merged(*plates), GLASS, "pile", back=1.5)]
    many = [ft.Surface(mesh, GLASS, f"plate {i}", back=1.5) for i, mesh in enumerate(plates)]
    for surfaces in (one, many):
        for paths in both_ways(surfaces):
            assert_each_once(paths, 10)


@pytest.mark.filterwarnings("ignore:media contradict")  # from below, where the scene is a vacuum
def test_three_faces_between_four_media_whatever_their_order():
    media = [1.0, 1.3, 1.7, 1.5]
    faces = [sheet(GLASS, f"face {i}", front=media[i], back=media[i + 1]) for i in range(3)]
    for order in ((0, 1, 2), (2, 1, 0), (1, 2, 0)):
        paths, _ = both_ways([faces[i] for i in order])
        assert_each_once(paths, 3)
        assert (np.array(order)[paths.surface] == [0, 1, 2]).all()


def test_a_stop_in_the_plane_of_a_lens_is_outside_the_glass():
    for surfaces in ([solid(0, 0.5, 1.5), sheet()], [sheet(), solid(0, 0.5, 1.5)]):
        names = [surface.name for surface in surfaces]
        down, up = both_ways(surfaces)
        for paths, order in ((down, ("solid", "solid", "sheet")), (up, ("sheet", "solid", "solid"))):
            assert_each_once(paths, 3)
            assert (paths.surface == [names.index(name) for name in order]).all()


def test_a_lens_on_a_mirror():
    down, up = both_ways([sheet(MIRROR, "mirror"), solid(0, 0.5, 1.5)])
    assert_each_once(down, 5)
    assert_each_once(up, 1)


@pytest.mark.parametrize("count", [2, 5, 9])
def test_windows_at_one_place_partly_over_each_other(count):
    rng = np.random.default_rng(count)
    surfaces = []
    for k in range(count):
        mesh = shapes.plate(*rng.uniform(0.5, 1.0, 2)).moved(turn=rotation((0, 0, 1), rng.uniform(0, 6)))
        surfaces.append(ft.Surface(inverted(mesh) if k % 2 else mesh, PASS, f"window {k}"))
    for paths in both_ways(surfaces):
        assert (paths.fate == Fate.LEFT).all()
        for row in range(len(paths)):
            met = paths.surface[row, : paths.bounces[row]]
            assert len(set(met)) == len(met)
    # all are over the middle
    assert paths.bounces[2] == count


def test_splitters_at_one_place_keep_the_power_and_do_not_multiply():
    surfaces = [sheet(ft.BeamSplitter(), f"splitter {k}") for k in range(3)]
    for paths in both_ways(surfaces, min_amplitude=1e-3):
        assert paths.ledger().error < 1e-12
        assert paths.ledger().truncated < 2e-3 * paths.ledger().incident
        # a mirror from outside: of incoherent light 1/4 goes through three halves
        through = paths.direction[:, 2] * paths.source.direction[paths.ray, 2] > 0.0
        gone = (np.abs(paths.amplitude[through]) ** 2).sum() / paths.incident
        assert gone == pytest.approx(0.25, abs=1e-3)


@pytest.mark.parametrize("same", [True, False], ids=["twice", "both windings"])
@pytest.mark.parametrize("welded", [True, False])
def test_faces_that_are_there_twice_let_light_through(welded, same):
    flat = shapes.plate(1.0, 1.0)
    faces = np.concatenate([flat.faces, flat.faces if same else flat.faces[:, ::-1]])
    mesh = ft.Mesh(flat.vertices, faces)
    if not welded:
        mesh = ft.Mesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3))
    for paths in both_ways([ft.Surface(mesh, PASS)]):
        assert_each_once(paths, 1 if same else 2)


FORMS = {
    "facets": lambda radius: None,
    "sphere": lambda radius: forms.Sphere((0, 0, 0), radius),
    "smooth": lambda radius: forms.Smooth(),
}


@pytest.mark.parametrize("gap", [0.0, 1e-15, 1e-9, 1e-4])
@pytest.mark.parametrize("form", FORMS)
def test_a_ball_in_a_shell(form, gap):
    surfaces = [
        ft.Surface(shapes.icosphere(0.5, 3), GLASS, "shell", FORMS[form](0.5), back=1.5),
        ft.Surface(
            shapes.icosphere(0.5 - gap, 3), GLASS, "ball", FORMS[form](0.5 - gap), front=1.5, back=1.7
        ),
    ]
    for paths in both_ways(surfaces):
        assert_each_once(paths, 4)
        assert (paths.surface == [0, 1, 1, 0]).all()


@pytest.mark.parametrize("form", FORMS)
def test_a_ball_is_met_from_any_distance(form):
    scene = ft.Scene([ft.Surface(shapes.icosphere(0.5, 3), MIRROR, "ball", FORMS[form](0.5))])
    rng = np.random.default_rng(0)
    aim, direction = rng.uniform(-0.25, 0.25, (200, 3)), rng.normal(size=(200, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    near = ft.trace(scene, ft.Rays(aim - 2.0 * direction, direction), max_bounces=1, record=True)
    assert (near.bounces == 1).all()
    for far in 10.0 ** np.arange(3, 10):
        paths = ft.trace(scene, ft.Rays(aim - far * direction, direction), max_bounces=1, record=True)
        assert (paths.bounces == 1).all()
        # the digits that coordinates have so far away; a steep face moves the hit by some of them
        rounding = np.finfo(float).eps * far
        np.testing.assert_allclose(paths.points[:, 1], near.points[:, 1], rtol=0, atol=16 * rounding)
        np.testing.assert_allclose(paths.length - far, near.length - 2.0, rtol=0, atol=16 * rounding)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("interface", [MIRROR, GLASS], ids=["mirror", "glass"])
def test_rays_that_start_on_a_solid_meet_it_going_in_only(interface, form, size):
    radius, back = 0.5 * size, None if interface is MIRROR else 1.5
    mesh = shapes.icosphere(radius, 3).moved((0.3 * size, 0.2 * size, 0.0))
    shape = FORMS[form](radius)
    shape = shape if shape is None else shape.moved((0.3 * size, 0.2 * size, 0.0))
    scene = ft.Scene([ft.Surface(mesh, interface, "ball", shape, back=back)])
    rng = np.random.default_rng(1)
    outward = rng.normal(size=(300, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    aim = ft.Rays(3.0 * size * outward + (0.3 * size, 0.2 * size, 0.0), -outward)
    on = ft.trace(scene, aim, max_bounces=1, record=True).points[:, 1]
    away = ft.trace(scene, ft.Rays(on, outward), max_bounces=5)
    assert (away.bounces == 0).all()
    into = ft.trace(scene, ft.Rays(on, -outward), max_bounces=5, record=True)
    assert (into.bounces == (1 if interface is MIRROR else 2)).all()
    np.testing.assert_allclose(into.points[:, 1], on, rtol=0, atol=64 * np.finfo(float).eps * size)
    if interface is GLASS:
        assert not into.contradictions.any()


@pytest.mark.parametrize("one", [True, False], ids=["one mesh", "surfaces"])
@pytest.mark.parametrize("turn", [np.eye(3), rotation((1, 2, 3), 0.7), rotation((0, 1, 5), 2.0)])
def test_no_ray_falls_through_the_seam_of_t_junctions(turn, one):
    left = ft.Mesh([(-1, -1, 0), (0, -1, 0), (0, 1, 0), (-1, 1, 0)], [(0, 1, 2), (0, 2, 3)])
    cut = np.linspace(-1, 1, 8) ** 3
    right = [
        ft.Mesh([(0, a, 0), (1, a, 0), (1, b, 0), (0, b, 0)], [(0, 1, 2), (0, 2, 3)])
        for a, b in pairwise(cut)
    ]
    meshes = [mesh.moved(turn=turn) for mesh in (left, *right)]
    meshes = [merged(*meshes)] if one else meshes
    y = np.linspace(-0.9, 0.9, 20_001)
    start = np.stack([0 * y, y, 0 * y + 1.0], axis=1) @ turn.T
    rays = ft.Rays(start, np.broadcast_to([0, 0, -1.0] @ turn.T, start.shape))
    paths = ft.trace(ft.Scene([ft.Surface(m, MIRROR, str(i)) for i, m in enumerate(meshes)]), rays)
    assert (paths.bounces == 1).all()


@pytest.mark.parametrize("gap", [1e-12, 1e-9, 2e-8])
def test_a_gap_of_a_nanometre_within_one_mesh_of_10_mm(gap):
    low = shapes.plate(0.01, 0.01)
    scene = ft.Scene([ft.Surface(merged(low, inverted(low).moved((0, 0, gap))), MIRROR)])
    rng = np.random.default_rng(9)
    start = np.append(rng.uniform(-3e-3, 3e-3, (500, 2)), np.full((500, 1), 0.25 * gap), axis=1)
    slope = rng.uniform(-1, 1, (500, 2))
    rays = ft.Rays(start, np.append(slope, np.ones((500, 1)), axis=1))
    paths = ft.trace(scene, rays, max_bounces=100)
    assert (paths.bounces == 100).all()
    slant = np.sqrt(1.0 + (slope**2).sum(axis=1))
    np.testing.assert_allclose(paths.length, 99.75 * gap * slant, rtol=1e-6)


def test_windows_of_one_mesh_a_nanometre_apart_are_crossed_in_their_order():
    z = -np.cumsum([0, 1e-9, 1e-10, 3e-9]) * 0.01
    mesh = merged(*(shapes.plate(0.01, 0.01).moved((0, 0, height)) for height in z))
    rng = np.random.default_rng(3)
    start = np.append(rng.uniform(-4e-3, 4e-3, (500, 2)), np.full((500, 1), 0.02), axis=1)
    down = np.append(rng.uniform(-0.01, 0.01, (500, 2)), -np.ones((500, 1)), axis=1)
    paths = ft.trace(ft.Scene([ft.Surface(mesh, PASS)]), ft.Rays(start, down), record=True)
    assert (paths.bounces == 4).all()
    assert (paths.triangle // 2 == np.arange(4)).all()


def test_no_ray_leaks_where_a_ball_stands_on_a_floor_in_one_mesh():
    ball = shapes.icosphere(0.5, 3)
    lowest = ball.vertices[:, 2].argmin()
    ball = ball.moved((0, 0, -ball.vertices[lowest, 2]))
    mesh = merged(ball, inverted(shapes.plate(4, 4, 4)).moved((0, 0, 4)))
    tip = ball.vertices[lowest]
    rng, count = np.random.default_rng(10), 5000
    angle = rng.uniform(0, 2 * np.pi, count)
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    start = tip + 1.5 * around + rng.uniform(0.001, 0.02, (count, 1)) * [0, 0, 1]
    aim = tip + 10.0 ** rng.uniform(-9, -2, (count, 1)) * (around + np.array([0, 0, 0.05]))
    paths = ft.trace(ft.Scene([ft.Surface(mesh, MIRROR)]), ft.Rays(start, aim - start), max_bounces=100)
    assert (paths.fate == Fate.TRUNCATED).all()


def test_no_ray_falls_through_a_vertex_of_an_open_sheet_to_the_one_behind():
    rough = shapes.height_map(1e-3 * np.random.default_rng(3).uniform(size=(41, 41)), 0.1)
    mesh = merged(rough, rough.moved((0, 0, -0.5)))
    targets = rough.vertices.reshape(41, 41, 3)[3:-3, 3:-3].reshape(-1, 3)
    for step in ([0.0, 0.0, -1.0], [0.3, -0.2, -1.0]):
        rays = ft.Rays(targets - 2.0 * np.array(step), np.broadcast_to(step, targets.shape))
        paths = ft.trace(ft.Scene([ft.Surface(mesh, MIRROR)]), rays, max_bounces=1, record=True)
        assert (paths.triangle < len(rough.faces)).all()
        np.testing.assert_allclose(paths.length, 2.0 * math.sqrt(np.dot(step, step)), rtol=1e-14)


# The list of faces crossed at a place


def test_a_face_is_crossed_once_and_taken_off_when_crossed_back():
    crossed = np.zeros((1, coincident.COLUMNS), dtype=np.int32)
    for triangle in (7, 9, 11):
        coincident.cross(crossed, 0, triangle)
    assert crossed[0, :5].tolist() == [3, 0, 7, 9, 11]
    crossed[0, coincident.BACK] = coincident.FIRST + 1
    coincident.cross(crossed, 0, 9)
    assert crossed[0, :4].tolist() == [2, 0, 7, 11]
    for triangle in range(20):  # more than there is room for: the oldest are forgotten
        coincident.cross(crossed, 0, triangle)
    room = coincident.COLUMNS - coincident.FIRST
    assert crossed[0].tolist() == [room, 0, *range(20 - room, 20)]


def test_a_ray_hands_on_what_it_has_crossed():
    crossed = np.zeros((3, coincident.COLUMNS), dtype=np.int32)
    coincident.cross(crossed, 0, 7)
    coincident.hand_on(crossed, 0, 1, 8)
    assert crossed[1, :4].tolist() == [2, 0, 7, 8]
    crossed[1, coincident.BACK] = coincident.FIRST  # back through 7
    coincident.hand_on(crossed, 1, 2, 7)
    assert crossed[2, :3].tolist() == [1, 0, 8]
    coincident.hand_on(crossed, 1, 1, -1)
    assert crossed[1, :4].tolist() == [2, 0, 7, 8]


def test_what_is_sent_back_has_not_gone_through():
    crossed = np.zeros((2, coincident.COLUMNS), dtype=np.int32)
    coincident.cross(crossed, 0, 7)
    coincident.turned_back(crossed, np.array([0, 1]), np.array([7, 8]))
    assert crossed[:, 0].tolist() == [0, 1]
    assert crossed[1, coincident.FIRST] == 8


def test_media_tell_the_order_of_faces():
    # glass 1 in vacuum, glass 2 in glass 1, a film of the same on both sides, a window, a mirror
    sides = np.array([(0, 1), (1, 2), (1, 1), (-1, -1), (-2, -2)], dtype=np.int32)
    down, up = -1.0, 1.0

    def order(medium, facing):
        return sorted(range(5), key=lambda surface: coincident.rank(sides, surface, medium, facing))

    assert order(0, down)[:3] == [3, 4, 0]
    assert order(1, down)[:4] == [2, 3, 4, 1]
    assert order(2, up)[0] == 1
    assert order(1, up)[:2] == [2, 0]
