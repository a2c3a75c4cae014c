"""Birefringent plates: beam displacers (shear, Savart) and Wollaston prisms of uniaxial crystal.

Inside, wave vector and ray differ: phases are those of the wave vector k, places those of the ray S. A plate
is drawn without its thickness: rays leave, shifted, from the plane in which they arrive, and the optical
path through the crystal is added. What faces reflect is left out (they count as perfectly coated).
Source of the formulas: Born and Wolf, Principles of Optics, ch. 15.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from fringetrace.core import (
    Array,
    ComplexArray,
    FloatArray,
    checked_direction,
    checked_vector,
    dot,
    short_repr,
)
from fringetrace.optics.elements import (
    Branch,
    IncidentRays,
    InterfaceKind,
    RealIndex,
    Waves,
    checked_index,
    checked_number,
    index_at,
    move_point,
    positive_length,
    rotate_fields,
    rotate_vector,
    scaled,
    tangential,
    tangential_axis,
    transverse_axis,
    vectors_of,
)


def refract_extraordinary(
    wave: FloatArray, normal: FloatArray, ordinary: Array, extraordinary: Array, axis: FloatArray
) -> tuple[FloatArray, FloatArray, Array]:
    """Refraction into a uniaxial crystal: extraordinary wave with k.eps.k = n_o^2 n_e^2.

    With both indices equal it is the ordinary wave, k.k = n^2.

    Parameters
    ----------
    wave : (n, 3) float64
        Wave vectors before the face, in units of 2 pi / vacuum wavelength.
    normal : (n, 3) float64, unit
        Of the face, on the side that light goes to.
    ordinary, extraordinary : (n,) float64
    axis : (n, 3) float64, unit
        Optic axis.

    Returns
    -------
    wave : (n, 3) float64
        Behind the face.
    ray : (n, 3) float64
        Along the ray, eps k; of any length.
    possible : (n,) bool
        False for total reflection; the other two are finite but mean nothing there.
    """
    o2, e2 = ordinary**2, extraordinary**2
    excess = e2 - o2
    along = tangential(wave, normal)
    tilt, slant = dot(axis, normal), dot(axis, along)
    a = o2 + excess * tilt**2
    b = excess * tilt * slant
    c = o2 * (dot(along, along) - e2) + excess * slant**2
    root = b * b - a * c
    possible = root > 0.0
    inside = along + scaled(normal, (np.sqrt(np.where(possible, root, 0.0)) - b) / a)
    return inside, scaled(inside, o2) + scaled(axis, excess * dot(axis, inside)), possible


def split_field(meeting: IncidentRays, axis: FloatArray, what: str) -> tuple[ComplexArray, ComplexArray]:
    """Field components along an axis, (3,) or (n, 3), and the remainder: (n, 3) complex128 each."""
    field = vectors_of(meeting, what)
    seen = transverse_axis(axis, meeting.direction)
    along = scaled(seen, dot(field, seen))
    return along, np.asarray(field - along)


@dataclass(frozen=True, eq=False)
class ShearPlate:
    """Shear plate (beam displacer) of uniaxial crystal: two polarised beams leave it side by side.

    The first branch is the ordinary beam, polarised across the optic axis, the second the extraordinary one.
    At normal incidence the ordinary beam goes straight on with the path n_o d, and the extraordinary one is
    shifted by d tan rho, with the path n(theta) d. At any incidence k and S are exact; the field is shared
    out by the axis as the ray outside sees it. Two of them, crossed, are a `savart` plate.

    Parameters
    ----------
    axis : (3,)
        Optic axis, out of the plate as well as in it.
    thickness : float, metres
    ordinary, extraordinary : float or callable
        Indices, or functions of the wavelength in metres.

    Raises
    ------
    ValueError
        If the axis is no direction, or a length or an index is not positive.
    """

    axis: FloatArray
    thickness: float
    ordinary: RealIndex
    extraordinary: RealIndex

    kind: ClassVar[InterfaceKind] = "element"
    waves: ClassVar[Waves] = "plane"
    branches: ClassVar[int] = 2
    polarised: ClassVar[bool] = True

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", checked_direction(self.axis, "ShearPlate axis"))
        positive_length(self.thickness, "ShearPlate thickness")
        checked_index(self.ordinary, "ShearPlate ordinary index")
        checked_index(self.extraordinary, "ShearPlate extraordinary index")

    @property
    def chromatic(self) -> bool:
        """Whether an index depends on the wavelength."""
        return callable(self.ordinary) or callable(self.extraordinary)

    def act(self, meeting: IncidentRays) -> tuple[Branch, ...]:
        """Ordinary and extraordinary branch; see `Element`."""
        n_o = index_at(self.ordinary, meeting.wavelength, "ShearPlate")
        n_e = index_at(self.extraordinary, meeting.wavelength, "ShearPlate")
        extraordinary, ordinary = split_field(meeting, self.axis, "ShearPlate")
        return self._beam(meeting, ordinary, n_o, n_o), self._beam(meeting, extraordinary, n_o, n_e)

    def _beam(self, meeting: IncidentRays, field: ComplexArray, n_o: float, n_e: float) -> Branch:
        """One of the beams, through the plate."""
        facing = dot(meeting.direction, meeting.normal)
        ahead = scaled(meeting.normal, np.where(facing > 0.0, 1.0, -1.0))
        axis = np.broadcast_to(self.axis, ahead.shape)
        first, second = (np.full(len(ahead), n) for n in (n_o, n_e))
        arriving = scaled(meeting.direction, meeting.index)
        wave, ray, possible = refract_extraordinary(arriving, ahead, first, second, axis)
        depth = dot(ray, ahead)
        ray = scaled(ray, self.thickness / np.where(possible, depth, 1.0))
        path = np.where(possible, dot(wave, ray), 0.0)
        shift = np.where(possible[:, None], tangential(ray, meeting.normal), 0.0)
        return Branch(scaled(field, possible), None, meeting.point + shift, path)

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> ShearPlate:
        """The plate rotated; as `Mesh.moved`."""
        return replace(self, axis=rotate_vector(self.axis, turn))


def savart(
    normal: npt.ArrayLike,
    first: npt.ArrayLike,
    thickness: float,
    ordinary: RealIndex,
    extraordinary: RealIndex,
) -> tuple[ShearPlate, ShearPlate]:
    """Savart plate: two shear plates, optic axes at 45 degrees to the normal, in perpendicular planes.

    Parameters
    ----------
    normal : (3,)
        Of the plates.
    first : (3,)
        In the plane of normal and axis of the first plate.
    thickness : float, metres
        Of each plate.
    ordinary, extraordinary : float or callable

    Returns
    -------
    two ShearPlate
        For two surfaces, one behind the other. Two of the four branches carry no power.

    Raises
    ------
    ValueError
        If `first` is along the normal, or as for `ShearPlate`.
    """
    n = checked_direction(normal, "savart normal")
    u = transverse_axis(checked_direction(first, "savart first"), n[None])[0]
    if not u.any():
        raise ValueError(f"savart first: expected a direction across the normal {n.tolist()}, got {first!r}")
    axes = (n + u, n + np.cross(n, u))
    one, two = (ShearPlate(axis, thickness, ordinary, extraordinary) for axis in axes)
    return one, two


@dataclass(frozen=True, eq=False)
class Wollaston:
    """Wollaston prism: two crystal prisms with perpendicular optic axes; the polarisations part in angle.

    The prism on the front has its optic axis along `axis`, and grows thicker that way; the one behind
    has it along normal x axis. The first branch is polarised along `axis` (extraordinary in the front
    prism, ordinary in the other), the second across. Both refractions are exact, at any incidence, so
    that the two angles differ as they do in calcite. The beams part at the slanted face between the prisms:
    without thickness, in the plane of the surface.

    Parameters
    ----------
    centre : (3,) metres
        Where both prisms are equally thick.
    axis : (3,)
        Its part along the surface counts.
    angle : float, radians
        Of the prisms; negative: the front prism grows thinner along `axis`.
    ordinary, extraordinary : float or callable
        Indices, or functions of the wavelength in metres.
    thickness : float, metres
        Of both together; 0 leaves out the common path at the centre.

    Raises
    ------
    ValueError
        If the axis is no direction, the angle not within a quarter turn, the thickness negative, or an
        index not positive.
    """

    centre: FloatArray
    axis: FloatArray
    angle: float
    ordinary: RealIndex
    extraordinary: RealIndex
    thickness: float = 0.0

    kind: ClassVar[InterfaceKind] = "element"
    waves: ClassVar[Waves] = "plane"
    branches: ClassVar[int] = 2
    polarised: ClassVar[bool] = True

    __repr__ = short_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checked_vector(self.centre, "Wollaston centre"))
        object.__setattr__(self, "axis", checked_direction(self.axis, "Wollaston axis"))
        if not abs(checked_number(self.angle, "Wollaston angle")) < 0.5 * np.pi:
            raise ValueError(f"Wollaston angle: expected less than a quarter turn, got {self.angle!r}")
        if checked_number(self.thickness, "Wollaston thickness") < 0.0:
            raise ValueError(f"Wollaston thickness: expected no negative length, got {self.thickness!r}")
        checked_index(self.ordinary, "Wollaston ordinary index")
        checked_index(self.extraordinary, "Wollaston extraordinary index")

    @property
    def chromatic(self) -> bool:
        """Whether an index depends on the wavelength."""
        return callable(self.ordinary) or callable(self.extraordinary)

    def act(self, meeting: IncidentRays) -> tuple[Branch, ...]:
        """Branch polarised along the axis, and the one across; see `Element`."""
        n_o = index_at(self.ordinary, meeting.wavelength, "Wollaston")
        n_e = index_at(self.extraordinary, meeting.wavelength, "Wollaston")
        slope = tangential_axis(self.axis, meeting.normal, "Wollaston axis")
        along, rest = split_field(meeting, slope, "Wollaston")
        one = self._beam(meeting, along, slope, n_o, n_e, True)
        return one, self._beam(meeting, rest, slope, n_o, n_e, False)

    def _beam(
        self,
        meeting: IncidentRays,
        field: ComplexArray,
        slope: FloatArray,
        n_o: float,
        n_e: float,
        first: bool,
    ) -> Branch:
        """One of the beams, through both prisms; it is extraordinary in the `first` or in the other."""
        inward = -meeting.normal
        front = dot(meeting.direction, inward) > 0.0
        side = np.where(front, 1.0, -1.0)
        ahead = scaled(inward, side)
        wedge = scaled(np.cos(self.angle) * inward - np.sin(self.angle) * slope, side)
        edge = np.cross(meeting.normal, slope)
        # the prism that light meets first, and the other
        axes = [np.where(front[:, None], *pair) for pair in ((slope, edge), (edge, slope))]
        lone = [np.where(front == first, *pair) for pair in ((n_e, n_o), (n_o, n_e))]
        plain = np.full(len(front), n_o)
        wave = scaled(meeting.direction, meeting.index)
        one, ray, possible = refract_extraordinary(wave, ahead, plain, lone[0], axes[0])
        two, way, through = refract_extraordinary(one, wedge, plain, lone[1], axes[1])
        level = tangential(two, ahead)
        rest = meeting.index**2 - dot(level, level)
        possible &= through & (rest > 0.0)
        out = level + scaled(ahead, np.sqrt(np.where(possible, rest, 1.0)))
        out = np.where(possible[:, None], scaled(out, 1.0 / meeting.index), meeting.direction)
        place, path = self._crossed(meeting, ahead, wedge, (one, two), (ray, way), possible)
        sent = scaled(rotate_fields(field, meeting.direction, out), possible)
        return Branch(sent, out, place, path)

    def _crossed(
        self,
        meeting: IncidentRays,
        ahead: FloatArray,
        wedge: FloatArray,
        waves: tuple[FloatArray, FloatArray],
        rays: tuple[FloatArray, FloatArray],
        possible: Array,
    ) -> tuple[FloatArray, FloatArray]:
        """Where rays leave, brought back into the plane, and their paths through both prisms."""
        half = 0.5 * self.thickness
        offset = tangential(meeting.point - self.centre, ahead)
        place = offset - scaled(ahead, np.full(len(ahead), half))  # from the middle of both
        path = np.zeros(len(ahead))
        for wave, ray, face, height in zip(waves, rays, (wedge, ahead), (0.0, half), strict=True):
            pace = dot(ray, face)
            usable = possible & (pace > 0.0)
            step = np.where(usable, height - dot(place, face), 0.0) / np.where(usable, pace, 1.0)
            place = place + scaled(ray, step)
            path += step * dot(wave, ray)
        return meeting.point + tangential(place - offset, ahead), path

    def moved(self, offset: npt.ArrayLike = (0.0, 0.0, 0.0), turn: npt.ArrayLike | None = None) -> Wollaston:
        """The prism rotated about the origin, then shifted; as `Mesh.moved`."""
        return replace(
            self, centre=move_point(self.centre, offset, turn), axis=rotate_vector(self.axis, turn)
        )
