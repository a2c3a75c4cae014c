import math

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
from fringetrace.rigorous.cylindrical_waves import CONDUCTOR

PRINTED = 6e-10  # nine decimals, half of the last and a little
BALANCE = 1e-11  # power, and the two ways around, by rounding alone
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
    for polarisation, expected in (("E", e), ("H", h)):
        found = efficiencies(size / 2 / math.pi, index, 1.0, 1.0, polarisation)
        assert found.scattering == pytest.approx(expected, abs=PRINTED)
        assert found.extinction == pytest.approx(expected, abs=PRINTED)
        assert abs(found.absorption) < BALANCE


def test_efficiencies_of_an_absorbing_cylinder():
    for polarisation, extinction, scattering in (
        ("E", 3.795172643, 3.072222973), ("H", 2.992109435, 2.427271597)
    ):  # fmt: skip
        found = efficiencies(2 / 2 / math.pi, 1.7428 + 0.0879j, 1.0, 1.0, polarisation)
        assert found.extinction == pytest.approx(extinction, abs=PRINTED)
        assert found.scattering == pytest.approx(scattering, abs=PRINTED)


def test_coefficients_broadcast_and_conserve_power():
    found = scattering_coefficients([0.1, 0.4], np.array([1.5, 3.0]), 1.2, 0.7, "H", 4)
    assert found.shape == (2, 9)
    np.testing.assert_allclose(abs(1 + 2 * found), 1, rtol=BALANCE)


@pytest.mark.parametrize(
    # treams, a T-matrix program; H is of 8 digits, as far as its orders went
    ("polarisation", "scattering", "extinction", "digits"),
    [("E", 2.515991714, 3.226449554, 6e-10), ("H", 1.716691932, 2.420211073, 1e-8)],
)
def test_three_cylinders(polarisation, scattering, extinction, digits):
    found = widths(scatter(THREE, 0.8, 0.3, polarisation, orders=22))
    assert found.scattering[0] == pytest.approx(scattering, abs=digits)
    assert found.extinction[0] == pytest.approx(extinction, abs=digits)


@pytest.mark.parametrize("polarisation", ["E", "H"])
def test_optical_theorem(polarisation):
    found = widths(scatter(THREE, 0.8, [0.3, 2.0], polarisation))
    np.testing.assert_allclose(found.extinction, found.scattering + found.absorption, rtol=BALANCE)
    assert np.all(found.absorption > 0.1)


@pytest.mark.parametrize("polarisation", ["E", "H"])
def test_reciprocity(polarisation):
    there, back = 0.3, 2.1
    one = amplitude(scatter(THREE, 0.8, there, polarisation), back)[0, 0]
    other = amplitude(scatter(THREE, 0.8, back + math.pi, polarisation), there + math.pi)[0, 0]
    assert abs(one - other) < BALANCE * abs(one)


def test_one_cylinder_in_a_cluster_is_a_single_one():
    alone = efficiencies(0.3, 1.5 + 0.1j, 1.3, 0.8, "H")
    found = widths(scatter(Cylinders([(0.2, -0.4)], 0.3, 1.5 + 0.1j, 1.3), 0.8, 0.7, "H"))
    np.testing.assert_allclose(np.ravel(found) / 0.6, alone, rtol=BALANCE)


@pytest.mark.parametrize("polarisation", ["E", "H"])
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
    found, far = scatter(THREE, 0.8, 0.3, "H"), 1e6
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


def test_scatter_rejects():
    rods = Cylinders([(0, 0)], 0.4, 1.5)
    with pytest.raises(ValueError, match="Wavelength: expected a positive length in metres, got 0"):
        scatter(rods, 0.0)
    with pytest.raises(ValueError, match="Host: expected a positive real refractive index"):
        scatter(Cylinders([(0, 0)], 0.4, 1.5, 1.3 + 0.1j), 0.5)
    with pytest.raises(ValueError, match="Polarisation: expected 'E' or 'H', got 'TE'"):
        scatter(rods, 0.5, 0.0, "TE")
