"""Lenses from catalogue data: radii, thicknesses and glasses to surfaces with exact forms and edges.

Signs are those of catalogues. Light comes along the axis; a radius is positive where the centre of
curvature lies beyond the vertex, so that a biconvex lens has (+, -); a plane has an infinite one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import FloatArray, checked_direction, checked_length, checked_vector, rotation
from fringetrace.geometry import Conic, Cylinder, Form, IndexArray, Mesh, Sphere, icosphere
from fringetrace.optics import Absorber, Dielectric, Interface, Material, Metal, as_material
from fringetrace.scene import Surface

Glass = Material | complex | str | None
Z = np.array([0.0, 0.0, 1.0])
Boundary = Interface | Dielectric | Metal
Vector = npt.ArrayLike

# A face bends by no more than this from one ring of vertices to the next, radians: facets then stand off
# by up to 1/150 of their length, and Newton steps along a ray from a facet to the form converge.
BEND = 0.04
# Rings at least: the rim is a polygon of six times as many corners, 0.06 % within the circle.
RINGS = 16
# Points of a profile at which its arc, its bend and its distance from the next are looked at.
PROFILE = 1024
# Faces nearer to each other than this part of half the diameter touch: a knife edge has no wall.
KNIFE = 1e-7
# Subdivisions of the icosahedron behind a ball: its facets turn by 4 degrees.
BALL = 4


def lens(
    radii: Sequence[float],
    thicknesses: Sequence[float],
    glasses: Sequence[Glass],
    diameter: float,
    *,
    conics: Sequence[float] | None = None,
    terms: Sequence[Sequence[float]] | None = None,
    vertex: Vector = (0.0, 0.0, 0.0),
    axis: Vector = (0.0, 0.0, 1.0),
    interface: Boundary | Sequence[Boundary] = Dielectric(),  # noqa: B008 - frozen
    edge: Boundary = Absorber(),  # noqa: B008 - frozen
    rings: int | None = None,
    name: str = "lens",
) -> tuple[Surface, ...]:
    """Surfaces of a lens: singlet, cemented doublet or triplet, or several with air gaps.

    Parameters
    ----------
    radii : (k,) metres
        Radius of curvature of each face at its vertex, in the order in which light meets them; positive
        if the centre lies beyond the vertex, `math.inf` for a plane.
    thicknesses : (k - 1,) metres
        Along the axis, from each vertex to the next.
    glasses : (k - 1,) of Material, or index, or name
        Between each face and the next; None: the scene's medium, an air gap.
    diameter : float, metres
        Of all faces. Their rims are polygons within this circle, of six times `rings` corners.
    conics : (k,), optional
        Conic constants, see `forms.Conic`; default 0, spheres.
    terms : (k,) of tuples, optional
        Aspheric terms of each face, see `forms.Conic`.
    vertex : (3,) metres
        Of the first face.
    axis : (3,)
        Direction in which light comes.
    interface : as a `Surface` has it, or one for each face
        Default: bare glass.
    edge : as a `Surface` has it
        Of the cylinders between the rims; default black.
    rings : int, optional
        Rings of vertices on each face. Default: 16, or so many that no face bends by more than 0.04 rad
        from ring to ring, with which every hit on a facet finds its form.
    name : str
        The faces are called "{name} 1", "{name} 2", ..., the edges "{name} edge 1", ...

    Returns
    -------
    tuple of Surface
        The faces, then the edges of what is glass. The front of a face is where light comes from, that of
        an edge outside. Planes have no form: their facets are exact.

    Raises
    ------
    ValueError
        If the numbers of radii, thicknesses and glasses do not fit, a length is not what it should
        be, the diameter is beyond a face's equator, or faces meet within it.
    """
    count = len(radii)
    _check_counts(count, thicknesses=(thicknesses, count - 1), glasses=(glasses, count - 1))
    conics = (0.0,) * count if conics is None else conics
    terms = ((),) * count if terms is None else terms
    interfaces = tuple(interface) if isinstance(interface, Iterable) else (interface,) * count
    _check_counts(count, conics=(conics, count), terms=(terms, count), interface=(interfaces, count))
    half = 0.5 * checked_length(diameter, "lens diameter")
    places = np.concatenate([[0.0], np.cumsum(_checked_thicknesses(thicknesses, glasses))])
    faces = [
        Conic(np.array([0.0, 0.0, z]), Z, radius, conic, tuple(more))
        for z, radius, conic, more in zip(places, radii, conics, terms, strict=True)
    ]
    profiles = _profiles(faces, half)
    rings = _rings(profiles) if rings is None else _checked_rings(rings)
    caps = [_cap(face, profile, rings) for face, profile in zip(faces, profiles, strict=True)]
    media = (None, *glasses, None)
    surfaces = [
        _surface(caps[i], interfaces[i], f"{name} {i + 1}", _exact(face), media[i], media[i + 1])
        for i, face in enumerate(faces)
    ]
    for i, glass in enumerate(glasses):
        if glass is not None and (wall := _wall(caps[i], caps[i + 1], 6 * rings)) is not None:
            around = Cylinder(np.zeros(3), Z, half)
            surfaces.append(_surface(wall, edge, f"{name} edge {i + 1}", around, None, glass))
    turn = _turn(axis)
    return tuple(surface.moved(vertex, turn) for surface in surfaces)


def plano_convex(
    radius: float, thickness: float, glass: Glass, diameter: float, *, flat_first: bool = False, **more: Any
) -> tuple[Surface, ...]:
    """Surfaces of a plano-convex lens; see `lens`.

    Parameters
    ----------
    radius : float, metres
        Of the curved face, positive; negative: a plano-concave lens.
    thickness : float, metres
    glass : Material, or index, or name
    diameter : float, metres
    flat_first : bool
        Light meets the flat face first.
    more
        As `lens` has them.

    Returns
    -------
    tuple of Surface
        Two faces and the edge.
    """
    radii = (math.inf, -radius) if flat_first else (radius, math.inf)
    return lens(radii, (thickness,), (glass,), diameter, **more)


def biconvex(
    radius: float, thickness: float, glass: Glass, diameter: float, **more: Any
) -> tuple[Surface, ...]:
    """Surfaces of a symmetric biconvex lens; see `lens`.

    Parameters
    ----------
    radius : float, metres
        Of both faces, positive; negative: a biconcave lens.
    thickness : float, metres
    glass : Material, or index, or name
    diameter : float, metres
    more
        As `lens` has them.

    Returns
    -------
    tuple of Surface
        Two faces and the edge.
    """
    return lens((radius, -radius), (thickness,), (glass,), diameter, **more)


def plano_hyperbola(
    focal_length: float, index: float, thickness: float, glass: Glass, diameter: float, **more: Any
) -> tuple[Surface, ...]:
    """Surfaces of a plano-hyperbolic lens, of equal optical path along its axis (Descartes 1637).

    The flat face comes first; behind it stands a hyperboloid of conic constant -n^2 and vertex radius
    (n - 1) f, whose far focus, `focal_length` behind the vertex, all light meets in step.

    Parameters
    ----------
    focal_length : float, metres
    index : float
        Of the glass, relative to the medium around, at the wavelength at which it shall be true.
    thickness : float, metres
    glass : Material, or index, or name
    diameter : float, metres
    more
        As `lens` has them.

    Returns
    -------
    tuple of Surface
        Two faces and the edge.

    Raises
    ------
    ValueError
        If the index is not above 1.
    """
    if not (math.isfinite(index) and index > 1.0):
        raise ValueError(f"plano-hyperbola index: expected a number above 1, got {index!r}")
    radius = (index - 1.0) * checked_length(focal_length, "plano-hyperbola focal length")
    return lens((math.inf, -radius), (thickness,), (glass,), diameter, conics=(0.0, -index * index), **more)


def ball(
    diameter: float,
    glass: Glass,
    *,
    centre: Vector = (0.0, 0.0, 0.0),
    interface: Boundary = Dielectric(),  # noqa: B008 - frozen
    name: str = "ball",
) -> Surface:
    """Surfaces of a ball lens.

    Parameters
    ----------
    diameter : float, metres
    glass : Material, or index, or name
    centre : (3,) metres
    interface : as a `Surface` has it
    name : str

    Returns
    -------
    Surface
        Its front is outside.

    Raises
    ------
    ValueError
        If the diameter is not positive.
    """
    radius = 0.5 * checked_length(diameter, "ball diameter")
    sphere = Sphere(checked_vector(centre, "ball centre"), radius)
    return _surface(icosphere(radius, BALL).moved(centre), interface, name, sphere, None, glass)


def focal_lengths(
    radii: Sequence[float], thicknesses: Sequence[float], indices: Sequence[float]
) -> tuple[float, float]:
    """Focal length and back focal length of paraxial rays (Gauss 1841).

    Parameters
    ----------
    radii, thicknesses : metres
        See `lens`.
    indices : (k - 1,)
        Of what is between the faces, relative to the medium around.

    Returns
    -------
    focal, back : float, metres
        Infinite if light leaves as it came.

    Raises
    ------
    ValueError
        If the numbers of radii, thicknesses and indices do not fit.
    """
    count = len(radii)
    _check_counts(count, thicknesses=(thicknesses, count - 1), indices=(indices, count - 1))
    height, slope, before = 1.0, 0.0, 1.0  # slope is times the index
    for radius, after, way in zip(radii, (*indices, 1.0), (*thicknesses, 0.0), strict=True):
        slope -= height * (after - before) / radius
        height += slope * way / after
        before = after
    return (math.inf, math.inf) if slope == 0.0 else (-1.0 / slope, -height / slope)


def _surface(
    mesh: Mesh, interface: Boundary, name: str, form: Form | None, front: Glass, back: Glass
) -> Surface:
    """A surface, with its media where it parts any."""
    if interface.kind == "boundary":
        media = [None if medium is None else as_material(medium, f"{name} glass") for medium in (front, back)]
        return Surface(mesh, interface, name, form, *media)
    return Surface(mesh, interface, name, form)


def _check_counts(faces: int, **given: tuple[Sequence[Any], int]) -> None:
    """Refuse a list whose length does not go with the number of faces."""
    if faces < 2:
        raise ValueError(f"lens radii: expected those of two faces or more, got {faces}")
    for what, (values, count) in given.items():
        if len(values) != count:
            raise ValueError(f"lens {what}: expected {count} for {faces} faces, got {len(values)}")


def _checked_thicknesses(thicknesses: Sequence[float], glasses: Sequence[Glass]) -> list[float]:
    """Thicknesses in metres: of glass positive, of air 0 or more."""
    for i, (thickness, glass) in enumerate(zip(thicknesses, glasses, strict=True)):
        if glass is not None or thickness != 0.0:
            checked_length(thickness, f"lens thickness {i + 1}")
    return [float(thickness) for thickness in thicknesses]


def _checked_rings(rings: int) -> int:
    if not isinstance(rings, (int, np.integer)) or rings < 1:
        raise ValueError(f"lens rings: expected a whole number from 1, got {rings!r}")
    return int(rings)


def _profiles(faces: Sequence[Conic], half: float) -> list[FloatArray]:
    """Each face from vertex to rim, (PROFILE + 1, 2): distance from the axis, place along it.

    The points crowd towards the rim, where a face may be steep.
    """
    radius = half * np.sin(np.linspace(0.0, 0.5 * math.pi, PROFILE + 1))
    profiles = [np.stack([radius, face.vertex[2] + face.sag(radius**2)], axis=1) for face in faces]
    for i, (face, profile) in enumerate(zip(faces, profiles, strict=True)):
        if np.isnan(profile).any():
            equator = abs(face.radius) / math.sqrt(1.0 + face.conic)
            raise ValueError(
                f"lens diameter: expected up to {2.0 * equator:.6g} m, the equator of face {i + 1}, "
                f"got {2.0 * half:.6g}"
            )
    for i, (one, other) in enumerate(pairwise(profiles)):
        least = (other - one)[:, 1].min()
        if least < -KNIFE * half:
            raise ValueError(
                f"lens faces {i + 1} and {i + 2}: expected apart within the diameter, got them "
                f"{-least:.6g} m in one another; make the lens as much thicker, or smaller across"
            )
    return profiles


def _arc(profile: FloatArray) -> FloatArray:
    """Way along a profile from its vertex to each of its points, metres."""
    steps = np.linalg.norm(np.diff(profile, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _rings(profiles: Sequence[FloatArray]) -> int:
    """So many rings, at equal steps of arc, that no face bends by more than `BEND` from one to the next."""
    most = 0.0
    for profile in profiles:
        step, arc = np.diff(profile, axis=0), _arc(profile)
        bend = np.abs(np.diff(np.arctan2(step[:, 1], step[:, 0])))
        most = max(most, float((bend / (0.5 * (arc[2:] - arc[:-2]))).max() * arc[-1]))
    return max(RINGS, math.ceil(most / BEND))


def _cap(face: Conic, profile: FloatArray, rings: int) -> Mesh:
    """A face: rings of 6, 12, 18, ... vertices at equal steps of arc about the vertex, its front to -z."""
    arc = _arc(profile)
    radius = np.interp(np.linspace(0.0, arc[-1], rings + 1), arc, profile[:, 0])
    around = [2.0 * math.pi * np.arange(6 * i) / (6 * i) for i in range(1, rings + 1)]
    ring = np.repeat(radius[1:], [len(angle) for angle in around])
    angle = np.concatenate(around)
    height = face.vertex[2] + face.sag(ring**2)
    outer = np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1)
    return Mesh(np.concatenate([[face.vertex], outer]), _disc(rings), "lens")


def _disc(rings: int) -> IndexArray:
    """Triangles between a centre and rings of 6, 12, 18, ... vertices, clockwise: 6 rings^2."""
    bands = []
    for i in range(1, rings + 1):
        outside, inside = np.arange(6 * i), max(1, 6 * (i - 1))
        first = 1 + 3 * i * (i - 1)
        within = first - inside
        sixth, place = np.divmod(outside, i)
        outer, onward = first + outside, first + (outside + 1) % (6 * i)
        inner = within + (outside - sixth) % inside
        other = within + (outside - sixth + 1) % inside
        bands.append(np.stack([inner, onward, outer], axis=1))
        bands.append(np.stack([inner, other, onward], axis=1)[place < i - 1])
    return np.concatenate(bands)


def _wall(one: Mesh, other: Mesh, count: int) -> Mesh | None:
    """The strip between the rims of two caps, their last `count` vertices; its front is outside."""
    low, high = one.vertices[-count:], other.vertices[-count:]
    if high[0, 2] - low[0, 2] < KNIFE * abs(low[0, 0]):
        return None
    start = np.arange(count)
    end = (start + 1) % count
    faces = np.concatenate(
        [np.stack([start, end, end + count], axis=1), np.stack([start, end + count, start + count], axis=1)]
    )
    return Mesh(np.concatenate([low, high]), faces, "lens edge")


def _exact(face: Conic) -> Conic | None:
    """The form of a face; none where the facets are exact."""
    return None if math.isinf(face.radius) and not any(face.terms) else face


def _turn(axis: Vector) -> FloatArray | None:
    """Turn of the z axis to another one."""
    onto = checked_direction(axis, "lens axis")
    across = np.cross((0.0, 0.0, 1.0), onto)
    size = float(np.linalg.norm(across))
    if size == 0.0:
        return None if onto[2] > 0.0 else rotation((1.0, 0.0, 0.0), math.pi)
    return rotation(across, math.atan2(size, onto[2]))
