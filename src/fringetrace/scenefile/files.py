"""Scene files: a scene or an interferometer, its light and the wanted outputs, as TOML."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from fringetrace.core import checked_wavelength, short_repr
from fringetrace.optics import Material
from fringetrace.scene import CCD, Beam, Scene, Surface
from fringetrace.scenefile.decode import decode
from fringetrace.scenefile.encode import Shelf, encode
from fringetrace.scenefile.schema import Recipe, parameters
from fringetrace.scenefile.toml import Place, choice, dump, parse

__all__ = ["OUTPUTS", "Experiment", "Recipe", "load", "parse_experiment", "save"]

# What can be asked for; the second half takes a bench.
OUTPUTS = (
    "interferogram.png", "interferogram.tif", "interferogram.nc", "field.nc", "paths.nc", "scene.png",
    "frames.tif", "height.png", "height.nc", "height.dat", "height.datx",
)  # fmt: skip
STEPPED = OUTPUTS[6:]
# What a bench brings along.
FREE = ("surface", "beam", "ccd", "medium", "method", "max_bounces", "min_amplitude")


@dataclass(frozen=True, eq=False)
class Experiment:
    """Contents of a scene file: scene or interferometer, beams, CCD, wavelengths, outputs.

    Parameters
    ----------
    wavelengths : tuple of float, metres
    bench : Recipe, optional
        A ready bench; or else
    medium : Material, optional
        What is around the surfaces; None: a vacuum.
    surface : tuple of Surface
    beam : tuple of Beam
        All coherent with each other.
    ccd : CCD, optional
    max_bounces : int
    min_amplitude : float
        See `trace`.
    method : {"auto", "wavefront", "rays"}
        See `complex_field`.
    outputs : tuple of str
        Some of `OUTPUTS`.
    steps : int
        Phase steps over one period, at least 3.

    Raises
    ------
    ValueError
        If there are neither a bench nor surfaces, or both; for outputs that are unknown or not possible.
    """

    wavelengths: tuple[float, ...] = ()
    outputs: tuple[str, ...] = ("interferogram.png",)
    steps: int = 4
    method: str = "auto"
    max_bounces: int = 12
    min_amplitude: float = 1e-6
    medium: Material | None = None
    bench: Recipe | None = None
    surface: tuple[Surface, ...] = ()
    beam: tuple[Beam, ...] = ()
    ccd: CCD | None = None

    __repr__ = short_repr

    def __post_init__(self) -> None:
        for wavelength in self.wavelengths:
            checked_wavelength(wavelength)
        plain = {name: parameter.default for name, parameter in parameters(Experiment).items()}
        free = [
            name
            for name in FREE
            if getattr(self, name) is not plain[name] and getattr(self, name) != plain[name]
        ]
        if self.bench is None and not self.surface:
            raise ValueError("expected a bench, or at least one surface, got neither")
        if self.bench is not None and free:
            raise ValueError(f"{free[0]}: expected none beside a bench, which brings its own, got some")
        for name in self.outputs:
            if name not in OUTPUTS:
                raise ValueError(f"outputs: {choice(name, OUTPUTS)}")
            if self.bench is None and name in STEPPED:
                raise ValueError(
                    f"outputs: expected a bench for {name}, whose phase can be stepped, got none"
                )
        if self.steps < 3:
            raise ValueError(f"steps: expected at least 3, got {self.steps}")

    @cached_property
    def scene(self) -> Scene:
        """Scene: the surfaces and the surrounding medium."""
        return Scene(self.surface, self.medium) if self.bench is None else self.bench.bench.scene


def parse_experiment(
    text: str, name: str, folder: str | os.PathLike[str], *, allow_outside: bool = False
) -> Experiment:
    """Parse and check the text of a scene file.

    Parameters
    ----------
    text : str
        TOML.
    name : str
        Of the file, for messages.
    folder : path
        Names of files in it are relative to this.
    allow_outside : bool
        Whether it may name files that are not in this folder.

    Returns
    -------
    Experiment

    Raises
    ------
    ValueError
        If anything in it is not as expected; says file and line, key, what was expected and what was found.
    """
    document = parse(text, name)
    experiment: Experiment = decode(document.values, Experiment, Place(document, Path(folder), allow_outside))
    return experiment


def load(path: str | os.PathLike[str], *, allow_outside: bool = False) -> Experiment:
    """Load a scene or an interferometer from a TOML file; runs no code from it.

    Parameters
    ----------
    path : path
    allow_outside : bool
        Whether it may name files that are not in its folder.

    Returns
    -------
    Experiment

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        As in `parse_experiment`.
    """
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: expected TOML in UTF-8, got other bytes: {error}") from None
    return parse_experiment(text, file.name, file.parent, allow_outside=allow_outside)


def save(what: Experiment | Scene, path: str | os.PathLike[str], *, allow_outside: bool = False) -> None:
    """Save a scene file; loading it gives the same setup, to the last bit.

    Meshes that were loaded from a file in the same folder are referred to; others, and large arrays, are
    written beside it. All files are there in full or not at all.

    Parameters
    ----------
    what : Experiment or Scene
    path : path
    allow_outside : bool
        Whether to refer to mesh files in other folders.

    Raises
    ------
    ValueError
        If something in it is no data, such as a profile that is a function of one's own.
    TypeError
        If it is neither an Experiment nor a Scene.
    OSError
        If the files cannot be written.
    """
    if isinstance(what, Scene):
        what = Experiment(surface=what.surfaces, medium=what.medium)
    if not isinstance(what, Experiment):
        raise TypeError(f"scene file: expected an Experiment or a Scene, got {type(what).__name__}")
    target = Path(path)
    shelf = Shelf(target, allow_outside)
    text = dump(encode(what, Experiment, (), shelf))
    with tempfile.TemporaryDirectory(prefix=".fringetrace-", dir=target.parent) as folder:
        for name, write in shelf.files.items():
            write(Path(folder, name))
        Path(folder, target.name).write_text(text, encoding="utf-8")
        for name in (*shelf.files, target.name):
            os.replace(Path(folder, name), target.parent / name)
