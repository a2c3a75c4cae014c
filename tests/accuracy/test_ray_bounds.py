"""How errors of single rays grow from bounce to bounce: laws."""

import math
import sys

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import nm
from fringetrace.geometry import forms, shapes

# Rays are cut off on purpose: what becomes of them is looked at here, that it is warned of in `test_checks`.
pytestmark = pytest.mark.filterwarnings("ignore:power is cut off")

RADIUS = 65 * nm
WAVE = 500 * nm
# Off the axes, where numbers round as they do anywhere.
LIFT = 90 * nm


def discs(gap, lift=0.0, radius=RADIUS):
    """Two rods side by side along x, so far apart, their axes at the height `lift`."""
    surfaces = []
    for name, x in (("left", -0.5 * gap - radius), ("right", 0.5 * gap + radius)):
        mesh = shapes.rod_lattice(1, 1, radius, 3 * radius, 40 * radius, sides=120).moved((x, 0, lift))
        surfaces.append(
            ft.Surface(mesh, ft.Mirror(), name, form=forms.Cylinder((x, 0, lift), (0, 1, 0), radius))
        )
    return ft.Scene(surfaces)


@pytest.mark.parametrize(("gap", "factor"), [(150 * nm, 6.4606), (20 * nm, 2.1503), (260 * nm, 9.898979486)])
def test_between_two_discs_an_error_grows_by_a_known_factor(gap, factor):
    """(1 + L/r) + sqrt((1 + L/r)^2 - 1) a bounce, for light between the tops of two discs."""
    grown = []
    for bounces in (11, 12):
        paths = ft.trace(discs(gap), ft.Rays([(0, 0, 0)], [(1, 0, 0)]), max_bounces=bounces, record=True)
        assert paths.bounces[0] == bounces
        grown.append(ft.bounds(paths).position[0])
    assert grown[1] / grown[0] == pytest.approx(factor, rel=1e-3)


def fan(count=40, seed=1):
    """Rays between the discs, in the plane across them, near the line between their centres."""
    rng = np.random.default_rng(seed)
    slope = rng.uniform(-3e-4, 3e-4, count)
    height = LIFT + rng.uniform(-0.02, 0.02, count) * nm
    start = np.stack([np.zeros(count), np.zeros(count), height], axis=1)
    return start, np.stack([np.ones(count), np.zeros(count), slope], axis=1)


def test_flat_mirrors_let_errors_grow_with_the_way_only():
    low = shapes.plate(4.0, 4.0)
    high = ft.Mesh(low.vertices + np.array([0, 0, 0.01]), low.faces[:, ::-1])
    scene = ft.Scene([ft.Surface(m, ft.Mirror(), str(k)) for k, m in enumerate((low, high))])
    found = [
        ft.bounds(ft.trace(scene, ft.Rays([(0, 0, 0.005)], [(0.1, 0.0, 1.0)]), max_bounces=n, record=True))
        for n in (10, 100)
    ]
    # directions take a walk at random, and the ray goes where they point: n^(3/2) at most
    assert 1.0 < found[1].position[0] / found[0].position[0] < 10**1.5
    assert found[1].direction[0] / found[0].direction[0] == pytest.approx(math.sqrt(101 / 11), rel=0.01)


def test_a_hollow_mirror_focuses_errors():
    """In a ball: errors wander as they do between flat mirrors, n^(3/2), less what has not begun to."""
    mesh = shapes.icosphere(1.0, 3)
    inside = ft.Mesh(mesh.vertices, mesh.faces[:, ::-1])
    scene = ft.Scene([ft.Surface(inside, ft.Mirror(), form=forms.Sphere((0, 0, 0), 1.0))])
    sizes = [
        ft.bounds(ft.trace(scene, ft.Rays([(0.1, 0.2, 0)], [(0.3, 0.1, 1)]), max_bounces=n, record=True))
        for n in (10, 160)
    ]
    assert sizes[1].position[0] / sizes[0].position[0] < 16.0**1.7


def test_phases_become_unknown_after_some_bounces():
    """From roundings of 1e-22 m, by 6.4606 a bounce, to 5 nm: after some 17 bounces."""
    gap, known = 150 * nm, []
    for bounces in range(10, 24):
        paths = ft.trace(discs(gap), ft.Rays([(0, 0, 0)], [(1, 0, 0)]), max_bounces=bounces, record=True)
        found = ft.bounds(paths)
        assert found.known(WAVE).shape == (1,)
        # along the axis lengths do not feel a step aside, to first order: what is known is the place
        known.append(bool(found.position[0] <= 0.01 * WAVE))
    lost = 10 + known.index(False)
    first = 4 * 2.0**-53 * 75 * nm  # roundings of the places, times the deviations of a bound
    assert lost == pytest.approx(math.log(5 * nm / first) / math.log(6.4606), abs=1.6)
    assert known == sorted(known, reverse=True)


def test_known_compares_lengths_with_a_part_of_the_wave():
    found = ft.Bounds(np.zeros(3), np.zeros(3), np.array([0.0, 4.9 * nm, 5.1 * nm]))
    assert found.known(WAVE).tolist() == [True, True, False]
    assert found.known(WAVE, part=0.1).all()
    with pytest.raises(ValueError, match="wavelength: expected a positive length"):
        found.known(0.0)


def test_many_paths_are_carried_in_parts(monkeypatch):
    start, direction = fan()
    paths = ft.trace(discs(150 * nm, LIFT), ft.Rays(start, direction), max_bounces=5, record=True)
    whole = ft.bounds(paths)
    monkeypatch.setattr(sys.modules[ft.bounds.__module__], "CHUNK", 7)
    parts = ft.bounds(paths)
    for name in ("position", "direction", "length"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), rtol=1e-12)


def test_paths_on_a_ccd_and_paths_that_split():
    """A splitter in the beam: what goes through keeps its direction, and its errors."""
    scene = ft.Scene([ft.Surface(shapes.plate(1.0, 1.0), ft.BeamSplitter())])
    rays = ft.Rays([(0.1, 0.0, 1.0)], [(0.3, 0.0, -1.0)])
    for place, normal in (((0, 0, -1.0), (0, 0, 1.0)), ((0, 0, 1.5), (0, 0, -1.0))):
        ccd = ft.CCD(place, normal, (0, 1, 0), 0.1, (100, 100))
        seen = ft.trace(scene, rays, ccd, record=True).detected
        found = ft.bounds(seen)
        assert len(seen) == 1
        # two roundings of direction, over a way of two metres, times four deviations
        assert 1e-16 < found.position[0] < 4 * 1e-15


def test_paths_have_to_be_recorded():
    paths = ft.trace(discs(20 * nm), ft.Rays([(0, 0, 0)], [(1, 0, 0)]), max_bounces=2)
    with pytest.raises(ValueError, match="expected paths traced with record=True"):
        ft.bounds(paths)
