"""A smooth mirror on 1024 x 1024 pixels: the wavefront method beside a ray sum of one ray a pixel.

python benchmarks/wavefront.py   prints, for each: rays, seconds of trace and light, CPU seconds, rms error
"""

from __future__ import annotations

import time

import numpy as np

import fringetrace as ft
from fringetrace import mm, nm

WAVELENGTH = 633 * nm
FOCAL, HEIGHT, SIDE, PIXELS = 50 * mm, 20 * mm, 2 * mm, 1024


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


def main() -> None:
    """Print the table; each is done twice, the second time counts."""
    exact, form = truth(), ft.forms.Conic((0, 0, 0), (0, 0, 1), 2 * FOCAL, -1.0)
    for method, count, surface in (
        ("wavefront", 16, form), ("wavefront", 64, form), ("rays", PIXELS, None), ("rays", PIXELS, form),
    ):  # fmt: skip
        for _ in range(2):
            start, cpu = time.perf_counter(), time.process_time()
            paths = paraboloid(count, surface)
            middle = time.perf_counter()
            image = ft.irradiance(paths, WAVELENGTH, method)
            end, used = time.perf_counter(), time.process_time() - cpu
        error = np.sqrt(np.mean((image - exact) ** 2)) / exact.mean()
        name = f"{method}, {'facets' if surface is None else 'form'}"
        print(f"{name:16} {count**2:9,} rays  trace {middle - start:5.2f} s  light {end - middle:5.2f} s  "
              f"CPU {used:5.2f} s  rms {error:.1e}")  # fmt: skip


if __name__ == "__main__":
    main()
