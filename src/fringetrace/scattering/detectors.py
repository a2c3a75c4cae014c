"""Far-field detectors of a goniometer: cones, cells of the hemisphere, pixels at a distance.

Directions are position angles: theta from +z, the sample's normal, towards +x (towards phi about z
from +x). Light that comes from (theta, phi) is mirrored to (-theta, phi).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from numbers import Real
from typing import Protocol

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray, short_repr
from fringetrace.geometry import IndexArray
from fringetrace.scene import CCD
from fringetrace.tracing import Fate, Paths, project

# Of each direction: which paths arrive, and their optical lengths in metres.
DirectionPaths = Iterator[tuple[IndexArray, FloatArray]]


def towards(theta: npt.ArrayLike, phi: npt.ArrayLike) -> FloatArray:
    """Unit vectors of directions.

    Parameters
    ----------
    theta, phi : float64, radians, shapes that broadcast

    Returns
    -------
    (..., 3) float64
    """
    polar, azimuth = np.broadcast_arrays(np.asarray(theta, np.float64), np.asarray(phi, np.float64))
    across = np.sin(polar)
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.cos(polar)], axis=-1)


def sides(axis: npt.ArrayLike, phi: npt.ArrayLike, travel: float = 1.0) -> FloatArray:
    """Polarisation vectors of s and p light along goniometer directions: s is horizontal, p = direction x s.

    Parameters
    ----------
    axis : (..., 3) float64
        As of `towards`.
    phi : (...) float64, radians
        Its azimuth, which also says what s is straight up.
    travel : {1, -1}
        Along the axis, or against it.

    Returns
    -------
    (..., 2, 3) float64
    """
    s = np.broadcast_to(towards(0.5 * np.pi, np.asarray(phi) + 0.5 * np.pi), np.shape(axis))
    return np.stack([s, np.cross(travel * np.asarray(axis), s)], axis=-2)


def checked_angles(angles: npt.ArrayLike, what: str, most: float | None = None) -> FloatArray:
    """Checked finite angles as an array, radians.

    Parameters
    ----------
    angles : float or (n,) array-like, radians
    what : str
        The name used in the error message.
    most : float, radians, optional
        None of them may be this far from 0.

    Returns
    -------
    (n,) float64, radians

    Raises
    ------
    ValueError
        If there are none, one is not finite, or one is too large.
    """
    values = np.atleast_1d(np.asarray(angles, dtype=np.float64))
    if values.ndim != 1 or values.size == 0 or not np.isfinite(values).all():
        raise ValueError(f"{what}: expected finite angles of shape (n,), got shape {values.shape} or others")
    if most is not None and not (np.abs(values) < most).all():
        raise ValueError(
            f"{what}: expected angles below {most:.6g} rad, got up to {np.abs(values).max():.6g}"
        )
    return values


class Detector(Protocol):
    """Protocol of detectors: a grid theta x phi of directions, and the paths that each accepts."""

    @property
    def theta(self) -> FloatArray:
        """Polar angles from the normal, (a,) float64, radians."""

    @property
    def phi(self) -> FloatArray:
        """Azimuths about the normal, (b,) float64, radians."""

    @property
    def solid_angle(self) -> FloatArray:
        """Accepted solid angle of each direction, (theta, phi) float64, sr."""

    @property
    def projected(self) -> FloatArray:
        """Projected solid angle of each direction, weighted with cos(theta), (theta, phi) float64, sr."""

    def arrivals(self, paths: Paths, centre: FloatArray) -> DirectionPaths:
        """Paths that arrive in each direction (theta-major), and their optical path lengths."""


def _exits(paths: Paths) -> IndexArray:
    """The paths that met something and left."""
    return np.flatnonzero((paths.fate == Fate.LEFT) & (paths.bounces > 0))


def far_lengths(paths: Paths, rows: IndexArray, centre: FloatArray, direction: FloatArray) -> FloatArray:
    """Optical path lengths to the plane through a centre, normal to a direction: far-field phase.

    Parameters
    ----------
    paths : Paths
        Traced without a CCD.
    rows : (n,) int64
        Which of them; they have left.
    centre : (3,) float64, metres
    direction : (3,) float64, unit
        Of observation.

    Returns
    -------
    (n,) float64, metres
    """
    ahead = (paths.origin[rows] - centre) @ direction
    if paths.index is not None:
        ahead *= paths.index[rows]
    return np.asarray(paths.length[rows] - ahead, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Cones:
    """Detector of circular cones about directions in the far field.

    Parameters
    ----------
    theta : (a,) radians, within a quarter turn of the normal
    half_angle : float, radians
        Acceptance: rays this near to a direction belong to it.
    phi : (b,) radians

    Raises
    ------
    ValueError
        For angles out of range; a cone may not reach below the horizon.
    """

    theta: FloatArray
    half_angle: float
    phi: FloatArray = field(default_factory=lambda: np.zeros(1))

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if not (isinstance(self.half_angle, Real) and 0.0 < self.half_angle < 0.5 * np.pi):
            raise ValueError(
                f"Cones half_angle: expected radians between 0 and pi/2, got {self.half_angle!r}"
            )
        highest = 0.5 * np.pi - self.half_angle
        object.__setattr__(self, "theta", checked_angles(self.theta, "Cones theta", highest))
        object.__setattr__(self, "phi", checked_angles(self.phi, "Cones phi"))

    @property
    def solid_angle(self) -> FloatArray:
        """Solid angle of each cone, 2 pi (1 - cos half_angle), (theta, phi) float64, sr."""
        angle = 4.0 * np.pi * np.sin(0.5 * self.half_angle) ** 2
        return np.full((len(self.theta), len(self.phi)), angle)

    @property
    def projected(self) -> FloatArray:
        """Projected solid angle of each cone, pi sin^2(half_angle) cos(theta), (theta, phi) float64, sr."""
        disc = np.pi * np.sin(self.half_angle) ** 2 * np.cos(self.theta)
        return np.repeat(disc[:, None], len(self.phi), axis=1)

    def arrivals(self, paths: Paths, centre: FloatArray) -> DirectionPaths:
        """Paths in each cone, see `Detector`; a path may be in several cones, or in none."""
        rows = _exits(paths)
        direction = paths.direction[rows]
        chord = 2.0 * np.sin(0.5 * self.half_angle)  # 1 - cos would lose the digits of narrow cones
        for axis in towards(self.theta[:, None], self.phi).reshape(-1, 3):
            inside = rows[np.linalg.norm(direction - axis, axis=1) <= chord]
            yield inside, far_lengths(paths, inside, centre, axis)


@dataclass(frozen=True, eq=False)
class Cells:
    """Detector of the upper hemisphere, in cells of equal steps of theta and phi.

    Parameters
    ----------
    rings, sectors : int
        Steps of theta from 0 to pi/2, and of phi from 0 to 2 pi.

    Raises
    ------
    ValueError
        If a count is not a whole number from 1.
    """

    rings: int
    sectors: int
    theta: FloatArray = field(init=False)
    phi: FloatArray = field(init=False)

    __repr__ = short_repr

    def __post_init__(self) -> None:
        for count, what in ((self.rings, "rings"), (self.sectors, "sectors")):
            if not (isinstance(count, (int, np.integer)) and count > 0):
                raise ValueError(f"Cells {what}: expected a whole number from 1, got {count!r}")
        object.__setattr__(self, "theta", (np.arange(self.rings) + 0.5) * (0.5 * np.pi / self.rings))
        object.__setattr__(self, "phi", (np.arange(self.sectors) + 0.5) * (2.0 * np.pi / self.sectors))

    def _rings(self, heights: FloatArray) -> FloatArray:
        """Differences of a function given on the circles between rings, times a sector."""
        ring = np.abs(np.diff(heights)) * (2.0 * np.pi / self.sectors)
        return np.repeat(ring[:, None], self.sectors, axis=1)

    @property
    def solid_angle(self) -> FloatArray:
        """Solid angle of each cell, (theta, phi) float64, sr; their sum is 2 pi."""
        return self._rings(np.cos(np.linspace(0.0, 0.5 * np.pi, self.rings + 1)))

    @property
    def projected(self) -> FloatArray:
        """Projected solid angle of each cell, (theta, phi) float64, sr; their sum is pi."""
        return self._rings(0.5 * np.sin(np.linspace(0.0, 0.5 * np.pi, self.rings + 1)) ** 2)

    def arrivals(self, paths: Paths, centre: FloatArray) -> DirectionPaths:
        """Paths in each cell, see `Detector`; each path that leaves upwards is in one cell."""
        rows = _exits(paths)
        x, y, z = paths.direction[rows].T
        up = z > 0.0
        theta, phi = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x) % (2.0 * np.pi)
        ring = np.minimum(theta / (0.5 * np.pi) * self.rings, self.rings - 1).astype(np.int64)
        sector = np.minimum(phi / (2.0 * np.pi) * self.sectors, self.sectors - 1).astype(np.int64)
        cell = np.where(up, ring * self.sectors + sector, self.rings * self.sectors)
        order = np.argsort(cell, kind="stable")
        ends = np.searchsorted(cell[order], np.arange(self.rings * self.sectors + 1))
        for i, axis in enumerate(towards(self.theta[:, None], self.phi).reshape(-1, 3)):
            inside = rows[order[ends[i] : ends[i + 1]]]
            yield inside, far_lengths(paths, inside, centre, axis)


@dataclass(frozen=True, eq=False)
class Pixels:
    """Detector of one square pixel per direction, at a distance from the sample's centre and facing it.

    It adds the amplitudes of all rays that fall on it, with their lengths as they arrive; it blocks
    none of them.

    Parameters
    ----------
    theta : (a,) radians, within a quarter turn of the normal
    distance, width : float, metres
    phi : (b,) radians

    Raises
    ------
    ValueError
        For angles out of range, or lengths that are not positive.
    """

    theta: FloatArray
    distance: float
    width: float
    phi: FloatArray = field(default_factory=lambda: np.zeros(1))

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "theta", checked_angles(self.theta, "Pixels theta", 0.5 * np.pi))
        object.__setattr__(self, "phi", checked_angles(self.phi, "Pixels phi"))
        for length, what in ((self.distance, "distance"), (self.width, "width")):
            if not (isinstance(length, Real) and np.isfinite(length) and length > 0.0):
                raise ValueError(f"Pixels {what}: expected a positive length in metres, got {length!r}")

    @property
    def solid_angle(self) -> FloatArray:
        """Solid angle of each pixel, width^2 / distance^2, (theta, phi) float64, sr."""
        return np.full((len(self.theta), len(self.phi)), (self.width / self.distance) ** 2)

    @property
    def projected(self) -> FloatArray:
        """Projected solid angle of each pixel, (theta, phi) float64, sr."""
        return self.solid_angle * np.cos(self.theta)[:, None]

    def arrivals(self, paths: Paths, centre: FloatArray) -> DirectionPaths:
        """Paths on each pixel, see `Detector`; a path may fall on several pixels, or on none."""
        met = paths.bounces > 0
        for theta in self.theta:
            for phi in self.phi:
                seen = project(paths, self._ccd(theta, phi, centre))
                rows = np.flatnonzero((seen.fate == Fate.DETECTED) & met)
                yield rows, seen.length[rows]

    def _ccd(self, theta: float, phi: float, centre: FloatArray) -> CCD:
        axis = towards(theta, phi)
        up = towards(0.5 * np.pi, phi + 0.5 * np.pi)
        return CCD(centre + self.distance * axis, -axis, up, self.width, (1, 1))


def fraunhofer_paths(paths: Paths, detector: Detector, centre: FloatArray) -> DirectionPaths:
    """All paths that met something and left, for each direction of a detector (Fraunhofer sum).

    Parameters
    ----------
    paths : Paths
    detector : Detector
    centre : (3,) float64, metres

    Yields
    ------
    rows : (n,) int64
    length : (n,) float64, metres
    """
    rows = _exits(paths)
    axes: Array = towards(detector.theta[:, None], detector.phi).reshape(-1, 3)
    for axis in axes:
        yield rows, far_lengths(paths, rows, centre, axis)
