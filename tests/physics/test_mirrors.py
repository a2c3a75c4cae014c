"""Flat mirrors against closed forms: retroreflection, multiple bounces, unfolding, and facets for curves."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace import Fate, mm, nm
from fringetrace.core.vectors import rotation, unit
from fringetrace.geometry import shapes

MIRROR = ft.Mirror()
# Part of the path; a path has some tens of roundings.
DISTANCE = 1e-12
EPS = float(np.finfo(np.float64).eps)


def mirrors(*meshes):
    return ft.Scene([ft.Surface(mesh, MIRROR, f"mirror {k}") for k, mesh in enumerate(meshes)])


# A corner cube with its apex at the origin sends d back as -d; where its light comes back to the plane
# across d through the start p it has come a way of -2 p.d, and across d it stands at the reflected point.


@pytest.mark.parametrize("subdivisions", [1, 7, 60])
@pytest.mark.parametrize("turn", [np.eye(3), rotation((1, 2, 3), 0.7), rotation((-1, 1, 0.3), 2.5)])
def test_a_corner_cube(turn, subdivisions):
    mesh = shapes.corner_cube(25 * mm, subdivisions).moved(turn=turn)
    rng, count = np.random.default_rng(1), 2000
    direction = unit(-rng.uniform(0.3, 1.0, (count, 3)))
    # onto the corner near its apex, so that all three mirrors are met
    start = 3 * mm * rng.uniform(-0.1, 1.0, (count, 3)) - 50 * mm * direction
    start, direction = start @ turn.T, direction @ turn.T
    paths = ft.trace(mirrors(mesh), ft.Rays(start, direction))
    three = paths.bounces == 3
    assert three.mean() > 0.7
    paths, start, direction = paths.where(three), start[three], direction[three]
    assert (paths.fate == Fate.LEFT).all()
    # rounding turns a small triangle by more than a large one
    np.testing.assert_allclose(paths.direction, -direction, rtol=0, atol=8 * (1 + subdivisions) * EPS)
    along = np.einsum("ij,ij->i", start, direction)
    back = np.einsum("ij,ij->i", paths.origin - start, direction)
    np.testing.assert_allclose(paths.length + back, -2 * along, rtol=DISTANCE)
    end = paths.origin - back[:, None] * direction
    across = 2 * along[:, None] * direction - start
    np.testing.assert_allclose(end, across, rtol=0, atol=DISTANCE * 50 * mm)


@pytest.mark.parametrize("slope", [0.0, 0.1, 2.0])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_a_thousand_bounces_between_parallel_plates(slope):
    gap, count = 0.25, 1000
    low, high = shapes.plate(1200.0, 2.0), shapes.plate(1200.0, 2.0).moved((0, 0, gap))
    for direction in ((slope, 0.0, 1.0), (-slope, 0.0, -1.0)):
        paths = ft.trace(mirrors(low, high), ft.Rays([(0.25, 0.1, 0.125)], [direction]), max_bounces=count)
        assert paths.bounces[0] == count
        exact = (count - 0.5) * gap * math.hypot(1.0, slope)
        assert paths.length[0] == pytest.approx(exact, rel=count * EPS, abs=0)
        if slope == 0.0:  # numbers that float64 holds exactly
            assert paths.length[0] == exact
        assert paths.origin[0, 0] - 0.25 == pytest.approx(
            (count - 0.5) * gap * direction[0] / abs(direction[2]), rel=DISTANCE
        )


# A mirror through (0, L), tilted by a; the source plane z = 0 sends light along +z, the detector lies at
# z = -D. Path to x on the detector: L + (L + D) cos 2a + x sin 2a.


@pytest.mark.parametrize("tilt", [0.0, 2e-3, -0.2])
def test_a_tilted_mirror(tilt):
    far, back = 0.1, 0.15
    mesh = shapes.plate(40 * mm, 40 * mm).moved((0, 0, far), rotation((0, -1, 0), tilt))
    offset = np.linspace(-2 * mm, 2 * mm, 41)
    rays = ft.Rays(np.stack([offset, 0 * offset, 0 * offset], axis=1), np.broadcast_to([0, 0, 1.0], (41, 3)))
    ccd = ft.CCD((0, 0, -back), (0, 0, 1), (0, 1, 0), 1 * mm, (400, 400))
    paths = ft.trace(mirrors(mesh), rays, ccd)
    assert (paths.fate == Fate.DETECTED).all()
    # the light of a mirror turned by a leaves at 2a
    np.testing.assert_allclose(paths.direction[:, 0], math.sin(2 * tilt), rtol=0, atol=4 * EPS)
    x = paths.origin[:, 0]
    exact = far + (far + back) * math.cos(2 * tilt) + x * math.sin(2 * tilt)
    np.testing.assert_allclose(paths.length, exact, rtol=DISTANCE)


def test_a_tilted_mirror_in_numbers():
    # tilt 2 mrad, 1 mm off the axis of the detector: 0.350001999992 m, to the digits given
    mesh = shapes.plate(40 * mm, 40 * mm).moved((0, 0, 0.1), rotation((0, -1, 0), 2e-3))
    ccd = ft.CCD((0, 0, -0.15), (0, 0, 1), (0, 1, 0), 1 * mm, (40, 40))
    start = np.stack([np.linspace(-2 * mm, 2 * mm, 401), np.zeros(401), np.zeros(401)], axis=1)
    paths = ft.trace(mirrors(mesh), ft.Rays(start, np.broadcast_to([0, 0, 1.0], start.shape)), ccd)
    at = np.interp(1 * mm, paths.origin[:, 0], paths.length)
    assert at == pytest.approx(0.350001999992, abs=0.5e-12)


# Unfolding: in a wedge of angle a a ray is a straight line that crosses images of the mirrors at the
# multiples of a, and keeps its distance from the edge.


@pytest.mark.parametrize("parts", [1, 2])
@pytest.mark.parametrize("angle", [0.05, 0.2, 0.7, math.pi / 3, 1.9])
def test_a_wedge_of_two_mirrors(angle, parts):
    long = 100.0
    low = shapes.extrude([(0.0, 0.0), (long, 0.0)], 4.0)
    high = shapes.extrude([(long * math.cos(angle), long * math.sin(angle)), (0.0, 0.0)], 4.0)
    if parts == 1:
        low = shapes.extrude([(long * math.cos(angle), long * math.sin(angle)), (0.0, 0.0), (long, 0.0)], 4.0)
    rng, count = np.random.default_rng(2), 3000
    polar = rng.uniform(0.05, 0.95, count) * angle
    start = 5.0 * np.stack([np.cos(polar), 0 * polar, np.sin(polar)], axis=1)
    heading = rng.uniform(-math.pi, math.pi, count)
    direction = np.stack([np.cos(heading), 0 * heading, np.sin(heading)], axis=1)
    # how far round the edge the straight line goes, from here to where the mirrors end
    impact, ahead = 5.0 * np.sin(heading - polar), 5.0 * np.cos(heading - polar)
    end = np.sqrt(long**2 - impact**2)
    sweep = np.arctan2(impact, ahead) - np.arctan2(impact, end)
    crossed = (polar + sweep) / angle
    clear = (np.abs(crossed - np.round(crossed)) > 1e-6) & (np.abs(impact) > 1e-6)
    paths = ft.trace(
        mirrors(low) if parts == 1 else mirrors(low, high), ft.Rays(start, direction), max_bounces=200
    )
    assert (paths.fate == Fate.LEFT).all()
    assert np.array_equal(paths.bounces[clear], np.abs(np.floor(crossed)).astype(int)[clear])
    # the length up to the last hit is that on the straight line
    last = np.where(sweep > 0, np.floor(crossed), np.ceil(crossed)) * angle
    met = clear & (paths.bounces > 0)
    exact = 5.0 * np.sin(last - polar) / np.sin(heading - last)
    np.testing.assert_allclose(paths.length[met], exact[met], rtol=1e-10)


# Mirrors parallel to an axis leave the part of a direction along it as it is.


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_a_box_keeps_the_parts_of_a_direction():
    rng = np.random.default_rng(3)
    rays = ft.Rays(rng.uniform(-0.4, 0.4, (50, 3)), rng.normal(size=(50, 3)))
    box = shapes.plate(1.0, 1.0, 1.0).moved((0, 0, 0.5))
    paths = ft.trace(mirrors(box), rays, max_bounces=2000)
    assert (paths.bounces == 2000).all()
    np.testing.assert_allclose(np.abs(paths.direction), np.abs(rays.direction), rtol=0, atol=2000 * EPS)
    # and the bounces at each pair of walls are those of a straight line through a lattice of boxes
    met = np.floor(np.abs(paths.length[:, None] * rays.direction) + 1).sum(axis=1)
    assert (np.abs(met - 2000) <= 3).all()


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_light_goes_the_same_way_back(seed):
    rng = np.random.default_rng(seed)
    x = np.linspace(-1.0, 1.0, 21)
    floor = np.stack([x, np.where(np.arange(21) % 2, -1.1, -1.0)], axis=1)
    room = mirrors(shapes.extrude(np.concatenate([floor, -floor]), 2.0, closed=True))
    start, direction = rng.uniform(-0.8, 0.8, (20, 3)), unit(rng.normal(size=(20, 3)))
    there = ft.trace(room, ft.Rays(start, direction), max_bounces=12, record=True)
    middle = 0.5 * (there.points[:, 11] + there.points[:, 12])
    back = ft.trace(room, ft.Rays(middle, unit(there.points[:, 11] - middle)), max_bounces=11, record=True)
    assert np.array_equal(back.triangle, there.triangle[:, 10::-1])
    # each bounce turns a ray by a rounding, and so do the points that the start is taken from, the more the
    # nearer they are; over the whole way this moves hits, at grazing incidence most
    corners = room.surfaces[0].mesh.vertices[room.surfaces[0].mesh.faces[there.triangle]]
    normal = unit(np.cross(corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]))
    steps = np.diff(there.points[:, :13], axis=1)
    cosine = np.abs((steps * normal).sum(axis=2)) / np.linalg.norm(steps, axis=2)
    turned = 12 * EPS + EPS * np.nanmax(np.abs(there.points)) / np.linalg.norm(
        middle - there.points[:, 11], axis=1
    )
    moved = 2 * turned * np.linalg.norm(steps, axis=2).sum(axis=1) / cosine.min(axis=1)
    apart = np.abs(back.points[:, 1:12] - there.points[:, 11:0:-1]).max(axis=(1, 2))
    assert (apart <= moved).all()
    assert (np.abs(back.direction + direction).max(axis=1) <= 2 * turned).all()
    last = np.linalg.norm(start - there.points[:, 1], axis=1)
    half = np.linalg.norm(there.points[:, 12] - middle, axis=1)
    np.testing.assert_allclose(back.length + last + half, there.length, rtol=1e-11)


# Flat facets for a smooth surface: paths are off by the square of their size h.


@pytest.mark.parametrize("sides", [18, 60, 400])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_a_polygon_for_a_circle_seen_from_its_centre(sides):
    # there and back: 2 (cos(pi/n) / cos(angle from the middle of a side) - 1); from 0 to -h^2/4, mean -h^2/6
    polygon = shapes.rod_lattice(1, 1, 1.0, 3.0, 2.0, sides=sides)
    angle = 2 * math.pi * (np.arange(20_000) + 0.5) / 20_000
    direction = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    paths = ft.trace(mirrors(polygon), ft.Rays(0 * direction, direction), max_bounces=1)
    part = math.pi / sides
    within = np.remainder(angle, 2 * part) - part
    np.testing.assert_allclose(paths.length, math.cos(part) / np.cos(within), rtol=DISTANCE)
    off, h = 2 * (paths.length - 1), 2 * math.sin(part)
    assert off.min() == pytest.approx(-(h**2) / 4, rel=h**2 + 1e-3)
    assert off.mean() == pytest.approx(-(h**2) / 6, rel=h**2 + 1e-3)
    assert off.max() < DISTANCE


def test_facets_of_a_parabola_put_the_focus_off_by_their_square():
    # all light along the axis has the way z0 + f to the focus
    focus, height = 50 * mm, 80 * mm
    start = np.linspace(-19.7 * mm, 19.3 * mm, 20_001)
    rays = ft.Rays(
        np.stack([start, 0 * start, np.full_like(start, height)], axis=1),
        np.broadcast_to([0, 0, -1.0], (20_001, 3)),
    )
    off = []
    for facets in (50, 100, 200, 400):
        x = np.linspace(-20 * mm, 20 * mm, facets + 1)
        trough = shapes.extrude(np.stack([x, x**2 / (4 * focus)], axis=1), 10 * mm)
        paths = ft.trace(mirrors(trough), rays, max_bounces=1)
        assert (paths.bounces == 1).all()
        # as a plane wave: what of the way to the focus lies along the ray
        rest = np.einsum("ij,ij->i", [0.0, 0.0, focus] - paths.origin, paths.direction)
        off.append(np.abs(paths.length + rest - (height + focus)).max())
    size = 40 * mm / np.array([50, 100, 200, 400])
    assert off[0] > 100 * nm
    np.testing.assert_allclose(np.log2(np.array(off[:-1]) / off[1:]), 2.0, atol=0.02)
    # chords stand above the curve by size^2 / 16 f, and turn the light off the focus: no more than both
    assert (off < size**2 * (1 / 8 + 1 / 8) / focus).all()
