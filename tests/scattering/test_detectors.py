"""Cones, cells and pixels: solid angles, and who falls into them."""

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import degree
from fringetrace.scattering.detectors import (
    Cells,
    Cones,
    Pixels,
    checked_angles,
    far_lengths,
    fraunhofer_paths,
    sides,
    towards,
)

ORIGIN = np.zeros(3)


def scattered(count=2000, seed=1):
    """Paths that leave a small ball in all directions; one that meets nothing."""
    rng = np.random.default_rng(seed)
    scene = ft.Scene([ft.Surface(ft.shapes.icosphere(1e-3, 3), ft.Mirror())])
    place = rng.uniform(-0.6e-3, 0.6e-3, (count, 2))
    place[0] = 2e-3
    origin = np.insert(place, 2, 1.0, axis=1)
    return ft.trace(scene, ft.Rays(origin, np.tile([0.0, 0.0, -1.0], (count, 1))))


def test_directions():
    assert towards(30 * degree, 0.0) == pytest.approx([0.5, 0.0, np.sqrt(0.75)])
    assert towards(-30 * degree, 90 * degree) == pytest.approx([0.0, -0.5, np.sqrt(0.75)])
    assert towards(np.zeros((2, 1)), np.zeros(3)).shape == (2, 3, 3)


@pytest.mark.parametrize("travel", [1.0, -1.0])
def test_s_lies_flat_and_p_beside_it(travel):
    """A right-handed frame about the way of light; s is along y in the plane of x and z."""
    theta, phi = np.array([-0.4, 0.0, 0.9]), np.array([0.0, 0.3, 2.0])
    axis = towards(theta, phi)
    frame = sides(axis, phi, travel)
    assert frame[0, 0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-15)
    assert frame[:, 0, 2] == pytest.approx(0.0, abs=1e-15)
    right = np.concatenate([frame, travel * axis[:, None]], axis=1)
    assert right @ right.transpose(0, 2, 1) == pytest.approx(np.tile(np.eye(3), (3, 1, 1)), abs=1e-15)
    assert np.linalg.det(right) == pytest.approx(1.0)  # p = way x s


def test_cells_fill_the_hemisphere():
    cells = Cells(5, 7)
    assert cells.solid_angle.sum() == pytest.approx(2.0 * np.pi, rel=1e-14)
    assert cells.projected.sum() == pytest.approx(np.pi, rel=1e-14)
    paths = scattered()
    rows = np.concatenate([rows for rows, _ in cells.arrivals(paths, ORIGIN)])
    up = np.flatnonzero((paths.direction[:, 2] > 0.0) & (paths.bounces > 0))
    assert len(up) > 1000
    assert np.array_equal(np.sort(rows), up)
    for i, (some, _) in enumerate(cells.arrivals(paths, ORIGIN)):
        x, y, z = paths.direction[some].T
        assert (abs(np.arccos(z) - cells.theta[i // 7]) <= 9.0 * degree + 1e-12).all()
        assert (abs(np.arctan2(y, x) % (2 * np.pi) - cells.phi[i % 7]) <= np.pi / 7 + 1e-12).all()


def test_cones_hold_what_is_near():
    paths, cones = scattered(), Cones([-20 * degree, 20 * degree], 5 * degree, [0.0, 1.0])
    assert cones.solid_angle == pytest.approx(2 * np.pi * (1 - np.cos(5 * degree)), rel=1e-12)
    axes = towards(cones.theta[:, None], cones.phi).reshape(-1, 3)
    seen = 0
    for (rows, length), axis in zip(cones.arrivals(paths, ORIGIN), axes, strict=True):
        near = (paths.direction @ axis > np.cos(5 * degree)) & (paths.bounces > 0)
        assert np.array_equal(rows, np.flatnonzero(near))
        assert length == pytest.approx(paths.length[rows] - paths.origin[rows] @ axis, abs=1e-15)
        seen += len(rows)
    assert seen > 20


def test_a_cone_s_projected_angle_is_its_area_on_the_ground():
    """Against a sum over a fine grid of the hemisphere."""
    cone, fine = Cones([40 * degree], 10 * degree), Cells(400, 800)
    inside = towards(fine.theta[:, None], fine.phi) @ towards(40 * degree, 0.0) > np.cos(10 * degree)
    assert fine.projected[inside].sum() == pytest.approx(cone.projected.item(), rel=2e-3)  # cells on its rim


def test_a_far_pixel_sees_what_a_pyramid_of_directions_holds():
    """Rays from within 1 mm at a distance of 1 km."""
    paths, theta = scattered(), np.array([-10, 15]) * degree
    pixels = Pixels(theta, 1e3, 4e2)
    assert pixels.solid_angle == pytest.approx(0.16)
    assert pixels.projected[:, 0] == pytest.approx(0.16 * np.cos(theta))
    for (rows, length), angle in zip(pixels.arrivals(paths, ORIGIN), theta, strict=True):
        axis = towards(angle, 0.0)
        ahead = paths.direction @ axis
        sides = abs(paths.direction @ towards(angle + 90 * degree, 0.0)), abs(paths.direction[:, 1])
        inside = (np.maximum(*sides) < 0.2 * ahead) & (paths.bounces > 0)
        assert np.array_equal(rows, np.flatnonzero(inside))
        assert len(rows) > 5
        straight = (1e3 - paths.origin[rows] @ axis) / ahead[rows]
        assert length == pytest.approx(paths.length[rows] + straight, rel=1e-12)


def test_everything_goes_everywhere():
    paths = scattered(50)
    both = list(fraunhofer_paths(paths, Cones([0.0, 1.0], 0.1), ORIGIN))
    assert [len(rows) for rows, _ in both] == [49, 49]
    assert np.array_equal(both[1][1], far_lengths(paths, both[1][0], ORIGIN, towards(1.0, 0.0)))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Cones([0.0], 0.0), "Cones half_angle: expected radians between 0 and pi/2, got 0.0"),
        (lambda: Cones([1.5], 0.1), "Cones theta: expected angles below 1.4708 rad, got up to 1.5"),
        (lambda: Cones([], 0.1), "Cones theta: expected finite angles"),
        (lambda: Cones([0.0], 0.1, [np.nan]), "Cones phi: expected finite angles"),
        (lambda: Cells(0, 3), "Cells rings: expected a whole number from 1, got 0"),
        (lambda: Cells(3, 1.5), "Cells sectors: expected a whole number from 1, got 1.5"),
        (lambda: Pixels([0.0], -1.0, 1.0), "Pixels distance: expected a positive length in metres, got -1.0"),
        (lambda: Pixels([0.0], 1.0, np.inf), "Pixels width: expected a positive length in metres, got inf"),
        (lambda: Pixels([1.6], 1.0, 1.0), "Pixels theta: expected angles below 1.5708 rad"),
        (lambda: checked_angles([[0.0]], "those"), r"those: expected finite angles of shape \(n,\)"),
    ],
)
def test_what_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
