"""How far each bench is off its truth: printed, or with `--write` put into docs/benches.md."""

from __future__ import annotations

import math
import sys

import numpy as np
import pages
from imaged import refocused, waves

from fringetrace import Dielectric, Mirror, Surface, instruments, mm, nm, um
from fringetrace.geometry import forms
from fringetrace.geometry.shapes import extrude, icosphere, plate
from fringetrace.optics.materials.named_materials import BK7, CALCITE_E, CALCITE_O, CHITIN
from fringetrace.scene.spectrum import Line, Spectrum

RED, HENE, SODIUM = 633 * nm, 632.8 * nm, 589.3 * nm
CELL, WATER = 1.38, 1.335


def arms(bench, wavelength):
    """Rays by the sample, and the path of the reference."""
    seen = bench.trace(wavelength).detected
    visits = seen.visits(bench.arms.reference.surface)
    return seen.where(visits == 0), seen.where(visits == 1).length.mean()


def rod(radius):
    """A cylinder along y."""
    angle = np.linspace(0.0, 2 * np.pi, 361)[:-1]
    mesh = extrude(radius * np.stack([np.cos(angle), np.sin(angle)], axis=1), 4 * radius, closed=True)
    form = forms.Cylinder((0, 0, 0), (0, 1, 0), radius)
    return Surface(mesh, Dielectric("transmitted"), "rod", form, back=CELL)


def slab():
    """5 um of a cell in water, straight on."""
    bench = instruments.mach_zehnder(
        plate(60 * um, 60 * um, 5 * um), aperture=20 * um, index=CELL, medium=WATER, pixels=(4, 4)
    )
    off = np.abs(bench.path_difference(RED) - 0.225 * um).max() / RED
    return "Mach-Zehnder", "slab of 5 um, 0.225 um of path, by phase steps", f"{off:.1e} waves"


def cylinder():
    """Rays through a form against the closed form."""
    sample, reference = arms(
        instruments.mach_zehnder(rod(10 * um), aperture=18 * um, medium=WATER, na=0.8, pixels=(1, 90)), RED
    )
    start = (44.5 - sample.ray) * 0.2 * um
    place, path = refocused(np.abs(start), 10 * um, CELL, WATER)
    x = np.abs(sample.pixel[:, 1] - 45) * 0.2 * um
    off = max(np.abs(x - place).max(), np.abs(sample.length - reference - path).max()) / RED
    return "Mach-Zehnder", "cylinder of 10 um by its form, refocused: position and path", f"{off:.1e} waves"


def balls():
    """Facets against the form."""
    for level in (3, 4, 5):
        bench = instruments.mach_zehnder(
            icosphere(10 * um, level), aperture=8 * um, index=CELL, medium=WATER, pixels=(24, 24)
        )
        rays, reference = arms(bench, RED)
        height = np.hypot(*((rays.pixel - 12) * bench.ccd.pitch).T)
        place, path = refocused(np.linspace(0.0, 6 * um, 1001), 10 * um, CELL, WATER)
        off = np.std(rays.length - reference - np.interp(height, place, path)) / RED
        faces = len(icosphere(1.0, level).faces)
        yield "Mach-Zehnder", f"ball of 10 um by {faces:,} facets, rms about its mean", f"{off:.1e} waves"


def cylinders():
    """Recorded fields against waves."""
    for radius, na in ((50 * um, 0.8), (10 * um, 0.8), (50 * um, 0.3)):
        bench = instruments.mach_zehnder(
            rod(radius), aperture=1.8 * radius, medium=WATER, na=na, pixels=(1, 181)
        )
        rays, reference = arms(bench, RED)
        x = (rays.pixel[:, 1] - 90.5) * bench.ccd.pitch
        inner = np.abs(x) <= 0.8 * radius
        for name, parallel in (("E", True), ("H", False)):
            wave = waves(x[inner], radius, CELL, WATER, RED, na, parallel)
            phase = 2 * np.pi * (rays.length[inner] - reference) / RED
            off = np.angle(np.exp(1j * phase) / wave)
            what = f"cylinder of {radius / um:.0f} um, NA {na}, against waves ({name} along it), within 0.8 R"
            yield (
                "Mach-Zehnder", what,
                f"{np.sqrt(np.mean(off**2)):.4f} rad rms, {np.abs(off).max():.4f} at most",
            )  # fmt: skip


def airy():
    """Two glass plates."""
    gap = 1000.25 * HENE
    glass = Surface(plate(8 * mm, 8 * mm), Dielectric(), "sample", front=1.0, back=1.5)
    bench = instruments.fizeau(glass, aperture=1 * mm, gap=gap, pixels=(2, 2), min_amplitude=0.0)
    turn = np.exp(4j * np.pi * gap / HENE)
    truth = abs(0.2 * (1 - turn) / (1 - 0.04 * turn)) ** 2
    off = np.abs(4 * bench.interferogram(HENE) - truth).max() / truth
    yield "Fizeau", "two glass plates, Airy's sum, 7 round trips", f"{off:.1e} of the irradiance"
    for angle, between, spacing in ((50e-6, 1.0, 6328.0), (math.radians(10 / 3600), 1.515, 4307.735)):
        bench = instruments.fizeau(
            Surface(plate(8 * mm, 8 * mm), Mirror(), "flat"), aperture=3 * mm, gap=20 * um, between=between,
            glass=1.52, reference_tilt=(angle, 0.0), pixels=(4, 32),
        )  # fmt: skip
        turns = np.unwrap(np.angle(bench.mutual(HENE)[1, 0, 2]))[1:-1]
        found = 2 * np.pi * 29 * bench.ccd.pitch / abs(turns[-1] - turns[0]) / um
        yield (
            "Fizeau",
            f"wedge of {angle * 1e6:.3g} urad, n = {between}: fringes {spacing} um",
            f"{found:.3f} um",
        )


def jamin():
    """The analyser's law, and chitin."""
    n = WATER + SODIUM / (2 * math.pi) / um
    slab = plate(24 * um, 24 * um, 1 * um)
    bench = instruments.jamin_lebedeff(slab, aperture=20 * um, index=n, medium=WATER, pixels=(3, 4))
    off = np.abs(bench.path_difference(SODIUM) * 2 * math.pi / SODIUM - 1.0).max()
    yield "Jamin-Lebedeff", "delay of 1 rad, by phase steps", f"{off:.1e} rad"
    sample = Surface(slab, Dielectric("transmitted"), "chitin", back=CHITIN)
    bench = instruments.jamin_lebedeff(
        sample, aperture=20 * um, medium=1.52, crystal=(CALCITE_O.index, CALCITE_E.index), pixels=(3, 4)
    )
    lines = np.array([400, 450, 500, 550, 600]) * nm
    paths = np.array([bench.path_difference(line).mean() for line in lines])
    a, b = np.linalg.lstsq(np.stack([np.ones(5), (nm / lines) ** 2], axis=1), 1.52 + paths / um)[0]
    off = max(abs(a / 1.517 - 1), abs(b / 8800 - 1))
    yield "Jamin-Lebedeff", "Cauchy's A and B of chitin from five wavelengths", f"{off:.1e} of them"


def michelson():
    """Coherence, and real plates."""

    def flat(piston, **options):
        return instruments.michelson(
            plate(4 * mm, 4 * mm), aperture=1 * mm, pixels=(2, 2), piston=piston, **options
        )

    def visibility(bench, light):
        frames = bench.phase_steps(light)
        return 2.0 * np.hypot(frames[0] - frames[2], frames[1] - frames[3]) / frames.sum(axis=0)

    line = Line(550 * nm, 10 * nm)
    off = max(
        np.abs(visibility(flat(0.5 * path), line) - abs(line.coherence(path))).max()
        for path in np.array([0.0, 5.0, 13.348454, 20.0, 40.0]) * um
    )
    yield "Michelson", "visibility of a line of 10 nm at 550 nm, paths to 40 um", f"{off:.1e}"
    doublet = Spectrum(np.array([588.995, 589.592]) * nm, np.ones(2))
    dark = visibility(flat(0.5 * 290.843166 * um, arm=4 * mm), doublet).max()
    yield "Michelson", "sodium's lines out of step, mirror moved by 145.42 um", f"{dark:.1e}"
    plate_of_glass = instruments.SplitterPlate(2 * mm)
    bench = flat(0.0, splitter=plate_of_glass, arm=12 * mm)
    seen = bench.trace(RED).detected
    strong = seen.where(np.abs(seen.amplitude) > 0.3)
    arm, n = strong.visits(bench.arms.reference.surface), BK7.index(RED).real
    added = 4 * mm * (math.sqrt(n * n - 0.5) - math.sqrt(0.5))
    off = abs(strong.length[arm == 0].mean() - strong.length[arm == 1].mean() - added) / RED
    yield (
        "Michelson",
        f"splitter of 2 mm BK7, no compensator: {added / um:.3f} um of path",
        f"{off:.1e} waves",
    )
    keys = len(np.unique(seen.key)) - 2
    yield (
        "Michelson",
        "the same: path keys of ghosts, power unaccounted for",
        f"{keys}, {bench.trace(RED).ledger().error:.1e}",
    )


def main() -> None:
    """Print the table, or put it into the page."""
    rows = [slab(), cylinder(), *balls(), *cylinders(), *airy(), *jamin(), *michelson()]
    table = "\n".join(
        ["| bench | truth | off by |", "|---|---|---|", *(f"| {' | '.join(row)} |" for row in rows)]
    )
    if "--write" in sys.argv:
        pages.write("benches", table, pages.DOCS / "benches.md")
    else:
        print(table)


if __name__ == "__main__":
    main()
