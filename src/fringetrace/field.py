"""From arrivals to the complex field on the pixels."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fringetrace.paths import Paths, screen
from fringetrace.waves import ComplexArray, checked_wavelength


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
    method : {"rays"}
        "rays": the coherent sum E = sum of a exp(2 pi i OPL / wavelength) over the rays that fall
        in a pixel, each weighted with its beam area over the pixel's, so that a unit beam falling
        straight on the CCD gives |E|^2 = 1. Rays without an area have weight 1.
    half_wave_loss : bool
        False leaves out the factor -1 of each reflection off a mirror.

    Returns
    -------
    (rows, columns) complex128
        The sum runs in the order of the rays: the same bits for any chunk size.

    Raises
    ------
    ValueError
        For a wavelength that is none, an unknown method, paths without a CCD, or no paths at all.
    """
    from fringetrace import kernels

    period = checked_wavelength(wavelength)
    if method != "rays":
        raise ValueError(f"method: expected 'rays', got {method!r}")
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
