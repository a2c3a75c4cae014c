"""Benches of thin elements, traced: spots, orders, and polarised beams that part and meet again."""

import numpy as np
import pytest
from meetings import EPS

import fringetrace as ft
from fringetrace.field import chosen
from fringetrace.optics.birefringent import ShearPlate, Wollaston
from fringetrace.optics.elements import Annulus, IdealLens
from fringetrace.optics.gratings import Grating, lamellar
from fringetrace.optics.phase_plates import PhasePlate, zone_plate
from fringetrace.optics.polarisers import JonesPlate, Polariser, wave_plate

# Points and paths of a few roundings of the bench's length, and directions, times the bench's length.
PLACE = 64 * EPS
# Printed with so many digits after the point.
NINE = 0.5e-9
POWER = 1e-12

LAMBDA = 589.3e-9
CALCITE = (1.6584, 1.4864)
X, Y, Z, DIAGONAL = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 0.0)
mm = ft.mm


def standing(element, z, name, size=40 * mm):
    """A square surface across the z axis, its front towards -z, where light comes from."""
    return ft.Surface(
        ft.shapes.plate(size, size).moved((0, 0, z), ft.vectors.rotation(X, np.pi)), element, name
    )


def camera(z, pitch=1 * mm, shape=(40, 40), centre=(0.0, 0.0)):
    return ft.CCD((*centre, z), (0, 0, -1), Y, pitch, shape)


def beam(size=0.2 * mm, shape=(4, 4), **options):
    """Along +z from z = -10 mm, its columns along -x and its rows along y."""
    return ft.Beam((0, 0, -10 * mm), Z, Y, (size, size), shape, **options)


def fan(source, count, half=8 * mm, z=0.0):
    """Rays from a point that fill a square of a plane."""
    line = np.linspace(-half, half, count)
    goal = np.stack([*np.meshgrid(line, line), np.full((count, count), z)], axis=-1).reshape(-1, 3)
    return ft.Rays(np.tile(source, (len(goal), 1)), goal - source)


@pytest.mark.parametrize("off", [(0.0, 0.0), (4 * mm, -3 * mm)])
def test_an_ideal_lens_makes_a_spot_of_equal_paths(off):
    lens = standing(IdealLens((0, 0, 0), Z, 60 * mm, 100 * mm), 0.0, "lens")
    source = np.array([*off, -100 * mm])
    paths = ft.trace(ft.Scene([lens]), fan(source, 20), camera(150 * mm))
    assert len(paths.detected) == 400
    image = np.array([*(-1.5 * np.array(off)), 150 * mm])
    assert np.abs(paths.origin - image).max() < 0.25 * PLACE
    assert np.abs(paths.length - np.linalg.norm(source) - np.linalg.norm(image)).max() < 0.25 * PLACE
    assert paths.ledger().error < POWER


def test_a_zone_plate_focuses_in_its_orders():
    plate = standing(zone_plate((0, 0, 0), Z, 50 * mm, design=LAMBDA, orders=(1, 2)), 0.0, "plate")
    source = beam(8 * mm, (16, 16))
    paths = ft.trace(ft.Scene([plate]), source, camera(50 * mm), wavelength=LAMBDA)
    seen = paths.detected
    # all light is in order 1: the other branch carries nothing
    assert len(seen) == 256
    assert np.abs(seen.origin[:, :2]).max() < 0.1 * PLACE
    assert np.abs(seen.length - 60 * mm).max() < 0.1 * PLACE
    red = ft.trace(ft.Scene([plate]), source, camera(25 * mm), wavelength=1.1 * LAMBDA)
    assert red.ledger().error < POWER
    power = np.abs(red.amplitude) ** 2
    shares = np.sinc(1 / 1.1 - 1.0) ** 2, np.sinc(1 / 1.1 - 2.0) ** 2
    for digit, share in zip(np.unique(red.key), shares, strict=True):
        assert power[red.key == digit] == pytest.approx(np.full(256, share), rel=POWER)


@pytest.mark.parametrize("reflects", [False, True])
def test_grating_orders_fall_where_the_grating_equation_says(reflects):
    orders = (-1, 0, 1, 2)
    grating = Grating(X, 10e-6, orders, lamellar(orders, 2.0, 0.3), reflects=reflects)
    ccd = ft.CCD((0, 0, -5 * mm), Z, Y, 0.1 * mm, (40, 40)) if reflects else camera(50 * mm, 0.5 * mm)
    paths = ft.trace(ft.Scene([standing(grating, 0.0, "grating")]), beam(), ccd, wavelength=LAMBDA)
    seen = paths.detected
    reach = 5 * mm if reflects else 50 * mm
    assert len(seen) == 16 * len(orders)
    start = np.repeat(np.linspace(0.075, -0.075, 4) * mm, len(orders)).reshape(4, -1)
    kinds = np.unique(seen.key)
    found = []
    for kind in kinds:
        some = seen.where(seen.key == kind)
        x0 = np.tile(start[:, 0], 4)
        sine = np.mean((some.origin[:, 0] - x0) / np.hypot(some.origin[:, 0] - x0, reach))
        m = round(sine * 10e-6 / LAMBDA)
        found.append(m)
        assert sine == pytest.approx(m * LAMBDA / 10e-6, abs=PLACE)
        efficiency = abs(lamellar((m,), 2.0, 0.3)[0]) ** 2
        assert np.abs(some.amplitude) ** 2 == pytest.approx(np.full(16, efficiency), rel=POWER)
        # a plane wave: path = path of the ray through the centre + its slope along x
        level = some.length - some.origin[:, 0] * sine
        assert np.ptp(level) < 0.1 * PLACE
    assert sorted(found) == list(orders)
    assert paths.ledger().error < POWER
    # what the four orders do not get is absorbed
    rest = 1.0 - sum(abs(a) ** 2 for a in lamellar(orders, 2.0, 0.3))
    ledger = paths.ledger()
    assert ledger.absorbed / ledger.incident == pytest.approx(rest, rel=POWER)


@pytest.mark.parametrize(("f", "expected"), [(100 * mm, 4.0), (-100 * mm, 4.0 / 9.0)])
@pytest.mark.parametrize("kind", ["lens", "plate"])
def test_light_behind_a_lens_is_as_dense_as_its_rays(kind, f, expected):
    # half way to the focus a beam is half as wide; exactly, for slopes that grow with the offset
    lens = IdealLens((0, 0, 0), Z, f) if kind == "lens" else zone_plate((0, 0, 0), Z, f)
    ccd = camera(50 * mm, 0.02 * mm, (8, 8))
    paths = ft.trace(ft.Scene([standing(lens, 0.0, "lens")]), beam(4 * mm, (64, 64)), ccd)
    image = ft.irradiance(paths, LAMBDA)
    # a zone plate's sine (against the tangent) is off by 3/2 (r / f)^2, and rays lean by as much
    assert image == pytest.approx(np.full((8, 8), expected), rel=1e-10 if kind == "lens" else 1e-5)


def test_polarised_beams_part_and_meet_again_as_wavefronts():
    image = ft.irradiance(jamin_lebedeff(None, DIAGONAL), LAMBDA, method="wavefront")
    # paths of 20 mm to a rounding of each of some ten steps
    assert image == pytest.approx(np.ones((4, 4)), abs=2.0 * np.pi * 16 * EPS * 20 * mm / LAMBDA)


def test_behind_pixels_and_stops_light_is_a_sum_of_rays():
    stop = standing(Annulus((0, 0, 0), 1 * mm, 2 * mm), 0.0, "stop")
    paths = ft.trace(ft.Scene([stop]), beam(5 * mm, (50, 50)), camera(5 * mm, 0.1 * mm, (50, 50)))
    assert chosen(paths, "auto") == "rays"
    image = ft.irradiance(paths, LAMBDA)
    assert set(np.round(image, 12).ravel()) == {0.0, 1.0}
    with pytest.raises(ValueError, match="method: expected 'rays' behind stop, which tears wavefronts, got"):
        ft.irradiance(paths, LAMBDA, method="wavefront")


def jamin_lebedeff(delta, analyser, extra=()):
    """Two calcite plates with a half-wave plate between, and a sample, or none, for one of the beams."""
    plate = ShearPlate((1, 0, 1), 5 * mm, *CALCITE)
    opd = (delta or 0.0) * LAMBDA / (2.0 * np.pi)
    # the extraordinary beam is half a millimetre to the left
    sample = PhasePlate([[opd, 0.0]], (-0.25 * mm, 0, 0), X, Y, pitch=20 * mm, interpolation="nearest")
    surfaces = [
        standing(plate, 0.0, "first"),
        standing(wave_plate(DIAGONAL, 0.5), 2 * mm, "half-wave"),
        *([] if delta is None else [standing(sample, 4 * mm, "sample")]),
        standing(plate, 6 * mm, "second"),
        *extra,
        standing(Polariser(analyser), 10 * mm, "analyser"),
    ]
    ccd = camera(12 * mm, 0.05 * mm, (4, 4), centre=(-0.5 * 1.0906068314 * mm, 0.0))
    return ft.trace(ft.Scene(surfaces), beam(polarisation=(-1, 1)), ccd, wavelength=LAMBDA)


@pytest.mark.parametrize(
    ("delta", "parallel", "crossed"),
    [(0.5, 0.938791281, 0.061208719), (1.0, 0.770151153, 0.229848847), (2.0, 0.291926582, 0.708073418)],
)
def test_jamin_lebedeff(delta, parallel, crossed):
    for analyser, printed in ((DIAGONAL, parallel), ((1, -1, 0), crossed)):
        paths = jamin_lebedeff(delta, analyser)
        image = ft.irradiance(paths, LAMBDA, method="rays")
        assert image == pytest.approx(np.full((4, 4), printed), abs=NINE)
        assert paths.ledger().error < POWER


@pytest.mark.parametrize("delta", [0.5, 2.0])
def test_senarmont_turns_the_analyser_until_it_is_dark(delta):
    quarter = (standing(wave_plate(DIAGONAL, 0.25), 8 * mm, "quarter-wave"),)
    psi = 0.75 * np.pi + 0.5 * delta  # the delayed beam, turned by the half-wave plate, lies along y
    dark = jamin_lebedeff(delta, (np.cos(psi), np.sin(psi), 0.0), quarter)
    # paths of 20 mm to a rounding of each of some ten steps
    phase = 2.0 * np.pi * 16 * EPS * 20 * mm / LAMBDA
    assert ft.irradiance(dark, LAMBDA, method="rays").max() < phase**2
    bright = jamin_lebedeff(delta, (-np.sin(psi), np.cos(psi), 0.0), quarter)
    assert ft.irradiance(bright, LAMBDA, method="rays") == pytest.approx(np.ones((4, 4)), abs=phase)


@pytest.mark.parametrize(
    ("wavelength", "leak"),
    [(450e-9, 0.116977778), (500e-9, 0.024471742), (600e-9, 0.017037087), (650e-9, 0.057271987)],
)
def test_a_half_wave_plate_between_polarisers_leaks(wavelength, leak):
    scene = ft.Scene([
        standing(Polariser(X), 0.0, "polariser"),
        standing(wave_plate(DIAGONAL, 0.5, design=550e-9), 1 * mm, "half-wave"),
        standing(Polariser(X), 2 * mm, "analyser"),
    ])  # fmt: skip
    ccd = camera(3 * mm, 0.05 * mm, (4, 4))
    paths = ft.trace(scene, beam(polarisation=(1, 0)), ccd, wavelength=wavelength)
    image = ft.irradiance(paths, wavelength, method="rays")
    assert image == pytest.approx(np.full((4, 4), leak), abs=NINE)


@pytest.mark.parametrize("back", [False, True])
def test_elements_know_their_front(back):
    # light travels along +z: into the plate's front if that is turned over
    turn = ft.vectors.rotation(X, np.pi) if back else None
    swap = ft.Surface(
        ft.shapes.plate(1 * mm, 1 * mm).moved(turn=turn), JonesPlate([[0, 0], [1, 0]], X), "swap"
    )
    paths = ft.trace(ft.Scene([swap]), beam(polarisation=(1, 0)), camera(3 * mm, 0.1 * mm))
    lit = np.abs(paths.detected.amplitude) if len(paths.detected) else np.zeros(1)
    assert lit.max() == pytest.approx(1.0 if back else 0.0, abs=PLACE)


def test_a_wollaston_prism_parts_two_spots():
    prism = Wollaston((0, 0, 0), X, np.radians(15.0), *CALCITE)
    scene = ft.Scene([standing(prism, 0.0, "prism")])
    source = ft.Rays([[0, 0, -1 * mm]], [Z], polarisation=np.array(DIAGONAL))
    seen = ft.trace(scene, source, camera(100 * mm)).detected
    angles = np.degrees(np.arctan(seen.origin[:, 0] / (100 * mm)))
    assert np.ptp(angles) == pytest.approx(5.284387, abs=0.5e-6)
    assert np.abs(seen.amplitude) ** 2 == pytest.approx([0.5, 0.5], rel=POWER)


def test_an_annular_stop_casts_a_ring():
    scene = ft.Scene([standing(Annulus((0, 0, 0), 1 * mm, 2 * mm), 0.0, "stop")])
    paths = ft.trace(scene, beam(5 * mm, (50, 50)), camera(5 * mm, 0.1 * mm, (50, 50)))
    radius = np.hypot(*paths.detected.origin[:, :2].T)
    line = (np.arange(50) - 24.5) * 0.1 * mm
    all_of = np.hypot(*np.meshgrid(line, line))
    assert len(radius) == ((all_of >= 1 * mm) & (all_of <= 2 * mm)).sum()
    assert paths.ledger().error < POWER
