"""Wavefront patches: bicubic Hermite interpolation of arrivals from the beam's grid to the CCD."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray
from fringetrace.field.wavefront.ray_tubes import along_grid, caustics, differences
from fringetrace.scene import CCD, Beam, pixels
from fringetrace.tracing import Paths, components, landed

# Of the fields of a cell (x, y, path, J) the amplitudes come last: two for each component.
AMPLITUDE = 4
# From values and slopes at both ends to the coefficients of a cubic.
HERMITE = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [-3, 3, -2, -1], [2, -2, 1, 1]])


@dataclass(frozen=True, eq=False)
class Sheet:
    """Arrivals of one path key on the beam's grid; NaN where there are none.

    Attributes
    ----------
    x, y : (rows, columns) float64, pixels
        Column and row coordinate in the CCD's plane of focus, inside the CCD or not.
    slope_x, slope_y : (rows, columns) float64, metres a pixel
        Gradient of the optical path there: the ray's direction.
    length : (rows, columns) float64, metres
        Optical path, less `base`.
    base : float, metres
    amplitude : (rows, columns, components) complex128
        See `components`.
    turns : (rows, columns) int64
        Caustics passed (the KMAH index).
    """

    x: FloatArray
    y: FloatArray
    slope_x: FloatArray
    slope_y: FloatArray
    length: FloatArray
    base: float
    amplitude: ComplexArray
    turns: npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class PatchCells:
    """Cells of a wavefront in the form that the kernels read; for `place` see `leaved`."""

    coefficients: FloatArray
    leaves: FloatArray
    folded: npt.NDArray[np.bool_]
    turns: npt.NDArray[np.int64]
    base: float
    place: npt.NDArray[np.int64]

    def component(self, number: int) -> FloatArray:
        """Coefficients (n, 6, 4, 4) with one component of the amplitude."""
        if self.coefficients.shape[1] == AMPLITUDE + 2:
            return self.coefficients
        chosen = [*range(AMPLITUDE), AMPLITUDE + 2 * number, AMPLITUDE + 2 * number + 1]
        return np.ascontiguousarray(self.coefficients[:, chosen])

    @cached_property
    def crossed(self) -> npt.NDArray[np.bool_]:
        """Which squares of the beam's grid (n,) a fold crosses: J changes its sign at their corners."""
        corner = np.array([[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]])
        corners = np.einsum("si,nij,tj->nst", corner, self.coefficients[:, 3], corner)
        signs = (corners.min(axis=(1, 2)) <= 0.0) & (corners.max(axis=(1, 2)) >= 0.0)
        return np.asarray(signs & (self.place >= 0).all(axis=1))

    @cached_property
    def folds(self) -> bool:
        """Whether there are folds, where the field depends on the wavelength beyond its phase."""
        from fringetrace.field.wavefront.raster_kernels import SIGN

        return bool(self.crossed.any() or (self.leaves[:, SIGN] == 0.0).any())


def sheets(paths: Paths) -> Iterator[Sheet]:
    """Arrivals of a beam on its grid, one table per path key.

    Parameters
    ----------
    paths : Paths
        Of a `Beam`, onto a CCD. Where `points` were recorded, caustics are counted.

    Yields
    ------
    Sheet
        One for each key, in the order of the keys.

    Raises
    ------
    ValueError
        If the source is no beam, or there is no CCD.
    """
    ccd, beam = checked(paths)
    rows, _, _ = landed(paths, ccd)
    keys = paths.key[rows]
    for key in np.unique(keys):
        yield sheet(paths, rows[keys == key], ccd, beam.shape)


def on_grid(values: Array, node: Array, shape: tuple[int, int]) -> Array:
    """Values (n, ...) of nodes on their grid (rows, columns, ...); NaN, or 0 of whole numbers, elsewhere."""
    fill = np.nan if values.dtype.kind in "fc" else 0
    blank = np.full((shape[0] * shape[1], *values.shape[1:]), fill, dtype=values.dtype)
    blank[node] = values
    return blank.reshape(*shape, *values.shape[1:])


def positions(paths: Paths, rows: Array, ccd: CCD, shape: tuple[int, int]) -> FloatArray:
    """Where some paths cross the CCD's plane of focus, (rows, columns, 2) pixels on a grid: y, x."""
    chosen = paths.where(rows)
    return on_grid(pixels(ccd, landed(chosen, ccd)[1]), chosen.ray, shape)


def sheet(paths: Paths, rows: Array, ccd: CCD, shape: tuple[int, int]) -> Sheet:
    """Arrivals of one surface sequence on a grid.

    Parameters
    ----------
    paths : Paths
        `ray` is the number of the node of the grid.
    rows : (n,) int64
        Which of them; they cross the CCD's plane of focus.
    ccd : CCD
    shape : (rows, columns)

    Returns
    -------
    Sheet
    """
    chosen = paths.where(rows)
    arrived = arrivals(paths, rows, ccd)

    def grid(values: Array) -> Array:
        return on_grid(values, chosen.ray, shape)

    base = float(arrived.length.mean()) if len(rows) else 0.0
    turns = np.zeros(shape, dtype=np.int64)
    if arrived.way is not None:
        way, direction, last = grid(arrived.way), grid(arrived.direction), grid(arrived.last)
        turns = caustics(way, direction, last, along_grid)
    return Sheet(
        x=grid(arrived.x), y=grid(arrived.y), slope_x=grid(arrived.slope_x), slope_y=grid(arrived.slope_y),
        length=grid(arrived.length - base), base=base, amplitude=grid(components(chosen, ccd).T), turns=turns,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Arrivals:
    """Arrivals of paths (n,) with equal numbers of bounces; as in `Sheet`, and for `caustics`.

    `length` is the whole path, `way` (n, bounces + 2, 3) the points that it went through, None unless
    recorded, `direction` (n, 3) that of its last leg, `last` that leg's length.
    """

    x: FloatArray
    y: FloatArray
    slope_x: FloatArray
    slope_y: FloatArray
    length: FloatArray
    way: FloatArray | None
    direction: FloatArray
    last: FloatArray


def arrivals(paths: Paths, rows: Array, ccd: CCD) -> Arrivals:
    """Arrivals of paths with equal numbers of bounces on the CCD's plane of focus.

    Parameters
    ----------
    paths : Paths
    rows : (n,) int64
        Which of them.
    ccd : CCD

    Returns
    -------
    Arrivals
    """
    u, v, _ = ccd.axes
    chosen = paths.where(rows)
    _, point, length = landed(chosen, ccd)
    pixel, direction = pixels(ccd, point), chosen.direction
    way, last = None, np.zeros(len(rows))
    if chosen.points is not None:
        bounces = int(chosen.bounces.max(initial=0))
        way = np.concatenate([chosen.points[:, : bounces + 1], point[:, None]], axis=1)
        last = np.einsum("ij,ij->i", way[:, -1] - way[:, -2], direction)
    return Arrivals(
        x=pixel[:, 1],
        y=pixel[:, 0],
        slope_x=chosen.gradient @ u * ccd.pitch,
        slope_y=chosen.gradient @ v * ccd.pitch,
        length=length,
        way=way,
        direction=direction,
        last=last,
    )


def checked(paths: Paths) -> tuple[CCD, Beam]:
    """CCD and beam of paths; ValueError unless they have both.

    Parameters
    ----------
    paths : Paths

    Returns
    -------
    CCD, Beam

    Raises
    ------
    ValueError
        If the source is no beam, or there is no CCD.
    """
    if paths.ccd is None:
        raise ValueError("wavefront: expected paths traced onto a CCD, got paths without one")
    if not isinstance(paths.source, Beam):
        raise ValueError(f"wavefront: expected paths of a Beam, got those of {type(paths.source).__name__}")
    return paths.ccd, paths.source


def _bicubic(f: FloatArray, along_s: FloatArray, along_t: FloatArray, twist: FloatArray) -> FloatArray:
    """Coefficients (rows - 1, columns - 1, 4, 4) of s^i t^j from nodes and their derivatives."""

    def corners(g: FloatArray) -> FloatArray:
        return np.stack([np.stack([g[:-1, :-1], g[1:, :-1]], -1), np.stack([g[:-1, 1:], g[1:, 1:]], -1)], -2)

    data = np.concatenate(
        [
            np.concatenate([corners(f), corners(along_t)], axis=-1),
            np.concatenate([corners(along_s), corners(twist)], axis=-1),
        ],
        axis=-2,
    )
    return np.asarray(HERMITE @ data @ HERMITE.T, dtype=np.float64)


def _interpolated(f: FloatArray) -> FloatArray:
    """Bicubic of values alone."""
    along_s = differences(f, 1)
    return _bicubic(f, along_s, differences(f, 0), differences(along_s, 0))


def patches(sheet: Sheet) -> tuple[FloatArray, FloatArray]:
    """Bicubic Hermite patches between the nodes of a grid.

    The optical path has the exact gradient, dW = p . dx; positions have tangents by differences
    of fourth order.

    Parameters
    ----------
    sheet : Sheet

    Returns
    -------
    coefficients : (rows - 1, columns - 1, 4 + 2 components, 4, 4) float64
        See `raster`; NaN where a corner is missing.
    area : (rows, columns) float64
        The map's Jacobian at the nodes.
    """
    x_s, x_t = differences(sheet.x, 1), differences(sheet.x, 0)
    y_s, y_t = differences(sheet.y, 1), differences(sheet.y, 0)
    w_s = sheet.slope_x * x_s + sheet.slope_y * y_s
    w_t = sheet.slope_x * x_t + sheet.slope_y * y_t
    area = x_s * y_t - x_t * y_s
    fields = [
        _bicubic(sheet.x, x_s, x_t, differences(x_s, 0)),
        _bicubic(sheet.y, y_s, y_t, differences(y_s, 0)),
        _bicubic(sheet.length, w_s, w_t, 0.5 * (differences(w_s, 0) + differences(w_t, 1))),
        _interpolated(area),
    ]
    for component in np.moveaxis(sheet.amplitude, -1, 0):
        fields += [_interpolated(component.real), _interpolated(component.imag)]
    return np.stack(fields, axis=2), area


def leaved(
    coefficients: FloatArray,
    turns: npt.NDArray[np.int64],
    base: float,
    place: npt.NDArray[np.int64],
    owner: npt.NDArray[np.int64],
    domain: FloatArray,
    lines: FloatArray,
    ccd: CCD,
) -> PatchCells:
    """Patch cells with their quadtree leaves.

    Parameters
    ----------
    coefficients : (n, 4 + 2 components, 4, 4) float64
    turns : (n, 2) int64
    base : float, metres
    place : (n, 2) int64
        Row and column on the beam's grid; -1 for what is no whole cell of it.
    owner : (m,) int64
        Which cells parts of them, that are lit, belong to.
    domain : (m, 4) float64
        Those parts: s from and to, t from and to.
    lines : (m, 3) float64
        a, b, c: lit where a s + b t >= c.
    ccd : CCD

    Returns
    -------
    PatchCells
    """
    from fringetrace.field.wavefront import raster_kernels

    leaves = raster_kernels.split_cells(np.ascontiguousarray(coefficients[owner]), domain, lines, *ccd.shape)
    leaves[:, raster_kernels.CELL] = owner[leaves[:, raster_kernels.CELL].astype(np.int64)]
    folded = np.zeros(len(coefficients), dtype=np.bool_)
    signs = np.zeros((len(coefficients), 2), dtype=np.bool_)
    for branch, sign in enumerate((-1.0, 1.0)):
        signs[
            leaves[leaves[:, raster_kernels.SIGN] == sign, raster_kernels.CELL].astype(np.int64), branch
        ] = True
    folded[leaves[leaves[:, raster_kernels.SIGN] == 0.0, raster_kernels.CELL].astype(np.int64)] = True
    folded |= signs.all(axis=1)
    return PatchCells(np.ascontiguousarray(coefficients), leaves, folded, turns, base, place)


def cells(sheet: Sheet, ccd: CCD) -> PatchCells:
    """Bicubic Hermite patches between the nodes of a grid, with their quadtree leaves.

    At the rim of the beam's grid a cell reaches on to the rim of the beam, half a cell beyond the rays.

    Parameters
    ----------
    sheet : Sheet
    ccd : CCD

    Returns
    -------
    PatchCells
    """
    coefficients, area = patches(sheet)
    whole = np.isfinite(coefficients).all(axis=(2, 3, 4))
    row, column = np.nonzero(whole)
    rows, columns = whole.shape
    domain = np.stack(
        [
            np.where(column == 0, -0.5, 0.0), np.where(column == columns - 1, 1.5, 1.0),
            np.where(row == 0, -0.5, 0.0), np.where(row == rows - 1, 1.5, 1.0),
        ], axis=1,
    )  # fmt: skip
    lines = np.tile([0.0, 0.0, -1.0], (len(domain), 1))  # all of each cell
    turns = branch_turns(sheet.turns, area)[whole]
    place = np.argwhere(whole)
    return leaved(coefficients[whole], turns, sheet.base, place, np.arange(len(domain)), domain, lines, ccd)


def largest(grid: Array, size: int) -> Array:
    """Maximum of each size x size window of a grid."""
    rows, columns = (n - size + 1 for n in grid.shape)
    window = range(size)
    return np.asarray(np.max([grid[i : i + rows, j : j + columns] for i in window for j in window], axis=0))


def branch_turns(turns: npt.NDArray[np.int64], area: FloatArray) -> npt.NDArray[np.int64]:
    """Caustics passed in each cell where J < 0 and where J > 0, from its corners of that sign.

    A fold that reaches into a cell, but to none of its corners, has them in the next cell.
    """
    none = -(1 << 30)
    branches = []
    for sign in (-1.0, 1.0):
        known = np.where(area * sign > 0.0, turns, none)
        corner, near = largest(known, 2), largest(np.pad(known, 1, constant_values=none), 4)
        branches.append(np.where(corner > none, corner, np.where(near > none, near, 0)))
    return np.stack(branches, axis=-1)
