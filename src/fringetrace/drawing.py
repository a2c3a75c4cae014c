"""Scenes in space: surfaces, rays, source and CCD, drawn by VTK in a process of its own."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fringetrace.interfaces import BeamSplitter
from fringetrace.paths import Fate, Paths
from fringetrace.scene import CCD, Beam, Scene
from fringetrace.waves import Array, FloatArray

if TYPE_CHECKING:
    from pyvista import PolyData

Plotter = Any  # mypy does not see through the decorators of pyvista's
UNITS: tuple[tuple[str, float], ...] = (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9), ("pm", 1e-12))
# Okabe and Ito's colours, told apart with any colour vision; the last one is for all the rest.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C8C8C")
# Where a scene is seen from: to the right of -y, and from above; radians.
AZIMUTH, ELEVATION = np.radians([30.0, 25.0])
BAR = {
    "vertical": False, "position_y": 0.04, "width": 0.3, "height": 0.07, "n_labels": 2, "fmt": "%.3g",
    "title_font_size": 20, "label_font_size": 18, "color": "black",
}  # fmt: skip
# What VTK loads when it draws; without them it takes the interpreter down with it.
PACKAGES = "libegl1 libgl1-mesa-dri"
SECONDS = 120.0


def unit_of(length: float) -> tuple[str, float]:
    """The unit in which a length has a few digits before the point.

    Parameters
    ----------
    length : float, metres

    Returns
    -------
    name : str
    metres : float
        How long one of it is.
    """
    size = abs(length)
    for name, metres in UNITS:
        if size >= metres:
            return name, metres
    return UNITS[-1] if size > 0.0 else UNITS[0]


def _routes(paths: Paths) -> list[tuple[str, Array]]:
    """Names and rows of the sequences of surfaces that light took, the most common ones first."""
    if paths.surface is None:
        raise ValueError("picture: expected paths traced with record=True, got paths without points")
    names = [surface.name for surface in paths.scene.surfaces]
    seen = paths.fate == Fate.DETECTED
    shown = np.flatnonzero(seen if seen.any() else np.ones(len(paths), dtype=bool))
    kinds, which, counts = np.unique(paths.surface[shown], axis=0, return_inverse=True, return_counts=True)
    routes = []
    for kind in np.argsort(-counts, kind="stable"):
        met = [names[surface] for surface in kinds[kind] if surface >= 0]
        routes.append((", ".join(met) or "straight", shown[which.ravel() == kind]))
    most = len(COLOURS) - 1
    rest = [rows for _, rows in routes[most:]]
    return routes[:most] + ([("other paths", np.concatenate(rest))] if rest else [])


def _thinned(routes: Sequence[tuple[str, Array]], ray: Array) -> list[tuple[str, Array]]:
    """Rows such that each ray is drawn on one route only: routes share legs, and colours would hide."""
    order = np.unique(ray, return_inverse=True)[1]
    thin = [(name, rows[order[rows] % len(routes) == i]) for i, (name, rows) in enumerate(routes)]
    return [(name, few if len(few) else rows) for (name, few), (_, rows) in zip(thin, routes, strict=True)]


def _line(paths: Paths, row: int, onward: float) -> FloatArray:
    """A polyline that ends on the chip itself (not in its plane of focus), or a bit on where light left."""
    line, ccd, direction = paths.polyline(row), paths.ccd, paths.direction[row]
    if ccd is not None and paths.fate[row] == Fate.DETECTED:
        line[-1] += ((ccd.centre - line[-1]) @ ccd.normal) / (direction @ ccd.normal) * direction
    elif paths.fate[row] == Fate.LEFT:
        line = np.concatenate([line, [line[-1] + onward * direction]])
    return line


def _rectangle(centre: FloatArray, u: FloatArray, v: FloatArray, size: tuple[float, float]) -> FloatArray:
    corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]) * size
    return np.asarray(centre + corners[:, :1] * u + corners[:, 1:] * v, dtype=np.float64)


def _drawing(scene: Scene, paths: Paths | None, colour: str, relief: str | None) -> dict[str, Any]:
    """All that is to be seen, as plain arrays: it goes to another process."""
    if colour not in ("route", "length"):
        raise ValueError(f"colour: expected 'route' or 'length', got {colour!r}")
    bounds = np.array([surface.mesh.bounds for surface in scene.surfaces])
    size = float(np.ptp(bounds.reshape(-1, 3), axis=0).max())
    unit, metres = unit_of(0.5 * size)
    drawing: dict[str, Any] = {"unit": unit, "metres": metres, "colour": colour, "routes": []}
    chosen = None if relief is None else scene.index(relief)
    drawing["surfaces"] = [
        (
            surface.name,
            surface.mesh.vertices,
            surface.mesh.faces,
            isinstance(surface.interface, BeamSplitter),
            number == chosen and np.ptp(surface.mesh.vertices[:, 2]) > 0.0,
        )
        for number, surface in enumerate(scene.surfaces)
    ]
    if paths is None:
        return drawing
    for name, rows in _thinned(_routes(paths), paths.ray):
        drawing["routes"].append((name, [_line(paths, int(row), 0.3 * size) for row in rows]))
    if isinstance(paths.source, Beam):
        beam = paths.source
        u, v, n = beam.axes
        drawing["source"] = (_rectangle(beam.centre, u, v, beam.size), n)
    if isinstance(paths.ccd, CCD):
        u, v, n = paths.ccd.axes
        drawing["CCD"] = (_rectangle(paths.ccd.centre, u, v, paths.ccd.size), n)
    return drawing


def _polydata(lines: Sequence[FloatArray], metres: float) -> PolyData:
    """Polylines as one object, with the length from the start at each point, metres."""
    import pyvista

    points = np.concatenate(lines)
    counts = np.array([len(line) for line in lines])
    starts = np.cumsum(counts) - counts
    cells = np.concatenate(
        [np.concatenate([[n], np.arange(s, s + n)]) for n, s in zip(counts, starts, strict=True)]
    )
    data = pyvista.PolyData(points / metres, lines=cells)
    legs = [np.linalg.norm(np.diff(line, axis=0), axis=1) for line in lines]
    data["length"] = np.concatenate([np.concatenate([[0.0], np.cumsum(leg)]) for leg in legs]) / metres
    return data


def _draw_surfaces(plotter: Plotter, drawing: dict[str, Any]) -> None:
    import pyvista

    metres = drawing["metres"]
    for name, vertices, faces, splits, relief in drawing["surfaces"]:
        mesh = pyvista.PolyData.from_regular_faces(vertices / metres, faces)
        if relief:
            z = vertices[:, 2] - 0.5 * (vertices[:, 2].min() + vertices[:, 2].max())
            unit, height_unit = unit_of(float(np.ptp(z)))
            title = f"height of the {name} / {unit}"
            bar = {**BAR, "title": title, "position_x": 0.04}
            plotter.add_mesh(
                mesh, scalars=z / height_unit, cmap="viridis", scalar_bar_args=bar, lighting=False
            )
        else:
            plotter.add_mesh(
                mesh, color="#9CC9E8" if splits else "#B8B8B8", opacity=0.35 if splits else 1.0,
                show_edges=len(faces) < 3, edge_color="#606060",
            )  # fmt: skip


def _draw_routes(plotter: Plotter, drawing: dict[str, Any]) -> None:
    metres, heading = drawing["metres"], "light, by the surfaces that it met:"
    if drawing["routes"] and drawing["colour"] == "route":
        plotter.add_text(heading, position=(0.03, 0.95), viewport=True, color="black", font_size=11)
    for row, ((name, lines), colour) in enumerate(zip(drawing["routes"], COLOURS, strict=False)):
        data = _polydata(lines, metres)
        if drawing["colour"] == "length":
            bar = {**BAR, "title": f"length of path / {drawing['unit']}", "position_x": 0.66}
            plotter.add_mesh(data, scalars="length", cmap="cividis", line_width=1.5, scalar_bar_args=bar)
        else:
            plotter.add_mesh(data, color=colour, line_width=1.5)
            place = (0.03, 0.91 - 0.04 * row)
            plotter.add_text(name, position=place, viewport=True, color=colour, font_size=11, name=name)


def _draw_ends(plotter: Plotter, drawing: dict[str, Any]) -> None:
    """The source with its direction, the CCD, and the names of all."""
    import pyvista

    metres = drawing["metres"]
    places = [(name, vertices) for name, vertices, *_ in drawing["surfaces"]]
    for name, colour in (("source", "#E69F00"), ("CCD", "#202020")):
        if name not in drawing:
            continue
        corners, normal = drawing[name]
        places.append((name, corners))
        chip = pyvista.PolyData.from_regular_faces(corners / metres, np.array([[0, 1, 2], [0, 2, 3]]))
        plotter.add_mesh(chip, color=colour, opacity=0.8, lighting=False)
        if name == "source":
            size = float(np.linalg.norm(corners[2] - corners[0])) / metres
            start = corners.mean(axis=0) / metres - 0.6 * size * normal
            plotter.add_mesh(pyvista.Arrow(start=start, direction=normal, scale=0.5 * size), color=colour)
    _draw_names(plotter, places, metres)


def _draw_names(plotter: Plotter, places: Sequence[tuple[str, FloatArray]], metres: float) -> None:
    """Names of things: above what is in the upper half of the picture, below the rest."""
    right = np.array([np.cos(AZIMUTH), np.sin(AZIMUTH), 0.0])
    up = np.array([-right[1] * np.sin(ELEVATION), right[0] * np.sin(ELEVATION), np.cos(ELEVATION)])
    everything = np.concatenate([points for _, points in places])
    gap = 0.01 * np.linalg.norm(np.ptp(everything, axis=0))
    middle = 0.5 * ((everything @ up).min() + (everything @ up).max())
    for name, points in places:
        side = 1.0 if (points @ up).mean() > middle + gap else -1.0
        spot = points[np.argmax(side * (points @ up))] + gap * (side * up + 2.0 * right)
        plotter.add_point_labels(
            spot[None, :] / metres, [name], font_size=22, text_color="black", shape=None, show_points=False,
            always_visible=True, justification_horizontal="left",
            justification_vertical="bottom" if side > 0.0 else "top",
        )  # fmt: skip


def _round_bounds(bounds: Sequence[float]) -> tuple[list[float], list[int]]:
    """Bounds of a box moved out to round numbers, and how many of those lie on each side."""
    low, high = np.array(bounds[::2]), np.array(bounds[1::2])
    raw = float((high - low).max()) / 5.0
    decade = 10.0 ** np.floor(np.log10(raw))
    tick = decade * min(step for step in (1.0, 2.0, 5.0, 10.0) if step * decade >= raw)
    first, last = np.floor(low / tick), np.ceil(high / tick)
    box = np.stack([first, last], axis=1) * tick
    return box.ravel().tolist(), [int(n) for n in last - first + 1]


def _draw(plotter: Plotter, drawing: dict[str, Any]) -> None:
    """The whole scene, seen from -y, a little from the right and from above."""
    plotter.set_background("white")
    plotter.enable_parallel_projection()
    _draw_surfaces(plotter, drawing)
    _draw_routes(plotter, drawing)
    _draw_ends(plotter, drawing)
    unit = drawing["unit"]
    bounds, (nx, ny, nz) = _round_bounds(plotter.bounds)
    plotter.show_grid(
        bounds=bounds, xtitle=f"x / {unit}", ytitle=f"y / {unit}", ztitle=f"z / {unit}", font_size=18,
        color="#808080", n_xlabels=nx, n_ylabels=ny, n_zlabels=nz, fmt="%.4g", use_3d_text=False,
    )  # fmt: skip
    plotter.camera_position = "xz"
    plotter.camera.azimuth, plotter.camera.elevation = np.degrees([AZIMUTH, ELEVATION])
    plotter.reset_camera()
    plotter.camera.zoom(1.05)


def _child(code: str, sent: Callable[[], bytes] = bytes) -> None:
    """Draw in another process: without its libraries VTK crashes the interpreter it is in.

    What is `sent` there is made while that process starts.
    """
    pipe = subprocess.PIPE
    command = [sys.executable, "-P", "-c", code]
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe) as process:
        try:
            _, errors = process.communicate(sent(), timeout=SECONDS)
        except subprocess.TimeoutExpired as error:
            raise RuntimeError(f"3D picture: gave up after {SECONDS:g} s") from error
        finally:
            process.kill()
    if process.returncode < 0 or process.returncode >= 128:
        raise RuntimeError(
            "3D pictures need OpenGL libraries that this machine lacks (VTK crashed); "
            f"on Debian or Ubuntu: apt-get install {PACKAGES}"
        )
    if process.returncode:
        last = errors.decode(errors="replace").strip().splitlines()[-1:]
        raise RuntimeError(f"3D picture: {last[0] if last else 'failed'}")


def _render() -> None:
    """In the child: draw what comes on standard input, once VTK is loaded."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=True)
    drawing, path, size = pickle.load(sys.stdin.buffer)
    plotter.window_size = size
    _draw(plotter, drawing)
    plotter.screenshot(path)


def opengl() -> str | None:
    """Whether 3D pictures can be made here, tried out in another process.

    Returns
    -------
    str or None
        None if they can; else why not, and what to install.
    """
    try:
        _child("import pyvista; p = pyvista.Plotter(off_screen=True); p.add_mesh(pyvista.Cube()); p.show()")
    except RuntimeError as error:
        return str(error)
    return None


def picture(
    scene: Scene,
    paths: Paths | Callable[[], Paths] | None,
    path: str | os.PathLike[str],
    *,
    size: tuple[int, int] = (1600, 1000),
    colour: str = "route",
    relief: str | None = None,
) -> None:
    """A PNG of a scene: surfaces, rays, CCD and source, drawn off-screen in a process of its own.

    Parameters
    ----------
    scene : Scene
    paths : Paths or callable, optional
        A few hundred, traced with record=True; or a function that gives them, called while VTK is
        loaded. Those that reached the CCD are drawn; all, if none did. Rays that split are drawn on
        one of their routes.
    path : path
    size : (width, height), pixels
    colour : {"route", "length"}
        Rays are coloured by the surfaces they met, or by the length from their start.
    relief : str, optional
        Name of a surface to be coloured by its z.

    Raises
    ------
    RuntimeError
        If there are no OpenGL libraries (says which packages to install), or VTK fails.
    ValueError
        If the paths have no recorded points, or a name is unknown.
    """
    target = Path(path)
    with tempfile.TemporaryDirectory(prefix=".fringetrace-", dir=target.parent) as folder:
        part = Path(folder, "scene.png")

        def sent() -> bytes:
            seen = paths() if callable(paths) else paths
            return pickle.dumps((_drawing(scene, seen, colour, relief), str(part), size))

        _child("from fringetrace.drawing import _render; _render()", sent)
        os.replace(part, target)


def show(
    scene: Scene, paths: Paths | None = None, *, colour: str = "route", relief: str | None = None
) -> None:
    """A window with a scene, to turn and zoom; arguments and errors as for `picture`.

    Parameters
    ----------
    scene, paths, colour, relief
        See `picture`.
    """
    drawing = _drawing(scene, paths, colour, relief)
    missing = opengl()
    if missing is not None:
        raise RuntimeError(missing)
    import pyvista

    plotter = pyvista.Plotter()
    _draw(plotter, drawing)
    plotter.show()
