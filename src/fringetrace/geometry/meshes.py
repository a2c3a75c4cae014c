"""Mesh files (STL, PLY, OBJ, GLB, NPZ, Zygo) and conversion to trimesh and pyvista; height of a mesh.

Meshes are `fringetrace.geometry.mesh.Mesh`, in metres. Height maps are arrays [row, column] with origin
lower: column counts along x, row along y, heights along z, seen from +z.
"""

from __future__ import annotations

import importlib.util
import io
import os
import warnings
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, checked_length, unit_length, whole
from fringetrace.geometry.mesh import Mesh, Source, as_mesh
from fringetrace.geometry.shapes import (
    corner_cube,
    extrude,
    height_map,
    icosphere,
    plate,
    rod_lattice,
    rod_of_triangle,
    staircase,
    step,
)
from fringetrace.geometry.topology import IndexArray, weld
from fringetrace.geometry.triangles import height_above
from fringetrace.geometry.zygo import KINDS, existing_file, read_height_map, write_height_map

if TYPE_CHECKING:
    from pyvista import PolyData
    from trimesh import Trimesh

__all__ = [
    "corner_cube",
    "elevation_sample",
    "extrude",
    "height_map",
    "icosphere",
    "interpolate_height",
    "load",
    "plate",
    "read_height_map",
    "rod_lattice",
    "rod_of_triangle",
    "save",
    "staircase",
    "step",
    "to_pyvista",
    "to_trimesh",
    "write_height_map",
]

WRITTEN = (".glb", ".npz", ".obj", ".ply", ".stl")
ARCHIVE = ".npz"


def load(path: str | os.PathLike[str], unit: str | None = None) -> Mesh:
    """Load a mesh from STL, PLY, OBJ, GLB, other trimesh formats, Zygo `.dat` and `.datx`, or `.npz`.

    Vertices with equal coordinates are welded and faces without area dropped. A file of several
    parts becomes one mesh, each part where the file puts it; the faces of a part keep their order.
    An `.npz` archive holds the arrays `vertices` and `faces`, which are taken as they are.

    Parameters
    ----------
    path : path-like
    unit : str
        Unit of the numbers in the file, such as ``"um"``: mesh files carry none. Only Zygo's
        files know their own, and `unit` is not looked at.

    Returns
    -------
    Mesh, metres
        A file of Zygo's gives ``height_map(*read_height_map(path))``.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the kind of file is unknown, the unit missing or unknown, the file empty or not
        what its name says, or what is in it is no mesh (see `Mesh`).
    """
    mesh = _loaded(path, unit)
    return replace(mesh, source=Source(str(Path(path).resolve()), unit))


def _loaded(path: str | os.PathLike[str], unit: str | None) -> Mesh:
    suffix = Path(path).suffix.lower()
    if suffix in KINDS:
        z, pitch = read_height_map(path)
        return height_map(z, pitch, name=Path(path).name)
    if suffix == ARCHIVE:
        return _archived(existing_file(path), unit_length(unit, f"{Path(path).name} unit"))
    from trimesh.exchange.load import mesh_formats

    known = sorted({*KINDS, ARCHIVE} | {f".{kind}" for kind in mesh_formats()})
    if suffix not in known:
        raise ValueError(f"{path}: expected a file named {', '.join(known)}, got {suffix or 'no suffix'!r}")
    file = existing_file(path)
    scale = unit_length(unit, f"{file.name} unit")
    vertices, faces = weld(*_parsed(file))
    try:
        return Mesh.cleaned(vertices * scale, faces, file.name)
    except ValueError:
        return Mesh(vertices * scale, faces, file.name)  # names the faces if none had an area


def _archived(file: Path, scale: float) -> Mesh:
    """A mesh out of numpy's archive, to the last bit: nothing is welded or dropped."""
    try:
        with np.load(file, allow_pickle=False) as data:
            vertices, faces = data["vertices"], data["faces"]
    except Exception as error:  # a zip file cut short, an array left out, objects in it
        raise ValueError(f"{file}: expected an archive of vertices and faces, got {error}") from error
    return Mesh(vertices * scale, faces, file.name)


def _parsed(file: Path) -> tuple[FloatArray, IndexArray]:
    """Vertices and faces of all parts, in the file's unit."""
    import trimesh

    if file.suffix.lower() == ".obj":
        _refuse_relative(file)
    try:
        with warnings.catch_warnings():
            # older numpy only warns, and leaves out the rest of the numbers
            warnings.filterwarnings("error", message="string or file could not be read")
            scene = trimesh.load_scene(file, process=False, skip_materials=True)
    except Exception as error:  # each parser raises kinds of its own
        kind = file.suffix[1:].upper()
        raise ValueError(
            f"{file}: expected {kind} data, got something that does not parse: {error}"
        ) from error
    vertices, faces, count = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)], 0
    for node in scene.graph.nodes_geometry:
        pose, name = scene.graph[node]
        part = scene.geometry[name]
        if isinstance(part, trimesh.Trimesh):
            with np.errstate(invalid="ignore"):  # infinite vertices are refused later, by name
                vertices.append(np.asarray(part.vertices) @ pose[:3, :3].T + pose[:3, 3])
            turned = np.linalg.det(pose[:3, :3]) < 0.0  # a mirrored part shows its back
            faces.append(np.asarray(part.faces)[:, :: -1 if turned else 1] + count)
            count += len(part.vertices)
    if sum(map(len, faces)) == 0:
        raise ValueError(f"{file}: expected triangles, got a file without any")
    return np.concatenate(vertices), np.concatenate(faces)


def _refuse_relative(file: Path) -> None:
    """Vertex numbers counted back from the current line are misread by trimesh, without a word."""
    with file.open("rb") as lines:
        for count, line in enumerate(lines, 1):
            words = line.split()
            if words[:1] == [b"f"] and any(word.startswith((b"-", b"0")) for word in words[1:]):
                face = line.decode(errors="replace").strip()
                raise ValueError(f"{file}: expected vertex numbers from 1 up, got {face!r} in line {count}")


def save(mesh: Mesh, path: str | os.PathLike[str], unit: str) -> None:
    """Save a mesh as STL (binary), PLY, OBJ, GLB or NPZ.

    NPZ keeps all bits (of metres), OBJ 17 decimals of the unit, the others 7 digits (float32). The file
    is written beside its target and then moved into place.

    Parameters
    ----------
    mesh : Mesh, trimesh.Trimesh or pyvista.PolyData, metres
    path : path-like
    unit : str
        Unit of the numbers in the file, such as ``"um"``.

    Raises
    ------
    ValueError
        If the kind of file or the unit is unknown.
    OSError
        If the file cannot be written.
    """
    file = Path(path)
    if file.suffix.lower() not in WRITTEN:
        raise ValueError(
            f"{path}: expected a file named {', '.join(WRITTEN)}, got {file.suffix or 'no suffix'!r}"
        )
    mesh = as_mesh(mesh)
    content = _content(mesh.vertices / unit_length(unit, f"{file.name} unit"), mesh.faces, file)
    with whole(file) as part:
        part.write_bytes(content.encode() if isinstance(content, str) else content)


def _content(vertices: FloatArray, faces: IndexArray, file: Path) -> Any:
    """What is in the file, bytes or text."""
    kind = file.suffix.lower()
    if kind == ARCHIVE:
        held = io.BytesIO()
        np.savez(held, vertices=vertices, faces=faces)
        return held.getvalue()
    import trimesh

    options: dict[str, Any] = {"digits": 17, "include_normals": False} if kind == ".obj" else {}
    return trimesh.Trimesh(vertices, faces, process=False).export(file_type=kind[1:], **options)


def to_trimesh(mesh: Mesh) -> Trimesh:
    """Convert a mesh to trimesh, in metres, with the same vertices and faces.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    trimesh.Trimesh
        A copy, which may be changed; nothing is merged. It knows its name and unit.
    """
    import trimesh

    arrays = mesh.vertices.copy(), mesh.faces.copy()
    given = trimesh.Trimesh(*arrays, process=False, metadata={"name": mesh.name})
    given.units = "meters"
    return given


def to_pyvista(mesh: Mesh) -> PolyData:
    """Convert a mesh to pyvista, in metres, with the same vertices and faces.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    pyvista.PolyData
        A copy in float64, which may be changed; name and unit are in its field data.
    """
    import pyvista

    corners: Any = mesh.faces
    given: PolyData = pyvista.PolyData.from_regular_faces(mesh.vertices.copy(), corners)
    given.add_field_data([mesh.name], "name")
    given.add_field_data(["m"], "unit")
    return given


def elevation_sample(relief: float, aperture: float) -> tuple[FloatArray, float]:
    """Mesh of matplotlib's sample elevation map, scaled down to a relief that a laser can measure.

    The file is that of the Jacksboro fault, Tennessee, from the Shuttle radar: 344 x 403 samples,
    three seconds of arc apart, 840 m of relief over some 30 km. Both are scaled linearly, the
    ground to `aperture` and the heights to `relief`, and the samples are taken as square.

    Parameters
    ----------
    relief : float, metres
        Peak to valley; the lowest sample is at 0.
    aperture : float, metres
        Distance of the first and the last sample of a row, the longer side.

    Returns
    -------
    z : (344, 403) float64, metres
        Row 0 is the southern edge.
    pitch : float, metres

    Raises
    ------
    ValueError
        If a length is not positive.
    FileNotFoundError
        If matplotlib was installed without its sample data.
    """
    relief, aperture = checked_length(relief, "relief"), checked_length(aperture, "aperture")
    found = importlib.util.find_spec("matplotlib")  # finds the folder without importing it
    folder = Path(found.origin).parent if found is not None and found.origin else Path()
    file = folder / "mpl-data" / "sample_data" / "jacksboro_fault_dem.npz"
    with np.load(existing_file(file), allow_pickle=False) as data:
        metres = data["elevation"][::-1].astype(np.float64)
    z = relief * (metres - metres.min()) / np.ptp(metres)
    return z, aperture / (max(z.shape) - 1)


def interpolate_height(mesh: Mesh, x: npt.ArrayLike, y: npt.ArrayLike) -> FloatArray:
    """Height of a mesh over points of the x-y plane, in float64, independent of the ray tracer.

    Parameters
    ----------
    mesh : Mesh, trimesh.Trimesh or pyvista.PolyData, metres
    x, y : float64, metres, shapes that broadcast

    Returns
    -------
    float64, metres, the common shape
        z of the topmost face there, linear within it; NaN beside the mesh and in its holes.
        Upright faces have no height.
    """
    points = np.stack(np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64)), axis=-1)
    mesh, height = as_mesh(mesh), np.full(points.shape[:-1], np.nan)
    somewhere = np.isfinite(points).all(axis=-1)
    if somewhere.any():
        height[somewhere] = height_above(mesh.corners, points[somewhere])
    return height
