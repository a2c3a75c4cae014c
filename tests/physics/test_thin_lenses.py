"""Ideal lenses and zone plates: sharp images, and equal paths to them, against mpmath."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from meetings import EPS, meeting

from fringetrace.optics.elements import IdealLens
from fringetrace.optics.phase_plates import zone_plate

# Lengths are sums of a few numbers below a metre, each rounded: of the whole path.
PATH = 2 * EPS
AIM = 16 * EPS
LAMBDA = 550e-9

MIDDLE, AXIS = np.array([0.02, -0.01, 0.3]), np.array([0.0, 0.6, 0.8])
EAST, NORTH = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.8, -0.6])
seeds = st.integers(0, 2**32 - 1)

# focal length and object distance: real, virtual, demagnified, diverging, from and to infinity
CONJUGATES = [
    (0.1, 0.3), (0.1, 0.12), (0.1, 0.05), (0.1, -0.2), (-0.1, 0.3), (-0.1, -0.05), (-0.1, -0.3), (0.1, 0.1),
    (0.1, np.inf), (-0.1, np.inf), (-0.1, -0.1),
]  # fmt: skip


def aperture(seed, count=6, radius=0.02, bulge=0.0):
    """Points of the lens, which may bulge out of its plane."""
    u, v = np.random.default_rng(seed).uniform(-radius, radius, (2, count))
    rise = bulge * (1.0 - (u * u + v * v) / radius**2)
    return MIDDLE + np.outer(u, EAST) + np.outer(v, NORTH) + np.outer(rise, AXIS)


def vector(row):
    return mpmath.matrix([mpmath.mpf(float(x)) for x in row])


def size(row):
    return mpmath.sqrt(sum(x * x for x in row))


def traced(element, points, directions, index, wavelength=None):
    rays = meeting(directions, points, normal=-AXIS, index=index, wavelength=wavelength)
    (branch,) = element.act(rays)
    return rays, branch


def bundle(points, source, travel):
    """Directions at points of light from a point (or to it, if that is behind), or along a vector (w = 0)."""
    *place, w = source
    if w == 0.0:
        return np.broadcast_to(place, points.shape)
    out = points - place
    return out * np.sign(out @ travel)[:, None]


def leg(point, source, travel):
    """Signed path in a vacuum from a source to a point; from the lens' centre if that is at infinity."""
    *place, w = source
    offset = point - vector(MIDDLE)
    if w == 0.0:
        away = vector(place) / size(vector(place))
        return sum(offset[i] * away[i] for i in range(3))
    way = point - vector(place)
    return size(way) * mpmath.sign(sum(way[i] * float(travel[i]) for i in range(3)))


def conjugate(f, s, across, reverse):
    """Source and image as (x, y, z, w), w = 0 at infinity, and the direction of travel."""
    after = 1.0 / f - 1.0 / s
    chief = AXIS + across[0] * EAST + across[1] * NORTH  # through the centre
    ends = []
    for vergence, sign in ((1.0 / s, -1.0), (after, 1.0)):
        ends.append((*chief, 0.0) if vergence == 0.0 else (*(MIDDLE + sign * chief / vergence), 1.0))
    if not reverse:
        return ends[0], ends[1], AXIS
    source, image = ((*(-np.array(end[:3])), 0.0) if end[3] == 0.0 else end for end in ends[::-1])
    return source, image, -AXIS


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize(("f", "s"), CONJUGATES)
@settings(deadline=None, max_examples=3)
@given(
    seed=seeds, across=st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)), bulge=st.sampled_from([0, 0.01])
)
def test_every_ray_of_an_object_point_has_the_same_path_to_its_image(f, s, reverse, seed, across, bulge):
    source, image, travel = conjugate(f, s, across, reverse)
    points = aperture(seed, bulge=bulge)
    _, branch = traced(IdealLens(MIDDLE, AXIS, f, s), points, bundle(points, source, travel), index=1.3)
    goal = bundle(points, image, travel)
    assert np.abs(branch.direction - goal / np.linalg.norm(goal, axis=1)[:, None]).max() < AIM
    middle = vector(MIDDLE)
    with mpmath.workdps(40):
        chief = leg(middle, source, travel) - leg(middle, image, travel)
        for row in range(len(points)):
            # the points as float64 has them: exactly in the plane they are not, and need not be
            point = vector(points[row])
            whole = leg(point, source, travel) - leg(point, image, travel)
            error = abs(whole + mpmath.mpf(float(branch.path[row])) / mpmath.mpf(1.3) - chief)
            span = abs(leg(point, source, travel)) + abs(leg(point, image, travel)) + mpmath.mpf(0.02)
            assert error <= PATH * span


@pytest.mark.parametrize(("f", "s"), CONJUGATES)
@settings(deadline=None, max_examples=3)
@given(seed=seeds)
def test_a_zone_plate_images_a_point_of_its_axis_like_the_ideal_lens(f, s, seed):
    source, _, travel = conjugate(f, s, (0.0, 0.0), False)
    points = aperture(seed)
    directions = bundle(points, source, travel)
    _, ideal = traced(IdealLens(MIDDLE, AXIS, f, s), points, directions, index=1.3)
    for design in (None, LAMBDA):
        plate = zone_plate(MIDDLE, AXIS, f, s, design=design, index=1.3)
        _, branch = traced(plate, points, directions, 1.3, wavelength=LAMBDA)
        assert np.abs(branch.direction - ideal.direction).max() < AIM
        assert np.abs(branch.path - ideal.path).max() < 0.2 * AIM  # of legs of decimetres


def test_the_edges_of_the_zones():
    # r_k^2 = k lambda f + (k lambda / 2)^2: one wave more from each zone to the focus
    f = 0.1
    plate = zone_plate((0, 0, 0), (0, 0, 1), f, design=LAMBDA)
    k = np.arange(1, 200)
    r = np.sqrt(2.0 * k * LAMBDA * f + (k * LAMBDA) ** 2)
    assert -plate.opd(r, 0.0 * r) / LAMBDA == pytest.approx(k, rel=8 * EPS)


def test_a_folded_zone_plate_focuses_blue_light_farther_off():
    # near the axis f design / (m lambda)
    point = np.array([[1e-5, 0.0, 0.0]])
    for wavelength, m in ((450e-9, 1), (650e-9, 1), (550e-9, 2), (550e-9, -1)):
        plate = zone_plate((0, 0, 0), (0, 0, 1), 0.1, design=LAMBDA, orders=(m,))
        (branch,) = plate.act(meeting((0, 0, 1), point, wavelength=wavelength))
        reach = -point[0, 0] / branch.direction[0, 0] * branch.direction[0, 2]
        # spherical aberration at 10 um from the axis: (r / f)^2
        assert reach == pytest.approx(0.1 * LAMBDA / (m * wavelength), rel=2 * (1e-5 / 0.05) ** 2)


def test_two_ideal_lenses_make_a_telescope():
    first, second = IdealLens((0, 0, 0), (0, 0, 1), 0.2), IdealLens((0, 0, 0.25), (0, 0, 1), 0.05, 0.05)
    random = np.random.default_rng(8)
    points = np.column_stack([random.uniform(-0.01, 0.01, (20, 2)), np.zeros(20)])
    slope = np.array([0.01, -0.02, 1.0])
    rays = meeting(np.tile(slope, (20, 1)), points)
    (one,) = first.act(rays)
    way = 0.25 / one.direction[:, 2]
    met = points + way[:, None] * one.direction
    (two,) = second.act(meeting(one.direction, met))
    out = two.direction / two.direction[:, 2:]
    assert np.abs(out - slope * [-4.0, -4.0, 1.0]).max() < AIM
    # a plane wave comes out: paths to a plane across it
    whole = rays.direction[0] @ points.T + one.path + way + two.path
    level = whole - met @ two.direction[0]
    assert np.ptp(level) < AIM
