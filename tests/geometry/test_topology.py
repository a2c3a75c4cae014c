"""Topology of meshes: welding, edges, and what hangs together, against plain loops."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from fringetrace import Mesh
from fringetrace.geometry import Topology, connected, directed_edges, shapes, weld

FACES = arrays(np.int64, st.tuples(st.integers(1, 12), st.just(3)), elements=st.integers(0, 9))


@settings(max_examples=40, deadline=None)
@given(
    arrays(
        np.float64,
        st.tuples(st.integers(1, 8), st.just(3), st.just(3)),
        elements=st.sampled_from([0.0, -0.0, 1.0, 2.0]),
    )
)
def test_weld_keeps_every_corner_and_one_of_each_vertex(corners):
    vertices, faces = weld(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    assert np.array_equal(vertices[faces], corners)
    assert len(vertices) == len(np.unique(corners.reshape(-1, 3) + 0.0, axis=0))


def test_weld_keeps_the_order_of_first_appearance():
    points = np.array([[5.0, 0, 0], [1, 0, 0], [5, 0, 0], [3, 0, 0], [1, 0, 0]])
    vertices, faces = weld(points, np.array([[4, 3, 2]]))
    assert vertices[:, 0].tolist() == [5, 1, 3]
    assert faces.tolist() == [[1, 2, 0]]


def test_weld_joins_zeros_of_either_sign_but_not_neighbouring_numbers():
    points = np.array([[0.0, 1, 0], [-0.0, 1, 0], [0, np.nextafter(1, 2), 0]])
    vertices, faces = weld(points, np.array([[0, 1, 2]]))
    assert len(vertices) == 2
    assert faces.tolist() == [[0, 0, 1]]


def of_faces(faces):
    """Topology of faces whose vertices are all apart."""
    return Topology(np.arange(30.0).reshape(10, 3), faces)


@settings(max_examples=40, deadline=None)
@given(FACES)
def test_edges_know_how_many_faces_are_beside_them_and_two_of_those(faces):
    edges, directed = of_faces(faces).edges, np.sort(directed_edges(faces), axis=1)
    counted = Counter(map(tuple, directed.tolist()))
    assert dict(zip(map(tuple, edges.ends.tolist()), edges.count.tolist(), strict=True)) == counted
    for rows in edges.rows.T:
        np.testing.assert_array_equal(directed[rows], edges.ends)
    np.testing.assert_array_equal(edges.rows[:, 0] < edges.rows[:, 1], edges.count > 1)


@settings(max_examples=40, deadline=None)
@given(FACES)
def test_fans_are_the_corners_around_each_vertex(faces):
    order, begins = of_faces(faces).fans
    for vertex in range(10):
        fan = order[begins[vertex] : begins[vertex + 1]]
        np.testing.assert_array_equal(fan, np.flatnonzero(faces.ravel() == vertex))


@settings(max_examples=40, deadline=None)
@given(FACES)
def test_faces_that_share_a_vertex_are_connected_and_others_are_not(faces):
    parts = []
    for face in faces.tolist():
        touched = [part for part in parts if part & set(face)]
        parts = [part for part in parts if part not in touched] + [set(face).union(*touched)]
    numbers = connected(faces)
    expected = [next(i for i, part in enumerate(parts) if face[0] in part) for face in faces.tolist()]
    assert len(set(zip(numbers.tolist(), expected, strict=True))) == len(parts) == len(set(numbers.tolist()))


def test_nothing_is_connected_where_there_is_nothing():
    assert connected(np.empty((0, 3), dtype=np.int64)).shape == (0,)


@pytest.mark.parametrize("made", [shapes.icosphere(1.0, 2), shapes.plate(1.0, 2.0, 0.5)])
def test_a_mesh_of_loose_facets_has_the_topology_of_the_closed_body(made):
    soup = Mesh(made.corners.reshape(-1, 3), np.arange(made.faces.size).reshape(-1, 3))
    for mesh in (made, soup):
        assert mesh.topology is mesh.topology
        edges, vertices = mesh.topology.edges, mesh.topology.vertices
        assert (edges.count == 2).all()
        assert len(vertices) - len(edges.ends) + len(mesh.faces) == 2  # Euler
