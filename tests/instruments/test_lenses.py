"""Lenses: where faces lie and which way they look, that they are closed, and what is refused."""

import math
from itertools import pairwise

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm
from fringetrace.core.vectors import rotation
from fringetrace.geometry import forms
from fringetrace.geometry.implicit import EPSILON
from fringetrace.instruments import lenses

INF = math.inf
CLEAR = ft.BeamSplitter(0.0, 1.0)  # light goes straight on
BK7, SF5 = 1.5168, 1.6727
# Radii, thicknesses, indices, diameter: plano-convex f = 100 mm; cemented achromat f = 100 mm (Thorlabs
# AC254-100-A); its like in air, of three; a meniscus; a strong biconcave one.
CATALOGUE = {
    "singlet": ((51.68 * mm, INF), (4.0 * mm,), (BK7,), 25.4 * mm),
    "doublet": ((62.8 * mm, -45.7 * mm, -128.2 * mm), (4.0 * mm, 2.5 * mm), (BK7, SF5), 25.4 * mm),
    "triplet": (
        (30.0 * mm, -40.0 * mm, 40.0 * mm, -30.0 * mm), (5.0 * mm, 2.0 * mm, 5.0 * mm), (BK7, SF5, BK7),
        15.0 * mm,
    ),
    "meniscus": ((32.1 * mm, 82.2 * mm), (3.6 * mm,), (BK7,), 25.4 * mm),
    "biconcave": ((-15.0 * mm, 15.0 * mm), (1.0 * mm,), (SF5,), 20.0 * mm),
}  # fmt: skip


def made(which, **more):
    return lenses.lens(*CATALOGUE[which], **more)


def faces_of(surfaces):
    return [surface for surface in surfaces if "edge" not in surface.name]


def edges_of(surfaces):
    return [surface for surface in surfaces if "edge" in surface.name]


def volume(corners):
    """Of a closed mesh, (f, 3, 3), positive if its front is outside."""
    return np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0


def cap_volume(radius, half):
    """Between a sphere and its vertex plane, within a cylinder; positive if it bends to +z."""
    if math.isinf(radius):
        return 0.0
    sag = abs(radius) - math.sqrt(radius**2 - half**2)
    below = math.pi * sag * sag * (abs(radius) - sag / 3.0)
    return math.copysign(math.pi * half**2 * sag - below, radius)


@pytest.mark.parametrize("name", CATALOGUE)
def test_vertices_lie_on_the_faces(name):
    radii, thicknesses, _, diameter = CATALOGUE[name]
    surfaces = made(name)
    for surface, radius, z in zip(faces_of(surfaces), radii, np.cumsum([0.0, *thicknesses]), strict=True):
        x, y, height = surface.mesh.vertices.T
        square = x * x + y * y
        # R - sqrt(R^2 - r^2) without its cancellation
        sag = square / (radius + math.copysign(1.0, radius) * np.sqrt(radius**2 - square))
        expected = z + (np.zeros_like(x) if math.isinf(radius) else sag)
        assert np.abs(height - expected).max() <= 4.0 * EPSILON * np.abs(expected).max()
        assert height[0] == z
        assert math.sqrt(square.max()) == pytest.approx(0.5 * diameter, rel=4 * EPSILON)


@pytest.mark.parametrize("name", CATALOGUE)
def test_each_glass_is_closed_and_its_normals_look_outside(name):
    surfaces = made(name)
    radii, thicknesses, _, diameter = CATALOGUE[name]
    half = 0.5 * diameter
    for i, (one, other) in enumerate(pairwise(faces_of(surfaces))):
        edge = edges_of(surfaces)[i]
        corners = np.concatenate([s.mesh.vertices[s.mesh.faces] for s in (one, edge)])
        behind = other.mesh.vertices[other.mesh.faces][:, ::-1]  # its front is in the glass
        corners = np.concatenate([corners, behind])
        _, number = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        faces = number.reshape(-1, 3)
        sides = np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)])
        there, times = np.unique(sides, axis=0, return_counts=True)
        assert (times == 1).all()
        assert set(map(tuple, there)) == set(map(tuple, there[:, ::-1]))  # each side is met from both
        exact = (
            math.pi * half**2 * thicknesses[i] - cap_volume(radii[i], half) + cap_volume(radii[i + 1], half)
        )
        assert volume(corners) == pytest.approx(exact, rel=4e-3)  # 0.2 % of a circle is outside 96 sides
        assert volume(corners) < exact * (1.0 + 1e-12) or radii[i] < 0


def test_fronts_are_where_light_comes_from():
    for surface in faces_of(made("doublet", axis=(1.0, 2.0, -2.0))):
        a, b, c = np.moveaxis(surface.mesh.vertices[surface.mesh.faces], 1, 0)
        assert (np.cross(b - a, c - a) @ np.array([1.0, 2.0, -2.0]) < 0.0).all()


def test_thickness_in_the_middle_and_at_the_rim():
    one, two, three, edge, last = made("doublet")
    assert two.mesh.vertices[0, 2] - one.mesh.vertices[0, 2] == 4.0 * mm
    first, third = (
        radius - math.copysign(math.sqrt(radius**2 - 12.7**2), radius) for radius in (62.8, -128.2)
    )
    rim = last.mesh.bounds[1, 2] - edge.mesh.bounds[0, 2]
    assert rim == pytest.approx((6.5 - first + third) * mm, rel=1e-13)
    assert last.mesh.bounds[1, 2] == three.mesh.bounds[0, 2]


def test_names_interfaces_and_forms():
    surfaces = made("singlet", name="collector", edge=ft.Mirror(), interface=(ft.Mirror(), CLEAR))
    assert [surface.name for surface in surfaces] == ["collector 1", "collector 2", "collector edge 1"]
    assert [surface.interface for surface in surfaces] == [ft.Mirror(), CLEAR, ft.Mirror()]
    assert [type(surface.form) for surface in surfaces] == [forms.Conic, type(None), forms.Cylinder]


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (-0.3, 0.5, 0.7)])
def test_a_lens_stands_where_it_is_put(axis):
    place, along = np.array([0.1, -0.2, 0.3]), np.array(axis) / np.linalg.norm(axis)
    for here, there in zip(made("doublet"), made("doublet", vertex=place, axis=axis), strict=True):
        offset = there.mesh.vertices - place
        height = offset @ along
        assert height == pytest.approx(here.mesh.vertices[:, 2], abs=1e-16)
        aside = np.linalg.norm(offset - np.outer(height, along), axis=1)
        assert aside == pytest.approx(np.hypot(*here.mesh.vertices.T[:2]), abs=1e-16)
        if there.form is not None:
            value, *_ = there.form.level(there.mesh.vertices, offset)
            assert np.abs(value).max() < 1e-16


def through(count, tilt, rng, reach):
    """Rays that cross the middle of a lens at any angle up to `tilt`, forwards."""
    aim = np.concatenate(
        [rng.uniform(-reach, reach, (count, 2)), rng.uniform(0.0, 4 * mm, (count, 1))], axis=1
    )
    angle, turn = rng.uniform(0.0, tilt, count), rng.uniform(0.0, 2.0 * math.pi, count)
    d = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], axis=1)
    return aim - 0.05 * d, d


def met(radius, z, origin, direction):
    """Way of lines to the part of a sphere beside its vertex at (0, 0, z), or to the plane."""
    if math.isinf(radius):
        return (z - origin[:, 2]) / direction[:, 2]
    offset = origin - np.array([0.0, 0.0, z + radius])
    along = np.einsum("ij,ij->i", offset, direction)
    aside = np.einsum("ij,ij->i", offset, offset) - along**2
    return -along - math.copysign(1.0, radius) * np.sign(direction[:, 2]) * np.sqrt(radius**2 - aside)


@pytest.mark.parametrize("name", CATALOGUE)
@pytest.mark.parametrize("back", [False, True])
def test_light_finds_every_face_from_either_side(name, back):
    radii, thicknesses, _, diameter = CATALOGUE[name]
    surfaces = made(name, interface=CLEAR)
    origin, direction = through(200, 0.3, np.random.default_rng(3), 0.2 * diameter)
    places = np.cumsum([0.0, *thicknesses])
    if back:
        origin, direction = origin + 0.1 * direction, -direction
    expected = np.stack(
        [met(r, z, origin, direction) for i, (r, z) in enumerate(zip(radii, places, strict=True))]
    )
    paths = ft.trace(ft.Scene(surfaces), ft.Rays(origin, direction), record=True)
    order = list(range(len(radii)))[:: -1 if back else 1]
    assert (paths.surface[:, : len(radii)] == order).all()
    ways = np.linalg.norm(paths.points[:, 1 : len(radii) + 1] - origin[:, None], axis=2)
    assert np.abs(ways - expected[order].T).max() < 1e-15


# Lens, and the part of its radius within which rays cross its middle
STEEP = {
    "half ball": (lambda: lenses.plano_convex(5 * mm, 5 * mm, BK7, 10 * mm, interface=CLEAR), 0.45),
    "hyperboloid": (lambda: lenses.plano_hyperbola(15 * mm, 1.5, 12 * mm, 1.5, 24e-3, interface=CLEAR), 0.55),
    "asphere": (
        lambda: lenses.lens(
            (8 * mm, -30 * mm), (6 * mm,), (BK7,), 12 * mm, conics=(-0.8, 2.0),
            terms=((-8e4, 5e8, -1e13), (2e4,)), interface=CLEAR,
        ),
        0.55,
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", STEEP)
def test_no_ray_is_lost_between_facets_and_form(kind):
    make, reach = STEEP[kind]
    surfaces = make()
    one, two = surfaces[:2]
    depth, half = two.mesh.bounds[1, 2], one.mesh.bounds[1, 0]
    origin, direction = through(1500, 0.4, np.random.default_rng(5), reach * half)
    origin[:, 2] += 0.5 * depth - 2 * mm
    paths = ft.trace(ft.Scene(surfaces), ft.Rays(origin, direction), record=True)
    assert (paths.surface == [0, 1]).all()
    for i, surface in enumerate(faces_of(surfaces)):
        if surface.form is not None:
            point = paths.points[:, i + 1]
            height = surface.form.vertex[2] + surface.form.sag((point[:, :2] ** 2).sum(axis=1))
            assert np.abs(point[:, 2] - height).max() < 8 * EPSILON * depth


def test_a_knife_edge_has_no_wall():
    radius = 5 * mm
    assert len(lenses.plano_convex(radius, radius, BK7, 2 * radius)) == 2
    sag = 20 * mm - math.sqrt(400.0 - 25.0) * mm
    assert len(lenses.biconvex(20 * mm, 2.0 * sag, BK7, 10 * mm)) == 2
    assert len(lenses.biconvex(20 * mm, 2.0 * sag + 1e-6, BK7, 10 * mm)) == 3


def test_air_gaps_have_no_edge_and_may_be_closed():
    surfaces = lenses.lens(
        (50 * mm, INF, 60 * mm, INF), (4 * mm, 0.0, 3 * mm), (BK7, None, SF5), 12 * mm, edge=ft.Absorber()
    )
    assert [surface.name for surface in edges_of(surfaces)] == ["lens edge 1", "lens edge 3"]


def test_facets_bend_little_and_rims_have_96_corners():
    for surface in faces_of(made("singlet")):
        assert len(surface.mesh.faces) == 6 * 16**2
    assert len(made("singlet", rings=3)[0].mesh.faces) == 54
    cap = lenses.plano_convex(5 * mm, 5 * mm, BK7, 10 * mm)[0]
    a, b, c = np.moveaxis(cap.mesh.vertices[cap.mesh.faces], 1, 0)
    longest = max(np.linalg.norm(side, axis=1).max() for side in (b - a, c - b, a - c))
    assert longest < 1.4 * lenses.BEND * 5 * mm


def test_ready_lenses():
    one, two, _ = lenses.biconvex(103.36 * mm, 4 * mm, BK7, 20 * mm)
    assert (one.form.radius, two.form.radius) == (103.36 * mm, -103.36 * mm)
    one, two, _ = lenses.plano_convex(51.68 * mm, 4 * mm, BK7, 20 * mm, flat_first=True)
    assert one.form is None
    assert two.form.radius == -51.68 * mm
    one, two, _ = lenses.plano_hyperbola(20 * mm, 1.5, 8 * mm, 1.5, 20 * mm)
    assert (two.form.radius, two.form.conic) == (-10 * mm, -2.25)
    ball = lenses.ball(10 * mm, 1.5, centre=(1, 2, 3), name="bead")
    assert (ball.form.radius, ball.name) == (5 * mm, "bead")
    assert np.linalg.norm(ball.mesh.vertices - (1, 2, 3), axis=1) == pytest.approx(5 * mm, rel=1e-12)


# f and back focal length by mpmath's ray at a nanometre from the axis, see physics/test_lenses.py
@pytest.mark.parametrize(
    ("radii", "thicknesses", "indices", "back"),
    [
        ((51.68, INF), (4.0,), (BK7,), 97.362869198312),
        ((INF, -51.68), (4.0,), (BK7,), 100.0),
        ((103.36, -103.36), (4.0,), (BK7,), 99.336341916645),
        ((5.0, -5.0), (10.0,), (1.5,), 2.5),
    ],
)
def test_focal_lengths(radii, thicknesses, indices, back):
    assert lenses.focal_lengths(radii, thicknesses, indices)[1] == pytest.approx(back, rel=1e-13)


def test_focal_lengths_of_what_has_no_power():
    assert lenses.focal_lengths((INF, INF), (3.0,), (1.5,)) == (INF, INF)
    assert lenses.focal_lengths((5.0, -5.0), (10.0,), (1.5,))[0] == pytest.approx(7.5, rel=1e-15)


@pytest.mark.parametrize(
    ("change", "error", "match"),
    [
        ({"radii": (0.1,)}, ValueError, "lens radii: expected those of two faces or more, got 1"),
        ({"thicknesses": ()}, ValueError, "lens thicknesses: expected 1 for 2 faces, got 0"),
        ({"glasses": (1.5, 1.6)}, ValueError, "lens glasses: expected 1 for 2 faces, got 2"),
        ({"conics": (0.0,)}, ValueError, "lens conics: expected 2 for 2 faces, got 1"),
        ({"terms": ((),)}, ValueError, "lens terms: expected 2 for 2 faces, got 1"),
        ({"interface": (CLEAR,) * 3}, ValueError, "lens interface: expected 2 for 2 faces, got 3"),
        ({"diameter": 0.0}, ValueError, "lens diameter: expected a positive length in metres, got 0"),
        ({"thicknesses": (-1 * mm,)}, ValueError, "lens thickness 1: expected a positive length"),
        ({"thicknesses": (0.0,)}, ValueError, "lens thickness 1: expected a positive length"),
        ({"radii": (0.0, INF)}, ValueError, "Conic radius"),
        ({"diameter": 25 * mm}, ValueError, "expected up to 0.02 m, the equator of face 1, got 0.025"),
        ({"diameter": 18 * mm}, ValueError, "lens faces 1 and 2: expected .* 0.0026411 m in one another"),
        ({"rings": 0}, ValueError, "lens rings: expected a whole number from 1, got 0"),
        ({"axis": (0, 0, 0)}, ValueError, "lens axis"),
    ],
)  # fmt: skip
def test_what_is_no_lens_is_refused(change, error, match):
    given = {"radii": (10 * mm, INF), "thicknesses": (3 * mm,), "glasses": (1.5,), "diameter": 8 * mm}
    with pytest.raises(error, match=match):
        lenses.lens(**{**given, **change})


def test_a_hyperboloid_needs_an_index_above_1():
    with pytest.raises(ValueError, match="plano-hyperbola index: expected a number above 1, got 1"):
        lenses.plano_hyperbola(20 * mm, 1.0, 5 * mm, 1.5, 10 * mm)
    with pytest.raises(ValueError, match="ball diameter: expected a positive length"):
        lenses.ball(-1.0, 1.5)


def test_a_lens_may_be_turned_after_it_was_made():
    turn = rotation((1, 1, 0), 0.3)
    for surface in made("doublet"):
        moved = surface.moved((0.01, 0.0, 0.0), turn)
        assert (moved.mesh.faces == surface.mesh.faces).all()
