"""Means over pixels: Gauss tables, fringes, even and cut pixels, groups, the same bits from any cores."""

import math
import os

import numpy as np
import pytest

from fringetrace.field import pixel_quadrature, sample_points
from fringetrace.field.pixel_quadrature import Case

# Phases of some turns are known to a few roundings.
ROUNDING = 1e-13
SHAPE = (12, 16)
ONE = (Case(1.0),)


class Light:
    """Fields of groups by a function of points and slopes (to be widened) and the wavelength."""

    def __init__(self, groups, fields):
        self.groups, self.fields = groups, fields

    def at(self, points, slopes):
        return points, slopes

    def field(self, found, case):
        points, slopes = found
        slope = np.tile([np.inf, -np.inf, np.inf, -np.inf], (len(points.x) if slopes else 0, 1))
        return self.fields(points, slope, case.wavelength), slope


def mean_field(light, cuts=None, cases=ONE):
    return pixel_quadrature.averaged(SHAPE, light, cases, True, cuts)[0]


def mutual_intensity(light, cuts=None, cases=ONE):
    return pixel_quadrature.averaged(SHAPE, light, cases, False, cuts)[0]


def waves(*slopes, bend=0.0):
    """Plane waves exp(2 pi i (a x + b y) / wavelength), a group each, amplitudes 1, 1/2, ..."""

    def light(points, slope, wavelength):
        field = points.blank(len(slopes))
        for group, (a, b) in enumerate(slopes):
            path = a * points.x + b * points.y + bend * points.x**2
            field[group] = np.exp(2j * math.pi * path / wavelength) / (group + 1)
            if len(slope):
                along = a + 2 * bend * points.x
                np.minimum(slope[:, 0], along, out=slope[:, 0])
                np.maximum(slope[:, 1], along, out=slope[:, 1])
                np.minimum(slope[:, 2], b, out=slope[:, 2])
                np.maximum(slope[:, 3], b, out=slope[:, 3])
        return field

    return Light(len(slopes), light)


def mean(a, b):
    """Of exp(2 pi i (a x + b y)) over each pixel."""
    x, y = np.arange(SHAPE[1]) + 0.5, np.arange(SHAPE[0])[:, None] + 0.5
    return np.sinc(a) * np.sinc(b) * np.exp(2j * math.pi * (a * x + b * y))


@pytest.mark.parametrize("order", [1, 2, 7, 32])
def test_a_rule_of_n_points_is_exact_to_degree_2n_less_1(order):
    nodes, weights = sample_points.gauss_table(np.array([[order, order]]))
    assert nodes.shape == weights.shape == (order + 1, order)
    assert (nodes[order, order:] == 0).all()
    for power in (0, 1, 2 * order - 1):
        assert weights[order] @ nodes[order] ** power == pytest.approx(1 / (power + 1), rel=1e-12)
    others = np.delete(np.arange(order + 1), order)
    assert (weights[others] == 0).all()


def test_fringes_are_those_between_waves_or_of_the_carrier():
    """Of three pixels in a row, two apart: the largest of each and its neighbours."""
    slope = np.tile([np.inf, -np.inf, np.inf, -np.inf], (1, 6, 1))
    slope[0, 0] = [1.0, 1.5, -2.0, -2.0]
    slope[0, 3] = [0.5, 0.5, 0.1, 0.2]
    assert pixel_quadrature.fringes(slope, False) == pytest.approx(np.array([[0.5, 0.5, 0.1, 0.1, 0.1, 0.0]]))
    assert pixel_quadrature.fringes(slope, True) == pytest.approx(np.array([[2.0, 2.0, 0.5, 0.5, 0.5, 0.0]]))


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.004, -0.003), (0.3, 0.2), (2.4, 0.0)])
def test_a_carrier_is_averaged(slope):
    """From the centre and its neighbours where it is even, by Gauss points where not."""
    found, mutual = mean_field(waves(slope)), mutual_intensity(waves(slope))
    assert found[0] == pytest.approx(mean(*slope), abs=2 * sample_points.ERROR)
    assert mutual[0, 0] == pytest.approx(np.ones(SHAPE), abs=ROUNDING)


@pytest.mark.parametrize("slope", [(0.004, 0.002), (0.3, 0.2), (1.7, 0.9)])
def test_fringes_between_groups_are_averaged(slope):
    carrier = np.array([40.0, 25.0])
    both = waves(carrier + slope, carrier)
    mutual = mutual_intensity(both)
    assert mutual[0, 1] == pytest.approx(0.5 * mean(*slope), abs=2 * sample_points.ERROR)
    assert mutual[0, 0] == pytest.approx(np.ones(SHAPE), abs=ROUNDING)
    assert mutual[1, 1] == pytest.approx(np.full(SHAPE, 0.25), abs=ROUNDING)
    assert mutual[1, 0] == pytest.approx(np.conj(mutual[0, 1]), abs=ROUNDING)


def test_irradiances_of_groups_are_hermitian():
    mutual = mutual_intensity(waves((0.1, 0.2), (0.4, -0.3), (-0.2, 0.0), bend=0.01))
    assert mutual == pytest.approx(np.conj(np.swapaxes(mutual, 0, 1)), abs=ROUNDING)
    assert np.abs(np.diagonal(mutual).imag).max() < ROUNDING
    each = np.linalg.eigvalsh(np.moveaxis(mutual, (0, 1), (-2, -1)))
    assert each.min() > -1e-12


def test_an_even_pixel_is_its_centre_and_a_part_of_its_curvature():
    def bowl(points, slope, wavelength):
        if len(slope):
            slope[:] = 0.0
        return (1.0 + 1e-4 * (points.x - 8) ** 2 + 1e-4j * points.y**2)[None]

    found = mean_field(Light(1, bowl))
    x, y = np.arange(SHAPE[1]) + 0.5, np.arange(SHAPE[0])[:, None] + 0.5
    expected = 1.0 + 1e-4 * ((x - 8) ** 2 + 1 / 12) + 1e-4j * (y**2 + 1 / 12)
    assert found[0] == pytest.approx(expected, abs=ROUNDING)


@pytest.mark.parametrize("tilt", [0.0, 0.31])
def test_pixels_are_cut_along_edges(tilt):
    """Light to the left of a line: each pixel gets the part of its area there."""

    def half(points, slope, wavelength):
        if len(slope):
            slope[:] = 0.0
        return (points.where_x < 5.3 + tilt * points.where_y).astype(complex)[None]

    line = np.array([[5.3, 0.0, 5.3 + tilt * SHAPE[0], float(SHAPE[0])]])
    cuts = sample_points.edges(line, SHAPE)
    mutual = mutual_intensity(Light(1, half), cuts)
    fine = (np.arange(SHAPE[0] * 1000) + 0.5) / 1000
    x = np.arange(SHAPE[1])
    part = np.clip(5.3 + tilt * fine[:, None] - x, 0.0, 1.0).reshape(SHAPE[0], 1000, SHAPE[1]).mean(axis=1)
    # the reference is a sum of a thousand lines
    assert mutual[0, 0].real == pytest.approx(part, abs=1e-6)
    crossed = (part > 0) & (part < 1)
    assert np.isin(np.flatnonzero(crossed), cuts.pixel).all()


def test_products_of_fields():
    field = np.array([[1.0 + 2.0j], [3.0j]])
    assert pixel_quadrature.mutual_products(field)[:, :, 0] == pytest.approx(
        np.array([[5, 6 - 3j], [6 + 3j, 9]])
    )


def test_the_same_bits_from_any_number_of_threads(monkeypatch):
    both = waves((0.3, 0.2), (2.1, -0.4), bend=0.02)
    cuts = sample_points.edges(np.array([[1.2, 0.0, 9.7, 12.0]]), SHAPE)
    monkeypatch.setattr(sample_points, "BAND", 64)  # many bands
    found = []
    for cores in (1, 2, 7):
        monkeypatch.setattr(os, "cpu_count", lambda cores=cores: cores)
        found.append((mean_field(both, cuts), mutual_intensity(both, cuts)))
    for again in found[1:]:
        for a, b in zip(found[0], again, strict=True):
            assert (a == b).all()


def test_cases_together_are_those_one_by_one():
    """Each pixel has the points that its case asks for, whatever the others ask."""
    both = waves((0.3, 0.2), (2.1, -0.4), bend=0.02)
    cuts = sample_points.edges(np.array([[1.2, 0.0, 9.7, 12.0]]), SHAPE)
    cases = [Case(1.0, image=0), Case(0.31, image=1), Case(40.0, image=2)]
    together = pixel_quadrature.averaged(SHAPE, both, cases, True, cuts)
    for case, image in zip(cases, together, strict=True):
        assert (image == mean_field(both, cuts, [case._replace(image=0)])).all()
    shares = [case._replace(image=0, weight=w) for case, w in zip(cases, (0.5, 0.3, 0.2), strict=True)]
    total = mutual_intensity(both, cuts, shares)
    parts = [case.weight * mutual_intensity(both, cuts, [case._replace(weight=1.0)]) for case in shares]
    assert total == pytest.approx(sum(parts), abs=ROUNDING)


def test_some_rows_are_those_of_the_image():
    both = waves((0.3, 0.2), (2.1, -0.4))
    cuts = sample_points.edges(np.array([[1.2, 0.0, 9.7, 12.0]]), SHAPE)
    whole = pixel_quadrature.averaged(SHAPE, both, [Case(1.0)], True, cuts)
    some = pixel_quadrature.averaged(SHAPE, both, [Case(1.0)], True, cuts, rows=(4, 9))
    assert some == pytest.approx(whole[:, :, 4:9], abs=ROUNDING)
    finer = pixel_quadrature.averaged(SHAPE, both, [Case(1.0)], True, cuts, more=3, rows=(4, 9))
    assert finer == pytest.approx(some, abs=10 * sample_points.ERROR)
    assert (finer != some).any()
