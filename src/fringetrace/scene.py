"""The nouns of a scene, checked once, at the door: Surface, Beam, CCD, Scene."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fringetrace.interfaces import Dielectric, Interface, Metal
from fringetrace.mesh import Mesh, as_mesh
from fringetrace.vectors import ROUNDED, checked_direction, checked_vector, frame
from fringetrace.waves import ComplexArray, FloatArray

if TYPE_CHECKING:
    from fringetrace.elements import Element
    from fringetrace.forms import Form
    from fringetrace.indices import Material


def _medium(value: Any, what: str) -> Material | None:
    if value is None:
        return None
    from fringetrace.materials import as_material

    return as_material(value, what)


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh and what it does to light.

    Parameters
    ----------
    mesh : Mesh, trimesh.Trimesh, pyvista.PolyData, or alike, metres
    interface : Interface, Dielectric, Metal, or one of `fringetrace.elements`
        `Mirror`, `Absorber`, `BeamSplitter`; `Dielectric`, `Metal`; thin optical elements.
    name : str
    form : Form, optional
        The exact surface that the facets stand for, one of `fringetrace.forms`; None: the facets
        are the surface.
    front, back : Material, or number, or name of a material, optional
        The media of a `Dielectric` or `Metal`, on the side that the mesh's normals point to and on the
        other; None: that of the scene.

    Raises
    ------
    TypeError
        If `mesh` is no mesh, `interface` no interface, `form` no form, a medium no material.
    ValueError
        If the mesh does not lie along the form, or media are missing or not asked for.
    """

    mesh: Mesh
    interface: Interface | Dielectric | Metal | Element
    name: str = "surface"
    form: Form | None = None
    front: Material | None = None
    back: Material | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "mesh", as_mesh(self.mesh, self.name))
        constant = all(hasattr(self.interface, name) for name in ("reflection", "transmission"))
        known = constant or isinstance(self.interface, (Dielectric, Metal)) or hasattr(self.interface, "act")
        if isinstance(self.interface, type) or not known:
            raise TypeError(f"{self.name} interface: expected one such as Mirror(), got {self.interface!r}")
        self._check_media()
        if self.form is not None:
            if isinstance(self.form, type) or not hasattr(self.form, "fit"):
                raise TypeError(f"{self.name} form: expected one such as forms.Sphere, got {self.form!r}")
            self.form.fit(self.mesh.vertices, self.mesh.faces)  # refuses what is not meant for this mesh

    @property
    def boundary(self) -> bool:
        """Whether it parts two media."""
        return isinstance(self.interface, (Dielectric, Metal))

    def _check_media(self) -> None:
        for side in ("front", "back"):
            object.__setattr__(self, side, _medium(getattr(self, side), f"{self.name} {side}"))
        given = [side for side in ("front", "back") if getattr(self, side) is not None]
        kind = type(self.interface).__name__
        if given and not self.boundary:
            raise ValueError(f"{self.name} {given[0]}: expected no medium beside a {kind}, got one")
        if self.boundary and not given:
            raise ValueError(f"{self.name}: expected a medium in front of a {kind} or behind it, got none")

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Surface:
        """The surface, mesh, interface and form, turned about the origin, then shifted; as `Mesh.moved`.

        Parameters
        ----------
        offset : (3,) array-like, metres
        turn : (3, 3) array-like, optional

        Returns
        -------
        Surface
        """
        form = None if self.form is None else self.form.moved(offset, turn)
        interface = self.interface
        if hasattr(interface, "moved"):
            interface = interface.moved(offset, turn)
        return replace(self, mesh=self.mesh.moved(offset, turn), interface=interface, form=form)


@dataclass(frozen=True)
class Gaussian:
    """Gaussian beam profile, brightest at the centre: amplitude exp(-r^2 / waist^2).

    Parameters
    ----------
    waist : float, metres
        Radius at which the amplitude is 1/e of the centre's.

    Raises
    ------
    ValueError
        If the waist is not a positive length.
    """

    waist: float

    def __post_init__(self) -> None:
        _positive(self.waist, "Gaussian waist")

    def __call__(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Amplitude at beam coordinates x, y (metres), each (n,) float64."""
        return np.asarray(np.exp(-(x * x + y * y) / self.waist**2), dtype=np.float64)


Axes = tuple[FloatArray, FloatArray, FloatArray]
Profile = Callable[[FloatArray, FloatArray], FloatArray]


def _positive(value: float, what: str) -> float:
    if not (isinstance(value, Real) and np.isfinite(value) and value > 0.0):
        raise ValueError(f"{what}: expected a positive length in metres, got {value!r}")
    return float(value)


def _checked_size(size: Any, what: str) -> tuple[float, float]:
    sides = tuple(size) if isinstance(size, Iterable) else (size,)
    if len(sides) != 2:
        raise ValueError(f"{what} size: expected (width, height) in metres, got {size!r}")
    return _positive(sides[0], f"{what} width"), _positive(sides[1], f"{what} height")


def as_names(names: str | Iterable[str]) -> tuple[str, ...]:
    """Names of surfaces, given as one or as several.

    Parameters
    ----------
    names : str or iterable of str

    Returns
    -------
    tuple of str
    """
    return (names,) if isinstance(names, str) else tuple(names)


def _checked_grid(shape: Any, what: str) -> tuple[int, int]:
    grid = tuple(shape) if isinstance(shape, Iterable) else (shape,)
    if len(grid) != 2 or not all(isinstance(n, (int, np.integer)) and n > 0 for n in grid):
        raise ValueError(f"{what}: expected two positive whole numbers (rows, columns), got {shape!r}")
    return int(grid[0]), int(grid[1])


def _checked_jones(value: Any) -> ComplexArray:
    try:
        vector = np.array(value, dtype=np.complex128)
    except (TypeError, ValueError) as error:
        raise ValueError(f"Beam polarisation: expected two numbers, got {value!r}") from error
    size = float(np.linalg.norm(vector)) if vector.shape == (2,) else np.nan
    if not (np.isfinite(size) and size > 0.0):
        raise ValueError(f"Beam polarisation: expected a Jones vector of two numbers, got {value!r}")
    return vector if abs(size - 1.0) <= ROUNDED else vector / size


@dataclass(frozen=True, eq=False)
class Beam:
    """A collimated coherent beam: a plane wave, launched as a grid of parallel rays.

    Parameters
    ----------
    centre : (3,) metres
        Centre of the rectangle it starts from; the phase is 0 on that rectangle.
    direction : (3,)
    up : (3,)
        Direction of the rows of its ray grid.
    size : (width, height), metres
    shape : (rows, columns)
        Rays start at the centres of the cells of this grid.
    profile : callable, optional
        Amplitude at beam coordinates (x, y) in metres; None is uniform, 1 everywhere.
    passes : names of surfaces that the rays pass over on their first leg.
    polarisation : (2,) complex, optional
        Jones vector along columns and rows, scaled to unit length; the field is then traced as a
        vector. None: as one number.

    Raises
    ------
    ValueError
        For a direction of length 0, an `up` along it, sizes or shapes that are not positive, a
        polarisation that is none.
    TypeError
        If the profile is no function.
    """

    centre: FloatArray
    direction: FloatArray
    up: FloatArray
    size: tuple[float, float]
    shape: tuple[int, int]
    profile: Profile | None = None
    passes: tuple[str, ...] = ()
    polarisation: ComplexArray | None = None
    axes: Axes = field(init=False, repr=False)  # of columns, rows, and the direction

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checked_vector(self.centre, "Beam centre"))
        object.__setattr__(self, "direction", checked_direction(self.direction, "Beam direction"))
        object.__setattr__(self, "up", checked_direction(self.up, "Beam up"))
        object.__setattr__(self, "axes", frame(self.direction, self.up, "Beam"))
        object.__setattr__(self, "size", _checked_size(self.size, "Beam"))
        object.__setattr__(self, "shape", _checked_grid(self.shape, "Beam shape"))
        if self.profile is not None and not callable(self.profile):
            raise TypeError(f"Beam profile: expected None or a function of (x, y), got {self.profile!r}")
        object.__setattr__(self, "passes", as_names(self.passes))
        if self.polarisation is not None:
            object.__setattr__(self, "polarisation", _checked_jones(self.polarisation))

    @property
    def area(self) -> float:
        """Area of the beam that one ray stands for, m^2."""
        return self.size[0] * self.size[1] / (self.shape[0] * self.shape[1])


@dataclass(frozen=True, eq=False)
class CCD:
    """A rectangle of pixels that records what falls on its front.

    Images are arrays [row, column] = [v, u], origin lower: u = normal x up is to the right of
    somebody who looks out of the chip along its normal, v is up. Light from behind passes.

    Parameters
    ----------
    centre : (3,) metres
    normal : (3,)
        Points to where the light comes from.
    up : (3,)
        Direction of increasing row.
    pitch : float, metres
        Side of the square pixels.
    shape : (rows, columns)
    focus : float, metres
        Distance in front of the chip of the plane that an ideal 1:1 relay images onto it;
        field positions and optical paths are those in that plane. 0: the bare chip.

    Raises
    ------
    ValueError
        For a normal of length 0, an `up` along it, a pitch or shape that is not positive.
    """

    centre: FloatArray
    normal: FloatArray
    up: FloatArray
    pitch: float
    shape: tuple[int, int]
    focus: float = 0.0
    axes: Axes = field(init=False, repr=False)  # of columns, rows, and the normal

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checked_vector(self.centre, "CCD centre"))
        object.__setattr__(self, "normal", checked_direction(self.normal, "CCD normal"))
        object.__setattr__(self, "up", checked_direction(self.up, "CCD up"))
        object.__setattr__(self, "axes", frame(self.normal, self.up, "CCD"))
        object.__setattr__(self, "pitch", _positive(self.pitch, "CCD pitch"))
        object.__setattr__(self, "shape", _checked_grid(self.shape, "CCD shape"))
        if not (isinstance(self.focus, Real) and np.isfinite(self.focus)):
            raise ValueError(f"CCD focus: expected a length in metres, got {self.focus!r}")

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, metres."""
        return self.shape[1] * self.pitch, self.shape[0] * self.pitch


@dataclass(frozen=True, eq=False)
class Scene:
    """Surfaces that light meets.

    Parameters
    ----------
    surfaces : iterable of Surface
    medium : Material, or number, or name of a material, optional
        What is around them, where beams start; None: a vacuum.

    Raises
    ------
    TypeError
        If one of them is not a Surface, or the medium no material.
    ValueError
        If there are none.
    """

    surfaces: tuple[Surface, ...]
    medium: Material | None = None
    # what rooms above have derived from the surfaces (the engine's bodies), kept with them
    derived: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        surfaces = tuple(self.surfaces) if isinstance(self.surfaces, Iterable) else (self.surfaces,)
        for surface in surfaces:
            if not isinstance(surface, Surface):
                raise TypeError(f"Scene: expected Surface, got {type(surface).__name__}")
        if not surfaces:
            raise ValueError("Scene: expected at least one Surface, got none")
        object.__setattr__(self, "surfaces", surfaces)
        object.__setattr__(self, "medium", _medium(self.medium, "Scene medium"))

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "derived": {}}

    @property
    def around(self) -> Material:
        """The medium around the surfaces."""
        if self.medium is not None:
            return self.medium
        from fringetrace.materials import VACUUM

        return VACUUM

    @property
    def digits(self) -> tuple[tuple[int, bool], ...]:
        """Surface and branch (whether transmitted) for which each digit of a path key stands, from 1 on.

        Two for each surface; then one for each further branch of elements with several.
        """
        plain = [(number, through) for number in range(len(self.surfaces)) for through in (False, True)]
        further = [
            (number, True)
            for number, surface in enumerate(self.surfaces)
            for _ in range(getattr(surface.interface, "branches", 1) - 1)
        ]
        return (*plain, *further)

    def index(self, name: str) -> int:
        """Position of the surface called `name`.

        Parameters
        ----------
        name : str

        Returns
        -------
        int

        Raises
        ------
        ValueError
            If no surface, or more than one, is called so.
        """
        names = [surface.name for surface in self.surfaces]
        if names.count(name) != 1:
            raise ValueError(
                f"Scene: expected one surface called {name!r}, got {names.count(name)} in {names}"
            )
        return names.index(name)
