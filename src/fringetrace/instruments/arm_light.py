"""Light of each arm on the pixels of an interferometer, from traced paths."""

from __future__ import annotations

import numpy as np

from fringetrace.core import ComplexArray
from fringetrace.field import centred, chosen, complex_field, light_on, mutual_intensity
from fringetrace.instruments.arms import Mark
from fringetrace.scene import Beam, Spectrum
from fringetrace.tracing import Paths


def arm_fields(paths: Paths, mark: Mark, wavelength: float, method: str) -> ComplexArray:
    """Mean fields on the pixels, one per count of a mark.

    Parameters
    ----------
    paths : Paths
        Of a `Beam` onto a CCD.
    mark : Mark
    wavelength : float, metres
    method : {"auto", "wavefront", "rays"}
        See `complex_field`.

    Returns
    -------
    (n, rows, columns) complex128, n at least 2; or (n, 3, rows, columns) of polarised light
    """
    if chosen(paths, method) == "rays":
        return ray_sums(paths, mark, wavelength)
    fields = complex_field(paths, wavelength, groups=mark.count(paths), method=method)
    return _padded(fields, 1)


def arm_mutual_intensity(paths: Paths, mark: Mark, light: float | Spectrum, method: str) -> ComplexArray:
    """Mutual intensity of the counts of a mark, averaged over each pixel.

    Parameters
    ----------
    paths, mark
        See `arm_fields`.
    light : float or Spectrum
        A wavelength in metres, or several at which light goes the same way.
    method : {"auto", "facets", "wavefront"}
        Not the sum of rays, which has no inside of pixels.

    Returns
    -------
    (n, n, rows, columns) complex128, n at least 2
        Summed over the components of polarised light.
    """
    return _padded(mutual_intensity(paths, light, groups=mark.count(paths), method=method), 2)


def ray_sums(paths: Paths, mark: Mark, wavelength: float) -> ComplexArray:
    """Fields by count of a mark as ray sums, each ray at the centre of its part of a pixel, see `centred`.

    Parameters
    ----------
    paths : Paths
        Of a `Beam` onto a CCD.
    mark : Mark
    wavelength : float, metres

    Returns
    -------
    (n, rows, columns) complex128, n at least 2; or (n, 3, rows, columns) of polarised light
    """
    assert isinstance(paths.source, Beam)
    assert paths.ccd is not None
    landed = paths.detected
    count = mark.count(landed)
    landed = centred(landed, max(1, paths.source.shape[1] // paths.ccd.shape[1]))
    orders = range(max(2, int(count.max(initial=0)) + 1))
    parts = (landed.where(count == order) for order in orders)
    return np.stack([light_on(part, wavelength, "rays").complex_field(wavelength) for part in parts])


def add_orders(one: ComplexArray, other: ComplexArray, axes: int = 1) -> ComplexArray:
    """Sum of two arrays of light with different numbers of counts along their first axes.

    Parameters
    ----------
    one, other : (n, ...) or (n, n, ...) complex128
    axes : {1, 2}
        How many axes are counts.

    Returns
    -------
    complex128, of the larger shape
    """
    few, many = sorted((one, other), key=len)
    total = many.copy()
    total[(slice(len(few)),) * axes] += few
    return total


def _padded(light: ComplexArray, axes: int) -> ComplexArray:
    """Light with at least two counts along each of its first axes; missing ones are dark."""
    missing = [(0, max(0, 2 - n)) for n in light.shape[:axes]]
    return np.pad(light, [*missing, *[(0, 0)] * (light.ndim - axes)])
