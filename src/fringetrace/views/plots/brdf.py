"""BRDF plots: heat maps over angles, polar lobes, spectrograms, overviews."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fringetrace.core import nm
from fringetrace.views.plots.spectra import axis_label, cell_edges, new_axes, short, spectra, styles

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from xarray import DataArray


def _grid(count: int, columns: int) -> tuple[Figure, list[Axes]]:
    """A figure of panels side by side and below one another, all to one scale."""
    from matplotlib.figure import Figure

    columns = min(columns, count)
    rows = -(-count // columns)
    figure = Figure(figsize=(3.2 * columns + 1.0, 2.6 * rows), layout="constrained")
    panels = list(figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).flat)
    for number, ax in enumerate(panels):
        ax.set_visible(number < count)
        ax.tick_params(labelbottom=number + columns >= count)
    return figure, panels[:count]


def _only(table: DataArray, kept: tuple[str, ...]) -> DataArray:
    """The table over some axes; the others must have one value."""
    for name in table.dims:
        if name not in kept and table.sizes[name] > 1:
            raise ValueError(
                f"table: expected one {name}, got {table.sizes[name]}; choose, as by table.isel({name}=0)"
            )
    missing = [name for name in kept if name not in table.dims]
    if missing:
        raise ValueError(f"table: expected axes {', '.join(kept)}, got {', '.join(map(str, table.dims))}")
    return table.isel({name: 0 for name in table.dims if name not in kept}).transpose(*kept)


def _at(table: DataArray, wavelength: float | None) -> tuple[DataArray, str]:
    """The table at the wavelength nearest to one, and that as text."""
    if "wavelength" not in table.coords:
        return table, ""
    have = np.atleast_1d(np.asarray(table["wavelength"], dtype=np.float64))
    low, high = have.min(), have.max()
    if wavelength is None and low < high:
        raise ValueError(f"wavelength: expected one from {low / nm:g} to {high / nm:g} nm, got None")
    if wavelength is not None and not low * (1.0 - 1e-9) <= wavelength <= high * (1.0 + 1e-9):
        raise ValueError(
            f"wavelength: expected one from {low / nm:g} to {high / nm:g} nm, got {wavelength / nm:g} nm"
        )
    if "wavelength" in table.dims:
        table = table.isel(
            wavelength=int(np.abs(have - (have[0] if wavelength is None else wavelength)).argmin())
        )
    return table, f"λ = {float(table['wavelength']) / nm:.4g} nm"


def _bar(ax: Axes, drawn: Any, label: str, away: float = 0.03) -> None:
    ax.figure.colorbar(drawn, cax=ax.inset_axes((1.0 + away, 0.0, 0.045, 1.0)), label=label)


def brdf(
    table: DataArray, ax: Axes | None = None, *, wavelength: float | None = None, title: str | None = None
) -> Axes:
    """Plot a BRDF in the plane of incidence: heat map of incident against outgoing angle.

    Parameters
    ----------
    table : xarray.DataArray
        As from `goniometer.brdf`, over theta_i and theta_o (radians), with one value of each other axis.
    ax : matplotlib Axes, optional
        Default: those of a new figure.
    wavelength : float, metres, optional
        The nearest one that there is, which the title names; needed if there are several.
    title : str, optional

    Returns
    -------
    matplotlib Axes
        Angles in degrees; the scale starts at 0.

    Raises
    ------
    ValueError
        If another axis has several values, or the wavelength is outside of the table.
    """
    at, named = _at(table, wavelength)
    flat = _only(at, ("theta_i", "theta_o"))
    up, right = (np.rad2deg(cell_edges(flat[name], flat.sizes[name], str(name))) for name in flat.dims)
    ax = new_axes(5.6, 4.4) if ax is None else ax
    drawn = ax.pcolormesh(right, up, np.asarray(flat), vmin=0.0, cmap="viridis")
    ax.set(xlabel=r"$\theta_o$ (to the eye) / °", ylabel=r"$\theta_i$ (to the light) / °", aspect="equal")
    ax.set_title(", ".join(filter(None, (title, named))))
    _bar(ax, drawn, axis_label(table))
    return ax


def polar(
    table: DataArray, ax: Axes | None = None, *, wavelength: float | None = None, title: str | None = None
) -> Axes:
    """Plot a BRDF on polar axes: lobes in the plane of incidence, or a map of the hemisphere.

    Parameters
    ----------
    table : xarray.DataArray
        As from `goniometer.brdf`. With one phi_o: a curve for each theta_i (at most 7), the normal up and
        +x to the right, with a dot on the rim where its light comes from. With several, and one
        incidence: a map seen from above, phi_o around and theta_o outwards, with a dot at the light.
    ax : matplotlib polar Axes, optional
    wavelength, title
        See `brdf`.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        As `brdf`; if the axes are not polar, or angles outwards are negative.
    """
    whole = table.sizes.get("phi_o", 1) > 1
    if ax is None:
        ax = new_axes(5.6, 4.6, "polar") if whole else _half()
    if ax.name != "polar":
        raise ValueError(f"axes: expected polar ones, as of subplots with projection='polar', got {ax.name}")
    at, named = _at(table, wavelength)
    (_hemisphere if whole else _lobes)(at, ax)
    ax.set_title(", ".join(filter(None, (title, named))), y=1.08 if whole else 0.84)
    return ax


def _half() -> Axes:
    """Polar axes for half a disc, in a figure that leaves out what would be above and below."""
    from matplotlib.figure import Figure

    axes: Axes = Figure(figsize=(5.6, 3.8)).add_axes((0.1, -0.1, 0.8, 0.8 * 5.6 / 3.8), projection="polar")
    return axes


def _lobes(table: DataArray, ax: Any) -> None:
    flat = _only(table, ("theta_i", "theta_o") if "theta_i" in table.dims else ("theta_o",))
    flat = flat if "theta_i" in flat.dims else flat.expand_dims("theta_i")
    ax.set_theta_zero_location("N")
    ax.set_theta_direction(-1)
    ax.set(thetamin=-90, thetamax=90)
    for curve, (colour, _, line) in zip(flat, styles(flat.sizes["theta_i"], "polar"), strict=True):
        start = short("theta_i", curve["theta_i"])
        ax.plot(flat["theta_o"], curve, color=colour, linestyle=line, label=start)
    top = ax.get_ylim()[1]
    ax.set_ylim(0.0, top)
    for line, start in zip(ax.lines[:], flat["theta_i"].values, strict=True):
        ax.plot(start, top, "o", color=line.get_color(), clip_on=False, zorder=5)
    at = np.arange(-90, 91, 30)
    ax.set_xticks(np.radians(at), labels=[f"{angle}°".replace("-", "−") for angle in at])
    ax.legend(
        title=f"{axis_label(table)}, light from", loc="upper center", bbox_to_anchor=(0.5, 0.2), ncols=4,
        fontsize="small", frameon=False,
    )  # fmt: skip


def _hemisphere(table: DataArray, ax: Any) -> None:
    flat = _only(table, ("theta_o", "phi_o"))
    outwards = cell_edges(flat["theta_o"], flat.sizes["theta_o"], "theta_o")
    if float(flat["theta_o"][0]) < 0.0:
        raise ValueError("theta_o: expected angles from 0 up beside several phi_o, got negative ones")
    rings = np.rad2deg(np.clip(outwards, 0.0, 0.5 * np.pi))
    drawn = ax.pcolormesh(
        cell_edges(flat["phi_o"], flat.sizes["phi_o"], "phi_o"),
        rings,
        np.asarray(flat),
        vmin=0.0,
        cmap="viridis",
    )
    ax.grid(alpha=0.3)
    ax.set_ylim(0.0, 90.0)
    ax.set_yticks([30, 60], labels=["30°", "60°"], color="white")
    start = table["theta_i"].item(), table["phi_i"].item() if "phi_i" in table.coords else 0.0
    turn = start[1] + (np.pi if start[0] < 0.0 else 0.0)
    ax.plot(
        turn, np.rad2deg(abs(start[0])), "o", color="white", markeredgecolor="black", label="light from here"
    )
    ax.legend(loc="lower left", bbox_to_anchor=(-0.15, -0.12), fontsize="small", frameon=False)
    _bar(ax, drawn, axis_label(table), 0.14)


def spectrogram(
    table: DataArray, ax: Axes | None = None, *, top: float | None = None, title: str | None = None
) -> Axes:
    """Plot a BRDF of one incidence over wavelength and outgoing angle.

    Parameters
    ----------
    table : xarray.DataArray
        Over theta_o (radians) and wavelength (metres), with one value of each other axis.
    ax : matplotlib Axes, optional
    top : float, optional
        End of the scale. Default: the 99.5th percentile of what is not 0.
    title : str, optional

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        If another axis has several values.
    """
    flat = _only(table, ("theta_o", "wavelength"))
    ax = new_axes() if ax is None else ax
    drawn = _spectrogram(flat, ax, _top(flat) if top is None else top)
    ax.set(xlabel="wavelength / nm", ylabel="observed at / °")
    if title:
        ax.set_title(title)
    _bar(ax, drawn, axis_label(table))
    return ax


def _top(table: DataArray) -> float:
    values = np.asarray(table)
    return float(np.quantile(values[values > 0.0], 0.995)) if (values > 0.0).any() else 1.0


def _spectrogram(flat: DataArray, ax: Axes, top: float) -> Any:
    along = 1e9 * np.asarray(flat.wavelength), np.rad2deg(flat.theta_o)
    values = np.asarray(flat.transpose("theta_o", "wavelength"))
    return ax.pcolormesh(*along, values, shading="nearest", vmin=0.0, vmax=top, cmap="viridis")


def _incidences(table: DataArray, observed: tuple[str, ...]) -> list[tuple[str, DataArray]]:
    """The table at each incidence and each parameter, with a title."""
    others = [name for name in table.dims if name not in (*observed, "wavelength")]
    varied = [name for name in others if name == "theta_i" or table.sizes[name] > 1]
    found = []
    for place in np.ndindex(*(table.sizes[name] for name in others)):
        part = table.isel(dict(zip(others, place, strict=True)))
        found.append((", ".join(short(str(name), part[name].item()) for name in varied), part))
    return found


def overview(table: DataArray, columns: int = 4) -> Figure:
    """Plot one spectrogram per incidence and parameter of a study, to one scale.

    Parameters
    ----------
    table : xarray.DataArray
        As from `goniometer.brdf` (phi_o taken at the first value), or `studies.study`.
    columns : int
        Panels side by side.

    Returns
    -------
    matplotlib Figure
    """
    parts = _incidences(table.isel(phi_i=0, phi_o=0), ("theta_o",))
    figure, panels = _grid(len(parts), columns)
    for ax, (title, part) in zip(panels, parts, strict=True):
        drawn = _spectrogram(part, ax, _top(table))
        ax.set_title(title, fontsize="small")
    figure.supxlabel("wavelength / nm")
    figure.supylabel("observed at / °")
    figure.colorbar(drawn, ax=panels, label=axis_label(table))
    return figure


def mirror_spectra(table: DataArray, measured: DataArray | None = None, columns: int = 4) -> Figure:
    """Plot spectra in the specular direction, or the nearest observed: one panel per incidence.

    Parameters
    ----------
    table : xarray.DataArray
        As for `overview`.
    measured : xarray.DataArray, optional
        Laid over each, see `spectra`.
    columns : int

    Returns
    -------
    matplotlib Figure
    """
    parts = _incidences(table.isel(phi_i=0), ("theta_o", "phi_o"))
    figure, panels = _grid(len(parts), columns)
    for ax, (title, part) in zip(panels, parts, strict=True):
        theta, phi = np.meshgrid(part.theta_o, part.phi_o, indexing="ij")
        start, turn = float(part.theta_i), float(part.phi_i)
        cosine = np.cos(theta) * np.cos(start) - np.sin(theta) * np.sin(start) * np.cos(phi - turn)
        ring, sector = np.unravel_index(int(cosine.argmax()), cosine.shape)
        spectra(part.isel(theta_o=int(ring), phi_o=int(sector)), ax, measured=measured)
        ax.set_title(f"{title}, {short('theta_o', theta[ring, sector])}", fontsize="small")
    return _shared(figure, panels)


def _shared(figure: Figure, panels: Sequence[Axes]) -> Figure:
    """One legend and one pair of labels for all panels, as the first has them."""
    handles, labels = panels[0].get_legend_handles_labels()
    figure.supxlabel(panels[0].get_xlabel())
    figure.supylabel(panels[0].get_ylabel())
    for ax in panels:
        ax.set(xlabel="", ylabel="")
        if legend := ax.get_legend():
            legend.remove()
    if labels:
        figure.legend(handles, labels, loc="outside upper center", ncols=min(4, len(labels)), frameon=False)
    return figure
