"""Rays between two discs in float64 and in 60 digits: where they part, and that the wave does not.

python docs/figures/shadowing.py           print the table
python docs/figures/shadowing.py --write   and write it into docs/budget.md
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import mpmath
import numpy as np
import pages

import fringetrace as ft
from fringetrace import nm
from fringetrace.geometry import forms, shapes

RADIUS, GAP = 65 * nm, 150 * nm
# Off the axes, where numbers round as they do anywhere.
LIFT = 90 * nm
# The wave is compared so far above or below the discs' centres.
FAR = 1000 * nm
WAVE = 500 * nm
DIGITS = 60
MOST = 40
# A step of the start, in metres, to look for the ray that leaves where another did.
STEP = 1e-24


def discs(gap: float = GAP, lift: float = LIFT) -> ft.Scene:
    """Two rods side by side along x, so far apart, their axes at the height `lift`."""
    surfaces = []
    for name, x in (("left", -0.5 * gap - RADIUS), ("right", 0.5 * gap + RADIUS)):
        mesh = shapes.rod_lattice(1, 1, RADIUS, 3 * RADIUS, 40 * RADIUS, sides=120).moved((x, 0, lift))
        form = forms.Cylinder((x, 0, lift), (0, 1, 0), RADIUS)
        surfaces.append(ft.Surface(mesh, ft.Mirror(), name, form=form))
    return ft.Scene(surfaces)


def mp(vector: np.ndarray) -> list:
    """A vector in mpmath."""
    return [mpmath.mpf(float(x)) for x in vector]


def hits(start: list, direction: list, most: int = MOST) -> list:
    """Place, direction and path after each hit of a ray between the discs, in mpmath."""
    point, path, found = start, mpmath.mpf(0), []
    size = mpmath.sqrt(sum(d * d for d in direction))
    along = [d / size for d in direction]
    radius, lift = mpmath.mpf(RADIUS), mpmath.mpf(LIFT)
    for _ in range(most):
        centre = mpmath.mpf(-0.5 * GAP - RADIUS) if along[0] < 0 else mpmath.mpf(0.5 * GAP + RADIUS)
        x, z = point[0] - centre, point[2] - lift
        middle = x * along[0] + z * along[2]
        root = middle**2 - (x * x + z * z - radius**2)
        if root <= 0 or middle > 0:
            break
        step = -middle - mpmath.sqrt(root)
        point, path = [p + step * d for p, d in zip(point, along, strict=True)], path + step
        normal = [(point[0] - centre) / radius, mpmath.mpf(0), (point[2] - lift) / radius]
        facing = sum(d * n for d, n in zip(along, normal, strict=True))
        along = [d - 2 * facing * n for d, n in zip(along, normal, strict=True)]
        found.append((point, along, path))
    return found


def onward(point: list, along: list, path: mpmath.mpf, side: int) -> tuple:
    """Where a ray crosses the line FAR from the centres: x, path, and the slope of the path along x."""
    step = (mpmath.mpf(LIFT) + side * mpmath.mpf(FAR) - point[2]) / along[2]
    return point[0] + step * along[0], path + step, along[0]


@dataclass(frozen=True)
class Row:
    """Rays that bounce alike often: worst figures, in metres and waves of 500 nm.

    `last` and `bound`: of the place of the last hit; `aside`: of the place on the line; `tangent`: of the
    path there less the slope of the path times `aside`; `start`: how far from the ray's start that of
    the true ray is which leaves where this one did; `wave`: its path beside this one's, in waves.
    """

    bounces: int
    rays: int
    last: float
    bound: float
    aside: float
    tangent: float
    start: float
    wave: float


def shadow(start: list, direction: list, count: int, side: int, place: mpmath.mpf) -> tuple:
    """The true ray that crosses the line at a place: how far its start is away, and its path."""

    def beside(moved: mpmath.mpf) -> mpmath.mpf:
        found = hits([start[0], start[1], start[2] + moved], direction, count)
        return onward(*found[count - 1], side)[0] - place

    moved = mpmath.findroot(beside, (mpmath.mpf(0), mpmath.mpf(STEP)), tol=mpmath.mpf(10) ** -60)
    found = hits([start[0], start[1], start[2] + moved], direction, count)
    return moved, onward(*found[count - 1], side)[1]


def compared(slope: float, rays: int = 20, seed: int = 5) -> Row:
    """Rays that start from the middle at about a slope, those that take the true sequence of discs."""
    rng = np.random.default_rng(seed)
    start = np.stack([rng.uniform(-1, 1, rays) * nm, np.zeros(rays), np.full(rays, LIFT)], axis=1)
    tilt = slope * rng.uniform(0.5, 1.5, rays) * rng.choice([-1, 1], rays)
    direction = np.stack([np.ones(rays), np.zeros(rays), tilt], axis=1)
    paths = ft.trace(discs(), ft.Rays(start, direction), max_bounces=MOST, record=True, warn=False)
    bound = ft.bounds(paths).position
    figures = []
    with mpmath.workdps(DIGITS):
        for row in range(rays):
            begin, into, count = mp(start[row]), mp(direction[row]), int(paths.bounces[row])
            true = hits(begin, into)
            if len(true) != count:
                continue
            side = 1 if paths.direction[row, 2] > 0 else -1
            end = mp(paths.origin[row])
            x, path, _ = onward(end, mp(paths.direction[row]), mpmath.mpf(float(paths.length[row])), side)
            x_true, path_true, lean = onward(*true[-1], side)
            moved, path_there = shadow(begin, into, count, side, x)
            last = mpmath.sqrt(sum((a - b) ** 2 for a, b in zip(end, true[-1][0], strict=True)))
            tangent = path - path_true - lean * (x - x_true)
            numbers = (last, x - x_true, tangent / WAVE, moved, (path - path_there) / WAVE)
            figures.append([abs(float(number)) for number in numbers])
    last, aside, tangent, moved, wave = np.max(figures, axis=0)
    return Row(int(paths.bounces.max()), len(figures), last, bound.max(), aside, tangent, moved, wave)


SLOPES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14, 1e-16)


def table() -> str:
    """All rows as a Markdown table."""
    lines = [
        "| bounces | last hit off, nm | bound, nm | off on the line, nm | path off the tangent, waves "
        "| start of the true ray off, nm | path off the true wave, waves |",
        "|---|---|---|---|---|---|---|",
    ]
    for slope in SLOPES:
        row = compared(slope)
        numbers = (row.last / nm, row.bound / nm, row.aside / nm, row.tangent, row.start / nm, row.wave)
        lines.append(f"| {row.bounces} | " + " | ".join(f"{n:.1e}" for n in numbers) + " |")
        print(lines[-1], flush=True)
    return "\n".join(lines)


def main() -> None:
    """Print the table; write it into its page if asked to."""
    text = table()
    if "--write" in sys.argv[1:]:
        pages.write("shadowing", text, pages.BUDGET)


if __name__ == "__main__":
    main()
