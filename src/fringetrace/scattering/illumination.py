"""Illumination of a goniometer's sample: a plane wave over a rectangle, from any direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, checked_length, short_repr
from fringetrace.geometry import breadth
from fringetrace.rigorous import CONDUCTOR, Index, Validity, validity
from fringetrace.scattering.detectors import sides, towards
from fringetrace.scene import Beam, Scene
from fringetrace.tracing import Rays, launch

SourceFunction = Callable[[float, float], Beam | Rays]


def scene_validity(scene: Scene, wavelength: float) -> Validity:
    """Validity of ray optics for the smallest part of a scene, taken for a rod; see `fringetrace.validity`.

    Parameters
    ----------
    scene : Scene
    wavelength : float, metres
        In vacuum.

    Returns
    -------
    Validity
        Of half the `breadth` of a mesh, out of its own matter or a conductor.
    """
    around = scene.around
    found = []
    for surface in scene.surfaces:
        index: Index = CONDUCTOR
        host: Index = around.index
        if surface.boundary:
            index, host = ((medium or around).index for medium in (surface.back, surface.front))
        found.append(validity(0.5 * breadth(surface.mesh), wavelength, index, host))
    return min(found, key=lambda one: one.size_parameter)


def footprint(
    theta: float,
    phi: float,
    size: tuple[float, float],
    shape: tuple[int, int],
    centre: FloatArray,
    reach: float,
    jones: npt.ArrayLike | None = None,
) -> Rays:
    """Plane wave whose rays cross the plane through the sample's centre in the same grid at any angle.

    Parameters
    ----------
    theta, phi : float, radians
        Where the light comes from.
    size : (width, height), metres
        Of the lit rectangle, along x and along y.
    shape : (rows, columns)
        Rays along y and along x, at the centres of equal cells.
    centre : (3,) float64, metres
    reach : float, metres
        Distance from the centre of the plane across the light that rays start from, with phase 0.
    jones : (2,) complex, optional
        Amplitudes of s and p, see `detectors.sides`. None: rays carry one number.

    Returns
    -------
    Rays
        Each stands for an area width * height * cos(theta) / rays of the wave.
    """
    rows, columns = shape
    x = ((np.arange(columns) + 0.5) / columns - 0.5) * size[0]
    y = ((np.arange(rows) + 0.5) / rows - 0.5) * size[1]
    grid = np.zeros((rows, columns, 3))
    grid[..., 0], grid[..., 1] = x, y[:, None]
    offset, axis = grid.reshape(-1, 3), towards(theta, phi)
    start = centre + offset + np.outer(reach - offset @ axis, axis)
    area = size[0] * size[1] * abs(np.cos(theta)) / (rows * columns)
    field = None if jones is None else np.asarray(jones, np.complex128) @ sides(axis, phi, -1.0)
    return Rays(start, np.broadcast_to(-axis, start.shape), area=area, polarisation=field)


@dataclass(frozen=True, eq=False)
class Illumination:
    """Sample of a goniometer: its scene, the lit rectangle and the phase centre.

    Parameters
    ----------
    scene : Scene
        The sample's normal is +z.
    aperture : (width, height), metres, optional
        The rectangle along x and y of the plane through the centre that is lit. Default: the box
        around the sample.
    rays : (rows, columns)
        Rays along y and x.
    centre : (3,) metres, optional
        What the goniometer turns about, and phases refer to. Default: the middle of the box.
    source : callable, optional
        (theta, phi) -> Beam or Rays, parallel, in place of a lit rectangle.

    Raises
    ------
    ValueError
        If the aperture is no pair of positive lengths, or the counts are not from 1.
    """

    scene: Scene
    aperture: tuple[float, float] | None = None
    rays: tuple[int, int] = (256, 256)
    centre: npt.ArrayLike | None = None
    source: SourceFunction | None = None

    __repr__ = short_repr

    def __post_init__(self) -> None:
        low, high = self.bounds
        size = tuple(high - low)[:2] if self.aperture is None else self.aperture
        width, height = (checked_length(side, "goniometer aperture") for side in size)
        object.__setattr__(self, "aperture", (width, height))
        if len(self.rays) != 2 or not all(isinstance(n, (int, np.integer)) and n > 0 for n in self.rays):
            raise ValueError(f"goniometer rays: expected two whole numbers from 1, got {self.rays!r}")
        middle = 0.5 * (low + high) if self.centre is None else self.centre
        object.__setattr__(self, "centre", np.asarray(middle, dtype=np.float64))

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Bounding box of the sample, (3,) float64 lower and upper corner, metres."""
        boxes = np.stack([surface.mesh.bounds for surface in self.scene.surfaces])
        return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)

    def light(self, theta: float, phi: float, jones: npt.ArrayLike | None = None) -> Beam | Rays:
        """Light on the sample from one direction.

        Parameters
        ----------
        theta, phi : float, radians
        jones : (2,) complex, optional
            See `footprint`.

        Returns
        -------
        Beam or Rays

        Raises
        ------
        ValueError
            For a polarisation beside a source, which has its own.
        """
        if self.source is not None:
            if jones is not None:
                raise ValueError("goniometer polarisation: expected none beside a source, which has its own")
            return self.source(theta, phi)
        assert self.aperture is not None
        low, high = self.bounds
        reach = float(np.linalg.norm(high - low) + np.hypot(*self.aperture))
        return footprint(theta, phi, self.aperture, self.rays, np.asarray(self.centre), reach, jones)

    def start(self, source: Beam | Rays, wavelength: float | None = None) -> float:
        """Optical path of parallel light from its start to the plane through the centre, normal to it.

        Parameters
        ----------
        source : Beam or Rays
        wavelength : float, metres, optional
            Needed where the medium around is dispersive.

        Returns
        -------
        float, metres
        """
        first = launch(source, 0, 1) if isinstance(source, Beam) else source.part(0, 1)
        assert first.length is not None
        way = (np.asarray(self.centre) - first.origin[0]) @ first.direction[0]
        index = 1.0 if self.scene.medium is None else self.scene.medium.index(wavelength or 1.0).real
        return float(first.length[0] + index * way)
