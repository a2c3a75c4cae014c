"""Compiled coherent sum of detected rays on the pixels."""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit
from fringetrace.scene import place
from fringetrace.tracing import DETECTED


@jit
def gather(fate, point, length, amplitude, reflections, loss, screen, pitch, weight, period, total):
    """Add weight * amplitude * exp(2 pi i length / period) of detected rays to their pixels, in order.

    The remainder is exact, so long paths cost no digits. Without `loss` the -1 of each reflection
    is left out.
    """
    rows, columns = total.shape
    for i in range(len(fate)):
        if fate[i] != DETECTED:
            continue
        v, u = place(screen, pitch, rows, columns, point[i, 0], point[i, 1], point[i, 2])
        turn = 2.0 * np.pi * ((length[i] % period) / period)
        phasor = complex(np.cos(turn), np.sin(turn)) * weight
        if not loss and reflections[i] % 2 == 1:
            phasor = -phasor
        # a point on the rim may round to the pixel beyond it
        row, column = min(max(int(np.floor(v)), 0), rows - 1), min(max(int(np.floor(u)), 0), columns - 1)
        total[row, column] += amplitude[i] * phasor
