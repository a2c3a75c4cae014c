"""Decoding of TOML values into objects, by the types of parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import numpy as np

from fringetrace.core import ComplexArray, FloatArray, parse_angle, parse_length, rotation
from fringetrace.geometry import Mesh, meshes
from fringetrace.instruments import Interferometer
from fringetrace.optics import Material, materials
from fringetrace.scenefile.schema import (
    Kind,
    Parameter,
    Recipe,
    Unit,
    call,
    concrete,
    kinds,
    members,
    parameters,
)
from fringetrace.scenefile.toml import Place, choice

# Mesh files that name no others, but for GLB, which is looked through.
MESHES = (".dat", ".datx", ".glb", ".npz", ".obj", ".ply", ".stl")
CALLABLE = get_origin(Callable[[], None])


@dataclass(frozen=True, eq=False)
class Pose:
    """Pose: rotation about the origin, then a shift.

    Parameters
    ----------
    offset : (3,) metres
    turn : (3, 3), optional
        Rotation matrix; or
    axis : (3,), optional
    angle : float, radians
        A right-handed turn about it.

    Raises
    ------
    ValueError
        If both a matrix and an axis are given, or an angle without an axis.
    """

    offset: FloatArray = field(default_factory=lambda: np.zeros(3))
    turn: FloatArray | None = None
    axis: FloatArray | None = None
    angle: float = 0.0

    def __post_init__(self) -> None:
        if (self.turn is not None and self.axis is not None) or (self.axis is None and self.angle):
            raise ValueError("pose: expected a turn, or an axis and an angle, or neither, got parts of both")

    @property
    def matrix(self) -> FloatArray | None:
        """Rotation matrix, (3, 3) float64, or None."""
        return self.turn if self.axis is None else rotation(self.axis, self.angle)


def decode(value: Any, hint: Any, place: Place, unit: Unit = "") -> Any:
    """Object that a TOML value stands for.

    Parameters
    ----------
    value : Any
    hint : type
        What is expected.
    place : Place
    unit : {"m", "rad", ""}
        Of numbers.

    Returns
    -------
    Any

    Raises
    ------
    ValueError
        If it does not stand for such; says file, line, key, what was expected and what was found.
    """
    some = members(hint)
    if Material in some and not isinstance(value, (dict, bool, list)):
        return _material(value, place)
    if Mesh in some and isinstance(value, str):
        value = {"file": value}
    if isinstance(value, dict):
        return _table(value, some, place)
    if isinstance(value, list):
        return _list(value, some, place, unit)
    if isinstance(value, str):
        return _text(value, some, place, unit)
    return _number(value, some, place, unit)


def _material(value: Any, place: Place) -> Material:
    if isinstance(value, str):
        value = _complex(value) if value[:1] in "+-.0123456789" else value
    try:
        return materials.as_material(value)
    except (TypeError, ValueError) as error:
        raise place.error(str(error)) from None


def _complex(text: str) -> complex | str:
    """A complex number such as 0.5+0.5i; the text itself, if it is none."""
    try:
        return complex(text.replace(" ", "").replace("i", "j"))
    except ValueError:
        return text


def _wants(some: Sequence[Any], unit: Unit) -> str:
    """In words, what is expected."""
    number = {"m": "a length ('1 nm', or a number of metres)", "rad": "an angle ('1 deg', or radians)"}
    words = {
        bool: "true or false", int: "a whole number", float: number.get(unit, "a number"), str: "text",
        complex: "a complex number ('0.5+0.5i')",
    }  # fmt: skip
    named = [words[part] for part in some if part in words]
    named += [repr(word) for part in some if get_origin(part) is Literal for word in get_args(part)]
    named += ["a list" for part in some if _listed(part)][:1]
    named += [f"a table of type {', '.join(known)}" for known in [kinds(some)] if known]
    return f"expected {' or '.join(named) or 'nothing that a file can hold'}"


def _number(value: Any, some: Sequence[Any], place: Place, unit: Unit) -> Any:
    kind = type(value)
    wanted = next((part for part in (int, float, complex) if part in some), None)
    if (kind is bool and bool in some) or (kind is int and wanted is not None):
        return value
    if kind is float and (float in some or complex in some):
        return value
    raise place.error(f"{_wants(some, unit)}, got {value!r}")


def _text(value: str, some: Sequence[Any], place: Place, unit: Unit) -> Any:
    if str in some:
        return value
    known = kinds(some)
    if value in known:
        return _made(known[value], {}, place)
    if float in some and unit and value[:1] in "+-.0123456789":
        try:
            return (parse_length if unit == "m" else parse_angle)(value, "number")
        except ValueError as error:
            raise place.error(str(error).removeprefix("number: ")) from None
    if complex in some and isinstance(number := _complex(value), complex):
        return number
    if float in some and any(get_origin(part) is CALLABLE for part in some):
        return _material(value, place).index
    words = [word for part in some if get_origin(part) is Literal for word in get_args(part)]
    if value in words:
        return value
    if words or known:
        raise place.error(choice(value, [*words, *known]))
    raise place.error(f"{_wants(some, unit)}, got {value!r}")


def _array(part: Any) -> type | None:
    """The type of an array's numbers."""
    if get_origin(part) is np.ndarray:
        return complex if part == ComplexArray else float
    return None


def _listed(part: Any) -> bool:
    origin = get_origin(part)
    return _array(part) is not None or (isinstance(origin, type) and issubclass(origin, Iterable))


def _list(value: list[Any], some: Sequence[Any], place: Place, unit: Unit) -> Any:
    part = next((part for part in some if _listed(part) and _long(part, len(value))), None)
    if part is None:
        lengths = {len(get_args(part)) for part in some if _listed(part)}
        among = f" of {' or '.join(map(str, sorted(lengths)))}" if lengths else ""
        raise place.error(f"{_wants(some, unit)}{among}, got a list of {len(value)}")
    number = _array(part)
    if number is not None:
        return _numbers(value, number, place, unit)
    hints = get_args(part)
    if get_origin(part) is not tuple or hints[1:] == (...,):
        hints = (hints[0],) * len(value)
    return tuple(
        decode(item, hint, place.at(k), unit) for k, (item, hint) in enumerate(zip(value, hints, strict=True))
    )


def _long(part: Any, count: int) -> bool:
    """Whether a type of lists has those of a length."""
    hints = get_args(part)
    fixed = get_origin(part) is tuple and hints[1:] != (...,)
    return not fixed or len(hints) == count


def _numbers(value: list[Any], number: type, place: Place, unit: Unit) -> Any:
    """An array from nested lists."""

    def nested(items: list[Any], place: Place) -> list[Any]:
        return [
            nested(item, place.at(k)) if isinstance(item, list) else decode(item, number, place.at(k), unit)
            for k, item in enumerate(items)
        ]

    rows = nested(value, place)
    try:
        return np.array(rows, dtype=np.complex128 if number is complex else np.float64)
    except ValueError:
        raise place.error("expected lists of equal lengths, got others") from None


def _table(value: dict[str, Any], some: Sequence[Any], place: Place) -> Any:
    if Recipe in some:
        return _recipe(value, place)
    if "file" in value:
        return _posed(value, place, lambda rest: _loaded(rest, some, place))
    known, plain = kinds(some), [part for part in concrete(some) if part not in (Mesh, Material)]
    if not known:
        raise place.error(f"{_wants(some, '')}, got a table")
    _, kind = _named(value, plain[0].__name__ if len(plain) == 1 else None, known, place)
    rest = {key: item for key, item in value.items() if key != "type"}
    return _posed(rest, place, lambda rest: _made(kind, rest, place))


def _named(
    value: dict[str, Any], default: str | None, known: dict[str, Kind], place: Place
) -> tuple[str, Kind]:
    """The kind that a table names, and its name."""
    name = value.get("type", default)
    if name is None:
        raise place.error(f"expected the key 'type', one of {', '.join(known)}, got {_listing(value)}")
    if not isinstance(name, str) or name not in known:
        raise place.at("type").error(choice(name, known))
    return name, known[name]


def _listing(value: Mapping[str, Any]) -> str:
    return ", ".join(value) or "none"


def _posed(value: dict[str, Any], place: Place, make: Callable[[dict[str, Any]], Any]) -> Any:
    """A thing in its poses, one after the other, if it can be moved."""
    made = make({key: item for key, item in value.items() if key != "pose"})
    if "pose" not in value:
        return made
    poses, here = value["pose"], place.at("pose")
    if not hasattr(made, "moved"):
        raise here.error(f"expected none for a {type(made).__name__}, got one")
    listed = isinstance(poses, list)
    for k, each in enumerate(poses if listed else [poses]):
        at = here.at(k) if listed else here
        pose = decode(each, Pose, at)
        try:
            made = made.moved(pose.offset, pose.matrix)
        except ValueError as error:
            raise at.error(str(error)) from None
    return made


def _made(kind: Kind, value: dict[str, Any], place: Place) -> Any:
    """What a kind makes of the values of a table."""
    arguments = _arguments(kind, value, place)
    return _checked(lambda: call(kind, arguments), value, place)


def _arguments(kind: Kind, value: dict[str, Any], place: Place) -> dict[str, Any]:
    known = parameters(kind)
    for key in value:
        if key not in known:
            posed = ["pose"] if hasattr(kind, "moved") or kind.__annotations__.get("return") == "Mesh" else []
            raise place.at(key).error(choice(key, [*known, *posed]))
    missing = [name for name, parameter in known.items() if parameter.required and name not in value]
    if missing:
        raise place.error(f"expected the key {missing[0]!r}, got {_listing(value)}")
    return {key: _argument(value[key], known[key], place.at(key)) for key in known if key in value}


def _argument(value: Any, parameter: Parameter, place: Place) -> Any:
    hint = parameter.hint
    if parameter.several:
        hint = tuple[hint, ...]  # type: ignore[valid-type]
    return decode(value, hint, place, parameter.unit)


def _checked(make: Callable[[], Any], value: Mapping[str, Any], place: Place) -> Any:
    """What is made; what the maker refuses is said of the key that it speaks of, if there is one."""
    try:
        return make()
    except (ValueError, TypeError, OSError) as error:
        text = " ".join(str(error).split())
        about = next((key for key in value if key in text.partition(":")[0].split()), None)
        raise (place if about is None else place.at(about)).error(text.removeprefix(f"{about}: ")) from None


def _recipe(value: dict[str, Any], place: Place) -> Recipe:
    name, known = _named(value, None, kinds([Interferometer]), place)
    rest = {key: item for key, item in value.items() if key != "type"}
    recipe = Recipe(name, _arguments(known, rest, place))
    _checked(lambda: recipe.bench, rest, place)
    return recipe


def _loaded(value: dict[str, Any], some: Sequence[Any], place: Place) -> Any:
    """A mesh, a material or an array from a file."""
    path, rest = place.at("file").file(value["file"]), {k: v for k, v in value.items() if k != "file"}
    allowed = ("unit",) if Mesh in some or Material in some else ()
    for key, item in rest.items():
        if key not in allowed:
            raise place.at(key).error(choice(key, ("file", *allowed, *(("pose",) if Mesh in some else ()))))
        if not isinstance(item, str):
            raise place.at(key).error(f"expected text, got {item!r}")
    if Mesh in some:
        _check_mesh(path, place)
        return _checked(lambda: meshes.load(path, **rest), value, place)
    if Material in some:
        return _checked(lambda: materials.load(path, **rest), value, place)
    if any(_array(part) for part in some):
        return _checked(lambda: _saved(path), value, place)
    raise place.error(f"{_wants(some, '')}, got a file")


def _saved(path: Path) -> Any:
    """An array of numpy's own format, without objects in it."""
    if path.suffix != ".npy":
        raise ValueError(f"file: expected one named .npy, got {path.name!r}")
    return np.load(path, allow_pickle=False)


def _check_mesh(path: Path, place: Place) -> None:
    """Refuse mesh files that may have other files read."""
    at = place.at("file")
    if place.outside:
        return
    if path.suffix.lower() not in MESHES:
        raise at.error(f"expected a file named {', '.join(MESHES)}, got {path.name!r}")
    if path.suffix.lower() == ".glb" and path.is_file() and b'"uri"' in path.read_bytes():
        raise at.error(f"expected a mesh that is whole, got {path.name!r}, which names other files")
