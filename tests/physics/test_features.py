"""Features narrower than a cell of the beam's grid, against closed forms by area."""

import math

import numpy as np
import pytest
from converging import COVERAGE, HENE, SIDE, landing, paraboloid, rms, scanned, seen

import fringetrace as ft
from fringetrace import instruments, mm, nm, um
from fringetrace.core.vectors import rotation
from fringetrace.field.wavefront import probe
from fringetrace.geometry import forms, shapes

# Edges of plane waves are known to 1e-7 of a cell, a few cells to a feature's width.
SHARP = 1e-6
# Where wires and grooves are: off the nodes, and off the middles of pixels.
X = 0.13 * mm


@pytest.fixture
def sent(monkeypatch):
    """Rays of each trace that looks where light goes."""
    counts = []
    retrace = probe.retrace

    def counted(paths, rays, **options):
        counts.append(len(rays))
        return retrace(paths, rays, **options)

    monkeypatch.setattr(probe, "retrace", counted)
    return counts


def groove(middle, width, depth, turn=0.0):
    low, high = middle - 0.5 * width, middle + 0.5 * width
    line = [(-9 * mm, 0), (low, 0), (low, -depth), (high, -depth), (high, 0), (9 * mm, 0)]
    return shapes.extrude(line, 18 * mm).moved(turn=rotation((0, 0, 1), turn))


def fringe(depth):
    """What a depth makes of the brightest interference, 1."""
    return math.cos(2 * math.pi * depth / HENE) ** 2


@pytest.mark.parametrize("depth", [100 * nm, -60 * nm])
@pytest.mark.parametrize("width", [40 * um, 12 * um, 4 * um])
def test_a_groove_or_ridge_in_a_michelson_darkens_its_area(width, depth):
    """Cells of 250 um, pixels of 31: each gets its part of the light of both levels."""
    middle, pixels = X, 96
    bench = instruments.michelson(
        groove(middle, width, depth), aperture=3 * mm, pixels=(pixels, pixels), rays=1 / 8
    )
    image = ft.irradiance(bench.trace(), HENE)
    x = (np.arange(pixels + 1) - 0.5 * pixels) * 3 * mm / pixels
    part = np.diff(np.clip(x, middle - 0.5 * width, middle + 0.5 * width)) / (3 * mm / pixels)
    expected = 1.0 + part * (fringe(depth) - 1.0)
    assert expected.min() < 0.97
    assert image == pytest.approx(np.tile(expected, (pixels, 1)), abs=SHARP)


@pytest.mark.parametrize(("width", "turn"), [(25 * um, 0.4), (7.5 * um, math.pi / 4)])
def test_a_groove_aslant_darkens_its_area(width, turn):
    depth, pixels, aperture = 100 * nm, 96, 3 * mm
    bench = instruments.michelson(
        groove(0, width, depth, turn), aperture=aperture, pixels=(pixels, pixels), rays=1 / 8
    )
    image = ft.irradiance(bench.trace(), HENE)
    # a strip through the middle; at 45 degrees it loses a triangle at either end
    area = width * aperture / math.cos(turn)
    if turn == math.pi / 4:
        area -= 0.5 * width**2
    missing = (1.0 - image).sum() * (aperture / pixels) ** 2
    assert missing == pytest.approx(area * (1.0 - fringe(depth)), rel=1e-5)


@pytest.mark.parametrize("side", [40 * um, 15 * um])
def test_a_dot_casts_its_area(side):
    """An opaque square, no node of the grid of 750 um near it, turned by half a radian."""
    turned = shapes.plate(side, side).moved((0.2 * mm, 0.31 * mm, 25 * mm), rotation((0, 0, 1), 0.5))
    dot = ft.Surface(turned, ft.Absorber(), "dot")
    flat = ft.Surface(shapes.plate(20 * mm, 20 * mm), ft.Mirror(), "flat")
    paths = seen([flat, dot], 8, 64)
    missing = (1.0 - ft.irradiance(paths, HENE)).sum() * paths.ccd.pitch**2
    # four corners, each known to 4^-10 of a cell
    assert missing == pytest.approx(side**2, abs=4 * 4**-10 * (0.75 * mm) ** 2)


def strip(at):
    """Where the CCD sees a line x = `at` across the beam; x at each y."""
    y = np.linspace(-3 * mm, 3 * mm, 20_001)
    curve = landing(np.stack([np.full_like(y, at), y], axis=1))
    return lambda here: np.interp(here, curve[:, 1], curve[:, 0])


def all_but(*dark):
    """Ranges of light beside dark ones, each (left, right)."""

    def ranges(y):
        begin = np.full_like(y, -SIDE)
        for left, right in dark:
            yield begin, np.maximum(begin, left(y))
            begin = np.maximum(begin, right(y))
        yield begin, np.full_like(y, SIDE)

    return ranges


@pytest.mark.parametrize("count", [8, pytest.param(16, marks=pytest.mark.slow)])
@pytest.mark.parametrize("width", [60 * um, 8 * um])
def test_a_wire_before_a_curved_mirror_casts_its_shadow(width, count):
    tape = shapes.plate(width, 18 * mm).moved((X, 0, 25 * mm))
    image = ft.irradiance(seen([paraboloid(), ft.Surface(tape, ft.Absorber(), "wire")], count, 64), HENE)
    edges = strip(X - 0.5 * width), strip(X + 0.5 * width)
    assert rms(image, scanned(64, all_but(edges))) < COVERAGE


@pytest.mark.parametrize("count", [8, pytest.param(16, marks=pytest.mark.slow)])
def test_a_round_wire_casts_its_shadow(count):
    """No edge of its mesh is one of its shadow's, but facets turn away from the light there."""
    radius, place = 20 * um, (X, 0, 25 * mm)
    angle = 2 * math.pi * np.arange(16) / 16
    outline = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    form = forms.Cylinder(place, (0, 1, 0), radius)
    mesh = shapes.extrude(outline, 18 * mm, closed=True).moved(place)
    image = ft.irradiance(
        seen([paraboloid(), ft.Surface(mesh, ft.Absorber(), "wire", form=form)], count, 64), HENE
    )
    edges = strip(X - radius), strip(X + radius)
    assert rms(image, scanned(64, all_but(edges))) < COVERAGE


@pytest.mark.parametrize("width", [60 * um, 20 * um])
def test_light_passes_a_wire_twice(width):
    """Below the camera's plane of focus the wave converges to a point: the second shadow grows from there."""
    focus, up, ccd = 50 * mm, 15 * mm, 20 * mm
    tape = shapes.plate(width, 18 * mm).moved((X, 0, up))
    image = ft.irradiance(seen([paraboloid(), ft.Surface(tape, ft.Absorber(), "wire")], 8, 64), HENE)
    grow = (focus - ccd) / (focus - up)
    back = [lambda y, x=x: np.full_like(y, grow * x) for x in (X - 0.5 * width, X + 0.5 * width)]
    edges = strip(X - 0.5 * width), strip(X + 0.5 * width)
    assert rms(image, scanned(64, all_but(edges, back))) < COVERAGE


def slit(middle, width):
    halves = [
        shapes.plate(9 * mm, 18 * mm).moved((middle + side * (0.5 * width + 4.5 * mm), 0, 25 * mm))
        for side in (-1, 1)
    ]
    vertices = np.vstack([half.vertices for half in halves])
    return ft.Surface(
        ft.Mesh(vertices, np.vstack([halves[0].faces, halves[1].faces + len(halves[0].vertices)])),
        ft.Absorber(), "slit",
    )  # fmt: skip


def test_a_slit_that_no_node_lights_lets_its_light_through():
    """The rays of the beam meet it, in the middle of a cell of 375 um."""
    middle, width = 0.1875 * mm, 40 * um
    flat = ft.Surface(shapes.plate(20 * mm, 20 * mm), ft.Mirror(), "flat")
    paths = seen([flat, slit(middle, width)], 16, 64)
    light = ft.irradiance(paths, HENE).sum() * paths.ccd.pitch**2
    assert light == pytest.approx(width * SIDE, rel=SHARP)
    image = ft.irradiance(seen([paraboloid(), slit(middle, width)], 16, 64), HENE)
    edges = strip(middle - 0.5 * width), strip(middle + 0.5 * width)
    expected = scanned(64, lambda y: [tuple(edge(y) for edge in edges)])
    assert rms(image, expected) < COVERAGE


def test_a_scene_without_features_costs_no_more(sent):
    """Only the nodes, and the middles of the cells of a curved sheet: 17^2 and 16^2."""
    ft.irradiance(seen([paraboloid()], 16, 64), HENE)
    assert sum(sent) <= 1.3 * (17**2 + 16**2)
    sent.clear()
    bench = instruments.michelson(shapes.plate(9 * mm, 9 * mm), aperture=3 * mm, pixels=(64, 64), rays=1 / 4)
    ft.irradiance(bench.trace(), HENE)
    assert sum(sent) <= 1.3 * 17**2
