"""Phase stepping, unwrapping, heights: the interface, the edges, and every refusal."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fringetrace import nm, phase

# Known steps of the algorithms, in degrees.
STEPS = {
    phase.four_step: [0, 90, 180, 270],
    phase.three_step: [-120, 0, 120],
    phase.hariharan: [-180, -90, 0, 90, 180],
    phase.carre: [-165, -55, 55, 165],
    phase.stoilov: [-180, -90, 0, 90, 180],
    phase.n_bucket: [0, 72, 144, 216, 288],
}
ALGORITHMS = pytest.mark.parametrize("algorithm", STEPS, ids=lambda algorithm: algorithm.__name__)
# A frame is rounded to eps of its size A + B, and the algorithms divide sums of a few by B: with
# the modulations used here, B > 0.01 (A + B), that is 100 eps times a few.
ANGLE = 1e-12
# Carre and Stoilov take the square root of a difference: eps/modulation becomes its square root
# where sin phi is 0, so the phase is off by 1e-7 there at the worst.
ROOT_ANGLE = 3e-7


def turned(difference):
    """Difference of angles modulo 2 pi, as a magnitude (independent of phase.wrap)."""
    return np.abs(np.angle(np.exp(1j * np.asarray(difference))))


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
    allowed = ROOT_ANGLE if algorithm in (phase.carre, phase.stoilov) else ANGLE
    assert turned(found - phi) < allowed
    assert -math.pi < found <= math.pi


@settings(max_examples=100, deadline=None)
@given(phi=angles, step=st.floats(20.0, 70.0))
def test_carre_needs_no_known_step(phi, step):
    found = phase.carre(fringes(phi, np.array([-3, -1, 1, 3]) * step))
    assert turned(found - phi) < ROOT_ANGLE


@settings(max_examples=100, deadline=None)
@given(phi=angles, step=st.floats(20.0, 160.0))
def test_stoilov_needs_no_known_step(phi, step):
    found = phase.stoilov(fringes(phi, np.array([-2, -1, 0, 1, 2]) * step))
    assert turned(found - phi) < ROOT_ANGLE


@settings(max_examples=60, deadline=None)
@given(phi=angles, jitter=st.lists(st.floats(-20.0, 20.0), min_size=7, max_size=7))
def test_least_squares_takes_any_known_steps(phi, jitter):
    steps = np.arange(7) * 51.0 + jitter
    assert turned(phase.least_squares(fringes(phi, steps), np.radians(steps)) - phi) < ANGLE


@settings(max_examples=60, deadline=None)
@given(phi=angles, mean=means, visibility=st.floats(0.0, 1.0), count=st.integers(3, 12))
def test_n_bucket_and_modulation_for_any_number_of_frames(phi, mean, visibility, count):
    frames = fringes(phi, 360.0 * np.arange(count) / count, mean, visibility * mean)
    assert phase.modulation(frames) == pytest.approx(visibility, abs=ANGLE)
    if visibility > 0.02:
        assert turned(phase.n_bucket(frames) - phi) < ANGLE


def test_n_bucket_with_four_frames_is_four_step():
    frames = fringes(np.linspace(-3, 3, 50), [0, 90, 180, 270])
    np.testing.assert_allclose(phase.n_bucket(frames), phase.four_step(frames), rtol=0, atol=ANGLE)


def test_least_squares_with_equal_steps_is_n_bucket():
    frames = np.random.default_rng(2).uniform(size=(8, 30))  # noise: no model fits
    steps = 2 * math.pi * np.arange(8) / 8
    np.testing.assert_allclose(phase.least_squares(frames, steps), phase.n_bucket(frames), rtol=0, atol=ANGLE)


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
    assert phase.four_step(frames)[0] == math.atan2(40 - 200, 10 - 30)


@ALGORITHMS
@pytest.mark.parametrize("level", [0.0, 1.0, 0.1, 1e9, 1.0 / 3.0])
def test_no_modulation_is_no_phase(algorithm, level):
    assert np.isnan(algorithm(np.full((len(STEPS[algorithm]), 3), level))).all()


def test_no_modulation_is_no_phase_in_least_squares():
    assert np.isnan(phase.least_squares(np.full((4, 3), 0.1), [0.0, 1.0, 2.0, 4.0])).all()


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
    assert phase.four_step([0.0, 1.0, 2.0, 1.0]) == math.pi
    assert phase.n_bucket([0.0, 1.0, 2.0, 1.0]) > 0.0


def test_noise_across_sin_phi_0_is_no_phase_lost():
    frames = fringes(np.zeros(2000), STEPS[phase.carre])
    frames += 1e-3 * np.random.default_rng(5).standard_normal(frames.shape)
    assert turned(phase.carre(frames)).max() < 0.01
    frames = fringes(np.full(2000, math.pi), STEPS[phase.stoilov])
    frames += 1e-3 * np.random.default_rng(6).standard_normal(frames.shape)
    assert turned(phase.stoilov(frames) - math.pi).max() < 0.01


def test_modulation_of_a_dark_pixel_is_unknown():
    frames = fringes(np.zeros(3), [0, 90, 180, 270])
    frames[:, 1] = 0.0
    frames[:, 2] -= 5.0
    assert np.isnan(phase.modulation(frames)).tolist() == [False, True, True]


@ALGORITHMS
def test_number_of_frames_is_checked(algorithm):
    expected = "3 or more" if algorithm is phase.n_bucket else str(len(STEPS[algorithm]))
    for shape in [(2, 4, 4), (0, 4), ()]:
        with pytest.raises(
            ValueError, match=rf"{algorithm.__name__} frames: expected {expected} along .*got"
        ):
            algorithm(np.zeros(shape))


def test_one_frame_too_many_is_refused():
    with pytest.raises(ValueError, match=r"four_step frames: expected 4 .* got 5 \(shape \(5, 2\)\)"):
        phase.four_step(np.zeros((5, 2)))


@pytest.mark.parametrize("function", [*STEPS, phase.modulation], ids=lambda function: function.__name__)
def test_complex_frames_are_refused(function):
    with pytest.raises(
        ValueError, match=r"frames: expected real intensities, got complex numbers; take \|E\|"
    ):
        function(np.zeros((4, 2), dtype=complex))


@pytest.mark.parametrize("steps", [[0.0, 1.0], [[0.0], [1.0], [2.0]], [0.0, 1.0, np.nan], [0.0, 1.0, np.inf]])
def test_least_squares_wants_one_step_a_frame(steps):
    with pytest.raises(ValueError, match="least_squares steps: expected 3 finite angles in radians"):
        phase.least_squares(np.zeros((3, 2)), steps)


@pytest.mark.parametrize("steps", [[0.0, 0.0, 0.0], [0.0, math.pi, 2 * math.pi], [1.0, 2.0, 1.0]])
def test_least_squares_wants_three_different_steps(steps):
    with pytest.raises(ValueError, match="least_squares steps: expected three different angles"):
        phase.least_squares(np.zeros((3, 2)), steps)


def test_least_squares_and_modulation_want_three_frames():
    with pytest.raises(ValueError, match="least_squares frames: expected 3 or more"):
        phase.least_squares(np.zeros((2, 2)), [0.0, 1.0])
    with pytest.raises(ValueError, match="modulation frames: expected 3 or more"):
        phase.modulation(np.zeros((2, 2)))


@settings(max_examples=200, deadline=None)
@given(st.floats(-1e4, 1e4))
def test_wrap(angle):
    wrapped = float(phase.wrap(angle))
    assert -math.pi < wrapped <= math.pi
    # np.angle(np.exp) loses a unit in the last place of the unwrapped angle
    assert turned(wrapped - angle) <= 1e-15 + 2e-16 * abs(angle)


@settings(deadline=None)
@given(st.floats(-math.pi, math.pi, exclude_min=True))
def test_wrap_leaves_wrapped_phases_alone(angle):
    assert phase.wrap(angle) == angle


def test_wrap_at_its_edges():
    below = math.nextafter(math.pi, 0.0)
    found = phase.wrap([math.pi, -math.pi, -below, below, 3 * math.pi, np.nan, 2 * math.pi])
    np.testing.assert_array_equal(found[:4], [math.pi, math.pi, -below, below])
    assert turned(found[4] - math.pi) < 1e-15
    assert np.isnan(found[5])
    assert found[6] == 0.0


def bump(peak, shape=(60, 50), width=12.0):
    rows, columns = np.indices(shape)
    r2 = (rows - 0.5 * shape[0]) ** 2 + (columns - 0.5 * shape[1]) ** 2
    return peak * np.exp(-0.5 * r2 / width**2)


# Whole turns are added to a phase of up to some tens of radians: a few units in its last place.
TURNS = 1e-13


def whole_turns(difference):
    """The one number of turns that the whole of a map is off by."""
    turns = difference / (2.0 * math.pi)
    assert np.abs(turns - np.rint(turns)).max() < TURNS
    assert np.ptp(np.rint(turns)) == 0.0
    return float(np.rint(turns).flat[0])


def test_unwrap_keeps_the_piston_near_zero():
    true = bump(20.0)
    found = phase.unwrap(phase.wrap(true))
    whole_turns(found - true)
    assert abs(found.mean()) <= math.pi


def test_unwrap_leaves_a_continuous_map_alone():
    true = phase.remove_mean(bump(3.0))
    assert whole_turns(phase.unwrap(true) - true) == 0.0


def test_unwrap_accepts_phases_outside_a_turn():
    true = bump(20.0)
    np.testing.assert_allclose(
        phase.unwrap(true + 14.0), phase.unwrap(phase.wrap(true + 14.0)), rtol=0, atol=TURNS * 7
    )


def test_unwrap_around_holes_and_masks():
    true = bump(20.0)
    row, column = np.indices(true.shape)
    holes = (row % 4 == 1) & (column % 3 == 1) | (np.hypot(row - 20, column - 30) < 6)
    wrapped = phase.wrap(true)
    found = phase.unwrap(np.where(holes, np.nan, wrapped))
    assert np.isnan(found[holes]).all()
    whole_turns((found - true)[~holes])
    np.testing.assert_array_equal(phase.unwrap(np.where(holes, 1e5, wrapped), mask=holes), found)
    np.testing.assert_array_equal(phase.unwrap(np.where(holes, np.inf, wrapped)), found)


def test_unwrap_joins_separate_regions_by_the_nearest_turn():
    true = np.zeros((20, 41))
    true[:, 21:] = 2.5  # a step that is within half a turn
    wrapped = phase.wrap(true + 3.0)  # 3 and -0.78: another turn each
    wrapped[:, 20] = np.nan
    found = phase.unwrap(wrapped)
    np.testing.assert_allclose(found[:, 21:] - found[:, 20 - 1 :: -1], 2.5, rtol=0, atol=1e-14)
    assert abs(np.nanmean(found[:, :20])) <= math.pi


def test_unwrap_is_deterministic():
    noisy = np.random.default_rng(4).uniform(-math.pi, math.pi, (40, 40))  # a different way at every start
    np.testing.assert_array_equal(phase.unwrap(noisy), phase.unwrap(noisy))


@pytest.mark.parametrize("shape", [(1, 80), (80, 1), (1, 1), (2, 40), (1, 2)])
def test_unwrap_of_thin_maps(shape):
    row, column = np.indices(shape)
    true = 1.3 * (row + column)
    found = phase.unwrap(phase.wrap(true))
    assert found.shape == shape
    whole_turns(found - true)


def test_unwrap_of_a_line_with_a_gap():
    true = np.linspace(0.0, 30.0, 60)[None, :]
    wrapped = phase.wrap(true)
    wrapped[0, 40] = np.nan
    found = phase.unwrap(wrapped)
    whole_turns((found - true)[:, :40])
    whole_turns((found - true)[:, 41:])


MAPS = pytest.mark.parametrize("function", [phase.unwrap, phase.remove_mean, phase.remove_plane])


@MAPS
def test_maps_are_two_dimensional(function):
    with pytest.raises(
        ValueError, match=rf"{function.__name__}: expected a map of shape .* got shape \(5,\)"
    ):
        function(np.zeros(5))


@MAPS
def test_masks_fit_their_maps(function):
    with pytest.raises(ValueError, match=rf"{function.__name__} mask: expected shape \(4, 5\), got \(5, 4\)"):
        function(np.zeros((4, 5)), mask=np.zeros((5, 4), dtype=bool))


@MAPS
def test_maps_without_a_valid_pixel_are_refused(function):
    message = rf"{function.__name__}: expected at least one valid pixel, got none of 20"
    with pytest.raises(ValueError, match=message):
        function(np.full((4, 5), np.nan))
    with pytest.raises(ValueError, match=message):
        function(np.zeros((4, 5)), mask=np.ones((4, 5), dtype=bool))


@settings(max_examples=50, deadline=None)
@given(
    st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.integers(1, 12), st.integers(1, 12)
)
def test_remove_plane_leaves_nothing_of_a_plane(piston, row_slope, column_slope, rows, columns):
    row, column = np.indices((rows, columns))
    plane = piston + row_slope * row + column_slope * column
    assert np.abs(phase.remove_plane(plane)).max() <= 1e-12 * (1.0 + np.abs(plane).max())


def test_remove_plane_fits_valid_pixels_only_and_shows_the_rest():
    row, column = np.indices((30, 40))
    plane = 3.0 + 0.5 * row - 0.25 * column
    map_ = plane.copy()
    map_[5:10, 5:10] += 7.0
    map_[20, 20] = np.nan
    mask = np.zeros(map_.shape, dtype=bool)
    mask[5:10, 5:10] = True
    flat = phase.remove_plane(map_, mask)
    expected = np.where(mask, 7.0, 0.0)
    expected[20, 20] = np.nan
    np.testing.assert_allclose(flat, expected, rtol=0, atol=1e-12)


def test_remove_plane_is_least_squares():
    map_ = np.random.default_rng(7).standard_normal((20, 30))
    flat = phase.remove_plane(map_)
    row, column = np.indices(map_.shape)
    # what is left is orthogonal to everything that was taken away: 600 pixels, 30 columns, eps
    for part in (np.ones(map_.shape), row, column):
        assert abs((flat * part).sum()) < 1e-10


def test_remove_mean():
    map_ = np.array([[1.0, 2.0], [6.0, np.nan]])
    np.testing.assert_array_equal(phase.remove_mean(map_), map_ - 3.0)
    np.testing.assert_array_equal(phase.remove_mean(map_, map_ > 5.0), map_ - 1.5)


def test_inputs_are_left_alone():
    map_ = bump(20.0)
    map_[3, 3] = np.nan
    kept = map_.copy()
    for function in (phase.unwrap, phase.remove_mean, phase.remove_plane, phase.wrap):
        function(map_)
    np.testing.assert_array_equal(map_, kept)


def test_height():
    assert phase.height(2.0 * math.pi, 633 * nm) == pytest.approx(316.5 * nm, rel=1e-15, abs=0.0)
    assert phase.height(np.zeros((3, 4)), 633 * nm).shape == (3, 4)
    assert np.isnan(phase.height(np.nan, 633 * nm))


@pytest.mark.parametrize("wavelength", [0.0, -1e-9, np.nan, np.inf])
def test_wavelengths_are_checked(wavelength):
    for call in (
        lambda: phase.height(1.0, wavelength),
        lambda: phase.synthetic_wavelength(wavelength, 633 * nm),
        lambda: phase.synthetic_wavelength(633 * nm, wavelength),
        lambda: phase.two_wavelength(1.0, 1.0, wavelength, 633 * nm),
    ):
        with pytest.raises(ValueError, match="wavelength: expected a positive length in metres"):
            call()


def test_equal_wavelengths_have_no_beat():
    with pytest.raises(
        ValueError, match=r"synthetic wavelength: expected two different .* got 6\.33e-07 m twice"
    ):
        phase.synthetic_wavelength(633 * nm, 633 * nm)
    with pytest.raises(ValueError, match="synthetic wavelength: expected two different"):
        phase.two_wavelength(0.0, 0.0, 633 * nm, 633 * nm)
