"""Colours of rays and surfaces, for any colour vision and a white background."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray
from fringetrace.optics import Absorber, BeamSplitter, Dielectric, Metal, Mirror
from fringetrace.scene import Surface
from fringetrace.tracing import Fate
from fringetrace.views.scene3d.polylines import Strands

# Okabe and Ito's colours, told apart with any colour vision; the last one is for all the rest.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C8C8C")
FATES = ("#0072B2", "#E69F00", "#000000", "#CC79A7", "#8C8C8C")
# Anchors of matplotlib's maps; twilight with less contrast, so that lines show on white.
VIRIDIS = (
    "#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725",
)  # fmt: skip
CIVIDIS = (
    "#00224e", "#1a386f", "#434e6c", "#61656f", "#7d7c78", "#9b9476", "#bcae6c", "#dec958", "#fee838",
)  # fmt: skip
TWILIGHT = (
    "#b8b2b9", "#a4abaf", "#849aa6", "#6c85a2", "#616f9d", "#5f5594", "#5b3b80", "#4d2c5d", "#3f2c44",
    "#512c4b", "#6d3354", "#864355", "#985956", "#a37362", "#a98e7c", "#b2a6a0", "#b8b2b9",
)  # fmt: skip
WAYS = ("route", "beam", "bounce", "length", "phase", "fate", "power")
# What surfaces look like: name, colour, opacity.
KINDS: tuple[tuple[type, str, str, float], ...] = (
    (Mirror, "mirror", "#B8B8B8", 1.0),
    (BeamSplitter, "beam splitter", "#9CC9E8", 0.35),
    (Absorber, "absorber", "#484848", 1.0),
    (Dielectric, "glass", "#7FD4C1", 0.3),
    (Metal, "metal", "#D9B64E", 1.0),
)
ELEMENT = "thin element", "#CC79A7", 0.35
OTHER = "surface", "#E0D8C8", 1.0
SHADES = ("#8FB8DE", "#E3B58A", "#8CCBB0", "#E2B3CE", "#F0D48A", "#BBB6E3", "#C9C9C9")


@dataclass(frozen=True)
class Scale:
    """Colour scale of rays.

    Parameters
    ----------
    title : str
        With the unit.
    colours : tuple of str
        Anchors from the low end to the high one, equally spaced; or one for each name.
    low, high : float
    names : tuple of str
        Of values 0, 1, ...; empty if these run on continuously.
    """

    title: str
    colours: tuple[str, ...]
    low: float = 0.0
    high: float = 1.0
    names: tuple[str, ...] = ()

    def table(self, count: int = 256) -> npt.NDArray[np.uint8]:
        """Colours from the low to the high end (or one per name), (count, 3): red, green, blue."""
        anchors = np.array([[int(c[i : i + 2], 16) for i in (1, 3, 5)] for c in self.colours])
        if self.names:
            return anchors.astype(np.uint8)
        at = np.linspace(0.0, len(anchors) - 1.0, count)
        columns = [np.interp(at, np.arange(len(anchors)), column) for column in anchors.T]
        return np.round(np.stack(columns, axis=1)).astype(np.uint8)


def checked_colouring(way: str, strands: Strands | None) -> str:
    """Checked name of a colouring that is possible for the paths.

    Parameters
    ----------
    way : str
    strands : Strands, optional

    Returns
    -------
    str

    Raises
    ------
    ValueError
        If there is no such way; for phases without a wavelength.
    """
    if way not in WAYS:
        names = ", ".join(repr(name) for name in WAYS[:-1])
        raise ValueError(f"colour: expected {names} or {WAYS[-1]!r}, got {way!r}")
    if way == "phase" and strands is not None and not len(strands.wavelengths):
        raise ValueError("colour: expected a wavelength for 'phase', got None")
    return way


def scale(strands: Strands, way: str, unit: str, metres: float) -> Scale:
    """Colour scale of the rays for a colouring.

    Parameters
    ----------
    strands : Strands
    way : {"route", "beam", "bounce", "length", "phase", "fate", "power"}
    unit : str
        In which lengths are shown.
    metres : float
        How long one of it is.

    Returns
    -------
    Scale
    """
    if way == "route":
        return Scale("surfaces met", COLOURS[: len(strands.routes)], names=strands.routes)
    if way == "beam":
        names = tuple(f"beam {number + 1}" for number in range(int(strands.beam.max(initial=0)) + 1))
        return Scale("beam", tuple(COLOURS[n % len(COLOURS)] for n in range(len(names))), names=names)
    if way == "fate":
        fates = np.unique(strands.fate).tolist()
        names = tuple(Fate(fate).name.lower() for fate in fates)
        return Scale("where paths end", tuple(FATES[fate] for fate in fates), names=names)
    if way == "bounce":
        return Scale("surfaces met before", VIRIDIS, 0.0, max(1.0, float(strands.bounces.max(initial=0))))
    if way == "phase":
        return Scale("phase in turns", TWILIGHT)
    if way == "power":
        return Scale("power at the end", VIRIDIS, 0.0, float(strands.power.max(initial=0.0)) or 1.0)
    longest = strands.opl[np.isfinite(strands.opl)].max(initial=0.0)
    return Scale(f"optical path / {unit}", CIVIDIS, 0.0, float(longest) / metres or 1.0)


def values(
    strands: Strands, way: str, metres: float, *, wavelength: int | None = None, step: float = 0.0
) -> FloatArray:
    """Values to be coloured, at the start and the end of each segment.

    Parameters
    ----------
    strands : Strands
    way : str
        As in `scale`.
    metres : float
    wavelength : int, optional
        Number of that of a phase; default: that of the picture.
    step : float, radians
        Phase added to what steps turn.

    Returns
    -------
    (legs, 2) float64
        The phase of a leg is that where it ends.
    """
    path, bounce = strands.legs()
    if way == "length":
        return np.stack([strands.opl[path, bounce], strands.opl[path, bounce + 1]], axis=1) / metres
    if way == "phase":
        at = strands.chosen if wavelength is None else wavelength
        turns = strands.phase[at] + strands.steps * (step / (2.0 * np.pi))
        flat = np.mod(turns[path, bounce + 1], 1.0)
    elif way == "bounce":
        flat = bounce.astype(np.float64)
    elif way == "fate":
        flat = np.unique(strands.fate, return_inverse=True)[1].astype(np.float64)[path]
    else:
        flat = np.asarray(getattr(strands, way), dtype=np.float64)[path]
    return np.repeat(flat[:, None], 2, axis=1)


def look(surface: Surface) -> tuple[str, str, float]:
    """Appearance of a surface by its interface.

    Parameters
    ----------
    surface : Surface

    Returns
    -------
    kind : str
    colour : str
    opacity : float
    """
    for kind, name, colour, opacity in KINDS:
        if isinstance(surface.interface, kind):
            return name, colour, opacity
    return OTHER if surface.element is None else ELEMENT
