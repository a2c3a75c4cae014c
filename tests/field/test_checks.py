"""Aliased fringes are told wherever light is put on pixels, and once."""

import math
from dataclasses import replace

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import instruments, mm, nm, shapes
from fringetrace.field import aliasing
from fringetrace.tracing import join

HENE = 632.8 * nm


def bench(cycles=0.8):
    """A Michelson with so many fringes a pixel."""
    angle = 0.5 * math.asin(cycles * HENE * 32 / (6 * mm))
    return instruments.michelson(
        shapes.plate(12 * mm, 12 * mm), aperture=6 * mm, pixels=(24, 32), reference_tilt=(angle, 0.0)
    )


def traced(cycles=0.8):
    one = bench(cycles)
    return ft.trace(one.scene, one.beam, one.ccd)


MADE = {
    "irradiance": lambda paths: ft.irradiance(paths, HENE),
    "ray sum": lambda paths: ft.irradiance(paths, HENE, "rays"),
    "spectrum": lambda paths: ft.irradiance(paths, ft.Spectrum(np.array([HENE, 2 * HENE]), np.ones(2))),
    "field": lambda paths: ft.complex_field(paths, HENE),
    "mutual": lambda paths: ft.mutual_intensity(paths, HENE, np.unique(paths.key, return_inverse=True)[1]),
    "budget": lambda paths: ft.budget(paths, HENE),
    "check": lambda paths: ft.accuracy.check(paths, HENE),
    "beams": lambda paths: ft.irradiance([paths, paths], HENE, "rays"),
    "stream": lambda paths: ft.irradiance(ft.stream(paths.scene, paths.source, paths.ccd), HENE, "rays"),
}
MEASURED = ["interferogram", "phase_steps", "wrapped", "path_difference", "height", "budget", "dataset"]


@pytest.mark.parametrize("name", MADE)
def test_fringes_that_alias_are_told_once(name):
    paths = traced()
    with pytest.warns(
        ft.FringetraceWarning, match=r"fringes alias: .* by 1\.6 pi about .*; take 2 times"
    ) as told:
        [MADE[name](paths) for _ in range(1 if name == "stream" else 2)]
    assert len(told) == 1
    assert told[0].filename == __file__


@pytest.mark.parametrize("name", MADE)
def test_fringes_that_do_not_are_not(name):
    MADE[name](traced(0.4))


@pytest.mark.parametrize("name", MEASURED)
def test_a_bench_tells_once_by_all_its_results(name):
    one = bench()
    with pytest.warns(ft.FringetraceWarning, match="fringes alias") as told:
        [getattr(one, what)(HENE) for what in (name, *MEASURED)]
    assert len(told) == 1
    assert told[0].filename == __file__


@pytest.mark.parametrize("name", MEASURED)
def test_a_bench_tells_of_power_cut_off(name):
    """A Fizeau whose light goes to and fro in its gap, more often than it is followed."""
    one = instruments.fizeau(shapes.plate(12 * mm, 12 * mm), gap=5 * mm, aperture=6 * mm, pixels=(8, 8))
    short = replace(one, max_bounces=5)
    with pytest.warns(ft.FringetraceWarning, match=r"power is cut off: .* after max_bounces=5") as told:
        [getattr(short, what)(HENE) for what in (name, *MEASURED)]
    assert len(told) == 1


def test_beams_that_cross_steeply_alias_with_each_other():
    def beam(tilt):
        return ft.Beam(
            (0, 0, 1.0), (math.sin(tilt), 0, -math.cos(tilt)), (0, 1, 0), (2 * mm, 2 * mm), (40, 40)
        )

    scene = ft.Scene([ft.Surface(shapes.plate(1 * mm, 1 * mm).moved((1.0, 0, 0)), ft.Mirror())])
    ccd = ft.CCD((0, 0, 1 - 1 * mm), (0, 0, 1), (0, 1, 0), 2 * mm / 32, (32, 32))
    steep = [ft.trace(scene, beam(tilt), ccd) for tilt in (0.0, 0.8 * HENE / (2 * mm / 32))]
    assert "by 1.6 pi" in aliasing(steep, HENE)
    assert [aliasing(one, HENE) for one in steep] == [None, None]
    assert aliasing(join([steep[0]]), HENE) is None
