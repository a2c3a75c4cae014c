"""Ray tubes: derivatives across a grid of rays, and the caustics they have passed (KMAH index)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray

# Stencils for a first derivative: where they begin, and their weights (Lagrange; exact to the order
# of their length less one). The longest that fits is taken, the most central first.
STENCILS = (
    (-2, (1 / 12, -8 / 12, 0.0, 8 / 12, -1 / 12)),
    (-1, (-3 / 12, -10 / 12, 18 / 12, -6 / 12, 1 / 12)),
    (-3, (-1 / 12, 6 / 12, -18 / 12, 10 / 12, 3 / 12)),
    (0, (-25 / 12, 48 / 12, -36 / 12, 16 / 12, -3 / 12)),
    (-4, (3 / 12, -16 / 12, 36 / 12, -48 / 12, 25 / 12)),
    (-1, (-0.5, 0.0, 0.5)),
    (0, (-1.5, 2.0, -0.5)),
    (-2, (0.5, -2.0, 1.5)),
    (0, (-1.0, 1.0)),
    (-1, (-1.0, 1.0)),
)


def differences(values: FloatArray, axis: int) -> FloatArray:
    """Derivative along an axis of a grid, of fourth order where five neighbours exist.

    Parameters
    ----------
    values : (rows, columns, ...) float64
        NaN where there is none.
    axis : {0, 1}

    Returns
    -------
    float64, shape of `values`
        A step of the grid is 1. NaN where a value or both of its neighbours are missing.
    """
    f = np.moveaxis(values, axis, 0)
    result = np.full(f.shape, np.nan)
    count = len(f)
    for begin, weights in STENCILS:
        if count < len(weights):
            continue
        # rows for which the whole stencil lies on the grid
        low, high = -begin, count - (begin + len(weights) - 1)
        if low >= high:
            continue
        # only the rows that no stencil before has filled
        open_ = np.isnan(result[low:high])
        rows = low + np.flatnonzero(open_.reshape(high - low, -1).any(axis=1))
        if len(rows) == 0:
            continue
        first, last = int(rows[0]), int(rows[-1]) + 1
        # 0 * NaN is NaN: a stencil with a hole in it gives none
        estimate = sum(w * f[first + begin + i : last + begin + i] for i, w in enumerate(weights))
        result[first:last] = np.where(open_[first - low : last - low], estimate, result[first:last])
    return np.asarray(np.moveaxis(result, 0, axis), dtype=np.float64)


def along_grid(values: FloatArray) -> FloatArray:
    """Derivatives along the columns and the rows of a grid.

    Parameters
    ----------
    values : (rows, columns, ...) float64
        NaN where there is none.

    Returns
    -------
    (rows, columns, 2, ...) float64
        As `differences`.
    """
    return np.stack([differences(values, 1), differences(values, 0)], axis=2)


def _across(direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors across each direction and each other."""
    least = np.argmin(np.where(np.isnan(direction), 0.0, np.abs(direction)), axis=-1)
    a = np.cross(direction, np.eye(3)[least])
    a /= np.linalg.norm(a, axis=-1, keepdims=True)
    return a, np.cross(direction, a)


def caustics(
    way: FloatArray, arrival: FloatArray, last: FloatArray, slopes: Callable[[FloatArray], FloatArray]
) -> npt.NDArray[np.int64]:
    """Caustics that each ray has passed (KMAH index), from principal wavefront curvatures.

    Between two surfaces the ray tube has the cross-section det(Q0 + s Q1), where Q0 and Q1 are the
    differentials of position and direction across the ray. Q1 Q0^-1 is the wavefront's curvature,
    symmetric; each principal section 1 + curvature * s that changes its sign is a caustic.

    Parameters
    ----------
    way : (n, m, k, 3) float64, metres
        Points of the path from its start to the plane of focus.
    arrival : (n, m, 3) float64, unit
        Direction of the last segment.
    last : (n, m) float64, metres
        Its length; negative where the plane of focus lies behind the last surface: what the relay
        images is the wave carried back, and caustics are taken back.
    slopes : callable
        Derivatives (n, m, 2, 3) of values (n, m, 3) along two coordinates, such as `along_grid`.

    Returns
    -------
    (n, m) int64
        0 where there is no path.
    """
    turns = np.zeros(last.shape, dtype=np.int64)
    for leg in range(way.shape[2] - 1):
        if leg < way.shape[2] - 2:
            step = way[:, :, leg + 1] - way[:, :, leg]
            reach = np.linalg.norm(step, axis=-1)
            # where faces touch a segment has no length: what it does to a tube is unknown, and nothing
            direction = np.divide(step, reach[..., None], where=reach[..., None] > 0.0, out=step * np.nan)
        else:
            direction, reach = arrival, last
        across = np.stack(_across(direction), axis=-2)
        start, turned = (
            np.einsum("...ij,...kj->...ik", across, slopes(f)) for f in (way[:, :, leg], direction)
        )
        known = np.isfinite(start).all(axis=(-1, -2)) & np.isfinite(turned).all(axis=(-1, -2))
        start[~known] = np.eye(2)
        known &= np.linalg.det(start) != 0.0
        start[~known], turned[~known] = np.eye(2), 0.0
        curvature = turned @ np.linalg.inv(start)
        principal = np.linalg.eigvalsh(0.5 * (curvature + np.swapaxes(curvature, -1, -2)))
        reach = np.where(known, reach, 0.0)
        passed = (1.0 + principal * reach[..., None] < 0.0).sum(axis=-1)
        turns += np.where(reach < 0.0, -passed, passed)
    return turns
