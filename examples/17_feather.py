"""
A peacock's lattices, rigorously
================================

Melanin rods in keratin are smaller than a wavelength: rays are no answer there, exact multiple scattering is.
Four lattices, sized as in the barbules of four colours, have a band each, near Bragg's.
"""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import nm
from fringetrace.scattering import RodLattice, colour, lattice_validity, rod_studies
from fringetrace.views.plots import colour_plots

waves = np.arange(400, 701, 5) * nm
# barbule: period along the normal, pitch along a row, rod diameter (nm), layers
BARBULES = {
    "blue": (140, 140, 101, 10),
    "green": (150, 150, 108, 10),
    "yellow": (165, 165, 119, 6),
    "brown": (185, 150, 108, 4),
}

curves, labels = [], []
for name, (period, pitch, diameter, layers) in BARBULES.items():
    lattice = RodLattice(
        rows=layers, radius=0.5 * diameter * nm, pitch=pitch * nm, spacing=period * nm,
        arrangement="square", rod="melanin", host="keratin", cortex=100 * nm,
    )  # fmt: skip
    reflectance = rod_studies.specular(lattice, [0.0], waves).values[0]
    curves.append(reflectance)
    labels.append(f"{layers} layers, {period} nm apart")
    part = np.pi * diameter**2 / (4 * period * pitch)  # of the section that is melanin
    melanin, keratin = (
        medium.index(500 * nm).real for medium in (ft.materials.MELANIN, ft.materials.KERATIN)
    )
    bragg = 2 * (part * melanin + (1 - part) * keratin) * period
    band = waves[reflectance.argmax()] / nm
    print(f"{name}: {labels[-1]}: band at {band:.0f} nm; Bragg, 2 * mean index * period: {bragg:.0f} nm")
print("rays there:", lattice_validity(lattice, 500 * nm))

figure = Figure(figsize=(9, 6), layout="constrained")
colours, panel = figure.subplots(2, 1, height_ratios=(1, 4))
seen = colour.xyz(np.array(curves), waves)
colour_plots.swatches(3 * seen, labels, colours)
colours.set_title("colours in daylight, three times as bright")
colours.set_aspect("auto")
colour_plots.coloured_spectra(curves, waves, panel, labels=labels)
ft.views.save(figure, "17_feather.png")
