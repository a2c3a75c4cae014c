"""Plane waves off sequences of flat facets, and their regions of the beam."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray, unit
from fringetrace.field.sample_points import Samples
from fringetrace.field.wavefront.boundary_search import cut
from fringetrace.field.wavefront.probe import RIM, profile
from fringetrace.field.wavefront.quadtree import CORNERS, Pieces, Squares
from fringetrace.field.wavefront.visibility import Survey
from fringetrace.optics import IncidentRays, refract
from fringetrace.scene import CCD, Beam, Surface, pixels
from fringetrace.tracing import Paths, Segments, components, landed


@dataclass(frozen=True, eq=False)
class Wave:
    """Plane wave off a sequence of facets.

    Attributes
    ----------
    name : int
    origin : (2,) float64, pixels
        Column and row coordinate of a ray in the plane of focus.
    matrix : (2, 2) float64
        From steps of the beam's grid (column, row) to pixels (column, row).
    start : (2,) float64
        That ray's place on the beam's grid.
    path : float, metres
        Its optical path.
    gradient : (2,) float64, metres a pixel
    amplitude : (components,) complex128
        See `components`.
    """

    name: np.uint64
    origin: FloatArray
    matrix: FloatArray
    start: FloatArray
    path: float
    gradient: FloatArray
    amplitude: ComplexArray

    def to_pixels(self, at: FloatArray) -> FloatArray:
        """CCD coordinates of points (..., 2) of the beam's grid."""
        return np.asarray(self.origin + (at - self.start) @ self.matrix.T, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Region:
    """Region of the beam's grid where a wave starts: cells from `low` on, and pieces of cells.

    `segments` are the region's edges on the beam's grid, (n, 2, 2).
    """

    low: tuple[int, int]
    kind: npt.NDArray[np.int64]
    begin: npt.NDArray[np.int64]
    pieces: FloatArray
    segments: FloatArray


def _met(paths: Paths, row: int) -> list[tuple[Surface, FloatArray]]:
    """The surfaces that a path met, and the normals (3,) of their facets there."""
    assert paths.surface is not None
    assert paths.triangle is not None
    count = paths.bounces[row]
    surfaces = [paths.scene.surfaces[number] for number in paths.surface[row, :count]]
    faces = paths.triangle[row, :count]
    return [(surface, surface.mesh.normals[face]) for surface, face in zip(surfaces, faces, strict=True)]


def _sent(paths: Paths, row: int, bounce: int, direction: FloatArray, normal: FloatArray) -> FloatArray:
    """Direction (3,) in which a thin element sends light, where the next surface is at the same place."""
    assert paths.surface is not None
    assert paths.branch is not None
    assert paths.points is not None
    element = paths.scene.surfaces[paths.surface[row, bounce]].element
    assert element is not None
    across = unit(np.cross(direction, np.eye(3)[[np.argmin(np.abs(direction))]]))
    rays = IncidentRays(
        point=paths.points[row, [bounce + 1]], direction=direction[None], normal=normal[None],
        index=Segments.of(paths.where(np.array([row]))).index[0, [bounce]],
        field=(np.ones(1) if paths.field is None else across).astype(np.complex128),
        wavelength=paths.wavelength,
    )  # fmt: skip
    sent = element.act(rays)[paths.branch[row, bounce] - 1].direction
    return direction if sent is None else np.asarray(sent[0], dtype=np.float64)


def _wave(paths: Paths, row: int, name: np.uint64, start: FloatArray, beam: Beam, ccd: CCD) -> Wave:
    """The plane wave that a ray belongs to: what its bounces make of a step across the beam."""
    assert paths.points is not None
    assert paths.starts is not None
    assert paths.branch is not None
    u, v, direction = beam.axes
    across = np.stack([u * beam.size[0] / beam.shape[1], v * beam.size[1] / beam.shape[0]], axis=1)
    count, met = paths.bounces[row], _met(paths, row)
    index = Segments.of(paths.where(np.array([row]))).index[0]
    onward = paths.points[row, 2 : count + 2] - paths.starts[row, 1 : count + 1]
    onward[count - 1 :] = paths.direction[row]
    for k, (surface, normal) in enumerate(met):
        if paths.branch[row, k] == 0:
            across = across - 2.0 * np.outer(normal, normal @ across)
            direction = direction - 2.0 * (direction @ normal) * normal
            continue
        bent = refract(direction, normal, index[k], index[k + 1])
        if surface.element is not None:
            way = np.linalg.norm(onward[k])
            bent = onward[k] / way if way > 0.0 else _sent(paths, row, k, direction, normal)
        if bent is not direction:
            # the step along the surface is the same on both sides
            across = across - np.outer(direction, (normal @ across) / (normal @ direction))
            direction = bent
    right, up, facing = ccd.axes
    # along the rays into the plane of focus
    across = across - np.outer(direction, (facing @ across) / (facing @ direction))
    _, point, length = landed(paths.where(np.array([row])), ccd)
    axes = np.stack([right, up]) / ccd.pitch
    matrix = axes @ across
    spread = abs(float(np.linalg.det(matrix)))
    size = np.sqrt(beam.area / ccd.pitch**2 / spread) if spread > 0.0 else 0.0
    return Wave(
        name=name,
        origin=pixels(ccd, point)[0, ::-1],
        matrix=matrix,
        start=start,
        path=float(length[0]),
        gradient=index[count] * np.array([direction @ right, direction @ up]) * ccd.pitch,
        amplitude=components(paths.where(np.array([row])), ccd)[:, 0] * size,
    )


def _near(wave: Wave, row: Array, column: Array, ccd: CCD) -> npt.NDArray[np.bool_]:
    """Cells of the beam's grid whose light may fall on the CCD."""
    at = np.stack([column, row], axis=-1)[:, None] + CORNERS
    x, y = np.moveaxis(wave.to_pixels(at), -1, 0)
    rows, columns = ccd.shape
    across = (x.max(axis=1) > 0) & (x.min(axis=1) < columns)
    return np.asarray(across & (y.max(axis=1) > 0) & (y.min(axis=1) < rows))


def plane_waves_of(survey: Survey) -> Iterator[tuple[Wave, Region]]:
    """Plane waves on a CCD off the facets of a scene, and their regions of the beam.

    Parameters
    ----------
    survey : Survey
        Of a beam's paths.

    Yields
    ------
    Wave, Region
    """
    probe = survey.probe
    ccd, beam = probe.ccd, probe.beam
    found: list[Wave] = []
    squares = []
    which = []
    for index in np.flatnonzero(~survey.curved).tolist():
        row = int(survey.first[index])
        start = np.clip(survey.at[survey.paths.ray[row]], RIM, np.array(beam.shape[::-1]) - RIM)
        wave = _wave(survey.paths, row, survey.names[index], start, beam, ccd)
        if wave.amplitude.any():
            squares.append(_squares(survey, index, wave, len(found)))
            found.append(wave)
            which.append(index)
    if not found:
        return
    names = np.array([wave.name for wave in found], dtype=np.uint64)
    pieces = cut(probe, names, Squares.joined(squares), survey.witnesses.numbered(which))
    order = np.lexsort((pieces.cell, pieces.wave))
    cuts = np.searchsorted(pieces.wave[order], np.arange(len(found) + 1))
    for n, wave in enumerate(found):
        mine = order[cuts[n] : cuts[n + 1]]
        if len(mine):
            yield wave, _region(pieces.part(mine), beam)


def _squares(survey: Survey, index: int, wave: Wave, number: int) -> Squares:
    """Cells that a wave may light, towards the CCD."""
    lit = survey.corners(index)
    row, column = np.nonzero(survey.cells(index))
    near = _near(wave, row, column, survey.probe.ccd)
    row, column = row[near], column[near]
    scale = np.full(len(row), np.linalg.norm(wave.matrix, 2))
    low = np.stack([column, row], axis=1).astype(np.float64)
    cell = row * lit.shape[1] + column
    return Squares(np.full(len(row), number), cell, scale, low, lit[row, column], 1.0)


def _region(pieces: Pieces, beam: Beam) -> Region:
    """The region of one wave, from its pieces in the order of their cells."""
    row, column = np.divmod(pieces.cell, beam.shape[1])
    low_s, low_t = int(column.min()), int(row.min())
    shape = int(row.max()) + 1 - low_t, int(column.max()) + 1 - low_s
    local = (row - low_t) * shape[1] + column - low_s
    kind = np.zeros(shape, dtype=np.int64)
    kind.ravel()[local] = np.where(pieces.whole, 1, 2)
    begin = np.searchsorted(local, np.arange(shape[0] * shape[1] + 1)).astype(np.int64)
    table = np.column_stack([pieces.low, pieces.high, pieces.lines])
    tall, wide = beam.shape
    rim = []
    for at_rim, ends in (
        (column.min() == 0, ((0, 0), (0, tall))), (column.max() == wide - 1, ((wide, 0), (wide, tall))),
        (row.min() == 0, ((0, 0), (wide, 0))), (row.max() == tall - 1, ((0, tall), (wide, tall))),
    ):  # fmt: skip
        if at_rim:
            rim.append(ends)
    edges = [pieces.chord[pieces.cut], np.array(rim, dtype=np.float64).reshape(-1, 2, 2)]
    return Region((low_s, low_t), kind, begin, table, np.concatenate(edges))


def _light(beam: Beam, wave: Wave, points: Samples) -> ComplexArray:
    """Amplitudes (points or 1, components) of a wave, with the beam's profile where its light starts."""
    if beam.profile is None:
        return wave.amplitude[None]
    at = np.stack([points.x, points.y], axis=1) - wave.origin
    light = profile(beam, at @ np.linalg.inv(wave.matrix).T + wave.start)
    return np.asarray(wave.amplitude * light[:, None])


def _window(wave: Wave, region: Region, points: Samples) -> npt.NDArray[np.int64]:
    """Pixels of a band that a wave may reach: first and last row, first and last column."""
    tall, wide = region.kind.shape
    at = wave.to_pixels(np.array(region.low) + CORNERS * (wide, tall))
    (left, low), (right, high) = np.floor(at.min(axis=0)), np.floor(at.max(axis=0)) + 1
    rows = (len(points.first) - 1) // points.columns
    window = np.array([low - points.top, high - points.top, left, right])
    limits = [rows, rows, points.columns, points.columns]
    return np.asarray(np.clip(window, 0, limits), dtype=np.int64)


def find_contributions(
    wave: Wave, region: Region, beam: Beam, points: Samples, slope: FloatArray
) -> FloatArray:
    """Contributions of a plane wave at sample points, exact but for rounding.

    Parameters
    ----------
    wave : Wave
    region : Region
    beam : Beam
    points : Samples
    slope : (points, 4) float64, metres a pixel, or (0, 4)
        Widened, see `raster_kernels.leaf_contributions`.

    Returns
    -------
    (n, 2 + 2 components) float64
        See `Contributions`.
    """
    from fringetrace.field.wavefront import raster_kernels

    window = _window(wave, region, points)
    if not (window[0] < window[1] and window[2] < window[3]):
        return np.empty((0, 2 + 2 * len(wave.amplitude)))
    back = wave.matrix @ wave.start  # to the corner of the beam's grid
    found: FloatArray = raster_kernels.plane_wave_contributions(
        np.linalg.inv(wave.matrix), wave.origin - back, wave.path - wave.gradient @ back,
        wave.gradient, _light(beam, wave, points), region.kind, *region.low, region.begin,
        region.pieces, points.first, points.x, points.y, points.where_x, points.where_y,
        points.columns, slope, window,
    )  # fmt: skip
    return found
