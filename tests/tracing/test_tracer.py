"""The bounce passes: where paths end and why, what they bring along, splitting, recording, the CCD."""

import math
import threading

import numpy as np
import pytest
from columns import BARE
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace import Fate
from fringetrace.core.vectors import rotation
from fringetrace.geometry import shapes
from fringetrace.tracing.detection import project

# Rays are cut off on purpose: what becomes of them is looked at here, that it is warned of in `test_checks`.
pytestmark = pytest.mark.filterwarnings("ignore:power is cut off")

# A dozen roundings: a path is a sum of a few segments.
ROUNDING = 1e-14
LEDGER = 1e-12


def plate(z=0.0, size=2.0, turn=None):
    return shapes.plate(size, size).moved(turn=turn).moved((0.0, 0.0, z))


def surface(interface=None, z=0.0, name="plate", **shape):
    return ft.Surface(plate(z, **shape), ft.Mirror() if interface is None else interface, name)


def facing(*interfaces, gap=1.0):
    """Parallel plates, one gap apart."""
    return ft.Scene([surface(interface, gap * k, f"plate {k}") for k, interface in enumerate(interfaces)])


def one(origin=(0.0, 0.0, 0.5), direction=(0.0, 0.0, -1.0), **more):
    return ft.Rays([origin], [direction], **more)


def ccd(centre=(0.0, 0.0, 1.0), normal=(0.0, 0.0, -1.0), **more):
    return ft.CCD(centre, normal, (0.0, 1.0, 0.0), **({"pitch": 0.125, "shape": (4, 8)} | more))


def many(count):
    """The same ray as often."""
    return ft.Rays(np.broadcast_to([0, 0, 0.5], (count, 3)), np.broadcast_to([0, 0, -1.0], (count, 3)))


def row(paths, names=("fate", "bounces", "reflections", "length")):
    """The only path there is."""
    assert len(paths) == 1
    return tuple(getattr(paths, name)[0] for name in names)


# How paths end


@pytest.mark.parametrize("record", [False, True])
@pytest.mark.parametrize("most", [0, 1, 2, 7])
def test_a_path_that_would_meet_one_more_surface_is_truncated(most, record):
    paths = ft.trace(facing(None, None), one(), max_bounces=most, record=record)
    assert row(paths) == (Fate.TRUNCATED, most, most, max(0, most - 0.5))
    assert paths.origin[0].tolist() == [0.0, 0.0, [0.5, 0.0, 1.0][min(most, 2 - most % 2)]]
    assert paths.direction[0].tolist() == [0.0, 0.0, -1.0 if most % 2 == 0 else 1.0]
    assert paths.amplitude[0] == (-1) ** most
    assert paths.segments == most + 1


def test_a_path_that_has_all_its_bounces_may_still_leave_or_land():
    scene = ft.Scene([surface()])
    assert row(ft.trace(scene, one(), max_bounces=1)) == (Fate.LEFT, 1, 1, 0.5)
    assert row(ft.trace(scene, one(), ccd(), max_bounces=1)) == (Fate.DETECTED, 1, 1, 1.5)
    assert row(ft.trace(scene, one(direction=(0, 0, 1)), max_bounces=0)) == (Fate.LEFT, 0, 0, 0.0)
    assert row(ft.trace(scene, one(), max_bounces=0)) == (Fate.TRUNCATED, 0, 0, 0.0)


def test_a_path_that_leaves_ends_at_its_last_hit():
    paths = ft.trace(ft.Scene([surface()]), one((0.3, 0.1, 0.5), (0.0, 0.75, -1.0)))
    np.testing.assert_allclose(paths.origin, [[0.3, 0.475, 0.0]], rtol=0, atol=1e-16)
    np.testing.assert_allclose(paths.direction, [[0.0, 0.6, 0.8]], rtol=0, atol=1e-16)
    assert np.isnan(paths.pixel).all()


@pytest.mark.parametrize("interface", [ft.Absorber(), ft.Mirror(0.0), ft.BeamSplitter(0, 0)])
def test_a_black_surface_absorbs(interface):
    paths = ft.trace(ft.Scene([surface(interface)]), one(amplitude=[3j]))
    assert row(paths) == (Fate.ABSORBED, 1, 0, 0.5)
    assert row(paths, ("amplitude", "lost")) == (0.0, 9.0)
    assert paths.direction[0].tolist() == [0.0, 0.0, -1.0]  # as it arrived
    assert paths.ledger() == ft.Ledger(9.0, 0.0, 0.0, 9.0, 0.0)


def test_a_mirror_that_absorbs_some():
    paths = ft.trace(facing(ft.Mirror(0.25), ft.Mirror(0.5)), one(), max_bounces=3)
    fate, amplitude, lost = row(paths, ("fate", "amplitude", "lost"))
    assert fate == Fate.TRUNCATED
    assert amplitude == pytest.approx(-0.5 * math.sqrt(0.5) * 0.5, rel=ROUNDING)
    assert lost == pytest.approx(1.0 - 0.25 * 0.5 * 0.25, rel=ROUNDING)


def test_a_path_ends_where_it_becomes_too_faint():
    # amplitude 0.1 ** n: below 1e-3 at the fourth bounce, not at the third
    scene = facing(ft.Mirror(0.01), ft.Mirror(0.01))
    found = ft.trace(scene, one(), max_bounces=30, min_amplitude=1.0001e-3)
    assert row(found, ("fate", "bounces")) == (Fate.FAINT, 3)
    found = ft.trace(scene, one(), max_bounces=30, min_amplitude=0.9999e-3)
    assert row(found, ("fate", "bounces")) == (Fate.FAINT, 4)
    assert found.amplitude[0] == pytest.approx(1e-4, rel=ROUNDING)
    assert found.ledger().truncated == pytest.approx(1e-8, rel=ROUNDING)
    assert row(ft.trace(scene, one(), max_bounces=30, min_amplitude=0.0), ("fate",)) == (Fate.TRUNCATED,)
    # relative to what was launched
    bright = ft.trace(scene, one(amplitude=[1e9]), max_bounces=30, min_amplitude=0.9999e-3)
    assert row(bright, ("fate", "bounces")) == (Fate.FAINT, 4)


def test_a_branch_too_faint_to_follow_ends_at_the_splitter():
    splitter = ft.BeamSplitter(math.sqrt(1 - 1e-4) * 1j, 1e-2)
    scene = ft.Scene([surface(splitter), surface(z=-1.0)])
    paths = ft.trace(scene, one(amplitude=[2.0]), min_amplitude=0.1)
    by_fate = {int(fate): k for k, fate in enumerate(paths.fate)}
    faint = by_fate[Fate.FAINT]
    assert set(by_fate) == {Fate.LEFT, Fate.FAINT}
    assert paths.amplitude[faint] == 2e-2
    assert paths.origin[faint].tolist() == [0.0, 0.0, 0.0]
    assert paths.direction[faint].tolist() == [0.0, 0.0, -1.0]
    assert paths.sequence(faint) == [(0, True)]
    assert paths.ledger().error < LEDGER


# What a ray brings along


def test_length_and_amplitude_of_a_ray_are_those_of_its_paths():
    rays = ft.Rays([(0, 0, 0.5)] * 3, [(0, 0, -1)] * 3, length=[0.0, 7.0, -1.0], amplitude=[1.0, 2j, -0.5])
    for record in (False, True):
        paths = ft.trace(ft.Scene([surface()]), rays, ccd(), record=record)
        assert paths.length.tolist() == [1.5, 8.5, 0.5]
        assert paths.amplitude.tolist() == [-1.0, -2j, 0.5]
        assert paths.ledger() == ft.Ledger(5.25, 5.25, 0.0, 0.0, 0.0)
    split = ft.trace(ft.Scene([surface(ft.BeamSplitter(0.6j, 0.8))]), rays)
    assert split.ray.tolist() == [0, 0, 1, 1, 2, 2]
    reflected = split.where(split.direction[:, 2] > 0)
    np.testing.assert_allclose(reflected.amplitude, np.array([1.0, 2j, -0.5]) * 0.6j, rtol=ROUNDING)
    assert reflected.length.tolist() == [0.5, 7.5, -0.5]


def test_rays_of_a_beam_are_numbered_row_by_row_and_stand_for_an_area():
    beam = ft.Beam((0, 0, 0.5), (0, 0, -1), (0, 1, 0), (1.0, 0.5), (3, 4), profile=ft.Gaussian(0.3))
    paths = ft.trace(ft.Scene([surface()]), beam, max_bounces=5)
    assert paths.ray.tolist() == list(range(12))
    assert paths.area == beam.area == 0.5 / 12
    x, y = np.meshgrid((np.arange(4) - 1.5) / 4, (np.arange(3) - 1.0) / 6)  # looking down with y up: x right
    np.testing.assert_allclose(paths.origin[:, :2], np.stack([x, y], -1).reshape(-1, 2), rtol=0, atol=1e-16)
    amplitude = np.exp(-(x**2 + y**2) / 0.09).ravel()
    np.testing.assert_allclose(paths.amplitude, -amplitude, rtol=ROUNDING)
    assert paths.incident == pytest.approx((amplitude**2).sum(), rel=ROUNDING)
    assert paths.ledger().incident == pytest.approx((amplitude**2).sum() * beam.area, rel=ROUNDING)
    assert paths.ledger().left == pytest.approx(paths.ledger().incident, rel=ROUNDING)


@pytest.mark.parametrize("interface", [ft.Mirror(), ft.BeamSplitter()])
def test_a_source_on_a_surface_does_not_meet_it(interface):
    scene = ft.Scene([surface(interface), surface(z=2.0)])
    away = ft.Rays([(0.1, 0.2, 0.0)] * 2, [(0.3, 0.1, 1.0), (0.3, 0.1, -1.0)])
    paths = ft.trace(scene, away, max_bounces=1)
    assert paths.bounces.tolist() == [1, 0]
    assert paths.origin[0, 2] == 2.0


# Splitting


def test_each_branch_is_a_path_of_its_own():
    turn = rotation((0, 1, 0), math.pi / 4)
    scene = ft.Scene([surface(ft.BeamSplitter(0.6j, 0.8), turn=turn)])
    paths = ft.trace(scene, one(), record=True)
    assert paths.ray.tolist() == [0, 0]
    assert paths.fate.tolist() == [Fate.LEFT, Fate.LEFT]
    across, through = np.argsort(np.abs(paths.direction[:, 2]))
    np.testing.assert_allclose(paths.direction[across], [1, 0, 0], rtol=0, atol=1e-15)
    assert paths.direction[through].tolist() == [0, 0, -1]
    assert paths.amplitude[[across, through]].tolist() == [0.6j, 0.8]
    assert paths.sequence(across) == [(0, False)]
    assert paths.sequence(through) == [(0, True)]
    assert paths.key[0] != paths.key[1]
    # neither is a reflection off a mirror
    assert paths.reflections.tolist() == [0, 0]
    assert paths.bounces.tolist() == [1, 1]
    assert paths.length.tolist() == [0.5, 0.5]


def product(paths, i, pairs):
    """Amplitude of a path, from its sequence and the (r, t) of each surface."""
    amplitude = paths.source.amplitude[paths.ray[i]]
    for number, transmitted in paths.sequence(i):
        amplitude = amplitude * pairs[number][int(transmitted)]
    return amplitude


unit_disc = st.builds(lambda size, turn: size * np.exp(1j * turn), st.floats(0, 1), st.floats(0, 2 * math.pi))


@st.composite
def passive(draw):
    """Amplitudes r, t for which |r + t| and |r - t| are at most 1."""
    even, odd = draw(unit_disc), draw(unit_disc)
    if draw(st.booleans()):  # lossless
        even, odd = (value / abs(value) if abs(value) > 1e-3 else 1.0 for value in (even, odd))
    return complex(0.5 * (even + odd) * (1 - 1e-15)), complex(0.5 * (even - odd) * (1 - 1e-15))


@settings(max_examples=40)
@given(
    pairs=st.lists(passive(), min_size=1, max_size=3),
    least=st.sampled_from([0.0, 1e-6, 0.05, 0.5]),
    most=st.integers(0, 9),
    screen=st.booleans(),
    seed=st.integers(0, 2**32 - 1),
)
def test_the_ledger_adds_up_and_amplitudes_are_products(pairs, least, most, screen, seed):
    rng = np.random.default_rng(seed)
    scene = facing(*(ft.BeamSplitter(r, t) for r, t in pairs), ft.Mirror(0.8))
    count = 7
    rays = ft.Rays(
        rng.uniform(-0.2, len(pairs) + 0.2, (count, 3)) * [0.1, 0.1, 1.0],
        rng.normal(size=(count, 3)) * [0.1, 0.1, 1.0],
        amplitude=rng.normal(size=count) + 1j * rng.normal(size=count),
        area=0.25,
    )
    detector = ccd((0, 0, len(pairs) + 0.5)) if screen else None
    paths = ft.trace(scene, rays, detector, max_bounces=most, min_amplitude=least)
    ledger = paths.ledger()
    assert ledger.incident == pytest.approx(0.25 * (np.abs(rays.amplitude) ** 2).sum(), rel=ROUNDING)
    assert ledger.error < LEDGER
    known = [*pairs, (-math.sqrt(0.8), 0.0)]
    for i in range(0, len(paths), 1 + len(paths) // 50):
        expected = 0.0 if paths.fate[i] == Fate.ABSORBED else product(paths, i, known)
        assert paths.amplitude[i] == pytest.approx(expected, rel=1e-13)
        assert (paths.fate[i] == Fate.FAINT) == (0 < abs(expected / rays.amplitude[paths.ray[i]]) < least)
    assert (np.diff(paths.ray) >= 0).all()
    assert np.unique(paths.ray).tolist() == list(range(count))


def test_a_thousand_paths_of_one_ray():
    scene = facing(ft.BeamSplitter(), ft.BeamSplitter(), ft.Mirror())
    paths = ft.trace(scene, one((0, 0, -1), (0, 0, 1)), max_bounces=20, min_amplitude=0.0)
    assert len(paths) > 1000
    names = {(tuple(paths.sequence(i)), int(paths.bounces[i])) for i in range(len(paths))}
    assert len(names) == len(paths)
    assert paths.ledger().error < LEDGER
    assert (paths.fate[paths.bounces < 20] == Fate.LEFT).all()
    assert (paths.origin[paths.fate == Fate.LEFT, 2] == 0.0).all()  # past the mirror there is no way


# Surfaces that rays pass over at first


@pytest.mark.parametrize("extra", [0, 9])
def test_passes_leaves_a_surface_out_on_the_first_leg_only(extra):
    aside = [plate(0.5, 0.1).moved((5.0, k, 0.0)) for k in range(extra)]
    far = [ft.Surface(mesh, ft.Mirror(), f"far {k}") for k, mesh in enumerate(aside)]
    scene = ft.Scene([surface(), surface(z=1.0, name="window"), *far])
    down = one((0, 0, 2.0))
    assert row(ft.trace(scene, down)) == (Fate.LEFT, 1, 1, 1.0)
    paths = ft.trace(scene, one((0, 0, 2.0), passes="window"), max_bounces=4, record=True)
    assert row(paths) == (Fate.TRUNCATED, 4, 4, 2.0 + 3.0)
    assert paths.surface[0].tolist() == [0, 1, 0, 1]
    # one that never meets anything else
    only = ft.trace(scene, one((0, 0, 2.0), passes=("window", "plate")))
    assert row(only) == (Fate.LEFT, 0, 0, 0.0)
    beam = ft.Beam((0, 0, 2), (0, 0, -1), (0, 1, 0), (0.1, 0.1), (2, 2), passes="window")
    assert ft.trace(scene, beam, max_bounces=2).bounces.tolist() == [2] * 4


def test_names_that_a_source_passes_must_be_there():
    scene = ft.Scene([surface(), surface(z=1.0)])
    with pytest.raises(
        ValueError, match=r"Scene: expected one surface called 'lens', got 0 in \['plate', 'plate'\]"
    ):
        ft.trace(scene, one(passes="lens"))
    with pytest.raises(ValueError, match="Scene: expected one surface called 'plate', got 2"):
        ft.stream(scene, one(passes="plate"))


# Recording


def three_surfaces():
    """A ball on a splitter under a faulty mirror, so that triangles have numbers of their own surface."""
    ball = shapes.icosphere(0.3, 2).moved((0.1, 0.2, 0.5))
    return ft.Scene(
        [
            ft.Surface(plate(1.5, 6.0), ft.Mirror(0.9), "roof"),
            ft.Surface(ball, ft.Mirror(), "ball"),
            ft.Surface(plate(0.0, 6.0), ft.BeamSplitter(0.6j, 0.8), "floor"),
        ]
    )


@pytest.fixture(scope="module")
def recorded():
    rng = np.random.default_rng(1)
    rays = ft.Rays(
        rng.uniform(-0.2, 0.2, (200, 3)) + np.array([0, 0, 1.1]),
        rng.normal(size=(200, 3)),
        length=rng.uniform(size=200),
    )
    detector = ccd((0.0, 0.0, -0.7), (0.1, 0.2, 1.0), pitch=0.1, shape=(20, 20))
    return ft.trace(three_surfaces(), rays, detector, max_bounces=8, record=True)


def test_a_polyline_is_as_long_as_its_path(recorded):
    assert set(np.unique(recorded.fate)) == {Fate.DETECTED, Fate.LEFT, Fate.TRUNCATED}
    for i in range(len(recorded)):
        points = recorded.polyline(i)
        landed = recorded.fate[i] == Fate.DETECTED
        assert len(points) == 1 + recorded.bounces[i] + landed
        assert np.array_equal(points[0], recorded.source.origin[recorded.ray[i]])
        assert np.array_equal(points[-1], recorded.origin[i])
        length = (
            np.linalg.norm(np.diff(points, axis=0), axis=1).sum() + recorded.source.length[recorded.ray[i]]
        )
        assert recorded.length[i] == pytest.approx(length, rel=ROUNDING)
        if landed:
            last = points[-1] - points[-2]
            np.testing.assert_allclose(last / np.linalg.norm(last), recorded.direction[i], rtol=0, atol=1e-13)


def test_recorded_triangles_are_those_of_their_surface_and_hold_the_hits(recorded):
    assert recorded.surface.shape == recorded.triangle.shape == (len(recorded), recorded.bounces.max())
    hit = recorded.surface >= 0
    assert np.array_equal(hit, recorded.triangle >= 0)
    assert np.array_equal(hit, np.arange(hit.shape[1]) < recorded.bounces[:, None])
    for number, surface in enumerate(recorded.scene.surfaces):
        where = recorded.surface == number
        assert where.any()
        assert recorded.triangle[where].max() < len(surface.mesh.faces)
        corners = surface.mesh.vertices[surface.mesh.faces[recorded.triangle[where]]]
        point = recorded.points[:, 1:-1][where]
        # the areas of the three triangles that a hit makes with the sides add up to the whole
        sides = corners - point[:, None]
        parts = np.cross(sides, np.roll(sides, -1, axis=1))
        whole = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.linalg.norm(parts, axis=2).sum(axis=1) / np.linalg.norm(whole, axis=1)
        np.testing.assert_allclose(areas, 1.0, rtol=1e-12)


def test_sequences_read_off_the_keys_are_those_recorded(recorded):
    for i in range(len(recorded)):
        numbers = [number for number, _ in recorded.sequence(i)]
        assert numbers == recorded.surface[i, : recorded.bounces[i]].tolist()
        assert not any(through for number, through in recorded.sequence(i) if number != 2)
    for number in range(3):
        assert np.array_equal(recorded.visits(number), (recorded.surface == number).sum(axis=1))


def test_a_record_changes_nothing_else(recorded):
    bare = ft.trace(recorded.scene, recorded.source, recorded.ccd, max_bounces=8)
    for name in BARE:
        assert np.array_equal(getattr(bare, name), getattr(recorded, name)), name
    assert bare.surface is bare.triangle is bare.points is None


def test_paths_that_meet_nothing_have_only_a_start():
    for screen in (None, ccd((5, 5, 5))):
        paths = ft.trace(ft.Scene([surface()]), one(direction=(1, 1, 1)), screen, record=True)
        assert paths.surface.shape == (1, 0)
        assert paths.polyline(0).tolist() == [[0.0, 0.0, 0.5]]


# The CCD


def test_the_front_of_a_ccd_detects_and_its_back_lets_pass():
    scene = ft.Scene([surface(z=-5.0), surface(z=5.0)])
    front = ccd(normal=(0, 0, -1))
    assert row(ft.trace(scene, one(direction=(0, 0, 1)), front)) == (Fate.DETECTED, 0, 0, 0.5)
    # down through nothing, up from the mirror at -5
    assert row(ft.trace(scene, one(), front)) == (Fate.DETECTED, 1, 1, 5.5 + 6.0)
    back = ccd(normal=(0, 0, 1))
    # through its back, to the mirror at 5, and down onto its front
    assert row(ft.trace(scene, one(direction=(0, 0, 1)), back)) == (Fate.DETECTED, 1, 1, 4.5 + 4.0)


def test_light_along_a_ccd_or_from_its_plane_is_not_detected():
    scene = ft.Scene([surface(z=-5.0)])
    assert row(ft.trace(scene, one((0.1, 0, 1.0), (1, 0, 0)), ccd()), ("fate",)) == (Fate.LEFT,)
    assert row(ft.trace(scene, one((0.1, 0, 1.0), (0, 0, 1)), ccd()), ("fate",)) == (Fate.LEFT,)


def test_a_surface_in_front_of_the_ccd_hides_it():
    assert row(
        ft.trace(ft.Scene([surface(z=0.9)]), one(direction=(0, 0, 1)), ccd()), ("fate", "bounces")
    ) == (Fate.LEFT, 1)
    assert row(ft.trace(ft.Scene([surface(z=1.1)]), one(direction=(0, 0, 1)), ccd())) == (
        Fate.DETECTED,
        0,
        0,
        0.5,
    )


@pytest.mark.parametrize("grid", [(4, 8), (3, 5)])
def test_pixels_are_half_open(grid):
    rows, columns = grid
    detector = ccd(pitch=0.125, shape=grid)
    # normal -z, up y: u = normal x up points along +x
    u = (np.arange(-1, 2 * columns + 2) - columns) / 2 * 0.125
    v = (np.arange(-1, 2 * rows + 2) - rows) / 2 * 0.125
    x, y = (part.ravel() for part in np.meshgrid(u, v))
    rays = ft.Rays(np.stack([x, y, 0 * x], axis=1), np.broadcast_to([0, 0, 1.0], (len(x), 3)))
    paths = ft.trace(ft.Scene([surface(z=-1)]), rays, detector)
    column, line = x / 0.125 + columns / 2, y / 0.125 + rows / 2
    inside = (column >= 0) & (column < columns) & (line >= 0) & (line < rows)
    assert np.array_equal(paths.fate == Fate.DETECTED, inside)
    assert np.array_equal(paths.pixel[inside], np.stack([line, column], axis=1)[inside])
    field = ft.complex_field(paths, 1.0)
    count = np.zeros(grid)
    np.add.at(count, (line[inside].astype(int), column[inside].astype(int)), 1.0)
    np.testing.assert_allclose(np.abs(field), count, rtol=ROUNDING)


def test_a_turned_ccd_sees_the_picture_the_right_way_round():
    # an eye at the chip that looks out along the normal with `up` up has u to its right
    detector = ft.CCD((0, 0, 0), (1, 0, 0), (0, 0, 1), 0.1, (10, 20))
    rays = ft.Rays([(1, 0.35, 0.25)], [(-1, 0, 0)])
    paths = ft.trace(ft.Scene([surface(z=-3.0)]), rays, detector)
    right = np.cross([1, 0, 0], [0, 0, 1])  # -y
    np.testing.assert_allclose(paths.pixel, [[5 + 2.5, 10 + 3.5 * right[1]]], rtol=ROUNDING)


@pytest.mark.parametrize("focus", [0.25, -0.5, 3.0])
def test_a_relay_images_the_plane_in_focus(focus):
    direction = np.array([0.3, -0.2, 1.0])
    unit = direction / np.linalg.norm(direction)
    detector = ccd(focus=focus, pitch=0.05, shape=(100, 100))
    paths = ft.trace(ft.Scene([surface(z=-1.0)]), one((0.01, 0.02, 0.5), direction), detector)
    assert paths.fate.tolist() == [Fate.DETECTED]
    reach = (0.5 - focus) / unit[2]  # to z = 1 - focus, along the ray or back along its line
    assert paths.length[0] == pytest.approx(reach, rel=ROUNDING)
    point = np.array([0.01, 0.02, 0.5]) + reach * unit
    np.testing.assert_allclose(paths.origin[0], point, rtol=0, atol=1e-15)
    np.testing.assert_allclose(paths.pixel[0], [point[1] / 0.05 + 50, point[0] / 0.05 + 50], rtol=1e-13)


def test_what_is_not_on_the_image_of_the_chip_is_not_detected():
    slanting = one((0.0, 0.0, 0.5), (0.5, 0.0, 1.0))  # at the chip x = 0.25, in focus x = -0.75 or 0.5
    chip = {"pitch": 0.1, "shape": (6, 6)}
    scene = ft.Scene([surface(z=-5.0)])
    assert ft.trace(scene, slanting, ccd(**chip)).fate.tolist() == [Fate.DETECTED]
    assert ft.trace(scene, slanting, ccd(focus=2.0, **chip)).fate.tolist() == [Fate.LEFT]
    assert ft.trace(scene, slanting, ccd(focus=-0.5, **chip)).fate.tolist() == [Fate.LEFT]
    # the other way round: past the chip, but on its image
    beside = one((-0.5, 0.0, -0.5), (0.5, 0.0, 1.0))  # x = 0.25 at the chip, 0 at z = 0.5
    assert ft.trace(scene, beside, ccd(focus=0.5, pitch=0.1, shape=(6, 3))).fate.tolist() == [Fate.DETECTED]
    # what stands behind the plane in focus hides it all the same
    hidden = ft.Scene([surface(z=0.9)])
    assert ft.trace(hidden, one(direction=(0, 0, 1)), ccd(focus=0.3)).fate.tolist() == [Fate.LEFT]


# Chunks, threads, progress


def test_progress_is_told_of_every_chunk_in_the_thread_that_asked():
    calls = []
    rays = many(250)
    for record in (False, True):
        ft.trace(
            ft.Scene([surface()]), rays, chunk=100, threads=2, record=record,
            progress=lambda done, total: calls.append((done, total, threading.current_thread())),
        )  # fmt: skip
    assert calls == [(done, 250, threading.main_thread()) for done in (100, 200, 250)] * 2


def test_an_error_in_progress_ends_the_trace():
    def stop(done, total):
        raise KeyboardInterrupt(f"{done} of {total}")

    rays = many(50)
    with pytest.raises(KeyboardInterrupt, match="5 of 50"):
        ft.trace(ft.Scene([surface()]), rays, chunk=5, threads=2, progress=stop)
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("fringetrace")]


def test_an_error_in_a_chunk_comes_out():
    def profile(x, y):
        if x.max() > 0.4:
            raise ZeroDivisionError("no light here")
        return np.ones_like(x)

    beam = ft.Beam((0, 0, 0.5), (0, 0, -1), (0, 1, 0), (1.0, 1.0), (20, 20), profile=profile)
    with pytest.raises(ZeroDivisionError, match="no light here"):
        ft.trace(ft.Scene([surface()]), beam, chunk=7, threads=2)


def test_a_stream_that_is_not_read_to_its_end():
    rays = many(500)
    stream = ft.stream(ft.Scene([surface()]), rays, chunk=5, threads=2)
    assert next(stream).ray.tolist() == [0, 1, 2, 3, 4]
    stream.close()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("fringetrace")]


def test_stream_records_as_well():
    rays = many(50)
    parts = list(ft.stream(ft.Scene([surface()]), rays, chunk=20, record=True))
    assert [part.surface.shape for part in parts] == [(20, 1), (20, 1), (10, 1)]


def test_project_and_trace_agree_on_a_free_ccd():
    rays = ft.Rays(many(50).origin, np.random.default_rng(2).normal(size=(50, 3)) * [1, 1, 5])
    scene = ft.Scene([surface(z=-1.0, size=20.0)])
    onto, later = ft.trace(scene, rays, ccd()), project(ft.trace(scene, rays), ccd())
    assert np.array_equal(onto.fate, later.fate)
    assert set(onto.fate) == {Fate.DETECTED, Fate.LEFT}


# What is refused

SCENE = ft.Scene([surface()])


@pytest.mark.parametrize("run", [ft.trace, ft.stream])
@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((surface(), one()), TypeError, "trace: expected a Scene, got Surface"),
        ((SCENE, ccd()), TypeError, "trace: expected a Beam or Rays, got CCD"),
        ((SCENE, np.zeros((2, 3))), TypeError, "trace: expected a Beam or Rays, got ndarray"),
        ((SCENE, one(), one()), TypeError, "trace: expected a CCD or None, got Rays"),
    ],
)
def test_arguments_of_the_wrong_kind(run, arguments, error, message):
    with pytest.raises(error, match=message):
        run(*arguments)


@pytest.mark.parametrize("run", [ft.trace, ft.stream])
@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("max_bounces", -1, "max_bounces: expected a whole number of at least 0, got -1"),
        ("max_bounces", 2.0, "max_bounces: expected a whole number of at least 0, got 2.0"),
        ("max_bounces", True, "max_bounces: expected a whole number of at least 0, got True"),
        ("max_bounces", None, "max_bounces: expected a whole number of at least 0, got None"),
        ("min_amplitude", -1e-9, "min_amplitude: expected a number of at least 0, got -1e-09"),
        ("min_amplitude", math.nan, "min_amplitude: expected a number of at least 0, got nan"),
        ("min_amplitude", math.inf, "min_amplitude: expected a number of at least 0, got inf"),
        ("min_amplitude", "dim", "min_amplitude: expected a number of at least 0, got 'dim'"),
        ("threads", 0, "threads: expected a whole number of at least 1, got 0"),
        ("threads", 1.5, "threads: expected a whole number of at least 1, got 1.5"),
        ("chunk", 0, "chunk: expected a whole number of at least 1, got 0"),
        ("chunk", 2.5, "chunk: expected a whole number of at least 1, got 2.5"),
    ],
)
def test_numbers_that_are_none(run, name, value, message):
    with pytest.raises(ValueError, match=message):
        run(SCENE, one(), **{name: value})


def test_numpy_numbers_are_numbers():
    paths = ft.trace(
        SCENE,
        one(),
        max_bounces=np.int32(3),
        threads=np.int64(1),
        chunk=np.uint16(5),
        min_amplitude=np.float32(0),
    )
    assert paths.bounces.tolist() == [1]


def test_no_kind_of_integer_compiles_the_loops_again():
    from fringetrace.tracing import kernels_loop

    scene, rays = ft.Scene([surface(), surface(z=1.0)]), one()
    box = ft.Scene([ft.Surface(shapes.plate(1.0, 1.0, 1.0), ft.Mirror())])
    inside = one((0.1, 0.1, -0.5), (0.3, 0.2, 0.1))

    def compiled(most):
        for where, what in ((scene, rays), (box, inside)):
            assert ft.trace(where, what, max_bounces=most).bounces.tolist() == [3]
        return len(kernels_loop.interact.signatures), len(kernels_loop.rebound.signatures)

    before = compiled(3)
    for kind in (np.int32, np.uint8, np.int64):
        assert compiled(kind(3)) == before


@pytest.mark.parametrize("record", [False, True])
@pytest.mark.parametrize("most", [np.uint64(12), np.int8(12), 2**31, 2**63, 2**64, 10**30], ids=repr)
def test_bounces_may_be_counted_by_any_integer(most, record):
    plates = [shapes.plate(1.0, 1.0), shapes.plate(1.0, 1.0).moved((0, 0, 0.1))]
    scene = ft.Scene([ft.Surface(plates[0], ft.BeamSplitter()), ft.Surface(plates[1], ft.Mirror())])
    ray = ft.Rays([[0.1, 0.2, 0.05]], [[0.0, 0.0, -1.0]])
    # light is too faint after some eighty bounces
    plain = ft.trace(scene, ray, max_bounces=12 if most == 12 else 100, record=record)
    assert np.array_equal(ft.trace(scene, ray, max_bounces=most, record=record).key, plain.key)


def test_no_kernel_takes_named_tuples():
    """Numba would pickle their classes into its cache, which none could load once they have moved."""
    from numba.core.types import NamedTuple, NamedUniTuple

    from fringetrace.tracing import kernels_boundary, kernels_loop, kernels_rays

    glass = ft.Scene([ft.Surface(shapes.plate(1.0, 1.0, 1.0), ft.Dielectric(), back=1.5)])
    for scene in (SCENE, glass):
        ft.trace(scene, one())
    seen = 0
    for module in (kernels_boundary, kernels_loop, kernels_rays):
        for function in vars(module).values():
            for signature in getattr(function, "signatures", ()):
                seen += 1
                assert not any(isinstance(kind, (NamedTuple, NamedUniTuple)) for kind in signature)
    assert seen > 3
