"""The goniometer: axes, power, methods, phases, and what it refuses."""

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import degree, nm, um
from fringetrace.core.warnings import FringetraceWarning
from fringetrace.optics.films import fresnel
from fringetrace.scattering import goniometer
from fringetrace.scattering.detectors import Cells, Cones, Pixels
from fringetrace.scattering.goniometer import amplitudes, brdf, reciprocity
from fringetrace.scattering.rod_lattice import RodLattice

WAVES = np.array([400, 500, 650]) * nm
THETA = np.array([-20, 0, 20]) * degree
POWERS = ("reflected", "transmitted", "missed", "absorbed", "truncated")


@pytest.fixture(scope="module")
def rods():
    return RodLattice(5, 3, reflectance=0.9).scene


def mirror():
    return ft.Scene([ft.Surface(ft.shapes.plate(20 * um, 20 * um), ft.Mirror())])


def test_axes_and_power(rods):
    table = brdf(rods, (THETA, [0.0, 0.5]), Cones(THETA, 1 * degree, [0.0]), WAVES, rays=(2, 500))
    assert table.dims == goniometer.AXES
    assert table.shape == (3, 2, 3, 1, 3)
    assert table.attrs["units"] == "1/sr"
    assert np.array_equal(table.wavelength, WAVES)
    assert sum(table[name] for name in POWERS).values == pytest.approx(1.0, abs=1e-12)
    assert (table.absorbed > 0.0).all()
    assert (table.ray_count.values.sum(axis=(2, 3)) > 0).any()


def test_a_hemisphere_holds_what_was_reflected(rods):
    """Summed over all cells, powers are what left upwards: to rounding of 8000 terms."""
    table = brdf(rods, (THETA, 0.3), Cells(9, 12), WAVES, method="power", rays=(40, 200))
    collected = table.collected.values
    assert collected == pytest.approx(np.repeat(table.reflected.values[..., None], 3, axis=2), rel=1e-12)
    assert (collected > 0.2).all()


def test_threads_do_not_change_a_bit(rods):
    one, two = (brdf(rods, THETA, Cones(THETA, 0.02), WAVES, rays=(1, 300), threads=n) for n in (1, 2))
    assert one.values.tobytes() == two.values.tobytes()


def test_chunks_add_up(rods, monkeypatch):
    whole = brdf(rods, THETA, Cones(THETA, 0.02), WAVES, rays=(1, 300))
    monkeypatch.setattr("fringetrace.scattering.far_fields.CHUNK", 70)
    parts = brdf(rods, THETA, Cones(THETA, 0.02), WAVES, rays=(1, 300))
    assert parts.values == pytest.approx(whole.values, rel=1e-10, abs=1e-10 * whole.values.max())
    assert parts.reflected.values == pytest.approx(whole.reflected.values, rel=1e-12)


def test_phases_are_those_of_planes_through_the_centre():
    """Of a mirror h below it: the path is longer by h (cos i + cos o), and each reflection is a -1."""
    for height in (0.0, 70 * nm):
        sums = amplitudes(
            mirror(), -20 * degree, Cones([20 * degree], 0.01), WAVES, centre=(0, 0, height), rays=(4, 4)
        )
        area = 400 * um * um * np.cos(20 * degree)
        truth = -area * np.exp(2j * np.pi / WAVES * 2.0 * height * np.cos(20 * degree))
        assert sums.values.ravel() == pytest.approx(truth, rel=1e-9)  # paths of 100 waves, to eps each
    without = amplitudes(
        mirror(), -20 * degree, Cones([20 * degree], 0.01), WAVES, half_wave_loss=False, rays=(4, 4)
    )
    assert without.values.ravel() == pytest.approx(area, rel=1e-9)


def test_few_reflections(rods):
    looks = Cones(THETA, 0.02)
    every, once, none = (
        brdf(rods, 20 * degree, looks, WAVES, method="power", rays=(1, 800), max_reflections=most)
        for most in (None, 1, 0)
    )
    assert (once <= every).all()
    assert once.sum() < every.sum()
    assert not none.any()


def test_a_pixel_of_its_own_size():
    """A beam that fills the pixel: its mean field is 1."""
    looks = Pixels([20 * degree], 1.0, 10 * um)
    side = 10 * um

    def source(theta, phi):
        axis = np.array([np.sin(theta), 0.0, np.cos(theta)])
        return ft.Beam(1e-3 * axis, -axis, (0, 1, 0), (side, side), (4, 4))

    table = brdf(mirror(), -20 * degree, looks, WAVES, source=source)
    assert table.values.ravel() == pytest.approx(1.0 / (side**2 * np.cos(20 * degree)), rel=1e-9)
    power = brdf(mirror(), -20 * degree, looks, WAVES, source=source, method="power")
    assert power.values == pytest.approx(table.values, rel=1e-9)


def test_coarse_rays_are_a_grating():
    with pytest.warns(FringetraceWarning, match=r"rays are 2e-06 m apart.* less than half of .* 4e-07 m"):
        brdf(mirror(), 0.0, Cones(THETA, 0.01), WAVES, method="diffraction", rays=(1, 10))


def test_progress_is_told(rods):
    said = []
    brdf(rods, THETA, Cones(THETA, 0.02), WAVES, rays=(1, 9), progress=lambda *counts: said.append(counts))
    assert said == [(1, 3), (2, 3), (3, 3)]


def test_reciprocity_of_nothing_is_whole(rods):
    table = brdf(rods, THETA, Cones(THETA, 1e-6), WAVES, rays=(1, 9), max_reflections=0)
    assert reciprocity(table) == 0.0


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"method": "waves"}, "method: expected one of rays, diffraction, power, got 'waves'"),
        ({"method": "diffraction", "detector": Pixels([0.0], 1.0, 1.0)}, "'rays' or 'power' with Pixels"),
        ({"incidence": 1.6}, "incidence theta: expected angles below 1.5708 rad, got up to 1.6"),
        ({"incidence": (0.0, np.inf)}, "incidence phi: expected finite angles"),
        ({"wavelengths": [0.0]}, "wavelength: expected a positive length"),
        ({"aperture": (1.0, -1.0)}, "goniometer aperture: expected a positive length in metres, got -1"),
        ({"rays": (0, 5)}, r"goniometer rays: expected two whole numbers from 1, got \(0, 5\)"),
        ({"reciprocal": True}, "reciprocity: expected the same angles on both sides, got 1 x 1 incidences"),
    ],
)
def test_what_is_refused(changed, message):
    given = {"incidence": 0.0, "detector": Cones(THETA, 0.01), "wavelengths": WAVES} | changed
    with pytest.raises(ValueError, match=message):
        brdf(mirror(), given.pop("incidence"), given.pop("detector"), given.pop("wavelengths"), **given)


def test_reciprocity_needs_a_square_table():
    table = brdf(mirror(), 0.0, Cones(THETA, 0.01), WAVES, rays=(2, 2))
    with pytest.raises(ValueError, match="reciprocity: expected the same angles on both sides, got shape"):
        reciprocity(table)


def test_glass_in_a_medium():
    """A dispersive face in water, straight on: Fresnel's |r|^2 at each wavelength, n h of path to it."""
    glass, water, height = ft.materials.named("N-BK7"), ft.materials.named("water"), 1 * um
    sheet = ft.shapes.plate(20 * um, 20 * um)
    scene = ft.Scene([ft.Surface(sheet, ft.Dielectric(), back=glass)], medium=water)
    given = {"wavelengths": WAVES, "rays": (2, 2)}
    power = brdf(scene, 0.0, Cones([0.0], 0.01), method="power", **given)
    n, m = (medium.index(WAVES).real for medium in (water, glass))
    r = (n - m) / (n + m)
    assert power.values.ravel() * np.pi * np.sin(0.01) ** 2 == pytest.approx(r**2, rel=1e-12)
    assert power.transmitted.item() == pytest.approx(1.0 - np.mean(r**2), rel=1e-12)
    sums = amplitudes(scene, 0.0, Cones([0.0], 0.01), centre=(0, 0, height), **given)
    truth = 400 * um * um * r * np.exp(4j * np.pi / WAVES * n * height)
    assert sums.values.ravel() == pytest.approx(truth, rel=1e-9)


GOLD = 0.18344 + 3.4332j
FACES = {"glass": (ft.Dielectric(), 1.5168), "gold": (ft.Metal(), GOLD)}


def face(name):
    interface, index = FACES[name]
    return ft.Scene([ft.Surface(ft.shapes.plate(20 * um, 20 * um), interface, back=index)])


@pytest.mark.parametrize("phi", [0.0, 0.7])
@pytest.mark.parametrize("name", FACES)
def test_flat_plates_reflect_s_and_p_as_fresnel_says(name, phi):
    """By power; in the amplitudes, too, s stays s and p stays p, with their phases."""
    theta = 56.0 * degree
    looks = Cones([-theta], 0.01, [phi])
    given = {"wavelengths": WAVES[:1], "rays": (2, 2), "centre": (0, 0, 0)}
    r = fresnel(1.0, FACES[name][1], theta)
    unit = np.cos(theta) * np.pi * np.sin(0.01) ** 2
    parts = {"s": abs(r.rs) ** 2, "p": abs(r.rp) ** 2}
    parts["unpolarised"] = 0.5 * (parts["s"] + parts["p"])
    for polarisation, true in parts.items():
        table = brdf(face(name), (theta, phi), looks, method="power", polarisation=polarisation, **given)
        assert table.values.item() * unit == pytest.approx(true, rel=1e-11)
        assert table.reflected.item() == pytest.approx(true, rel=1e-11)
        assert table.power_unaccounted < 1e-12
    sums = [amplitudes(face(name), (theta, phi), looks, polarisation=one, **given) for one in ("s", "p")]
    assert sums[0].dims == (*goniometer.AXES[:4], "polarisation", "wavelength")
    area = 400 * um * um * np.cos(theta)
    found = np.array([one.values.ravel() for one in sums]) / area
    assert found == pytest.approx(np.diag([r.rs, r.rp]), abs=1e-9)


def test_a_jones_vector_an_incidence():
    """Amplitudes add before they are squared, powers do not; each incidence has its own."""
    theta = np.array([20.0, 56.0]) * degree
    jones = np.array([[[0.6, 0.8j]], [[1.0, -1.0]]])
    table = brdf(
        face("gold"), theta, Cones(-theta, 0.01), WAVES[:1], method="power", rays=(2, 2), polarisation=jones
    )
    r = fresnel(1.0, GOLD, theta)
    s, p = (np.array([0.36, 0.5]) * abs(r.rs) ** 2, np.array([0.64, 0.5]) * abs(r.rp) ** 2)
    assert table.reflected.values[:, 0] == pytest.approx(s + p, rel=1e-11)
    straight = brdf(face("glass"), 0.0, Cones([0.0], 0.01), WAVES, rays=(2, 2), polarisation=(1, 1j))
    scalar = brdf(face("glass"), 0.0, Cones([0.0], 0.01), WAVES, rays=(2, 2))
    assert straight.values == pytest.approx(scalar.values, rel=1e-11)


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_a_plane_of_rods_keeps_s_and_p():
    """Along rods s is along every boundary: what light of one number a ray is."""
    glass = RodLattice(3, 2, rod=1.6, host=1.4)
    given = {"rays": (1, 60), "min_amplitude": 1e-2, "max_bounces": 6, **glass.lighting}
    looks = Cones(THETA, 5 * degree)
    scalar, s, p = (
        brdf(glass.scene, THETA, looks, WAVES, polarisation=one, **given) for one in (None, "s", "p")
    )
    assert s.values == pytest.approx(scalar.values, rel=1e-9, abs=1e-12 * scalar.values.max())
    assert abs(p - s).max() > 0.1 * s.max()


def test_polarised_pixels():
    """All of a mirror's light falls on one pixel, whatever its polarisation."""
    looks = Pixels([20 * degree], 1e-3, 100 * um)
    one, other = (
        brdf(mirror(), -20 * degree, looks, WAVES, rays=(2, 2), polarisation=which) for which in (None, "p")
    )
    assert other.values == pytest.approx(one.values, rel=1e-9)


def test_a_source_brings_its_own_polarisation():
    def source(theta, phi):
        return ft.Beam((0, 0, 1e-4), (0, 0, -1), (0, 1, 0), (1e-5, 1e-5), (2, 2), polarisation=(1, 0))

    looks = Cones([0.0], 0.01)
    table = brdf(mirror(), 0.0, looks, WAVES, source=source, method="power")
    assert table.values.ravel() * np.pi * np.sin(0.01) ** 2 == pytest.approx(1.0, rel=1e-12)
    with pytest.raises(ValueError, match="expected none beside a source, which has its own"):
        brdf(mirror(), 0.0, looks, WAVES, source=source, polarisation="s")


@pytest.mark.parametrize(
    ("polarisation", "message"),
    [
        ("E", "goniometer polarisation: expected s, p, unpolarised or amplitudes, got 'E'"),
        ((1, 0, 0), r"expected amplitudes of s and p of shape \(2,\) or \(1, 1, 2\), got \(3,\)"),
        ((0, 0), "expected finite amplitudes, not both 0, got others"),
        ((np.nan, 1), "expected finite amplitudes, not both 0, got others"),
    ],
)
def test_polarisations_that_are_none(polarisation, message):
    with pytest.raises(ValueError, match=message):
        brdf(mirror(), 0.0, Cones([0.0], 0.01), WAVES, polarisation=polarisation)


def test_polarised_tables_are_not_filled_in():
    with pytest.raises(ValueError, match="reciprocity: expected light without polarisation, got 's'"):
        brdf(mirror(), [0.0], Cones([0.0], 0.01), WAVES, polarisation="s", reciprocal=True)
    with pytest.raises(ValueError, match="expected one state of light, got 'unpolarised'"):
        amplitudes(mirror(), 0.0, Cones([0.0], 0.01), WAVES, polarisation="unpolarised")


def test_half_the_rays_tell_what_the_rays_cost(rods):
    """Powers of a few hundred rays beside those of many: the estimate is no less than half the true error."""
    given = {"method": "power", "polarisation": None}
    detector = Cells(6, 8)
    truth = brdf(rods, THETA, detector, WAVES, rays=(1, 12000), **given).isel(theta_i=1, phi_i=0)
    for count in (60, 200):
        table = brdf(rods, THETA, detector, WAVES, rays=(1, count), **given)
        told = goniometer.brdf_sampling_error(table, rods, detector, rays=(1, count), **given)
        off = table.isel(theta_i=1, phi_i=0) - truth
        true = float(np.sqrt((off**2).mean() / (truth**2).mean()))
        assert 0.5 * true < told < 10.0 * true
    flat = brdf(mirror(), THETA, Cones(THETA, 0.02), WAVES, rays=(4, 4))
    assert goniometer.brdf_sampling_error(flat, mirror(), Cones(THETA, 0.02), rays=(4, 4)) < 1e-12
    nothing = Cones(THETA + 1.0, 0.02)  # no light goes there
    dark = brdf(mirror(), THETA, nothing, WAVES, rays=(4, 4))
    assert goniometer.brdf_sampling_error(dark, mirror(), nothing, rays=(4, 4)) == 0.0


def test_rounding_of_what_leaves_is_known_in_waves(rods):
    """Some roundings of micrometres, in waves: as many more of a shorter one."""
    long, short = (goniometer.rounding_error(rods, 0.2, wave) for wave in (600 * nm, 300 * nm))
    assert short == pytest.approx(2 * long, rel=1e-9)
    assert 1e-17 < long < 1e-12
    away = goniometer.rounding_error(
        mirror(), 0.2, 600 * nm, centre=(1.0, 0.0, 0.0), aperture=(3 * um, 3 * um)
    )
    assert away == 0.0  # all light misses it
