"""How far facets stand off what they stand for: curved meshes do, flat parts and edges do not."""

import numpy as np
import pytest

from fringetrace import Mesh
from fringetrace.core.vectors import unit
from fringetrace.geometry import shapes
from fringetrace.geometry.facet_sag import standoff


def spots(mesh, count=3000):
    """Points all over a mesh, and their facets."""
    rng = np.random.default_rng(1)
    face = rng.integers(0, len(mesh.faces), count)
    weight = rng.dirichlet((1.0, 1.0, 1.0), count)
    return face, np.einsum("nk,nkj->nj", weight, mesh.vertices[mesh.faces[face]])


def above(mesh, face, point):
    return standoff(mesh, face, point)


@pytest.mark.parametrize(("level", "off"), [(2, 2e-2), (3, 5e-3), (4, 1.2e-3)])
def test_an_icosphere_stands_off_by_its_sag(level, off):
    mesh = shapes.icosphere(1.0, level)
    face, point = spots(mesh)
    height, lean = above(mesh, face, point)
    size = np.linalg.norm(point, axis=1)
    # next order of the sag: h^2 smaller
    np.testing.assert_allclose(height, 1.0 - size, rtol=0, atol=off * (1.0 - size).max())
    corners = mesh.vertices[mesh.faces[face]]
    normal = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    leans = normal - point / size[:, None]
    np.testing.assert_allclose(lean, leans, rtol=0, atol=0.1 * np.linalg.norm(leans, axis=1).max())


def test_the_sign_is_that_of_the_front():
    mesh = shapes.icosphere(1.0, 3)
    hollow = Mesh(mesh.vertices, mesh.faces[:, ::-1])
    face, point = spots(mesh, 200)
    assert (above(mesh, face, point)[0] >= 0.0).all()
    np.testing.assert_allclose(above(hollow, face, point)[0], -above(mesh, face, point)[0], rtol=1e-9)


def test_a_triangle_soup_is_welded():
    mesh = shapes.icosphere(1.0, 3)
    soup = Mesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))
    face, point = spots(mesh, 200)
    np.testing.assert_allclose(above(soup, face, point)[0], above(mesh, face, point)[0], rtol=1e-9)


@pytest.mark.parametrize("sides", [18, 60])
def test_a_prism_stands_for_a_rod_and_its_ends_for_themselves(sides):
    mesh = shapes.rod_lattice(1, 1, 1.0, 3.0, 2.0, sides=sides)
    face, point = spots(mesh)
    height, _ = above(mesh, face, point)
    end = np.abs(point[:, 1]) > 1.0 - 1e-9
    assert (height[end] == 0.0).all()
    true = 1.0 - np.hypot(point[:, 0], point[:, 2])
    np.testing.assert_allclose(height[~end], true[~end], rtol=0, atol=2e-2 * true[~end].max())


FLAT = {
    "plate": shapes.plate(1.0, 1.0, 0.2),
    "step": shapes.step(1.0, 1.0, 0.2, 1e-3),
    "staircase": shapes.staircase(1.0, 1.0, 5, 1e-3),
    "corner cube": shapes.corner_cube(1.0, 4),
    "valley": shapes.extrude([(-1.0, 1e-3), (0.0, 0.0), (1.0, 1e-3)], 2.0),
    "fine valley": shapes.height_map(np.abs(np.arange(21) - 10.0)[None, :] * np.full((21, 1), 1e-3), 0.1),
    "prism of 9 sides": shapes.rod_lattice(1, 1, 1.0, 3.0, 2.0, sides=9),
}


@pytest.mark.parametrize("name", FLAT)
def test_flat_parts_stand_off_nothing(name):
    mesh = FLAT[name]
    height, lean = above(mesh, *spots(mesh))
    size = np.ptp(mesh.bounds, axis=0).max()
    assert np.abs(height).max() <= 1e-14 * size
    assert np.abs(lean).max() <= 1e-14
