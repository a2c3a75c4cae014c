"""The fused loops one by one, and the exact search that they fall back on."""

import numpy as np
import pytest
import twin
from hypothesis import given, settings
from hypothesis import strategies as st

import fringetrace as ft
from fringetrace import bounces, engine, exact, kernels, screens, shapes
from fringetrace.interfaces import reflect
from fringetrace.paths import screen
from fringetrace.rays import launch
from fringetrace.vectors import frame, unit

EPS = float(np.finfo(np.float64).eps)
seeds = st.integers(0, 2**32 - 1)


def body(mesh):
    """The one body of a scene of one mirror."""
    return engine.build(ft.Scene([ft.Surface(mesh, ft.Mirror())])).bodies[0]


# Sorting


@given(values=st.lists(st.integers(-3, 3), min_size=1, max_size=60), part=st.floats(0, 1), seed=seeds)
def test_select_puts_the_smaller_keys_first(values, part, seed):
    keys = np.array(values, dtype=float)
    order = np.random.default_rng(seed).permutation(len(keys))
    start, stop = sorted(np.random.default_rng(seed).integers(0, len(keys) + 1, 2))
    middle = start + int(part * (stop - start))
    before = order.copy()
    exact.select(order, keys, start, stop, middle)
    assert sorted(order[start:stop]) == sorted(before[start:stop])
    assert np.array_equal(order[:start], before[:start])
    assert np.array_equal(order[stop:], before[stop:])
    assert keys[order[start:middle]].max(initial=-9) <= keys[order[middle:stop]].min(initial=9)


@given(rays=st.lists(st.integers(0, 6), max_size=60), first=st.integers(0, 1000))
def test_ends_are_sorted_by_ray_and_stay_in_order(rays, first):
    ray = np.array(rays, dtype=np.int64) + first
    assert np.array_equal(bounces.sort(ray, first, 7), np.argsort(ray, kind="stable"))


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 17, 64, 1000])
def test_the_tree_holds_every_triangle_once_in_boxes_around_it(count):
    rng = np.random.default_rng(count)
    corners = rng.uniform(-1, 1, (count, 1, 3)) + 0.1 * rng.normal(size=(count, 3, 3))
    mesh = ft.Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    tree = body(mesh).tree
    assert sorted(tree.order[tree.order >= 0]) == list(range(count))
    leaves = len(tree.lower) // 2
    local = tree.corners.reshape(-1, 3, 3)
    for slot, triangle in enumerate(tree.order):
        node = leaves + slot // exact.LEAF
        while triangle >= 0 and node:
            assert (local[triangle] >= tree.lower[node]).all()
            assert (local[triangle] <= tree.upper[node]).all()
            node //= 2


# The exact search


def shear(direction):
    """The axis and shear that `crosses` takes."""
    axis = int(np.abs(direction).argmax())
    x, y, z = np.roll(direction, -(axis + 1))
    return axis, x / z, y / z


@settings(max_examples=200)
@given(
    spokes=st.integers(3, 9),
    seed=seeds,
    part=st.sampled_from([0.0, 1e-17, 1e-16, 1e-15, 1e-9, 0.5]),
    whole=st.booleans(),
)
def test_no_line_passes_between_the_triangles_of_a_fan(spokes, seed, part, whole):
    # aimed at the hub, or at a point on a spoke; the fan is flat enough to go round the line once
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, spokes))
    if np.diff(np.append(angle, angle[0] + 2 * np.pi)).max() > 3.0:
        return
    hub = rng.uniform(-0.1, 0.1, 3)
    rim = hub + np.stack([np.cos(angle), np.sin(angle), 0.1 * rng.uniform(-1, 1, spokes)], axis=1)
    corners = np.stack([np.broadcast_to(hub, rim.shape), rim, np.roll(rim, -1, axis=0)], axis=1)
    direction = np.append(rng.integers(-1, 2, 2), 2.0) if whole else np.append(rng.uniform(-0.3, 0.3, 2), 1.0)
    target = hub + part * (rim[0] - hub)
    for start in (target - direction, target - 1e3 * direction, target):
        hits = [exact.crosses(corners.reshape(-1, 9), k, *start, *shear(direction)) for k in range(spokes)]
        assert any(hits)


@pytest.mark.parametrize("mesh", [shapes.icosphere(1.0, 3), shapes.rod_lattice(4, 3, 0.3, 0.8, 2.0)])
def test_the_exact_search_finds_what_the_twin_finds(mesh):
    some = body(mesh)
    rng = np.random.default_rng(2)
    start = rng.uniform(-1.2, 1.2, (500, 3))
    direction = unit(rng.normal(size=(500, 3)))
    corners = some.tree.corners.reshape(-1, 3, 3)
    path, triangle = twin.nearest(corners, start, direction, np.full(500, -1))
    tree = (some.planes, some.tree.corners, some.tree.order, some.tree.lower, some.tree.upper, some.frame[6])
    for guess in (-1, 0, 7):
        for i in range(len(start)):
            ray = (*start[i], *direction[i])
            # a source: touches nothing, left nothing
            found = exact.decide(*ray, -1, guess, np.inf, 2, *direction[i], *tree)
            assert found[1] == triangle[i]
            assert found[0] == pytest.approx(path[i], rel=1e-12)
            # nothing before what is there
            assert (
                exact.decide(*ray, -1, guess, 0.999 * path[i], 2, *direction[i], *tree)[1] == -1
                or path[i] == np.inf
            )
    assert (triangle >= 0).sum() > 50


def test_a_touched_face_is_met_only_by_light_that_goes_on_through_it():
    some = body(shapes.plate(2.0, 2.0))
    tree = (some.planes, some.tree.corners, some.tree.order, some.tree.lower, some.tree.upper, some.frame[6])

    def meets(dz, side, bz=0.0):
        return exact.decide(0.1, 0.3, 0.0, 0.0, 0.0, dz, -1, -1, np.inf, side, 0.0, 0.0, bz, *tree)[1] >= 0

    # before the front (side 1), behind it (-1), a source (2)
    assert [meets(dz, side) for side in (1, -1, 2) for dz in (1.0, -1.0)] == [
        False,
        True,
        True,
        False,
        False,
        False,
    ]
    # in the sense in which it came (0)
    assert [meets(dz, 0, bz) for dz in (1.0, -1.0) for bz in (1.0, -1.0)] == [True, False, False, True]


# Directions and places


@given(seed=seeds)
def test_reflections_are_those_of_the_formula(seed):
    rng = np.random.default_rng(seed)
    direction, normal = unit(rng.normal(size=(2, 3)))
    expected = reflect(direction[None], normal[None])[0]
    for steps in (1, 8):  # the eighth is brought back to length 1
        after = bounces.bounced(*direction, *normal, direction @ normal, steps)
        np.testing.assert_allclose(after, expected, rtol=0, atol=4 * EPS)


def test_a_direction_keeps_its_length_over_many_reflections():
    rng = np.random.default_rng(3)
    direction = np.array([0.6, 0.0, 0.8])
    for steps, normal in enumerate(unit(rng.normal(size=(5000, 3)))):
        direction = np.array(bounces.bounced(*direction, *normal, direction @ normal, steps))
    assert np.linalg.norm(direction) == pytest.approx(1.0, rel=16 * EPS, abs=0)


@given(seed=seeds, lean=st.floats(1e-9, 1), side=st.sampled_from([1.0, -1.0]))
def test_a_restart_is_one_shift_above_the_face_on_the_side_that_the_ray_leaves(seed, lean, side):
    rng = np.random.default_rng(seed)
    normal, other = unit(rng.normal(size=(2, 3)))
    across = unit(np.cross(normal, other)[None])[0]
    direction = side * lean * normal + np.sqrt(1 - lean * lean) * across
    start = rng.uniform(-1, 1, 3)
    leaving = direction @ normal
    moved = np.array(kernels.restart(*start, *direction, *normal, leaving, 1.0 / abs(leaving))) - start
    assert moved @ normal == pytest.approx(side * kernels.SHIFT, rel=1e-8)
    # no farther than the steepest that counts as grazing
    assert np.linalg.norm(moved) <= 1.01 * kernels.SHIFT / kernels.GRAZING
    if abs(lean) > 1.01 * kernels.GRAZING:  # on the ray itself
        np.testing.assert_allclose(np.cross(moved, direction), 0.0, rtol=0, atol=8 * EPS)


@pytest.mark.parametrize(("start", "stop"), [(0, 12), (0, 1), (5, 9), (11, 12), (4, 4)])
def test_a_beam_starts_at_the_centres_of_its_cells(start, stop):
    beam = ft.Beam((1.0, 2.0, 3.0), (1, 1, 0), (0, 0, 1), (4.0, 3.0), (3, 4))
    u, v, n = frame(beam.direction, beam.up, "Beam")
    rays = launch(beam, start, stop)
    number = np.arange(start, stop)
    x, y = number % 4 - 1.5, number // 4 - 1.0
    expected = beam.centre + x[:, None] * u + y[:, None] * v
    np.testing.assert_allclose(rays.origin, expected, rtol=0, atol=8 * EPS)
    assert np.array_equal(rays.direction, np.broadcast_to(n, (stop - start, 3)))


@given(seed=seeds)
def test_a_place_on_the_ccd_is_counted_from_its_corner(seed):
    rng = np.random.default_rng(seed)
    normal, up = rng.normal(size=(2, 3))
    ccd = ft.CCD(rng.normal(size=3), normal, up, 0.25, (6, 10))
    u, v, _ = frame(ccd.normal, ccd.up, "CCD")
    row, column = rng.uniform(0, [6, 10])
    point = ccd.centre + (column - 5) * 0.25 * u + (row - 3) * 0.25 * v
    pixel = np.empty((1, 2))
    screens.locate(screen(ccd), ccd.pitch, *ccd.shape, point[None], pixel)
    np.testing.assert_allclose(pixel, [[row, column]], rtol=0, atol=1e-12)
