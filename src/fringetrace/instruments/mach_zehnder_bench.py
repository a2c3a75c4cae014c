"""Mach-Zehnder interferometer: one arm passes the sample once."""

from __future__ import annotations

import math

import numpy as np

from fringetrace.core import FloatArray, nm
from fringetrace.geometry import plate
from fringetrace.instruments import layout
from fringetrace.instruments.arms import Arms, Mark, path_slope
from fringetrace.instruments.interferometer import Interferometer
from fringetrace.instruments.layout import Sample
from fringetrace.optics import BeamSplitter, Interface, Material, Mirror
from fringetrace.scene import CCD, Beam, Profile, Scene, Surface

# Wavelength for the default aperture, where the medium disperses.
DESIGN = 587.56 * nm
DIAGONAL = np.array([-1.0, 0.0, 1.0])


def mach_zehnder(
    sample: Sample,
    *,
    aperture: float,
    index: Material | complex | str | None = None,
    medium: Material | complex | str | None = None,
    na: float | None = None,
    plane: float = 0.0,
    reference_tilt: tuple[float, float] = (0.0, 0.0),
    pixels: tuple[int, int] = (512, 512),
    rays: float = 1,
    profile: Profile | None = None,
    polarisation: tuple[complex, complex] | None = None,
    splitter: Interface = BeamSplitter(),  # noqa: B008 - frozen
    mirror: Interface = Mirror(),  # noqa: B008 - frozen
    method: str = "auto",
    design: float = DESIGN,
) -> Interferometer:
    """Mach-Zehnder interferometer with a transparent sample in one arm, such as a cell.

    Light goes through the sample along +z; the camera looks back at it, its columns along x and its rows
    along y, focused on a plane inside of the sample: rays are carried back to it along the lines on which
    they left (`CCD.focus`). Both arms are equally long without the sample. All of it stands in the medium.

    Parameters
    ----------
    sample : Mesh, Surface, or several surfaces, metres
        In its own coordinates, x = y = 0 the optical axis. Closed meshes with their front outside; a
        mesh is filled with `index`, and what its faces reflect is not followed. Surfaces bring their own
        interfaces, media and forms.
    aperture : float, metres
        Width of the beam and of the image.
    index : Material, number or name
        Of a mesh.
    medium : Material, number or name, optional
        Around everything; None: a vacuum.
    na : float, optional
        Numerical aperture of the objective: steeper rays are dropped. Default: what the bench carries
        on, 0.62 of the medium's index.
    plane : float, metres
        z of the plane that the camera is focused on.
    reference_tilt : (tilt_x, tilt_y), radians
        The path of the reference rises by 2 tilt_x a metre along x, 2 tilt_y along y (times the index of
        the medium).
    pixels : (rows, columns)
    rays : float
        A pixel, along either axis; see `michelson`.
    profile : callable, optional
        Amplitude at (x, y) of the image.
    polarisation : (2,) complex, optional
        Jones vector along x and y; the field is then traced as a vector.
    splitter, mirror : Interface
        Of both splitters, and of both mirrors.
    method : {"auto", "wavefront", "rays"}
    design : float, metres
        Wavelength at which the default aperture is found, if the medium disperses.

    Returns
    -------
    Interferometer
        `path_difference` has the optical path that the sample adds.

    Raises
    ------
    ValueError
        If a length, a number of pixels or of rays is not positive, an index is missing or given twice, the
        aperture or the tilt is too large for the bench.
    TypeError
        If the sample is no mesh.
    """
    size = layout.checked_image_size("mach_zehnder", aperture, pixels, rays)
    layout.checked_tilt("mach_zehnder", reference_tilt)
    around = layout.surrounding_medium(medium)
    surfaces = layout.transmitting_surfaces("mach_zehnder", sample, index)
    aside, deep = layout.sample_extent(surfaces, max(size))
    stop = 1.1 * max(deep, abs(plane)) + 0.25 * max(size)
    arm = 4.0 * max(stop, aside)
    chip = 7.0 * (arm + aside)
    small = plate(4.0 * aside, 4.0 * aside)
    pupil = layout.pupil("mach_zehnder", Scene(surfaces, around), na, design)
    turn = layout.standing_rotation(DIAGONAL)
    scene = Scene(
        (
            Surface(small.moved((-arm, 0.0, -arm), turn), splitter, "first splitter"),
            Surface(small.moved((0.0, 0.0, -arm), turn), mirror, "mirror"),
            Surface(small.moved((-arm, 0.0, arm), _turn(reference_tilt)), mirror, "reference"),
            *surfaces,
            Surface(plate(100.0 * arm, 100.0 * arm).moved((0.0, 0.0, stop)), pupil, "pupil"),
            _last(arm, aside, splitter),
        ),
        around,
    )
    x, y, z = np.eye(3)
    beam = Beam(
        centre=-arm * x - 2.0 * arm * z, direction=z, up=y,
        size=size, shape=layout.ray_grid(pixels, rays), profile=layout.flip_profile(profile),
        polarisation=None if polarisation is None else np.array([-polarisation[0], polarisation[1]]),
    )  # fmt: skip
    ccd = CCD(
        centre=chip * z, normal=-z, up=y, pitch=aperture / pixels[1], shape=pixels, focus=chip - plane,
    )  # fmt: skip
    arms = Arms(Mark(2), reference_tilt, sample=1, immersion=scene.medium)
    return Interferometer(scene, beam, ccd, arms, method)


def _turn(tilt: tuple[float, float]) -> FloatArray:
    """Turn of the reference mirror: light along +z leaves it so that the splitter sends it on as tilted.

    The mirror is in focus: it stands as far from the second splitter as the middle of the sample.
    """
    slope_x, slope_y = path_slope(tilt)
    ahead = math.sqrt(1.0 - slope_x**2 - slope_y**2)
    # the second splitter swaps x and z
    return layout.standing_rotation(np.array([0.0, 0.0, 1.0]) - np.array([ahead, slope_y, slope_x]))


def _last(arm: float, aside: float, splitter: Interface) -> Surface:
    """The second splitter, at z = x + arm, as large as the steepest rays to all sides ask for.

    A ray from x = aside that rises by `STEEPEST` gets to it at z = (arm + aside) / (1 - STEEPEST), one that
    falls at (arm - aside) / (1 + STEEPEST); to the sides they reach STEEPEST / sqrt(1 - STEEPEST^2) arms.
    """
    low = 0.9 * (arm - aside) / (1.0 + layout.STEEPEST)
    high = 1.1 * (arm + aside) / (1.0 - layout.STEEPEST)
    middle = 0.5 * (low + high)
    across = 2.0 * (1.5 * (arm + aside) + aside)
    mesh = plate(math.sqrt(2.0) * (high - low), across)
    return Surface(
        mesh.moved((middle - arm, 0.0, middle), layout.standing_rotation(DIAGONAL)),
        splitter,
        "second splitter",
    )
