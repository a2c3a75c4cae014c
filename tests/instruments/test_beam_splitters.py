"""Real splitter plates: their coatings, and where the axis of the light goes."""

import math

import numpy as np
import pytest

from fringetrace import instruments, nm
from fringetrace.core.units import degree
from fringetrace.core.vectors import unit
from fringetrace.geometry import shapes
from fringetrace.instruments.beam_splitters import SplitterPlate, anti_reflecting, semi_reflecting
from fringetrace.optics import films
from fringetrace.optics.interfaces import Absorber

ROUNDINGS = 1e-12


@pytest.mark.parametrize("reflectance", [0.3, 0.5, 0.8])
def test_a_semi_reflecting_layer_reflects_what_it_should(reflectance):
    film = semi_reflecting(1.515, 550 * nm, reflectance)
    s = films.reflectance(film, 1.0, 1.515, 45 * degree, 550 * nm).s
    assert s == pytest.approx(reflectance, rel=ROUNDINGS)


@pytest.mark.parametrize("reflectance", [-0.1, 0.05, 1.0])
def test_a_layer_that_cannot_is_refused(reflectance):
    with pytest.raises(ValueError, match="semi_reflecting: expected more than the bare face and less than 1"):
        semi_reflecting(1.515, 550 * nm, reflectance)


def test_an_anti_reflecting_layer_reflects_nothing():
    film = anti_reflecting("BK7", 550 * nm)
    assert films.reflectance(film, 1.0, "BK7", 45 * degree, 550 * nm).s < ROUNDINGS


@pytest.mark.parametrize("thickness", [0.0, math.inf])
def test_a_plate_has_a_thickness(thickness):
    with pytest.raises(ValueError, match="SplitterPlate thickness: expected a positive length in metres"):
        SplitterPlate(thickness)


def test_a_plate_is_closed_by_a_black_rim():
    coated, bare, rim = SplitterPlate(1e-3).surfaces(10e-3)
    assert isinstance(rim.interface, Absorber)
    corners = {tuple(np.round(v, 9)) for s in (coated, bare) for v in s.mesh.vertices}
    assert corners == {tuple(np.round(v, 9)) for v in rim.mesh.vertices}
    triangles = np.concatenate([s.mesh.vertices[s.mesh.faces] for s in (coated, bare, rim)])
    area = np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    )
    assert 0.5 * area.sum() == pytest.approx(
        2 * (20e-3 * math.sqrt(2)) * 20e-3 + 2e-3 * 20e-3 * (1 + math.sqrt(2)), rel=1e-12
    )


def test_the_axis_of_the_light_hits_the_coating_in_the_origin():
    """By the lateral shift of a slab at 45 degrees, d sin(45 - r) / cos r, seen along x and z."""
    plate = SplitterPlate(2e-3, 1.515)
    z, x = plate.offsets()
    r = math.asin(math.sqrt(0.5) / 1.515)
    shift = 2e-3 * math.sin(math.pi / 4 - r) / math.cos(r)
    assert (abs(z), abs(x)) == (pytest.approx(shift, rel=1e-12), pytest.approx(shift, rel=1e-12))
    bench = instruments.michelson(
        shapes.plate(40e-3, 40e-3), aperture=5e-3, pixels=(3, 3), splitter=SplitterPlate(2e-3, 1.515)
    )
    seen = bench.sampled((3, 3), 550 * nm)
    middle = [
        row for row in np.flatnonzero((seen.fate == 0) & (seen.ray == 4)) if abs(seen.amplitude[row]) > 0.3
    ]
    for row in middle:
        points = seen.polyline(row)
        assert np.linalg.norm(points, axis=1).min() < 1e-15
        assert seen.pixel[row] == pytest.approx([1.5, 1.5], abs=1e-9)
    assert len(middle) == 2
    assert unit(bench.scene.surfaces[1].mesh.bounds.mean(axis=0)[None])[0] @ [0, 0, -1] > 0.99
