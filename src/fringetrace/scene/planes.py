"""Axes of a plane in space, and the checks of sizes and grids on it."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Real
from typing import Any

import numpy as np

from fringetrace.core import (
    FloatArray,
)

PlaneAxes = tuple[FloatArray, FloatArray, FloatArray]


def checked_positive(value: float, what: str) -> float:
    """Checked finite positive length in metres."""
    if not (isinstance(value, Real) and np.isfinite(value) and value > 0.0):
        raise ValueError(f"{what}: expected a positive length in metres, got {value!r}")
    return float(value)


def checked_size(size: Any, what: str) -> tuple[float, float]:
    """Checked (width, height), two positive lengths in metres."""
    sides = tuple(size) if isinstance(size, Iterable) else (size,)
    if len(sides) != 2:
        raise ValueError(f"{what} size: expected (width, height) in metres, got {size!r}")
    return checked_positive(sides[0], f"{what} width"), checked_positive(sides[1], f"{what} height")


def checked_grid(shape: Any, what: str) -> tuple[int, int]:
    """Checked (rows, columns), two positive whole numbers."""
    grid = tuple(shape) if isinstance(shape, Iterable) else (shape,)
    if len(grid) != 2 or not all(isinstance(n, (int, np.integer)) and n > 0 for n in grid):
        raise ValueError(f"{what}: expected two positive whole numbers (rows, columns), got {shape!r}")
    return int(grid[0]), int(grid[1])
