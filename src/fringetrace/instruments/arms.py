"""Arms of an interferometer: which light a phase step shifts, and the slope of a tilted wave."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.tracing import Paths


@dataclass(frozen=True)
class Mark:
    """Marker of an arm: counts how often light met a surface.

    Parameters
    ----------
    surface : int
        Number of the surface in its scene.
    branch : int, optional
        Counts only where light left it so: 0 reflected, 1 transmitted (or by the first branch of a thin
        element), 2 and on by its further branches. None: however.
    then : int, optional
        Counts only where this is the next surface, as at the entrance of a cavity.
    sense : {1, -1}
        A phase step of delta multiplies light with a count of m by exp(i sense m delta).
    """

    surface: int
    branch: int | None = None
    then: int | None = None
    sense: int = 1

    def count(self, paths: Paths) -> npt.NDArray[np.int64]:
        """Number of times each path met the marked surface.

        Parameters
        ----------
        paths : Paths

        Returns
        -------
        (m,) int64

        Raises
        ------
        ValueError
            If a path has too many bounces for its key to tell.
        """
        digits, which = paths.kinds()
        mine = np.isin(digits, self._digits(paths, self.surface, self.branch))
        if self.then is not None:
            after = np.isin(digits, self._digits(paths, self.then, None))
            mine[:, :-1] &= after[:, 1:]
            mine[:, -1:] = False
        return np.asarray(mine.sum(axis=1)[which], dtype=np.int64)

    @staticmethod
    def _digits(paths: Paths, surface: int, branch: int | None) -> list[int]:
        """Digits of path keys that stand for a surface, or for one of its branches."""
        mine = [number for number, (there, _) in enumerate(paths.scene.digits, start=1) if there == surface]
        return mine if branch is None else mine[branch : branch + 1]


def path_slope(tilt: tuple[float, float]) -> tuple[float, float]:
    """Slope of the optical path of a beam off a tilted plane mirror, on a plane across the beam.

    A mirror tilted by a turns the beam by 2a; the plane wave's path then rises by sin 2a a
    metre in the direction of the tilt.

    Parameters
    ----------
    tilt : (tilt_x, tilt_y), radians

    Returns
    -------
    (slope_x, slope_y), metres a metre
    """
    angle = math.hypot(*tilt)
    scale = math.sin(2.0 * angle) / angle if angle > 0.0 else 2.0
    return scale * tilt[0], scale * tilt[1]
