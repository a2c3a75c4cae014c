"""Fizeau interferometer: multiple round trips between a reference face and the sample."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fringetrace.core import FloatArray, nm, rotation, short_repr
from fringetrace.geometry import Mesh, Sphere, height_map, plate
from fringetrace.instruments import layout
from fringetrace.instruments.arms import Arms, Mark
from fringetrace.instruments.interferometer import Interferometer
from fringetrace.optics import BeamSplitter, Dielectric, Film, Interface, Material, Mirror, as_material
from fringetrace.scene import CCD, Beam, Profile, Scene, Surface

# Wavelength at which the camera is focused, where glass disperses.
DESIGN = 587.56 * nm
# The splitter reaches SPAN arms to all sides; an arm is ROOM apertures, and ROOM times what stands under it.
SPAN, ROOM = 0.6, 4.0
# Bounces that a path key can tell, for the few surfaces of this bench.
MOST = 18
# Cells of a curved reference face along either side.
CELLS = 64


def fizeau(
    sample: Mesh | Surface,
    *,
    aperture: float,
    gap: float,
    glass: Material | float | str = 1.5,
    between: Material | float | str = 1.0,
    reference_tilt: tuple[float, float] = (0.0, 0.0),
    radius: float = math.inf,
    thickness: float | None = None,
    wedge: tuple[float, float] = (0.0, 0.0),
    coating: Film | None = None,
    back_coating: Film | None = None,
    pixels: tuple[int, int] = (512, 512),
    rays: float = 1,
    profile: Profile | None = None,
    splitter: Interface = BeamSplitter(),  # noqa: B008 - frozen
    max_bounces: int = MOST,
    min_amplitude: float = 1e-6,
    method: str = "auto",
    design: float = DESIGN,
) -> Interferometer:
    """Fizeau interferometer: a glass plate above the sample, its lower face the reference.

    Light comes down through the plate; what the reference face sends back interferes with what comes back
    from the sample, once or after several round trips in the gap: Airy's fringes, as narrow as both
    reflect well. A splitter above, which halves the light twice, sends it to the camera; that is focused
    on z = 0 of the sample, through the plate.

    Parameters
    ----------
    sample : Mesh or Surface, metres
        z is the height towards the light, x = y = 0 the optical axis. A mesh becomes a mirror; a Surface
        brings its own interface, with the medium `between` in front of it.
    aperture : float, metres
        Width of the beam and of the image.
    gap : float, metres
        From z = 0 of the sample up to the reference face.
    glass, between : Material, number or name
        Of the plate, and what fills the gap.
    reference_tilt : (tilt_x, tilt_y), radians
        Of the reference face: the gap narrows along the tilt, so that the path of the reference
        rises by 2 tilt_x a metre along x (times the index in the gap).
    radius : float, metres
        Of a spherical reference face: positive if it bulges towards the sample, infinite for a flat one.
    thickness : float, metres, optional
        Of the plate, whose upper face then reflects too. None: the plate has none (light starts in glass).
    wedge : (x, y), radians
        Tilt of the upper face, which leads what it reflects aside.
    coating, back_coating : Film, optional
        On the reference face and on the upper one, from above.
    pixels : (rows, columns)
    rays : float
        A pixel, along either axis; see `michelson`.
    profile : callable, optional
        Amplitude at (x, y) of the image.
    splitter : Interface
    max_bounces : int
        Surfaces that light may meet: (max_bounces - 3) / 2 round trips in the gap.
    min_amplitude : float
        Fainter light is left out, relative to that launched.
    method : {"auto", "wavefront", "rays"}
    design : float, metres
        Wavelength at which the camera is focused.

    Returns
    -------
    Interferometer
        A phase step moves the reference face: light with m round trips is turned by -m delta. Heights
        by phase steps hold where one round trip is all that counts.

    Raises
    ------
    ValueError
        If a length, a number of pixels or of rays is not positive; if the reference touches the
        sample, or tilt or curvature are too large for the bench.
    TypeError
        If the sample is no mesh.
    """
    size = layout.checked_image_size("fizeau", aperture, pixels, rays)
    surface = sample if isinstance(sample, Surface) else Surface(sample, Mirror(), "sample")
    layout.checked_tilt("fizeau", reference_tilt)
    layout.checked_tilt("fizeau", wedge)
    top = _checked_top(float(surface.mesh.bounds[1, 2]), gap, thickness)
    arm = ROOM * max(*size, top)
    cover = ReferencePlate(
        size, gap, as_material(glass), as_material(between), reference_tilt, radius, thickness, wedge,
        (coating, back_coating),
    )  # fmt: skip
    x, y, z = np.eye(3)
    around = as_material(glass if thickness is None else 1.0)
    scene = Scene(
        (
            Surface(_crossing(SPAN * arm), splitter, "splitter"),
            surface.moved(-arm * z),
            *(face.moved(-arm * z) for face in cover.surfaces),
        ),
        around,
    )
    beam = Beam(
        centre=-arm * x, direction=x, up=y, size=size, shape=layout.ray_grid(pixels, rays),
        profile=layout.flip_profile(profile),
    )  # fmt: skip
    outside, inside, filled = (layout.real_index(m, design) for m in (around, glass, between))
    focus = 2.0 * arm - top + gap * outside / filled + (top - gap) * outside / inside
    ccd = CCD(centre=arm * z, normal=-z, up=y, pitch=aperture / pixels[1], shape=pixels, focus=focus)
    arms = Arms(Mark(2, then=1, sense=-1), reference_tilt, sample=1, immersion=as_material(between))
    return Interferometer(scene, beam, ccd, arms, method, max_bounces, min_amplitude)


def _checked_top(height: float, gap: float, thickness: float | None) -> float:
    """Where the plate ends, metres above z = 0, once it is known to stand over a sample of a height."""
    top = gap + (0.0 if thickness is None else thickness)
    if not (math.isfinite(top) and gap > height and (thickness is None or thickness > 0.0)):
        raise ValueError(
            f"fizeau gap: expected more than the sample's height, {height:g} m, and a "
            f"plate of positive thickness, got {gap!r} and {thickness!r}"
        )
    return top


def _crossing(reach: float) -> Mesh:
    """A plate in the origin at 45 degrees to x and z, which reaches so far along them and along y."""
    flat = plate(2.0 * reach * math.sqrt(2.0), 2.0 * reach)
    return flat.moved(turn=rotation((0.0, 1.0, 0.0), math.pi / 4.0))


@dataclass(frozen=True)
class ReferencePlate:
    """Plate over the sample of a Fizeau interferometer; its lower face is the reference.

    Parameters
    ----------
    size : (width, height), metres
        Of the image.
    gap : float, metres
        Height of the reference face.
    glass, between : Material
        Of the plate, and below it.
    tilt : (tilt_x, tilt_y), radians
    radius : float, metres
        Of the reference face; infinite: flat.
    thickness : float or None, metres
        None: there is no upper face.
    wedge : (x, y), radians
        Tilt of the upper face.
    coatings : (lower, upper), Film or None
    """

    size: tuple[float, float]
    gap: float
    glass: Material
    between: Material
    tilt: tuple[float, float]
    radius: float
    thickness: float | None
    wedge: tuple[float, float]
    coatings: tuple[Film | None, Film | None]

    __repr__ = short_repr

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The reference face, its front in the glass, and the upper face if there is one."""
        lower, upper = self.coatings
        normal = layout.tilted_normal(self.tilt)
        face = _face(self.size, self.radius).moved(turn=layout.standing_rotation(normal))
        face, form = face.moved((0.0, 0.0, self.gap)), None
        if math.isfinite(self.radius):
            centre = np.array([0.0, 0.0, self.gap]) + self.radius * normal
            form = Sphere(centre, abs(self.radius))
        reference = Surface(face, Dielectric(film=lower), "reference", form, self.glass, self.between)
        if self.thickness is None:
            return (reference,)
        wide = 4.0 * max(self.size)
        top = plate(wide, wide).moved(turn=layout.standing_rotation(layout.tilted_normal(self.wedge)))
        top = top.moved((0.0, 0.0, self.gap + self.thickness))
        return reference, Surface(top, Dielectric(film=upper), "upper face", None, None, self.glass)


def _face(size: tuple[float, float], radius: float) -> Mesh:
    """A face with its vertex in the origin, its front to +z."""
    wide = 2.0 * max(size)
    if math.isinf(radius):
        return plate(2.0 * wide, 2.0 * wide)
    if not 0.5 * math.sqrt(2.0) * wide < abs(radius):
        raise ValueError(f"fizeau radius: expected over {0.5 * math.sqrt(2.0) * wide:g} m, got {radius!r}")
    at = np.linspace(-0.5 * wide, 0.5 * wide, CELLS + 1)
    return height_map(_sag(np.add.outer(at**2, at**2), radius), wide / CELLS, name="reference")


def _sag(square: FloatArray, radius: float) -> FloatArray:
    """Height of a sphere over its vertex at a distance squared from the axis."""
    return np.asarray(square / (radius * (1.0 + np.sqrt(1.0 - square / radius**2))), dtype=np.float64)
