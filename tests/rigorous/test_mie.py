import math

import mpmath
import numpy as np
import pytest

from fringetrace.rigorous.cylindrical_waves import CONDUCTOR
from fringetrace.rigorous.mie import amplitude_functions, efficiencies, mie_coefficients

# A wave of size x has some x eps of phase error, and a series some thousand terms.
LARGE = 1e-11
# Tables have seven digits.
PRINTED = 0.51e-6


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


@pytest.mark.parametrize(
    ("x", "index", "scattering", "asymmetry"),
    [
        (1000.0, 0.75, 1.997908, 0.844944),
        (10000.0, 1.33 + 1e-5j, 1.723857, 0.907840),
        (10000.0, 1.5 + 1.0j, 1.236574, 0.846310),
        (10000.0, 10.0 + 10.0j, 1.795393, 0.548194),
    ],
)
def test_wiscombes_large_spheres(x, index, scattering, asymmetry):
    """W. J. Wiscombe, Mie scattering calculations, NCAR/TN-140+STR (1979), the table of test cases."""
    found = efficiencies(x / 2 / math.pi, index, 1.0, 1.0)
    assert found.scattering == pytest.approx(scattering, abs=PRINTED)
    assert found.asymmetry == pytest.approx(asymmetry, abs=PRINTED)


def exact(n, x, m):
    """Mie's a_n and b_n from Bessel functions in 30 digits (Bohren and Huffman, 4.53)."""
    with mpmath.workdps(30):
        x, m = mpmath.mpf(x), mpmath.mpc(m)

        def psi(order, z):
            return mpmath.sqrt(mpmath.pi * z / 2) * mpmath.besselj(order + mpmath.mpf(0.5), z)

        def xi(order, z):
            return psi(order, z) + 1j * mpmath.sqrt(mpmath.pi * z / 2) * mpmath.bessely(
                order + mpmath.mpf(0.5), z
            )

        inner, f, h = ((w(n, z), w(n - 1, z) - n * w(n, z) / z) for w, z in ((psi, m * x), (psi, x), (xi, x)))
        a = (m * inner[0] * f[1] - f[0] * inner[1]) / (m * inner[0] * h[1] - h[0] * inner[1])
        b = (inner[0] * f[1] - m * f[0] * inner[1]) / (inner[0] * h[1] - m * h[0] * inner[1])
        return complex(a), complex(b)


@pytest.mark.parametrize("index", [0.75, 0.05 + 1e-3j, 0.2 + 3.4j])
def test_coefficients_of_large_bubbles_and_metals(index):
    x = 3000.0
    a, b = mie_coefficients(x / 2 / math.pi, index, 1.0, 1.0)
    assert np.isfinite(a).all()
    assert np.isfinite(b).all()
    for n in (1, 2249, 3040):
        expected = exact(n, 2.0 * math.pi * (x / 2 / math.pi), index)
        assert (a[n - 1], b[n - 1]) == pytest.approx(expected, abs=LARGE)


@pytest.mark.parametrize("index", [1.5, 0.2 + 3.4j, CONDUCTOR])
def test_tiny_spheres_scatter_as_dipoles(index):
    x = 1e-5
    found = efficiencies(x / 2 / math.pi, index, 1.0, 1.0)
    share = 1.25 if np.isinf(index) else abs((index**2 - 1) / (index**2 + 2)) ** 2  # magnetic dipole too
    assert found.scattering == pytest.approx(8 / 3 * x**4 * share, rel=1e-9)
    assert efficiencies(1e-80, index, 1.0, 1.0).asymmetry == 0.0


def test_a_conductor_is_the_limit_of_large_index():
    metal, perfect = (np.array(efficiencies(8.0, index, 1.0, 1.0)) for index in (1e8j, CONDUCTOR))
    np.testing.assert_allclose(metal, perfect, atol=1e-6)


@pytest.mark.parametrize("index", [math.nan, None, 0.0, complex(1.5, math.nan), "glass"])
def test_spheres_reject_what_is_no_index(index):
    with pytest.raises(ValueError, match="Sphere: expected a refractive index n"):
        efficiencies(1.0, index, 1.0, 0.5)


@pytest.mark.parametrize("change", [{"radius": math.nan}, {"host": math.inf}, {"wavelength": math.inf}])
def test_spheres_reject_lengths_that_are_not_finite(change):
    with pytest.raises(ValueError, match="Sphere: expected positive radius, host and wavelength"):
        efficiencies(**{"radius": 1.0, "index": 1.5, "host": 1.0, "wavelength": 0.5, **change})


def test_amplitudes_reject_no_angle():
    with pytest.raises(ValueError, match="Scattering angle: expected finite angles in radians, got nan"):
        amplitude_functions(1.0, 1.5, 1.0, 0.5, math.nan)
