"""The pictures of docs/views.md: python docs/figures/views.py."""

from __future__ import annotations

import numpy as np
from pages import DOCS

import fringetrace as ft
from fringetrace import instruments, mm, nm, views
from fringetrace.geometry import shapes

IMAGES = DOCS / "images"


def michelson() -> None:
    """A step in a Michelson: by route, and by phase with legs apart."""
    sample = shapes.step(10 * mm, 10 * mm, 1 * mm, 100 * nm)
    bench = instruments.michelson(sample, aperture=6 * mm, pixels=(48, 64), reference_tilt=(200e-6, 0.0))
    views.picture(bench, None, IMAGES / "views_route.png", wavelength=633 * nm)
    paths = bench.sampled((5, 7))
    views.picture(
        bench, paths, IMAGES / "views_phase.png", wavelength=633 * nm, colour="phase", explode=0.5,
        tubes=0.06 * mm, surfaces="name",
    )  # fmt: skip
    print(views.describe_path(bench.sampled((9, 12)).detected, 5, 633 * nm))


def glass() -> None:
    """Many rays through a ball of glass: a sample of them, by what becomes of them; the ball cut open."""
    ball = ft.Surface(shapes.icosphere(3 * mm, 4), ft.Dielectric(), "ball", back="BK7")
    floor = ft.Surface(shapes.plate(16 * mm, 16 * mm).moved([0, 0, -7 * mm]), ft.Absorber(), "floor")
    beam = ft.Beam([0, 0, 7 * mm], [0, 0, -1], [0, 1, 0], (5 * mm, 5 * mm), (60, 60))
    paths = ft.trace(
        ft.Scene([ball, floor]), beam, wavelength=550 * nm, max_bounces=4, record=True, warn=False
    )
    views.picture(
        paths.scene, paths, IMAGES / "views_fate.png", colour="fate", most=60,
        clip=(np.array([0, -1, 0]), np.array([0, -1 * mm, 0])),
    )  # fmt: skip


if __name__ == "__main__":
    michelson()
    glass()
