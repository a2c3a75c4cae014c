"""Warning about aliased fringes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, checked_wavelength, warn
from fringetrace.scene import CCD, Spectrum, pixel_indices
from fringetrace.tracing import Paths

# This part of the image may have fringes too fine for its pixels.
FEW = 0.01
# Rays in a part of the image, at the least, that tell the slopes of its waves.
ENOUGH = 4
NAME = "fringes alias"


def warn_of_aliasing(parts: Sequence[Paths], light: float | Spectrum) -> None:
    """Warn of aliased fringes, once.

    Parameters
    ----------
    parts : sequence of Paths
        Of coherent beams onto one CCD.
    light : float or Spectrum
        A wavelength in metres, or several: the shortest has the finest fringes.

    Warns
    -----
    FringetraceWarning
    """
    if not parts or any(NAME in part.warned for part in parts):
        return
    wavelength = float(light.wavelengths.min()) if isinstance(light, Spectrum) else light
    text = aliasing(parts, wavelength)
    if text is not None:
        for part in parts:
            part.warned.add(NAME)
        warn(text)


def aliasing(paths: Paths | Sequence[Paths], wavelength: float) -> str | None:
    """Aliased fringes: the phase between two waves changes by more than pi per pixel.

    Slopes are means over the rays of one path key, in parts of the image that are as small as the
    rays allow.

    Parameters
    ----------
    paths : Paths, or a sequence of them
        Onto a CCD, of one beam, or of several coherent ones.
    wavelength : float, metres

    Returns
    -------
    str or None
    """
    wavelength, parts = checked_wavelength(wavelength), [paths] if isinstance(paths, Paths) else list(paths)
    kept = parts[0].derived if len(parts) == 1 else {}
    if NAME not in kept:
        kept[NAME] = _path_steps([part.detected for part in parts])
    step, lit, size = kept[NAME]
    cycles = step / wavelength
    bad = int((cycles > 0.5).sum())
    if bad <= FEW * lit:
        return None
    ccd = _ccd(parts[0])
    pixels = ccd.shape[0] * ccd.shape[1]
    worst = int(np.argmax(cycles))
    row, column = (n * size + size // 2 for n in divmod(worst, -(-ccd.shape[1] // size)))
    return (
        f"fringes alias: the phase steps by more than pi a pixel at {min(bad * size**2, pixels):,} of "
        f"{pixels:,} pixels, by {2.0 * cycles[worst]:.3g} pi about [{row}, {column}]; "
        f"take {np.ceil(2.0 * cycles[worst]):.0f} times as many pixels along either axis, or less tilt"
    )


def _path_steps(parts: Sequence[Paths]) -> tuple[FloatArray, int, int]:
    """Metres of path difference a pixel in parts of the image; how many are lit; their pixels a side."""
    ccd = _ccd(parts[0])
    waves, count = _waves(parts)
    if count < 2:
        return np.zeros(1), 1, 1
    rays = int(np.bincount(waves).max())
    size = max(1, int(np.ceil(np.sqrt(ENOUGH * ccd.shape[0] * ccd.shape[1] / rays))))
    rows, columns = (-(-n // size) for n in ccd.shape)
    at = np.concatenate([pixel_indices(ccd, part.pixel) for part in parts]) // size
    part = at[:, 0] * columns + at[:, 1]
    group, member, number = np.unique(part * count + waves, return_inverse=True, return_counts=True)
    step = np.zeros(rows * columns)
    for axis in ccd.axes[:2]:
        slope = np.concatenate([part.gradient @ axis for part in parts])
        mean = np.bincount(member.ravel(), slope) / number
        low, high = np.full(len(step), np.inf), np.full(len(step), -np.inf)
        np.minimum.at(low, group // count, mean)
        np.maximum.at(high, group // count, mean)
        step = np.maximum(step, np.where(high > low, high - low, 0.0) * ccd.pitch)
    return step, len(np.unique(group // count)), size


def _waves(parts: Sequence[Paths]) -> tuple[npt.NDArray[np.int64], int]:
    """Number of the wave that each path belongs to, of one beam and one path key, and how many there are."""
    key, sources = np.concatenate([part.key for part in parts]), [id(part.source) for part in parts]
    wave, count = np.zeros(len(key), dtype=np.int64), 0
    if len(set(sources)) == 1 and (key == key[:1]).all():  # told without sorting
        return wave, min(len(key), 1)
    for source in dict.fromkeys(sources):
        own = np.repeat([one == source for one in sources], [len(part) for part in parts])
        keys = np.unique(key[own])
        wave[own] = count + np.searchsorted(keys, key[own])
        count += len(keys)
    return wave, count


def _ccd(paths: Paths) -> CCD:
    if paths.ccd is None:
        raise ValueError("checks: expected paths traced onto a CCD, got paths without one")
    return paths.ccd
