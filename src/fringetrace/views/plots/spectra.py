"""Plots of spectra over the colours of their wavelengths, and of run time against error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, nm
from fringetrace.scattering import colour as colours

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure
    from xarray import DataArray

# Colours that colour-blind people tell apart (Okabe and Ito), with a mark and a line for each.
STYLES = (
    ("#999999", "x", ":"), ("#E69F00", "o", "--"), ("#56B4E9", "s", "--"), ("#D55E00", "^", "-"),
    ("#0072B2", "D", "-"), ("#009E73", "v", "-"), ("#CC79A7", "P", "-"),
)  # fmt: skip
# The strongest of them first, for a few curves.
STRONG = (3, 4, 5, 6, 1, 2, 0)
# Room around curves on logarithmic axes, a factor.
MARGIN = 2.0
# Spectral colours are shown this bright, of what the brightest of them would be.
GLOW = 0.8
PER_STERADIAN = ("sr-1", "1/sr")
SYMBOLS = {"theta_i": r"$\theta_i$", "theta_o": r"$\theta_o$", "phi_i": r"$\phi_i$", "phi_o": r"$\phi_o$"}

# By curve: rays, seconds, error; and these by panel.
Curves = Mapping[str, FloatArray]
Panels = Mapping[str, Curves]


def new_axes(width: float = 7.0, height: float = 4.0, projection: str | None = None) -> Axes:
    """Axes in a new figure.

    Parameters
    ----------
    width, height : float, inches
    projection : {"polar"}, optional

    Returns
    -------
    matplotlib Axes
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    axes: Axes = figure.add_subplot(projection=projection)
    return axes


def short(name: str, value: Any) -> str:
    """Short text of a coordinate for titles and legends: degrees, nm.

    Parameters
    ----------
    name : str
    value : float (radians, metres, or a plain number), or str

    Returns
    -------
    str
    """
    if name in SYMBOLS:
        degrees = f"{np.rad2deg(float(value)):.3g}".replace("-", "−")
        return f"{SYMBOLS[name]} = {degrees}°"
    if isinstance(value, str):
        return value
    number = float(value)
    return f"{name} {number / nm:g} nm" if 0.0 < number < 1e-3 else f"{name} {number:g}"


def axis_label(table: DataArray) -> str:
    """Axis label of a table's values: name and unit.

    Parameters
    ----------
    table : xarray.DataArray

    Returns
    -------
    str
    """
    unit = table.attrs.get("units", "1")
    if unit in PER_STERADIAN:
        return "BRDF / sr⁻¹"
    return str(table.name or "value") + ("" if unit == "1" else f" / {unit}")


def styles(count: int, what: str) -> list[tuple[str, str, str]]:
    """Colours, markers and line styles for a few curves.

    Parameters
    ----------
    count : int
    what : str
        For messages.

    Returns
    -------
    list of (colour, mark, line)

    Raises
    ------
    ValueError
        If there are more curves than can be told apart.
    """
    if count > len(STYLES):
        raise ValueError(
            f"{what}: expected at most {len(STYLES)} curves, got {count}; choose some, as by table.sel"
        )
    return [STYLES[which] for which in STRONG[:count]]


def cell_edges(places: npt.ArrayLike, count: int, what: str) -> FloatArray:
    """Cell edges: midpoints between neighbouring places, extended at both ends.

    Parameters
    ----------
    places : (count,) array-like
    count : int
    what : str
        For messages.

    Returns
    -------
    (count + 1,) float64

    Raises
    ------
    ValueError
        If there are others, or fewer than 2, or they do not increase.
    """
    at = np.asarray(places, dtype=np.float64)
    if at.shape != (count,) or count < 2 or not (np.diff(at) > 0.0).all():
        raise ValueError(f"{what}: expected {count} increasing numbers (at least 2), got shape {at.shape}")
    middle = 0.5 * (at[1:] + at[:-1])
    return np.concatenate([[2.0 * at[0] - middle[0]], middle, [2.0 * at[-1] - middle[-1]]])


def rainbow(ax: Axes) -> None:
    """Draw the colours of the wavelengths in a strip along the bottom of axes in nm.

    Parameters
    ----------
    ax : matplotlib Axes
        Its limits along x are wavelengths in nm; the strip is a twentieth of its height.
    """
    low, high = ax.get_xlim()
    steps = np.linspace(low, high, 401)
    seen = colours.observer(2, 0.5 * (steps[1:] + steps[:-1]) * nm)
    below = ax.inset_axes((0.0, 0.0, 1.0, 0.05))
    shown = colours.srgb(GLOW * seen / max(float(seen.max()), 1e-300))
    below.pcolormesh(steps, [0.0, 1.0], shown[None])
    below.set_axis_off()
    below.set_xlim(low, high)


def lay_over(ax: Axes, measured: DataArray, scale: float = 1.0, note: str = "") -> None:
    """Draw measured spectra over others, as dashed black lines.

    Parameters
    ----------
    ax : matplotlib Axes
        Over wavelengths in nm.
    measured : xarray.DataArray
        reflectance (sample, wavelength), as of `spectra.load`.
    scale : float
        Drawn is this times the reflectance.
    note : str
        Added to their names.
    """
    overlaid = measured.transpose("sample", "wavelength")
    for row, name in enumerate(overlaid["sample"].values):
        line = ("--", ":", "-.")[row % 3]
        values = scale * np.asarray(overlaid[row])
        ax.plot(overlaid["wavelength"] / nm, values, line, color="black", label=f"{name}{note}")


def spectra(
    table: DataArray, ax: Axes | None = None, *, measured: DataArray | None = None, title: str | None = None
) -> Axes:
    """Plot spectra over the colours of their wavelengths, with measured ones as dashed black lines.

    Parameters
    ----------
    table : xarray.DataArray
        A BRDF or reflectance over wavelength (metres): a curve for each place on its other axes, at most 7.
    ax : matplotlib Axes, optional
    measured : xarray.DataArray, optional
        reflectance (sample, wavelength), as of `spectra.load`, relative to a white standard: over a BRDF it
        is drawn divided by pi, for white is the Lambertian 1 / pi.
    title : str, optional

    Returns
    -------
    matplotlib Axes
        Wavelengths in nm, those of the table.

    Raises
    ------
    ValueError
        If there are too many curves, or fewer than 2 wavelengths.
    """
    if table.sizes.get("wavelength", 0) < 2:
        raise ValueError("spectra: expected a table over at least 2 wavelengths, got fewer")
    others = [str(name) for name in table.dims if name != "wavelength"]
    flat = table.transpose(*others, "wavelength")
    varied = [name for name in others if table.sizes[name] > 1]
    rows = np.asarray(flat).reshape(-1, table.sizes["wavelength"])
    ax = new_axes() if ax is None else ax
    at, alone = np.asarray(table["wavelength"]) / nm, None if measured is None else "model"
    places = np.ndindex(*(table.sizes[name] for name in others))
    for values, place, (colour, _, line) in zip(rows, places, styles(len(rows), "spectra"), strict=True):
        corner = flat[place]
        named = [short(name, corner[name].item()) for name in varied if name in corner.coords]
        ax.plot(at, values, color=colour, linestyle=line, label=", ".join(named) or alone)
    if measured is not None:
        lambertian = table.attrs.get("units") in PER_STERADIAN
        lay_over(ax, measured, *((1.0 / np.pi, " / π") if lambertian else ()))
    ax.set(xlabel="wavelength / nm", ylabel=axis_label(table), xlim=(at.min(), at.max()))
    if title:
        ax.set_title(title)
    ax.autoscale(axis="y")  # again, for axes that share their scale
    top = ax.get_ylim()[1]
    ax.set_ylim(-0.06 * top, top)
    rainbow(ax)
    if varied or measured is not None:
        ax.legend(frameon=False, fontsize="small")
    return ax


def work_precision(
    curves: Curves,
    ax: Axes | None = None,
    *,
    against: str = "seconds",
    order: Sequence[str] = (),
    legend: bool = True,
    title: str | None = None,
) -> Axes:
    """Plot error against seconds or rays, logarithmic.

    Parameters
    ----------
    curves : dict of (3, n) float64
        By name: rays, seconds, phase error in waves.
    ax : matplotlib Axes, optional
    against : {"seconds", "rays"}
    order : sequence of str, optional
        Names in the order of their colours, to keep these from panel to panel. Default: those of the curves.
    legend : bool
        Name the curves.
    title : str, optional

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        If there is nothing to draw, or `against` is something else.
    """
    if not curves:
        raise ValueError("work_precision: expected at least one curve, got none")
    if against not in ("seconds", "rays"):
        raise ValueError(f"against: expected seconds or rays, got {against!r}")
    ax = new_axes() if ax is None else ax
    names = list(order or curves)
    for name, (rays, seconds, error) in curves.items():
        colour, mark, line = STYLES[names.index(name) % len(STYLES)]
        work = seconds if against == "seconds" else rays
        ax.loglog(work, error, color=colour, marker=mark, linestyle=line, markersize=5, label=name)
    ax.set(xlabel=against, ylabel="phase error / waves")
    ax.grid(alpha=0.3)
    if title:
        ax.set_title(title)
    if legend:
        ax.legend(fontsize="small")
    return ax


def comparison(panels: Panels) -> Figure:
    """Plot error against seconds and against rays, two axes per panel, to one scale.

    Parameters
    ----------
    panels : dict of dict of (3, n) float64
        By panel and curve: see `work_precision`.

    Returns
    -------
    matplotlib Figure

    Raises
    ------
    ValueError
        If there is nothing to draw.
    """
    from matplotlib.figure import Figure

    if not panels:
        raise ValueError("comparison: expected at least one panel, got none")
    names = list(dict.fromkeys(name for curves in panels.values() for name in curves))
    rows = (len(panels) + 1) // 2
    every = np.concatenate([curve for curves in panels.values() for curve in curves.values()], axis=1)
    shown = every.min(axis=1) / MARGIN, every.max(axis=1) * MARGIN
    figure = Figure(figsize=(12.0, 1.0 + 2.6 * rows), layout="constrained")
    handles: dict[str, Any] = {}
    parts = figure.subfigures(rows, 2, squeeze=False).ravel()
    for part, (title, curves) in zip(parts, panels.items(), strict=False):
        part.suptitle(title, fontsize="medium")
        left, right = part.subplots(1, 2, sharey=True)
        for ax, column, against in ((left, 1, "seconds"), (right, 0, "rays")):
            work_precision(curves, ax, against=against, order=names, legend=False)
            ax.set(xlim=[end[column] for end in shown], ylim=[end[2] for end in shown])
            handles |= dict(zip(curves, ax.lines, strict=True))
        right.set_ylabel("")
    lines = [handles[name] for name in names]
    figure.legend(lines, names, loc="outside lower center", ncols=len(names))
    return figure
