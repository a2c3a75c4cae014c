"""What came out of a trace: choosing, naming, joining, projecting, and the ledger."""

import numpy as np
import pytest
from columns import BARE

import fringetrace as ft
from fringetrace import Fate
from fringetrace.geometry import shapes
from fringetrace.scene.sensor import pixels
from fringetrace.tracing.detection import project
from fringetrace.tracing.paths import join

# Rays are cut off on purpose: what becomes of them is looked at here, that it is warned of in `test_checks`.
pytestmark = pytest.mark.filterwarnings("ignore:power is cut off")

LEDGER = 1e-12
ROUNDING = 1e-14


def scene(*interfaces):
    """Parallel plates 1 m apart."""
    plates = [shapes.plate(4.0, 4.0).moved((0, 0, k)) for k in range(len(interfaces))]
    return ft.Scene(
        [ft.Surface(*pair, f"plate {k}") for k, pair in enumerate(zip(plates, interfaces, strict=True))]
    )


def scattered(count=400, seed=1, **more):
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(count, 3)) * [0.3, 0.3, 1.0]
    return ft.Rays(rng.uniform(-0.5, 0.5, (count, 3)) + np.array([0, 0, 2.5]), direction, **more)


SPLITTERS = scene(ft.BeamSplitter(0.6j, 0.8), ft.BeamSplitter(), ft.BeamSplitter(0.3, 0.4j))


@pytest.fixture(scope="module")
def split():
    return ft.trace(SPLITTERS, scattered(area=0.5), max_bounces=8, record=True)


def test_where_takes_masks_and_indices(split):
    mask = split.bounces == 3
    rows = np.flatnonzero(mask)
    for some in (split.where(mask), split.where(rows)):
        assert len(some) == mask.sum() > 0
        for name in (*BARE, "pixel", "points"):
            assert np.array_equal(getattr(some, name), getattr(split, name)[rows], equal_nan=True)
        assert np.array_equal(some.surface, split.surface[rows])
        assert np.array_equal(some.polyline(0), split.polyline(rows[0]))
        assert (some.incident, some.segments, some.scene) == (split.incident, split.segments, split.scene)
    assert len(split.where(np.zeros(len(split), dtype=bool))) == 0
    assert len(split.where(np.array([], dtype=int)).polyline.__self__) == 0


def test_detected_are_those_on_the_ccd():
    ccd = ft.CCD((0, 0, 3), (0, 0, -1), (0, 1, 0), 0.1, (10, 10))
    paths = ft.trace(SPLITTERS, scattered(), ccd, max_bounces=5)
    some = paths.detected
    assert 0 < len(some) < len(paths)
    assert (some.fate == Fate.DETECTED).all()
    assert (paths.fate == Fate.DETECTED).sum() == len(some)
    assert np.isfinite(some.pixel).all()
    assert np.isnan(paths.pixel[paths.fate != Fate.DETECTED]).all()


def test_pixels_of_points():
    ccd = ft.CCD((1, 2, 3), (0, 0, -1), (0, 1, 0), 0.5, (4, 6))
    # normal -z, up y: u = normal x up = x
    point = ccd.centre + np.array([(0, 0, 0), (-1.5, -1.0, 0), (0.25, 0.5, 0)])
    assert pixels(ccd, point).tolist() == [[2, 3], [0, 0], [3, 3.5]]


# Names of sequences


def test_equal_keys_are_equal_sequences(split):
    # with as many bounces; shorter sequences may be the head of longer ones
    names = {}
    for i in range(len(split)):
        name = (split.bounces[i], split.key[i])
        assert names.setdefault(name, split.sequence(i)) == split.sequence(i)
    assert len({tuple(sequence) for sequence in names.values()}) == len(names) > 50


def test_visits_count_how_often_each_surface_was_met(split):
    visits = np.stack([split.visits(k) for k in range(3)])
    assert visits.dtype == np.int64
    assert np.array_equal(visits.sum(axis=0), split.bounces)
    for k in range(3):
        assert np.array_equal(visits[k], (split.surface == k).sum(axis=1))


def test_sequences_may_be_as_long_as_a_key_can_tell():
    mirrors = scene(ft.Mirror(), ft.Mirror())
    start = ft.Rays([(0, 0, 0.5)], [(0, 0, -1)])
    most = 27  # 5 ** 27 < 2 ** 64 < 5 ** 28
    paths = ft.trace(mirrors, start, max_bounces=most)
    assert paths.sequence(0) == [(k % 2, False) for k in range(most)]
    assert paths.visits(0).tolist() == [14]
    beyond = ft.trace(mirrors, start, max_bounces=most + 1)
    message = (
        "path key: expected at most 27 bounces among 2 surfaces to tell their sequence, got 28; trace with"
    )
    with pytest.raises(ValueError, match=message):
        beyond.sequence(0)
    with pytest.raises(ValueError, match=message):
        beyond.visits(1)


def test_points_have_to_be_recorded():
    paths = ft.trace(SPLITTERS, scattered(5))
    with pytest.raises(
        ValueError, match="polyline: expected paths traced with record=True, got paths without points"
    ):
        paths.polyline(0)


# The ledger


def test_the_ledger_says_where_the_power_went():
    # 0.64 through the splitter and off the mirror behind it, of that 0.64 back through and out
    plates = scene(ft.Mirror(0.5), ft.BeamSplitter(0.6j, 0.8))
    rays = ft.Rays([(0, 0, 2.0)] * 2, [(0, 0, -1)] * 2, amplitude=[1.0, 2.0], area=0.1)
    ccd = ft.CCD((0, 0, 3), (0, 0, -1), (0, 1, 0), 0.1, (4, 4))
    paths = ft.trace(plates, rays, ccd, max_bounces=3)
    ledger = paths.ledger()
    assert ledger.incident == pytest.approx(0.5, rel=ROUNDING)
    assert ledger.detected == pytest.approx(0.5 * (0.36 + 0.64 * 0.5 * 0.64), rel=ROUNDING)
    assert ledger.left == 0.0
    assert ledger.absorbed == pytest.approx(0.5 * 0.64 * 0.5, rel=ROUNDING)
    assert ledger.truncated == pytest.approx(0.5 * 0.64 * 0.5 * 0.36, rel=ROUNDING)
    assert ledger.error < LEDGER


@pytest.mark.filterwarnings("ignore:paths multiply")
def test_the_ledger_of_many_paths_from_one_ray_loses_no_digits():
    plates = scene(*[ft.BeamSplitter(0.3**0.5 * 1j, 0.7**0.5)] * 8)
    ray = ft.Rays([[1e-4, 2e-4, -5e-3]], [[0.01, 0.02, 1.0]])
    paths = ft.trace(plates, ray, max_bounces=20, min_amplitude=0.0)
    assert len(paths) > 100_000
    assert paths.ledger().error < ROUNDING


def test_ledgers_of_parts_add_up_to_that_of_the_whole():
    rays = scattered(300, area=0.5, amplitude=np.random.default_rng(2).normal(size=300))
    whole = ft.trace(SPLITTERS, rays, max_bounces=6).ledger()
    total = ft.Ledger(0.0, 0.0, 0.0, 0.0, 0.0)
    for part in ft.stream(SPLITTERS, rays, max_bounces=6, chunk=70):
        assert part.ledger().error < LEDGER
        total = total + part.ledger()
    for name, value in vars(whole).items():
        assert getattr(total, name) == pytest.approx(value, rel=ROUNDING)


def test_the_error_of_a_ledger():
    assert ft.Ledger(4.0, 1.0, 1.0, 0.5, 0.5).error == 0.25
    assert ft.Ledger(0.0, 0.0, 0.0, 0.0, 0.0).error == 0.0
    assert ft.Ledger(0.0, 1.0, 0.0, 0.0, 0.0).error == 1.0


# Joining


def test_joined_parts_are_the_whole():
    rays = scattered(100)
    whole = ft.trace(SPLITTERS, rays, max_bounces=6, record=True)
    # parts of different depth: their tables are padded
    parts = list(ft.stream(SPLITTERS, rays, max_bounces=6, record=True, chunk=1))
    assert len({part.surface.shape[1] for part in parts}) > 1
    joined = join(parts)
    for name in ("ray", "fate", "length", "origin", "amplitude", "key", "surface", "triangle", "points"):
        assert np.array_equal(getattr(joined, name), getattr(whole, name), equal_nan=True), name
    assert (joined.segments, joined.doubtful) == (whole.segments, whole.doubtful)
    assert joined.incident == pytest.approx(whole.incident, rel=ROUNDING)


def test_one_part_is_the_whole():
    part = ft.trace(SPLITTERS, scattered(3))
    assert join([part]) is part


# Another CCD without another trace


@pytest.mark.parametrize("focus", [0.0, 1.5, -0.7])
@pytest.mark.parametrize("normal", [(0, 0, -1), (0.2, -0.3, -1)])
@pytest.mark.filterwarnings("ignore:fringes alias")
def test_projecting_is_tracing_where_nothing_stands_between(normal, focus):
    ccd = ft.CCD((0.1, 0.2, 6.0), normal, (0, 1, 0), 0.25, (9, 12), focus=focus)
    rays = scattered()
    traced = ft.trace(SPLITTERS, rays, ccd, max_bounces=6)
    later = project(ft.trace(SPLITTERS, rays, max_bounces=6), ccd)
    assert {Fate.DETECTED, Fate.LEFT} <= set(traced.fate)
    for name in ("ray", "fate", "bounces", "key", "amplitude"):
        assert np.array_equal(getattr(later, name), getattr(traced, name)), name
    np.testing.assert_allclose(later.length, traced.length, rtol=ROUNDING)
    np.testing.assert_allclose(later.origin, traced.origin, rtol=0, atol=1e-14)
    np.testing.assert_allclose(later.pixel, traced.pixel, rtol=0, atol=1e-12)
    assert later.ccd is ccd
    assert later.ledger().error < LEDGER
    field, other = ft.complex_field(later, 1e-3), ft.complex_field(traced, 1e-3)
    np.testing.assert_allclose(field, other, rtol=0, atol=1e-9 * abs(other).max())


def test_projecting_passes_by_what_stands_between():
    blocked = ft.Scene(
        [*scene(ft.Mirror()).surfaces, ft.Surface(shapes.plate(1, 1).moved((0, 0, -1)), ft.Mirror(), "wall")]
    )
    ccd = ft.CCD((0, 0, 3), (0, 0, -1), (0, 1, 0), 0.1, (10, 10))
    start = ft.Rays([(0, 0, 2.0)], [(0, 0, -1)])
    paths = ft.trace(blocked, start)
    seen = project(paths, ccd)
    assert seen.fate.tolist() == [Fate.DETECTED]
    assert seen.length.tolist() == [2.0 + 3.0]
    assert seen.pixel.tolist() == [[5.0, 5.0]]
    # what it came from is as it was
    assert paths.fate.tolist() == [Fate.LEFT]
    assert paths.ccd is None


def test_only_light_that_left_towards_the_front_is_projected():
    ccd = ft.CCD((0, 0, 3), (0, 0, -1), (0, 1, 0), 1.0, (10, 10))
    behind = ft.CCD((0, 0, 3), (0, 0, 1), (0, 1, 0), 1.0, (10, 10))
    below = ft.CCD((0, 0, -3), (0, 0, -1), (0, 1, 0), 1.0, (10, 10))
    along = ft.CCD((0, 0, 3), (1, 0, 0), (0, 1, 0), 1.0, (10, 10))
    start = ft.Rays([(0.1, 0, 2.0)], [(0, 0, -1)])
    for interface, fate in [(ft.Mirror(), Fate.LEFT), (ft.Absorber(), Fate.ABSORBED)]:
        paths = ft.trace(scene(interface), start)
        for screen in (behind, below, along):
            assert project(paths, screen).fate.tolist() == [fate]
        assert project(paths, ccd).fate.tolist() == [Fate.DETECTED if fate == Fate.LEFT else fate]
    cut = ft.trace(scene(ft.Mirror()), start, max_bounces=0)
    assert project(cut, ccd).fate.tolist() == [Fate.TRUNCATED]


def test_what_is_on_one_ccd_cannot_be_projected_onto_another():
    ccd = ft.CCD((0, 0, 3), (0, 0, -1), (0, 1, 0), 0.1, (10, 10))
    paths = ft.trace(SPLITTERS, scattered(20), ccd)
    with pytest.raises(ValueError, match="project: expected paths traced without a CCD"):
        project(paths, ccd)


@pytest.mark.parametrize("grid", [(4, 8), (3, 5)])
def test_projected_pixels_are_half_open(grid):
    rows, columns = grid
    u = (np.arange(-1, 2 * columns + 2) - columns) / 16
    v = (np.arange(-1, 2 * rows + 2) - rows) / 16
    x, y = (part.ravel() for part in np.meshgrid(u, v))
    start = np.stack([x, y, np.full_like(x, 2.0)], axis=1)
    paths = ft.trace(scene(ft.Mirror()), ft.Rays(start, np.broadcast_to([0, 0, -1.0], start.shape)))
    seen = project(paths, ft.CCD((0, 0, 3), (0, 0, -1), (0, 1, 0), 0.125, grid))
    place = np.stack([y, x], axis=1) / 0.125 + np.array(grid) / 2
    inside = ((place >= 0) & (place < grid)).all(axis=1)
    assert np.array_equal(seen.fate == Fate.DETECTED, inside)
    assert np.array_equal(seen.pixel[inside], place[inside])


@pytest.mark.parametrize("surface", [-1, 3])
def test_visits_are_to_surfaces_of_the_scene(split, surface):
    with pytest.raises(ValueError, match=rf"visits surface: expected a number from 0 to \d, got {surface}"):
        split.visits(surface)


@pytest.mark.parametrize("what", ["sequence", "polyline"])
def test_rows_are_those_of_the_table(split, what):
    read = getattr(split, what)
    assert np.array_equal(read(-1), read(len(split) - 1))
    for row in (len(split), -len(split) - 1):
        with pytest.raises(IndexError, match=f"{what} row: expected one of {len(split)} paths, got {row}"):
            read(row)


def test_nothing_cannot_be_joined():
    with pytest.raises(ValueError, match="join: expected at least one Paths, got none"):
        join([])


def test_join_takes_any_parts_of_one_trace_but_none(split):
    halves = [split.where(split.ray < 200), split.where(split.ray >= 200)]
    assert np.array_equal(join(iter(halves)).key, split.key)
    for nothing in ([], (), iter(())):
        with pytest.raises(ValueError, match="join: expected at least one Paths, got none"):
            join(nothing)
    bare = ft.trace(SPLITTERS, scattered(area=0.5), max_bounces=8)
    with pytest.raises(ValueError, match="join: expected parts of one trace, got surface in 1 of 2"):
        join([split, bare])


def test_no_rays_are_no_paths():
    none = ft.Rays(np.empty((0, 3)), np.empty((0, 3)))
    for record in (False, True):
        paths = ft.trace(SPLITTERS, none, record=record)
        assert len(paths) == 0
        assert vars(paths.ledger()) == dict.fromkeys(vars(paths.ledger()), 0.0)
        assert paths.ledger().error == 0.0
        assert len(join([paths, paths])) == 0
