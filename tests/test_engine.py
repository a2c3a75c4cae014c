"""The engine against its brute-force twin, against leaks, and against all that hurts Embree."""

import math
from functools import cache

import numpy as np
import pytest
import twin

import fringetrace as ft
from fringetrace import nm, shapes

MIRROR = ft.Mirror()
# Distances are good to this part of the path: a few hundred roundings of float64.
DISTANCE = 1e-12
# Float32 may take a ray past a silhouette on the wrong side this often.
GRAZES = 2e-6


def merged(*meshes):
    """Several meshes as one, none welded to another."""
    shift = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])[:-1]
    return ft.Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, shift, strict=True)]),
    )


def inverted(mesh):
    """The same triangles with their fronts behind."""
    return ft.Mesh(mesh.vertices, mesh.faces[:, ::-1])


def mirrors(*meshes):
    """A scene of mirrors, one surface for each mesh."""
    return ft.Scene([ft.Surface(mesh, MIRROR, name=f"mirror {i}") for i, mesh in enumerate(meshes)])


def box(width, depth, height):
    """A box about the origin."""
    return shapes.plate(width, depth, height).moved((0.0, 0.0, 0.5 * height))


def within(rng, low, high, count):
    """Rays from random points of a box in all directions."""
    return ft.Rays(rng.uniform(low, high, (count, 3)), rng.normal(size=(count, 3)))


def wedge(degrees):
    return shapes.extrude([(0.0, 0.0), (1.0, 0.0), (1.0, math.tan(math.radians(degrees)))], 1.0, closed=True)


def in_wedge(degrees):
    def shoot(rng, count):
        x, part = rng.uniform(0.1, 0.9, count), rng.uniform(0.1, 0.9, count)
        z = part * x * math.tan(math.radians(degrees))
        return ft.Rays(np.stack([x, rng.uniform(-0.4, 0.4, count), z], axis=1), rng.normal(size=(count, 3)))

    return shoot


def grooves(count=40, depth=0.03):
    """A room of size 2 whose floor and ceiling are V-grooves."""
    x = np.linspace(-1.0, 1.0, 2 * count + 1)
    z = np.where(np.arange(len(x)) % 2, -1.0 - depth, -1.0)
    floor = np.stack([x, z], axis=1)
    return shapes.extrude(np.concatenate([floor, -floor]), 2.0, closed=True)


def rods_in_a_box():
    lattice = shapes.rod_lattice(12, 12, 0.065, 0.28, 3.0)
    return merged(lattice.moved(-lattice.bounds.mean(axis=0)), inverted(box(4.2, 4.0, 4.2)))


def around_the_rods(rng, count):
    start = rng.uniform(1.85, 1.95, (count, 3)) * rng.choice([-1.0, 1.0], (count, 3))
    return ft.Rays(start, rng.normal(size=(count, 3)))


def room_and_cube():
    """A cube of 0.4 that stands on the floor of a room of 2."""
    return box(0.4, 0.4, 0.4).moved((0.0, 0.0, -0.8)), inverted(box(2.0, 2.0, 2.0))


ROOMS = {
    "icosphere 5k": (lambda: mirrors(shapes.icosphere(1.0, 4)), lambda r, n: within(r, -0.3, 0.3, n), 0.0),
    "icosphere 80k": (lambda: mirrors(shapes.icosphere(1.0, 6)), lambda r, n: within(r, -0.3, 0.3, n), 0.0),
    "cube": (lambda: mirrors(box(1.0, 1.0, 1.0)), lambda r, n: within(r, -0.45, 0.45, n), 0.0),
    "wedge 5 degrees": (lambda: mirrors(wedge(5.0)), in_wedge(5.0), 0.0),
    "V-grooves": (lambda: mirrors(grooves()), lambda r, n: within(r, -0.9, 0.9, n), GRAZES),
    "box of 144 rods": (lambda: mirrors(rods_in_a_box()), around_the_rods, GRAZES),
    "cube on a floor": (
        lambda: mirrors(merged(*room_and_cube())),
        lambda r, n: within(r, (-0.95, -0.95, -0.55), 0.95, n),
        GRAZES,
    ),
    "cube on a floor, two surfaces": (
        lambda: mirrors(*room_and_cube()),
        lambda r, n: within(r, (-0.95, -0.95, -0.55), 0.95, n),
        GRAZES,
    ),
}
DEPTH = 50
HOW_MANY = [20_000, pytest.param(1_000_000, marks=pytest.mark.slow)]


@pytest.mark.parametrize("bounces", HOW_MANY)
@pytest.mark.parametrize("room", ROOMS)
def test_a_closed_room_keeps_every_ray_and_the_twin_agrees(room, bounces):
    build, shoot, grazes = ROOMS[room]
    rays = shoot(np.random.default_rng(1), bounces // DEPTH)
    paths = ft.trace(build(), rays, max_bounces=DEPTH, record=True)
    assert (paths.fate == ft.Fate.TRUNCATED).all()
    assert (paths.bounces == DEPTH).all()
    verdict = twin.judge(paths)
    print(room, verdict, 'doubt', paths.doubtful/paths.segments)
    assert verdict.bounces == bounces
    assert verdict.itself == 0
    assert verdict.worst < DISTANCE
    assert len(verdict.wrong) <= grazes * bounces
