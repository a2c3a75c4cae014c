"""Segments and hits of recorded paths: lengths, directions, media, optical path and phase."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray, dot, short_repr, unit
from fringetrace.geometry import LevelFit, Patches
from fringetrace.scene import Surface
from fringetrace.tracing.optics_table import constants
from fringetrace.tracing.paths import Paths

# What tells roundings of float64 has more digits, where the machine has such numbers.
EXTENDED = np.longdouble


def _recorded(paths: Paths, what: str) -> None:
    if paths.surface is None or paths.triangle is None or paths.points is None or paths.branch is None:
        raise ValueError(f"{what}: expected paths traced with record=True, got paths without points")


@dataclass(frozen=True, eq=False)
class Segments:
    """Segments of recorded paths: one before each hit, and one after the last, to the CCD.

    Attributes
    ----------
    length : (m, b + 1) longdouble, metres
        From where a segment starts to the next point; 0 where there is none. To the CCD's plane of focus it
        is negative where that lies behind the last surface.
    direction : (m, b + 1, 3) longdouble, unit
        Of the light; 0 where there is no segment, and on those of length 0 between two hits.
    medium : (m, b + 1) int32
        Number in `fringetrace.tracing.scene_media`; 0 where there is no segment.
    index : (m, b + 1) float64
        Real refractive index for the ray, |Re k| / k0; 1 where there is no segment.
    through : (m, b) bool
        Whether light went on to the other side of the surface at each hit.
    advance : (m, b) float64, metres
        Optical path that a thin element added at each hit.
    """

    length: Array
    direction: Array
    medium: npt.NDArray[np.int32]
    index: FloatArray
    through: npt.NDArray[np.bool_]
    advance: FloatArray

    __repr__ = short_repr

    @staticmethod
    def of(paths: Paths) -> Segments:
        """Segments of recorded paths.

        Parameters
        ----------
        paths : Paths
            Traced with record=True.

        Returns
        -------
        Segments

        Raises
        ------
        ValueError
            If the trace did not record them.
        """
        _recorded(paths, "segments")
        assert paths.branch is not None
        length, direction = _lengths(paths)
        shape = length.shape
        medium, index = paths.media, paths.indices
        return Segments(
            length=length,
            direction=direction,
            medium=np.zeros(shape, dtype=np.int32) if medium is None else np.maximum(medium, 0),
            index=np.ones(shape) if index is None else np.where(np.isnan(index), 1.0, index),
            through=_through(paths, direction),
            advance=np.zeros(paths.branch.shape) if paths.advances is None else paths.advances,
        )

    def optical_path(self, start: FloatArray | float = 0.0) -> FloatArray:
        """Optical path length from the start to each point.

        Parameters
        ----------
        start : (m,) float64, metres
            That the rays bring along.

        Returns
        -------
        (m, b + 2) float64, metres
            To a hit without what an element there adds; unchanged behind the last point.
        """
        steps = np.asarray(self.length, dtype=np.float64) * self.index
        steps[:, 1:] += self.advance
        first = np.broadcast_to(start, (len(steps),))
        return np.asarray(np.cumsum(np.column_stack([first, steps]), axis=1), dtype=np.float64)


def _lengths(paths: Paths) -> tuple[Array, Array]:
    """Lengths and directions of segments, from the recorded points."""
    assert paths.points is not None
    assert paths.starts is not None
    step = paths.points[:, 1:].astype(EXTENDED) - paths.starts
    length = np.sqrt((step**2).sum(axis=2))
    rows, last = np.arange(len(paths)), paths.bounces
    with np.errstate(invalid="ignore", divide="ignore"):
        direction = step / length[:, :, None]
    final = paths.direction.astype(EXTENDED)
    final /= np.sqrt((final**2).sum(axis=1))[:, None]
    direction[rows, last] = final
    length[rows, last] = (step[rows, last] * final).sum(axis=1)
    return np.where(np.isfinite(length), length, 0.0), np.nan_to_num(direction)


def _through(paths: Paths, direction: Array) -> npt.NDArray[np.bool_]:
    """Whether light went on to the other side at each hit; branches of elements may go back."""
    assert paths.branch is not None
    through = paths.branch > 0
    for hits in surface_hits(paths):
        if hits.surface.element is not None:
            normal, (path, hit) = hits.facet_normal, (hits.path, hits.hit)
            into, out = (dot(normal, direction[path, hit + k].astype(np.float64)) for k in (0, 1))
            through[path, hit] = into * out > 0.0
    return np.asarray(through)


def surface_phase(paths: Paths, through: Array) -> FloatArray:
    """Phase added by surfaces up to each point.

    Parameters
    ----------
    paths : Paths
        Traced with record=True.
    through : (m, b) bool
        See `Segments`.

    Returns
    -------
    (m, b + 2) float64, radians
        0 for polarised light. What boundaries, films and thin elements do to the phase is known in all:
        it stands behind the last of them that was hit.
    """
    assert paths.surface is not None
    assert paths.points is not None
    phase: FloatArray = np.zeros(paths.points.shape[:2])
    if paths.field is not None:
        return phase
    reflection, transmission = constants(paths.scene)
    factor = np.where(through, transmission[paths.surface], reflection[paths.surface])
    turn = np.where((paths.surface >= 0) & (factor != 0.0), np.angle(factor), 0.0)
    launched = getattr(paths.source, "amplitude", None)
    if launched is not None:
        phase += np.angle(launched[paths.ray])[:, None]
    phase[:, 1:-1] += np.cumsum(turn, axis=1)
    phase[:, -1] = phase[:, -2]
    rest = np.angle(paths.amplitude * np.exp(-1j * phase[:, -1]))  # 0 of no light
    known = np.array([s.boundary or s.element is not None for s in paths.scene.surfaces])
    hit = (paths.surface >= 0) & known[paths.surface]
    last = np.where(hit, np.arange(1, hit.shape[1] + 1), 0).max(axis=1, initial=0)
    late = np.arange(phase.shape[1]) >= last[:, None]
    return np.asarray(phase + np.where(late, rest[:, None], 0.0), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class SurfaceHits:
    """Hits of recorded paths on one surface.

    Attributes
    ----------
    surface : Surface
    path, hit : (n,) int64
        Which path, and which of its hits.
    point : (n, 3) float64, metres
    face : (n,) int64
        Number of the facet.
    """

    surface: Surface
    path: npt.NDArray[np.int64]
    hit: npt.NDArray[np.int64]
    point: FloatArray
    face: npt.NDArray[np.int64]

    __repr__ = short_repr

    @property
    def formed(self) -> npt.NDArray[np.bool_]:
        """Whether each hit is on a facet with an exact form, (n,) bool."""
        if self.surface.fit is None:
            return np.zeros(len(self.face), dtype=np.bool_)
        return np.asarray(self.surface.fit.along[self.face] != 0)

    @cached_property
    def corners(self) -> FloatArray:
        """Corners of the facets, the shortest side first, (n, 3, 3) float64, metres.

        Good for normals of needles.
        """
        corners = self.surface.mesh.vertices[self.surface.mesh.faces[self.face]]
        sides = ((np.roll(corners, -1, axis=1) - corners) ** 2).sum(axis=2)
        order = (np.argmin(sides, axis=1)[:, None] + np.arange(3)) % 3
        return np.take_along_axis(corners, order[:, :, None], axis=1)

    @cached_property
    def facet_normal(self) -> FloatArray:
        """Facet normals towards the front, (n, 3) float64, unit."""
        corner = self.corners
        return unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))

    @cached_property
    def normal(self) -> FloatArray:
        """Surface normals of either sign, those of the form if it has one, (n, 3) float64, unit."""
        normal, on = self.facet_normal.copy(), self.formed
        if on.any():
            normal[on] = unit(self.level(on, normal[on])[1])
        return normal

    def level(self, rows: Array, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Level function of the form at hits, and its derivatives.

        Parameters
        ----------
        rows : (n,) bool
            Which hits, k of them; all have a form.
        direction : (k, 3) float64, unit

        Returns
        -------
        value : (k,) float64, metres
        gradient : (k, 3) float64
        second : (k,) float64, 1/m
            Second derivative along `direction`.
        """
        point, fit = self.point[rows], self.surface.fit
        if isinstance(fit, LevelFit):
            return fit.form.level(point, direction)
        assert isinstance(fit, Patches)
        return fit.level(point, direction, self.face[rows])[:3]


def surface_hits(paths: Paths) -> Iterator[SurfaceHits]:
    """Hits of recorded paths, surface by surface.

    Parameters
    ----------
    paths : Paths
        Traced with record=True.

    Yields
    ------
    SurfaceHits

    Raises
    ------
    ValueError
        If the trace did not record them.
    """
    _recorded(paths, "surface_hits")
    assert paths.surface is not None
    assert paths.triangle is not None
    assert paths.points is not None
    for number, surface in enumerate(paths.scene.surfaces):
        path, hit = np.nonzero(paths.surface == number)
        if len(path):
            point = paths.points[path, hit + 1]
            yield SurfaceHits(surface, path, hit, point, paths.triangle[path, hit])
