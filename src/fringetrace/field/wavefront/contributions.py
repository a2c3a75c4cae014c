"""Contributions of waves at sample points: optical path and amplitude, the same for all wavelengths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, FloatArray, short_repr
from fringetrace.field.sample_points import Samples
from fringetrace.field.wavefront import plane_waves
from fringetrace.field.wavefront.patches import PatchCells
from fringetrace.field.wavefront.plane_waves import Region, Wave
from fringetrace.scene import Beam

if TYPE_CHECKING:
    from fringetrace.field.wavefront.uniform_airy import Folds

# No gradient seen yet: lowest and highest along x, and along y.
NONE = np.array([np.inf, -np.inf, np.inf, -np.inf])


@dataclass(frozen=True, eq=False)
class PlaneWave:
    """Plane wave off facets, and its region of a beam.

    `path` is a row of the paths that has its key, `odd` whether it has an odd number of half-wave losses.
    """

    path: int
    odd: bool
    beam: Beam
    wave: Wave
    region: Region

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class CurvedWave:
    """Curved wavefront of patches; `path` and `odd` as those of `PlaneWave`.

    `unit` is the area of the beam that a step of its grid stands for, in pixels.
    """

    path: int
    odd: bool
    unit: float
    cells: PatchCells

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class Contributions:
    """Contributions of waves at sample points.

    Attributes
    ----------
    points : Samples
    rows : (n, 2 + 2 components) float64
        Number of the point, optical path in metres less that of the wave, amplitudes: real and imaginary
        parts.
    begin : (waves + 1,) int64
        Where the rows of each wave begin.
    base : (waves,) float64, metres
        Optical path of each wave.
    slope : (points, 4) float64, metres a pixel, or (0, 4)
        Lowest and highest gradient of the path along x, and along y; see `fringes`.
    """

    points: Samples
    rows: FloatArray
    begin: npt.NDArray[np.int64]
    base: FloatArray
    slope: FloatArray

    __repr__ = short_repr

    @property
    def nbytes(self) -> int:
        """Memory of the tables, bytes."""
        return self.rows.nbytes + self.slope.nbytes + 5 * self.points.x.nbytes

    def field(
        self, wavelength: float, component: int, groups: int, group: npt.NDArray[np.int64], sign: FloatArray,
        folded: Mapping[int, Folds],
    ) -> tuple[ComplexArray, FloatArray]:  # fmt: skip
        """Field at the points.

        Parameters
        ----------
        wavelength : float, metres
        component : int
            Of light with a polarisation.
        groups : int
        group : (waves,) int64
            The group of each wave, and `sign` (waves,) a factor.
        folded : dict of wave to Folds
            Of the sheets that have folds: they have no rows, since more than their phases depends on the
            wavelength.

        Returns
        -------
        field : (groups, points) complex128
        slope : (points, 4) or (0, 4) float64, metres a pixel
            With that of the fringes beside folds.
        """
        from fringetrace.field.wavefront import raster_kernels, uniform_airy

        field, slope = self.points.blank(groups), self.slope
        factor = sign * np.exp(2j * np.pi * (np.fmod(self.base, wavelength) / wavelength))
        raster_kernels.add_waves(self.rows, self.begin, component, wavelength, group, factor, field)
        if folded and len(slope):
            slope = slope.copy()
        for number, sheet in folded.items():
            field[group[number]] += factor[number] * uniform_airy.light(sheet, self.points, slope)
        return field, slope


def find_contributions(
    plane: Sequence[PlaneWave], curved: Sequence[CurvedWave], components: int, points: Samples, slopes: bool
) -> Contributions:
    """Contributions of waves at sample points.

    Parameters
    ----------
    plane, curved : sequence
        Waves are counted in this order.
    components : int
        1, or 3 of light with a polarisation.
    points : Samples
    slopes : bool
        Whether gradients of the path are wanted.

    Returns
    -------
    Contributions
    """
    from fringetrace.field.wavefront import raster_kernels

    slope = np.tile(NONE, (len(points.x) if slopes else 0, 1))
    tables = [np.empty((0, 2 + 2 * components))]
    for one in plane:
        tables.append(plane_waves.find_contributions(one.wave, one.region, one.beam, points, slope))
    for sheet in curved:
        cells = sheet.cells
        if cells.folds:
            tables.append(tables[0])
            continue
        tables.append(
            raster_kernels.leaf_contributions(
                cells.leaves,
                cells.coefficients,
                cells.folded,
                cells.turns,
                sheet.unit,
                points.top,
                points.columns,
                points.first,
                points.x,
                points.y,
                slope,
            )
        )
    begin = np.cumsum([len(table) for table in tables]).astype(np.int64)
    base = np.array([0.0] * len(plane) + [sheet.cells.base for sheet in curved])
    return Contributions(points, np.concatenate(tables), begin, base, slope)
