"""Circles that may touch, but not overlap."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fringetrace.geometry.circles import check_circles_apart


@given(seed=st.integers(0, 2**32 - 1), scale=st.floats(-9, 3).map(lambda power: 10.0**power))
def test_a_grid_of_any_scale_may_touch_but_not_overlap(seed, scale):
    rng = np.random.default_rng(seed)
    centres = np.stack(np.meshgrid(np.arange(4.0), np.arange(3.0)), axis=-1).reshape(-1, 2) * scale
    radii = np.full(12, 0.5 * scale * (1.0 - 1e-12))
    check_circles_apart(centres, radii, "rods")
    grown = int(rng.integers(12))
    radii[grown] *= 1.01
    with pytest.raises(ValueError, match=rf"rods: expected them apart, got .*\b{grown}\b.* overlapping by "):
        check_circles_apart(centres, radii, "rods")


def test_a_small_circle_inside_a_large_one_overlaps():
    with pytest.raises(ValueError, match="rods: expected them apart, got 0 and 1 overlapping by 2"):
        check_circles_apart(np.array([[0.0, 0.0], [0.1, 0.0]]), np.array([2.0, 0.1]), "rods")
