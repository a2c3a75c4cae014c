"""The error budget beside the true error, term by term, on scenes whose truth is known.

python docs/figures/budget.py           print the table
python docs/figures/budget.py --write   and write it into docs/budget.md
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import mpmath
import numpy as np
import pages

import fringetrace as ft
from fringetrace import instruments, mm, nm, um
from fringetrace.accuracy.error_budget import FEWEST, budget, facet_error, hit_error
from fringetrace.accuracy.sampling import count_error, offset_error, quadrature_error, sampling_error
from fringetrace.core.vectors import rotation
from fringetrace.geometry import forms, shapes
from fringetrace.tracing.rays import launch

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
import arrivals

HENE = 632.8 * nm
MIRROR = ft.Mirror()
# An estimate may be this much below the truth, and above it.
BELOW, ABOVE = 0.5, 10.0


@dataclass(frozen=True)
class Row:
    """A scene at one size: the true error and the estimated one, in waves."""

    size: str
    truth: float
    estimate: float

    @property
    def ratio(self) -> float:
        """Estimate beside truth."""
        return self.estimate / self.truth if self.truth else math.nan

    @property
    def holds(self) -> bool:
        """Whether the estimate keeps its promise."""
        return BELOW * self.truth <= self.estimate <= ABOVE * self.truth


def off(field: np.ndarray, truth: np.ndarray) -> float:
    """Error of a field in waves, as `Budget` counts it."""
    return math.sqrt((abs(field - truth) ** 2).sum() / (abs(truth) ** 2).sum()) / (2 * math.pi)


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return math.sqrt(np.mean(np.asarray(values) ** 2))


def wave(path: np.ndarray) -> np.ndarray:
    """exp(2 pi i path / wavelength)."""
    return np.exp(2j * math.pi * np.fmod(path, HENE) / HENE)


# Rounding. The truth is a trace in 50 digits over the same triangles, continued along the wave
# to where the ray of float64 arrived.


def mp(vector: np.ndarray) -> list:
    """A vector in mpmath."""
    return [mpmath.mpf(float(x)) for x in vector]


def dot(a: list, b: list) -> mpmath.mpf:
    """Scalar product, in mpmath."""
    return sum(x * y for x, y in zip(a, b, strict=True))


def plane(paths: ft.Paths, surface: int, triangle: int) -> tuple[list, list]:
    """A corner and the normal of a triangle, from the float64 vertices."""
    mesh = paths.scene.surfaces[surface].mesh
    a, b, c = (mp(mesh.vertices[k]) for k in mesh.faces[triangle])
    p, q = [y - x for x, y in zip(a, b, strict=True)], [y - x for x, y in zip(a, c, strict=True)]
    return a, [p[k - 2] * q[k - 1] - p[k - 1] * q[k - 2] for k in range(3)]


def onto(point: list, along: list, corner: list, normal: list) -> tuple[list, mpmath.mpf]:
    """Where a ray crosses a plane, and how far that is."""
    step = dot([c - o for c, o in zip(corner, point, strict=True)], normal) / dot(along, normal)
    return [o + step * d for o, d in zip(point, along, strict=True)], step


def rounding_error(paths: ft.Paths, row: int) -> float:
    """Optical path of a recorded ray less that of the true wave where it arrived, metres."""
    beam, ccd = paths.source, paths.ccd
    start = mp(launch(beam, int(paths.ray[row]), int(paths.ray[row]) + 1).origin[0])
    along = mp(beam.axes[2])
    along = [d / mpmath.sqrt(dot(along, along)) for d in along]
    total = dot([x - c for x, c in zip(start, mp(beam.centre), strict=True)], along)
    point = start
    for surface, triangle in zip(paths.surface[row], paths.triangle[row], strict=True):
        if surface < 0:
            break
        corner, normal = plane(paths, surface, triangle)
        point, step = onto(point, along, corner, normal)
        twice = 2 * dot(along, normal) / dot(normal, normal)
        along = [d - twice * n for d, n in zip(along, normal, strict=True)]
        total += step
    normal = mp(ccd.axes[2])
    corner = [c + mpmath.mpf(ccd.focus) * n for c, n in zip(mp(ccd.centre), normal, strict=True)]
    point, step = onto(point, along, corner, normal)
    beside = [a - b for a, b in zip(mp(paths.origin[row]), point, strict=True)]
    above = dot(beside, normal) / dot(normal, normal)
    beside = [b - above * n for b, n in zip(beside, normal, strict=True)]
    return float(mpmath.mpf(float(paths.length[row])) - total - step - dot(beside, along))


def hit_row(size: str, paths: ft.Paths, every: int = 1) -> Row:
    """Rounding of some paths."""
    paths = paths.detected
    assert len(paths) > 30
    with mpmath.workdps(50):
        truth = rms([rounding_error(paths, row) for row in range(0, len(paths), every)])
    return Row(size, truth / HENE, hit_error(paths, HENE))


def hit_grazing() -> Iterator[Row]:
    """A tilted plate, lit at a flat angle."""
    turn = rotation((1.0, 2.0, 3.0), 0.7)
    scene = ft.Scene([ft.Surface(shapes.plate(2.0, 2.0).moved(turn=turn), MIRROR)])
    for angle in (30.0, 80.0, 89.0):
        sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
        into, out = turn @ (sine, 0.0, -cosine), turn @ (sine, 0.0, cosine)
        up = turn @ (0.0, 1.0, 0.0)
        beam = ft.Beam(-0.5 * into, into, up, (5 * mm, 5 * mm), (9, 9))
        ccd = ft.CCD(1.5 * out, -out, up, 1 * mm, (10, 10))
        yield hit_row(f"{angle:g} degrees", ft.trace(scene, beam, ccd, record=True))


def hit_plates() -> Iterator[Row]:
    """Between two plates 10 mm apart, more and more bounces."""
    turn, gap = rotation((1.0, 2.0, 3.0), 0.7), 10 * mm
    for bounces in (10, 100, 1000):
        long = (bounces + 0.5) * gap
        low = shapes.plate(long, 0.1)
        high = ft.Mesh(low.vertices + np.array([0.0, 0.0, gap]), low.faces[:, ::-1])
        scene = ft.Scene([ft.Surface(m.moved(turn=turn), MIRROR, str(k)) for k, m in enumerate((low, high))])
        slope, into = 1.0, np.array([1.0, 0.0, -1.0]) / math.sqrt(2.0)
        start = np.array([-0.5 * long + 0.25 * gap * slope, 0.0, 0.5 * gap])
        beam = ft.Beam(turn @ start, turn @ into, turn @ (0, 1, 0), (1 * mm, 1 * mm), (7, 7))
        end = turn @ np.array([0.5 * long + 2 * gap, 0.0, 0.5 * gap])
        ccd = ft.CCD(end, turn @ (-1.0, 0.0, 0.0), turn @ (0, 1, 0), 1 * mm, (100, 100))
        paths = ft.trace(scene, beam, ccd, max_bounces=2 * bounces, record=True, warn=False)
        yield hit_row(f"{int(paths.detected.bounces.max())} bounces", paths, 1 if bounces < 1000 else 7)


def hit_far() -> Iterator[Row]:
    """A corner cube of 25 mm, off the origin."""
    turn, axis = rotation((1.0, 2.0, 3.0), 0.7), np.ones(3) / math.sqrt(3.0)
    for far in (0.0, 1.0, 1e3, 1e5):
        place = far * np.array([0.6, -0.7, 0.4])
        mesh = shapes.corner_cube(25 * mm, 5).moved(place, turn)
        d = turn @ (axis + np.array([0.03, -0.02, 0.01]))
        d /= np.linalg.norm(d)
        up = turn @ np.array([1.0, -1.0, 0.0])
        beam = ft.Beam(place + 60 * mm * d, -d, up, (6 * mm, 6 * mm), (12, 12))
        ccd = ft.CCD(place + 90 * mm * d, -d, up, 1 * mm, (20, 20))
        paths = ft.trace(ft.Scene([ft.Surface(mesh, MIRROR)]), beam, ccd, record=True)
        yield hit_row(f"{far:g} m off", paths)


def hit_form() -> Iterator[Row]:
    """A paraboloid (its form), every path to the focus as long: f from 1 mm to 1 km."""
    for focal in (1e-3, 1.0, 1e3):
        paths = bowl(focal, 17, forms.Conic((0, 0, 0), (0, 0, 1), 2 * focal, -1.0), 0.4)
        x, y = (mpmath.matrix([float(v) for v in paths.origin[:, k]]) for k in (0, 1))
        with mpmath.workdps(50):
            f, away = mpmath.mpf(focal), mpmath.mpf(focal) - mpmath.mpf(float(0.4 * focal))
            start = mpmath.mpf(float(paths.source.centre[2]))
            errors = [
                float(mpmath.mpf(float(path)) - start - f + mpmath.sqrt(a * a + b * b + away**2))
                for path, a, b in zip(paths.length, x, y, strict=True)
            ]
        yield Row(f"f = {focal:g} m", rms(errors) / HENE, hit_error(paths, HENE))


# Facets. The truth is the closed form of the wave off the smooth surface, where the ray arrived.


def bowl(focal: float, cells: int, form: forms.Form | None, place: float) -> ft.Paths:
    """Paths off a paraboloid of so many cells across, on a plane a part of its focal length away."""
    along = (np.arange(cells) / (cells - 1) - 0.5) * 0.16 * focal
    mesh = shapes.height_map((along**2 + along[:, None] ** 2) / (4 * focal), 0.16 * focal / (cells - 1))
    beam = ft.Beam((0, 0, 0.96 * focal), (0, 0, -1), (0, 1, 0), (0.12 * focal, 0.12 * focal), (53, 51))
    far = 0.98 * focal
    ccd = ft.CCD((0, 0, far), (0, 0, -1), (0, 1, 0), focal / 64, (64, 64), focus=far - place * focal)
    scene = ft.Scene([ft.Surface(mesh, MIRROR, "bowl", form=form)])
    return ft.trace(scene, beam, ccd, record=True).detected


def facets_paraboloid(place: float) -> Iterator[Row]:
    """A paraboloid of f = 50 mm, on a plane some part of f away."""
    focal = 50 * mm
    for cells in (17, 33, 65, 129):
        paths = bowl(focal, cells, None, place)
        away = np.hypot(np.hypot(paths.origin[:, 0], paths.origin[:, 1]), focal * (1 - place))
        error = paths.length - (paths.source.centre[2] + focal - away)
        yield Row(f"{cells - 1} x {cells - 1} cells", rms(error) / HENE, facet_error(paths, HENE)[0])


def facets_bench() -> Iterator[Row]:
    """A hollow of 1 m radius in a Michelson: the field on its pixels, against that with its form."""
    for cells in (9, 17, 33, 65):
        along = (np.arange(cells) / (cells - 1) - 0.5) * 8 * mm
        mesh = shapes.height_map(-(along**2 + along[:, None] ** 2) / 2.0, 8 * mm / (cells - 1))
        field = []
        for form in (None, forms.Conic((0, 0, 0), (0, 0, -1), 1.0, -1.0)):
            sample = ft.Surface(mesh, MIRROR, "sample", form=form)
            bench = instruments.michelson(sample, aperture=6 * mm, pixels=(64, 64))
            field.append(ft.complex_field(bench.trace(), HENE, "rays"))
            if form is None:
                estimate = budget(bench.trace(), HENE, "rays").facets
        yield Row(f"{cells - 1} x {cells - 1} cells", off(*field), estimate)


def round_mirror(mesh: ft.Mesh, radius: float, across: bool) -> tuple[ft.Paths, np.ndarray]:
    """Paths off a convex ball, or a cylinder along y, and their errors, on a plane near its top."""
    high, width = 3 * radius, 0.6 * radius
    beam = ft.Beam((0, 0, high), (0, 0, -1), (0, 1, 0), (width, width), (53, 51))
    ccd = ft.CCD((0, 0, 4 * radius), (0, 0, -1), (0, 1, 0), radius / 64, (128, 128), focus=3.2 * radius)
    paths = ft.trace(ft.Scene([ft.Surface(mesh, MIRROR, "round")]), beam, ccd, record=True).detected
    # rays that meet it at sin t leave at 2 t, and seem to come from the plane z = .8 R
    t = np.linspace(0.0, 0.6, 200_001)
    back = (np.cos(t) - 0.8) * radius / np.cos(2 * t)
    place, path = radius * np.sin(t) - back * np.sin(2 * t), high - radius * np.cos(t) - back
    x, y = paths.origin[:, 0], paths.origin[:, 1]
    at = np.abs(x) if across else np.hypot(x, y)
    return paths, paths.length - np.interp(at, place, path)


def facets_ball() -> Iterator[Row]:
    """A ball of 10 mm, seen through a relay: an icosphere."""
    for level in (3, 4, 5, 6):
        paths, error = round_mirror(shapes.icosphere(10 * mm, level), 10 * mm, False)
        yield Row(f"{20 * 4**level:,} facets", rms(error) / HENE, facet_error(paths, HENE)[0])


def facets_rod() -> Iterator[Row]:
    """A rod of 10 mm, seen through a relay: a prism."""
    for sides in (60, 180, 360, 1001):
        rod = shapes.rod_lattice(1, 1, 10 * mm, 30 * mm, 40 * mm, sides=sides)
        paths, error = round_mirror(rod, 10 * mm, True)
        yield Row(f"{sides} sides", rms(error) / HENE, facet_error(paths, HENE)[0])


# Rays and pixels. The truth is the mean over each pixel of a plane or spherical wave.


def fringes(tilt: float, pitch: float, pixels: int, rays: float, turn: float = 0.0) -> tuple:
    """Paths of a plane wave off a mirror that leans, so many rays a pixel, and its mean over pixels."""
    count = round(2 * pixels * rays)
    size = 2 * pixels * pitch
    place = (1.3 * um, -0.7 * um) if turn else (0.0, 0.0)
    beam = ft.Beam((*place, 0.1), (0, 0, -1), (turn, 1, 0), (size, size), (count, count))
    ccd = ft.CCD((0, 0, 1 * um), (0, 0, -1), (0, 1, 0), pitch, (pixels, pixels))
    x = (np.arange(pixels) - 0.5 * (pixels - 1)) * pitch
    path = 0.1 + 1 * um * math.cos(2 * tilt) + x * math.sin(2 * tilt)
    # light that arrives aslant is spread over more of the CCD
    mean = -np.sinc(math.sin(2 * tilt) * pitch / HENE) * wave(path)
    return arrivals.reflected(beam, ccd, arrivals.plane(tilt)), np.tile(mean, (pixels, 1)), math.cos(2 * tilt)


def sphere(rays: int, place: float, pixels: int = 24, power: float = 0.5) -> tuple[ft.Paths, np.ndarray]:
    """Paths off a paraboloid of f = 50 mm to a plane at `place`, and the mean field over the pixels.

    A ray sum goes to the irradiance itself where light converges, not to its root: `power` is 1.
    """
    focal = 50 * mm
    beam = ft.Beam((0, 0, 30 * mm), (0, 0, -1), (0, 1, 0), (5 * mm, 5 * mm), (rays, rays))
    ccd = ft.CCD((0, 0, place), (0, 0, -1), (0, 1, 0), 0.5 * mm / pixels, (pixels, pixels))
    nodes, weights = np.polynomial.legendre.leggauss(12)
    x = ((np.arange(pixels)[:, None] + 0.5 + 0.5 * nodes).ravel() - 0.5 * pixels) * ccd.pitch
    rho, depth = np.hypot(x, x[:, None]), focal - place
    angle = np.arctan2(rho, depth)
    grow = focal / np.cos(angle / 2) ** 2 * depth / (rho**2 + depth**2)
    bright = 2 * focal * np.tan(angle / 2) / rho * grow
    field = -(bright**power) * wave(30 * mm + focal - np.hypot(rho, depth))
    field = field.reshape(pixels, 12, pixels, 12)
    mean = np.einsum("iajb,a,b->ij", field, weights / 2, weights / 2)
    return arrivals.reflected(beam, ccd, arrivals.paraboloid(focal)), mean


def sampling_wavefront(place: float) -> Iterator[Row]:
    """Wavefront method: a spherical wave, 30 or 5 mm before its focus."""
    for rays in (8, 12, 16, 24, 32):
        finest = 2 * rays if rays < FEWEST else rays
        grids = [sphere(n, place)[0] for n in (finest, finest // 2, finest // 4)]
        paths, mean = sphere(rays, place)
        truth = off(ft.complex_field(paths, HENE, "wavefront"), mean)
        estimate = sampling_error(grids, HENE, math.log2(rays / finest))
        yield Row(f"{rays} x {rays} rays", truth, math.hypot(estimate, quadrature_error(paths, HENE)))


def sampling_counts(tilt: float) -> Iterator[Row]:
    """Ray sum: tilt fringes, a beam turned by 0.02 to the pixels."""
    for rays in (0.7, 0.93, 1.5, 3.7, 7.9):
        paths, mean, squeeze = fringes(tilt, 8 * um, 48, rays, turn=0.02)
        field = ft.complex_field(paths, HENE, "rays")
        # of what is off, the rest is that of pixels
        yield Row(
            f"{rays:g} rays a pixel",
            off(field, squeeze * mean),
            math.hypot(count_error(paths, HENE), offset_error(paths, HENE)),
        )


def sampling_sphere() -> Iterator[Row]:
    """Ray sum: a spherical wave, 30 mm before its focus, total of sampling and pixels."""
    for rays in (300, 700, 1500):
        paths, mean = sphere(rays, 20 * mm, pixels=96, power=1.0)
        field = ft.complex_field(paths, HENE, "rays")
        estimate = math.hypot(count_error(paths, HENE), offset_error(paths, HENE))
        yield Row(f"{rays * 0.1 / 0.6 / 96:.2g} rays a pixel", off(field, mean), estimate)


def pixels_rays(rays: int) -> Iterator[Row]:
    """Ray sum: tilt fringes on pixels of 8 um, 1 or 2 x 2 rays a pixel."""
    for tilt in (0.5e-3, 2e-3, 10e-3, 20e-3):
        paths, mean, squeeze = fringes(tilt, 8 * um, 48, rays)
        field = ft.complex_field(paths, HENE, "rays")
        cycles = math.sin(2 * tilt) * 8 * um / HENE
        yield Row(f"{cycles:.3f} fringes a pixel", off(field, squeeze * mean), offset_error(paths, HENE))


def pixels_wavefront() -> Iterator[Row]:
    """Wavefront method: tilt fringes."""
    for tilt, pitch in ((2e-3, 3.45 * um), (20e-3, 8 * um), (30e-3, 8 * um), (30e-3, 80 * um)):
        beam = ft.Beam((0, 0, 0.1), (0, 0, -1), (0, 1, 0), (20 * mm, 4 * mm), (6, 24))
        ccd = ft.CCD((0, 0, 0.05), (0, 0, -1), (0, 1, 0), pitch, (4, 96))
        paths = arrivals.reflected(beam, ccd, arrivals.plane(tilt))
        x = (np.arange(96) - 47.5) * pitch
        path = 0.1 + 0.05 * math.cos(2 * tilt) + x * math.sin(2 * tilt)
        cycles = math.sin(2 * tilt) * pitch / HENE
        mean = np.tile(-math.sqrt(math.cos(2 * tilt)) * np.sinc(cycles) * wave(path), (4, 1))
        field = ft.complex_field(paths, HENE, "wavefront")
        yield Row(f"{cycles:.2g} fringes a pixel", off(field, mean), quadrature_error(paths, HENE))


def terrain() -> Iterator[Row]:
    """The demo's relief in a Michelson by the ray sum: total less facets, against 64 rays a pixel."""
    heights, pitch = ft.meshes.elevation_sample(2e-6, 8e-3)
    mesh = shapes.height_map(heights[::2, ::2], 2.0 * pitch)
    mesh = mesh.moved((0, 0, -mesh.bounds[1, 2]))
    for pixels in (64, 128):
        fine, coarse = (
            instruments.michelson(mesh, aperture=6e-3, pixels=(pixels, pixels), rays=n).trace()
            for n in (8, 1)
        )
        costs = budget(coarse, HENE, "rays")
        truth = off(ft.complex_field(coarse, HENE, "rays"), ft.complex_field(fine, HENE, "rays"))
        yield Row(f"{pixels} x {pixels} pixels", truth, math.hypot(costs.sampling, costs.pixels))


CASES: dict[str, tuple[str, str, Callable[[], Iterator[Row]]]] = {
    "plate at a flat angle": ("hit", "mpmath", hit_grazing),
    "between plates": ("hit", "mpmath", hit_plates),
    "corner cube off the origin": ("hit", "mpmath", hit_far),
    "paraboloid, its form": ("hit", "closed form", hit_form),
    "paraboloid, near it": ("facets", "closed form", lambda: facets_paraboloid(0.02)),
    "paraboloid, .4 f away": ("facets", "closed form", lambda: facets_paraboloid(0.4)),
    "paraboloid, .9 f away": ("facets", "closed form", lambda: facets_paraboloid(0.9)),
    "hollow in a Michelson": ("facets", "its form", facets_bench),
    "ball through a relay": ("facets", "closed form", facets_ball),
    "rod through a relay": ("facets", "closed form", facets_rod),
    "spherical wave, 30 mm before its focus, wavefront": (
        "sampling + pixels", "closed form", lambda: sampling_wavefront(20 * mm)
    ),
    "spherical wave, 5 mm before its focus, wavefront": (
        "sampling + pixels", "closed form", lambda: sampling_wavefront(45 * mm)
    ),
    "plane wave across the CCD, rays": ("sampling", "closed form", lambda: sampling_counts(0.0)),
    "tilt fringes, 0.13 a pixel, rays": ("sampling + pixels", "sinc", lambda: sampling_counts(5e-3)),
    "spherical wave, rays": ("sampling + pixels", "closed form", sampling_sphere),
    "tilt fringes, 1 ray a pixel": ("pixels", "sinc", lambda: pixels_rays(1)),
    "tilt fringes, 4 rays a pixel": ("pixels", "sinc", lambda: pixels_rays(2)),
    "tilt fringes, wavefront": ("pixels", "sinc", pixels_wavefront),
    "relief of the demo, 1 ray a pixel": ("sampling + pixels", "64 rays a pixel", terrain),
}  # fmt: skip


def table() -> str:
    """All cases as a Markdown table."""
    lines = ["| term | scene | truth by | size | true | estimated | ratio |", "|---|---|---|---|---|---|---|"]
    for name, (term, truth, case) in CASES.items():
        for row in case():
            numbers = f"{row.truth:.1e} | {row.estimate:.1e} | {row.ratio:.2f}"
            lines.append(f"| {term} | {name} | {truth} | {row.size} | {numbers} |")
            print(lines[-1], flush=True)
    return "\n".join(lines)


def main() -> None:
    """Print the table; write it into its page if asked to."""
    text = table()
    if "--write" in sys.argv[1:]:
        pages.write("budget", text, pages.BUDGET)


if __name__ == "__main__":
    main()
