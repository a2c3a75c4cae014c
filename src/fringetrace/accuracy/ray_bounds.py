"""Error bounds of single rays: rounding propagated from bounce to bounce along recorded paths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, checked_wavelength, short_repr
from fringetrace.tracing import Fate, Paths

# Half the distance between neighbouring numbers about 1: the largest relative rounding of float64.
ROUNDING = 0.5 * float(np.finfo(np.float64).eps)
# A bound is so many standard deviations: one ray in ten thousand may lie beyond.
DEVIATIONS = 4.0
# Paths followed at a time; bounds the memory.
CHUNK = 1 << 14


@dataclass(frozen=True, eq=False)
class Bounds:
    """Error bounds of single rays: position, direction and optical path.

    Attributes
    ----------
    position : (m,) float64, metres
        Of its end: on the CCD (on the plane that it is focused on), or at the last hit.
    direction : (m,) float64, radians
    length : (m,) float64, metres
        Of its optical path. Where the end has moved along the wave, the phase there has changed with
        it: the field stays right for longer, see `fringetrace.accuracy.path_errors.rounding`.
    """

    position: FloatArray
    direction: FloatArray
    length: FloatArray

    __repr__ = short_repr

    def known(self, wavelength: float, part: float = 0.01) -> npt.NDArray[np.bool_]:
        """Which paths have an optical path known to a part of the wavelength.

        Parameters
        ----------
        wavelength : float, metres
        part : float

        Returns
        -------
        (m,) bool
        """
        return np.asarray(self.length <= part * checked_wavelength(wavelength))


def bounds(paths: Paths) -> Bounds:
    """Propagate float64 rounding errors through the bounces of each path.

    Errors of position, direction and optical path are carried as a covariance by the linear map of
    each segment and bounce: dp' = dp + L dd, onto the surface along the ray; off a mirror
    dd' = R dd - 2 ((d.dn) n + (d.n) dn), dn = C dp, with the curvature C of the form, and alike by
    Snell's law: on a rod of radius r the error grows by about 1 + 2 L / (r cos) a bounce. Facets are
    flat: they let errors grow only with the way. Each point adds a rounding of its coordinates, each
    direction one of 1.

    Parameters
    ----------
    paths : Paths
        Traced with record=True.

    Returns
    -------
    Bounds

    Raises
    ------
    ValueError
        If the trace did not record them.
    """
    rows = np.arange(len(paths))
    starts = range(0, max(len(paths), 1), CHUNK)
    parts = [_carried(paths.where(rows[start : start + CHUNK])) for start in starts]
    return Bounds(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _carried(paths: Paths) -> tuple[FloatArray, FloatArray, FloatArray]:
    """`Bounds` of some paths. Rows and columns of the covariance: position, direction, optical path."""
    from fringetrace.tracing import Segments

    normal, bend = _tables(paths)
    segments = Segments.of(paths)
    index = segments.index
    length, direction = segments.length.astype(np.float64), segments.direction.astype(np.float64)
    assert paths.points is not None
    size = np.nanmax(np.abs(paths.points), axis=(1, 2)) * ROUNDING
    spread = np.zeros((len(paths), 7, 7))
    spread[:, 3:6, 3:6] = np.eye(3) * ROUNDING**2
    noise = np.stack([*[size] * 3, *[np.full(len(paths), ROUNDING)] * 3, np.zeros(len(paths))], axis=1)
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(int(paths.bounces.max(initial=0)) + 1):
            here = np.flatnonzero(paths.bounces >= k)
            last = paths.bounces[here] == k
            ends = last & (paths.fate[here] == Fate.DETECTED)
            here, ends = here[~last | ends], ends[~last | ends]
            across = np.where(ends[:, None], 0.0, normal[here, min(k, normal.shape[1] - 1)])
            if paths.ccd is not None:
                across[ends] = paths.ccd.axes[2]
            step = _flight(direction[here, k], length[here, k], across, index[here, k])
            if not ends.all():
                on = ~ends
                rows = here[on]
                turn = _turn(
                    direction[rows, k : k + 2], index[rows, k : k + 2], normal[rows, k], bend[rows, k]
                )
                step[on] = turn @ step[on]
            spread[here] = step @ spread[here] @ np.swapaxes(step, 1, 2)
            noise[here, 6] = ROUNDING * np.abs(length[here, : k + 1] * index[here, : k + 1]).sum(axis=1)
            spread[here] += np.einsum("ni,ij->nij", noise[here] ** 2, np.eye(7))
        sizes = (np.trace(spread[:, a:b, a:b], axis1=1, axis2=2) for a, b in ((0, 3), (3, 6), (6, 7)))
        position, turn, path = (DEVIATIONS * np.sqrt(np.nan_to_num(s, nan=np.inf)) for s in sizes)
    return position, turn, path


def _tables(paths: Paths) -> tuple[FloatArray, FloatArray]:
    """Normal (m, b, 3) and curvature (m, b, 3, 3) at each bounce; at least one column."""
    from fringetrace.accuracy.path_errors import curvature
    from fringetrace.tracing import surface_hits

    depth = max(1, int(paths.bounces.max(initial=0)))
    normal, bend = np.zeros((len(paths), depth, 3)), np.zeros((len(paths), depth, 3, 3))
    for hits in surface_hits(paths):
        normal[hits.path, hits.hit] = hits.normal
        bend[hits.path, hits.hit] = curvature(hits)
    return normal, bend


def _flight(direction: FloatArray, length: FloatArray, normal: FloatArray, index: FloatArray) -> FloatArray:
    """Maps (n, 7, 7) of errors over a segment, onto the plane that it ends on."""
    count = len(direction)
    facing = np.einsum("ni,ni->n", direction, normal)
    # onto the plane: q - d (n.q) / (n.d)
    onto = np.eye(3) - np.einsum("ni,nj->nij", direction, normal / facing[:, None])
    step = np.zeros((count, 7, 7))
    step[:, :3, :3], step[:, :3, 3:6] = onto, onto * length[:, None, None]
    step[:, 3:6, 3:6] = np.eye(3)
    step[:, 6, :3] = -normal * (index / facing)[:, None]
    step[:, 6, 3:6] = -normal * (index * length / facing)[:, None]
    step[:, 6, 6] = 1.0
    return step


def _turn(direction: FloatArray, index: FloatArray, normal: FloatArray, bend: FloatArray) -> FloatArray:
    """Maps (n, 7, 7) of errors at a bounce; `direction` (n, 2, 3), `index` (n, 2) before and after it.

    From n' d' = n d + G nu, G = n' c' - n c with cosines c to the normal nu (-2 n c off a mirror).
    """
    before, after = index[:, 0], index[:, 1]
    into, out = (np.einsum("ni,ni->n", direction[:, k], normal) for k in (0, 1))
    gain = after * out - before * into
    # d(n' c') = n^2 c / (n' c') dc
    change = before * (before * into / (after * out) - 1.0)
    lever = change[:, None, None] * np.einsum("ni,nj->nij", normal, direction[:, 0])
    lever += gain[:, None, None] * np.eye(3)
    step = np.tile(np.eye(7), (len(normal), 1, 1))
    step[:, 3:6, 3:6] = before[:, None, None] * np.eye(3)
    step[:, 3:6, 3:6] += change[:, None, None] * np.einsum("ni,nj->nij", normal, normal)
    step[:, 3:6, :3] = lever @ bend
    step[:, 3:6] /= after[:, None, None]
    return step
