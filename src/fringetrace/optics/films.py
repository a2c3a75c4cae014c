"""Thin films: reflection and transmission of plane waves by layer stacks and bare interfaces.

Amplitudes are those of E with fields as exp(+i k n x). r of p light has Byrnes' sign: at normal
incidence r_p = -r_s, and H is reflected with r_p. Sources: M. Born, E. Wolf, Principles of Optics,
sections 1.5 and 1.6; S. J. Byrnes, arXiv:1603.02720 (the program tmm).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from fringetrace.core import (
    ComplexArray,
    FloatArray,
    checked_wavelength,
    described,
    filled,
    length_text,
    short_repr,
)
from fringetrace.optics.materials.material import Material
from fringetrace.optics.materials.named_materials import as_material

# Layers of a film that its representation names.
NAMED_LAYERS = 4


class Amplitudes(NamedTuple):
    """Complex amplitudes of E: reflected s and p, transmitted s and p; arrays of one shape."""

    rs: ComplexArray
    rp: ComplexArray
    ts: ComplexArray
    tp: ComplexArray

    def __repr__(self) -> str:
        return short_repr(self)


class PolarisedPowers(NamedTuple):
    """Power fractions of s and p light; arrays of one shape."""

    s: FloatArray
    p: FloatArray

    def __repr__(self) -> str:
        return short_repr(self)


@dataclass(frozen=True)
class Film:
    """Thin-film stack: layers in the order in which light from the front meets them.

    Parameters
    ----------
    layers : sequence of (material, thickness in metres)
        Material, index or name, and its thickness. None at all is a bare face.

    Raises
    ------
    ValueError
        If a layer is no such pair, or a thickness is no length of 0 or more.
    TypeError
        If a material is none.
    """

    layers: tuple[tuple[Material, float], ...] = ()

    def __repr__(self) -> str:
        if len(self.layers) > NAMED_LAYERS:
            return described(self, f"{len(self.layers)} layers, {length_text(float(self.thickness.sum()))}")
        return described(self, *(f"{material.name} {length_text(depth)}" for material, depth in self.layers))

    def __post_init__(self) -> None:
        checked = []
        for k, layer in enumerate(self.layers):
            try:
                material, thickness = layer
            except (TypeError, ValueError):
                raise ValueError(f"Film layer {k}: expected (material, thickness), got {layer!r}") from None
            if not (isinstance(thickness, (int, float, np.number)) and 0.0 <= thickness < math.inf):
                raise ValueError(
                    f"Film layer {k}: expected a thickness of 0 or more metres, got {thickness!r}"
                )
            checked.append((as_material(material, f"Film layer {k}"), float(thickness)))
        object.__setattr__(self, "layers", tuple(checked))

    @property
    def thickness(self) -> FloatArray:
        """Layer thicknesses, (m,) float64, metres."""
        return np.array([thickness for _, thickness in self.layers], dtype=np.float64)

    @property
    def dispersive(self) -> bool:
        """Whether an index may depend on the wavelength."""
        return any(material.dispersive for material, _ in self.layers)

    def indices(self, wavelength: npt.ArrayLike) -> ComplexArray:
        """Complex refractive indices of the layers.

        Parameters
        ----------
        wavelength : float64, metres, any shape (...)

        Returns
        -------
        (..., m) complex128
        """
        shape = np.shape(wavelength)
        out = np.empty((*shape, len(self.layers)), np.complex128)
        for k, (material, _) in enumerate(self.layers):
            out[..., k] = material.index(wavelength)
        return out

    def reversed(self) -> Film:
        """The stack in reverse order, as light from behind meets it."""
        return Film(self.layers[::-1])


def quarter_wave_stack(
    high: Material | complex | str, low: Material | complex | str, pairs: int, wavelength: float
) -> Film:
    """Dielectric mirror (HL)^pairs H of quarter-wave layers at normal incidence.

    Parameters
    ----------
    high, low : Material, index or name
    pairs : int
        0 or more; one more layer of `high` closes the film.
    wavelength : float, metres
        Vacuum wavelength it is made for.

    Returns
    -------
    Film

    Raises
    ------
    ValueError
        If `pairs` is negative or no integer.
    """
    if not (isinstance(pairs, (int, np.integer)) and pairs >= 0):
        raise ValueError(f"quarter-wave stack: expected 0 or more pairs, got {pairs!r}")
    w = checked_wavelength(wavelength)
    h, v = ((m, 0.25 * w / float(m.index(w).real)) for m in (as_material(high), as_material(low)))
    return Film((h, v) * pairs + (h,))


def _checked_angles(theta: FloatArray) -> FloatArray:
    wrong = ~((theta >= 0.0) & (theta <= 0.5 * math.pi))
    if wrong.any():
        raise ValueError(f"angle of incidence: expected 0 to pi/2 radians, got {theta[wrong].flat[0]}")
    return theta


def _incidence(
    film: Film | None,
    first: Material | complex | str,
    last: Material | complex | str,
    angle: npt.ArrayLike,
    wavelength: npt.ArrayLike,
) -> tuple[tuple[int, ...], dict[str, Any]]:
    """Shape of the answer, and flat arrays of q1, first, layers, last and k0, as in `layers.stack`."""
    from fringetrace.optics.film_kernels import normal_part

    theta, w = np.broadcast_arrays(
        np.asarray(angle, dtype=np.float64), np.asarray(wavelength, dtype=np.float64)
    )
    _checked_angles(theta)
    flat = np.ascontiguousarray(w.reshape(-1))
    n1, n2 = (as_material(m, "half space").index(flat) for m in (first, last))
    layers = (film or Film()).indices(flat)
    return theta.shape, {
        "q1": normal_part(n1, theta.reshape(-1)), "first": n1, "layers": layers, "last": n2,
        "k0": 2.0 * math.pi / flat
    }  # fmt: skip


def coefficients(
    film: Film | None,
    first: Material | complex | str,
    last: Material | complex | str,
    angle: npt.ArrayLike,
    wavelength: npt.ArrayLike,
) -> Amplitudes:
    """Amplitude coefficients of a film between two half-spaces: r_s, r_p, t_s, t_p of E.

    Parameters
    ----------
    film : Film or None
        None: a bare face.
    first, last : Material, index or name
        Before and behind.
    angle : float64, radians, any shape
        Of incidence, 0 to pi/2, in `first`.
    wavelength : float64, metres, any shape
        Vacuum wavelength; broadcast with `angle`.

    Returns
    -------
    Amplitudes
        rs, rp, ts, tp, complex128 of the broadcast shape; phases at the outer faces of the film.

    Raises
    ------
    ValueError
        If an angle or wavelength is out of range, of the film or of a material.
    """
    from fringetrace.optics.film_kernels import stacks

    shape, wave = _incidence(film, first, last, angle, wavelength)
    thickness = (film or Film()).thickness
    out = stacks(wave["q1"], wave["first"], wave["layers"], thickness, wave["last"], wave["k0"])
    return Amplitudes(*out.reshape(4, *shape))


def reflectance(
    film: Film | None,
    first: Material | complex | str,
    last: Material | complex | str,
    angle: npt.ArrayLike,
    wavelength: npt.ArrayLike,
) -> PolarisedPowers:
    """Reflectance of a film, |r|^2; arguments as in `coefficients`.

    Returns
    -------
    Powers
        s and p, float64 of the broadcast shape.
    """
    amplitudes = coefficients(film, first, last, angle, wavelength)
    return PolarisedPowers(np.abs(amplitudes.rs) ** 2, np.abs(amplitudes.rp) ** 2)


def transmittance(
    film: Film | None,
    first: Material | complex | str,
    last: Material | complex | str,
    angle: npt.ArrayLike,
    wavelength: npt.ArrayLike,
) -> PolarisedPowers:
    """Transmittance of a film; arguments as in `coefficients`.

    Returns
    -------
    Powers
        s and p, float64 of the broadcast shape: into the first nanometre of an absorbing half space.
    """
    from fringetrace.optics.film_kernels import shares

    shape, wave = _incidence(film, first, last, angle, wavelength)
    amplitudes = coefficients(film, first, last, angle, wavelength)
    s, p = shares(wave["q1"], wave["first"], wave["last"]).reshape(2, *shape)
    return PolarisedPowers(s * np.abs(amplitudes.ts) ** 2, p * np.abs(amplitudes.tp) ** 2)


def fresnel(first: npt.ArrayLike, last: npt.ArrayLike, angle: npt.ArrayLike) -> Amplitudes:
    """Fresnel coefficients of a bare interface, from indices and angle of incidence.

    Parameters
    ----------
    first, last : complex128, any shape
        Indices n + i kappa before and behind.
    angle : float64, radians, any shape
        Of incidence; broadcast with the indices.

    Returns
    -------
    Amplitudes
        rs, rp, ts, tp, complex128 of the broadcast shape.

    Raises
    ------
    ValueError
        If an angle is not from 0 to pi/2, or an index is not finite or 0.
    """
    from fringetrace.optics.film_kernels import normal_part, stacks

    indices = [filled(n, np.complex128) for n in (first, last)]
    for n in indices:
        if not (np.isfinite(n) & (n != 0.0)).all():
            raise ValueError(f"fresnel: expected finite indices n + i kappa, not 0, got {n}")
    n1, n2, theta = np.broadcast_arrays(*indices, np.asarray(angle, dtype=np.float64))
    flat = _checked_angles(theta).reshape(-1)
    n1, n2, shape = np.ascontiguousarray(n1.reshape(-1)), np.ascontiguousarray(n2.reshape(-1)), theta.shape
    none = np.empty((len(flat), 0), np.complex128)
    q1 = normal_part(n1, flat)
    return Amplitudes(*stacks(q1, n1, none, np.empty(0), n2, np.ones(len(flat))).reshape(4, *shape))
