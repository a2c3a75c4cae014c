"""Assembly of a beam's wavefronts into mean fields and mutual intensities on the pixels."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, FloatArray
from fringetrace.field.pixel_quadrature import Samples, averaged, edges
from fringetrace.field.wavefront import curved_waves, patches, plane_waves
from fringetrace.field.wavefront.patches import PatchCells
from fringetrace.field.wavefront.plane_waves import Region, Wave
from fringetrace.field.wavefront.visibility import survey
from fringetrace.scene import Beam
from fringetrace.tracing import Paths, detection

Numbers = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Light:
    """Wavefronts of a beam on a CCD: plane waves, curved patches, edges.

    Attributes
    ----------
    beam : Beam
    unit : float
        Its area that a step of its grid stands for, in pixels.
    plane : list of (group, Wave, Region)
        Plane waves off facets.
    curved : list of (group, Cells)
        Curved sheets.
    segments : (n, 4) float64, pixels
        The edges of both: x, y of either end.
    """

    beam: Beam
    unit: float
    plane: list[tuple[int, Wave, Region]]
    curved: list[tuple[int, PatchCells]]
    segments: FloatArray


def light(
    paths: Paths, groups: Numbers, half_wave_loss: bool = True, axis: FloatArray | None = None
) -> Light:
    """Reconstruct the wavefronts of a beam: plane waves off facets, curved patches off forms.

    Parameters
    ----------
    paths : Paths
        Of a `Beam`, onto a CCD.
    groups : (paths,) int64
        The group of each path, the same for all of a key.
    half_wave_loss : bool
        False leaves out the factor -1 of each reflection off a mirror.
    axis : (3,) float64, optional
        Of light with a polarisation, the component of the field along it.

    Returns
    -------
    Light

    Raises
    ------
    ValueError
        If the source is no beam, or there is no CCD.
    """
    ccd, beam = patches.checked(paths)
    unit = beam.area / ccd.pitch**2
    keys, first = np.unique(paths.key, return_index=True)

    def group(key: np.uint64) -> int:
        return int(groups[first[np.searchsorted(keys, key)]])

    if paths.points is not None and paths.triangle is None:  # arrivals that no facet stands for
        if axis is not None:
            paths = detection.along(paths, axis)
        if not half_wave_loss:
            paths = replace(paths, amplitude=paths.amplitude * (1.0 - 2.0 * (paths.reflections % 2)))
        landed = np.unique(paths.key[detection.landed(paths, ccd)[0]])
        found = zip(landed, patches.sheets(paths), strict=True)
        curved = [(group(key), patches.cells(sheet, ccd)) for key, sheet in found]
        return Light(beam, unit, [], curved, np.empty((0, 4)))
    surveyed = survey(paths, half_wave_loss, axis)
    member = {name: group(key) for name, key in zip(surveyed.names, surveyed.keys, strict=True)}
    plane = [(member[wave.name], wave, region) for wave, region in plane_waves.plane_waves_of(surveyed)]
    cells, rim = curved_waves.curved(surveyed)
    named = [member[name] for name in surveyed.names[surveyed.curved]]
    drawn = [wave.to_pixels(region.segments).reshape(-1, 4) for _, wave, region in plane]
    return Light(beam, unit, plane, list(zip(named, cells, strict=True)), np.concatenate([rim, *drawn]))


def fields(
    lights: list[Light], groups: int, shape: tuple[int, int], period: float, carrier: bool, more: int = 0
) -> tuple[ComplexArray, ComplexArray]:
    """Means over each pixel of the fields of groups of wavefronts, and of their products.

    Parameters
    ----------
    lights : list of Light
        Of coherent beams.
    groups : int
        How many there are.
    shape : (rows, columns)
        Of the CCD.
    period : float, metres
        The wavelength.
    carrier : bool
        Whether the mean fields matter: then pixels are sampled for the whole slope of the phase;
        otherwise for the differences between the sheets that overlap.
    more : int
        See `quadrature.averaged`.

    Returns
    -------
    mean : (groups, rows, columns) complex128
    mutual : (groups, groups, rows, columns) complex128
        See `quadrature.averaged`.
    """
    from fringetrace.field.wavefront import uniform_airy

    curved = [
        (
            group,
            uniform_airy.folds(
                part.coefficients, part.leaves, part.folded, part.turns, part.place, period, beam.unit
            ),
            np.exp(2j * np.pi * np.fmod(part.base, period) / period),
        )
        for beam in lights
        for group, part in beam.curved
    ]

    def at(points: Samples, slope: FloatArray) -> ComplexArray:
        field = points.blank(groups)
        for beam in lights:
            for group, wave, region in beam.plane:
                plane_waves.add_plane_wave(wave, region, beam.beam, period, points, field[group], slope)
        for group, sheet, phase in curved:
            field[group] += uniform_airy.light(sheet, points, slope) * phase
        return field

    segments = np.concatenate([beam.segments for beam in lights])
    return averaged(shape, at, period, carrier, edges(segments, shape), more)
