"""
White light in a Michelson, with and without a compensator
==========================================================

The sample's light crosses the glass of the splitter three times, that of the reference once. Glass disperses:
without a second plate of it no place of the image has equal paths for all colours.
"""

import math

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import mm, nm, um
from fringetrace.scattering import colour as spectra
from fringetrace.views.plots import colour_plots

thickness, aperture = 50 * um, 8 * mm  # of the splitter; width of the image
tilt = 0.5e-3  # of the reference, rad
waves = np.arange(400, 701, 4) * nm
n = ft.materials.BK7.index(waves).real
glass = 2 * thickness * (np.sqrt(n**2 - 0.5) - math.sqrt(0.5))  # path of two crossings at 45 degrees
group = glass - waves * np.gradient(glass, waves)  # path of a packet of waves
x = (np.arange(400) - 199.5) * aperture / 400

figure = Figure(figsize=(10, 6), layout="constrained")
*strips, curves = figure.subplots(3, 1, sharex=True, height_ratios=(1, 1, 2))
names = "with a compensator", "without, the reference moved to equal group paths at 550 nm"
for name, strip, colour in zip(names, strips, ("#0072B2", "#D55E00"), strict=True):
    alone = name.startswith("without")
    bench = ft.instruments.michelson(
        ft.shapes.plate(12 * mm, 12 * mm), aperture=aperture, pixels=(4, 400), rays=1 / 4,
        reference_tilt=(tilt, 0), piston=0.5 * np.interp(550 * nm, waves, group) * alone,
        splitter=ft.instruments.SplitterPlate(thickness, "BK7", ghosts=False), compensator=not alone,
    )  # fmt: skip
    images = np.stack([bench.interferogram(wavelength)[2] for wavelength in waves], axis=-1)
    colour_plots.strip(spectra.xyz(images, waves, illuminant="E"), x / mm, strip)
    strip.set_title(name)
    curves.plot(x / mm, images.mean(axis=-1), color=colour, label=name)

    crossing = []
    for wavelength in (450 * nm, 650 * nm):
        seen = bench.trace(wavelength).detected
        by_reference = seen.visits(bench.arms.reference.surface) == 1
        crossing.append(seen.length[~by_reference].mean() - seen.length[by_reference].mean())
    print(
        f"{name}: at 450 nm the paths differ by {(crossing[0] - crossing[1]) / um:.3f} um more than at 650 nm"
    )
low, high = np.interp([450 * nm, 650 * nm], waves, glass)
print(f"without, in closed form: {(low - high) / um:.3f} um")
curves.set(
    xlabel="x / mm",
    ylabel="mean irradiance\nof all wavelengths",
    xlim=(x[0] / mm, x[-1] / mm),
    ylim=(0, 0.85),
)
curves.legend()
ft.views.save(figure, "06_white_light.png")
