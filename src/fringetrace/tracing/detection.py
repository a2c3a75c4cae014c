"""Detection of paths on a CCD that they were not traced onto; field components of paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fringetrace.core import Array, ComplexArray, FloatArray
from fringetrace.scene import CCD, cross
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
    reach, _ = cross(ccd, paths.origin, paths.direction)
    beside = (paths.fate == Fate.LEFT) & np.isfinite(reach) & (paths.direction @ ccd.axes[2] < -FLATTEST)
    reach = np.where(beside, reach, 0.0)
    rows = np.flatnonzero(beside | (paths.fate == Fate.DETECTED))
    point = paths.origin[rows] + reach[rows, None] * paths.direction[rows]
    index = 1.0 if paths.index is None else paths.index[rows]
    return rows, point, paths.length[rows] + reach[rows] * index


def components(paths: Paths, ccd: CCD) -> ComplexArray:
    """Field components of each path on a CCD.

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
    reach, hit = cross(ccd, paths.origin, paths.direction)
    seen = hit & (paths.fate == Fate.LEFT)
    reach = np.where(seen, reach, 0.0)
    lengths = paths.lengths
    if lengths is not None:
        lengths = lengths.copy()
        lengths[seen, paths.medium[seen]] += reach[seen]  # type: ignore[index]
    return replace(
        paths,
        lengths=lengths,
        fate=np.where(seen, np.int8(Fate.DETECTED), paths.fate),
        length=paths.length + reach * (1.0 if paths.index is None else paths.index),
        origin=paths.origin + reach[:, None] * paths.direction,
        ccd=ccd,
    )
