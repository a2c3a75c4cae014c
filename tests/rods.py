"""Rods in keratin: the feathers of peacocks as the literature gives them."""

import numpy as np

from fringetrace import nm
from fringetrace.rigorous.cylinder_gratings import CylinderGratings, Row


def keratin(wavelength):
    """Leertouwer, Wilts and Stavenga, Opt. Express 19, 24061 (2011)."""
    return 1.532 + 5890 / (wavelength / nm) ** 2


def melanin(wavelength):
    """Stavenga et al., PLoS ONE 7, e49743 (2012)."""
    return 1.648 + 23700 / (wavelength / nm) ** 2 + 0.56j * np.exp(-wavelength / nm / 270)


# layer period, pitch, cortex, rod diameter, air-channel diameter (nm), layers:
# R1 to R6 Freyer and Stavenga, Faraday Discuss. 223, 49 (2020): black-violet, blue-green, brown,
# green-yellow, purple, brass-green; the next four after Zi et al., PNAS 100, 12576 (2003), but without
# their air channels
FEATHERS = {
    "R1": (140, 150, 100, 100, 33, 10),
    "R2": (160, 170, 100, 110, 33, 9),
    "R3": (190, 150, 70, 110, 50, 5),
    "R4": (195, 150, 130, 120, 55, 5),
    "R5": (185, 190, 140, 100, 70, 3),
    "R6": (185, 160, 130, 120, 70, 4),
    "blue": (140, 140, 100, 0.72 * 140, 0, 10),
    "green": (150, 150, 100, 0.72 * 150, 0, 10),
    "yellow": (165, 165, 100, 0.72 * 165, 0, 6),
    "brown": (185, 150, 100, 0.72 * 150, 0, 4),
    "study": (150, 150, 100, 130, 0, 10),
}


def feather(period, pitch, cortex, rod, channel, layers, index=melanin, host=keratin, back=None):
    """Air, cortex down to the first rods, rods below one another, air channels half-way between four."""
    first = cortex + rod / 2
    rows = [Row((first + j * period) * nm, rod / 2 * nm, index) for j in range(layers)]
    if channel:
        rows += [
            Row((first + (j + 0.5) * period) * nm, channel / 2 * nm, 1.0, pitch / 2 * nm)
            for j in range(layers - 1)
        ]
    return CylinderGratings(pitch * nm, (cortex + rod + (layers - 1) * period) * nm, rows, host, 1.0, back)
