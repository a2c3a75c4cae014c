"""
White light in a Michelson, with and without a compensator
==========================================================

The light that goes down to the sample crosses the splitter's glass three times, that of the reference once.
Glass disperses: without a second plate of it no place of the image has equal paths for all colours.
"""

import math

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import mm, nm, um

thickness, tilt, aperture = 20 * um, 1.2e-3, 8 * mm  # of a pellicle; rad; width of the image
wavelengths = np.arange(400, 701, 10) * nm
flat = ft.shapes.plate(12 * mm, 12 * mm)
n = ft.materials.BK7.index(550 * nm).real
extra = 2 * thickness * (math.sqrt(n**2 - 0.5) - math.sqrt(0.5))  # of two crossings at 45 degrees

colours, visible = {}, {}
for name, compensator, piston in (("compensator", True, 0.0), ("no compensator", False, 0.5 * extra)):
    bench = ft.instruments.michelson(
        flat, aperture=aperture, reference_tilt=(tilt, 0), piston=piston, pixels=(60, 480), rays=1 / 10,
        splitter=ft.instruments.SplitterPlate(thickness, "BK7", ghosts=False), compensator=compensator,
    )  # fmt: skip
    mutual = np.array([bench.mutual(wavelength)[:, :, 30] for wavelength in wavelengths])
    image = np.array([bench.interferogram(wavelength) for wavelength in wavelengths])
