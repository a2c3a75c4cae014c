"""Snell, Fresnel and polarised fields of the tracer beside a twin that solves Maxwell's conditions."""

import maxwell
import numpy as np
import pytest
from scipy.spatial import ConvexHull

import fringetrace as ft
from fringetrace import Fate, Mesh
from fringetrace.geometry import forms, shapes

# Rays are cut off on purpose: what becomes of them is looked at here, that it is warned of in `test_checks`.
pytestmark = pytest.mark.filterwarnings("ignore:power is cut off")

# Optical paths of two programs, relative: both add up some ten segments; curved and slanting faces multiply
# what a point is off.
PATH = 1e-12
# Fields: phases of no path are in them, only those of faces; each face some ten roundings, over the cosine.
FIELD = 1e-10
LEDGER = 1e-12


def hull(seed, centre, size=1.0, count=9):
    """A random convex polyhedron: its mesh and its planes."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    points = np.asarray(centre) + size * points / np.linalg.norm(points, axis=1)[:, None]
    found = ConvexHull(points)
    faces = found.simplices.copy()
    corners = points[faces]
    turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    wrong = np.einsum("ij,ij->i", turned, found.equations[:, :3]) < 0.0
    faces[wrong] = faces[wrong][:, ::-1]
    planes = found.equations.copy()
    planes[:, 3] *= -1.0
    return Mesh.cleaned(points, faces), planes


def ball(centre, radius, level=2):
    """A sphere with its form."""
    mesh = shapes.icosphere(radius, level).moved(centre)
    return mesh, forms.Sphere(centre, radius)


def shower(seed, count, towards, spread=0.4, away=4.0):
    """Random rays with random fields, most of which meet what is at one of some places."""
    random = np.random.default_rng(seed)
    start = random.normal(size=(count, 3))
    start *= away / np.linalg.norm(start, axis=1)[:, None]
    aim = np.asarray(towards)[random.integers(len(towards), size=count)] + random.uniform(
        -spread, spread, (count, 3)
    )
    direction = aim - start
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    field = random.normal(size=(count, 3)) + 1j * random.normal(size=(count, 3))
    field -= np.einsum("ij,ij->i", field, direction)[:, None] * direction
    field /= np.linalg.norm(field, axis=1)[:, None]
    return start, direction, field


def two_bodies(seed, first, second, around):
    """A polyhedron and a ball beside each other: scene, and bodies of the twin."""
    mesh, planes = hull(seed, (-1.2, 0.1, 0.0))
    globe, form = ball((1.1, 0.0, 0.2), 0.9)
    scene = ft.Scene(
        [
            ft.Surface(mesh, ft.Dielectric(), "stone", back=first),
            ft.Surface(globe, ft.Dielectric(), "ball", form, back=second),
        ],
        medium=around,
    )
    bodies = [
        maxwell.Body(first, planes=planes),
        maxwell.Body(second, centre=np.array([1.1, 0.0, 0.2]), radius=0.9),
    ]
    return scene, bodies


@pytest.mark.parametrize(
    ("seed", "first", "second", "around"),
    [(1, 1.5, 1.8, 1.0), (2, 1.33, 2.4, 1.0), (3, 1.0, 1.2, 1.6), (4, 1.7, 1.45, 1.33)],
)
def test_stones_and_balls_beside_the_twin(seed, first, second, around):
    scene, bodies = two_bodies(seed, first, second, around)
    start, direction, field = shower(seed, 24, [(-1.2, 0.1, 0.0), (1.1, 0.0, 0.2)])
    rays = ft.Rays(start, direction, polarisation=field)
    most, least = 6, 1e-4
    paths = ft.trace(scene, rays, max_bounces=most, min_amplitude=0.1 * least)
    assert not paths.contradictions.any()
    assert paths.ledger().error < LEDGER
    compared = 0
    for ray in range(len(start)):
        ends = maxwell.trace(bodies, around, start[ray], direction[ray], field[ray], most, least)
        rows = np.flatnonzero(paths.ray == ray)
        mine = {tuple(paths.sequence(row)): row for row in rows}
        bright = {
            key for key, row in mine.items()
            if paths.fate[row] != Fate.FAINT and np.abs(paths.amplitude[row]) > 1.01 * least
        }  # fmt: skip
        assert bright <= set(ends)
        assert {key for key, end in ends.items() if np.linalg.norm(end.amplitude) > 1.01 * least} <= set(mine)
        for key in bright:
            row, end = mine[key], ends[key]
            assert paths.fate[row] == (Fate.TRUNCATED if len(key) == most else Fate.LEFT) or len(key) == most
            if key:
                assert paths.length[row] == pytest.approx(end.length, rel=PATH)
            along = end.wave.real / np.linalg.norm(end.wave.real)
            np.testing.assert_allclose(paths.direction[row], along, rtol=0, atol=FIELD)
            np.testing.assert_allclose(paths.origin[row], end.origin, rtol=0, atol=FIELD)
            np.testing.assert_allclose(paths.field[row], end.amplitude, rtol=0, atol=FIELD)
            assert abs(paths.field[row] @ paths.direction[row]) < FIELD
            assert paths.index[row] == (around if end.inside < 0 else bodies[end.inside].index)
            compared += 1
    assert compared > 60
