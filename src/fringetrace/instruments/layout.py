"""Layout of interferometers: checked sizes, ray grids, tilted plates, transparent samples."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial

import numpy as np

from fringetrace.core import FloatArray, unit
from fringetrace.geometry import Mesh, as_mesh
from fringetrace.optics import Dielectric, Material, Pupil
from fringetrace.scene import Profile, Scene, Surface

# Rays along either axis at least: what differences of fourth order need.
LEAST = 5
# Tilt of a reference, radians: its light then meets what it is meant to.
TILT = 0.1
# tan and sin of the steepest rays that benches for transparent samples carry on.
STEEPEST = 0.8
STEEP = STEEPEST / math.hypot(1.0, STEEPEST)

Sample = Mesh | Surface | Iterable[Surface]


def checked_image_size(
    bench: str, aperture: float, pixels: tuple[int, int], rays: float
) -> tuple[float, float]:
    """Checked width and height of an image, metres.

    Parameters
    ----------
    bench : str
        For messages.
    aperture : float, metres
    pixels : (rows, columns)
    rays : float
        A pixel, along either axis.

    Returns
    -------
    (width, height), metres

    Raises
    ------
    ValueError
    """
    if not (math.isfinite(aperture) and aperture > 0.0):
        raise ValueError(f"{bench} aperture: expected a positive length in metres, got {aperture!r}")
    if len(pixels) != 2 or not all(isinstance(n, (int, np.integer)) and n > 0 for n in pixels):
        raise ValueError(f"{bench} pixels: expected positive whole (rows, columns), got {pixels!r}")
    if not (0.0 < rays < 1.0 or (rays >= 1 and float(rays).is_integer())):
        raise ValueError(f"{bench} rays: expected a positive whole number, or a part of 1, got {rays!r}")
    return aperture, aperture * pixels[0] / pixels[1]


def checked_tilt(bench: str, tilt: tuple[float, float]) -> None:
    """Check that a tilt keeps the reference beam on the instrument; else ValueError."""
    if not math.hypot(*tilt) <= TILT:
        raise ValueError(f"{bench} reference_tilt: expected up to {TILT} rad, got {tilt!r}")


def ray_grid(pixels: tuple[int, int], rays: float) -> tuple[int, int]:
    """Rows and columns of a beam's rays, for a number of rays per pixel."""
    least = 1 if rays >= 1 else LEAST
    return max(least, round(pixels[0] * rays)), max(least, round(pixels[1] * rays))


def flip_profile(profile: Profile | None) -> Profile | None:
    """Profile over the image as one over a beam whose columns run along -x."""
    return None if profile is None else partial(_mirrored, profile)


def _mirrored(profile: Profile, x: FloatArray, y: FloatArray) -> FloatArray:
    return profile(-x, y)


def standing_rotation(normal: FloatArray) -> FloatArray:
    """Rotation (3, 3) of a plate from +z to a normal in any direction but y, its rows still along y."""
    n = unit(np.asarray(normal, dtype=np.float64)[None])[0]
    side = unit(np.cross([0.0, 1.0, 0.0], n)[None])[0]
    return np.stack([side, np.cross(n, side), n], axis=1)


def tilted_normal(tilt: tuple[float, float]) -> FloatArray:
    """Normal of a tilted mirror that faced +z; `path_slope` of its light is along the tilt."""
    angle = math.hypot(*tilt)
    scale = math.sin(angle) / angle if angle > 0.0 else 1.0
    return np.array([scale * tilt[0], scale * tilt[1], math.cos(angle)])


def surrounding_medium(medium: Material | complex | str | None) -> Material | None:
    """Medium around an interferometer, from a material, name or index; None: vacuum."""
    from fringetrace.optics import as_material

    return None if medium is None else as_material(medium, "medium")


def transmitting_surfaces(bench: str, sample: Sample, index: object) -> tuple[Surface, ...]:
    """Surfaces of a transparent sample.

    Parameters
    ----------
    bench : str
        For messages.
    sample : Mesh, Surface, or several of these
    index : Material, number or name, or None
        What a mesh is filled with; what its faces reflect is then not followed.

    Returns
    -------
    tuple of Surface

    Raises
    ------
    ValueError
        If a mesh has no index, or surfaces have one besides their own media.
    TypeError
        If the sample is no mesh.
    """
    if isinstance(sample, Surface):
        sample = (sample,)
    if isinstance(sample, (list, tuple)):
        if index is not None:
            raise ValueError(
                f"{bench} index: expected None beside surfaces, which name their media, got {index!r}"
            )
        return tuple(sample)
    mesh = as_mesh(sample, "sample")
    if index is None:
        raise ValueError(f"{bench} index: expected that of what the mesh is filled with, got None")
    return (Surface(mesh, Dielectric("transmitted"), "sample", back=index),)  # type: ignore[arg-type]


def sample_extent(surfaces: Iterable[Surface], aperture: float) -> tuple[float, float]:
    """Extent of a sample from the axis (at least the image), and from z = 0 to either side, metres."""
    bounds = np.array([surface.mesh.bounds for surface in surfaces])
    aside = float(np.abs(bounds[:, :, :2]).max())
    return max(aside, 0.5 * math.sqrt(2.0) * aperture), float(np.abs(bounds[:, :, 2]).max())


def pupil(bench: str, scene: Scene, aperture: float | None, wavelength: float = 0.0) -> Pupil:
    """Pupil that limits rays to a numerical aperture; None: to those that fit the instrument.

    Parameters
    ----------
    bench : str
        For messages.
    scene : Scene
        Its medium is that before the objective.
    aperture : float or None
    wavelength : float, metres
        At which the index is taken, where it depends on it.

    Returns
    -------
    Pupil

    Raises
    ------
    ValueError
        If the aperture is not positive, or more than the bench carries on.
    """
    most = STEEP * real_index(scene.around, wavelength)
    if aperture is not None and not 0.0 < aperture <= most:
        raise ValueError(f"{bench} na: expected a number up to {most:.4g}, got {aperture!r}")
    return Pupil(np.array([0.0, 0.0, 1.0]), most if aperture is None else aperture)


def real_index(material: object, wavelength: float) -> float:
    """Real index of a material, name or index, at a wavelength (any, if it is not dispersive)."""
    from fringetrace.optics import as_material

    medium = as_material(material)  # type: ignore[arg-type]
    return complex(medium.index(wavelength if medium.dispersive else 1.0)).real
