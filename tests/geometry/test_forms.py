"""Forms: what they refuse, their derivatives, and the fit to a mesh."""

import math

import numpy as np
import pytest

import fringetrace as ft
from fringetrace.geometry import forms, shapes

HEIGHTS = np.add.outer(np.linspace(-1, 1, 6) ** 3, np.linspace(-1, 1, 7) ** 2)
TURN = ft.vectors.rotation((1, 2, 3), 0.7)
FORMS = {
    "sphere": forms.Sphere((0.1, 0.2, 0.3), 2.0),
    "cylinder": forms.Cylinder((0.1, 0.2, 0.3), (1, 1, 0), 2.0),
    "parabola": forms.Conic((0, 0, 0), (0, 1, 1), 2.0, -1.0),
    "ellipse": forms.Conic((0, 0, 0), (0, 1, 1), -2.0, -0.3),
    "asphere": forms.Conic((0, 0, 0), (0, 1, 1), 2.0, 0.4, (0.1, -0.02)),
    "plane": forms.Conic((0, 0, 0), (0, 1, 1), math.inf),
    "height field": forms.HeightField(HEIGHTS, (0.3, 0.4), (0.1, 0.0, 0.0), TURN),
}


@pytest.mark.parametrize("name", FORMS)
def test_gradient_and_bend_are_the_derivatives_of_the_level(name):
    form = FORMS[name]
    rng = np.random.default_rng(1)
    point = rng.uniform(-0.4, 0.4, (50, 3))
    direction = rng.normal(size=(50, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    value, gradient, bend = form.level(point, direction)
    step = 1e-4
    ahead, behind = (form.level(point + s * direction, direction)[0] for s in (step, -step))
    # the next terms are of order step^2; the digits lost, of order 1e-16 / step^2
    slope = np.einsum("ij,ij->i", gradient, direction)
    assert (ahead - behind) / (2 * step) == pytest.approx(slope, abs=1e-6)
    assert (ahead + behind - 2 * value) / step**2 == pytest.approx(
        bend, abs=1e-4 if "field" not in name else 1e-2
    )


def test_a_mesh_is_fitted_on_either_side():
    mesh = shapes.icosphere(2.0, 2)
    form = forms.Sphere((0, 0, 0), 2.0)
    assert (form.fit(mesh).along == 1).all()
    assert (form.fit(ft.Mesh(mesh.vertices, mesh.faces[:, ::-1])).along == -1).all()
    corners = mesh.vertices[mesh.faces]
    assert form.fit(mesh).sag >= 2.0 - np.linalg.norm(corners.mean(axis=1), axis=1).max()


@pytest.mark.parametrize("wrong", [forms.Sphere((0, 0, 0), 3.0), forms.Cylinder((0, 0, 9), (1, 0, 0), 2.0)])
def test_a_mesh_elsewhere_is_refused(wrong):
    with pytest.raises(ValueError, match="form: expected faces that lie along it"):
        ft.Surface(shapes.icosphere(2.0, 2), ft.Mirror(), form=wrong)


@pytest.mark.parametrize("wrong", [forms.Sphere, 3.0, "sphere"])
def test_what_is_no_form_is_refused(wrong):
    with pytest.raises(TypeError, match=r"lens form: expected one such as forms\.Sphere"):
        ft.Surface(shapes.icosphere(2.0, 2), ft.Mirror(), "lens", form=wrong)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: forms.Sphere((0, 0), 1.0), "Sphere centre: expected 3 numbers"),
        (lambda: forms.Sphere((0, 0, 0), -1.0), "Sphere radius: expected a positive length"),
        (lambda: forms.Cylinder((0, 0, 0), (0, 0, 0), 1.0), "Cylinder axis: expected a direction"),
        (
            lambda: forms.Cylinder((0, 0, 0), (0, 0, 1), math.nan),
            "Cylinder radius: expected a positive length",
        ),
        (
            lambda: forms.Conic((0, 0, 0), (0, 0, 1), 0.0),
            "Conic radius: expected a length in metres other than 0",
        ),
        (lambda: forms.Conic((0, 0, 0), (0, 0, 1), 1.0, math.inf), "Conic: expected a finite conic constant"),
        (lambda: forms.HeightField(np.zeros((3, 4)), 1.0), "HeightField heights: expected 4 x 4"),
        (lambda: forms.HeightField(np.full((4, 4), math.nan), 1.0), "HeightField heights: expected 4 x 4"),
        (lambda: forms.HeightField(np.zeros((4, 4)), 0.0), "HeightField pitch: expected a positive length"),
        (
            lambda: forms.HeightField(np.zeros((4, 4)), 1.0, turn=np.ones((3, 3))),
            "HeightField turn: expected a rot",
        ),
    ],
)
def test_what_a_form_refuses(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_plane_form_changes_nothing():
    plate = shapes.plate(1.0, 1.0)
    rays = ft.Rays([(0.1, 0.2, 1.0)], [(0.1, 0.0, -1.0)])
    flat = ft.trace(ft.Scene([ft.Surface(plate, ft.Mirror())]), rays)
    form = forms.Conic((0, 0, 0), (0, 0, 1), math.inf)
    same = ft.trace(ft.Scene([ft.Surface(plate, ft.Mirror(), form=form)]), rays)
    assert same.length == pytest.approx(flat.length, rel=1e-15)
    assert same.direction == pytest.approx(flat.direction, abs=1e-15)


@pytest.mark.parametrize("name", FORMS)
def test_a_form_moves_with_its_mesh(name):
    form = FORMS[name]
    rng = np.random.default_rng(2)
    point, direction = rng.uniform(-0.4, 0.4, (20, 3)), rng.normal(size=(20, 3))
    turn, offset = ft.vectors.rotation((3, -1, 2), 1.1), np.array([0.3, -0.2, 0.5])
    value, gradient, bend = form.level(point, direction)
    moved = form.moved(offset, turn).level(point @ turn.T + offset, direction @ turn.T)
    assert moved[0] == pytest.approx(value, abs=1e-13)
    assert moved[1] @ turn == pytest.approx(gradient, abs=1e-12)
    assert moved[2] == pytest.approx(bend, abs=1e-11)


def test_a_surface_moves_with_its_form():
    surface = ft.Surface(shapes.icosphere(2.0, 2), ft.Mirror(), "ball", form=forms.Sphere((0, 0, 0), 2.0))
    moved = surface.moved((5.0, 0.0, 0.0), TURN)
    paths = ft.trace(ft.Scene([moved]), ft.Rays([(5.3, 0.4, 9.0)], [(0, 0, -1)]))
    assert paths.length[0] == pytest.approx(9.0 - math.sqrt(4.0 - 0.25), rel=1e-14)
    assert moved.name == "ball"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: forms.Smooth(np.zeros((4, 3))), r"Smooth normals: expected directions of shape \(v, 3\)"),
        (lambda: forms.Smooth(np.ones((4, 2))), r"Smooth normals: expected directions of shape \(v, 3\)"),
        (
            lambda: surface_of(forms.Smooth(np.ones((4, 3)))),
            "Smooth normals: expected 162, one for each vertex, got 4",
        ),
        (lambda: surface_of(forms.Smooth(), shapes.corner_cube(1.0)), "of a sharp edge a surface of its own"),
        (lambda: surface_of(forms.Smooth(), twice()), "Smooth form: expected faces wound alike"),
    ],
)
def test_what_smooth_refuses(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def surface_of(form, mesh=None):
    return ft.Surface(shapes.icosphere(2.0, 2) if mesh is None else mesh, ft.Mirror(), form=form)


def twice():
    """A plate of which each face is there twice."""
    plate = shapes.plate(1.0, 1.0)
    return ft.Mesh(plate.vertices, np.concatenate([plate.faces, plate.faces]))
