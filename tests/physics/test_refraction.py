"""Rays through faces of glass and metal: Snell, Brewster, total reflection, prisms, slabs, cylinders."""

import cmath
import math

import glass
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace import Fate, Mesh, nm, um
from fringetrace.core.units import degree
from fringetrace.geometry import forms, shapes

EPS = float(np.finfo(np.float64).eps)
# Reference numbers are printed with nine decimals.
PRINTED = 0.51e-9
# An amplitude is a quotient of sums of products, split into s and p and put together again.
ROUNDINGS = 20 * EPS
LEDGER = 1e-12
HIT, THROUGH = ((0, False),), ((0, True),)

angles = st.floats(0.0, 89.9).map(math.radians)
indices = st.floats(1.0, 4.0)
states = st.sampled_from([None, "s", "p"])


def struck(first, last, angle, polarisation, wavelength=None, interface=None):
    """A ray at one face, the angle in degrees: amplitudes of power by sequence."""
    scene = glass.stack([first, last], interface=interface)
    paths = ft.trace(
        scene, glass.aimed(angle * degree, polarisation), wavelength=wavelength, min_amplitude=0.0
    )
    assert paths.ledger().error < LEDGER
    return glass.branches(paths, polarisation)


# One face


@pytest.mark.parametrize(
    ("angle", "rs", "rp"), [(45.0, -0.303337045, 0.092013363), (60.0, -0.420204103, -0.042449235)]
)
def test_air_to_glass(angle, rs, rp):
    for state, expected in (("s", rs), ("p", rp), (None, rs)):
        got = struck(1.0, 1.5, angle, state)
        assert got[HIT] == pytest.approx(expected, abs=PRINTED)
        assert abs(got[HIT]) ** 2 + abs(got[THROUGH]) ** 2 == pytest.approx(1.0, abs=ROUNDINGS)
        assert got[THROUGH].imag == 0.0
        assert got[THROUGH].real > 0.0


def test_brewster():
    angle = 56.309932474
    assert math.degrees(math.atan(1.5)) == pytest.approx(angle, abs=PRINTED)
    assert abs(struck(1.0, 1.5, angle, "p")[HIT]) < PRINTED
    assert abs(struck(1.0, 1.5, angle, "s")[HIT]) > 0.3


@pytest.mark.parametrize(("n", "angle"), [(1.5, 41.810314896), (1.33, 48.753466631)])
@pytest.mark.parametrize("state", [None, "s", "p"])
def test_critical_angle(n, angle, state):
    below, above = (struck(n, 1.0, angle + shift, state) for shift in (-2 * PRINTED, 2 * PRINTED))
    assert set(below) == {HIT, THROUGH}
    assert set(above) == {HIT}
    assert abs(above[HIT]) == pytest.approx(1.0, abs=ROUNDINGS)


def test_total_reflection_and_its_phase():
    for state, printed in (("s", -0.1 - 0.994987437j), ("p", -0.721739130 - 0.692165174j)):
        got = struck(1.5, 1.0, 60.0, state)
        assert set(got) == {HIT}
        assert got[HIT].real == pytest.approx(printed.real, abs=PRINTED)
        assert got[HIT].imag == pytest.approx(printed.imag, abs=PRINTED)


@pytest.mark.parametrize("angle", [48.624359160, 54.623105441])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_fresnel_rhomb(angle):
    """Two total reflections turn light at 45 degrees into circular light."""
    depth = 0.1
    scene = ft.Scene(
        [
            ft.Surface(shapes.plate(2.0, 1.0), ft.Dielectric(), "bottom", back=1.0),
            ft.Surface(shapes.plate(2.0, 1.0).moved((0.0, 0.0, depth)), ft.Dielectric(), "top", front=1.0),
        ],
        medium=1.51,
    )
    direction = glass.towards(angle * degree)
    p = np.cross(direction, glass.Y)
    rays = ft.Rays([-0.05 * direction], [direction], polarisation=[glass.Y + p])
    end = ft.trace(scene, rays, max_bounces=2)
    assert end.fate.tolist() == [Fate.TRUNCATED]
    s, q = end.field[0] @ glass.Y, end.field[0] @ np.cross(end.direction[0], glass.Y)
    assert math.degrees(cmath.phase(s / q)) % 360.0 == pytest.approx(90.0, abs=40 * PRINTED)
    # circular: no light along one of the two circular states
    assert min(abs(s + 1j * q), abs(s - 1j * q)) < 1e-9


def test_goos_haenchen():
    """Artmann: the ray comes back -d(arg rs)/d(kx) farther on."""
    k, step = 1.5 * 2.0 * math.pi / 633.0, 1e-4
    before, after = (struck(1.5, 1.0, 60.0 + turn / degree, "s")[HIT] for turn in (-step, step))
    slope = cmath.phase(after / before) / (2.0 * step)
    # the difference quotient is off by step^2 in relative terms
    assert -slope / (k * math.cos(math.pi / 3)) == pytest.approx(420.8992, rel=10 * step**2 + 1.2e-7)


@pytest.mark.parametrize(
    ("angle", "s", "p"), [(0.0, 0.944358978, 0.944358978), (45.0, 0.961122032, 0.923755560)]
)
def test_gold_mirror(angle, s, p):
    for state, expected in (("s", s), ("p", p), (None, s)):
        got = struck(1.0, 0.18344 + 3.4332j, angle, state, 633 * nm, ft.Metal())
        assert set(got) == {HIT}
        assert abs(got[HIT]) ** 2 == pytest.approx(expected, abs=PRINTED)


def test_keratin_to_melanin():
    for state, expected in (("s", 0.006503985), ("p", 0.001999897)):
        got = struck(1.55556, 1.7428 + 0.08789j, 30.0, state, 500 * nm)
        assert abs(got[HIT]) ** 2 == pytest.approx(expected, abs=PRINTED)


def test_damping_in_melanin():
    """Through 130 nm at 45 degrees: the wave vector across the face is 1.593383 + 0.096132i."""
    wavelength, depth, kz = 500 * nm, 130 * nm, 1.593383 + 0.096132j
    scene = glass.stack([1.0, 1.7428 + 0.08789j, 1.0], [depth])
    paths = ft.trace(scene, glass.aimed(45 * degree, "s"), wavelength=wavelength)
    once = paths.where([paths.sequence(k) == [(0, True), (1, True)] for k in range(len(paths))])
    into, out = (1.0 / math.sqrt(2.0), 1.0 / math.sqrt(2.0))
    fresnel = 4.0 * into * kz / ((into + kz) * (out + kz))
    expected = fresnel * cmath.exp(2j * math.pi / wavelength * kz * depth)
    got = glass.summed(once, wavelength, "s", upwards=False, point=(0.0, 0.0, -depth))
    # six decimals are printed of kz; the phase is 1.6 k kz
    assert got == pytest.approx(expected, abs=3e-6)


@given(first=indices, last=indices, angle=angles, state=states)
@settings(max_examples=40)
def test_snell(first, last, angle, state):
    paths = ft.trace(glass.stack([first, last]), glass.aimed(angle, state, away=1e-3), min_amplitude=0.0)
    assert paths.ledger().error < LEDGER
    for row in range(len(paths)):
        x, y, z = paths.direction[row]
        assert y == 0.0
        assert math.hypot(x, z) == pytest.approx(1.0, abs=4 * EPS)
        index = last if z < 0.0 else first
        assert index * x == pytest.approx(first * math.sin(angle), abs=1e-15 * 4.0)
        assert paths.index[row] == index


@pytest.mark.parametrize("state", ["s", "p"])
def test_grazing_light(state):
    """At 89.99 degrees nearly all is reflected: 1 - R = 4 cos / sqrt(n^2 - 1), times n^2 for p."""
    got = struck(1.0, 1.5, 89.99, state)
    passes = 4.0 * math.cos(89.99 * degree) / math.sqrt(1.25) * (2.25 if state == "p" else 1.0)
    assert abs(got[THROUGH]) ** 2 == pytest.approx(passes, rel=1e-3)  # to first order in the cosine
    assert abs(got[HIT]) ** 2 == pytest.approx(1.0 - passes, abs=passes**2)


@given(first=indices, last=indices, angle=st.floats(0.0, 89.0).map(math.radians), state=states)
@settings(max_examples=40)
def test_stokes_relations(first, last, angle, state):
    """Light sent back along both paths gives the incident wave: r12 = -r21, t12 t21 - r12 r21 = 1."""
    sine = first * math.sin(angle) / last
    if sine > 0.999:  # total reflection: there is no wave to send back
        return
    there = glass.branches(
        ft.trace(glass.stack([first, last]), glass.aimed(angle, state), min_amplitude=0.0), state
    )
    scene = ft.Scene(glass.stack([first, last]).surfaces, medium=last)
    back = glass.branches(
        ft.trace(scene, glass.aimed(math.asin(sine), state, upwards=True), min_amplitude=0.0), state
    )
    # cosines of each side are off by the rounding of n^2 - sine^2
    worst = 40 * EPS * max(1.0 / math.cos(angle) ** 2, 1.0 / (1.0 - sine**2))
    r, s = there.get(HIT, 0.0), back.get(HIT, 0.0)
    assert s == pytest.approx(-r, abs=worst)
    assert there[THROUGH] * back[THROUGH] - r * s == pytest.approx(1.0, abs=worst)


# Slabs, wedges, prisms, cylinders


def test_slab_in_water():
    """Optical path beside that of water alone, and the shift, at 30 degrees."""
    for n, around, depth, opd, shift in (
        (1.38, 1.335, 5 * um, 0.258410644430 * um, 0.106973453 * um),
        (1.5, 1.0, 1000 * um, 548.188158588656 * um, 193.813782152 * um),
    ):
        direction = glass.towards(30 * degree)
        scene = glass.stack([around, n, around], [depth])
        paths = ft.trace(scene, glass.aimed(30 * degree, away=0.01))
        straight = paths.where([paths.sequence(k) == [(0, True), (1, True)] for k in range(len(paths))])
        np.testing.assert_allclose(straight.direction[0], direction, rtol=0, atol=4 * EPS)
        aside = np.cross(straight.origin[0], direction)
        # what is printed has nine or twelve digits; a path of a centimetre rounds to 1e-18 m
        assert np.linalg.norm(aside) == pytest.approx(shift, rel=1e-8)
        ahead = straight.origin[0] @ direction
        assert straight.length[0] - around * (0.01 + ahead) == pytest.approx(opd, rel=2e-11)


def prism(apex, side=1.0, depth=1.0):
    """A prism: its apex at (0, side), its faces at half the angle on both sides of the z axis."""
    half = side * math.tan(0.5 * apex)
    return shapes.extrude([(0.0, side), (half, 0.0), (-half, 0.0)], depth, closed=True)


def test_deviation_of_a_wedge():
    """Light falls straight on the first face of a wedge of 0.05 rad."""
    apex = 0.05
    wedge = shapes.extrude([(1.0, 0.0), (-1.0, 0.0), (-1.0, 2.0 * math.tan(apex))], 1.0, closed=True)
    scene = ft.Scene([ft.Surface(wedge, ft.Dielectric("transmitted"), "wedge", back=1.5)])
    end = ft.trace(scene, ft.Rays([(0.0, 0.0, -1.0)], [(0.0, 0.0, 1.0)]))
    assert len(end) == 1
    x, _, z = end.direction[0]
    assert abs(math.atan2(x, z)) == pytest.approx(0.025039156767523857, abs=4 * EPS)


@pytest.mark.parametrize("state", [None, "s", "p"])
def test_minimum_deviation_of_a_prism(state):
    n, apex = 1.5, 60 * degree
    scene = ft.Scene([ft.Surface(prism(apex), ft.Dielectric("transmitted"), "prism", back=n)])
    least = 2.0 * math.asin(n * math.sin(0.5 * apex)) - apex

    def deviation(turn):
        angle = 0.5 * least + turn  # above the base, for the ray that comes from the left
        direction = np.array([math.cos(angle), 0.0, math.sin(angle)])
        field = {None: None, "s": [glass.Y], "p": [np.cross(direction, glass.Y)]}[state]
        start = np.array([-0.5 * math.tan(0.5 * apex), 0.0, 0.5]) - direction
        end = ft.trace(scene, ft.Rays([start], [direction], polarisation=field))
        assert end.fate.tolist() == [Fate.LEFT]
        assert end.sequence(0) == [(0, True), (0, True)]
        return math.acos(direction @ end.direction[0])

    at = [deviation(turn) for turn in (-1e-3, 0.0, 1e-3)]
    assert at[1] == pytest.approx(least, abs=1e-15 * 10)
    assert at[1] < min(at[0], at[2])


def test_prism_beside_closed_form_off_minimum():
    """Deviation i1 + i2 - A by Snell's law twice, at many angles."""
    n, apex = 1.62, 60 * degree
    first = np.radians(np.linspace(40.0, 85.0, 19))
    inside = np.arcsin(np.sin(first) / n)
    second = np.arcsin(n * np.sin(apex - inside))
    normal = np.pi - 0.5 * apex  # of the left face, from +x
    heading = normal + np.pi - first  # turned up or down by the angle of incidence
    for sign in (-1.0, 1.0):
        heading = normal + np.pi + sign * first
        direction = np.column_stack([np.cos(heading), np.zeros(19), np.sin(heading)])
        start = np.array([-0.5 * math.tan(0.5 * apex), 0.0, 0.5]) - direction
        scene = ft.Scene([ft.Surface(prism(apex), ft.Dielectric("transmitted"), "prism", back=n)])
        ends = ft.trace(scene, ft.Rays(start, direction), max_bounces=2)
        through = [k for k in range(len(ends)) if ends.sequence(k) == [(0, True), (0, True)]]
        turned = np.arccos((direction[ends.ray[through]] * ends.direction[through]).sum(axis=1))
        some = (first + second - apex)[ends.ray[through]]
        if np.allclose(turned, some, rtol=0, atol=1e-13) and len(through) == 19:
            return
    pytest.fail("no sense of turning gives the deviation of a prism")


@pytest.mark.parametrize(
    ("b", "x", "path"),
    [
        (2.0, 2.000176996, 0.882413003), (4.0, 4.001610969, 0.827379393),
        (6.0, 6.007057021, 0.726259291), (8.0, 8.028711932, 0.553202894),
    ],
)  # fmt: skip
def test_cylinder_refocused(b, x, path):
    """A cell's cylinder in water, 10 um in radius, seen in its middle plane (lengths in um)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 97)[:-1]
    mesh = shapes.extrude(10 * um * np.column_stack([np.cos(angle), np.sin(angle)]), 40 * um, closed=True)
    form = forms.Cylinder((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 10 * um)
    scene = ft.Scene([ft.Surface(mesh, ft.Dielectric("transmitted"), "cell", form, back=1.38)], medium=1.335)
    ccd = ft.CCD((0.0, 0.0, -30 * um), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), 1 * um, (40, 40), focus=30 * um)
    end = ft.trace(scene, ft.Rays([(b * um, 0.0, 30 * um)], [(0.0, 0.0, -1.0)]), ccd)
    assert end.fate.tolist() == [Fate.DETECTED]
    assert abs(end.origin[0, 0]) == pytest.approx(x * um, abs=PRINTED * um)
    assert end.length[0] - 1.335 * 30 * um == pytest.approx(path * um, abs=PRINTED * um)
    assert end.lengths[0] @ (1.335, 1.38) == pytest.approx(end.length[0], rel=1e-14)


# A corner cube of glass


def corner_prism(side=1.0):
    """A solid corner: right angles at the origin, the face across (1, 1, 1)."""
    vertices = side * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    return Mesh(vertices, np.array([[1, 2, 3], [0, 2, 1], [0, 3, 2], [0, 1, 3]]))


@pytest.mark.parametrize("sextant", range(6))
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_total_reflections_in_a_corner_cube(sextant):
    """Each sextant is a Jones matrix of its own: three reflections in another order (Peck, 1962)."""
    n = 1.5
    scene = ft.Scene([ft.Surface(corner_prism(), ft.Dielectric(), "cube", back=n)])
    axis = -np.ones(3) / math.sqrt(3.0)
    order = [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)][sextant]
    # the coordinate that is least comes to its plane first
    point = np.empty(3)
    point[list(order)] = (0.22, 0.33, 0.45)
    u = np.array([1.0, -1.0, 0.0]) / math.sqrt(2.0)
    fields = np.stack([u, np.cross(axis, u)])
    rays = ft.Rays(np.tile(point - 2.0 * axis, (2, 1)), np.tile(axis, (2, 1)), polarisation=fields)
    paths = ft.trace(scene, rays, max_bounces=5, record=True)
    back = np.flatnonzero((paths.bounces == 5) & (paths.fate == Fate.LEFT))
    assert paths.ray[back].tolist() == [0, 1]
    assert paths.triangle[back[0], 1:4].tolist() == [{0: 2, 1: 3, 2: 1}[k] for k in order]
    np.testing.assert_allclose(paths.direction[back], [-axis, -axis], rtol=0, atol=4 * EPS)
    sine2 = 2.0 / 3.0  # of incidence on each of the three faces
    q, c = math.sqrt(sine2 - 1.0 / n**2), math.sqrt(1.0 - sine2)
    rs, rp = cmath.exp(-2j * math.atan(q / c)), cmath.exp(-2j * math.atan(q * n**2 / c))
    matrix, direction = np.eye(3, dtype=complex), axis
    for k in order:
        normal = np.eye(3)[k]
        out = direction - 2.0 * direction[k] * normal
        s = np.cross(direction, normal)
        s /= np.linalg.norm(s)
        one = rs * np.outer(s, s) + rp * np.outer(np.cross(out, s), np.cross(direction, s))
        matrix, direction = one @ matrix, out
    passes = 4.0 * n / (1.0 + n) ** 2  # two faces met straight on, amplitudes of power
    np.testing.assert_allclose(paths.field[back], passes * (fields @ matrix.T), rtol=0, atol=1e-14)
    # from the entry face to the corner and back: there and back again along (1, 1, 1)
    assert paths.lengths[back[0], 1] == pytest.approx(2.0 / math.sqrt(3.0), rel=1e-14)
