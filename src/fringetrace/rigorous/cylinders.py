"""Rigorous scattering by parallel circular cylinders: cylindrical waves and multiple scattering.

Everything lies in the plane across the cylinders, x and y; light travels in that plane. Polarisation
``"s"`` has the electric field along the cylinders, ``"p"`` the magnetic field; that field component is
the wave u. Outside a cylinder j, with polar coordinates about its centre,

    u = sum_n [a_jn J_n(k r) + b_jn H_n(k r)] exp(i n phi),    b_jn = S_jn a_jn,

where the waves of all others make up a_jn by Graf's addition theorem (V. Twersky, J. Acoust. Soc. Am.
24, 42 (1952); C. F. Bohren and D. R. Huffman, Absorption and Scattering of Light by Small Particles, 8.4).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fringetrace.core import Array, ComplexArray, FloatArray, checked_angles, checked_whole, short_repr
from fringetrace.geometry import check_circles_apart
from fringetrace.optics import Polarisation
from fringetrace.rigorous.cylindrical_waves import (
    CONDUCTOR as CONDUCTOR,
    Index,
    boundary,
    checked_index,
    damped,
    hankel,
    indices_at,
    truncation,
)
from fringetrace.rigorous.multiple_scattering import solve


@dataclass(frozen=True)
class Cylinders:
    """Parallel circular cylinders in a transparent host.

    Attributes
    ----------
    centres : (n, 2) float64, metres
    radii : (n,) float64, metres
        One number does for all.
    index : complex, function of the wavelength in metres, or n of these
        Refractive index n + i kappa; `CONDUCTOR` for a perfect conductor.
    host : float, or function of the wavelength in metres
        Real refractive index around them.

    Raises
    ------
    ValueError
        If shapes do not match, a radius is not positive, an index is none, or cylinders overlap.
    """

    centres: ArrayLike
    radii: ArrayLike
    index: Index | Sequence[Index]
    host: Index = 1.0

    __repr__ = short_repr

    def __post_init__(self) -> None:
        centres = np.atleast_2d(np.asarray(self.centres, np.float64))
        if centres.ndim != 2 or centres.shape[1] != 2 or len(centres) == 0:
            raise ValueError(f"Cylinders: expected centres of shape (n, 2), got {centres.shape}")
        if not np.isfinite(centres).all():
            raise ValueError("Cylinders: expected finite centres in metres, got NaN or infinity")
        radii = np.broadcast_to(np.asarray(self.radii, np.float64), (len(centres),))
        if not np.all((radii > 0) & (radii < np.inf)):
            raise ValueError(f"Cylinders: expected positive radii in metres, got {radii.min()}")
        several = _each(self.index)
        if len(several) not in (1, len(centres)):
            raise ValueError(f"Cylinders: expected 1 or {len(centres)} indices, got {len(several)}")
        for index in (*several, self.host):
            if not callable(index):
                checked_index(index, "Cylinders")
        check_circles_apart(centres, radii, "Cylinders")
        object.__setattr__(self, "centres", centres)
        object.__setattr__(self, "radii", radii)


class Widths(NamedTuple):
    """Cross-sections per length (widths) of extinction, scattering and absorption, metres, (q,)."""

    extinction: FloatArray
    scattering: FloatArray
    absorption: FloatArray

    def __repr__(self) -> str:
        return short_repr(self)


@dataclass(frozen=True)
class Scattered:
    """Waves scattered by cylinders at one wavelength.

    Attributes
    ----------
    cylinders : Cylinders
    wavelength : float, metres
        In vacuum.
    polarisation : ``"s"`` or ``"p"``
    angle : (q,) float64, radians
        Where the incident waves travel to, from +x towards +y.
    exciting, outgoing : (q, n, 2 N + 1) complex128
        a and b of orders -N to N, for an incident wave of amplitude 1 and phase 0 at the origin.
    """

    cylinders: Cylinders
    wavelength: float
    polarisation: Polarisation
    angle: FloatArray
    exciting: ComplexArray
    outgoing: ComplexArray

    __repr__ = short_repr

    @property
    def wavenumber(self) -> float:
        """Wavenumber in the host, 1/m."""
        return _wavenumber(self.cylinders, self.wavelength)

    @property
    def orders(self) -> Array:
        """Orders -N to N of the cylindrical waves."""
        half = self.outgoing.shape[-1] // 2
        return np.arange(-half, half + 1)


def scattering_coefficients(
    radius: ArrayLike, index: ArrayLike, host: float, wavelength: ArrayLike, polarisation: Polarisation,
    orders: int,
) -> ComplexArray:  # fmt: skip
    """Scattering coefficients S_n of single cylinders: b_n = S_n a_n.

    Parameters
    ----------
    radius, wavelength : float or array, metres
        The wavelength in vacuum; these and the index broadcast.
    index : complex or array
        n + i kappa; `CONDUCTOR` for a perfect conductor.
    host : float or array
        Refractive index around.
    polarisation : ``"s"`` or ``"p"``
    orders : int
        N.

    Returns
    -------
    (..., 2 N + 1) complex128
        Orders -N to N.
    """
    return boundary(radius, index, host, wavelength, polarisation, orders)[0]


def efficiencies(
    radius: float, index: complex, host: float, wavelength: float, polarisation: Polarisation
) -> Widths:
    """Efficiencies of one cylinder: extinction, scattering and absorption width over diameter.

    Arguments as in `scattering_coefficients`; Bohren and Huffman, eq. 8.36.
    """
    size = 2.0 * math.pi * host * radius / wavelength
    found = scattering_coefficients(radius, index, host, wavelength, polarisation, truncation(size))
    extinction = -2.0 / size * found.real.sum(-1)
    scattering = 2.0 / size * (abs(found) ** 2).sum(-1)
    return Widths(extinction, scattering, extinction - scattering)


def scatter(
    cylinders: Cylinders, wavelength: float, angle: ArrayLike = 0.0, polarisation: Polarisation = "s",
    orders: int | None = None,
) -> Scattered:  # fmt: skip
    """Scattering of plane waves by a cluster of cylinders, with multiple scattering.

    Solved by elimination, or, where many centres lie on a rectangular grid (a lattice, staggered or not),
    by iteration with the coupling as a convolution.

    Parameters
    ----------
    cylinders : Cylinders
    wavelength : float, metres
        In vacuum.
    angle : float or (q,), radians
        Where the waves travel to, from +x towards +y.
    polarisation : ``"s"`` or ``"p"``
    orders : int, optional
        N; by default `truncation` of the largest cylinder.

    Returns
    -------
    Scattered

    Raises
    ------
    ValueError
        If the wavelength is not positive, the polarisation unknown, the host absorbs, or there are too many
        cylinders off a grid.
    """
    if not 0 < wavelength < math.inf:
        raise ValueError(f"Wavelength: expected a positive length in metres, got {wavelength}")
    k = _wavenumber(cylinders, wavelength)
    radii = np.asarray(cylinders.radii)
    orders = truncation(k * radii.max()) if orders is None else checked_whole(orders, 0, "Orders")
    response, weight, _ = boundary(
        radii,
        _indices(cylinders, wavelength),
        k * wavelength / (2 * math.pi),
        wavelength,
        polarisation,
        orders,
    )
    angles = np.atleast_1d(checked_angles(angle, "Angle"))
    incident = _incident(cylinders, k, angles, orders)
    exciting = solve(np.asarray(cylinders.centres), k, response, weight, incident)
    return Scattered(cylinders, wavelength, polarisation, angles, exciting, response * exciting)


def amplitude(scattered: Scattered, direction: ArrayLike) -> ComplexArray:
    """Scattering amplitude f in the far field: u = sqrt(2 / (pi k r)) exp(i (k r - pi / 4)) f.

    Parameters
    ----------
    scattered : Scattered
    direction : (t,), radians
        Where the light goes to, from +x towards +y.

    Returns
    -------
    (q, t) complex128
    """
    direction = np.atleast_1d(checked_angles(direction, "Direction"))
    n, k = scattered.orders, scattered.wavenumber
    centres = np.asarray(scattered.cylinders.centres)
    turned = scattered.outgoing * (-1j) ** n
    found = np.zeros((len(scattered.angle), len(direction)), np.complex128)
    for part in _chunks(len(direction), len(centres) + len(n)):
        theta = direction[part]
        phase = np.exp(-1j * k * (centres @ np.stack([np.cos(theta), np.sin(theta)])))
        fans = turned @ np.exp(1j * n[:, None] * theta)
        found[:, part] = (phase * fans).sum(1)
    return found


def differential_width(scattered: Scattered, direction: ArrayLike) -> FloatArray:
    """Differential scattering width d sigma / d theta = 2 |f|^2 / (pi k): (q, t) float64, m/rad."""
    power = abs(amplitude(scattered, direction)) ** 2
    return np.asarray(2.0 / (math.pi * scattered.wavenumber) * power, np.float64)


def widths(scattered: Scattered) -> Widths:
    """Extinction, scattering and absorption widths in metres, each computed independently.

    Extinction from the forward amplitude (optical theorem), scattering from the integral of the differential
    width, absorption from the power that flows into each cylinder; extinction is the sum of the two others.
    """
    k, centres = scattered.wavenumber, np.asarray(scattered.cylinders.centres)
    q = np.arange(len(scattered.angle))
    extinction = -4.0 / k * amplitude(scattered, scattered.angle)[q, q].real
    reach = np.hypot(*(centres - centres.mean(0)).T).max()
    # |f|^2 holds harmonics up to 2 (k reach + N), and hardly any beyond
    count = 2 * (truncation(k * reach) + len(scattered.orders)) if reach > 0 else 4 * len(scattered.orders)
    around = np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)
    scattering = 2.0 * math.pi * differential_width(scattered, around).mean(1)
    a, b = scattered.exciting, scattered.outgoing
    absorption = -4.0 / k * ((a.conj() * b).real + abs(b) ** 2).sum((1, 2))
    return Widths(extinction, scattering, absorption)


def near_field(scattered: Scattered, points: ArrayLike) -> ComplexArray:
    """Near field u, incident and scattered, at points outside and inside the cylinders.

    Parameters
    ----------
    scattered : Scattered
    points : (p, 2), metres

    Returns
    -------
    (q, p) complex128
        The electric ("s") or magnetic ("p") field along the cylinders, over the incident amplitude.
    """
    points = np.atleast_2d(np.asarray(points, np.float64))
    k, cylinders = scattered.wavenumber, scattered.cylinders
    centres, radii = np.asarray(cylinders.centres), np.asarray(cylinders.radii)
    along = np.stack([np.cos(scattered.angle), np.sin(scattered.angle)])
    found: ComplexArray = np.exp(1j * k * (points @ along)).T
    inside = np.full(len(points), -1)
    for j, (centre, radius) in enumerate(zip(centres, radii, strict=True)):
        offset = points - centre
        distance, azimuth = np.hypot(*offset.T), np.arctan2(offset[:, 1], offset[:, 0])
        within = distance < radius
        inside[within] = j
        wave = hankel(k * np.where(within, radius, distance), scattered.orders[-1])
        found += scattered.outgoing[:, j] @ (wave * np.exp(1j * azimuth[:, None] * scattered.orders)).T
    for j in np.unique(inside[inside >= 0]):
        found[:, inside == j] = _inner_field(scattered, int(j), points[inside == j])
    return found


def _inner_field(scattered: Scattered, j: int, points: FloatArray) -> ComplexArray:
    """The wave inside cylinder j at points (p, 2) in it."""
    cylinders, half = scattered.cylinders, int(scattered.orders[-1])
    index = _indices(cylinders, scattered.wavelength)[j]
    if np.isinf(index):
        return np.zeros((len(scattered.angle), len(points)), np.complex128)
    radius, host = np.asarray(cylinders.radii)[j], scattered.wavenumber * scattered.wavelength / (2 * math.pi)
    _, _, inner = boundary(radius, index, host, scattered.wavelength, scattered.polarisation, half)
    offset = points - np.asarray(cylinders.centres)[j]
    distance, azimuth = np.hypot(*offset.T)[:, None], np.arctan2(offset[:, 1], offset[:, 0])[:, None]
    k = 2.0 * math.pi * index / scattered.wavelength
    wave = damped(scattered.orders, k * distance[:, 0], k * radius) * np.exp(1j * azimuth * scattered.orders)
    found: ComplexArray = (scattered.exciting[:, j] * inner) @ wave.T
    return found


def _incident(cylinders: Cylinders, k: float, angle: FloatArray, orders: int) -> ComplexArray:
    """Plane waves about each centre: i^n exp(-i n angle) exp(i k . r_j), (q, n, 2 N + 1)."""
    n = np.arange(-orders, orders + 1)
    along = np.stack([np.cos(angle), np.sin(angle)])
    phase = np.exp(1j * k * (np.asarray(cylinders.centres) @ along)).T
    found: ComplexArray = phase[..., None] * (1j**n * np.exp(-1j * angle[:, None] * n))[:, None]
    return found


def _wavenumber(cylinders: Cylinders, wavelength: float) -> float:
    """Wave number in the host, 1/m."""
    host = complex(indices_at(cylinders.host, np.asarray(wavelength)))
    if not (host.real > 0 and host.imag == 0):
        raise ValueError(f"Host: expected a positive real refractive index, got {host}")
    return 2.0 * math.pi * host.real / wavelength


def _each(index: Index | Sequence[Index]) -> Sequence[Index]:
    """Indices of the cylinders, or one for all."""
    if isinstance(index, np.ndarray) and index.ndim:
        return list(index)
    return index if isinstance(index, Sequence) and not isinstance(index, str) else [index]


def _indices(cylinders: Cylinders, wavelength: float) -> ComplexArray:
    """Refractive index of each cylinder at a wavelength, (n,) complex128."""
    values = [indices_at(index, np.asarray(wavelength)) for index in _each(cylinders.index)]
    return np.broadcast_to(np.asarray(values, np.complex128), (len(np.asarray(cylinders.centres)),))


def _chunks(count: int, width: int) -> list[slice]:
    """Slices of a count of columns, each of at most some million numbers."""
    step = max(1, 2**20 // width)
    return [slice(start, start + step) for start in range(0, count, step)]
