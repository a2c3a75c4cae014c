"""The nouns of a scene: what they keep, and everything they refuse."""

import copy
import math
import pickle
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fringetrace as ft
from fringetrace import scene
from fringetrace.vectors import rotation

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


def test_a_surface_takes_whatever_has_vertices_and_faces():
    alike = SimpleNamespace(vertices=CORNERS, faces=FACES)
    surface = ft.Surface(alike, ft.Mirror(), name="plate")
    assert isinstance(surface.mesh, ft.Mesh)
    assert surface.mesh.name == "plate"
    mesh = square()
    assert ft.Surface(mesh, ft.Mirror()).mesh is mesh


@pytest.mark.parametrize("value", ["mesh.stl", None, CORNERS, SimpleNamespace(vertices=CORNERS)])
def test_a_surface_wants_a_mesh(value):
    message = (
        "plate: expected a mesh with vertices and faces, got .*files are read by fringetrace.meshes.load"
    )
    with pytest.raises(TypeError, match=message):
        ft.Surface(value, ft.Mirror(), name="plate")


@pytest.mark.parametrize("value", [None, "mirror", ft.Mirror, -1.0, SimpleNamespace(reflection=1.0)])
def test_a_surface_wants_an_interface(value):
    with pytest.raises(TypeError, match=r"plate interface: expected one such as Mirror\(\), got"):
        ft.Surface(square(), value, name="plate")


def beam(**changes):
    defaults = {
        "centre": (0, 0, 1),
        "direction": (0, 0, -2),
        "up": (0, 3, 0),
        "size": (4, 2),
        "shape": (5, 10),
    }
    return ft.Beam(**{**defaults, **changes})


def ccd(**changes):
    defaults = {"centre": (0, 0, 1), "normal": (0, 0, -2), "up": (0, 3, 0), "pitch": 1e-3, "shape": (5, 10)}
    return ft.CCD(**{**defaults, **changes})


def test_beam():
    made = beam(size=[4, np.float32(2.0)], shape=np.array([5, 10]), passes=["splitter", "lens"])
    np.testing.assert_array_equal(made.direction, [0, 0, -1])
    np.testing.assert_array_equal(made.up, [0, 1, 0])
    assert made.size == (4.0, 2.0)
    assert made.shape == (5, 10)
    assert made.passes == ("splitter", "lens")
    assert made.profile is None
    assert made.area == pytest.approx(8.0 / 50, rel=ROUNDING, abs=0.0)


def test_ccd():
    made = ccd(shape=(5, 10), focus=-2.5)
    np.testing.assert_array_equal(made.normal, [0, 0, -1])
    assert made.size == pytest.approx((10e-3, 5e-3), rel=ROUNDING, abs=0.0)
    assert made.focus == -2.5
    assert ccd(shape=(1, 1)).shape == (1, 1)
    assert ccd().focus == 0.0


def test_one_name_may_be_given_without_a_list():
    assert beam(passes="splitter").passes == ("splitter",)
    assert scene.as_names(name for name in ("a", "b")) == ("a", "b")


@pytest.mark.parametrize(("make", "what", "axis"), [(beam, "Beam", "direction"), (ccd, "CCD", "normal")])
def test_positions_and_directions_are_checked(make, what, axis):
    for name in ("centre", axis, "up"):
        with pytest.raises(ValueError, match=f"{what} {name}: expected 3 numbers, got"):
            make(**{name: (1.0, 2.0)})
        with pytest.raises(ValueError, match=f"{what} {name}: expected finite numbers, got"):
            make(**{name: (1.0, 2.0, math.nan)})
    for name in (axis, "up"):
        with pytest.raises(
            ValueError, match=f"{what} {name}: expected a direction, got a vector of length 0"
        ):
            make(**{name: (0.0, 0.0, 0.0)})
    with pytest.raises(ValueError, match=rf"{what} up: expected a direction across the normal .* got"):
        make(up=(0.0, 0.0, 5.0))


NO_LENGTHS = [0.0, -1.0, math.nan, math.inf, "1", "1 mm", None, 1j]


@pytest.mark.parametrize("bad", NO_LENGTHS)
def test_lengths_are_positive(bad):
    for call, name in (
        (lambda: beam(size=(bad, 1.0)), "Beam width"),
        (lambda: beam(size=(1.0, bad)), "Beam height"),
        (lambda: ccd(pitch=bad), "CCD pitch"),
        (lambda: ft.Gaussian(bad), "Gaussian waist"),
    ):
        with pytest.raises(ValueError, match=f"{name}: expected a positive length in metres, got"):
            call()


@pytest.mark.parametrize("size", [1e-3, (1.0,), (1.0, 2.0, 3.0)])
def test_a_beam_has_two_sides(size):
    with pytest.raises(ValueError, match=r"Beam size: expected \(width, height\) in metres, got"):
        beam(size=size)


@pytest.mark.parametrize("shape", [5, (5,), (5, 5, 5), (0, 5), (5, -1), (5.0, 5), "55", None])
def test_grids_have_rows_and_columns(shape):
    for make, what in ((beam, "Beam"), (ccd, "CCD")):
        with pytest.raises(ValueError, match=rf"{what} shape: expected two positive whole numbers .* got"):
            make(shape=shape)


@pytest.mark.parametrize("focus", [math.nan, math.inf, "1 mm", None])
def test_focus_is_a_length(focus):
    with pytest.raises(ValueError, match="CCD focus: expected a length in metres, got"):
        ccd(focus=focus)


def test_profiles_are_functions():
    with pytest.raises(
        TypeError, match=r"Beam profile: expected None or a function of \(x, y\), got 'gauss'"
    ):
        beam(profile="gauss")


@settings(max_examples=50, deadline=None)
@given(st.floats(1e-6, 1e3), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_gaussian(waist, x, y):
    found = ft.Gaussian(waist)(np.array([x * waist]), np.array([y * waist]))
    assert found == pytest.approx(math.exp(-(x * x) - y * y), rel=40 * ROUNDING, abs=0.0)
    assert found <= ft.Gaussian(waist)(np.zeros(1), np.zeros(1)) == 1.0


def test_scene():
    first, second = ft.Surface(square(), ft.Mirror(), name="first"), ft.Surface(square(), ft.Absorber())
    made = ft.Scene([first, second])
    assert made.surfaces == (first, second)
    assert (made.index("first"), made.index("surface")) == (0, 1)
    assert ft.Scene(first).surfaces == (first,)
    assert ft.Scene(surface for surface in (first, second)).surfaces == (first, second)


@pytest.mark.parametrize("surfaces", [[None], [square()], square(), None, ["surface"]])
def test_scenes_are_made_of_surfaces(surfaces):
    with pytest.raises(TypeError, match="Scene: expected Surface, got"):
        ft.Scene(surfaces)


def test_scenes_are_not_empty():
    with pytest.raises(ValueError, match="Scene: expected at least one Surface, got none"):
        ft.Scene([])


def test_names_of_surfaces_are_found_once():
    twice = [ft.Surface(square(), ft.Mirror(), name="twin")] * 2
    for name, count in (("twin", 2), ("lens", 0)):
        message = rf"Scene: expected one surface called '{name}', got {count} in \['twin', 'twin'\]"
        with pytest.raises(ValueError, match=message):
            ft.Scene(twice).index(name)


def test_a_scene_travels_without_what_was_derived_from_it():
    made = ft.Scene([ft.Surface(square(), ft.BeamSplitter(), name="splitter")])
    made.derived["engine"] = lambda: None  # as little to be pickled as an Embree scene
    for other in (pickle.loads(pickle.dumps(made)), copy.deepcopy(made)):
        assert other.derived == {}
        assert other.index("splitter") == 0
        np.testing.assert_array_equal(other.surfaces[0].mesh.vertices, CORNERS)
        assert other.surfaces[0].interface == ft.BeamSplitter()
        with pytest.raises(ValueError, match="read-only"):
            other.surfaces[0].mesh.vertices[0, 0] = 1.0
    assert "engine" in made.derived


def test_beams_and_ccds_travel():
    for made in (beam(profile=ft.Gaussian(2.0)), ccd()):
        other = pickle.loads(pickle.dumps(made))
        np.testing.assert_array_equal(other.centre, made.centre)
        assert other.shape == made.shape
    assert pickle.loads(pickle.dumps(beam(profile=ft.Gaussian(2.0)))).profile == ft.Gaussian(2.0)
