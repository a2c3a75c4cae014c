"""Which facets are one plane: any tessellation, turn, place and scale; steps down to 1e-12 of the mesh."""

import numpy as np
import pytest

from fringetrace import instruments, mm, nm
from fringetrace.core.vectors import rotation
from fringetrace.geometry import shapes
from fringetrace.scene.coplanar import LEVEL, planes

# A step this high, relative to the mesh, is one.
HIGH = 10 * LEVEL


def terraces(heights, cells, slopes=None):
    """Strips of one grid, each at a height and of a slope; their facets' true planes."""
    corners, truth = [], []
    for k, height in enumerate(heights):
        x, y = np.meshgrid(np.linspace(k, k + 1, cells + 1), np.linspace(0, len(heights), cells + 1))
        z = height + (0.0 if slopes is None else slopes[k]) * (x - k)
        points = np.stack([x, y, z], axis=-1)
        a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
        corners += [
            np.stack([a, b, c], axis=2).reshape(-1, 3, 3),
            np.stack([a, c, d], axis=2).reshape(-1, 3, 3),
        ]
        truth.append(np.full(2 * cells**2, k))
    return np.concatenate(corners) / len(heights), np.concatenate(truth)


def same(found, truth):
    """Whether two numberings part things alike."""
    pairs = np.unique(np.column_stack([found, truth]), axis=0)
    return len(pairs) == len(np.unique(found)) == len(np.unique(truth))


@pytest.mark.parametrize("seed", range(12))
def test_terraces(seed):
    rng = np.random.default_rng(seed)
    count, cells = rng.integers(2, 6), rng.integers(1, 30)
    heights = np.cumsum(HIGH * 10 ** rng.uniform(0, 10, count)) * count
    corners, truth = terraces(heights, cells)
    # turned, off the origin by up to its size, and of any scale
    turned = corners @ rotation(rng.normal(size=3), rng.uniform(0, 6)).T + rng.uniform(-1, 1, 3)
    order = rng.permutation(len(corners))
    found = planes((10 ** rng.uniform(-9, 6) * turned)[order])
    assert same(found, truth[order])


@pytest.mark.parametrize("seed", range(12))
def test_slopes(seed):
    """Facets that meet in an edge, bent by little."""
    rng = np.random.default_rng(seed)
    count, cells = rng.integers(2, 6), rng.integers(1, 12)
    slopes = np.cumsum(4 * HIGH * 10 ** rng.uniform(0, 10, count))
    heights = np.concatenate([[0.0], np.cumsum(slopes)[:-1]])
    corners, truth = terraces(heights, cells, slopes)
    assert same(planes(corners @ rotation(rng.normal(size=3), rng.uniform(0, 6)).T), truth)


def test_one_plane_of_many_small_facets_is_one():
    corners, _ = terraces([0.0], 200)
    rng = np.random.default_rng(0)
    for _ in range(5):
        turned = corners @ rotation(rng.normal(size=3), rng.uniform(0, 6)).T + rng.uniform(-3, 3, 3)
        assert len(np.unique(planes(turned))) <= 4  # 1e-9 may be rounded either way


def test_none_and_one():
    assert planes(np.empty((0, 3, 3))).shape == (0,)
    assert planes(np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])).tolist() == [0]


@pytest.mark.parametrize("rise", [3e-13, 3e-12, 5e-12])
def test_a_step_of_picometres_is_seen_by_the_wavefront_as_by_rays(rise):
    width, wavelength = 6 * mm, 500 * nm
    found = []
    for method in ("wavefront", "rays"):
        bench = instruments.michelson(
            shapes.step(width, width, 0.0, rise), aperture=width, pixels=(8, 8), method=method
        )
        field = bench.fields(wavelength)[0]
        found.append(np.angle(field[4, 1] * np.conj(field[4, 6])) * wavelength / (4 * np.pi))
    # a phase is good to some eps of the path, 1e-16 of 24 mm
    assert found == pytest.approx([rise, rise], abs=1e-16)
