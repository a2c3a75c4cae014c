"""The loops that find hits, one by one."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fringetrace.core.vectors import unit
from fringetrace.tracing.intersect import kernels

EPS = float(np.finfo(np.float64).eps)
seeds = st.integers(0, 2**32 - 1)


@given(seed=seeds, lean=st.floats(1e-9, 1), side=st.sampled_from([1.0, -1.0]))
def test_a_restart_is_one_shift_above_the_face_on_the_side_that_the_ray_leaves(seed, lean, side):
    rng = np.random.default_rng(seed)
    normal, other = unit(rng.normal(size=(2, 3)))
    across = unit(np.cross(normal, other)[None])[0]
    direction = side * lean * normal + np.sqrt(1 - lean * lean) * across
    start = rng.uniform(-1, 1, 3)
    leaving = direction @ normal
    moved = np.array(kernels.restart(*start, *direction, *normal, leaving, 1.0 / abs(leaving))) - start
    assert moved @ normal == pytest.approx(side * kernels.SHIFT, rel=1e-8)
    # no farther than the steepest that counts as grazing
    assert np.linalg.norm(moved) <= 1.01 * kernels.SHIFT / kernels.GRAZING
    if abs(lean) > 1.01 * kernels.GRAZING:  # on the ray itself
        np.testing.assert_allclose(np.cross(moved, direction), 0.0, rtol=0, atol=8 * EPS)
