import numpy as np
import pytest
from scipy.special import h1vp, hankel1, jv, jvp

from fringetrace.rigorous.cylindrical_waves import (
    CONDUCTOR,
    boundary,
    hankel,
    indices_at,
    lattice_sums,
    outgoing_waves,
    truncation,
)

ROUNDING = 1e-12  # of special functions and their recurrence
LEFT_OUT = 1e-13  # of the largest order, what truncation promises


def test_hankel_is_that_of_scipy():
    x = np.array([0.3, 2.0, 40.0])
    expected = hankel1(np.arange(-30, 31), x[:, None])
    np.testing.assert_allclose(hankel(x, 30), expected, rtol=ROUNDING * 10)


@pytest.mark.parametrize("polarisation", ["s", "p"])
@pytest.mark.parametrize("index", [1.7 + 0.2j, 0.2 + 3.4j, 3.0])
def test_boundary_keeps_tangential_fields_continuous(polarisation, index):
    x, host, n = 2.3, 1.3, np.arange(-9, 10)
    response, weight, within = boundary(x / host / 2 / np.pi, index, host, 1.0, polarisation, 9)
    m = index / host
    within = within / jv(n, m * x)
    outside = jv(n, x) + response * hankel1(n, x)
    slope = jvp(n, x) + response * h1vp(n, x)
    ratio = m if polarisation == "s" else 1 / m
    scale = abs(jv(n, x)) + abs(response * hankel1(n, x))
    assert np.all(abs(within * jv(n, m * x) - outside) < ROUNDING * scale)
    assert np.all(abs(ratio * within * jvp(n, m * x) - slope) < 100 * ROUNDING * (scale + abs(slope)))
    np.testing.assert_allclose(weight, abs(hankel1(n, x)), rtol=ROUNDING)


def test_boundary_of_a_conductor_is_the_limit_of_large_index():
    for polarisation in ("s", "p"):
        metal = boundary(0.2, 1e6j, 1.0, 1.0, polarisation, 5)[0]
        perfect = boundary(0.2, CONDUCTOR, 1.0, 1.0, polarisation, 5)[0]
        # a wave enters by 1 / |index| of a wavelength
        np.testing.assert_allclose(metal, perfect, atol=1e-5)


def test_boundary_rejects_an_unknown_polarisation():
    with pytest.raises(ValueError, match="Polarisation: expected 's' or 'p', got 'TE'"):
        boundary(1.0, 1.5, 1.0, 1.0, "TE", 3)


@pytest.mark.parametrize("x", [0.01, 0.3, 3.0, 30.0, 300.0, 1000.0])
def test_truncation_leaves_out_what_it_promises(x):
    n = truncation(x)
    for index in (1.5, CONDUCTOR):
        response = abs(boundary(x / 2 / np.pi, index, 1.0, 1.0, "p", n + 1)[0])
        assert response[-1] < 3 * LEFT_OUT * response.max()


def test_waves_are_zero_at_home():
    found = outgoing_waves(np.array([[0.0, 0.0], [3.0, 4.0]]), 2.0, 4)
    assert np.all(found[0] == 0)
    np.testing.assert_allclose(found[1, 4 + 3], hankel1(3, 10.0) * (0.6 + 0.8j) ** 3, rtol=ROUNDING)


def test_at_wavelength_takes_numbers_and_functions():
    wavelength = np.array([1.0, 2.0])
    np.testing.assert_array_equal(indices_at(1.5, wavelength), [1.5, 1.5])
    np.testing.assert_array_equal(indices_at(lambda w: 1j * w, wavelength), [1j, 2j])


@pytest.mark.parametrize(("beta", "pitch"), [(0.0, 0.26), (2.0, 0.4), (2.0, 0.9), (1.0, 1.3), (6.2, 0.49)])
def test_lattice_sums_keep_power(beta, pitch):
    # their even real part is closed: plane waves that leave less the cylinder's own wave (V. Twersky 1961)
    k, half = 2 * np.pi, 6
    found = lattice_sums(beta, k, pitch, half)
    across = beta + 2 * np.pi / pitch * np.arange(-3, 4)
    across = across[abs(across) < k]
    angle = np.arccos(across / k)
    for order in range(0, half + 1, 2):
        leaving = (2 / (k * pitch) * np.cos(order * angle) / np.sin(angle)).sum() * (-1) ** (order // 2)
        assert found[half + order].real == pytest.approx(leaving - (order == 0), rel=1e-11, abs=1e-11)


def test_lattice_sums_add_up_neighbours_in_a_smooth_window():
    # the sum itself, cut off smoothly over 1e5 neighbours: what is left falls faster than any power
    beta, k, pitch = 2.0, 2 * np.pi, 0.9
    count = 100_000
    j = np.arange(1, count)
    u = np.clip((j / count - 0.2) / 0.8, 2e-3, 1 - 2e-3)
    window = 1 / (1 + np.exp(1 / (1 - u) - 1 / u))
    found = lattice_sums(beta, k, pitch, 5)
    for order in (-3, 0, 1, 5):
        both = np.exp(1j * beta * j * pitch) * (-1) ** order + np.exp(-1j * beta * j * pitch)
        assert found[5 + order] == pytest.approx(
            (window * both * hankel1(order, k * j * pitch)).sum(), rel=1e-9
        )


@pytest.mark.parametrize(
    ("beta", "pitch"), [(0.3, 0.4), (2.0, 1.7), (6.28, 0.5), (6.2831, 0.99), (0.0, 0.9999)]
)
def test_lattice_sums_agree_with_treams(beta, pitch):
    treams = pytest.importorskip("treams", exc_type=ImportError)
    k = 2 * np.pi
    found = lattice_sums(beta, k, pitch, 6)
    for order in range(-6, 7):
        # its Ewald sums stop at some 1e-9
        expected = treams.lattice.lsumcw1d(order, k, beta, pitch, 0.0, 0)
        assert found[6 + order] == pytest.approx(expected, rel=1e-8, abs=1e-8 * abs(found).max())
