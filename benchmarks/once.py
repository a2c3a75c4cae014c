"""Once means once: what more light of a traced bench costs beside the first image.

python benchmarks/once.py

A Michelson with a curved sample, 512 x 512 pixels: ratios of CPU time, each bench from its trace on, the
least of some runs. Compiled once before.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable

import numpy as np

import fringetrace as ft
from fringetrace import instruments, mm, nm
from fringetrace.geometry import forms, shapes

HENE, PIXELS, RADIUS = 632.8 * nm, 512, 20.0
WHITE = ft.Spectrum(np.linspace(600, 660, 20) * nm, np.ones(20))


def michelson(rays: float, pixels: int = PIXELS, tilt: float = 2e-4) -> instruments.Interferometer:
    """A hollow mirror of 20 m radius in the arm of the sample, so many rays a pixel along either axis."""
    along = np.linspace(-4 * mm, 4 * mm, 65)
    mesh = shapes.height_map(-(along**2 + along[:, None] ** 2) / (2 * RADIUS), along[1] - along[0])
    sample = ft.Surface(mesh, ft.Mirror(), "sample", form=forms.Conic((0, 0, 0), (0, 0, -1), RADIUS, -1.0))
    return instruments.michelson(
        sample, aperture=6 * mm, pixels=(pixels, pixels), rays=rays, reference_tilt=(tilt, 0.0),
        method="wavefront",
    )  # fmt: skip


def seconds(
    work: Callable[[instruments.Interferometer], object], rays: float, tilt: float, runs: int = 3
) -> float:
    """Least CPU time of some work on a bench that is not traced yet."""
    least = np.inf
    for _ in range(runs):
        bench = michelson(rays, tilt=tilt)
        start = time.process_time()
        work(bench)
        least = min(least, time.process_time() - start)
    return least


def field_and_irradiance(bench: instruments.Interferometer) -> None:
    """Both, at one wavelength."""
    bench.field(HENE)
    bench.interferogram(HENE)


def image_and_budget(bench: instruments.Interferometer) -> None:
    """An interferogram and then its budget."""
    bench.interferogram(HENE)
    bench.budget(HENE)


def main() -> None:
    """Print the table."""
    warnings.simplefilter("ignore", ft.FringetraceWarning)
    for work in (field_and_irradiance, image_and_budget, lambda bench: bench.interferogram(WHITE)):
        work(michelson(1 / 4, 32))
    print("| rays a pixel | fringes | image, s | 20 wavelengths | field and image | budget |")
    print("|---|---|---|---|---|---|")
    for rays, tilt in ((1 / 4, 2e-4), (1 / 4, 2e-3), (1, 2e-4)):
        runs = 3 if rays < 1 else 1
        image = seconds(lambda bench: bench.interferogram(HENE), rays, tilt, runs)
        white = seconds(lambda bench: bench.interferogram(WHITE), rays, tilt, runs) / image
        both = seconds(field_and_irradiance, rays, tilt, runs) / image
        budget = seconds(image_and_budget, rays, tilt, runs) / image - 1.0
        cycles = 2 * tilt * 6 * mm / PIXELS / HENE
        ratios = f"{white:.2f} | {both:.2f} | {budget:.2f}"
        print(f"| {rays:g} | {cycles:.2g} a pixel | {image:.2f} | {ratios} |", flush=True)


if __name__ == "__main__":
    main()
