"""Wavefronts of traced beams: reconstructed once, evaluated at any wavelength on the pixels of a CCD."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, FloatArray, checked_wavelength
from fringetrace.field.groups import grouped
from fringetrace.field.pixel_quadrature import Case, averaged
from fringetrace.field.sample_points import Edges, Samples, edges
from fringetrace.field.wavefront import curved_waves, patches, plane_waves
from fringetrace.field.wavefront.contributions import (
    Contributions,
    CurvedWave,
    PlaneWave,
    find_contributions,
)
from fringetrace.field.wavefront.uniform_airy import Folds, folds
from fringetrace.field.wavefront.visibility import survey
from fringetrace.scene import CCD, Spectrum
from fringetrace.tracing import Paths, at_wavelength, landed, needs

# Bytes of wavefronts that are kept with the paths, and of what they bring to the centres of the pixels.
KEPT, CENTRES = 1 << 30, 1 << 28

Groups = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Wavefronts:
    """Wavefronts of traced beams on a CCD, at any wavelength.

    Attributes
    ----------
    ccd : CCD
    plane : tuple of PlaneWave
        Off flat facets.
    curved : tuple of CurvedWave
        Off surfaces with a form.
    segments : (n, 4) float64, pixels
        Edges of both: x, y of either end.
    paths : int
        Number of paths that they were reconstructed from.
    components : int
        1, or 3 of light with a polarisation.
    wavelength : float or None, metres
        The only one at which they may be evaluated; None: any.
    """

    ccd: CCD
    plane: tuple[PlaneWave, ...]
    curved: tuple[CurvedWave, ...]
    segments: FloatArray
    paths: int
    components: int
    wavelength: float | None
    # what they bring to the centres of the pixels
    derived: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    def __repr__(self) -> str:
        at = "any wavelength" if self.wavelength is None else f"{self.wavelength * 1e9:.6g} nm"
        return f"Wavefronts({len(self.plane)} plane, {len(self.curved)} curved, at {at})"

    @cached_property
    def edges(self) -> Edges:
        """Pixels that edges cross."""
        return edges(self.segments, self.ccd.shape)

    @property
    def nbytes(self) -> int:
        """Memory of the curved waves, bytes."""
        return sum(wave.cells.coefficients.nbytes + wave.cells.leaves.nbytes for wave in self.curved)

    def complex_field(
        self, wavelength: float, groups: npt.ArrayLike | None = None, half_wave_loss: bool = True
    ) -> ComplexArray:
        """Complex field, averaged over each pixel.

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
            Of light with a polarisation (3, rows, columns), or (groups, 3, rows, columns): along the CCD's
            columns, rows and normal.

        Raises
        ------
        ValueError
            For a wavelength that is none or not that of the wavefronts; for groups that do not fit.
        """
        mean = self._averaged(self._cases(wavelength, True), groups, half_wave_loss, True)
        mean = mean[0] if self.components == 1 else np.swapaxes(mean, 0, 1)
        return np.ascontiguousarray(mean if groups is not None else mean[0])

    def mutual_intensity(
        self, light: float | Spectrum, groups: npt.ArrayLike, half_wave_loss: bool = True
    ) -> ComplexArray:
        """Mutual intensity E_m conj(E_n) of groups of paths, averaged over each pixel.

        Parameters
        ----------
        light : float or Spectrum
            A wavelength in metres, or several, whose mutual intensities add.
        groups, half_wave_loss
            As in `complex_field`.

        Returns
        -------
        (groups, groups, rows, columns) complex128
            Summed over the components of light with a polarisation.

        Raises
        ------
        ValueError
            As in `complex_field`.
        """
        images = self._averaged(self._cases(light, False), groups, half_wave_loss, False)
        return np.asarray(images[0], dtype=np.complex128)

    def irradiance(self, light: float | Spectrum, half_wave_loss: bool = True) -> FloatArray:
        """Irradiance |E|^2, averaged over each pixel.

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
        mutual = self._averaged(self._cases(light, False), None, half_wave_loss, False)
        return np.ascontiguousarray(mutual[0, 0, 0].real)

    def refined(self, wavelength: float, rows: tuple[int, int], more: int = 0) -> ComplexArray:
        """Mean field of some rows of pixels, with more sample points than usual.

        Parameters
        ----------
        wavelength : float, metres
        rows : (first, after the last)
        more : int
            Points along either axis of each pixel.

        Returns
        -------
        (components, rows, columns) complex128
        """
        images = self._averaged(self._cases(wavelength, True), None, True, True, rows, more)
        return np.asarray(images[:, 0], dtype=np.complex128)

    def _cases(self, light: float | Spectrum, apart: bool) -> list[Case]:
        """Wavelengths and components to be evaluated; `apart`: an image for each component."""
        if isinstance(light, Spectrum):
            shares = list(zip(light.wavelengths.tolist(), light.weights.tolist(), strict=True))
        else:
            shares = [(light, 1.0)]
        cases = [
            Case(checked_wavelength(wavelength), k, share, k if apart else 0)
            for wavelength, share in shares
            for k in range(self.components)
        ]
        for case in cases:
            if self.wavelength not in (None, case.wavelength):
                raise ValueError(
                    f"wavelength: expected {self.wavelength!r} m, that of the wavefronts, since the scene "
                    f"depends on it, got {case.wavelength!r} m"
                )
        return cases

    def _averaged(
        self, cases: Sequence[Case], groups: npt.ArrayLike | None, half_wave_loss: bool, carrier: bool,
        rows: tuple[int, int] | None = None, more: int = 0,
    ) -> ComplexArray:  # fmt: skip
        numbers = np.zeros(self.paths, dtype=np.int64) if groups is None else grouped(groups, self.paths)
        light = Evaluation(self, numbers, half_wave_loss)
        for case in cases:
            light.prepare(case)
        return averaged(self.ccd.shape, light, cases, carrier, self.edges, more, rows)


class Evaluation:
    """Fields of groups of waves at sample points, for `averaged`."""

    def __init__(self, wavefronts: Wavefronts, groups: Groups, half_wave_loss: bool) -> None:
        waves: list[PlaneWave | CurvedWave] = [*wavefronts.plane, *wavefronts.curved]
        self.wavefronts = wavefronts
        self.groups = int(groups.max(initial=0)) + 1
        self.group = np.array([groups[wave.path] for wave in waves], dtype=np.int64)
        self.sign = np.array([-1.0 if wave.odd and not half_wave_loss else 1.0 for wave in waves])
        self.folding = {
            n: one for n, one in enumerate(waves) if isinstance(one, CurvedWave) and one.cells.folds
        }
        self.folds: dict[tuple[float, int], dict[int, Folds]] = {}

    def prepare(self, case: Case) -> None:
        """Find the folds at a wavelength."""
        self.folds[case.wavelength, case.component] = {
            n: folds(one.cells, case.wavelength, one.unit, case.component) for n, one in self.folding.items()
        }

    def at(self, points: Samples, slopes: bool) -> Contributions:
        """Contributions of the waves at sample points, for any wavelength; kept at the pixel centres."""
        one, kept = self.wavefronts, self.wavefronts.derived
        key = points.top, len(points.x)
        if not slopes:
            return find_contributions(one.plane, one.curved, one.components, points, slopes)
        if key not in kept:
            found = find_contributions(one.plane, one.curved, one.components, points, slopes)
            if sum(each.nbytes for each in kept.values()) + found.nbytes > CENTRES:
                return found
            kept[key] = found
        there: Contributions = kept[key]
        return there

    def field(self, found: Contributions, case: Case) -> tuple[ComplexArray, FloatArray]:
        """Fields (groups, points) and slopes of the path (points, 4), or (0, 4)."""
        folded = self.folds[case.wavelength, case.component]
        return found.field(case.wavelength, case.component, self.groups, self.group, self.sign, folded)


def reconstruct(paths: Paths | Iterable[Paths], wavelength: float | None = None) -> Wavefronts:
    """Reconstruct the wavefronts of traced beams, for fields and irradiances at any wavelength.

    What does not depend on the wavelength is found once, and kept with the paths: which sequences of
    surfaces light takes, where they end on the beam's grid, plane waves and curved patches. Some more rays
    are traced for it.

    Parameters
    ----------
    paths : Paths, or an iterable of them
        Of a `Beam` onto a CCD; of several coherent beams, one after the other.
    wavelength : float, metres, optional
        Needed where the scene depends on it: another than that of the trace, see `at_wavelength`.

    Returns
    -------
    Wavefronts

    Raises
    ------
    ValueError
        If the source is no beam, if there is no CCD, or no paths; if the wavelength goes another way.
    """
    if isinstance(paths, Paths):
        return _kept(paths, wavelength)
    parts = [_kept(one, wavelength) for one in paths]
    if not parts:
        raise ValueError("reconstruct: expected at least one Paths, got none")
    return parts[0] if len(parts) == 1 else _together(parts)


def _kept(paths: Paths, wavelength: float | None) -> Wavefronts:
    """Wavefronts of one beam, the latest of which are kept."""
    paths_at = paths if wavelength is None else at_wavelength(paths, wavelength)
    only = None if needs(paths.scene) is None else paths_at.wavelength
    found: Wavefronts | None = paths.derived.get("wavefronts")
    if found is None or found.wavelength != only:
        paths.derived.pop("wavefronts", None)
        found = replace(_reconstructed(paths_at), wavelength=only)
        if found.nbytes <= KEPT:
            paths.derived["wavefronts"] = found
    return found


def _together(parts: Sequence[Wavefronts]) -> Wavefronts:
    """Waves of several beams."""
    before = np.cumsum([0] + [part.paths for part in parts]).tolist()
    numbered = list(zip(before, parts, strict=False))
    plane = [replace(wave, path=wave.path + n) for n, part in numbered for wave in part.plane]
    curved = [replace(wave, path=wave.path + n) for n, part in numbered for wave in part.curved]
    segments = np.concatenate([part.segments for part in parts])
    return replace(parts[0], plane=tuple(plane), curved=tuple(curved), segments=segments, paths=before[-1])


def _reconstructed(paths: Paths) -> Wavefronts:
    """Plane waves and curved sheets of a beam."""
    ccd, beam = patches.checked(paths)
    unit, components = beam.area / ccd.pitch**2, 1 if paths.field is None else 3
    keys, first = np.unique(paths.key, return_index=True)

    def path(key: np.uint64) -> int:
        return int(first[np.searchsorted(keys, key)])

    if paths.points is not None and paths.triangle is None:  # arrivals that no facet stands for
        there = np.unique(paths.key[landed(paths, ccd)[0]])
        curved = [
            CurvedWave(path(key), bool(paths.reflections[path(key)] % 2), unit, patches.cells(sheet, ccd))
            for key, sheet in zip(there, patches.sheets(paths), strict=True)
        ]
        return Wavefronts(ccd, (), tuple(curved), np.empty((0, 4)), len(paths), components, None)
    seen = survey(paths)
    odd = seen.paths.reflections[seen.first] % 2 == 1
    about = {name: (path(key), bool(o)) for name, key, o in zip(seen.names, seen.keys, odd, strict=True)}
    plane = [
        PlaneWave(*about[wave.name], beam, wave, region) for wave, region in plane_waves.plane_waves_of(seen)
    ]
    curved_seen, rim = curved_waves.curved(seen)
    sheets = [CurvedWave(*about[seen.names[index]], unit, cells) for index, cells in curved_seen]
    drawn = [one.wave.to_pixels(one.region.segments).reshape(-1, 4) for one in plane]
    segments = np.concatenate([rim, *drawn])
    return Wavefronts(ccd, tuple(plane), tuple(sheets), segments, len(paths), components, None)
