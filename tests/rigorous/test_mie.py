import math

import numpy as np
import pytest

from fringetrace.rigorous.mie import amplitude_functions, efficiencies, mie_coefficients


def test_efficiencies_of_a_clear_sphere():
    # W. J. Wiscombe's case, index 1.5, size parameter 10
    found = efficiencies(10 / 2 / math.pi, 1.5, 1.0, 1.0)
    expected = (2.881998952, 2.881998952, 0.0, 1.695063583, 0.742912898)
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_amplitudes_obey_the_optical_theorem_and_add_up():
    x, index = 7.0, 1.6 + 0.05j
    found = efficiencies(x / 2 / math.pi / 1.2, index, 1.2, 1.0)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    s1, s2 = amplitude_functions(x / 2 / math.pi / 1.2, index, 1.2, 1.0, np.arccos(nodes))
    assert ((abs(s1) ** 2 + abs(s2) ** 2) @ weights) / x**2 == pytest.approx(found.scattering, rel=1e-12)
    forward = amplitude_functions(x / 2 / math.pi / 1.2, index, 1.2, 1.0, 0.0)[0][0]
    assert 4 / x**2 * forward.real == pytest.approx(found.extinction, rel=1e-12)


@pytest.mark.parametrize(("x", "index"), [(0.3, 1.33), (10.0, 1.5 + 0.1j), (80.0, 1.7 + 0.01j)])
def test_spheres_agree_with_miepython(x, index):
    miepython = pytest.importorskip("miepython")
    found = efficiencies(x / 2 / math.pi, index, 1.0, 1.0)
    # miepython leaves the series at 1e-11 of all power; light sent back may be 1e-4 of it
    np.testing.assert_allclose(
        np.array(found)[[0, 1, 3, 4]], miepython.efficiencies_mx(index.conjugate(), x), rtol=2e-7
    )


def test_coefficients_conserve_power():
    a, b = mie_coefficients(0.4, 1.5, 1.3, 0.6)
    np.testing.assert_allclose(abs(1 - 2 * np.stack([a, b])), 1, rtol=1e-12)


def test_coefficients_reject_no_radius():
    with pytest.raises(ValueError, match="Sphere: expected positive radius, host and wavelength, got 0"):
        mie_coefficients(0.0, 1.5, 1.0, 1.0)
