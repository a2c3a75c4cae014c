"""The pictures of docs/colour.md: swatches, colours against angles, spheres, and a spectrum."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from fringetrace import bsdf, nm, spectra, swatches, tables, views

IMAGES = Path(__file__).parents[1] / "docs" / "images"
W = spectra.samples(4e-6)


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


def main():
    """Draw them all."""
    thickness = np.array([50, 100, 150, 200, 250, 300, 400, 500])
    colours = 10 * spectra.xyz(soap(thickness[:, None] * nm), W)
    views.save(swatches.swatches(colours, [f"{d} nm" for d in thickness]), IMAGES / "colour_swatches.png")

    theta, phi = np.radians(np.arange(0, 88, 3.0)), np.radians(np.arange(0, 360, 10.0))
    brdf = rough(theta, theta, phi)
    table = bsdf.table(spectra.xyz(np.pi * brdf, W)[:, None], theta, [0.0], theta, phi, [0.0, 1.0, 2.0])
    figure = Figure(figsize=(11.5, 4.6), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    in_plane = table.sel(phi_o=np.pi).isel(phi_i=0)
    swatches.angles(np.asarray(in_plane), theta, theta, left)
    left.set_title("rough pile of layers, in plane")
    ball = bsdf.sphere(table, (0.5, 0.5, 0.7))
    swatches.sphere(ball, middle, title="a sphere of it, one light")
    mirror = spectra.xyz(layers(np.cos(theta)), W)
    swatches.sphere(swatches.mirrored(mirror, theta), right, title="smooth, white sky all around")
    views.save(figure, IMAGES / "colour_angles.png")

    noisy = layers(1.0) + np.random.default_rng(0).normal(0, 0.01, len(W))
    axes = {"sample": (["made up, with noise"], ""), "wavelength": (W, "m")}
    sample = tables.labelled(noisy[None], axes, name="reflectance", unit="1")
    both = layers(np.cos(np.radians([0, 40])))
    ax = swatches.spectrum(both, W, labels=["0°", "40°"], measured=sample)
    views.save(ax, IMAGES / "colour_spectrum.png")


if __name__ == "__main__":
    main()
