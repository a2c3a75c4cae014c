"""Results worked out from a scene once and kept with it, each typed by the function that makes it."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from threading import RLock
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar


class Derived:
    """Results kept with a scene, by function and arguments; copies and pickles of it start without."""

    def __init__(self) -> None:
        self.results: dict[tuple[Any, ...], Any] = {}
        self.lock = RLock()  # one result may be made from another

    def __reduce__(self) -> tuple[Any, ...]:
        return Derived, ()


class _Keeper(Protocol):
    """What keeps results: a scene."""

    @property
    def derived(self) -> Derived: ...


Keeper = TypeVar("Keeper", bound=_Keeper)
Options = ParamSpec("Options")
Result = TypeVar("Result")


def once_per_scene(
    make: Callable[Concatenate[Keeper, Options], Result],
) -> Callable[Concatenate[Keeper, Options], Result]:
    """Decorate a function of a scene: the result is made once, whichever thread asks, and kept with it.

    Parameters
    ----------
    make : callable
        Of a scene, and of further hashable arguments: each set of them has a result of its own.

    Returns
    -------
    callable
        The same function, which returns the same object every time.
    """
    signature = inspect.signature(make)

    @wraps(make)
    def kept(scene: Keeper, /, *args: Options.args, **kwargs: Options.kwargs) -> Result:
        given = signature.bind(scene, *args, **kwargs)
        given.apply_defaults()
        key = (make, *given.args[1:])
        with scene.derived.lock:
            if key not in scene.derived.results:
                scene.derived.results[key] = make(scene, *args, **kwargs)
            result: Result = scene.derived.results[key]
            return result

    return kept
