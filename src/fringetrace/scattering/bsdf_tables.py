"""BSDF tables: interpolation, a sphere under one light, and Mitsuba files."""

from __future__ import annotations

import os
import struct
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, nm, tables

if TYPE_CHECKING:
    from xarray import DataArray

AXES = ("theta_i", "phi_i", "theta_o", "phi_o", "wavelength")
# Mitsuba's numbers of types.
TYPES = {"uint8": 1, "float32": 10}
# Where nothing is reflected a direction is still drawn this often, as a part of the mean.
SELDOM = 1e-3
# Light along the surface is looked up this part above it, for there is none on it.
GRAZING = 1e-6


def brdf_table(
    values: npt.ArrayLike,
    theta_i: npt.ArrayLike,
    phi_i: npt.ArrayLike,
    theta_o: npt.ArrayLike,
    phi_o: npt.ArrayLike,
    wavelengths: npt.ArrayLike,
) -> DataArray:
    """BRDF table f = dL_o / (L_i cos(theta_i) dOmega_i) with its axes.

    Parameters
    ----------
    values : (i, j, o, p, n) array-like, 1/sr
    theta_i, phi_i, theta_o, phi_o : (i,), (j,), (o,), (p,) array-like, radians
        Directions from the surface to the light and to the eye: theta from its normal, phi from its x axis.
        A single phi_i stands for an isotropic surface.
    wavelengths : (n,) array-like, metres

    Returns
    -------
    xarray.DataArray
        brdf (theta_i, phi_i, theta_o, phi_o, wavelength).
    """
    angles = zip(AXES, (theta_i, phi_i, theta_o, phi_o), strict=False)
    axes = {**{name: (np.asarray(along), "rad") for name, along in angles}, "wavelength": (wavelengths, "m")}
    return tables.labelled(values, axes, name="brdf", unit="1/sr")


def _checked(brdf: DataArray) -> tuple[list[FloatArray], FloatArray]:
    """Angles and values, (theta_i, phi_i, theta_o, phi_o, ...)."""
    if tuple(brdf.dims[:4]) != AXES[:4] or brdf.ndim != 5:
        raise ValueError(f"BRDF: expected axes {', '.join(AXES)}, got {', '.join(map(str, brdf.dims))}")
    angles = [np.asarray(brdf[name], dtype=np.float64) for name in AXES[:4]]
    values = np.asarray(brdf, dtype=np.float64)
    if not np.isfinite(values).all():
        raise ValueError(f"BRDF: expected finite values, got {int((~np.isfinite(values)).sum())} others")
    for name, along in zip(AXES, angles, strict=False):
        if not (np.diff(along) > 0.0).all():
            raise ValueError(f"BRDF: expected increasing {name}, got {along}")
        if name.startswith("theta") and not (along[0] >= 0.0 and along[-1] <= 0.5 * np.pi + 1e-12):
            raise ValueError(f"BRDF: expected {name} from 0 to pi/2, got {along[0]:g} to {along[-1]:g}")
    return angles, values


def _turned(nodes: FloatArray, values: FloatArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """Azimuths over the whole turn: one more node at each end, unless there is only one."""
    if len(nodes) == 1:
        return nodes, values
    if nodes[-1] - nodes[0] > 2.0 * np.pi - 1e-9:  # both ends are the same direction
        nodes, values = nodes[:-1], np.delete(values, -1, axis=axis)
    turn = 2.0 * np.pi
    around = np.concatenate([[nodes[-1] - turn], nodes, [nodes[0] + turn]])
    ends = np.take(values, [-1], axis=axis), np.take(values, [0], axis=axis)
    return around, np.concatenate([ends[0], values, ends[1]], axis=axis)


def _between(at: FloatArray, nodes: FloatArray) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Which nodes enclose a place, by the lower one, and how far it is on the way to the other."""
    if len(nodes) == 1:
        return np.zeros(at.shape, dtype=np.intp), np.zeros(at.shape)
    low = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, len(nodes) - 2)
    part = (at - nodes[low]) / (nodes[low + 1] - nodes[low])
    return low, np.clip(part, 0.0, 1.0)


def lookup(brdf: DataArray, incident: npt.ArrayLike, outgoing: npt.ArrayLike) -> FloatArray:
    """BRDF between the entries of a table: linear in each angle, periodic in azimuth.

    Parameters
    ----------
    brdf : xarray.DataArray
        (theta_i, phi_i, theta_o, phi_o, anything), as of `brdf_table`. If phi_i is a single angle the surface
        is isotropic: only phi_o - phi_i counts.
    incident, outgoing : (..., 3) array-like
        To the light and to the eye, unit vectors, z along the surface's normal.

    Returns
    -------
    (..., n) float64, 1/sr
        Beyond the tabulated theta the last value; 0 where light or eye is below the surface.

    Raises
    ------
    ValueError
        If the axes are others, do not increase, or values are not finite.
    """
    (theta_i, phi_i, theta_o, phi_o), values = _checked(brdf)
    wi, wo = np.broadcast_arrays(*(np.asarray(w, dtype=np.float64) for w in (incident, outgoing)))
    turn_i, turn_o = (np.arctan2(w[..., 1], w[..., 0]) for w in (wi, wo))
    if len(phi_i) == 1:
        turn_o = turn_o - turn_i + phi_i[0]
    phi_i, values = _turned(phi_i, values, 1)
    phi_o, values = _turned(phi_o, values, 3)
    places = [
        _between(np.arctan2(np.hypot(wi[..., 0], wi[..., 1]), wi[..., 2]), theta_i),
        _between(phi_i[0] + np.mod(turn_i - phi_i[0], 2.0 * np.pi), phi_i),
        _between(np.arctan2(np.hypot(wo[..., 0], wo[..., 1]), wo[..., 2]), theta_o),
        _between(phi_o[0] + np.mod(turn_o - phi_o[0], 2.0 * np.pi), phi_o),
    ]
    found = np.zeros((*wi.shape[:-1], values.shape[-1]))
    for corner in np.ndindex(2, 2, 2, 2):
        weight = np.prod(
            [part if up else 1.0 - part for up, (_, part) in zip(corner, places, strict=True)], 0
        )
        index = tuple(
            np.minimum(low + up, size - 1)
            for up, (low, _), size in zip(corner, places, values.shape, strict=False)
        )
        found += weight[..., None] * values[index]
    above = (wi[..., 2] > 0.0) & (wo[..., 2] > 0.0)
    return np.asarray(found * above[..., None])


def shaded_sphere(brdf: DataArray, light: npt.ArrayLike = (0.0, 0.0, 1.0), pixels: int = 256) -> FloatArray:
    """Sphere with a BRDF under one distant light, seen along z: radiance over irradiance.

    Parameters
    ----------
    brdf : xarray.DataArray
        See `lookup`; its last axis may be wavelengths, or X, Y, Z of pi f.
    light : (3,) array-like
        To the light; x is to the right, y up, z to the eye.
    pixels : int
        Rows, and columns.

    Returns
    -------
    (pixels, pixels, n) float64, 1/sr
        f cos(theta_i), [row, column] = [y, x]; NaN beside the sphere. On the sphere the surface's y axis
        lies with the sphere's meridian, x along its circles of latitude.
    """
    side = (np.arange(pixels) + 0.5) * 2.0 / pixels - 1.0
    x, y = np.meshgrid(side, side)
    on = x**2 + y**2 < 1.0
    normal = np.stack([x[on], y[on], np.sqrt(1.0 - x[on] ** 2 - y[on] ** 2)], axis=-1)
    east = np.cross([0.0, 1.0, 0.0], normal)
    east /= np.linalg.norm(east, axis=-1, keepdims=True)
    frames = np.stack([east, np.cross(normal, east), normal], axis=1)
    to_light = np.asarray(light, dtype=np.float64)
    incident = frames @ (to_light / np.linalg.norm(to_light))
    image = np.full((pixels, pixels, brdf.shape[-1]), np.nan)
    image[on] = lookup(brdf, incident, frames[:, :, 2]) * incident[:, 2:]
    return image


def _direction(theta: float, phi: float) -> FloatArray:
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def _halfway(pixels: int) -> tuple[FloatArray, FloatArray]:
    """Half vectors on Mitsuba's square, (phi, theta, 3), and the solid angle that each stands for."""
    u = np.linspace(0.0, 1.0, pixels)
    theta, phi = np.meshgrid(0.5 * np.pi * u**2, (2.0 * u - 1.0) * np.pi)
    half = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    return half, np.sin(theta) * np.sqrt(theta)


def mitsuba(
    brdf: DataArray,
    path: str | os.PathLike[str],
    pixels: int = 64,
    incidences: tuple[int, int] = (19, 37),
    name: str = "fringetrace",
) -> None:
    """Write a BRDF for Mitsuba 3's plugin `measured` (spectral variants).

    That stores f cos(theta_o) against the half vector between light and eye, on a square of
    sqrt(theta_m) and phi_m (Dupuy and Jakob, ACM Trans. Graph. 37, 274 (2018)), with maps that say
    where to draw directions. Its warp is left out here (a uniform one, `jacobian` 0), so that no normal
    distribution has to be made up; directions are drawn as light is reflected. The file takes
    4 bytes x pixels^2 x incidences x wavelengths.

    Parameters
    ----------
    brdf : xarray.DataArray
        As of `brdf_table`, resampled by `lookup`; a single phi_i is an isotropic surface.
    path : path
        The file is there in full or not at all.
    pixels : int, at least 2
        Of the half vector in either angle. Mitsuba's interpolation is linear between them.
    incidences : (theta, phi)
        Angles of the light, over 0 to pi/2 and -pi to pi; phi is 1 for isotropic surfaces. Linear between
        them too, at one half vector: it is these that a smooth surface needs.
    name : str
        A description, kept in the file.

    Raises
    ------
    ValueError
        If axes or values are not those of a BRDF.
    """
    _checked(brdf)
    theta_i = np.linspace(0.0, 0.5 * np.pi, incidences[0])
    phi_i = np.linspace(-np.pi, np.pi, incidences[1]) if brdf.sizes["phi_i"] > 1 else np.zeros(1)
    half, share = _halfway(pixels)
    shape = (len(phi_i), len(theta_i), pixels, pixels)
    spectra = np.empty((*shape[:2], brdf.shape[-1], pixels, pixels), dtype=np.float32)
    chance = np.empty(shape, dtype=np.float32)
    for j, i in np.ndindex(*shape[:2]):
        theta = np.minimum(theta_i[i], 0.5 * np.pi * (1.0 - GRAZING))
        wi = _direction(float(theta), float(phi_i[j]))
        cosine = half @ wi
        wo = 2.0 * cosine[..., None] * half - wi
        light = lookup(brdf, wi, wo) * np.maximum(wo[..., 2:], 0.0)
        spectra[j, i] = np.moveaxis(light, -1, 0)
        drawn = light.mean(axis=-1) * np.maximum(cosine, 0.0) * share
        chance[j, i] = drawn + SELDOM * drawn.mean() + np.finfo(np.float32).tiny
    even = np.ones((2, 2), dtype=np.float32)
    _write_tensors(
        path,
        description=np.frombuffer(name.encode(), dtype=np.uint8),
        jacobian=np.zeros(1, dtype=np.uint8),
        theta_i=theta_i.astype(np.float32),
        phi_i=phi_i.astype(np.float32),
        wavelengths=(np.asarray(brdf["wavelength"]) / nm).astype(np.float32),
        ndf=even, sigma=even, vndf=np.ones((*shape[:2], 2, 2), dtype=np.float32),
        luminance=chance, spectra=spectra,
    )  # fmt: skip


def _write_tensors(path: str | os.PathLike[str], **fields: npt.NDArray[np.generic]) -> None:
    """Mitsuba's tensor file: heads of all fields, then their numbers, each from a multiple of 8 bytes on."""
    sizes = [2 + len(name.encode()) + 2 + 1 + 8 + 8 * field.ndim for name, field in fields.items()]
    place = 18 + sum(sizes)
    heads, bodies = [b"tensor_file\0" + struct.pack("<BBI", 1, 0, len(fields))], []
    for name, field in fields.items():
        gap = -place % 8
        bodies.append(b"\0" * gap + np.ascontiguousarray(field).tobytes())
        label = name.encode()
        heads.append(struct.pack("<H", len(label)) + label)
        heads.append(struct.pack("<HBQ", field.ndim, TYPES[field.dtype.name], place + gap))
        heads.append(struct.pack(f"<{field.ndim}Q", *field.shape))
        place += gap + field.nbytes
    target = Path(path)
    with tempfile.TemporaryDirectory(prefix=".fringetrace-", dir=target.parent) as folder:
        part = Path(folder, target.name)
        part.write_bytes(b"".join(heads + bodies))
        os.replace(part, target)
