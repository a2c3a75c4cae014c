"""The pictures of docs/how.md: sheets of light between rays, and bodies of surfaces.

python docs/figures/how.py   writes docs/images/sheets.png and docs/images/bodies.png
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

import fringetrace as ft
from fringetrace import mm, um
from fringetrace.field.wavefront.patches import sheets
from fringetrace.tracing.intersect.embree import build

IMAGES = Path(__file__).parents[1] / "images"
BLUE, ORANGE, GREEN, RED, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#999999"
TIGHT = {"handletextpad": 0.3, "columnspacing": 1.0, "handlelength": 1.2}
RADIUS, TILT = 20 * mm, 0.13  # light that starts at R sin(TILT) touches the caustic at the camera


def bowl(rays: int) -> tuple[ft.Scene, ft.Beam, ft.CCD]:
    """A spherical mirror that looks down on its beam, an absorbing plate over a side of it, a camera."""
    z = RADIUS * np.cos(TILT) * (1 + 2 * np.sin(TILT) ** 2) / 2
    x = np.linspace(-5 * mm, 5 * mm, 65)
    mesh = ft.shapes.height_map(np.sqrt(RADIUS**2 - x[:, None] ** 2 - x**2), x[1] - x[0])
    mirror = ft.Surface(mesh, ft.Mirror(), "mirror", form=ft.forms.Sphere((0, 0, 0), RADIUS))
    plate = ft.Surface(ft.shapes.plate(5 * mm, 9 * mm).moved((3.6 * mm, 0, 1 * mm)), ft.Absorber(), "plate")
    beam = ft.Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (6.8 * mm, 6.8 * mm), (rays, rays))
    ccd = ft.CCD((0, 0, z), (0, 0, 1), (0, 1, 0), 0.5 * um, (400, 400))
    return ft.Scene([mirror, plate]), beam, ccd


def section(axes: Any) -> None:
    """Rays of the middle row, from the beam by the mirror to the camera."""
    scene, _, ccd = bowl(1)
    starts = np.linspace(-3.4 * mm, 3.4 * mm, 35)
    rays = ft.Rays([(x, 0, 0) for x in starts], [(0, 0, 1)] * len(starts))
    paths = ft.trace(scene, rays, max_bounces=1, record=True, warn=False)
    for row in range(len(paths)):
        line = paths.polyline(row)
        if paths.fate[row] == ft.Fate.ABSORBED:
            axes.plot(line[:, 0] / mm, line[:, 2] / mm, color=GREY, linewidth=0.8)
            continue
        camera = line[-1] + paths.direction[row] * (ccd.centre[2] - line[-1, 2]) / paths.direction[row, 2]
        line = np.vstack([line, camera])
        axes.plot(line[:, 0] / mm, line[:, 2] / mm, color=BLUE, linewidth=0.6)
    arc = np.linspace(-0.2, 0.2, 99)
    axes.plot(RADIUS * np.sin(arc) / mm, RADIUS * np.cos(arc) / mm, color="black", linewidth=2)
    axes.plot([1.1, 4.2], [1, 1], color=ORANGE, linewidth=4)
    axes.plot([-1, 1], [ccd.centre[2] / mm] * 2, color=RED, linewidth=3)
    axes.text(0, 20.4, "mirror, a part of a sphere", ha="center")
    axes.text(4.3, 1, "plate", color=ORANGE, va="center")
    axes.text(1.2, ccd.centre[2] / mm, "camera", color=RED, va="center")
    axes.set(xlim=(-5, 6), ylim=(-0.5, 21.5), xlabel="x / mm", ylabel="z / mm", title="rays, from below")


def grid(axes: Any) -> None:
    """The beam's grid; each ray has the colour of what it met."""
    scene, beam, ccd = bowl(24)
    paths = ft.trace(scene, beam, ccd, max_bounces=1, warn=False)
    reflected = np.zeros(24 * 24, dtype=bool)
    reflected[paths.ray[paths.fate != ft.Fate.ABSORBED]] = True
    centres = (np.arange(24) - 11.5) * 6.8 / 24
    x, y = (each.ravel() for each in np.meshgrid(-centres, centres))  # columns run along normal x up: -x
    for which, colour, name in ((reflected, BLUE, "mirror"), (~reflected, GREY, "plate")):
        axes.scatter(x[which], y[which], color=colour, s=14, label=f"met the {name}")
    edge = 0.5 * (x[reflected].max() + x[~reflected].min())
    axes.axvspan(edge - 0.142, edge + 0.142, color=ORANGE, alpha=0.35, label="cells on an edge")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), frameon=False, ncols=3, **TIGHT)
    axes.set(xlabel="x / mm", ylabel="y / mm", title="the beam's grid", aspect="equal")


def folded(axes: Any) -> None:
    """The same cells where they arrive: a sheet, folded along the caustic."""
    scene, beam, ccd = bowl(72)
    (sheet,) = sheets(ft.trace(scene, beam, ccd, max_bounces=1, record=True, warn=False))
    x, y = (200 - sheet.x) * 0.5, (sheet.y - 200) * 0.5
    for turned, colour, label in (
        (False, BLUE, "has passed no caustic"),
        (True, ORANGE, "has passed the caustic"),
    ):
        shown = (sheet.turns > 0) == turned
        u, v = np.where(shown, x, np.nan), np.where(shown, y, np.nan)
        lines = [axes.plot(a, b, color=colour, linewidth=0.6) for a, b in ((u, v), (u.T, v.T))]
        lines[0][0].set_label(label)
    around = np.linspace(0, 2 * np.pi, 361)
    caustic = RADIUS * np.sin(TILT) ** 3 / um
    axes.plot(
        caustic * np.cos(around), caustic * np.sin(around), color="black", linewidth=1.5, label="caustic"
    )
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), frameon=False, ncols=3, **TIGHT)
    axes.set(xlim=(-60, 60), ylim=(-60, 60), aspect="equal", xlabel="x / µm", ylabel="y / µm")
    axes.set_title("the same sheet on the camera")


def parts() -> dict[str, ft.Mesh]:
    """A ball that stands on a floor, rods beside each other, a window above."""
    floor = ft.shapes.plate(30 * mm, 8 * mm, 1.5 * mm)
    ball, rod = ft.shapes.icosphere(3.8 * mm, 3), ft.shapes.rod_lattice(1, 1, 1 * mm, 4 * mm, 6 * mm)
    top = floor.bounds[1, 2]
    found = {"floor": floor, "ball": ball.moved((-8 * mm, 0, top - ball.bounds[0, 2]))}
    for number in range(4):
        found[f"rod {number + 1}"] = rod.moved((1.5 * mm + 3.6 * mm * number, 0, top + 3 * mm))
    found["window"] = ft.shapes.plate(26 * mm, 8 * mm, 2 * mm).moved((0, 0, 15 * mm))
    return found


def bodies(axes: Any) -> None:
    """A section of some surfaces, coloured by body, with the box that float32 sees of each body."""
    meshes = parts()
    scene = ft.Scene([ft.Surface(mesh, ft.Mirror(), name) for name, mesh in meshes.items()])
    for body, colour in zip(build(scene).bodies, (BLUE, RED, GREEN, ORANGE), strict=False):
        corner, size = body.frame[:3] - 1 / body.frame[3], 2 / body.frame[3]
        axes.add_patch(
            Rectangle(corner[[0, 2]] / mm, size / mm, size / mm, fill=False, ls="--", color=colour, lw=1.2)
        )
        for surface in body.surfaces:
            mesh = scene.surfaces[surface].mesh
            axes.fill(*outline(mesh).T / mm, color=colour, alpha=0.9)
            x, _, z = mesh.bounds.mean(axis=0) / mm
            name = scene.surfaces[surface].name.replace("rod ", "")
            axes.text(x, z, name, ha="center", va="center", color="white")
    axes.set(aspect="equal", xlabel="x / mm", ylabel="z / mm", title="bodies, and their boxes")
    axes.autoscale_view()


def outline(mesh: ft.Mesh) -> np.ndarray:
    """Convex outline of a mesh seen along y."""
    from scipy.spatial import ConvexHull

    flat = mesh.vertices[:, [0, 2]]
    return flat[ConvexHull(flat).vertices]


def save(figure: Figure, name: str) -> None:
    """Write a picture, whole or not at all."""
    part = IMAGES / f"{name}.part"
    figure.savefig(part, format="png", dpi=110)
    part.replace(IMAGES / f"{name}.png")


if __name__ == "__main__":
    figure = Figure(figsize=(14, 5.4), layout="constrained")
    section_axes, grid_axes, sheet_axes = figure.subplots(1, 3)
    section(section_axes), grid(grid_axes), folded(sheet_axes)
    save(figure, "sheets")
    figure = Figure(figsize=(6, 6), layout="constrained")
    bodies(figure.subplots())
    save(figure, "bodies")
