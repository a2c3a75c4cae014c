"""Detection of paths on a CCD that they were not traced onto; field components of paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fringetrace.core import Array, ComplexArray, FloatArray, frame
from fringetrace.scene import CCD
from fringetrace.tracing.fates import Fate
from fringetrace.tracing.paths import Paths

# Light that meets the CCD's plane flatter than this (cosine) went along it, but for rounding.
FLATTEST = 1e-9


def landed(paths: Paths, ccd: CCD) -> tuple[Array, FloatArray, FloatArray]:
    """Paths that cross the CCD's plane of focus, on the CCD or beside it.

    Parameters
    ----------
    paths : Paths
    ccd : CCD

    Returns
    -------
    rows : (n,) int64
        Which paths: those detected, and those that left the scene towards the CCD's front.
    point : (n, 3) float64, metres
        In the plane of focus.
    length : (n,) float64, metres
        Optical path to there.
    """
    _, _, n = frame(ccd.normal, ccd.up, "CCD")
    facing = paths.direction @ n
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = ((ccd.centre - paths.origin) @ n) / facing
        beside = (paths.fate == Fate.LEFT) & (facing < -FLATTEST) & (reach > 0.0)
        reach = np.where(beside, reach + ccd.focus / facing, 0.0)
    rows = np.flatnonzero(beside | (paths.fate == Fate.DETECTED))
    point = paths.origin[rows] + reach[rows, None] * paths.direction[rows]
    index = 1.0 if paths.index is None else paths.index[rows]
    return rows, point, paths.length[rows] + reach[rows] * index


def components(paths: Paths, ccd: CCD) -> ComplexArray:
    """Field that each path brings to a CCD.

    Parameters
    ----------
    paths : Paths
    ccd : CCD

    Returns
    -------
    (1, m) complex128
        The amplitude; of polarised light (3, m), its components along the CCD's columns, rows and normal.
    """
    if paths.field is None:
        return paths.amplitude[None]
    return np.stack([paths.field @ axis for axis in ccd.axes])


def project(paths: Paths, ccd: CCD) -> Paths:
    """Detect the light that left a scene on a CCD beyond it, without a new trace.

    Parameters
    ----------
    paths : Paths
        Traced without a CCD.
    ccd : CCD
        Blocks nothing: light reaches it past any surface.

    Returns
    -------
    Paths
        Those that reach the CCD are detected there.

    Raises
    ------
    ValueError
        If the paths were traced onto a CCD already, or light left in a medium that absorbs.
    """
    if paths.ccd is not None:
        raise ValueError("project: expected paths traced without a CCD, got paths that have one")
    if paths.wavelength is not None and complex(paths.scene.around.index(paths.wavelength)).imag > 0.0:
        raise ValueError(f"project: expected a transparent medium, got {paths.scene.around.name}")
    u, v, n = ccd.axes
    facing = paths.direction @ n
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = ((ccd.centre - paths.origin) @ n) / facing
        ahead = (paths.fate == Fate.LEFT) & (facing < 0.0) & (reach > 0.0)
        reach = np.where(ahead, reach + ccd.focus / facing, 0.0)
    point = paths.origin + reach[:, None] * paths.direction
    offset = point - ccd.centre
    width, height = ccd.size
    x, y = offset @ u, offset @ v
    seen = ahead & (abs(x) <= 0.5 * width) & (x < 0.5 * width) & (abs(y) <= 0.5 * height) & (y < 0.5 * height)
    lengths = paths.lengths
    if lengths is not None:
        lengths = lengths.copy()
        lengths[seen, paths.medium[seen]] += reach[seen]  # type: ignore[index]
    return replace(
        paths,
        lengths=lengths,
        fate=np.where(seen, np.int8(Fate.DETECTED), paths.fate),
        length=np.where(
            seen, paths.length + reach * (1.0 if paths.index is None else paths.index), paths.length
        ),
        origin=np.where(seen[:, None], point, paths.origin),
        ccd=ccd,
    )
