"""Lenses in a Twyman-Green interferometer: a singlet, the same turned round, and an achromat, at 632.8 nm."""

import math
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import lenses, mm, nm

wavelength, aperture, ball = 632.8 * nm, 12 * mm, 50 * mm
bk7 = float(ft.materials.BK7.index(wavelength).real)
sf5 = 1.66846  # SCHOTT SF5
glass = ft.Dielectric(follow="transmitted")
CATALOGUE = {  # radii, thicknesses, glasses; all of them 25.4 mm across, f = 100 mm
    "convex first": ((51.68 * mm, math.inf), (4 * mm,), (bk7,)),
    "flat first": ((math.inf, -51.68 * mm), (4 * mm,), (bk7,)),
    "achromat": ((62.8 * mm, -45.7 * mm, -128.2 * mm), (4 * mm, 2.5 * mm), (bk7, sf5)),
}

images = []
for name, (radii, thicknesses, glasses) in CATALOGUE.items():
    # where light from the rim of the beam, and from next to the axis, cross the axis
    lens = lenses.lens(radii, thicknesses, glasses, 25.4 * mm, interface=glass)
    rays = ft.Rays([(h, 0, -1 * mm) for h in (1e-9, 0.5 * aperture)], [(0, 0, 1)] * 2)
    paths = ft.trace(ft.Scene(lens), rays)
    focus = paths.origin[:, 2] - paths.origin[:, 0] / paths.direction[:, 0] * paths.direction[:, 2]

    # a ball about the middle of both sends the light back; the camera sees the first vertex of the lens
    centre = (0, 0, -focus.mean())
    mirror = ft.Surface(
        ft.shapes.icosphere(ball, 4).moved(centre), ft.Mirror(), "ball", form=ft.forms.Sphere(centre, ball)
    )
    bench = ft.instruments.michelson(mirror, aperture=aperture, pixels=(256, 256), rays=1 / 8)
    foot = bench.beam.centre[0] * np.array([0.0, 0.0, 1.0])  # of the arm that holds the sample
    lens = lenses.lens(radii, thicknesses, glasses, 25.4 * mm, vertex=foot, axis=(0, 0, -1), interface=glass)
    stop = ft.shapes.plate(4 * aperture, 4 * aperture).moved(turn=ft.vectors.rotation((0, 1, 0), math.pi / 2))
    stop = ft.Surface(
        stop.moved(1.1 * bench.beam.centre), ft.Absorber(), "isolator"
    )  # nothing gets to the laser
    bench = replace(bench, scene=ft.Scene([*bench.scene.surfaces, *lens, stop]))
    images.append(bench.interferogram(wavelength))
    blur = abs(focus[1] - focus[0]) / mm
    print(f"{name}: focal length {focus[0] / mm:.3f} mm behind the vertex, {blur:.3f} mm shorter at the rim")
panels = Figure(figsize=(13, 4), layout="constrained").subplots(1, 3)
for axes, image, name in zip(panels, images, CATALOGUE, strict=True):
    ft.views.interferogram(image, aperture / 256, axes, wavelength=wavelength, title=name)
ft.views.save(panels[0], "04_lens.png")
