"""Lenses of catalogues beside optiland, a sequential ray tracer: `python benchmarks/lenses.py [--write]`.

Needs `pip install optiland`. --write puts the tables into docs/lenses.md, and keeps what optiland answers
for the tests, in tests/data/optiland.json.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "docs" / "figures"))
import pages

KEPT = Path(__file__).parents[1] / "tests" / "data" / "optiland.json"
# Radius, thickness behind and index behind of each face, mm; the last thickness leads to the focus.
LENSES: dict[str, list[tuple[float, float, float]]] = {
    "singlet": [(51.68, 4.0, 1.5168), (math.inf, 97.363, 1.0)],
    "doublet": [(62.8, 4.0, 1.5168), (-45.7, 2.5, 1.6727), (-128.2, 97.225, 1.0)],
}
# Rays start on this plane, mm before the first vertex.
BEFORE = 10.0
# Largest height on that plane, mm, and slope off axis.
HEIGHT, SLOPE = 7.5, 0.08


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


def traced(
    faces: list[tuple[float, float, float]], points: np.ndarray, directions: np.ndarray, **more: Any
) -> dict[str, np.ndarray]:
    """Where our rays end; mm."""
    import fringetrace as ft
    from fringetrace import mm
    from fringetrace.instruments import lenses

    radii, thicknesses, indices = (np.array(column) for column in zip(*faces, strict=True))
    lens = lenses.lens(
        radii * mm, thicknesses[:-1] * mm, indices[:-1].tolist(), 25.4 * mm,
        interface=ft.Dielectric(follow="transmitted"), **more,
    )  # fmt: skip
    if more:  # coarse facets are meant to be what they are
        lens = tuple(replace(surface, form=None) for surface in lens)
    paths = ft.trace(ft.Scene(lens), ft.Rays(points * mm, directions), threads=1)
    way = (thicknesses.sum() * mm - paths.origin[:, 2]) / paths.direction[:, 2]
    end = paths.origin + way[:, None] * paths.direction
    return {"end": end / mm, "out": paths.direction, "path": (paths.length + way) / mm}


def spent(trace: Callable[..., Any], *given: Any) -> float:
    """Processor time of the fastest of five runs, seconds."""
    times = []
    for _ in range(5):
        start = time.process_time()
        trace(*given)
        times.append(time.process_time() - start)
    return min(times)


def table(count: int = 50_000) -> str:
    """Both programs on the same rays, and facets without a form."""
    points, directions = launched(count)
    lines = [
        "| lens | optical path | place in the focal plane | processor time beside optiland |",
        "|---|---|---|---|",
    ]
    for name, faces in LENSES.items():
        there, here = rival(faces, points, directions), traced(faces, points, directions)
        off = {key: np.abs(there[key] - here[key]).max() * 1e-3 for key in there}
        ratio = spent(traced, faces, points, directions) / spent(rival, faces, points, directions)
        lines.append(f"| {name} | {off['path']:.0e} m | {off['end']:.0e} m | {ratio:.1f} |")
    lines += [
        "",
        "| singlet of facets, no form: rings | facets a face | spot, rms | optical path, rms |",
        "|---|---|---|---|",
    ]
    faces = LENSES["singlet"]
    points, directions = points[: count // 2], directions[: count // 2]
    smooth = traced(faces, points, directions)
    for rings in (16, 64, 256):
        flat = traced(faces, points, directions, rings=rings)
        aside = flat["end"] - smooth["end"]
        spot = np.sqrt((aside**2).sum(axis=1).mean()) * 1e-3
        # the wave at the place where the other ray is
        path = flat["path"] - smooth["path"] - (aside * smooth["out"]).sum(axis=1)
        error = np.sqrt(np.mean(path**2)) * 1e-3
        lines.append(f"| {rings} | {6 * rings**2:,} | {spot * 1e6:.3g} um | {error * 1e9:.3g} nm |")
    return "\n".join(lines)


def main() -> None:
    """Compare, and write if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="into docs/lenses.md and the tests' data")
    write = parser.parse_args().write
    text = table()
    print(text)
    if write:
        pages.write("lenses", text, pages.DOCS / "lenses.md")
        beside = KEPT.with_suffix(".part")
        beside.write_text(json.dumps(record(), indent=1) + "\n", encoding="utf-8")
        beside.replace(KEPT)


if __name__ == "__main__":
    main()
