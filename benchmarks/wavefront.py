"""A smooth mirror on 1024 x 1024 pixels: the wavefront method beside a ray sum of one ray a pixel.

python benchmarks/wavefront.py           print the table
python benchmarks/wavefront.py --write   and write its section of docs/accuracy.md
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

import fringetrace as ft
from fringetrace import mm, nm

sys.path.insert(0, str(Path(__file__).parents[1] / "docs" / "figures"))
import pages

WAVELENGTH = 633 * nm
FOCAL, HEIGHT, SIDE, PIXELS = 50 * mm, 20 * mm, 2 * mm, 1024

SECTION = """## A million pixels

A paraboloid is seen 30 mm before its focus on 1024 x 1024 pixels (`benchmarks/wavefront.py --write`). The
ray sum has one ray per pixel, and squares the concentration of light, see above.

"""


def paraboloid(count: int, form: ft.forms.Form | None) -> ft.Paths:
    """Rays off a paraboloid, seen 30 mm before its focus."""
    x = np.linspace(-3 * mm, 3 * mm, 65)
    mesh = ft.shapes.height_map((x[:, None] ** 2 + x**2) / (4 * FOCAL), x[1] - x[0])
    beam = ft.Beam((0, 0, 30 * mm), (0, 0, -1), (0, 1, 0), (3.6 * mm, 3.6 * mm), (count, count))
    ccd = ft.CCD((0, 0, HEIGHT), (0, 0, -1), (0, 1, 0), SIDE / PIXELS, (PIXELS, PIXELS))
    return ft.trace(ft.Scene([ft.Surface(mesh, ft.Mirror(), form=form)]), beam, ccd)


def truth() -> np.ndarray:
    """Irradiance of a spherical wave, averaged over the pixels by 4 x 4 Gauss points."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    x = ((np.arange(PIXELS)[:, None] + 0.5 + 0.5 * nodes).ravel() - 0.5 * PIXELS) * SIDE / PIXELS
    rho, depth = np.hypot(x, x[:, None]), FOCAL - HEIGHT
    angle = np.arctan2(rho, depth)
    grow = FOCAL / np.cos(angle / 2) ** 2 * depth / (rho**2 + depth**2)
    bright = (2 * FOCAL * np.tan(angle / 2) / rho * grow).reshape(PIXELS, 4, PIXELS, 4)
    return np.einsum("iajb,a,b->ij", bright, weights / 2, weights / 2)


def row(method: str, count: int, form: ft.forms.Form | None, exact: np.ndarray) -> str:
    """A method's row of the table; it runs twice, the second time counts."""
    for _ in range(2):
        start, cpu = time.perf_counter(), time.process_time()
        paths = paraboloid(count, form)
        middle = time.perf_counter()
        image = ft.irradiance(paths, WAVELENGTH, method)
        end, used = time.perf_counter(), time.process_time() - cpu
    error = np.sqrt(np.mean((image - exact) ** 2)) / exact.mean()
    name = f"{method}, {'facets' if form is None else 'form'}"
    seconds = f"{middle - start:.2f} | {end - middle:.2f} | {used:.2f}"
    return f"| {name} | {count**2:,} | {seconds} | {error:.1e} |"


def main() -> None:
    """Print the table; write the section if asked to."""
    exact, form = truth(), ft.forms.Conic((0, 0, 0), (0, 0, 1), 2 * FOCAL, -1.0)
    lines = [
        "| method | rays | trace, s | light, s | CPU, s | irradiance error, rms |",
        "|---|---|---|---|---|---|",
    ]
    for method, count, surface in (
        ("wavefront", 16, form), ("wavefront", 64, form), ("rays", PIXELS, None), ("rays", PIXELS, form),
    ):  # fmt: skip
        lines.append(row(method, count, surface, exact))
        print(lines[-1], flush=True)
    if "--write" in sys.argv[1:]:
        pages.write("megapixel", SECTION + "\n".join(lines))


if __name__ == "__main__":
    main()
