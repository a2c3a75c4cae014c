"""The noun Mesh: what it keeps, and everything it refuses."""

import copy
import math
import pickle

import numpy as np
import pytest
import pyvista
import trimesh
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace import instruments
from fringetrace.core.vectors import rotation
from fringetrace.geometry import meshes, shapes
from fringetrace.geometry.mesh import as_mesh
from fringetrace.validation import measurement

CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
FACES = np.array([[0, 1, 2], [2, 1, 3]])
# Moving a mesh multiplies and adds coordinates of size 1 or so a few times.
ROUNDING = 16 * float(np.finfo(np.float64).eps)


def square(**changes):
    return ft.Mesh(**{"vertices": CORNERS, "faces": FACES, "name": "square", **changes})


def with_vertex(value):
    vertices = CORNERS.copy()
    vertices[3, 1] = value
    return vertices


def test_mesh_keeps_its_own_arrays():
    vertices, faces = CORNERS.copy(), FACES.copy()
    mesh = ft.Mesh(vertices, faces)
    vertices[:] = 7.0
    faces[:] = 0
    np.testing.assert_array_equal(mesh.vertices, CORNERS)
    np.testing.assert_array_equal(mesh.faces, FACES)
    assert mesh.vertices.dtype == np.float64
    assert mesh.faces.dtype == np.int64
    np.testing.assert_array_equal(mesh.bounds, [[0, 0, 0], [1, 1, 0]])


def test_mesh_takes_lists_and_any_integers():
    mesh = ft.Mesh(CORNERS.tolist(), FACES.tolist())
    np.testing.assert_array_equal(mesh.vertices, CORNERS)
    for dtype in (np.int32, np.uint8, np.uint64):
        np.testing.assert_array_equal(square(faces=FACES.astype(dtype)).faces, FACES)


def test_bounds_are_those_of_the_faces():
    mesh = ft.Mesh([*CORNERS.tolist(), [50.0, 50.0, 50.0]], FACES)  # a vertex that no face uses
    np.testing.assert_array_equal(mesh.bounds, [[0, 0, 0], [1, 1, 0]])


@pytest.mark.parametrize(
    "passed_on", [lambda mesh: mesh, lambda mesh: pickle.loads(pickle.dumps(mesh)), copy.deepcopy]
)
def test_mesh_does_not_change(passed_on):
    mesh = passed_on(square())
    for array in (mesh.vertices, mesh.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 5
    with pytest.raises(AttributeError, match="cannot assign to field 'vertices'"):
        mesh.vertices = CORNERS
    assert mesh.name == "square"
    np.testing.assert_array_equal(mesh.vertices, CORNERS)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_vertices_are_finite(bad):
    message = r"square vertices: expected finite numbers, got NaN or infinity in 1 of 4 \(vertices 3\)"
    with pytest.raises(ValueError, match=message):
        square(vertices=with_vertex(bad))
    with pytest.raises(ValueError, match=message):
        ft.Mesh.cleaned(with_vertex(bad), FACES, "square")


def test_only_the_first_bad_vertices_are_named():
    vertices = np.full((9, 3), np.nan)
    with pytest.raises(ValueError, match=r"in 9 of 9 \(vertices 0, 1, 2, 3, 4, \.\.\.\)"):
        square(vertices=vertices)


@pytest.mark.parametrize("shape", [(), (0,), (12,), (4, 2), (4, 4), (2, 2, 3)])
def test_vertices_have_their_shape(shape):
    with pytest.raises(ValueError, match=r"square vertices: expected shape \(v, 3\), got"):
        square(vertices=np.zeros(shape))


@pytest.mark.parametrize("value", ["abc", [[0, 0, 0], [1, 0]], [[0, 0, object()]]])
def test_vertices_are_numbers(value):
    with pytest.raises(ValueError, match=r"square vertices: expected numbers of shape \(v, 3\), got"):
        square(vertices=value)


@pytest.mark.parametrize("faces", [[], np.empty((0, 3), dtype=int)])
def test_meshes_have_faces(faces):
    with pytest.raises(ValueError, match="square faces: expected at least one triangle, got none"):
        square(faces=faces)


@pytest.mark.parametrize("faces", [[0, 1, 2], [[0, 1]], [[0, 1, 2, 3]], [[0, 1, 2], [1, 2]], 5, "abc"])
def test_faces_have_their_shape(faces):
    with pytest.raises(ValueError, match=r"square faces: expected shape \(f, 3\), got"):
        square(faces=faces)


@pytest.mark.parametrize("dtype", [float, bool, str, complex, object])
def test_faces_are_integers(dtype):
    with pytest.raises(ValueError, match="square faces: expected integers, got"):
        square(faces=np.array(FACES, dtype=dtype))


@pytest.mark.parametrize("index", [-1, 4, 2**62])
def test_faces_name_vertices_that_exist(index):
    message = r"square faces: expected vertex indices from 0 to 3, got others in 1 of 2 \(faces 1\)"
    with pytest.raises(ValueError, match=message):
        square(faces=[[0, 1, 2], [2, 1, index]])
    with pytest.raises(ValueError, match=message):
        ft.Mesh.cleaned(CORNERS, [[0, 1, 2], [2, 1, index]], "square")


# the second face without area: a corner twice, all corners the same, three corners in line
FLAT = [[[0, 1, 2], [2, 1, 1]], [[0, 1, 2], [3, 3, 3]], [[0, 1, 2], [0, 1, 4]]]


@pytest.mark.parametrize("faces", FLAT)
@pytest.mark.parametrize("scale", [1.0, 1e-90, 1e90])
def test_faces_have_an_area(faces, scale):
    vertices = scale * (np.vstack([CORNERS, [0.25, 0.0, 0.0]]) + np.array([0.5, 2.0, 1.0]))
    message = r"square faces: expected triangles with an area, got 1 of 2 without \(faces 1\); drop .*cleaned"
    with pytest.raises(ValueError, match=message):
        square(vertices=vertices, faces=faces)
    kept = ft.Mesh.cleaned(vertices, faces, "square")
    np.testing.assert_array_equal(kept.faces, [[0, 1, 2]])
    np.testing.assert_array_equal(kept.vertices, vertices)


def test_a_mesh_of_one_point_has_no_area():
    with pytest.raises(ValueError, match="square faces: expected triangles with an area, got 2 of 2"):
        square(vertices=np.ones((4, 3)))
    with pytest.raises(ValueError, match="square faces: expected at least one triangle, got none"):
        ft.Mesh.cleaned(np.ones((4, 3)), FACES, "square")


@settings(max_examples=50, deadline=None)
@given(st.floats(-11.0, 0.0))
def test_needles_that_have_a_normal_are_welcome(exponent):
    height = 10.0**exponent
    mesh = ft.Mesh([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, height, 0.0]], [[0, 1, 2]])
    assert mesh.bounds[1, 1] == height
    assert len(ft.Mesh.cleaned(mesh.vertices, mesh.faces).faces) == 1


def test_cleaned_leaves_good_meshes_alone():
    np.testing.assert_array_equal(ft.Mesh.cleaned(CORNERS, FACES).faces, FACES)


def test_meshes_far_away_have_lost_their_digits():
    square(vertices=CORNERS + np.array([0.9e9, 0.0, 0.0]))
    with pytest.raises(
        ValueError, match=r"square: expected a mesh within 1e\+09 of its own sizes .* got 2e\+09"
    ):
        square(vertices=4.0 * CORNERS + np.array([8e9, 0.0, 0.0]))


@pytest.mark.parametrize("scale", [1e-99, 1e-30, 1e30, 1e99])
def test_meshes_of_most_sizes_are_welcome(scale):
    np.testing.assert_array_equal(square(vertices=scale * CORNERS).bounds[1], [scale, scale, 0.0])


@pytest.mark.parametrize("scale", [1e-300, 1e-101, 1e101, 1.7e308])
def test_meshes_beyond_float64_are_refused(scale):
    vertices = scale * (CORNERS - 0.5) * 2.0
    for make in (ft.Mesh, ft.Mesh.cleaned):
        with pytest.raises(ValueError, match=r"square: expected a size from 1e-100 to 1e\+100 m, got"):
            make(vertices, FACES, "square")


def test_moved():
    turn = rotation([1.0, 2.0, 3.0], 0.7)
    moved = square().moved((1.0, -2.0, 3.0), turn)
    expected = np.array([turn @ vertex + [1.0, -2.0, 3.0] for vertex in CORNERS])
    np.testing.assert_allclose(moved.vertices, expected, rtol=0, atol=ROUNDING)
    assert moved.name == "square"
    np.testing.assert_array_equal(square().moved().vertices, CORNERS)


def test_moved_refuses_what_is_no_motion():
    with pytest.raises(ValueError, match="offset: expected 3 numbers, got shape"):
        square().moved((1.0, 2.0))
    with pytest.raises(ValueError, match="offset: expected finite numbers"):
        square().moved((1.0, 2.0, math.nan))
    with pytest.raises(ValueError, match=r"turn: expected a rotation matrix of shape \(3, 3\), got shape"):
        square().moved(turn=np.eye(2))
    with pytest.raises(ValueError, match="turn: expected a rotation matrix, got"):
        square().moved(turn=np.diag([1.0, 1.0, -1.0]))


# Facets


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(-40, 40))
def test_normals_and_areas_are_those_of_each_facet(seed, power):
    """Corners are whole numbers times a power of two: their cross product is exact in whole numbers."""
    corners = np.random.default_rng(seed).integers(-1000, 1000, (4, 3, 3))
    mesh = ft.Mesh(corners.reshape(-1, 3) * 2.0**power, np.arange(12).reshape(4, 3))
    (x, y, z), (u, v, w) = (corners[:, k].T - corners[:, 0].T for k in (1, 2))
    cross = np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=1)
    length = np.sqrt((cross**2).sum(axis=1))
    np.testing.assert_allclose(mesh.areas, 0.5 * length * 4.0**power, rtol=ROUNDING)
    np.testing.assert_allclose(mesh.normals, cross / length[:, None], rtol=0, atol=ROUNDING)
    np.testing.assert_array_equal(mesh.corners, corners * 2.0**power)


def test_normals_and_areas_are_kept_and_cannot_be_written():
    mesh = square()
    assert mesh.normals is mesh.normals
    assert mesh.areas is mesh.areas
    for kept in (mesh.normals, mesh.areas):
        with pytest.raises(ValueError, match="read-only"):
            kept[0] = 0.0
    assert "normals" not in vars(pickle.loads(pickle.dumps(mesh)))


# From other libraries


def test_a_polydata_is_cut_into_triangles():
    cube = pyvista.Cube(x_length=2.0).cast_to_unstructured_grid().extract_surface(algorithm=None)
    assert cube.n_cells == 6
    mesh = as_mesh(cube, "cube")
    assert (len(mesh.faces), mesh.name) == (12, "cube")
    assert mesh.bounds.tolist() == [[-1.0, -0.5, -0.5], [1.0, 0.5, 0.5]]
    strip = pyvista.PolyData(CORNERS, strips=[4, 0, 1, 3, 2])
    assert len(as_mesh(strip).faces) == 2
    # normals stay outside: the volume is positive
    first, second, third = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    assert (first * np.cross(second, third)).sum() / 6.0 == pytest.approx(2.0)


def test_a_polydata_of_float64_keeps_its_digits():
    corners = CORNERS / 3.0
    mesh = as_mesh(pyvista.PolyData.from_regular_faces(corners, FACES))
    assert mesh.vertices.tobytes() == corners.tobytes()
    assert mesh.faces.tolist() == np.asarray(FACES).tolist()


@pytest.mark.parametrize(
    ("value", "error", "message"),
    [
        (
            pyvista.PolyData(CORNERS),
            ValueError,
            r"sample: .* of faces only, got 4 loose points",
        ),
        (pyvista.Line(), ValueError, r"sample: .* of faces only, got 1 lines"),
        (
            pyvista.PolyData(),
            ValueError,
            "sample faces: expected at least one",
        ),
        (pyvista.ImageData(), TypeError, r"sample: .* got ImageData; .* have a surface, extract_surface\(\)"),
        (trimesh.Scene(), TypeError, r"sample: expected a mesh .* got Scene"),
        ("part.stl", TypeError, "sample: .* got str; files are read by fringetrace.meshes.load"),
    ],
)
def test_what_is_no_mesh_is_refused_by_name(value, error, message):
    with pytest.raises(error, match=message):
        as_mesh(value, "sample")


def test_a_trimesh_that_knows_its_unit_must_be_in_metres():
    box = trimesh.creation.box()
    for unit in (None, "m", "meters"):
        box.units = unit
        assert len(as_mesh(box).faces) == 12
    box.units = "mm"
    with pytest.raises(ValueError, match=r"box: expected a mesh in metres, got one in mm; call .*'meters'"):
        as_mesh(box, "box")


def test_every_door_takes_the_meshes_of_others(tmp_path):
    mesh = shapes.plate(8e-3, 8e-3, 1e-3)
    for other in (meshes.to_trimesh(mesh), meshes.to_pyvista(mesh)):
        assert len(ft.Surface(other, ft.Mirror()).mesh.faces) == 12
        optics = {"aperture": 4e-3, "pixels": (4, 4)}
        for bench in (
            instruments.michelson(other, **optics), instruments.fizeau(other, gap=2e-3, **optics),
            instruments.mach_zehnder(other, index=1.5, **optics),
        ):  # fmt: skip
            assert 12 in [len(surface.mesh.faces) for surface in bench.scene.surfaces]
        meshes.save(other, tmp_path / "plate.npz", "m")
        assert meshes.interpolate_height(other, 0.0, 0.0) == mesh.bounds[1, 2]
        assert measurement.heights(other, (2, 2), 1e-3) == pytest.approx(mesh.bounds[1, 2])
