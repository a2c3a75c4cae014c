"""Phase stepping: every algorithm, its edges, and every refusal."""

import math

import numpy as np
import pytest
from angles import turned
from hypothesis import given, settings, strategies as st

from fringetrace import phase
from fringetrace.phase import stepping

# Known steps of the algorithms, in degrees.
STEPS = {
    stepping.four_step: [0, 90, 180, 270],
    stepping.three_step: [-120, 0, 120],
    stepping.hariharan: [-180, -90, 0, 90, 180],
    stepping.carre: [-165, -55, 55, 165],
    stepping.stoilov: [-180, -90, 0, 90, 180],
    stepping.n_bucket: [0, 72, 144, 216, 288],
}
ALGORITHMS = pytest.mark.parametrize("algorithm", STEPS, ids=lambda algorithm: algorithm.__name__)
# A frame is rounded to eps of its size A + B, and the algorithms divide sums of a few by B: with
# the modulations used here, B > 0.01 (A + B), that is 100 eps times a few.
ANGLE = 1e-12
# Carre and Stoilov take the square root of a difference: eps/modulation becomes its square root
# where sin phi is 0, so the phase is off by 1e-7 there at the worst.
ROOT_ANGLE = 3e-7


def fringes(phi, steps, mean=1.0, amplitude=0.8):
    """Frames A + B cos(phi + alpha_k) for steps in degrees."""
    alpha = np.radians(steps).reshape(-1, *(1,) * np.ndim(phi))
    return mean + amplitude * np.cos(phi + alpha)


angles = st.floats(-math.pi, math.pi)
means = st.floats(1e-3, 1e6)
visibilities = st.floats(0.02, 1.0)


@ALGORITHMS
@settings(max_examples=60, deadline=None)
@given(phi=angles, mean=means, visibility=visibilities)
def test_every_algorithm_recovers_any_phase(algorithm, phi, mean, visibility):
    found = algorithm(fringes(phi, STEPS[algorithm], mean, visibility * mean))
    allowed = ROOT_ANGLE if algorithm in (stepping.carre, stepping.stoilov) else ANGLE
    assert turned(found - phi) < allowed
    assert -math.pi < found <= math.pi


@settings(max_examples=100, deadline=None)
@given(phi=angles, step=st.floats(20.0, 70.0))
def test_carre_needs_no_known_step(phi, step):
    found = stepping.carre(fringes(phi, np.array([-3, -1, 1, 3]) * step))
    assert turned(found - phi) < ROOT_ANGLE


@settings(max_examples=100, deadline=None)
@given(phi=angles, step=st.floats(20.0, 160.0))
def test_stoilov_needs_no_known_step(phi, step):
    found = stepping.stoilov(fringes(phi, np.array([-2, -1, 0, 1, 2]) * step))
    assert turned(found - phi) < ROOT_ANGLE


@settings(max_examples=60, deadline=None)
@given(phi=angles, jitter=st.lists(st.floats(-20.0, 20.0), min_size=7, max_size=7))
def test_least_squares_takes_any_known_steps(phi, jitter):
    steps = np.arange(7) * 51.0 + jitter
    assert turned(stepping.least_squares(fringes(phi, steps), np.radians(steps)) - phi) < ANGLE


@settings(max_examples=60, deadline=None)
@given(phi=angles, mean=means, visibility=st.floats(0.0, 1.0), count=st.integers(3, 12))
def test_n_bucket_and_modulation_for_any_number_of_frames(phi, mean, visibility, count):
    frames = fringes(phi, 360.0 * np.arange(count) / count, mean, visibility * mean)
    assert stepping.modulation(frames) == pytest.approx(visibility, abs=ANGLE)
    if visibility > 0.02:
        assert turned(stepping.n_bucket(frames) - phi) < ANGLE


def test_n_bucket_with_four_frames_is_four_step():
    frames = fringes(np.linspace(-3, 3, 50), [0, 90, 180, 270])
    np.testing.assert_allclose(stepping.n_bucket(frames), stepping.four_step(frames), rtol=0, atol=ANGLE)


def test_least_squares_with_equal_steps_is_n_bucket():
    frames = np.random.default_rng(2).uniform(size=(8, 30))  # noise: no model fits
    steps = 2 * math.pi * np.arange(8) / 8
    np.testing.assert_allclose(
        stepping.least_squares(frames, steps), stepping.n_bucket(frames), rtol=0, atol=ANGLE
    )


@ALGORITHMS
def test_shapes_pass_through(algorithm):
    phi = np.linspace(-3.0, 3.0, 24).reshape(2, 3, 4)
    frames = fringes(phi, STEPS[algorithm])
    found = algorithm(frames)
    assert found.shape == (2, 3, 4)
    assert found.dtype == np.float64
    assert algorithm(frames[:, 0, 0, 0]).shape == ()
    assert algorithm(frames[:, 0, 0, 0]) == found[0, 0, 0]


def test_camera_frames_of_unsigned_integers_do_not_wrap_around():
    frames = np.array([[10], [200], [30], [40]], dtype=np.uint8)
    assert stepping.four_step(frames)[0] == math.atan2(40 - 200, 10 - 30)


@ALGORITHMS
@pytest.mark.parametrize("level", [0.0, 1.0, 0.1, 1e9, 1.0 / 3.0])
def test_no_modulation_is_no_phase(algorithm, level):
    assert np.isnan(algorithm(np.full((len(STEPS[algorithm]), 3), level))).all()


def test_no_modulation_is_no_phase_in_least_squares():
    assert np.isnan(stepping.least_squares(np.full((4, 3), 0.1), [0.0, 1.0, 2.0, 4.0])).all()


@ALGORITHMS
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_frames_that_are_not_finite_spoil_their_pixel_only(algorithm, bad):
    frames = fringes(np.array([0.7, 0.7, 0.7]), STEPS[algorithm])
    frames[:2, 1] = bad
    assert np.isnan(algorithm(frames)).tolist() == [False, True, False]


@ALGORITHMS
def test_half_a_turn_is_plus_pi(algorithm):
    for phi in (math.pi, -math.pi):
        frames = np.round(fringes(phi, STEPS[algorithm]), 15)
        found = algorithm(frames)
        assert turned(found - math.pi) < ROOT_ANGLE
        assert -math.pi < found <= math.pi
    assert stepping.four_step([0.0, 1.0, 2.0, 1.0]) == math.pi
    assert stepping.n_bucket([0.0, 1.0, 2.0, 1.0]) > 0.0


def test_noise_across_sin_phi_0_is_no_phase_lost():
    frames = fringes(np.zeros(2000), STEPS[stepping.carre])
    frames += 1e-3 * np.random.default_rng(5).standard_normal(frames.shape)
    assert turned(stepping.carre(frames)).max() < 0.01
    frames = fringes(np.full(2000, math.pi), STEPS[stepping.stoilov])
    frames += 1e-3 * np.random.default_rng(6).standard_normal(frames.shape)
    assert turned(stepping.stoilov(frames) - math.pi).max() < 0.01


def test_modulation_of_a_dark_pixel_is_unknown():
    frames = fringes(np.zeros(3), [0, 90, 180, 270])
    frames[:, 1] = 0.0
    frames[:, 2] -= 5.0
    assert np.isnan(stepping.modulation(frames)).tolist() == [False, True, True]


@ALGORITHMS
def test_number_of_frames_is_checked(algorithm):
    expected = "3 or more" if algorithm is stepping.n_bucket else str(len(STEPS[algorithm]))
    for shape in [(2, 4, 4), (0, 4), ()]:
        with pytest.raises(
            ValueError, match=rf"{algorithm.__name__} frames: expected {expected} along .*got"
        ):
            algorithm(np.zeros(shape))


def test_one_frame_too_many_is_refused():
    with pytest.raises(ValueError, match=r"four_step frames: expected 4 .* got 5 \(shape \(5, 2\)\)"):
        stepping.four_step(np.zeros((5, 2)))


@pytest.mark.parametrize("function", [*STEPS, stepping.modulation], ids=lambda function: function.__name__)
def test_complex_frames_are_refused(function):
    with pytest.raises(
        ValueError, match=r"frames: expected real intensities, got complex numbers; take \|E\|"
    ):
        function(np.zeros((4, 2), dtype=complex))


@pytest.mark.parametrize("steps", [[0.0, 1.0], [[0.0], [1.0], [2.0]], [0.0, 1.0, np.nan], [0.0, 1.0, np.inf]])
def test_least_squares_wants_one_step_a_frame(steps):
    with pytest.raises(ValueError, match="least_squares steps: expected 3 finite angles in radians"):
        stepping.least_squares(np.zeros((3, 2)), steps)


@pytest.mark.parametrize("steps", [[0.0, 0.0, 0.0], [0.0, math.pi, 2 * math.pi], [1.0, 2.0, 1.0]])
def test_least_squares_wants_three_different_steps(steps):
    with pytest.raises(ValueError, match="least_squares steps: expected three different angles"):
        stepping.least_squares(np.zeros((3, 2)), steps)


def test_least_squares_and_modulation_want_three_frames():
    with pytest.raises(ValueError, match="least_squares frames: expected 3 or more"):
        stepping.least_squares(np.zeros((2, 2)), [0.0, 1.0])
    with pytest.raises(ValueError, match="modulation frames: expected 3 or more"):
        stepping.modulation(np.zeros((2, 2)))


def test_the_algorithms_are_found_with_the_rest_of_phase():
    named = [
        name
        for name, thing in vars(stepping).items()
        if getattr(thing, "__module__", "") == stepping.__name__
    ]
    public = {name for name in named if not name.startswith("_")}
    assert public <= set(phase.__all__)
    for name in public:
        assert getattr(phase, name) is getattr(stepping, name)
