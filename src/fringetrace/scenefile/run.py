"""Run of a scene file: trace, record, check, write the outputs."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import reduce
from operator import add
from pathlib import Path
from typing import Any

import numpy as np

from fringetrace.accuracy import checks, judge
from fringetrace.core import (
    Array,
    ComplexArray,
    FloatArray,
    FringetraceWarning,
    nm,
    short_repr,
    staged,
    tables,
)
from fringetrace.field import choose, complex_field, irradiance
from fringetrace.geometry import write_height_map
from fringetrace.instruments import Interferometer, Mark, records, tiff
from fringetrace.scene import CCD, Beam, Scene
from fringetrace.scenefile.files import Experiment
from fringetrace.tracing import Fate, Ledger, Paths, needs, trace
from fringetrace.views import few

# Outputs that need no CCD.
BLIND = ("paths.nc", "scene.png")


@dataclass(frozen=True, eq=False)
class Run:
    """A setup with its lazily computed paths, images and fields.

    Parameters
    ----------
    experiment : Experiment
    """

    experiment: Experiment
    derived: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    __repr__ = short_repr

    def kept(self, key: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        """Value computed once and kept."""
        if key not in self.derived:
            self.derived[key] = make()
        return self.derived[key]

    @property
    def bench(self) -> Interferometer | None:
        """The interferometer, if the setup is one."""
        return None if self.experiment.bench is None else self.experiment.bench.bench

    @property
    def ccd(self) -> CCD:
        """CCD that records the light."""
        found = self.experiment.ccd if self.bench is None else self.bench.ccd
        assert found is not None
        return found

    @property
    def beams(self) -> tuple[Beam, ...]:
        """Beams that light the scene."""
        return self.experiment.beam if self.bench is None else (self.bench.beam,)

    @property
    def method(self) -> str:
        """Method of the coherent sum on the pixels."""
        return self.experiment.method if self.bench is None else self.bench.method

    def paths(self, wavelength: float) -> list[Paths]:
        """Paths of each beam, traced per wavelength where the scene depends on it."""
        if self.bench is not None:
            self.image(wavelength)
            return [self.bench.trace()]
        at = None if needs(self.experiment.scene) is None else wavelength
        found: list[Paths] = self.kept(
            ("paths", at), lambda: [self.traced(beam, self.experiment.ccd, at) for beam in self.beams]
        )
        return found

    def traced(self, beam: Beam, ccd: CCD | None, wavelength: float | None, record: bool = False) -> Paths:
        """Trace one beam through the scene; what there is to warn of is said beside the budget."""
        return trace(
            self.experiment.scene, beam, ccd, wavelength=wavelength, max_bounces=self.experiment.max_bounces,
            min_amplitude=self.experiment.min_amplitude, record=record, warn=False,
        )  # fmt: skip

    def image(self, wavelength: float) -> FloatArray:
        """Irradiance |E|^2, (rows, columns)."""

        def find() -> FloatArray:
            with warnings.catch_warnings():  # they are said beside the budget
                warnings.simplefilter("ignore", FringetraceWarning)
                if self.bench is None:
                    return irradiance(self.paths(wavelength), wavelength, self.method)
                return self.bench.interferogram(wavelength)

        found: FloatArray = self.kept(("image", wavelength), find)
        return found

    def field(self, wavelength: float) -> ComplexArray:
        """Complex field, (rows, columns) complex128, or (3, rows, columns) for polarised light."""
        if self.bench is not None:
            return self.bench.field(wavelength)
        return complex_field(self.paths(wavelength), wavelength, self.method)


def run(experiment: Experiment, out: Path) -> Iterator[tuple[str, str]]:
    """Trace a setup and write its outputs, all of them or none.

    Parameters
    ----------
    experiment : Experiment
    out : Path
        Folder to write to.

    Yields
    ------
    what, text : str
        What was done, and what there is to warn of.

    Raises
    ------
    ValueError
        If there are no wavelengths or no beam, or no CCD for what is asked for.
    """
    _check(experiment)
    current = Run(experiment)
    with staged(out) as folder:
        yield "scene", _described(current)
        for wavelength in experiment.wavelengths:
            yield from _traced(current, wavelength)
        for name in experiment.outputs:
            missing = WRITERS[name](current, folder)
            if missing is not None:
                yield f"no {name}", missing
        files = sorted(file.name for file in folder.iterdir())
    yield "written", f"{out}: {', '.join(files)}"


def _check(experiment: Experiment) -> None:
    if not experiment.wavelengths:
        raise ValueError("wavelengths: expected at least one to run a scene, got none")
    if experiment.bench is None and not experiment.beam:
        raise ValueError("beam: expected at least one to run a scene, got none")
    for name in experiment.outputs:
        if experiment.bench is None and experiment.ccd is None and name not in BLIND:
            raise ValueError(f"ccd: expected one for {name}, got none")


def _described(current: Run) -> str:
    experiment = current.experiment
    surfaces = experiment.scene.surfaces
    parts = [f"{len(surfaces)} surfaces, {sum(len(s.mesh.faces) for s in surfaces):,} triangles"]
    if experiment.bench is not None:
        parts.insert(0, experiment.bench.name)
    rays = ", ".join(f"{beam.shape[1]} x {beam.shape[0]}" for beam in current.beams)
    parts.append(f"beams: {len(current.beams)} of {rays} rays")
    if current.bench is not None or experiment.ccd is not None:
        rows, columns = current.ccd.shape
        parts.append(f"{columns} x {rows} pixels of {1e6 * current.ccd.pitch:.4g} um")
    return "; ".join(parts)


def _traced(current: Run, wavelength: float) -> Iterator[tuple[str, str]]:
    """What tracing at a wavelength did, and what it is worth."""
    start = time.perf_counter()
    every = current.paths(wavelength)
    seconds, segments = time.perf_counter() - start, sum(paths.segments for paths in every)
    ends = sum(map(len, every))
    yield "traced", f"{_named(wavelength)}: {segments:,} segments, {ends:,} path ends in {seconds:.2f} s"
    power: Ledger = reduce(add, (paths.ledger() for paths in every))
    shares = ", ".join(
        f"{item} {getattr(power, item) / power.incident:.4%}"
        for item in ("detected", "left", "absorbed", "truncated")
    )
    yield "power", f"{shares}; unaccounted for {power.error:.1e} of the incident"
    for number, paths in enumerate(every):
        if paths.ccd is None:
            problems = checks.found(paths, wavelength)
        else:
            choice = choose(paths, current.method)
            yield "method", str(choice)
            costs, problems = judge(paths, wavelength, choice.method)
            yield "budget", f"{f'beam {number}' if len(every) > 1 else 'of the image'}: {costs.line}"
        paths.warned.update(problems)
        yield from (("note", note) for note in problems.values())


def _named(wavelength: float) -> str:
    return f"{wavelength / nm:.7g} nm"


def _marked(name: str, current: Run) -> Iterator[tuple[float, str]]:
    """Wavelengths, and the name of a file at each: after the wavelength, too, if there are several."""
    several = len(current.experiment.wavelengths) > 1
    for wavelength in current.experiment.wavelengths:
        yield wavelength, f"{name}-{_named(wavelength).replace(' ', '')}" if several else name


def _pictures(name: str, current: Run, folder: Path, draw: Callable[[float], Any]) -> None:
    """A picture for each wavelength, named after it if there are several."""
    from fringetrace import views

    for wavelength, marked in _marked(name, current):
        views.save(draw(wavelength), folder / f"{marked}.png")


def _interferogram_png(current: Run, folder: Path) -> None:
    from fringetrace import views

    def draw(wavelength: float) -> Any:
        image = current.image(wavelength)
        return views.interferogram(image, current.ccd.pitch, wavelength=wavelength, title="Interferogram")

    _pictures("interferogram", current, folder, draw)


def _height_map(kind: str) -> Callable[[Run, Path], None]:
    """A writer of the height as a file of Zygo's, one for each wavelength."""

    def write(current: Run, folder: Path) -> None:
        for wavelength, marked in _marked("height", current):
            z = _height(current, wavelength)
            write_height_map(z, current.ccd.pitch, folder / f"{marked}.{kind}", wavelength=wavelength)

    return write


def _height_png(current: Run, folder: Path) -> None:
    from fringetrace import views

    def draw(wavelength: float) -> Any:
        height = _height(current, wavelength)
        return views.height(height, current.ccd.pitch, title=f"Height, λ = {_named(wavelength)}")

    _pictures("height", current, folder, draw)


def _height(current: Run, wavelength: float) -> FloatArray:
    assert current.bench is not None
    return current.bench.height(wavelength, current.experiment.steps)


def _frames(current: Run, wavelength: float) -> FloatArray:
    assert current.bench is not None
    return current.bench.phase_steps(wavelength, current.experiment.steps)


def _stack(current: Run, find: Callable[[float], Array]) -> Array:
    """What is found at each wavelength, (wavelengths, ...)."""
    return np.stack([find(wavelength) for wavelength in current.experiment.wavelengths])


def _tif(name: str, find: Callable[[Run, float], FloatArray]) -> Callable[[Run, Path], None]:
    """A writer of 16-bit images."""

    def write(current: Run, folder: Path) -> None:
        images = _stack(current, lambda wavelength: find(current, wavelength))
        images = images[0] if len(images) == 1 else images
        wavelengths = list(current.experiment.wavelengths)
        tiff.save(images, current.ccd.pitch, folder / name, wavelengths_m=wavelengths)

    return write


def _images(current: Run, folder: Path, name: str, images: dict[str, Array]) -> None:
    """Labelled images (wavelength, [component,] y, x) as NetCDF."""
    labelled = {
        what: (("wavelength", "component")[: values.ndim - 2], values) for what, values in images.items()
    }
    axes = {"wavelength": (np.array(current.experiment.wavelengths), "m")}
    table = records.dataset(labelled, current.ccd.pitch, axes, method=current.method)
    tables.write_netcdf(table, folder / name)


def _interferogram_nc(current: Run, folder: Path) -> None:
    _images(current, folder, "interferogram.nc", {"interferogram": _stack(current, current.image)})


def _height_nc(current: Run, folder: Path) -> None:
    heights = _stack(current, lambda wavelength: _height(current, wavelength))
    _images(current, folder, "height.nc", {"height": heights})


def _field_nc(current: Run, folder: Path) -> None:
    light = _stack(current, current.field)
    _images(current, folder, "field.nc", {"field_real": light.real, "field_imag": light.imag})


def _paths_nc(current: Run, folder: Path) -> None:
    """Where every path ended; rows of one beam after those of another, wavelength by wavelength."""
    found: dict[int, tuple[float, int, Paths]] = {}
    for wavelength in current.experiment.wavelengths:
        for number, paths in enumerate(current.paths(wavelength)):
            found.setdefault(id(paths), (wavelength, number, paths))

    def column(of: Callable[[Paths], Any]) -> Array:
        return np.concatenate([np.asarray(of(paths)) for _, _, paths in found.values()])

    def label(part: int) -> Array:
        return np.concatenate([np.full(len(row[2]), row[part]) for row in found.values()])

    row, place = ("path",), ("path", "axis")
    variables = {
        "wavelength": (row, label(0), {"units": "m", "comment": "traced at; others go the same way"}),
        "beam": (row, label(1), {}),
        "ray": (row, column(lambda p: p.ray), {"comment": "in the scan order of its beam"}),
        "fate": (row, column(lambda p: p.fate), {"comment": ", ".join(f"{f.value} {f.name}" for f in Fate)}),
        "bounces": (row, column(lambda p: p.bounces), {}),
        "reflections": (row, column(lambda p: p.reflections), {}),
        "key": (row, column(lambda p: p.key), {"comment": "names the sequence of surfaces and branches"}),
        "length": (row, column(lambda p: p.length), {"units": "m", "long_name": "optical path"}),
        "origin": (place, column(lambda p: p.origin), {"units": "m", "long_name": "last hit, or on the CCD"}),
        "direction": (place, column(lambda p: p.direction), {}),
        "amplitude_real": (row, column(lambda p: p.amplitude.real), {}),
        "amplitude_imag": (row, column(lambda p: p.amplitude.imag), {}),
    }
    tables.write_netcdf(tables.labelled_dataset(variables, {}, {}), folder / "paths.nc")


def scene_to_draw(
    experiment: Experiment, wavelength: float | None, rays: int
) -> tuple[Scene, list[Paths], FloatArray | None, Mark | None]:
    """Scene, paths and drawing options of a setup, for a view.

    Parameters
    ----------
    experiment : Experiment
    wavelength : float, metres, optional
        None: the first that it names, if it names any.
    rays : int
        Along the longer side of each beam.

    Returns
    -------
    scene : Scene
    paths : list of Paths
        Of each beam, recorded.
    image : (rows, columns) float64, or None
        What the CCD shows, if there is one, and a wavelength.
    reference : Mark or None
        What a phase step turns, of a bench.
    """
    current = Run(experiment)
    bench, ccd = current.bench, experiment.ccd if current.bench is None else current.ccd
    beams = [replace(beam, shape=few(beam.shape, rays)) for beam in current.beams]
    paths = [current.traced(beam, ccd, wavelength, record=True) for beam in beams]
    image = None if ccd is None or wavelength is None or not beams else current.image(wavelength)
    reference = None if bench is None else bench.arms.reference
    return experiment.scene, paths, image, reference


def _scene_png(current: Run, folder: Path) -> str | None:
    """The scene with some rays of the first beam; or why there is no picture."""
    from fringetrace import views

    first, scene, experiment = current.beams[0], current.experiment.scene, current.experiment
    ccd = experiment.ccd if current.bench is None else current.ccd
    wavelength = None if needs(scene) is None else experiment.wavelengths[0]
    beam = replace(first, shape=few(first.shape))
    paths = current.traced(beam, ccd, wavelength, record=True)
    try:
        views.picture(scene, paths, folder / "scene.png")
    except RuntimeError as error:
        return str(error)
    return None


WRITERS: dict[str, Callable[[Run, Path], str | None]] = {
    "interferogram.png": _interferogram_png,
    "interferogram.tif": _tif("interferogram.tif", Run.image),
    "interferogram.nc": _interferogram_nc,
    "field.nc": _field_nc,
    "paths.nc": _paths_nc,
    "scene.png": _scene_png,
    "frames.tif": _tif("frames.tif", _frames),
    "height.png": _height_png,
    "height.nc": _height_nc,
    "height.dat": _height_map("dat"),
    "height.datx": _height_map("datx"),
}
