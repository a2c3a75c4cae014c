"""
The parallel problem: a bump that is not there
==============================================

Light that falls on one flank of a groove leaves by the other, parallel to how it came: the camera sees it
above the wrong place, and reads a roof where the surface falls by a millimetre.
"""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import degree, mm, nm, um

wavelength, error = 632.8 * nm, 0.3e-3  # rad, by which each flank is flatter than 45 degrees
depth = 1 * mm * np.tan(45 * degree - error)
profile = np.array([(-3 * mm, 0), (-1 * mm, 0), (0, -depth), (1 * mm, 0), (3 * mm, 0)])
sample = ft.shapes.extrude(profile, 6 * mm)
bench = ft.instruments.michelson(sample, aperture=4 * mm, pixels=(240, 240))
height = bench.height(wavelength)
image = bench.interferogram(wavelength)

x = (np.arange(240) - 119.5) * bench.ccd.pitch
seen = height[120]
flank = (x > 0.1 * mm) & (x < 0.9 * mm)
slope = np.polyfit(x[flank], seen[flank], 1)[0]
print(f"slope that is seen: {slope / 1e-3:.4f} mrad; twice the error of a flank: {2 * error / 1e-3:.4f} mrad")
print(f"slope that is there: {depth / mm:.4f}")

# the same sample under a handful of rays, to look at
x0 = np.linspace(-1.4, 1.4, 15) * mm
rays = ft.Rays([(at, 0, 1 * mm) for at in x0], [(0, 0, -1)] * len(x0))
paths = ft.trace(ft.Scene([ft.Surface(sample, ft.Mirror())]), rays, record=True)

figure = Figure(figsize=(15, 4.4), layout="constrained")
figure.get_layout_engine().set(w_pad=0.15)  # inches
scene, fringes, section = figure.subplots(1, 3)
scene.plot(*profile.T / mm, color="black", linewidth=3)
for i in range(len(x0)):
    way = np.array([*paths.polyline(i), paths.origin[i] + 2 * mm * paths.direction[i]])
    scene.plot(*way.T[[0, 2]] / mm, color="#D55E00" if abs(x0[i]) < 1 * mm else "#0072B2", linewidth=1)
scene.set(xlabel="x / mm", ylabel="z / mm", xlim=(-1.6, 1.6), ylim=(-1.1, 1), title="light across the groove")
ft.views.interferogram(image, bench.ccd.pitch, fringes, wavelength=wavelength)
section.plot(x / mm, (seen - seen[5]) / um, color="#D55E00", label="as the camera reads it")
section.plot(*profile.T / [[mm], [um]], color="black", label="the surface")
section.set(xlabel="x / mm", ylabel="z / µm", xlim=(-2, 2), ylim=(-1, 1), title="height, y = 0")
section.legend()
ft.views.save(figure, "02_parallel.png")
