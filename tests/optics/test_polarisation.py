"""Names and Jones vectors of polarisation."""

import math

import numpy as np
import pytest

from fringetrace.optics import JONES, check_polarisation, checked_jones, films, jones_states
from fringetrace.rigorous import effective_medium

ROUNDING = 1e-15


def test_names_stand_for_jones_vectors():
    for name, vectors in JONES.items():
        states = jones_states(name, (2, 3), "light")
        assert len(states) == 6
        assert all(np.array_equal(state, vectors) for state in states)
    assert jones_states(None, (2, 1), "light") == [(None,), (None,)]


def test_unpolarised_light_is_the_mean_of_two_orthogonal_states():
    """The coherency matrix, J J^H in the mean, is half the unit matrix."""
    (states,) = jones_states("unpolarised", (1, 1), "light")
    matrix = np.mean([np.outer(one, np.conj(one)) for one in states], axis=0)
    np.testing.assert_array_equal(matrix, 0.5 * np.eye(2))


def test_amplitudes_are_one_pair_or_one_an_incidence():
    given = np.arange(1, 13).reshape(2, 3, 2) * (1 + 2j)
    states = jones_states(given, (2, 3), "light")
    np.testing.assert_array_equal([state[0] for state in states], given.reshape(-1, 2))
    np.testing.assert_array_equal(
        [state[0] for state in jones_states([1, 1j], (2, 3), "light")], [[1, 1j]] * 6
    )


@pytest.mark.parametrize(
    ("polarisation", "message"),
    [
        ("TE", "light polarisation: expected s, p, unpolarised or amplitudes, got 'TE'"),
        ([1, 0, 0], r"light polarisation: .* of shape \(2,\) or \(2, 3, 2\), got \(3,\)"),
        ([0, 0], "light polarisation: expected finite amplitudes, not both 0"),
        ([math.nan, 1], "light polarisation: expected finite amplitudes, not both 0"),
    ],
)
def test_no_polarisation(polarisation, message):
    with pytest.raises(ValueError, match=message):
        jones_states(polarisation, (2, 3), "light")


def test_one_of_two_names_is_expected():
    check_polarisation("s")
    with pytest.raises(ValueError, match="Polarisation: expected 's' or 'p', got 'unpolarised'"):
        check_polarisation("unpolarised")


def test_jones_vectors_of_beams_have_unit_length():
    np.testing.assert_allclose(checked_jones([3, 4j], "Beam"), [0.6, 0.8j], rtol=ROUNDING)
    for wrong in ([0, 0], [1, 2, 3], [math.inf, 1]):
        with pytest.raises(ValueError, match="Beam polarisation: expected a Jones vector of two numbers"):
            checked_jones(wrong, "Beam")
    with pytest.raises(ValueError, match="Beam polarisation: expected two numbers, got 'xy'"):
        checked_jones("xy", "Beam")


@pytest.mark.parametrize("which", ["s", "p"])
def test_films_and_rigorous_methods_mean_the_same_by_s_and_p(which):
    """Fresnel's reflectance of a bare face, by both."""
    face = films.fresnel(1.0, 1.5, 0.8)
    expected = abs({"s": face.rs, "p": face.rp}[which]) ** 2
    found = effective_medium.stack_powers([0.0], [1.0], 1.0, 1.5, 5e-7, 0.8, which).reflectance
    assert found == pytest.approx(float(expected), rel=1e-12)
