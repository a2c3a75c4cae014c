"""Stress tests of numerical stability: the worst figure of each, against mpmath or a closed form.

python docs/figures/stability.py           print the table
python docs/figures/stability.py --write   and write its section of docs/accuracy.md
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import mpmath
import numpy as np

import fringetrace as ft
from fringetrace import mm, nm, um
from fringetrace.core.vectors import rotation, unit
from fringetrace.geometry import forms, shapes

MIRROR = ft.Mirror()
WAVE = 500 * nm
TILT = rotation((1.0, 2.0, 3.0), 0.7)


@dataclass(frozen=True)
class Figure:
    """What a stress came to: its worst error, mostly in waves of 500 nm, and how many rays went astray."""

    rays: int
    worst: float
    astray: int


def unit_mp(vector):
    """A vector scaled to unit length, in mpmath."""
    size = mpmath.sqrt(sum(x * x for x in vector))
    return [x / size for x in vector]


def dot_mp(a, b):
    """Scalar product, in mpmath."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def plane_mp(paths, surface, triangle):
    """A corner and the normal of a triangle, from the float64 vertices."""
    mesh = paths.scene.surfaces[surface].mesh
    a, b, c = ([mpmath.mpf(float(x)) for x in mesh.vertices[k]] for k in mesh.faces[triangle])
    p, q = [y - x for x, y in zip(a, b, strict=True)], [y - x for x, y in zip(a, c, strict=True)]
    return a, [p[k - 2] * q[k - 1] - p[k - 1] * q[k - 2] for k in range(3)]


def exact_length(paths, row):
    """Path of a recorded ray up to its last hit or the CCD, in 50 digits, off the triangles that it met."""
    rays = paths.source
    origin = [mpmath.mpf(float(x)) for x in rays.origin[paths.ray[row]]]
    along = unit_mp([mpmath.mpf(float(x)) for x in rays.direction[paths.ray[row]]])
    total = mpmath.mpf(float(rays.length[paths.ray[row]]))
    plane = cache(partial(plane_mp, paths))  # few triangles are met many times
    for surface, triangle in zip(paths.surface[row], paths.triangle[row], strict=True):
        if surface < 0:
            break
        corner, normal = plane(surface, triangle)
        offset = [c - o for c, o in zip(corner, origin, strict=True)]
        step = dot_mp(offset, normal) / dot_mp(along, normal)
        origin = [o + step * d for o, d in zip(origin, along, strict=True)]
        twice = 2 * dot_mp(along, normal) / dot_mp(normal, normal)
        along = [d - twice * n for d, n in zip(along, normal, strict=True)]
        total += step
    if paths.fate[row] == ft.Fate.DETECTED:
        normal = [mpmath.mpf(float(x)) for x in paths.ccd.normal]
        offset = [mpmath.mpf(float(c)) - o for c, o in zip(paths.ccd.centre, origin, strict=True)]
        total += dot_mp(offset, normal) / dot_mp(along, normal)
    return total


def worst_length(paths, rows, wave=WAVE):
    """Largest error of the length of some paths, in waves."""
    with mpmath.workdps(50):
        return (
            max(float(abs(exact_length(paths, row) - mpmath.mpf(float(paths.length[row])))) for row in rows)
            / wave
        )


def inverted(mesh):
    """The same triangles with their fronts behind."""
    return ft.Mesh(mesh.vertices, mesh.faces[:, ::-1])


def directions(rng, count):
    """Unit vectors (count, 3) all round."""
    return unit(rng.normal(size=(count, 3)))


def grazing():
    """Incidence from 80 to 89.99 degrees on a tilted plate of 2 m, path on to a CCD."""
    rng = np.random.default_rng(1)
    scene = ft.Scene([ft.Surface(shapes.plate(2.0, 2.0).moved(turn=TILT), MIRROR)])
    worst, astray, count = 0.0, 0, 40
    for angle in (80.0, 89.0, 89.9, 89.99):
        sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
        into, out = TILT @ (sine, 0.0, -cosine), TILT @ (sine, 0.0, cosine)
        spot = (
            TILT
            @ np.stack([rng.uniform(-0.2, 0.2, count), rng.uniform(-0.2, 0.2, count), 0.0 * np.ones(count)])
        ).T
        ccd = ft.CCD(1.5 * out, -out, TILT @ (0, 1, 0), 1 * mm, (1000, 1000))
        paths = ft.trace(scene, ft.Rays(spot - 0.5 * into, np.tile(into, (count, 1))), ccd, record=True)
        astray += int((paths.fate != ft.Fate.DETECTED).sum() + (paths.bounces != 1).sum())
        worst = max(worst, worst_length(paths, range(count)))
    return Figure(4 * count, worst, astray)


def needles():
    """Two tilted strips face to face, each of 400 triangles 1 m long and 1 um wide; 10 bounces."""
    edges = (np.arange(201) - 100.0) * um
    vertices = np.concatenate([[(x, -0.5, 0.0) for x in edges], [(x, 0.5, 0.0) for x in edges]])
    i = np.arange(200)
    faces = np.concatenate([np.stack([i, i + 1, i + 202], axis=1), np.stack([i, i + 202, i + 201], axis=1)])
    lower = ft.Mesh(vertices, faces)
    upper = ft.Mesh(vertices * (1, 1, -1) + np.array([0, 0, 0.01]), faces[:, ::-1])
    scene = ft.Scene(
        [ft.Surface(mesh.moved(turn=TILT), MIRROR, str(k)) for k, mesh in enumerate((lower, upper))]
    )
    rng = np.random.default_rng(2)
    count = 2000
    start = np.stack(
        [rng.uniform(-50, 50, count) * um, rng.uniform(-0.4, 0.4, count), 0.005 * np.ones(count)], axis=1
    )
    along = np.stack([rng.normal(0, 5e-5, count), rng.normal(0, 0.2, count), -np.ones(count)], axis=1)
    paths = ft.trace(scene, ft.Rays(start @ TILT.T, along @ TILT.T), max_bounces=10, record=True, warn=False)
    return Figure(count, worst_length(paths, range(0, count, 20)), int((paths.bounces != 10).sum()))


def far_away():
    """A faceted ball of 1 mm, 1 km off the origin: 8 bounces inside."""
    rng = np.random.default_rng(3)
    place = np.array([0.6, -0.7, 0.4]) * 1e3
    mesh = inverted(shapes.icosphere(1 * mm, 2)).moved(place)
    start = rng.uniform(-0.3, 0.3, (400, 3)) * mm + place
    rays = ft.Rays(start, directions(rng, 400))
    paths = ft.trace(ft.Scene([ft.Surface(mesh, MIRROR)]), rays, max_bounces=8, record=True, warn=False)
    return Figure(400, worst_length(paths, range(0, 400, 8)), int((paths.bounces != 8).sum()))


def scales():
    """The same corner cube of 10,000 waves in nm, um, mm, m and 1000 m: phases against those in metres."""
    rng = np.random.default_rng(4)
    count = 500
    along = -np.ones(3) + 0.1 * rng.normal(size=(count, 3))
    start = rng.uniform(0.2, 0.4, (count, 3)) - unit(along)
    lengths, astray = [], 0
    for size in (1.0, 1e-9, 1e-6, 1e-3, 1e3):
        cube = shapes.corner_cube(1.0, subdivisions=4)
        mesh = ft.Mesh((cube.vertices @ TILT.T) * size, cube.faces)
        rays = ft.Rays((start @ TILT.T) * size, along @ TILT.T)
        paths = ft.trace(ft.Scene([ft.Surface(mesh, MIRROR)]), rays)
        lengths.append(paths.length / size)
        bounces = paths.bounces if size == 1.0 else bounces  # noqa: F821
        astray += int((paths.bounces != bounces).sum())
    return Figure(5 * count, float(np.abs(np.array(lengths[1:]) - lengths[0]).max() / 1e-4), astray)


def many_bounces():
    """1,000 bounces between two tilted plates 1 mm apart."""
    gap = 1 * mm
    lower = shapes.plate(0.2, 0.2)
    upper = ft.Mesh(lower.vertices + np.array([0, 0, gap]), lower.faces[:, ::-1])
    scene = ft.Scene(
        [ft.Surface(mesh.moved(turn=TILT), MIRROR, str(k)) for k, mesh in enumerate((lower, upper))]
    )
    rng = np.random.default_rng(5)
    start = np.concatenate([rng.uniform(-0.01, 0.01, (200, 2)), np.full((200, 1), 0.3 * gap)], axis=1)
    along = np.concatenate([rng.normal(0, 0.02, (200, 2)), -np.ones((200, 1))], axis=1)
    paths = ft.trace(
        scene, ft.Rays(start @ TILT.T, along @ TILT.T), max_bounces=1000, record=True, warn=False
    )
    return Figure(200, worst_length(paths, range(0, 200, 20)), int((paths.bounces != 1000).sum()))


def vertices_and_edges():
    """From near the middle of a faceted ball of 1 m to each of its vertices and along its edges' middles."""
    mesh = inverted(shapes.icosphere(1.0, 3))
    corners = mesh.vertices[mesh.faces]
    goals = np.concatenate([mesh.vertices, 0.5 * (corners[:, 0] + corners[:, 1])])
    start = np.tile([0.1, 0.2, -0.05], (len(goals), 1))
    scene = ft.Scene([ft.Surface(mesh, MIRROR)])
    once = ft.trace(scene, ft.Rays(start, goals - start), max_bounces=1, warn=False)
    often = ft.trace(scene, ft.Rays(start, goals - start), max_bounces=30, warn=False)
    worst = 0.0
    with mpmath.workdps(50):
        for a, b, length in zip(goals, start, once.length, strict=True):
            apart = [mpmath.mpf(float(x)) - mpmath.mpf(float(y)) for x, y in zip(a, b, strict=True)]
            worst = max(worst, float(abs(mpmath.sqrt(dot_mp(apart, apart)) - mpmath.mpf(float(length)))))
    return Figure(len(goals), worst / WAVE, int((once.bounces != 1).sum() + (often.bounces != 30).sum()))


def along_edges():
    """Along the walls, the inner edges and the diagonals of the faces of a box of 1 m."""
    box = inverted(shapes.plate(1.0, 1.0, 1.0).moved((0, 0, 0.5)))
    scene = ft.Scene([ft.Surface(box, MIRROR)])
    inset = 0.5 - 1e-12  # as near to the walls as makes a difference
    start, along = [], []
    for x in (-inset, 0.0, inset):
        for y in (-inset, 0.0, inset):
            start += [(x, y, 0.25), (0.25, x, y), (y, 0.25, x)]
            along += [(0, 0, -1), (-1, 0, 0), (0, -1, 0)]
    paths = ft.trace(scene, ft.Rays(start, along), max_bounces=101, warn=False)
    expected = 0.75 + 100.0
    return Figure(
        len(start), float(np.abs(paths.length - expected).max() / WAVE), int((paths.bounces != 101).sum())
    )


def touching():
    """Plates side by side, on the same plane twice, and face to face: rays on the seams too."""
    plate = shapes.plate(1.0, 1.0)
    rng = np.random.default_rng(6)
    start = np.concatenate([rng.uniform(-0.4, 0.4, (300, 2)), np.ones((300, 1))], axis=1)
    start[:100, 0] = 0.0
    rays = ft.Rays(start, np.tile([0.0, 0.0, -1.0], (300, 1)))
    pairs = {
        "side by side": (plate.moved((-0.5, 0, 0)), plate.moved((0.5, 0, 0))),
        "twice": (plate, plate.moved((0.25, 0.25, 0.0))),
        "face to face": (plate, inverted(plate)),
        "block on a plate": (plate, shapes.plate(0.5, 0.5, 0.1).moved((0.25, 0, 0.1))),
    }
    worst, astray = 0.0, 0
    for name, (one, other) in pairs.items():
        scene = ft.Scene([ft.Surface(one, MIRROR, "one"), ft.Surface(other, MIRROR, "other")])
        paths = ft.trace(scene, rays)
        high = (start[:, 0] >= 0.0) & (start[:, 0] <= 0.5) & (np.abs(start[:, 1]) <= 0.25)
        expected = np.where(high & (name == "block on a plate"), 0.9, 1.0)
        worst = max(worst, float(np.abs(paths.length - expected).max() / WAVE))
        astray += int((paths.bounces != 1).sum())
    return Figure(4 * 300, worst, astray)


def gaps():
    """A lens of radius 1 m (its form) over a flat, 1 um to 1 nm apart: the gap as the ray sees it."""
    radius, count = 1.0, 300
    side = 5 * mm
    along = (np.arange(41) - 20) * side / 20
    heights = radius - np.sqrt(radius**2 - along**2 - along[:, None] ** 2)
    lens = inverted(shapes.height_map(heights, side / 20))
    flat = shapes.plate(20 * mm, 20 * mm)
    rng = np.random.default_rng(7)
    start = np.concatenate([rng.uniform(-3.4 * mm, 3.4 * mm, (count, 2)), np.full((count, 1), 0.01)], axis=1)
    worst, astray = 0.0, 0
    for gap in (1 * um, 100 * nm, 10 * nm, 1 * nm):
        surfaces = [
            ft.Surface(lens, ft.BeamSplitter(), "lens", form=forms.Sphere((0, 0, radius), radius)).moved(
                (0, 0, gap)
            ),
            ft.Surface(flat, MIRROR, "flat"),
        ]
        rays = ft.Rays(start, np.tile([0.0, 0.0, -1.0], (count, 1)))
        paths = ft.trace(ft.Scene(surfaces), rays, max_bounces=2, record=True, warn=False)
        through = (paths.surface[:, 0] == 0) & (paths.surface[:, 1] == 1)
        astray += count - int(through.sum())
        met = paths.where(through)
        seen = met.points[:, 1, 2] - met.points[:, 2, 2]
        for row in range(0, len(met), 5):
            x, y = (mpmath.mpf(float(v)) for v in start[met.ray[row], :2])
            with mpmath.workdps(50):
                top = mpmath.mpf(float(surfaces[0].form.centre[2]))
                truth = top - mpmath.sqrt(mpmath.mpf(radius) ** 2 - x * x - y * y)
                worst = max(worst, float(abs(truth - mpmath.mpf(float(seen[row])))) / WAVE)
    return Figure(4 * count, worst, astray)


def axes():
    """Rays straight along each axis onto plates across it, at 0 and off it."""
    worst, astray, total = 0.0, 0, 0
    for axis in range(3):
        for sign in (-1.0, 1.0):
            for place in (0.0, 0.25):
                order = np.roll(np.arange(3), 2 - axis)
                normal = np.eye(3)[axis] * sign
                flat = shapes.plate(1.0, 1.0)
                vertices = np.zeros_like(flat.vertices)
                vertices[:, order[:2]] = flat.vertices[:, :2]
                vertices[:, axis] = place
                scene = ft.Scene([ft.Surface(ft.Mesh(vertices, flat.faces), MIRROR)])
                x, y = (v.ravel() for v in np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.5, 0.5, 9)))
                start = np.zeros((81, 3))
                start[:, order[0]], start[:, order[1]] = x, y
                start += place * np.eye(3)[axis] + 1.5 * normal
                paths = ft.trace(scene, ft.Rays(start, np.tile(-normal, (81, 1))))
                total += 81
                astray += int((paths.bounces != 1).sum())
                hit = paths.bounces == 1
                worst = max(worst, float(np.abs(paths.length[hit] - 1.5).max()) / WAVE)
    return Figure(total, worst, astray)


def pixel_edges():
    """Rays exactly on the edges and corners of pixels: each belongs to one pixel; error in pixels."""
    ccd = ft.CCD((0, 0, 0), (0, 0, 1), (0, 1, 0), 2.0**-10, (64, 64))
    grid = np.arange(-32, 32) * 2.0**-10
    x, y = (v.ravel() for v in np.meshgrid(grid, grid))
    rays = ft.Rays(
        np.stack([-x, y, np.ones_like(x)], axis=1), np.tile([0.0, 0.0, -1.0], (len(x), 1)), area=2.0**-20
    )
    scene = ft.Scene([ft.Surface(shapes.plate(1.0, 1.0).moved((0, 0, -1.0)), MIRROR)])
    paths = ft.trace(scene, rays, ccd)
    image = np.abs(ft.complex_field(paths, WAVE, method="rays"))
    off = paths.pixel - np.round(paths.pixel)
    return Figure(len(x), float(np.abs(off).max()), int((np.abs(image - 1.0) > 1e-12).sum()))


def whispering():
    """60 chords in a ball of 1 m, cosines at its wall from 1e-5 to 1.

    A rounding of a point tilts a chord by as much, and changes its length by that over the cosine:
    the error of a chord, times the cosine, in roundings of 1 m.
    """
    rng = np.random.default_rng(8)
    count, bounces = 1000, 60
    spoke = directions(rng, count)
    tangent = unit(np.cross(spoke, directions(rng, count)))
    cosine = 10.0 ** rng.uniform(-5.0, 0.0, count)
    along = np.sqrt(1.0 - cosine**2)[:, None] * tangent - cosine[:, None] * spoke
    ball = ft.Surface(inverted(shapes.icosphere(1.0, 3)), MIRROR, form=forms.Sphere((0, 0, 0), 1.0))
    paths = ft.trace(ft.Scene([ball]), ft.Rays(spoke * (1.0 - 1e-14), along), max_bounces=bounces, warn=False)
    worst = 0.0
    with mpmath.workdps(50):
        for row in range(0, count, 10):
            o, d = (
                [mpmath.mpf(float(x)) for x in v[row]] for v in (paths.source.origin, paths.source.direction)
            )
            d = unit_mp(d)
            half = mpmath.sqrt(1 - dot_mp(o, o) + dot_mp(o, d) ** 2)
            truth = half * (2 * bounces - 1) - dot_mp(o, d)
            worst = max(worst, float(abs(truth - mpmath.mpf(float(paths.length[row]))) * half / bounces))
    return Figure(count, worst / 2**-53, int((paths.bounces != bounces).sum()))


CASES: dict[str, tuple[str, Callable[[], Figure], float]] = {
    "grazing incidence, 80 to 89.99 degrees": ("mpmath", grazing, 2e-8),
    "needles of aspect 1e6, 10 bounces": ("mpmath", needles, 1e-8),
    "1e6 sizes off the origin, 8 bounces": ("mpmath", far_away, 5e-5),
    "the same scene in nm, um, mm, m, 1000 m": ("itself", scales, 1e-9),
    "1,000 bounces between plates": ("mpmath", many_bounces, 1e-6),
    "rays to vertices and edges": ("mpmath", vertices_and_edges, 5e-9),
    "rays along edges and walls, 101 bounces": ("closed form", along_edges, 1e-7),
    "coplanar and touching faces": ("closed form", touching, 1e-9),
    "gaps of 1 um to 1 nm under a lens": ("mpmath", gaps, 1e-8),
    "surfaces along every axis, at 0": ("closed form", axes, 1e-12),
    "rays on the edges of pixels (pixels)": ("closed form", pixel_edges, 1e-12),
    "chords along a spherical form (roundings)": ("mpmath", whispering, 64.0),
}


def table() -> str:
    """All cases as a Markdown table."""
    lines = ["| stress | against | rays | worst error, waves of 500 nm | astray |", "|---|---|---|---|---|"]
    for name, (truth, case, _) in CASES.items():
        figure = case()
        lines.append(f"| {name} | {truth} | {figure.rays} | {figure.worst:.1e} | {figure.astray} |")
        print(lines[-1], flush=True)
    return "\n".join(lines)


INTRODUCTION = """## Numerical stability

The table shows the worst figure of each stress test. `docs/figures/stability.py --write` made it, and
`tests/physics/test_stability.py` checks it. Errors are of the optical path, in waves of 500 nm (in
1/10,000 of its size for the scene in five units) unless the row names another unit. Rays astray
missed, leaked, hit the triangle that they had just left, or reached a wrong pixel.

"""


def main() -> None:
    """Print the table; write the section if asked to."""
    text = INTRODUCTION + table()
    if "--write" in sys.argv[1:]:
        import pages

        pages.write("stability", text)


if __name__ == "__main__":
    main()
