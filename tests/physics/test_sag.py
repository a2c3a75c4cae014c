"""How far facets stand off the smooth surface that they are meant for."""

import math

import numpy as np
import pytest

from fringetrace import mm
from fringetrace.geometry import meshes, shapes


def facets(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    return a, normal / np.linalg.norm(normal, axis=1, keepdims=True), np.linalg.norm(b - a, axis=1)


# Unit icosphere: level, largest sag (4 digits), mean sag (sampled, good to half a percent).
TABLE = [(3, 4.528e-3, 2.880e-3), (4, 1.138e-3, 7.182e-4), (5, 2.848e-4, 1.803e-4), (6, 7.123e-5, 4.499e-5)]
SAMPLED = 5e-3


@pytest.mark.parametrize(("level", "largest", "mean"), TABLE)
def test_sag_of_an_icosphere(level, largest, mean):
    mesh = shapes.icosphere(1.0, level)
    a, normal, _ = facets(mesh)
    sag = 1 - np.einsum("ij,ij->i", a, normal)  # the facet's foot point is where it stands off most
    assert sag.max() == pytest.approx(largest, rel=5e-4)
    # the volume between sphere and facets is the integral of sag - sag^2 over the sphere
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    missing = 4 / 3 * math.pi - np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert missing / (4 * math.pi) == pytest.approx(mean, rel=SAMPLED + largest)


def test_sag_of_a_facet_is_that_of_its_edges():
    # an equilateral triangle of side h touches a sphere of radius R: h^2 / 6 R, next order h^4
    mesh = shapes.icosphere(10 * mm, 5)
    a, normal, _ = facets(mesh)
    sides = np.linalg.norm(mesh.vertices[mesh.faces] - mesh.vertices[np.roll(mesh.faces, 1, axis=1)], axis=2)
    even = np.ptp(sides, axis=1) < 1e-3 * sides.mean(axis=1)
    assert even.any()
    sag = 10 * mm - np.einsum("ij,ij->i", a, normal)
    assert sag[even] == pytest.approx((sides[even] ** 2).mean(axis=1) / (6 * 10 * mm), rel=1e-3)


@pytest.mark.parametrize("radius", [1.0, -1.0])
def test_sag_of_a_height_map_of_a_paraboloid(radius):
    # linear between samples: off by x (p - x) / 2R along an edge, twice the square of that on the diagonal
    pitch = 0.1 * mm
    along = (np.arange(21) - 10) * pitch
    mesh = shapes.height_map((along**2 + along[:, None] ** 2) / (2 * radius), pitch)
    fine = np.linspace(-10, 10, 401) * pitch  # twenty points a cell, the middle of each among them
    exact = (fine**2 + fine[:, None] ** 2) / (2 * radius)
    off = (meshes.interpolate_height(mesh, fine, fine[:, None]) - exact) * np.sign(radius)
    assert off.max() == pytest.approx(2 * pitch**2 / (8 * abs(radius)), rel=1e-6)
    assert off.min() > -1e-18  # chords of a hollow stand above it
    assert off[::20].max() == pytest.approx(pitch**2 / (8 * abs(radius)), rel=1e-6)
