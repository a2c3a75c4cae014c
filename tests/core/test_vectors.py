"""Unit vectors of any magnitude, frames, rotations."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from fringetrace.core import vectors

# Unit vectors and matrices come out of a handful of products of numbers below 1.
ROUNDING = 16 * float(np.finfo(np.float64).eps)
# A frame divides by the sine of the angle between normal and up, which the tests keep above this.
SLANT = 1e-3

components = st.floats(-1.0, 1.0)
directions = st.tuples(components, components, components).filter(lambda v: max(map(abs, v)) > 1e-3)
exponents = st.integers(-300, 300)


@settings(deadline=None)
@given(directions, exponents)
def test_direction_of_any_magnitude(vector, exponent):
    scaled = np.array(vector) * 10.0**exponent
    expected = np.array(vector) / math.sqrt(math.fsum(c * c for c in vector))
    np.testing.assert_allclose(vectors.checked_direction(scaled, "way"), expected, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(vectors.unit(scaled[None])[0], expected, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("size", [5e-324, 1e-310, 1e-200, 1e200, 1.7e308])
def test_direction_at_the_ends_of_float64(size):
    expected = [math.sqrt(0.5), 0.0, -math.sqrt(0.5)]
    np.testing.assert_allclose(
        vectors.checked_direction([size, 0.0, -size], "way"), expected, rtol=0, atol=ROUNDING
    )
    np.testing.assert_allclose(
        vectors.unit(np.array([[size, 0.0, -size]])), [expected], rtol=0, atol=ROUNDING
    )


def test_unit_of_many_sizes_at_once():
    rows = np.array([[3.0, 0.0, 4.0], [3e-200, 0.0, 4e-200], [0.0, -5e200, 0.0]])
    found = vectors.unit(rows)
    np.testing.assert_allclose(
        found, [[0.6, 0.0, 0.8], [0.6, 0.0, 0.8], [0.0, -1.0, 0.0]], rtol=0, atol=ROUNDING
    )
    assert rows[0, 0] == 3.0  # the input is left alone


def test_checked_vector_is_a_copy():
    value = np.array([1.0, 2.0, 3.0])
    vector = vectors.checked_vector(value, "centre")
    vector[0] = 9.0
    assert value[0] == 1.0
    assert vectors.checked_vector((1, 2, 3), "centre").dtype == np.float64


@pytest.mark.parametrize("shape", [(), (2,), (4,), (3, 1), (1, 3), (0,)])
def test_vectors_have_three_numbers(shape):
    with pytest.raises(ValueError, match=r"centre: expected 3 numbers, got shape"):
        vectors.checked_vector(np.ones(shape), "centre")


@pytest.mark.parametrize("value", ["abc", [1, 2, object()], [1, [2, 3], 4], [1j, 2, 3]])
def test_vectors_are_numbers(value):
    with pytest.raises(ValueError, match="centre: expected 3 numbers, got"):
        vectors.checked_vector(value, "centre")


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_vectors_are_finite(bad):
    for check in (vectors.checked_vector, vectors.checked_direction):
        with pytest.raises(
            ValueError, match=r"centre: expected finite numbers, got \[0.0, (nan|-?inf), 1.0\]"
        ):
            check([0.0, bad, 1.0], "centre")


def test_directions_have_a_length():
    with pytest.raises(ValueError, match="way: expected a direction, got a vector of length 0"):
        vectors.checked_direction([0.0, -0.0, 0.0], "way")


@settings(max_examples=200, deadline=None)
@given(directions, directions, exponents, exponents)
def test_frame(normal, up, e1, e2):
    normal, up = np.array(normal), np.array(up)
    sine = np.linalg.norm(np.cross(normal, up)) / np.linalg.norm(normal) / np.linalg.norm(up)
    assume(sine > SLANT)
    u, v, n = vectors.frame(normal * 10.0**e1, up * 10.0**e2, "CCD")
    tolerance = ROUNDING / SLANT
    np.testing.assert_allclose(np.array([u, v, n]) @ np.array([u, v, n]).T, np.eye(3), rtol=0, atol=tolerance)
    np.testing.assert_allclose(np.cross(v, u), n, rtol=0, atol=tolerance)  # (v, u, n) is right-handed
    np.testing.assert_allclose(n, normal / np.linalg.norm(normal), rtol=0, atol=tolerance)
    across = np.cross(n, up / np.linalg.norm(up))
    np.testing.assert_allclose(u, across / np.linalg.norm(across), rtol=0, atol=tolerance)
    assert v @ up > 0.0
    assert abs(u @ up) <= tolerance * np.linalg.norm(up)


def test_frame_right_is_right():
    # looking along -z with y up, x is to the right, as on paper
    u, v, n = vectors.frame([0, 0, -1], [0, 1, 0], "CCD")
    np.testing.assert_array_equal([u, v, n], [[1, 0, 0], [0, 1, 0], [0, 0, -1]])
    # an up that leans only turns in its plane
    np.testing.assert_allclose(vectors.frame([0, 0, -1], [0, 1, 5], "CCD"), [u, v, n], rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("up", [[0, 0, 1], [0, 0, -3], [1e-9, 0, 1]])
def test_frame_refuses_up_along_the_normal(up):
    with pytest.raises(ValueError, match=r"CCD up: expected a direction across the normal .* got"):
        vectors.frame([0, 0, 2], up, "CCD")


def test_frame_names_what_is_wrong():
    with pytest.raises(ValueError, match="CCD normal: expected a direction, got a vector of length 0"):
        vectors.frame([0, 0, 0], [0, 1, 0], "CCD")
    with pytest.raises(ValueError, match="CCD up: expected a direction, got a vector of length 0"):
        vectors.frame([0, 0, 1], [0, 0, 0], "CCD")


@settings(deadline=None)
@given(directions, st.floats(-10.0, 10.0))
def test_rotation_against_scipy(axis, angle):
    found = vectors.rotation(axis, angle)
    expected = Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis)).as_matrix()
    np.testing.assert_allclose(found, expected, rtol=0, atol=ROUNDING)
    np.testing.assert_array_equal(vectors.checked_rotation(found, "turn"), found)


@pytest.mark.parametrize("angle", [1e-3, 1e-9, 1e-15, 1e-200])
def test_rotation_keeps_the_digits_of_small_tilts(angle):
    found = vectors.rotation([0, 0, 1], angle)
    assert found[1, 0] == pytest.approx(math.sin(angle), rel=ROUNDING, abs=0.0)
    assert found[0, 1] == -found[1, 0]
    assert found[0, 0] == pytest.approx(math.cos(angle), rel=ROUNDING, abs=0.0)


def test_rotation_is_right_handed():
    turned = vectors.rotation([0, 0, 5], math.pi / 2) @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(turned, [0.0, 1.0, 0.0], rtol=0, atol=ROUNDING)


def test_rotation_needs_an_axis():
    with pytest.raises(ValueError, match="rotation axis: expected a direction, got a vector of length 0"):
        vectors.rotation([0, 0, 0], 1.0)


def test_rotations_have_their_shape():
    with pytest.raises(
        ValueError, match=r"turn: expected a rotation matrix of shape \(3, 3\), got shape \(2, 2\)"
    ):
        vectors.checked_rotation(np.eye(2), "turn")


STRETCHED = 1.001 * np.eye(3)
SWAPPED = np.diag([1.0, 1.0, -1.0])
UNKNOWN = np.full((3, 3), np.nan)


@pytest.mark.parametrize("matrix", [STRETCHED, SWAPPED, UNKNOWN, np.zeros((3, 3))])
def test_rotations_keep_lengths_and_hands(matrix):
    with pytest.raises(ValueError, match=r"turn: expected a rotation matrix, got \[\["):
        vectors.checked_rotation(matrix, "turn")


def test_a_component_has_the_same_bits_in_any_company():
    rows = np.random.default_rng(4).normal(size=(999, 3))
    axis = np.array([0.3, -0.2, 0.933])
    whole = vectors.component(rows, axis)
    np.testing.assert_allclose(whole, rows @ axis, rtol=0, atol=1e-15)
    alone = np.concatenate([vectors.component(row[None], axis) for row in rows])
    np.testing.assert_array_equal(alone, whole)


@given(arrays(np.float64, 3, elements=st.floats(-1e3, 1e3)).filter(lambda v: np.abs(v).max() > 1e-3))
def test_a_direction_that_is_one_already_stays_to_the_last_bit(vector):
    once = vectors.checked_direction(vector, "it")
    assert vectors.checked_direction(once, "it").tobytes() == once.tobytes()
