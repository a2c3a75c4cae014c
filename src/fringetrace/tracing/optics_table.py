"""Optical constants of a scene's media and surfaces at a wavelength, as tables for the kernels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, checked_wavelength
from fringetrace.scene import Scene, Surface

if TYPE_CHECKING:
    from fringetrace.optics import Dielectric, Element, Interface, Material, Metal

# What a surface is: of constant amplitudes, or a boundary between two media.
CONSTANT, BOUNDARY = 0, 1
# What is followed from a boundary: bits. What is not, is lost to the metal behind it if that is OPAQUE.
REFLECTED, TRANSMITTED, OPAQUE = 1, 2, 4
FOLLOW = {"both": REFLECTED | TRANSMITTED, "reflected": REFLECTED, "transmitted": TRANSMITTED}
# Beyond, float64 keeps nothing of the squares of other indices beside them.
INDICES = 1e-7, 1e7


class SurfaceTable(NamedTuple):
    """Surfaces and media of a scene at a wavelength, as the kernels take them.

    Attributes
    ----------
    kind : (surfaces,) int8
        `CONSTANT` or `BOUNDARY`.
    reflection, transmission : (surfaces,) complex128
        Amplitudes where they are constant, see `constants`.
    front, back : (surfaces,) int32
        Numbers of the media beside each surface.
    media : (media,) complex128
        Refractive indices.
    follow : (surfaces,) int8
        Which branches are followed: bits.
    film : tuple
        Where the layers of each surface begin, and their indices and thicknesses from front to back and
        from back to front.
    k0 : float, 1/m
        2 pi over the wavelength, 0 where nothing depends on it.
    ideal : bool
        All surfaces reflect with -1 in a vacuum, so that amplitudes follow from the number of bounces.
    """

    kind: npt.NDArray[np.int8]
    reflection: ComplexArray
    transmission: ComplexArray
    front: npt.NDArray[np.int32]
    back: npt.NDArray[np.int32]
    media: ComplexArray
    follow: npt.NDArray[np.int8]
    film: tuple[Array, ComplexArray, Array, tuple[ComplexArray, Array]]
    k0: float
    ideal: bool


@dataclass(frozen=True, eq=False)
class SceneOptics:
    """What light meets in a scene.

    Attributes
    ----------
    surfaces : SurfaceTable
    vacuum : bool
        Light meets nothing but constant amplitudes in a vacuum.
    wavelength : float or None, metres
    polarised : bool
    elements : dict
        Thin elements by the number of their surface.
    """

    surfaces: SurfaceTable
    vacuum: bool
    wavelength: float | None
    polarised: bool
    elements: dict[int, Element]

    @property
    def fading(self) -> bool:
        """Whether some medium absorbs."""
        return bool(self.surfaces.media.imag.any())

    @property
    def splits(self) -> bool:
        """Whether a ray may have several ends."""
        table = self.surfaces
        return not self.vacuum or bool((abs(table.reflection) * abs(table.transmission)).any())


def scene_media(scene: Scene) -> tuple[Material, ...]:
    """Media of a scene by number, the surrounding one first.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    tuple of Material
    """
    found = [scene.around]
    for surface in scene.surfaces:
        found += [medium for medium in (surface.front, surface.back) if medium is not None]
    return tuple(dict.fromkeys(found))


def _film(surface: Surface) -> tuple[tuple[Material, float], ...]:
    return () if surface.film is None else surface.film.layers


def plain(scene: Scene, polarised: bool) -> bool:
    """Whether all surfaces have constant amplitudes, and the medium is vacuum.

    Parameters
    ----------
    scene : Scene
    polarised : bool

    Returns
    -------
    bool
    """
    acting = any(surface.interface.kind != "constant" for surface in scene.surfaces)
    if acting or polarised:
        return False
    around = scene.medium
    return around is None or not (around.dispersive or complex(around.index(1.0)) != 1.0)


def needs(scene: Scene) -> str | None:
    """Reason why a scene depends on the wavelength, in words; None if it does not.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    str or None
    """
    for medium in scene_media(scene):
        if medium.dispersive:
            return f"{medium.name} is dispersive"
        if complex(medium.index(1.0)).imag != 0.0:
            return f"{medium.name} absorbs"
    for surface in scene.surfaces:
        if _film(surface):
            return f"{surface.name} has a film"
        if surface.interface.chromatic:
            return f"{surface.name} depends on it"
    return None


def optics(scene: Scene, wavelength: float | None, polarised: bool) -> SceneOptics:
    """The media, boundaries and elements of a scene at a wavelength.

    Parameters
    ----------
    scene : Scene
    wavelength : float or None, metres
        Not needed where nothing depends on it.
    polarised : bool

    Returns
    -------
    SceneOptics

    Raises
    ------
    ValueError
        If the wavelength is missing, is none, or lies outside the range of a material; if an index is
        beyond `INDICES`; if an element needs light of a polarisation that has none.
    """
    if wavelength is not None:
        wavelength = checked_wavelength(wavelength)
    vacuum = plain(scene, polarised)
    why = None if vacuum else needs(scene)
    if wavelength is None and why is not None:
        raise ValueError(f"trace wavelength: expected one, since {why}, got None")
    elements = thin(scene)
    for number, element in elements.items():
        if element.polarised and not polarised:
            name = scene.surfaces[number].name
            raise ValueError(f"{name}: expected light with a polarisation, got a scalar beam")
    table = _table(scene, 1.0 if wavelength is None else wavelength, vacuum)
    if wavelength is not None:
        table = table._replace(k0=2.0 * math.pi / wavelength)
    return SceneOptics(table, vacuum, None if vacuum else wavelength, polarised, elements)


def _table(scene: Scene, wavelength: float, vacuum: bool) -> SurfaceTable:
    known = scene_media(scene)
    numbers = {medium: number for number, medium in enumerate(known)}
    sides = [[s.front or scene.around, s.back or scene.around] for s in scene.surfaces]
    beside = np.array([[numbers[medium] for medium in side] for side in sides], dtype=np.int32)
    reflection, transmission = constants(scene)
    return SurfaceTable(
        kind=np.array([BOUNDARY if s.boundary else CONSTANT for s in scene.surfaces], dtype=np.int8),
        reflection=reflection,
        transmission=transmission,
        front=beside[:, 0].copy(),
        back=beside[:, 1].copy(),
        media=np.array([_index(medium, wavelength) for medium in known]),
        follow=np.array([followed_branches(surface) for surface in scene.surfaces], dtype=np.int8),
        film=_layers(scene, wavelength),
        k0=0.0,
        ideal=vacuum and bool((reflection == -1.0).all() and not transmission.any()),
    )


def sides(scene: Scene) -> npt.NDArray[np.int32]:
    """The media beside each surface.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    (surfaces, 2) int32
        Numbers of the media in front and behind, see `scene_media`; -1 for surfaces that part none, -2 if
        they let no light through either.
    """
    numbers = {medium: number for number, medium in enumerate(scene_media(scene))}
    opaque = constants(scene)[1] == 0.0
    table = np.repeat(np.where(opaque, -2, -1)[:, None], 2, axis=1).astype(np.int32)
    for number, surface in enumerate(scene.surfaces):
        if surface.boundary:
            table[number] = [numbers[side or scene.around] for side in (surface.front, surface.back)]
    return table


def _index(medium: Material, wavelength: float) -> complex:
    """Index of a medium that the kernels can do with."""
    index, (least, most) = complex(medium.index(wavelength)), INDICES
    if not least <= abs(index) <= most:
        raise ValueError(f"{medium.name}: expected an index of magnitude {least:g} to {most:g}, got {index}")
    return index


def thin(scene: Scene) -> dict[int, Element]:
    """Thin elements of a scene, by surface number.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    dict of int to Element
    """
    found = enumerate(surface.element for surface in scene.surfaces)
    return {number: element for number, element in found if element is not None}


def constants(scene: Scene) -> tuple[ComplexArray, ComplexArray]:
    """Reflection and transmission amplitudes of surfaces where they are constant.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    reflection, transmission : (surfaces,) complex128
        0 for boundaries; elements let all light through.
    """
    table = np.zeros((2, len(scene.surfaces)), dtype=np.complex128)
    for number, surface in enumerate(scene.surfaces):
        interface = surface.interface
        if interface.kind == "element":
            table[1, number] = 1.0
        elif interface.kind == "constant":
            constant = cast("Interface", interface)
            table[:, number] = constant.reflection, constant.transmission
    return table[0], table[1]


def followed_branches(surface: Surface) -> int:
    """Bits of the branches that are traced at a surface: reflected, transmitted, or opaque."""
    if not surface.boundary:
        return REFLECTED | TRANSMITTED
    boundary = cast("Dielectric | Metal", surface.interface)
    return FOLLOW[boundary.follow] | (OPAQUE if boundary.opaque else 0)


def _layers(scene: Scene, wavelength: float) -> tuple[Array, ComplexArray, Array, tuple[ComplexArray, Array]]:
    """The layers of all surfaces, those of each from the front and from the back."""
    films = [_film(surface) for surface in scene.surfaces]
    begin = np.cumsum([0, *(len(film) for film in films)])

    def table(some: list[tuple[tuple[Material, float], ...]]) -> tuple[ComplexArray, Array]:
        layers = [layer for film in some for layer in film]
        index = np.array([_index(medium, wavelength) for medium, _ in layers], dtype=np.complex128)
        return index, np.array([thickness for _, thickness in layers], dtype=np.float64)

    return begin, *table(films), table([film[::-1] for film in films])
