"""Open edges of bodies of glass: holes through which rays pass between media without meeting a boundary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fringetrace.core import FloatArray, short_repr
from fringetrace.geometry import IndexArray, Mesh, Topology, connected, directed_edges, weld
from fringetrace.scene.derived import once_per_scene
from fringetrace.scene.model import Scene

# A mesh is meant to close if its vector area is a smaller part of its area than this: of a closed mesh it
# is 0, of a cube without a face 1/5, of half a sphere 1/2, of a flat sheet 1.
SHEET = 1.0 / 3.0
# Prisms and rods without ends stand for endless ones: all normals lie across an axis, to this part.
PRISM = 1e-9
# A hole whose vector area is a smaller part of its squared outline is a seam: vertices on another's edge.
SEAM = 1e-9
# Random bits of vertices repeat with this period, by which a mesh with open edges cannot look closed.
SEED = 20250


@dataclass(frozen=True, eq=False)
class Opening:
    """A hole in the boundary between two media.

    Attributes
    ----------
    surface : int
        Number of the surface that has the first of its edges.
    edges : (k, 2) int64
        Its edges on that surface, by the vertices of its mesh.
    area : float, m^2
    centre : (3,) float64, metres
    """

    surface: int
    edges: IndexArray
    area: float
    centre: FloatArray

    __repr__ = short_repr


@once_per_scene
def openings(scene: Scene) -> tuple[Opening, ...]:
    """Holes in boundaries that are closed but for them, largest first; found once and kept with the scene.

    Edges count as joined where they have the same end points, within a surface or among boundaries. Sheets,
    prisms without ends, and seams at which no area is left open, have none.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    tuple of Opening
    """
    numbers = [i for i, surface in enumerate(scene.surfaces) if surface.boundary]
    meshes = {i: scene.surfaces[i].mesh for i in numbers}
    suspected = [i for i in numbers if not (_closed(meshes[i].faces) or _sheet(meshes[i]))]
    if not suspected:
        return ()
    start = dict(
        zip(numbers, np.cumsum([0, *(len(mesh.vertices) for mesh in meshes.values())]), strict=False)
    )
    vertices = np.concatenate([mesh.vertices for mesh in meshes.values()])
    faces = np.concatenate([mesh.faces + start[i] for i, mesh in meshes.items()])
    owner = np.repeat(numbers, [len(mesh.faces) for mesh in meshes.values()])
    whole = Topology(*weld(vertices, faces))
    here = whole.edges.rows[whole.edges.count == 1, 0]
    edges = directed_edges(whole.faces)[here]
    hole = connected(edges)
    found = []
    for number in range(int(hole.max(initial=-1)) + 1):
        mine = np.flatnonzero(hole == number)
        surface = int(owner[here[mine[0]] // 3])
        area, centre, seam = _measured(whole.vertices[edges[mine]])
        if surface in suspected and not seam:
            mine = mine[owner[here[mine] // 3] == surface]
            found.append(Opening(surface, directed_edges(faces)[here[mine]] - start[surface], area, centre))
    return tuple(sorted(found, key=lambda opening: -opening.area))


def _closed(faces: IndexArray) -> bool:
    """Whether each edge is run through as often one way as the other; told by hashes, without sorting.

    The sum of h(a) g(b) - h(b) g(a) over all edges (a, b) is 0 if so, and else with a chance of 1 in 2^64.
    """
    bits = np.random.default_rng(SEED).integers(0, 2**64, (2, int(faces.max()) + 1), dtype=np.uint64)
    one, other = bits[0][faces], bits[1][faces]
    total = (one * np.roll(other, -1, axis=1) - np.roll(one, -1, axis=1) * other).sum(dtype=np.uint64)
    return bool(total == 0)


def _sheet(mesh: Mesh) -> bool:
    """Whether a mesh is not meant to close: it is flat, a bowl, or a prism without ends."""
    areas = mesh.normals * (mesh.areas / mesh.areas.max())[:, None]
    along, *_, most = np.linalg.eigvalsh(areas.T @ areas)
    total = np.linalg.norm(areas, axis=1).sum()
    return bool(along < PRISM**2 * most or np.linalg.norm(areas.sum(axis=0)) > SHEET * total)


def _measured(ends: FloatArray) -> tuple[float, FloatArray, bool]:
    """Area and centre of a hole with edges (k, 2, 3), and whether it is but a seam."""
    centre = ends.mean(axis=(0, 1))
    spokes = ends - centre
    area = 0.5 * float(np.linalg.norm(np.cross(spokes[:, 0], spokes[:, 1]).sum(axis=0)))
    outline = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
    return area, centre, area <= SEAM * outline**2
