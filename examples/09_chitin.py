"""
The index of chitin by a Jamin-Lebedeff interferometer
======================================================

Two polarised beams, one through the flake and one beside it, are joined by calcite. The paths that the flake adds
at seven wavelengths give its dispersion back.
"""

import numpy as np
from matplotlib.figure import Figure

import fringetrace as ft
from fringetrace import degree, nm, um

thickness, oil, chitin, calcite = 1 * um, 1.52, ft.materials.CHITIN, (ft.materials.CALCITE_O.index, ft.materials.CALCITE_E.index)
flake = ft.shapes.extrude(6 * um * np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)]), 14 * um, closed=True)
