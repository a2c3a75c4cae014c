"""Numba decorators of the compiled kernels, and growth of their tables."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

# No fast mathematics, here or in a caller (numba hands it on): a fused multiplication and addition
# would round the two sides of an edge differently, and rays would slip through. No wrappers for C, which
# nobody calls: they take a seventh of the time to compile.
COMPILED: dict[str, Any] = {
    "nogil": True, "cache": True, "error_model": "numpy", "no_cfunc_wrapper": True,
}  # fmt: skip

jit: Any = njit(**COMPILED)

# Makes no array, and counts no references to those it is given: a count is an atomic operation, which takes
# as long as the test of a box, and longer where threads share the array.
lean: Any = njit(**COMPILED | {"_nrt": False})

part: Any = njit(**COMPILED | {"forceinline": True})


@jit
def grown(table):
    """Copy of a full table with as many blank rows appended."""
    # an array put into a slice would take numba 7 s, for the text of an error that cannot happen
    larger = np.empty((2 * len(table), table.shape[1]), table.dtype)
    for row in range(len(table)):
        for column in range(table.shape[1]):
            larger[row, column] = table[row, column]
    return larger
