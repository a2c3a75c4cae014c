"""Flat elements: what all of them keep, the stop, and the ideal lens."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from meetings import EPS, meeting, outcome, power, shower

from fringetrace.core.vectors import rotation
from fringetrace.optics.birefringent import ShearPlate, Wollaston
from fringetrace.optics.elements import (
    Annulus,
    IdealLens,
    deflect,
    rotate_fields,
    tangential_axis,
    transverse_axis,
)
from fringetrace.optics.gratings import Grating
from fringetrace.optics.phase_plates import PhasePlate, zone_plate
from fringetrace.optics.polarisers import Birefringence, JonesPlate, Polariser, Retarder, wave_plate

# Directions and fields are sums of some ten products of numbers near 1.
ROUNDING = 32 * EPS
# Turned by a rounded matrix, and with lengths of centimetres about points half a metre away.
TURNED = 1e-13

LAMBDA = 633e-9
seeds = st.integers(0, 2**32 - 1)
ripple = np.random.default_rng(1).normal(scale=1e-6, size=(6, 7))
unitary = np.linalg.qr(ripple[:2, :2] * 1e6 + 1j * ripple[2:4, :2] * 1e6)[0]


def twist(x, y):
    return 1e-3 * (x * x - x * y) + 1e-3 * y


def twist_gradient(x, y):
    return 1e-3 * (2.0 * x - y), 1e-3 * (1.0 - x)


LOSSLESS = {
    "retarder": Retarder((1, 2, 0.1), 0.7),
    "dispersive retarder": Retarder((1, 2, 0.1), Birefringence(1.54424, 1.55335, 1e-4)),
    "wave plate": wave_plate((1, -1, 0), 0.25, design=550e-9),
    "jones": JonesPlate(unitary, (1, 0.5, 0)),
    "lens": IdealLens((1e-3, 0, 0), (0, 0, 1), 0.1),
    "relay lens": IdealLens((1e-3, 0, 0), (0, 0, -1), -0.1, 0.3),
    "plate": PhasePlate(twist, (1e-3, 0, 0), (1, 1, 0), (0, 1, 0), gradient=twist_gradient),
    "modulator": PhasePlate(ripple, (0, 0, 0), (1, 0, 0), (0, 1, 0), pitch=3e-3, interpolation="nearest"),
    "mirror modulator": PhasePlate(
        ripple, (0, 0, 0), (1, 0, 0), (0, 1, 0), pitch=3e-3, interpolation="nearest", reflects=True
    ),
    "membrane": PhasePlate(1e-1 * ripple, (0, 0, 0), (1, 0, 0), (0, 1, 0), pitch=3e-3, reflects=True),
    "zone plate": zone_plate((0, 0, 0), (0, 0, 1), 0.2, 0.7, design=LAMBDA),
    "grating": Grating((1, 0.5, 0), 10e-6, orders=(-1, 0, 2), centre=(1e-3, 0, 0)),
    "mirror grating": Grating((1, 0.5, 0), 10e-6, orders=(-1, 0, 2), reflects=True),
    "shear plate": ShearPlate((1, 0.2, 1), 5e-3, 1.6584, 1.4864),
    "wollaston": Wollaston((0, 0, 0), (1, 0.3, 0), 0.2, 1.6584, 1.4864, thickness=2e-3),
    "thin wollaston": Wollaston((0, 0, 0), (1, 0.3, 0), -0.1, 1.54424, 1.55335),
}
LOSSY = {
    "polariser": Polariser((1, 2, 0), extinction=1e-3),
    "stop": Annulus((1e-3, 0, 0), 3e-3, 8e-3),
    "coarse grating": Grating((0, 1, 0), 1e-6, orders=(-1, 1), amplitudes=(0.5, 0.5j)),
    "other colour": zone_plate((0, 0, 0), (0, 0, 1), 0.2, design=500e-9, orders=(0, 1, 2)),
}
EVERY = LOSSLESS | LOSSY


@pytest.mark.parametrize("name", LOSSLESS)
@settings(deadline=None, max_examples=8)
@given(seed=seeds)
def test_lossless_elements_keep_the_power(name, seed):
    rays = shower(seed, wavelength=LAMBDA, index=1.2)
    branches = LOSSLESS[name].act(rays)
    total = sum(power(branch.field) for branch in branches)
    assert np.abs(total / power(rays.field) - 1.0).max() < ROUNDING


@pytest.mark.parametrize("name", EVERY)
@settings(deadline=None, max_examples=8)
@given(seed=seeds)
def test_what_leaves_an_element_is_light(name, seed):
    element, rays = EVERY[name], shower(seed, wavelength=LAMBDA)
    branches = element.act(rays)
    assert len(branches) == element.branches
    assert (sum(power(b.field) for b in branches) <= power(rays.field) * (1.0 + ROUNDING)).all()
    for branch in branches:
        field, direction, point, path = outcome(rays, branch)
        assert np.isfinite(path).all()
        assert np.abs(np.linalg.norm(direction, axis=1) - 1.0).max() < ROUNDING
        assert np.abs(point[:, 2]).max() <= ROUNDING
        lean = np.abs(np.einsum("ij,ij->i", field, direction))
        assert (lean <= ROUNDING * np.sqrt(power(rays.field))).all()
        back = direction[:, 2] * rays.direction[:, 2] < 0.0
        assert (back == getattr(element, "reflects", False)).all()


@pytest.mark.parametrize("name", EVERY)
def test_one_number_fares_like_a_vector(name):
    element, rays = EVERY[name], shower(3, wavelength=LAMBDA)
    if element.polarised:
        with pytest.raises(ValueError, match=r"expected polarised light, fields \(n, 3\), got shape \(12,\)"):
            element.act(replace(rays, field=rays.field[:, 0]))
        return
    for plain, vector in zip(
        element.act(shower(3, polarised=False, wavelength=LAMBDA)), element.act(rays), strict=True
    ):
        for one, other in zip(outcome(rays, plain)[1:], outcome(rays, vector)[1:], strict=True):
            assert np.array_equal(one, other)
        given_power = power(shower(3, polarised=False).field)
        kept, gone = power(plain.field) / given_power, power(vector.field) / power(rays.field)
        assert np.abs(kept - gone).max() < ROUNDING


@pytest.mark.parametrize("name", EVERY)
def test_elements_move_with_their_surface(name):
    element, rays = EVERY[name], shower(5, wavelength=LAMBDA)
    offset, turn = np.array([0.3, -0.2, 0.4]), rotation((1, 2, 3), 0.7)
    there = replace(
        rays,
        point=rays.point @ turn.T + offset,
        direction=rays.direction @ turn.T,
        normal=rays.normal @ turn.T,
        field=rays.field @ turn.T,
    )
    moved = element.moved(offset, turn)
    assert type(moved) is type(element)
    for here, away in zip(element.act(rays), moved.act(there), strict=True):
        field, direction, point, path = outcome(rays, here)
        turned = outcome(there, away)
        assert np.abs(turned[0] - field @ turn.T).max() < TURNED
        assert np.abs(turned[1] - direction @ turn.T).max() < TURNED
        assert np.abs(turned[2] - (point @ turn.T + offset)).max() < TURNED
        assert np.abs(turned[3] - path).max() < TURNED
    for mine, same in zip(element.act(rays), element.moved().act(rays), strict=True):
        assert np.array_equal(mine.field, same.field)


@pytest.mark.parametrize("name", EVERY)
def test_rays_do_not_know_of_each_other(name):
    element, rays = EVERY[name], shower(7, wavelength=LAMBDA)
    part = replace(
        rays, **{key: getattr(rays, key)[5:8] for key in ("point", "direction", "normal", "index", "field")}
    )
    for whole, few in zip(element.act(rays), element.act(part), strict=True):
        for all_of, some in zip(outcome(rays, whole), outcome(part, few), strict=True):
            assert np.array_equal(all_of[5:8], some)


@pytest.mark.parametrize("name", EVERY)
def test_elements_travel_to_other_processes(name):
    element, rays = EVERY[name], shower(9, wavelength=LAMBDA)
    element.act(rays)
    twin = pickle.loads(pickle.dumps(element))
    assert hash(element) == hash(element)
    for mine, its in zip(element.act(rays), twin.act(rays), strict=True):
        assert np.array_equal(mine.field, its.field)


@pytest.mark.parametrize("name", [name for name, element in EVERY.items() if element.chromatic])
def test_chromatic_elements_ask_for_the_wavelength(name):
    with pytest.raises(ValueError, match="expected a wavelength, which it depends on, got None"):
        EVERY[name].act(shower(0))


@pytest.mark.parametrize("name", [name for name, element in EVERY.items() if not element.chromatic])
def test_the_others_do_without(name):
    for lone, told in zip(
        EVERY[name].act(shower(0)), EVERY[name].act(shower(0, wavelength=LAMBDA)), strict=True
    ):
        assert np.array_equal(lone.field, told.field)


@settings(deadline=None, max_examples=30)
@given(seed=seeds)
def test_carrying_turns_by_the_least_rotation(seed):
    one, other = shower(seed), shower(seed + 1)
    before, after = one.direction, other.direction * np.sign(one.direction[:, 2:] * other.direction[:, 2:])
    field = rotate_fields(one.field, before, after)
    for row in range(len(field)):
        axis = np.cross(before[row], after[row])
        angle = np.arctan2(np.linalg.norm(axis), before[row] @ after[row])
        assert np.abs(field[row] - rotation(axis, angle) @ one.field[row]).max() < 16 * ROUNDING


def test_an_axis_along_the_ray_has_no_direction_across():
    slanted = np.array([[0.6, 0.0, 0.8]])
    assert np.array_equal(transverse_axis(np.array([0.6, 0.0, 0.8]), slanted), np.zeros((1, 3)))
    seen = transverse_axis(np.array([0.0, 0.0, 1.0]), slanted)
    assert seen[0] == pytest.approx([-0.8, 0.0, 0.6], rel=ROUNDING)
    with pytest.raises(ValueError, match="comb: expected a direction along the surface, got its normal"):
        tangential_axis(np.array([0.6, 0.0, 0.8]), slanted, "comb")


def test_a_path_that_is_even_bends_nothing():
    rays = shower(2)
    direction, possible = deflect(rays, np.zeros((12, 3)), False)
    assert np.abs(direction - rays.direction).max() < ROUNDING
    mirrored, _ = deflect(rays, np.zeros((12, 3)), True)
    assert np.abs(mirrored - rays.direction * [1.0, 1.0, -1.0]).max() < ROUNDING
    assert possible.all()


def test_an_annulus_lets_light_pass_between_its_radii():
    radius = np.array([0.0, 0.9e-3, 1e-3, 1.5e-3, 2e-3, 2.1e-3])
    point = np.column_stack([radius, np.zeros(6), np.zeros(6)])
    stop = Annulus((0, 0, 0), 1e-3, 2e-3)
    (branch,) = stop.act(meeting(np.tile([0.1, 0.0, 1.0], (6, 1)), point))
    assert branch.field.tolist() == [0, 0, 1, 1, 1, 0]
    assert branch.direction is branch.point is branch.path is None
    # the distance is that within the plane, wherever along the normal the centre is
    (lifted,) = Annulus((0, 0, 5.0), 0.0, 2e-3).act(meeting(np.tile([0.1, 0.0, 1.0], (6, 1)), point))
    assert lifted.field.tolist() == [1, 1, 1, 1, 1, 0]
    (disc,) = Annulus((0, 0, 0), 1e-3, np.inf).act(meeting(np.tile([0.1, 0.0, 1.0], (6, 1)), point))
    assert disc.field.tolist() == [0, 0, 1, 1, 1, 1]


@pytest.mark.parametrize("radii", [(1e-3, 1e-3), (-1e-3, 1e-3), (np.nan, 1.0), (0.0, np.nan), ("0", 1.0)])
def test_radii_that_are_none_are_refused(radii):
    with pytest.raises(ValueError, match="Annulus radii: expected 0 <= inner < outer in metres, got"):
        Annulus((0, 0, 0), *radii)


def test_an_ideal_lens_keeps_what_comes_through_its_centre():
    rays = shower(4, index=1.5)
    (branch,) = IdealLens((0, 0, 0), (0, 0, 1), 0.05, 0.2).act(replace(rays, point=0.0 * rays.point))
    assert np.abs(branch.direction - rays.direction).max() < ROUNDING
    assert np.array_equal(branch.path, np.zeros(12))


@settings(deadline=None, max_examples=30)
@given(seed=seeds, f=st.sampled_from([0.05, -0.05, 0.3]), s=st.sampled_from([np.inf, 0.05, 0.12, -0.07, 1e9]))
def test_an_ideal_lens_takes_light_back_the_way_it_came(seed, f, s):
    lens, rays = IdealLens((1e-3, 0, 0), (0, 0, 1), f, s), shower(seed)
    (there,) = lens.act(rays)
    (back,) = lens.act(replace(rays, direction=-there.direction, field=there.field))
    assert np.abs(back.direction + rays.direction).max() < ROUNDING
    assert np.abs(back.path - there.path).max() < ROUNDING * 0.02  # of the offset from the centre
    assert np.abs(back.field - rays.field).max() < 8 * ROUNDING


def test_an_ideal_lens_leaves_rays_in_its_plane_out():
    (branch,) = IdealLens((0, 0, 0), (1, 0, 0), 0.05).act(meeting((0.0, 0.0, 1.0), (0.0, 1e-3, 0.0)))
    assert branch.field.tolist() == [0.0]
    assert np.array_equal(branch.direction, [[0.0, 0.0, 1.0]])
    assert branch.path.tolist() == [0.0]


@pytest.mark.parametrize("f", [np.inf, np.nan, "1", None, True])
def test_focal_lengths_are_numbers(f):
    with pytest.raises(ValueError, match="IdealLens focal length: expected a finite number, got"):
        IdealLens((0, 0, 0), (0, 0, 1), f)


def test_focal_lengths_are_not_0():
    with pytest.raises(ValueError, match="IdealLens focal length: expected a length other than 0, got 0"):
        IdealLens((0, 0, 0), (0, 0, 1), 0.0)


@pytest.mark.parametrize("s", [0.0, np.nan, "inf", None])
def test_object_distances_are_lengths(s):
    with pytest.raises(ValueError, match="IdealLens object distance: expected a length other than 0, got"):
        IdealLens((0, 0, 0), (0, 0, 1), 0.1, s)
