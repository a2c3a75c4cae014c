"""Visibility from the beam's grid: surface sequences at its nodes, and features between them."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray
from fringetrace.field.wavefront.feature_edges import places_beside_edges
from fringetrace.field.wavefront.patches import checked
from fringetrace.field.wavefront.probe import Probe
from fringetrace.scene import CCD, group_facets
from fringetrace.tracing import Paths, join, landed

# Rays sent beside edges of meshes, as many times the nodes.
MOST = 4

Names = npt.NDArray[np.uint64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Witnesses:
    """Samples (lines or points) on the beam's grid where a surface sequence is lit, or dark.

    Attributes
    ----------
    wave : (n,) int64
        Number of the sequence.
    begin, end : (n, 2) float64
        Columns and rows, in cells; rays from both ends said so.
    lit : (n,) bool
    """

    wave: npt.NDArray[np.int64]
    begin: FloatArray
    end: FloatArray
    lit: Mask

    def part(self, rows: Array) -> Witnesses:
        """Subset of the samples."""
        return Witnesses(*(getattr(self, field.name)[rows] for field in fields(self)))

    @staticmethod
    def joined(parts: list[Witnesses]) -> Witnesses:
        """Concatenation of tables; an empty one of none."""
        none = Witnesses(
            np.empty(0, dtype=np.int64), np.empty((0, 2)), np.empty((0, 2)), np.empty(0, dtype=np.bool_)
        )
        columns = ([getattr(part, field.name) for part in [none, *parts]] for field in fields(Witnesses))
        return Witnesses(*(np.concatenate(column) for column in columns))

    def numbered(self, waves: list[int]) -> Witnesses:
        """Samples of some sequences, numbered from 0 in their order."""
        number = np.full(max(int(self.wave.max(initial=0)), *waves, 0) + 1, -1)
        number[waves] = np.arange(len(waves))
        wave = number[self.wave]
        return replace(self, wave=wave).part(wave >= 0)

    def points(self, apart: float) -> tuple[npt.NDArray[np.int64], FloatArray]:
        """Points (m, 2) along the samples, both ends and no farther apart than so, with their owners."""
        way = self.end - self.begin
        count = np.ceil(np.abs(way).max(axis=1, initial=0.0) / apart).astype(np.int64) + 1
        row = np.repeat(np.arange(len(count)), count)
        step = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
        f = step / np.maximum(count - 1, 1)[row]
        return row, self.begin[row] + f[:, None] * way[row]


@dataclass(frozen=True, eq=False)
class Survey:
    """Paths from the nodes of a beam's grid and from points between them, sorted by sequence.

    Attributes
    ----------
    probe : Probe
    paths : Paths
        `ray` is the number of the node, row * (columns + 1) + column; beyond the nodes' that of another
        place.
    at : (rays, 2) float64
        Where on the grid each ray started: column and row.
    names : (k,) uint64
        Sequences found.
    curved : (k,) bool
        Those of them that met a form.
    first : (k,) int64
        A path of each.
    rows : list of (n,) int64
        The paths of each from the nodes.
    witnesses : Witnesses
        What the nodes do not tell; numbers are those of the names.
    """

    probe: Probe
    paths: Paths
    at: FloatArray
    names: Names
    curved: Mask
    first: npt.NDArray[np.int64]
    rows: list[npt.NDArray[np.int64]]
    witnesses: Witnesses

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the nodes."""
        tall, wide = self.probe.beam.shape
        return tall + 1, wide + 1

    @property
    def keys(self) -> Names:
        """Path keys (k,) of the sequences."""
        return self.paths.key[self.first]

    def corners(self, index: int) -> Mask:
        """Lit corners of each cell for a sequence, (rows, columns, 4), from (0, 0) around."""
        return _corners(self.paths.ray[self.rows[index]], self.shape)

    def cells(self, index: int) -> Mask:
        """Cells (rows, columns) that a sequence may light: where it was found, and their neighbours."""
        seen = np.asarray(self.corners(index).any(axis=-1))
        witnesses = self.witnesses.part((self.witnesses.wave == index) & self.witnesses.lit)
        seen[tuple(_cell(witnesses.points(0.5)[1], self.probe.beam.shape))] = True
        return widened(seen)


def widened(mask: Array) -> Mask:
    """Mask (rows, columns) with all neighbours."""
    rows, columns = mask.shape
    wide = np.pad(mask, 1)
    window = range(3)
    return np.asarray(np.any([wide[i : i + rows, j : j + columns] for i in window for j in window], axis=0))


def _corners(ray: Array, shape: tuple[int, int]) -> Mask:
    """Corners (rows, columns, 4) of cells that are some of the nodes."""
    lit = np.zeros(shape, dtype=np.bool_)
    lit.ravel()[ray] = True
    return np.stack([lit[:-1, :-1], lit[:-1, 1:], lit[1:, 1:], lit[1:, :-1]], axis=-1)


def _cell(at: FloatArray, shape: tuple[int, int]) -> npt.NDArray[np.int64]:
    """Row and column (2, n) of the cells that points lie in."""
    return np.clip(np.floor(at[:, ::-1]), 0, np.array(shape) - 1).astype(np.int64).T


def survey(paths: Paths) -> Survey:
    """Trace from the nodes of a beam's grid, and from points where features may hide between them.

    Rays are sent to either side of the edges of meshes: rims, edges between facets, and silhouettes;
    and from the centres of cells where `paths` met other surfaces than the rays from all four corners.

    What is not seen: surfaces that none of `paths` met on their way to the CCD's plane (the shadows
    they cast are); what only light between the nodes gets to, such as a wire behind a slit; features
    narrower than 1/256 of a cell; beyond curved mirrors features so narrow that steps linear between
    the nodes miss them; and some of the edges where they would take more than `MOST` times the
    nodes' rays.

    Parameters
    ----------
    paths : Paths
        Of a `Beam` onto a CCD; sequences of surfaces that are missing here are left out.

    Returns
    -------
    Survey

    Raises
    ------
    ValueError
        If the source is no beam, or there is no CCD.
    """
    probe = _probe(paths)
    shape = probe.beam.shape[0] + 1, probe.beam.shape[1] + 1
    row, column = np.indices(shape)
    nodes = np.stack([column.ravel(), row.ravel()], axis=1).astype(np.float64)
    traced, rows, found, curved = probe.paths(nodes)
    centres = _differing(paths, probe.ccd, traced.ray[rows], traced.key[rows], shape)
    between, goes_on = places_beside_edges(traced, shape, MOST * len(nodes))
    extra = np.concatenate([between, centres])
    goes_on = np.concatenate([goes_on, np.zeros(len(centres), dtype=np.bool_)])
    more, others, its, bent = probe.paths(extra)
    # all that is kept of the paths from elsewhere is one of each sequence that no node has
    _, new = np.unique(its, return_index=True)
    new = new[~np.isin(its[new], found)]
    if len(new):
        kept = more.where(others[new])
        traced = join([traced, replace(kept, ray=kept.ray + len(nodes))])
    row = np.full(len(its), -1)
    row[new] = np.arange(len(traced) - len(new), len(traced))
    ray = np.append(traced.ray[rows], more.ray[others] + len(nodes))
    rows, found, curved = np.append(rows, row), np.append(found, its), np.append(curved, bent)
    names, first = np.unique(found, return_index=True)
    order = np.argsort(found, kind="stable")
    groups = np.split(order, np.searchsorted(found[order], names)[1:]) if len(names) else []
    lit = [rows[group[ray[group] < len(nodes)]] for group in groups]
    witnesses = [_witnesses(n, ray[group], extra, goes_on, shape) for n, group in enumerate(groups)]
    return Survey(
        probe, traced, np.concatenate([nodes, extra]), names, curved[first], rows[first], lit,
        Witnesses.joined(witnesses),
    )  # fmt: skip


def _probe(paths: Paths) -> Probe:
    """A probe for what paths of a beam took."""
    ccd, beam = checked(paths)
    rows, _, _ = landed(paths, ccd)
    keys, bounces = np.unique(paths.key[rows]), int(paths.bounces[rows].max(initial=0))
    faintest = 0.5 * float(np.abs(paths.amplitude[rows]).min(initial=1.0))
    return Probe(paths, beam, ccd, group_facets(paths.scene), keys, bounces, faintest)


def _differing(paths: Paths, ccd: CCD, node: Array, keys: Names, shape: tuple[int, int]) -> FloatArray:
    """Centres (n, 2) of cells whose paths took other sequences than those from all four corners."""
    rows, _, _ = landed(paths, ccd)
    key, ray = paths.key[rows], paths.ray[rows]
    differing = np.zeros((shape[0] - 1, shape[1] - 1), dtype=np.bool_)
    for one in np.unique(key):
        corners = _corners(node[keys == one], shape)
        centre = np.zeros_like(differing)
        centre.ravel()[ray[key == one]] = True
        differing |= np.where(centre, ~corners.any(axis=-1), corners.all(axis=-1))
    return np.asarray(np.argwhere(differing)[:, ::-1] + 0.5, dtype=np.float64)


def _witnesses(wave: int, ray: Array, at: FloatArray, goes_on: Mask, shape: tuple[int, int]) -> Witnesses:
    """What a sequence, lit by some rays, is at places (n, 2) in cells whose corners do not tell it all."""
    count = shape[0] * shape[1]
    lit = np.zeros(len(at), dtype=np.bool_)
    lit[ray[ray >= count] - count] = True
    nodes = _corners(ray[ray < count], shape)
    cell = tuple(_cell(at, (shape[0] - 1, shape[1] - 1)))
    differs = np.zeros(nodes.shape[:2], dtype=np.bool_)
    np.logical_or.at(differs, cell, np.where(lit, ~nodes[cell].all(axis=1), nodes[cell].any(axis=1)))
    to = np.arange(len(at))
    to[:-1] += goes_on[:-1] & (lit[1:] == lit[:-1])
    kept = differs[cell] | differs[cell][to]
    return Witnesses(np.full(kept.sum(), wave), at[kept], at[to[kept]], lit[kept])
