"""The batch of rays, and beams launched as one."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

import fringetrace as ft
from fringetrace.tracing.rays import launch

# Positions are sums of three products of numbers of the size of the beam.
ROUNDING = 16 * float(np.finfo(np.float64).eps)

ORIGIN = np.arange(12.0).reshape(4, 3)
WAY = np.array([[0.0, 0.0, 2.0], [3.0, 0.0, 4.0], [1e-200, 0.0, 0.0], [0.0, -1e200, 0.0]])
UNIT = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def test_rays_and_their_defaults():
    rays = ft.Rays(ORIGIN, WAY)
    assert len(rays) == 4
    np.testing.assert_array_equal(rays.origin, ORIGIN)
    np.testing.assert_allclose(rays.direction, UNIT, rtol=0, atol=ROUNDING)
    np.testing.assert_array_equal(rays.length, np.zeros(4))
    np.testing.assert_array_equal(rays.amplitude, np.ones(4))
    assert rays.amplitude.dtype == np.complex128
    assert rays.area is None
    assert rays.passes == ()
    np.testing.assert_allclose(WAY[1], [3.0, 0.0, 4.0])  # the input is left alone


def test_rays_with_everything():
    rays = ft.Rays(
        ORIGIN.tolist(), WAY, length=[1, 2, 3, 4], amplitude=[1j, 2, 3, 4], area=0.5, passes="splitter"
    )
    np.testing.assert_array_equal(rays.length, [1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(rays.amplitude, [1j, 2, 3, 4])
    assert rays.area == 0.5
    assert rays.passes == ("splitter",)


def test_no_rays_at_all():
    rays = ft.Rays(np.empty((0, 3)), np.empty((0, 3)))
    assert len(rays) == len(rays.length) == len(rays.amplitude) == 0


def test_part():
    rays = ft.Rays(ORIGIN, WAY, length=[1, 2, 3, 4], amplitude=[1j, 2, 3, 4], area=0.5, passes=["splitter"])
    part = rays.part(1, 3)
    assert len(part) == 2
    for name in ("origin", "direction", "length", "amplitude"):
        np.testing.assert_array_equal(getattr(part, name), getattr(rays, name)[1:3])
        assert np.shares_memory(getattr(part, name), getattr(rays, name))
    assert (part.area, part.passes) == (0.5, ("splitter",))
    assert len(rays.part(3, 100)) == 1
    assert len(rays.part(4, 8)) == 0


@pytest.mark.parametrize("name", ["origin", "direction"])
def test_rows_of_three(name):
    good = {"origin": ORIGIN, "direction": WAY}
    for bad in (np.zeros((4, 2)), np.zeros(3), np.zeros((2, 2, 3)), 5.0):
        with pytest.raises(ValueError, match=rf"Rays {name}: expected shape \(n, 3\), got"):
            ft.Rays(**{**good, name: bad})
    for bad in ("abc", [[1, 2, object()]], [[1, 2, 3], [1, 2]]):
        with pytest.raises(ValueError, match=rf"Rays {name}: expected numbers of shape \(n, 3\), got"):
            ft.Rays(**{**good, name: bad})
    for bad in (math.nan, math.inf):
        rows = np.ones((4, 3))
        rows[2:, 1] = bad
        message = (
            rf"Rays {name}: expected finite numbers, got NaN or infinity in 2 of 4 rays \(first: ray 2\)"
        )
        with pytest.raises(ValueError, match=message):
            ft.Rays(**{**good, name: rows})


def test_one_direction_for_each_origin():
    with pytest.raises(ValueError, match="Rays direction: expected one for each of 4 origins, got 3"):
        ft.Rays(ORIGIN, WAY[:3])


def test_directions_have_a_length():
    way = WAY.copy()
    way[2] = 0.0
    with pytest.raises(
        ValueError, match=r"Rays direction: expected a direction, got length 0 \(first: ray 2\)"
    ):
        ft.Rays(ORIGIN, way)


@pytest.mark.parametrize("name", ["length", "amplitude"])
def test_columns(name):
    for bad in (np.ones(3), np.ones((4, 1)), 1.0):
        with pytest.raises(ValueError, match=rf"Rays {name}: expected shape \(4,\), got"):
            ft.Rays(ORIGIN, WAY, **{name: bad})
    for bad in (math.nan, math.inf):
        with pytest.raises(ValueError, match=f"Rays {name}: expected finite numbers, got NaN or infinity"):
            ft.Rays(ORIGIN, WAY, **{name: [1.0, 2.0, bad, 4.0]})
    for bad in ("abc", [1.0, 2.0, object(), 3.0]):
        with pytest.raises(ValueError, match=rf"Rays {name}: expected numbers of shape \(n,\), got"):
            ft.Rays(ORIGIN, WAY, **{name: bad})


@pytest.mark.parametrize("area", [0.0, -1.0, math.nan, math.inf, "1"])
def test_areas_are_positive(area):
    with pytest.raises(ValueError, match=r"Rays area: expected a positive area in m\^2, got"):
        ft.Rays(ORIGIN, WAY, area=area)


def beam(**changes):
    defaults = {
        "centre": (0.1, 0.2, 0.3),
        "direction": (0, 0, -1),
        "up": (0, 1, 0),
        "size": (6.0, 2.0),
        "shape": (4, 3),
    }
    return ft.Beam(**{**defaults, **changes})


def test_launched_grid():
    rays = launch(beam(passes=["splitter"]))
    # looking along -z with y up, x is to the right: rows run along y, columns along x
    x, y = np.meshgrid([-2.0, 0.0, 2.0], [-0.75, -0.25, 0.25, 0.75])
    expected = np.column_stack([0.1 + x.ravel(), 0.2 + y.ravel(), np.full(12, 0.3)])
    np.testing.assert_allclose(rays.origin, expected, rtol=0, atol=3 * ROUNDING)
    np.testing.assert_array_equal(rays.direction, np.tile([0.0, 0.0, -1.0], (12, 1)))
    np.testing.assert_array_equal(rays.length, np.zeros(12))
    np.testing.assert_array_equal(rays.amplitude, np.ones(12))
    assert rays.area == 1.0
    assert rays.passes == ("splitter",)


slants = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.2, 1.0))


@settings(max_examples=50, deadline=None)
@given(direction=slants, rows=st.integers(1, 5), columns=st.integers(1, 5))
def test_launched_plane_waves(direction, rows, columns):
    source = beam(direction=direction, up=(0.0, 1.0, -0.1), shape=(rows, columns))
    rays = launch(source)
    assert len(rays) == rows * columns
    # one phase front across one direction, centred on the beam, of the beam's area
    offset = rays.origin - source.centre
    np.testing.assert_allclose(offset @ source.direction, 0.0, rtol=0, atol=6 * ROUNDING)
    np.testing.assert_allclose(offset.mean(axis=0), 0.0, rtol=0, atol=6 * ROUNDING)
    np.testing.assert_allclose(
        rays.direction, np.tile(source.direction, (rows * columns, 1)), rtol=0, atol=ROUNDING
    )
    assert rays.area * len(rays) == pytest.approx(12.0, rel=ROUNDING, abs=0.0)
    # mean square distance of the midpoints of n equal cells from the middle: w^2 (1 - 1/n^2) / 12
    spread = (36.0 * (1.0 - 1.0 / columns**2) + 4.0 * (1.0 - 1.0 / rows**2)) / 12.0
    assert (offset**2).sum(axis=1).mean() == pytest.approx(spread, rel=10 * ROUNDING, abs=36 * ROUNDING**2)


@settings(max_examples=50, deadline=None)
@given(cuts=st.lists(st.integers(0, 35), max_size=5), gaussian=st.booleans())
@example(cuts=[23, 24], gaussian=True)  # a row by itself, where a matrix product has other bits
def test_parts_of_a_beam_are_the_beam(cuts, gaussian):
    source = beam(shape=(5, 7), direction=(0.3, -0.2, 1.0), profile=ft.Gaussian(1.5) if gaussian else None)
    edges = [0, *sorted(cuts), 35]
    parts = [launch(source, start, stop) for start, stop in pairwise(edges)]
    whole = launch(source)
    for name in ("origin", "direction", "length", "amplitude"):
        joined = np.concatenate([getattr(part, name) for part in parts])
        np.testing.assert_array_equal(joined, getattr(whole, name))


def test_launch_ends_where_the_beam_does():
    np.testing.assert_array_equal(launch(beam(), 10, 99).origin, launch(beam()).origin[10:])
    np.testing.assert_array_equal(launch(beam(), -2).origin, launch(beam()).origin[-2:])
    assert len(launch(beam(), 12)) == len(launch(beam(), 7, 3)) == 0


def test_launch_gives_checked_rays():
    rays = launch(beam(profile=ft.Gaussian(1.0)))
    again = ft.Rays(rays.origin, rays.direction, rays.length, rays.amplitude, rays.area, rays.passes)
    for name in ("origin", "direction", "length", "amplitude"):
        np.testing.assert_allclose(getattr(again, name), getattr(rays, name), rtol=0, atol=ROUNDING)
        assert getattr(rays, name).dtype == getattr(again, name).dtype


def test_gaussian_is_brightest_at_the_centre():
    source = beam(size=(6.0, 6.0), shape=(31, 31), direction=(1.0, 2.0, 3.0), profile=ft.Gaussian(1.5))
    rays = launch(source)
    assert np.argmax(np.abs(rays.amplitude)) == 31 * 31 // 2
    r = np.linalg.norm(rays.origin - source.centre, axis=1)
    np.testing.assert_allclose(rays.amplitude, np.exp(-((r / 1.5) ** 2)), rtol=40 * ROUNDING)
    inwards_out = np.abs(rays.amplitude[np.argsort(r)])
    assert (np.diff(inwards_out) <= 40 * ROUNDING).all()


def test_power_of_a_gaussian_beam():
    waist = 0.7e-3
    rays = launch(beam(size=(8 * waist, 8 * waist), shape=(64, 64), profile=ft.Gaussian(waist)))
    power = (np.abs(rays.amplitude) ** 2).sum() * rays.area
    # the midpoint sum of a Gaussian converges faster than any power of the spacing; the square
    # cuts off what lies beyond 4 waists, erfc(4 sqrt 2) = 1e-15 along either side
    assert power == pytest.approx(0.5 * math.pi * waist**2, rel=1e-13, abs=0.0)


def test_power_of_a_gaussian_beam_cut_off_by_its_rectangle():
    waist, width, height = 1.0, 1.2, 0.8
    rays = launch(beam(size=(width, height), shape=(400, 600), profile=ft.Gaussian(waist)))
    power = (np.abs(rays.amplitude) ** 2).sum() * rays.area
    sides = math.erf(width / math.sqrt(2.0) / waist) * math.erf(height / math.sqrt(2.0) / waist)
    # midpoint rule: cells of 2 thousandths of a waist, squared, times second derivatives over 24
    assert power == pytest.approx(0.5 * math.pi * waist**2 * sides, rel=2e-6, abs=0.0)


def test_power_of_a_uniform_beam():
    rays = launch(beam())
    assert (np.abs(rays.amplitude) ** 2).sum() * rays.area == pytest.approx(12.0, rel=ROUNDING, abs=0.0)


def test_profiles_see_beam_coordinates():
    rays = launch(beam(profile=lambda x, y: x + 1j * y))
    offset = rays.origin - [0.1, 0.2, 0.3]
    np.testing.assert_allclose(rays.amplitude, offset[:, 0] + 1j * offset[:, 1], rtol=0, atol=6 * ROUNDING)
    np.testing.assert_array_equal(launch(beam(profile=lambda x, y: 0.5)).amplitude, np.full(12, 0.5))


@pytest.mark.parametrize("value", [np.nan, np.full(12, np.inf), np.ones(11), np.ones((12, 1))])
def test_profiles_give_one_finite_number_a_ray(value):
    with pytest.raises(
        ValueError, match="Beam profile: expected a finite amplitude for each of 12 rays, got"
    ):
        launch(beam(profile=lambda x, y: value))
