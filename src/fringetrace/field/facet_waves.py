"""Plane waves off flat facets: found once by beam tracing, averaged over pixels exactly at any wavelength."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from threading import Lock

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray, checked_wavelength
from fringetrace.field import footprint_kernels as kernels
from fringetrace.field.beam_tracing import Footprints, follow_beam
from fringetrace.field.groups import grouped
from fringetrace.scene import CCD, Beam, Spectrum
from fringetrace.tracing import Fate, Paths, plain

# Bytes of facet waves that are kept with the paths.
KEPT = 1 << 30
# Bands of pixel rows that are averaged at a time.
BANDS = 64


@dataclass(frozen=True, eq=False)
class FacetWaves:
    """The plane waves that traced beams bring to a CCD off flat facets, at any wavelength.

    Attributes
    ----------
    ccd : CCD
    footprints : Footprints
        Those whose path key is that of a path.
    path : (n,) int64
        A path of the same key, for each.
    odd : (n,) bool
        Whether it was reflected an odd number of times off mirrors.
    begin : (pixels + 1,) int64
        Where the members of each pixel begin.
    member : (m,) int32
        Footprints that reach it.
    profile : (m, 5) float64, or (0, 5)
        Amplitude of the beam where the light of each member comes from, and its tilt, see `_linear`.
    paths : int
        Number of paths.
    missed : float
        Power of light that was not found or took a way that none of the paths took, as part of that detected.
    """

    ccd: CCD
    footprints: Footprints
    path: npt.NDArray[np.int64]
    odd: npt.NDArray[np.bool_]
    begin: npt.NDArray[np.int64]
    member: npt.NDArray[np.int32]
    profile: FloatArray
    paths: int
    missed: float

    def __repr__(self) -> str:
        return f"FacetWaves({len(self.footprints):,} plane waves, {len(self.member):,} parts of pixels)"

    @property
    def nbytes(self) -> int:
        """Memory that they take."""
        return self.footprints.nbytes + self.member.nbytes + self.profile.nbytes

    def complex_field(
        self, wavelength: float, groups: npt.ArrayLike | None = None, half_wave_loss: bool = True
    ) -> ComplexArray:
        """Mean of the complex field over each pixel.

        Parameters
        ----------
        wavelength : float, metres
        groups : (paths,) int, optional
            A field for each group of paths, from 0 on; paths of one key are of one group.
        half_wave_loss : bool
            False leaves out the factor -1 of each reflection off a mirror.

        Returns
        -------
        (rows, columns) complex128, or (groups, rows, columns)

        Raises
        ------
        ValueError
            For a wavelength that is none; for groups that do not fit.
        """
        mean, _ = self._averaged(checked_wavelength(wavelength), groups, half_wave_loss, True)
        return mean if groups is not None else np.ascontiguousarray(mean[0])

    def mutual_intensity(
        self, light: float | Spectrum, groups: npt.ArrayLike | None, half_wave_loss: bool = True
    ) -> ComplexArray:
        """Mean over each pixel of E_m conj(E_n), for the fields of groups of paths.

        Parameters
        ----------
        light : float or Spectrum
            A wavelength in metres, or several, whose mutual intensities add.
        groups, half_wave_loss
            As in `complex_field`.

        Returns
        -------
        (groups, groups, rows, columns) complex128

        Raises
        ------
        ValueError
            As in `complex_field`.
        """
        if not isinstance(light, Spectrum):
            return self._averaged(checked_wavelength(light), groups, half_wave_loss, False)[1]
        parts = zip(light.wavelengths.tolist(), light.weights.tolist(), strict=True)
        found = [share * self._averaged(one, groups, half_wave_loss, False)[1] for one, share in parts]
        return np.asarray(np.sum(found, axis=0), dtype=np.complex128)

    def irradiance(self, light: float | Spectrum, half_wave_loss: bool = True) -> FloatArray:
        """Mean of |E|^2 over each pixel.

        Parameters
        ----------
        light, half_wave_loss
            As in `mutual_intensity`.

        Returns
        -------
        (rows, columns) float64
            1 where a beam of unit irradiance falls straight on the CCD.

        Raises
        ------
        ValueError
            As in `complex_field`.
        """
        return np.ascontiguousarray(self.mutual_intensity(light, None, half_wave_loss)[0, 0].real)

    def _averaged(
        self, wavelength: float, groups: npt.ArrayLike | None, half_wave_loss: bool, carrier: bool
    ) -> tuple[ComplexArray, ComplexArray]:
        """Mean fields of groups (zeros without `carrier`), and means of their products."""
        numbers = np.zeros(self.paths, dtype=np.int64) if groups is None else grouped(groups, self.paths)
        count, (rows, columns) = int(numbers.max(initial=0)) + 1, self.ccd.shape
        group = numbers[self.path]
        sign = np.where(self.odd & (not half_wave_loss), -1.0, 1.0)
        mean = np.zeros((count, rows * columns), dtype=np.complex128)
        mutual = np.zeros((count, count, rows * columns), dtype=np.complex128)
        prints = self.footprints

        def band(rows: tuple[int, int]) -> None:
            kernels.means(
                *rows, columns, prints.corners, prints.first, self.begin, self.member, prints.wave, group,
                sign, self.profile, wavelength, carrier, mean, mutual,
            )  # fmt: skip

        edges = np.linspace(0, rows, min(rows, BANDS) + 1).astype(np.int64).tolist()
        with ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="fringetrace") as pool:
            list(pool.map(band, pairwise(edges)))
        return mean.reshape(count, rows, columns), mutual.reshape(count, count, rows, columns)


def prevented(paths: Paths) -> str | None:
    """What in a scene is not for plane waves off facets alone, in words; None if nothing is.

    Parameters
    ----------
    paths : Paths

    Returns
    -------
    str or None
    """
    beam, scene = paths.source, paths.scene
    if not isinstance(beam, Beam) or paths.ccd is None:
        return "light that is no beam onto a CCD"
    if paths.points is not None and paths.triangle is None:
        return "arrivals that no facet stands for"
    if beam.passes:
        return "a beam that passes over surfaces"
    formed = next((surface.name for surface in scene.surfaces if surface.form is not None), None)
    if formed is not None:
        return f"the form of {formed}"
    if not plain(scene, beam.polarisation is not None):
        return "media, elements or polarisation"
    return None


def reconstruct_facet_waves(paths: Paths | Iterable[Paths]) -> FacetWaves:
    """Plane waves of traced beams off flat facets, for fields and irradiances at any wavelength.

    Exact: beams are cut where facets, their shadows and the CCD end. What does not depend on the
    wavelength is found once, and kept with the paths.

    Parameters
    ----------
    paths : Paths, or an iterable of them
        Of a `Beam` onto a CCD, of surfaces with constant amplitudes and no form; of several coherent beams,
        one after the other.

    Returns
    -------
    FacetWaves

    Raises
    ------
    ValueError
        For anything else, or no paths.
    """
    if isinstance(paths, Paths):
        lock = paths.derived.setdefault("facet waves lock", Lock())  # the budget may ask at the same time
        with lock:
            if "facet waves" in paths.derived:
                kept: FacetWaves = paths.derived["facet waves"]
                return kept
            found = _reconstructed([paths])
            if found.nbytes <= KEPT:
                paths.derived["facet waves"] = found
            return found
    return _reconstructed(list(paths))


def _reconstructed(parts: list[Paths]) -> FacetWaves:
    """The plane waves of beams that light the same CCD."""
    if not parts:
        raise ValueError("reconstruct_facet_waves: expected at least one Paths, got none")
    ccd = parts[0].ccd
    found: list[Footprints] = []
    path, odd, beams = [], [], []
    missed, detected, before = 0.0, 0.0, 0
    for paths in parts:
        why = prevented(paths)
        if why is not None:
            raise ValueError(f"method: expected 'wavefront' or 'rays' with {why}, got 'facets'")
        assert isinstance(paths.source, Beam)
        assert ccd is not None
        bounces = int(paths.bounces[paths.fate == Fate.DETECTED].max(initial=0))
        prints = follow_beam(paths.scene, paths.source, ccd, bounces, paths.min_amplitude)
        keys, first = np.unique(paths.key, return_index=True)
        row = np.minimum(np.searchsorted(keys, prints.key), len(keys) - 1)
        known = keys[row] == prints.key if len(keys) else np.zeros(len(prints), dtype=np.bool_)
        missed, detected = missed + prints.dropped, detected + prints.detected
        if not known.all():
            missed += _power(prints, ~known) * ccd.pitch**2
            prints = _part(prints, known)
        found.append(prints)
        beams.append(paths.source)
        path.append(first[row[known]] + before)
        odd.append(paths.reflections[first[row[known]]] % 2 == 1)
        before += len(paths)
    assert ccd is not None
    prints = found[0] if len(found) == 1 else _together(found)
    begin, member = _covered(prints, ccd.shape)
    missed += sum(_unlit(paths, prints, begin, member) for paths in parts)
    waves = FacetWaves(
        ccd, prints, np.concatenate(path), np.concatenate(odd), begin, member, np.empty((0, 5)), before,
        missed / detected if detected > 0.0 else 0.0,
    )  # fmt: skip
    owner = np.repeat(np.arange(len(found)), [len(one) for one in found])
    return _profiled(waves, beams, owner)


def _unlit(paths: Paths, prints: Footprints, begin: npt.NDArray[np.int64], member: Array) -> float:
    """Power that rays bring to pixels which no footprint of their key reaches."""
    assert paths.ccd is not None
    rows, columns = paths.ccd.shape
    seen = np.flatnonzero(paths.fate == Fate.DETECTED)
    at = np.clip(np.floor(paths.pixel[seen]), 0, (rows - 1, columns - 1)).astype(np.int64)
    keys, number = np.unique(np.concatenate([paths.key[seen], prints.key]), return_inverse=True)
    lit = np.repeat(np.arange(rows * columns), np.diff(begin)) * len(keys) + number[len(seen) :][member]
    found = np.isin((at[:, 0] * columns + at[:, 1]) * len(keys) + number[: len(seen)], lit)
    power = (np.abs(paths.amplitude[seen][~found]) ** 2).sum()
    return float(power * (1.0 if paths.area is None else paths.area))


def _power(prints: Footprints, which: npt.NDArray[np.bool_]) -> float:
    """Power of some footprints on the CCD, in pixels."""
    x, y = prints.corners.T
    after = np.arange(1, len(x) + 1)
    last = prints.first[1:] - 1
    after[last] = prints.first[:-1]
    double = np.add.reduceat(x * y[after] - y * x[after], prints.first[:-1]) if len(x) else np.empty(0)
    strength = prints.wave[:, 5] ** 2 + prints.wave[:, 6] ** 2
    return float((0.5 * np.abs(double) * strength)[which].sum())


def _part(prints: Footprints, which: npt.NDArray[np.bool_]) -> Footprints:
    """Some of the footprints."""
    count = np.diff(prints.first)
    first = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(count[which])])
    corners = prints.corners[np.repeat(which, count)]
    return replace(prints, corners=corners, first=first, wave=prints.wave[which], key=prints.key[which])


def _together(parts: list[Footprints]) -> Footprints:
    """Footprints of several beams."""
    before = np.cumsum([0] + [len(one.corners) for one in parts])
    ends = [one.first[1:] + offset for one, offset in zip(parts, before, strict=False)]
    return replace(
        parts[0],
        corners=np.concatenate([one.corners for one in parts]),
        first=np.concatenate([np.zeros(1, dtype=np.int64), *ends]),
        wave=np.concatenate([one.wave for one in parts]),
        key=np.concatenate([one.key for one in parts]),
    )


def _covered(
    prints: Footprints, shape: tuple[int, int]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]]:
    """Which footprints reach each pixel, in compressed rows."""
    count, none = np.zeros(shape[0] * shape[1], dtype=np.int64), np.empty(0, dtype=np.int32)
    kernels.cover(prints.corners, prints.first, *shape, count, none)
    begin = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(count)])
    member = np.empty(begin[-1], dtype=np.int32)
    kernels.cover(prints.corners, prints.first, *shape, begin[:-1].copy(), member)
    return begin, member


def _profiled(waves: FacetWaves, beams: list[Beam], owner: npt.NDArray[np.int64]) -> FacetWaves:
    """The waves with the profiles of their beams."""
    profiles: list[Callable[..., FloatArray] | None] = [beam.profile for beam in beams]
    if all(profile is None for profile in profiles):
        return waves
    prints, count = waves.footprints, len(waves.member)
    middle, at = np.empty((count, 5)), np.empty((count, 5, 2))
    kernels.sources(
        waves.ccd.shape[1], prints.corners, prints.first, waves.begin, waves.member, prints.wave, middle, at
    )
    table = np.tile((1.0, 0.0, 0.0, 0.0, 0.0), (count, 1))
    for number, profile in enumerate(profiles):
        mine = np.flatnonzero(owner[waves.member] == number)
        if profile is not None:
            values = np.broadcast_to(profile(*at[mine].reshape(-1, 2).T), 5 * len(mine)).reshape(-1, 5)
            table[mine] = _linear(values, middle[mine])
    return replace(waves, profile=table)


def _linear(values: FloatArray, middle: FloatArray) -> FloatArray:
    """Amplitudes about parts of pixels: root of the mean power, relative gradient, and this at the centroid.

    Parameters
    ----------
    values : (m, 5)
        At the points of `kernels.sources`.
    middle : (m, 5) float64
        As there.

    Returns
    -------
    (m, 5) float64
        Real and imaginary part, gradient a pixel along x and y, and its product with the centroid.
    """
    mean, power = _mean(values), np.maximum(_mean(np.abs(values) ** 2).real, 0.0)
    amplitude = np.exp(1j * np.angle(mean)) * np.sqrt(power)
    x, y, along, shear, up = middle.T
    some = (along > 0.0) & (up > 0.0) & (mean != 0.0)
    change = np.divide(
        values[:, :4:2] - values[:, 1:4:2], 2.0 * mean[:, None], where=some[:, None], out=0.0 * values[:, :2]
    )
    rise = np.divide(change[:, 1].real, up, where=some, out=np.zeros(len(up)))
    run = np.divide(change[:, 0].real - shear * rise, along, where=some, out=np.zeros(len(up)))
    return np.stack([amplitude.real, amplitude.imag, run, rise, run * x + rise * y], axis=1)


def _mean(values: Array) -> Array:
    """Means of functions over parts of pixels, to the second order, from their values (m, 5) there."""
    middle = values[:, 4]
    return np.asarray(middle + (values[:, :4].mean(axis=1) - middle) / kernels.WITHIN**2)
