"""Launching and sorting rays, and reflecting them, one by one."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import fringetrace as ft
from fringetrace.core.vectors import frame, unit
from fringetrace.optics.interfaces import reflect
from fringetrace.tracing import kernels_boundary, kernels_rays
from fringetrace.tracing.rays import launch

EPS = float(np.finfo(np.float64).eps)
seeds = st.integers(0, 2**32 - 1)


@given(rays=st.lists(st.integers(0, 6), max_size=60), first=st.integers(0, 1000))
def test_ends_are_sorted_by_ray_and_stay_in_order(rays, first):
    ray = np.array(rays, dtype=np.int64) + first
    assert np.array_equal(kernels_rays.sort(ray, first, 7), np.argsort(ray, kind="stable"))


@given(seed=seeds)
def test_reflections_are_those_of_the_formula(seed):
    rng = np.random.default_rng(seed)
    direction, normal = unit(rng.normal(size=(2, 3)))
    expected = reflect(direction[None], normal[None])[0]
    for steps in (1, 8):  # the eighth is brought back to length 1
        after = kernels_boundary.reflected(*direction, *normal, direction @ normal, steps)
        np.testing.assert_allclose(after, expected, rtol=0, atol=4 * EPS)


def test_a_direction_keeps_its_length_over_many_reflections():
    rng = np.random.default_rng(3)
    direction = np.array([0.6, 0.0, 0.8])
    for steps, normal in enumerate(unit(rng.normal(size=(5000, 3)))):
        direction = np.array(kernels_boundary.reflected(*direction, *normal, direction @ normal, steps))
    assert np.linalg.norm(direction) == pytest.approx(1.0, rel=16 * EPS, abs=0)


@pytest.mark.parametrize(("start", "stop"), [(0, 12), (0, 1), (5, 9), (11, 12), (4, 4)])
def test_a_beam_starts_at_the_centres_of_its_cells(start, stop):
    beam = ft.Beam((1.0, 2.0, 3.0), (1, 1, 0), (0, 0, 1), (4.0, 3.0), (3, 4))
    u, v, n = frame(beam.direction, beam.up, "Beam")
    rays = launch(beam, start, stop)
    number = np.arange(start, stop)
    x, y = number % 4 - 1.5, number // 4 - 1.0
    expected = beam.centre + x[:, None] * u + y[:, None] * v
    np.testing.assert_allclose(rays.origin, expected, rtol=0, atol=8 * EPS)
    assert np.array_equal(rays.direction, np.broadcast_to(n, (stop - start, 3)))
