"""
Stairs that are too high for one wavelength
===========================================

A riser of more than a quarter of the wavelength loses whole half waves when its phase is unwrapped. The beat
of two wavelengths chooses the order, the shorter of them gives the height.
"""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import mm, nm, um

orange, red, rise = 611.97 * nm, 632.8 * nm, 1.1 * um
sample = ft.shapes.staircase(6 * mm, 6 * mm, treads=4, rise=rise)
bench = ft.instruments.michelson(sample, aperture=5.9 * mm, pixels=(200, 200), rays=1 / 4)

phases = [bench.wrapped(wavelength) for wavelength in (orange, red)]  # traced once
alone = ft.phase.height(ft.phase.unwrap(phases[0]), orange)
both = ft.phase.two_wavelength(*phases, orange, red)

treads = [slice(50 * i + 10, 50 * i + 40) for i in range(4)]
for name, height in (("one wavelength", alone), ("two wavelengths", both)):
    steps = np.diff([height[100, tread].mean() for tread in treads])
    print(f"{name}: risers of {np.round(steps / nm, 6)} nm, made {rise / nm:g} nm high")
beat = ft.phase.synthetic_wavelength(orange, red)
print(f"synthetic wavelength {beat / um:.3f} um: right for heights within {beat / 4 / um:.2f} um of 0")

x = (np.arange(200) - 99.5) * bench.ccd.pitch
figure = Figure(figsize=(14, 4.4), layout="constrained")
figure.get_layout_engine().set(w_pad=0.15)  # inches
first, second, section = figure.subplots(1, 3)
for ax, phase, wavelength in ((first, phases[0], orange), (second, phases[1], red)):
    ft.views.phase(phase, bench.ccd.pitch, ax, title=f"phase at {wavelength / nm:g} nm")
section.plot(
    x / mm, (alone[100] - alone[100, 25]) / um, ":", color="#D55E00", label="one wavelength, unwrapped"
)
section.plot(x / mm, both[100] / um, color="#0072B2", label="two wavelengths")
section.set(xlabel="x / mm", ylabel="height / µm", title="section, y = 0", ylim=(-0.6, 4.4))
section.legend(loc="upper left")
ft.views.save(figure, "04_two_wavelengths.png")
