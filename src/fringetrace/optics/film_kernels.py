"""Compiled Fresnel coefficients of bare interfaces, and characteristic matrices of thin films."""

from __future__ import annotations

import cmath
import math

import numpy as np

from fringetrace.core import ComplexArray, FloatArray, jit, part

# A wave fades along a boundary if so much of its squared wave number there is imaginary: more than rounding.
ASLANT = 1e-9


def normal_part(index: ComplexArray, theta: FloatArray) -> ComplexArray:
    """Normal component N cos(theta) for `stacks`; 0 at the float pi/2, slightly below a right angle."""
    return index * np.where(theta < 0.5 * math.pi, np.cos(theta), 0.0)


@jit
def layer_matrix(square, thickness, k0):
    """Characteristic matrix of a layer, times p = exp(i k0 kz d): diagonal, i sin / kz, i kz sin, and p.

    From kz^2, in terms of p, which cannot overflow, and of a quotient that stays finite at kz = 0.
    """
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


@part
def answered(q, field, across):
    """Reflection and transmission amplitudes of a wave of normal component q, from E and H at the stack."""
    whole = q * field + across
    if whole == 0.0:  # a wave along a film of its own medium
        return 0j, 1.0 / field
    return (q * field - across) / whole, 2.0 * q / whole


@jit
def stack_amplitudes(q1, first, layers, thickness, last, k0):
    """Amplitudes (rs, rp, ts, tp) of a thin-film stack between two half-spaces.

    q1 = n cos(theta) is the normal part of the wave vector before the stack, over k0; `first`,
    `last` and `layers` (m,) are complex indices, in the order that light meets them; `thickness`
    (m,) in metres; k0 = 2 pi / wavelength. Goes back through the stack by the tangential fields
    (E and H): each layer's matrix is scaled by exp(i k0 kz d), and fields are by their size, so
    that nothing overflows, however thick or many the layers; |r| is good to some 1e-16 a layer,
    at grazing incidence too, where n^2 - n^2 sin(theta)^2 would have lost its digits.
    """
    if len(layers) == 0 and first == last:
        return 0j, 0j, 1.0 + 0j, 1.0 + 0j
    q2 = beneath(first, last, q1)
    es, hs, gs = 1.0 + 0j, q2, 1.0 + 0j
    hp, ep, gp = 1.0 + 0j, q2 / (last * last), 1.0 + 0j
    for j in range(len(layers) - 1, -1, -1):
        w = layers[j] * layers[j]
        square = (layers[j] - first) * (layers[j] + first) + q1 * q1
        middle, quotient, product, p = layer_matrix(square, thickness[j], k0)
        es, hs = middle * es + quotient * hs, product * es + middle * hs
        hp, ep = middle * hp + w * quotient * ep, product / w * hp + middle * ep
        size = 1.0 / (abs(es) + abs(hs))
        es, hs, gs = es * size, hs * size, gs * (p * size)
        size = 1.0 / (abs(hp) + abs(ep))
        hp, ep, gp = hp * size, ep * size, gp * (p * size)
    rs, ts = answered(q1, es, hs)
    rp, tp = answered(q1 / (first * first), hp, ep)
    return rs, rp, ts * gs, tp * gp * (first / last)


@jit
def power_factors(q1, first, last):
    """Power transmittance for |t|^2 = 1, of s and p light: T = power_factors * |t|^2.

    The normal part of the Poynting vector behind, by that before; T = 0 where light is totally
    reflected, or runs along the face. If the first half space absorbs, R + T is not the whole
    (Byrnes, section 3).
    """
    if first == last:
        return 1.0, 1.0
    s, p = flow(first, q1)
    through_s, through_p = flow(last, beneath(first, last, q1))
    return (through_s / s, through_p / p) if q1 != 0.0 else (0.0, 0.0)


@jit
def stacks(q1, first, layers, thickness, last, k0):
    """`stack_amplitudes` for arrays (k,) of q1, first, last, k0, and (k, m) of layers: (4, k) amplitudes."""
    out = np.empty((4, len(q1)), np.complex128)
    for i in range(len(q1)):
        out[0, i], out[1, i], out[2, i], out[3, i] = stack_amplitudes(
            q1[i], first[i], layers[i], thickness, last[i], k0[i]
        )
    return out


@jit
def shares(q1, first, last):
    """`power_factors` for arrays (k,): (2, k)."""
    out = np.empty((2, len(q1)))
    for i in range(len(q1)):
        out[0, i], out[1, i] = power_factors(q1[i], first[i], last[i])
    return out


@part
def forward(squared):
    """Normal wave-vector component from its square: the root that propagates or decays forwards.

    Waves that come out of an absorbing medium may grow along the normal, as they are damped along the
    face: the branch with Re + Im > 0 is the one that goes on into that of a transparent medium.
    """
    root = np.sqrt(squared)
    return -root if root.real + root.imag < 0.0 else root


@part
def flow(index, normal):
    """Power flux through an interface for unit amplitude, s and p: n cos, except in absorbing media."""
    return normal.real, (index * (normal / index).conjugate()).real


@part
def shared(through, before):
    """Amplitudes of power from amplitudes of E; nothing is transmitted where no power flows."""
    return np.sqrt(through / before) if through > 0.0 and before > 0.0 else 0.0


@part
def face_amplitudes(first, q1, last, q2):
    """Fresnel coefficients r_s, r_p, t_s, t_p of E, from n and n cos of both sides; signs as in `films`."""
    a, b = last * last * q1, first * first * q2
    s, p = 1.0 / (q1 + q2), 1.0 / (a + b)
    return (q1 - q2) * s, (a - b) * p, 2.0 * q1 * s, 2.0 * first * last * q1 * p


@part
def clear(first, last, q):
    """Power amplitudes like `bare` between transparent media, from the real normal component before."""
    square = (last - first) * (last + first) + q * q
    deep = np.sqrt(abs(square))
    a, b = last * last * q, first * first * deep
    if square >= 0.0:
        s, p, root = 1.0 / (q + deep), 1.0 / (a + b), 2.0 * np.sqrt(q * deep)
        ts, tp = root * s, first * last * root * p
        return complex((q - deep) * s), complex((a - b) * p), complex(ts), complex(tp), complex(deep)
    s, p = 1.0 / (q * q + deep * deep), 1.0 / (a * a + b * b)
    rs = complex((q - deep) * (q + deep) * s, -2.0 * q * deep * s)
    rp = complex((a - b) * (a + b) * p, -2.0 * a * b * p)
    return rs, rp, 0j, 0j, complex(0.0, deep)


@part
def aslant(first, q1):
    """Whether a wave decays along the boundary; never between parallel faces.

    As an endless wave it might bring power along that is not in it; rays are to keep theirs.
    """
    return abs((q1 * q1 - first * first).imag) > ASLANT * abs(first * first)


@part
def bounded(r, t):
    """Power amplitudes limited to the incident power, the reflected one first."""
    size = r.real * r.real + r.imag * r.imag
    rest, through = 1.0 - size, t.real * t.real + t.imag * t.imag
    if rest <= 0.0:
        return r / np.sqrt(size), 0j
    return r, t * np.sqrt(rest / through) if through > rest else t


@part
def bare(first, last, q1):
    """Power amplitudes r_s, r_p, t_s, t_p of a bare boundary, and the normal component behind it."""
    if first == last:
        return 0j, 0j, 1.0 + 0j, 1.0 + 0j, q1
    if first.imag == 0.0 and last.imag == 0.0 and q1.imag == 0.0 and q1.real > 0.0:
        return clear(first.real, last.real, q1.real)
    q2 = beneath(first, last, q1)
    rs, rp, ts, tp = face_amplitudes(first, q1, last, q2)
    s, p = powers(first, q1, last, q2)
    ts, tp = ts * s, tp * p
    if aslant(first, q1):
        (rs, ts), (rp, tp) = bounded(rs, ts), bounded(rp, tp)
    return rs, rp, ts, tp, q2


@part
def beneath(first, last, q1):
    """Normal wave-vector component behind a boundary."""
    return q1 if first == last else forward((last - first) * (last + first) + q1 * q1)


@part
def powers(first, q1, last, q2):
    """Power amplitudes from amplitudes of E behind a boundary, of s and p light."""
    s, p = flow(first, q1)
    through_s, through_p = flow(last, q2)
    return shared(through_s, s), shared(through_p, p)


@jit
def coated(film, surface, front, first, last, q1, k0):
    """Power amplitudes of a boundary with a film on it, met from the front or from the back."""
    q2 = beneath(first, last, q1)
    begin, indices, thickness, backwards = film
    a, b = begin[surface], begin[surface + 1]
    layers = indices[a:b] if front else backwards[0][a:b]
    depth = thickness[a:b] if front else backwards[1][a:b]
    rs, rp, ts, tp = stack_amplitudes(q1, first, layers, depth, last, k0)
    s, p = powers(first, q1, last, q2)
    ts, tp = ts * s, tp * p
    if aslant(first, q1):
        (rs, ts), (rp, tp) = bounded(rs, ts), bounded(rp, tp)
    return rs, rp, ts, tp, q2
