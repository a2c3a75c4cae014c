"""A plane mirror behind narrow absorbers: traced paths with features between the nodes of the beam's grid."""

import fringetrace as ft
from fringetrace import mm, um
from fringetrace.geometry import shapes


def traced(*blockers, count=6):
    """A plane mirror of a beam of 3 mm, behind absorbers; cells of 0.5 mm."""
    flat = ft.Surface(shapes.plate(20 * mm, 20 * mm), ft.Mirror(), "flat")
    beam = ft.Beam((0, 0, 9 * mm), (0, 0, -1), (0, 1, 0), (3 * mm, 3 * mm), (count, count))
    ccd = ft.CCD((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), 0.1 * mm, (40, 40))
    return ft.trace(ft.Scene([flat, *blockers]), beam, ccd)


def tape(x, width=20 * um):
    return ft.Surface(shapes.plate(width, 20 * mm).moved((x, 0, 7 * mm)), ft.Absorber(), "tape")
