"""Phase stepping against closed forms: systematic errors of the algorithms, and noise."""

import math

import numpy as np
import pytest

from fringetrace import phase

CARRE = np.array([-3, -1, 1, 3])
FIVE = np.array([-2, -1, 0, 1, 2])
FRAMES = {
    "four_step": (phase.four_step, 90.0 * np.arange(4)),
    "three_step": (phase.three_step, 120.0 * np.array([-1, 0, 1])),
    "hariharan": (phase.hariharan, 90.0 * FIVE),
    "eight_bucket": (phase.n_bucket, 45.0 * np.arange(8)),
    "carre_110": (phase.carre, 55.0 * CARRE),
    "carre_90": (phase.carre, 45.0 * CARRE),
    "stoilov_90": (phase.stoilov, 90.0 * FIVE),
}
# One turn of phases, none of them special to an algorithm.
PHASES = 2.0 * math.pi * (np.arange(20001) + 0.123) / 20001
# The tabulated numbers have this many digits after the point.
PRINTED = 0.51e-8
PEAK = 0.51e-6
# Frames are rounded to eps; Carre and Stoilov take the root of differences of them (see below).
EXACT = 1e-13
ROOT = 1e-7


def fringes(steps, phi, mean=1.0, amplitude=0.8):
    return mean + amplitude * np.cos(phi + np.radians(np.asarray(steps, dtype=float))[:, None])


def errors(name, frames):
    algorithm, _ = FRAMES[name]
    return phase.wrap(algorithm(frames) - PHASES)


def miscalibrated(name, part):
    """Peak error without its mean, and the mean, when every step is wrong by one part."""
    found = errors(name, fringes(FRAMES[name][1] * (1.0 + part), PHASES))
    return np.abs(found - found.mean()).max(), found.mean()


def test_frames_of_a_known_phase():
    frames = fringes(90 * np.arange(4), np.array([0.7]))
    np.testing.assert_allclose(
        frames[:, 0], [1.61187375, 0.48462585, 0.38812625, 1.51537415], rtol=0, atol=PRINTED
    )
    assert phase.four_step(frames)[0] == pytest.approx(0.7, rel=1e-15, abs=0.0)
    frames = fringes(55 * CARRE, np.array([0.7]))
    np.testing.assert_allclose(
        frames[:, 0], [0.54236399, 1.77312615, 0.92878658, 0.2755867], rtol=0, atol=PRINTED
    )
    assert phase.carre(frames)[0] == pytest.approx(0.7, rel=1e-14, abs=0.0)


# Reference values computed independently, to six digits after the point.
@pytest.mark.parametrize(
    ("name", "peaks", "mean_at_5_percent"),
    [
        ("four_step", (0.007854, 0.039300, 0.078783), 0.117810),
        ("three_step", (0.012166, 0.062444, 0.129566), 0.0),
        ("hariharan", (0.000062, 0.001544, 0.006194), 0.0),
        ("eight_bucket", (0.005532, 0.027240, 0.053489), 0.137445),
    ],
)
def test_wrong_steps(name, peaks, mean_at_5_percent):
    found = [miscalibrated(name, part) for part in (0.01, 0.05, 0.10)]
    np.testing.assert_allclose([peak for peak, _ in found], peaks, rtol=0, atol=PEAK)
    assert found[1][1] == pytest.approx(mean_at_5_percent, abs=PEAK)


@pytest.mark.parametrize("name", ["carre_110", "carre_90", "stoilov_90"])
@pytest.mark.parametrize("part", [-0.10, 0.01, 0.05, 0.10])
def test_carre_and_stoilov_do_not_mind_wrong_steps(name, part):
    peak, mean = miscalibrated(name, part)
    # where sin phi is s, the frames' eps becomes eps / s: at 20001 phases s is 4e-5 at the least
    assert peak < ROOT
    assert abs(mean) < EXACT


@pytest.mark.parametrize("part", [1e-3, 1e-2])
def test_law_of_the_four_step_error(part):
    # error e a step: a piston of 1.5 e, and a ripple of e/2 in 2 phi
    step_error = 0.5 * math.pi * part
    peak, mean = miscalibrated("four_step", part)
    second_order = step_error**2
    assert abs(mean - 1.5 * step_error) < second_order
    assert abs(peak - 0.5 * step_error) < second_order


@pytest.mark.parametrize("part", [-0.10, 0.02, 0.10])
def test_law_of_the_hariharan_error(part):
    # exactly tan phi' = tan phi / sin step: numerator and denominator shrink by sin and sin^2
    step = 0.5 * math.pi * (1.0 + part)
    expected = np.arctan2(np.sin(PHASES), np.cos(PHASES) * math.sin(step))
    found = phase.hariharan(fringes(FRAMES["hariharan"][1] * (1.0 + part), PHASES))
    assert np.abs(phase.wrap(found - expected)).max() < EXACT


def test_least_squares_knows_the_wrong_steps():
    steps = 90.0 * np.arange(4) * 1.1
    found = phase.least_squares(fringes(steps, PHASES), np.radians(steps))
    assert np.abs(phase.wrap(found - PHASES)).max() < EXACT


def test_quadratic_drift_of_the_steps():
    k = np.arange(4)
    found = errors("four_step", fringes(90.0 * k * (1.0 + 0.02 * k / 4), PHASES))
    assert np.abs(found - found.mean()).max() == pytest.approx(0.01178, abs=0.51e-5)


# Peak error when the detector shows I + 0.1 I^2 or I + 0.1 I^3, A = B = 0.5.
# Zeros are exact: the harmonic that the detector adds cancels in the sums.
@pytest.mark.parametrize(
    ("name", "square", "cube"),
    [
        ("four_step", 0.0, 0.00571),
        ("hariharan", 0.0, 0.00571),
        ("stoilov_90", 0.0, 0.00571),
        ("eight_bucket", 0.0, 0.0),
        ("three_step", 0.0227, 0.0343),
        ("carre_110", 0.0210, None),
        ("carre_90", 0.0259, None),
    ],
)
def test_detector_that_is_not_linear(name, square, cube):
    frames = fringes(FRAMES[name][1], PHASES, 0.5, 0.5)
    for power, peak in ((2, square), (3, cube)):
        if peak is None:
            continue
        found = np.abs(errors(name, frames + 0.1 * frames**power)).max()
        printed = 0.51e-5 if peak < 0.01 else 0.51e-4
        assert found == pytest.approx(peak, abs=printed if peak else ROOT)


def carre_noise(step):
    """First-order noise factor of Carre's phase, averaged over phi.

    d phi = (cos phi dn - sin phi dd) / D with D = 8 sin^2 a cos a, d = (-1, 1, 1, -1) and
    n = (cot a (-1, 3, -3, 1) + tan a (1, 1, -1, -1)) / 2, the derivatives of the two parts.
    """
    a = math.radians(step)
    numerator = 0.5 * (np.array([-1, 3, -3, 1]) / math.tan(a) + np.array([1, 1, -1, -1]) * math.tan(a))
    scale = 8.0 * math.sin(a) ** 2 * math.cos(a)
    return math.sqrt(0.5 * ((numerator**2).sum() + 4.0)) / scale


SIGMA = 1e-3  # noise over modulation: the second order is a part in a thousand of the first
SAMPLES = 200_000


@pytest.mark.parametrize(
    ("name", "factor", "printed"),
    [
        ("four_step", math.sqrt(2 / 4), 0.7071),
        ("three_step", math.sqrt(2 / 3), 0.8165),
        ("eight_bucket", math.sqrt(2 / 8), 0.5),
        ("hariharan", math.sqrt(7 / 16), 0.6614),
        ("carre_110", carre_noise(55.0), 0.743),
        ("carre_90", carre_noise(45.0), 0.865),
        ("stoilov_90", math.sqrt(7 / 16), 0.66),
    ],
)
def test_noise(name, factor, printed):
    algorithm, steps = FRAMES[name]
    rng = np.random.default_rng(20260101)
    phi = rng.uniform(-math.pi, math.pi, SAMPLES)
    frames = fringes(steps, phi) + 0.8 * SIGMA * rng.standard_normal((len(steps), SAMPLES))
    rms = np.sqrt(np.mean(phase.wrap(algorithm(frames) - phi) ** 2)) / SIGMA
    # an rms of n samples is known to 1/sqrt(2n) of itself; Carre's and Stoilov's errors are larger
    # where sin phi is 0 and the first order fails: another part in a hundred
    statistics = 5.0 / math.sqrt(2 * SAMPLES)
    assert rms == pytest.approx(
        factor, rel=statistics + (0.01 if "_90" in name or "_110" in name else 0.0), abs=0.0
    )
    assert factor == pytest.approx(printed, rel=0.01, abs=0.0)
