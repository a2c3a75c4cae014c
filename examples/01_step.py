"""
A machined step in a Michelson interferometer
=============================================

One trace gives the interferogram, the phase-stepped frames and the height of a step of 100 nm.
"""

import fringetrace as ft
from fringetrace import mm, nm

wavelength = 632.8 * nm
sample = ft.shapes.step(6 * mm, 6 * mm, edge=0.8 * mm, rise=100 * nm)
bench = ft.instruments.michelson(sample, aperture=8 * mm, reference_tilt=(200e-6, 0.0), pixels=(400, 400))

image = bench.interferogram(wavelength)
height = bench.height(wavelength)  # from four phase-stepped frames, of the same trace
low, high = height[200, 60:180].mean(), height[200, 300:340].mean()
print(f"dark outside the sample: {image[0, 0]:.3f} of the incident irradiance (reference alone: 0.250)")
print(f"step: {(high - low) / nm:.4f} nm, made 100 nm high")

left, right = ft.views.side_by_side()
ft.views.interferogram(image, bench.ccd.pitch, left, wavelength=wavelength, title="interferogram")
ft.views.height(height - low, bench.ccd.pitch, right, title="height from four phase steps")
ft.views.save(left, "01_step.png")
