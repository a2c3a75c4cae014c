"""What recorded paths met: how far each hit is from where it belongs, and what that does to the path."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.crossings import Fit, LevelFit, dot
from fringetrace.facets import standoff
from fringetrace.media import materials
from fringetrace.patches import Patches
from fringetrace.paths import Fate, Paths
from fringetrace.scene import Beam, Surface
from fringetrace.vectors import unit
from fringetrace.waves import Array, ComplexArray, FloatArray

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
    known = {m: complex(m.index(paths.wavelength or 1.0)) for m in materials(paths.scene)}
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
    corners = _corners(bounces)
    return unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def _corners(bounces: Met) -> FloatArray:
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
        gradient = _level(bounces, on, normal[on])[1]
        normal[on] = unit(gradient)
    return normal


def off(bounces: Met) -> Array:
    """Rounding of the hits: how far each stands off its facet, or off the form behind it.

    Parameters
    ----------
    bounces : Met

    Returns
    -------
    (n, 3) longdouble, metres
        Along the normal of the surface.
    """
    corners = _corners(bounces).astype(EXTENDED)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.sqrt((normal**2).sum(axis=1))[:, None]
    height = ((bounces.point - corners[:, 0]) * normal).sum(axis=1)
    on = bounces.formed
    if on.any():
        value, gradient, _ = _level(bounces, on, np.asarray(normal[on], dtype=np.float64))
        normal[on] = gradient / dot(gradient, gradient)[:, None]
        height[on] = value
    return np.asarray(height[:, None] * normal)


def flattened(bounces: Met) -> tuple[FloatArray, FloatArray]:
    """What facets leave out of the smooth surface that they may stand for; see `facets.standoff`.

    Parameters
    ----------
    bounces : Met

    Returns
    -------
    (n, 3) float64, metres
        From the smooth surface to the hit; 0 where a form is behind the facet.
    (n, 3) float64
        The facet's normal less that of the smooth surface.
    """
    height, lean = np.zeros((len(bounces.face), 3)), np.zeros((len(bounces.face), 3))
    plain = ~bounces.formed
    if plain.any():
        mesh, face = bounces.surface.mesh, bounces.face[plain]
        corners = mesh.vertices[mesh.faces[face]]
        normal = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
        above, lean[plain] = standoff(mesh.vertices, mesh.faces, face, bounces.point[plain])
        height[plain] = -above[:, None] * normal
    return height, lean


def curvature(bounces: Met) -> FloatArray:
    """How the normal of the surface turns from place to place: dn = C dp; 0 on facets.

    Parameters
    ----------
    bounces : Met

    Returns
    -------
    (n, 3, 3) float64, 1/m
        Of the normal that `normals` gives.
    """
    bend = np.zeros((len(bounces.face), 3, 3))
    on = bounces.formed
    if not on.any():
        return bend
    normal = normals(bounces)[on]
    least = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    first = unit(np.cross(normal, least))
    second = np.cross(normal, first)
    steep = np.linalg.norm(_level(bounces, on, first)[1], axis=1)
    ways = (first, second, unit(first + second))
    along, across, between = (_level(bounces, on, way)[2] / steep for way in ways)
    twist = between - 0.5 * (along + across)
    bend[on] = np.einsum("n,ni,nj->nij", along, first, first)
    bend[on] += np.einsum("n,ni,nj->nij", across, second, second)
    bend[on] += np.einsum("n,ni,nj->nij", twist, first, second)
    bend[on] += np.einsum("n,ni,nj->nij", twist, second, first)
    return bend


def _level(bounces: Met, on: Array, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Level function of the form at some bounces, its gradient, its second derivative along directions."""
    fit, point = bounces.fit, bounces.point[on]
    if isinstance(fit, LevelFit):
        return fit.form.level(point, direction)
    assert isinstance(fit, Patches)
    return fit.level(point, direction, bounces.face[on])[:3]


def shifted(paths: Paths, bounces: Met, offset: Array, turn: Array) -> Array:
    """What it does to the path that a surface stands somewhere else: -(n' d_out - n d_in) . offset.

    Parameters
    ----------
    paths : Paths
        Traced with record=True.
    bounces : Met
    offset : (n, 3), metres
        Of the hits from where they belong.
    turn : (m, b + 1, 3)
        Directions of the segments, see `legs`.

    Returns
    -------
    (m,) longdouble, metres
        Summed over the bounces of each path. By Fermat's principle, what directions and places
        along the surfaces err does not count, to first order.
    """
    index = indices(paths)
    after, before = (bounces.path, bounces.bounce + 1), (bounces.path, bounces.bounce)
    turned = index[after][:, None] * turn[after] - index[before][:, None] * turn[before]
    error = np.zeros(len(paths), dtype=EXTENDED)
    np.add.at(error, bounces.path, -(turned * offset).sum(axis=1))
    return error


def _lengths(paths: Paths) -> FloatArray:
    """Optical paths, without what thin elements add."""
    if paths.lengths is None or not any(hasattr(s.interface, "act") for s in paths.scene.surfaces):
        return paths.length
    known = [complex(m.index(paths.wavelength or 1.0)).real for m in materials(paths.scene)]
    return np.asarray(paths.lengths @ np.array(known), dtype=np.float64)


def leverage(bounces: Met, direction: FloatArray, index: FloatArray) -> FloatArray:
    """How far rays turn at each bounce where the surface turns by 1: 2 off a mirror.

    From Snell's law, n' d' = n d + (n' c' - n c) nu, with cosines c to the normal nu.

    Parameters
    ----------
    bounces : Met
    direction : (m, b + 1, 3) float64
    index : (m, b + 1) float64

    Returns
    -------
    (n,) float64
    """
    normal = facing(bounces)
    after, before = (bounces.path, bounces.bounce + 1), (bounces.path, bounces.bounce)
    out = index[after] * np.einsum("ni,ni->n", direction[after], normal)
    into = index[before] * np.einsum("ni,ni->n", direction[before], normal)
    return np.asarray(np.abs((out - into) / out), dtype=np.float64)


def rounding(paths: Paths) -> FloatArray:
    """Error of the optical path of each path by the rounding of float64, measured.

    The recorded points are compared with the facets and forms that they should lie on, and the
    optical path with the way from point to point, in longer numbers. A path whose points lie on the
    surfaces and that has the length of the way between them is, by Fermat's principle, the true
    path to where it arrives, to second order.

    Parameters
    ----------
    paths : Paths
        Traced with record=True.

    Returns
    -------
    (m,) float64, metres
        Optical path less the true one to the same place. Where numbers have no more digits than
        float64 (some machines), or behind a form, as large as the roundings of this comparison.
    """
    length, direction = legs(paths)
    index = indices(paths)
    error = _lengths(paths).astype(EXTENDED) - (length * index).sum(axis=1)
    for bounces in met(paths):
        error += shifted(paths, bounces, off(bounces), direction)
    assert paths.points is not None
    if isinstance(paths.source, Beam):  # the phase is 0 on its rectangle
        start = paths.points[:, 0].astype(EXTENDED) - paths.source.centre
        along = paths.source.axes[2].astype(EXTENDED)
        error -= index[:, 0] * (start @ (along / np.sqrt((along**2).sum())))
    elif paths.source.length is not None:
        error -= paths.source.length[paths.ray]
    if paths.ccd is not None:
        seen = np.flatnonzero(paths.fate == Fate.DETECTED)
        normal = paths.ccd.axes[2].astype(EXTENDED)
        beyond = (paths.origin[seen].astype(EXTENDED) - paths.ccd.centre) @ normal - paths.ccd.focus
        last = paths.bounces[seen]
        error[seen] += beyond * (direction[seen, last] @ normal) * index[seen, last]
    return np.asarray(error, dtype=np.float64)
