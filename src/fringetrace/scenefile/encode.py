"""Encoding of objects as TOML values, by the types of their parameters."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from numbers import Number
from pathlib import Path
from typing import Any

import numpy as np

from fringetrace.core import Array
from fringetrace.geometry import Mesh, meshes
from fringetrace.instruments import Interferometer
from fringetrace.optics import Material, materials
from fringetrace.scenefile.schema import Recipe, concrete, kinds, members, parameters
from fringetrace.scenefile.toml import Path as Keys

# Arrays of more numbers go to a file of their own.
FEW = 16

Writer = Callable[[Path], None]


class Shelf:
    """Companion files of a scene file, before any of them is written.

    Parameters
    ----------
    path : Path
        Of the scene file.
    outside : bool
        Whether it may refer to files that are not in its folder.
    """

    def __init__(self, path: Path, outside: bool = False) -> None:
        self.folder, self.stem, self.outside = path.resolve().parent, path.stem, outside
        self.files: dict[str, Writer] = {}

    def put(self, keys: Keys, suffix: str, write: Writer) -> dict[str, str]:
        """Add a companion file; returns the reference to it."""
        name = f"{self.stem}.{'-'.join(map(str, keys))}{suffix}"
        self.files[name] = write
        return {"file": name}

    def refer(self, path: Path) -> str | None:
        """Reference to a file that exists already; None if there is none."""
        if self.outside or path.is_relative_to(self.folder):
            return Path(os.path.relpath(path, self.folder)).as_posix()
        return None


def encode(value: Any, hint: Any, keys: Keys, shelf: Shelf) -> Any:
    """TOML value of an object.

    Parameters
    ----------
    value : Any
    hint : type
        What will be expected there.
    keys : tuple of str and int
        Where it will stand.
    shelf : Shelf
        Takes meshes and large arrays.

    Returns
    -------
    dict, list, str, float, int or bool

    Raises
    ------
    ValueError
        If no file can hold it, such as a function.
    """
    if isinstance(value, Recipe):
        return {"type": value.name, **_arguments(_kind(value), value.arguments, keys, shelf)}
    if isinstance(value, Material):
        return _material(value, keys, shelf)
    if isinstance(value, Mesh):
        return _mesh(value, keys, shelf)
    if isinstance(owner := getattr(value, "__self__", None), Material) and value == owner.index:
        return _material(owner, keys, shelf)
    if isinstance(value, np.ndarray):
        return _array(value, keys, shelf)
    if isinstance(value, (bool, str, Number, np.bool_)):
        return _plain(value)
    if isinstance(value, (tuple, list)):
        return _list(value, hint, keys, shelf)
    return _thing(value, hint, keys, shelf)


def _plain(value: Any) -> bool | int | float | str:
    """Text, a truth or a number; complex ones become text."""
    if isinstance(value, (np.bool_, np.number)):
        value = value.item()
    if isinstance(value, complex):
        return f"{value.real!r}{'' if repr(value.imag)[0] == '-' else '+'}{value.imag!r}i"
    return value if isinstance(value, (bool, int, str)) else float(value)


def _kind(recipe: Recipe) -> Callable[..., Any]:
    """The function that a recipe names."""
    return kinds([Interferometer])[recipe.name]


def _refused(value: Any, keys: Keys) -> ValueError:
    words = ".".join(str(key) for key in keys)
    what = type(value).__name__
    if callable(value):
        what = f"the function {getattr(value, '__name__', what)}"
    return ValueError(f"{words}: expected data that a scene file can hold, got {what}")


def _array(value: Array, keys: Keys, shelf: Shelf) -> Any:
    if value.size > FEW:
        return shelf.put(keys, ".npy", lambda path: np.save(path, value, allow_pickle=False))
    if value.ndim:
        return [_array(row, keys, shelf) for row in value]
    return _plain(value.item())


def _list(value: Any, hint: Any, keys: Keys, shelf: Shelf) -> list[Any]:
    parts = [part for part in members(hint) if getattr(part, "__args__", None)]
    several = [part for listed in parts for part in listed.__args__ if part is not ...]
    pairs = len(several) == len(value) and len(parts) == 1
    return [
        encode(item, several[k] if pairs else _either(several), (*keys, k), shelf)
        for k, item in enumerate(value)
    ]


def _either(several: list[Any]) -> Any:
    """The union of some types; None for none."""
    either = several[0] if several else None
    for part in several[1:]:
        either = either | part
    return either


def _thing(value: Any, hint: Any, keys: Keys, shelf: Shelf) -> dict[str, Any]:
    """A dataclass as a table."""
    some, name = members(hint), type(value).__name__
    known: dict[str, Any] = kinds(some)
    if known.get(name) is not type(value):
        raise _refused(value, keys)
    kind = known[name]
    plain = [part for part in concrete(some) if part not in (Mesh, Material)]
    named = {} if plain == [kind] else {"type": name}
    given = {key: getattr(value, key) for key in parameters(kind)}
    return {**named, **_arguments(kind, given, keys, shelf)}


def _arguments(
    kind: Callable[..., Any], given: Mapping[str, Any], keys: Keys, shelf: Shelf
) -> dict[str, Any]:
    """The arguments that are not the defaults."""
    known = parameters(kind)
    return {
        name: encode(value, known[name].hint, (*keys, name), shelf)
        for name, value in given.items()
        if not _default(value, known[name].default)
    }


def _default(value: Any, default: Any) -> bool:
    if isinstance(value, np.ndarray) or isinstance(default, np.ndarray):
        return False
    return value is None or value is default or (type(value) is type(default) and bool(value == default))


def _material(value: Material, keys: Keys, shelf: Shelf) -> Any:
    """Its name, its index, or its curves."""
    for known in materials.NAMED:
        if value == known:
            return known.name
    if not value.dispersive:
        index = complex(value.index(1.0))
        if value == materials.constant(index):
            return index.real if index.imag == 0.0 else _plain(index)
    return {"type": "Material", **_arguments(Material, vars(value), keys, shelf)}


def _mesh(mesh: Mesh, keys: Keys, shelf: Shelf) -> dict[str, Any]:
    """A reference to the file that a mesh came from, if it still gives the same; else a file beside."""
    source = mesh.source
    name = None if source is None else shelf.refer(Path(source.path))
    if source is None or name is None or not _same(mesh):
        return {**shelf.put(keys, ".npz", lambda path: meshes.save(mesh, path, "m")), "unit": "m"}
    unit = {} if source.unit is None else {"unit": source.unit}
    poses = [
        {"offset": offset.tolist(), **({} if turn is None else {"turn": turn.tolist()})}
        for offset, turn in source.moves
    ]
    return {"file": name, **unit, **({"pose": poses} if poses else {})}


def _same(mesh: Mesh) -> bool:
    """Whether the file that a mesh came from gives it again, to the last bit."""
    assert mesh.source is not None
    try:
        again = meshes.load(mesh.source.path, mesh.source.unit)
    except (OSError, ValueError):
        return False
    for offset, turn in mesh.source.moves:
        again = again.moved(offset, turn)
    return np.array_equal(again.vertices, mesh.vertices) and np.array_equal(again.faces, mesh.faces)
