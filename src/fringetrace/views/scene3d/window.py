"""Interactive window of a scene: sliders that re-phase the rays, a clipping plane, ray picking."""

from __future__ import annotations

import pickle
import sys
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fringetrace.core import nm
from fringetrace.views.scene3d.describe import describe_polyline
from fringetrace.views.scene3d.layout import apart
from fringetrace.views.scene3d.palette import WAYS
from fringetrace.views.scene3d.vtk import Plotter, View, chip, clip_plane, draw, draw_rays, empty, path_lines

HELP = "right click on a ray: its path;  c: colours;  p: clipping plane;  r: whole scene;  q: close"
# Where sliders are: their left and right ends, from below; parts of the window.
LEFT, RIGHT, LOWEST, APART = 0.72, 0.97, 0.08, 0.11


@dataclass(eq=False)
class Window:
    """View that sliders change without a new trace.

    Parameters
    ----------
    view : View
        What is seen now.
    plotter : pyvista.Plotter
    rays, pixels : pyvista.PolyData or None
        What is drawn of them.
    picked : int
        Number of the strand that was clicked on; -1: none.
    planes : list
        The clipping plane's widget, while there is one.
    """

    view: View
    plotter: Plotter
    rays: Any
    pixels: Any = None
    picked: int = -1
    planes: list[Any] = field(default_factory=list)

    def changed(self, **parts: Any) -> None:
        """Redraw rays after a change of the view.

        Parameters
        ----------
        **parts
            Of `View`.
        """
        self.view = replace(self.view, **parts)
        if self.rays is not None:
            self.rays.copy_from(path_lines(self.view))
        if "step" in parts and self.view.frames is not None and self.pixels is not None:
            count = len(self.view.frames)
            frame = self.view.frames[round(self.view.step * count / (2.0 * np.pi)) % count]
            self.pixels.cell_data["image"] = frame.ravel()
        if self.picked >= 0:
            self.pick(self.picked)

    def recoloured(self, colour: str) -> None:
        """Recolour rays, with a new legend.

        Parameters
        ----------
        colour : str
            As in `hues.scale`.
        """
        for name in [name for name in self.plotter.actors if name.startswith("ray ")]:
            self.plotter.remove_actor(name)
        for title in list(self.plotter.scalar_bars.keys()):
            if not title.startswith("height"):
                self.plotter.remove_scalar_bar(title)
        self.view = replace(self.view, colour=colour)
        self.rays = draw_rays(self.plotter, self.view)

    def next_colour(self) -> None:
        """Recolour rays by the next colouring."""
        strands = self.view.strands
        ways = [way for way in WAYS if way != "phase" or (strands is not None and len(strands.wavelengths))]
        self.recoloured(ways[(ways.index(self.view.colour) + 1) % len(ways)])

    def wavelength(self, value: float) -> None:
        """Set the wavelength in nm: the nearest for which phases are known."""
        strands = self.view.strands
        assert strands is not None
        self.changed(wavelength=int(np.argmin(np.abs(strands.wavelengths / nm - value))))

    def step(self, value: float) -> None:
        """Set the phase step in degrees."""
        self.changed(step=float(np.radians(value)))

    def upto(self, value: float) -> None:
        """Show light only up to the surface after so many."""
        self.changed(upto=round(value))

    def explode(self, value: float) -> None:
        """Separate segments by so many times the standard displacement."""
        assert self.view.strands is not None
        self.changed(shift=value * apart(self.view.strands))

    def pick(self, number: int) -> None:
        """Show a path in black, and its description.

        Parameters
        ----------
        number : int
            Of the strand.
        """
        shown = self.view.strands
        assert shown is not None
        self.picked = number
        text = describe_polyline(shown, number, self.view.wavelength, self.view.step)
        note = self.plotter.add_text(
            text,
            position=(0.01, 0.03),
            viewport=True,
            color="black",
            font_size=8,
            name="path",
            font="courier",
        )
        note.prop.background_color, note.prop.background_opacity = "white", 0.85
        data = path_lines(self.view)
        mine = np.flatnonzero(np.asarray(data.cell_data["strand"]) == number)
        if len(mine):
            self.plotter.add_mesh(
                data.extract_cells(mine.tolist()), color="black", line_width=5.0, name="picked",
                pickable=False, reset_camera=False,
            )  # fmt: skip

    def clicked(self, picker: Any) -> None:
        """Handle a mouse pick.

        Parameters
        ----------
        picker : vtkCellPicker
        """
        if picker.GetDataSet() is not None and picker.GetCellId() >= 0 and self.rays is not None:
            strand = np.asarray(self.rays.cell_data["strand"])
            if picker.GetCellId() < len(strand):
                self.pick(int(strand[picker.GetCellId()]))

    def toggle_plane(self) -> None:
        """Show or remove the clipping plane."""
        if self.planes:
            self.planes.pop()
            self.plotter.clear_plane_widgets()
            clip_plane(self.plotter, None, None)
            return

        def moved(normal: Any, origin: Any) -> None:
            clip_plane(self.plotter, np.asarray(normal), np.asarray(origin))

        self.planes.append(self.plotter.add_plane_widget(moved, normal="-y", color="#606060"))


def furnish(view: View, plotter: Plotter) -> Window:
    """Plotter of a view with all its sliders and keys.

    Parameters
    ----------
    view : View
    plotter : pyvista.Plotter
        With nothing in it.

    Returns
    -------
    Window
    """
    window = Window(view, plotter, draw(plotter, view))
    if view.frames is not None:
        chips = [panel for panel in view.stage.panels if panel.image is not None]
        window.pixels = chip(chips[0], view.stage.metres)
        plotter.add_mesh(
            window.pixels, scalars="image", cmap="gray", clim=(0.0, float(view.frames.max()) or 1.0),
            name="image", lighting=False, show_scalar_bar=False, pickable=False, copy_mesh=False,
            reset_camera=False,
        )  # fmt: skip
    plotter.add_text(HELP, position=(0.3, 0.01), viewport=True, color="#404040", font_size=9, name="help")
    _sliders(window)
    plotter.add_key_event("c", window.next_colour)
    plotter.add_key_event("p", window.toggle_plane)
    plotter.enable_point_picking(
        lambda _, picker: window.clicked(picker), picker="cell", use_picker=True, show_message=False,
        show_point=False, tolerance=0.005,
    )  # fmt: skip
    return window


def _sliders(window: Window) -> None:
    """Those that there is something to choose with."""
    shown = window.view.strands
    if shown is None or not len(shown):
        return
    most = int(shown.bounces.max())
    known = shown.wavelengths / nm
    wanted: list[tuple[str, Any, float, float, float, str]] = []
    if len(known):
        wanted.append(
            ("phase step, degrees", window.step, 0.0, 360.0, float(np.degrees(window.view.step)), "%.0f")
        )
    if len(known) > 1:
        at = float(known[shown.chosen])
        wanted.append(("wavelength, nm", window.wavelength, float(known[0]), float(known[-1]), at, "%.0f"))
    if most > 0:
        start = most if window.view.upto is None else window.view.upto
        wanted.append(("surfaces met, up to", window.upto, 0.0, float(most), float(start), "%.0f"))
        wanted.append(("explode", window.explode, 0.0, 1.0, float(window.view.shift.any()), "%.2f"))
    for row, (title, act, low, high, value, digits) in enumerate(wanted):
        height = LOWEST + APART * row
        window.plotter.add_slider_widget(
            act, (low, high), value=value, title=title, pointa=(LEFT, height), pointb=(RIGHT, height),
            color="black", style="modern", title_height=0.018,
            slider_width=0.02, tube_width=0.008,
            fmt=digits, interaction_event="always",
        )  # fmt: skip


def receive() -> None:
    """Open a window with the view on standard input; runs in a separate process."""
    plotter = empty((400, 300), off_screen=False)
    view, plotter.window_size = pickle.load(sys.stdin.buffer)
    furnish(view, plotter)
    plotter.show()
