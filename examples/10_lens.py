"""
Three lenses in a Twyman-Green interferometer
=============================================

A singlet, the same turned round, and an achromat, from catalogue data. A ball about their focus sends the
light back; what is left of the fringes is their spherical aberration.
"""

import math
from dataclasses import replace

from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.instruments import lenses

wavelength, aperture, ball = 632.8 * nm, 12 * mm, 50 * mm
bk7 = float(ft.materials.BK7.index(wavelength).real)
sf5 = 1.66846  # SCHOTT SF5
glass = ft.Dielectric(follow="transmitted")
CATALOGUE = {  # radii, thicknesses, glasses; all of them 25.4 mm across, f = 100 mm
    "convex first": ((51.68 * mm, math.inf), (4 * mm,), (bk7,)),
    "flat first": ((math.inf, -51.68 * mm), (4 * mm,), (bk7,)),
    "achromat": ((62.8 * mm, -45.7 * mm, -128.2 * mm), (4 * mm, 2.5 * mm), (bk7, sf5)),
}

panels = Figure(figsize=(13, 4), layout="constrained").subplots(1, 3)
for ax, (name, (radii, thicknesses, glasses)) in zip(panels, CATALOGUE.items(), strict=True):
    # where light from the rim of the beam, and from next to the axis, cross the axis
    lens = lenses.lens(radii, thicknesses, glasses, 25.4 * mm, interface=glass)
    rays = ft.Rays([(h, 0, -1 * mm) for h in (1e-9, 0.5 * aperture)], [(0, 0, 1)] * 2)
    paths = ft.trace(ft.Scene(lens), rays)
    focus = paths.origin[:, 2] - paths.origin[:, 0] / paths.direction[:, 0] * paths.direction[:, 2]
    shorter = (focus[0] - focus[1]) / mm
    print(
        f"{name}: focus {focus[0] / mm:.3f} mm behind the first vertex, {shorter:.3f} mm shorter at the rim"
    )

    # the ball stands about the middle of both; the camera sees the first vertex of the lens
    centre = (0, 0, -focus.mean())
    mesh, form = ft.shapes.icosphere(ball, 4).moved(centre), ft.forms.Sphere(centre, ball)
    mirror = ft.Surface(mesh, ft.Mirror(), "ball", form)
    bench = ft.instruments.michelson(mirror, aperture=aperture, pixels=(256, 256), rays=1 / 8)
    foot = (0, 0, bench.beam.centre[0])  # of the arm that holds the sample
    lens = lenses.lens(radii, thicknesses, glasses, 25.4 * mm, vertex=foot, axis=(0, 0, -1), interface=glass)
    screen = ft.shapes.plate(4 * aperture, 4 * aperture)
    screen = screen.moved(1.1 * bench.beam.centre, turn=ft.vectors.rotation((0, 1, 0), math.pi / 2))
    isolator = ft.Surface(screen, ft.Absorber(), "isolator")  # nothing gets back into the laser
    bench = replace(bench, scene=ft.Scene([*bench.scene.surfaces, *lens, isolator]))
    image = bench.interferogram(wavelength)
    ft.views.interferogram(image, bench.ccd.pitch, ax, wavelength=wavelength, title=name)
ft.views.save(panels[0], "10_lens.png")
