"""Rays in a lattice are soon lost to rounding; the wave that they lie on is not.

Where a ray of float64 leaves after many bounces, a true ray leaves too, whose start is less than a
rounding away; their optical paths are the same.
"""

import math

import mpmath
import numpy as np
import pytest
import shadowing

import fringetrace as ft
from fringetrace.accuracy.path_errors import rounding

# Roundings of coordinates of some 100 nm, in metres: 1.3e-23 each.
ROUNDING = 2.0**-53 * 100e-9
# Some roundings of a path of 5 um, that to the line included, which light reaches aslant.
PATH = 32 * 2.0**-53 * 5e-6


@pytest.mark.parametrize(("slope", "bounces"), [(1e-4, 5), (1e-8, 10), (1e-12, 15), (1e-16, 21)])
def test_the_field_stays_right_when_rays_do_not(slope, bounces):
    row = shadowing.compared(slope)
    assert row.bounces == bounces
    assert row.rays > 10
    # the start that is meant is off by no more than a rounding of it
    assert row.start < 2 * ROUNDING
    # and its path is that found
    assert row.wave * shadowing.WAVE < PATH
    # while rays go astray by 6.46 a bounce
    assert 1e-1 < row.aside / (ROUNDING * 6.4606**bounces) < 1e3


def test_off_the_true_ray_the_path_goes_along_the_wave():
    """Path less slope times way aside: of second order, as the wave is curved."""
    far, near = shadowing.compared(1e-14), shadowing.compared(1e-12)
    assert near.aside > 0.1e-9
    assert near.tangent < 1e-7
    order = math.log(far.tangent / near.tangent) / math.log(far.aside / near.aside)
    assert order == pytest.approx(2.0, abs=0.7)


@pytest.mark.parametrize("slope", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14])
def test_single_rays_lie_within_their_bounds(slope):
    row = shadowing.compared(slope)
    assert row.last < row.bound
    # and are not promised far too much
    assert row.bound < 100 * row.last


@pytest.mark.parametrize("bounces", [1, 2, 4, 6])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_place_direction_and_path_lie_within_their_bounds(bounces):
    rng = np.random.default_rng(3)
    rays = 40
    height = shadowing.LIFT + rng.uniform(-1e-12, 1e-12, rays)
    start = np.stack([np.zeros(rays), np.zeros(rays), height], axis=1)
    direction = np.stack([np.ones(rays), np.zeros(rays), rng.uniform(-1e-6, 1e-6, rays)], axis=1)
    paths = ft.trace(shadowing.discs(), ft.Rays(start, direction), max_bounces=bounces, record=True)
    assert (paths.bounces == bounces).all()
    off = []
    with mpmath.workdps(50):
        for row in range(rays):
            true = shadowing.hits(shadowing.mp(start[row]), shadowing.mp(direction[row]), bounces)[-1]
            found = paths.origin[row], paths.direction[row], paths.length[row : row + 1]
            wanted = true[0], true[1], [true[2]]
            pairs = [zip(shadowing.mp(f), w, strict=True) for f, w in zip(found, wanted, strict=True)]
            off.append([float(mpmath.sqrt(sum((a - b) ** 2 for a, b in pair))) for pair in pairs])
    bounds = ft.bounds(paths)
    for true, bound in zip(
        np.transpose(off), (bounds.position, bounds.direction, bounds.length), strict=True
    ):
        assert (true <= bound).all()
        assert bound.mean() < 60 * true.mean()


def test_the_residual_of_a_lost_ray_is_a_rounding():
    """What `rounding` measures does not grow with the ray's error: the path is a true one nearby."""
    start, direction = [(0.0, 0.0, shadowing.LIFT)], [(1.0, 0.0, 1e-16)]
    paths = ft.trace(shadowing.discs(), ft.Rays(start, direction), max_bounces=40, record=True)
    assert paths.bounces[0] > 15
    assert ft.bounds(paths).position[0] > 1e-10
    # a dozen roundings a bounce, of the path and of the form
    assert abs(rounding(paths)[0]) < 12 * paths.bounces[0] * 20 * ROUNDING
