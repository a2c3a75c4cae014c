"""Coplanar facets of a mesh, distinguished from nearly coplanar ones."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray

# Normals and heights of facets this near (relative to the mesh) may be those of one plane: where facets are
# small, rounding moves them by so much.
NEAR = 1e-9
# Vertices this far off a plane (relative to the mesh) are not in it: 6 fm on 6 mm, 1e-8 of a wave.
LEVEL = 1e-12
# Roundings of a vertex that has been turned and moved.
ROUNDINGS = 8.0 * float(np.finfo(np.float64).eps)
# Facets that share no plane are told apart by so many times finer steps of their normals.
FINER = 32.0

Parts = npt.NDArray[np.int64]


def planes(corners: FloatArray) -> Parts:
    """Number of the plane in which each facet of a mesh lies.

    Parameters
    ----------
    corners : (n, 3, 3) float64, metres
        Corners of each facet.

    Returns
    -------
    (n,) int64
        Equal for facets whose corners all lie in one plane, to `LEVEL` of the mesh or to the rounding of
        its coordinates; from 0 on.
    """
    if len(corners) == 0:
        return np.zeros(0, dtype=np.int64)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    size, rounding = float((high - low).max()), ROUNDINGS * float(np.abs(corners).max())
    # from here on relative to the mesh, about its middle
    local = (corners - 0.5 * (low + high)) / size
    area = np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0])
    normal = area / np.linalg.norm(area, axis=1, keepdims=True)
    height = np.einsum("ij,ij->i", normal, local[:, 0])
    part = _rows(_steps(np.column_stack([normal, height]), NEAR))
    step, rest = NEAR, np.flatnonzero(np.bincount(part)[part] > 1)
    while len(rest) and step > LEVEL / FINER:
        some = _numbered(part[rest])
        some, bent = _levels(some, local[rest], area[rest], rounding / size)
        step /= FINER
        steps = _steps(normal[rest[bent]], step)
        some[bent] = some.max() + 1 + _rows(np.column_stack([some[bent], steps]))
        part[rest] = part.max() + 1 + some
        rest = rest[bent]
    return _numbered(part)


def _steps(values: FloatArray, step: float) -> Parts:
    """Values in whole steps, off the middle between round numbers, where most designs have their planes."""
    return np.asarray(np.floor(values / step + 0.377), dtype=np.int64)


def _rows(rows: Parts) -> Parts:
    """Numbers from 0 on, equal for equal rows (n, k)."""
    return np.asarray(np.unique(rows, axis=0, return_inverse=True)[1].ravel(), dtype=np.int64)


def _numbered(numbers: Parts) -> Parts:
    """Numbers from 0 on, equal for equal ones."""
    return np.asarray(np.unique(numbers, return_inverse=True)[1].ravel(), dtype=np.int64)


def _levels(
    part: Parts, local: FloatArray, area: FloatArray, rounding: float
) -> tuple[Parts, npt.NDArray[np.bool_]]:
    """Parts split where they lie at several heights, and which facets (n,) are of a part that is bent."""
    offset, allowed = _offsets(part, local, area, rounding)
    if np.abs(offset).max() <= allowed.min():
        return part, np.zeros(len(part), dtype=np.bool_)
    tilted = np.ptp(offset, axis=1) > allowed
    bent = np.bincount(part, tilted)[part] > 0.0
    middle = np.where(bent, 0.0, offset.mean(axis=1))
    order = np.lexsort((middle, part))
    apart = (np.diff(part[order]) > 0) | (np.diff(middle[order]) > allowed[order][1:])
    split = np.empty_like(part)
    split[order] = np.concatenate([[0], np.cumsum(apart)])
    if split.max() > part.max():
        offset, allowed = _offsets(split, local, area, rounding)
    bent |= np.bincount(split, (np.abs(offset) > allowed[:, None]).any(axis=1))[split] > 0.0
    return split, bent


def _offsets(
    part: Parts, local: FloatArray, area: FloatArray, rounding: float
) -> tuple[FloatArray, FloatArray]:
    """How far corners (n, 3) are from the mean plane of their part, and what rounding allows (n,)."""
    double = np.linalg.norm(area, axis=1)
    one = np.empty(part.max() + 1, dtype=np.int64)
    one[part] = np.arange(len(part))  # some facet of each
    # a million facets are added up without their rounding: as what they differ from that one by
    facing, whole = area[one] / double[one, None], np.bincount(part, double)
    differing = area - double[:, None] * facing[part]
    turn = np.stack([np.bincount(part, differing[:, axis]) for axis in range(3)], axis=1)
    away = local - local[one, 0][part][:, None]
    offset = np.einsum("ijk,ik->ij", away, (facing + turn / whole[:, None])[part])
    offset -= (np.bincount(part, offset.mean(axis=1)) / np.bincount(part))[part][:, None]
    # the rounding of a facet's corners tilts it by that over its height: perimeter over twice the area
    around = np.bincount(part, np.abs(local - local[:, [1, 2, 0]]).sum(axis=(1, 2)))
    reach = np.zeros(len(one))
    np.maximum.at(reach, part, np.abs(away).max(axis=(1, 2)))
    return offset, np.maximum(LEVEL, rounding * (1.0 + 2.0 * reach * around / whole))[part]
