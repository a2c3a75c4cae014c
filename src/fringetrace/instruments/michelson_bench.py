"""Michelson (Twyman-Green) interferometer."""

from __future__ import annotations

import math

import numpy as np

from fringetrace.core import FloatArray, rotation
from fringetrace.geometry import Mesh, plate
from fringetrace.instruments import layout
from fringetrace.instruments.arms import Arms, Mark
from fringetrace.instruments.beam_splitters import SplitterPlate, anti_reflecting, semi_reflecting
from fringetrace.instruments.fizeau_bench import fizeau
from fringetrace.instruments.interferometer import Interferometer
from fringetrace.instruments.jamin_lebedeff_bench import jamin_lebedeff
from fringetrace.instruments.layout import TILT
from fringetrace.instruments.mach_zehnder_bench import mach_zehnder
from fringetrace.optics import BeamSplitter, Interface, Mirror
from fringetrace.scene import CCD, Beam, Profile, Scene, Surface

__all__ = [
    "TILT", "Interferometer", "SplitterPlate", "anti_reflecting", "fizeau", "jamin_lebedeff", "mach_zehnder",
    "michelson", "semi_reflecting",
]  # fmt: skip

# Twice an aperture is twice that, whatever unit it was multiplied with.
ROUNDED = 1.0 - 1e-12
# Parts of the arm: the splitter reaches SPAN up, down and to the sides; an arm is SHORTEST apertures and
# TALLEST heights of the sample long, or longer. A reference mirror tilted by up to TILT and
# moved by up to PISTON arms then sends all of its light back through the splitter, and touches nothing.
SPAN = 0.6
SHORTEST = 2.0
TALLEST = 3.0
PISTON = 0.1
# With a real splitter an arm has room for plates, at least so many apertures and thicknesses; half way to the
# reference stands the compensator, which reaches half a beam and WIDER arms to all sides.
ROOMIER = 4.0
WIDER = 0.1


def michelson(
    sample: Mesh | Surface,
    *,
    aperture: float,
    reference_tilt: tuple[float, float] = (0.0, 0.0),
    piston: float = 0.0,
    pixels: tuple[int, int] = (512, 512),
    rays: float = 1,
    profile: Profile | None = None,
    arm: float | None = None,
    splitter: Interface | SplitterPlate = BeamSplitter(),  # noqa: B008 - frozen
    compensator: bool = False,
    mirror: Interface = Mirror(),  # noqa: B008 - frozen
    focus: bool = True,
    method: str = "auto",
) -> Interferometer:
    """Michelson (Twyman-Green) interferometer with the sample in one arm.

    The splitter stands at the origin at 45 degrees. The source at (-arm, 0, 0) fires along +x;
    half of the light goes down to the sample at (0, 0, -arm), half on to the reference mirror
    at (+arm, 0, 0); what comes back meets on the CCD at (0, 0, +arm), whose rows lie along y
    and whose columns lie along x of the sample.

    Parameters
    ----------
    sample : Mesh (or trimesh.Trimesh), or Surface, metres
        In its own coordinates: z is the height towards the light, x = y = 0 the optical axis.
        A mesh becomes a mirror; a Surface brings its own interface.
    aperture : float, metres
        Width of the beam and of the image; the height follows from the pixels, which are square.
    reference_tilt : (tilt_x, tilt_y), radians
        The path of the reference rises by 2 tilt_x a metre along x, 2 tilt_y along y.
    piston : float, metres
        Displacement of the reference mirror away from the splitter: its path is 2 piston longer.
    pixels : (rows, columns)
    rays : float
        Rays a pixel, along either axis: rays**2 in all, from the centres of its parts. The wavefront
        does with fewer than one, such as 1/8: one in 8 x 8 pixels.
    profile : callable, optional
        Amplitude of the beam at (x, y) of the image, metres; None is uniform. See `Gaussian`.
    arm : float, metres, optional
        Length of the arms; default twice the larger side of the image, three times the height of
        the sample if that is more; with a plate four times that side, or its thickness.
    splitter : Interface or SplitterPlate
        A thin splitter, or a real plate: then one has to say at which wavelength it is traced.
    compensator : bool
        A second plate of glass, in the arm of the reference.
    mirror : Interface
        Of the reference mirror.
    focus : bool
        The CCD sees the plane z = 0 of the sample through an ideal 1:1 relay; False: bare CCD.
    method : {"auto", "wavefront", "rays"}
        How arrivals become light on the pixels, see `complex_field`.

    Returns
    -------
    Interferometer

    Raises
    ------
    ValueError
        If a length, a number of pixels or of rays is not positive; if the arm is too short for
        the aperture or the sample; if the tilt would lead the reference beam off the bench; for a
        compensator without a plate.
    TypeError
        If the sample is no mesh.
    """
    surface = sample if isinstance(sample, Surface) else Surface(sample, Mirror(), "sample")
    thick = splitter if isinstance(splitter, SplitterPlate) else None
    size = layout.checked_image_size("michelson", aperture, pixels, rays)
    arm = _arm(size, arm, float(surface.mesh.bounds[1, 2]), thick)
    _check_reference(reference_tilt, piston, arm)
    if compensator and thick is None:
        raise ValueError(f"michelson compensator: expected one beside a SplitterPlate only, got {splitter!r}")
    half, (rows, columns) = SPAN * arm, pixels
    crossing = plate(2.0 * half * math.sqrt(2.0), 2.0 * half)
    facing = plate(half, half).moved(turn=_reference_turn(reference_tilt))
    x, y, z = np.eye(3)
    rise, aside = (0.0, 0.0) if thick is None else thick.offsets()
    glass: tuple[Surface, ...] = ()
    if thick is None:
        first = Surface(crossing.moved(turn=rotation(y, math.pi / 4.0)), splitter, "splitter")  # type: ignore[arg-type]
    else:
        first, *others = thick.surfaces(half)
        glass = tuple(others)
        if compensator:
            glass += thick.compensator(0.5 * max(size) + WIDER * arm, 0.5 * arm * x)
    scene = Scene(
        (
            first,
            surface.moved(aside * x - arm * z),
            Surface(facing.moved((arm + piston) * x), mirror, "reference"),
            *glass,
        )
    )
    beam = Beam(
        centre=rise * z - arm * x, direction=x, up=y, size=size, shape=layout.ray_grid(pixels, rays),
        profile=layout.flip_profile(profile),
    )  # fmt: skip
    ccd = CCD(
        centre=arm * z, normal=-z, up=y, pitch=aperture / columns, shape=(rows, columns),
        focus=2.0 * arm if focus else 0.0,
    )  # fmt: skip
    return Interferometer(scene, beam, ccd, Arms(Mark(2), reference_tilt, sample=1), method)


def _arm(size: tuple[float, float], arm: float | None, top: float, thick: SplitterPlate | None) -> float:
    """The length of the arms, once all is known to fit."""
    shortest = SHORTEST * max(size)
    if thick is not None:
        shortest = ROOMIER * max(*size, thick.thickness)
    arm = max(shortest, TALLEST * top) if arm is None else arm
    if not (math.isfinite(arm) and arm >= ROUNDED * shortest):
        raise ValueError(
            f"michelson arm: expected at least {shortest / max(size)} times the aperture, {shortest:g} m, "
            f"got {arm!r}"
        )
    if not arm >= ROUNDED * TALLEST * top:
        raise ValueError(
            f"michelson arm: expected at least {TALLEST} times the sample's height, {TALLEST * top:g} m, "
            f"got {arm!r}; z = 0 is the plane that the camera sees"
        )
    return arm


def _check_reference(tilt: tuple[float, float], piston: float, arm: float) -> None:
    """Refuse what would lead the reference beam off the bench."""
    if not math.hypot(*tilt) <= TILT:
        raise ValueError(f"michelson reference_tilt: expected up to {TILT} rad, got {tilt!r}")
    if not abs(piston) <= PISTON * arm:
        raise ValueError(
            f"michelson piston: expected up to {PISTON} times the arm, {PISTON * arm:g} m, got {piston!r}"
        )


def _reference_turn(tilt: tuple[float, float]) -> FloatArray:
    """Turn of a plate from facing +z to facing -x, tilted.

    The splitter shows (x, y, z) of the mirror at (-z, y, -x): tilted about (0, -tilt_x, -tilt_y),
    it stands in the image with the normal (sin a tilt_x / a, sin a tilt_y / a, cos a).
    """
    facing = rotation((0.0, 1.0, 0.0), -0.5 * math.pi)
    angle = math.hypot(*tilt)
    if angle == 0.0:
        return facing
    return np.asarray(rotation((0.0, -tilt[0], -tilt[1]), angle) @ facing, dtype=np.float64)
