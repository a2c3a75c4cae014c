"""
Layers of film between two polarisers
=====================================

Film that delays one polarisation by 220 nm lies one to eight layers thick between polarisers: if they are
crossed, sin^2 of half the retardance passes of each wavelength, and all the rest if they are parallel.
"""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.scattering import colour
from fringetrace.views.plots import colour_plots

delay, layers = 220 * nm, np.arange(1, 9)
waves = np.arange(400, 701, 5) * nm
square, wide = ft.shapes.plate(1 * mm, 1 * mm), ft.shapes.plate(8 * mm, 1 * mm)
films = [
    ft.Surface(
        square.moved(((count - 4.5) * mm, 0, 0)),
        ft.polarisers.wave_plate((1, 1, 0), count * delay / (550 * nm), design=550 * nm),
        f"{count} layers",
    )
    for count in layers
]
beam = ft.Beam((0, 0, -1 * mm), (0, 0, 1), (0, 1, 0), (8 * mm, 1 * mm), (1, 8), polarisation=(-1, 0))
ccd = ft.CCD((0, 0, 2 * mm), (0, 0, -1), (0, 1, 0), 1 * mm, (1, 8))  # a pixel for each number of layers

figure = Figure(figsize=(10, 6), layout="constrained")
*strips, curves = figure.subplots(3, 1, height_ratios=(1, 1, 3))
crossed = np.sin(np.pi * layers[:, None] * delay / waves) ** 2
for strip, (name, axis) in zip(strips, {"crossed": (0, 1, 0), "parallel": (1, 0, 0)}.items(), strict=True):
    second = ft.Surface(wide.moved((0, 0, 1 * mm)), ft.polarisers.Polariser(axis), "second polariser")
    scene = ft.Scene([*films, second])
    images = [
        ft.irradiance(ft.trace(scene, beam, ccd, wavelength=wavelength), wavelength, method="rays")
        for wavelength in waves
    ]
    passed = np.array(images)[:, 0].T  # layers, wavelength
    expected = crossed if name == "crossed" else 1 - crossed
    print(f"{name}: off the closed form by {abs(passed - expected).max():.1e} at most")
    colour_plots.swatches(colour.xyz(passed, waves), layers, strip)
    strip.set(title=f"{name} polarisers, number of layers below")
    strip.set_aspect("auto")
    if name == "crossed":
        colour_plots.coloured_spectra(
            passed[[0, 2, 5]], waves, curves, labels=["1 layer", "3 layers", "6 layers"]
        )
curves.set(ylabel="part that passes, crossed", ylim=(-0.08, 1.3))
curves.legend(loc="upper right", ncols=3)
ft.views.save(figure, "11_polarisers.png")
