"""Thin films: reflection and transmission of plane waves by stacks of layers, and by bare faces.

Amplitudes are those of E with fields as exp(+i k n x). r of p light has Byrnes' sign: at normal
incidence r_p = -r_s, and H is reflected with r_p. Sources: M. Born, E. Wolf, Principles of Optics,
sections 1.5 and 1.6; S. J. Byrnes, arXiv:1603.02720 (the program tmm).
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from fringetrace.exact import jit
from fringetrace.materials import Material, as_material
from fringetrace.waves import ComplexArray, FloatArray, checked_wavelength


@jit
def normal(index, sine2):
    """Normal part kz / k0 = sqrt(n^2 - sine2) of the wave that goes on: Im > 0, or Re > 0 where it is real.

    Waves that come out of an absorbing medium may grow along z, as they are damped along x: there
    the branch with Re + Im > 0 is the one that goes on into that of a transparent medium.
    """
    root = cmath.sqrt(index * index - sine2)
    return -root if root.real + root.imag < 0.0 else root


@jit
def across(index, sine2, thickness, k0):
    """Matrix of a layer, times p = exp(i k0 kz d): its diagonal, i sin / kz, i kz sin, and p.

    In terms of p, which cannot overflow, and of a quotient that stays finite at kz = 0.
    """
    square = index * index - sine2
    kz = cmath.sqrt(square)
    kz = -kz if kz.imag < 0.0 else kz
    delta = k0 * thickness * kz
    p = cmath.exp(1j * delta)
    if abs(delta) > 0.5:
        quotient = 0.5 * (1.0 - p * p) / kz
    elif delta != 0.0:
        quotient = -1j * p * cmath.sin(delta) / kz
    else:
        quotient = -1j * k0 * thickness * p
    return 0.5 * (1.0 + p * p), quotient, square * quotient, p


@jit
def stack(sine2, first, layers, thickness, last, k0):
    """Amplitudes (rs, rp, ts, tp) of a stack of layers between two half spaces.

    sine2 = (n sin(theta))^2 of the first half space, the same all through the stack; `first`,
    `last` and `layers` (m,) are complex indices, in the order that light meets them; `thickness`
    (m,) in metres; k0 = 2 pi / wavelength. Goes back through the stack by the tangential fields
    (E and H): each layer's matrix is scaled by exp(i k0 kz d), and fields are by their size, so
    that nothing overflows, however thick or many the layers; |r| is good to some 1e-16 a layer.
    """
    kz1, kz2 = normal(first, sine2), normal(last, sine2)
    if len(layers) == 0 and first == last:
        return 0j, 0j, 1.0 + 0j, 1.0 + 0j
    es, hs, gs = 1.0 + 0j, kz2, 1.0 + 0j
    hp, ep, gp = 1.0 + 0j, kz2 / (last * last), 1.0 + 0j
    for j in range(len(layers) - 1, -1, -1):
        middle, quotient, product, p = across(layers[j], sine2, thickness[j], k0)
        w = layers[j] * layers[j]
        es, hs = middle * es + quotient * hs, product * es + middle * hs
        hp, ep = middle * hp + w * quotient * ep, product / w * hp + middle * ep
        size = 1.0 / (abs(es) + abs(hs))
        es, hs, gs = es * size, hs * size, gs * (p * size)
        size = 1.0 / (abs(hp) + abs(ep))
        hp, ep, gp = hp * size, ep * size, gp * (p * size)
    q1 = kz1 / (first * first)
    s, c = kz1 * es + hs, q1 * hp + ep
    return (
        (kz1 * es - hs) / s,
        (q1 * hp - ep) / c,
        2.0 * kz1 / s * gs,
        2.0 * q1 / c * gp * (first / last),
    )


@jit
def carried(sine2, first, last):
    """Power across a face or film for |t|^2 = 1, of s and of p light: T = carried * |t|^2.

    The normal part of the Poynting vector behind, by that before; T = 0 where light is totally
    reflected. If the first half space absorbs, R + T is not the whole (Byrnes, section 3).
    """
    kz1, kz2 = normal(first, sine2), normal(last, sine2)
    s = kz2.real / kz1.real
    before = (first * first * kz1.conjugate()).real / abs(first * first)
    behind = (last * last * kz2.conjugate()).real / abs(last * last)
    return s, behind / before


@jit
def stacks(sine2, first, layers, thickness, last, k0):
    """`stack` for arrays (k,) of sine2, first, last, k0, and (k, m) of layers: (4, k) amplitudes."""
    out = np.empty((4, len(sine2)), np.complex128)
    for i in range(len(sine2)):
        out[0, i], out[1, i], out[2, i], out[3, i] = stack(
            sine2[i], first[i], layers[i], thickness, last[i], k0[i]
        )
    return out


@jit
def shares(sine2, first, last):
    """`carried` for arrays (k,): (2, k)."""
    out = np.empty((2, len(sine2)))
    for i in range(len(sine2)):
        out[0, i], out[1, i] = carried(sine2[i], first[i], last[i])
    return out


class Amplitudes(NamedTuple):
    """Complex amplitudes of E: reflected s and p, transmitted s and p; arrays of one shape."""

    rs: ComplexArray
    rp: ComplexArray
    ts: ComplexArray
    tp: ComplexArray


class Powers(NamedTuple):
    """Fractions of the power of s and of p light; arrays of one shape."""

    s: FloatArray
    p: FloatArray


@dataclass(frozen=True)
class Film:
    """Layers on each other, in the order that light from the front meets them.

    Parameters
    ----------
    layers : sequence of (material, thickness)
        Material, index or name, and metres. None at all is a bare face.

    Raises
    ------
    ValueError
        If a layer is no such pair, or a thickness is no length of 0 or more.
    TypeError
        If a material is none.
    """

    layers: tuple[tuple[Material, float], ...] = ()

    def __post_init__(self) -> None:
        checked = []
        for k, layer in enumerate(self.layers):
            try:
                material, thickness = layer
            except (TypeError, ValueError):
                raise ValueError(f"Film layer {k}: expected (material, thickness), got {layer!r}") from None
            if not (isinstance(thickness, (int, float, np.number)) and 0.0 <= thickness < math.inf):
                raise ValueError(
                    f"Film layer {k}: expected a thickness of 0 or more metres, got {thickness!r}"
                )
            checked.append((as_material(material, f"Film layer {k}"), float(thickness)))
        object.__setattr__(self, "layers", tuple(checked))

    @property
    def thickness(self) -> FloatArray:
        """(m,) float64, metres."""
        return np.array([thickness for _, thickness in self.layers], dtype=np.float64)

    @property
    def dispersive(self) -> bool:
        """Whether an index may change with the wavelength."""
        return any(material.dispersive for material, _ in self.layers)

    def indices(self, wavelength: npt.ArrayLike) -> ComplexArray:
        """Complex indices of the layers.

        Parameters
        ----------
        wavelength : float64, metres, any shape (...)

        Returns
        -------
        (..., m) complex128
        """
        shape = np.shape(wavelength)
        out = np.empty((*shape, len(self.layers)), np.complex128)
        for k, (material, _) in enumerate(self.layers):
            out[..., k] = material.index(wavelength)
        return out

    def reversed(self) -> Film:
        """The film as light from behind meets it."""
        return Film(self.layers[::-1])


def quarter_wave_stack(
    high: Material | complex | str, low: Material | complex | str, pairs: int, wavelength: float
) -> Film:
    """The dielectric mirror (HL)^pairs H: layers a quarter of a wave thick at normal incidence.

    Parameters
    ----------
    high, low : Material, index or name
    pairs : int
        0 or more; one more layer of `high` closes the film.
    wavelength : float, metres
        Vacuum wavelength it is made for.

    Returns
    -------
    Film

    Raises
    ------
    ValueError
        If `pairs` is negative or no integer.
    """
    if not (isinstance(pairs, (int, np.integer)) and pairs >= 0):
        raise ValueError(f"quarter-wave stack: expected 0 or more pairs, got {pairs!r}")
    w = checked_wavelength(wavelength)
    h, v = ((m, 0.25 * w / float(m.index(w).real)) for m in (as_material(high), as_material(low)))
    return Film((h, v) * pairs + (h,))


def _checked_angles(theta: FloatArray) -> FloatArray:
    wrong = ~((theta >= 0.0) & (theta <= 0.5 * math.pi))
    if wrong.any():
        raise ValueError(f"angle of incidence: expected 0 to pi/2 radians, got {theta[wrong].flat[0]}")
    return theta


def _incidence(
    film: Film | None,
    first: Material | complex | str,
    last: Material | complex | str,
    angle: npt.ArrayLike,
    wavelength: npt.ArrayLike,
) -> tuple[tuple[int, ...], dict[str, Any]]:
    """Shape of the answer, and flat arrays of sine2, first, layers, last and k0."""
    theta, w = np.broadcast_arrays(
        np.asarray(angle, dtype=np.float64), np.asarray(wavelength, dtype=np.float64)
    )
    _checked_angles(theta)
    flat = np.ascontiguousarray(w.reshape(-1))
    n1, n2 = (as_material(m, "half space").index(flat) for m in (first, last))
    sine2 = (n1 * np.sin(theta.reshape(-1))) ** 2
    layers = (film or Film()).indices(flat)
    return theta.shape, {
        "sine2": sine2, "first": n1, "layers": layers, "last": n2, "k0": 2.0 * math.pi / flat
    }  # fmt: skip


def coefficients(
    film: Film | None,
    first: Material | complex | str,
    last: Material | complex | str,
    angle: npt.ArrayLike,
    wavelength: npt.ArrayLike,
) -> Amplitudes:
    """Amplitudes of E behind and before a film between two half spaces.

    Parameters
    ----------
    film : Film or None
        None: a bare face.
    first, last : Material, index or name
        Before and behind.
    angle : float64, radians, any shape
        Of incidence, 0 to pi/2, in `first`.
    wavelength : float64, metres, any shape
        Vacuum wavelength; broadcast with `angle`.

    Returns
    -------
    Amplitudes
        rs, rp, ts, tp, complex128 of the broadcast shape; phases at the outer faces of the film.

    Raises
    ------
    ValueError
        If an angle or wavelength is out of range, of the film or of a material.
    """
    shape, wave = _incidence(film, first, last, angle, wavelength)
    thickness = (film or Film()).thickness
    out = stacks(wave["sine2"], wave["first"], wave["layers"], thickness, wave["last"], wave["k0"])
    return Amplitudes(*out.reshape(4, *shape))


def reflectance(
    film: Film | None,
    first: Material | complex | str,
    last: Material | complex | str,
    angle: npt.ArrayLike,
    wavelength: npt.ArrayLike,
) -> Powers:
    """Fraction of the power that a film reflects, |r|^2; arguments as in `coefficients`.

    Returns
    -------
    Powers
        s and p, float64 of the broadcast shape.
    """
    amplitudes = coefficients(film, first, last, angle, wavelength)
    return Powers(np.abs(amplitudes.rs) ** 2, np.abs(amplitudes.rp) ** 2)


def transmittance(
    film: Film | None,
    first: Material | complex | str,
    last: Material | complex | str,
    angle: npt.ArrayLike,
    wavelength: npt.ArrayLike,
) -> Powers:
    """Fraction of the power that gets behind a film; arguments as in `coefficients`.

    Returns
    -------
    Powers
        s and p, float64 of the broadcast shape: into the first nanometre of an absorbing half space.
    """
    shape, wave = _incidence(film, first, last, angle, wavelength)
    amplitudes = coefficients(film, first, last, angle, wavelength)
    s, p = shares(wave["sine2"], wave["first"], wave["last"]).reshape(2, *shape)
    return Powers(s * np.abs(amplitudes.ts) ** 2, p * np.abs(amplitudes.tp) ** 2)


def fresnel(first: npt.ArrayLike, last: npt.ArrayLike, angle: npt.ArrayLike) -> Amplitudes:
    """Fresnel's amplitudes of a bare face, from indices alone.

    Parameters
    ----------
    first, last : complex128, any shape
        Indices n + i kappa before and behind.
    angle : float64, radians, any shape
        Of incidence; broadcast with the indices.

    Returns
    -------
    Amplitudes
        rs, rp, ts, tp, complex128 of the broadcast shape.

    Raises
    ------
    ValueError
        If an angle is not from 0 to pi/2.
    """
    n1, n2, theta = np.broadcast_arrays(
        np.asarray(first, dtype=np.complex128), np.asarray(last, dtype=np.complex128),
        np.asarray(angle, dtype=np.float64),
    )  # fmt: skip
    flat = _checked_angles(theta).reshape(-1)
    n1, n2, shape = np.ascontiguousarray(n1.reshape(-1)), np.ascontiguousarray(n2.reshape(-1)), theta.shape
    none = np.empty((len(flat), 0), np.complex128)
    sine2 = (n1 * np.sin(flat)) ** 2
    return Amplitudes(*stacks(sine2, n1, none, np.empty(0), n2, np.ones(len(flat))).reshape(4, *shape))
