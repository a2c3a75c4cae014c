"""Warning class of the package, given at the caller's line and once."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Mapping

PACKAGE = __name__.partition(".")[0]


class FringetraceWarning(UserWarning):
    """Warning that an image cannot be trusted: where, by how much, and the remedy."""


def warn(text: str) -> None:
    """Give a `FringetraceWarning` at the line that called into the package.

    Parameters
    ----------
    text : str

    Warns
    -----
    FringetraceWarning
    """
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == PACKAGE:
        frame, level = frame.f_back, level + 1
    warnings.warn(text, FringetraceWarning, stacklevel=level)


def warn_once(problems: Mapping[str, str], given: set[str]) -> None:
    """Warn of problems that were not warned of before.

    Parameters
    ----------
    problems : dict of str to str
        The text of each warning by its name.
    given : set of str
        Names of warnings given before; those given now are added.

    Warns
    -----
    FringetraceWarning
    """
    for name, text in problems.items():
        if name not in given:
            given.add(name)
            warn(text)
