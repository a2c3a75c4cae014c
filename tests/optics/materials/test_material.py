"""Refractive indices by formula and table: values, shapes, and what is none."""

import math

import numpy as np
import pytest

from fringetrace import nm, um
from fringetrace.optics import materials as m
from fringetrace.optics.materials.dispersion import IndexFormula

D = 587.5618 * nm  # the helium line of glass catalogues


def test_shapes():
    one = m.BK7.index(D)
    assert isinstance(one, np.complex128)
    many = m.BK7.index(np.full((2, 3), D))
    assert (many == one).all()
    assert (many.shape, many.dtype) == ((2, 3), np.complex128)
    assert m.constant(1.5).index([1.0, 2.0]).tolist() == [1.5, 1.5]


def test_both_forms_of_sellmeier():
    lengths = (0.0684043 * um, 0.1162414 * um, 9.896161 * um)
    by_square = m.sellmeier((0.6961663, 0.4079426, 0.8974794), squares=[x**2 for x in lengths])
    assert by_square.index(D) == pytest.approx(m.FUSED_SILICA.index(D), rel=1e-14)
    assert m.sellmeier((), lengths=(), offset=1.25).index(D) == 1.5


def test_cauchy_of_three_terms():
    glass = m.cauchy(1.5, 4e3 * nm**2, 1e8 * nm**4)
    assert glass.index(500 * nm) == pytest.approx(1.5 + 0.016 + 0.0016, rel=1e-14)
    assert glass.range is None
    assert glass.dispersive


def test_tables():
    metal = m.tabulated([400 * nm, 600 * nm], [1.0, 2.0], [3.0, 5.0], name="metal")
    assert metal.index(500 * nm) == pytest.approx(1.5 + 4.0j)
    assert m.tabulated([400 * nm, 600 * nm], [1.0, 2.0]).index(450 * nm) == pytest.approx(1.25)


@pytest.mark.parametrize("n", [0.0, -1.5, 1.5 - 0.1j, math.nan, math.inf])
def test_no_index(n):
    with pytest.raises(ValueError, match=r"constant index .*: expected n \+ i kappa with n, kappa >= 0, got"):
        m.constant(n)


@pytest.mark.parametrize("wavelength", [0.0, -1e-6, math.nan, math.inf])
def test_no_wavelength(wavelength):
    with pytest.raises(ValueError, match="vacuum: expected a positive wavelength, got"):
        m.VACUUM.index(wavelength)


def test_an_index_that_is_none():
    with pytest.raises(
        ValueError, match=r"Sellmeier: expected a finite index with kappa >= 0, got .*nan.* 1900 nm"
    ):
        m.sellmeier((1.0,), lengths=(2 * um,)).index(1.9 * um)
    with pytest.raises(ValueError, match=r"table: expected a finite index with kappa >= 0, got .* at 500 nm"):
        m.tabulated([400 * nm, 600 * nm], [1.5, 1.5], [-0.1, -0.1]).index(500 * nm)


@pytest.mark.parametrize("given", [{}, {"lengths": (1.0,)}, {"lengths": (1.0, 2.0), "squares": (1.0, 2.0)}])
def test_resonances_of_sellmeier(given):
    with pytest.raises(ValueError, match="expected lengths or squares, one for each of 2 strengths"):
        m.sellmeier((1.0, 2.0), **given)


def test_n_and_kappa_apart():
    n, kappa = m.GOLD.n, IndexFormula("exponential", (1.0, 1.0), (10.0, 20.0))
    with pytest.raises(ValueError, match="x: expected n and kappa over common wavelengths, got"):
        m.Material("x", n, kappa)


def test_materials_of_one_index_are_equal_whatever_their_name():
    assert m.constant(1.0) == m.constant(1.0, "vacuum")
    assert hash(m.constant(1.0)) == hash(m.constant(1.0, "vacuum"))
    assert m.constant(1.0) != m.constant(1.0 + 1e-9)
