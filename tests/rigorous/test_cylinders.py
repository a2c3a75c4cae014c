import math

import mpmath
import numpy as np
import pytest

from fringetrace.rigorous.cylinders import (
    Cylinders,
    amplitude,
    differential_width,
    efficiencies,
    near_field,
    scatter,
    scattering_coefficients,
    widths,
)
from fringetrace.rigorous.cylindrical_waves import CONDUCTOR, truncation

PRINTED = 6e-10  # nine decimals, half of the last and a little
BALANCE = 1e-11  # power, and the two ways around, by rounding alone
LARGE = 1e-11  # a wave of size x has some x eps of phase error, its recurrence some of amplitude
THREE = Cylinders([(0, 0), (1.1, 0.2), (-0.3, 1.3)], [0.5, 0.4, 0.3], [1.5, 1.7 + 0.1j, 1.3])


@pytest.mark.parametrize(
    ("size", "index", "e", "h"),
    [
        (5, 1.33, 3.850104291, 3.666501657),
        (1, 1.5, 0.942920698, 0.279923094),
        (1, CONDUCTOR, 2.956556861, 1.000191728),
        # Bohren and Huffman's own example BHCYL: 0.525 um, 0.6328 um
        (2 * math.pi * 0.525 / 0.6328, 1.55, 2.097164476, 1.927819417),
    ],
)
def test_efficiencies_of_single_cylinders(size, index, e, h):
    for polarisation, expected in (("s", e), ("p", h)):
        found = efficiencies(size / 2 / math.pi, index, 1.0, 1.0, polarisation)
        assert found.scattering == pytest.approx(expected, abs=PRINTED)
        assert found.extinction == pytest.approx(expected, abs=PRINTED)
        assert abs(found.absorption) < BALANCE


def test_efficiencies_of_an_absorbing_cylinder():
    for polarisation, extinction, scattering in (
        ("s", 3.795172643, 3.072222973), ("p", 2.992109435, 2.427271597)
    ):  # fmt: skip
        found = efficiencies(2 / 2 / math.pi, 1.7428 + 0.0879j, 1.0, 1.0, polarisation)
        assert found.extinction == pytest.approx(extinction, abs=PRINTED)
        assert found.scattering == pytest.approx(scattering, abs=PRINTED)


def test_coefficients_broadcast_and_conserve_power():
    found = scattering_coefficients([0.1, 0.4], np.array([1.5, 3.0]), 1.2, 0.7, "p", 4)
    assert found.shape == (2, 9)
    np.testing.assert_allclose(abs(1 + 2 * found), 1, rtol=BALANCE)


@pytest.mark.parametrize(
    # treams, a T-matrix program; H is of 8 digits, as far as its orders went
    ("polarisation", "scattering", "extinction", "digits"),
    [("s", 2.515991714, 3.226449554, 6e-10), ("p", 1.716691932, 2.420211073, 1e-8)],
)
def test_three_cylinders(polarisation, scattering, extinction, digits):
    found = widths(scatter(THREE, 0.8, 0.3, polarisation, orders=22))
    assert found.scattering[0] == pytest.approx(scattering, abs=digits)
    assert found.extinction[0] == pytest.approx(extinction, abs=digits)


@pytest.mark.parametrize("polarisation", ["s", "p"])
def test_optical_theorem(polarisation):
    found = widths(scatter(THREE, 0.8, [0.3, 2.0], polarisation))
    np.testing.assert_allclose(found.extinction, found.scattering + found.absorption, rtol=BALANCE)
    assert np.all(found.absorption > 0.1)


@pytest.mark.parametrize("polarisation", ["s", "p"])
def test_reciprocity(polarisation):
    there, back = 0.3, 2.1
    one = amplitude(scatter(THREE, 0.8, there, polarisation), back)[0, 0]
    other = amplitude(scatter(THREE, 0.8, back + math.pi, polarisation), there + math.pi)[0, 0]
    assert abs(one - other) < BALANCE * abs(one)


def test_one_cylinder_in_a_cluster_is_a_single_one():
    alone = efficiencies(0.3, 1.5 + 0.1j, 1.3, 0.8, "p")
    found = widths(scatter(Cylinders([(0.2, -0.4)], 0.3, 1.5 + 0.1j, 1.3), 0.8, 0.7, "p"))
    np.testing.assert_allclose(np.ravel(found) / 0.6, alone, rtol=BALANCE)


@pytest.mark.parametrize("polarisation", ["s", "p"])
def test_fields_are_continuous_across_surfaces(polarisation):
    rods = Cylinders([(0, 0), (1.2, 0.3)], [0.5, 0.4], [1.5 + 0.2j, lambda w: 2.0 * w / 0.8], lambda w: 1.1)
    found = scatter(rods, 0.8, 0.3, polarisation, orders=24)
    angle = np.linspace(0, 2 * np.pi, 7)
    ring = np.stack([np.cos(angle), np.sin(angle)], 1)
    for centre, radius in zip(rods.centres, rods.radii, strict=True):
        inside, outside = (near_field(found, centre + ring * radius * f) for f in (1 - 1e-9, 1 + 1e-9))
        # the gap of 2e-9 radii is some 1e-8 of a wave
        np.testing.assert_allclose(inside, outside, atol=1e-7)


def test_no_field_in_a_conductor_and_none_on_it():
    found = scatter(Cylinders([(0, 0)], 0.5, CONDUCTOR), 0.8, orders=22)
    assert near_field(found, [(0.1, 0.2)])[0, 0] == 0
    assert abs(near_field(found, [(0.5, 0.0), (-0.3, 0.4)])).max() < 1e-11


def test_near_field_becomes_the_amplitude():
    found, far = scatter(THREE, 0.8, 0.3, "p"), 1e6
    k = found.wavenumber
    point = far * np.array([math.cos(2.0), math.sin(2.0)])
    incident = np.exp(1j * k * far * math.cos(2.0 - 0.3))
    wave = (near_field(found, [point])[0, 0] - incident) / np.exp(1j * (k * far - math.pi / 4))
    # the next term of the far field is k 1.4^2 / 2 far, 1e-5; rounding k far, 1e-9, is 5000 times the wave's
    assert wave * math.sqrt(math.pi * k * far / 2) == pytest.approx(amplitude(found, 2.0)[0, 0], rel=5e-5)


def test_matched_cylinders_do_nothing():
    found = widths(scatter(Cylinders([(0, 0), (1, 0)], 0.3, 1.33, 1.33), 0.5))
    assert abs(np.array(found)).max() < BALANCE


def test_differential_width_integrates_to_the_scattering_width():
    found = scatter(THREE, 0.8, 0.3)
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    total = differential_width(found, angle).mean() * 2 * np.pi
    assert total == pytest.approx(widths(found).scattering[0], rel=BALANCE)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"centres": [(0, 0, 0)]}, r"Cylinders: expected centres of shape \(n, 2\), got \(1, 3\)"),
        ({"radii": -1.0}, "Cylinders: expected positive radii in metres, got -1.0"),
        ({"index": [1.5, 1.6, 1.7]}, "Cylinders: expected 1 or 2 indices, got 3"),
        ({"radii": 0.6}, "Cylinders: expected them apart, got 0 and 1 overlapping by 0.2 m"),
    ],
)
def test_cylinders_reject(change, message):
    with pytest.raises(ValueError, match=message):
        Cylinders(**{"centres": [(0, 0), (1, 0)], "radii": 0.4, "index": 1.5, **change})


@pytest.mark.parametrize("index", [None, math.nan, 0.0, "glass", [1.5, None], np.array([1.5, math.nan])])
def test_cylinders_reject_what_is_no_index(index):
    with pytest.raises(ValueError, match="Cylinders: expected a refractive index n"):
        Cylinders([(0, 0), (1, 0)], 0.4, index)
    with pytest.raises(ValueError, match="Index: expected a refractive index n"):
        scatter(Cylinders([(0, 0)], 0.4, lambda wavelength: None), 0.5)


def test_indices_may_be_an_array():
    several = scatter(Cylinders([(0, 0), (1, 0)], 0.4, np.array([1.5, 2.0])), 0.5)
    listed = scatter(Cylinders([(0, 0), (1, 0)], 0.4, [1.5, 2.0]), 0.5)
    assert np.array_equal(several.outgoing, listed.outgoing)


@pytest.mark.parametrize("polarisation", ["s", "p"])
@pytest.mark.parametrize("index", [0.05 + 0j, 0.2 + 3.4j])
def test_large_bubbles_and_metals(index, polarisation):
    """Coefficients of size 1,500 beside Bessel functions in 30 digits (Bohren and Huffman, 8.30 and 8.32)."""
    x, orders = 1500.0, [0, 75, 1499, 1530]
    found = scattering_coefficients(x / (2 * math.pi), index, 1.0, 1.0, polarisation, max(orders))
    assert np.isfinite(found).all()
    with mpmath.workdps(30):
        x, m = 2 * mpmath.pi * mpmath.mpf(x / (2 * math.pi)), mpmath.mpc(index)
        for n in orders:
            (j, dj), (y, dy), (i, di) = (
                (f(n, z), (f(n - 1, z) - f(n + 1, z)) / 2)
                for f, z in ((mpmath.besselj, x), (mpmath.bessely, x), (mpmath.besselj, m * x))
            )
            h, dh = j + 1j * y, dj + 1j * dy
            contrast = m if polarisation == "s" else 1 / m
            expected = -(contrast * di * j - i * dj) / (contrast * di * h - i * dh)
            assert found[max(orders) + n] == pytest.approx(complex(expected), abs=LARGE)
            assert found[max(orders) - n] == found[max(orders) + n]


def test_field_in_a_large_bubble_is_continuous():
    """Right inside its surface too, where waves of total reflection are, whose J_n underflows."""
    # near the surface more orders count than far off
    bubble = scatter(Cylinders([(0, 0)], 200.0, 0.05), 1.0, orders=truncation(400 * math.pi) + 80)
    around = np.linspace(0.0, 2 * math.pi, 40)
    rim = np.stack([np.cos(around), np.sin(around)], -1)
    outside, inside = (near_field(bubble, 200.0 * (1 + s) * rim) for s in (1e-12, -1e-12))
    assert abs(outside).max() > 1.0
    np.testing.assert_allclose(inside, outside, atol=1e-8)
    assert np.isfinite(near_field(bubble, [(0, 0), (1e-300, 0), (199.9, 0)])).all()


@pytest.mark.parametrize("polarisation", ["s", "p"])
def test_a_tiny_cylinder_beside_a_large_one(polarisation):
    """Orders that the large one needs overflow at the tiny one."""
    radii, index, apart, n = (20.0 / (2 * math.pi), 1e-9), 1.5, 4.0, truncation(20.0)
    found = scatter(Cylinders([(0, 0), (apart, 0)], radii, index), 1.0, 0.0, polarisation)
    assert np.isfinite(found.outgoing).all()
    assert np.isfinite(near_field(found, [(apart + 2e-9, 0), (apart, 0), (-7.0, 1.0)])).all()
    # the tiny one changes nothing at the large one, and is excited by its field there
    alone = scatter(Cylinders([(0, 0)], radii[0], index), 1.0, 0.0, polarisation)
    middle = found.outgoing.shape[-1] // 2
    np.testing.assert_allclose(found.outgoing[:, 0], alone.outgoing[:, 0], atol=1e-12)
    assert found.exciting[0, 1, middle] == pytest.approx(near_field(alone, [(apart, 0)])[0, 0], rel=1e-11)
    own = scattering_coefficients(radii[1], index, 1.0, 1.0, polarisation, 1)
    expected = found.exciting[0, 1, middle - 1 : middle + 2] * own
    np.testing.assert_allclose(found.outgoing[0, 1, middle - 1 : middle + 2], expected, rtol=1e-9)
    assert n == middle


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_scatter_rejects_what_is_not_finite(value):
    with pytest.raises(ValueError, match="Wavelength: expected a positive length in metres"):
        scatter(Cylinders([(0, 0)], 0.4, 1.5), value)
    with pytest.raises(ValueError, match="Angle: expected finite angles in radians"):
        scatter(Cylinders([(0, 0)], 0.4, 1.5), 0.5, value)
    with pytest.raises(ValueError, match="Cylinders: expected finite centres in metres, got NaN or infinity"):
        Cylinders([(0, value)], 0.4, 1.5)
    with pytest.raises(ValueError, match="Cylinders: expected positive radii in metres"):
        Cylinders([(0, 0)], value, 1.5)
    with pytest.raises(ValueError, match="Host: expected a positive real refractive index, got"):
        scattering_coefficients(1.0, 1.5, value, 1.0, "s", 3)


def test_scatter_rejects():
    rods = Cylinders([(0, 0)], 0.4, 1.5)
    with pytest.raises(ValueError, match="Wavelength: expected a positive length in metres, got 0"):
        scatter(rods, 0.0)
    with pytest.raises(ValueError, match="Host: expected a positive real refractive index"):
        scatter(Cylinders([(0, 0)], 0.4, 1.5, 1.3 + 0.1j), 0.5)
    with pytest.raises(ValueError, match="Polarisation: expected 's' or 'p', got 'TE'"):
        scatter(rods, 0.5, 0.0, "TE")


def test_orders_are_counted_by_any_integer_from_0():
    one, other = (scattering_coefficients(1.0, 1.5, 1.0, 1.0, "s", orders) for orders in (9, np.uint64(9)))
    assert np.array_equal(one, other)
    for orders in (-1, 2.5):
        with pytest.raises(ValueError, match="Orders: expected a whole number of at least 0, got"):
            scattering_coefficients(1.0, 1.5, 1.0, 1.0, "s", orders)
        with pytest.raises(ValueError, match="Orders: expected a whole number of at least 0, got"):
            scatter(Cylinders([(0, 0)], 0.4, 1.5), 0.5, orders=orders)
