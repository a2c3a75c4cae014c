"""The non-uniform FFT against all exponentials."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fringetrace.field import spectral_sum

WAVES = np.linspace(300e-9, 700e-9, 101)
COUNT = 200  # times 101 wavelengths: too many for the direct way to be chosen
EPS = np.finfo(float).eps


def rays(seed, span, count=COUNT, sets=()):
    rng = np.random.default_rng(seed)
    amplitude = rng.standard_normal((*sets, count)) + 1j * rng.standard_normal((*sets, count))
    return rng.uniform(-span, span, count), amplitude


@settings(max_examples=30)
@given(
    seed=st.integers(0, 2**32),
    span=st.floats(-9, -3).map(lambda power: 10.0**power),
    far=st.sampled_from([0.0, 1e-4, 0.3, -2.0]),
    tolerance=st.sampled_from([1e-12, 1e-8, 1e-3]),
)
def test_it_keeps_its_tolerance(seed, span, far, tolerance):
    """Beside that, lengths round to eps: 2 pi eps L / lambda of phase in each ray."""
    length, amplitude = rays(seed, span)
    length = length + far
    error = np.abs(
        spectral_sum.spectrum(length, amplitude, WAVES, tolerance)
        - spectral_sum.direct(length, amplitude, WAVES)
    )
    rounding = 4.0 * np.pi * EPS * np.abs(length).max() / WAVES.min() * np.sqrt(COUNT)
    assert (error < (tolerance + rounding) * np.linalg.norm(amplitude)).all()


def test_equal_lengths_and_one_wavelength():
    assert spectral_sum.spectrum(np.full(5000, 600e-9), np.ones(5000), 600e-9) == pytest.approx(
        5000.0, rel=1e-12
    )


def test_few_rays_are_summed_as_they_are():
    length, amplitude = rays(1, 1e-5, 8)
    assert np.array_equal(
        spectral_sum.spectrum(length, amplitude, WAVES), spectral_sum.direct(length, amplitude, WAVES)
    )


def test_the_direct_sum_is_the_sum(monkeypatch):
    length, amplitude = rays(2, 1e-6, 50)
    truth = np.array([(amplitude * np.exp(2j * np.pi * length / wave)).sum() for wave in WAVES])
    assert spectral_sum.direct(length, amplitude, WAVES) == pytest.approx(truth, rel=1e-12, abs=1e-12)
    monkeypatch.setattr(spectral_sum, "BLOCK", 700)
    assert spectral_sum.direct(length, amplitude, WAVES) == pytest.approx(truth, rel=1e-12, abs=1e-12)


def test_several_sets_at_once():
    length, amplitude = rays(3, 1e-5, sets=(2, 3))
    sums = spectral_sum.spectrum(length, amplitude, WAVES)
    assert sums.shape == (2, 3, 101)
    assert sums[1, 2] == pytest.approx(spectral_sum.spectrum(length, amplitude[1, 2], WAVES), rel=1e-9)


def test_no_rays():
    assert not spectral_sum.spectrum([], [], WAVES).any()


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"amplitude": np.ones(3)}, r"amplitude: expected shape \(..., n\) for lengths of shape \(n,\)"),
        ({"wavelengths": []}, r"wavelengths: expected numbers of shape \(w,\), got shape \(0,\)"),
        ({"wavelengths": [5e-7, -1.0]}, "wavelength: expected a positive length in metres, got .*-1"),
        ({"tolerance": 1e-16}, "tolerance: expected a number from 1e-13 to 0.1, got 1e-16"),
        ({"length": np.full(COUNT, np.nan)}, "length: expected finite lengths in metres"),
    ],
)
def test_what_is_refused(changed, message):
    length, amplitude = rays(4, 1e-5)
    given = {"length": length, "amplitude": amplitude, "wavelengths": WAVES} | changed
    with pytest.raises(ValueError, match=message):
        spectral_sum.spectrum(**given)
