"""What each skip saves: the same work with it and without it, timed in turn in one run.

python benchmarks/skips.py [--side 512]   print the table
python benchmarks/skips.py --write        and write its section of docs/accuracy.md

The library has no switches: a skip is taken away from outside, or the scene is put so that it does not
apply although it might.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from unittest.mock import patch

import numpy as np
import scenes

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.tracing.batch import part
from fringetrace.tracing.intersect.embree import build

sys.path.insert(0, str(Path(__file__).parents[1] / "docs" / "figures"))
import pages

WAVE = 633 * nm
ROUNDS = 5
# Columns of paths that a skip might change.
COLUMNS = ("ray", "fate", "bounces", "length", "origin", "direction", "amplitude", "key")


@dataclass(frozen=True)
class Skip:
    """A rule that leaves work out.

    `on` and `off` do the same work with it and without it; both return arrays to be compared.
    """

    name: str
    scene: str
    on: Callable[[], list[np.ndarray]]
    off: Callable[[], list[np.ndarray]]


def columns(paths: ft.Paths) -> list[np.ndarray]:
    """What there is to compare of paths."""
    return [getattr(paths, name) for name in COLUMNS]


ENGINE = "tracing.intersect.embree"


@contextlib.contextmanager
def swapped(name: str, wrap: Callable, *modules: str) -> Iterator[None]:
    """Wrap a function of that name in all of some modules that have it."""
    there = [import_module(f"fringetrace.{module}") for module in modules]
    there = [module for module in there if hasattr(module, name)]
    if not there:
        raise LookupError(f"skips: expected {name} in one of {', '.join(modules)}, got none")
    with contextlib.ExitStack() as stack:
        for module in there:
            stack.enter_context(patch.object(module, name, wrap(getattr(module, name))))
        yield


def without(work: Callable, name: str, wrap: Callable, *modules: str) -> Callable:
    """Work that is done with a function wrapped."""

    def off() -> list[np.ndarray]:
        with swapped(name, wrap, *modules):
            return work()

    return off


def altered(scene: ft.Scene, change: Callable) -> ft.Scene:
    """A scene whose bodies are changed."""
    other = ft.Scene(scene.surfaces)
    engine = build(other)
    bodies = tuple(change(body) for body in engine.bodies)
    object.__setattr__(engine, "bodies", bodies)
    return other


def tracing(scene: ft.Scene, beam: ft.Beam, ccd: ft.CCD | None = None) -> Callable:
    """A trace on one thread, to be called."""
    return lambda: columns(ft.trace(scene, beam, ccd, threads=1, warn=False))


def rods(side: int, open_: bool = False) -> tuple[ft.Scene, ft.Beam]:
    """The rods of `scenes`, with or without the box around them."""
    scene, beam = scenes.rods()
    if open_:
        lattice = ft.shapes.rod_lattice(20, 4, 65e-9, 280e-9, 2e-6)
        lattice = lattice.moved(-lattice.bounds.mean(axis=0))
        scene = ft.Scene([ft.Surface(lattice, ft.Mirror())])
    return scene, replace(beam, shape=(side, side))


def shut(side: int) -> Skip:
    """Behind a shutter no light of the reference is traced; the sample's is what it was."""
    flat = ft.shapes.plate(16 * mm, 16 * mm)
    bench = ft.instruments.michelson(
        flat, aperture=6 * mm, pixels=(side, side), reference_tilt=(2e-5, 0.0), method="rays"
    )
    bench.trace(threads=1)  # builds what belongs to the scene
    blocked = bench.shut("reference")
    blocked.trace(threads=1)

    def sample(one: ft.instruments.Interferometer) -> Callable:
        def found() -> list[np.ndarray]:
            fresh = replace(one)
            fresh.trace(threads=1)
            return [fresh.fields(WAVE)[0]]

        return found

    return Skip("an arm behind a shutter is not traced", "Michelson", sample(blocked), sample(bench))


def only_mirrors(side: int) -> Skip:
    """One real pass over the rays a bounce, without amplitudes."""
    work = tracing(*rods(side))

    def general() -> list[np.ndarray]:
        with patch("fringetrace.tracing.plan.Plan.mirrors", False):
            return work()

    return Skip("only ideal mirrors: no amplitudes, one pass a bounce", "80 rods in a box", work, general)


def in_place(side: int) -> Skip:
    """No splitter: each ray has its row from the start."""
    scene, beam = rods(side)

    def chunks() -> list[np.ndarray]:
        return columns(ft.tracing.join(list(ft.stream(scene, beam, threads=1))))

    return Skip(
        "no ray splits: ends are written in their rows", "80 rods in a box", tracing(scene, beam), chunks
    )


def culled(side: int) -> Skip:
    """Rays that pass a surface's box, or leave a plane, are not asked."""
    bench = scenes.michelson(side)
    work = tracing(bench.scene, bench.beam, bench.ccd)
    all_ = without(
        work, "aim", lambda aim: lambda *a, **k: aim(*a, **{**k, "cull": False}), "tracing.intersect.embree"
    )
    return Skip("rays that miss all boxes, or leave a plane, are not asked", "Michelson", work, all_)


def closed(side: int) -> Skip:
    """In a closed body a miss, or a hit from behind, is wrong: no second opinions on the rest."""
    scene, beam = rods(side)
    doubting = altered(scene, lambda body: replace(body, closed=False))
    return Skip(
        "closed bodies: a miss tells itself",
        "80 rods in a box",
        tracing(scene, beam),
        tracing(doubting, beam),
    )


class Undecided:
    """Stands for Embree, and knows nothing."""

    def run(self, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """No triangle is sure."""
        return np.full(len(origin), -2, dtype=np.int32)


def undecided(body):
    """A body all of whose hits are decided by the float64 tree."""
    other = replace(body)
    vars(other)["embree"] = Undecided()
    return other


def doubted(side: int) -> Skip:
    """The exact test, only where float32 is in doubt."""
    scene, beam = rods(side)
    exact = tracing(altered(scene, undecided), beam)
    return Skip(
        "exact decisions only where float32 is in doubt", "80 rods in a box", tracing(scene, beam), exact
    )


def dropped(side: int) -> Skip:
    """Rays that have ended leave the batch; without, as many are asked in each pass as were launched."""
    scene, beam = rods(side, open_=True)
    scene = ft.Scene(
        [*scene.surfaces, ft.Surface(ft.shapes.plate(1e-9, 1e-9).moved((0, 0, -1)), ft.Mirror())]
    )

    def asked(find: Callable) -> Callable:
        first: list = []

        def again(engine, batch, rows, hits, passed=frozenset(), medium=None):
            if not (batch.bounces[:rows] == 0).all():
                finished = first[0] - rows
                if finished:
                    idle = part(first[1], slice(0, finished))
                    find(engine, idle, finished, type(hits).blank(finished), passed, medium)
            else:
                kept = {name: column[:rows].copy() for name, column in batch._asdict().items()}
                first[:] = [rows, type(batch)(**kept)]
            return find(engine, batch, rows, hits, passed, medium)

        return again

    work = tracing(scene, beam)
    return Skip(
        "finished rays leave the batch",
        "80 rods, open",
        work,
        without(work, "find", asked, ENGINE),
    )


def unrecorded(side: int) -> Skip:
    """Polylines only when asked for."""
    scene, beam = rods(side)

    def recorded() -> list[np.ndarray]:
        return columns(ft.trace(scene, beam, threads=1, record=True, warn=False))

    return Skip("polylines only when asked for", "80 rods in a box", tracing(scene, beam), recorded)


def uniform(side: int) -> Skip:
    """A uniform beam brings no amplitudes along."""
    scene = ft.Scene([ft.Surface(ft.shapes.plate(2.0, 2.0), ft.Mirror())])
    beam = ft.Beam((0, 0, 1), (0, 0, -1), (0, 1, 0), (1, 1), (side, side))
    ones = replace(beam, profile=lambda x, y: np.ones_like(x))
    return Skip("uniform beams without amplitudes", "one mirror", tracing(scene, beam), tracing(scene, ones))


def rephased(side: int) -> Skip:
    """Another wavelength without another trace."""
    bench = scenes.michelson(side)
    paths = ft.trace(bench.scene, bench.beam, bench.ccd, threads=1)

    def traced() -> list[np.ndarray]:
        return [ft.complex_field(ft.trace(bench.scene, bench.beam, bench.ccd, threads=1), WAVE, "rays")]

    return Skip(
        "another wavelength from the same paths", "Michelson",
        lambda: [ft.complex_field(paths, WAVE, "rays")], traced,
    )  # fmt: skip


def stepped(side: int) -> Skip:
    """Phase steps without another trace or sum."""
    flat = ft.shapes.plate(16 * mm, 16 * mm)

    def tilted(piston: float = 0.0) -> ft.instruments.Interferometer:
        return ft.instruments.michelson(
            flat, aperture=6 * mm, pixels=(side, side), reference_tilt=(2e-5, 0.0), piston=piston
        )

    def once() -> list[np.ndarray]:
        return list(tilted().phase_steps(WAVE, 4))

    def moved() -> list[np.ndarray]:
        # 2 piston is the path that a step adds
        return [tilted(0.125 * WAVE * k).phase_steps(WAVE, 4)[0] for k in range(4)]

    return Skip("four phase steps from the same fields", "Michelson", once, moved)


def differences(side: int) -> Skip:
    """Irradiance needs the fringes between waves resolved, not the waves themselves."""
    tilt, pixels = 20e-3, max(8, side // 4)
    flat = ft.shapes.plate(16 * mm, 16 * mm)
    turn = ft.vectors.rotation((0, 1, 0), tilt)
    bench = ft.instruments.michelson(
        flat.moved(turn=turn), aperture=6 * mm, pixels=(pixels, pixels), reference_tilt=(tilt, 0.0)
    )
    paths = ft.trace(bench.scene, replace(bench.beam, shape=(12, 12)), bench.ccd, warn=False)

    def image() -> list[np.ndarray]:
        return [ft.irradiance(paths, WAVE, "wavefront")]

    names = ("wavefront.patches", "wavefront.plane_waves", "coherent_sum", "pixel_quadrature")
    files = [f"field.{name}" for name in names]
    carrier = without(
        image,
        "fringes",
        lambda real: lambda slope, _: real(slope, True),
        *files,
    )
    return Skip("irradiance: sampled for fringes, not for the carrier", "tilted flats", image, carrier)


def imported(side: int) -> Skip:
    """Heavy libraries at first use."""
    heavy = "trimesh, prysm, skimage.restoration, xarray, tifffile, matplotlib.figure, pyvista, rich.console"

    def fresh(line: str) -> Callable:
        def run() -> list[np.ndarray]:
            subprocess.run([sys.executable, "-c", line], check=True)
            return []

        return run

    return Skip(
        "heavy libraries are imported at first use", "`import fringetrace`",
        fresh("import fringetrace"), fresh(f"import fringetrace, {heavy}"),
    )  # fmt: skip


def even(side: int) -> Skip:
    """Where light is even, its value at the centre of a pixel and its curvature give the mean."""
    focal, z, pixels = 50 * mm, 20 * mm, max(16, side)
    x = np.linspace(-3 * mm, 3 * mm, 65)
    mesh = ft.shapes.height_map((x[:, None] ** 2 + x**2) / (4 * focal), x[1] - x[0])
    form = ft.forms.Conic((0, 0, 0), (0, 0, 1), 2 * focal, -1.0)
    beam = ft.Beam((0, 0, 30 * mm), (0, 0, -1), (0, 1, 0), (3.6 * mm, 3.6 * mm), (24, 24))
    ccd = ft.CCD((0, 0, z), (0, 0, -1), (0, 1, 0), 2 * mm / pixels, (pixels, pixels))
    paths = ft.trace(ft.Scene([ft.Surface(mesh, ft.Mirror(), form=form)]), beam, ccd)

    def image() -> list[np.ndarray]:
        return [ft.irradiance(paths, WAVE)]

    def never(_: Callable) -> Callable:
        return lambda bend, values: np.zeros(values.shape[-2:], dtype=bool)

    sampled = without(image, "_small", never, "field.pixel_quadrature")
    return Skip("one sample a pixel where light is even", "paraboloid with form", image, sampled)


def unreached(side: int) -> Skip:
    """Trees are built for the bodies that rays get near to."""
    ball = ft.shapes.icosphere(1 * mm, 7).moved((1.0, 0.0, 0.0))
    plate = ft.shapes.plate(8 * mm, 8 * mm)
    surfaces = [ft.Surface(plate, ft.Mirror(), name="plate"), ft.Surface(ball, ft.Mirror(), name="ball")]
    beam = ft.Beam((0, 0, 20 * mm), (0, 0, -1), (0, 1, 0), (4 * mm, 4 * mm), (side, side))

    def fresh() -> list[np.ndarray]:
        return columns(ft.trace(ft.Scene(surfaces), beam, threads=1, warn=False))

    def built() -> list[np.ndarray]:
        scene = ft.Scene(surfaces)
        for body in build(scene).bodies:
            body.prepare()
        return columns(ft.trace(scene, beam, threads=1, warn=False))

    return Skip("bodies that no ray gets near are not built", "a ball beside a plate", fresh, built)


def slab(side: int, index: complex = 1.5, jones: tuple | None = None) -> Callable:
    """A glass plate, traced at an angle."""
    plate = ft.shapes.plate(8 * mm, 8 * mm)
    back = plate.moved((0, 0, -1 * mm), ft.vectors.rotation((0, 1, 0), math.pi))
    scene = ft.Scene([ft.Surface(side_, ft.Dielectric(), back=index) for side_ in (plate, back)])
    turn = ft.vectors.rotation((1, 0, 0), 0.3)
    way = turn @ (0, 0, -1.0)
    beam = ft.Beam(
        -5 * mm * way, way, (1, 0, 0), (2 * mm, 2 * mm), (side // 2, side // 2), polarisation=jones
    )
    return lambda: columns(ft.trace(scene, beam, wavelength=WAVE, threads=1, warn=False))


def scalar(side: int) -> Skip:
    """Light without polarisation carries one number."""
    work = slab(side)

    def numbers() -> list[np.ndarray]:
        *rest, amplitude, key = work()
        # that of vectors is their size
        return [*rest, np.abs(amplitude).astype(complex), key]

    s_light = (0.0, 1.0)
    return Skip(
        "light without polarisation: one number a ray", "glass plate", numbers, slab(side, jones=s_light)
    )


def transparent(side: int) -> Skip:
    """Where no medium absorbs no complex wave vectors are carried."""
    return Skip("transparent media: real wave vectors", "glass plate", slab(side), slab(side, 1.5 + 1e-300j))


def vacuum(side: int) -> Skip:
    """Scenes of mirrors know no media."""
    scene, beam = rods(side)
    immersed = ft.Scene(scene.surfaces, medium=ft.materials.constant(1.0 + 1e-300j))

    def through() -> list[np.ndarray]:
        return columns(ft.trace(immersed, beam, wavelength=WAVE, threads=1, warn=False))

    return Skip("mirrors in a vacuum: no media", "80 rods in a box", tracing(scene, beam), through)


def extruded(side: int) -> Skip:
    """A sheet off an extruded scene is swept from one row of rays."""
    outline = np.array([[-4, 0], [-1, 0], [-1, 0.0004], [1, 0.0004], [1, 0], [4, 0]]) * mm
    mesh = ft.shapes.extrude(outline, 8 * mm)
    scene = ft.Scene([ft.Surface(mesh, ft.Mirror())])
    size = (6 * mm, 6 * mm)
    ccd = ft.CCD((0, 0, 20 * mm), (0, 0, -1), (0, 1, 0), 5 * mm / 64, (64, 64))

    def image(rows: int) -> Callable:
        beam = ft.Beam((0, 0, 10 * mm), (0, 0, -1), (0, 1, 0), size, (rows, 64))
        return lambda: [ft.irradiance(ft.trace(scene, beam, ccd, threads=1, warn=False), WAVE, "wavefront")]

    return Skip("extruded scene: one row of rays, swept", "a step", image(1), image(64))


def observed(side: int) -> Skip:
    """The rays of one incidence serve all directions that are observed."""
    lattice = ft.scattering.RodLattice(10, 4)
    theta = np.radians(np.arange(-60, 61, 20))
    waves = np.linspace(400, 700, 16) * nm
    given = {"rays": (1, 16 * side), "threads": 1}

    def seen(angles: np.ndarray) -> np.ndarray:
        cones = ft.scattering.Cones(angles, math.radians(2.0))
        return ft.scattering.brdf(lattice.scene, theta, cones, waves, **given).values

    def apart() -> list[np.ndarray]:
        return [np.concatenate([seen(theta[i : i + 1]) for i in range(len(theta))], axis=2)]

    return Skip(
        "goniometer: one trace an incidence for all directions", "40 rods", lambda: [seen(theta)], apart
    )


SKIPS: dict[str, Callable[[int], Skip]] = {
    case.__name__: case
    for case in (
        shut, only_mirrors, in_place, culled, closed, doubted, dropped, unrecorded, uniform, rephased,
        stepped, differences, even, unreached, scalar, transparent, vacuum, extruded,
        observed, imported,
    )
}  # fmt: skip


def same(one: list[np.ndarray], other: list[np.ndarray]) -> str:
    """How alike two results are: to the bit, or by how much, relative to the root of the mean square."""
    if all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, other, strict=True)):
        return "to the bit" if one else ""
    worst = 0.0
    for a, b in zip(one, other, strict=True):
        if a.shape != b.shape or (a.dtype.kind in "iu" and (a != b).any()):
            return "no"
        scale = math.sqrt(np.mean(np.abs(b) ** 2)) if a.dtype.kind in "fc" else 0.0
        if scale:
            worst = max(worst, math.sqrt(np.mean(np.abs(a - b) ** 2)) / scale)
    return f"to {worst:.0e} rms"


def measured(case: Skip, rounds: int = ROUNDS) -> tuple[float, float, str]:
    """Median seconds with and without a skip, taken in turn, and how alike the results are."""
    alike = same(case.on(), case.off())
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(rounds):
        for work, seconds in zip((case.on, case.off), times, strict=True):
            begin = time.perf_counter()
            work()
            seconds.append(time.perf_counter() - begin)
    on, off = (statistics.median(seconds) for seconds in times)
    return on, off, alike


SECTION = """## Savings of each skip

Each row compares the same work with and without one skip, on one thread: medians of {rounds} alternating
runs, {rays} rays, made by `benchmarks/skips.py --write`.

Visibility rays are never traced: rays of the beam itself locate shadows where wavefronts end. For a
reciprocal BRDF, `reciprocal=True` sums half of the table (ray sums are reciprocal only as far as their rays
sample the sample: no row here).

"""


def table(side: int, rounds: int = ROUNDS) -> str:
    """All skips as a Markdown table."""
    lines = [
        "| skip | scene | on, s | off, s | same results | off / on |",
        "|---|---|---|---|---|---|",
    ]
    for case in (make(side) for make in SKIPS.values()):
        on, off, alike = measured(case, rounds)
        lines.append(f"| {case.name} | {case.scene} | {on:.3f} | {off:.3f} | {alike} | {off / on:.2f} |")
        print(lines[-1], flush=True)
    return "\n".join(lines)


def main() -> None:
    """Print the table; write the section if asked to."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--side", type=int, default=512, help="rays along either side of a beam")
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--write", action="store_true")
    chosen = parser.parse_args()
    text = table(chosen.side, chosen.rounds)
    if chosen.write:
        pages.write("skips", SECTION.format(rounds=chosen.rounds, rays=f"{chosen.side**2:,}") + text)


if __name__ == "__main__":
    main()
