"""Jamin-Lebedeff interferometer: birefringent plates separate two beams and recombine them."""

from __future__ import annotations

import math

import numpy as np

from fringetrace.core import FloatArray, nm, unit
from fringetrace.geometry import plate
from fringetrace.instruments import layout
from fringetrace.instruments.arms import Arms, Mark
from fringetrace.instruments.interferometer import Interferometer
from fringetrace.instruments.layout import Sample
from fringetrace.optics import Element, IncidentRays, Material, Polariser, RealIndex, ShearPlate, wave_plate
from fringetrace.scene import CCD, Beam, Profile, Scene, Surface

# Calcite at 589.3 nm, ordinary and extraordinary.
CALCITE = (1.6584, 1.4864)
SODIUM = 589.3 * nm
# Of the polariser, the half-wave plate, the quarter-wave plate.
HALFWAY = math.pi / 4.0
# Slope of the rays that tell how deep a plate seems.
PROBE_SLOPE = 1e-4


def jamin_lebedeff(
    sample: Sample,
    *,
    aperture: float,
    index: Material | complex | str | None = None,
    medium: Material | complex | str | None = None,
    analyser: float = HALFWAY,
    senarmont: bool = False,
    shear: float | None = None,
    crystal: tuple[RealIndex, RealIndex] = CALCITE,
    half_wave: float | None = None,
    na: float | None = None,
    plane: float = 0.0,
    pixels: tuple[int, int] = (512, 512),
    rays: float = 1,
    profile: Profile | None = None,
    method: str = "auto",
    design: float = SODIUM,
) -> Interferometer:
    """Jamin-Lebedeff interferometer: two polarised beams side by side through the same plates.

    Light along +z, polarised at 45 degrees, meets a shear plate, a half-wave plate (which swaps the two
    polarisations), the sample, a second shear plate like the first, the analyser. The ordinary beam goes
    straight to the sample and is displaced behind it, the extraordinary one passes beside the sample; the
    retardances of the plates cancel. A sample that delays by delta gives cos^2(delta/2) with the analyser
    along the polariser, sin^2(delta/2) across it. Phase steps delay the extraordinary beam.

    Parameters
    ----------
    sample : Mesh, Surface, or several surfaces, metres
        As for `mach_zehnder`.
    aperture : float, metres
        Width of the beam and of the image.
    index, medium : Material, number or name
        As for `mach_zehnder`.
    analyser : float, radians
        From x towards y; the polariser stands at pi/4.
    senarmont : bool
        A quarter-wave plate, its slow axis along the polariser, before the analyser: the light is linear, and
        dark at an analyser of 3 pi/4 - delta/2.
    shear : float, metres, optional
        Distance of the two beams. Default: what image and sample need, and a quarter more.
    crystal : (ordinary, extraordinary)
        Indices of the shear plates, numbers or functions of the wavelength in metres, such as
        `materials.CALCITE_O.index`.
    half_wave : float, metres, optional
        Wavelength at which the half-wave plate is one; it leaks at others. None: at all.
    na, plane, pixels, rays, profile, method
        As for `mach_zehnder`.
    design : float, metres
        Wavelength for which the plates' thickness is found.

    Returns
    -------
    Interferometer
        `path_difference` has the optical path that the sample adds.

    Raises
    ------
    ValueError
        If a length, a number of pixels or of rays is not positive, an index is missing or given twice, the
        shear is too small for image and sample, the crystal has none, or the aperture is too large.
    TypeError
        If the sample is no mesh.
    """
    size = layout.checked_image_size("jamin_lebedeff", aperture, pixels, rays)
    surfaces = layout.transmitting_surfaces("jamin_lebedeff", sample, index)
    aside, deep = layout.sample_extent(surfaces, max(size))
    least = max(float(np.abs([s.mesh.bounds[:, 0] for s in surfaces]).max()) + 0.5 * aperture, aperture)
    shear = 1.25 * least if shear is None else shear
    if not shear >= least:
        raise ValueError(f"jamin_lebedeff shear: expected at least {least:g} m, got {shear!r}")
    space = Scene(surfaces, layout.surrounding_medium(medium))
    stop = 1.1 * max(deep, abs(plane)) + 0.25 * max(size)
    plates, moved, depth = _plates(shear, crystal, layout.real_index(space.around, design), design)
    half = wave_plate((1.0, 1.0, 0.0), 0.5, half_wave)
    wide = 100.0 * (stop + aside + shear)

    ahead: dict[str, tuple[float, Element]] = {"first plate": (-3.0, plates), "half-wave plate": (-2.0, half)}
    behind: dict[str, tuple[float, Element]] = {
        "pupil": (2.0, layout.pupil("jamin_lebedeff", space, na, design)),
        "second plate": (3.0, plates),
    }
    if senarmont:
        behind["quarter-wave plate"] = (4.0, wave_plate((1.0, 1.0, 0.0), 0.25))
    behind["analyser"] = (5.0, Polariser(np.array([math.cos(analyser), math.sin(analyser), 0.0])))
    scene = Scene(
        (*_in_line(ahead, stop, wide), *surfaces, *_in_line(behind, stop, wide)),
        space.medium,
    )
    _, y, z = np.eye(3)
    beam = Beam(
        centre=-4.0 * stop * z, direction=z, up=y, size=size, shape=layout.ray_grid(pixels, rays),
        profile=layout.flip_profile(profile), polarisation=np.array([-math.cos(HALFWAY), math.sin(HALFWAY)]),
    )  # fmt: skip
    ccd = CCD(
        centre=6.0 * stop * z + moved, normal=-z, up=y, pitch=aperture / pixels[1], shape=pixels,
        focus=6.0 * stop + depth - plane,
    )  # fmt: skip
    return Interferometer(scene, beam, ccd, Arms(Mark(0, branch=2), immersion=scene.medium), method)


def _in_line(train: dict[str, tuple[float, Element]], stop: float, wide: float) -> tuple[Surface, ...]:
    """Elements across the axis by name, each at so many `stop` along it."""
    return tuple(
        Surface(plate(wide, wide).moved((0.0, 0.0, place * stop)), element, name)
        for name, (place, element) in train.items()
    )


def _plates(
    shear: float, crystal: tuple[RealIndex, RealIndex], index: float, wavelength: float
) -> tuple[ShearPlate, FloatArray, float]:
    """A plate that displaces the extraordinary beam by so much; its displacement (3,); how deep it seems.

    A ray that comes in aslant leaves the plate farther aside, as if it had gone on for the depth: the mean of
    both planes, whose depths differ in a crystal.
    """
    axis = np.array([1.0, 0.0, 1.0])
    slopes = PROBE_SLOPE * np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)])
    direction = unit(np.column_stack([slopes, np.ones(len(slopes))]))
    none = np.zeros((len(slopes), 3))
    rays = IncidentRays(
        point=none, direction=direction, normal=none + np.array([0.0, 0.0, 1.0]),
        index=np.full(len(slopes), index), field=none + np.array([1.0 + 0j, 0.0, 0.0]), wavelength=wavelength,
    )  # fmt: skip
    point = ShearPlate(axis, 1.0, *crystal).act(rays)[1].point
    assert point is not None
    size = float(np.abs(point[0]).max())
    if not size > 0.0:
        raise ValueError(f"jamin_lebedeff crystal: expected two different indices, got {crystal!r}")
    thickness = shear / size
    depth = 0.5 * (point[1, 0] - point[2, 0] + point[3, 1] - point[4, 1]) / (2.0 * PROBE_SLOPE)
    return ShearPlate(axis, thickness, *crystal), point[0] * thickness, float(depth * thickness)
