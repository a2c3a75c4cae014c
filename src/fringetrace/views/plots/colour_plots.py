"""Colour plots: swatches, strips, maps over angles, spheres, spectra."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, nm
from fringetrace.scattering import colour as spectra
from fringetrace.views.plots.spectra import STYLES, cell_edges, lay_over, new_axes, rainbow

if TYPE_CHECKING:
    from xarray import DataArray

    from fringetrace.views.plots.spectra import Axes

# What is behind a sphere.
BEHIND = (0.12, 0.12, 0.12)


def _colours(xyz: npt.ArrayLike, dimensions: int, gamut: str) -> FloatArray:
    values = np.asarray(xyz, dtype=np.float64)
    if values.ndim != dimensions or values.shape[-1] != 3:
        shape = ("n, 3", "rows, columns, 3")[dimensions - 2]
        raise ValueError(f"colours: expected X, Y, Z of shape ({shape}), got {values.shape}")
    return spectra.srgb(values, gamut)


def swatches(
    xyz: npt.ArrayLike, labels: Sequence[str], ax: Axes | None = None, *, gamut: str = "clip"
) -> Axes:
    """Plot colour swatches side by side, each with its name below.

    Parameters
    ----------
    xyz : (n, 3) array-like
        White has Y = 1.
    labels : sequence of n str
    ax : matplotlib Axes, optional
        Default: those of a new figure.
    gamut : {"clip", "desaturate"}
        See `spectra.srgb`.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        If there are not as many labels as colours.
    """
    colours = _colours(xyz, 2, gamut)
    if len(labels) != len(colours):
        raise ValueError(f"labels: expected {len(colours)}, one a colour, got {len(labels)}")
    ax = new_axes(max(2.0, 1.1 * len(colours)), 1.6) if ax is None else ax
    ax.imshow(colours[None], extent=(0.0, len(colours), 0.0, 1.0), interpolation="nearest")
    ax.set_xticks(np.arange(len(colours)) + 0.5, list(labels))
    ax.set_yticks([])
    ax.tick_params(length=0)
    return ax


def strip(
    xyz: npt.ArrayLike, places: npt.ArrayLike, ax: Axes | None = None, *, label: str = "", gamut: str = "clip"
) -> Axes:
    """Plot a strip of colour along an axis of thickness, angle or path.

    Parameters
    ----------
    xyz : (n, 3) array-like
    places : (n,) array-like
        Increasing, in the unit that the label names.
    ax, gamut
        See `swatches`.
    label : str
        Of the axis, with its unit, as in "thickness / nm".

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        If shapes do not agree.
    """
    colours = _colours(xyz, 2, gamut)
    sides = cell_edges(places, len(colours), "places")
    ax = new_axes(7.0, 1.3) if ax is None else ax
    ax.pcolormesh(sides, [0.0, 1.0], colours[None])
    ax.set(xlabel=label, yticks=[])
    return ax


def angles(
    xyz: npt.ArrayLike,
    theta_i: npt.ArrayLike,
    theta_o: npt.ArrayLike,
    ax: Axes | None = None,
    *,
    gamut: str = "clip",
) -> Axes:
    """Plot colours over the angles of light and eye.

    Parameters
    ----------
    xyz : (i, o, 3) array-like
    theta_i, theta_o : (i,), (o,) array-like, radians
        Increasing; to the light and to the eye, from the normal.
    ax, gamut
        See `swatches`.

    Returns
    -------
    matplotlib Axes
        theta_i upwards, theta_o to the right, in degrees.

    Raises
    ------
    ValueError
        If shapes do not agree.
    """
    colours = _colours(xyz, 3, gamut)
    up = np.degrees(cell_edges(theta_i, colours.shape[0], "theta_i"))
    right = np.degrees(cell_edges(theta_o, colours.shape[1], "theta_o"))
    ax = new_axes(5.0, 4.4) if ax is None else ax
    ax.pcolormesh(right, up, colours)
    ax.set(xlabel=r"$\theta_o$ (to the eye) / °", ylabel=r"$\theta_i$ (to the light) / °", aspect="equal")
    return ax


def draw_sphere(
    xyz: npt.ArrayLike, ax: Axes | None = None, *, title: str | None = None, gamut: str = "clip"
) -> Axes:
    """Plot a sphere in colour, see `bsdf_tables.shaded_sphere` and `mirrored`, on dark grey.

    Parameters
    ----------
    xyz : (rows, columns, 3) array-like
        The first row is the lowest; NaN is beside the sphere.
    ax, gamut
        See `swatches`.
    title : str, optional

    Returns
    -------
    matplotlib Axes
    """
    values = np.asarray(xyz, dtype=np.float64)
    colours = _colours(np.nan_to_num(values), 3, gamut)
    colours[np.isnan(values).any(axis=-1)] = BEHIND
    ax = new_axes(3.4, 3.6) if ax is None else ax
    ax.imshow(colours, origin="lower", interpolation="nearest")
    ax.set_axis_off()
    if title:
        ax.set_title(title)
    return ax


def mirrored(xyz: npt.ArrayLike, theta: npt.ArrayLike, pixels: int = 256) -> FloatArray:
    """Sphere that reflects a uniform white sky: each place has the colour of its own angle.

    Parameters
    ----------
    xyz : (n, 3) array-like
        Of the specular reflectance.
    theta : (n,) array-like, radians
        Angles of incidence, increasing.
    pixels : int
        Rows, and columns.

    Returns
    -------
    (pixels, pixels, 3) float64
        X, Y, Z; NaN beside the sphere. Linear between the angles.
    """
    values, at = np.asarray(xyz, dtype=np.float64), np.asarray(theta, dtype=np.float64)
    side = (np.arange(pixels) + 0.5) * 2.0 / pixels - 1.0
    radius = np.hypot(side[:, None], side)
    angle = np.arcsin(np.minimum(radius, 1.0))
    picture = np.stack([np.interp(angle, at, column) for column in values.T], axis=-1)
    return np.where(radius[..., None] < 1.0, picture, np.nan)


def coloured_spectra(
    reflectance: npt.ArrayLike,
    wavelengths: npt.ArrayLike,
    ax: Axes | None = None,
    *,
    labels: Sequence[str] = (),
    measured: DataArray | None = None,
) -> Axes:
    """Plot spectra over the colours of their wavelengths, with measured ones as dashed lines.

    Parameters
    ----------
    reflectance : (n,) or (m, n) array-like
    wavelengths : (n,) array-like, metres
    ax : matplotlib Axes, optional
    labels : sequence of m str, optional
    measured : xarray.DataArray, optional
        reflectance (sample, wavelength), as of `spectra.load`.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        If shapes do not agree.
    """
    values, at = np.atleast_2d(np.asarray(reflectance, dtype=np.float64)), np.asarray(wavelengths)
    if values.ndim != 2 or values.shape[1:] != at.shape or (labels and len(labels) != len(values)):
        raise ValueError(
            f"spectra: expected as many values as the {at.size} wavelengths and as many labels as spectra, "
            f"got shape {values.shape} and {len(labels)} labels"
        )
    ax = new_axes(7.0, 4.0) if ax is None else ax
    for row, curve in enumerate(values):
        colour = STYLES[(row + 3) % len(STYLES)][0]
        ax.plot(at / nm, curve, color=colour, label=labels[row] if labels else None)
    if measured is not None:
        lay_over(ax, measured)
    ax.set(xlabel="wavelength / nm", ylabel="reflectance", xlim=(at[0] / nm, at[-1] / nm))
    top = ax.get_ylim()[1]
    ax.set_ylim(-0.06 * top, top)
    rainbow(ax)
    if labels or measured is not None:
        ax.legend(frameon=False)
    return ax
