"""A machined step in a Michelson: interferogram, and the height measured from four frames."""

import fringetrace as ft
from fringetrace import mm, nm

sample = ft.shapes.step(6 * mm, 6 * mm, edge=0.8 * mm, rise=100 * nm)
bench = ft.instruments.michelson(sample, aperture=8 * mm, reference_tilt=(200e-6, 0.0), pixels=(400, 400))
image = bench.interferogram(632.8 * nm)
print(f"dark outside the sample: {image[0, 0]:.3f} of the incident irradiance (reference alone: 0.250)")
height = bench.height(632.8 * nm)
low, high = height[200, 60:180].mean(), height[200, 300:340].mean()
print(f"step: {(high - low) / nm:.4f} nm, made 100 nm high")
ax = ft.views.interferogram(image, bench.ccd.pitch, wavelength=632.8 * nm)
ft.views.save(ax, "01_step.png")
