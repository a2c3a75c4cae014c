"""Beam tracing: a collimated beam through the facets of a scene, to its footprints on the CCD."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray
from fringetrace.field import beam_kernels as kernels, beam_tables, visibility_kernels
from fringetrace.scene import CCD, Beam, Scene, screen
from fringetrace.tracing import LEAF, arrange, constants

# A beam that lights less than this part of a pixel is not followed: some hundred such would make 1e-5.
SLIVER = 1e-7
# Rounding: lengths that differ by less than this part of a pixel, or of the scene, are the same.
SAME_IN_PIXEL, SAME_IN_SCENE = 1e-10, 1e-14
# Facets in a part of the source that one thread follows, and the fewest and most parts.
PART, FEWEST, MOST = 16384, 8, 128


@dataclass(frozen=True, eq=False)
class Footprints:
    """Where the light of a beam falls on a CCD: for each way that it took a convex polygon with a plane wave.

    Attributes
    ----------
    corners : (k, 2) float64, pixels
        Column and row coordinate of the corners of all polygons.
    first : (n + 1,) int64
        Where those of each begin.
    wave : (n, 13) float64
        Columns as `beam_tables` names them: a point in pixels, path there in metres, its gradient in metres
        a pixel, complex amplitude, and where in the source the light comes from.
    key : (n,) uint64
        Path keys.
    detected, left, absorbed, truncated, dropped : float
        Where the power went, in m^2 of a beam of unit irradiance; `dropped` is that of slivers narrower than
        `SLIVER`, which counts as `left`.
    """

    corners: FloatArray
    first: npt.NDArray[np.int64]
    wave: FloatArray
    key: npt.NDArray[np.uint64]
    detected: float
    left: float
    absorbed: float
    truncated: float
    dropped: float

    def __len__(self) -> int:
        return len(self.key)

    @property
    def nbytes(self) -> int:
        """Memory that they take."""
        return self.corners.nbytes + self.first.nbytes + self.wave.nbytes + self.key.nbytes


def facet_tables(scene: Scene) -> beam_tables.Facets:
    """Facets of a scene in the order of a tree of boxes over each surface, as the compiled loops take them.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    beam_tables.Facets
    """
    roots, box, first = [], 0, 0
    for surface in scene.surfaces:
        leaves = 1 << max(0, (-(-len(surface.mesh.faces) // LEAF) - 1).bit_length())
        roots.append((box, leaves, first))
        box, first = box + 2 * leaves, first + LEAF * leaves
    corners, owner, boxes = np.full((first, 9), np.nan), np.full(first, -1, np.int32), np.zeros((box, 6))
    for number, (surface, (box, leaves, first)) in enumerate(zip(scene.surfaces, roots, strict=True)):
        table = surface.mesh.corners
        order = arrange(np.ascontiguousarray(table.mean(axis=1).T), leaves)
        corners[first : first + len(table)] = table.reshape(-1, 9)[order]
        owner[first : first + len(table)] = number
        visibility_kernels.fill(corners, first, leaves, LEAF, box, boxes)
    planes = np.empty((len(corners), 4))
    visibility_kernels.planes_of(corners, planes)
    return beam_tables.Facets(corners, planes, owner, boxes, np.array(roots, dtype=np.int64))


def follow_beam(scene: Scene, beam: Beam, ccd: CCD, max_bounces: int, min_amplitude: float) -> Footprints:
    """Footprints on a CCD of a beam that plane mirrors and thin plates send there.

    Parameters
    ----------
    scene : Scene
        Surfaces of constant amplitude in a vacuum; forms are not regarded.
    beam : Beam
        Its profile is not regarded.
    ccd : CCD
    max_bounces : int
        Surfaces that light may meet.
    min_amplitude : float
        Fainter light is not followed, relative to that launched.

    Returns
    -------
    Footprints
        The same for any number of threads.
    """
    reflection, transmission = constants(scene)
    base = 2 * len(scene.surfaces) + 1
    optics = beam_tables.Interfaces(reflection, transmission, base, max_bounces, min_amplitude**2)
    return _joined(*_followed(scene, beam, ccd, optics))


def _followed(
    scene: Scene, beam: Beam, ccd: CCD, optics: beam_tables.Interfaces
) -> tuple[list[list[Array]], FloatArray]:
    """Tables of footprints (corners, ends, waves, keys) for parts of the source, and the power."""
    facets = facet_tables(scene)
    size = float(np.nanmax(np.abs(facets.corners.reshape(-1, 3) - beam.centre)))
    slack = max(SAME_IN_PIXEL * ccd.pitch, SAME_IN_SCENE * size)
    limits = beam_tables.Tolerances(SLIVER * ccd.pitch**2, slack, SAME_IN_SCENE * size)
    source = np.concatenate([beam.centre, *beam.axes, np.zeros(4)])
    width, height = beam.size
    count = sum(len(surface.mesh.faces) for surface in scene.surfaces)
    edges = np.linspace(-0.5, 0.5, int(np.clip(count // PART, FEWEST, MOST)) + 1) * height

    def part(k: int) -> tuple[list[Array], FloatArray]:
        x, low, high = 0.5 * width, edges[k], edges[k + 1]
        section = np.array([(-x, low), (x, low), (x, high), (-x, high)])
        out, done, power = kernels.follow(
            source, section, LEAF, facets, optics, limits, np.array(screen(ccd)), ccd.pitch, ccd.shape
        )
        end = out.end[:done, 0].copy()
        corners = out.corners[: end[-1] if done else 0].copy()
        return [corners, end, out.wave[:done].copy(), out.key[:done, 0].view(np.uint64).copy()], power

    with ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="fringetrace") as pool:
        tables, powers = zip(*pool.map(part, range(len(edges) - 1)), strict=True)
    return list(tables), np.sum(powers, axis=0)


def _joined(tables: list[list[Array]], power: FloatArray) -> Footprints:
    """The footprints of all parts of the source, each table of theirs let go when it is copied."""
    before = np.cumsum([0] + [len(table[0]) for table in tables])
    for table, offset in zip(tables, before, strict=False):
        table[1] += offset

    def column() -> Array:
        return np.concatenate([table.pop(0) for table in tables])

    corners, end, wave, key = (column() for _ in range(4))
    first = np.concatenate([np.zeros(1, dtype=np.int64), end])
    return Footprints(corners, first, wave, key, *power.tolist())
