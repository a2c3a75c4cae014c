"""
A cell in a Mach-Zehnder interferometer
=======================================

A ball of 8 um radius with a denser nucleus, in water. Light is bent at its faces, and the camera refocuses
it; phase steps give the optical path that the cell adds.
"""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import nm, um

wavelength, water, cytoplasm, nucleus = 633 * nm, 1.335, 1.37, 1.40
outer, inner, aside = 8 * um, 3 * um, (2 * um, 1 * um, 0)
ball, small = ft.forms.Sphere((0, 0, 0), outer), ft.forms.Sphere(aside, inner)
meshes = ft.shapes.icosphere(outer, 4), ft.shapes.icosphere(inner, 4).moved(aside)
through = ft.Dielectric(follow="transmitted")
cell = [
    ft.Surface(meshes[0], through, "cell", form=ball, front=water, back=cytoplasm),
    ft.Surface(meshes[1], through, "nucleus", form=small, front=cytoplasm, back=nucleus),
]
bench = ft.instruments.mach_zehnder(
    cell, aperture=20 * um, medium=water, na=0.8, reference_tilt=(0.08, 0), pixels=(120, 120), rays=4,
    method="rays",
)  # fmt: skip
image = bench.interferogram(wavelength)
path = bench.path_difference(wavelength)
path -= np.nanmedian(path[:5])  # nothing but water there

at = (np.arange(120) - 59.5) * bench.ccd.pitch
row, middle = (np.argmin(abs(at - aside[axis])) for axis in (1, 0))
squares = outer**2 - at**2 - at[row] ** 2, inner**2 - (at - aside[0]) ** 2
chords = 2 * np.sqrt(np.maximum(squares, 0))
straight = (cytoplasm - water) * chords[0] + (nucleus - cytoplasm) * chords[1]
through_nucleus = path[row, middle] / nm, straight[middle] / nm
print("through the nucleus: {:.1f} nm; straight through: {:.1f} nm".format(*through_nucleus))

figure = Figure(figsize=(15, 4.4), layout="constrained")
figure.get_layout_engine().set(w_pad=0.15)  # inches
fringes, map, section = figure.subplots(1, 3)
ft.views.interferogram(image, bench.ccd.pitch, fringes, wavelength=wavelength)
ft.views.height(path, bench.ccd.pitch, map, title="optical path added")
map.images[0].colorbar.set_label("optical path / nm")
section.plot(at / um, path[row] / nm, color="#0072B2", label="phase steps")
section.plot(at / um, straight / nm, ":", color="#D55E00", label="straight through")
section.set(xlabel="x / µm", ylabel="optical path / nm", title="section, y = 1 µm")
section.legend()
ft.views.save(figure, "08_cell.png")
