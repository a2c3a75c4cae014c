"""Plates of uniaxial crystal: waves and rays inside, and the two beams that leave."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from meetings import EPS, meeting, power, shower

from fringetrace.core.vectors import unit
from fringetrace.optics.birefringent import ShearPlate, Wollaston, refract_extraordinary, savart

# Some twenty products and a root, of numbers up to 10 (squares of indices).
ROUNDING = 200 * EPS

CALCITE = (1.6584, 1.4864)
X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
seeds = st.integers(0, 2**32 - 1)
axes = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda a: math.hypot(*a) > 0.1)


def inside(rays, axis, n_o, n_e):
    """Extraordinary waves behind a plane that rays meet from the front."""
    count = len(rays.point)
    rows = np.broadcast_to(np.asarray(axis) / math.hypot(*axis), (count, 3))
    wave = rays.direction * rays.index[:, None]
    return rows, *refract_extraordinary(wave, -rays.normal, np.full(count, n_o), np.full(count, n_e), rows)


@settings(deadline=None, max_examples=30)
@given(seed=seeds, axis=axes)
def test_waves_inside_obey_the_crystal_and_the_face(seed, axis):
    rays, (n_o, n_e) = shower(seed, both=False), CALCITE
    c, wave, ray, possible = inside(rays, axis, n_o, n_e)
    assert possible.all()
    assert np.abs((wave - rays.direction)[:, :2]).max() < ROUNDING
    along = np.einsum("ij,ij->i", wave, c)
    across = np.einsum("ij,ij->i", wave, wave) - along**2
    # k along the axis sees n_o, k across it n_e
    assert np.abs(across / n_e**2 + along**2 / n_o**2 - 1.0).max() < ROUNDING
    # the ray is normal to that ellipsoid, and what the field knows of k.S = n_ray |S| is positive
    steep = (wave - along[:, None] * c) / n_e**2 + along[:, None] * c / n_o**2
    assert np.abs(np.cross(unit(steep), unit(ray))).max() < ROUNDING
    assert (np.einsum("ij,ij->i", wave, ray) > 0.0).all()


@settings(deadline=None, max_examples=30)
@given(seed=seeds)
def test_equal_indices_make_snell(seed):
    rays = shower(seed, both=False)
    _, wave, ray, _ = inside(rays, X, 1.5, 1.5)
    assert np.abs(np.linalg.norm(wave, axis=1) - 1.5).max() < ROUNDING
    assert np.abs(np.cross(unit(wave), unit(ray))).max() < ROUNDING


def test_beyond_the_critical_angle_no_wave_goes_on():
    rays = meeting((0.9, 0.0, math.sqrt(0.19)), index=1.9)
    *_, possible = inside(rays, X, *CALCITE)
    assert not possible.any()
    for branch in ShearPlate((1, 0, 1), 1e-3, *CALCITE).act(replace(rays, field=np.array([[0, 1 + 0j, 0]]))):
        assert np.array_equal(branch.field, np.zeros((1, 3)))
        assert np.array_equal(branch.point, rays.point)


@settings(deadline=None, max_examples=30)
@given(theta=st.floats(0.0, math.pi / 2))
def test_normal_incidence_shifts_by_the_walk_off(theta):
    n_o, n_e = CALCITE
    rays = meeting(Z, field=(0.6, 0.8, 0.0))
    ordinary, extraordinary = ShearPlate((math.sin(theta), 0.0, math.cos(theta)), 0.01, n_o, n_e).act(rays)
    assert np.array_equal(ordinary.point, rays.point)
    assert ordinary.path[0] == pytest.approx(n_o * 0.01, rel=ROUNDING)
    # n(theta) and tan(rho): Born and Wolf, ch. 15.3
    c, s = math.cos(theta), math.sin(theta)
    index = n_o * n_e / math.hypot(n_e * c, n_o * s)
    walk = (n_o**2 - n_e**2) * s * c / (n_e**2 * c**2 + n_o**2 * s**2)
    assert extraordinary.path[0] == pytest.approx(index * 0.01, rel=ROUNDING)
    assert extraordinary.point[0] == pytest.approx([-0.01 * walk, 0.0, 0.0], abs=0.01 * ROUNDING)


def test_the_beams_are_polarised_across_and_along_the_optic_axis():
    ordinary, extraordinary = ShearPlate((1, 0, 1), 0.01, *CALCITE).act(meeting(Z, field=(0.6, 0.8j, 0.0)))
    assert ordinary.field[0] == pytest.approx([0.0, 0.8j, 0.0], abs=ROUNDING)
    assert extraordinary.field[0] == pytest.approx([0.6, 0.0, 0.0], abs=ROUNDING)
    alone, nothing = ShearPlate(Z, 0.01, *CALCITE).act(meeting(Z, field=(0.6, 0.8j, 0.0)))
    assert alone.field[0] == pytest.approx([0.6, 0.8j, 0.0], abs=ROUNDING)
    assert power(nothing.field)[0] == 0.0


def front(rays, branch):
    """Phase, in metres, by which rays of one plane wave leave differently from a plane wave."""
    out = rays.direction if branch.direction is None else branch.direction
    place = rays.point if branch.point is None else branch.point
    arrival = np.einsum("ij,ij->i", rays.direction, rays.point)
    return arrival + branch.path - np.einsum("ij,ij->i", out, place)


SPLITTERS = {
    "shear plate": ShearPlate((1, 0.4, 0.7), 5e-3, *CALCITE),
    "wollaston": Wollaston((1e-3, 0, 0), (1, 0.3, 0), 0.3, *CALCITE, thickness=4e-3),
    "thin wollaston": Wollaston((1e-3, 0, 0), (1, 0.3, 0), -0.3, *CALCITE),
}


@pytest.mark.parametrize("name", SPLITTERS)
@settings(deadline=None, max_examples=40)
@given(seed=seeds)
def test_a_plane_wave_leaves_as_two_plane_waves(name, seed):
    # every ray has its own path and shift; one wave front comes of it only if both are exact
    rays = shower(seed)
    rays = replace(rays, direction=np.broadcast_to(rays.direction[0], (12, 3)))
    for branch in SPLITTERS[name].act(rays):
        level = front(rays, branch)
        assert np.ptp(level) < 0.02 * ROUNDING  # of paths of two centimetres


@pytest.mark.parametrize("name", SPLITTERS)
@settings(deadline=None, max_examples=40)
@given(seed=seeds)
def test_beams_go_back_the_way_they_came(name, seed):
    rays = shower(seed)
    for number, branch in enumerate(SPLITTERS[name].act(rays)):
        out = rays.direction if branch.direction is None else branch.direction
        back = SPLITTERS[name].act(replace(rays, point=branch.point, direction=-out, field=branch.field))[
            number
        ]
        assert np.abs(back.point - rays.point).max() < 0.02 * ROUNDING
        assert np.abs(back.path - branch.path).max() < 0.02 * ROUNDING
        if back.direction is not None:
            assert np.abs(back.direction + rays.direction).max() < ROUNDING


def test_a_savart_plate_parts_beams_by_equal_shears():
    one, two = savart(Z, X, 0.01, *CALCITE)
    ends = []
    for first in one.act(meeting(Z, field=(1.0, 1.0j, 0.0))):
        for branch in two.act(meeting(Z, point=first.point, field=first.field)):
            ends.append((power(branch.field)[0], branch.point[0], first.path[0] + branch.path[0]))
    lit = [end for end in ends if end[0] > ROUNDING]
    assert [end[0] for end in lit] == pytest.approx([1.0, 1.0], rel=ROUNDING)
    shear = 0.01 * (CALCITE[0] ** 2 - CALCITE[1] ** 2) / (CALCITE[0] ** 2 + CALCITE[1] ** 2)
    assert lit[0][1] == pytest.approx([0.0, -shear, 0.0], abs=0.01 * ROUNDING)
    assert lit[1][1] == pytest.approx([-shear, 0.0, 0.0], abs=0.01 * ROUNDING)
    assert lit[0][2] == pytest.approx(lit[1][2], rel=ROUNDING)


def test_a_wollaston_without_thickness_parts_beams_in_its_plane():
    rays = meeting(np.tile(Z, (3, 1)), [(-1e-3, 0, 0), (0, 0, 0), (2e-3, 0, 0)], field=(1.0, 1.0, 0.0))
    for branch in Wollaston((0, 0, 0), X, 0.2, *CALCITE).act(rays):
        assert branch.path[1] == 0.0
        assert branch.point[1] == pytest.approx([0.0, 0.0, 0.0], abs=1e-3 * ROUNDING)
        # paths are those of the wave that is deflected, up to the shift inside the wedge
        slope = np.einsum("ij,ij->i", branch.direction, branch.point)
        assert branch.path == pytest.approx(slope, abs=1e-3 * ROUNDING)
    thick = Wollaston((0, 0, 0), X, 0.2, *CALCITE, thickness=5e-3).act(rays)
    for branch, (first, second) in zip(thick, (CALCITE[::-1], CALCITE), strict=True):
        wave = first + math.sqrt(second**2 - branch.direction[1, 0] ** 2)  # k across the plates, in both
        assert front(rays, branch) == pytest.approx(np.full(3, 0.5 * wave * 5e-3), rel=ROUNDING)


def test_a_wollaston_that_reflects_everything_blocks():
    rays = meeting((0.0, 0.0, 1.0), field=(1.0, 1.0, 0.0))
    dark, _ = Wollaston((0, 0, 0), X, 1.4, *CALCITE).act(rays)
    bright = Wollaston((0, 0, 0), X, 0.2, *CALCITE).act(rays)
    assert all(power(branch.field)[0] > 0.5 for branch in bright)
    other = Wollaston((0, 0, 0), X, 1.4, *CALCITE).act(rays)[1]
    assert min(power(dark.field)[0], power(other.field)[0]) == 0.0


def test_indices_may_depend_on_the_wavelength():
    def ordinary(wavelength):
        return 1.6 + 1e-14 / wavelength**2

    plate = ShearPlate((1, 0, 1), 1e-3, ordinary, 1.48)
    assert plate.chromatic
    beam = plate.act(meeting(Z, field=(0.0, 1.0, 0.0), wavelength=500e-9))[0]
    assert beam.path[0] == pytest.approx(1e-3 * ordinary(500e-9), rel=ROUNDING)
    assert Wollaston((0, 0, 0), X, 0.2, 1.5, lambda w: 1.6).chromatic
    with pytest.raises(ValueError, match="ShearPlate: expected a wavelength, which it depends on, got None"):
        plate.act(meeting(Z, field=(0.0, 1.0, 0.0)))


@pytest.mark.parametrize("bad", [0.0, -1.5, math.nan, math.inf, "1.5", True])
def test_indices_are_positive(bad):
    expected = "index: expected a positive index or a function of the wavelength, got"
    with pytest.raises(ValueError, match=f"ShearPlate ordinary {expected}"):
        ShearPlate(X, 1e-3, bad, 1.5)
    with pytest.raises(ValueError, match=f"Wollaston extraordinary {expected}"):
        Wollaston((0, 0, 0), X, 0.2, 1.5, bad)


def test_doors_of_the_plates():
    with pytest.raises(ValueError, match="ShearPlate thickness: expected a positive length in metres, got 0"):
        ShearPlate(X, 0, 1.5, 1.6)
    with pytest.raises(ValueError, match=r"Wollaston angle: expected less than a quarter turn, got 1\.6"):
        Wollaston((0, 0, 0), X, 1.6, 1.5, 1.6)
    with pytest.raises(ValueError, match=r"Wollaston thickness: expected no negative length, got -0\.1"):
        Wollaston((0, 0, 0), X, 0.1, 1.5, 1.6, thickness=-0.1)
    with pytest.raises(ValueError, match="Wollaston axis: expected a direction along the surface, got its"):
        Wollaston((0, 0, 0), Z, 0.1, 1.5, 1.6).act(meeting(Z, field=X))
    with pytest.raises(ValueError, match="savart first: expected a direction across the normal"):
        savart(Z, Z, 1e-3, 1.5, 1.6)
