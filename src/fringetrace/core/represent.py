"""Short representations of dataclasses: values in few digits, shapes of arrays, never their numbers."""

from __future__ import annotations

import types
from dataclasses import MISSING, fields, is_dataclass
from numbers import Complex, Integral
from typing import Any

import numpy as np

from fringetrace.core.units import unit_of

# A vector of up to so many numbers is written out, as are so many members of a sequence.
FEW = 3
# A representation, and that of a part of one, in characters.
LONGEST, PART = 240, 60


def length_text(metres: float) -> str:
    """Length with four digits in a fitting unit, such as "15.62 um"."""
    if not np.isfinite(metres):
        return f"{metres} m"
    name, unit = unit_of(metres)
    return f"{metres / unit:.4g} {name.replace('µ', 'u')}"


def short_repr(thing: Any) -> str:
    """Representation of a dataclass or named tuple by those of its values that are not the defaults.

    Parameters
    ----------
    thing : dataclass or NamedTuple

    Returns
    -------
    str
        At most some `LONGEST` characters, without the numbers of any array.
    """
    return described(thing, *(f"{name}={value_text(value)}" for name, value in _values(thing)))


def described(thing: Any, *parts: str) -> str:
    """Representation of a thing: the name of its class, and parts in parentheses; empty parts are left out.

    Parameters
    ----------
    thing : Any
    *parts : str

    Returns
    -------
    str
        At most some `LONGEST` characters.
    """
    return _clipped(f"{type(thing).__name__}({', '.join(filter(None, parts))})", LONGEST)


def _clipped(text: str, most: int) -> str:
    """Text of at most so many characters; of a longer one the beginning, and dots."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


def _values(thing: Any) -> list[tuple[str, Any]]:
    """Names and values of the fields that are shown."""
    if not is_dataclass(thing):
        return list(thing._asdict().items())
    found = []
    for field in fields(thing):
        value = getattr(thing, field.name, None)
        default = field.default
        same = value is default or (isinstance(value, (str, float, int)) and value == default)
        if field.init and field.repr and (default is MISSING or not same):
            found.append((field.name, value))
    return found


def value_text(value: Any) -> str:
    """Value in few characters: numbers in six digits, short vectors, shapes of arrays, names of functions."""
    if isinstance(value, np.ndarray):
        return _array(value)
    if isinstance(value, (bool, str)) or value is None:
        return _clipped(repr(value), PART)
    if isinstance(value, Integral):
        return str(int(value))
    if isinstance(value, Complex):
        return f"{complex(value):.6g}" if isinstance(value, (complex, np.complexfloating)) else f"{value:.6g}"
    if isinstance(value, (tuple, list)):
        if len(value) > FEW:
            return f"<{len(value)} items>"
        return _clipped(f"({', '.join(map(value_text, value))}{',' * (len(value) == 1)})", PART)
    if isinstance(value, dict):
        return f"<{len(value)} items>"
    if isinstance(value, (types.FunctionType, types.BuiltinFunctionType, types.MethodType)):
        return value.__qualname__.replace(".<locals>", "")
    return _clipped(repr(value), PART) if is_dataclass(value) else f"<{type(value).__name__}>"


def _array(value: np.ndarray[Any, Any]) -> str:
    """A short vector in full; of any other array shape and type."""
    if value.ndim == 0:
        return value_text(value.item())
    if value.ndim == 1 and 0 < len(value) <= FEW and value.dtype.kind in "fiuc":
        return f"({', '.join(f'{number + 0.0:.6g}' for number in value.tolist())})"
    return f"<{value.shape} {value.dtype}>"
