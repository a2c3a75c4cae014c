"""Pictures with real units: interferograms, heights, residuals, phases; scenes come from `drawing`."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fringetrace.exhibits import export, page, picture, show
from fringetrace.itinerary import itinerary
from fringetrace.offscreen import opengl
from fringetrace.waves import Array, FloatArray, checked_wavelength, unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure

    from fringetrace.tables import DataArray

__all__ = [
    "export",
    "height",
    "interferogram",
    "itinerary",
    "opengl",
    "page",
    "phase",
    "picture",
    "residual",
    "save",
    "show",
    "spectra",
    "work_precision",
]

NO_LIGHT = "#D0D0D0"
# Colours that colour-blind people tell apart (Okabe and Ito), with a mark and a line for each.
STYLES = (
    ("#999999", "x", ":"), ("#E69F00", "o", "--"), ("#56B4E9", "s", "--"), ("#D55E00", "^", "-"),
    ("#0072B2", "D", "-"), ("#009E73", "v", "-"), ("#CC79A7", "P", "-"),
)  # fmt: skip

# Room around curves on logarithmic axes, a factor.
MARGIN = 2.0

# By panel and curve: rays, seconds, error.
Panels = dict[str, dict[str, FloatArray]]


def _axes(ax: Axes | None, shape: tuple[int, ...]) -> Axes:
    if ax is not None:
        return ax
    from matplotlib.figure import Figure

    rows, columns = shape
    height = float(np.clip(5.6 * rows / columns, 2.0, 9.0))
    figure = Figure(figsize=(7.0, height))
    figure.subplots_adjust(left=0.11, right=0.85, bottom=0.65 / height, top=1.0 - 0.4 / height)
    axes: Axes = figure.add_subplot()
    return axes


def blank(width: float = 7.0, height: float = 4.0) -> Axes:
    """Axes in a figure of their own.

    Parameters
    ----------
    width, height : float, inches

    Returns
    -------
    matplotlib Axes
    """
    from matplotlib.figure import Figure

    axes: Axes = Figure(figsize=(width, height), layout="constrained").add_subplot()
    return axes


def pair() -> tuple[Axes, Axes]:
    """Two axes side by side in a figure of their own, with room for a colour bar beside each.

    Returns
    -------
    left, right : matplotlib Axes
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 5.0))
    figure.subplots_adjust(left=0.06, right=0.91, bottom=0.11, top=0.92, wspace=0.4)
    left, right = figure.subplots(1, 2)
    return left, right


def _scale_bar(ax: Axes, width: float, unit: str) -> None:
    """A bar of about a fifth of the width, 1, 2 or 5 times a power of ten long."""
    from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar

    decade = 10.0 ** np.floor(np.log10(width / 5.0))
    length = decade * max(step for step in (1.0, 2.0, 5.0) if step * decade <= width / 5.0)
    bar = AnchoredSizeBar(
        ax.transData, length, f"{length:g} {unit}", "lower right", pad=0.4, borderpad=0.6, sep=4,
        size_vertical=width / 150.0, color="black",
    )  # fmt: skip
    bar.patch.set(facecolor="white", edgecolor="none", alpha=0.8)
    ax.add_artist(bar)


def _image(
    values: Array, pitch: float, ax: Axes | None, *, label: str, title: str | None, style: dict[str, Any]
) -> Axes:
    """An array [row, column] = [y, x], with its axes, scale bar and colour bar."""
    values = np.asarray(values)
    if values.ndim != 2 or values.size == 0:
        raise ValueError(f"image: expected shape (rows, columns), got {values.shape}")
    if not (np.isfinite(pitch) and pitch > 0.0):
        raise ValueError(f"pitch: expected a positive length in metres, got {pitch!r}")
    ax = _axes(ax, values.shape)
    unit, metres = unit_of(0.5 * pitch * max(values.shape))
    height, width = (n * pitch / metres for n in values.shape)
    image = ax.imshow(
        np.ma.masked_invalid(values), origin="lower", interpolation="nearest",
        extent=(-0.5 * width, 0.5 * width, -0.5 * height, 0.5 * height), **style,
    )  # fmt: skip
    ax.set_facecolor(NO_LIGHT)
    ax.set(xlabel=f"x / {unit}", ylabel=f"y / {unit}")
    if title:
        ax.set_title(title)
    _scale_bar(ax, width, unit)
    ax.figure.colorbar(image, cax=ax.inset_axes((1.03, 0.0, 0.045, 1.0)), label=label)
    return ax


def interferogram(
    image: FloatArray,
    pitch: float,
    ax: Axes | None = None,
    *,
    wavelength: float | None = None,
    title: str | None = None,
) -> Axes:
    """An interferogram in grey.

    Parameters
    ----------
    image : (rows, columns) float64
        |E|^2; the grey scale starts at 0.
    pitch : float, metres
        Side of a pixel.
    ax : matplotlib Axes, optional
        Default: those of a new figure.
    wavelength : float, metres, optional
        Named in the title.
    title : str, optional

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        If the image has not two axes, or the pitch is not a positive length.
    """
    if wavelength is not None:
        named = f"λ = {checked_wavelength(wavelength) * 1e9:g} nm"
        title = f"{title}, {named}" if title else named
    return _image(
        image,
        pitch,
        ax,
        label="irradiance / incident irradiance",
        title=title,
        style={"cmap": "gray", "vmin": 0.0},
    )


def height(map: FloatArray, pitch: float, ax: Axes | None = None, *, title: str | None = None) -> Axes:
    """A height map, in nm, µm or mm; NaN is light grey.

    Parameters
    ----------
    map : (rows, columns) float64, metres
    pitch : float, metres
    ax, title
        See `interferogram`.

    Returns
    -------
    matplotlib Axes
    """
    span = np.nanmax(np.abs(map)) if np.isfinite(map).any() else 0.0
    unit, metres = unit_of(float(span))
    return _image(map / metres, pitch, ax, label=f"height / {unit}", title=title, style={"cmap": "viridis"})


def residual(
    map: FloatArray,
    pitch: float,
    ax: Axes | None = None,
    *,
    wavelength: float | None = None,
    title: str | None = None,
) -> Axes:
    """A difference of heights, its scale the same on both sides of 0; its rms in the title.

    Parameters
    ----------
    map : (rows, columns) float64, metres
    pitch : float, metres
    wavelength : float, metres, optional
        The rms is then also given in waves.
    ax, title
        See `interferogram`.

    Returns
    -------
    matplotlib Axes
        The scale ends at the 99.9th percentile, so that single pixels do not hide the rest.
    """
    valid = map[np.isfinite(map)]
    rms = float(np.sqrt(np.mean(valid**2))) if valid.size else 0.0
    top = float(np.quantile(np.abs(valid), 0.999)) if valid.size else 0.0
    unit, metres = unit_of(top)
    limit = top / metres if top > 0.0 else 1.0
    named = f"rms {rms * 1e9:.3g} nm"
    if wavelength is not None:
        named += f" = {rms / checked_wavelength(wavelength):.2g} λ"
    return _image(
        map / metres, pitch, ax, label=f"residual / {unit}", title=f"{title}, {named}" if title else named,
        style={"cmap": "PuOr", "vmin": -limit, "vmax": limit},
    )  # fmt: skip


def phase(map: FloatArray, pitch: float, ax: Axes | None = None, *, title: str | None = None) -> Axes:
    """A wrapped phase in cyclic colours, which meet at -pi and pi.

    Parameters
    ----------
    map : (rows, columns) float64, radians
    pitch : float, metres
    ax, title
        See `interferogram`.

    Returns
    -------
    matplotlib Axes
    """
    style = {"cmap": "twilight", "vmin": -np.pi, "vmax": np.pi}
    ax = _image(map, pitch, ax, label="phase / rad", title=title, style=style)
    bar = ax.images[0].colorbar
    if bar is not None:
        bar.set_ticks([-np.pi, 0.0, np.pi], labels=["−π", "0", "π"])
    return ax


def work_precision(panels: Panels) -> Figure:
    """Error against seconds and against rays, a pair of axes for each panel, logarithmic, to one scale.

    Parameters
    ----------
    panels : dict of dict of (3, n) float64
        By panel and curve: rays, seconds, phase error in waves.

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
        raise ValueError("work_precision: expected at least one panel, got none")
    labels = list(dict.fromkeys(label for curves in panels.values() for label in curves))
    rows = (len(panels) + 1) // 2
    every = np.concatenate([curve for curves in panels.values() for curve in curves.values()], axis=1)
    shown = every.min(axis=1) / MARGIN, every.max(axis=1) * MARGIN
    figure = Figure(figsize=(12.0, 1.0 + 2.6 * rows), layout="constrained")
    parts = figure.subfigures(rows, 2, squeeze=False).ravel()
    handles = {}
    for part, (title, curves) in zip(parts, panels.items(), strict=False):
        part.suptitle(title, fontsize="medium")
        pair = part.subplots(1, 2, sharey=True)
        for label, (rays, seconds, error) in curves.items():
            colour, mark, line = STYLES[labels.index(label) % len(STYLES)]
            style = {"color": colour, "marker": mark, "linestyle": line, "markersize": 5}
            for ax, work in zip(pair, (seconds, rays), strict=True):
                (handles[label],) = ax.loglog(work, error, **style)
        pair[0].set(xlabel="seconds", ylabel="phase error / waves")
        pair[1].set(xlabel="rays")
        for ax, column in zip(pair, (1, 0), strict=True):
            ax.set(xlim=[end[column] for end in shown], ylim=[end[2] for end in shown])
            ax.grid(alpha=0.3)
    figure.legend([handles[label] for label in labels], labels, loc="outside lower center", ncols=len(labels))
    return figure


def spectra(table: DataArray, columns: int = 4) -> Figure:
    """A BRDF against wavelength and angle of observation, in the plane of incidence: a panel for each.

    Parameters
    ----------
    table : xarray.DataArray
        As from `goniometer.brdf` (phi taken at the first value), or `studies.study`.
    columns : int
        Panels side by side.

    Returns
    -------
    matplotlib Figure
        The scale ends at the 99.5th percentile of what is not 0.
    """
    from matplotlib.figure import Figure

    others = [name for name in table.dims if name not in ("theta_o", "phi_o", "phi_i", "wavelength")]
    flat = table.isel(phi_i=0, phi_o=0).stack(panel=others)
    values = np.asarray(flat.transpose("panel", "theta_o", "wavelength"))
    top = float(np.quantile(values[values > 0.0], 0.995)) if (values > 0.0).any() else 1.0
    rows = -(-len(values) // columns)
    figure = Figure(figsize=(3.2 * min(columns, len(values)) + 1.0, 2.6 * rows), layout="constrained")
    panels = figure.subplots(rows, min(columns, len(values)), squeeze=False, sharex=True, sharey=True)
    edges = 1e9 * np.asarray(table.wavelength), np.rad2deg(table.theta_o)
    for ax, image, names in zip(panels.flat, values, flat.panel.values, strict=False):
        drawn = ax.pcolormesh(*edges, image, shading="nearest", vmin=0.0, vmax=top, cmap="viridis")
        labels = dict(zip(others, names, strict=True))
        start = f"from {np.rad2deg(labels.pop('theta_i')):.3g}°"
        ax.set_title(", ".join([start, *(f"{k} {_short(v)}" for k, v in labels.items())]), fontsize="small")
    for ax in panels.flat[len(values) :]:
        ax.set_visible(False)
    figure.supxlabel("wavelength / nm")
    figure.supylabel("observed at / °")
    figure.colorbar(drawn, ax=panels, label="BRDF / sr⁻¹")
    return figure


def _short(value: Any) -> str:
    """A parameter for a title: small lengths in nm."""
    if isinstance(value, float) and 0.0 < value < 1e-3:
        return f"{1e9 * value:g} nm"
    return str(value) if isinstance(value, str) else f"{value:g}"


def save(drawn: Axes | Figure, path: str | os.PathLike[str], dpi: float = 150.0) -> None:
    """Write a figure, or the figure of some axes; a file is there in full or not at all.

    Parameters
    ----------
    drawn : matplotlib Axes or Figure
    path : path
        Its suffix says the kind: .png, .pdf, .svg.
    dpi : float
        Pixels an inch.
    """
    figure: Any = drawn if hasattr(drawn, "savefig") else drawn.get_figure(root=True)
    target = Path(path)
    with tempfile.TemporaryDirectory(prefix=".fringetrace-", dir=target.parent) as folder:
        part = Path(folder, target.name)
        lightly = {"pil_kwargs": {"compress_level": 1}} if part.suffix == ".png" else {}
        figure.savefig(part, dpi=dpi, **lightly)
        os.replace(part, target)
