"""Two wavelengths and spatial unwrapping, against closed forms and probabilities."""

import math

import numpy as np
import pytest
from scipy.special import erfc

from fringetrace import nm, phase, um

SHORT, LONG = 611.97 * nm, 632.8 * nm
# h is computed from numbers of some Lambda, each rounded a few times: relative to Lambda / 4.
EXACT = 1e-14


def beat_of(l1, l2):
    return l1 * l2 / abs(l1 - l2)


def wrapped(height, wavelength):
    return np.angle(np.exp(4j * math.pi * height / wavelength))


@pytest.mark.parametrize(
    ("other", "micrometres"), [(611.97, 18.591196), (532.0, 3.339778), (543.5, 3.851364), (594.1, 9.714379)]
)
def test_synthetic_wavelength(other, micrometres):
    found = phase.synthetic_wavelength(632.8 * nm, other * nm)
    assert found == pytest.approx(micrometres * um, abs=0.51e-6 * um)
    assert phase.synthetic_wavelength(other * nm, 632.8 * nm) == pytest.approx(found, rel=1e-15, abs=0.0)


def test_synthetic_wavelength_over_the_finer_one():
    assert phase.synthetic_wavelength(SHORT, LONG) / SHORT == pytest.approx(30.379, abs=0.51e-3)


def test_sodium_lines_beat_in_a_michelson():
    # the contrast returns after a mirror travel of half the synthetic wavelength
    travel = 0.5 * phase.synthetic_wavelength(588.995 * nm, 589.592 * nm)
    assert travel == pytest.approx(290.843166 * um, abs=0.51e-6 * um)


@pytest.mark.parametrize("pair", [(SHORT, LONG), (LONG, SHORT), (532 * nm, LONG), (LONG, 594.1 * nm)])
def test_heights_without_noise(pair):
    beat = beat_of(*pair)
    height = 0.25 * beat * np.linspace(-0.999, 0.999, 4001)
    found = phase.two_wavelength(wrapped(height, pair[0]), wrapped(height, pair[1]), *pair)
    assert np.abs(found - height).max() < EXACT * 0.25 * beat


def test_heights_repeat_after_half_the_synthetic_wavelength():
    beat = beat_of(SHORT, LONG)
    height = 0.3 * beat
    found = phase.two_wavelength(wrapped(height, SHORT), wrapped(height, LONG), SHORT, LONG)
    # both fringe systems do not repeat at once: the nearest order of the fine one, half a fringe off at most
    assert abs(found - (height - 0.5 * beat)) < 0.25 * SHORT


def test_a_step_too_high_for_one_wavelength():
    height = np.where(np.arange(100) < 50, 0.0, 2.0 * um)[None, :].repeat(20, axis=0)
    found = phase.two_wavelength(wrapped(height, SHORT), wrapped(height, LONG), SHORT, LONG)
    np.testing.assert_allclose(found, height, rtol=0, atol=EXACT * 4 * um)
    alone = phase.height(phase.unwrap(wrapped(height, SHORT)), SHORT)
    # spatial unwrapping alone loses whole half waves of it
    lost = (np.ptp(height) - np.ptp(alone)) / (0.5 * SHORT)
    assert round(lost) != 0


def test_two_wavelength_keeps_shapes_and_nan():
    phases = np.zeros((3, 4))
    phases[1, 2] = np.nan
    found = phase.two_wavelength(phases, 0.1, SHORT, LONG)
    assert found.shape == (3, 4)
    assert np.isnan(found).sum() == 1
    assert np.isnan(found[1, 2])


SAMPLES = 400_000


def noisy_heights(sigma, pair):
    rng = np.random.default_rng(20260102)
    height = 0.2 * beat_of(*pair) * rng.uniform(-1.0, 1.0, SAMPLES)
    first, second = (wrapped(height, each) + sigma * rng.standard_normal(SAMPLES) for each in pair)
    return height, phase.two_wavelength(first, second, *pair)


@pytest.mark.parametrize("pair", [(SHORT, LONG), (LONG, SHORT)])
@pytest.mark.parametrize(
    ("sigma", "printed"), [(0.01, 0.0), (0.02, 0.00020), (0.03, 0.01322), (0.05, 0.13708), (0.10, 0.457)]
)
def test_probability_of_a_wrong_order(pair, sigma, printed):
    beat = beat_of(*pair)
    q = math.hypot(beat / SHORT - 1.0, beat / SHORT)
    probability = erfc(math.pi / (math.sqrt(2.0) * sigma * q))
    assert probability == pytest.approx(printed, abs=0.51e-5 if sigma < 0.1 else 0.51e-3)
    height, found = noisy_heights(sigma, pair)
    failures = np.mean(np.abs(found - height) > 0.25 * SHORT)
    spread = math.sqrt(probability * (1.0 - probability) / SAMPLES)
    assert abs(failures - probability) <= 5.0 * spread


def test_noise_of_coarse_and_fine_heights():
    sigma = 0.01
    assert phase.height(sigma, SHORT) == pytest.approx(0.4870 * nm, abs=0.51e-4 * nm)
    coarse = math.sqrt(2.0) * phase.height(sigma, beat_of(SHORT, LONG))
    assert coarse == pytest.approx(20.92 * nm, abs=0.51e-2 * nm)
    height, found = noisy_heights(sigma, (SHORT, LONG))
    rms = np.sqrt(np.mean((found - height) ** 2))
    assert rms == pytest.approx(sigma * SHORT / (4.0 * math.pi), rel=5.0 / math.sqrt(2 * SAMPLES), abs=0.0)


def test_one_hundredth_of_a_radian_is_half_a_nanometre():
    assert phase.height(0.01, 632.8 * nm) == pytest.approx(0.50 * nm, abs=0.005 * nm)


def bump(peak):
    rows, columns = np.indices((200, 200)) - 99.5
    return peak * np.exp(-0.5 * (rows**2 + columns**2) / 40.0**2)


@pytest.mark.parametrize(("peak", "steepest"), [(30.0, 0.455), (80.0, 1.213), (200.0, 3.032)])
def test_unwrapping_a_smooth_bump(peak, steepest):
    true = bump(peak)
    assert np.abs(np.diff(true)).max() == pytest.approx(steepest, abs=0.51e-3)
    found = phase.unwrap(np.angle(np.exp(1j * true)))
    difference = found - true
    piston = 2.0 * math.pi * np.rint(difference.mean() / (2.0 * math.pi))
    # whole turns are added to numbers of the size of the peak: a few units in its last place
    assert np.abs(difference - piston).max() < 4.0 * np.spacing(peak)


# Measured for scikit-image's algorithm on this bump: 1.4 % of the pixels in wrong turns. The
# noise is another one, the fraction varies by some tenths.
WRONG = (0.005, 0.03)


def test_unwrapping_under_noise_where_the_phase_is_steep():
    true = bump(200.0) + 0.3 * np.random.default_rng(1).standard_normal((200, 200))
    turns = np.rint((phase.unwrap(np.angle(np.exp(1j * true))) - true) / (2.0 * math.pi))
    wrong = np.mean(turns != np.median(turns))
    assert WRONG[0] < wrong < WRONG[1]
    # and where it is not steep, noise of 0.3 rad does no harm
    gentle = true - bump(200.0) + bump(80.0)
    turns = np.rint((phase.unwrap(np.angle(np.exp(1j * gentle))) - gentle) / (2.0 * math.pi))
    assert np.ptp(turns) == 0.0
