"""Description of one path in words: surfaces, lengths, phase and power."""

from __future__ import annotations

import numpy as np

from fringetrace.core import FloatArray, nm, unit_of
from fringetrace.tracing import Fate, Paths
from fringetrace.views.scene3d.polylines import Strands, strands

ENDS = {
    Fate.DETECTED: "reaches the CCD", Fate.LEFT: "leaves", Fate.ABSORBED: "is absorbed",
    Fate.TRUNCATED: "is cut off (too many surfaces)", Fate.FAINT: "is cut off (too faint)",
}  # fmt: skip

# Coordinates of a point that are smaller beside the others are roundings.
NOTHING = 1e-12


def describe_path(paths: Paths, row: int, wavelength: float | None = None) -> str:
    """Describe one path in words: places, surfaces, lengths, phase and power.

    Parameters
    ----------
    paths : Paths
        Traced with record=True.
    row : int
    wavelength : float, metres, optional
        Of the phase; None: that of the trace, if it has one.

    Returns
    -------
    str
        Some lines; lengths in a unit that suits the path.

    Raises
    ------
    IndexError
        If there is no such path.
    ValueError
        If the paths have no recorded points; for a wavelength that takes a new trace.
    """
    if not -len(paths) <= row < len(paths):
        raise IndexError(f"itinerary row: expected one of {len(paths)} paths, got {row}")
    return describe_polyline(strands(paths.where(np.array([row])), wavelength, every=True), 0)


def describe_polyline(shown: Strands, number: int, wavelength: int | None = None, step: float = 0.0) -> str:
    """Describe one of the sampled paths in words.

    Parameters
    ----------
    shown : Strands
    number : int
        Which of them.
    wavelength : int, optional
        Number of that of the phase; default: that of the picture.
    step : float, radians
        Phase step.

    Returns
    -------
    str
    """
    fate, bounces = Fate(int(shown.fate[number])), int(shown.bounces[number])
    last = bounces + (fate == Fate.DETECTED)
    points, opl = shown.points[number], shown.opl[number]
    unit, metres = unit_of(0.1 * float(np.abs(points[: last + 1]).max()))
    beam = f" of beam {shown.beam[number] + 1}" if shown.beam.any() else ""
    lines = [f"ray {shown.ray[number]}{beam} {ENDS[fate]}; lengths in {unit}"]
    lines.append(f"start at {_place(points[0], metres)}")
    for bounce in range(bounces):
        name = shown.surfaces[shown.surface[number, bounce]]
        stops = bounce + 1 == bounces and fate == Fate.ABSORBED
        does = "absorbed by" if stops else "through" if shown.through[number, bounce] else "off"
        lines.append(f"{bounce + 1}. {does} {name} at {_place(points[bounce + 1], metres)}")
        lines.append(_leg(shown, number, bounce, metres))
    if fate == Fate.DETECTED:
        lines.append(f"{bounces + 1}. CCD at {_place(points[last], metres)}")
        lines.append(_leg(shown, number, bounces, metres).partition(";")[0])
    where = " (to its plane of focus)" if fate == Fate.DETECTED and shown.focused else ""
    lines.append(f"optical path {opl[last] / metres:.9g} {unit}{where}")
    lines += _phase(shown, number, last, wavelength, step)
    return "\n".join([*lines, f"power {shown.power[number]:.6g} of the launched"])


def _place(point: FloatArray, metres: float) -> str:
    shown = np.where(np.abs(point) > NOTHING * np.abs(point).max(), point, 0.0) / metres
    return "(" + ", ".join(f"{x:.5g}" for x in shown) + ")"


def _leg(shown: Strands, number: int, leg: int, metres: float) -> str:
    way = np.linalg.norm(shown.points[number, leg + 1] - shown.starts[number, leg]) / metres
    index = shown.index[number, leg]
    medium = "" if index == 1.0 else f", index {index:.6g}"
    return f"    after {way:.7g}{medium}; optical path so far {shown.opl[number, leg + 1] / metres:.9g}"


def _phase(shown: Strands, number: int, last: int, wavelength: int | None, step: float) -> list[str]:
    if not len(shown.wavelengths):
        return []
    at = shown.chosen if wavelength is None else wavelength
    turns = shown.phase[at, number, last] + shown.steps[number, last] * step / (2.0 * np.pi)
    turns = round(float(turns), 4) % 1.0
    return [f"phase {turns:.4f} turns = {360.0 * turns:.1f}° at {shown.wavelengths[at] / nm:.6g} nm"]
