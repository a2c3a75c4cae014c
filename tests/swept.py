"""Functions that sweeps call in other processes, which find them by the name of this module."""

import os
import signal
from pathlib import Path

import numpy as np

from fringetrace.core import sweeps


def max_of(values):
    return np.max(values)


def dies_once(x, marks):
    """Kills its process at 2, the first time."""
    mark = Path(marks, "died")
    if x == 2.0 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return np.array([x**2, *(int(os.environ.get(name, 0)) for name in sweeps.THREADS)])
