"""Cylindrical harmonics H_n(k r) exp(i n phi): one cylinder's answer, and what a row sends to itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from fringetrace.core import Array, ComplexArray, FloatArray

Polarisation = Literal["E", "H"]
Index = complex | Callable[[Any], Any]

CONDUCTOR: complex = complex(math.inf)  # the index of a perfect conductor
_STEP = 0.05  # of the midpoint rule; poles nearer to the path than a few of these enter by residues
_NEAR = 4  # poles on either side that may be that near
_FAR = 1.0  # of k, detuning from which an order's pole counts exp(-88)
_TOUCHING = 5e-15  # of k: no diffraction order grazes closer than that
_OVERFLOW = 600.0  # exponent beyond which the integrand is nothing


def truncation(size_parameter: float) -> int:
    """Highest order N that a cylinder of size parameter k a needs.

    W. J. Wiscombe's rule (Appl. Opt. 19, 1505 (1980)), with its constants raised until the first order left
    out is 1e-13 of the largest, for k a = 0.01 to 1000. Cylinders that almost touch may need more.
    """
    return math.ceil(size_parameter + 6.0 * math.cbrt(size_parameter) + 2.0)


def indices_at(index: Index, wavelength: FloatArray) -> ComplexArray:
    """Refractive index at each of some wavelengths in metres, complex128 of their shape."""
    value = index(wavelength) if callable(index) else index
    return np.broadcast_to(np.asarray(value, np.complex128), wavelength.shape)


def check_polarisation(polarisation: str) -> None:
    """Raise ValueError unless the polarisation is "E" or "H"."""
    if polarisation not in ("E", "H"):
        raise ValueError(f"Polarisation: expected 'E' or 'H', got {polarisation!r}")


def boundary(
    radius: ArrayLike, index: ArrayLike, host: ArrayLike, wavelength: ArrayLike, polarisation: Polarisation,
    orders: int,
) -> tuple[Array, FloatArray, Array]:  # fmt: skip
    """What the boundary of a cylinder does to each harmonic (Bohren and Huffman, 8.30 to 8.37).

    Parameters
    ----------
    radius, wavelength : float or array, metres
        The wavelength in vacuum; these and the indices broadcast.
    index : complex or array
        n + i kappa; `CONDUCTOR` for a perfect conductor.
    host : float or array
        Refractive index around.
    polarisation : ``"E"`` or ``"H"``
        The field along the cylinder.
    orders : int
        N.

    Returns
    -------
    response : (..., 2 N + 1) complex128
        S_n: an exciting wave a J_n(k r) sends out S_n a H_n(k r). Orders -N to N.
    weight : (..., 2 N + 1) float64
        |H_n(k a)|.
    within : (..., 2 N + 1) complex128
        The wave inside is ``within`` a J_n(k' r) exp(-|Im k' a|), k' the wavenumber there.

    Raises
    ------
    ValueError
        If the polarisation is unknown.
    """
    from scipy.special import jv, jve

    check_polarisation(polarisation)
    radius, index, host, wavelength = (
        np.asarray(v)[..., None] for v in np.broadcast_arrays(radius, index, host, wavelength)
    )
    n = np.arange(orders + 2)
    x = 2.0 * math.pi * host * radius / wavelength
    j, h = jv(n, x), hankel(x[..., 0], orders + 1)[..., orders + 1 :]
    conducting = np.isinf(index)
    ratio = np.where(conducting, 1.0, index) / host
    inner = jve(n, ratio * x)  # over exp(|Im|), which cancels
    (j, dj), (h, dh), (inner, dinner) = (_with_derivative(v) for v in (j, h, inner))
    contrast = ratio if polarisation == "E" else 1.0 / ratio
    below = contrast * dinner * h - inner * dh
    response = -(contrast * dinner * j - inner * dj) / below
    hard = -j / h if polarisation == "E" else -dj / dh
    response = np.where(conducting, hard, response)
    within = np.where(conducting, 0.0, -2j / (math.pi * x) / below)
    fold = abs(np.arange(-orders, orders + 1))
    weight = np.asarray(abs(h)[..., fold], np.float64)
    return response[..., fold], weight, within[..., fold]


def _with_derivative(cylinder_function: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Z_n and Z_n' of orders 0 to N, from Z_n of orders 0 to N + 1."""
    z = cylinder_function
    slope = np.concatenate([-z[..., 1:2], (z[..., :-2] - z[..., 2:]) / 2.0], -1)
    return z[..., :-1], slope


def hankel(argument: FloatArray, orders: int) -> ComplexArray:
    """H_n^(1) of orders -N to N, (..., 2 N + 1), by upward recurrence, along which it never shrinks."""
    from scipy.special import hankel1

    rising = [hankel1(0, argument), hankel1(1, argument)]
    for n in range(1, orders):
        rising.append(2.0 * n / argument * rising[n] - rising[n - 1])
    positive = np.stack(rising[: orders + 1], -1)
    sign = (-1.0) ** np.arange(orders, 0, -1)
    return np.concatenate([sign * positive[..., :0:-1], positive], -1)


def outgoing_waves(displacement: FloatArray, k: float, orders: int) -> ComplexArray:
    """H_l(k R) exp(i l phi) of orders -N to N at displacements (..., 2), zero at displacement zero."""
    distance = np.hypot(displacement[..., 0], displacement[..., 1])
    here = distance == 0.0
    azimuth = np.arctan2(displacement[..., 1], displacement[..., 0])
    wave = hankel(np.where(here, orders + 1.0, k * distance), orders)  # of anything finite, here
    wave *= np.exp(1j * azimuth[..., None] * np.arange(-orders, orders + 1))
    wave[here] = 0.0
    return wave


def lattice_sums(beta: ArrayLike, k: ArrayLike, pitch: float, orders: int) -> ComplexArray:
    """Lattice sums of a row: the waves H_l(k R) exp(i l phi) at one cylinder from all the others in the row.

    The cylinder at j d sends with the phase exp(i beta j d), and R, phi lead from it to the cylinder at 0.

    The sum is taken under the integral for H_l along its path of steepest descent, which leaves a smooth
    integrand for the midpoint rule (K. Yasumoto and K. Yoshitomi, IEEE Trans. Antennas Propag. 47, 1050
    (1999)); the poles that come near the path (orders near grazing) enter by their residues, exactly.

    Parameters
    ----------
    beta : float or array, 1/m
        Wavenumber along the row; broadcasts with `k`.
    k : float or array, 1/m
        Wavenumber in the host.
    pitch : float, metres
    orders : int
        L.

    Returns
    -------
    (..., 2 L + 1) complex128
        Orders l = -L to L. They diverge where a diffraction order grazes the row.
    """
    beta, k = np.broadcast_arrays(np.asarray(beta, np.float64), np.asarray(k, np.float64))
    forward, backward = _half_sum(beta, k, pitch, orders), _half_sum(-beta, k, pitch, orders)
    sign = (-1.0) ** np.arange(orders + 1)
    # from those at j > 0 the way to 0 has phi = pi
    positive = forward * sign + backward
    return np.concatenate([(sign * positive)[..., :0:-1], positive], -1)


def _half_sum(beta: FloatArray, k: FloatArray, pitch: float, orders: int) -> ComplexArray:
    """Sum over j > 0 of H_l(k j d) exp(i beta j d), l = 0 to L: (..., L + 1).

    With cos w = 1 + i s^2, H_l(x) = (-i)^l exp(i x) / pi times the integral over s of
    T_l(cos w) exp(-x s^2) 2 / sqrt(2 i - s^2); the sum over j is geometric.
    """
    kd, phase = (k * pitch)[..., None], ((k + beta) * pitch)[..., None]
    reach = math.sqrt((40.0 + 3.0 * orders) / kd.min()) + 1.0
    s = _STEP * (np.arange(math.ceil(reach / _STEP)) + 0.5)
    geometric = 1.0 / np.expm1(np.minimum(kd * s**2, _OVERFLOW) - 1j * phase)
    found: Array = 2.0 * _STEP * _on_path(s**2, geometric, orders)
    turns = np.round(phase / (2.0 * math.pi)) + np.arange(-_NEAR, _NEAR + 1)
    apart = (phase - 2.0 * math.pi * turns) / kd
    near = abs(apart) < _FAR
    square = 1j * np.where(near, np.where(abs(apart) < _TOUCHING, _TOUCHING, apart), _FAR)
    pole = np.sqrt(square)
    pole = np.where(pole.imag < 0, -pole, pole)
    turn = near * np.exp(2j * math.pi * pole / _STEP)
    found += 4j * math.pi * _on_path(square, turn / (1.0 + turn) / (2.0 * kd * pole), orders)
    found = found * (-1j) ** np.arange(orders + 1) / math.pi
    return found


def _on_path(square: Array, factor: Array, orders: int) -> ComplexArray:
    """Sum over s, whose squares are given, of factor T_l(1 + i s^2) 2 / sqrt(2 i - s^2): (..., L + 1)."""
    weight = factor * 2.0 / np.sqrt(2j - square)
    found: ComplexArray = np.einsum("...s,...ls->...l", weight, _chebyshev(1.0 + 1j * square, orders))
    return found


def _chebyshev(z: ComplexArray, orders: int) -> ComplexArray:
    """T_l(z) for l = 0 to L: (..., L + 1, s)."""
    rising = [np.ones_like(z), z]
    for _ in range(1, orders):
        rising.append(2.0 * z * rising[-1] - rising[-2])
    return np.stack(rising[: orders + 1], -2)
