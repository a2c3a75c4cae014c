"""Mie scattering by one sphere: the Lorenz-Mie series (Bohren and Huffman, chapter 4)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fringetrace.core import Array, ComplexArray, checked_angles, short_repr
from fringetrace.rigorous.cylindrical_waves import LARGEST, checked_index, truncation


class Efficiencies(NamedTuple):
    """Efficiencies (cross-sections over pi a^2), and the mean cosine of the scattering angle."""

    extinction: float
    scattering: float
    absorption: float
    backscattering: float
    asymmetry: float

    def __repr__(self) -> str:
        return short_repr(self)


def mie_coefficients(
    radius: float, index: complex, host: float, wavelength: float
) -> tuple[ComplexArray, ComplexArray]:
    """Mie coefficients a_n and b_n, n = 1 to N.

    Parameters
    ----------
    radius, wavelength : float, metres
        The wavelength in vacuum.
    index : complex
        n + i kappa; `harmonics.CONDUCTOR` for a perfect conductor.
    host : float
        Refractive index around.

    Returns
    -------
    a, b : (N,) complex128

    Raises
    ------
    ValueError
        If radius, host or wavelength is not a positive finite number, or the index is none.
    """
    from scipy.special import jv, yv

    from fringetrace.rigorous.bessel import ratios

    if not all(0 < length < math.inf for length in (radius, host, wavelength)):
        raise ValueError(
            f"Sphere: expected positive radius, host and wavelength, got {radius}, {host}, {wavelength}"
        )
    x, m = 2.0 * math.pi * host * radius / wavelength, complex(checked_index(index, "Sphere")) / host
    n = np.arange(truncation(x) + 1)
    scale = math.sqrt(math.pi * x / 2.0)
    psi: Array = scale * jv(n + 0.5, x)
    chi: Array = scale * yv(n + 0.5, x)
    chi = np.maximum(chi, -LARGEST)  # of orders that tiny spheres do without
    n, xi = n[1:], psi + 1j * chi
    if not np.isfinite(m):  # a perfect conductor
        return _matched(psi, n / x) / _matched(xi, n / x), psi[1:] / xi[1:]
    inside = ratios(m * x, 1.5, len(n)) - n / (m * x)  # psi'(m x) / psi(m x)
    a, b = (_matched(psi, slope) / _matched(xi, slope) for slope in (inside / m + n / x, m * inside + n / x))
    return a, b


def _matched(wave: Array, slope: Array) -> ComplexArray:
    """What is wrong at the boundary with a wave of orders 0 to N: slope Z_n - Z_{n-1}, n = 1 to N."""
    return np.asarray(slope * wave[1:] - wave[:-1], np.complex128)


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
    asymmetry = 4.0 * moment / x**2 / scattering if scattering > 0.0 else 0.0
    return Efficiencies(*map(float, (extinction, scattering, extinction - scattering, back, asymmetry)))


def amplitude_functions(
    radius: float, index: complex, host: float, wavelength: float, angle: ArrayLike
) -> tuple[ComplexArray, ComplexArray]:
    """Scattering amplitudes S1 (across the scattering plane) and S2 (in it) at scattering angles.

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

    Raises
    ------
    ValueError
        As in `coefficients`, or if an angle is not finite.
    """
    a, b = mie_coefficients(radius, index, host, wavelength)
    cosine = np.cos(np.atleast_1d(checked_angles(angle, "Scattering angle")))
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
