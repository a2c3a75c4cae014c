"""The engine against its brute-force twin, against leaks, and against all that hurts Embree."""

import dataclasses
import functools
import math
import pickle
from copy import deepcopy
from fractions import Fraction

import numpy as np
import pytest
import twin
from columns import BARE
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace import nm
from fringetrace.core.vectors import rotation
from fringetrace.geometry import shapes
from fringetrace.tracing.intersect.embree import build
from fringetrace.tracing.paths import join

# Rays are cut off on purpose: what becomes of them is looked at here, that it is warned of in `test_checks`.
pytestmark = pytest.mark.filterwarnings("ignore:power is cut off")

MIRROR = ft.Mirror()
# Distances are good to this part of the path: a few hundred roundings of float64.
DISTANCE = 1e-12
# Float32 may take a ray past a silhouette on the wrong side this often, where it passes as near as this
# (a few of its roundings) to the edge, relative to the scene.
GRAZES, GRAZE = 2e-6, 2.0**-22


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


def unwelded(mesh):
    """The same triangles, each with vertices of its own, as STL files have them."""
    return ft.Mesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(mesh.faces.size).reshape(-1, 3))


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


def ends(paths):
    """All that is known of paths without a record, as bytes."""
    return {name: getattr(paths, name).tobytes() for name in (*BARE, "pixel")}


DEPTH = 50
HOW_MANY = [20_000, pytest.param(1_050_000, marks=pytest.mark.slow)]


@pytest.mark.parametrize("bounces", HOW_MANY)
@pytest.mark.parametrize(
    "room", [pytest.param(room, marks=pytest.mark.slow if "80k" in room else ()) for room in ROOMS]
)
def test_a_closed_room_keeps_every_ray_and_the_twin_agrees(room, bounces):
    build, shoot, grazes = ROOMS[room]
    rays = shoot(np.random.default_rng(1), bounces // DEPTH)
    paths = ft.trace(build(), rays, max_bounces=DEPTH, record=True)
    assert (paths.fate == ft.Fate.TRUNCATED).all()
    assert (paths.bounces == DEPTH).all()
    # where nothing is recorded there is a shorter way
    assert ends(ft.trace(paths.scene, rays, max_bounces=DEPTH)) == ends(paths)
    verdict = twin.judge(paths)
    assert verdict.bounces == bounces
    assert verdict.itself == 0
    assert verdict.distance < DISTANCE
    assert verdict.aside < DISTANCE
    assert verdict.graze < GRAZE
    assert len(verdict.wrong) <= grazes * bounces


def seen_from_afar(rng, count, centre):
    """Rays from a square of 1 mm, 0.1 m away, onto the rods."""
    start = centre + np.array([0.02, 0.01, 0.1]) + rng.uniform(-5e-4, 5e-4, (count, 3))
    aim = centre + rng.uniform(-1.0, 1.0, (count, 3)) * [2.9e-6, 2.5e-6, 0.5e-6]
    return ft.Rays(start, aim - start)


@pytest.mark.parametrize("bounces", HOW_MANY)
@pytest.mark.parametrize("x", [0.0, 0.1], ids=["at the origin", "0.1 m off"])
def test_rods_of_65_nm_seen_from_100_mm(x, bounces):
    lattice = shapes.rod_lattice(20, 4, 65 * nm, 280 * nm, 6e-6)
    centre = np.array([x, 0.0, 0.0])
    scene = mirrors(lattice.moved(centre - lattice.bounds.mean(axis=0)))
    rng = np.random.default_rng(2)
    whole, inside = twin.Verdict(), twin.Verdict()
    while whole.bounces < bounces:
        rays = seen_from_afar(rng, min(bounces // 2, 100_000), centre)
        paths = ft.trace(scene, rays, max_bounces=40, record=True)
        assert ends(ft.trace(scene, rays, max_bounces=40)) == ends(paths)
        whole += twin.judge(paths)
        inside += twin.judge(paths.where(paths.bounces > 1), begin=1)
    assert whole.itself == 0
    assert whole.distance < DISTANCE
    assert whole.aside < DISTANCE
    assert whole.graze < GRAZE
    assert len(whole.wrong) <= GRAZES * bounces
    if x == 0.0:  # further off, coordinates in metres do not have the digits
        assert inside.distance < DISTANCE
        assert inside.aside < DISTANCE


# Embree has holes at exact vertices.

CLOSED = {
    **{f"icosphere {level}": functools.partial(shapes.icosphere, 1.0, level) for level in range(5)},
    "cube": lambda: box(1.0, 1.0, 1.0),
    "cube far off": lambda: box(1.0, 1.0, 1.0).moved((0.3, 1000.7, -3.0)),
    "cylinder": lambda: shapes.rod_lattice(1, 1, 1.0, 3.0, 2.0),
    "cylinder askew": lambda: shapes.rod_lattice(1, 1, 1.0, 3.0, 2.0).moved(
        (7, 8, 9), rotation((1, 2, 3), 0.7)
    ),
    "prism": lambda: shapes.rod_lattice(1, 1, 1.0, 3.0, 2.0, sides=3),
    "wedge": lambda: wedge(5.0),
    "inside out": lambda: inverted(shapes.icosphere(1.0, 3)),
    "every triangle its own vertices": lambda: unwelded(shapes.icosphere(1.0, 2)),
}


@pytest.mark.parametrize("name", CLOSED)
def test_no_ray_escapes_through_a_vertex_or_an_edge(name):
    mesh = CLOSED[name]()
    scene, rng = mirrors(mesh), np.random.default_rng(5)
    corners = mesh.vertices[mesh.faces]
    middle = 0.5 * (corners + np.roll(corners, 1, axis=1))
    targets = np.unique(np.concatenate([corners, middle]).reshape(-1, 3), axis=0)
    centre = corners.mean(axis=(0, 1))
    sources = centre + 0.3 * rng.uniform(size=(6 if len(targets) < 5000 else 2, 1)) * (
        targets[rng.integers(len(targets), size=6 if len(targets) < 5000 else 2)] - centre
    )
    for source in [centre, *sources]:
        rays = ft.Rays(np.broadcast_to(source, targets.shape), targets - source)
        paths = ft.trace(scene, rays, max_bounces=30)
        assert (paths.fate == ft.Fate.TRUNCATED).all()
        assert (paths.bounces == 30).all()


@pytest.mark.parametrize("relief", [0.0, 1e-6, 1e-3, 0.3])
@pytest.mark.parametrize("direction", [(0.0, 0.0, -1.0), (0.3, -0.2, -1.0), (1.0, 1.0, -1.0)])
@pytest.mark.parametrize("behind", ["nothing", "a surface"])
def test_no_ray_falls_through_a_vertex_of_an_open_height_map(behind, direction, relief):
    # steep ridges are silhouettes of slanting light: those it may miss
    relief = relief if direction[0] == 0.0 else min(relief, 1e-3)
    front = shapes.height_map(relief * np.random.default_rng(3).uniform(size=(101, 101)), 0.1)
    back = shapes.plate(30.0, 30.0).moved((0, 0, -3))
    scene = {
        "nothing": mirrors(front),
        "a surface": mirrors(front, back),
    }[behind]
    grid = front.vertices.reshape(101, 101, 3)[10:-10, 10:-10]
    cut = 0.5 * (grid[1:, 1:] + grid[:-1, :-1])
    edges = 0.5 * (grid[1:] + grid[:-1]), 0.5 * (grid[:, 1:] + grid[:, :-1]), cut
    targets = np.concatenate([points.reshape(-1, 3) for points in (grid, *edges)])
    step = np.array(direction)
    rays = ft.Rays(targets - 2.0 * step, np.broadcast_to(step, targets.shape))
    paths = ft.trace(scene, rays, max_bounces=1)
    assert (paths.bounces == 1).all()
    np.testing.assert_allclose(paths.length, 2.0 * np.linalg.norm(step), rtol=1e-14)


def test_a_beam_whose_rays_all_meet_vertices():
    z = 1e-4 * np.random.default_rng(4).uniform(size=(65, 65))
    pitch = 2.0**-6
    beam = ft.Beam((0, 0, 1), (0, 0, -1), (0, 1, 0), (63 * pitch, 63 * pitch), (63, 63))
    paths = ft.trace(mirrors(shapes.height_map(z, pitch)), beam, max_bounces=1)
    np.testing.assert_allclose(1.0 - paths.length.reshape(63, 63), z[1:-1, 1:-1], rtol=0, atol=1e-15)


# Seams: where surfaces meet, touch, or nearly do.


def beside(rng, count, least=1e-18, most=1e-3):
    """Distances from a seam, to both sides, of all sizes from far below float32 up."""
    return rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(np.log10(least), np.log10(most), count)


def rectangle(low, high):
    """A plate at z = 0 between two corners (x, y), as two triangles."""
    (a, b), (c, d) = low, high
    return ft.Mesh([(a, b, 0), (c, b, 0), (c, d, 0), (a, d, 0)], [(0, 1, 2), (0, 2, 3)])


@pytest.mark.parametrize("step", [(0.0, 0.0, -1.0), (0.0, 0.5, -1.0), (0.25, -0.5, -1.0)])
def test_no_ray_falls_between_two_plates_that_touch(step):
    rng = np.random.default_rng(6)
    for _ in range(10):
        # numbers that float64 holds exactly, so that the seam is one and the rays are on it
        edge, left, right, up = np.round(rng.uniform([-1, 0.1, 0.1, 1], [1, 3, 3, 5]) * 2**20) / 2**20
        low, high = rectangle((edge - left, -up), (edge, up)), rectangle((edge, -up), (edge + right, up))
        y = np.linspace(-0.875, 0.875, 1793)
        start = np.stack([np.full_like(y, edge), y, 0 * y], axis=1) - step
        paths = ft.trace(mirrors(low, high), ft.Rays(start, np.broadcast_to(step, start.shape)))
        assert (paths.bounces == 1).all()
        np.testing.assert_allclose(paths.length, np.linalg.norm(step), rtol=1e-14)


@pytest.mark.parametrize("turn", [np.eye(3), rotation((0, 0, 1), 2.0), rotation((1, 2, 3), 0.7)])
def test_no_ray_falls_through_beside_a_seam(turn):
    rng = np.random.default_rng(6)
    count, step = 2000, np.array([0.2, 0.3, -1.0])
    for _ in range(10):
        edge, left, right, up = rng.uniform([-1, 0.01, 0.01, 1], [1, 3, 3, 5])
        low, high = rectangle((edge - left, -up), (edge, up)), rectangle((edge, -up), (edge + right, up))
        scene = mirrors(low.moved(turn=turn), high.moved(turn=turn))
        # far enough off the seam for float64 to tell
        aim = np.stack(
            [edge + beside(rng, count, least=1e-13), rng.uniform(-0.9, 0.9, count), np.zeros(count)], axis=1
        )
        rays = ft.Rays((aim - step) @ turn.T, np.broadcast_to(step @ turn.T, aim.shape))
        paths = ft.trace(scene, rays, record=True)
        assert (paths.bounces == 1).all()
        assert (paths.surface[:, 0] == (aim[:, 0] > edge)).all()


def corner(parts):
    """A corner cube of 1 as one mesh or as three; its seams are the axes."""
    mesh = shapes.corner_cube(1.0, 2)
    if parts == 1:
        return mirrors(mesh)
    third = len(mesh.faces) // 3
    return mirrors(*(ft.Mesh(mesh.vertices, mesh.faces[k * third : (k + 1) * third]) for k in range(3)))


def assert_comes_back(paths):
    """A corner cube with its tip at the origin sends light back as a mirror at the tip would."""
    start, towards = paths.source.origin, paths.source.direction
    assert (paths.bounces == 3).all()
    np.testing.assert_allclose(paths.direction, -towards, rtol=0, atol=1e-15)
    to_the_start = np.einsum("ij,ij->i", start - paths.origin, -towards)
    there_and_back = -2.0 * np.einsum("ij,ij->i", start, towards)
    np.testing.assert_allclose(paths.length + to_the_start, there_and_back, rtol=1e-14)


@pytest.mark.parametrize("parts", [1, 3])
@pytest.mark.parametrize("where", ["on", "beside"])
def test_rays_into_the_seams_of_a_corner_come_back(where, parts):
    rng = np.random.default_rng(7)
    if where == "beside":
        aim = np.stack(
            [*np.abs([beside(rng, 3000, 1e-12), beside(rng, 3000, 1e-12)]), rng.uniform(0, 0.3, 3000)], axis=1
        )
    else:
        aim = rng.integers(0, 2**20, (3000, 3)) / 2.0**22 * [0, 0, 1]
        aim[:300] = 0.0  # the tip
    direction = -rng.integers(2**9, 2**10, (3000, 3)) / 2.0**10
    direction[::3] = -1.0
    aim = np.concatenate([np.roll(aim, turn, axis=1) for turn in range(3)])
    direction = np.concatenate([direction] * 3)
    assert_comes_back(ft.trace(corner(parts), ft.Rays(aim - 0.5 * direction, direction)))


@pytest.mark.parametrize("parts", [1, 2])
@pytest.mark.parametrize("degrees", [90.0, 60.0, 45.0])
def test_rays_into_the_seam_of_a_roof_come_back(degrees, parts):
    # pi over the angle is a whole number of bounces: the last undoes the first, whichever face is first
    half = math.radians(0.5 * degrees)
    ridge = np.array([(0.0, -1.0, 0.0), (0.0, 1.0, 0.0)])
    rims = [ridge + np.array([sign * math.sin(half), 0.0, math.cos(half)]) for sign in (-1.0, 1.0)]
    plates = [ft.Mesh([*ridge, *rim], [(0, 1, 3), (0, 3, 2)]) for rim in rims]
    y = np.random.default_rng(22).uniform(-0.5, 0.5, 300)
    origin = np.stack([0 * y, y, 0 * y + 1.0], axis=1)
    rays = ft.Rays(origin, np.broadcast_to([0.0, 0.0, -1.0], origin.shape))
    paths = ft.trace(mirrors(*plates) if parts == 2 else mirrors(merged(*plates)), rays, max_bounces=20)
    assert (paths.fate == ft.Fate.LEFT).all()
    assert (paths.bounces == 180 / degrees).all()
    np.testing.assert_allclose(paths.direction, -rays.direction, rtol=0, atol=1e-14)
    np.testing.assert_allclose(paths.length, 1.0, rtol=1e-14)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("substrate", [shapes.plate(3.0, 3.0), shapes.plate(3.0, 3.0, 0.5)])
def test_light_that_goes_through_a_splitter_meets_what_lies_on_it(substrate, side):
    coating = ft.Surface(shapes.plate(2.0, 2.0), ft.BeamSplitter(0.6j, 0.8))
    scene = ft.Scene([coating, ft.Surface(substrate, ft.Absorber())])
    paths = ft.trace(scene, ft.Rays([(0.1, 0.3, side)], [(0.0, 0.0, -side)]))
    if side < 0.0 and len(substrate.faces) > 2:  # from below a solid one hides the coating
        assert paths.fate.tolist() == [ft.Fate.ABSORBED]
    else:
        assert sorted(paths.fate.tolist()) == [ft.Fate.LEFT, ft.Fate.ABSORBED]
        np.testing.assert_allclose(paths.ledger().absorbed, 0.64, rtol=1e-14)
        assert paths.length.tolist() == [1.0, 1.0]


@pytest.mark.parametrize("gap", [1e-6, 10 * nm, 1 * nm])
@pytest.mark.parametrize("thickness", [None, 0.002])
def test_a_thin_gap_between_two_plates(gap, thickness):
    low = shapes.plate(0.01, 0.01, thickness)
    high = inverted(low).moved((0, 0, gap)) if thickness is None else low.moved((0, 0, gap + thickness))
    true = high.bounds[0, 2]  # vertices are rounded
    assert true == pytest.approx(gap, rel=1e-9)
    rng = np.random.default_rng(8)
    start = np.append(rng.uniform(-3e-3, 3e-3, (2000, 2)), np.full((2000, 1), 0.25 * gap), axis=1)
    slope = rng.uniform(-1, 1, (2000, 2))
    rays = ft.Rays(start, np.append(slope, np.ones((2000, 1)), axis=1))
    paths = ft.trace(mirrors(low, high), rays, max_bounces=100)
    assert (paths.bounces == 100).all()
    slant = np.sqrt(1.0 + (slope**2).sum(axis=1))
    np.testing.assert_allclose(paths.length, (100 * true - 0.25 * gap) * slant, rtol=DISTANCE)


@pytest.mark.parametrize("gap", [1e-6, 2e-8])  # 2e-6 of the box: the least that one mesh may have
def test_a_thin_gap_within_one_mesh(gap):
    low = shapes.plate(0.01, 0.01)
    scene = mirrors(merged(low, inverted(low).moved((0, 0, gap))))
    rng = np.random.default_rng(9)
    start = np.append(rng.uniform(-3e-3, 3e-3, (500, 2)), np.full((500, 1), 0.25 * gap), axis=1)
    slope = rng.uniform(-1, 1, (500, 2))
    paths = ft.trace(scene, ft.Rays(start, np.append(slope, np.ones((500, 1)), axis=1)), max_bounces=100)
    assert (paths.bounces == 100).all()
    slant = np.sqrt(1.0 + (slope**2).sum(axis=1))
    np.testing.assert_allclose(paths.length, 99.75 * gap * slant, rtol=DISTANCE)


def test_no_ray_leaks_where_a_ball_stands_on_a_floor():
    ball = shapes.icosphere(0.5, 3)
    lowest = ball.vertices[:, 2].argmin()
    ball = ball.moved((0, 0, -ball.vertices[lowest, 2]))
    floor = inverted(shapes.plate(4, 4, 4)).moved((0, 0, 4))
    tip = ball.vertices[lowest]
    rng, count = np.random.default_rng(10), 20_000
    angle = rng.uniform(0, 2 * np.pi, count)
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    start = tip + 1.5 * around + rng.uniform(0.001, 0.02, (count, 1)) * [0, 0, 1]
    aim = tip + 10.0 ** rng.uniform(-9, -2, (count, 1)) * (around + np.array([0, 0, 0.05]))
    # two surfaces: the gap narrows to nothing
    paths = ft.trace(mirrors(ball, floor), ft.Rays(start, aim - start), max_bounces=100)
    assert (paths.fate == ft.Fate.TRUNCATED).all()


@pytest.mark.parametrize("build", [lambda mesh: mesh, unwelded], ids=["welded", "unwelded"])
@pytest.mark.parametrize("degrees", [5.0, 1.0, 0.1])
def test_no_ray_leaks_at_a_knife_s_edge(degrees, build):
    # in the unfolded wedge a ray is a straight line: it passes the edge at this distance
    rng, count, angle = np.random.default_rng(11), 300 + int(600 * degrees), math.radians(degrees)
    turned = np.arcsin(beside(rng, count, 1e-9, 1e-2) / 0.9)
    start = 0.9 * np.array([math.cos(0.5 * angle), 0.0, math.sin(0.5 * angle)])
    towards = math.pi + 0.5 * angle + turned
    direction = np.stack([np.cos(towards), rng.uniform(-0.2, 0.2, count), np.sin(towards)], axis=1)
    rays = ft.Rays(np.broadcast_to(start, (count, 3)), direction)
    depth = int(1.2 * 180 / degrees)
    paths = ft.trace(mirrors(build(wedge(degrees))), rays, max_bounces=depth)
    assert (paths.fate == ft.Fate.TRUNCATED).all()


SQUARE = [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)]
HALVES = np.array([(0, 1, 2), (0, 2, 3)])
SHEETS = {
    "welded": ft.Mesh(SQUARE, HALVES),
    "welded, wound opposite ways": ft.Mesh(SQUARE, [(0, 1, 2), (0, 3, 2)]),
    "unwelded": unwelded(ft.Mesh(SQUARE, HALVES)),
    "unwelded, wound opposite ways": unwelded(ft.Mesh(SQUARE, [(0, 1, 2), (0, 3, 2)])),
    "twice": ft.Mesh(SQUARE, np.concatenate([HALVES, HALVES])),
    "both sides": ft.Mesh(SQUARE, np.concatenate([HALVES, HALVES[:, ::-1]])),
    "both sides, unwelded": merged(ft.Mesh(SQUARE, HALVES), ft.Mesh(SQUARE, HALVES[:, ::-1])),
}


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("name", SHEETS)
def test_a_sheet_reflects_once_however_it_is_wound(name, side):
    along = np.linspace(0.125, 0.875, 25)
    target = np.stack([along, 0.25 * along, 0 * along], axis=1)
    target = np.concatenate([target, target * [1, 4, 1]])  # the second half lies on the seam
    paths = ft.trace(
        mirrors(SHEETS[name]),
        ft.Rays(target + np.array([0, 0, side]), np.broadcast_to([0, 0, -side], (50, 3))),
    )
    assert (paths.bounces == 1).all()
    assert (paths.direction == [0, 0, side]).all()


def exact_path(corners, origin, direction):
    """Path to a triangle's plane, in rational numbers of the floats as they are."""
    a, b, c, o, d = ([Fraction(float(x)) for x in row] for row in (*corners, origin, direction))
    u, v, w = ([x - y for x, y in zip(one, a, strict=True)] for one in (b, c, o))
    n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    return float(
        -sum(x * y for x, y in zip(n, w, strict=True)) / sum(x * y for x, y in zip(n, d, strict=True))
    )


@pytest.mark.parametrize("turn", range(3))
@pytest.mark.parametrize("slim", [1e-3, 1e-5])
def test_needles_are_measured_to_all_digits(slim, turn):
    rng = np.random.default_rng(21)
    for _ in range(20):
        needle = (
            np.array([(-0.5, 0, 0), (0.5, slim, 0), (0.5, -slim, 0)]) @ rotation(rng.normal(size=3), 1.0).T
        )
        mesh = ft.Mesh(needle, [np.roll([0, 1, 2], turn)])
        target = rng.dirichlet([9, 5, 5], 20) @ needle  # not near the rim, which float32 blurs
        across = np.cross(needle[1] - needle[0], needle[2] - needle[0]) / slim
        direction = across + 0.3 * rng.normal(size=(20, 3))
        rays = ft.Rays(target - direction, direction)
        paths = ft.trace(mirrors(mesh), rays, max_bounces=1)
        exact = [exact_path(needle, *ray) for ray in zip(rays.origin, rays.direction, strict=True)]
        assert (paths.bounces == 1).all()
        np.testing.assert_allclose(paths.length, exact, rtol=DISTANCE)


# Bodies: how surfaces are grouped changes nothing.


def clutter():
    """Twelve bodies in a room: rods, a ball in a cage, cubes that touch each other and the floor."""
    rods = [shapes.rod_lattice(1, 1, 0.1, 1.0, 1.0).moved((-0.6 + 0.3 * k, 0.3, -0.2)) for k in range(4)]
    cubes = [
        box(0.25, 0.25, 0.25).moved((x, y, -0.875)) for x, y in [(0, 0), (0.25, 0), (0, 0.25), (0.25, 0.25)]
    ]
    ball, roof = (
        shapes.icosphere(0.15, 2).moved((0.6, -0.5, 0.5)),
        shapes.plate(0.5, 0.5).moved((0.6, -0.5, 0.7)),
    )
    speck = shapes.icosphere(1e-4, 1).moved((-0.5, -0.5, 0.1))
    return [inverted(box(2.0, 2.0, 2.0)), *rods, *cubes, ball, roof, speck]


def test_many_surfaces_give_what_one_mesh_gives():
    parts = clutter()
    assert len(parts) > 8
    rays = within(np.random.default_rng(12), (-0.9, -0.9, -0.7), (0.9, -0.8, 0.9), 3000)
    apart = ft.trace(mirrors(*parts), rays, max_bounces=20, record=True)
    whole = ft.trace(mirrors(merged(*parts)), rays, max_bounces=20, record=True)
    first = np.cumsum([0] + [len(mesh.faces) for mesh in parts])[:-1]
    for paths in (apart, whole):
        assert ends(ft.trace(paths.scene, rays, max_bounces=20)) == ends(paths)
    assert (np.bincount(apart.surface[apart.surface >= 0], minlength=12)[:11] > 0).all()
    np.testing.assert_array_equal(apart.triangle + first[apart.surface], whole.triangle)
    np.testing.assert_allclose(apart.points, whole.points, rtol=0, atol=1e-11)
    np.testing.assert_allclose(apart.length, whole.length, rtol=DISTANCE)
    verdict = twin.judge(apart)
    assert verdict.distance < DISTANCE
    assert (verdict.itself, verdict.wrong) == (0, ())


@pytest.mark.parametrize("exponent", [-60, -40, -20, 20, 30])
def test_a_scene_of_another_size_gives_the_same_picture(exponent):
    scale = 2.0**exponent  # from 1e-18 m to 1e9 m
    rays, mesh = around_the_rods(np.random.default_rng(13), 500), rods_in_a_box()
    here, there = (
        ft.trace(
            mirrors(ft.Mesh(mesh.vertices * size, mesh.faces)),
            ft.Rays(rays.origin * size, rays.direction),
            max_bounces=30,
            record=True,
        )
        for size in (1.0, scale)
    )
    assert np.array_equal(here.triangle, there.triangle)
    assert np.array_equal(here.direction, there.direction)
    assert np.array_equal(here.length * scale, there.length)
    assert np.array_equal(here.points * scale, there.points, equal_nan=True)


def test_a_scene_at_another_place_gives_the_same_picture():
    # vertices that float64 holds exactly at either place
    mesh = shapes.icosphere(1.0, 3)
    mesh = ft.Mesh(np.round(mesh.vertices * 2**20) / 2**20, mesh.faces)
    rays = within(np.random.default_rng(14), -0.3, 0.3, 1000)
    origin = np.round(rays.origin * 2**20) / 2**20
    offset = np.array([2.0**12, -3.0, 2.0**8])
    here = ft.trace(mirrors(mesh), ft.Rays(origin, rays.direction), max_bounces=20, record=True)
    there = ft.trace(
        mirrors(mesh.moved(offset)), ft.Rays(origin + offset, rays.direction), max_bounces=20, record=True
    )
    assert np.array_equal(here.triangle, there.triangle)
    rounding = 20 * np.finfo(float).eps * np.abs(offset).max()
    np.testing.assert_allclose(there.points - offset, here.points, rtol=0, atol=100 * rounding)


seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=40, deadline=None)
@given(count=st.integers(1, 8), aligned=st.booleans(), seed=seeds)
def test_any_heap_of_surfaces_agrees_with_the_twin(count, aligned, seed):
    rng = np.random.default_rng(seed)
    heap = []
    for kind in rng.integers(4, size=count):
        mesh = (
            shapes.plate(1.0, 1.0),
            box(*rng.uniform(0.1, 1.0, 3)),
            shapes.icosphere(0.5, 1),
            shapes.height_map(0.1 * rng.uniform(size=(4, 4)), 0.3),
        )[kind]
        size, place = 10.0 ** rng.uniform(-2, 0), rng.uniform(-1, 1, 3)
        if aligned:  # faces in the same planes, edges in a row
            size, place = 0.5, np.round(4 * place) / 4
        turn = np.eye(3) if aligned else rotation(rng.normal(size=3), rng.uniform(0, 6))
        heap.append(ft.Mesh(mesh.vertices * size, mesh.faces).moved(place, turn))
    start, part = rng.uniform(-2, 2, (100, 3)), rng.integers(count, size=100)
    aim = np.array([mesh.bounds.mean(axis=0) for mesh in heap])[part] + 0.1 * rng.normal(size=(100, 3))
    rays = ft.Rays(start, aim - start)
    paths = ft.trace(mirrors(*heap), rays, max_bounces=10, record=True)
    assert ends(ft.trace(paths.scene, rays, max_bounces=10)) == ends(paths)
    verdict = twin.judge(paths)
    assert (verdict.itself, verdict.wrong) == (0, ())
    assert verdict.distance < 1e-10  # faces may be grazed


lengths = st.floats(1e-6, 1e6)


@settings(max_examples=40, deadline=None)
@given(kind=st.sampled_from(["icosphere", "box", "rods"]), size=lengths, shift=st.floats(-10, 10), seed=seeds)
def test_any_body_agrees_with_the_twin(kind, size, shift, seed):
    rng = np.random.default_rng(seed)
    body = {
        "icosphere": lambda: shapes.icosphere(1.0, int(rng.integers(0, 3))),
        "box": lambda: box(*rng.uniform(0.05, 1.0, 3)),
        "rods": lambda: shapes.rod_lattice(3, 3, 0.2, 0.6, 1.0, sides=int(rng.integers(3, 9))),
    }[kind]()
    turned = body.moved(rng.uniform(-1, 1, 3) * shift, rotation(rng.normal(size=3), rng.uniform(0, 6)))
    mesh = ft.Mesh(turned.vertices * size, turned.faces)
    target = mesh.vertices[mesh.faces].mean(axis=1)[rng.integers(len(mesh.faces), size=40)]
    direction = rng.normal(size=(40, 3))
    distance = rng.uniform(0, 3, (40, 1)) * size  # from inside as well as from outside
    paths = ft.trace(
        mirrors(mesh), ft.Rays(target - distance * direction, direction), max_bounces=8, record=True
    )
    verdict = twin.judge(paths)
    assert (verdict.itself, verdict.wrong) == (0, ())
    # the first leg may be short, and no more than the rounding of its coordinates is asked for
    assert verdict.distance < 1e-9


# The same bits


def bits(paths):
    record = () if paths.points is None else ("surface", "triangle", "points")
    counts = {"segments": paths.segments, "doubtful": paths.doubtful}
    return ends(paths) | {name: getattr(paths, name).tobytes() for name in record} | counts


def half_silvered():
    plate = ft.Surface(box(1.0, 1.0, 0.01), ft.BeamSplitter())
    return ft.Scene([plate, ft.Surface(box(3.0, 3.0, 3.0), ft.Mirror(0.9))])


@pytest.mark.parametrize("record", [False, True])
@pytest.mark.parametrize("splits", [False, True])
def test_threads_and_chunks_change_no_bit(splits, record):
    scene = half_silvered() if splits else mirrors(shapes.icosphere(1.0, 3))
    rays = within(np.random.default_rng(15), -0.3, 0.3, 160 if splits else 3001)
    ccd = ft.CCD((0, 0, 0.4), (1, 2, 3), (0, 1, 0), 0.01, (20, 20))
    expected = None
    for threads in (1, 2, 4):
        for chunk in (1, 77, 1000, 16384) if splits else (77, 1000, 16384):
            paths = ft.trace(scene, rays, ccd, max_bounces=8, threads=threads, chunk=chunk, record=record)
            found = bits(paths)
            expected = expected or found
            assert found == expected
    assert (paths.fate == ft.Fate.DETECTED).any()


@pytest.mark.parametrize("splits", [False, True])
def test_a_record_changes_no_bit(splits):
    scene = half_silvered() if splits else mirrors(shapes.icosphere(1.0, 3), shapes.icosphere(0.1, 1))
    rays = within(np.random.default_rng(15), -0.3, 0.3, 500)
    ccd = ft.CCD((0, 0, 0.5), (1, 2, 3), (0, 1, 0), 0.01, (20, 20))
    bare, recorded = (ft.trace(scene, rays, ccd, max_bounces=8, record=record) for record in (False, True))
    assert ends(bare) == ends(recorded)
    assert (bare.segments, bare.incident) == (recorded.segments, recorded.incident)
    assert bare.bounces[bare.fate == ft.Fate.DETECTED].max() > 2


def test_the_short_way_has_the_same_doubts_about_an_open_body():
    # what is in doubt depends on the face that a ray has just left, several bounces on as well
    bowl = shapes.icosphere(1.0, 3)
    bowl = ft.Mesh(bowl.vertices, bowl.faces[bowl.vertices[bowl.faces][:, :, 2].max(axis=1) < 0.5])
    rays = within(np.random.default_rng(23), -0.3, 0.3, 20_000)
    bare, recorded = (
        ft.trace(mirrors(bowl), rays, max_bounces=30, record=record) for record in (False, True)
    )
    assert ends(bare) == ends(recorded)
    assert (bare.segments, bare.doubtful) == (recorded.segments, recorded.doubtful)
    assert bare.bounces.max() > 3


def test_one_ray_in_a_chunk_changes_no_bit():
    scene, rays = mirrors(shapes.icosphere(1.0, 3)), within(np.random.default_rng(16), -0.3, 0.3, 100)
    assert bits(ft.trace(scene, rays, chunk=1)) == bits(ft.trace(scene, rays))


@pytest.mark.parametrize("splits", [False, True])
def test_a_stream_is_the_trace_in_pieces(splits):
    scene = half_silvered() if splits else mirrors(shapes.icosphere(1.0, 3))
    rays = within(np.random.default_rng(17), -0.3, 0.3, 250)
    whole = ft.trace(scene, rays, max_bounces=6)
    pieces = list(ft.stream(scene, rays, max_bounces=6, chunk=77, threads=2))
    assert [np.unique(piece.ray).tolist() for piece in pieces] == [
        list(range(start, min(start + 77, 250))) for start in range(0, 250, 77)
    ]
    assert bits(join(pieces)) == bits(whole)
    assert join(pieces).incident == pytest.approx(whole.incident, rel=1e-14)


# What hurts Embree stops at the door.

ONE = np.array([(0.0, 0.0, 1.0)])
TRIANGLE = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])


@pytest.mark.parametrize(
    ("origin", "direction", "message"),
    [
        (np.zeros((5, 3)), np.ones((4, 3)), "Rays direction: expected one for each of 5 origins, got 4"),
        (np.zeros((4, 3)), np.ones((5, 3)), "Rays direction: expected one for each of 4 origins, got 5"),
        (np.zeros((5, 2)), np.ones((5, 2)), r"Rays origin: expected shape \(n, 3\), got \(5, 2\)"),
        (np.zeros((5, 3)), np.ones((5, 2)), r"Rays direction: expected shape \(n, 3\), got \(5, 2\)"),
        (np.zeros(3), np.ones(3), r"Rays origin: expected shape \(n, 3\), got \(3,\)"),
        (ONE * np.nan, ONE, "Rays origin: expected finite numbers, got NaN or infinity in 1 of 1 rays"),
        (ONE, ONE + np.inf, "Rays direction: expected finite numbers, got NaN or infinity in 1 of 1 rays"),
        (ONE, 0 * ONE, "Rays direction: expected a direction, got length 0"),
    ],
)
def test_rays_that_would_hurt_embree(origin, direction, message):
    with pytest.raises(ValueError, match=message):
        ft.Rays(origin, direction)


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (
            TRIANGLE * np.nan,
            [(0, 1, 2)],
            "mesh vertices: expected finite numbers, got NaN or infinity in 3 of 3",
        ),
        (TRIANGLE, [(0, 1, 3)], "mesh faces: expected vertex indices from 0 to 2"),
        (TRIANGLE, [(0, 1, -1)], "mesh faces: expected vertex indices from 0 to 2"),
        (TRIANGLE, np.empty((0, 3), dtype=int), "mesh faces: expected at least one triangle, got none"),
        (TRIANGLE, [(0, 1, 1)], "mesh faces: expected triangles with an area, got 1 of 1"),
    ],
)
def test_meshes_that_would_hurt_embree(vertices, faces, message):
    with pytest.raises(ValueError, match=message):
        ft.Mesh(vertices, faces)


def test_a_mesh_cannot_change_under_a_scene():
    vertices, faces = np.array(SQUARE), HALVES.copy()
    mesh = ft.Mesh(vertices, faces)
    scene = mirrors(mesh)
    rays = ft.Rays([(0.5, 0.25, 1.0)], [(0.0, 0.0, -1.0)])
    before = bits(ft.trace(scene, rays))
    vertices += 5.0
    faces[:] = 0
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0] = 7.0
    with pytest.raises(ValueError, match="read-only"):
        mesh.faces[0] = 0
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.surfaces = ()
    assert bits(ft.trace(scene, rays)) == before


@pytest.mark.parametrize("record", [False, True])
@pytest.mark.parametrize("interface", [MIRROR, ft.Mirror(0.5), ft.BeamSplitter(), ft.Absorber()])
def test_no_rays_give_no_paths(interface, record):
    scene = ft.Scene([ft.Surface(box(1, 1, 1), interface)])
    rays = ft.Rays(np.empty((0, 3)), np.empty((0, 3)))
    ccd = ft.CCD((0, 0, 3), (0, 0, -1), (0, 1, 0), 0.1, (4, 4))
    for screen in (None, ccd):
        paths = ft.trace(scene, rays, screen, record=record)
        assert len(paths) == 0
        assert paths.segments == 0
        assert paths.pixel.shape == (0, 2)
        assert paths.ledger() == ft.Ledger(0.0, 0.0, 0.0, 0.0, 0.0)
        assert [len(part) for part in ft.stream(scene, rays, screen)] == [0]
    assert not ft.complex_field(paths, 633 * nm).any()


@pytest.mark.parametrize(
    "copy", [lambda scene: pickle.loads(pickle.dumps(scene)), deepcopy], ids=["pickle", "copy"]
)
def test_a_scene_can_be_pickled_after_it_was_traced(copy):
    scene, rays = half_silvered(), within(np.random.default_rng(18), -0.3, 0.3, 50)
    paths = ft.trace(scene, rays, max_bounces=6)
    assert bits(ft.trace(copy(scene), rays, max_bounces=6)) == bits(paths)
    assert bits(copy(paths)) == bits(paths)


FORMS = {
    "float32": lambda rows: rows.astype(np.float32),
    "columns": np.asfortranarray,
    "every second": lambda rows: np.repeat(rows, 2, axis=0)[::2],
    "backwards": lambda rows: rows[::-1].copy()[::-1],
    "big-endian": lambda rows: rows.astype(">f8"),
    "read-only": lambda rows: np.broadcast_to(rows[None], (1, *rows.shape))[0],
    "lists": lambda rows: rows.tolist(),
}


@pytest.mark.parametrize("form", FORMS)
def test_any_form_of_array_goes_in_and_stays_as_it_is(form):
    rays = within(np.random.default_rng(19), -0.3, 0.3, 50)
    origin, direction = (rows.astype(np.float32).astype(float) for rows in (rays.origin, rays.direction))
    given_origin, given_direction = FORMS[form](origin), FORMS[form](direction)
    scene = mirrors(shapes.icosphere(1.0, 2))
    paths = ft.trace(scene, ft.Rays(given_origin, given_direction))
    assert bits(paths) == bits(ft.trace(scene, ft.Rays(origin, direction)))
    assert np.array_equal(given_origin, origin)
    assert np.array_equal(given_direction, direction)


def test_integers_are_numbers():
    paths = ft.trace(mirrors(box(2, 2, 2)), ft.Rays(np.array([(0, 0, 5)]), np.array([(0, 0, -3)])))
    assert paths.length.tolist() == [4.0]


def test_directions_of_any_length():
    scene, rays = mirrors(shapes.icosphere(1.0, 2)), within(np.random.default_rng(20), -0.3, 0.3, 50)
    expected = bits(ft.trace(scene, ft.Rays(rays.origin, rays.direction)))
    for scale in (2.0**-900, 2.0**-100, 2.0**100, 2.0**1000):
        assert bits(ft.trace(scene, ft.Rays(rays.origin, rays.direction * scale))) == expected


def test_bodies_that_no_ray_gets_near_are_not_built():
    ball = ft.shapes.icosphere(1e-3, 1)
    scene = ft.Scene(
        [
            ft.Surface(ball, ft.Mirror(), name="lit"),
            ft.Surface(ball.moved((1, 0, 0)), ft.Mirror(), name="aside"),
        ]
    )
    rays = ft.Rays(np.array([[0, 0, 5e-3]]), np.array([[0, 0, -1.0]]))
    assert ft.trace(scene, rays).bounces[0] == 1
    lit, aside = build(scene).bodies
    assert "embree" in vars(lit)
    assert not {"embree", "tree", "packed"} & set(vars(aside))
    away = ft.trace(scene, ft.Rays(np.array([[1, 0, 5e-3]]), np.array([[0, 0, -1.0]])))
    assert away.bounces[0] == 1
    assert "embree" in vars(aside)
