"""Ray queries: which surface sequence light takes from any point of a beam, by new rays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray
from fringetrace.scene import CCD, Beam
from fringetrace.tracing import Paths, landed, launch_at, retrace

# Rays at the rim of the beam start this part of a cell inside it.
RIM = 1e-9
# Silhouettes, which single rays pass or hit, are known to this part of the scene's size.
FUZZ = 1e-8


@dataclass(frozen=True, eq=False)
class Probe:
    """Ray query for the surface sequences that light takes from points of the beam.

    `traced` are the paths whose scene is asked; `parts` are those of `group_facets`; `keys` the sequences
    that are looked at, of up to so many `bounces`; light fainter than `faintest` is not followed.
    """

    traced: Paths
    beam: Beam
    ccd: CCD
    parts: list[npt.NDArray[np.int64]]
    keys: npt.NDArray[np.uint64]
    bounces: int
    faintest: float

    @property
    def fuzz(self) -> FloatArray:
        """Uncertainty of edges in cells of the beam's grid: along columns, along rows."""
        bounds = np.stack([surface.mesh.bounds for surface in self.traced.scene.surfaces])
        size = float((bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)).max())
        cells = np.array(self.beam.shape[::-1]) / np.array(self.beam.size)
        return np.asarray(FUZZ * size * cells, dtype=np.float64)

    def paths(self, at: FloatArray) -> tuple[Paths, Array, npt.NDArray[np.uint64], npt.NDArray[np.bool_]]:
        """Trace from points of the beam's grid.

        Parameters
        ----------
        at : (n, 2) float64
            Columns and rows, in cells from the grid's corner.

        Returns
        -------
        paths : Paths
            `ray` is the number of the point; amplitudes without the beam's profile.
        rows : (m,) int64
            Those that cross the CCD's plane of focus.
        names : (m,) uint64
            One for each sequence of branches and parts of surfaces (a 64-bit hash).
        curved : (m,) bool
            Whether a surface with a form was met.
        """
        inside = np.clip(at, RIM, np.array(self.beam.shape[::-1]) - RIM)
        rays = launch_at(self.beam, inside[:, 0], inside[:, 1])
        paths = retrace(self.traced, rays, record=True, max_bounces=self.bounces, min_amplitude=self.faintest)
        rows, _, _ = landed(paths, self.ccd)
        rows = rows[np.isin(paths.key[rows], self.keys)]
        return paths, rows, *self._names(paths, rows)

    def _names(self, paths: Paths, rows: Array) -> tuple[npt.NDArray[np.uint64], npt.NDArray[np.bool_]]:
        assert paths.surface is not None
        assert paths.triangle is not None
        names, curved = paths.key[rows].copy(), np.zeros(len(rows), dtype=np.bool_)
        for bounce in range(paths.surface.shape[1]):
            # the table is as wide as its longest path
            there = np.flatnonzero(paths.bounces[rows] > bounce)
            surface, triangle = paths.surface[rows[there], bounce], paths.triangle[rows[there], bounce]
            part = np.zeros(len(there), dtype=np.int64)
            for number in np.unique(surface):
                mine = surface == number
                part[mine] = self.parts[number][triangle[mine]]
            curved[there] |= part < 0
            names[there] = _mixed(names[there] * np.uint64(0x9E3779B97F4A7C15) + part.astype(np.uint64))
        return names, curved

    def lit(self, at: FloatArray, names: npt.NDArray[np.uint64]) -> npt.NDArray[np.bool_]:
        """Whether light takes a sequence (n,) from a point (n, 2)."""
        if len(at) == 0:
            return np.zeros(0, dtype=np.bool_)
        paths, rows, found, _ = self.paths(at)
        ray = paths.ray[rows]
        lit = np.zeros(len(at), dtype=np.bool_)
        lit[ray[found == names[ray]]] = True
        return lit


def profile(beam: Beam, at: FloatArray) -> FloatArray:
    """Beam amplitude at points of its grid.

    Parameters
    ----------
    beam : Beam
    at : (n, 2) float64
        Columns and rows, in cells from the grid's corner.

    Returns
    -------
    (n,) float64
    """
    if beam.profile is None:
        return np.ones(len(at))
    x, y = ((at / beam.shape[::-1] - 0.5) * beam.size).T
    return np.asarray(np.broadcast_to(beam.profile(x, y), len(at)))


def _mixed(number: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    """Numbers scattered over 64 bits, one to one (Steele, Lea and Flood, OOPSLA 2014)."""
    number = (number ^ (number >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    number = (number ^ (number >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return number ^ (number >> np.uint64(31))
