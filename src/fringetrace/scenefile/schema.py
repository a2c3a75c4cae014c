"""Schema of scene files: kinds of objects, and their parameters with type and unit.

All of it is read off dataclasses and signatures, units off the docstrings: a new kind needs no word here.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import re
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy.typing as npt

from fringetrace.core import FloatArray, short_repr
from fringetrace.geometry import Form, Mesh
from fringetrace.instruments import Interferometer
from fringetrace.optics import Element, Film, Material, PhasePlate, Retarder
from fringetrace.scenefile.toml import choice

# Where the public dataclasses, and the functions that return one, can be named: modules of doors, or doors.
SOURCES = (
    "optics.interfaces", "optics.elements", "optics.polarisers", "optics.birefringent", "optics.gratings",
    "optics.phase_plates", "optics.films", "optics.materials.material", "optics.materials.dispersion",
    "geometry.forms", "geometry.shapes", "scene", "instruments",
)  # fmt: skip
# What annotations name that their own files import for type checkers only, and what functions return.
NAMES: dict[str, Any] = {
    "Interferometer": Interferometer, "Element": Element, "Film": Film, "Form": Form, "Material": Material,
    "Mesh": Mesh, "PhasePlate": PhasePlate, "Retarder": Retarder,
}  # fmt: skip
_SECTION = re.compile(r"^Parameters\n-+\n(.*?)(?=^\w[^\n]*\n-+\n|\Z)", re.DOTALL | re.MULTILINE)
_SLOT = re.compile(r"^(\*?\w+(?:, \*?\w+)*) : (.*)$", re.MULTILINE)
_ARRAY = frozenset(get_args(npt.ArrayLike))

Kind = Callable[..., Any]
Unit = Literal["m", "rad", ""]


@dataclass(frozen=True)
class Parameter:
    """One parameter of a kind.

    Parameters
    ----------
    name : str
    hint : Any
        Its type.
    unit : str
        "m", "rad", or "" for a plain number.
    default : Any
        `inspect.Parameter.empty`: there is none.
    several : bool
        Whether it takes all further arguments.
    text : str
        What the docstring says of it.
    """

    name: str
    hint: Any
    unit: Unit
    default: Any
    several: bool = False
    text: str = ""

    @property
    def required(self) -> bool:
        """Whether the parameter has no default."""
        return self.default is inspect.Parameter.empty and not self.several


def _documented(kind: Kind) -> dict[str, tuple[str, str]]:
    """The type slot and the text of each parameter in a docstring."""
    section = _SECTION.search(inspect.getdoc(kind) or "")
    if section is None:
        return {}
    slots = list(_SLOT.finditer(section[1]))
    ends = [*(slot.start() for slot in slots[1:]), len(section[1])]
    return {
        name.lstrip("*"): (slot[2], " ".join(section[1][slot.end() : end].split()))
        for slot, end in zip(slots, ends, strict=True)
        for name in slot[1].split(", ")
    }


def _unit(slot: str) -> Unit:
    """The unit that the type slot of a docstring names."""
    if re.search(r"\bmetres\b", slot):
        return "m"
    return "rad" if re.search(r"\bradians\b", slot) else ""


@functools.cache
def parameters(kind: Kind) -> dict[str, Parameter]:
    """Parameters of a dataclass or a function.

    Parameters
    ----------
    kind : class or function

    Returns
    -------
    dict of Parameter
        By name, in their order.
    """
    hints, documented = get_type_hints(kind, localns=NAMES), _documented(kind)
    found = {}
    for name, parameter in inspect.signature(kind).parameters.items():
        slot, text = documented.get(name, ("", ""))
        several = parameter.kind is inspect.Parameter.VAR_POSITIONAL
        found[name] = Parameter(name, hints[name], _unit(slot), parameter.default, several, text)
    return found


def members(hint: Any) -> tuple[Any, ...]:
    """Alternatives of a union type, without None; numpy's array-likes count as one.

    Parameters
    ----------
    hint : Any

    Returns
    -------
    tuple
    """
    flat: list[Any] = []
    for part in get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,):
        flat += members(part) if get_origin(part) in (Union, types.UnionType) else [part]
    if set(flat) >= _ARRAY:
        flat = [FloatArray, *(part for part in flat if part not in _ARRAY)]
    return tuple(dict.fromkeys(part for part in flat if part is not type(None)))


def _protocol(member: Any) -> bool:
    return bool(getattr(member, "_is_protocol", False))


def concrete(some: Sequence[Any]) -> list[type]:
    """Alternatives of a union type that are dataclasses.

    Parameters
    ----------
    some : sequence of types

    Returns
    -------
    list of type
    """
    return [part for part in some if dataclasses.is_dataclass(part) and isinstance(part, type)]


def _fits(made: type, member: Any) -> bool:
    """Whether what is of one class is of a type, too."""
    if _protocol(member):
        fields = {field.name for field in dataclasses.fields(made)}
        public = {name: value for name, value in vars(member).items() if not name.startswith("_")}
        return all(
            callable(getattr(made, name, None)) if callable(value) else name in fields or hasattr(made, name)
            for name, value in public.items()
        )
    if get_origin(member) is get_origin(Callable[[], None]):
        call, (arguments, result) = vars(made).get("__call__"), get_args(member)
        return call is not None and [*get_type_hints(call, localns=NAMES).values()] == [*arguments, result]
    return isinstance(member, type) and issubclass(made, member)


def _offered(source: str) -> Iterator[tuple[str, Any]]:
    """Public names that a module defines or a door offers, with their values."""
    module = import_module(f"fringetrace.{source}")
    for name in getattr(module, "__all__", vars(module)):
        value = getattr(module, name)
        if not name.startswith("_") and getattr(value, "__module__", "").startswith(module.__name__):
            yield name, value


@functools.cache
def _vocabulary() -> dict[str, list[tuple[Kind, type]]]:
    """By name: public kinds, and what they make."""
    found: dict[str, list[tuple[Kind, type]]] = {}
    for name, value in (pair for source in SOURCES for pair in _offered(source)):
        made = None
        if value is Interferometer:  # benches are made by the functions that return one
            continue
        if inspect.isclass(value) and dataclasses.is_dataclass(value):
            made = value
        elif inspect.isfunction(value):
            made = NAMES.get(str(value.__annotations__.get("return")))
        if made is not None:
            found.setdefault(name, []).append((value, made))
    return found


@functools.cache
def _kinds(some: tuple[Any, ...]) -> dict[str, Kind]:
    known = {
        name: kind
        for name, candidates in _vocabulary().items()
        for kind, made in candidates
        if any(_fits(made, member) for member in some)
    }
    return {**known, **{part.__name__: part for part in concrete(some) if part not in (Interferometer, Mesh)}}


def kinds(some: Sequence[Any]) -> dict[str, Kind]:
    """Kinds of objects that may stand where a value of some types is expected.

    Parameters
    ----------
    some : sequence of types

    Returns
    -------
    dict of classes and functions
        By name.
    """
    return _kinds(tuple(some))


def call(kind: Kind, arguments: Mapping[str, Any]) -> Any:
    """Call a dataclass or a function with arguments by name, `*args` among them.

    Parameters
    ----------
    kind : class or function
    arguments : dict

    Returns
    -------
    Any
    """
    bound = inspect.BoundArguments(inspect.signature(kind), dict(arguments))
    return kind(*bound.args, **bound.kwargs)


@dataclass(frozen=True, eq=False)
class Recipe:
    """Interferometer given by its name and arguments.

    Parameters
    ----------
    name : str
        One of the functions of `fringetrace.instruments.michelson_bench`.
    arguments : dict
        As the function takes them.

    Raises
    ------
    ValueError
        If there is no such bench, or it takes no such argument.
    """

    name: str
    arguments: Mapping[str, Any]

    __repr__ = short_repr

    def __post_init__(self) -> None:
        known = kinds([Interferometer])
        if self.name not in known:
            raise ValueError(f"bench type: {choice(self.name, known)}")
        for name in self.arguments:
            if name not in parameters(known[self.name]):
                raise ValueError(f"{self.name} {name}: {choice(name, parameters(known[self.name]))}")

    @functools.cached_property
    def bench(self) -> Interferometer:
        """Build the interferometer."""
        bench: Interferometer = call(kinds([Interferometer])[self.name], self.arguments)
        return bench
