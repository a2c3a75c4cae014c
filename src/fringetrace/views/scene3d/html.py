"""HTML page of a scene: one file without network, to rotate, re-phase and inspect rays."""

from __future__ import annotations

import base64
import html
import json
import os
import tempfile
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray
from fringetrace.views.scene3d.describe import describe_polyline
from fringetrace.views.scene3d.layout import Panel, Solid, apart, axes_of_view, explode
from fringetrace.views.scene3d.palette import WAYS, Scale, scale, values
from fringetrace.views.scene3d.polylines import Strands
from fringetrace.views.scene3d.vtk import View, chip, surface

# Triangles of a surface at most; of more, a simpler surface is shown, and its name says so.
FACES = 100_000
# Phase steps of a slider where no image comes with them.
STEPS = 12
GREYS = [[0.0, "#000000"], [1.0, "#ffffff"]]


def write_page(view: View, path: str | os.PathLike[str], title: str = "fringetrace") -> None:
    """Write the HTML page of a scene, atomically.

    Parameters
    ----------
    view : View
    path : path
    title : str

    Raises
    ------
    ImportError
        If plotly is missing; says what to install.
    """
    text = page_text(view, title)
    target = Path(path)
    with tempfile.TemporaryDirectory(prefix=".fringetrace-", dir=target.parent) as folder:
        part = Path(folder, "page.html")
        part.write_text(text, encoding="utf-8")
        os.replace(part, target)


def page_text(view: View, title: str) -> str:
    """Text of the HTML page.

    Parameters
    ----------
    view : View
    title : str

    Returns
    -------
    str
    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise ImportError(f"a page needs plotly: pip install 'fringetrace[html]' ({error})") from error
    data = contents(view)
    parts = {
        "title": html.escape(title),
        "caption": html.escape(view.strands.caption if view.strands is not None else ""),
        "steps": data["steps"],
        "plotly": get_plotlyjs(),
        "data": json.dumps(data, allow_nan=False).replace("</", "<\\/"),
    }
    template = files("fringetrace.views.scene3d").joinpath("page.html").read_text(encoding="utf-8")
    return Template(template).substitute(parts)


def contents(view: View) -> dict[str, Any]:
    """Contents of the HTML page, as they go into JSON.

    Parameters
    ----------
    view : View

    Returns
    -------
    dict
        `figure` for plotly; `rays` and `frames`, arrays as kind and base64.
    """
    stage, shown = view.stage, view.strands
    traces = [_solid(solid, stage.metres) for solid in stage.solids]
    chips = [panel for panel in stage.panels if panel.image is not None]
    traces += [_panel(panel, stage.metres) for panel in stage.panels if panel.image is None]
    traces += [_arrow(arrow.tail / stage.metres, arrow.tip / stage.metres) for arrow in stage.arrows]
    data: dict[str, Any] = {"steps": STEPS if view.frames is None else len(view.frames)}
    for panel in chips:
        data["chip"] = len(traces)
        traces.append(_image(panel, stage.metres))
    if view.frames is not None and chips:
        most = float(view.frames.max()) or 1.0
        data["frames"] = _packed(np.round(255.0 * view.frames / most), "u1")
        data["pixels"] = int(np.prod(view.frames.shape[1:]))
    traces.append(_bar(stage.bar / stage.metres, stage.bar_label))
    if shown is not None and len(shown):
        data["rays"] = _rays(view, shown, len(traces), data["steps"])
        traces += _lines()
    data["figure"] = {"data": traces, "layout": _layout(stage.unit)}
    return data


def _packed(array: npt.ArrayLike, kind: str) -> list[str]:
    raw = np.ascontiguousarray(array, dtype=f"<{kind}").tobytes()
    return [kind, base64.b64encode(raw).decode()]


def _typed(array: npt.ArrayLike, kind: str) -> dict[str, Any]:
    """An array as plotly reads it."""
    kind, text = _packed(array, kind)
    return {"dtype": kind, "bdata": text}


def _mesh(points: FloatArray, faces: npt.NDArray[Any], **more: Any) -> dict[str, Any]:
    corners = {name: _typed(column, "f4") for name, column in zip("xyz", points.T, strict=True)}
    sides = {name: _typed(column, "i4") for name, column in zip("ijk", faces.T, strict=True)}
    return {"type": "mesh3d", **corners, **sides, "flatshading": True, "showlegend": True, **more}


def _solid(solid: Solid, metres: float) -> dict[str, Any]:
    name = solid.name if solid.name == solid.kind else f"{solid.name} ({solid.kind})"
    points, faces = solid.vertices / metres, solid.faces
    if len(faces) > FACES:
        simple = surface(solid, metres).decimate(1.0 - FACES / len(faces))
        points, faces = np.asarray(simple.points), simple.regular_faces
        name += f", {len(faces):,} of {len(solid.faces):,} triangles"
    style: dict[str, Any] = {"color": solid.colour, "opacity": solid.opacity, "name": html.escape(name)}
    if solid.relief:
        style |= {"intensity": _typed(points[:, 2], "f4"), "colorscale": "Viridis", "showscale": False}
    return _mesh(points, faces, hoverinfo="name", **style)


def _panel(panel: Panel, metres: float) -> dict[str, Any]:
    colour = "#202020" if panel.name == "CCD" else "#E69F00"
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return _mesh(panel.corners / metres, faces, color=colour, opacity=0.8, name=panel.name, hoverinfo="name")


def _image(panel: Panel, metres: float) -> dict[str, Any]:
    """Two triangles for each pixel."""
    mesh = chip(panel, metres)
    quads = mesh.regular_faces
    faces = np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    light = np.repeat(np.asarray(mesh.cell_data["image"]), 2)
    light = np.round(255.0 * light / max(float(light.max()), np.finfo(float).tiny))
    return _mesh(
        np.asarray(mesh.points), faces, intensity=_typed(light, "f4"), intensitymode="cell", colorscale=GREYS,
        cmin=0, cmax=255, showscale=False, name=panel.name, hoverinfo="name",
        lighting={"ambient": 1.0, "diffuse": 0.0, "specular": 0.0, "fresnel": 0.0},
    )  # fmt: skip


def _arrow(tail: FloatArray, tip: FloatArray) -> dict[str, Any]:
    place = {name: [float(x)] for name, x in zip("xyz", tip, strict=True)}
    way = {name: [float(x)] for name, x in zip("uvw", tip - tail, strict=True)}
    return {
        "type": "cone", **place, **way, "anchor": "tip", "sizemode": "raw", "sizeref": 1.0,
        "showscale": False, "colorscale": [[0, "#E69F00"], [1, "#E69F00"]], "name": "direction of light",
        "hoverinfo": "name",
    }  # fmt: skip


def _bar(ends: FloatArray, label: str) -> dict[str, Any]:
    middle = ends.mean(axis=0)
    points = np.stack([ends[0], middle, ends[1]])
    place = {name: column.tolist() for name, column in zip("xyz", points.T, strict=True)}
    return {
        "type": "scatter3d", **place, "mode": "lines+text", "text": ["", label, ""],
        "textposition": "bottom center", "line": {"color": "#000000", "width": 6},
        "name": f"scale bar, {label}", "hoverinfo": "name", "showlegend": True,
    }  # fmt: skip


def _lines() -> list[dict[str, Any]]:
    """The rays, and the one that was clicked on; the page fills them in."""
    bar = {"x": 0.0, "xanchor": "left", "len": 0.6, "thickness": 16, "title": {"side": "top"}}
    return [
        {
            "type": "scatter3d", "mode": "lines", "name": "rays", "x": [], "y": [], "z": [],
            "showlegend": True, "hoverinfo": "none",
            "line": {"width": 2.5, "color": [], "colorbar": bar, "showscale": True},
        },
        {
            "type": "scatter3d", "mode": "lines", "name": "ray clicked on", "x": [], "y": [], "z": [],
            "line": {"width": 9, "color": "#000000"}, "hoverinfo": "skip", "showlegend": True,
        },
    ]  # fmt: skip


def _rays(view: View, shown: Strands, trace: int, steps: int) -> dict[str, Any]:
    """Legs with all that they may be coloured by, and every path in words."""
    stage, (path, bounce) = view.stage, shown.legs()
    straight = np.stack(explode(shown, np.zeros(3)), axis=1) / stage.metres
    most = int(bounce.max())
    ways = {way: _way(view, shown, way) for way in WAYS if way != "phase" or len(shown.wavelengths)}
    ends = np.zeros(len(shown), dtype=int)
    np.maximum.at(ends, path, bounce + 1)
    data = {
        "trace": trace, "ends": _packed(straight, "f4"), "path": _packed(path, "i4"),
        "bounce": _packed(bounce, "i4"), "steps": _packed(shown.steps[path, bounce + 1], "i4"),
        "ends_at": ends.tolist(), "most": most, "upto": most if view.upto is None else min(view.upto, most),
        "shift": _shift(view, shown), "explode": 20 if view.shift.any() else 0,
        "step": round(view.step * steps / (2.0 * np.pi)) % steps, "colour": view.colour, "ways": ways,
        "wavelengths": shown.wavelengths.tolist(), "chosen": shown.chosen, "phase": None,
        "texts": [describe_polyline(shown, number) for number in range(len(shown))],
    }  # fmt: skip
    if len(shown.wavelengths):
        turns = shown.phase[:, path, bounce + 1]
        data["phase"] = _packed(np.round(256.0 * turns).astype(np.int64) % 256, "u1")
    return data


def _shift(view: View, shown: Strands) -> list[float]:
    shift = view.shift if view.shift.any() else apart(shown)
    return [float(x) for x in shift / view.stage.metres]


def _way(view: View, shown: Strands, way: str) -> dict[str, Any]:
    """What colours stand for, as plotly has it: names are ticks of a colour bar."""
    found = scale(shown, way, view.stage.unit, view.stage.metres)
    data: dict[str, Any] = {"title": html.escape(found.title), "colorscale": _colorscale(found)}
    data |= {"low": found.low, "high": found.high, "names": None, "ticks": None}
    if found.names:
        names = [html.escape(_broken(name)) for name in found.names]
        names = [name.replace("\n", "<br>") for name in names]
        data |= {"low": -0.5, "high": len(names) - 0.5, "names": names, "ticks": list(range(len(names)))}
    if way == "bounce":
        data |= {
            "ticks": list(range(int(found.high) + 1)),
            "names": [str(n) for n in range(int(found.high) + 1)],
        }
    if way != "phase":
        data["values"] = _packed(values(shown, way, view.stage.metres), "f4")
    return data


def _broken(name: str, letters: int = 26) -> str:
    """A long name in lines."""
    import textwrap

    return "\n".join(textwrap.wrap(name, letters)[:4]) or name


def _colorscale(found: Scale) -> list[list[Any]]:
    colours = found.colours
    if not found.names:
        return [[n / (len(colours) - 1), colour] for n, colour in enumerate(colours)]
    count = len(colours)
    return [[edge, colour] for n, colour in enumerate(colours) for edge in (n / count, (n + 1) / count)]


def _layout(unit: str) -> dict[str, Any]:
    _, _, eye = axes_of_view()
    axes = {
        f"{name}axis": {
            "title": {"text": f"{name} / {unit}"},
            "backgroundcolor": "#f6f6f6",
            "gridcolor": "#bbb",
        }
        for name in "xyz"
    }
    camera = {
        "eye": dict(zip("xyz", (1.3 * eye).tolist(), strict=True)), "up": {"x": 0, "y": 0, "z": 1},
        "projection": {"type": "orthographic"},
    }  # fmt: skip
    return {
        "scene": {**axes, "aspectmode": "data", "camera": camera, "dragmode": "orbit"},
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0}, "legend": {"x": 1, "xanchor": "right", "y": 0.95},
        "paper_bgcolor": "#ffffff", "uirevision": "kept",
    }  # fmt: skip
