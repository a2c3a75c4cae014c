"""Paths leg by leg: the media they go through, optical path and phase from point to point."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray
from fringetrace.tracing.fates import Fate
from fringetrace.tracing.optics_table import constants, scene_media
from fringetrace.tracing.paths import Paths


def ways(paths: Paths) -> FloatArray:
    """Length of each leg; negative back from the last hit to the CCD's plane of focus.

    Parameters
    ----------
    paths : Paths
        Recorded, here and below.

    Returns
    -------
    (m, k - 1) float64, metres
        0 where there is no leg.
    """
    assert paths.points is not None
    assert paths.starts is not None
    legs = paths.points[:, 1:] - paths.starts
    way = np.linalg.norm(legs, axis=2)
    seen = np.flatnonzero(paths.fate == Fate.DETECTED)
    last = paths.bounces[seen]
    way[seen, last] = (legs[seen, last] * paths.direction[seen]).sum(axis=1)
    return np.asarray(np.nan_to_num(way), dtype=np.float64)


def media(paths: Paths) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.int64]]:
    """Whether light went on through each surface, and what it is in on each leg.

    Parameters
    ----------
    paths : Paths

    Returns
    -------
    through : (m, k - 2) bool
    medium : (m, k - 1) int64
        Number in `media.scene_media`.
    """
    assert paths.points is not None
    assert paths.surface is not None
    assert paths.triangle is not None
    assert paths.starts is not None
    scene, (rows, bounces) = paths.scene, paths.surface.shape
    numbers = {medium: number for number, medium in enumerate(scene_media(scene))}
    beside = np.array(
        [[numbers[s.front or scene.around], numbers[s.back or scene.around]] for s in scene.surfaces]
    )
    parts = np.array([surface.boundary for surface in scene.surfaces])
    through = np.zeros((rows, bounces), dtype=bool)
    medium = np.full((rows, bounces + 1), numbers[scene.around], dtype=np.int64)
    legs = paths.points[:, 1:] - paths.starts
    for bounce in range(bounces):
        met = np.flatnonzero(paths.surface[:, bounce] >= 0)
        surface = paths.surface[met, bounce]
        last = paths.bounces[met] == bounce + 1
        onward = np.where(last[:, None], paths.direction[met], legs[met, bounce + 1])
        normal = _normals(paths, surface, paths.triangle[met, bounce])
        out = (onward * normal).sum(axis=1)
        through[met, bounce] = out * (legs[met, bounce] * normal).sum(axis=1) > 0.0
        medium[:, bounce + 1] = medium[:, bounce]
        medium[met, bounce + 1] = np.where(
            parts[surface], beside[surface, (out < 0.0).astype(np.int64)], medium[met, bounce]
        )
    return through, medium


def _normals(paths: Paths, surface: Array, triangle: Array) -> FloatArray:
    """Normals of facets, not scaled."""
    normal = np.empty((len(surface), 3))
    for number in np.unique(surface):
        mine = np.flatnonzero(surface == number)
        mesh = paths.scene.surfaces[number].mesh
        a, b, c = np.moveaxis(mesh.vertices[mesh.faces[triangle[mine]]], 1, 0)
        normal[mine] = np.cross(b - a, c - a)
    return normal


def indices(paths: Paths, wavelength: float | None) -> FloatArray:
    """Real refractive indices of the media of a scene, by their numbers.

    Parameters
    ----------
    paths : Paths
    wavelength : float or None, metres

    Returns
    -------
    (media,) float64
    """
    at = 1.0 if wavelength is None else wavelength
    return np.array([complex(medium.index(at)).real for medium in scene_media(paths.scene)])


def _last(paths: Paths) -> npt.NDArray[np.int64]:
    """Number of the point of the last surface whose part is only known at the end; 0: there is none."""
    assert paths.surface is not None
    special = np.array([s.boundary or hasattr(s.interface, "act") for s in paths.scene.surfaces])
    met = (paths.surface >= 0) & special[paths.surface]
    last = np.where(met, np.arange(1, met.shape[1] + 1), 0).max(axis=1, initial=0)
    return np.asarray(last, dtype=np.int64)


def _brought(paths: Paths, name: str) -> Array:
    """What each ray brings along, `length` or `amplitude`; 0 if that is not said."""
    column = getattr(paths.source, name, None)
    return np.zeros(len(paths)) if column is None else column[paths.ray]


def _spread(paths: Paths, sums: FloatArray, total: FloatArray) -> FloatArray:
    """Sums along paths that end with their totals: what is missing is added from `_last` on."""
    assert paths.points is not None
    end = np.isfinite(paths.points[..., 0]).sum(axis=1) - 1
    rest = total - np.take_along_axis(sums, end[:, None], axis=1)[:, 0]
    late = np.arange(sums.shape[1]) >= _last(paths)[:, None]
    return np.asarray(sums + np.where(late, rest[:, None], 0.0), dtype=np.float64)


def opl(paths: Paths, way: FloatArray, medium: Array, wavelength: float | None) -> FloatArray:
    """Optical path from the start to each point.

    Parameters
    ----------
    paths : Paths
    way : (m, k - 1) float64, metres
    medium : (m, k - 1) int64
    wavelength : float or None, metres

    Returns
    -------
    (m, k) float64, metres
        The last one is that of the paths.
    """
    legs = way * indices(paths, wavelength)[medium]
    sums = np.cumsum(np.column_stack([_brought(paths, "length"), legs]), axis=1)
    return _spread(paths, sums, paths.length)


def turned(paths: Paths, through: Array) -> FloatArray:
    """By how much surfaces turned the phase up to each point.

    Parameters
    ----------
    paths : Paths
    through : (m, k - 2) bool

    Returns
    -------
    (m, k) float64, radians
        0 for polarised light. What boundaries, films and thin elements do is known in all: it stands behind
        the last of them that was met.
    """
    assert paths.surface is not None
    assert paths.points is not None
    turned = np.zeros(paths.points.shape[:2])
    if paths.field is not None:
        return turned
    reflection, transmission = constants(paths.scene)
    factor = np.where(through, transmission[paths.surface], reflection[paths.surface])
    turn = np.where((paths.surface >= 0) & (factor != 0.0), np.angle(factor), 0.0)
    turned += np.angle(_brought(paths, "amplitude"))[:, None]
    turned[:, 1:-1] += np.cumsum(turn, axis=1)
    turned[:, -1] = turned[:, -2]
    off = np.angle(paths.amplitude * np.exp(-1j * turned[:, -1]))  # 0 of no light
    return _spread(paths, turned, turned[:, -1] + off)
