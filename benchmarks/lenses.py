"""Lenses of catalogues beside optiland, a sequential ray tracer: `python benchmarks/lenses.py [--write]`.

Needs `pip install optiland`. --write keeps what it answers for the tests, in tests/data/optiland.json.
"""

from __future__ import annotations

import argparse
import json
import math
import warnings
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

KEPT = Path(__file__).parents[1] / "tests" / "data" / "optiland.json"
# Radius, thickness behind and index behind of each face, mm; the last thickness leads to the focus.
LENSES: dict[str, list[tuple[float, float, float]]] = {
    "singlet": [(51.68, 4.0, 1.5168), (math.inf, 97.363, 1.0)],
    "doublet": [(62.8, 4.0, 1.5168), (-45.7, 2.5, 1.6727), (-128.2, 97.225, 1.0)],
}
# Rays start on this plane, mm before the first vertex.
BEFORE = 10.0
# Largest height on that plane, mm, and slope off axis.
HEIGHT, SLOPE = 9.0, 0.08


def launched(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays, half of them along the axis, half skew; mm."""
    rng = np.random.default_rng(14)
    points = np.stack([*rng.uniform(-HEIGHT, HEIGHT, (2, count)), np.full(count, -BEFORE)], axis=1)
    slopes = rng.uniform(-SLOPE, SLOPE, (count, 2))
    slopes[: count // 2] = 0.0
    directions = np.concatenate([slopes, np.ones((count, 1))], axis=1)
    return points, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def rival(
    faces: list[tuple[float, float, float]], points: np.ndarray, directions: np.ndarray
) -> dict[str, np.ndarray]:
    """Where optiland's rays end, on the plane behind the last face; mm."""
    from optiland.materials import IdealMaterial
    from optiland.optic import Optic
    from optiland.rays import RealRays

    optic = Optic()
    optic.surfaces.add(index=0, radius=math.inf, thickness=math.inf)
    for i, (radius, thickness, index) in enumerate(faces):
        optic.surfaces.add(
            index=i + 1, radius=radius, thickness=thickness, material=IdealMaterial(index), is_stop=i == 0
        )
    optic.surfaces.add(index=len(faces) + 1)
    optic.wavelengths.add(value=0.5876, is_primary=True)
    one = np.ones(len(points))
    rays = RealRays(*points.T, *directions.T, one, 0.5876 * one)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # numba's, about itself
        optic.surfaces.trace(rays)
    return {
        "end": np.stack([rays.x, rays.y, rays.z], axis=1),
        "out": np.stack([rays.L, rays.M, rays.N], axis=1),
        "path": np.asarray(rays.opd),
    }


def record(count: int = 24) -> dict[str, Any]:
    """What the tests compare with."""
    points, directions = launched(count)
    lenses = {}
    for name, faces in LENSES.items():
        answer = {key: value.tolist() for key, value in rival(faces, points, directions).items()}
        rows = [[None if math.isinf(radius) else radius, *more] for radius, *more in faces]
        lenses[name] = {"faces": rows, **answer}
    return {
        "program": f"optiland {version('optiland')}",
        "points": points.tolist(),
        "directions": directions.tolist(),
        "lenses": lenses,
    }


def main() -> None:
    """Compare, and write if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="keep optiland's answers for the tests")
    if parser.parse_args().write:
        beside = KEPT.with_suffix(".part")
        beside.write_text(json.dumps(record(), indent=1) + "\n", encoding="utf-8")
        beside.replace(KEPT)
        print(f"written: {KEPT}")


if __name__ == "__main__":
    main()
