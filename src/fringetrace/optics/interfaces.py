"""Optical interfaces: amplitudes of the reflected and the transmitted branch."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from numbers import Complex, Real
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np

from fringetrace.core import FloatArray, short_repr
from fringetrace.optics.elements import InterfaceKind, Waves

if TYPE_CHECKING:
    from fringetrace.optics.films import Film

# A passive surface may not send on more power than it got; rounding is allowed for.
PASSIVE = 1.0 + 1e-12


class Interface(Protocol):
    """Anything with a constant amplitude for each of two branches.

    What it is, and what else asks for it (`kind` to `waves`), has the same names on boundaries of media
    and on an `Element`; `ConstantInterface` has them for what is as simple as a mirror.
    """

    @property
    def reflection(self) -> complex:
        """Amplitude of the reflected branch, relative to the incident one."""

    @property
    def transmission(self) -> complex:
        """Amplitude of the branch that goes straight on."""

    @property
    def kind(self) -> InterfaceKind:
        """What a surface asks of it: "constant" amplitudes."""

    @property
    def branches(self) -> int:
        """How many branches there are, always."""

    @property
    def polarised(self) -> bool:
        """Whether fields have to be vectors."""

    @property
    def chromatic(self) -> bool:
        """Whether it depends on the wavelength."""

    @property
    def waves(self) -> Waves:
        """How plane waves leave it: plane, curved or torn."""


class ConstantInterface:
    """Two branches of constant amplitudes, which keep plane waves plane, in any light."""

    kind: ClassVar[InterfaceKind] = "constant"
    branches: ClassVar[int] = 2
    polarised: ClassVar[bool] = False
    chromatic: ClassVar[bool] = False
    waves: ClassVar[Waves] = "plane"


class _MediaBoundary:
    """What boundaries of media have in common."""

    kind: ClassVar[InterfaceKind] = "boundary"
    branches: ClassVar[int] = 2
    polarised: ClassVar[bool] = False
    waves: ClassVar[Waves] = "plane"
    film: Film | None

    @property
    def chromatic(self) -> bool:
        """Whether it depends on the wavelength, whatever its media do."""
        return self.film is not None


def _checked_fraction(value: float, what: str) -> float:
    if not (isinstance(value, Real) and math.isfinite(value) and 0.0 <= value <= 1.0):
        raise ValueError(f"{what}: expected a number from 0 to 1, got {value!r}")
    return float(value)


@dataclass(frozen=True)
class Mirror(ConstantInterface):
    """Ideal mirror: multiplies the field by -sqrt(reflectance), on both sides.

    The sign is the half-wave loss at a denser medium. What is not reflected is absorbed.

    Parameters
    ----------
    reflectance : float
        Fraction of the power that is reflected, 0 to 1.

    Raises
    ------
    ValueError
        If the reflectance is not a number from 0 to 1.
    """

    reflectance: float = 1.0

    __repr__ = short_repr

    def __post_init__(self) -> None:
        _checked_fraction(self.reflectance, "Mirror reflectance")

    @property
    def reflection(self) -> complex:
        """Amplitude of the reflected branch, -sqrt(reflectance)."""
        return complex(-math.sqrt(self.reflectance))

    @property
    def transmission(self) -> complex:
        """Amplitude of the transmitted branch, 0."""
        return 0j


@dataclass(frozen=True)
class Absorber(ConstantInterface):
    """Absorber: ends every ray."""

    @property
    def reflection(self) -> complex:
        """Amplitude of the reflected branch, 0."""
        return 0j

    @property
    def transmission(self) -> complex:
        """Amplitude of the transmitted branch, 0."""
        return 0j


@dataclass(frozen=True)
class BeamSplitter(ConstantInterface):
    """Thin beam splitter, the same from both sides.

    A symmetric lossless splitter conserves energy at every phase between its two inputs only
    if |r|^2 + |t|^2 = 1 and r is a quarter wave from t (Re(r* t) = 0); the default is the
    50/50 one, t = 1/sqrt(2), r = i/sqrt(2).

    Parameters
    ----------
    reflection, transmission : complex
        Amplitudes r and t.

    Raises
    ------
    ValueError
        If an amplitude is not finite, or some pair of inputs would gain power: the largest
        of |r + t|^2 and |r - t|^2 is above 1.
    """

    reflection: complex = 1j / math.sqrt(2.0)
    transmission: complex = complex(1.0 / math.sqrt(2.0))

    __repr__ = short_repr

    def __post_init__(self) -> None:
        r, t = self.reflection, self.transmission
        if not all(isinstance(a, Complex) and cmath.isfinite(a) for a in (r, t)):
            raise ValueError(f"BeamSplitter: expected finite amplitudes, got r={r!r}, t={t!r}")
        largest = max(math.hypot(a.real, a.imag) for a in (r + t, r - t))
        gain = largest * largest  # not **: that raises on overflow
        if gain > PASSIVE:
            raise ValueError(
                f"BeamSplitter: expected |r + t|^2 and |r - t|^2 up to 1 (passive), got {gain:.6g} "
                f"for r={r}, t={t}; a lossless splitter has r a quarter wave from t"
            )


FOLLOWED = ("both", "reflected", "transmitted")


def _checked_film(film: Film | None, what: str) -> None:
    if film is None:
        return
    from fringetrace.optics.films import Film

    if not isinstance(film, Film):
        raise TypeError(f"{what} film: expected None or a Film, got {film!r}")


@dataclass(frozen=True)
class Dielectric(_MediaBoundary):
    """Dielectric boundary between two media: refraction and reflection by Snell and Fresnel.

    A beam without polarisation takes the amplitudes of s light (E along the boundary).

    Parameters
    ----------
    follow : {"both", "reflected", "transmitted"}
        Which branches are traced on; the power of the other counts as truncated.
    film : Film, optional
        Thin layers on the boundary, from the front to the back.

    Raises
    ------
    ValueError
        For any other `follow`.
    TypeError
        If `film` is no Film.
    """

    follow: str = "both"
    film: Film | None = None

    opaque: ClassVar[bool] = False

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if self.follow not in FOLLOWED:
            raise ValueError(f"Dielectric follow: expected one of {FOLLOWED}, got {self.follow!r}")
        _checked_film(self.film, "Dielectric")


@dataclass(frozen=True)
class Metal(_MediaBoundary):
    """Metal boundary: only the reflected branch is traced, the medium behind absorbs the rest.

    Parameters
    ----------
    film : Film, optional
        Thin layers on the metal, from the front to the back.

    Raises
    ------
    TypeError
        If `film` is no Film.
    """

    film: Film | None = None

    follow: ClassVar[str] = "reflected"
    opaque: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _checked_film(self.film, "Metal")


def reflect(direction: FloatArray, normal: FloatArray) -> FloatArray:
    """Reflected directions, d - 2 (n.d) n.

    Parameters
    ----------
    direction : (n, 3) float64, unit
    normal : (n, 3) float64, unit
        Either side.

    Returns
    -------
    (n, 3) float64, unit
    """
    along = np.einsum("ij,ij->i", direction, normal)
    return np.asarray(direction - 2.0 * along[:, None] * normal, dtype=np.float64)


def refract(direction: FloatArray, normal: FloatArray, before: float, behind: float) -> FloatArray:
    """Refracted directions by Snell's law: the tangential component of n d is conserved.

    Parameters
    ----------
    direction : (3,) float64, unit
    normal : (3,) float64, unit
        Either side.
    before, behind : float
        Real refractive indices.

    Returns
    -------
    (3,) float64, unit
        The same array where the indices are the same; NaN where light is totally reflected.
    """
    if before == behind:
        return direction
    facing = float(direction @ normal)
    with np.errstate(invalid="ignore"):
        deep = np.sqrt((behind - before) * (behind + before) + (before * facing) ** 2)
    bent = before * direction + (math.copysign(1.0, facing) * deep - before * facing) * normal
    return np.asarray(bent / behind, dtype=np.float64)
