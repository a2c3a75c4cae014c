"""What recorded paths met: how far each hit is from where it belongs, and what that does to the path."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray, dot, unit
from fringetrace.geometry import Fit, LevelFit, Patches
from fringetrace.scene import Surface
from fringetrace.tracing.optics_table import scene_media
from fringetrace.tracing.paths import Paths

# What tells roundings of float64 has more digits, where the machine has such numbers.
EXTENDED = np.longdouble


@dataclass(frozen=True, eq=False)
class Met:
    """Bounces of some paths on one surface: the path and bounce of each, its point (n, 3) and face (n,)."""

    surface: Surface
    fit: Fit | None
    path: npt.NDArray[np.int64]
    bounce: npt.NDArray[np.int64]
    point: FloatArray
    face: npt.NDArray[np.int64]

    @property
    def formed(self) -> npt.NDArray[np.bool_]:
        """(n,) bool: on faces that have a form."""
        if self.fit is None:
            return np.zeros(len(self.face), dtype=np.bool_)
        return np.asarray(self.fit.along[self.face] != 0)


def met(paths: Paths) -> Iterator[Met]:
    """Bounces of recorded paths, surface by surface.

    Parameters
    ----------
    paths : Paths
        Traced with record=True.

    Yields
    ------
    Met

    Raises
    ------
    ValueError
        If the trace did not record them.
    """
    if paths.surface is None or paths.triangle is None or paths.points is None:
        raise ValueError("contacts: expected paths traced with record=True, got paths without points")
    for number, surface in enumerate(paths.scene.surfaces):
        path, bounce = np.nonzero(paths.surface == number)
        if len(path) == 0:
            continue
        fit = None if surface.form is None else surface.form.fit(surface.mesh.vertices, surface.mesh.faces)
        point = paths.points[path, bounce + 1]
        yield Met(surface, fit, path, bounce, point, paths.triangle[path, bounce])


def legs(paths: Paths) -> tuple[Array, Array]:
    """Segments of recorded paths, from the recorded points alone.

    Parameters
    ----------
    paths : Paths
        Traced with record=True.

    Returns
    -------
    length : (m, b + 1) longdouble, metres
        Of the segment before each bounce, and of the one to the CCD, negative where the plane that
        it sees lies behind the last surface; 0 where there is none.
    direction : (m, b + 1, 3) longdouble, unit
        Of the light on each segment.
    """
    assert paths.points is not None
    assert paths.starts is not None
    step = paths.points[:, 1:].astype(EXTENDED) - paths.starts
    length = np.sqrt((step**2).sum(axis=2))
    rows, last = np.arange(len(paths)), paths.bounces
    with np.errstate(invalid="ignore", divide="ignore"):
        direction = step / length[:, :, None]
    final = paths.direction.astype(EXTENDED)
    final /= np.sqrt((final**2).sum(axis=1))[:, None]
    direction[rows, last] = final
    length[rows, last] = (step[rows, last] * final).sum(axis=1)
    return np.where(np.isfinite(length), length, 0.0), np.nan_to_num(direction)


def indices(paths: Paths) -> FloatArray:
    """Real refractive index on each segment of recorded paths.

    Parameters
    ----------
    paths : Paths
        Traced with record=True.

    Returns
    -------
    (m, b + 1) float64
        Before each bounce, and behind the last; that of the wave, |Re k| / k0, where it fades aslant.
    """
    assert paths.points is not None
    shape = len(paths), paths.points.shape[1] - 1
    if paths.medium is None:
        return np.ones(shape)
    known = {m: complex(m.index(paths.wavelength or 1.0)) for m in scene_media(paths.scene)}
    direction = np.asarray(legs(paths)[1], dtype=np.float64)
    medium, normal = np.full(shape, np.nan, dtype=np.complex128), np.zeros((*shape, 3))
    medium[:, 0] = known[paths.scene.around]
    for bounces in met(paths):
        surface, at = bounces.surface, (bounces.path, bounces.bounce + 1)
        normal[at] = normals(bounces)
        if not surface.boundary:
            continue
        front = np.einsum("ni,ni->n", facing(bounces), direction[at]) > 0.0
        before, behind = (known[side or paths.scene.around] for side in (surface.front, surface.back))
        medium[at] = np.where(front, before, behind)
    # as it was, where no boundary changed it
    latest = np.maximum.accumulate(np.where(np.isnan(medium), 0, np.arange(shape[1])), axis=1)
    medium = np.take_along_axis(medium, latest, axis=1)
    return _slanting(medium, normal, direction) if medium.imag.any() else medium.real


def _slanting(medium: ComplexArray, normal: FloatArray, direction: FloatArray) -> FloatArray:
    """|Re k| / k0 on each segment, in media that may absorb; see `refractions`.

    `medium` (m, b + 1) are their indices, `normal` (m, b + 1, 3) those of the surfaces met before.
    """
    index = medium.real.copy()
    fade = medium[:, 0].imag[:, None] * direction[:, 0]
    for k in range(1, index.shape[1]):
        n, first, last = normal[:, k], medium[:, k - 1], medium[:, k]
        into, out = dot(n, direction[:, k - 1]), dot(n, direction[:, k])
        sense, along = np.sign(into), dot(n, fade)
        before = index[:, k - 1] * np.abs(into) + 1j * sense * along
        behind = np.sqrt((last - first) * (last + first) + before**2)
        behind = np.where(behind.real + behind.imag < 0.0, -behind, behind)
        back = into * out < 0.0
        deeper = sense * (behind - before) * (first != last)
        wave = index[:, k - 1, None] * direction[:, k - 1] + deeper.real[:, None] * n
        index[:, k] = np.where(back, index[:, k - 1], np.sqrt(dot(wave, wave)))
        fade = fade + np.where(back, -2.0 * along, deeper.imag)[:, None] * n
    return index


def facing(bounces: Met) -> FloatArray:
    """Normal (n, 3) of the facet at each bounce, towards the front."""
    corner = corners(bounces)
    return unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))


def corners(bounces: Met) -> FloatArray:
    """Corners (n, 3, 3) of the facets met, first those of the shortest side: good for normals of needles."""
    corners = bounces.surface.mesh.vertices[bounces.surface.mesh.faces[bounces.face]]
    sides = ((np.roll(corners, -1, axis=1) - corners) ** 2).sum(axis=2)
    order = (np.argmin(sides, axis=1)[:, None] + np.arange(3)) % 3
    return np.take_along_axis(corners, order[:, :, None], axis=1)


def normals(bounces: Met) -> FloatArray:
    """Normal of the surface at each bounce, of either sense.

    Parameters
    ----------
    bounces : Met

    Returns
    -------
    (n, 3) float64, unit
    """
    normal = facing(bounces)
    on = bounces.formed
    if on.any():
        gradient = level(bounces, on, normal[on])[1]
        normal[on] = unit(gradient)
    return normal


def level(bounces: Met, on: Array, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Level function of the form at some bounces, its gradient, its second derivative along directions."""
    fit, point = bounces.fit, bounces.point[on]
    if isinstance(fit, LevelFit):
        return fit.form.level(point, direction)
    assert isinstance(fit, Patches)
    return fit.level(point, direction, bounces.face[on])[:3]
