"""
Newton's rings in a Fizeau interferometer
=========================================

A reference face of 1 m radius over a flat: bare glass gives rings like cos^2, faces coated to reflect a third
send light to and fro many times, and the rings become narrow.
"""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import mm, nm

wavelength, radius, gap = 589.3 * nm, 1.0, 2 * 589.3 * nm
flat = ft.shapes.plate(8 * mm, 8 * mm)
layer = ft.films.Film(((2.4, wavelength / (4 * 2.4)),))  # a quarter-wave layer of titania
images = {}
for name, film in (("bare glass", None), ("coated", layer)):
    sample = ft.Surface(flat, ft.Dielectric(film=film), "flat", front=1.0, back=1.5)
    bench = ft.instruments.fizeau(
        sample,
        aperture=4 * mm,
        gap=gap,
        radius=radius,
        coating=film,
        pixels=(300, 300),
        rays=1 / 10,
        max_bounces=13,
    )
    images[name] = bench.interferogram(wavelength)

x = (np.arange(300) - 149.5) * bench.ccd.pitch
row = images["bare glass"][150, 150:]
dark = x[150:][1:-1][(row[1:-1] < row[2:]) & (row[1:-1] < row[:-2])]
order = np.arange(1, len(dark) + 1)
print("dark rings at", np.round(dark / mm, 2), "mm")
print("sqrt(m lambda R):", np.round(np.sqrt(order * wavelength * radius) / mm, 2), "mm")

figure = Figure(figsize=(15, 4.4), layout="constrained")
figure.get_layout_engine().set(w_pad=0.15)  # inches
*panels, section = figure.subplots(1, 3)
for ax, (name, image), colour in zip(panels, images.items(), ("#0072B2", "#D55E00"), strict=True):
    ft.views.interferogram(image, bench.ccd.pitch, ax, wavelength=wavelength, title=name)
    section.plot(x[150:] / mm, image[150, 150:] / image[150].max(), color=colour, label=name)
section.set(xlabel="distance from the centre / mm", ylabel="irradiance / largest", title="section, y = 0")
section.set_ylim(0, 1.25)
section.legend(loc="upper right", ncols=2)
ft.views.save(figure, "07_fizeau.png")
