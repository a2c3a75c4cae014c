"""A Fizeau bench against Airy's sum, fringes of wedges, Newton's rings, and its own steps."""

import math

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import Dielectric, Mirror, Surface, instruments, mm, nm, um
from fringetrace.geometry.shapes import plate
from fringetrace.optics import films
from fringetrace.optics.films import Film

HENE = 632.8 * nm
GLASS = 1.5
# What two splittings leave of a wave that all comes back.
QUARTER = 0.25
NINE = 0.5e-9
# A path of some centimetres in float64, after a few dozen roundings.
WAVES = 1e-9


def flat(interface=None, **media):
    return Surface(plate(8 * mm, 8 * mm), Mirror() if interface is None else interface, "sample", **media)


def glass_plate(n=GLASS, front=1.0):
    """A face of glass, which has no other side."""
    return flat(Dielectric(), front=front, back=n)


def airy(r, phase):
    """Amplitude back from two faces of reflections -r (above) and r: the closed sum over all round trips."""
    return -r * (1 - np.exp(1j * phase)) / (1 - r * r * np.exp(1j * phase))


@pytest.mark.parametrize(("waves", "power"), [(0.0, 0.0), (0.125, 0.079872204), (0.25, 0.147928994)])
def test_a_gap_between_two_glass_plates(waves, power):
    """|r (1 - exp(2ib)) / (1 - r^2 exp(2ib))|^2, b = 2 pi gap / lambda; trips left out bring r^15."""
    bench = instruments.fizeau(
        glass_plate(), aperture=1 * mm, gap=(1000 + waves) * HENE, pixels=(4, 4), min_amplitude=0.0
    )
    np.testing.assert_allclose(bench.interferogram(HENE) / QUARTER, power, rtol=0, atol=NINE)


@pytest.mark.parametrize("trips", [1, 2, 4, 8])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_each_round_trip_brings_the_sum_nearer_to_airys(trips):
    """What m round trips lack is the rest of a geometric series, t^2 r^(2m+1) / (1 - r^2 ...)."""
    gap = 1000.2 * HENE
    bench = instruments.fizeau(
        glass_plate(3.0), aperture=1 * mm, gap=gap, glass=3.0, pixels=(2, 2), max_bounces=3 + 2 * trips,
        min_amplitude=0.0,
    )  # fmt: skip
    fields = bench.fields(HENE)
    assert fields[trips].all()
    assert not fields[trips + 1 :].any()
    # of n = 3 glass into air r is +1/2; its sign is that of the first face met from inside
    expected = -2j * fields.sum(axis=0)[0, 0] / np.exp(2j * np.pi * _down(bench, gap) / HENE)
    lacking = abs(expected - airy(-0.5, 4 * np.pi * gap / HENE))
    x = 0.25 * np.exp(4j * np.pi * gap / HENE)
    rest = 0.75 * 0.5 * abs(x) ** trips * abs(np.exp(4j * np.pi * gap / HENE) / (1 - x))
    assert lacking == pytest.approx(rest, rel=1e-4, abs=1e-9)


def _down(bench, gap):
    """Path to the reference face and back, in glass of n = 3."""
    arm = -bench.beam.centre[0]
    return 3.0 * (arm + 2 * (arm - gap) - bench.ccd.focus + arm)


def test_a_phase_step_is_a_moved_reference():
    frames = instruments.fizeau(glass_plate(), aperture=1 * mm, gap=40 * um, pixels=(4, 4)).phase_steps(HENE)
    for k, frame in enumerate(frames):
        # nearer to the light by delta lambda / 4 pi: the reference leads
        moved = instruments.fizeau(
            glass_plate(), aperture=1 * mm, gap=40 * um - k * HENE / 8, pixels=(4, 4)
        ).interferogram(HENE)
        np.testing.assert_allclose(frame, moved, rtol=0, atol=1e-6)


def fringes(bench, wavelength=HENE):
    """Fringes across the row of centres of pixels, by the phase of the two first waves."""
    mutual = bench.mutual(wavelength)[1, 0]
    turns = np.unwrap(np.angle(mutual[len(mutual) // 2]))[1:-1] / (2 * np.pi)
    return abs(turns[-1] - turns[0]) / (len(turns) - 1) / bench.ccd.pitch


@pytest.mark.parametrize(
    ("angle", "between", "spacing"), [(50e-6, 1.0, 6328.000), (math.radians(10 / 3600), 1.515, 4307.735)]
)
def test_the_fringes_of_a_wedge(angle, between, spacing):
    """lambda / (2 n tan a), in micrometres as printed."""
    bench = instruments.fizeau(
        flat(), aperture=3 * mm, gap=20 * um, glass=1.52 if between > 1 else 1.5, between=between,
        reference_tilt=(angle, 0.0), pixels=(4, 32),
    )  # fmt: skip
    assert 1 / fringes(bench) / um == pytest.approx(spacing, rel=1e-6)


@pytest.mark.parametrize("between", [1.0, 1.333])
def test_the_height_of_a_step_is_found_where_one_face_reflects_little(between):
    """Round trips beyond the first bring r^2: heights are off by less than that part of a fringe."""
    step = ft.shapes.step(8 * mm, 8 * mm, 0.1 * mm, 60 * nm)
    sample = Surface(step, Dielectric(), "step", front=between, back=GLASS)
    bench = instruments.fizeau(
        sample, aperture=2 * mm, gap=100 * um, between=between, reference_tilt=(1e-4, 0.0), pixels=(4, 16),
        max_bounces=7,
    )  # fmt: skip
    height = bench.height(HENE, steps=5)
    rise = height[:, 10:-1].mean() - height[:, 1:7].mean()
    assert rise == pytest.approx(60 * nm, abs=0.04 * HENE / (4 * np.pi * between))


@pytest.mark.filterwarnings("ignore:fringes alias")
def test_newtons_rings():
    """Dark at r_m = sqrt(m lambda R - (m lambda / 2)^2), R = 1 m: where the gap has grown by m half waves.

    Light comes back beside where it went, by 2 gap / R of the radius: 2e-6 here.
    """
    lam, radius = 589.3 * nm, 1.0
    bench = instruments.fizeau(
        glass_plate(), aperture=6 * mm, gap=2 * lam, radius=radius, pixels=(1, 301), rays=0.2
    )
    mutual = bench.mutual(lam)[1, 0, 0]
    x = (np.arange(301) - 150) * bench.ccd.pitch
    turns = np.unwrap(np.angle(mutual[150:])) / (2 * np.pi)
    for order, dark in ((1, 0.767658722), (10, 2.427548417)):
        # turns are straight over the square of the radius
        crossing = math.sqrt(np.interp(order, np.abs(turns - turns[0]), x[150:] ** 2))
        assert crossing / mm == pytest.approx(dark, rel=1e-5)


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_a_whole_plate_has_a_ghost_that_a_coating_takes_away():
    """The upper face reflects 4 %; a quarter-wave layer of sqrt(n) sends nothing back."""
    film = Film(((math.sqrt(GLASS), HENE / (4 * math.sqrt(GLASS))),))
    bare, coated = (
        instruments.fizeau(
            flat(), aperture=1 * mm, gap=50 * um, thickness=3 * mm, back_coating=coating, pixels=(2, 2)
        )
        for coating in (None, film)
    )
    ghosts = []
    for bench in (bare, coated):
        seen = bench.trace(HENE).detected
        assert bench.trace(HENE).ledger().error < 1e-12
        first = seen.where((seen.visits(2) == 0) & (seen.visits(3) == 1))
        ghosts.append(float((np.abs(first.amplitude) ** 2).mean()) if len(first) else 0.0)
    bare_face = films.reflectance(None, 1.0, GLASS, 0.0, HENE).s
    assert ghosts[0] == pytest.approx(QUARTER * bare_face, rel=1e-12)
    assert ghosts[1] < 1e-12


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_a_wedged_plate_leads_its_ghost_aside():
    """The upper face tilted by w sends its light off by 2w."""
    bench = instruments.fizeau(
        flat(), aperture=1 * mm, gap=50 * um, thickness=3 * mm, wedge=(0.02, 0.0), pixels=(2, 2)
    )
    paths = bench.trace()
    up = paths.where((paths.visits(3) == 1) & (paths.visits(2) == 0) & (paths.direction[:, 2] > 0.5))
    np.testing.assert_allclose(np.arcsin(up.direction[:, 0]), 0.04, rtol=0, atol=1e-12)


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_the_camera_sees_the_sample_through_the_plate():
    """A tilted sample: its light comes from where it stands, up to the third order of its angle."""
    slope = 0.01
    tilted = plate(8 * mm, 8 * mm).moved(turn=ft.vectors.rotation((0, 1, 0), -slope))
    bench = instruments.fizeau(tilted, aperture=1 * mm, gap=0.1 * mm, thickness=3 * mm, pixels=(1, 9))
    seen = bench.trace().detected
    once = seen.where((seen.visits(2) == 2) & (seen.visits(1) == 1) & (seen.bounces == 7))
    start = 9 - (once.ray + 0.5)
    assert len(once) >= 8
    # a quarter of the angle's cube times the way through the glass, and the facet's own height
    np.testing.assert_allclose(
        (once.pixel[:, 1] - start) * bench.ccd.pitch,
        0.0,
        atol=(2 * slope) ** 3 * 3 * mm + 2 * slope**2 * 1 * mm,
    )
