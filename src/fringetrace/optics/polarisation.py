"""Polarisation: the names s, p and unpolarised, and Jones vectors.

s light has its electric field across the plane of incidence, p light in it, along direction x s. Where light
travels across parallel cylinders or rods, the plane of incidence is that across them: s is the field along
them. A `Beam` meets surfaces in planes of any direction: its Jones vector is along its columns and rows.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from fringetrace.core import ROUNDED, ComplexArray, filled

Polarisation = Literal["s", "p"]
PolarisationName = Literal["s", "p", "unpolarised"]
# None: light of one number a ray. A name, or Jones vectors of s and p.
PolarisationLike = str | npt.ArrayLike | None
# Jones vectors (s, p); of several the mean of the powers is taken.
JONES: dict[str, tuple[tuple[int, int], ...]] = {
    "s": ((1, 0),),
    "p": ((0, 1),),
    "unpolarised": ((1, 0), (0, 1)),
}


def check_polarisation(polarisation: str) -> None:
    """Check that the polarisation is "s" or "p"; else ValueError."""
    if polarisation not in ("s", "p"):
        raise ValueError(f"Polarisation: expected 's' or 'p', got {polarisation!r}")


def checked_jones(value: Any, what: str) -> ComplexArray:
    """Jones vector scaled to unit length.

    Parameters
    ----------
    value : (2,) complex
    what : str
        The name used in the error message.

    Returns
    -------
    (2,) complex128

    Raises
    ------
    ValueError
        If it is no vector of two finite numbers, or 0.
    """
    try:
        vector: ComplexArray = filled(value, np.complex128).copy()
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what} polarisation: expected two numbers, got {value!r}") from error
    size = float(np.linalg.norm(vector)) if vector.shape == (2,) else np.nan
    if not (np.isfinite(size) and size > 0.0):
        raise ValueError(f"{what} polarisation: expected a Jones vector of two numbers, got {value!r}")
    return vector if abs(size - 1.0) <= ROUNDED else vector / size


def jones_states(
    polarisation: PolarisationLike, shape: tuple[int, int], what: str
) -> list[tuple[ComplexArray | None, ...]]:
    """Jones vectors of the states of light whose powers make up a polarisation, for each incidence.

    Parameters
    ----------
    polarisation : None, "s", "p", "unpolarised", or (2,) or (theta, phi, 2) complex
    shape : (theta, phi)
        Counts of incidences.
    what : str
        The name used in the error message.

    Returns
    -------
    list of tuples of (2,) complex128, or None for light of one number a ray
        Amplitudes of s and p; an incidence after the other, theta-major.

    Raises
    ------
    ValueError
        For another name or shape, numbers that are not finite, or amplitudes that are both 0.
    """
    count = shape[0] * shape[1]
    if polarisation is None:
        return [(None,)] * count
    if isinstance(polarisation, str):
        if polarisation not in JONES:
            raise ValueError(
                f"{what} polarisation: expected {', '.join(JONES)} or amplitudes, got {polarisation!r}"
            )
        return [tuple(np.array(one, np.complex128) for one in JONES[polarisation])] * count
    given = np.asarray(polarisation, dtype=np.complex128)
    if given.shape not in ((2,), (*shape, 2)):
        raise ValueError(
            f"{what} polarisation: expected amplitudes of s and p of shape (2,) or {(*shape, 2)}, "
            f"got {given.shape}"
        )
    if not (np.isfinite(given).all() and given.any(axis=-1).all()):
        raise ValueError(f"{what} polarisation: expected finite amplitudes, not both 0, got others")
    return [(one,) for one in np.broadcast_to(given, (*shape, 2)).reshape(-1, 2)]
