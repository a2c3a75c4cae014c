"""The nouns of a scene: what they keep, and everything they refuse."""

import copy
import math
import pickle
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace import shapes
from fringetrace.scene import sources
from fringetrace.tracing.intersect.embree import build

CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
FACES = np.array([[0, 1, 2], [2, 1, 3]])
# Moving a mesh multiplies and adds coordinates of size 1 or so a few times.
ROUNDING = 16 * float(np.finfo(np.float64).eps)


def square(**changes):
    return ft.Mesh(**{"vertices": CORNERS, "faces": FACES, "name": "square", **changes})


def test_a_surface_takes_whatever_has_vertices_and_faces():
    alike = SimpleNamespace(vertices=CORNERS, faces=FACES)
    surface = ft.Surface(alike, ft.Mirror(), name="plate")
    assert isinstance(surface.mesh, ft.Mesh)
    assert surface.mesh.name == "plate"
    mesh = square()
    assert ft.Surface(mesh, ft.Mirror()).mesh is mesh


@pytest.mark.parametrize("value", ["mesh.stl", None, CORNERS, SimpleNamespace(vertices=CORNERS)])
def test_a_surface_wants_a_mesh(value):
    message = r"plate: expected a mesh with .*, or a pyvista\.PolyData, got .*read by .*meshes\.load"
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
    assert sources.as_names(name for name in ("a", "b")) == ("a", "b")


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
    engine = build(made, frozenset())  # an Embree scene cannot be pickled
    for other in (pickle.loads(pickle.dumps(made)), copy.deepcopy(made)):
        assert build(other, frozenset()) is not engine
        assert other.index("splitter") == 0
        np.testing.assert_array_equal(other.surfaces[0].mesh.vertices, CORNERS)
        assert other.surfaces[0].interface == ft.BeamSplitter()
        with pytest.raises(ValueError, match="read-only"):
            other.surfaces[0].mesh.vertices[0, 0] = 1.0
    assert build(made) is engine


def test_beams_and_ccds_travel():
    for made in (beam(profile=ft.Gaussian(2.0)), ccd()):
        other = pickle.loads(pickle.dumps(made))
        np.testing.assert_array_equal(other.centre, made.centre)
        assert other.shape == made.shape
    assert pickle.loads(pickle.dumps(beam(profile=ft.Gaussian(2.0)))).profile == ft.Gaussian(2.0)


def test_a_surface_is_fitted_once_and_travels_without_the_fit():
    ball = ft.Surface(shapes.icosphere(1.0, 1), ft.Mirror(), form=ft.forms.Sphere((0, 0, 0), 1.0))
    assert ball.fit is ball.fit
    other = pickle.loads(pickle.dumps(ball))
    assert "fit" not in vars(other)
    np.testing.assert_array_equal(other.fit.along, ball.fit.along)
    assert ft.Surface(square(), ft.Mirror()).fit is None
