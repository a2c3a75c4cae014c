"""Lenses by form: exact rays, published focal lengths, a rival program, equal paths."""

import json
import math
from pathlib import Path

import mpmath
import numpy as np
import pytest
from sequential import Face, crossing
from sequential import trace as exact

INF = math.inf
N = 1.5168
# Printed digits of back focal lengths, computed with mpmath; millimetres.
PRINTED = 5.1e-10
# Faces (radius, thickness, index), and back focal length over the height of the ray; 0: next to the axis.
TABLE = {
    "flat first": (
        [(INF, 4.0, N), (-51.68, 0.0, 1.0)],
        {0: 100.000000000, 1: 99.956922135, 5: 98.918695457, 10: 95.618161341},
    ),
    "convex first": (
        [(51.68, 4.0, N), (INF, 0.0, 1.0)],
        {0: 97.362869198, 1: 97.351978737, 5: 97.089884306, 10: 96.261677654},
    ),
    "biconvex": (
        [(103.36, 4.0, N), (-103.36, 0.0, 1.0)],
        {0: 99.336341917, 1: 99.320582649, 5: 98.941089235, 10: 97.739112918},
    ),
    "ball": (
        [(5.0, 10.0, 1.5), (-5.0, 0.0, 1.0)],
        {0: 2.5, 1: 2.416160093, 2: 2.158222349, 3: 1.703901493},
    ),
}
# Height of a ray next to the axis: its focus is off by some h^2 / f.
PARAXIAL = 1e-6
RIVAL = json.loads((Path(__file__).parents[1] / "data" / "optiland.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("lens", TABLE)
def test_the_exact_tracer_prints_the_table(lens):
    faces, table = TABLE[lens]
    heights = [(height or PARAXIAL, 0, -10) for height in table]
    points, directions, _ = exact(
        [Face(*face) for face in faces], heights, [(0, 0, 1)] * len(table), digits=30
    )
    found = crossing(points, directions) - sum(thickness for _, thickness, _ in faces)
    assert [float(v) for v in found] == pytest.approx(list(table.values()), abs=PRINTED)


def test_the_exact_tracer_finds_the_paths_to_a_focus_equal():
    index, focus = mpmath.mpf(3) / 2, 20
    faces = [Face(INF, 8, index), Face(-(index - 1) * focus, focus, 1, -index * index)]
    points, _, path = exact(faces, [(h, 0, -10) for h in (0, 1, 5, 9)], [(0, 0, 1)] * 4, digits=40)
    assert max(abs(path - 42)) < 1e-36
    assert max(abs(points[:, 0])) < 1e-28


@pytest.mark.parametrize("lens", RIVAL["lenses"])
def test_the_exact_tracer_agrees_with_optiland(lens):
    """Two programs that know nothing of each other; both have 16 digits of 100 mm."""
    there = RIVAL["lenses"][lens]
    faces = [Face(INF if radius is None else radius, *more) for radius, *more in there["faces"]]
    end, out, path = exact(faces, RIVAL["points"], RIVAL["directions"])
    assert np.abs(path - there["path"]).max() < 1e-12
    assert np.abs(end - there["end"]).max() < 1e-12
    assert np.abs(out - there["out"]).max() < 1e-14
    in_full, _, _ = exact(faces, RIVAL["points"][:4], RIVAL["directions"][:4], digits=30)
    assert np.abs((in_full - end[:4]).astype(float)).max() < 1e-12
