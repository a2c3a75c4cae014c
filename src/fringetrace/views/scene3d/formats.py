"""Export of surfaces and rays to glTF, PLY and VTP."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fringetrace.core import Array, FloatArray
from fringetrace.views.scene3d.layout import Solid
from fringetrace.views.scene3d.palette import scale, values
from fringetrace.views.scene3d.polylines import Strands
from fringetrace.views.scene3d.vtk import View

if TYPE_CHECKING:
    from pyvista import PolyData

# Radius of rays as tubes, which PLY needs, a part of the scene's size; and their sides.
THIN, SIDES = 1e-3, 6
# glTF has y upwards.
UPRIGHT = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def write_view(view: View, path: str | os.PathLike[str]) -> None:
    """Export a view's surfaces and rays, in metres; the file is written atomically.

    Parameters
    ----------
    view : View
    path : path
        .glb (rays as lines, y upwards), .ply (rays as tubes, coloured), or .vtp (with all numbers).

    Raises
    ------
    ValueError
        If the suffix is another one.
    """
    target = Path(path)
    write = WRITERS.get(target.suffix.lower())
    if write is None:
        raise ValueError(
            f"export: expected a file named {', '.join('*' + s for s in WRITERS)}, got {target.name!r}"
        )
    with tempfile.TemporaryDirectory(prefix=".fringetrace-", dir=target.parent) as folder:
        part = Path(folder, target.name)
        write(view, part)
        os.replace(part, target)


def polydata(view: View) -> PolyData:
    """PyVista data of rays as polylines and surfaces as triangles, with all attributes.

    Parameters
    ----------
    view : View

    Returns
    -------
    pyvista.PolyData
        Metres. At points `optical_path` (metres) and `bounce`. At cells, those of rays first, `ray`, `beam`,
        `fate`, `bounces`, `power`, `optical_path`, `phase` (turns, if there is a wavelength), and `surface`:
        -1 or NaN where they do not apply. The names of surfaces are field data.
    """
    import pyvista

    points, lines, cells, at_points = _polylines(view.strands)
    solids = view.stage.solids
    vertices = np.concatenate([points, *(solid.vertices for solid in solids)])
    starts = np.cumsum([len(points), *(len(solid.vertices) for solid in solids)])
    faces = np.concatenate([solid.faces + start for solid, start in zip(solids, starts, strict=False)])
    prefixed = np.column_stack([np.full(len(faces), 3), faces]).ravel()
    mesh = pyvista.PolyData(vertices, faces=prefixed, **({"lines": lines} if len(lines) else {}))
    for name, column in at_points.items():
        mesh.point_data[name] = _longer(column, len(vertices) - len(points))
    for name, column in cells.items():
        mesh.cell_data[name] = _longer(column, len(faces))
    surface = np.repeat(np.arange(len(solids)), [len(solid.faces) for solid in solids])
    rays = 0 if view.strands is None else len(view.strands)
    mesh.cell_data["surface"] = np.concatenate([np.full(rays, -1), surface])
    mesh.field_data["surfaces"] = np.array([solid.name for solid in solids])
    return mesh


def _polylines(shown: Strands | None) -> tuple[FloatArray, Array, dict[str, Array], dict[str, Array]]:
    """Points, lines as VTK numbers them, numbers of lines, numbers of points."""
    if shown is None or not len(shown):
        return np.empty((0, 3)), np.empty(0, dtype=np.int64), {}, {}
    there = np.isfinite(shown.points[..., 0])
    counts = there.sum(axis=1)
    path, bounce = np.nonzero(there)
    first = np.cumsum(counts) - counts
    lines = np.insert(np.arange(len(path)), first, counts)
    ends = np.arange(len(shown)), counts - 1
    columns = {name: getattr(shown, name) for name in ("ray", "beam", "fate", "bounces", "power")}
    columns["optical_path"] = shown.opl[ends]
    if len(shown.wavelengths):
        columns["phase"] = shown.phase[shown.chosen][ends]
    return (
        shown.points[path, bounce],
        lines,
        columns,
        {"optical_path": shown.opl[path, bounce], "bounce": bounce},
    )


def _longer(column: Array, more: int) -> Array:
    return np.concatenate(
        [column, np.full(more, np.nan if column.dtype.kind == "f" else -1, dtype=column.dtype)]
    )


def _vtp(view: View, path: Path) -> None:
    polydata(view).save(path)


def _rgb(colour: str) -> list[int]:
    return [int(colour[at : at + 2], 16) for at in (1, 3, 5)]


def _coloured(view: View, shown: Strands) -> Array:
    """(legs, 2, 3) uint8."""
    found = scale(shown, view.colour, view.stage.unit, view.stage.metres)
    table = found.table()
    value = values(shown, view.colour, view.stage.metres, step=view.step)
    part = value if found.names else (value - found.low) / (found.high - found.low) * (len(table) - 1)
    return np.asarray(table[np.clip(np.round(part), 0, len(table) - 1).astype(int)])


def _ply(view: View, path: Path) -> None:
    import pyvista

    pieces = []
    for solid in view.stage.solids:
        piece = pyvista.PolyData.from_regular_faces(solid.vertices, solid.faces)
        piece["RGB"] = np.tile(np.array(_rgb(solid.colour), dtype=np.uint8), (len(solid.vertices), 1))
        pieces.append(piece)
    if view.strands is not None and len(view.strands):
        pieces.append(_tubes(view, view.strands))
    pyvista.merge(pieces, merge_points=False).save(path, texture="RGB")


def _tubes(view: View, shown: Strands) -> PolyData:
    import pyvista

    path, bounce = shown.legs()
    ends = np.stack([shown.starts[path, bounce], shown.points[path, bounce + 1]], axis=1)
    cells = np.column_stack([np.full(len(ends), 2), np.arange(2 * len(ends)).reshape(-1, 2)])
    data = pyvista.PolyData(ends.reshape(-1, 3), lines=cells.ravel())
    data["RGB"] = _coloured(view, shown).reshape(-1, 3)
    tubes = data.tube(radius=view.radius or THIN * view.stage.size, n_sides=SIDES).triangulate()
    tubes.point_data.remove("TubeNormals")
    return tubes


def _glb(view: View, path: Path) -> None:
    import trimesh

    scene = trimesh.Scene()
    for solid in view.stage.solids:
        scene.add_geometry(_shape(solid), geom_name=solid.name, node_name=solid.name, transform=UPRIGHT)
    if view.strands is not None and len(view.strands):
        for name, line in _wires(view, view.strands):
            scene.add_geometry(line, geom_name=name, node_name=name, transform=UPRIGHT)
    path.write_bytes(scene.export(file_type="glb"))


def _shape(solid: Solid) -> Any:
    import trimesh

    material = trimesh.visual.material.PBRMaterial(
        name=solid.kind, baseColorFactor=[*_rgb(solid.colour), round(255 * solid.opacity)], doubleSided=True,
        alphaMode="OPAQUE" if solid.opacity == 1.0 else "BLEND", metallicFactor=0.0, roughnessFactor=0.7,
    )  # fmt: skip
    mesh = trimesh.Trimesh(solid.vertices, solid.faces, process=False)
    mesh.visual = trimesh.visual.TextureVisuals(material=material)
    return mesh


def _wires(view: View, shown: Strands) -> list[tuple[str, Any]]:
    """The rays, in as many pieces as there are colours, and the colour of each as its name says."""
    import trimesh

    path, bounce = shown.legs()
    ends = np.stack([shown.starts[path, bounce], shown.points[path, bounce + 1]], axis=1)
    found = scale(shown, view.colour, view.stage.unit, view.stage.metres)
    colours, which = np.unique(_coloured(view, shown)[:, 1], axis=0, return_inverse=True)
    wires = []
    for number, colour in enumerate(colours):
        mine = ends[which.ravel() == number]
        entities = [trimesh.path.entities.Line([2 * n, 2 * n + 1]) for n in range(len(mine))]
        line = trimesh.path.Path3D(entities, mine.reshape(-1, 3), process=False)
        line.colors = np.tile([*colour, 255], (len(mine), 1))
        wires.append((f"rays, {found.title}, {number}", line))
    return wires


WRITERS: dict[str, Callable[[View, Path], None]] = {".glb": _glb, ".ply": _ply, ".vtp": _vtp}
