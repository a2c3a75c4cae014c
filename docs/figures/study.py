"""The 2013 study's lattice done again: what its arithmetic lost, and what that did to its spectra.

    python docs/figures/study.py            print
    python docs/figures/study.py --write    and put table and figure into docs/study.md

The tables are in tests/data/scene_b_far.npz: an exact tracer's rays, and what a transcription of the
study's own listing made of the same scene.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pages
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace.scattering import goniometer

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data" / "scene_b_far.npz"
UNIT = 10e-6
PAGE, FIGURE = pages.DOCS / "study.md", pages.DOCS / "images" / "study.png"
# Pairs of the figure: where most was lost, and where little was.
SHOWN = [(0, 0), (-20, 20), (-40, 40), (-60, 60), (0, 40), (-60, -60), (-40, -40), (-20, -20)]


def lattice() -> ft.Scene:
    """20 x 4 rods of 18 sides, 65 nm, pitch 280 nm, every second row shifted."""
    rods = ft.shapes.rod_lattice(20, 4, 0.0065 * UNIT, 0.028 * UNIT, 0.2 * UNIT)
    return ft.Scene([ft.Surface(rods.moved((0.727 * UNIT, 0.0, 0.0)), ft.Mirror(), "rods")])


def spectra(data, **options) -> np.ndarray:
    """|sum of exp(i k OPL)| on the study's pixels, [ti, to, wavelength], and how many rays."""
    theta = np.deg2rad(data["theta"])

    def source(angle: float, _: float) -> ft.Rays:
        i = int(np.argmin(abs(theta - angle)))
        origin, direction = (np.insert(data[name][i], 1, 0.0, axis=1) for name in ("org", "dir"))
        return ft.Rays(origin * UNIT, direction)

    sums = goniometer.amplitudes(
        lattice(), theta, goniometer.Pixels(theta, 25 * UNIT, 0.56 * UNIT), data["lam_nm"] * 1e-9,
        source=source, centre=(1.0 * UNIT, 0.0, 0.042 * UNIT), half_wave_loss=False, **options,
    )  # fmt: skip
    return np.abs(sums.values[:, 0, :, 0])


def rows(data, ours: np.ndarray) -> list[tuple[str, ...]]:
    """One row a pair with at least 20 rays: rays, rays of the listing, the spectra's difference, peaks."""
    theta, waves = data["theta"].astype(int), data["lam_nm"]
    there = (data["det_nrefl"] > 0).sum(axis=2)
    listing = data["amp_v0_M12"]
    table = []
    for i, o in np.argwhere(there >= 20):
        true, old = ours[i, o], listing[i, o]
        error = np.sqrt(np.mean((true - old) ** 2) / np.mean(true**2))
        seen = int(data["v0_nrec"][i, o])
        false = seen - int(data["v0_matched"][i, o])
        peak = f"{waves[old.argmax()]:.0f}" if seen else "no light"
        table.append(
            (f"{theta[i]} to {theta[o]}", f"{there[i, o]}", f"{seen - false} + {false}", f"{error:.0%}",
             f"{waves[true.argmax()]:.0f}", peak)
        )  # fmt: skip
    return table


def horizontal(data) -> tuple[int, int]:
    """Rays that reach the pixel straight above, and others that meet a horizontal facet on their way."""
    reach, hit = data["det_nrefl"] > 0, data["hit_seg"]
    level = abs(data["segs"][:, 1] - data["segs"][:, 3]) < 1e-9
    met = ((hit >= 0) & level[np.maximum(hit, 0)]).any(axis=-1)
    above = data["theta"] == 0.0
    return int(reach[:, above].sum()), int((reach[:, ~above] & met[:, None]).sum())


def text(data, ours: np.ndarray) -> str:
    """The section of the page."""
    there, seen = (data["det_nrefl"] > 0).sum(axis=2), data["v0_nrec"]
    found = data["v0_matched"]
    error = np.abs(ours - data["amp_all"]).max()
    dark = [(i, o) for i, o in np.argwhere((there >= 20) & (seen == 0))]
    names = ", ".join(f"{data['theta'][i]:.0f} to {data['theta'][o]:.0f}" for i, o in dark)
    up, flat = horizontal(data)
    head = (
        f"Of {there.sum():,} rays that reach a pixel {up:,} go straight up, and {flat:,} others meet a "
        f"horizontal facet. The listing finds {found.sum():,} of them all, and "
        f"{seen.sum() - found.sum()} that do not reach it: {1 - found.sum() / there.sum():.1%} are lost. "
        f"{len(dark)} pairs of 20 rays and more are dark in it: {names} degrees. Ours differ from an "
        f"independent exact tracer's sums by {error:.1g} at most, of up to {data['amp_all'].max():.0f}.\n\n"
        "![Spectra of eight pairs, exact and by the listing](images/study.png)\n\n"
        "| from, to (degrees) | rays | listing: right + wrong | rms difference | peak, nm | listing's |\n"
        "|---|---|---|---|---|---|\n"
    )
    return head + "\n".join("| " + " | ".join(row) + " |" for row in rows(data, ours))


def draw(data, ours: np.ndarray) -> None:
    """Eight pairs: exact, at most one reflection, the listing."""
    figure = Figure(figsize=(12.0, 5.6), layout="constrained")
    theta, waves = data["theta"].astype(int).tolist(), data["lam_nm"]
    once = spectra(data, max_reflections=1)
    for ax, (start, end) in zip(figure.subplots(2, 4, sharex=True).flat, SHOWN, strict=True):
        i, o = theta.index(start), theta.index(end)
        ax.plot(waves, ours[i, o], color="#0072B2", label="all reflections")
        ax.plot(waves, once[i, o], color="#56B4E9", linestyle=":", label="one reflection")
        ax.plot(
            waves, data["amp_v0_M12"][i, o], color="#D55E00", linewidth=0.9, label="the study's arithmetic"
        )
        ax.set_title(f"{start}° to {end}°", fontsize="medium")
        ax.set_ylim(bottom=0.0)
    figure.supxlabel("wavelength / nm")
    figure.supylabel("|sum| over rays")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    ft.views.save(figure, FIGURE)


def main() -> None:
    """Trace, compare, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--write", action="store_true", help="put table and figure into docs/study.md")
    with np.load(DATA) as stored:
        data = dict(stored)
    ours = spectra(data)
    section = text(data, ours)
    print(section)
    if parser.parse_args().write:
        draw(data, ours)
        pages.write("study", section, PAGE)


if __name__ == "__main__":
    main()
