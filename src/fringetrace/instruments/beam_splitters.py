"""Beam-splitter plates: glass with a semi-reflecting coating, ghosts included."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fringetrace.core import FloatArray, nm, rotation, short_repr
from fringetrace.geometry import Mesh, plate
from fringetrace.instruments.layout import real_index
from fringetrace.optics import Absorber, Dielectric, Film, Material, as_material, refract
from fringetrace.scene import Surface

# Sine squared of the incidence at a plate that stands at 45 degrees.
HALF = 0.5
DESIGN = 587.56 * nm


def semi_reflecting(
    glass: Material | float | str, wavelength: float = DESIGN, reflectance: float = 0.5
) -> Film:
    """Semi-reflecting layer, a quarter wave thick at 45 degrees, of given reflectance for s light.

    Its index follows from r = (Y_0 Y_s - Y_1^2) / (Y_0 Y_s + Y_1^2) with the s admittances Y = n cos
    (Macleod, Thin-Film Optical Filters, ch. 2); it is about 2.45 for half the light, as titania.

    Parameters
    ----------
    glass : Material, number or name
    wavelength : float, metres
    reflectance : float
        Between that of the bare face and 1.

    Returns
    -------
    Film

    Raises
    ------
    ValueError
        If a layer of a higher index than the glass cannot do so.
    """
    n = real_index(glass, wavelength)
    product, r = math.sqrt(1.0 - HALF) * math.sqrt(n * n - HALF), math.sqrt(max(reflectance, 0.0))
    if not 0.0 < reflectance < 1.0 or product * (1.0 + r) / (1.0 - r) + HALF <= n * n:
        raise ValueError(
            f"semi_reflecting: expected more than the bare face and less than 1, got {reflectance!r}"
        )
    return _quarter(product * (1.0 + r) / (1.0 - r), wavelength)


def anti_reflecting(glass: Material | float | str, wavelength: float = DESIGN) -> Film:
    """Antireflection layer for s light on glass at 45 degrees.

    Parameters
    ----------
    glass : Material, number or name
    wavelength : float, metres

    Returns
    -------
    Film
    """
    n = real_index(glass, wavelength)
    return _quarter(math.sqrt(1.0 - HALF) * math.sqrt(n * n - HALF), wavelength)


def _quarter(admittance2: float, wavelength: float) -> Film:
    """The layer of a squared s admittance in air at 45 degrees, a quarter of a wave thick there."""
    index = math.sqrt(admittance2 + HALF)
    return Film(((as_material(index), wavelength / (4.0 * math.sqrt(admittance2))),))


@dataclass(frozen=True)
class SplitterPlate:
    """Beam-splitter plate: plane-parallel glass at 45 degrees, half-reflecting on one face.

    Light comes from the glass side: the sample's arm crosses the glass three times, that of the
    reference once, or with a compensator three times as well.

    Parameters
    ----------
    thickness : float, metres
    glass : Material, number or name
    coating : Film, optional
        On the splitting face, from the air to the glass. Default: `semi_reflecting`.
    back_coating : Film, optional
        On the other face (and on both of the compensator), from the air to the glass. None: bare.
    ghosts : bool
        Whether what those faces reflect is followed: light with path keys of its own.
    design : float, metres
        Wavelength of the default coating, and at which the light's axis hits what it is meant to.

    Raises
    ------
    ValueError
        If the thickness is not positive.
    """

    thickness: float
    glass: Material | float | str = "BK7"
    coating: Film | None = None
    back_coating: Film | None = None
    ghosts: bool = True
    design: float = DESIGN

    __repr__ = short_repr

    def __post_init__(self) -> None:
        if not (math.isfinite(self.thickness) and self.thickness > 0.0):
            raise ValueError(
                f"SplitterPlate thickness: expected a positive length in metres, got {self.thickness!r}"
            )

    def surfaces(self, half: float) -> tuple[Surface, ...]:
        """Surfaces of the plate: coated face through the origin, other face, blackened rim.

        Parameters
        ----------
        half : float, metres
            How far it reaches along x, y and z.

        Returns
        -------
        three Surface
        """
        coating = semi_reflecting(self.glass, self.design) if self.coating is None else self.coating
        upper, lower, rim = _box(half, self.thickness)
        coated = Surface(upper, Dielectric(film=coating), "splitter", back=as_material(self.glass))
        black = Surface(rim, Absorber(), "splitter's rim")
        return coated, self._bare(lower, True, "splitter's other face"), black

    def compensator(self, half: float, centre: FloatArray) -> tuple[Surface, ...]:
        """Compensator plate of the same glass and thickness, parallel to the splitter, uncoated.

        Parameters
        ----------
        half : float, metres
            How far it reaches along x, y and z.
        centre : (3,) metres

        Returns
        -------
        three Surface
        """
        upper, lower, rim = (mesh.moved(centre) for mesh in _box(half, self.thickness))
        return (
            self._bare(upper, False, "compensator"),
            self._bare(lower, True, "compensator's other face"),
            Surface(rim, Absorber(), "compensator's rim"),
        )

    def _bare(self, mesh: Mesh, ahead: bool, name: str) -> Surface:
        """A face with the glass before it (on its front) or behind it."""
        film = self.back_coating
        if film is not None and ahead:
            film = film.reversed()
        kind = Dielectric("both" if self.ghosts else "transmitted", film)
        medium = as_material(self.glass)
        front, back = (medium, None) if ahead else (None, medium)
        return Surface(mesh, kind, name, front=front, back=back)

    def offsets(self) -> tuple[float, float]:
        """Displacements of light along +x that hits the coating in the origin: in z before, in x after.

        Returns
        -------
        z, x : float, metres
        """
        normal = _turn()[:, 2]
        inside = refract(np.array([1.0, 0.0, 0.0]), normal, 1.0, real_index(self.glass, self.design))
        down = inside - 2.0 * (inside @ normal) * normal
        enters = -inside * (self.thickness / (inside @ normal))
        leaves = down * (self.thickness / -(down @ normal))
        return float(enters[2]), float(leaves[0])


def _box(half: float, thickness: float) -> tuple[Mesh, Mesh, Mesh]:
    """Upper face, lower face and rim of a plate whose upper face goes through the origin at 45 degrees."""
    face = plate(2.0 * half * math.sqrt(2.0), 2.0 * half)
    box = plate(2.0 * half * math.sqrt(2.0), 2.0 * half, thickness)
    level = np.ptp(box.corners[:, :, 2], axis=1) == 0.0
    lower, rim = face.moved((0.0, 0.0, -thickness)), Mesh(box.vertices, box.faces[~level], "rim")
    upper, lower, rim = (mesh.moved(turn=_turn()) for mesh in (face, lower, rim))
    return upper, lower, rim


def _turn() -> FloatArray:
    """From facing +z to facing +x and +z."""
    return rotation(np.array([0.0, 1.0, 0.0]), math.pi / 4.0)
