"""Newton's rings: a spherical splitter over a flat mirror, in full field."""

import math

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm, um
from fringetrace.geometry import shapes

SODIUM = 589.3 * nm
R, HEIGHT = 1.0, 10 * mm
# |r| = |t|^2: the waves off the ball and off the flat are equally strong; with t a quarter wave from
# r and a half-wave loss at the flat, they are in opposition where they touch.
STRONG = 0.5 * (math.sqrt(5.0) - 1.0)
SPLITTER = ft.BeamSplitter(-STRONG, 1j * math.sqrt(STRONG))
# What the quadrature of a pixel may be off where fringes bend as much as they advance: in the middle.
IRRADIANCE, RMS = 5e-6, 2e-7


def cap(reach=6 * mm, count=33):
    """The lower side of a ball that touches z = 0, its vertices on the ball."""
    x = np.linspace(-reach, reach, count)
    z = R - np.sqrt(R**2 - x[:, None] ** 2 - x**2)
    return shapes.height_map(z, 2 * reach / (count - 1))


def traced(ccd, rays=48, gap=0.0, width=8 * mm):
    form = ft.forms.Sphere((0, 0, R + gap), R)
    ball = ft.Surface(cap().moved((0, 0, gap)), SPLITTER, "ball", form=form)
    flat = ft.Surface(shapes.plate(20 * mm, 20 * mm), ft.Mirror(), "flat")
    beam = ft.Beam((0, 0, HEIGHT), (0, 0, -1), (0, 1, 0), (width, width), (rays, rays))
    # light that goes to and fro between ball and flat is left out
    return ft.trace(ft.Scene([ball, flat]), beam, ccd, max_bounces=3)


def camera(size, pixels, at=0.0):
    """Sees the plane z = 0 through an ideal relay."""
    return ft.CCD((at, 0, HEIGHT), (0, 0, -1), (0, 1, 0), size / pixels, (pixels, pixels), focus=HEIGHT)


def rings(rho, gap=0.0):
    """|E|^2 at a distance from the axis on the plane z = 0: both rays that go there, exactly."""
    start = rho
    for _ in range(12):  # the sag is thousands of times smaller than the distance
        turn = np.arcsin(start / R)
        sag = gap + R * (1 - np.cos(turn))
        start = rho - sag * np.tan(2 * turn)
    # seen back from above the bowl: the ray that starts at r comes from r + sag(r) tan(2 turn(r))
    turn_slope = 1 / (R * np.cos(turn))
    slope = 1 + (np.tan(turn) * np.tan(2 * turn) + sag * 2 * turn_slope / np.cos(2 * turn) ** 2)
    around = np.where(rho > 0, rho / np.where(start > 0, start, 1.0), slope)
    k = 2 * math.pi / SODIUM
    behind = sag + sag / np.cos(2 * turn)
    return STRONG**2 * abs(1 - np.exp(-1j * k * behind) / np.sqrt(slope * around)) ** 2


@pytest.mark.parametrize("gap", [0.0, 1 * nm, 150 * nm])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_the_image_is_that_of_both_rays(gap):
    ccd = camera(5 * mm, 96)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    x = ((np.arange(96)[:, None] + 0.5 + 0.5 * nodes).ravel() - 48) * ccd.pitch
    bright = rings(np.hypot(x, x[:, None]), gap).reshape(96, 8, 96, 8)
    expected = np.einsum("iajb,a,b->ij", bright, weights / 2, weights / 2)
    image = ft.irradiance(traced(ccd, gap=gap), SODIUM)
    assert abs(image - expected).max() < IRRADIANCE
    assert np.sqrt(np.mean((image - expected) ** 2)) < RMS


@pytest.mark.parametrize(("order", "radius"), [(1, 0.767658722 * mm), (10, 2.427548417 * mm)])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_dark_rings_lie_where_newton_saw_them(order, radius):
    """r_m^2 = m lambda R - (m lambda / 2)^2."""
    assert radius == pytest.approx(math.sqrt(order * SODIUM * R - (order * SODIUM / 2) ** 2), rel=1e-9)
    # a column of small pixels across the ring
    ccd = camera(101 * 0.2 * um, 101, at=radius)
    image = ft.irradiance(traced(ccd), SODIUM)[50]
    low = np.argmin(image)
    near = slice(low - 3, low + 4)
    fit = np.polyfit(np.arange(-3, 4), image[near], 2)
    found = (low - 50 - 0.5 * fit[1] / fit[0]) * ccd.pitch
    # the ray off the ball leans: rings of order m shift by about radius * m lambda / R
    assert abs(found) < 5 * order * SODIUM * radius / R + 0.002 * um
    # a pixel is a six-hundredth of a fringe wide, and the ray off the ball a little spread
    assert image.min() < 1e-5
