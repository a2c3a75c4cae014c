"""The exact search that decides doubtful hits: sorting, the watertight test, touched faces."""

import numpy as np
import pytest
import twin
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace.core.vectors import unit
from fringetrace.geometry import shapes
from fringetrace.tracing.intersect import embree, exact

EPS = float(np.finfo(np.float64).eps)
seeds = st.integers(0, 2**32 - 1)


def decide(some, ray, guess, limit, side, came):
    """Path and triangle of the exact search on a body, for a ray that has crossed nothing where it stands."""
    owner, sides = np.zeros(len(some.faces), dtype=np.int32), np.full((1, 2), -1, dtype=np.int32)
    medium, crossed = np.zeros(1, dtype=np.int32), np.zeros((1, 16), dtype=np.int32)
    contact = (owner, sides, np.zeros(1), medium, crossed, 0, some.oriented, some.closed)
    tree = (some.tree.corners, some.tree.order, some.tree.lower, some.tree.upper)
    return exact.decide(
        ray, -1, guess, limit, side, came, 0, contact, some.planes, tree, some.frame[6]
    )[:2]  # fmt: skip


def body(mesh):
    """The one body of a scene of one mirror."""
    return embree.build(ft.Scene([ft.Surface(mesh, ft.Mirror())])).bodies[0]


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
    for guess in (-1, 0, 7):
        for i in range(len(start)):
            ray = (*start[i], *direction[i])
            # a source: touches nothing, left nothing
            found = decide(some, ray, guess, np.inf, 2, tuple(direction[i]))
            assert found[1] == triangle[i]
            assert found[0] == pytest.approx(path[i], rel=1e-12)
            # nothing before what is there
            assert (
                decide(some, ray, guess, 0.999 * path[i], 2, tuple(direction[i]))[1] == -1
                or path[i] == np.inf
            )
    assert (triangle >= 0).sum() > 50


def test_a_touched_face_is_met_only_by_light_that_goes_on_through_it():
    some = body(shapes.plate(2.0, 2.0))

    def meets(dz, side, bz=1.0, some=some):
        ray = (0.1, 0.3, 0.0, 0.0, 0.0, dz)
        return decide(some, ray, -1, np.inf, side, (0.0, 0.0, bz))[1] >= 0

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


def test_a_source_on_a_solid_meets_it_only_going_in_and_on_an_open_sheet_never():
    solid, sheet = body(shapes.plate(2.0, 2.0, 1.0).moved((0, 0, 1.0))), body(shapes.plate(2.0, 2.0))
    z = solid.vertices[:, 2].max()
    for dz in (1.0, -1.0):
        ray = (0.1, 0.3, z, 0.0, 0.0, dz)
        path, triangle = decide(solid, ray, -1, np.inf, 1, (0.0, 0.0, 0.0))
        assert (triangle >= 0) == (dz < 0.0)
        assert path == (0.0 if dz < 0.0 else np.inf)
        ray = (0.1, 0.3, 0.0, 0.0, 0.0, dz)
        assert decide(sheet, ray, -1, np.inf, 1, (0.0, 0.0, 0.0))[1] == -1
