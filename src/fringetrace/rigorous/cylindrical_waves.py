"""Cylindrical waves H_n(k r) exp(i n phi): scattering by one cylinder, and lattice sums of a row."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fringetrace.core import Array, ComplexArray, FloatArray, checked_lengths, checked_whole
from fringetrace.optics import Polarisation, check_polarisation

Index = complex | Callable[[Any], Any]

CONDUCTOR: complex = complex(math.inf)  # the index of a perfect conductor
_STEP = 0.05  # of the midpoint rule; poles nearer to the path than a few of these enter by residues
_NEAR = 4  # poles on either side that may be that near
_FAR = 1.0  # of k, detuning from which an order's pole counts exp(-88)
_TOUCHING = 5e-15  # of k: no diffraction order grazes closer than that
LARGEST = 1e200  # waves of orders that a tiny cylinder does without are held there: products stay finite
_OVERFLOW = 600.0  # exponent beyond which the integrand is nothing


def truncation(size_parameter: float) -> int:
    """Truncation order N of the cylindrical waves for a size parameter k a.

    W. J. Wiscombe's rule (Appl. Opt. 19, 1505 (1980)), with its constants raised until the first order left
    out is 1e-13 of the largest, for k a = 0.01 to 1000. Cylinders that almost touch may need more.
    """
    return math.ceil(size_parameter + 6.0 * math.cbrt(size_parameter) + 2.0)


def checked_index(index: Any, what: str) -> ComplexArray:
    """Refractive indices, once they are known to be some.

    Parameters
    ----------
    index : complex or array
        n + i kappa, or `CONDUCTOR`.
    what : str
        The name used in the error message.

    Returns
    -------
    complex128, shape of `index`

    Raises
    ------
    ValueError
        If one is missing, NaN, 0, or no number.
    """
    try:
        value = np.asarray(index, np.complex128)
    except (TypeError, ValueError):
        value = np.asarray(np.nan, np.complex128)
    wrong = np.isnan(value) | (value == 0.0)
    if wrong.any():
        raise ValueError(f"{what}: expected a refractive index n + i kappa, not 0, got {index!r}")
    return value


def indices_at(index: Index, wavelength: FloatArray) -> ComplexArray:
    """Refractive index at wavelengths in metres, complex128 of their shape."""
    value = index(wavelength) if callable(index) else index
    return np.broadcast_to(checked_index(value, "Index"), wavelength.shape)


def boundary(
    radius: ArrayLike, index: ArrayLike, host: ArrayLike, wavelength: ArrayLike, polarisation: Polarisation,
    orders: int,
) -> tuple[Array, FloatArray, Array]:  # fmt: skip
    """Boundary conditions of a cylinder for each order (Bohren and Huffman, 8.30 to 8.37).

    Parameters
    ----------
    radius, wavelength : float or array, metres
        The wavelength in vacuum; these and the indices broadcast.
    index : complex or array
        n + i kappa; `CONDUCTOR` for a perfect conductor.
    host : float or array
        Refractive index around.
    polarisation : ``"s"`` or ``"p"``
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
        The wave inside is ``within`` a J_n(k' r) / J_n(k' a), k' the wavenumber there; see `damped`.

    Raises
    ------
    ValueError
        If the polarisation is unknown, an index or the number of orders is none, or a length is not positive
        and finite.
    """
    from scipy.special import jv

    from fringetrace.rigorous.bessel import ratios

    check_polarisation(polarisation)
    radius, index, host, wavelength = (
        np.asarray(v)[..., None]
        for v in np.broadcast_arrays(radius, checked_index(index, "Index"), host, wavelength)
    )
    radius, wavelength = checked_lengths(radius, "Radius"), checked_lengths(wavelength, "Wavelength")
    if not np.all((host > 0.0) & (host < np.inf)):
        raise ValueError(f"Host: expected a positive real refractive index, got {host[..., 0]}")
    orders = checked_whole(orders, 0, "Orders")
    n = np.arange(orders + 2)
    x = 2.0 * math.pi * host * radius / wavelength
    j, h = jv(n, x), hankel(x[..., 0], orders + 1)[..., orders + 1 :]
    conducting = np.isinf(index)
    contrast = np.where(conducting, 1.0, index) / host
    z = (contrast * x)[..., 0]
    inside = ratios(z, 1.0, orders + 1)  # J_{n-1} / J_n from n = 1, of what may underflow
    (j, dj), (h, dh) = _with_derivative(j, n / x), _with_derivative(h, n / x)
    rest = inside[..., :-1] - n[1:-1] / z[..., None]
    slope = np.concatenate([-1.0 / inside[..., :1], rest], -1)  # J_n' / J_n
    slope = slope * (contrast if polarisation == "s" else 1.0 / contrast)
    below = slope * h - dh
    response = -(slope * j - dj) / below
    hard = -j / h if polarisation == "s" else -dj / dh
    response = np.where(conducting, hard, response)
    within = np.where(conducting, 0.0, -2j / (math.pi * x) / below)
    order = np.arange(-orders, orders + 1)
    fold, sign = abs(order), np.where(order < 0, (-1.0) ** order, 1.0)  # of J_-n and H_-n
    weight = np.asarray(abs(h)[..., fold], np.float64)
    return response[..., fold], weight, within[..., fold] * sign


def _with_derivative(wave: ComplexArray, steep: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Z_n and Z_n' = Z_{n-1} - n Z_n / x of orders 0 to N, from Z_n and n / x of orders 0 to N + 1."""
    slope = np.concatenate([-wave[..., 1:2], wave[..., :-2] - steep[..., 1:-1] * wave[..., 1:-1]], -1)
    return wave[..., :-1], slope


def hankel(argument: FloatArray, orders: int) -> ComplexArray:
    """H_n^(1) of orders -N to N, (..., 2 N + 1), by upward recurrence, along which it never shrinks.

    Above `LARGEST` it is held there.
    """
    from scipy.special import hankel1

    rising = [hankel1(0, argument), hankel1(1, argument)]
    for n in range(1, orders):
        rising.append(_held(2.0 * n / argument * rising[n] - rising[n - 1]))
    positive = np.stack(rising[: orders + 1], -1)
    sign = (-1.0) ** np.arange(orders, 0, -1)
    return np.concatenate([sign * positive[..., :0:-1], positive], -1)


def _held(wave: ComplexArray) -> ComplexArray:
    """A wave of a size up to `LARGEST`: of higher ones Y_n is all that float64 knows, and below 0."""
    return np.where(abs(wave) > LARGEST, -1j * LARGEST, wave)


def damped(orders: Array, inner: ArrayLike, outer: complex) -> ComplexArray:
    """Ratios J_n(z) / J_n(z') of waves inside a cylinder, z on the way from its axis to z' on its surface.

    Parameters
    ----------
    orders : (2 N + 1,) int
        -N to N.
    inner : (p,) complex
        z.
    outer : complex
        z', of the same argument.

    Returns
    -------
    (p, 2 N + 1) complex128
    """
    from scipy.special import jve

    from fringetrace.rigorous.bessel import ratios

    half, z = int(orders[-1]), np.asarray(inner, np.complex128)[:, None]
    n = np.arange(half + 1)
    there = jve(n, outer)
    known = int(np.flatnonzero(abs(there) > 1.0 / LARGEST)[-1]) + 1  # beyond, both underflow
    found = np.zeros((len(z), half + 1), np.complex128)
    shrunk = np.exp(abs(z.imag) - abs(outer.imag))  # jve is free of exp(|Im|)
    found[:, :known] = jve(n[:known], z) / there[:known] * shrunk
    if known <= half:
        tiny = np.where(abs(z) < abs(outer) / LARGEST, outer / LARGEST, z)
        steps = ratios(outer, 1.0, half)[known - 1 :] / ratios(tiny[:, 0], 1.0, half)[:, known - 1 :]
        found[:, known:] = found[:, known - 1 : known] * np.cumprod(steps, -1)
    return found[:, abs(orders)]


def outgoing_waves(displacement: FloatArray, k: float, orders: int) -> ComplexArray:
    """Cylindrical waves H_l(k R) exp(i l phi), orders -N to N, at displacements (..., 2); 0 at R = 0."""
    distance = np.hypot(displacement[..., 0], displacement[..., 1])
    here = distance == 0.0
    azimuth = np.arctan2(displacement[..., 1], displacement[..., 0])
    wave = hankel(np.where(here, orders + 1.0, k * distance), orders)  # of anything finite, here
    wave *= np.exp(1j * azimuth[..., None] * np.arange(-orders, orders + 1))
    wave[here] = 0.0
    return wave


def lattice_sums(beta: ArrayLike, k: ArrayLike, pitch: float, orders: int) -> ComplexArray:
    """Lattice sums of a row: cylindrical waves at one cylinder from all the others in the row.

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
