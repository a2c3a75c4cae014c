"""Colours without pigment: Newton's scale, soap, oil on water, a morpho-like stack, a CD, in one picture."""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import nm, spectra, swatches, um

w = spectra.samples(8 * um)  # resolves fringes of path differences up to 8 um


def film(thickness, n, below):
    """Reflectance of a film in air on a substrate, at normal incidence: Airy's sum of all passes."""
    first, second = (1 - n) / (1 + n), (n - below) / (n + below)
    turn = np.exp(4j * np.pi * n * thickness / w)
    return abs((first + second * turn) / (1 + first * second * turn)) ** 2


def stack(angle, plates=8):
    """Reflectance of chitin (n = 1.56, 65 nm) and air (140 nm) for s light, layer by layer from behind."""
    air, chitin = np.cos(angle), np.sqrt(1.56**2 - np.sin(angle) ** 2)
    face = (air - chitin) / (air + chitin)
    plate, gap = (np.exp(4j * np.pi * n * d / w) for n, d in ((chitin, 65 * nm), (air, 140 * nm)))
    r = 0.0
    for _ in range(plates):
        r = (-face + r * gap) / (1 - face * r * gap)
        r = (face + r * plate) / (1 + face * r * plate)
    return abs(r) ** 2


def grating(angle, lit, pitch):
    """X, Y, Z of white light off a grating: orders m lambda = pitch (sin o + sin i) of one strength."""
    colour = np.zeros((len(angle), 3))
    for m in range(1, 9):
        at = pitch * (np.sin(angle) + np.sin(lit)) / m
        per_angle = pitch * np.cos(angle) / m  # d wavelength / d angle
        colour += (spectra.illuminant("D65", at) * per_angle)[:, None] * spectra.observer(2, at)
    return colour / colour[:, 1].max()


path, thick = np.linspace(0, 1.8, 361)[:, None] * um, np.linspace(0, 1.2, 361)[:, None] * um
angle, eye = np.radians(np.linspace(0, 85, 171)), np.radians(np.linspace(-29, 85, 400))
rows = [
    (np.sin(np.pi * path / w) ** 2, path / nm, "Newton's scale: path difference / nm"),
    (10 * film(thick, 1.33, 1.0), thick / nm, "soap film, 10 times as bright: thickness / nm"),
    (15 * film(thick, 1.47, 1.33), thick / nm, "oil on water, 15 times as bright: thickness / nm"),
    (stack(angle[:, None]), np.degrees(angle), "morpho-like stack: angle of incidence / °"),
]
figure = Figure(figsize=(8, 6.5), layout="constrained")
axes = figure.subplots(5, 1)
for ax, (reflectance, places, label) in zip(axes, rows, strict=False):
    swatches.strip(spectra.xyz(reflectance, w), places.ravel(), ax, label=label)
compact_disc = grating(eye, np.radians(30), 1.6 * um)
swatches.strip(compact_disc, np.degrees(eye), axes[4], label="CD, white light from 30°: angle to the eye / °")
ft.views.save(figure, "10_colours.png")
