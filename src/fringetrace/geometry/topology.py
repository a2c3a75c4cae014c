"""Topology of triangle meshes: welded vertices, edges and the faces beside them, connected parts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, short_repr

IndexArray = npt.NDArray[np.int64]


def weld(vertices: FloatArray, faces: IndexArray) -> tuple[FloatArray, IndexArray]:
    """Weld vertices with exactly equal coordinates.

    Parameters
    ----------
    vertices : (v, 3) float64
    faces : (f, 3) int64

    Returns
    -------
    vertices : (w, 3) float64
        In the order in which they first appeared.
    faces : (f, 3) int64
        The same faces in the same order.
    """
    order = np.lexsort(vertices.T)
    opens = np.ones(len(vertices), dtype=bool)
    opens[1:] = (vertices[order[1:]] != vertices[order[:-1]]).any(axis=1)
    first = order[opens]  # the sort is stable: the earliest of each group
    appearance = np.argsort(first)
    rank = np.empty_like(appearance)
    rank[appearance] = np.arange(len(first))
    welded = np.empty(len(vertices), dtype=np.int64)
    welded[order] = rank[np.cumsum(opens) - 1]
    return vertices[first[appearance]], welded[faces]


def directed_edges(faces: IndexArray) -> IndexArray:
    """Directed edges of faces (f, 3), (3 f, 2) int64: those of face i are rows 3 i to 3 i + 2."""
    return np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)


def connected(links: IndexArray) -> IndexArray:
    """Number of the connected part that each link belongs to.

    Parameters
    ----------
    links : (n, k) int64
        Vertices of faces or edges, which join them.

    Returns
    -------
    (n,) int64
        From 0 on.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    if len(links) == 0:
        return np.empty(0, dtype=np.int64)
    vertex, ends = np.unique(links, return_inverse=True)
    ends = ends.reshape(links.shape)
    pairs = (ends.ravel(), np.roll(ends, -1, axis=1).ravel())
    graph = coo_matrix((np.ones(ends.size, dtype=np.bool_), pairs), (len(vertex), len(vertex)))
    return np.asarray(connected_components(graph, directed=False)[1][ends[:, 0]], dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Topology:
    """Topology of a mesh: what hangs together, by the places of its vertices.

    Attributes
    ----------
    vertices : (w, 3) float64, metres
        No two at the same place, see `weld`.
    faces : (f, 3) int64
        Those of the mesh, by these vertices.
    """

    vertices: FloatArray
    faces: IndexArray

    __repr__ = short_repr

    @cached_property
    def edges(self) -> MeshEdges:
        """Edges, each once."""
        ends = np.sort(directed_edges(self.faces), axis=1)
        key = ends[:, 1] * len(self.vertices) + ends[:, 0]
        order = np.argsort(key, kind="stable")
        first = np.flatnonzero(np.diff(key[order], prepend=-1))
        count = np.diff(first, append=len(key))
        rows = order[np.stack([first, first + np.minimum(count, 2) - 1], axis=1)]
        return MeshEdges(ends[rows[:, 0]], rows, count)

    @cached_property
    def fans(self) -> tuple[IndexArray, IndexArray]:
        """Corners around each vertex: flat indices into `faces`, (3 f,), and where each begins, (w + 1,)."""
        order = np.argsort(self.faces, axis=None, kind="stable")
        return order, np.searchsorted(self.faces.ravel()[order], np.arange(len(self.vertices) + 1))


@dataclass(frozen=True, eq=False)
class MeshEdges:
    """Edges of a mesh and the faces beside them.

    Attributes
    ----------
    ends : (e, 2) int64
        Vertices at the ends, the lower one first.
    rows : (e, 2) int64
        Rows of the first two among the `directed_edges` that run there, three times the number of their
        face and up; twice the same where there is one face only.
    count : (e,) int64
        Faces at each edge.
    """

    ends: IndexArray
    rows: IndexArray
    count: IndexArray

    __repr__ = short_repr
