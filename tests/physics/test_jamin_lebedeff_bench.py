"""A Jamin-Lebedeff bench: the analyser's law, Senarmont, leaks, the index of chitin measured."""

import math

import numpy as np
import pytest

from fringetrace import Dielectric, Surface, instruments, nm, um
from fringetrace.geometry.shapes import extrude, plate
from fringetrace.optics.films import fresnel
from fringetrace.optics.materials.named_materials import CALCITE_E, CALCITE_O, CHITIN
from fringetrace.optics.phase_plates import PhasePlate

SODIUM = 589.3 * nm
NINE = 0.5e-9
ANALYSERS = {"parallel": math.pi / 4, "crossed": 3 * math.pi / 4}
# Phases of paths of a millimetre in float64, after a few dozen roundings.
PHASE = 1e-8


def delay(delta):
    """A phase object without reflections."""
    path = np.full((4, 4), delta * SODIUM / (2 * math.pi))
    element = PhasePlate(path, (0, 0, 0), (1, 0, 0), (0, 1, 0), pitch=10 * um, interpolation="nearest")
    return Surface(plate(24 * um, 24 * um), element, "delay")


def bench(sample, **options):
    return instruments.jamin_lebedeff(sample, aperture=20 * um, pixels=(3, 4), **options)


@pytest.mark.parametrize(
    ("delta", "parallel", "crossed"),
    [(0.5, 0.938791281, 0.061208719), (1.0, 0.770151153, 0.229848847), (2.0, 0.291926582, 0.708073418)],
)
def test_the_analyser_shows_cosine_and_sine_of_half_the_delay(delta, parallel, crossed):
    for name, expected in (("parallel", parallel), ("crossed", crossed)):
        image = bench(delay(delta), analyser=ANALYSERS[name]).interferogram(SODIUM)
        np.testing.assert_allclose(image, expected, rtol=0, atol=NINE + PHASE)


@pytest.mark.parametrize(("delta", "degrees"), [(0.5, 120.676), (2.0, 77.704)])
def test_senarmonts_analyser_is_dark_at_half_the_delay(delta, degrees):
    exact = 0.75 * math.pi - 0.5 * delta
    assert math.degrees(exact) == pytest.approx(degrees, abs=0.5e-3)
    assert bench(delay(delta), senarmont=True, analyser=exact).interferogram(SODIUM).max() < PHASE
    off = bench(delay(delta), senarmont=True, analyser=exact + 0.1).interferogram(SODIUM)
    np.testing.assert_allclose(off, math.sin(0.1) ** 2, rtol=0, atol=PHASE)


def test_phase_steps_find_the_path():
    measured = bench(delay(1.2)).path_difference(SODIUM)
    np.testing.assert_allclose(measured, 1.2 * SODIUM / (2 * math.pi), rtol=0, atol=PHASE * SODIUM)


def test_faces_reflect_and_the_contrast_falls():
    """A sample that passes t of the field: (1 + t^2 + 2 t cos delta) / 4."""
    n, medium = 1.7, 1.335
    slab = plate(24 * um, 24 * um, 1 * um)
    image = bench(slab, index=n, medium=medium).interferogram(SODIUM)
    r = fresnel(medium, n, 0.0).rs.real
    t, delta = 1 - r * r, 2 * math.pi * (n - medium) * um / SODIUM
    np.testing.assert_allclose(image, 0.25 * (1 + t * t + 2 * t * math.cos(delta)), rtol=0, atol=PHASE)


@pytest.mark.parametrize(
    ("wavelength", "leak"), [(450 * nm, 0.116977778), (500 * nm, 0.024471742), (650 * nm, 0.057271987)]
)
def test_what_the_half_wave_plate_leaks_goes_aside(wavelength, leak):
    """cos^2(pi 550 / (2 lambda)) of the light is not swapped, and lands a whole shear beside the image."""
    instrument = bench(delay(0.0), half_wave=550 * nm)
    image = instrument.interferogram(wavelength)
    np.testing.assert_allclose(image, 1.0 - leak, rtol=0, atol=NINE + PHASE)


def test_the_indices_of_chitin_come_back():
    """1 um in n = 1.52, at three wavelengths through dispersive calcite: Cauchy's A and B to 1e-6."""
    slab = Surface(plate(24 * um, 24 * um, 1 * um), Dielectric("transmitted"), "chitin", back=CHITIN)
    instrument = bench(slab, medium=1.52, crystal=(CALCITE_O.index, CALCITE_E.index))
    waves = np.array([400 * nm, 500 * nm, 600 * nm])
    paths = np.array([instrument.path_difference(wavelength).mean() for wavelength in waves])
    assert instrument.traced == tuple(waves)
    # the plate and the bench agree on the printed phases
    np.testing.assert_allclose(
        2 * math.pi * paths / waves, [0.816814090, 0.404637134, 0.224565697], rtol=0, atol=NINE + PHASE
    )
    columns = np.stack([np.ones(3), (nm / waves) ** 2], axis=1)
    a, b = np.linalg.lstsq(columns, 1.52 + paths / um)[0]
    assert a == pytest.approx(1.517, rel=1e-6)
    assert b == pytest.approx(8800.0, rel=1e-6)


def test_power_adds_up_and_both_beams_meet():
    instrument = bench(delay(1.0))
    paths = instrument.trace()
    assert paths.ledger().error < 1e-12
    assert np.bincount(instrument.arms.reference.count(paths.detected)).tolist() == [12, 12]


def test_recorded_light_goes_straight_on_from_where_the_plates_displace_it():
    made = bench(delay(0.7), shear=50 * um)
    paths = made.sampled((5, 5), SODIUM).detected
    for row in range(len(paths)):
        step = np.diff(paths.polyline(row), axis=0)
        aside = np.abs(step[:, 2]) < 1e-9 * np.abs(step).max()
        assert aside.sum() == 1  # by one of the plates
        np.testing.assert_allclose(np.abs(step[aside]), [[50 * um, 0, 0]], rtol=1e-9, atol=1e-9 * um)
        np.testing.assert_allclose(step[~aside, :2], 0.0, atol=1e-9 * um)
        # the last step leads back to the plane of focus
        assert paths.lengths[row].sum() == pytest.approx(step[~aside, 2].sum(), rel=1e-9)


def test_the_budget_knows_where_light_goes_on():
    """Roundings of some lengths of tens of micrometres."""
    assert bench(delay(0.7)).budget(SODIUM).hit < PHASE


@pytest.mark.parametrize("method", ["rays", "wavefront"])
def test_light_that_a_sample_bends_is_in_focus(method):
    """A roof bends the light of its flanks by up to 3.4 mrad apart; ends and ridge stand where they are."""
    corners = np.array([(-20, -1), (20, -1), (20, 0), (0, 3), (-20, 0)]) * um
    flake = Surface(extrude(corners, 30 * um, closed=True), Dielectric("transmitted"), "flake", back=1.56)
    made = instruments.jamin_lebedeff(
        flake, aperture=50 * um, medium=1.52, pixels=(1, 200), rays=2, method=method
    )
    light = made.mutual(SODIUM)[0, 0, 0].real
    edges = np.flatnonzero(np.abs(np.diff(light)) > 0.1 * light.max()) - 99
    assert set(edges.tolist()) <= {-81, -80, -1, 0, 1, 80, 81}  # pixels of 0.25 um
    assert {-80, 80} <= {round(edge / 10) * 10 for edge in edges.tolist()}
