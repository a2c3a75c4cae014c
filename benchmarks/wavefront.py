"""Irradiance error of the ray sum and of the wavefront method against rays and seconds; prints a table."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.vectors import rotation

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import arrivals

WAVELENGTH = 632.8 * nm
PIXELS = 256


def paraboloid(count: int) -> tuple[ft.Paths, np.ndarray]:
    """A paraboloid of f = 50 mm, seen 30 mm before its focus; the truth by 4 x 4 Gauss points."""
    focal, z, side = 50 * mm, 20 * mm, 2 * mm
    beam = ft.Beam((0, 0, 30 * mm), (0, 0, -1), (0, 1, 0), (3.6 * mm, 3.6 * mm), (count, count))
    ccd = ft.CCD((0, 0, z), (0, 0, -1), (0, 1, 0), side / PIXELS, (PIXELS, PIXELS))
    nodes, weights = np.polynomial.legendre.leggauss(4)
    x = ((np.arange(PIXELS)[:, None] + 0.5 + 0.5 * nodes).ravel() - 0.5 * PIXELS) * ccd.pitch
    rho, depth = np.hypot(x, x[:, None]), focal - z
    angle = np.arctan2(rho, depth)
    grow = focal / np.cos(angle / 2) ** 2 * depth / (rho**2 + depth**2)
    bright = (2 * focal * np.tan(angle / 2) / rho * grow).reshape(PIXELS, 4, PIXELS, 4)
    truth = np.einsum("iajb,a,b->ij", bright, weights / 2, weights / 2)
    return arrivals.reflected(beam, ccd, arrivals.paraboloid(focal)), truth


def slanted_step(count: int) -> tuple[ft.Paths, np.ndarray]:
    """A step of 50 nm at 0.3 rad to the pixels in a Michelson; the truth by areas."""
    width, rise, turn = 6 * mm, 50 * nm, 0.3
    mesh = ft.shapes.step(4 * width, 4 * width, 0.4 * mm, rise).moved(turn=rotation((0, 0, 1), turn))
    bench = ft.instruments.michelson(mesh, aperture=width, pixels=(PIXELS, PIXELS))
    paths = ft.trace(bench.scene, replace(bench.beam, shape=(count, count)), bench.ccd)
    slope = -math.tan(turn)
    across = np.arange(PIXELS) - 0.5 * PIXELS
    at = 0.4 * mm / math.cos(turn) * PIXELS / width + slope * across[:, None] - across
    lower = (_covered(at + slope) - _covered(at)) / slope
    return paths, lower + (1 - lower) * math.cos(2 * math.pi * rise / WAVELENGTH) ** 2


def _covered(u: np.ndarray) -> np.ndarray:
    return np.where(u < 0, 0.0, np.where(u < 1, 0.5 * u * u, u - 0.5))


def valley(count: int) -> tuple[ft.Paths, np.ndarray]:
    """Two mirrors tilted towards each other by 0.2 mrad: fringes where their light overlaps."""
    height, angle, pitch = 2.0, 0.2e-3, 16e-6
    slope = math.tan(angle)
    mesh = ft.shapes.extrude([(-9 * mm, 9 * mm * slope), (0, 0), (9 * mm, 9 * mm * slope)], 30 * mm)
    beam = ft.Beam((0, 0, 1.5), (0, 0, -1), (0, 1, 0), (6 * mm, 6 * mm), (count, count))
    ccd = ft.CCD((0, 0, height), (0, 0, -1), (0, 1, 0), pitch, (PIXELS, PIXELS))
    paths = ft.trace(ft.Scene([ft.Surface(mesh, ft.Mirror())]), beam, ccd)
    sides = (np.arange(PIXELS + 1) - 0.5 * PIXELS) * pitch
    rim, k = height * math.tan(2 * angle), 4 * math.pi * math.sin(2 * angle) / WAVELENGTH
    total = np.minimum(sides, rim) + np.maximum(sides, -rim) + 2 * np.sin(k * np.clip(sides, -rim, rim)) / k
    return paths, np.tile(math.cos(2 * angle) * np.diff(total) / pitch, (PIXELS, 1))


def runs(scene: Callable[[int], tuple[ft.Paths, np.ndarray]]) -> Iterator[tuple[str, int, float, float]]:
    """Method, rays, seconds of the sum alone, and rms error relative to the mean."""
    for count in (8, 16, 32, 64):
        paths, truth = scene(count)
        ft.irradiance(paths, WAVELENGTH)  # compiles
        start = time.perf_counter()
        image = ft.irradiance(paths, WAVELENGTH)
        yield "wavefront", count**2, time.perf_counter() - start, _rms(image, truth)
    for count in (PIXELS, 4 * PIXELS):
        start = time.perf_counter()
        paths, truth = scene(count)
        image = np.abs(ft.complex_field(paths, WAVELENGTH)) ** 2
        yield "rays", count**2, time.perf_counter() - start, _rms(image, truth)


def _rms(image: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(np.mean((image - truth) ** 2)) / truth.mean())


def main() -> None:
    """Print the table."""
    print(f"{PIXELS} x {PIXELS} pixels; seconds: wavefront with its own rays, ray sum with its trace")
    print(f"{'scene':14}{'method':12}{'rays':>10}{'seconds':>10}{'rms error':>12}")
    for scene in (paraboloid, slanted_step, valley):
        for method, rays, seconds, error in runs(scene):
            print(f"{scene.__name__:14}{method:12}{rays:10d}{seconds:10.3f}{error:12.1e}")


if __name__ == "__main__":
    main()
