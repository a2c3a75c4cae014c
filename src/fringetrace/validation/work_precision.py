"""Work-precision benchmark: run time against error on reference scenes; table, figure and JSON."""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from fringetrace import views
from fringetrace.core import ComplexArray, FloatArray
from fringetrace.field import light_on
from fringetrace.scene import CCD, Beam, Scene
from fringetrace.tracing import Paths, trace
from fringetrace.validation import float32_tracer
from fringetrace.validation.standards import STANDARDS, WAVELENGTH, Standard, Truth

# A pixel without light knows no phase: it counts as any phase would on average, 1 / sqrt(12) of a wave.
ANY_PHASE = 12.0**-0.5
LIBRARIES = ("fringetrace", "numpy", "scipy", "numba", "embreex")
FILES = ("work_precision.json", "work_precision.png")

Tracer = Callable[[Scene, Beam, CCD], Paths]


@dataclass(frozen=True)
class Method:
    """Method from a scene to the field on its pixels.

    Attributes
    ----------
    name : str
    tracer : callable
        Paths from scene, beam and CCD.
    sum : {"rays", "wavefront"}
        See `complex_field`.
    form : bool
        Whether hits are moved onto the forms behind the facets.
    full, quick : tuple of int
        Rays along either side of the beam, in a full and in a quick bench.
    """

    name: str
    tracer: Tracer
    sum: str
    form: bool
    full: tuple[int, ...]
    quick: tuple[int, ...]

    def suits(self, standard: Standard) -> bool:
        """Whether the method applies: flat facets need no form."""
        return standard.curved or not self.form


METHODS = (
    Method(
        "float32, facets", float32_tracer.trace_float32, "rays", False, (64, 128, 256, 512, 800), (24, 48, 96)
    ),
    Method("rays, facets", trace, "rays", False, (64, 128, 256, 512, 800), (24, 48, 96)),
    Method("rays, form", trace, "rays", True, (64, 128, 256, 400), (24, 48, 96)),
    Method("wavefront, facets", trace, "wavefront", False, (4, 8, 16), (4,)),
    Method("wavefront, form", trace, "wavefront", True, (4, 6, 9, 14, 24, 48), (4, 8, 16)),
)


@dataclass(frozen=True)
class Size:
    """Size of the benchmark: pixels, mesh cells along either side, repetitions."""

    pixels: int
    cells: int
    repeats: int


FULL, QUICK = Size(128, 64, 3), Size(32, 16, 1)
# Runs longer than this are not repeated, seconds.
LONG = 0.5


@dataclass(frozen=True)
class StandardRun:
    """One run of a method on a reference scene.

    Attributes
    ----------
    standard, method : str
    rays : int
        Of the beam. The wavefront method sends more to edges; they are in its time.
    triangles : int
    seconds : float
        Shortest time of trace and field.
    waves : float
        Phase error of the mean field, rms over the pixels, weighted with the irradiance.
    irradiance : float
        Error of the mean irradiance, rms over the pixels, relative to the mean.
    """

    standard: str
    method: str
    rays: int
    triangles: int
    seconds: float
    waves: float
    irradiance: float


def phase_error(field: ComplexArray, truth: ComplexArray) -> float:
    """Phase error in waves, rms over pixels weighted with their power.

    Parameters
    ----------
    field, truth : (rows, columns) complex128

    Returns
    -------
    float
        Pixels without any light count `ANY_PHASE`.
    """
    weight = np.abs(truth) ** 2
    off = np.where(field == 0.0, ANY_PHASE, np.angle(field * np.conj(truth)) / (2.0 * np.pi))
    return float(np.sqrt((weight * off**2).sum() / weight.sum()))


def irradiance_error(image: FloatArray, truth: FloatArray) -> float:
    """Irradiance error, rms over pixels, relative to the mean.

    Parameters
    ----------
    image, truth : (rows, columns) float64

    Returns
    -------
    float
    """
    return float(np.sqrt(np.mean((image - truth) ** 2)) / truth.mean())


def run_standard(
    standard: Standard, truth: Truth, method: Method, count: int, repeats: int = 1
) -> StandardRun:
    """Run a method on a reference scene.

    Parameters
    ----------
    standard : Standard
        Without its forms where the method is one of facets; see `Standard.faceted`.
    truth : mean field and irradiance, each (rows, columns)
    method : Method
    count : int
        Rays along either side of the beam.
    repeats : int
        The shortest time counts.

    Returns
    -------
    Run
        Its standard is named by its title.
    """

    def once() -> tuple[float, Paths, ComplexArray]:
        begin = time.perf_counter()
        paths = method.tracer(standard.scene, standard.lit(count), standard.ccd)
        field = light_on(paths, WAVELENGTH, method.sum).complex_field(WAVELENGTH)
        return time.perf_counter() - begin, paths, field

    seconds, paths, field = once()
    for _ in range(repeats - 1 if seconds < LONG else 0):
        seconds = min(seconds, once()[0])
    bright = light_on(paths, WAVELENGTH, method.sum).irradiance(WAVELENGTH)
    return StandardRun(
        standard.title, method.name, count**2, standard.triangles, seconds,
        phase_error(field, truth[0]), irradiance_error(bright, truth[1]),
    )  # fmt: skip


def runs(
    names: Iterable[str] = tuple(STANDARDS),
    quick: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[StandardRun]:
    """Run all methods on reference scenes, with increasing numbers of rays.

    Facets that only stand for a smooth surface grow with the rays where the wavefront method is to
    follow them, two rays a facet along either side; the ray sum has them fine from the start.

    Parameters
    ----------
    names : iterable of str
        Of `STANDARDS`, at least one.
    quick : bool
        Fewer pixels and rays.
    progress : callable, optional
        Called with the runs done and the runs in all.

    Yields
    ------
    Run

    Raises
    ------
    ValueError
        For the name of a standard that there is not.
    """
    size = QUICK if quick else FULL
    chosen = [(name, STANDARDS[name](size.pixels, size.cells)) for name in checked_standards(names)]
    plan = [
        (name, standard, method, method.quick if quick else method.full)
        for name, standard in chosen
        for method in METHODS
        if method.suits(standard)
    ]
    total, done = sum(len(counts) for *_, counts in plan), 0
    truth, begun = chosen[0][1].truth(), set()
    for row, (name, standard, method, counts) in enumerate(plan):
        if row and standard is not plan[row - 1][1]:
            truth = standard.truth()
        follow = method.sum == "wavefront" and standard.curved and not method.form
        used = standard if method.form else standard.faceted()
        for count in counts:
            if follow:
                used = STANDARDS[name](size.pixels, count // 2).faceted()
            elif method.name not in begun:  # compiles
                run_standard(used, truth, method, count)
                begun.add(method.name)
            method.tracer(used.scene, used.lit(1), used.ccd)  # builds what belongs to the scene
            yield run_standard(used, truth, method, count, size.repeats)
            done += 1
            if progress is not None:
                progress(done, total)


def checked_standards(names: Iterable[str]) -> tuple[str, ...]:
    """Checked names of reference scenes.

    Parameters
    ----------
    names : iterable of str

    Returns
    -------
    tuple of str

    Raises
    ------
    ValueError
        For a name that is none.
    """
    chosen = tuple(names)
    for name in chosen:
        if name not in STANDARDS:
            raise ValueError(f"scenes: expected some of {', '.join(STANDARDS)}, got {name!r}")
    return chosen


def best(done: Iterable[StandardRun]) -> list[StandardRun]:
    """Most accurate run of each method on each scene, in their order.

    Parameters
    ----------
    done : iterable of Run

    Returns
    -------
    list of Run
    """
    chosen: dict[tuple[str, str], StandardRun] = {}
    for one in done:
        name = one.standard, one.method
        if name not in chosen or one.waves < chosen[name].waves:
            chosen[name] = one
    return list(chosen.values())


def markdown_table(done: Iterable[StandardRun]) -> str:
    """Markdown table of the most accurate run of each method on each scene.

    Parameters
    ----------
    done : iterable of Run

    Returns
    -------
    str
    """
    lines = [
        "| scene | method | rays | seconds | phase error, waves rms | irradiance error, rms |",
        "|---|---|---|---|---|---|",
    ]
    for one in best(done):
        figures = f"{one.rays} | {one.seconds:.3f} | {one.waves:.1e} | {one.irradiance:.1e}"
        lines.append(f"| {one.standard} | {one.method} | {figures} |")
    return "\n".join(lines)


def machine() -> dict[str, str | int | None]:
    """Description of the machine: processor, system, versions of the libraries that decide run time.

    Returns
    -------
    dict
    """
    return {
        "machine": platform.machine(),
        "system": platform.system(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        **{name: version(name) for name in LIBRARIES},
    }


def write(done: Iterable[StandardRun], folder: Path) -> None:
    """Write all runs as `work_precision.json`, and a figure of them.

    Parameters
    ----------
    done : iterable of Run
    folder : Path
        An existing one; see `measurement.staged`.
    """
    every = list(done)
    content = {"wavelength_m": WAVELENGTH, **machine(), "runs": [asdict(one) for one in every]}
    (folder / FILES[0]).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    views.save(views.comparison(panels(every)), folder / FILES[1])


def panels(done: Iterable[StandardRun]) -> dict[str, dict[str, FloatArray]]:
    """Panels of the runs for `views.comparison`.

    Parameters
    ----------
    done : iterable of Run

    Returns
    -------
    dict of dict of (3, n) float64
        By standard and method: rays, seconds, phase error in waves.
    """
    rows: dict[str, dict[str, list[tuple[float, float, float]]]] = {}
    for one in done:
        curve = rows.setdefault(one.standard, {}).setdefault(one.method, [])
        curve.append((one.rays, one.seconds, one.waves))
    return {
        name: {method: np.array(curve).T for method, curve in curves.items()} for name, curves in rows.items()
    }
