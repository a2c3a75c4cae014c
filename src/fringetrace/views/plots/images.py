"""Image plots with real units: interferograms, heights, residuals, phases."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from fringetrace.core import Array, FloatArray, checked_wavelength, filled, unit_of, whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure

NO_LIGHT = "#D0D0D0"


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


def side_by_side() -> tuple[Axes, Axes]:
    """Two axes side by side in a new figure, with space for colour bars.

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
    values = filled(values)
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
    """Plot an interferogram in grey, with scale bar and colour bar.

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
    """Plot a height map in nm, um or mm; NaN is light grey.

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
    map = filled(map)
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
    """Plot a height residual, symmetric about 0, with its rms in the title.

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
    map = filled(map)
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
    """Plot a wrapped phase in a cyclic colour map.

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


def save(drawn: Axes | Figure, path: str | os.PathLike[str], dpi: float = 150.0) -> None:
    """Save a figure, or the figure of some axes, atomically.

    Parameters
    ----------
    drawn : matplotlib Axes or Figure
    path : path
        Its suffix says the kind: .png, .pdf, .svg.
    dpi : float
        Pixels an inch.
    """
    figure: Any = drawn if hasattr(drawn, "savefig") else drawn.get_figure(root=True)
    with whole(path) as part:
        lightly = {"pil_kwargs": {"compress_level": 1}} if part.suffix == ".png" else {}
        figure.savefig(part, dpi=dpi, **lightly)
