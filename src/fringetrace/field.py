"""From arrivals to the complex field on the pixels."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fringetrace.paths import Paths, join, screen
from fringetrace.waves import ComplexArray, FloatArray, checked_wavelength

if TYPE_CHECKING:
    from fringetrace.regions import Region, Wave
    from fringetrace.sheets import Cells


def complex_field(
    paths: Paths | Iterable[Paths],
    wavelength: float,
    method: str = "rays",
    half_wave_loss: bool = True,
) -> ComplexArray:
    """Complex field on the pixels of the CCD.

    Parameters
    ----------
    paths : Paths, or an iterable of them
        From `trace`, or chunk by chunk from `stream`.
    wavelength : float, metres
        Vacuum wavelength. Another wavelength needs no new trace.
    method : {"rays", "wavefront"}
        "rays": the coherent sum E = sum of a exp(2 pi i OPL / wavelength) over the rays that fall
        in a pixel, each weighted with its beam area over the pixel's, so that a unit beam falling
        straight on the CCD gives |E|^2 = 1. Rays without an area have weight 1.
        "wavefront": neighbouring rays of a `Beam` with the same path span a sheet, whose mean field
        over each pixel is found; overlapping sheets add. See `irradiance`.
    half_wave_loss : bool
        False leaves out the factor -1 of each reflection off a mirror.

    Returns
    -------
    (rows, columns) complex128
        The sum runs in the order of the rays: the same bits for any chunk size.

    Raises
    ------
    ValueError
        For a wavelength that is none, an unknown method, paths without a CCD, or no paths at all;
        with "wavefront", for paths that are not of a beam.
    """
    from fringetrace import kernels

    period = checked_wavelength(wavelength)
    if method == "wavefront":
        return _wavefront(paths, wavelength, True, half_wave_loss)[0]
    if method != "rays":
        raise ValueError(f"method: expected 'rays' or 'wavefront', got {method!r}")
    total: ComplexArray | None = None
    for part in (paths,) if isinstance(paths, Paths) else paths:
        if part.ccd is None:
            raise ValueError("complex_field: expected paths traced onto a CCD, got paths without one")
        if total is None:
            total = np.zeros(part.ccd.shape, dtype=np.complex128)
        weight = 1.0 if part.area is None else part.area / part.ccd.pitch**2
        kernels.gather(
            part.fate, part.origin, part.length, part.amplitude, part.reflections, half_wave_loss,
            screen(part.ccd), part.ccd.pitch, weight, period, total,
        )  # fmt: skip
    if total is None:
        raise ValueError("complex_field: expected at least one Paths, got none")
    return total


def irradiance(paths: Paths | Iterable[Paths], wavelength: float, half_wave_loss: bool = True) -> FloatArray:
    """Irradiance averaged over each pixel of the CCD, from the sheets of a coherent beam.

    Overlapping sheets add before the square is taken, at as many points of each pixel as their
    fringes ask for: the mean of |E|^2, not the square of the mean field.

    Parameters
    ----------
    paths : Paths, or an iterable of them
        Of one `Beam`, from `trace`, or chunk by chunk from `stream`. Beams that are not coherent
        with each other have irradiances that add.
    wavelength : float, metres
        Vacuum wavelength. Another wavelength needs no new trace.
    half_wave_loss : bool
        False leaves out the factor -1 of each reflection off a mirror.

    Returns
    -------
    (rows, columns) float64
        1 where a beam of unit irradiance falls straight on the CCD.

    Raises
    ------
    ValueError
        For a wavelength that is none, paths without a CCD or not of a beam, or no paths at all.
    """
    return _wavefront(paths, wavelength, False, half_wave_loss)[1]


def _wavefront(
    paths: Paths | Iterable[Paths], wavelength: float, carrier: bool, half_wave_loss: bool
) -> tuple[ComplexArray, FloatArray]:
    """Mean field and mean irradiance of each pixel, from plane waves off facets and from curved sheets.

    `carrier` tells whether the mean field matters: then pixels are sampled for the whole slope of the
    phase; otherwise for the differences between the sheets that overlap.
    """
    from fringetrace import regions, sheets
    from fringetrace.quadrature import Samples, averaged, edges, fringes, gauss_order, samples

    parts = [paths] if isinstance(paths, Paths) else list(paths)
    if not parts:
        raise ValueError("wavefront: expected at least one Paths, got none")
    whole = join(parts)
    ccd, beam = sheets.checked(whole)
    period = checked_wavelength(wavelength)
    if not half_wave_loss:
        loss = 1.0 - 2.0 * (whole.reflections % 2)
        whole = replace(whole, amplitude=whole.amplitude * loss)
    plane, curved, segments = _sheets(whole, half_wave_loss)
    unit = beam.area / ccd.pitch**2

    def light(points: Samples, slope: FloatArray) -> ComplexArray:
        field = points.blank()
        for wave, region in plane:
            regions.spread(wave, region, beam, period, points, field, slope)
        for sheet in curved:
            sheets.spread(sheet, unit, period, points, field, slope)
        return field

    rows, columns = ccd.shape
    slope = np.tile([np.inf, -np.inf, np.inf, -np.inf], (rows * columns, 1))
    light(samples(np.ones(ccd.shape, dtype=np.int64), 0), slope)
    order = gauss_order(fringes(slope.reshape(rows, columns, 4), carrier) / period)
    return averaged(order, lambda points: light(points, np.empty((0, 4))), edges(segments, ccd.shape))


def _sheets(paths: Paths, half_wave_loss: bool) -> tuple[list[tuple[Wave, Region]], list[Cells], FloatArray]:
    """Plane waves, curved sheets, and the edges of both on the pixels."""
    from fringetrace import probes, regions, rims, sheets

    ccd, _ = sheets.checked(paths)
    if paths.points is not None and paths.triangle is None:  # arrivals that no facet stands for
        return [], [sheets.cells(sheet, ccd) for sheet in sheets.sheets(paths)], np.empty((0, 4))
    survey = probes.survey(paths, half_wave_loss)
    plane = list(regions.waves(survey))
    drawn = [wave.to_pixels(region.segments).reshape(-1, 4) for wave, region in plane]
    curved, rim = rims.curved(survey)
    return plane, curved, np.concatenate([rim, *drawn])
