"""From sheets to the light on the pixels: plane and curved ones, groups, several beams, what is refused."""

from dataclasses import replace

import arrivals
import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.field.wavefront import assemble
from fringetrace.geometry import forms, shapes

HENE = 632.8 * nm
# What quadrature may be off.
ERROR = 1e-6


def traced(form=None, y=0.0):
    """A plane mirror, by facets or by a form, lit on 3 mm of a CCD of 4 mm."""
    flat = ft.Surface(shapes.plate(10 * mm, 10 * mm), ft.Mirror(), "flat", form=form)
    beam = ft.Beam((0, y, 9 * mm), (0, 0, -1), (0, 1, 0), (3 * mm, 3 * mm), (6, 6))
    ccd = ft.CCD((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), 0.1 * mm, (40, 40))
    return ft.trace(ft.Scene([flat]), beam, ccd)


PLANE = forms.Conic((0, 0, 0), (0, 0, 1), np.inf)
SQUARE = np.pad(np.ones((30, 30)), 5)


def groups(paths, number=0):
    return np.full(len(paths), number)


def test_facets_make_plane_waves_and_forms_curved_sheets():
    flat = assemble.light(traced(), groups(traced(), 1))
    assert len(flat.plane) == 1
    assert flat.plane[0][0] == 1
    assert flat.curved == []
    curved = assemble.light(traced(PLANE), groups(traced(PLANE), 1))
    assert curved.plane == []
    assert [group for group, _ in curved.curved] == [1]
    # a beam's cell of half a millimetre is 25 pixels
    assert flat.unit == curved.unit == pytest.approx(25.0)
    for one in (flat, curved):
        length = np.hypot(*(one.segments[:, 2:] - one.segments[:, :2]).T).sum()
        assert length == pytest.approx(4 * 30, rel=1e-6)


@pytest.mark.parametrize("form", [None, PLANE])
def test_a_beam_brings_its_light(form):
    one = assemble.light(traced(form), groups(traced(form)))
    mean, mutual = assemble.fields([one], 1, (40, 40), HENE, True)
    assert mutual[0, 0] == pytest.approx(SQUARE, abs=ERROR)
    turn = np.exp(2j * np.pi * np.fmod(14 * mm, HENE) / HENE)
    assert mean[0] == pytest.approx(-turn * SQUARE, abs=ERROR)


@pytest.mark.parametrize("form", [None, PLANE])
def test_half_wave_loss_may_be_left_out(form):
    lit = [assemble.light(traced(form), groups(traced(form)), loss) for loss in (True, False)]
    one, other = (assemble.fields([beam], 1, (40, 40), HENE, True)[0] for beam in lit)
    assert one == pytest.approx(-other, abs=ERROR)
    assert np.abs(one).max() > 0.9


def test_arrivals_without_facets_are_sheets():
    paths = traced()
    beam, ccd = replace(paths.source, centre=(0, 0, 9 * mm)), paths.ccd
    given = arrivals.reflected(beam, ccd, arrivals.plane(0.0))
    for loss, sign in ((True, 1.0), (False, -1.0)):
        one = assemble.light(given, groups(given), loss)
        assert one.plane == []
        assert len(one.segments) == 0
        mean, _ = assemble.fields([one], 1, (40, 40), HENE, True)
        whole = assemble.fields([assemble.light(paths, groups(paths))], 1, (40, 40), HENE, True)[0]
        middle = (0, slice(6, 34), slice(6, 34))
        assert mean[middle] == pytest.approx(sign * whole[middle], abs=ERROR)


def test_groups_of_several_beams_are_kept_apart():
    """Two beams a millimetre apart, in phase: where both fall, four times the light of one."""
    low, high = traced(y=-0.5 * mm), traced(PLANE, y=0.5 * mm)
    lights = [assemble.light(low, groups(low, 0)), assemble.light(high, groups(high, 1))]
    _, mutual = assemble.fields(lights, 2, (40, 40), HENE, False)
    row = np.arange(40)
    under, over = (((row >= at) & (row < at + 30)) * 1.0 for at in (0, 10))
    column = ((row >= 5) & (row < 35)) * 1.0
    assert mutual[0, 0] == pytest.approx(np.outer(under, column), abs=ERROR)
    assert mutual[1, 1] == pytest.approx(np.outer(over, column), abs=ERROR)
    assert mutual[0, 1] == pytest.approx(np.outer(under * over, column), abs=ERROR)
    together = [assemble.light(low, groups(low)), assemble.light(high, groups(high))]
    _, mutual = assemble.fields(together, 1, (40, 40), HENE, False)
    assert mutual[0, 0] == pytest.approx(np.outer((under + over) ** 2, column), abs=4 * ERROR)


def test_what_is_refused():
    paths = traced()
    with pytest.raises(ValueError, match="paths traced onto a CCD, got paths without one"):
        assemble.light(replace(paths, ccd=None), groups(paths))
    with pytest.raises(ValueError, match="paths of a Beam, got those of Rays"):
        assemble.light(replace(paths, source=ft.Rays([(0, 0, 0)], [(0, 0, 1)])), groups(paths))
