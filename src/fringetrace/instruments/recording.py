"""Recorded irradiance of two arms, phase steps, and the optical path difference; arrays in, arrays out."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from fringetrace import phase
from fringetrace.core import ComplexArray, FloatArray
from fringetrace.instruments.arms import Arms

if TYPE_CHECKING:
    from fringetrace.core import Coordinates


def phase_shifts(steps: int) -> FloatArray:
    """Phase steps of the reference, frame by frame: equal steps over a period.

    Parameters
    ----------
    steps : int, at least 3

    Returns
    -------
    (steps,) float64, radians
        2 pi k / steps.

    Raises
    ------
    ValueError
        If there are fewer than 3 steps.
    """
    if steps < 3:
        raise ValueError(f"phase steps: expected at least 3, got {steps}")
    return np.asarray(2.0 * math.pi * np.arange(steps) / steps, dtype=np.float64)


def step_axis(steps: int) -> Coordinates:
    """Axis of phase-stepped frames, labelled, radians."""
    return {"step": (phase_shifts(steps), "rad")}


def recorded(mutual: ComplexArray, arms: Arms, step: float) -> FloatArray:
    """Irradiance on the pixels with a phase step on the reference.

    Parameters
    ----------
    mutual : (n, n, rows, columns) complex128
        Mutual intensities, see `mutual_intensity`.
    arms : Arms
    step : float, radians

    Returns
    -------
    (rows, columns) float64
    """
    turns = arms.phasors(step, len(mutual))
    # what rounding leaves of a dark pixel may be negative
    image = np.maximum(np.einsum("m,n,mnij->ij", turns, turns.conj(), mutual).real, 0.0)
    return np.asarray(image, dtype=np.float64)


def wrapped_phase(frames: FloatArray, mutual: ComplexArray) -> FloatArray:
    """Wrapped phase of the reference relative to the sample, from phase-stepped frames.

    Parameters
    ----------
    frames : (steps, rows, columns) float64
    mutual : (n, n, rows, columns) complex128

    Returns
    -------
    (rows, columns) float64, radians
        NaN where either arm brings no light.
    """
    lit = (mutual[0, 0] != 0.0) & (mutual[1, 1] != 0.0)
    return np.where(lit, phase.n_bucket(frames), np.nan)


def path_difference(wrapped: FloatArray, carrier: FloatArray, wavelength: float) -> FloatArray:
    """Optical path difference of the sample arm and the reference: carrier removed, unwrapped, scaled.

    Parameters
    ----------
    wrapped, carrier : (rows, columns) float64, radians
        Of the reference arm minus the sample's, and that part of it that the tilt makes.
    wavelength : float, metres

    Returns
    -------
    (rows, columns) float64, metres
        Up to a constant; NaN where `wrapped` is.

    Raises
    ------
    ValueError
        If there is no pixel with light from both arms.
    """
    if np.isnan(wrapped).all():
        raise ValueError("path difference: expected pixels with light from both arms, got none")
    continuous = phase.unwrap(phase.wrap(wrapped - carrier))
    return np.asarray(-phase.optical_path(continuous, wavelength), dtype=np.float64)
