"""Layout of a 3D view as plain arrays: surfaces, sources, CCD, labels, scale bar."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, short_repr, unit_of
from fringetrace.scene import CCD, Beam, Scene
from fringetrace.tracing import Paths
from fringetrace.views.scene3d.palette import SHADES, look
from fringetrace.views.scene3d.polylines import Strands, start_of

# Where a scene is seen from: to the right of -y, and from above; radians.
AZIMUTH, ELEVATION = np.radians([30.0, 25.0])
# Part of the scene's width that the scale bar is long, at most.
BAR = 0.25
# A letter's width and a line's height, parts of the scene's diagonal in the view.
LETTER, LINE = 0.017, 0.035
THICK = np.array([-0.01, -0.01, 0.01, 0.01])  # room around an arrow, likewise


@dataclass(frozen=True, eq=False)
class Solid:
    """Surface of a view, with its appearance.

    Attributes
    ----------
    name, kind : str
    vertices : (v, 3) float64, metres
    faces : (f, 3) int64
    colour : str
    opacity : float
    relief : bool
        Whether it is coloured by its z instead.
    """

    name: str
    kind: str
    vertices: FloatArray
    faces: npt.NDArray[np.int64]
    colour: str
    opacity: float
    relief: bool

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class Panel:
    """Rectangle of a view: a beam or a CCD.

    Attributes
    ----------
    name : str
    corners : (4, 3) float64, metres
        Of an image: lower left, lower right, upper right, upper left.
    image : (rows, columns) float64, or None
    """

    name: str
    corners: FloatArray
    image: FloatArray | None = None

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class Arrow:
    """Arrow of a view: direction of a source.

    Attributes
    ----------
    tail, tip : (3,) float64, metres
    """

    tail: FloatArray
    tip: FloatArray

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class Stage:
    """Contents of a 3D view besides the rays.

    Attributes
    ----------
    unit : str
    metres : float
        How long one of it is.
    size : float, metres
        Largest extent of the surfaces.
    solids, panels, arrows : tuple
    legend : tuple of (name, colour)
        Of surfaces.
    bar : (2, 3) float64, metres
        Ends of the scale bar.
    bar_label : str
    """

    unit: str
    metres: float
    size: float
    solids: tuple[Solid, ...]
    panels: tuple[Panel, ...]
    arrows: tuple[Arrow, ...]
    legend: tuple[tuple[str, str], ...]
    bar: FloatArray
    bar_label: str

    __repr__ = short_repr

    @property
    def places(self) -> list[tuple[str, FloatArray]]:
        """Names of all objects, and points on them."""
        solids = [(solid.name, solid.vertices) for solid in self.solids]
        return [*solids, *((panel.name, panel.corners) for panel in self.panels)]


def scene_size(scene: Scene) -> float:
    """Largest side of the box around the surfaces of a scene.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    float, metres
    """
    bounds = np.array([surface.mesh.bounds for surface in scene.surfaces])
    return float(np.ptp(bounds.reshape(-1, 3), axis=0).max())


def lay_out(
    scene: Scene,
    parts: Sequence[Paths] = (),
    shown: Strands | None = None,
    *,
    image: npt.ArrayLike | None = None,
    surfaces: str = "interface",
    relief: str | None = None,
) -> Stage:
    """Layout of a scene, its sources and its CCD.

    Parameters
    ----------
    scene : Scene
    parts : sequence of Paths
        Whose sources and CCD are drawn.
    shown : Strands, optional
        Of these.
    image : (rows, columns) array-like, optional
        What the CCD shows.
    surfaces : {"interface", "name"}
        What surfaces are coloured by.
    relief : str, optional
        Name of a surface to be coloured by its z.

    Returns
    -------
    Stage

    Raises
    ------
    ValueError
        For an unknown surface or way of colouring, an image without a CCD.
    """
    size = scene_size(scene)
    solids, legend = _solids(scene, surfaces, relief)
    panels, arrows = _ends(parts, shown, size, image)
    corners = np.concatenate([solid.vertices for solid in solids] + [panel.corners for panel in panels])
    unit, metres = unit_of(0.5 * size)
    bar, label = _bar(corners)
    return Stage(unit, metres, size, solids, panels, arrows, legend, bar, label)


def _solids(
    scene: Scene, surfaces: str, relief: str | None
) -> tuple[tuple[Solid, ...], tuple[tuple[str, str], ...]]:
    if surfaces not in ("interface", "name"):
        raise ValueError(f"surfaces: expected 'interface' or 'name', got {surfaces!r}")
    chosen = None if relief is None else scene.index(relief)
    solids: list[Solid] = []
    legend: dict[str, str] = {}
    for number, surface in enumerate(scene.surfaces):
        kind, colour, opacity = look(surface)
        if surfaces == "name":
            colour = SHADES[number % len(SHADES)]
        raised = number == chosen and np.ptp(surface.mesh.vertices[:, 2]) > 0.0
        if not raised:
            legend.setdefault(kind if surfaces == "interface" else surface.name, colour)
        mesh = surface.mesh
        solids.append(Solid(surface.name, kind, mesh.vertices, mesh.faces, colour, opacity, bool(raised)))
    return tuple(solids), tuple(legend.items())


def _ends(
    parts: Sequence[Paths], shown: Strands | None, size: float, image: npt.ArrayLike | None
) -> tuple[tuple[Panel, ...], tuple[Arrow, ...]]:
    """Rectangles of sources and CCD, an arrow for each source."""
    panels, arrows = [], []
    for number, paths in enumerate(parts):
        assert shown is not None
        centre, direction, width = start_of(paths.source, shown.points[shown.beam == number])
        width = max(width, 0.1 * size)
        arrows.append(Arrow(centre - 0.6 * width * direction, centre - 0.1 * width * direction))
        if isinstance(paths.source, Beam):
            name = "source" if len(parts) == 1 else f"source {number + 1}"
            panels.append(Panel(name, _rectangle(paths.source)))
    ccds = {id(paths.ccd): paths.ccd for paths in parts if isinstance(paths.ccd, CCD)}
    for ccd in ccds.values():
        panels.append(Panel("CCD", _rectangle(ccd), None if image is None else checked_image(image, ccd)))
    if image is not None and not ccds:
        raise ValueError("image: expected paths traced onto a CCD that can show it, got none")
    return tuple(panels), tuple(
        arrow for arrow in arrows if np.linalg.norm(arrow.tip - arrow.tail) > 0.05 * size
    )


def checked_image(image: Any, ccd: CCD) -> FloatArray:
    """Checked image of a CCD.

    Parameters
    ----------
    image : (rows, columns) array-like
    ccd : CCD

    Returns
    -------
    (rows, columns) float64

    Raises
    ------
    ValueError
        If it has another shape.
    """
    found = np.asarray(image, dtype=np.float64)
    if found.shape != ccd.shape:
        raise ValueError(f"image: expected that of the CCD, shape {ccd.shape}, got {found.shape}")
    return found


def _rectangle(of: Beam | CCD) -> FloatArray:
    u, v, _ = of.axes
    corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]) * of.size
    return np.asarray(of.centre + corners[:, :1] * u + corners[:, 1:] * v, dtype=np.float64)


def axes_of_view() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Axes of the initial view: to the right, up and towards the eye.

    Returns
    -------
    right, up, eye : (3,) float64
    """
    right = np.array([np.cos(AZIMUTH), np.sin(AZIMUTH), 0.0])
    up = np.array([-right[1] * np.sin(ELEVATION), right[0] * np.sin(ELEVATION), np.cos(ELEVATION)])
    return right, up, np.cross(right, up)


def _bar(points: FloatArray) -> tuple[FloatArray, str]:
    """A bar of a round length across the view, below the left end of everything."""
    right, up, _ = axes_of_view()
    across = points @ right
    longest = BAR * float(np.ptp(across))
    decade = 10.0 ** np.floor(np.log10(longest))
    length = float(decade * max(step for step in (1.0, 2.0, 5.0) if step * decade <= longest))
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    left = middle + (across.min() - middle @ right) * right
    start = left + ((points @ up).min() - 0.12 * np.ptp(points @ up) - left @ up) * up
    unit, metres = unit_of(length)
    return np.stack([start, start + length * right]), f"{length / metres:g} {unit}"


def labels(stage: Stage) -> list[tuple[str, FloatArray, bool]]:
    """Label positions beside objects, clear of each other and of other objects where possible.

    Parameters
    ----------
    stage : Stage

    Returns
    -------
    list of (name, (3,) float64 metres, above)
        The spot is in the middle of the text's lower edge if it is above the thing, else of its upper edge.
    """
    right, up, _ = axes_of_view()
    flat = [(name, points @ np.stack([right, up], axis=1), points) for name, points in stage.places]
    everything = np.concatenate([plane for _, plane, _ in flat])
    size = float(np.linalg.norm(np.ptp(everything, axis=0)))
    taken = [np.concatenate([plane.min(axis=0), plane.max(axis=0)]) for _, plane, _ in flat]
    for arrow in stage.arrows:
        ends = np.stack([arrow.tail, arrow.tip]) @ np.stack([right, up], axis=1)
        taken.append(np.concatenate([ends.min(axis=0), ends.max(axis=0)]) + size * THICK)
    found = []
    for name, plane, points in flat:
        half, gap = 0.5 * LETTER * size * len(name), 0.012 * size
        best = np.inf
        for number, (spot, above) in enumerate(_spots(plane, gap, half)):
            low = spot[1] if above else spot[1] - LINE * size
            box = np.array([spot[0] - half, low, spot[0] + half, low + LINE * size])
            away = np.linalg.norm(plane - spot, axis=1).min() - (half if number > 1 else 0.0)
            cost = _overlap(box, taken) / (2.0 * half * LINE * size) + 2.0 * away / size
            if cost < best:
                best, chosen = cost, (spot, above, box)
        spot, above, box = chosen
        taken.append(box)
        centre = points.mean(axis=0)
        at = centre + (spot[0] - centre @ right) * right + (spot[1] - centre @ up) * up
        found.append((name, at, above))
    return found


def _spots(plane: FloatArray, gap: float, half: float) -> list[tuple[FloatArray, bool]]:
    """Places beside a thing in the plane of the view: above, below, to the right, to the left."""
    low, high = plane.min(axis=0), plane.max(axis=0)
    top, bottom = plane[np.argmax(plane[:, 1])], plane[np.argmin(plane[:, 1])]
    most, least = plane[np.argmax(plane[:, 0])], plane[np.argmin(plane[:, 0])]
    return [
        (np.array([bottom[0], low[1] - gap]), False),
        (np.array([top[0], high[1] + gap]), True),
        (np.array([high[0] + gap + half, most[1]]), False),
        (np.array([low[0] - gap - half, least[1]]), False),
        (np.array([high[0] + gap + half, low[1]]), False),
        (np.array([low[0] - gap - half, high[1]]), True),
    ]


def _overlap(box: FloatArray, taken: Sequence[FloatArray]) -> float:
    """Area that a box shares with others, each (left, bottom, right, top)."""
    others = np.array(taken)
    sides = np.minimum(box[2:], others[:, 2:]) - np.maximum(box[:2], others[:, :2])
    return float(np.prod(np.maximum(sides, 0.0), axis=1).sum())


def explode(shown: Strands, shift: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Segment ends, each displaced in proportion to the surfaces met before.

    Parameters
    ----------
    shown : Strands
    shift : (3,) array-like, metres
        From one bounce to the next.

    Returns
    -------
    start, end : (legs, 3) float64, metres
    """
    path, bounce = shown.legs()
    moved = bounce[:, None] * np.asarray(shift, dtype=np.float64)
    return shown.starts[path, bounce] + moved, shown.points[path, bounce + 1] + moved


def apart(shown: Strands) -> FloatArray:
    """Displacement per bounce that separates segments well: along the least extent of the rays.

    Parameters
    ----------
    shown : Strands

    Returns
    -------
    (3,) float64, metres
    """
    points = shown.points[np.isfinite(shown.points[..., 0])]
    sides = np.ptp(points, axis=0)
    shift = np.zeros(3)
    shift[int(np.argmin(sides))] = 0.5 * float(sides.max()) / max(1, int(shown.bounces.max(initial=0)))
    return shift
