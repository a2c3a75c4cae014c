"""Bessel functions: ratios of neighbouring orders, where the functions underflow or overflow."""

from __future__ import annotations

import cmath
import math

import numpy as np
from numpy.typing import ArrayLike

from fringetrace.core import ComplexArray, jit

# Beyond the turning point, orders above |z| in units of its cube root and further ones, from which any start
# has been forgotten to 1e-16 when the recurrence is back at the turning point.
WIDTHS, MORE = 8.0, 20
# From here on Debye's expansion is exact to float64 after two terms, if |Im z| is above a few tens, and a
# recurrence from |z| down would take its time.
FAR, DAMPED = 1e8, 40.0
# Stands for a ratio at a zero of J, so that the next one may be divided by it.
TINY = 1e-100


def ratios(argument: ArrayLike, first: float, count: int) -> ComplexArray:
    """Ratios J_{v-1}(z) / J_v(z) for the orders v = first, first + 1, ...

    By downward recurrence (W. J. Lentz, Appl. Opt. 15, 668 (1976), has it as a continued fraction), which is
    stable for all z, and does not care that J_v is below 1e-308 or above 1e308.

    Parameters
    ----------
    argument : complex, any shape (...)
        z, not 0.
    first : float
        1 for cylindrical waves, 1/2 for spherical ones.
    count : int

    Returns
    -------
    (..., count) complex128
    """
    z = np.asarray(argument, np.complex128)
    out = np.empty((z.size, count), np.complex128)
    _downwards(np.ascontiguousarray(z.reshape(-1)), first, out)
    return out.reshape(*z.shape, count)


@jit
def _downwards(z, first, out):
    """Fill a table with `ratios`."""
    count = out.shape[1]
    for i in range(len(z)):
        size = abs(z[i])
        steps = count + MORE
        if size < FAR or abs(z[i].imag) < DAMPED:
            steps = max(count, math.ceil(size + WIDTHS * size ** (1.0 / 3.0))) + MORE
            ratio = 2.0 * (first + steps) / z[i]
        else:
            ratio = _debye(first + steps, z[i])
        for k in range(steps - 1, -1, -1):
            ratio = 2.0 * (first + k) / z[i] - 1.0 / (ratio if ratio != 0.0 else TINY + 0j)
            if k < count:
                out[i, k] = ratio


@jit
def _debye(order, z):
    """J_{v-1}(z) / J_v(z) far from the turning points, where one of two exponentials is all there is."""
    share = order / z
    square = 1.0 - share * share
    turn = 1j if z.imag < 0.0 else -1j
    return share + turn * cmath.sqrt(square) - 0.5 / (z * square)
