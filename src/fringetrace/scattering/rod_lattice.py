"""Rod lattices: positions, materials, mesh and scene; see `rod_solvers` for rigorous solutions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fringetrace.core import FloatArray, checked_length, short_repr
from fringetrace.geometry import Cylinder, Mesh, check_circles_apart, plate, rod_lattice
from fringetrace.optics import VACUUM, Absorber, Dielectric, Mirror, as_material
from fringetrace.scene import Scene, Surface

if TYPE_CHECKING:
    from fringetrace.optics import Material

# Distance of the rows in pitches, and how far every second one is shifted.
ARRANGEMENTS = {"square": (1.0, 0.0), "staggered": (1.0, 0.5), "hexagonal": (0.5 * np.sqrt(3.0), 0.5)}
MEDIA = ("rod", "host")


@dataclass(frozen=True)
class RodLattice:
    """Lattice of rods along y, in rows across z, the top row highest.

    Without a host they stand in a vacuum. A host fills the half-space below a front face; in the scene
    it ends half a pitch beside the rods, at black walls.

    Parameters
    ----------
    columns, rows : int
    radius, pitch, length : float, metres
        Of the rods; the distance of neighbours in a row; along y.
    arrangement : {"square", "staggered", "hexagonal"}
        Rows a pitch apart; every second one shifted by half a pitch; and sqrt(3)/2 of a pitch apart.
    spacing : float, metres, optional
        Distance of the rows. Default: by the arrangement.
    disorder : float
        Root mean square of the displacement of rods along x and along z, in pitches; normally
        distributed. Mirrors may come to overlap.
    seed : int
        Of the displacements.
    sides : int
        Of each rod.
    reflectance : float
        Of mirrors.
    rod, host : Material, number, or name of a material, optional
        What rods are made of, None: mirrors; and what is around them, None: a vacuum.
    cortex : float, metres
        Of the host above the highest rod.
    channel : float, metres, optional
        Radius of air channels in the host, one amid each four rods.
    exact : bool
        True cylinders behind the facets (`forms.Cylinder`), one surface each: for some dozens.

    Raises
    ------
    ValueError
        For counts, lengths, arrangements or disorder that cannot be; cortex or channels without a host.
    TypeError
        For a rod or host of no material.
    """

    columns: int = 20
    rows: int = 4
    radius: float = 65e-9
    pitch: float = 280e-9
    length: float = 2e-6
    arrangement: str = "staggered"
    spacing: float | None = None
    disorder: float = 0.0
    seed: int = 0
    sides: int = 18
    reflectance: float = 1.0
    rod: Material | None = None
    host: Material | None = None
    cortex: float = 0.0
    channel: float | None = None
    exact: bool = False

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if self.arrangement not in ARRANGEMENTS:
            names = ", ".join(ARRANGEMENTS)
            raise ValueError(f"lattice arrangement: expected one of {names}, got {self.arrangement!r}")
        for count, what in ((self.columns, "columns"), (self.rows, "rows")):
            if not (isinstance(count, (int, np.integer)) and count > 0):
                raise ValueError(f"lattice {what}: expected a whole number from 1, got {count!r}")
        for what in ("radius", "pitch", "spacing", "channel"):
            if getattr(self, what) is not None:
                checked_length(getattr(self, what), f"lattice {what}")
        if not (np.isfinite(self.disorder) and self.disorder >= 0.0):
            raise ValueError(f"lattice disorder: expected a number of at least 0, got {self.disorder!r}")
        self._check_matter()

    def _check_matter(self) -> None:
        for what in MEDIA:
            medium = getattr(self, what)
            if medium is not None:
                object.__setattr__(self, what, as_material(medium, f"lattice {what}"))
        if not (np.isfinite(self.cortex) and self.cortex >= 0.0):
            raise ValueError(f"lattice cortex: expected a length of at least 0, got {self.cortex!r}")
        if self.host is None and (self.cortex > 0.0 or self.channel is not None):
            raise ValueError("lattice host: expected one for a cortex or channels to be in, got None")

    @property
    def gap(self) -> float:
        """Distance between rows, metres."""
        return ARRANGEMENTS[self.arrangement][0] * self.pitch if self.spacing is None else self.spacing

    @property
    def centres(self) -> FloatArray:
        """Rod axes (x, z) about the origin, column by column, (columns * rows, 2) float64, metres."""
        column, row = (
            i.ravel() for i in np.meshgrid(*map(np.arange, (self.columns, self.rows)), indexing="ij")
        )
        x = (column + ARRANGEMENTS[self.arrangement][1] * (row % 2)) * self.pitch
        places = np.stack([x, row * self.gap], axis=1)
        places -= 0.5 * (places.min(axis=0) + places.max(axis=0))
        wander = np.random.default_rng(self.seed).standard_normal(places.shape)
        return np.asarray(places + self.disorder * self.pitch * wander)

    @property
    def channels(self) -> FloatArray:
        """Positions (x, z) of air channels, each amid four rods, metres; or none."""
        if self.channel is None:
            return np.zeros((0, 2))
        grid = self.centres.reshape(self.columns, self.rows, 2)
        corners = grid[:-1, :-1], grid[1:, :-1], grid[:-1, 1:], grid[1:, 1:]
        return np.asarray(np.mean(corners, axis=0).reshape(-1, 2))

    @property
    def front(self) -> float:
        """Height z of the host's front face, metres."""
        return float(self.centres[:, 1].max() + self.radius + self.cortex)

    @property
    def mesh(self) -> Mesh:
        """Mesh of the rods, see `shapes.rod_lattice`; `shapes.rod_of_triangle` numbers its triangles."""
        return _prisms(self, self.centres, self.radius, f"{self.arrangement} lattice")

    @property
    def scene(self) -> Scene:
        """Scene of the lattice: rods as mirrors or of matter; channels, front face and walls of the host."""
        self._check_apart()
        inside = {} if self.rod is None else {"front": self.host, "back": self.rod}
        kind = Mirror(self.reflectance) if self.rod is None else Dielectric()
        surfaces = _surfaces(self, self.centres, self.radius, kind, inside, "rods")
        if self.channel is not None:
            inside = {"front": self.host, "back": VACUUM}
            surfaces += _surfaces(self, self.channels, self.channel, Dielectric(), inside, "channels")
        if self.host is not None:
            surfaces += _half_space(self)
        return Scene(tuple(surfaces))

    @property
    def lighting(self) -> dict[str, Any]:
        """Arguments of `goniometer.brdf` besides the scene: aperture and centre on a host's front face."""
        if self.host is None:
            return {}
        return {"aperture": self.footprint, "centre": (_across(self)[0], 0.0, self.front)}

    @property
    def footprint(self) -> tuple[float, float]:
        """Lit width along x and length along y, metres: of the host's face, or the box around rods."""
        width, length = _across(self)[1], self.length
        if self.host is not None:
            return width + self.pitch, length + self.pitch
        (low, _, _), (high, _, _) = self.mesh.bounds
        return float(high - low), length

    def _check_apart(self) -> None:
        """Matter may not overlap."""
        if self.rod is not None or self.channel is not None:
            radii = np.repeat([self.radius, self.channel or 0.0], (len(self.centres), len(self.channels)))
            check_circles_apart(np.concatenate([self.centres, self.channels]), radii, "rods")


def _prisms(lattice: RodLattice, centres: FloatArray, radius: float, name: str) -> Mesh:
    """Rods about axes (n, 2), rod after rod."""
    rod = rod_lattice(1, 1, radius, lattice.pitch, lattice.length, sides=lattice.sides)
    offset = np.insert(centres, 1, 0.0, axis=1)
    vertices = offset[:, None] + rod.vertices
    faces = rod.faces + len(rod.vertices) * np.arange(len(offset))[:, None, None]
    return Mesh(vertices.reshape(-1, 3), faces.reshape(-1, 3), name)


def _surfaces(
    lattice: RodLattice, centres: FloatArray, radius: float, kind: Mirror | Dielectric,
    media: dict[str, Any], name: str,
) -> list[Surface]:  # fmt: skip
    """Rods as one surface, or as true cylinders, one surface each, open at their ends."""
    if not lattice.exact:
        return [Surface(_prisms(lattice, centres, radius, name), kind, name, **media)]
    rod = rod_lattice(1, 1, radius, lattice.pitch, lattice.length, sides=lattice.sides)
    tube = Mesh(rod.vertices, rod.faces[: 2 * lattice.sides], name)
    axis = np.array([0.0, 1.0, 0.0])
    return [
        Surface(tube.moved(at), kind, f"{name} {i}", Cylinder(at, axis, radius), **media)
        for i, at in enumerate(np.insert(centres, 1, 0.0, axis=1))
    ]


def _across(lattice: RodLattice) -> tuple[float, float]:
    """Middle and width of the rods along x, metres."""
    x = lattice.centres[:, 0]
    low, high = x.min() - lattice.radius, x.max() + lattice.radius
    return float(0.5 * (low + high)), float(high - low)


def _half_space(lattice: RodLattice) -> list[Surface]:
    """The host's front face, and black walls down to below the rods."""
    x, (width, length) = _across(lattice)[0], lattice.footprint
    low = float(lattice.centres[:, 1].min()) - lattice.radius
    depth = lattice.front - low + lattice.pitch
    box = plate(width, length, depth).moved((x, 0.0, lattice.front))
    walls = np.delete(box.faces, [0, 1, 4, 5], axis=0)  # its first and third side: front and bottom
    front = Mesh(box.vertices, box.faces[:2], "front")
    return [
        Surface(front, Dielectric(), "front", back=lattice.host),
        Surface(Mesh(box.vertices, walls, "walls"), Absorber(), "walls"),
    ]
