"""Compile the kernels that most tests need, in two halves that know nothing of each other.

python tests/compiled.py rays | light: run by conftest before all tests, one on each core. What is found
compiled already is loaded.
"""

import sys
from dataclasses import replace

import arrivals
import numpy as np

import fringetrace as ft
from fringetrace import mm, nm


def rays():
    """Kernels that trace: mirrors, benches, glass."""
    flat = ft.shapes.plate(8 * mm, 8 * mm)
    ft.instruments.michelson(flat, aperture=6 * mm, pixels=(6, 8)).trace()
    beam = ft.Beam((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), (1 * mm, 1 * mm), (9, 9))
    mirror = ft.Scene([ft.Surface(flat, ft.Mirror())])
    for record in (False, True):
        ft.trace(mirror, beam, record=record)
    slab = ft.Scene([ft.Surface(ft.shapes.plate(2 * mm, 2 * mm, 0.1 * mm), ft.Dielectric(), back=1.5)])
    ft.trace(slab, beam)
    ft.trace(slab, replace(beam, polarisation=np.array([1.0, 0.0j])))


def light():
    """Kernels that make light on pixels of rays, folds among it."""
    radius, tilt = 20 * mm, 0.13
    z = 0.5 * radius * np.cos(tilt) * (1 + 2 * np.sin(tilt) ** 2)
    beam = ft.Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (6.8 * mm, 6.8 * mm), (40, 40))
    ccd = ft.CCD((0, 0, z), (0, 0, 1), (0, 1, 0), 2.6 * radius * np.sin(tilt) ** 3 / 40, (40, 40))
    paths = arrivals.reflected(beam, ccd, arrivals.sphere(radius))
    ft.complex_field(paths, 632.8 * nm, "wavefront")
    ft.irradiance(paths, 632.8 * nm, "wavefront")


if __name__ == "__main__":
    {"rays": rays, "light": light}[sys.argv[1]]()
