"""
The Michelson of the 2013 study, in full field
==============================================

A slope of 10 mrad, a step, a flat, seen by a bare camera: where the step parts the light of the sample
the camera sees the reference alone (and below, where the tilted reference has walked off, the sample).
"""

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import nm, um

unit, wavelength = 10 * um, 540 * nm  # the study's unit of length; its wavelength was 0.054 units
profile = np.array([(-1, 0), (0.2, 0.012), (0.2, 0.1), (1, 0.1)]) * unit
sample = ft.shapes.extrude(profile, 2.4 * unit)
bench = ft.instruments.michelson(
    sample, aperture=2 * unit, reference_tilt=(0, 10e-3), pixels=(200, 200), rays=1 / 2, focus=False
)
image = bench.interferogram(wavelength)

# light off the slope turns by twice its angle, and walks aside on its way to the camera
mutual = bench.mutual(wavelength)[:, :, 100]  # of the arms, along the middle row
angle = np.arctan(0.012 / 1.2)
walk = (2 * bench.ccd.centre[2] - profile[1, 1]) * np.tan(2 * angle)
alone = (mutual[0, 0] < 1e-6).sum() * bench.ccd.pitch
print(f"reference alone: {alone / um:.2f} um wide; light off the slope walks {walk / um:.2f} um aside")
per_pixel = np.diff(np.unwrap(np.angle(mutual[1, 0, 20:80]))).mean() / (2 * np.pi)
period, expected = bench.ccd.pitch / abs(per_pixel), wavelength / np.sin(2 * angle)
print(f"a fringe every {period / um:.3f} um of the slope; wavelength / sin 2a: {expected / um:.3f} um")

paths = ft.trace(bench.scene, replace(bench.beam, shape=(1, 24)), bench.ccd, record=True)
figure = Figure(figsize=(13, 5.2), layout="constrained")
side, full = figure.subplots(1, 2)
for surface in bench.scene.surfaces:
    for corners in surface.mesh.vertices[surface.mesh.faces]:
        side.plot(*corners.T[[0, 2]] / um, color="black", linewidth=2)
for i in np.flatnonzero(paths.fate == ft.Fate.DETECTED):
    by_reference = bench.arms.reference.surface in paths.surface[i]
    side.plot(
        *paths.polyline(i).T[[0, 2]] / um, color="#E69F00" if by_reference else "#0072B2", linewidth=0.8
    )
side.plot([-unit / um, unit / um], [bench.ccd.centre[2] / um] * 2, color="#009E73", linewidth=4)
names = {
    "light": (-34, 12),
    "camera": (12, 38),
    "sample": (12, -41),
    "splitter": (-25, 26),
    "reference": (24, 14),
}
for name, place in names.items():
    side.text(*place, name)
side.set(xlabel="x / µm", ylabel="z / µm", aspect="equal", title="24 rays of the middle row")
ft.views.interferogram(image, bench.ccd.pitch, full, wavelength=wavelength, title="full field")
ft.views.save(figure, "03_study.png")
