"""A Michelson interferometer against closed forms: tilt, steps, pixels, energy, phase steps, round trips."""

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from scipy.special import erf

import fringetrace as ft
from fringetrace import instruments, mm, nm, um
from fringetrace.geometry.meshes import interpolate_height
from fringetrace.geometry.shapes import height_map, plate, step

HENE = 632.8 * nm
APERTURE = 6 * mm
# A path of some 50 mm in float64 is known to 7e-18 m; a few dozen roundings later, to 1e-9 waves.
WAVES = 1e-9
# cos^2 of a phase that is right to 1e-9 waves.
IRRADIANCE = 2 * math.pi * WAVES


def mirror():
    return plate(2 * APERTURE, 2 * APERTURE)


def bench(sample=None, **options):
    options = {"aperture": APERTURE, "pixels": (24, 32), **options}
    return instruments.michelson(mirror() if sample is None else sample, **options)


def arms(paths, number=2):
    """Detected paths by arm: sample, reference."""
    seen = paths.detected
    visits = seen.visits(number)
    return seen.where(visits == 0), seen.where(visits == 1)


def positions(paths):
    """(x, y) on the CCD about the centre of the image, metres."""
    rows, columns = paths.ccd.shape
    return (
        (paths.pixel[:, 1] - columns / 2) * paths.ccd.pitch,
        (paths.pixel[:, 0] - rows / 2) * paths.ccd.pitch,
    )


def tilted_path(reach, beyond, angle, x):
    """Path off a plane mirror through (0, reach), detected at z = -beyond: exact, in 50 digits."""
    with mpmath.workdps(50):
        length, angle = mpmath.mpf(reach), mpmath.mpf(angle)
        fixed = length + (length + mpmath.mpf(beyond)) * mpmath.cos(2 * angle)
        return [fixed + mpmath.mpf(float(at)) * mpmath.sin(2 * angle) for at in x]


@pytest.mark.parametrize("tilt", [0.5e-3, 2e-3, 20e-3])
@pytest.mark.parametrize("focus", [True, False])
def test_the_path_off_a_tilted_mirror_is_that_of_the_plane_wave(tilt, focus):
    instrument = bench(reference_tilt=(tilt, 0.0), focus=focus)
    arm = float(instrument.ccd.centre[2])
    _, reference = arms(instrument.trace())
    x, _ = positions(reference)
    expected = tilted_path(2 * arm, -2 * arm if focus else 0.0, tilt, x)
    error = [
        abs(float(length - mpmath.mpf(got))) for length, got in zip(expected, reference.length, strict=True)
    ]
    assert len(error) > 0.8 * 24 * 32
    assert max(error) / HENE < WAVES


def test_the_path_at_a_millimetre_is_the_tabulated_one():
    """L = 0.1 m, D = 0.15 m, a = 2 mrad: 0.350001999992 m at x = 1 mm."""
    instrument = bench(arm=50 * mm, reference_tilt=(2e-3, 0.0), pixels=(12, 12))
    # 0.25 m from the mirror, 0.2 m behind the splitter
    ccd = replace(instrument.ccd, centre=np.array([0.0, 0.0, 0.2]), focus=0.0)
    _, reference = arms(ft.trace(instrument.scene, instrument.beam, ccd))
    x, _ = positions(reference)
    at_millimetre = reference.length + (1 * mm - x) * math.sin(4e-3)
    assert np.ptp(at_millimetre) / HENE < WAVES
    assert at_millimetre[0] == pytest.approx(0.350001999992, abs=5e-13)


def test_a_tilt_in_any_direction_raises_the_path_along_it():
    tilt = (1.1e-3, -0.7e-3)
    _, reference = arms(bench(reference_tilt=tilt).trace())
    x, y = positions(reference)
    angle = math.hypot(*tilt)
    along = (tilt[0] * x + tilt[1] * y) / angle
    assert np.ptp(reference.length - along * math.sin(2 * angle)) / HENE < WAVES


@pytest.mark.parametrize(
    ("tilt", "period"), [(0.5e-3, 632.800105 * um), (2e-3, 158.200422 * um), (20e-3, 15.824219 * um)]
)
def test_fringes_are_as_far_apart_as_the_turned_wave_says(tilt, period):
    columns = 64
    instrument = bench(reference_tilt=(tilt, 0.0), aperture=columns * period / 8, pixels=(1, columns))
    sample, reference = instrument.fields(HENE)
    turns = np.unwrap(np.angle(reference[0] / sample[0])) / (2 * math.pi)
    assert turns[-1] - turns[0] == pytest.approx((columns - 1) / 8, rel=1e-7)  # the table's digits


@pytest.mark.parametrize(
    ("rise", "irradiance"),
    [(50 * nm, 3.092495955), (79.1 * nm, 2.0), (100 * nm, 1.193547411), (158.2 * nm, 0.0)],
)
def test_a_step_has_the_irradiance_of_its_phase(rise, irradiance):
    """4 pi h / lambda; the table is for two beams of irradiance 1, here each brings 1/4."""
    image = bench(step(2 * APERTURE, 2 * APERTURE, 1.03 * mm, rise)).interferogram(HENE)
    edge = int((APERTURE / 2 + 1.03 * mm) / (APERTURE / 32))
    np.testing.assert_allclose(image[:, :edge], 1.0, rtol=0, atol=IRRADIANCE)
    # the table has 9 decimals
    np.testing.assert_allclose(image[:, edge + 1 :], irradiance / 4, rtol=0, atol=IRRADIANCE + 0.5e-9)


def test_a_piston_scan_is_a_squared_cosine():
    for piston in np.linspace(-1.0, 1.0, 9) * HENE:
        image = bench(piston=float(piston), pixels=(2, 2)).interferogram(HENE)
        expected = math.cos(2 * math.pi * piston / HENE) ** 2
        np.testing.assert_allclose(image, expected, rtol=0, atol=IRRADIANCE)


@pytest.mark.parametrize("steps", [3, 4, 7])
def test_phase_steps_are_those_of_a_moved_mirror(steps):
    """A step of delta is a piston of delta lambda / (4 pi)."""
    sample = plate(2 * APERTURE, 2 * APERTURE).moved(turn=ft.vectors.rotation((0, 1, 0), -3e-4))
    frames = bench(sample).phase_steps(HENE, steps)
    for number, frame in enumerate(frames):
        moved = bench(sample, piston=HENE * number / (2 * steps)).interferogram(HENE)
        np.testing.assert_allclose(frame, moved, rtol=0, atol=IRRADIANCE)


@pytest.mark.filterwarnings("ignore:fringes alias")  # the law holds for any fringes
def test_what_one_port_lacks_goes_out_of_the_other():
    """cos^2 and sin^2 of half the phase: r a quarter wave from t."""
    sample = height_map(*bumps(3 * HENE)[:2])
    # rays share out what comes in; waves off facets overlap where these meet, by 1e-5 of a pixel
    instrument = bench(sample, reference_tilt=(2e-4, 1e-4), method="rays")
    arm = float(instrument.ccd.centre[2])
    x, y, _ = np.eye(3)
    # behind the source, focused on what the splitter shows of the sample there
    back = replace(instrument.ccd, centre=-2 * arm * x, normal=x, up=y, focus=3 * arm)
    returned = replace(instrument, ccd=back).interferogram(HENE)
    total = instrument.interferogram(HENE) + returned[:, ::-1]
    np.testing.assert_allclose(total, 1.0, rtol=0, atol=IRRADIANCE)
    assert returned.max() > 0.9


def test_power_adds_up():
    lossy = ft.BeamSplitter(reflection=0.6j, transmission=0.7)
    for splitter, mirror in ((ft.BeamSplitter(), ft.Mirror()), (lossy, ft.Mirror(0.9))):
        ledger = bench(splitter=splitter, mirror=mirror, reference_tilt=(1e-3, 0.0)).trace().ledger()
        assert ledger.error < 1e-12
        assert ledger.incident == pytest.approx(APERTURE * APERTURE * 24 / 32)
        assert (ledger.absorbed > 1e-3 * ledger.incident) == (mirror.reflectance < 1)
    # both arms cross the splitter once and are reflected once: r^2 t^2 each, whatever the mirror does
    assert ledger.detected == pytest.approx(0.42**2 * (1 + 0.9) * ledger.incident, rel=2e-3)


def dirichlet(turns, count):
    """Mean of exp(2 pi i turns s) over `count` equidistant s in a unit pixel, about its middle."""
    return math.sin(math.pi * turns) / (count * math.sin(math.pi * turns / count))


@pytest.mark.parametrize("count", [1, 4, 9])
@pytest.mark.filterwarnings("ignore:fringes alias")
def test_many_rays_in_a_pixel_sum_to_the_mean_of_the_wave(count):
    """The ray sum is |mean E|^2: the tilted wave fades as the (discrete) sinc, the other does not."""
    tilt, pitch = 20e-3, 8 * um
    instrument = bench(
        reference_tilt=(tilt, 0.0), aperture=16 * pitch, pixels=(3, 16), rays=count, method="rays"
    )
    sample, reference = instrument.fields(HENE)
    faded = dirichlet(pitch * math.sin(2 * tilt) / HENE, count)
    middle = slice(2, -2)  # the tilted beam walks off the rim of the image
    np.testing.assert_allclose(np.abs(sample), 0.5, rtol=0, atol=IRRADIANCE)
    np.testing.assert_allclose(np.abs(reference[:, middle]), 0.5 * faded, rtol=0, atol=IRRADIANCE)
    frames = instrument.phase_steps(HENE, 4)[:, :, middle]
    visibility = ft.phase.modulation(frames)
    np.testing.assert_allclose(visibility, 2 * faded / (1 + faded**2), rtol=0, atol=4 * IRRADIANCE)


@pytest.mark.parametrize(("pitch", "visibility"), [(8 * um, 0.62952984), (3.45 * um, 0.92362532)])
@pytest.mark.filterwarnings("ignore:fringes alias")
def test_a_pixel_that_averages_irradiance_sees_the_sinc(pitch, visibility):
    """mean |E|^2 over a box."""
    tilt = 20e-3
    frames = bench(reference_tilt=(tilt, 0.0), aperture=8 * pitch, pixels=(3, 8)).phase_steps(HENE, 4)
    # the tilted beam brings less light to a pixel
    bright = math.cos(2 * tilt)
    expected = 2 * math.sqrt(bright) / (1 + bright) * visibility
    middle = (1, slice(2, -2))  # the tilted beam walks off the rim of the image
    np.testing.assert_allclose(ft.phase.modulation(frames)[middle], expected, rtol=3e-6)


def test_beams_of_unequal_power_lose_visibility():
    """I1 : I2 = 1 : 0.25 has the visibility 0.8."""
    frames = bench(mirror=ft.Mirror(0.25), piston=0.1 * HENE).phase_steps(HENE, 4)
    np.testing.assert_allclose(ft.phase.modulation(frames), 0.8, rtol=0, atol=4 * IRRADIANCE)


def test_a_gaussian_beam_is_brightest_at_the_centre():
    waist = 2 * mm
    image = bench(profile=ft.Gaussian(waist), method="rays").interferogram(HENE)
    pitch = APERTURE / 32
    x, y = (np.arange(32) - 15.5) * pitch, (np.arange(24) - 11.5) * pitch
    expected = np.exp(-2 * (x[None, :] ** 2 + y[:, None] ** 2) / waist**2)
    np.testing.assert_allclose(image, expected, rtol=0, atol=IRRADIANCE)
    # over a pixel: erf; the profile is interpolated between rays, (h / w)^4 / 384 times 12
    sides = [(np.arange(n + 1) - n / 2) * pitch * math.sqrt(2) / waist for n in (24, 32)]
    means = [np.diff(erf(side)) * math.sqrt(math.pi) / 2 / (side[1] - side[0]) for side in sides]
    image = bench(profile=ft.Gaussian(waist)).interferogram(HENE)
    np.testing.assert_allclose(image, np.outer(*means), rtol=0, atol=1e-5)


def bumps(height, size=96):
    """Smooth heights of some waves over the aperture: z, pitch."""
    pitch = 1.1 * APERTURE / (size - 1)
    at = (np.arange(size) - (size - 1) / 2) * pitch
    x, y = np.meshgrid(at, at)
    z = sum(
        high * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * wide**2))
        for u, v, wide, high in ((-0.8 * mm, 0.5 * mm, 0.9 * mm, 1.0), (1.1 * mm, -0.9 * mm, 0.7 * mm, -0.6))
    )
    return height * z, pitch


@pytest.mark.parametrize("rays", [1, 2])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (4e-4, -2e-4)])
def test_a_height_map_comes_back(rays, tilt):
    """Height map -> mesh -> interferogram -> height, within lambda/1000 rms."""
    mesh = height_map(*bumps(3 * HENE))
    instrument = bench(mesh, pixels=(150, 200), rays=rays, reference_tilt=tilt)
    found = instrument.height(HENE)
    pitch = APERTURE / 200
    x, y = (np.arange(200) - 99.5) * pitch, (np.arange(150) - 74.5) * pitch
    truth = interpolate_height(mesh, x[None, :], y[:, None])
    difference = found - truth
    assert np.isfinite(difference).all()
    assert np.ptp(truth) > 3 * HENE
    assert np.std(difference) < HENE / 1000


def test_height_is_positive_towards_the_light_and_not_mirrored():
    z, pitch = bumps(0.1 * HENE)
    found = bench(height_map(z, pitch), reference_tilt=(3e-4, 1e-4)).height(HENE)
    row, column = np.unravel_index(np.argmax(found), found.shape)
    assert row == pytest.approx((APERTURE * 24 / 32 / 2 + 0.5 * mm) / (APERTURE / 32), abs=1)
    assert column == pytest.approx((APERTURE / 2 - 0.8 * mm) / (APERTURE / 32), abs=1)


def test_beside_the_sample_there_is_the_reference_alone():
    instrument = bench(plate(APERTURE / 2, APERTURE), reference_tilt=(1e-4, 0.0))
    image, height = instrument.interferogram(HENE), instrument.height(HENE)
    np.testing.assert_allclose(image[:, [0, 7, 24, 31]], 0.25, rtol=0, atol=IRRADIANCE)
    assert np.isnan(height[:, :8]).all()
    assert np.isnan(height[:, 24:]).all()
    inside = height[:, 8:24]
    np.testing.assert_allclose(inside, inside.mean(), rtol=0, atol=HENE * 1e-6)


def test_wavelengths_share_one_trace():
    instrument = bench(step(2 * APERTURE, 2 * APERTURE, 0.1 * mm, 60 * nm))
    paths = instrument.trace()
    for wavelength in (450 * nm, 532 * nm, HENE):
        image = instrument.interferogram(wavelength)
        np.testing.assert_allclose(
            image[:, 20:], math.cos(2 * math.pi * 60 * nm / wavelength) ** 2, rtol=0, atol=2e-8
        )
    assert instrument.trace() is paths


def test_a_slope_above_the_focus_has_the_retrace_error():
    """The wave off the plane z = s x + h, seen at z = 0, gives h (1 - s^2) on the axis."""
    slope, high = 0.02, 5 * um
    angle = math.atan(slope)
    turn = ft.vectors.rotation((0, 1, 0), -angle)
    sample = plate(2 * mm, 2 * mm).moved((0, 0, high), turn)
    instrument = bench(sample, aperture=60 * um, pixels=(8, 64))
    paths, _ = arms(instrument.trace())
    x, _ = positions(paths)
    # a turn by 2a about the line in which the plane meets z = 0
    lead = (x + high / slope) * math.sin(2 * angle)
    there_and_back = instrument.ccd.focus
    assert np.abs(paths.length - (there_and_back - lead)).max() / HENE < WAVES
    at_axis = 0.5 * high / slope * math.sin(2 * angle)
    assert at_axis == pytest.approx(high * (1 - slope**2), rel=1.1 * slope**4)
