"""Compile the kernels that tests need, in two halves that know nothing of each other.

python tests/compiled.py rays | light: run by conftest before tests on several workers, one on each core. What
is found compiled already is loaded.
"""

import sys
from dataclasses import replace

import arrivals
import numpy as np

import fringetrace as ft
from fringetrace import mm, nm

WAVELENGTH = 632.8 * nm


def rays():
    """Kernels that trace: mirrors, benches, glass and its films; and the sum over rays."""
    film = ft.films.Film(((1.38, 100 * nm),))
    ft.films.transmittance(film, 1.0, 1.5, 0.1, WAVELENGTH)
    flat = ft.shapes.plate(8 * mm, 8 * mm)
    bench = ft.instruments.michelson(flat, aperture=6 * mm, pixels=(6, 8), method="rays")
    bench.interferogram(WAVELENGTH)
    bench.trace().pixel  # where they land
    beam = ft.Beam((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), (1 * mm, 1 * mm), (9, 9))
    mirror = ft.Scene([ft.Surface(flat, ft.Mirror())])
    for record in (False, True):
        ft.trace(mirror, beam, record=record)
    slab = ft.shapes.plate(2 * mm, 2 * mm, 0.1 * mm)
    for interface in (ft.Dielectric(), ft.Dielectric(film=film)):
        scene = ft.Scene([ft.Surface(slab, interface, back=1.5)])
        ft.trace(scene, beam, wavelength=WAVELENGTH)
        ft.trace(scene, replace(beam, polarisation=np.array([1.0, 0.0j])), wavelength=WAVELENGTH)


def light():
    """Kernels that make light on pixels of rays: flat waves, curved ones, folds."""
    flat = ft.shapes.plate(8 * mm, 8 * mm)
    bench = ft.instruments.michelson(flat, aperture=6 * mm, pixels=(6, 8), method="wavefront")
    bench.interferogram(WAVELENGTH)
    radius, tilt = 20 * mm, 0.13
    z = 0.5 * radius * np.cos(tilt) * (1 + 2 * np.sin(tilt) ** 2)
    beam = ft.Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (6.8 * mm, 6.8 * mm), (40, 40))
    ccd = ft.CCD((0, 0, z), (0, 0, 1), (0, 1, 0), 2.6 * radius * np.sin(tilt) ** 3 / 40, (40, 40))
    paths = arrivals.reflected(beam, ccd, arrivals.sphere(radius))
    ft.complex_field(paths, WAVELENGTH, "wavefront")
    ft.irradiance(paths, WAVELENGTH, "wavefront")


if __name__ == "__main__":
    {"rays": rays, "light": light}[sys.argv[1]]()
