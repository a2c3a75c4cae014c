"""Rigorous diffraction by stacked gratings of circular cylinders in a host slab between two half-spaces.

The plane across the cylinders: x along a row, depth downwards from the front face; light travels in that
plane. Within a row cylindrical harmonics are coupled by lattice sums; rows and faces exchange plane waves
(diffraction orders g, x-wavenumber beta + 2 pi g / pitch), and their scattering matrices are joined by
Redheffer's star product (K. Yasumoto, Electromagnetic Theory and Applications for Photonic Crystals, 2006,
ch. 2-3). Polarisation as in room `cylinders`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, zip_longest
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fringetrace.core import (
    Array,
    ComplexArray,
    FloatArray,
    checked_angles,
    checked_lengths,
    checked_whole,
    short_repr,
)
from fringetrace.optics import Polarisation, check_polarisation
from fringetrace.rigorous.cylindrical_waves import (
    Index,
    boundary,
    indices_at,
    lattice_sums,
    truncation,
)
from fringetrace.rigorous.effective_medium import SlabPowers, effective_index, stack_powers

_SLICES = 64  # flat layers a pitch, of method "multilayer"
_EVANESCENT = 7  # diffraction orders beyond those that propagate: reciprocity then holds to 1e-11
_GRAZING = 1e-7  # of k: wavenumbers across the rows are kept this far from zero, where sums diverge


@dataclass(frozen=True)
class Row:
    """Infinite row (grating) of circular cylinders, one per pitch.

    Attributes
    ----------
    depth : float, metres
        Of the axes, below the front face.
    radius : float, metres
    index : complex, or function of the wavelength in metres
    offset : float, metres
        Along the row.
    """

    depth: float
    radius: float
    index: Index
    offset: float = 0.0

    __repr__ = short_repr


@dataclass(frozen=True)
class CylinderGratings:
    """Stacked rows of cylinders in a host slab between a front and a back half-space.

    Attributes
    ----------
    pitch : float, metres
        Between neighbours in a row, the same for all rows.
    thickness : float, metres
        Of the slab.
    rows : sequence of Row
        At different depths.
    host : float, or function of the wavelength in metres
        Real refractive index of the slab.
    front, back : complex, or function of the wavelength in metres
        The half-spaces; the front's is real. A back of None is the host.

    Raises
    ------
    ValueError
        If a length is not positive, or a row does not fit in its pitch, in the slab, or beside the others.
    """

    pitch: float
    thickness: float
    rows: Sequence[Row]
    host: Index
    front: Index = 1.0
    back: Index | None = None

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if not (0 < self.pitch < math.inf and 0 < self.thickness < math.inf):
            lengths = f"pitch {self.pitch}, thickness {self.thickness}"
            raise ValueError(f"Lattice: expected positive lengths in metres, got {lengths}")
        rows = tuple(sorted(self.rows, key=lambda row: row.depth))
        for row in rows:
            if not 0 < row.radius <= self.pitch / 2:
                raise ValueError(f"Row: expected a radius up to half the pitch, got {row.radius} m")
            if not row.radius <= row.depth <= self.thickness - row.radius:
                raise ValueError(f"Row: expected cylinders inside the slab, got one at depth {row.depth} m")
        if any(one.depth == other.depth for one, other in pairwise(rows)):
            raise ValueError("Lattice: expected rows at different depths, got two at the same")
        object.__setattr__(self, "rows", rows)


class Diffraction(NamedTuple):
    """Reflected and transmitted light of a lattice, by diffraction order.

    Attributes
    ----------
    orders : (g,) int
    reflected, transmitted : (..., g) complex128
        Amplitudes of the wave u, phases at offset zero on the front and on the back face.
    reflectance, transmittance : (..., g) float64
        Power over incident power; zero for orders that do not propagate.
    """

    orders: Array
    reflected: ComplexArray
    transmitted: ComplexArray
    reflectance: FloatArray
    transmittance: FloatArray

    def __repr__(self) -> str:
        return short_repr(self)


class _Section(NamedTuple):
    """Scattering matrices between plane waves (..., g, g): from above back and on, from below back and on."""

    back: ComplexArray
    on: ComplexArray
    below_back: ComplexArray
    below_on: ComplexArray


class _Light(NamedTuple):
    """What all sections need: wavenumbers along x (..., g), in vacuum (...,), polarisation."""

    beta: FloatArray
    vacuum: FloatArray
    polarisation: Polarisation

    def across(self, index: ComplexArray) -> ComplexArray:
        """Wavenumbers across the rows in a medium, decaying or leaving: (..., g)."""
        k = (index * self.vacuum)[..., None]
        found = np.sqrt(k**2 - self.beta**2 + 0j)
        return np.where(abs(found) < _GRAZING * abs(k), _GRAZING * abs(k), found)

    def flux(self, index: ComplexArray) -> ComplexArray:
        """Wavenumbers across over 1 ("s") or the square of the index ("p"): what keeps flux continuous."""
        across = self.across(index)
        return across if self.polarisation == "s" else across / index[..., None] ** 2


def diffract(
    lattice: CylinderGratings, wavelength: ArrayLike, angle: ArrayLike = 0.0,
    polarisation: Polarisation = "s", orders: int | None = None, harmonics: int | None = None,
) -> Diffraction:  # fmt: skip
    """Diffraction of a plane wave from the front by a lattice of cylinders.

    Parameters
    ----------
    lattice : Lattice
    wavelength : float or array, metres
        In vacuum; broadcasts with `angle`.
    angle : float or array, radians
        Of incidence, in the front medium.
    polarisation : ``"s"`` or ``"p"``
        The field along the cylinders.
    orders : int, optional
        Highest diffraction order G; by default those that propagate and 7 more, on either side.
    harmonics : int, optional
        Highest cylindrical harmonic; by default that of `truncation`.

    Returns
    -------
    Diffraction

    Raises
    ------
    ValueError
        If a wavelength is not positive, an angle not finite, a number of orders none, the polarisation
        unknown, or front or host absorb.
    """
    check_polarisation(polarisation)
    wavelength, angle = _light(wavelength, angle)
    front, host, back = _media(lattice, wavelength)
    vacuum = 2.0 * math.pi / wavelength
    if orders is not None:
        orders = checked_whole(orders, 0, "Orders")
    else:
        orders = _EVANESCENT + math.ceil(2.0 * np.max(host.real * lattice.pitch / wavelength))
    order = np.arange(-orders, orders + 1)
    beta = (vacuum * front.real * np.sin(angle))[..., None] + order * 2.0 * math.pi / lattice.pitch
    light = _Light(beta, vacuum, polarisation)
    whole = _face(light, front, host)
    above = 0.0
    for row, following in zip_longest(lattice.rows, lattice.rows[1:]):
        middle = lattice.thickness if following is None else (row.depth + following.depth) / 2.0
        own = truncation(float(np.max(host.real * vacuum)) * row.radius)
        reach = own if harmonics is None else checked_whole(harmonics, 0, "Harmonics")
        section = _row(light, lattice.pitch, row, host, wavelength, reach)
        whole = _join(whole, _spaced(light, host, section, row.depth - above, middle - row.depth))
        above = middle
    if not lattice.rows:
        whole = _join(whole, _gap(light, host, lattice.thickness))
    whole = _join(whole, _face(light, host, back))
    reflected, transmitted = whole.back[..., orders], whole.on[..., orders]
    incident = light.flux(front)[..., orders : orders + 1].real
    return Diffraction(
        order, reflected, transmitted,
        light.flux(front).real / incident * abs(reflected) ** 2,
        light.flux(back).real / incident * abs(transmitted) ** 2,
    )  # fmt: skip


def reflectance_spectrum(
    lattice: CylinderGratings, wavelength: ArrayLike, angle: ArrayLike = 0.0,
    polarisation: Polarisation | Literal["unpolarised"] = "unpolarised",
    method: str = "rods",
) -> SlabPowers:  # fmt: skip
    """Reflectance and transmittance of a lattice of cylinders, summed over the diffraction orders.

    Parameters
    ----------
    lattice : Lattice
    wavelength : float or array, metres
        In vacuum; broadcasts with `angle`.
    angle : float or array, radians
        Of incidence, in the front medium.
    polarisation : ``"s"``, ``"p"`` or ``"unpolarised"``
        The last is the mean of the two others.
    method : ``"rods"`` or ``"multilayer"``
        Rigorous, or flat layers of effective index: quicker, without diffraction orders, some 5 % off.

    Returns
    -------
    Powers

    Raises
    ------
    ValueError
        If the method or the polarisation is unknown.
    """
    if polarisation == "unpolarised":
        e = reflectance_spectrum(lattice, wavelength, angle, "s", method)
        h = reflectance_spectrum(lattice, wavelength, angle, "p", method)
        return SlabPowers((e.reflectance + h.reflectance) / 2.0, (e.transmittance + h.transmittance) / 2.0)
    check_polarisation(polarisation)
    if method == "multilayer":
        return _blurred(lattice, wavelength, angle, polarisation)
    if method != "rods":
        raise ValueError(f"Method: expected 'rods' or 'multilayer', got {method!r}")
    found = diffract(lattice, wavelength, angle, polarisation)
    return SlabPowers(found.reflectance.sum(-1), found.transmittance.sum(-1))


def _blurred(
    lattice: CylinderGratings, wavelength: ArrayLike, angle: ArrayLike, polarisation: Polarisation
) -> SlabPowers:
    """Powers of the lattice as a stack of thin flat layers of effective index."""
    wavelength, angle = _light(wavelength, angle)
    front, host, back = _media(lattice, wavelength)
    faces = np.linspace(0.0, lattice.thickness, math.ceil(_SLICES * lattice.thickness / lattice.pitch) + 1)
    fractions = [_filling(row, lattice.pitch, faces) for row in lattice.rows]
    fractions.append(1.0 - np.sum(fractions, 0) * np.ones(len(faces) - 1))
    indices = [*(indices_at(row.index, wavelength) for row in lattice.rows), host]
    if not np.all(np.isfinite(indices)):
        raise ValueError("Method 'multilayer': expected finite refractive indices, got a perfect conductor")
    mixed = effective_index(np.stack(fractions, -1), np.stack(indices, -1)[..., None, :], polarisation)
    return stack_powers(np.diff(faces), mixed, front, back, wavelength, angle, polarisation)


def _filling(row: Row, pitch: float, faces: FloatArray) -> FloatArray:
    """Area fraction of a row's cylinders between neighbouring depths (s + 1,): (s,)."""
    u = np.clip((faces - row.depth) / row.radius, -1.0, 1.0)
    area = row.radius**2 * (u * np.sqrt(1.0 - u**2) + np.arcsin(u))
    found: FloatArray = np.diff(area) / (pitch * np.diff(faces))
    return found


def _light(wavelength: ArrayLike, angle: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Wavelengths and angles of incidence of one shape, at least one of each."""
    lengths, angles = np.broadcast_arrays(
        checked_lengths(wavelength, "Wavelength"), checked_angles(angle, "Angle of incidence")
    )
    if lengths.size == 0:
        raise ValueError(f"Wavelength: expected at least one, got shape {lengths.shape}")
    return lengths, angles


def _media(
    lattice: CylinderGratings, wavelength: FloatArray
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Index of front, host and back at each wavelength."""
    behind = lattice.host if lattice.back is None else lattice.back
    front, host, back = (indices_at(index, wavelength) for index in (lattice.front, lattice.host, behind))
    for name, index in (("Front", front), ("Host", host)):
        if not (np.all(index.real > 0) and np.all(index.imag == 0)):
            raise ValueError(f"{name}: expected a positive real refractive index, got {index}")
    return front, host, back


def _face(light: _Light, above: ComplexArray, below: ComplexArray) -> _Section:
    """A plane face between two media (Fresnel)."""
    one, other = light.flux(above), light.flux(below)
    total = one + other
    return _Section(*(_diagonal(v / total) for v in (one - other, 2 * one, other - one, 2 * other)))


def _gap(light: _Light, index: ComplexArray, thickness: float) -> _Section:
    """A homogeneous layer."""
    passed = _diagonal(np.exp(1j * light.across(index) * thickness))
    nothing = np.zeros_like(passed)
    return _Section(nothing, passed, nothing, passed)


def _row(
    light: _Light, pitch: float, row: Row, host: ComplexArray, wavelength: FloatArray, harmonics: int
) -> _Section:
    """A row of cylinders, phases at its axis."""
    k = (host.real * light.vacuum)[..., None]
    gamma = light.across(host)
    index = indices_at(row.index, wavelength)
    response, weight, _ = boundary(row.radius, index, host.real, wavelength, light.polarisation, harmonics)
    n = np.arange(-harmonics, harmonics + 1)
    sums = lattice_sums(light.beta[..., light.beta.shape[-1] // 2], k[..., 0], pitch, 2 * harmonics)
    coupling = (
        sums[..., n - n[:, None] + 2 * harmonics] * (response * weight)[..., None, :] / weight[..., None]
    )
    down, up = ((light.beta + sign * 1j * gamma) / k for sign in (1, -1))  # exp(i theta)
    place = np.exp(1j * light.beta * row.offset)
    fans = [
        place[..., None, :] * 1j ** n[:, None] * direction[..., None, :] ** -n[:, None]
        for direction in (down, up)
    ]
    exciting = np.linalg.solve(np.eye(len(n)) - coupling, np.concatenate(fans, -1) / weight[..., None])
    outgoing = (response * weight)[..., None] * exciting
    sent = [
        (2.0 / (pitch * gamma * place))[..., None] * (-1j) ** n * direction[..., None] ** n @ outgoing
        for direction in (up, down)
    ]
    count = light.beta.shape[-1]
    (back, below_on), (on, below_back) = ((each[..., :count], each[..., count:]) for each in sent)
    return _Section(back, on + np.eye(count), below_back, below_on + np.eye(count))


def _spaced(light: _Light, host: ComplexArray, section: _Section, above: float, below: float) -> _Section:
    """A section with homogeneous host above and below it."""
    gamma = light.across(host)
    top, bottom = np.exp(1j * gamma * above), np.exp(1j * gamma * below)
    return _Section(
        top[..., None] * section.back * top[..., None, :],
        bottom[..., None] * section.on * top[..., None, :],
        bottom[..., None] * section.below_back * bottom[..., None, :],
        top[..., None] * section.below_on * bottom[..., None, :],
    )


def _join(upper: _Section, lower: _Section) -> _Section:
    """Two sections, one on the other: Redheffer's star product."""
    one = np.eye(upper.on.shape[-1])
    downward = np.linalg.solve(one - upper.below_back @ lower.back, upper.on)
    upward = np.linalg.solve(one - lower.back @ upper.below_back, lower.below_on)
    return _Section(
        upper.back + upper.below_on @ lower.back @ downward,
        lower.on @ downward,
        lower.below_back + lower.on @ upper.below_back @ upward,
        upper.below_on @ upward,
    )


def _diagonal(values: ComplexArray) -> ComplexArray:
    """Diagonal matrices (..., g, g)."""
    found: ComplexArray = values[..., None] * np.eye(values.shape[-1])
    return found
