"""3D drawing by VTK: surfaces, rays, sources and CCD, with axes, legends and a scale bar."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from fringetrace.core import FloatArray, nm, short_repr, unit_of
from fringetrace.views.scene3d.layout import (
    AZIMUTH,
    ELEVATION,
    Panel,
    Solid,
    Stage,
    axes_of_view,
    explode,
    labels,
)
from fringetrace.views.scene3d.palette import scale, values
from fringetrace.views.scene3d.polylines import Strands

if TYPE_CHECKING:
    from pyvista import PolyData

Plotter = Any  # mypy does not see through the decorators of pyvista's
BAR = {
    "vertical": False, "position_y": 0.03, "width": 0.3, "height": 0.07, "fmt": "%.3g",
    "color": "black",
}  # fmt: skip
SOURCE, CHIP, INK = "#E69F00", "#202020", "black"
# Letters of a legend's name at most: longer ones would run into the scene.
LETTERS = 30
# Pixels, for which sizes of fonts are meant.
WIDTH = 1600
# Room for labels of axes, a factor.
MARGIN = 1.14
# How far the scale bar's label is below it, a part of the scene's size.
BELOW = 0.02


@dataclass(frozen=True, eq=False)
class View:
    """View to draw: contents and drawing options.

    Parameters
    ----------
    stage : Stage
    strands : Strands, optional
    colour : str
        What rays are coloured by, see `hues.scale`.
    step : float, radians
        Phase step.
    wavelength : int, optional
        Number of that of phases; default: that of the picture.
    upto : int, optional
        Only legs before so many surfaces are met, and one more; default: all.
    shift : (3,) float64, metres
        Of legs from bounce to bounce.
    radius : float, metres
        Of tubes; 0: lines.
    clip : (normal, origin), optional
        Plane in front of which nothing is shown; (3,) each, metres.
    frames : (steps, rows, columns) float64, optional
        What the CCD shows at each phase step of a period, at the wavelength of the picture.
    """

    stage: Stage
    strands: Strands | None = None
    colour: str = "route"
    step: float = 0.0
    wavelength: int | None = None
    upto: int | None = None
    shift: FloatArray = field(default_factory=lambda: np.zeros(3))
    radius: float = 0.0
    clip: tuple[FloatArray, FloatArray] | None = None
    frames: FloatArray | None = None

    __repr__ = short_repr


def path_lines(view: View) -> PolyData:
    """Ray segments as line data, two points each.

    Parameters
    ----------
    view : View

    Returns
    -------
    pyvista.PolyData
        In the unit of the stage; `value` at points is what is coloured, `strand` at cells is whose leg it is.
    """
    import pyvista

    assert view.strands is not None
    metres = view.stage.metres
    path, bounce = view.strands.legs()
    shown = np.ones(len(path), dtype=bool) if view.upto is None else bounce <= view.upto
    ends = np.stack(explode(view.strands, view.shift), axis=1)[shown]
    count = len(ends)
    cells = np.column_stack([np.full(count, 2), np.arange(2 * count).reshape(-1, 2)])
    data = pyvista.PolyData(ends.reshape(-1, 3) / metres, lines=cells.ravel())
    value = values(view.strands, view.colour, metres, wavelength=view.wavelength, step=view.step)
    data["value"] = value[shown].ravel()
    data.cell_data["strand"] = path[shown]
    return data.tube(radius=view.radius / metres, n_sides=8) if view.radius > 0.0 and count else data


def surface(solid: Solid, metres: float) -> PolyData:
    """Triangle data of a surface.

    Parameters
    ----------
    solid : Solid
    metres : float
        Length of the unit.

    Returns
    -------
    pyvista.PolyData
    """
    import pyvista

    return pyvista.PolyData.from_regular_faces(solid.vertices / metres, solid.faces)


def chip(panel: Panel, metres: float) -> PolyData:
    """CCD pixels as squares with their irradiance `image`; row 0 below, seen from the front.

    Parameters
    ----------
    panel : Panel
        With an image.
    metres : float

    Returns
    -------
    pyvista.PolyData
    """
    import pyvista

    assert panel.image is not None
    rows, columns = panel.image.shape
    corner, right, _, up = panel.corners / metres
    at = np.linspace(0.0, 1.0, columns + 1)[None, :, None] * (right - corner)
    points = corner + at + np.linspace(0.0, 1.0, rows + 1)[:, None, None] * (up - corner)
    number = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    quads = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1)
    mesh = pyvista.PolyData.from_regular_faces(points.reshape(-1, 3), quads.reshape(-1, 4))
    mesh.cell_data["image"] = panel.image.ravel()
    return mesh


def _draw_surfaces(plotter: Plotter, stage: Stage) -> None:
    for solid in stage.solids:
        mesh = surface(solid, stage.metres)
        if solid.relief:
            z = solid.vertices[:, 2] - 0.5 * (solid.vertices[:, 2].min() + solid.vertices[:, 2].max())
            unit, height_unit = unit_of(float(np.ptp(z)))
            bar = {
                **_bar(plotter),
                "n_labels": 2,
                "title": f"height of the {solid.name} / {unit}",
                "position_x": 0.04,
            }
            plotter.add_mesh(
                mesh, scalars=z / height_unit, cmap="viridis", scalar_bar_args=bar, lighting=False,
                pickable=False,
            )  # fmt: skip
        else:
            plotter.add_mesh(
                mesh, color=solid.colour, opacity=solid.opacity, show_edges=len(solid.faces) < 3,
                edge_color="#606060", pickable=False,
            )  # fmt: skip
    _legend(plotter, stage.legend, 0.8, 0.955, "surface")


def _legend(plotter: Plotter, entries: Sequence[tuple[str, str]], left: float, top: float, what: str) -> None:
    """Names beside a dash in their colour, one below the other."""
    for row, (name, colour) in enumerate(entries):
        height = top - 0.037 * row
        for text, at, y, ink, size in (
            ("–", left, height - 0.022, colour, 36),
            (_short(name), left + 0.04, height, INK, 11),
        ):
            plotter.add_text(
                text,
                position=(at, y),
                viewport=True,
                color=ink,
                font_size=font_size(plotter, size),
                name=f"{what} {row} {at}",
            )


def font_size(plotter: Plotter, size: int) -> int:
    """Font size in proportion to the picture.

    Parameters
    ----------
    plotter : pyvista.Plotter
    size : int
        In a picture as wide as `WIDTH`.

    Returns
    -------
    int
    """
    return max(4, round(size * plotter.window_size[0] / WIDTH))


def _short(name: str) -> str:
    return name if len(name) <= LETTERS else name[: LETTERS - 1] + "…"


def draw_rays(plotter: Plotter, view: View) -> PolyData | None:
    """Draw rays, their colour legend and their number.

    Parameters
    ----------
    plotter : pyvista.Plotter
    view : View

    Returns
    -------
    pyvista.PolyData or None
        That is drawn: new `path_lines` copied into it are shown. None: there are no rays.
    """
    strands, stage = view.strands, view.stage
    if strands is None or not len(strands):
        return None
    data = path_lines(view)
    found = scale(strands, view.colour, stage.unit, stage.metres)
    clim = (-0.5, len(found.names) - 0.5) if found.names else (found.low, found.high)
    title, several = found.title, {"n_labels": 3}
    if view.colour == "phase":
        at = strands.chosen if view.wavelength is None else view.wavelength
        title = f"{title} at {strands.wavelengths[at] / nm:.6g} nm"
    if view.colour == "bounce" and found.high < 9.0:
        several = {"n_labels": int(found.high) + 1}
    plotter.add_mesh(
        data, scalars="value", cmap=_listed(found.table()), clim=clim, line_width=1.5, name="rays",
        show_scalar_bar=not found.names, lighting=view.radius > 0.0, ambient=0.6, diffuse=0.4,
        copy_mesh=False,
        scalar_bar_args={**_bar(plotter), **several, "title": title, "position_x": 0.02, "position_y": 0.86},
    )  # fmt: skip
    caption = f"{strands.caption}; colours: {found.title}" if found.names else strands.caption
    plotter.add_text(
        caption,
        position=(0.02, 0.955),
        viewport=True,
        color=INK,
        font_size=font_size(plotter, 11),
        name="caption",
    )
    _legend(plotter, list(zip(found.names, found.colours, strict=False)), 0.02, 0.915, "ray")
    return data


def _bar(plotter: Plotter) -> dict[str, Any]:
    sizes = {
        name: font_size(plotter, size) for name, size in (("title_font_size", 20), ("label_font_size", 18))
    }
    return {**BAR, **sizes}


def _listed(table: Any) -> Any:
    """Colours as pyvista takes them."""
    return ["#{:02x}{:02x}{:02x}".format(*row) for row in table]


def _draw_ends(plotter: Plotter, stage: Stage) -> None:
    """Sources with their directions, the CCD with its image, and the scale bar."""
    import pyvista

    metres = stage.metres
    for panel in stage.panels:
        if panel.image is not None:
            top = max(float(np.nanmax(panel.image)), np.finfo(float).tiny)
            plotter.add_mesh(
                chip(panel, metres), scalars="image", cmap="gray", clim=(0.0, top), lighting=False,
                show_scalar_bar=False, pickable=False,
            )  # fmt: skip
            continue
        rectangle = pyvista.PolyData.from_regular_faces(panel.corners / metres, [[0, 1, 2], [0, 2, 3]])
        colour = CHIP if panel.name == "CCD" else SOURCE
        plotter.add_mesh(rectangle, color=colour, opacity=0.8, lighting=False, pickable=False)
    for arrow in stage.arrows:
        way = (arrow.tip - arrow.tail) / metres
        shape = pyvista.Arrow(start=arrow.tail / metres, direction=way, scale=float(np.linalg.norm(way)))
        plotter.add_mesh(shape, color=SOURCE, pickable=False)
    plotter.add_mesh(
        pyvista.Line(*(stage.bar / metres)), color=INK, line_width=4.0, pickable=False, name="bar"
    )
    below = stage.bar.mean(axis=0) - BELOW * stage.size * axes_of_view()[1]
    _label(plotter, below / metres, stage.bar_label, "top", 20)


def _label(plotter: Plotter, spot: FloatArray, text: str, vertical: str, size: int) -> None:
    plotter.add_point_labels(
        spot[None, :], [text], font_size=font_size(plotter, size), text_color=INK, shape=None,
        show_points=False, always_visible=True, justification_horizontal="center",
        justification_vertical=vertical, pickable=False,
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


def _fitting(bounds: Sequence[float], size: Sequence[int]) -> float:
    """Half the height of a view that a box fits into, with its labels."""
    right, up, _ = axes_of_view()
    corners = np.stack(np.meshgrid(bounds[:2], bounds[2:4], bounds[4:]), axis=-1).reshape(-1, 3)
    height, width = np.ptp(corners @ up), np.ptp(corners @ right)
    return float(0.5 * MARGIN * max(height, width * size[1] / size[0]))


def clip_plane(plotter: Plotter, normal: FloatArray | None, origin: FloatArray | None) -> None:
    """Clip all objects at a plane: hide the side that its normal points to.

    Parameters
    ----------
    plotter : pyvista.Plotter
    normal, origin : (3,) float64, in the unit of the stage, or None
        None: hide nothing any more.
    """
    from pyvista import _vtk

    planes = _vtk.vtkPlaneCollection()
    if normal is not None and origin is not None:
        plane = _vtk.vtkPlane()
        plane.SetNormal(*-np.asarray(normal, dtype=np.float64))
        plane.SetOrigin(*np.asarray(origin, dtype=np.float64))
        planes.AddItem(plane)
    for name, actor in plotter.actors.items():
        mapper = getattr(actor, "mapper", None)
        if name != "bar" and hasattr(mapper, "SetClippingPlanes") and hasattr(mapper, "dataset"):
            mapper.SetClippingPlanes(planes)


def draw(plotter: Plotter, view: View) -> PolyData | None:
    """Draw the whole scene, seen from -y, slightly from the right and from above.

    Parameters
    ----------
    plotter : pyvista.Plotter
    view : View

    Returns
    -------
    pyvista.PolyData or None
        As `draw_rays`.
    """
    stage = view.stage
    plotter.set_background("white")
    plotter.enable_parallel_projection()
    _draw_surfaces(plotter, stage)
    data = draw_rays(plotter, view)
    _draw_ends(plotter, stage)
    for name, spot, above in labels(stage):
        _label(plotter, spot / stage.metres, name, "bottom" if above else "top", 22)
    if view.clip is not None:
        normal, origin = view.clip
        clip_plane(plotter, normal, origin / stage.metres)
    unit = stage.unit
    bounds, (nx, ny, nz) = _round_bounds(plotter.bounds)
    plotter.show_grid(
        bounds=bounds, xtitle=f"x / {unit}", ytitle=f"y / {unit}", ztitle=f"z / {unit}",
        font_size=font_size(plotter, 18), color="#808080", n_xlabels=nx, n_ylabels=ny,
        n_zlabels=nz, fmt="%.4g", use_3d_text=False,
    )  # fmt: skip
    plotter.camera_position = "xz"
    plotter.camera.azimuth, plotter.camera.elevation = np.degrees([AZIMUTH, ELEVATION])
    plotter.reset_camera(bounds=bounds)
    plotter.camera.parallel_scale = _fitting(bounds, plotter.window_size)
    return data


def empty(size: tuple[int, int], off_screen: bool = True) -> Plotter:
    """Empty plotter; imports VTK.

    Parameters
    ----------
    size : (width, height), pixels
    off_screen : bool

    Returns
    -------
    pyvista.Plotter
    """
    import pyvista

    return pyvista.Plotter(off_screen=off_screen, window_size=size, title="fringetrace")
