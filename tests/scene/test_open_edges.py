"""Holes in glass are found, whatever mesh they are in, and nothing else is taken for one."""

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, shapes
from fringetrace.scene import openings


def scene(*meshes, interface=None):
    glass = ft.Dielectric() if interface is None else interface
    media = {"back": 1.5} if isinstance(glass, ft.Dielectric) else {}
    return ft.Scene([ft.Surface(mesh, glass, f"part {i}", **media) for i, mesh in enumerate(meshes)])


def part(mesh, keep):
    return ft.Mesh(mesh.vertices, mesh.faces[keep])


def unwelded(mesh):
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    return ft.Mesh(corners, np.arange(len(corners)).reshape(-1, 3))


def box(size=1.0):
    return shapes.plate(size, size, size)


BALL = shapes.icosphere(1 * mm, 2)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
@pytest.mark.parametrize("split", [False, True])
def test_a_missing_face_is_a_hole(seed, scale, split):
    rng = np.random.default_rng(seed)
    whole = ft.Mesh(BALL.vertices * scale + 100.0 * scale * rng.normal(size=3), BALL.faces)
    gone = int(rng.integers(len(BALL.faces)))
    holed = part(whole, np.arange(len(whole.faces)) != gone)
    (found,) = openings(scene(unwelded(holed) if split else holed))
    corners = whole.vertices[whole.faces[gone]]
    area = 0.5 * np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
    assert found.area == pytest.approx(area, rel=1e-9)
    np.testing.assert_allclose(found.centre, corners.mean(axis=0), rtol=1e-9)
    mesh = unwelded(holed) if split else holed
    ends = mesh.vertices[found.edges]
    assert {tuple(p) for p in ends.reshape(-1, 3)} == {tuple(p) for p in corners}


def test_the_largest_hole_comes_first_and_names_its_surface():
    faces = np.arange(len(BALL.faces))
    one = part(BALL, faces != 7)
    edge = BALL.faces[20]
    beside = [n for n, face in enumerate(BALL.faces) if len(set(face) & set(edge)) >= 2]
    other = part(BALL.moved((5 * mm, 0, 0)), ~np.isin(faces, beside))
    first, second = openings(scene(one, other))
    assert (first.surface, second.surface) == (1, 0)
    assert first.area > second.area


def test_a_box_without_a_face_is_open():
    mesh = box()
    up = np.cross(
        mesh.vertices[mesh.faces[:, 1]] - mesh.vertices[mesh.faces[:, 0]],
        mesh.vertices[mesh.faces[:, 2]] - mesh.vertices[mesh.faces[:, 0]],
    )[:, 2]
    (found,) = openings(scene(part(mesh, up < 0.5)))
    assert found.area == pytest.approx(1.0)


@pytest.mark.parametrize(
    "meshes",
    [
        [BALL],
        [unwelded(BALL)],
        [box()],
        [part(BALL, np.arange(len(BALL.faces)) < 60), part(BALL, np.arange(len(BALL.faces)) >= 60)],
        [shapes.plate(1.0, 1.0)],
        [part(BALL, BALL.vertices[BALL.faces].mean(axis=1)[:, 2] > 0.0)],
        [shapes.extrude([(0, 0), (1, 0), (1, 1), (0, 1)], 50.0)],
        [shapes.height_map(np.random.default_rng(1).normal(size=(9, 9)) * 0.1, 0.2)],
    ],
    ids=["ball", "loose triangles", "box", "ball in two", "sheet", "half", "no ends", "relief"],
)
def test_what_closes_and_what_is_a_sheet_is_not_open(meshes):
    assert openings(scene(*meshes)) == ()


def test_a_seam_is_not_a_hole():
    """A box with a vertex in the middle of an edge, which only one of its faces knows."""
    mesh = box()
    a, b, c = mesh.faces[0]
    vertices = np.concatenate([mesh.vertices, [0.5 * (mesh.vertices[a] + mesh.vertices[b])]])
    new = len(mesh.vertices)
    faces = np.concatenate([mesh.faces[1:], [[a, new, c], [new, b, c]]])
    assert openings(scene(ft.Mesh(vertices, faces))) == ()


def test_only_boundaries_of_media_are_asked_and_once():
    holed = part(BALL, slice(1, None))
    assert openings(scene(holed, interface=ft.Mirror())) == ()
    glass = scene(holed)
    assert openings(glass) is openings(glass)
