"""White light and lines in a Michelson: degree of coherence, beats, glass with and without compensator."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fringetrace import instruments, mm, nm, um
from fringetrace.geometry.shapes import plate
from fringetrace.optics.materials.named_materials import BK7
from fringetrace.scene.spectrum import ERROR, Line, Spectrum

GREEN = Line(550 * nm, 10 * nm)
SODIUM = 588.995 * nm, 589.592 * nm
NINE = 0.5e-9


def michelson(piston=0.0, **options):
    return instruments.michelson(
        plate(4 * mm, 4 * mm), aperture=1 * mm, pixels=(2, 2), piston=piston, **options
    )


def visibility(bench, light):
    """Of fringes by phase steps, in the mean of all pixels."""
    frames = bench.phase_steps(light)
    modulation = np.hypot(frames[0] - frames[2], frames[1] - frames[3])
    return float((modulation / frames.sum(axis=0) * 2.0).mean())


@pytest.mark.parametrize(
    ("path", "coherence"), [(0.0, 1.0), (10 * um, 0.677725811), (13.348454 * um, 0.5), (20 * um, 0.210967766)]
)
def test_a_line_of_ten_nanometres(path, coherence):
    # the printed paths have so many digits
    assert abs(GREEN.coherence(path)) == pytest.approx(coherence, abs=3e-8)
    assert visibility(michelson(0.5 * path), GREEN) == pytest.approx(coherence, abs=ERROR)


def test_the_line_is_half_coherent_where_its_length_says():
    assert GREEN.length == pytest.approx(13.348454 * um, abs=0.5e-12)
    assert abs(GREEN.coherence(10 * um)) == pytest.approx(0.677725811, abs=NINE)
    assert abs(GREEN.coherence(20 * um)) == pytest.approx(0.210967766, abs=NINE)


@given(
    centre=st.floats(300 * nm, 1000 * nm), part=st.floats(1e-6, 0.05), reach=st.floats(0.0, 40.0),
    share=st.floats(-1.0, 1.0), error=st.sampled_from([1e-3, 1e-6, 1e-9]),
)  # fmt: skip
def test_a_sampled_line_is_as_coherent_as_the_line(centre, part, reach, share, error):
    """Up to the path difference that it was sampled for: no revival, whatever the line."""
    line = Line(centre, part * centre)
    path = reach * line.length
    off = line.sampled(path, error).coherence(share * path) - line.coherence(share * path)
    # a path of many waves is itself known to so many digits
    assert abs(off) <= error + 1e-15 * path / centre * 8


def test_too_coarse_a_sum_would_come_back_to_life():
    """The same line, sampled for no path at all: fringes where there are none."""
    coarse = GREEN.sampled(0.0)
    step = np.diff(1 / coarse.wavelengths[::-1]).mean()
    assert abs(coarse.coherence(1 / step)) == pytest.approx(1.0, abs=1e-6)
    assert abs(GREEN.coherence(1 / step)) < 1e-6


@pytest.mark.parametrize(("beats", "expected"), [(0.0, 1.0), (0.25, math.sqrt(0.5)), (0.5, 0.0), (1.0, 1.0)])
def test_the_beat_of_the_sodium_lines(beats, expected):
    """Fringes come back after every 290.843166 um of mirror travel."""
    doublet = Spectrum(np.array(SODIUM), np.array([1.0, 1.0]))
    period = SODIUM[0] * SODIUM[1] / (2 * (SODIUM[1] - SODIUM[0]))
    assert period == pytest.approx(290.843166 * um, abs=0.5e-12)
    # the travel's digits times the phase that a wave's length of it turns
    assert visibility(michelson(beats * period, arm=4 * mm), doublet) == pytest.approx(expected, abs=1e-7)


def test_the_irradiance_of_white_light_is_the_sum_over_its_wavelengths():
    lamp = Spectrum(np.array([600 * nm, 450 * nm]), np.array([1.0, 3.0]))
    bench = michelson(1.3 * um)
    expected = 0.25 * bench.interferogram(600 * nm) + 0.75 * bench.interferogram(450 * nm)
    np.testing.assert_allclose(bench.interferogram(lamp), expected, rtol=1e-12)
    assert bench.traced == (None,)


@pytest.mark.parametrize("compensator", [False, True])
def test_a_splitter_of_glass_adds_two_crossings_that_a_compensator_takes_away(compensator):
    """2 d (sqrt(n^2 - 1/2) - sqrt(1/2)) at 45 degrees, at any wavelength."""
    depth = 1 * mm
    bench = michelson(
        splitter=instruments.SplitterPlate(depth, ghosts=False), compensator=compensator, arm=10 * mm
    )
    for wavelength in (633 * nm, 480 * nm):
        seen = bench.trace(wavelength).detected
        arm = seen.visits(bench.arms.reference.surface)
        n = BK7.index(wavelength).real
        added = 0.0 if compensator else 2 * depth * (math.sqrt(n * n - 0.5) - math.sqrt(0.5))
        longer = seen.length[arm == 0] - seen.length[arm == 1]
        np.testing.assert_allclose(longer, added, rtol=0, atol=1e-9 * wavelength)
    assert bench.traced == (633 * nm, 480 * nm)


@pytest.mark.parametrize("compensator", [False, True])
def test_dispersion_takes_the_fringes_of_white_light(compensator):
    """Paths made equal for the middle of a line: the group's path is not, and the fringes fade."""
    depth, line = 1 * mm, Line(550 * nm, 5 * nm)
    n = BK7.index(line.centre).real
    added = 0.0 if compensator else depth * (math.sqrt(n * n - 0.5) - math.sqrt(0.5))
    bench = michelson(
        added, splitter=instruments.SplitterPlate(depth, ghosts=False), compensator=compensator, arm=10 * mm
    )
    lamp = line.sampled(60 * um, 1e-4)
    index = BK7.index(lamp.wavelengths).real
    glass = 0.0 * index if compensator else 2 * depth * (np.sqrt(index**2 - 0.5) - math.sqrt(0.5))
    expected = abs(np.exp(2j * np.pi * (glass - 2 * added) / lamp.wavelengths) @ lamp.weights)
    assert (expected == pytest.approx(1.0)) == compensator
    # the coating's phase and reflectance change over the line too
    assert visibility(bench, lamp) == pytest.approx(expected, abs=0.01)


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_ghosts_have_path_keys_of_their_own_and_a_coating_takes_them_away():
    """The other face's reflection, off the sample and back: s light at 45 degrees on bare glass."""
    lam = 587.56 * nm
    weakest = {}
    for name, film in (("bare", None), ("coated", instruments.anti_reflecting("BK7", lam))):
        bench = michelson(splitter=instruments.SplitterPlate(1 * mm, back_coating=film), arm=10 * mm)
        paths = bench.trace(lam)
        assert paths.ledger().error < 1e-12
        assert not paths.contradictions.any()
        power = np.abs(paths.amplitude[paths.fate == 0]) ** 2
        keys = np.unique(paths.key[paths.fate == 0])
        weakest[name] = len(keys), power[(power < 0.05)].sum() / power.sum()
    assert weakest["bare"][0] > 10
    assert weakest["bare"][1] > 1e-2
    assert weakest["coated"] == (2, 0.0)
