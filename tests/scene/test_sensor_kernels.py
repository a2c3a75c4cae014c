"""Where rays fall on the CCD."""

import numpy as np
from hypothesis import given, strategies as st

import fringetrace as ft
from fringetrace.core.vectors import frame
from fringetrace.scene import sensor_kernels
from fringetrace.scene.sensor import screen

EPS = float(np.finfo(np.float64).eps)
seeds = st.integers(0, 2**32 - 1)


@given(seed=seeds)
def test_a_place_on_the_ccd_is_counted_from_its_corner(seed):
    rng = np.random.default_rng(seed)
    normal, up = rng.normal(size=(2, 3))
    ccd = ft.CCD(rng.normal(size=3), normal, up, 0.25, (6, 10))
    u, v, _ = frame(ccd.normal, ccd.up, "CCD")
    row, column = rng.uniform(0, [6, 10])
    point = ccd.centre + (column - 5) * 0.25 * u + (row - 3) * 0.25 * v
    pixel = np.empty((1, 2))
    sensor_kernels.locate(screen(ccd), ccd.pitch, *ccd.shape, point[None], pixel)
    np.testing.assert_allclose(pixel, [[row, column]], rtol=0, atol=1e-12)
