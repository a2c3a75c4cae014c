"""Curved sheets of traced beams: patches between the nodes, and at edges patches fitted to rays inside."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from fringetrace.fits import Fit, fitted, places
from fringetrace.outlines import PIXEL, STRAIGHT, Pieces, Squares, cut, widened
from fringetrace.probes import Probe, Survey, profile
from fringetrace.scene import CCD
from fringetrace.sheets import (
    Cells,
    Sheet,
    arrivals,
    branch_turns,
    differences,
    largest,
    leaved,
    patches,
    sheet,
)
from fringetrace.waves import Array, FloatArray

# Segments that an edge within a cell is drawn with, at most.
SEGMENTS = 64
# Neighbours in a row that differences of fourth order need.
STENCIL = 5


def curved(survey: Survey) -> tuple[list[Cells], FloatArray]:
    """Sheets that met surfaces with a form, cut along their edges.

    Parameters
    ----------
    survey : Survey
        Of a beam's paths. What no node of the grid lights is not seen.

    Returns
    -------
    list of Cells
    segments : (n, 4) float64, pixels
        Their edges, and the rim of the beam: x, y of either end.
    """
    probe = survey.probe
    which = np.flatnonzero(survey.curved)
    if len(which) == 0:
        return [], np.empty((0, 4))
    grids = [_grid(survey, index) for index in which]
    squares = [
        _squares(survey, index, grid, n) for n, (index, grid) in enumerate(zip(which, grids, strict=True))
    ]
    columns = (np.concatenate(column) for column in zip(*squares, strict=True))
    names = survey.names[which]
    pieces = cut(probe, names, Squares(*columns, 1.0))
    order = np.lexsort((pieces.cell, pieces.wave))
    pieces = pieces.part(order)
    coefficients, areas = zip(*(patches(grid) for grid in grids), strict=True)
    plain = _plain(pieces, grids, coefficients)
    fits = _fits(probe, names, pieces.part(~plain), [grid.base for grid in grids])
    found, drawn = [], [np.empty((0, 4))]
    for n, (grid, fit) in enumerate(zip(grids, fits, strict=True)):
        mine = pieces.part(plain & (pieces.wave == n))
        row, column = np.divmod(mine.cell, probe.beam.shape[1])
        turns = branch_turns(grid.turns, areas[n])[row, column]
        patched = Fit(mine, np.arange(len(row)), coefficients[n][row, column], turns, mine.low, mine.high)
        found.append(_together([patched, fit], grid.base, probe.ccd))
        drawn += [_drawn(part, probe) for part in (patched, fit)]
    return found, np.concatenate(drawn)


def _grid(survey: Survey, index: int) -> Sheet:
    """The sheet of a sequence on the nodes of the beam's grid, with the beam's profile."""
    probe = survey.probe
    found = sheet(survey.paths, survey.rows[index], probe.ccd, survey.shape)
    row, column = np.indices(survey.shape)
    light = profile(probe.beam, np.stack([column.ravel(), row.ravel()], axis=1)).reshape(survey.shape)
    return replace(found, amplitude=found.amplitude * light)


def _around(values: FloatArray) -> FloatArray:
    """Largest of the 4 x 4 nodes around each cell; -inf where none is known."""
    known = np.where(np.isfinite(values), values, -np.inf)
    return largest(np.pad(known, 1, constant_values=-np.inf), 4)


def _squares(survey: Survey, index: int, grid: Sheet, number: int) -> tuple[Array, ...]:
    """Cells that a sheet may light, towards the CCD; columns of `Squares`."""
    lit = survey.corners(index)
    x, y = grid.x, grid.y
    steps = [np.hypot(differences(x, axis), differences(y, axis)) for axis in (0, 1)]
    scale = np.maximum(*(_around(step) for step in steps))
    most = float(scale.max())
    scale = np.where(scale > 0.0, scale, most if most > 0.0 else PIXEL / STRAIGHT)
    near = widened(lit.any(axis=-1))
    for place, count in ((x, survey.probe.ccd.shape[1]), (y, survey.probe.ccd.shape[0])):
        low, high = -_around(-place), _around(place)
        near &= (high + 2.0 * scale > 0.0) & (low - 2.0 * scale < count)
    row, column = np.nonzero(near)
    low = np.stack([column, row], axis=1).astype(np.float64)
    cell = row * lit.shape[1] + column
    return np.full(len(row), number), cell, scale[row, column], low, lit[row, column]


def _complete(lit: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Nodes with neighbours enough in their row and in their column."""
    complete = lit.copy()
    for axis in (0, 1):
        along = np.moveaxis(lit, axis, 0)
        runs = np.zeros_like(along)
        count = len(along) - STENCIL + 1
        if count > 0:
            five = np.all([along[k : k + count] for k in range(STENCIL)], axis=0)
            for k in range(STENCIL):
                runs[k : k + count] |= five
        complete &= np.moveaxis(runs, 0, axis)
    return complete


def _plain(pieces: Pieces, grids: list[Sheet], coefficients: tuple[FloatArray, ...]) -> npt.NDArray[np.bool_]:
    """Pieces that are whole cells between nodes with neighbours enough."""
    plain = pieces.whole
    for n, (grid, known) in enumerate(zip(grids, coefficients, strict=True)):
        complete = _complete(np.isfinite(grid.x))
        good = complete[:-1, :-1] & complete[:-1, 1:] & complete[1:, 1:] & complete[1:, :-1]
        good &= np.isfinite(known).all(axis=(2, 3, 4))
        mine = pieces.wave == n
        plain[mine] &= good.ravel()[pieces.cell[mine]]
    return plain


def _fits(probe: Probe, names: Array, pieces: Pieces, bases: list[float]) -> list[Fit]:
    """Fits of the cells of pieces, one table for each sheet, to rays that start inside the pieces."""
    units, owner = np.unique(np.stack([pieces.wave, pieces.cell]), axis=1, return_inverse=True)
    owner = owner.ravel()
    at, low, high = places(pieces, owner, units.shape[1])
    paths, rows, found, _ = probe.paths(at.reshape(-1, 2))
    wanted = np.repeat(names[units[0]], at.shape[1])
    rows = rows[found == wanted[paths.ray[rows]]]
    paths = replace(paths, amplitude=paths.amplitude * profile(probe.beam, at.reshape(-1, 2))[paths.ray])
    sheet_of = units[0][paths.ray[rows] // at.shape[1]]
    fits = []
    for n, base in enumerate(bases):
        mine = np.flatnonzero(units[0] == n)
        part = pieces.wave == n
        first = int(mine[0]) if len(mine) else 0
        arrived = rows[sheet_of == n]
        coefficients, turns, good = fitted(
            at[mine], low[mine], high[mine], paths.ray[arrived] - first * at.shape[1],
            arrivals(paths, arrived, probe.ccd), paths.amplitude[arrived], base,
        )  # fmt: skip
        own = owner[part] - first
        fits.append(Fit(pieces.part(part), own, coefficients, turns, low[mine], high[mine]).where(good))
    return fits


def _together(parts: list[Fit], base: float, ccd: CCD) -> Cells:
    """One sheet's cells and leaves, of several tables of fits."""
    before = np.cumsum([0] + [len(part.coefficients) for part in parts])
    owner = [part.owner + offset for part, offset in zip(parts, before[:-1], strict=True)]
    return leaved(
        np.concatenate([part.coefficients for part in parts]),
        np.concatenate([part.turns for part in parts]),
        base,
        np.concatenate(owner),
        np.concatenate([part.domain for part in parts]),
        np.concatenate([part.lines for part in parts]),
        ccd,
    )


def _drawn(fit: Fit, probe: Probe) -> FloatArray:
    """Segments (n, 4) in pixels: chords of pieces, and what of the beam's rim they touch."""
    pieces = fit.pieces
    ends, owner = [pieces.chord[pieces.cut]], [fit.owner[pieces.cut]]
    sides = np.stack([pieces.low, pieces.high], axis=1)
    for axis, count in ((0, probe.beam.shape[1]), (1, probe.beam.shape[0])):
        for side, rim in ((0, 0), (1, count)):
            at_rim = np.flatnonzero(sides[:, side, axis] == rim)
            touching = sides[at_rim].copy()
            touching[:, :, axis] = rim
            ends.append(touching)
            owner.append(fit.owner[at_rim])
    return fit.drawn(np.concatenate(ends), np.concatenate(owner), SEGMENTS)
