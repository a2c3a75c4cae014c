"""Circles in a plane: cross-sections of rods and cylinders."""

from __future__ import annotations

import numpy as np

from fringetrace.core import FloatArray


def check_circles_apart(centres: FloatArray, radii: FloatArray, what: str) -> None:
    """Check that no two circles overlap; they may touch.

    Parameters
    ----------
    centres : (n, 2) float64, metres
    radii : (n,) float64, metres
    what : str
        The name used in the error message.

    Raises
    ------
    ValueError
        If two overlap; names the worst pair.
    """
    from scipy.spatial import cKDTree

    pairs = cKDTree(centres).query_pairs(2.0 * radii.max(), output_type="ndarray")
    i, j = pairs.T
    gap = np.hypot(*(centres[i] - centres[j]).T) - radii[i] - radii[j]
    if np.any(gap < 0):
        worst = gap.argmin()
        raise ValueError(
            f"{what}: expected them apart, got {i[worst]} and {j[worst]} overlapping by {-gap[worst]:.3g} m"
        )
