"""Thin gaps of air between glass: plane, wedged, and under a lens (Newton's rings)."""

import math

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm, um
from fringetrace.core.vectors import rotation
from fringetrace.geometry import shapes
from fringetrace.instruments import lenses

INF, GLASS, SODIUM, R = math.inf, 1.5, 589.3 * nm, 1.0
IN, OUT = 4 * mm, 5 * mm  # thickness of the glass above and below the gap
THROUGH, BARE = ft.Dielectric(follow="transmitted"), ft.Dielectric()
# Power that the uppermost face lets in and out again.
COVER = (1.0 - ((GLASS - 1.0) / (GLASS + 1.0)) ** 2) ** 2
# Bounces that add (1/5)^2 of the amplitude each; from the seventh on less than 1e-10 of the irradiance.
BOUNCES = 19


def glasses(radius, gap):
    """A lens over a flat, with air between; only the faces of the gap throw light back."""
    return lenses.lens(
        (INF, -radius, INF, INF), (IN, gap, OUT), (GLASS, None, GLASS), 30 * mm,
        interface=(THROUGH, BARE, BARE, THROUGH), edge=ft.Absorber(),
    )  # fmt: skip


def seen(surfaces, at, pixels, pitch, bounces=BOUNCES):
    """Irradiance on a row of pixels that sees the upper face of the gap from above, through the glass."""
    high = 10 * mm
    ccd = ft.CCD((at, 0, -high), (0, 0, 1), (0, 1, 0), pitch, (1, pixels), focus=high + IN / GLASS)
    size = pixels * pitch + 0.2 * mm
    beam = ft.Beam((at, 0, -high / 2), (0, 0, 1), (0, 1, 0), (size, size), (12, 12))
    paths = ft.trace(ft.Scene(surfaces), beam, ccd, max_bounces=bounces, min_amplitude=0.0)
    return ft.irradiance(paths, SODIUM)[0]


@pytest.mark.parametrize(("part", "printed"), [(1 / 8, 0.079872204), (1 / 4, 0.147928994)])
def test_a_plane_gap_between_glass(part, printed):
    """|r (1 - e^2ib) / (1 - r^2 e^2ib)|^2, b = 2 pi gap / wavelength, as all bounces add up."""
    light = seen(glasses(INF, part * SODIUM), 0.0, 3, 10 * um)
    assert light / COVER == pytest.approx(printed, abs=5.1e-10)


@pytest.mark.parametrize(("part", "printed"), [(1 / 8, 0.079872204), (1 / 4, 0.147928994)])
def test_irradiance_of_the_rings(part, printed):
    """A lens that touches the flat is a plane gap at each place, but for slopes of 4e-4."""
    gap = part * SODIUM
    light = seen(glasses(R, 0.0), math.sqrt(gap * (2.0 * R - gap)), 3, 0.2 * um, bounces=13)
    assert light[1] / COVER == pytest.approx(printed, rel=2e-6)


@pytest.mark.parametrize(
    ("order", "radius"), [(1, 0.767658722 * mm), (10, 2.427548417 * mm), (100, 7.676531235 * mm)]
)
def test_dark_rings_lie_where_newton_saw_them(order, radius):
    """r_m^2 = m wavelength R - (m wavelength / 2)^2."""
    assert radius == pytest.approx(math.sqrt(order * SODIUM * R - (order * SODIUM / 2) ** 2), rel=1e-9)
    light = seen(glasses(R, 0.0), radius, 101, 0.2 * um, bounces=9)
    low = np.argmin(light)
    fit = np.polyfit(np.arange(-3, 4), light[low - 3 : low + 4], 2)
    found = (low - 50 - 0.5 * fit[1] / fit[0]) * 0.2 * um
    # light leaves both faces leaning by about r / R, and the gap is m wavelengths long
    assert abs(found) < order * SODIUM * radius / R + 0.002 * um
    assert light.min() < 1e-5


@pytest.mark.parametrize(
    ("index", "angle", "wavelength", "spacing"),
    [(1.0, 50e-6, 632.8 * nm, 6328.000), (1.515, math.radians(10 / 3600), 632.8 * nm, 4307.735)],
)
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_spacing_of_fizeau_fringes(index, angle, wavelength, spacing):
    """wavelength / (2 n tan a), in micrometres, of a wedge of air in glass and of glass in air."""
    around = GLASS if index == 1.0 else 1.0
    face = shapes.plate(40 * mm, 40 * mm)
    lower = face.moved((0, 0, -1 * mm), rotation((0, 1, 0), angle))
    scene = ft.Scene(
        [ft.Surface(face, BARE, "upper", back=index), ft.Surface(lower, BARE, "lower", front=index)],
        medium=around,
    )
    ccd = ft.CCD((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), 0.05 * mm, (1, 500), focus=5 * mm)
    beam = ft.Beam((0, 0, 4 * mm), (0, 0, -1), (0, 1, 0), (30 * mm, 1 * mm), (8, 8))
    paths = ft.trace(scene, beam, ccd, max_bounces=3)
    light = ft.irradiance(paths, wavelength)[0]
    assert np.ptp(light) > 0.9 * light.max()
    # two waves: a + b cos(k x) + c sin(k x), with the k that leaves least
    x = (np.arange(500) - 249.5) * 0.05 * mm

    def left(period):
        waves = np.stack([np.ones_like(x), np.cos(2 * np.pi * x / period), np.sin(2 * np.pi * x / period)], 1)
        return np.linalg.norm(light - waves @ np.linalg.lstsq(waves, light)[0])

    from scipy.optimize import minimize_scalar

    found = minimize_scalar(left, bracket=(spacing * 0.999e-6, spacing * 1.001e-6), tol=1e-10).x
    assert found / um == pytest.approx(spacing, abs=6e-4)
