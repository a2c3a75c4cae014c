"""3D views of scenes and interferometers: picture, window, HTML page, export."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypedDict, Unpack

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray
from fringetrace.instruments import Interferometer, Mark
from fringetrace.scene import Scene
from fringetrace.tracing import Paths
from fringetrace.views.scene3d import formats, html
from fringetrace.views.scene3d.layout import apart, lay_out, scene_size
from fringetrace.views.scene3d.palette import checked_colouring
from fringetrace.views.scene3d.polylines import Strands, strands
from fringetrace.views.scene3d.subprocess import open_window, written
from fringetrace.views.scene3d.vtk import View

Several = Paths | Sequence[Paths] | None
# Rays of a bench that are drawn along its longer side, if nothing else is said.
DRAWN = 12
# Wavelengths and phase steps that sliders go through, and pixels a side of the images that follow the steps.
SWEEP, STEPS, PIXELS = 19, 12, 96
# Part of the scene's size that light which leaves is drawn on.
ONWARD = 0.3


class Looks(TypedDict, total=False):
    """Drawing options of a scene; see `view`."""

    colour: str
    wavelength: float | None
    step: float
    surfaces: str
    relief: str | None
    image: npt.ArrayLike | None
    most: int
    every: bool | None
    reference: str | Mark | None
    explode: float | npt.ArrayLike
    upto: int | None
    clip: tuple[npt.ArrayLike, npt.ArrayLike] | None
    tubes: float


def few(shape: tuple[int, int], most: int = DRAWN) -> tuple[int, int]:
    """Coarser grid of rays of the same proportions, for drawing.

    Parameters
    ----------
    shape : (rows, columns)
    most : int
        Rays along the longer side.

    Returns
    -------
    (rows, columns)
    """
    rows, columns = (max(1, round(most * n / max(shape))) for n in shape)
    return rows, columns


def scene_view(
    scene: Scene | Interferometer,
    paths: Several = None,
    *,
    colour: str = "route",
    wavelength: float | None = None,
    step: float = 0.0,
    surfaces: str = "interface",
    relief: str | None = None,
    image: npt.ArrayLike | None = None,
    most: int = 1000,
    every: bool | None = None,
    reference: str | Mark | None = None,
    explode: float | npt.ArrayLike = 0.0,
    upto: int | None = None,
    clip: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    tubes: float = 0.0,
    sweep: int = 1,
) -> View:
    """View of a scene as plain arrays.

    Parameters
    ----------
    scene : Scene or Interferometer
        A bench brings its rays, its image (with a wavelength), and what a phase step turns.
    paths : Paths, or a sequence of them, optional
        Traced with record=True; of several beams. Those that reached the CCD are drawn; all, if none did.
        Rays that split are drawn on one of their routes.
    colour : {"route", "beam", "bounce", "length", "phase", "fate", "power"}
        Rays are coloured by the surfaces they met, their beam, the surfaces met so far, the optical path so
        far, the phase where each leg ends, why the path ends, or the power with which it ends.
    wavelength : float, metres, optional
        Of phases and of a bench's image. None: that of the trace, if it has one.
    step : float, radians
        Phase step, see `reference`.
    surfaces : {"interface", "name"}
        What surfaces are coloured by.
    relief : str, optional
        Name of a surface to be coloured by its z.
    image : (rows, columns) array-like, optional
        What the CCD shows, such as its interferogram.
    most : int
        Rays to draw; of more a fixed sample is drawn, and the picture says so.
    every : bool, optional
        Draw all paths, also those that do not reach the CCD. None: only to colour them by fate.
    reference : str or Mark, optional
        Surface (or `arms.Mark`) whose light a phase step turns. None: all light, or what the bench says.
    explode : float, or (3,) metres
        Shift of legs from bounce to bounce: the vector, or so many times one that parts them well.
    upto : int, optional
        Draw light only up to the surface after so many.
    clip : (normal, origin), optional
        Plane; what is on the side that the normal points to is not drawn. Metres.
    tubes : float, metres
        Radius of rays drawn as tubes; 0: lines.
    sweep : int
        Wavelengths at which phases are found.

    Returns
    -------
    View

    Raises
    ------
    ValueError
        If the paths have no recorded points, a name or a way of colouring is unknown, the image does not fit.
    """
    checked_colouring(colour, None)
    if isinstance(scene, Interferometer):
        paths = scene.sampled(few(scene.beam.shape), wavelength) if paths is None else paths
        reference = scene.arms.reference if reference is None else reference
        if image is None and wavelength is not None and sweep == 1:
            image = scene.interferogram(wavelength, step=step)
        scene = scene.scene
    parts = [paths] if isinstance(paths, Paths) else list(paths or [])
    shown = None
    if parts:
        mark = Mark(scene.index(reference)) if isinstance(reference, str) else reference
        shown = strands(
            parts, wavelength, most=most, every=colour == "fate" if every is None else every, reference=mark,
            sweep=sweep, onward=ONWARD * scene_size(scene),
        )  # fmt: skip
        checked_colouring(colour, shown)
    stage = lay_out(scene, parts, shown, image=image, surfaces=surfaces, relief=relief)
    plane = None if clip is None else tuple(np.asarray(part, dtype=np.float64) for part in clip)
    return View(stage, shown, colour, step, None, upto, _shift(explode, shown), tubes, plane)  # type: ignore[arg-type]


def _shift(explode: float | npt.ArrayLike, shown: Strands | None) -> FloatArray:
    """From bounce to bounce, metres."""
    shift = np.asarray(explode, dtype=np.float64)
    if shift.ndim == 0 and shown is not None:
        shift = shift * apart(shown) if shift else np.zeros(3)
    return np.asarray(np.broadcast_to(shift, 3), dtype=np.float64)


def picture(
    scene: Scene | Interferometer,
    paths: Several | Callable[[], Several],
    path: str | os.PathLike[str],
    *,
    size: tuple[int, int] = (1600, 1000),
    **looks: Unpack[Looks],
) -> None:
    """Write a PNG picture of a scene, drawn off-screen in a separate process.

    Parameters
    ----------
    scene : Scene or Interferometer
    paths : as in `scene_view`; or callable
        A function that gives them is called while VTK is loaded.
    path : path
    size : (width, height), pixels
    **looks
        Colours and the like, see `scene_view`.

    Raises
    ------
    RuntimeError
        If there are no OpenGL libraries (says which packages to install), or VTK fails.
    ValueError
        As `scene_view`.
    """
    written(lambda: scene_view(scene, paths() if callable(paths) else paths, **looks), path, size)


def show(
    scene: Scene | Interferometer,
    paths: Several = None,
    *,
    size: tuple[int, int] = (1600, 1000),
    **looks: Unpack[Looks],
) -> None:
    """Show a scene in a window, with sliders, a clipping plane and rays to click on.

    Parameters
    ----------
    scene : Scene or Interferometer
    paths : as in `scene_view`
    size : (width, height), pixels
    **looks
        Colours and the like, see `scene_view`.

    Raises
    ------
    RuntimeError
        As `picture`; if there is no display.
    ValueError
        As `scene_view`.
    """
    open_window(_interactive(scene, paths, looks), size)


def page(
    scene: Scene | Interferometer,
    paths: Several,
    path: str | os.PathLike[str],
    *,
    title: str = "fringetrace",
    **looks: Unpack[Looks],
) -> None:
    """Write an interactive HTML page of a scene: one file that needs neither network nor server.

    Parameters
    ----------
    scene : Scene or Interferometer
    paths : as in `scene_view`
    path : path
    title : str
    **looks
        What it begins with, see `scene_view`; clipping and tubes are for pictures and windows.

    Raises
    ------
    ImportError
        If plotly is missing; says what to install.
    ValueError
        As `scene_view`.
    """
    html.write_page(_interactive(scene, paths, looks), path, title)


def export(
    scene: Scene | Interferometer, paths: Several, path: str | os.PathLike[str], **looks: Unpack[Looks]
) -> None:
    """Export surfaces and rays as .glb, .ply or .vtp, in metres.

    Parameters
    ----------
    scene : Scene or Interferometer
    paths : as in `scene_view`
    path : path
        Its suffix says the kind, see `exports.write_view`.
    **looks
        Colours and the like, see `scene_view`.

    Raises
    ------
    ValueError
        As `scene_view`; for another suffix.
    """
    formats.write_view(scene_view(scene, paths, **looks), path)


def _interactive(scene: Scene | Interferometer, paths: Several, looks: Looks) -> View:
    """A view with phases at many wavelengths, and of a bench with an image for each phase step."""
    found = scene_view(scene, paths, sweep=SWEEP, **looks)
    frames, wavelength = None, looks.get("wavelength")
    if isinstance(scene, Interferometer) and looks.get("image") is None and wavelength is not None:
        frames = _binned(scene.phase_steps(wavelength, STEPS))
    panels = [
        panel if panel.name != "CCD" else replace(panel, image=_shown(panel.image, frames))
        for panel in found.stage.panels
    ]
    return replace(found, stage=replace(found.stage, panels=tuple(panels)), frames=frames)


def _shown(image: FloatArray | None, frames: FloatArray | None) -> FloatArray | None:
    """What the CCD shows at first."""
    if frames is not None:
        return np.asarray(frames[0], dtype=np.float64)
    return None if image is None else np.asarray(_binned(image[None])[0], dtype=np.float64)


def _binned(images: FloatArray) -> FloatArray:
    """Images of at most `PIXELS` a side: means over blocks of pixels."""
    for axis in (1, 2):
        count = images.shape[axis]
        edges = np.unique(np.linspace(0, count, min(count, PIXELS), endpoint=False).astype(int))
        size = np.diff(edges, append=count).reshape([-1 if at == axis else 1 for at in range(3)])
        images = np.add.reduceat(images, edges, axis=axis) / size
    return images
