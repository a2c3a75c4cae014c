"""
A measured surface, measured again
==================================

Heights become a mesh, the mesh an interferogram, and phase steps give the heights back. A Zygo MetroPro file
goes the same way: name it in the variable FRINGETRACE_MAP; without one it is matplotlib's elevation sample.
"""

import os

import numpy as np

import fringetrace as ft
from fringetrace import mm, nm, um

wavelength = 632.8 * nm
if "FRINGETRACE_MAP" in os.environ:
    z, pitch = ft.meshes.read_height_map(os.environ["FRINGETRACE_MAP"])
    z = z - np.nanmean(z)
else:
    z, pitch = ft.meshes.elevation_sample(relief=2 * um, aperture=8 * mm)
sample = ft.shapes.height_map(z, pitch)
high = np.nanmax(z) - np.nanmin(z)
print(f"{z.shape[0]} x {z.shape[1]} samples, {pitch / um:.3g} um apart, {high / um:.3f} um peak to valley")

aperture = 0.96 * pitch * (min(z.shape) - 1)
bench = ft.instruments.michelson(
    sample, aperture=aperture, reference_tilt=(4 * wavelength / aperture, 0), pixels=(300, 300)
)
image = bench.interferogram(wavelength)
height = bench.height(wavelength)

at = (np.arange(300) - 149.5) * bench.ccd.pitch
truth = ft.meshes.interpolate_height(sample, at[None, :], at[:, None])
error = height - truth
error -= np.nanmedian(error)
rms = np.sqrt(np.nanmean(error**2))
print(f"height against the mesh: {rms / nm:.4f} nm rms, {rms / wavelength:.1e} waves")

left, right = ft.views.side_by_side()
ft.views.interferogram(image, bench.ccd.pitch, left, wavelength=wavelength)
ft.views.height(
    ft.phase.remove_plane(height),
    bench.ccd.pitch,
    right,
    title="height from four phase steps, plane taken off",
)
ft.views.save(left, "05_surface.png")
