"""Shear plates: walk-off in calcite and quartz, and prisms after Wollaston."""

import numpy as np
import pytest
from meetings import EPS, meeting, power

from fringetrace.optics.birefringent import ShearPlate, Wollaston
from fringetrace.optics.polarisers import Polariser, Retarder

# Printed with so many digits after the point.
NINE = 0.5e-9
SIX = 0.5e-6
# Two refractions lose about (n_o + n_e) / (n_o - n_e), twenty, of some ten roundings.
LAW = 400 * EPS

CALCITE = (1.6584, 1.4864)  # at 589.3 nm
QUARTZ = (1.54424, 1.55335)
X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
SLANTED = (1.0, 1.0, 0.0)


def walk_off(theta, indices, thickness=1.0):
    """Angle in degrees, path and shift away from the optic axis (at theta to the normal) in metres."""
    rays = meeting(Z, field=SLANTED)
    beam = ShearPlate((np.sin(theta), 0.0, np.cos(theta)), thickness, *indices).act(rays)[1]
    shift = -beam.point[0, 0]
    return np.degrees(np.arctan(shift / thickness)), beam.path[0], shift


def test_calcite_at_45_degrees():
    angle, path, shift = walk_off(np.pi / 4, CALCITE, 10e-3)
    assert angle == pytest.approx(6.224117603, abs=NINE)
    assert path / 10e-3 == pytest.approx(1.565356826, abs=NINE)
    assert shift / 1e-3 == pytest.approx(1.090606831, abs=NINE)


def test_calcite_walks_off_most_at_a_known_angle():
    # tan(theta) = n_e / n_o, in the plate's formula tan(rho) = (n_o^2 - n_e^2) t / (n_e^2 + n_o^2 t^2)
    best = np.arctan(CALCITE[1] / CALCITE[0])
    assert np.degrees(best) == pytest.approx(41.8694, abs=0.5e-4)
    assert walk_off(best, CALCITE)[0] == pytest.approx(6.261170907, abs=NINE)
    assert walk_off(best, CALCITE)[0] > max(walk_off(best + step, CALCITE)[0] for step in (-1e-3, 1e-3))


def test_quartz_walks_off_the_other_way():
    assert walk_off(np.pi / 4, QUARTZ)[0] == pytest.approx(-0.337006523, abs=NINE)


def deflections(angle, indices):
    """Angles (degrees) at which the two beams leave a Wollaston prism that light meets straight on."""
    beams = Wollaston((0, 0, 0), X, np.radians(angle), *indices).act(meeting(Z, field=SLANTED))
    assert [power(beam.field)[0] for beam in beams] == pytest.approx([1.0, 1.0], rel=8 * EPS)
    return [np.degrees(np.arcsin(beam.direction[0, 0])) for beam in beams]


def test_wollaston_prisms_of_calcite_deflect_unequally():
    one, other = deflections(15.0, CALCITE)
    assert other - one == pytest.approx(5.284387, abs=SIX)
    one, other = deflections(30.0, CALCITE)
    assert (other, one) == pytest.approx((5.814005, -5.603472), abs=SIX)
    assert other - one == pytest.approx(11.417477, abs=SIX)


def test_wollaston_prisms_by_two_refractions():
    # asin(n2 sin(t2 - a)) with t2 = asin(n1 sin(a) / n2), for (n_e, n_o) and (n_o, n_e)
    for a in np.radians([5.0, 15.0, 30.0]):
        for turn in (a, -a):
            beams = deflections(np.degrees(turn), CALCITE)
            for beam, (n1, n2) in zip(beams, (CALCITE[::-1], CALCITE), strict=True):
                law = np.arcsin(n2 * np.sin(np.arcsin(n1 / n2 * np.sin(turn)) - turn))
                assert np.radians(beam) == pytest.approx(law, rel=LAW)


def test_wollaston_prisms_of_quartz():
    one, other = deflections(15.0, QUARTZ)
    assert 60.0 * (one - other) == pytest.approx(16.783226, abs=SIX)
    # 2 (n_e - n_o) tan a, to second order in the angles
    assert np.radians(one - other) == pytest.approx(
        2.0 * (QUARTZ[1] - QUARTZ[0]) * np.tan(np.radians(15.0)), rel=3e-6
    )


@pytest.mark.parametrize(
    ("bias", "seen"), [(0.0, 0.002497917), (np.pi / 2, 0.549916708), (np.pi, 0.997502083)]
)
def test_differential_interference_contrast(bias, seen):
    # two beams with a phase of 0.1 between them come together in a second prism
    prism = Wollaston((0, 0, 0), X, np.radians(15.0), *QUARTZ)
    rays = meeting(Z, field=np.array(SLANTED) / np.sqrt(2.0))
    total = np.zeros((1, 3), dtype=complex)
    for number, beam in enumerate(prism.act(rays)):
        delayed = beam.field * np.exp(0.1j * (number == 0))
        back = meeting(-beam.direction, field=delayed)
        joined = prism.act(back)[number]
        assert np.abs(joined.direction + rays.direction).max() < 16 * EPS
        total += joined.field
    behind = meeting(-rays.direction, field=total[0])
    (biased,) = Retarder(X, bias).act(behind)
    (crossed,) = Polariser((1, -1, 0)).act(meeting((0, 0, -1), field=biased.field[0]))
    assert power(crossed.field)[0] == pytest.approx(seen, abs=NINE)
