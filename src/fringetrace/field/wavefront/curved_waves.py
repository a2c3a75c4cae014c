"""Curved wavefronts: patches between grid nodes, and patches fitted to rays at edges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray
from fringetrace.field.wavefront.boundary_search import cut
from fringetrace.field.wavefront.patch_fit import PatchFit, fitted, places
from fringetrace.field.wavefront.patches import (
    PatchCells,
    Sheet,
    arrivals,
    branch_turns,
    largest,
    leaved,
    patches,
    positions,
    sheet,
)
from fringetrace.field.wavefront.probe import Probe, profile
from fringetrace.field.wavefront.quadtree import PIXEL, STRAIGHT, Pieces, Squares, quarters
from fringetrace.field.wavefront.ray_tubes import differences
from fringetrace.field.wavefront.visibility import Survey, Witnesses
from fringetrace.scene import CCD
from fringetrace.tracing import components

# Segments that an edge within a cell is drawn with, at most.
SEGMENTS = 64
# Rays this many pixels off in the middle of a patch tell that it is none.
MIDDLE = 1e-4
# Fits that rays are so many off are poor: samples fall through the seams; cells are quartered so often;
POOR, QUARTERS = 1e-5, 3
# where they are still so many off, light is going everywhere and nothing is there.
LOST = 0.1
# Neighbours in a row that differences of fourth order need.
STENCIL = 5


def curved(survey: Survey) -> tuple[list[tuple[int, PatchCells]], FloatArray]:
    """Curved wavefronts off surfaces with a form, cut along their edges.

    Parameters
    ----------
    survey : Survey
        Of a beam's paths.

    Returns
    -------
    list of (number of the sequence, PatchCells)
        Of those that reach the CCD.
    segments : (n, 4) float64, pixels
        Their edges, and the rim of the beam: x, y of either end.
    """
    probe = survey.probe
    seen = {int(index): _squares(survey, int(index)) for index in np.flatnonzero(survey.curved)}
    which = [index for index, squares in seen.items() if len(squares.cell)]
    if not which:
        return [], np.empty((0, 4))
    cells = Squares.joined([seen[index].numbered(n) for n, index in enumerate(which)])
    grids = [_grid(survey, index) for index in which]
    names = survey.names[which]
    witnesses = survey.witnesses.numbered(which)
    pieces = cut(probe, names, cells, witnesses)
    pieces = pieces.part(np.lexsort((pieces.cell, pieces.wave)))
    coefficients, areas = zip(*(patches(grid) for grid in grids), strict=True)
    plain = _plain(probe, names, pieces, grids, coefficients)
    fits = _fits(probe, names, cells, pieces.part(~plain), [grid.base for grid in grids], witnesses)
    found, drawn = [], [np.empty((0, 4))]
    for n, (grid, fit) in enumerate(zip(grids, fits, strict=True)):
        mine = pieces.part(plain & (pieces.wave == n))
        row, column = np.divmod(mine.cell, probe.beam.shape[1])
        turns = branch_turns(grid.turns, areas[n])[row, column]
        patched = PatchFit(
            mine, np.arange(len(row)), coefficients[n][row, column], turns, mine.low, mine.high
        )
        found.append((which[n], _together([patched, *fit], grid.base, probe.ccd)))
        drawn += [_drawn(part, probe) for part in (patched, *fit)]
    return found, np.concatenate(drawn)


def _grid(survey: Survey, index: int) -> Sheet:
    """The sheet of a sequence on the nodes of the beam's grid, with the beam's profile."""
    probe = survey.probe
    found = sheet(survey.paths, survey.rows[index], probe.ccd, survey.shape)
    row, column = np.indices(survey.shape)
    light = profile(probe.beam, np.stack([column.ravel(), row.ravel()], axis=1)).reshape(*survey.shape, 1)
    return replace(found, amplitude=found.amplitude * light)


def _around(values: FloatArray) -> FloatArray:
    """Largest of the corners of each cell, or else of the nodes around it; -inf where none is known."""
    known = np.where(np.isfinite(values), values, -np.inf)
    corner, near = largest(known, 2), largest(np.pad(known, 1, constant_values=-np.inf), 4)
    return np.where(np.isfinite(corner), corner, near)


def _squares(survey: Survey, index: int) -> Squares:
    """Cells that a sheet may light, towards the CCD."""
    lit = survey.corners(index)
    y, x = np.moveaxis(positions(survey.paths, survey.rows[index], survey.probe.ccd, survey.shape), -1, 0)
    steps = [np.hypot(differences(x, axis), differences(y, axis)) for axis in (0, 1)]
    scale = np.maximum(*(_around(step) for step in steps))
    # light that goes past the CCD's plane is spread without bounds
    scale = np.minimum(np.where(scale > 0.0, scale, PIXEL / STRAIGHT), max(survey.probe.ccd.shape))
    # the least step: next to where light goes past the CCD's plane there are large ones
    margin = -np.maximum(*(_around(-step) for step in steps))
    margin = np.where(np.isfinite(margin), margin, np.inf)
    row, column = np.nonzero(survey.cells(index))
    # of what only rays between the nodes found, nothing is known
    margin = margin[row, column]
    blank = np.isinf(margin)
    near, margin = np.ones(len(row), dtype=np.bool_), np.where(blank, 0.0, margin)
    for place, count in ((x, survey.probe.ccd.shape[1]), (y, survey.probe.ccd.shape[0])):
        least, most = -_around(-place)[row, column], _around(place)[row, column]
        near &= blank | ((most + margin > 0.0) & (least - margin < count))
    row, column = row[near], column[near]
    low = np.stack([column, row], axis=1).astype(np.float64)
    cell = row * lit.shape[1] + column
    return Squares(np.zeros(len(row), dtype=np.int64), cell, scale[row, column], low, lit[row, column], 1.0)


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


def _plain(
    probe: Probe, names: Array, pieces: Pieces, grids: list[Sheet], patched: tuple[FloatArray, ...]
) -> npt.NDArray[np.bool_]:
    """Pieces that are whole cells with neighbours enough, where the rays in the middle agree."""
    plain = pieces.whole
    middle = np.full((len(plain), 2), np.nan)
    for n, (grid, coefficients) in enumerate(zip(grids, patched, strict=True)):
        complete = _complete(np.isfinite(grid.x))
        good = complete[:-1, :-1] & complete[:-1, 1:] & complete[1:, 1:] & complete[1:, :-1]
        good &= np.isfinite(coefficients).all(axis=(2, 3, 4))
        mine = pieces.wave == n
        plain[mine] &= good.ravel()[pieces.cell[mine]]
        half = 0.5 ** np.arange(4)
        middle[mine] = (half @ coefficients[:, :, :2] @ half).reshape(-1, 2)[pieces.cell[mine]]
    rows = np.flatnonzero(plain)
    paths, landed, found, _ = probe.paths(pieces.low[rows] + 0.5)
    arrived = rows[paths.ray[landed]]
    here = arrivals(paths, landed, probe.ccd)
    with np.errstate(invalid="ignore"):
        off = np.hypot(here.x - middle[arrived, 0], here.y - middle[arrived, 1])
    sure = np.zeros(len(plain), dtype=np.bool_)
    sure[arrived[(off < MIDDLE) & (found == names[pieces.wave[arrived]])]] = True
    return sure


def _fits(
    probe: Probe, names: Array, squares: Squares, pieces: Pieces, bases: list[float], witnesses: Witnesses
) -> list[list[PatchFit]]:
    """Fits of the cells of pieces, and of their quarters where need be; tables for each sheet."""
    tables: list[list[PatchFit]] = [[] for _ in bases]
    for level in range(QUARTERS + 1):
        bad = np.zeros(len(squares.cell), dtype=np.bool_)
        for n, (fit, off) in enumerate(_fitted(probe, names, pieces, bases)):
            poor = off > (LOST if level == QUARTERS else POOR)
            cells = np.unique(fit.pieces.cell[poor[fit.owner]])
            bad |= (squares.wave == n) & np.isin(squares.cell, cells)
            tables[n].append(fit.where(~poor))
        if level == QUARTERS or not bad.any():
            break
        squares = quarters(probe, names, squares.part(bad))
        squares = replace(squares, cell=np.arange(len(squares.cell)))
        pieces = cut(probe, names, squares, witnesses)
    return tables


def _fitted(
    probe: Probe, names: Array, pieces: Pieces, bases: list[float]
) -> list[tuple[PatchFit, FloatArray]]:
    """Fits to rays that start inside the pieces, a table for each sheet, and what rays are off."""
    units, owner = np.unique(np.stack([pieces.wave, pieces.cell]), axis=1, return_inverse=True)
    owner = owner.ravel()
    at, low, high = places(pieces, owner, units.shape[1])
    starts = at.reshape(-1, 2)
    paths, rows, found, _ = probe.paths(starts)
    wanted = np.repeat(names[units[0]], at.shape[1])
    rows = rows[found == wanted[paths.ray[rows]]]
    amplitude = (components(paths, probe.ccd) * profile(probe.beam, starts)[paths.ray]).T
    wave = units[0][paths.ray[rows] // at.shape[1]]
    fits = []
    for n, base in enumerate(bases):
        mine = slice(*np.searchsorted(units[0], [n, n + 1]))
        part, arrived = pieces.wave == n, rows[wave == n]
        coefficients, turns, good, off = fitted(
            at[mine], low[mine], high[mine], paths.ray[arrived] - mine.start * at.shape[1],
            arrivals(paths, arrived, probe.ccd), amplitude[arrived], base, probe.ccd.shape,
        )  # fmt: skip
        fit = PatchFit(
            pieces.part(part), owner[part] - mine.start, coefficients, turns, low[mine], high[mine]
        )
        fits.append((fit.where(good), off[good]))
    return fits


def _together(parts: list[PatchFit], base: float, ccd: CCD) -> PatchCells:
    """One sheet's cells and leaves, of several tables of fits."""
    before = np.cumsum([0] + [len(part.coefficients) for part in parts])
    owner = [part.owner + offset for part, offset in zip(parts, before[:-1], strict=True)]
    return leaved(
        np.concatenate([part.coefficients for part in parts]),
        np.concatenate([part.turns for part in parts]),
        base,
        np.concatenate([part.place for part in parts]),
        np.concatenate(owner),
        np.concatenate([part.domain for part in parts]),
        np.concatenate([part.lines for part in parts]),
        ccd,
    )


def _drawn(fit: PatchFit, probe: Probe) -> FloatArray:
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
