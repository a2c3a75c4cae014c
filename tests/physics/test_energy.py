"""Where the power goes: splitters, cavities and losses against closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.core.vectors import rotation
from fringetrace.geometry import shapes
from fringetrace.tracing.detection import project

# Powers are sums of some tens of terms.
LEDGER = 1e-12
# A path of 0.3 m is rounded to 6e-17 m, 1e-10 waves, 6e-10 rad; a few of them.
PHASE = 1e-8

DIAGONAL = rotation((0, 1, 0), math.pi / 4)


def michelson(piston, splitter):
    """Both outputs (normals face the splitter) of one beam, as paths."""
    scene = ft.Scene(
        [
            ft.Surface(shapes.plate(30 * mm, 30 * mm).moved(turn=DIAGONAL), splitter, "splitter"),
            ft.Surface(shapes.plate(20 * mm, 20 * mm).moved((0, 0, -100 * mm)), ft.Mirror(), "sample"),
            ft.Surface(
                shapes.plate(20 * mm, 20 * mm).moved(
                    (100 * mm + piston, 0, 0), rotation((0, 1, 0), math.pi / 2)
                ),
                ft.Mirror(),
                "reference",
            ),
        ]
    )
    beam = ft.Beam((0, 0, 60 * mm), (0, 0, -1), (0, 1, 0), (8 * mm, 8 * mm), (16, 16))
    paths = ft.trace(scene, beam, max_bounces=6)
    out = ft.CCD((-50 * mm, 0, 0), (1, 0, 0), (0, 1, 0), 1 * mm, (8, 8))
    back = ft.CCD((0, 0, 70 * mm), (0, 0, -1), (0, 1, 0), 1 * mm, (8, 8))
    return project(paths, out), project(paths, back)


@pytest.mark.parametrize("piston", [0.0, 50 * nm, 158.2 * nm, 1e-6, -3.3e-4])
@pytest.mark.parametrize("wavelength", [632.8 * nm, 450 * nm])
def test_the_two_ports_of_a_michelson_add_up_to_what_came_in(wavelength, piston):
    # fields r t e^{i a} + t r e^{i b} at the output, r^2 e^{i a} + t^2 e^{i b} back: cos^2 and sin^2
    out, back = (
        np.abs(ft.complex_field(paths, wavelength)) ** 2 for paths in michelson(piston, ft.BeamSplitter())
    )
    np.testing.assert_allclose(out + back, 1.0, rtol=0, atol=PHASE)
    turn = 2 * math.pi * math.fmod(2 * piston, wavelength) / wavelength
    np.testing.assert_allclose(out, math.cos(turn / 2) ** 2, rtol=0, atol=10 * PHASE)
    np.testing.assert_allclose(back, math.sin(turn / 2) ** 2, rtol=0, atol=10 * PHASE)


@settings(max_examples=25)  # two numbers
@given(mix=st.floats(0.05, 1.5), piston=st.floats(-1e-6, 1e-6))
def test_any_lossless_splitter_conserves_energy_at_every_phase(mix, piston):
    # r = i sin, t = cos: out 4 R T cos^2, back 1 - that
    splitter = ft.BeamSplitter(1j * math.sin(mix), math.cos(mix))
    out, back = (np.abs(ft.complex_field(paths, 500 * nm)) ** 2 for paths in michelson(piston, splitter))
    np.testing.assert_allclose(out + back, 1.0, rtol=0, atol=10 * PHASE)
    turn = 2 * math.pi * math.fmod(2 * piston, 500 * nm) / (500 * nm)
    expected = math.sin(2 * mix) ** 2 * math.cos(turn / 2) ** 2
    np.testing.assert_allclose(out, expected, rtol=0, atol=20 * PHASE)


def cavity(splitter, gap, most=200):
    """Ends of one ray of unit area in a cavity of two equal splitters: through it, and back."""
    plates = [shapes.plate(1.0, 1.0).moved((0, 0, z)) for z in (0.0, gap)]
    scene = ft.Scene([ft.Surface(plate, splitter, f"plate {k}") for k, plate in enumerate(plates)])
    beam = ft.Beam((0, 0, -0.1), (0, 0, 1), (0, 1, 0), (0.5, 0.5), (1, 1))
    paths = ft.trace(scene, beam, max_bounces=most, min_amplitude=1e-12)
    through = ft.CCD((0, 0, 0.2), (0, 0, -1), (0, 1, 0), 0.5, (1, 1))
    back = ft.CCD((0, 0, -0.2), (0, 0, 1), (0, 1, 0), 0.5, (1, 1))
    return paths, project(paths, through), project(paths, back)


@pytest.mark.parametrize("reflectance", [0.04, 0.36, pytest.param(0.8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("gap", [1e-3, 1.0001234e-3, 1.00017e-3])
def test_the_partial_waves_of_a_cavity_add_up_to_airy(gap, reflectance):
    r, t = 1j * math.sqrt(reflectance), math.sqrt(1 - reflectance)
    wavelength = 633 * nm
    _, through, back = cavity(ft.BeamSplitter(r, t), gap)
    e = np.exp(2j * math.pi * math.fmod(gap, wavelength) / wavelength)
    transmitted = abs(t * t * e / (1 - r * r * e * e)) ** 2
    reflected = abs(r + t * t * r * e * e / (1 - r * r * e * e)) ** 2
    assert transmitted + reflected == pytest.approx(1.0, rel=LEDGER)
    # 1e-3 m is rounded to 2e-19 m; the finesse multiplies that
    assert abs(ft.complex_field(through, wavelength)[0, 0]) ** 2 == pytest.approx(transmitted, rel=PHASE)
    assert abs(ft.complex_field(back, wavelength)[0, 0]) ** 2 == pytest.approx(
        reflected, rel=PHASE, abs=PHASE
    )


@given(reflected=st.floats(0, 0.9), share=st.floats(0, 1), turn=st.floats(0, 6.28))
def test_the_powers_of_a_lossy_cavity_are_geometric_series(reflected, share, turn):
    # R, T of a plate that may absorb: through T^2 / (1 - R^2), back R + T^2 R / (1 - R^2)
    r = math.sqrt(reflected)
    t = share * (1 - r)  # |r| + |t| up to 1 is passive for any phase
    paths, through, back = cavity(ft.BeamSplitter(r * np.exp(1j * turn), t), 0.05, most=400)
    ledger = paths.ledger()
    assert ledger.error < LEDGER
    power_r, power_t = r * r, t * t
    area = 0.25
    series = power_t**2 / (1 - power_r**2)
    # what min_amplitude cut off is all that may be missing
    cut = ledger.truncated / area + LEDGER
    assert cut < 1e-10
    assert through.ledger().detected / area == pytest.approx(series, rel=LEDGER, abs=cut)
    assert back.ledger().detected / area == pytest.approx(power_r + series * power_r, rel=LEDGER, abs=cut)
    assert ledger.absorbed / area == pytest.approx(1 - power_r - series * (1 + power_r), rel=LEDGER, abs=cut)


@pytest.mark.parametrize("reflectance", [0.9, 0.5, 0.04])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_a_mirror_s_losses_multiply(reflectance):
    plates = [shapes.plate(1.0, 1.0).moved((0, 0, z)) for z in (0.0, 0.1)]
    scene = ft.Scene([ft.Surface(plate, ft.Mirror(reflectance)) for plate in plates])
    for bounces in (1, 2, 5):
        paths = ft.trace(
            scene,
            ft.Rays([(0, 0, 0.05)], [(0, 0, 1)], amplitude=[2.0]),
            max_bounces=bounces,
            min_amplitude=0.0,
        )
        assert abs(paths.amplitude[0]) ** 2 == pytest.approx(4 * reflectance**bounces, rel=LEDGER)
        assert paths.ledger().absorbed == pytest.approx(4 * (1 - reflectance**bounces), rel=LEDGER)
