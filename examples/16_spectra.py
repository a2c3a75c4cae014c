"""
The spectra of the study's lattice, done again
==============================================

Mirror rods of 65 nm at a pitch of 280 nm, between seven directions of light and seven of a pixel: 49 spectra.
The feather's bands at 445 and 525 nm are not among the peaks; orders of the pitch and one Bragg line are.
"""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import degree, nm, um
from fringetrace.scattering import goniometer

rods = ft.scattering.RodLattice(columns=20, rows=4, radius=65 * nm, pitch=280 * nm)
theta, waves, width = np.arange(-60, 61, 20) * degree, np.arange(300, 701) * nm, 5.6 * um


def source(theta, phi):
    """2000 rays side by side, 200 um away, that the lattice is lit with."""
    towards, aside = np.array([[np.sin(theta), 0, np.cos(theta)], [np.cos(theta), 0, -np.sin(theta)]])
    start = 200 * um * towards + np.outer(np.linspace(-0.5, 0.5, 2000) * width, aside)
    return ft.Rays(start, np.tile(-towards, (2000, 1)))


pixels = goniometer.Pixels(theta, distance=250 * um, width=width)
sums = [
    goniometer.amplitudes(rods.scene, theta, pixels, waves, source=source, max_reflections=most)
    for most in (None, 1)
]
every, once = (np.abs(table.values)[:, 0, :, 0] for table in sums)  # from, to, wavelength
print(f"-60 to -60 degrees: peak at {waves[every[0, 0].argmax()] / nm:.0f} nm, "
      f"order of the pitch at 2 * 280 nm * sin 60 = {560 * np.sin(60 * degree):.0f} nm")  # fmt: skip
line = 400 + once[3, 3, 100:].argmax()
print(f"0 to 0 degrees, one reflection: peak at {line} nm; rows 280 nm apart: 560 nm")

figure = Figure(figsize=(13, 9), layout="constrained")
panels = figure.subplots(7, 7, sharex=True, sharey=True)
for i, o in np.ndindex(7, 7):
    ax = panels[i, o]
    ax.plot(waves / nm, every[i, o], color="#0072B2", linewidth=1, label="all reflections")
    ax.plot(waves / nm, once[i, o], ":", color="#D55E00", linewidth=1, label="one reflection")
    ax.vlines(
        (445, 525), 0, 450, color="#999999", linestyle="--", linewidth=0.7, label="bands of the feather"
    )
    ax.set(xlim=(300, 700), ylim=(0, 450))
    if i == 0:
        ax.set_title(f"to {theta[o] / degree:.0f}°", fontsize="medium")
    if o == 0:
        ax.set_ylabel(f"from {theta[i] / degree:.0f}°")
figure.supxlabel("wavelength / nm")
figure.supylabel("|sum over rays|")
figure.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=3)
ft.views.save(figure, "16_spectra.png")
