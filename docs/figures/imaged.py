"""Truths for images of transparent cylinders and balls: rays in closed form, and waves exactly."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import h1vp, hankel1, jv, jvp

# Points of the integral over directions: panels, and Gauss points in each.
PANELS, POINTS = 96, 24


def refocused(height, radius, inside, around):
    """Image position, and added path, of a ray through a cylinder or ball, carried back to its middle.

    It meets the surface at a height from the axis; refractive indices inside and around.
    """
    i = np.arcsin(height / radius)
    r = np.arcsin(around * height / (inside * radius))
    chord, bend = 2 * radius * np.cos(r), r - i
    # along the chord, turned by r - i, and out at twice that
    x, z = height + chord * np.sin(bend), -radius * np.cos(i) + chord * np.cos(bend)
    on = -z / np.cos(2 * bend)
    return x + on * np.sin(2 * bend), inside * chord + around * (on - radius * np.cos(i))


def waves(x, radius, inside, around, wavelength, na, parallel=True):
    """Field of a plane wave behind a cylinder, imaged within an aperture onto its middle plane.

    u = sum of i^n (J_n + b_n H_n) exp(i n a) (van de Hulst, Light Scattering by Small Particles, ch. 15);
    i^n H_n exp(i n a) is 1 / pi times the integral over plane waves. E parallel to the axis, or H.
    """
    k, m = 2 * np.pi * around / wavelength, inside / around
    ka = k * radius
    n = np.arange(int(ka + 4.05 * ka ** (1 / 3) + 30))
    p, q = (m, 1.0) if parallel else (1.0, m)
    field, slope = jv(n, m * ka), jvp(n, m * ka)
    top = p * jv(n, ka) * slope - q * jvp(n, ka) * field
    b = -top / (p * hankel1(n, ka) * slope - q * h1vp(n, ka) * field)
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    panels, limit = np.linspace(-1.0, 1.0, PANELS + 1), math.asin(na / around)
    angle = limit * (0.5 * (panels[:-1] + panels[1:])[:, None] + nodes / PANELS).ravel()
    weight = limit / PANELS * np.tile(weights, PANELS)
    scattered = b[0] + 2 * np.cos(np.outer(angle, n[1:])) @ b[1:]
    return 1.0 + np.exp(1j * k * np.outer(x, np.sin(angle))) @ (scattered * weight) / np.pi
