"""Reference ray tracer in single precision throughout, for comparison only."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray
from fringetrace.scene import CCD, Beam, Scene
from fringetrace.tracing import Fate, Float32, Paths, constants, float32_hits, launch, plain

# A ray restarts this part of the scene's size along itself, so as not to meet what it has just left;
# float32 resolves a hundredth of it.
RESTART = 1e-5


@dataclass(frozen=True, eq=False)
class _Rays:
    """Rays under way: metres, in float32."""

    ray: npt.NDArray[np.int64]
    origin: Float32
    direction: Float32
    length: Float32
    amplitude: ComplexArray
    bounces: npt.NDArray[np.int32]
    reflections: npt.NDArray[np.int32]

    def where(self, mask: Array) -> _Rays:
        """Some of them."""
        return _Rays(*(column[mask] for column in vars(self).values()))

    def on(self, path: Float32) -> _Rays:
        """All of them, as far along their way."""
        origin = self.origin + path[:, None] * self.direction
        return replace(self, origin=origin, length=self.length + path)


def trace_float32(scene: Scene, beam: Beam, ccd: CCD, max_bounces: int = 12) -> Paths:
    """Trace like `fringetrace.trace`, with all lengths and directions in float32.

    Embree's distances as they come, points and optical paths added up in float32, in metres about the
    origin, restarts a fixed step off the surface. Forms are not looked at: facets are the surface.

    Parameters
    ----------
    scene : Scene
    beam : Beam
    ccd : CCD
    max_bounces : int

    Returns
    -------
    Paths
        Those that reach the CCD: float32 numbers in float64 arrays. What fell by the wayside is not
        in it, nor is any key.

    Raises
    ------
    ValueError
        For scenes with media or thin elements, or light with a polarisation.
    """
    if not plain(scene, beam.polarisation is not None):
        raise ValueError("single: expected mirrors and beam splitters in a vacuum, got media or elements")
    meshes = [surface.mesh for surface in scene.surfaces]
    shift = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    faces = np.concatenate([mesh.faces + first for mesh, first in zip(meshes, shift, strict=False)])
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    hits = float32_hits(vertices.astype(np.float32), faces)
    step = np.float32(RESTART * np.ptp(vertices, axis=0).max())
    rays, ends = _launched(beam), []
    incident = float((abs(rays.amplitude) ** 2).sum())
    for _ in range(max_bounces + 1):
        triangle, path, normal = hits(rays.origin, rays.direction)
        met = triangle >= 0
        reach, seen = _landing(rays, np.where(met, path, np.float32(np.inf)), ccd)
        ends.append(rays.on(reach).where(seen))
        met &= ~seen
        rays = rays.on(np.where(met, path, np.float32(0.0))).where(met)
        if len(rays.ray) == 0:
            break
        rays = _split(rays, owner[triangle[met]], normal[met], scene)
        rays = rays.on(np.full(len(rays.ray), step))
    return _paths(ends, incident, scene, beam, ccd)


def _launched(beam: Beam) -> _Rays:
    rays = launch(beam)
    count, none = len(rays), np.zeros(len(rays), dtype=np.int32)
    start, along = rays.origin.astype(np.float32), rays.direction.astype(np.float32)
    amplitude = np.array(rays.amplitude, dtype=np.complex128)
    return _Rays(np.arange(count), start, along, np.zeros(count, np.float32), amplitude, none, none)


def _landing(rays: _Rays, path: Float32, ccd: CCD) -> tuple[Float32, Array]:
    """Way to the plane that the CCD is focused on, and which rays reach it before they meet anything."""
    u, v, n = (axis.astype(np.float32) for axis in ccd.axes)
    offset = ccd.centre.astype(np.float32) - rays.origin
    facing = rays.direction @ n
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (offset @ n) / facing
        ahead = (facing < 0.0) & (reach > 0.0) & (reach < path)
        reach = np.where(ahead, reach + np.float32(ccd.focus) / facing, np.float32(0.0))
    place = reach[:, None] * rays.direction - offset
    width, height = (np.float32(side) for side in ccd.size)
    return reach, ahead & (abs(place @ u) < width / 2) & (abs(place @ v) < height / 2)


def _split(rays: _Rays, surface: Array, normal: Float32, scene: Scene) -> _Rays:
    """Both branches of rays that have met surfaces."""
    back, through = (table[surface] for table in constants(scene))
    unit = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    along = np.einsum("ij,ij->i", rays.direction, unit)
    reflected = replace(
        rays,
        direction=rays.direction - np.float32(2.0) * along[:, None] * unit,
        amplitude=rays.amplitude * back,
        reflections=rays.reflections + (through == 0.0).astype(np.int32),
    ).where(back != 0.0)
    passed = replace(rays, amplitude=rays.amplitude * through).where(through != 0.0)
    both = (vars(reflected).values(), vars(passed).values())
    joined = _Rays(*(np.concatenate(columns) for columns in zip(*both, strict=True)))
    return replace(joined, bounces=joined.bounces + np.int32(1))


def _paths(ends: list[_Rays], incident: float, scene: Scene, beam: Beam, ccd: CCD) -> Paths:
    columns = zip(*(vars(end).values() for end in ends), strict=True)
    all_ = _Rays(*(np.concatenate(column) for column in columns))
    count = len(all_.ray)
    return Paths(
        ray=all_.ray,
        fate=np.full(count, Fate.DETECTED, dtype=np.int8),
        bounces=all_.bounces,
        reflections=all_.reflections,
        length=all_.length.astype(np.float64),
        origin=all_.origin.astype(np.float64),
        direction=all_.direction.astype(np.float64),
        amplitude=all_.amplitude,
        lost=np.zeros(count),
        key=np.zeros(count, dtype=np.uint64),
        area=beam.area,
        incident=incident,
        segments=count,
        doubtful=0,
        scene=scene,
        source=beam,
        ccd=ccd,
    )
