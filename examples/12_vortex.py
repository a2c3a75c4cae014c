"""
A vortex in a Mach-Zehnder interferometer
=========================================

A spiral phase plate winds the phase of one arm twice about the axis. Against a tilted plane wave the
fringes fork into two more; phase steps show the winding itself.
"""

import numpy as np

import fringetrace as ft
from fringetrace import mm, nm

wavelength, charge = 632.8 * nm, 2
rise = charge * wavelength / (2 * np.pi)  # path a radian


def path(x, y):
    return rise * np.arctan2(y, x)


def gradient(x, y):
    return -rise * y / (x**2 + y**2), rise * x / (x**2 + y**2)


spiral = ft.phase_plates.PhasePlate(path, (0, 0, 0), (1, 0, 0), (0, 1, 0), gradient=gradient)
plate = ft.Surface(ft.shapes.plate(6 * mm, 6 * mm), spiral, "spiral plate")
bench = ft.instruments.mach_zehnder(
    plate, aperture=4 * mm, reference_tilt=(0.8e-3, 0), pixels=(240, 240), rays=2, method="rays"
)
image = bench.interferogram(wavelength)
phase = ft.phase.wrap(bench.carrier(wavelength) - bench.wrapped(wavelength))  # by which the plate delays

rim = np.concatenate([phase[20, 20:220], phase[20:220, 219], phase[219, 219:20:-1], phase[219:20:-1, 20]])
turns = ft.phase.wrap(np.diff(rim, append=rim[0])).sum() / (2 * np.pi)
print(f"the phase winds {turns:.6f} times about the axis, made to wind {charge} times")

left, right = ft.views.side_by_side()
ft.views.interferogram(image, bench.ccd.pitch, left, wavelength=wavelength)
ft.views.phase(phase, bench.ccd.pitch, right, title="phase from four steps, carrier taken off")
ft.views.save(left, "12_vortex.png")
