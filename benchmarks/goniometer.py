"""Speed of the goniometer beside a plain numpy tracer, and its cost against rods and wavelengths.

python benchmarks/goniometer.py            print
python benchmarks/goniometer.py --write    and put the table into docs/goniometer.md
python benchmarks/goniometer.py --quick    the small parts only
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import fringetrace as ft
from fringetrace import degree, nm, um
from fringetrace.field import spectral_sum
from fringetrace.scattering import goniometer
from fringetrace.scattering.rod_lattice import RodLattice

sys.path.insert(0, str(Path(__file__).parents[1] / "docs" / "figures"))
import pages

ROUNDS = 3
THETA = np.arange(-60, 61, 20) * degree
WAVES = np.linspace(300, 700, 401) * nm
HALF = 0.64 * degree
PAGE = pages.DOCS / "goniometer.md"


def seconds(call: Callable[[], object]) -> float:
    """Of one call."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def nearest(origin, direction, start, along):
    """The first segment (start + s along, 0 <= s <= 1) that each ray of a plane meets: number, distance."""
    cross = direction[:, :1] * along[:, 1] - direction[:, 1:] * along[:, 0]
    dx = start[:, 0] - origin[:, :1]
    dz = start[:, 1] - origin[:, 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (dx * along[:, 1] - dz * along[:, 0]) / cross
        place = (dx * direction[:, 1:] - dz * direction[:, :1]) / cross
    reach[~((place >= 0.0) & (place <= 1.0) & (reach > 1e-15))] = np.inf
    which = reach.argmin(axis=1)
    return which, reach[np.arange(len(origin)), which]


def plain_trace(origin, direction, start, along, most=100):
    """Every ray against every segment, bounce by bounce, in numpy: path, bounces, last point, direction."""
    origin, direction = origin.copy(), direction.copy()
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    path, bounces, alive = np.zeros(len(origin)), np.zeros(len(origin), dtype=int), np.arange(len(origin))
    for _ in range(most):
        which, reach = nearest(origin[alive], direction[alive], start, along)
        met = np.isfinite(reach)
        alive, which, reach = alive[met], which[met], reach[met]
        if not len(alive):
            break
        origin[alive] += reach[:, None] * direction[alive]
        path[alive] += reach
        bounces[alive] += 1
        n = normal[which]
        direction[alive] -= 2.0 * (direction[alive] * n).sum(axis=1, keepdims=True) * n
    return path, bounces, origin, direction


def plain_table(lattice: RodLattice, rays: int) -> np.ndarray:
    """|sum|^2 of 49 pairs at all wavelengths by plain numpy, in the units of the BRDF."""
    angle = 2.0 * np.pi * np.arange(1, lattice.sides + 1) / lattice.sides
    ring = lattice.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    corners = lattice.centres[:, None] + ring
    start = corners.reshape(-1, 2)
    along = np.roll(corners, -1, axis=1).reshape(-1, 2) - start
    lighting = goniometer.Illumination(lattice.scene, rays=(1, rays))
    outs = np.stack([np.sin(THETA), np.cos(THETA)], axis=1)
    table = np.zeros((len(THETA), len(THETA), len(WAVES)))
    for i, theta in enumerate(THETA):
        light = lighting.light(theta, 0.0)
        path, bounces, origin, direction = plain_trace(
            light.origin[:, ::2], light.direction[:, ::2], start, along
        )
        incident = light.area * rays
        for o, out in enumerate(outs):
            rows = np.flatnonzero((bounces > 0) & (np.hypot(*(direction - out).T) <= 2 * np.sin(HALF / 2)))
            length = path[rows] - origin[rows] @ out
            sign = 1.0 - 2.0 * (bounces[rows] % 2)
            total = light.area * (np.exp(2j * np.pi / WAVES[:, None] * length) @ sign)
            table[i, o] = np.abs(total) ** 2 / (WAVES**2 * np.cos(THETA[o]) * incident)
    return table


def ours(lattice: RodLattice, rays: int, theta=THETA, waves=WAVES, scene: ft.Scene | None = None):
    """The same by the goniometer."""
    scene = lattice.scene if scene is None else scene
    return goniometer.brdf(scene, theta, goniometer.Cones(THETA, HALF), waves, rays=(1, rays))


def beside_numpy(rays: int = 2000) -> list[tuple[str, str]]:
    """49 pairs, 401 wavelengths, 80 rods: seconds of either, and whether they agree."""
    lattice = RodLattice()
    fast, slow, times = ours(lattice, rays), plain_table(lattice, rays), []
    # a ray within rounding of a vertex may go either way: one in thousands
    error = np.abs(np.sqrt(fast.values[:, 0, :, 0]) - np.sqrt(slow)) / np.sqrt(slow.max())
    for _ in range(ROUNDS):
        times.append((seconds(lambda: ours(lattice, rays)), seconds(lambda: plain_table(lattice, rays))))
    ratio = statistics.median(b / a for a, b in times)
    mine, plain = (statistics.median(column) for column in zip(*times, strict=True))
    agreed = float((error.max(axis=2) < 1e-9).mean())
    return [
        ("49 pairs x 401 wavelengths, 80 rods, 2,000 rays an incidence", f"{mine:.2f} s"),
        ("the same by brute force in numpy", f"{plain:.1f} s: {ratio:.0f} times as long"),
        ("pairs whose spectra are equal to 1e-9 of the largest; largest difference of all",
         f"{agreed:.0%}; {error.max():.1e}"),
    ]  # fmt: skip


def fourier() -> list[tuple[str, str]]:
    """The non-uniform FFT beside all exponentials."""
    rng, rows = np.random.default_rng(5), []
    for count in (2_000, 50_000):
        length, amplitude = rng.uniform(0.0, 50 * um, count), np.exp(1j * rng.uniform(0.0, 6.3, count))
        pairs = [
            (
                seconds(lambda x=length, a=amplitude: spectral_sum.spectrum(x, a, WAVES)),
                seconds(lambda x=length, a=amplitude: spectral_sum.direct(x, a, WAVES)),
            )
            for _ in range(ROUNDS)
        ]
        error = np.abs(
            spectral_sum.spectrum(length, amplitude, WAVES) - spectral_sum.direct(length, amplitude, WAVES)
        ).max()
        ratio = statistics.median(b / a for a, b in pairs)
        rows.append(
            (f"spectra of {count:,} rays at 401 wavelengths: all exponentials beside the non-uniform FFT",
             f"{ratio:.0f} times as long; apart by {error / np.sqrt(count):.1e} of the root of the rays")
        )  # fmt: skip
    return rows


def against_rods(rays: int = 100_000) -> list[tuple[str, str]]:
    """Nanoseconds a ray segment, of a trace at 20 degrees, in lattices of more and more rods."""
    times = []
    for columns, rows in ((10, 10), (32, 32), (100, 100)):
        scene = RodLattice(columns, rows).scene
        light = goniometer.Illumination(scene, rays=(1, rays)).light(20 * degree, 0.0)
        count = ft.trace(scene, light, max_bounces=100).segments
        times.append(
            min(seconds(lambda s=scene, r=light: ft.trace(s, r, max_bounces=100)) for _ in range(ROUNDS))
            / count
        )
    shown = ", ".join(f"{1e9 * time:.0f}" for time in times)
    return [("100, 1,024 and 10,000 rods: nanoseconds a ray segment", shown)]


def against_wavelengths(rays: int = 100_000) -> list[tuple[str, str]]:
    """Seconds of a whole incidence at more and more wavelengths."""
    lattice, times = RodLattice(), []
    scene = lattice.scene
    for count in (1, 40, 400, 4000):
        waves = np.linspace(300, 700, count) * nm
        times.append(
            min(seconds(lambda w=waves: ours(lattice, rays, THETA[4:5], w, scene)) for _ in range(ROUNDS))
        )
    shown = ", ".join(f"{time / times[0]:.2f}" for time in times)
    return [
        ("1, 40, 400 and 4,000 wavelengths, 100,000 rays: time of an incidence beside that of one", shown)
    ]


def large(rays: int = 2_000_000) -> list[tuple[str, str]]:
    """10,000 rods of 54 sides, 2 million rays an incidence, all 49 pairs."""
    lattice = RodLattice(200, 50, sides=54)
    start = time.perf_counter()
    scene = lattice.scene
    table = ours(lattice, rays, scene=scene)
    whole = time.perf_counter() - start
    triangles = len(scene.surfaces[0].mesh.faces)
    return [
        (f"49 pairs x 401 wavelengths, 10,000 rods, {triangles / 1e6:.1f}M triangles, {rays:,} rays each",
         f"{whole:.0f} s; power unaccounted for {table.power_unaccounted:.0e}, cut off after 100 bounces "
         f"{float(table.truncated.max()):.1e}"),
    ]  # fmt: skip


def main() -> None:
    """Run all, print all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--write", action="store_true", help="put the table into docs/goniometer.md")
    parser.add_argument("--quick", action="store_true", help="without the large lattice")
    chosen = parser.parse_args()
    if chosen.write and chosen.quick:
        parser.error("--write: expected a run of all parts, got --quick")
    rows = [(f"`benchmarks/goniometer.py`, {os.cpu_count()} cores", ""), ("---", "---")]
    for part in (
        beside_numpy,
        fourier,
        against_rods,
        against_wavelengths,
        *([] if chosen.quick else [large]),
    ):
        rows += part()
        print(*rows[-1], sep=": ", flush=True)
    text = "\n".join(f"| {' | '.join(row)} |".replace("  |", " |") for row in rows)
    print(text)
    if chosen.write:
        pages.write("goniometer", text, PAGE)


if __name__ == "__main__":
    main()
