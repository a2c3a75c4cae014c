"""VTK in a separate process, which protects this one where OpenGL libraries are missing."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from fringetrace.views.scene3d.vtk import View, draw, empty

# What VTK loads when it draws; without them it takes the interpreter down with it.
PACKAGES = "libegl1 libgl1-mesa-dri"
SECONDS = 120.0
RENDER = "from fringetrace.views.scene3d.subprocess import _render; _render()"
WINDOW = "from fringetrace.views.scene3d.window import received; received()"
TRIAL = "import pyvista; p = pyvista.Plotter(off_screen=True); p.add_mesh(pyvista.Cube()); p.show()"


def child(code: str, sent: Callable[[], bytes] = bytes, seconds: float | None = None) -> None:
    """Draw in a separate process.

    Parameters
    ----------
    code : str
        Python to run there.
    sent : callable
        Gives what comes on its standard input, called while it starts.
    seconds : float, optional
        How long to wait for it; None: `SECONDS`; infinity: as long as it takes.

    Raises
    ------
    RuntimeError
        If it crashes (says which packages to install), fails, or takes too long.
    """
    limit = SECONDS if seconds is None else seconds
    pipe = subprocess.PIPE
    command = [sys.executable, "-P", "-c", code]
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe) as process:
        try:
            _, errors = process.communicate(sent(), timeout=None if limit == float("inf") else limit)
        except subprocess.TimeoutExpired as error:
            raise RuntimeError(f"3D picture: gave up after {limit:g} s") from error
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
    plotter = empty((400, 300))
    view, path, plotter.window_size = pickle.load(sys.stdin.buffer)
    draw(plotter, view)
    plotter.screenshot(path)


def opengl() -> str | None:
    """Whether 3D pictures can be drawn here, tested in a separate process.

    Returns
    -------
    str or None
        None if they can; else why not, and what to install.
    """
    try:
        child(TRIAL)
    except RuntimeError as error:
        return str(error)
    return None


def written(view: Callable[[], View], path: str | os.PathLike[str], size: tuple[int, int]) -> None:
    """Write a PNG picture of a view, atomically.

    Parameters
    ----------
    view : callable
        Gives the view; called while VTK is loaded elsewhere.
    path : path
    size : (width, height), pixels

    Raises
    ------
    RuntimeError
        As `child`.
    """
    target = Path(path)
    with tempfile.TemporaryDirectory(prefix=".fringetrace-", dir=target.parent) as folder:
        part = Path(folder, "scene.png")
        child(RENDER, lambda: pickle.dumps((view(), str(part), size)))
        os.replace(part, target)


def open_window(view: View, size: tuple[int, int]) -> None:
    """Open a window with a view; returns once it is closed.

    Parameters
    ----------
    view : View
    size : (width, height), pixels

    Raises
    ------
    RuntimeError
        As `child`; if there is no display.
    """
    missing = opengl()
    if missing is not None:
        raise RuntimeError(missing)
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise RuntimeError("a window needs a display, and there is none here; try a PNG or HTML file")
    child(WINDOW, lambda: pickle.dumps((view, size)), float("inf"))
