"""Templates of scene files: one per interferometer, made from its signature, and one of a free scene."""

from __future__ import annotations

import inspect
import textwrap
from pathlib import Path
from typing import Any

from fringetrace.geometry import Mesh
from fringetrace.instruments import Interferometer
from fringetrace.scenefile.encode import Shelf, encode
from fringetrace.scenefile.schema import Kind, Parameter, kinds, members, parameters
from fringetrace.scenefile.toml import choice, dump

WIDTH = 90
# Values to begin with, by the name of the parameter; what is not here begins as its unit does.
VALUES: dict[str, Any] = {
    "aperture": "8 mm", "gap": "0.1 mm", "index": 1.34, "pixels": [128, 128], "rays": 0.5,
    "reference_tilt": ["200 urad", 0.0],
}  # fmt: skip
BEGINNINGS: dict[str, Any] = {"m": "1 mm", "rad": "1 deg", "": 1.0}
# What light is sent back by, once or to and fro, and what it goes through.
STEP = {"type": '"step"', "width": '"10 mm"', "height": '"10 mm"', "edge": '"1 mm"', "rise": '"100 nm"'}
FLAT = {"type": '"plate"', "width": '"10 mm"', "height": '"10 mm"'}
BOX = {"type": '"plate"', "width": '"4 mm"', "height": '"4 mm"', "thickness": '"2 um"'}
# Instead of numbers.
FILED = '# or of a file beside this one: { file = "part.stl", unit = "mm" }'

FREE = """\
# A half-transparent plate over a mirror, a wedge between them, seen by a CCD: fringes of equal thickness.
# Run it with: fringetrace run THIS.toml

wavelengths = ["632.8 nm"]
outputs = ["interferogram.png", "interferogram.tif", "field.nc", "paths.nc"]
# method = "auto"            # or "wavefront", "rays"
# max_bounces = 12
# medium = "air"             # around the surfaces; default: a vacuum

[[surface]]
name = "plate"
# a mesh of numbers; from a file beside this one: mesh = { file = "plate.stl", unit = "mm" }
mesh = { type = "plate", width = "4 mm", height = "4 mm" }
interface = { type = "BeamSplitter", reflection = "0.2i", transmission = 0.9 }
pose = { offset = [0, 0, "20 um"], axis = [0, 1, 0], angle = "1.5 mrad" }

[[surface]]
name = "mirror"
mesh = { type = "plate", width = "4 mm", height = "4 mm" }
interface = { type = "Mirror", reflectance = 0.5 }
# form = { type = "Sphere", centre = [0, 0, "1 m"], radius = "1 m" }

[[beam]]
centre = [0, 0, "5 mm"]
direction = [0, 0, -1]
up = [0, 1, 0]
size = ["2 mm", "2 mm"]
shape = [64, 64]
# profile = { type = "Gaussian", waist = "1 mm" }
# polarisation = [1, "0.5i"]

[ccd]
centre = [0, 0, "10 mm"]
normal = [0, 0, -1]
up = [0, 1, 0]
pitch = "20 um"
shape = [128, 128]
"""


def template(name: str) -> str:
    """Text of a scene file that runs.

    Parameters
    ----------
    name : str
        A bench of `fringetrace.instruments.michelson_bench`, or "free".

    Returns
    -------
    str
        TOML.

    Raises
    ------
    ValueError
        If there is no such bench; says the nearest one.
    """
    benches = kinds([Interferometer])
    if name == "free":
        return FREE
    if name not in benches:
        raise ValueError(f"template: {choice(name, ['free', *benches])}")
    return _bench(name, benches[name])


def _bench(name: str, kind: Kind) -> str:
    """All parameters of a bench with what is said of them; those with a default as comments."""
    known = parameters(kind)
    first = " ".join((inspect.getdoc(kind) or name).partition("\n\n")[0].split())
    height = "reference_tilt" in known and not _through(known)
    outputs = ["interferogram.png", "interferogram.nc", *(["height.png"] if height else [])]
    lines = [
        *_comment(first), "# Run it with: fringetrace run THIS.toml", "",
        'wavelengths = ["632.8 nm"]', _line("outputs", outputs), "", "[bench]", _line("type", name),
    ]  # fmt: skip
    tables: list[str] = []
    for parameter in known.values():
        if Mesh in members(parameter.hint):
            end = lines if _through(known) else tables
            end += ["", *_comment(parameter.text), *_sample(parameter, known)]
        else:
            lines += ["", *_comment(parameter.text), _value(parameter)]
    return "\n".join([*lines, *tables]) + "\n"


def _through(known: dict[str, Parameter]) -> bool:
    """Whether light goes through the sample of a bench."""
    return "index" in known


def _comment(text: str) -> list[str]:
    return [f"# {line}" for line in textwrap.wrap(text, WIDTH)]


def _line(key: str, value: Any) -> str:
    return dump({key: value}).rstrip()


def _value(parameter: Parameter) -> str:
    """A line with a value; behind a # if it is the default."""
    if parameter.name in VALUES:
        return _line(parameter.name, VALUES[parameter.name])
    if parameter.required:
        return _line(parameter.name, BEGINNINGS[parameter.unit])
    if parameter.default is None:
        return f"# {parameter.name} = ..."
    value = encode(parameter.default, parameter.hint, (parameter.name,), Shelf(Path()))
    if isinstance(value, dict) and list(value) == ["type"]:
        value = value["type"]
    return f"# {_line(parameter.name, value)}"


def _sample(parameter: Parameter, known: dict[str, Parameter]) -> list[str]:
    """The table of a sample: a step to reflect off, a flat for a cavity, or a thin box to look through."""
    through = _through(known)
    shape = BOX if through else FLAT if "gap" in known else STEP
    mesh = ", ".join(f"{key} = {value}" for key, value in shape.items())
    if through:  # the bench knows what it is made of
        return [FILED, f"{parameter.name} = {{ {mesh} }}"]
    return [f"[bench.{parameter.name}]", FILED, f"mesh = {{ {mesh} }}", 'interface = "Mirror"']
