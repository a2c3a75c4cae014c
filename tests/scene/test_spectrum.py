"""Spectra and lines: what they refuse, and how many wavelengths a line takes."""

import math

import numpy as np
import pytest

from fringetrace import nm, um
from fringetrace.scene.spectrum import MOST, Line, Spectrum


def test_weights_are_shares():
    lamp = Spectrum([500 * nm, 600 * nm], [1, 3])
    np.testing.assert_array_equal(lamp.weights, [0.25, 0.75])
    np.testing.assert_allclose(lamp.coherence([0.0, 3 * um]), [1.0, 0.25 + 0.75], rtol=0, atol=1e-12)
    assert abs(lamp.coherence(1.5 * um)) == pytest.approx(0.5, abs=1e-12)  # 3 waves of one, 2.5 of the other


@pytest.mark.parametrize(
    ("wavelengths", "weights", "message"),
    [
        ([], [], "Spectrum: expected as many wavelengths as weights, at least one, got shapes"),
        ([500 * nm], [1.0, 1.0], "Spectrum: expected as many wavelengths as weights"),
        ([[500 * nm]], [[1.0]], "Spectrum: expected as many wavelengths as weights"),
        ([0.0], [1.0], "wavelength: expected a positive length"),
        ([500 * nm], [-1.0], "Spectrum weights: expected numbers of at least 0, not all 0, got"),
        ([500 * nm], [0.0], "Spectrum weights: expected numbers of at least 0, not all 0, got"),
        ([500 * nm], [math.nan], "Spectrum weights: expected numbers of at least 0, not all 0, got"),
    ],
)
def test_what_is_no_spectrum_is_refused(wavelengths, weights, message):
    with pytest.raises(ValueError, match=message):
        Spectrum(wavelengths, weights)


@pytest.mark.parametrize("width", [0.0, -1 * nm, math.inf, 400 * nm, "10 nm"])
def test_what_is_no_width_is_refused(width):
    with pytest.raises(ValueError, match="Line width: expected a positive length, a part of 550 nm, got"):
        Line(550 * nm, width)


def test_a_line_needs_a_wavelength():
    with pytest.raises(ValueError, match="wavelength: expected a positive length"):
        Line(-1.0, 1 * nm)


def test_the_width_is_that_at_half_maximum():
    """On the scale of wavenumbers, where the line is Gaussian: 2 sqrt(2 ln 2) standard deviations."""
    line = Line(550 * nm, 10 * nm)
    lamp = line.sampled(2000 * um)
    number = 1 / lamp.wavelengths
    half = number[lamp.weights >= 0.5 * lamp.weights.max()]
    assert np.ptp(half) == pytest.approx(10 * nm / (550 * nm) ** 2, abs=2 * abs(np.diff(number)).max())


def test_longer_paths_take_more_wavelengths():
    line = Line(550 * nm, 10 * nm)
    few, many = (len(line.sampled(path).wavelengths) for path in (0.0, 1 / line.spread))
    assert few < 20
    assert 8 < many - few < 16
    with pytest.raises(
        ValueError, match=f"Line: expected at most {MOST} wavelengths, got .* give a Spectrum"
    ):
        line.sampled(0.1)


@pytest.mark.parametrize("path", [-1.0, math.nan])
def test_a_path_that_is_none_is_refused(path):
    with pytest.raises(ValueError, match="Line path: expected a length of at least 0 in metres, got"):
        Line(550 * nm, 1 * nm).sampled(path)


@pytest.mark.parametrize("error", [0.0, 1.0])
def test_an_error_that_is_none_is_refused(error):
    with pytest.raises(ValueError, match="Line error: expected a number between 0 and 1, got"):
        Line(550 * nm, 1 * nm).sampled(0.0, error)
