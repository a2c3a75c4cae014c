"""The plane of the CCD: where rays cross it, in which pixel, and its parts."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import fringetrace as ft
from fringetrace.core.vectors import frame, unit
from fringetrace.scene import sensor, sensor_kernels

seeds = st.integers(0, 2**32 - 1)
# A few dozen roundings of a place some 10 pixels from the corner.
PLACE = 1e-12


def camera(rng, focus=0.0):
    """A CCD anywhere, of any size from a micrometre to a kilometre."""
    scale = 10.0 ** rng.uniform(-6, 3)
    normal, up = rng.normal(size=(2, 3))
    shape = tuple(rng.integers(1, 20, 2).tolist())
    return ft.CCD(rng.normal(size=3) * scale, normal, up, 0.25 * scale, shape, focus * scale), scale


def on_plane(ccd, pixel):
    """Points at places in pixels, in the plane of focus."""
    u, v, n = frame(ccd.normal, ccd.up, "CCD")
    row, column = pixel.T
    rows, columns = ccd.shape
    offset = (column - columns / 2)[:, None] * u + (row - rows / 2)[:, None] * v
    return ccd.centre + ccd.pitch * offset, n


@given(seed=seeds)
def test_a_place_is_counted_from_the_corner(seed):
    rng = np.random.default_rng(seed)
    ccd, _ = camera(rng)
    pixel = rng.uniform(0, ccd.shape, (5, 2))
    point, _ = on_plane(ccd, pixel)
    np.testing.assert_allclose(sensor.pixels(ccd, point), pixel, rtol=0, atol=PLACE)


@given(seed=seeds, focus=st.floats(-3.0, 3.0))
def test_rays_cross_where_they_are_aimed(seed, focus):
    """Rays through points of the chip, carried back to the plane of focus; from in front and behind."""
    rng = np.random.default_rng(seed)
    ccd, scale = camera(rng, focus)
    chip, n = on_plane(ccd, rng.uniform(-0.5, 1.5, (20, 2)) * ccd.shape)
    direction = unit(rng.normal(size=(20, 3)))
    direction[np.abs(direction @ n) < 0.1] = -n
    way = rng.uniform(0.1, 10.0, 20) * scale
    start = chip - way[:, None] * direction
    reach, hit = sensor.cross(ccd, start, direction)
    front = direction @ n < 0.0
    assert np.isinf(reach[~front]).all()
    assert not hit[~front].any()
    in_focus = (way + ccd.focus / (direction @ n))[front]
    np.testing.assert_allclose(reach[front], in_focus, rtol=0, atol=100 * PLACE * scale)
    # inside or not as the point in focus is
    place = sensor.pixels(ccd, start[front] + reach[front, None] * direction[front])
    beside = np.abs(place / ccd.shape - 0.5).max(axis=1) - 0.5
    clear = np.abs(beside) > 100 * PLACE
    np.testing.assert_array_equal(hit[front][clear], beside[clear] < 0.0)


@given(seed=seeds)
def test_rays_that_start_behind_or_run_along_the_plane_do_not_cross(seed):
    rng = np.random.default_rng(seed)
    ccd, scale = camera(rng)
    u, _, n = ccd.axes
    away = np.stack([ccd.centre - scale * n, ccd.centre + scale * n, ccd.centre + scale * n])
    reach, hit = sensor.cross(ccd, away, np.stack([-n, n, u]))
    assert not hit[:2].any()
    assert np.isinf(reach[:2]).all()
    assert reach[2] > 1e9 * scale  # along it, but for rounding
    assert not hit[2]


def test_a_point_on_a_border_is_in_one_pixel():
    ccd = ft.CCD((0, 0, 0), (0, 0, 1), (0, 1, 0), 1.0, (2, 2))
    x = np.array([-1.0, -0.5, 0.0, np.nextafter(1.0, 0.0), 1.0])
    origin = np.stack([x, 0.5 + 0 * x, 1 + 0 * x], axis=1)
    _, hit = sensor.cross(ccd, origin, np.tile([0.0, 0.0, -1.0], (5, 1)))
    # u = normal x up runs along -x: columns are half open the other way round
    np.testing.assert_array_equal(hit, [False, True, True, True, True])
    at = sensor.pixel_indices(ccd, sensor.pixels(ccd, origin))
    np.testing.assert_array_equal(at[:, 1], [1, 1, 1, 0, 0])
    np.testing.assert_array_equal(at[:, 0], 1)


@given(seed=seeds)
def test_a_ray_lands_as_arrays_of_rays_do(seed):
    """The kernel of the tracer, which stops at the first hit, and that of arrays."""
    rng = np.random.default_rng(seed)
    ccd, scale = camera(rng, rng.uniform(-2, 2))
    origin = ccd.centre + 5.0 * scale * rng.normal(size=(10, 3))
    direction = unit(ccd.centre + scale * rng.normal(size=(10, 3)) - origin)
    reach, hit = sensor.cross(ccd, origin, direction)
    screen = sensor.screen(ccd)

    def lands(path):
        rays = zip(origin, direction, strict=True)
        return [sensor_kernels.lands.py_func(screen, path, *start, *along) for start, along in rays]

    np.testing.assert_array_equal(lands(np.inf), np.where(hit, reach, np.inf))
    assert np.isinf(lands(1e-9 * scale)).all()


@given(seed=seeds)
def test_a_part_of_a_ccd_has_its_pixels_where_they_were(seed):
    rng = np.random.default_rng(seed)
    ccd, _ = camera(rng)
    ccd = ft.CCD(ccd.centre, ccd.normal, ccd.up, ccd.pitch, (12, 16), ccd.focus)
    row = int(rng.integers(0, 8))
    part = sensor.crop(ccd, row, 4, 16)
    point, _ = on_plane(ccd, rng.uniform(0, ccd.shape, (5, 2)))
    np.testing.assert_allclose(sensor.pixels(part, point), sensor.pixels(ccd, point) - [row, 0], atol=PLACE)
    binned = sensor.crop(ccd, 0, 12, 16, binning=2)
    assert binned.shape == (6, 8)
    np.testing.assert_allclose(sensor.pixels(binned, point), sensor.pixels(ccd, point) / 2, atol=PLACE)


@pytest.mark.parametrize("shape", [(1, 1), (3, 4)])
def test_centres_of_pixels_are_about_the_middle(shape):
    x, y = sensor.pixel_centres(shape, 2.0)
    assert (len(y), len(x)) == shape
    assert x.sum() == y.sum() == 0.0
    assert np.all(np.diff(x) == 2.0)
