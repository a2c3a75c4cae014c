"""Beyond the study: matter, true cylinders, counts and disorder, traced, beside the rigorous answer.

python docs/figures/feathers.py            print
python docs/figures/feathers.py --write    and put figure and table into docs/study.md
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
import pages
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import degree, nm
from fringetrace.scattering.detectors import Cones
from fringetrace.scattering.goniometer import brdf
from fringetrace.scattering.rod_lattice import RodLattice
from fringetrace.scattering.rod_solvers import lattice_validity
from fringetrace.scattering.rod_studies import cluster, specular

PAGE, FIGURE = pages.DOCS / "study.md", pages.DOCS / "images" / "feathers.png"
WAVES = np.linspace(400, 700, 16) * nm
BACK = Cones([0.0], 2 * degree)
MIRRORS = RodLattice()
FEATHER = RodLattice(
    6, 4, pitch=150 * nm, arrangement="square", rod="melanin", host="keratin", cortex=100 * nm
)  # fmt: skip


def straight_back(kind: RodLattice, method: str = "diffraction", rays: int = 250) -> np.ndarray:
    """BRDF from 0 to 0 degrees by rays."""
    table = brdf(
        kind.scene, 0.0, BACK, WAVES, method=method, rays=(1, rays), min_amplitude=3e-2, **kind.lighting
    )
    return table.values.ravel()


def rigorous(kind: RodLattice) -> np.ndarray:
    """The same, rigorously."""
    return cluster(kind, 0.0, 0.0, WAVES).ravel()


def curves() -> dict[str, dict[str, np.ndarray]]:
    """Spectra straight back, by panel and label."""
    matter = {"rays": straight_back(FEATHER), "rigorous": rigorous(FEATHER)}
    small = replace(MIRRORS, columns=6)
    shape = {
        "18 sides": straight_back(small),
        "cylinders": straight_back(replace(small, exact=True)),
        "rigorous": rigorous(small),
    }
    counts = {
        f"{kind}, {rows} rows": function(replace(FEATHER, rows=rows))
        for rows in (2, 6)
        for kind, function in (("rays", straight_back), ("rigorous", rigorous))
    }
    disorder = {"ordered, rigorous": rigorous(FEATHER)}
    for kind, function in (("rays", straight_back), ("rigorous", rigorous)):
        several = [function(replace(FEATHER, disorder=0.02, seed=seed)) for seed in range(2)]
        disorder[f"0.02 pitch, {kind}"] = np.mean(several, axis=0)
    return {
        "melanin in keratin": matter, "mirrors in a vacuum": shape, "rod counts": counts,
        "disorder, mean of 2": disorder,
    }  # fmt: skip


def text(found: dict[str, dict[str, np.ndarray]]) -> str:
    """Figure, peaks and the endless rows."""
    lines = [
        "![Spectra straight back](images/feathers.png)\n",
        "| straight back | peak, nm | BRDF there, 1/sr |",
    ]
    lines.append("|---|---|---|")
    for panel, several in found.items():
        lines += [
            f"| {panel}: {label} | {WAVES[values.argmax()] / nm:.0f} | {values.max():.3g} |"
            for label, values in several.items()
        ]
    for method in ("rods", "multilayer"):
        table = specular(FEATHER, 0.0, WAVES, method=method)
        peak = float(WAVES[int(table.values.argmax())]) / nm
        lines.append(f"| endless rows, {method} | {peak:.0f} | reflectance {table.values.max():.3g} |")
    return "\n".join([*lines, f"\nMelanin in keratin at 550 nm: {lattice_validity(FEATHER, 550 * nm)}."])


def draw(found: dict[str, dict[str, np.ndarray]]) -> None:
    """A panel each."""
    figure = Figure(figsize=(12.0, 3.4), layout="constrained")
    for ax, (panel, several) in zip(figure.subplots(1, len(found)), found.items(), strict=True):
        for label, values in several.items():
            ax.semilogy(WAVES / nm, values, label=label, linestyle="-" if "rig" in label else "--")
        ax.set_title(panel, fontsize="medium")
        ax.legend(fontsize="x-small")
    figure.supxlabel("wavelength / nm")
    figure.supylabel("BRDF, 0° to 0° / sr⁻¹")
    ft.views.save(figure, FIGURE)


def main() -> None:
    """Trace, compare, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--write", action="store_true", help="put table and figure into docs/study.md")
    write = parser.parse_args().write
    found = curves()
    section = text(found)
    print(section)
    if write:
        draw(found)
        pages.write("feathers", section, PAGE)


if __name__ == "__main__":
    main()
