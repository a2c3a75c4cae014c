"""Rigorous light on one sphere: the Lorenz-Mie series (Bohren and Huffman, chapter 4)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fringetrace.core import ComplexArray
from fringetrace.rigorous.cylindrical_waves import truncation


class Efficiencies(NamedTuple):
    """Cross-sections over pi a^2, and the mean cosine of the scattering angle."""

    extinction: float
    scattering: float
    absorption: float
    backscattering: float
    asymmetry: float


def mie_coefficients(
    radius: float, index: complex, host: float, wavelength: float
) -> tuple[ComplexArray, ComplexArray]:
    """Mie coefficients a_n and b_n, n = 1 to N.

    Parameters
    ----------
    radius, wavelength : float, metres
        The wavelength in vacuum.
    index : complex
        n + i kappa.
    host : float
        Refractive index around.

    Returns
    -------
    a, b : (N,) complex128

    Raises
    ------
    ValueError
        If radius, host or wavelength is not positive.
    """
    from scipy.special import jv, jve, yv

    if not (radius > 0 and host > 0 and wavelength > 0):
        raise ValueError(
            f"Sphere: expected positive radius, host and wavelength, got {radius}, {host}, {wavelength}"
        )
    x, m = 2.0 * math.pi * host * radius / wavelength, complex(index) / host
    n = np.arange(truncation(x) + 1)
    psi = math.sqrt(math.pi * x / 2.0) * jv(n + 0.5, x)
    xi = psi + 1j * math.sqrt(math.pi * x / 2.0) * yv(n + 0.5, x)
    inner = jve(n + 0.5, m * x)  # over exp(|Im|), which cancels
    n = n[1:]
    # psi'(m x) and psi'(x), xi'(x) by Z_n' = Z_{n-1} - n Z_n / z
    d_inner, d_psi, d_xi = (f[:-1] - n * f[1:] / z for f, z in ((inner, m * x), (psi, x), (xi, x)))
    inner, psi, xi = inner[1:], psi[1:], xi[1:]
    a = (m * inner * d_psi - psi * d_inner) / (m * inner * d_xi - xi * d_inner)
    b = (inner * d_psi - m * psi * d_inner) / (inner * d_xi - m * xi * d_inner)
    return a, b


def efficiencies(radius: float, index: complex, host: float, wavelength: float) -> Efficiencies:
    """Efficiencies of one sphere; arguments as in `mie_coefficients`."""
    a, b = mie_coefficients(radius, index, host, wavelength)
    x, n = 2.0 * math.pi * host * radius / wavelength, np.arange(1, len(a) + 1)
    weight = 2 * n + 1
    extinction = 2.0 / x**2 * (weight * (a + b).real).sum()
    scattering = 2.0 / x**2 * (weight * (abs(a) ** 2 + abs(b) ** 2)).sum()
    back = abs((weight * (-1.0) ** n * (a - b)).sum()) ** 2 / x**2
    neighbours = (a[:-1] * a[1:].conj() + b[:-1] * b[1:].conj()).real
    moment = (n * (n + 2) / (n + 1))[:-1] @ neighbours + (weight / (n * (n + 1))) @ (a * b.conj()).real
    asymmetry = 4.0 * moment / x**2 / scattering
    return Efficiencies(*map(float, (extinction, scattering, extinction - scattering, back, asymmetry)))


def amplitude_functions(
    radius: float, index: complex, host: float, wavelength: float, angle: ArrayLike
) -> tuple[ComplexArray, ComplexArray]:
    """Amplitudes S1 (across the scattering plane) and S2 (in it) at scattering angles.

    The differential cross-section is |S|^2 / k^2, k the wavenumber in the host.

    Parameters
    ----------
    radius, index, host, wavelength
        As in `mie_coefficients`.
    angle : (t,) float64, radians
        From the forward direction.

    Returns
    -------
    S1, S2 : (t,) complex128
    """
    a, b = mie_coefficients(radius, index, host, wavelength)
    cosine = np.cos(np.atleast_1d(np.asarray(angle, np.float64)))
    pi, tau = _angular(cosine, len(a))
    n = np.arange(1, len(a) + 1)
    weight = (2 * n + 1) / (n * (n + 1))
    return (weight * a) @ pi + (weight * b) @ tau, (weight * a) @ tau + (weight * b) @ pi


def _angular(cosine: ComplexArray, orders: int) -> tuple[ComplexArray, ComplexArray]:
    """Functions pi_n and tau_n of the scattering angle, n = 1 to N: (N, t) each."""
    pi = [np.zeros_like(cosine), np.ones_like(cosine)]
    for n in range(2, orders + 1):
        pi.append(((2 * n - 1) * cosine * pi[-1] - n * pi[-2]) / (n - 1))
    tau = [n * cosine * pi[n] - (n + 1) * pi[n - 1] for n in range(1, orders + 1)]
    return np.stack(pi[1:]), np.stack(tau)
