"""Gratings: orders, their paths, what is blocked, and amplitudes of phase gratings."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from meetings import EPS, meeting, power, shower

from fringetrace.optics.gratings import Grating, blazed_amplitude, lamellar, sinusoidal

ROUNDING = 64 * EPS
LAMBDA = 633e-9
X = (1.0, 0.0, 0.0)
seeds = st.integers(0, 2**32 - 1)


@pytest.mark.parametrize("reflects", [False, True])
@settings(deadline=None, max_examples=40)
@given(seed=seeds, index=st.floats(1.0, 2.0))
def test_a_plane_wave_leaves_as_plane_waves(reflects, seed, index):
    rays = shower(seed, index=index, wavelength=LAMBDA)
    rays = replace(rays, direction=np.broadcast_to(rays.direction[0], (12, 3)))
    grating = Grating((1, 0.4, 0), 5e-6, orders=(-2, 0, 3), centre=(2e-3, 0, 0), reflects=reflects)
    for branch in grating.act(rays):
        turn = np.einsum("ij,ij->i", rays.direction - branch.direction, rays.point)
        # of paths of a centimetre
        assert np.ptp(index * turn + branch.path) < 0.02 * ROUNDING


def test_orders_change_the_wave_vector_along_the_surface_alone():
    rays = shower(1, index=1.3, wavelength=LAMBDA)
    axis = np.array([0.6, 0.8, 0.0])
    (branch,) = Grating(axis, 2e-6, orders=(-2,)).act(rays)
    change = rays.index[:, None] * (branch.direction - rays.direction)
    assert np.abs(change[:, :2] + 2.0 * LAMBDA / 2e-6 * axis[:2]).max() < ROUNDING


def test_a_mirror_grating_in_order_0_is_a_mirror():
    rays = shower(2, wavelength=LAMBDA)
    (branch,) = Grating(X, 2e-6, orders=(0,), reflects=True).act(rays)
    assert np.abs(branch.direction - rays.direction * [1.0, 1.0, -1.0]).max() < ROUNDING
    # an ideal conductor turns the field along it over
    assert np.abs(branch.field - rays.field * [-1.0, -1.0, 1.0]).max() < 4 * ROUNDING
    assert np.array_equal(branch.path, np.zeros(12))


def test_evanescent_orders_are_absorbed():
    rays = meeting((0, 0, 1), wavelength=500e-9)
    branches = Grating(X, 1e-6, orders=(-2, -1, 0, 1, 3), amplitudes=(0.4, 0.5, 0.6, 0.3j, 0.2)).act(rays)
    assert [branch.field[0] for branch in branches] == pytest.approx([0.0, 0.5, 0.6, 0.3j, 0.0], rel=ROUNDING)
    assert np.array_equal(branches[0].direction, rays.direction)


@settings(deadline=None, max_examples=30)
@given(phase=st.floats(0.0, 6.0), fill=st.floats(0.0, 1.0))
def test_orders_of_a_binary_grating_are_its_fourier_series(phase, fill):
    orders = range(-2, 3)
    samples = 4096
    x = (np.arange(samples) + 0.5) / samples - 0.5
    inside = np.clip(0.5 * samples * fill - np.abs(x) * samples + 0.5, 0.0, 1.0)
    screen = 1.0 + (np.exp(1j * phase) - 1.0) * inside
    for m, amplitude in zip(orders, lamellar(orders, phase, fill), strict=True):
        # the midpoint rule on steps, whose cells are filled in proportion: second order, (2 pi m / N)^2
        assert amplitude == pytest.approx((screen * np.exp(-2j * np.pi * m * x)).mean(), abs=1e-4)


def test_phase_gratings_only_share_the_power_out():
    many = range(-40, 41)
    assert sum(abs(a) ** 2 for a in sinusoidal(many, 5.0)) == pytest.approx(1.0, rel=ROUNDING)
    # tails of 1/m^2 and 1/(a - m)^2: 2 / (pi^2 M) of a step of 2, and 1 / (pi^2 M) each way
    wide = range(-400, 401)
    assert sum(abs(a) ** 2 for a in lamellar(wide, math.pi)) == pytest.approx(
        1.0, abs=4.0 / (math.pi**2 * 400)
    )
    assert sum(abs(blazed_amplitude(m, 0.4)) ** 2 for m in wide) == pytest.approx(
        1.0, abs=2.0 / (math.pi**2 * 400)
    )


def test_sinusoidal_gratings_by_the_series():
    x = np.arange(64) / 64.0
    screen = np.exp(1j * 1.7 * np.cos(2.0 * np.pi * x))
    series = np.fft.fft(screen) / 64.0  # beyond machine accuracy from order 32 on
    for m, amplitude in zip(range(-5, 6), sinusoidal(range(-5, 6), 1.7), strict=True):
        assert amplitude == pytest.approx(series[m % 64], abs=ROUNDING)


def test_blazed_gratings_at_whole_depths_have_one_order():
    assert blazed_amplitude(1, 1.0) == 1.0
    assert blazed_amplitude(2, 2.0) == 1.0
    assert abs(blazed_amplitude(0, 1.0)) < ROUNDING
    u = (np.arange(4096) + 0.5) / 4096
    for m in (-1, 0, 1, 2):
        mean = np.exp(2j * np.pi * (1.3 - m) * u).mean()
        assert blazed_amplitude(m, 1.3) == pytest.approx(mean, abs=1e-5)  # midpoint rule, (2 pi / 4096)^2


def test_orders_share_the_power_equally_unless_told_otherwise():
    branches = Grating(X, 1e-5, orders=(-1, 0, 1, 2)).act(meeting((0, 0, 1), wavelength=LAMBDA))
    assert [power(branch.field)[0] for branch in branches] == pytest.approx([0.25] * 4, rel=ROUNDING)


@pytest.mark.parametrize("bad", [(), (1, 1), (0.5,), (True,), "1"])
def test_orders_are_whole_numbers(bad):
    with pytest.raises(
        ValueError, match="Grating orders: expected different whole numbers, at least one, got"
    ):
        Grating(X, 1e-6, orders=bad)


@pytest.mark.parametrize("bad", [(1.0,), (0.5, math.nan), (0.5, "0.5")])
def test_amplitudes_are_one_an_order(bad):
    with pytest.raises(ValueError, match="Grating amplitudes: expected 2 finite numbers, one an order, got"):
        Grating(X, 1e-6, orders=(0, 1), amplitudes=bad)


def test_doors():
    with pytest.raises(
        ValueError, match="Grating amplitudes: expected powers that add up to at most 1, got 2"
    ):
        Grating(X, 1e-6, orders=(0, 1), amplitudes=(1.0, 1j))
    with pytest.raises(ValueError, match="Grating period: expected a positive length in metres, got 0"):
        Grating(X, 0)
    with pytest.raises(
        ValueError, match="Grating axis: expected a direction along the surface, got its normal"
    ):
        Grating((0, 0, 1), 1e-6).act(meeting((0, 0, 1), wavelength=LAMBDA))
    with pytest.raises(ValueError, match=r"lamellar fill: expected a number from 0 to 1, got 1\.5"):
        lamellar((0,), 1.0, 1.5)
