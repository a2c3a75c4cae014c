"""Bodies: their trees, and the planes of their triangles."""

import subprocess
import sys

import mpmath
import numpy as np
import pytest
from hypothesis import strategies as st

import fringetrace as ft
from fringetrace.core.vectors import rotation
from fringetrace.tracing.intersect import embree, exact

EPS = float(np.finfo(np.float64).eps)
seeds = st.integers(0, 2**32 - 1)


def body(mesh):
    """The one body of a scene of one mirror."""
    return embree.build(ft.Scene([ft.Surface(mesh, ft.Mirror())])).bodies[0]


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 17, 64, 1000])
def test_the_tree_holds_every_triangle_once_in_boxes_around_it(count):
    rng = np.random.default_rng(count)
    corners = rng.uniform(-1, 1, (count, 1, 3)) + 0.1 * rng.normal(size=(count, 3, 3))
    mesh = ft.Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    tree = body(mesh).tree
    assert sorted(tree.order[tree.order >= 0]) == list(range(count))
    leaves = len(tree.lower) // 2
    local = tree.corners.reshape(-1, 3, 3)
    for slot, triangle in enumerate(tree.order):
        node = leaves + slot // exact.LEAF
        while triangle >= 0 and node:
            assert (local[triangle] >= tree.lower[node]).all()
            assert (local[triangle] <= tree.upper[node]).all()
            node //= 2


CROWD = """
import fringetrace as ft
from fringetrace.tracing.intersect.embree import build

sample = ft.Surface(ft.shapes.plate(1.0, 1.0), ft.Mirror())
bodies = [build(ft.Scene([sample.moved((0.0, 0.0, float(k)))])).bodies[0] for k in range(1100)]
for body in bodies:
    body.prepare()
"""


@pytest.mark.slow
def test_more_scenes_may_be_alive_than_posix_has_keys():
    # 1024 of them: with one for each scene the interpreter crashes, so in a process of its own
    done = subprocess.run([sys.executable, "-c", CROWD], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")


def normal_of(corners):
    """Unit normal of a triangle, to 50 digits."""
    with mpmath.workdps(50):
        a, b, c = ([mpmath.mpf(float(x)) for x in corner] for corner in corners)
        u, v = ([x - y for x, y in zip(one, a, strict=True)] for one in (b, c))
        n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        size = mpmath.sqrt(sum(x * x for x in n))
        return np.array([float(x / size) for x in n])


# Corners are rounded to half a unit in their last place, and differences of them are exact or nearly so:
# along the short sides, which meet at an angle far from 0, a normal is off by a few roundings only.
NORMAL = 8 * EPS


@pytest.mark.parametrize("turn", range(3))
@pytest.mark.parametrize("slim", [1.0, 1e-3, 1e-6])
def test_the_normals_of_needles_have_all_their_digits(slim, turn):
    rng = np.random.default_rng(24)
    for _ in range(20):
        # one short side: the other two, which are long and nearly alike, meet at a far corner
        needle = np.array([(0.0, 0.0, 0.0), (0.0, slim, 0.0), (1.0, 0.3 * slim, 0.0)])
        mesh = ft.Mesh(needle @ rotation(rng.normal(size=3), 1.0).T, [np.roll([0, 1, 2], turn)])
        some = body(mesh)
        expected = normal_of(some.vertices[some.faces[0]])
        np.testing.assert_allclose(some.planes[0, :3], expected, rtol=0, atol=NORMAL)
