"""Coherent sum on the pixels: complex field, irradiance and mutual intensity of traced paths."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, groupby
from typing import Protocol

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, FloatArray, checked_wavelength
from fringetrace.field.checks import warn_of_aliasing
from fringetrace.field.ray_sum import RaySum
from fringetrace.scene import Beam, Scene, Spectrum
from fringetrace.tracing import Paths, at_wavelength, join, needs


class PixelLight(Protocol):
    """Protocol of light on the pixels of a CCD, by wavefronts or by a ray sum."""

    def complex_field(
        self, wavelength: float, groups: npt.ArrayLike | None = None, half_wave_loss: bool = True
    ) -> ComplexArray:
        """Complex field, averaged over each pixel; see `complex_field`."""

    def irradiance(self, light: float | Spectrum, half_wave_loss: bool = True) -> FloatArray:
        """Irradiance, averaged over each pixel; see `irradiance`."""

    def mutual_intensity(
        self, light: float | Spectrum, groups: npt.ArrayLike, half_wave_loss: bool = True
    ) -> ComplexArray:
        """Mutual intensity, averaged over each pixel; see `mutual_intensity`."""


METHODS = ("auto", "facets", "wavefront", "rays")
# A wavefront is worth its while where so many rays of the beam share a facet, or facets are so few.
SHARING, FEW = 16, 64
# What methods take on a core, seconds: a facet and a pixel of "facets", a plane wave and a ray of the beam
# of "wavefront", a ray of "rays". "auto" starts nothing that takes over `LONGEST`.
FACET, PIXEL, WAVE, RAY = 1e-5, 3e-6, 1e-6, 1e-7
LONGEST = 600.0


@dataclass(frozen=True)
class Choice:
    """A method of the coherent sum, why it is taken, and about how long it takes, in seconds."""

    method: str
    why: str
    seconds: float

    def __str__(self) -> str:
        return f"{self.method}: {self.why}; about {max(self.seconds, 1.0):.0f} s"


def choose(paths: Paths, method: str = "auto") -> Choice:
    """Choose a method for the coherent sum by what it can do and what it costs.

    "facets" where surfaces are flat facets with constant amplitudes: it is exact, and its time grows with
    the facets. Else "wavefront" for a `Beam` whose rays are at least `SHARING` times as many as the flat
    facets of the scene (coplanar triangles are one; surfaces with a form have none), or where those are
    `FEW`, if it takes less than `LONGEST`; else "rays", as behind elements that tear waves.

    Parameters
    ----------
    paths : Paths
    method : {"auto", "facets", "wavefront", "rays"}

    Returns
    -------
    Choice

    Raises
    ------
    ValueError
        For any other method, for "facets" with surfaces that are none, or for "wavefront" behind elements
        that tear waves.
    """
    from fringetrace.field.facet_waves import prevented

    if method not in METHODS:
        raise ValueError(f"method: expected one of {METHODS}, got {method!r}")
    tears, why = torn(paths), prevented(paths)
    if method == "wavefront" and tears:
        raise ValueError(f"method: expected 'rays' behind {tears}, which tears wavefronts, got 'wavefront'")
    if method == "facets" and why:
        raise ValueError(f"method: expected 'wavefront' or 'rays' with {why}, got 'facets'")
    pixels = 0 if paths.ccd is None else math.prod(paths.ccd.shape)
    faces = sum(len(surface.mesh.faces) for surface in paths.scene.surfaces)
    rays = math.prod(paths.source.shape) if isinstance(paths.source, Beam) else 0
    asked = "asked for" if method != "auto" else None
    if method == "facets" or (method == "auto" and why is None):
        return Choice("facets", asked or f"exact for {faces:,} flat facets", faces * FACET + pixels * PIXEL)
    summed = Choice("rays", asked or (f"{tears} tears waves" if tears else f"{why}"), len(paths) * RAY)
    if method == "rays" or (method == "auto" and (tears or rays == 0 or pixels == 0)):
        return summed
    waves = _flat_facets(paths.scene, max(FEW, rays // SHARING))
    seconds = waves * rays * WAVE + pixels * PIXEL
    if method == "auto" and waves > max(FEW, rays // SHARING):
        return replace(summed, why=f"{waves:,} flat facets or more for {rays:,} rays, with {why}")
    if method == "auto" and waves > FEW and seconds > LONGEST:
        return replace(summed, why=f"wavefronts off {waves:,} flat facets take {seconds:,.0f} s")
    return Choice("wavefront", asked or f"{waves:,} flat facets, with {why}", seconds)


def _flat_facets(scene: Scene, enough: int) -> int:
    """Number of flat facets, coplanar triangles as one; of triangles, if they are no more than enough."""
    from fringetrace.scene import group_facets

    flat = [number for number, surface in enumerate(scene.surfaces) if surface.form is None]
    faces = sum(len(scene.surfaces[number].mesh.faces) for number in flat)
    if faces <= enough:
        return faces
    parts = group_facets(scene)
    return int(sum(parts[number].max(initial=-1) + 1 for number in flat))


def torn(paths: Paths) -> str | None:
    """Name of a surface that tears wavefronts: an element that treats neighbouring rays differently.

    Parameters
    ----------
    paths : Paths

    Returns
    -------
    str or None
    """
    surfaces = paths.scene.surfaces
    return next((s.name for s in surfaces if s.interface.waves == "torn"), None)


def complex_field(
    paths: Paths | Iterable[Paths],
    wavelength: float,
    method: str = "auto",
    half_wave_loss: bool = True,
    groups: npt.ArrayLike | None = None,
) -> ComplexArray:
    """Complex field, averaged over each pixel of the CCD.

    Parameters
    ----------
    paths : Paths, or an iterable of them
        From `trace`, or chunk by chunk from `stream`; of several coherent beams, one after the other.
    wavelength : float, metres
        Vacuum wavelength. Another one needs no new trace, unless media bend it another way.
    method : {"auto", "facets", "wavefront", "rays"}
        "facets": a plane wave off each sequence of flat facets, cut where they and their shadows end;
        means over pixels are exact, see `FacetWaves`.
        "wavefront": neighbouring rays of a `Beam` with the same path span a sheet, whose mean field
        over each pixel is found; overlapping sheets add. See `irradiance`.
        "rays": the coherent sum E = sum of a exp(2 pi i OPL / wavelength) over the rays that fall
        in a pixel, each weighted with its beam area over the pixel's, so that a unit beam falling
        straight on the CCD gives |E|^2 = 1. Rays without an area have weight 1.
        "auto": the one that `choose` takes.
    half_wave_loss : bool
        False leaves out the factor -1 of each reflection off a mirror.
    groups : (paths,) int, optional
        A field for each group of paths, from 0 on; with "wavefront", paths of one key are of one group.

    Returns
    -------
    (rows, columns) complex128, or (groups, rows, columns)
        Of light with a polarisation (3, rows, columns), or (groups, 3, rows, columns): along the CCD's
        columns, rows and normal. A ray sum runs in the order of the rays: the same bits for any chunk size.

    Raises
    ------
    ValueError
        For a wavelength that is none, or goes another way than that of the trace; for an unknown method,
        paths without a CCD, or no paths at all;
        with "wavefront", for paths that are not of a beam; for groups that do not fit the paths.

    Warns
    -----
    FringetraceWarning
        If fringes alias, once of the same paths.
    """
    return light_on(_watched(paths, wavelength), wavelength, method).complex_field(
        wavelength, groups, half_wave_loss
    )


def mutual_intensity(
    paths: Paths | Iterable[Paths],
    light: float | Spectrum,
    groups: npt.ArrayLike,
    method: str = "auto",
    half_wave_loss: bool = True,
) -> ComplexArray:
    """Mutual intensity E_m conj(E_n) of groups of paths, averaged over each pixel.

    What a camera sees of groups whose phases are stepped by d_m is the sum of J_mn exp(i (d_m - d_n)).

    Parameters
    ----------
    paths, method, half_wave_loss
        As in `complex_field`.
    light : float or Spectrum
        A wavelength in metres, or several, whose mutual intensities add.
    groups : (paths,) int
        The group of each path, from 0 on; with "wavefront", paths of one key are of one group.

    Returns
    -------
    (groups, groups, rows, columns) complex128
        Hermitian; irradiances on the diagonal. With "rays" a pixel has no inside: E_m conj(E_n).

    Raises
    ------
    ValueError
        As in `complex_field`.

    Warns
    -----
    FringetraceWarning
        As in `complex_field`.
    """
    found = [
        share * one.mutual_intensity(part, groups, half_wave_loss)
        for share, part, one in _lights(_watched(paths, light), light, method)
    ]
    return np.asarray(np.sum(found, axis=0) if len(found) > 1 else found[0], dtype=np.complex128)


def irradiance(
    paths: Paths | Iterable[Paths],
    light: float | Spectrum,
    method: str = "auto",
    half_wave_loss: bool = True,
) -> FloatArray:
    """Irradiance |E|^2, averaged over each pixel of the CCD.

    Overlapping sheets add before the square is taken, at as many points of each pixel as their
    fringes ask for: the mean of |E|^2, not the square of the mean field.

    Parameters
    ----------
    paths, method, half_wave_loss
        As in `complex_field`. The irradiances of beams that are not coherent with each other add.
    light : float or Spectrum
        A wavelength in metres, or several, whose irradiances add.

    Returns
    -------
    (rows, columns) float64
        1 where a beam of unit irradiance falls straight on the CCD.

    Raises
    ------
    ValueError
        As in `complex_field`.

    Warns
    -----
    FringetraceWarning
        As in `complex_field`.
    """
    found = [
        share * one.irradiance(part, half_wave_loss)
        for share, part, one in _lights(_watched(paths, light), light, method)
    ]
    return np.asarray(np.sum(found, axis=0) if len(found) > 1 else found[0], dtype=np.float64)


def chosen(paths: Paths, method: str) -> str:
    """Method of the coherent sum, with "auto" resolved; see `choose`.

    Parameters
    ----------
    paths : Paths
    method : {"auto", "facets", "wavefront", "rays"}

    Returns
    -------
    {"facets", "wavefront", "rays"}

    Raises
    ------
    ValueError
        As `choose`.
    """
    return choose(paths, method).method


def light_on(paths: Paths | Iterable[Paths], wavelength: float, method: str = "auto") -> PixelLight:
    """Light of paths on their CCD by a chosen method, to be evaluated at a wavelength.

    Parameters
    ----------
    paths, wavelength, method
        As in `complex_field`.

    Returns
    -------
    PixelLight
        `FacetWaves` or `Wavefronts`, which are kept with the paths, or a `RaySum`.

    Raises
    ------
    ValueError
        As in `complex_field`.
    """
    wavelength = checked_wavelength(wavelength)
    first, parts = _first(paths)
    method = chosen(first, method)
    if method == "rays":
        return RaySum(at_wavelength(part, wavelength) for part in parts)
    # chunks of a stream are parts of one beam
    beams = [join(list(some)) for _, some in groupby(parts, lambda part: id(part.source))]
    if method == "facets":
        from fringetrace.field.facet_waves import reconstruct_facet_waves

        return reconstruct_facet_waves(beams[0] if len(beams) == 1 else beams)
    from fringetrace.field.wavefront.wavefronts import reconstruct

    return reconstruct(beams, wavelength)


def _watched(paths: Paths | Iterable[Paths], light: float | Spectrum) -> Iterator[Paths]:
    """The paths in turn, and a warning if fringes alias: of each chunk, or of all beams together."""
    parts = (paths,) if isinstance(paths, Paths) else paths
    for part in parts:
        yield part
        if not isinstance(parts, Sequence):
            warn_of_aliasing((part,), light)
    if isinstance(parts, Sequence):
        warn_of_aliasing(parts, light)


def _lights(
    paths: Paths | Iterable[Paths], light: float | Spectrum, method: str
) -> Iterator[tuple[float, float | Spectrum, PixelLight]]:
    """Parts of some light that are evaluated together: a factor, the part, and what brings it to the CCD."""
    if not isinstance(light, Spectrum):
        yield 1.0, light, light_on(paths, light, method)
        return
    parts = [paths] if isinstance(paths, Paths) else list(paths)
    first, _ = _first(parts)
    if needs(first.scene) is None and chosen(first, method) != "rays":
        yield 1.0, light, light_on(parts, float(light.wavelengths[0]), method)
        return
    for wavelength, share in zip(light.wavelengths.tolist(), light.weights.tolist(), strict=True):
        yield share, wavelength, light_on(parts, wavelength, method)


def _first(paths: Paths | Iterable[Paths]) -> tuple[Paths, Iterator[Paths]]:
    """The first of the paths, of which there is at least one, onto a CCD; and all of them."""
    rest = iter((paths,) if isinstance(paths, Paths) else paths)
    first = next(rest, None)
    if first is None:
        raise ValueError("field: expected at least one Paths, got none")
    if first.ccd is None:
        raise ValueError("field: expected paths traced onto a CCD, got paths without one")
    return first, chain([first], rest)
