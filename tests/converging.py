"""A paraboloid that focuses a beam: its rays, its CCD and closed forms of its irradiance."""

import numpy as np

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.geometry import forms, shapes

HENE = 632.8 * nm
F = 50 * mm
CCD_AT, SIDE = 20 * mm, 3.4 * mm
# Edges are known to 1e-4 of a pixel, and 2 % of pixels are on them: of the mean, root mean square.
COVERAGE = 3e-5


def paraboloid(cells=40, pitch=0.2 * mm):
    """z = r^2 / 4 F over a square of 8 mm."""
    along = (np.arange(cells + 1) - 0.5 * cells) * pitch
    mesh = shapes.height_map((along**2 + along[:, None] ** 2) / (4 * F), pitch)
    return ft.Surface(mesh, ft.Mirror(), "mirror", form=forms.Conic((0, 0, 0), (0, 0, 1), 2 * F, conic=-1.0))


def seen(surfaces, count, pixels, width=6 * mm):
    """Paths of a beam straight down, and its CCD."""
    beam = ft.Beam((0, 0, 30 * mm), (0, 0, -1), (0, 1, 0), (width, width), (count, count))
    ccd = ft.CCD((0, 0, CCD_AT), (0, 0, -1), (0, 1, 0), SIDE / pixels, (pixels, pixels))
    return ft.trace(ft.Scene(surfaces), beam, ccd)


def bright(x, y):
    """Irradiance of the converging wave: r = 2 F tan(t / 2) leaves at an angle t to the axis."""
    depth = F - CCD_AT
    away = np.sqrt(x * x + y * y + depth * depth)
    # F / cos^2(t / 2) is the distance of the mirror from the focus, and cos t = depth / away
    return (2 * F / (away + depth)) ** 2 * depth / away


def landing(points):
    """Where the light of points (n, 2) across the beam falls on the CCD."""
    r = np.hypot(*points.T)
    return points / r[:, None] * ((F - CCD_AT) * np.tan(2 * np.arctan(r / (2 * F))))[:, None]


def scanned(pixels, ranges, rows=128):
    """Means over pixels of `bright`, over ranges (a, b) of x for each scan line y; Gauss points along x."""
    pitch = SIDE / pixels
    y = (np.arange(pixels * rows) + 0.5) / rows * pitch - 0.5 * SIDE
    sides = (np.arange(pixels + 1) - 0.5 * pixels) * pitch
    nodes, weights = np.polynomial.legendre.leggauss(5)
    total = np.zeros((len(y), pixels))
    for begin, end in ranges(y):
        a, b = (np.clip(edge[:, None], sides[:-1], sides[1:]) for edge in (begin, end))
        for node, weight in zip(nodes, weights, strict=True):
            x = 0.5 * (a + b) + 0.5 * (b - a) * node
            total += 0.5 * weight * (b - a) * bright(x, y[:, None])
    return (total / pitch).reshape(pixels, rows, pixels).mean(axis=1)


def between(y, curve):
    """Least and largest x of a convex closed curve (n, 2) at each y; NaN beside it."""
    low, high = np.argmin(curve[:, 1]), np.argmax(curve[:, 1])
    turned = np.roll(curve, -low, axis=0)
    top = (high - low) % len(curve)
    one, other = turned[: top + 1], np.vstack([turned[top:], turned[:1]])[::-1]
    x = [np.interp(y, part[:, 1], part[:, 0], left=np.nan, right=np.nan) for part in (one, other)]
    return np.minimum(*x), np.maximum(*x)


def rms(image, truth):
    return np.sqrt(np.mean((image - truth) ** 2)) / truth.mean()
