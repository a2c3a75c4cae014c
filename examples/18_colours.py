"""
Colours without pigment
=======================

Newton's scale, a soap film, oil on water, a stack of plates like a morpho's, a CD: spectra in closed form, as
the CIE's observer sees them in daylight.
"""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import degree, nm, um
from fringetrace.optics import films
from fringetrace.scattering import colour
from fringetrace.views.plots import colour_plots

waves = colour.resolving_wavelengths(8 * um)  # resolves fringes of path differences up to 8 um
path, thick = np.linspace(0, 1800, 361) * nm, np.linspace(0, 1200, 361) * nm
angle, eye = np.linspace(0, 85, 171) * degree, np.linspace(-29, 85, 400) * degree

newton = np.sin(np.pi * path[:, None] / waves) ** 2
soap = np.array([films.reflectance(films.Film(((1.33, t),)), 1.0, 1.0, 0.0, waves).s for t in thick])
oil = np.array([films.reflectance(films.Film(((1.47, t),)), 1.0, 1.33, 0.0, waves).s for t in thick])
plates = films.Film(((1.56, 65 * nm), (1.0, 140 * nm)) * 8)  # chitin and air
morpho = films.reflectance(plates, 1.0, 1.0, angle[:, None], waves).s

# a grating: orders m * wavelength = pitch * (sin eye + sin lit), of one strength
pitch, lit, disc = 1.6 * um, 30 * degree, np.zeros((len(eye), 3))
for m in range(1, 9):
    at = pitch * (np.sin(eye) + np.sin(lit)) / m
    per_angle = pitch * np.cos(eye) / m  # d wavelength / d angle
    disc += (colour.illuminant("D65", at) * per_angle)[:, None] * colour.observer(2, at)

rows = [
    (colour.xyz(newton, waves), path / nm, "Newton's scale: path difference / nm"),
    (10 * colour.xyz(soap, waves), thick / nm, "soap film, 10 times as bright: thickness / nm"),
    (15 * colour.xyz(oil, waves), thick / nm, "oil on water, 15 times as bright: thickness / nm"),
    (colour.xyz(morpho, waves), angle / degree, "stack of chitin plates, s light: angle of incidence / °"),
    (disc / disc[:, 1].max(), eye / degree, "CD, white light from 30°: angle to the eye / °"),
]
first = rows[0][0][path.searchsorted(575 * nm)]
print(
    "Newton's sensitive tint, 575 nm: sRGB",
    np.rint(255 * colour.srgb(first)).astype(int),
    "expected [54 41 207]",
)

figure = Figure(figsize=(8, 6.5), layout="constrained")
for ax, (xyz, places, label) in zip(figure.subplots(5, 1), rows, strict=True):
    colour_plots.strip(xyz, places, ax, label=label)
ft.views.save(figure, "18_colours.png")
