"""
The caustic of a spherical mirror
=================================

A round caustic behind a straight edge: folds, edges and fringes, all of 10,000 rays. Along the fold two waves
merge, and their field is Airy's function; beyond it there is none.
"""

import numpy as np

import fringetrace as ft
from fringetrace import mm, nm

radius, tilt = 20 * mm, 0.13  # the ray that starts at R sin(tilt) touches the caustic at the camera
z = radius * np.cos(tilt) * (1 + 2 * np.sin(tilt) ** 2) / 2
edge = radius * np.sin(tilt) ** 3

x = np.linspace(-5 * mm, 5 * mm, 65)
bowl = ft.shapes.height_map(np.sqrt(radius**2 - x[:, None] ** 2 - x**2), x[1] - x[0])
mirror = ft.Surface(bowl, ft.Mirror(), "mirror", form=ft.forms.Sphere((0, 0, 0), radius))
plate = ft.Surface(ft.shapes.plate(5 * mm, 9 * mm).moved((3.6 * mm, 0, 1 * mm)), ft.Absorber(), "plate")
beam = ft.Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (6.8 * mm, 6.8 * mm), (100, 100))
ccd = ft.CCD((0, 0, z), (0, 0, 1), (0, 1, 0), 2.6 * edge / 400, (400, 400))
paths = ft.trace(ft.Scene([mirror, plate]), beam, ccd, max_bounces=1)
image = ft.irradiance(paths, 632.8 * nm)
print(f"{len(paths):,} paths; brightest pixel {image.max():,.0f} times the incident irradiance")
print(f"on the caustic {image[200, 340:360].max():.0f}, 10 um outside {image[200, 390]:.1e}")
shown = np.minimum(image, np.percentile(image, 99.5))  # the axis is a caustic too, far brighter
ft.views.save(ft.views.interferogram(shown, ccd.pitch, wavelength=632.8 * nm), "13_caustic.png")
