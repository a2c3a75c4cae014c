"""The pictures of docs/colour.md: swatches, colours against angles, spheres, a spectrum; and what aliases.

python docs/figures/colours.py           draw the pictures
python docs/figures/colours.py --write   and put what fringes need into docs/colour.md
"""

import sys
import warnings
from pathlib import Path

import numpy as np
import pages
from matplotlib.figure import Figure

from fringetrace import FringetraceWarning, nm, um, views
from fringetrace.core import tables
from fringetrace.scattering import bsdf_tables, colour
from fringetrace.views.plots import colour_plots

IMAGES = Path(__file__).parents[1] / "images"
W = colour.resolving_wavelengths(4e-6)


def soap(thickness):
    """Reflectance of a soap film in air at normal incidence (Airy)."""
    face, turn = (1 - 1.33) / 2.33, np.exp(4j * np.pi * 1.33 * thickness / W)
    return abs(face * (1 - turn) / (1 - face**2 * turn)) ** 2


def layers(cosine, period=170 * nm, index=1.5, count=6):
    """A model of a pile of weak layers, at the angle halfway between light and eye: kinematic Bragg sum."""
    path = 2 * period * np.sqrt(index**2 - 1 + np.asarray(cosine)[..., None] ** 2)
    half = np.pi * path / W + 1e-6  # never 0 / 0
    return (np.sin(count * half) / (count * np.sin(half))) ** 2


def rough(theta_i, theta_o, phi_o):
    """Such layers on tilted flakes, 1/sr: a lobe of normals 15 degrees wide, isotropic."""
    ti, to, po = np.meshgrid(theta_i, theta_o, phi_o, indexing="ij")
    wi = np.stack([np.sin(ti), 0 * ti, np.cos(ti)], axis=-1)
    wo = np.stack([np.sin(to) * np.cos(po), np.sin(to) * np.sin(po), np.cos(to)], axis=-1)
    half = (wi + wo) / np.maximum(np.linalg.norm(wi + wo, axis=-1, keepdims=True), 1e-9)
    spread = np.exp(-((np.arccos(np.clip(half[..., 2], 0, 1)) / np.radians(15)) ** 2)) / np.radians(15) ** 2
    return 0.12 * spread[..., None] * layers((wi * half).sum(axis=-1)) / np.pi


def fringes(path, wavelengths):
    """Two waves of equal strength."""
    return np.sin(np.pi * path / wavelengths) ** 2


def warned(path, at):
    """Whether colours of fringes are warned of."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", FringetraceWarning)
        colour.xyz(fringes(path, at), at)
    return bool(said)


def aliasing(steps=(1, 2.5, 5, 10), count=600):
    """From which path difference on fringes are warned of, and the worst that went without."""
    paths = np.geomspace(0.1, 1000, count) * um
    fine = np.linspace(360, 830, 47001) * nm
    exact = colour.weights(fine)
    true = np.array([fringes(path, fine) @ exact for path in paths])
    worst, first = 0.0, {}
    for step in steps:
        at = np.arange(360, 830.1, step) * nm
        weights = colour.weights(at)
        told = np.array([warned(path, at) for path in paths])
        off = abs(fringes(paths[:, None], at) @ weights - true).max(axis=1)
        worst, first[step] = max(worst, off[~told].max()), paths[told.argmax()] / um
    return (
        f"Warned of are fringes of path differences from {first[5]:.0f} µm on at steps of 5 nm, from "
        f"{first[1]:.0f} µm at 1 nm. Of {count} path differences up to 1 mm, at steps of "
        f"{', '.join(f'{step:g}' for step in steps)} nm, none with X, Y or Z off by more than {worst:.1g} "
        "went without a warning."
    )


def main():
    """Draw them all."""
    said = aliasing()
    print(said)
    if "--write" in sys.argv[1:]:
        pages.write("aliasing", said, pages.DOCS / "colour.md")
    thickness = np.array([50, 100, 150, 200, 250, 300, 400, 500])
    colours = 10 * colour.xyz(soap(thickness[:, None] * nm), W)
    views.save(colour_plots.swatches(colours, [f"{d} nm" for d in thickness]), IMAGES / "colour_swatches.png")

    theta, phi = np.radians(np.arange(0, 88, 3.0)), np.radians(np.arange(0, 360, 10.0))
    brdf = rough(theta, theta, phi)
    table = bsdf_tables.brdf_table(
        colour.xyz(np.pi * brdf, W)[:, None], theta, [0.0], theta, phi, [0.0, 1.0, 2.0]
    )
    figure = Figure(figsize=(11.5, 4.6), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    in_plane = table.sel(phi_o=np.pi).isel(phi_i=0)
    colour_plots.angles(np.asarray(in_plane), theta, theta, left)
    left.set_title("rough pile of layers, in plane")
    ball = bsdf_tables.shaded_sphere(table, (0.5, 0.5, 0.7))
    colour_plots.draw_sphere(ball, middle, title="a sphere of it, one light")
    mirror = colour.xyz(layers(np.cos(theta)), W)
    colour_plots.draw_sphere(
        colour_plots.mirrored(mirror, theta), right, title="smooth, white sky all around"
    )
    views.save(figure, IMAGES / "colour_angles.png")

    noisy = layers(1.0) + np.random.default_rng(0).normal(0, 0.01, len(W))
    axes = {"sample": (["made up, with noise"], ""), "wavelength": (W, "m")}
    sample = tables.labelled(noisy[None], axes, name="reflectance", unit="1")
    both = layers(np.cos(np.radians([0, 40])))
    ax = colour_plots.coloured_spectra(both, W, labels=["0°", "40°"], measured=sample)
    views.save(ax, IMAGES / "colour_spectrum.png")


if __name__ == "__main__":
    main()
