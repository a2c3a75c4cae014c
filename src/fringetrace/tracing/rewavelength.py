"""Traced paths evaluated at another wavelength."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from fringetrace.core import ComplexArray, checked_wavelength
from fringetrace.scene import Surface
from fringetrace.tracing.fates import Fate
from fringetrace.tracing.optics_table import REFLECTED, followed_branches, needs, scene_media
from fringetrace.tracing.paths import Paths
from fringetrace.tracing.rays import Rays

if TYPE_CHECKING:
    from fringetrace.optics import Material


# Incidence (sin^2, rounded) up to which a boundary is met straight on, so that no wavelength is bent by it.
STRAIGHT = 1e-14
# A trace leaves out branches below its `min_amplitude`; at another wavelength these may have become so many
# times that, as indices drift, before it has to be traced again.
DRIFT = 10.0


def at_wavelength(paths: Paths, wavelength: float) -> Paths:
    """Paths at another wavelength, without a new trace.

    Optical paths follow from the way in each medium, amplitudes of boundaries met straight on from the
    key: wherever nothing is bent by another angle.

    Parameters
    ----------
    paths : Paths
    wavelength : float, metres

    Returns
    -------
    Paths

    Raises
    ------
    ValueError
        If the other wavelength goes another way, or media contradict; if the trace cut off branches that
        are bright at the other wavelength.
    """
    wavelength = checked_wavelength(wavelength)
    if paths.wavelength is None or paths.wavelength == wavelength or paths.lengths is None:
        return paths
    assert paths.bend is not None
    why, seen = needs(paths.scene), paths.fate == Fate.DETECTED
    if why is None:
        return paths.changed(wavelength=wavelength)
    if paths.contradictions is not None and paths.contradictions.any():
        raise ValueError(
            f"wavelength: expected that of the trace, {paths.wavelength:.6g} m, since rays came to surfaces "
            f"in media that these do not have there, got {wavelength:.6g} m: trace once a wavelength"
        )
    if (paths.bend[seen] > STRAIGHT).any():
        raise ValueError(
            f"wavelength: expected that of the trace, {paths.wavelength:.6g} m, since {why} and "
            f"light is bent, got {wavelength:.6g} m: trace once a wavelength"
        )
    known = scene_media(paths.scene)
    old, new = (np.array([complex(m.index(at)) for m in known]) for at in (paths.wavelength, wavelength))
    phase = 2.0 * math.pi * (new.imag / wavelength - old.imag / paths.wavelength)
    factor = np.exp(-(paths.lengths @ phase)) * _ratio(paths, wavelength)
    _check_cut(paths, factor, wavelength)
    return paths.changed(
        length=paths.length + paths.lengths @ (new.real - old.real),
        amplitude=paths.amplitude * (factor if paths.field is None else np.abs(factor)),
        field=None if paths.field is None else paths.field * factor[:, None],
        index=None if paths.medium is None else new.real[paths.medium],
        indices=None if paths.media is None else np.where(paths.media < 0, np.nan, new.real[paths.media]),
        wavelength=wavelength,
    )


def _ratio(paths: Paths, wavelength: float) -> ComplexArray:
    """Amplitudes of all boundaries met straight on, at a wavelength over those at the traced one."""
    assert paths.wavelength is not None
    keys, first, which = np.unique(paths.key, return_index=True, return_inverse=True)
    ratio = np.ones(len(keys), dtype=np.complex128)
    for number, row in enumerate(first):
        medium = paths.scene.around
        for name, through in paths.sequence(int(row)):
            surface = paths.scene.surfaces[name]
            if surface.boundary:
                new, beyond = _straight_on(surface, medium, paths.scene.around, wavelength, through)
                old, _ = _straight_on(surface, medium, paths.scene.around, paths.wavelength, through)
                ratio[number] *= new / old
                medium = beyond
    return np.asarray(ratio[which], dtype=np.complex128)


def _straight_on(
    surface: Surface, medium: Material, around: Material, wavelength: float, through: bool
) -> tuple[complex, Material]:
    """Amplitude of power of a boundary at normal incidence from a medium, and the medium behind it."""
    from fringetrace.optics import coefficients

    front, back = surface.front or around, surface.back or around
    film = surface.film
    if film is not None and front == back and film != film.reversed():
        raise ValueError(
            f"wavelength: expected that of the trace, since {surface.name} has a film that is not the same "
            f"from behind, between equal media, got {wavelength:.6g} m: trace once a wavelength"
        )
    if medium != front and film is not None:
        film = film.reversed()
    beyond = back if medium == front else front
    unit = coefficients(film, medium, beyond, 0.0, wavelength)
    if not through:
        return complex(unit.rs), medium
    before, behind = (complex(m.index(wavelength)).real for m in (medium, beyond))
    return complex(unit.ts) * math.sqrt(behind / before), beyond


def _check_cut(paths: Paths, factor: ComplexArray, wavelength: float) -> None:
    """Raise ValueError if branches that were cut off as faint are bright at another wavelength.

    `factor` (paths,) is what amplitudes change by. Those that were 0 to the last bit are not even there.
    """
    launched = paths.source.amplitude if isinstance(paths.source, Rays) else None
    unit = 1.0 if launched is None else float(np.abs(launched).max(initial=0.0))
    faint = paths.fate == Fate.FAINT
    brightest = float(np.abs(paths.amplitude[faint] * factor[faint]).max(initial=0.0))
    if brightest > DRIFT * paths.min_amplitude * unit:
        what = f"branches that it cut off have up to {brightest / unit:.2g} of the launched amplitude there"
    elif dark := _dark(paths, wavelength):
        what = f"{dark} sends back no light at all at that wavelength, but at the other"
    else:
        return
    raise ValueError(
        f"wavelength: expected that of the trace, {paths.wavelength:.6g} m, since {what}, got "
        f"{wavelength:.6g} m: trace once a wavelength"
    )


def _dark(paths: Paths, wavelength: float) -> str | None:
    """Name of a boundary that was met, and reflects nothing at the traced wavelength, but does at another."""
    assert paths.wavelength is not None
    around = paths.scene.around
    for number, surface in enumerate(paths.scene.surfaces):
        if surface.boundary and followed_branches(surface) & REFLECTED and paths.visits(number).any():
            front = surface.front or around
            old, new = (
                _straight_on(surface, front, around, at, False)[0] for at in (paths.wavelength, wavelength)
            )
            if old == 0.0 and new != 0.0:
                return surface.name
    return None
