"""Triangle mesh: vertices in metres and faces, checked once."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import (
    Array,
    FloatArray,
    checked_rotation,
    checked_vector,
    described,
    filled,
    length_text,
    short_repr,
    unit,
    value_text,
)
from fringetrace.geometry.topology import Topology, weld

# A face is degenerate when its height is below this part of its longest side: less than what
# float64 coordinates can express, and far below any needle that still has a normal.
DEGENERATE = 1e-14
# float64 keeps 16 digits: a mesh this many of its own sizes from the origin has 7 left.
FARTHEST = 1e9
# Beyond these a length squared leaves the range of float64 numbers that keep all their digits.
LARGEST, SMALLEST = 1e100, 1e-100
# What trimesh calls a metre, and what it makes of None.
METRES = ("none", "m", "meter", "meters", "metre", "metres")


def _named(indices: Array, limit: int = 5) -> str:
    """The first few indices, for a message."""
    head = ", ".join(str(int(i)) for i in indices[:limit])
    return head + (", ..." if len(indices) > limit else "")


def _checked_vertices(value: Any, name: str) -> FloatArray:
    try:
        vertices = filled(value).copy()
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} vertices: expected numbers of shape (v, 3), got {error}") from error
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError(f"{name} vertices: expected shape (v, 3), got {vertices.shape}")
    finite = np.isfinite(vertices).all(axis=1)
    if not finite.all():
        bad = np.flatnonzero(~finite)
        raise ValueError(
            f"{name} vertices: expected finite numbers, got NaN or infinity in {len(bad)} "
            f"of {len(vertices)} (vertices {_named(bad)})"
        )
    return vertices


def _checked_faces(value: Any, count: int, name: str) -> npt.NDArray[np.int64]:
    try:
        raw = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name} faces: expected shape (f, 3), got {error}") from error
    if raw.size == 0:
        raise ValueError(f"{name} faces: expected at least one triangle, got none")
    if raw.ndim != 2 or raw.shape[1] != 3:
        raise ValueError(f"{name} faces: expected shape (f, 3), got {raw.shape}")
    if np.ma.is_masked(value):
        masked = int(np.ma.getmaskarray(value).sum())
        raise ValueError(f"{name} faces: expected whole triangles, got {masked} masked corners")
    if not np.issubdtype(raw.dtype, np.integer):
        raise ValueError(f"{name} faces: expected integers, got {raw.dtype}")
    bad = np.flatnonzero((raw < 0).any(axis=1) | (raw >= count).any(axis=1))
    if len(bad):
        raise ValueError(
            f"{name} faces: expected vertex indices from 0 to {count - 1}, got others in "
            f"{len(bad)} of {len(raw)} (faces {_named(bad)})"
        )
    return np.array(raw, dtype=np.int64)


def _checked_extent(corners: FloatArray, name: str) -> tuple[float, npt.NDArray[np.bool_]]:
    """Longest side of the box around the corners, once known to be measurable; which faces have an area."""
    with np.errstate(over="ignore"):
        extent = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    if not (extent < LARGEST and (extent == 0.0 or extent > SMALLEST)):
        raise ValueError(f"{name}: expected a size from {SMALLEST:g} to {LARGEST:g} m, got {extent:g} m")
    sides = (corners - np.roll(corners, 1, axis=1)) / max(extent, SMALLEST)
    doubled = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return extent, doubled > DEGENERATE * (sides**2).sum(axis=2).max(axis=1)


def _check_shape(vertices: FloatArray, faces: npt.NDArray[np.int64], name: str) -> None:
    """Refuse faces without area, and meshes too far off for float64 to resolve."""
    corners = vertices[faces]
    extent, spread = _checked_extent(corners, name)
    farthest = np.abs(corners).max()
    if len(bad := np.flatnonzero(~spread)):
        raise ValueError(
            f"{name} faces: expected triangles with an area, got {len(bad)} of {len(faces)} "
            f"without (faces {_named(bad)}); drop them, or give Mesh.cleaned(...)"
        )
    if farthest > FARTHEST * extent:
        raise ValueError(
            f"{name}: expected a mesh within {FARTHEST:g} of its own sizes from the origin, got "
            f"{farthest / extent:.3g} sizes; move the scene nearer"
        )


@dataclass(frozen=True, eq=False)
class Source:
    """Origin of a mesh (file and moves), by which a scene file can refer to it.

    Parameters
    ----------
    path : str
        Of its file, absolute.
    unit : str or None
        Of the numbers in the file.
    moves : tuple of (offset, turn)
        What `Mesh.moved` was told since then, in turn.
    """

    path: str
    unit: str | None
    moves: tuple[tuple[FloatArray, FloatArray | None], ...] = ()

    __repr__ = short_repr

    def moved(self, offset: FloatArray, turn: FloatArray | None) -> Source:
        """The same origin after one more move."""
        return Source(self.path, self.unit, (*self.moves, (offset, turn)))


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangle mesh: vertices in metres and faces.

    Parameters
    ----------
    vertices : (v, 3) float64, metres
    faces : (f, 3) int64
        Vertex indices, counter-clockwise seen from the front.
    name : str
        For messages.
    source : Source, optional
        The file that it was loaded from.

    Raises
    ------
    ValueError
        For vertices that are not finite, no faces, indices out of range, faces without area.
    """

    vertices: FloatArray
    faces: npt.NDArray[np.int64]
    name: str = "mesh"
    source: Source | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        sides = " x ".join(map(length_text, np.subtract(*self.bounds[::-1]).tolist()))
        counts = f"{len(self.faces):,} triangles, {len(self.vertices):,} vertices"
        return described(self, value_text(self.name), counts, sides)

    def __post_init__(self) -> None:
        vertices = _checked_vertices(self.vertices, self.name)
        faces = _checked_faces(self.faces, len(vertices), self.name)
        _check_shape(vertices, faces, self.name)
        vertices.flags.writeable = False
        faces.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)

    def __reduce__(self) -> tuple[Any, ...]:
        # numpy forgets on the way through a pickle that the arrays are not to be written
        return Mesh, (self.vertices, self.faces, self.name, self.source)

    @staticmethod
    def cleaned(vertices: npt.ArrayLike, faces: npt.ArrayLike, name: str = "mesh") -> Mesh:
        """Mesh without the faces of zero area.

        Parameters
        ----------
        vertices : (v, 3) array-like, metres
        faces : (f, 3) array-like of int
        name : str

        Returns
        -------
        Mesh
        """
        points = _checked_vertices(vertices, name)
        triangles = _checked_faces(faces, len(points), name)
        return Mesh(points, triangles[_checked_extent(points[triangles], name)[1]], name)

    @property
    def corners(self) -> FloatArray:
        """Corners of the faces, (f, 3, 3) float64, metres."""
        return self.vertices[self.faces]

    @cached_property
    def bounds(self) -> FloatArray:
        """Bounding box of the faces, (2, 3) float64, metres: lower and upper corner."""
        corners = self.corners.reshape(-1, 3)
        return np.array([corners.min(axis=0), corners.max(axis=0)])

    @cached_property
    def normals(self) -> FloatArray:
        """Normals of the faces to the front, (f, 3) float64, unit."""
        normals = unit(self._crossed)
        normals.flags.writeable = False
        return normals

    @cached_property
    def areas(self) -> FloatArray:
        """Areas of the faces, (f,) float64, m^2."""
        areas = 0.5 * np.linalg.norm(self._crossed, axis=1)
        areas.flags.writeable = False
        return np.asarray(areas)

    @property
    def _crossed(self) -> FloatArray:
        """Cross products of two sides of each face, (f, 3) float64, m^2."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.cross(b - a, c - a)

    @cached_property
    def topology(self) -> Topology:
        """Welded vertices, edges and the faces beside them."""
        return Topology(*weld(self.vertices, self.faces))

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Mesh:
        """Mesh rotated about the origin, then shifted.

        Parameters
        ----------
        offset : (3,) array-like, metres
        turn : (3, 3) array-like, optional
            Rotation matrix, applied to column vectors; see `fringetrace.core.vectors.rotation`.

        Returns
        -------
        Mesh

        Raises
        ------
        ValueError
            If `offset` is no vector or `turn` no rotation.
        """
        rotation = None if turn is None else checked_rotation(turn, "turn")
        shift = checked_vector(offset, "offset")
        turned = self.vertices if rotation is None else self.vertices @ rotation.T
        source = None if self.source is None else self.source.moved(shift, rotation)
        return Mesh(turned + shift, self.faces, self.name, source)


def as_mesh(value: Any, name: str = "mesh") -> Mesh:
    """Mesh converted from trimesh or pyvista, whose numbers are taken as metres.

    Parameters
    ----------
    value : Mesh, trimesh.Trimesh, pyvista.PolyData, or anything else with `vertices` and `faces`
        Polygons and strips of a PolyData are cut into triangles; point data are left behind.
    name : str

    Returns
    -------
    Mesh

    Raises
    ------
    TypeError
        If the value is no mesh.
    ValueError
        If it says that its unit is another one, has lines or loose points, or see `Mesh`.
    """
    if isinstance(value, Mesh):
        return value
    if all(hasattr(value, part) for part in ("points", "faces", "triangulate")):
        return Mesh(value.points, _triangles(value, name), name)
    if not (hasattr(value, "vertices") and hasattr(value, "faces")):
        raise TypeError(
            f"{name}: expected a mesh with vertices and faces, or a pyvista.PolyData, got "
            f"{type(value).__name__}; files are read by fringetrace.meshes.load, and other data of pyvista "
            "have a surface, extract_surface()"
        )
    unit = getattr(value, "units", None)
    if unit is not None and unit not in METRES:
        raise ValueError(
            f"{name}: expected a mesh in metres, got one in {unit}; call its convert_units('meters') first"
        )
    return Mesh(value.vertices, value.faces, name)


def _triangles(polydata: Any, name: str) -> Array:
    """Faces (f, 3) of a pyvista.PolyData."""
    loose = {"lines": polydata.n_lines, "loose points": polydata.n_verts}
    if found := ", ".join(f"{count} {kind}" for kind, count in loose.items() if count):
        raise ValueError(f"{name}: expected a PolyData of faces only, got {found}")
    if polydata.n_strips or not polydata.is_all_triangles:
        polydata = polydata.triangulate()
    return np.asarray(polydata.faces).reshape(-1, 4)[:, 1:]
