"""How far rays can be believed, and whether lattices explain a peacock's colours: tables and figures.

python docs/figures/rigorous.py           print the tables
python docs/figures/rigorous.py --write   and write them, with the figures, into docs/rigorous.md
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import discs
import numpy as np
import pages
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import nm
from fringetrace.rigorous.cylinder_gratings import reflectance_spectrum
from fringetrace.rigorous.cylinders import Cylinders, amplitude, differential_width, scatter
from fringetrace.rigorous.cylindrical_waves import CONDUCTOR

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from rods import FEATHERS, feather, keratin, melanin

PAGE = pages.DOCS / "rigorous.md"
SIZES = (1, 2, 4, 8, 16, 31, 63, 126, 251)
PAIR = [(0, 0), (13, -4)]  # discs of radius 5
IN = -math.pi / 2
CLEAR = (1.12, 1.5)  # melanin in keratin, glass in air
BANDS = (445, 525)  # nm, measured on a feather
WAVELENGTHS = np.arange(380, 701, 5) * nm
ANGLES = (0, 20, 40, 60)


def error(rays, exact):
    """Rms over directions of the difference, over the rms of the exact amplitude."""
    return math.sqrt((abs(rays - exact) ** 2).sum() / (abs(exact) ** 2).sum())


def opaque(sizes, polarisation):
    """Error of rays on two conducting discs, light coming off at 40 to 120 degrees."""
    out = np.radians(np.linspace(40, 120, 81))
    sign = -1 if polarisation == "s" else 1
    found = [discs.rays(PAIR, 5, IN, each, 9) for each in out]
    errors = []
    for size in sizes:
        k = size / 5
        exact = amplitude(scatter(Cylinders(PAIR, 5, CONDUCTOR), 2 * math.pi / k, IN, polarisation), out)[0]
        errors.append(error(np.array([discs.amplitude(each, k, sign) for each in found]), exact))
    return errors


def clear(sizes, index, polarisation, low, high):
    """Error of rays through and off one clear rod, light leaving its way by low to high degrees."""
    turn = np.radians(np.arange(low + 0.25, high, 1.0))
    errors = []
    for size in sizes:
        exact = amplitude(
            scatter(Cylinders([(0, 0)], 1.0, index), 2 * math.pi / size, 0.0, polarisation), turn
        )[0]
        errors.append(error(discs.through(index, size, polarisation, turn), exact))
    return errors


def _percent(value):
    return f"{100 * value:.2g}" if value < 0.1 else f"{100 * value:.0f}"


def rays_table():
    """Errors of rays in per cent as rods grow, and the laws of `validity`."""
    columns = [opaque(SIZES, "s"), opaque(SIZES, "p")]
    for index in CLEAR:
        columns += [clear(SIZES, index, "s", 3, 180), clear(SIZES, index, "s", 15, 45)]
    laws = [
        [ft.validity(size / 2 / math.pi, 1.0, index).ray_error for size in SIZES]
        for index in (CONDUCTOR, 1.5)
    ]
    head = (
        "| k a | two conducting discs, s | p | law 2.4 / k a | clear rod m = 1.12, 3-180 deg | 15-45 deg "
        "| m = 1.5, 3-180 deg | 15-45 deg | law 3 / sqrt(k a) |\n" + "| ---: " * 9 + "|"
    )
    order = [columns[0], columns[1], laws[0], *columns[2:], laws[1]]
    rows = [
        f"| {size} | " + " | ".join(_percent(column[j]) for column in order) + " |"
        for j, size in enumerate(SIZES)
    ]
    return columns, laws, "\n".join([head, *rows])


def draw_rays(columns, laws):
    """Errors of rays against size."""
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.subplots()
    names = ["two conducting discs, s", "the same, p"]
    names += [f"clear rod, m = {m}, {part}" for m in CLEAR for part in ("beyond 3°", "15° to 45°")]
    for column, name, style in zip(columns, names, ("o", "s", "^", "v", "D", "P"), strict=True):
        axes.loglog(SIZES, column, style + "-", label=name, lw=0.8, ms=5)
    axes.loglog(SIZES, laws[0], "k--", lw=1, label="2.4 / ka")
    axes.loglog(SIZES, laws[1], "k:", lw=1, label="3 / √ka")
    axes.set(xlabel="size parameter ka", ylabel="rms error of rays / rigorous amplitude", ylim=(4e-3, 5))
    axes.legend(fontsize=7)
    figure.savefig(pages.DOCS / "images" / "rigorous_rays.png", dpi=140)


def bands(curve):
    """Wavelengths (nm) and heights of the maxima that reach half of the highest."""
    inner = curve[1:-1]
    top = np.flatnonzero((inner > curve[:-2]) & (inner >= curve[2:]) & (inner > curve.max() / 2)) + 1
    return [(round(WAVELENGTHS[j] / nm), curve[j]) for j in top]


def peacock_table():
    """Bands of each lattice at four angles, rigorous; and those of flat layers at normal incidence."""
    rows = [
        "| lattice (nm: period, pitch, rod, layers) | "
        + " | ".join(f"{a} deg" for a in ANGLES)
        + " | flat layers |"
    ]
    rows.append("| --- " * (len(ANGLES) + 2) + "|")
    curves = {}
    thin, thick = ((*FEATHERS["brown"][:2], cortex, *FEATHERS["brown"][3:]) for cortex in (0, 200))
    several = {**FEATHERS, "brown, no cortex": thin, "brown, cortex 200": thick}
    for name, numbers in several.items():
        lattice = feather(*numbers)
        curves[name] = [
            reflectance_spectrum(lattice, WAVELENGTHS, math.radians(a)).reflectance for a in ANGLES
        ]
        flat = reflectance_spectrum(lattice, WAVELENGTHS, method="multilayer").reflectance
        cells = [", ".join(f"{w} ({h:.2f})" for w, h in bands(curve)) for curve in [*curves[name], flat]]
        period, pitch, _, rod, _, layers = numbers
        rows.append(f"| {name}: {period}, {pitch}, {rod:.3g}, {layers} | " + " | ".join(cells) + " |")
    return curves, "\n".join(rows)


def cluster_table():
    """Strongest wavelength of 20 x 4 melanin rods in keratin, for pairs of angles in keratin."""
    centres = [(i * 150 * nm, j * 150 * nm) for i in range(20) for j in range(4)]
    rods = Cylinders(centres, 65 * nm, melanin, keratin)
    incidence = np.radians(ANGLES)
    out = math.pi / 2 + np.radians([-60, -40, -20, 0, 20, 40, 60])
    found = np.zeros((len(ANGLES), len(out), len(WAVELENGTHS)))
    for j, wavelength in enumerate(WAVELENGTHS):
        for polarisation in ("s", "p"):
            light = scatter(rods, wavelength, IN + incidence, polarisation, orders=6)
            found[..., j] += differential_width(light, out) / 2
    rows = [
        "| in \\ out | " + " | ".join(f"{a}" for a in (60, 40, 20, 0, -20, -40, -60)) + " |",
        "| ---: " * 8 + "|",
    ]
    for i, angle in enumerate(ANGLES):
        cells = [f"{round(WAVELENGTHS[c.argmax()] / nm)} ({c.max() / nm:.0f})" for c in found[i]]
        rows.append(f"| {angle} | " + " | ".join(cells) + " |")
    return "\n".join(rows)


def wires():
    """What 20 x 4 conducting rods in air send straight back, s light, least and most of 400 to 550 nm."""
    said = []
    for name, shift in (("square", 0.0), ("staggered", 0.5)):
        centres = [((i + shift * (j % 2)) * 280 * nm, j * 280 * nm) for i in range(20) for j in range(4)]
        rods, at = Cylinders(centres, 65 * nm, CONDUCTOR), np.arange(400, 551, 10) * nm
        sent = [differential_width(scatter(rods, w, IN, orders=5), math.pi / 2)[0, 0] / nm for w in at]
        low, high = np.argmin(sent), np.argmax(sent)
        said.append(
            f"{name} {sent[low] / 1e3:.0f} µm/rad ({at[low] / nm:.0f} nm) to {sent[high] / 1e3:.0f} µm/rad "
            f"({at[high] / nm:.0f} nm), median {np.median(sent) / 1e3:.0f}"
        )
    return f"20 x 4 such rods, s light of 400 to 550 nm straight back: {'; '.join(said)}."


def draw_peacock(curves):
    """Spectra of lattices, upright and tilted."""
    figure = Figure(figsize=(8.4, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for name in ("R1", "R2", "R6", "blue", "green", "yellow", "study"):
        left.plot(WAVELENGTHS / nm, curves[name][0], label=name, lw=1.2)
    for angle, curve in zip(ANGLES, curves["R2"], strict=True):
        right.plot(WAVELENGTHS / nm, curve, label=f"R2, {angle}°", lw=1.2)
    for axes in (left, right):
        for band in BANDS:
            axes.axvline(band, color="0.6", ls="--", lw=0.8)
        axes.set(xlabel="wavelength / nm")
        axes.legend(fontsize=7)
    left.set(ylabel="reflectance", title="normal incidence")
    right.set(title="one lattice, tilted")
    figure.savefig(pages.DOCS / "images" / "rigorous_peacock.png", dpi=140)


def main():
    """Print the tables; write them if asked to."""
    columns, laws, rays = rays_table()
    curves, peacock = peacock_table()
    cluster = cluster_table()
    mesh = wires()
    print(rays, peacock, cluster, mesh, sep="\n\n")
    if "--write" in sys.argv[1:]:
        draw_rays(columns, laws)
        draw_peacock(curves)
        for name, text in (("rays", rays), ("peacock", peacock), ("cluster", cluster), ("wires", mesh)):
            pages.write(name, text, PAGE)


if __name__ == "__main__":
    main()
