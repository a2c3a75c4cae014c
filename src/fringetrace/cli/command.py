"""Command line: mesh or scene file to interferogram, frames, height map, data file and pictures."""

from __future__ import annotations

import contextlib
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from cyclopts import App, CycloptsError, Parameter

import fringetrace
from fringetrace.cli import brdf_commands, scene_commands
from fringetrace.core import (
    Array,
    FloatArray,
    FringetraceWarning,
    checked_wavelength,
    length_text,
    parse_angle,
    parse_length,
    staged,
)
from fringetrace.geometry import Mesh

if TYPE_CHECKING:
    from rich.console import Console

    from fringetrace.instruments import Interferometer
    from fringetrace.tracing import Paths
    from fringetrace.validation import Measurement

app = App(
    name="fringetrace",
    version=fringetrace.__version__,
    help="Triangle meshes to full-field interferograms, with a phase you can trust.",
    default_parameter=Parameter(consume_multiple=True, negative_iterable=()),
)
app.command(brdf_commands.brdf)
app.command(brdf_commands.lattice)
app.command(scene_commands.run)
app.command(scene_commands.init)
app.command(scene_commands.view)

FRINGES = 10.0
# The demo's relief and aperture: slopes that 512 pixels still resolve.
RELIEF, APERTURE = 2e-6, 8e-3
# Seen from above, a mesh whose sides differ by more than this stands upright.
UPRIGHT = 1e-9
# Work that is done sooner needs no progress bar, seconds.
PATIENCE = 1.0
FAILURE, INTERRUPTED = 2, 130


@Parameter(name="*")
@dataclass(frozen=True)
class Settings:
    """Options that `interferogram` and `demo` share.

    Parameters
    ----------
    wavelength
        Vacuum wavelength, a number and a unit.
    pixels
        Pixels along the longer side of the image; the other side follows from the sample's shape.
    rays
        Rays a pixel along either axis: 2 traces four rays a pixel, 0.125 one in 8 x 8 pixels.
    steps
        Phase steps over one period, at least 3.
    tilt
        Tilt of the reference mirror along x, such as "200 urad". Default: ten fringes across.
    threads
        Default: one for each core.
    picture
        Draw the scene in 3D (scene.png); this needs OpenGL libraries.
    zygo
        Leave the measured height as a file of Zygo's, too: dat (MetroPro: height.dat), datx (Mx:
        height.datx), or both.
    """

    wavelength: str = "632.8 nm"
    pixels: int = 512
    rays: float = 1
    steps: int = 4
    tilt: str | None = None
    threads: int | None = None
    picture: bool = True
    zygo: tuple[str, ...] = ()


@app.command
def interferogram(
    mesh: Path,
    /,
    *,
    unit: str | None = None,
    out: Path | None = None,
    aperture: str | None = None,
    settings: Settings = Settings(),
) -> None:
    """Interferogram of a mesh (or a measured height map) in a Michelson interferometer.

    The mesh lies with its heights along z, towards the light. Its lateral centre is moved onto
    the optical axis and its highest point to z = 0, the plane that the camera is focused on.
    Phase-stepped frames give the height map back, which is compared with the mesh.

    Written to the folder OUT: interferogram.png, interferogram.tif and frames.tif (16 bits, as
    a camera would), height.png (height, and its difference from the mesh), result.nc
    (everything, labelled, NetCDF), scene.png (surfaces and rays).

    Parameters
    ----------
    mesh
        STL, PLY, OBJ or GLB file; or a height map of Zygo's, MetroPro .dat or Mx .datx.
    unit
        Unit of the numbers in the mesh file: nm, um, mm, m, ... Zygo's files know their own.
    out
        Folder to write to. Default: fringetrace-NAME, after the mesh, in this folder.
    aperture
        Longer side of the image, such as "8 mm". Default: that of the mesh.
    """
    from fringetrace.geometry import meshes

    sample = meshes.load(mesh, unit=unit)
    width = None if aperture is None else parse_length(aperture, "--aperture")
    _run(sample, f"{mesh.name}", Path(f"fringetrace-{mesh.stem}") if out is None else out, width, settings)


@app.command
def demo(
    *,
    out: Path = Path("fringetrace-demo"),
    settings: Settings = Settings(),
) -> None:
    """Demonstrate the whole chain on matplotlib's elevation sample, scaled to a few wavelengths.

    Every second sample of the map (Jacksboro fault, Tennessee; 840 m of relief over 30 km) becomes
    a mirror of 8 mm with 2 um of relief, measured and written as by `fringetrace interferogram`.

    Parameters
    ----------
    out
        Folder to write to.
    """
    from fringetrace.geometry import height_map, meshes

    z, pitch = meshes.elevation_sample(RELIEF, APERTURE)
    name = (
        f"matplotlib's elevation map, {z.shape[0]} x {z.shape[1]}, every second sample, relief scaled to "
        f"{1e6 * RELIEF:g} um"
    )
    _run(height_map(z[::2, ::2], 2.0 * pitch, name="elevation map"), name, out, None, settings)


@app.command
def bench(
    *,
    out: Path = Path("fringetrace-bench"),
    quick: bool = False,
    scenes: tuple[str, ...] = (),
) -> None:
    """Benchmark run time against error on this machine, on scenes with closed-form fields.

    The ray sum and the wavefront method, with facets and with the exact surface behind them, and a
    tracer in float32 throughout, each with more and more rays: two minutes, or twenty seconds if
    quick. Written to the folder OUT: work_precision.png, work_precision.json.

    Parameters
    ----------
    out
        Folder to write to.
    quick
        Fewer pixels and rays.
    scenes
        Some of paraboloid, sphere, newton, tilt, step, valley, corner_cube. Default: all.
    """
    from fringetrace.validation import STANDARDS, work_precision

    names = work_precision.checked_standards(scenes or STANDARDS)
    with staged(out) as folder, _progress("running") as advance:
        done = list(work_precision.runs(names, quick, advance))
        work_precision.write(done, folder)
    console = _console()
    console.print(work_precision.markdown_table(done), markup=False)
    _say(console, "written", f"{out}: {', '.join(work_precision.FILES)}")


def _run(mesh: Mesh, name: str, out: Path, aperture: float | None, settings: Settings) -> None:
    """Trace, measure, write; say what was done."""
    from fringetrace.accuracy import judge
    from fringetrace.field import choose
    from fringetrace.validation import measurement
    from fringetrace.views import viewer

    console = _console()
    wavelength = checked_wavelength(parse_length(settings.wavelength, "--wavelength"))
    bench, centre = _bench(mesh, aperture, wavelength, settings)
    with staged(out) as folder, ThreadPoolExecutor(2) as aside, warnings.catch_warnings():
        warnings.simplefilter("ignore", FringetraceWarning)  # they are said as notes
        _say_bench(console, name, mesh, bench, wavelength)
        scene = None
        if settings.picture:
            few = aside.submit(bench.sampled, viewer.few(bench.beam.shape))
            scene = aside.submit(_draw, bench, few.result, folder)
            few.result()  # before the trace, which needs the same trees
        with _progress("tracing") as advance:
            start = time.perf_counter()
            bench.trace(progress=advance, threads=settings.threads)
            seconds = time.perf_counter() - start
        choice = choose(bench.trace(), bench.method)
        _say(console, "method", str(choice))
        # what is averaged over pixels is compared with a mean
        parts = 1 if choice.method == "rays" else 2
        truth = aside.submit(measurement.heights, mesh, bench.ccd.shape, bench.ccd.pitch, centre, parts)
        costing = aside.submit(judge, bench.trace(), wavelength, choice.method)
        measured = measurement.measure_height(bench, truth.result(), wavelength, settings.steps)
        _say_result(console, bench, measured, seconds)
        measurement.write_camera(measured, folder)
        measurement.write_pictures(measured, folder)
        measurement.write_measurement(measured, folder / "result.nc")
        measurement.write_heights(measured, folder, settings.zygo)
        costs, notes = costing.result()
        _say(console, "budget", f"of the image: {costs.line}")
        for note in notes.values():
            _say(console, "note", note)
        missing = None if scene is None else scene.result()
        files = sorted(file.name for file in folder.iterdir())
    if missing is not None:
        _say(console, "no scene.png", missing)
    _say(console, "written", f"{out}: {', '.join(files)}")


def _bench(
    mesh: Mesh, aperture: float | None, wavelength: float, settings: Settings
) -> tuple[Interferometer, FloatArray]:
    """The bench with the sample centred on its axis, and the point (3,) of the sample that is moved to 0."""
    from fringetrace import instruments

    if settings.steps < 3:
        raise ValueError(f"--steps: expected at least 3, got {settings.steps}")
    if wrong := set(settings.zygo) - {"dat", "datx"}:
        raise ValueError(f"--zygo: expected dat or datx, got {wrong.pop()!r}")
    if settings.pixels < 1:
        raise ValueError(f"--pixels: expected at least 1, got {settings.pixels}")
    low, high = mesh.bounds
    sides = (high - low)[1::-1]
    if not sides.min() > UPRIGHT * sides.max():
        raise ValueError(f"{mesh.name}: expected a surface across z, got {sides[1]:g} m x {sides[0]:g} m")
    if aperture is not None and not aperture > 0.0:
        raise ValueError(f"--aperture: expected a positive length, got {aperture:g} m")
    rows, columns = (max(1, round(settings.pixels * side / sides.max())) for side in sides)
    width = (sides.max() if aperture is None else aperture) * columns / settings.pixels
    tilt = min(FRINGES * wavelength / (2.0 * width), 0.5 * instruments.TILT)
    if settings.tilt is not None:
        tilt = parse_angle(settings.tilt, "--tilt")
    top = np.array([*0.5 * (low + high)[:2], high[2]])
    bench = instruments.michelson(
        mesh.moved(-top),
        aperture=width,
        reference_tilt=(tilt, 0.0),
        pixels=(rows, columns),
        rays=settings.rays,
    )
    return bench, top


def _draw(bench: Interferometer, paths: Callable[[], Paths], folder: Path) -> str | None:
    """scene.png, or why there is none."""
    from fringetrace import views

    try:
        views.picture(bench.scene, paths, folder / "scene.png", relief=bench.scene.surfaces[1].name)
    except RuntimeError as error:
        return str(error)
    return None


@contextlib.contextmanager
def _progress(what: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on standard error, if that is a terminal, once the work has taken a second."""
    from rich.console import Console

    console = Console(stderr=True)
    start, bars = time.monotonic(), contextlib.ExitStack()
    shown: list[Callable[[int, int], None]] = []

    def advance(done: int, total: int) -> None:
        if not shown and console.is_terminal and done < total and time.monotonic() - start > PATIENCE:
            from rich.progress import Progress

            bar = bars.enter_context(Progress(console=console, transient=True))
            task = bar.add_task(what)
            shown.append(lambda done, total: bar.update(task, completed=done, total=total))
        for show in shown:
            show(done, total)

    with bars:
        yield advance


def _say(console: Console, what: str, text: str) -> None:
    console.print(f"{what:<12} {text}", markup=False)


def _console() -> Console:
    from rich.console import Console

    return Console(highlight=False, soft_wrap=True)


def _say_bench(console: Console, name: str, mesh: Mesh, bench: Interferometer, wavelength: float) -> None:
    from fringetrace.instruments import path_slope

    rows, columns = bench.ccd.shape
    width, height = bench.ccd.size
    moved = "lateral centre moved onto the axis, highest point to z = 0"
    _say(console, "sample", f"{name}: {len(mesh.faces):,} triangles; {moved}")
    fringes = path_slope(bench.arms.tilt)[0] * width / wavelength
    _say(
        console,
        "bench",
        f"Michelson, {length_text(wavelength)}, image {length_text(width)} x {length_text(height)}, "
        f"{columns} x {rows} pixels of {length_text(bench.ccd.pitch)}; "
        f"reference tilted by {bench.arms.tilt[0] * 1e6:.4g} urad: {fringes:.3g} fringes across",
    )


def _say_result(console: Console, bench: Interferometer, measured: Measurement, seconds: float) -> None:
    paths, power = bench.trace(), measured.ledger
    rays = bench.beam.shape[0] * bench.beam.shape[1]
    _say(
        console,
        "traced",
        f"{rays:,} rays, {paths.segments:,} segments, at most {paths.bounces.max()} bounces, {len(paths):,} "
        f"path ends in {seconds:.2f} s: {rays / seconds:,.0f} rays/s",
    )
    shares = ", ".join(
        f"{item} {getattr(power, item) / power.incident:.4%}"
        for item in ("detected", "left", "absorbed", "truncated")
    )
    _say(console, "power", f"{shares}; unaccounted for {power.error:.1e} of the incident")
    valid, smooth = np.isfinite(measured.residual), measured.smooth
    _say(
        console,
        "height",
        f"differs from the mesh by {_rms(measured, valid)} over {valid.mean():.1%} of the pixels, "
        f"{_rms(measured, valid & smooth)} away from steps (over {(valid & smooth).mean():.1%})",
    )
    jumps = int((measured.orders[valid] != 0.0).sum())
    if jumps:
        _say(
            console,
            "note",
            f"pixels off by whole half wavelengths: {jumps:,}; steps of over a quarter of the wavelength "
            "between pixels cannot be told from smaller ones at one wavelength; but for these the height is "
            f"off by {_rms(measured, valid & smooth, True)} away from steps",
        )
    _say(
        console,
        "16 bits",
        f"65535 counts are an irradiance of {measured.full_scale:.6g} times the incident one",
    )


def _rms(measured: Measurement, where: Array, but_for_orders: bool = False) -> str:
    rms = measured.rms(where, but_for_orders)
    return f"{rms * 1e9:.3g} nm = {rms / measured.wavelength:.2g} waves rms"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Default: those of the process.

    Returns
    -------
    int
        0; 2 after an error, said in one line on standard error; 130 if interrupted.
    """
    try:
        command, bound, _ = app.parse_args(arguments, print_error=False, exit_on_error=False)
        for what, text in command(*bound.args, **bound.kwargs) or []:
            if what:
                _say(_console(), what, text)
            else:
                sys.stdout.write(text)
    except (CycloptsError, ValueError, OSError, RuntimeError, MemoryError) as error:
        text = " ".join(str(error).split()) or type(error).__name__
        sys.stderr.write(f"fringetrace: {text}\n")
        return FAILURE
    except KeyboardInterrupt:
        return INTERRUPTED
    return 0
