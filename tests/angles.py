"""Angles compared modulo whole turns."""

import numpy as np


def turned(difference):
    """Difference of angles modulo 2 pi, as a magnitude (independent of phase.wrap)."""
    return np.abs(np.angle(np.exp(1j * np.asarray(difference))))
