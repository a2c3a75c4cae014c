"""Surfaces and the scene that they make."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast, get_args

import numpy.typing as npt

from fringetrace.core import described, value_text
from fringetrace.geometry import Mesh, as_mesh
from fringetrace.optics import Dielectric, Interface, InterfaceKind, Metal
from fringetrace.scene.derived import Derived

if TYPE_CHECKING:
    from fringetrace.geometry import Fit, Form
    from fringetrace.optics import Element, Film, Material


def _medium(value: Any, what: str) -> Material | None:
    if value is None:
        return None
    from fringetrace.optics import as_material

    return as_material(value, what)


# Surfaces of a scene that its representation names.
NAMED_SURFACES = 5


@dataclass(frozen=True, eq=False)
class Surface:
    """Surface of a scene: mesh, interface, exact form and the media on both sides.

    Parameters
    ----------
    mesh : Mesh, trimesh.Trimesh, pyvista.PolyData, or alike, metres
    interface : Interface, Dielectric, Metal, or one of `fringetrace.optics.elements`
        `Mirror`, `Absorber`, `BeamSplitter`; `Dielectric`, `Metal`; thin optical elements.
    name : str
    form : Form, optional
        The exact surface that the facets stand for, one of `fringetrace.geometry.forms`; None: the facets
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

    def __repr__(self) -> str:
        media = (f"{side} {m.name}" for side in ("front", "back") if (m := getattr(self, side)) is not None)
        form = "" if self.form is None else f"exact {type(self.form).__name__}"
        triangles = f"{len(self.mesh.faces):,} triangles"
        return described(self, value_text(self.name), value_text(self.interface), triangles, form, *media)

    def __post_init__(self) -> None:
        object.__setattr__(self, "mesh", as_mesh(self.mesh, self.name))
        if isinstance(self.interface, type) or getattr(self.interface, "kind", None) not in get_args(
            InterfaceKind
        ):
            raise TypeError(f"{self.name} interface: expected one such as Mirror(), got {self.interface!r}")
        self._check_media()
        if self.form is not None:
            if isinstance(self.form, type) or not hasattr(self.form, "fit"):
                raise TypeError(f"{self.name} form: expected one such as forms.Sphere, got {self.form!r}")
            _ = self.fit  # refuses what is not meant for this mesh

    def __getstate__(self) -> dict[str, Any]:
        return {one.name: getattr(self, one.name) for one in fields(self)}

    @cached_property
    def fit(self) -> Fit | None:
        """Fit of the form to the mesh, or None."""
        return None if self.form is None else self.form.fit(self.mesh)

    @property
    def boundary(self) -> bool:
        """Whether the surface separates two media."""
        return self.interface.kind == "boundary"

    @property
    def element(self) -> Element | None:
        """Thin element of the surface, or None."""
        return cast("Element", self.interface) if self.interface.kind == "element" else None

    @property
    def opaque(self) -> bool:
        """Whether it is a boundary that absorbs all that gets through it."""
        return self.boundary and cast("Dielectric | Metal", self.interface).opaque

    @property
    def film(self) -> Film | None:
        """The film on the boundary, if there is one."""
        return cast("Dielectric | Metal", self.interface).film if self.boundary else None

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
        """Surface (mesh, interface, form) rotated about the origin, then shifted; as `Mesh.moved`.

        Parameters
        ----------
        offset : (3,) array-like, metres
        turn : (3, 3) array-like, optional

        Returns
        -------
        Surface
        """
        form = None if self.form is None else self.form.moved(offset, turn)
        interface = self.interface if self.element is None else self.element.moved(offset, turn)
        return replace(self, mesh=self.mesh.moved(offset, turn), interface=interface, form=form)


@dataclass(frozen=True, eq=False)
class Scene:
    """Scene: the surfaces that light meets, and the surrounding medium.

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
    # see `once_per_scene`
    derived: Derived = field(default_factory=Derived, init=False, repr=False)

    def __repr__(self) -> str:
        named = [f"{s.name} ({type(s.interface).__name__})" for s in self.surfaces[:NAMED_SURFACES]]
        more = ["..."] if len(self.surfaces) > NAMED_SURFACES else []
        count = f"{len(self.surfaces)} surface{'s' * (len(self.surfaces) > 1)}"
        around = "" if self.medium is None else f"in {self.medium.name}"
        return described(self, f"{count}: {', '.join(named + more)}", around)

    def __post_init__(self) -> None:
        surfaces = tuple(self.surfaces) if isinstance(self.surfaces, Iterable) else (self.surfaces,)
        for surface in surfaces:
            if not isinstance(surface, Surface):
                raise TypeError(f"Scene: expected Surface, got {type(surface).__name__}")
        if not surfaces:
            raise ValueError("Scene: expected at least one Surface, got none")
        object.__setattr__(self, "surfaces", surfaces)
        object.__setattr__(self, "medium", _medium(self.medium, "Scene medium"))

    @property
    def around(self) -> Material:
        """Medium around the surfaces."""
        if self.medium is not None:
            return self.medium
        from fringetrace.optics import VACUUM

        return VACUUM

    @property
    def digits(self) -> tuple[tuple[int, bool], ...]:
        """Surface and branch (whether transmitted) of each digit of a path key, from 1 on.

        Two for each surface; then one for each further branch of elements with several.
        """
        plain = [(number, through) for number in range(len(self.surfaces)) for through in (False, True)]
        further = [
            (number, True)
            for number, surface in enumerate(self.surfaces)
            if surface.element is not None
            for _ in range(surface.element.branches - 1)
        ]
        return (*plain, *further)

    def index(self, name: str) -> int:
        """Number of the surface called `name`.

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
