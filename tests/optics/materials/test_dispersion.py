"""Formulas of refractive indices by their published coefficients, and tables."""

import math

import numpy as np
import pytest

from fringetrace.optics.materials.dispersion import FORMS, IndexFormula, IndexTable, checked_range

W = np.array([0.5, 1.0, 2.0])


def test_every_form_beside_its_formula():
    """Each with coefficients that all matter; written out once more, at one wavelength."""
    w = 0.8
    q = w * w
    herz = 1 / (q - 0.028)
    ratio = 0.2 + 0.1 * q / (q - 0.02) - 0.003 * q
    cases = {
        "constant": ((1.5,), 1.5),
        "formula 1": (
            (0.1, 0.7, 0.07, 0.4, 0.12), (1.1 + 0.7 * q / (q - 0.0049) + 0.4 * q / (q - 0.0144)) ** 0.5,
        ),
        "formula 2": (
            (0.1, 0.7, 0.07, 0.4, 0.12), (1.1 + 0.7 * q / (q - 0.07) + 0.4 * q / (q - 0.12)) ** 0.5,
        ),
        "formula 3": ((2.2, -0.01, 2.0, 0.02, -2.0), (2.2 - 0.01 * q + 0.02 / q) ** 0.5),
        "formula 4": (
            (2.2, 0.1, 2.0, 0.2, 2.0, 0.3, 0.0, 0.1, 1.0, -0.02, 2.0),
            (2.2 + 0.1 * q / (q - 0.04) + 0.3 / (q - 0.1) - 0.02 * q) ** 0.5,
        ),
        "formula 5": ((1.5, 0.005, -2.0, 0.0001, -4.0), 1.5 + 0.005 / q + 0.0001 / q**2),
        "formula 6": ((0.0, 0.058, 238.0, 0.0017, 57.0), 1 + 0.058 / (238 - 1 / q) + 0.0017 / (57 - 1 / q)),
        "formula 7": (
            (3.4, 0.15, 0.01, -1e-3, 1e-4, 2e-5),
            3.4 + 0.15 * herz + 0.01 * herz**2 - 1e-3 * q + 1e-4 * q**2 + 2e-5 * q**3,
        ),
        "formula 8": ((0.2, 0.1, 0.02, -0.003), ((1 + 2 * ratio) / (1 - ratio)) ** 0.5),
        "formula 9": (
            (2.5, 0.024, 0.03, 0.02, 1.52, 0.88),
            (2.5 + 0.024 / (q - 0.03) + 0.02 * (w - 1.52) / ((w - 1.52) ** 2 + 0.88)) ** 0.5,
        ),
        "exponential": ((0.56, 0.27), 0.56 * math.exp(-0.8 / 0.27)),
    }  # fmt: skip
    assert set(cases) == set(FORMS)
    for form, (coefficients, expected) in cases.items():
        got = IndexFormula(form, coefficients).at(np.full((2, 1), w))
        assert got.shape == (2, 1)
        assert got == pytest.approx(expected, rel=1e-14), form


def test_one_pole_of_formula_4():
    assert IndexFormula("formula 4", (2.2, 0.1, 2.0, 0.2, 2.0)).at(W) == pytest.approx(
        np.sqrt(2.2 + 0.1 * W**2 / (W**2 - 0.04)), rel=1e-14
    )


def test_no_index_within_a_resonance():
    assert np.isnan(IndexFormula("formula 2", (0.0, 1.0, 4.0)).at(np.array([1.9]))).all()


def test_tables_run_straight():
    table = IndexTable((0.4, 0.6, 1.0), (1.5, 1.4, 1.6))
    assert table.range == (0.4, 1.0)
    assert table.at(np.array([[0.4, 0.5], [0.8, 1.0]])) == pytest.approx(np.array([[1.5, 1.45], [1.5, 1.6]]))


@pytest.mark.parametrize(
    ("form", "coefficients", "limits", "message"),
    [
        ("formula 10", (1.0,), None, "expected one of constant, formula 1, .* got 'formula 10'"),
        ("formula 8", (1.0,), None, "dispersion formula 8: expected 4 coefficients, got 1"),
        ("formula 9", (1.0,) * 5, None, "dispersion formula 9: expected 6 coefficients, got 5"),
        ("formula 2", (1.0, 2.0), None, "expected 1, 3, 5, .* coefficients, got 2"),
        ("constant", (math.nan,), None, "dispersion constant: expected finite coefficients, got"),
        ("constant", (1.0,), (2.0, 1.0), "dispersion constant: expected a range from a positive .* got"),
    ],
)
def test_bad_formulas(form, coefficients, limits, message):
    with pytest.raises(ValueError, match=message):
        IndexFormula(form, coefficients, limits)


@pytest.mark.parametrize(
    ("wavelength", "value", "message"),
    [
        ((1.0,), (1.5,), "2 or more, got 1 and 1"),
        ((1.0, 2.0), (1.5,), "as many values as wavelengths, 2 or more, got 1 and 2"),
        ((1.0, 2.0, 2.0), (1.5,) * 3, "wavelengths that rise from above 0, got 2 in row 2"),
        ((0.0, 2.0), (1.5,) * 2, "wavelengths that rise from above 0, got 0 in row 0"),
        ((1.0, 2.0), (1.5, math.inf), "table: expected finite values, got inf"),
    ],
)
def test_bad_tables(wavelength, value, message):
    with pytest.raises(ValueError, match=message):
        IndexTable(wavelength, value)


def test_any_range_is_one_of_none():
    checked_range(None, "x")
    with pytest.raises(ValueError, match="x: expected a range"):
        checked_range((0.0, 1.0), "x")
