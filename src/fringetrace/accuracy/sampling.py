"""Sampling errors of a field: by the number of rays and by the quadrature in pixels, in waves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray
from fringetrace.field import centred, light_on, reconstruct, reconstruct_facet_waves
from fringetrace.scene import CCD, Beam, crop, pixels
from fringetrace.tracing import Paths

# Bands of the image that stand for all of it: their middles, in parts of its height, and pixel rows in each.
BANDS = (0.1, 0.5, 0.9)
ROWS = 4
# Pixel rows in each band for the ray sum, which has more to average.
MANY = 24
# Points a pixel, along either axis, that are more than enough: each makes the error many times less.
MORE = 4
# By halving the ray spacing an error falls as it is seen to, but no less than by 3 nor more than by 2^4.
LEAST_FALL, MOST_FALL = 3.0, 16.0


def _difference(fields: Sequence[ComplexArray], others: Sequence[ComplexArray]) -> float:
    """Fields less others, as waves of phase: see `budget.Budget`."""
    off = sum(float((np.abs(a - b) ** 2).sum()) for a, b in zip(fields, others, strict=True))
    all_ = sum(float((np.abs(a) ** 2).sum()) for a in fields)
    return math.sqrt(off / all_) / (2.0 * math.pi) if all_ > 0.0 else 0.0


def sample_bands(shape: tuple[int, int], height: int = ROWS) -> list[tuple[int, int]]:
    """Bands of pixel rows that represent all: near the lower end, the middle, the upper end.

    Parameters
    ----------
    shape : (rows, columns)
    height : int
        Rows of each band.

    Returns
    -------
    list of (first row, row after the last)
        All of them, if there are few.
    """
    rows = shape[0]
    if rows <= height * len(BANDS):
        return [(0, rows)]
    tops = [round(min(max(part * rows - 0.5 * height, 0.0), rows - height)) for part in BANDS]
    return [(top, top + height) for top in tops]


def _parts(ccd: CCD) -> list[CCD]:
    """Parts of a CCD that stand for all of it, for the ray sum."""
    return [crop(ccd, top, stop - top, ccd.shape[1]) for top, stop in sample_bands(ccd.shape, MANY)]


def _onto(paths: Paths, ccd: CCD) -> Paths:
    """The paths that arrive on a part of their CCD, as they are seen there."""
    at = pixels(ccd, paths.origin)
    inside = np.asarray(((at >= 0.0) & (at < ccd.shape)).all(axis=1))
    return replace(paths.where(inside), ccd=ccd)


def sampling_error(grids: Sequence[Paths], wavelength: float, steps: float = 0.0) -> float:
    """Sampling error of the wavefront method, from coarser grids of rays.

    The error falls from grid to grid as it is seen to fall, by 16 at most: the method's fourth order.

    Parameters
    ----------
    grids : sequence of Paths
        The same beam with ever fewer rays, half as many either way; three, or more.
    wavelength : float, metres
    steps : float
        How often the finest grid is to be halved until it is the one asked for.

    Returns
    -------
    float, waves; see `budget.Budget`
    """
    fields = [_in_bands(paths, wavelength) for paths in grids]
    change = [_difference(fine, coarse) for fine, coarse in pairwise(fields)]
    if change[0] == 0.0:
        return 0.0
    fall = min(max(change[1] / change[0], LEAST_FALL), MOST_FALL)
    return float(change[0] / (fall - 1.0) * fall**-steps)


def quadrature_error(paths: Paths, wavelength: float) -> float:
    """Quadrature error of the wavefront method, from more points along either axis of the pixels.

    Parameters
    ----------
    paths : Paths
    wavelength : float, metres

    Returns
    -------
    float, waves; see `budget.Budget`
    """
    return _difference(_in_bands(paths, wavelength), _in_bands(paths, wavelength, MORE))


def _in_bands(paths: Paths, wavelength: float, more: int = 0) -> list[ComplexArray]:
    """The mean field of pixels that stand for all, by wavefronts; with more points in each."""
    found = reconstruct(paths, wavelength)
    return [found.refined(wavelength, rows, more) for rows in sample_bands(found.ccd.shape)]


def spread_over_pixels(paths: Paths, wavelength: float) -> Paths:
    """Rays averaged as plane waves over their part of a pixel.

    Where there are n x n rays a pixel it has n x n parts. Each ray is continued to the centre of its
    part, see `centred`, and has its amplitude times sinc of the cycles over the part, along either side.

    Parameters
    ----------
    paths : Paths
        Detected.
    wavelength : float, metres

    Returns
    -------
    Paths
    """
    assert paths.ccd is not None
    assert paths.area is not None
    parts = max(1, round(paths.ccd.pitch / math.sqrt(paths.area)))
    cycles = paths.gradient @ np.transpose(paths.ccd.axes[:2]) * (paths.ccd.pitch / parts / wavelength)
    mean = np.sinc(cycles).prod(axis=1)
    return replace(centred(paths, parts), amplitude=paths.amplitude * mean)


def missed_error(paths: Paths) -> float:
    """Error of plane waves off facets: light that takes a way that no ray took, or lies in slivers, in waves.

    Parameters
    ----------
    paths : Paths
        Of a `Beam` onto a CCD, off flat facets.

    Returns
    -------
    float, waves; see `budget.Budget`
    """
    return math.sqrt(reconstruct_facet_waves(paths).missed) / (2.0 * math.pi)


def offset_error(paths: Paths, wavelength: float) -> float:
    """Offset error of the ray sum: rays count where they land, not as means over part of a pixel.

    Parameters
    ----------
    paths : Paths
    wavelength : float, metres

    Returns
    -------
    float, waves; see `budget.Budget`
    """
    assert paths.ccd is not None
    seen = paths.detected
    parts = [_onto(seen, ccd) for ccd in _parts(paths.ccd)]
    means = [_ray_sum(spread_over_pixels(part, wavelength), wavelength) for part in parts]
    return _difference(means, [_ray_sum(part, wavelength) for part in parts])


def count_error(paths: Paths, wavelength: float) -> float:
    """Counting error of the ray sum: pixels get more or fewer rays than their share of light.

    Every second ray either way, on pixels twice as large, against all of them: there are as many
    rays a pixel, so the smaller sum is off by as much as the image itself.

    Parameters
    ----------
    paths : Paths
        Of a `Beam`.
    wavelength : float, metres

    Returns
    -------
    float, waves; see `budget.Budget`
    """
    assert paths.ccd is not None
    assert isinstance(paths.source, Beam)
    seen, fields, others = paths.detected, [], []
    for ccd in _parts(paths.ccd):
        rows, columns = (n - n % 2 for n in ccd.shape)
        if rows == 0 or columns == 0:
            return 0.0
        all_ = _onto(seen, crop(ccd, 0, rows, columns, binning=2))
        row, column = np.divmod(all_.ray, paths.source.shape[1])
        few = all_.where(_even(row) & _even(column))
        assert few.area is not None
        few = replace(few, area=4.0 * few.area)
        fields.append(_ray_sum(spread_over_pixels(all_, wavelength), wavelength))
        others.append(_ray_sum(spread_over_pixels(few, wavelength), wavelength))
    return _difference(fields, others)


def _even(number: Array) -> npt.NDArray[np.bool_]:
    return np.asarray(number % 2 == 0)


def _ray_sum(paths: Paths, wavelength: float) -> ComplexArray:
    """Field by ray sum, of rays that are not the image's: whether their fringes alias is not asked."""
    return light_on(paths, wavelength, "rays").complex_field(wavelength)
