"""
The index of chitin by a Jamin-Lebedeff interferometer
======================================================

Two polarised beams, one through the flake and one beside it, are parted and joined by calcite. The paths that
a flake adds at seven wavelengths give Cauchy's law of its index back.
"""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import degree, nm, um

thickness, oil = 2 * um, 1.52
calcite = ft.materials.CALCITE_O.index, ft.materials.CALCITE_E.index
sodium, waves = 589.3 * nm, np.arange(400, 701, 50) * nm

# stairs of 1 to 4 um on a flat foot, between crossed polarisers
treads = np.arange(1, 5)
x, z = np.repeat(np.arange(-20, 21, 10), 2), np.concatenate([[0], np.repeat(treads, 2), [0]])
stairs = ft.shapes.extrude(np.stack([x, z], axis=1) * um, 30 * um, closed=True)
flake = ft.Surface(stairs, ft.Dielectric("transmitted"), "flake", back=ft.materials.CHITIN)
crossed = ft.instruments.jamin_lebedeff(
    flake,
    aperture=60 * um,
    medium=oil,
    crystal=calcite,
    analyser=135 * degree,
    pixels=(90, 120),
    rays=2,
    method="rays",
)
image = crossed.interferogram(sodium)
seen = image[45, 30:100:20]
expected = np.sin(np.pi * (ft.materials.CHITIN.index(sodium).real - oil) * treads * um / sodium) ** 2
print("stairs:", np.round(seen, 4), "sin^2(delay / 2):", np.round(expected, 4))

slab = ft.shapes.plate(60 * um, 60 * um, thickness)
slab = ft.Surface(slab, ft.Dielectric("transmitted"), "slab", back=ft.materials.CHITIN)
bench = ft.instruments.jamin_lebedeff(slab, aperture=40 * um, medium=oil, crystal=calcite, pixels=(3, 4))
path = np.array([bench.path_difference(wavelength).mean() for wavelength in waves])
index = oil + path / thickness
(a, b), *_ = np.linalg.lstsq(np.stack([np.ones(len(waves)), (nm / waves) ** 2], axis=1), index)
print(f"measured: n = {a:.6f} + {b:.2f} nm^2 / wavelength^2; chitin: n = 1.517 + 8800 nm^2 / wavelength^2")

left, right = Figure(figsize=(12, 4.4), layout="constrained").subplots(1, 2)
ft.views.interferogram(image, crossed.ccd.pitch, left, wavelength=sodium, title="stairs of chitin")
fine = np.linspace(400, 700, 301) * nm
right.plot(fine / nm, ft.materials.CHITIN.index(fine).real, color="#0072B2", label="chitin")
right.plot(waves / nm, index, "o", color="#D55E00", label="measured on a slab of 2 µm")
right.axhline(oil, color="#999999", linestyle=":", label="oil")
right.set(xlabel="wavelength / nm", ylabel="index")
right.legend()
ft.views.save(left, "09_chitin.png")
