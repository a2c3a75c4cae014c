"""The Michelson's layout: which ray lands where, what it is made of, and every refusal."""

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh

import fringetrace as ft
from fringetrace import instruments, mm, nm
from fringetrace.geometry.shapes import plate

HENE = 632.8 * nm
APERTURE = 6 * mm


def michelson(**options):
    options = {"sample": plate(8 * mm, 8 * mm), "aperture": APERTURE, "pixels": (6, 8), **options}
    return instruments.michelson(options.pop("sample"), **options)


def test_the_wavefront_does_with_few_rays():
    fine, coarse = (
        michelson(pixels=(64, 96), rays=rays, reference_tilt=(2e-4, 1e-4)) for rays in (1, 1 / 16)
    )
    assert coarse.beam.shape == (5, 6)
    np.testing.assert_allclose(coarse.interferogram(HENE), fine.interferogram(HENE), atol=1e-6)


@pytest.mark.parametrize("rays", [1, 3])
def test_rays_start_over_the_centres_of_the_pixels(rays):
    """Row by row; the splitter shows the beam from behind, so columns run the other way."""
    bench = michelson(rays=rays)
    paths = bench.trace().detected
    assert bench.beam.shape == (6 * rays, 8 * rays)
    row, column = np.divmod(paths.ray, 8 * rays)
    np.testing.assert_allclose(paths.pixel[:, 0], (row + 0.5) / rays, atol=1e-9)
    np.testing.assert_allclose(paths.pixel[:, 1], 8 - (column + 0.5) / rays, atol=1e-9)


def test_every_ray_comes_by_both_arms():
    paths = michelson(reference_tilt=(1e-4, 1e-4)).trace()
    visits = paths.detected.visits(2)
    assert np.bincount(visits).tolist() == [48, 48]
    # r t out of each arm towards the CCD, r r or t t back to the source
    np.testing.assert_allclose(np.abs(paths.amplitude), 0.5, rtol=1e-12)


def test_pixels_are_square_and_the_beam_covers_the_ccd():
    bench = michelson(pixels=(3, 12), aperture=6 * mm)
    assert bench.ccd.pitch == pytest.approx(0.5 * mm)
    assert bench.beam.size == pytest.approx((6 * mm, 1.5 * mm))
    assert bench.beam.size == pytest.approx(bench.ccd.size)


def test_the_profile_is_given_over_the_image():
    bench = michelson(profile=lambda x, y: np.where((x > 0) & (y < 0), 1.0, 0.0))
    expected = np.zeros((6, 8))
    expected[:3, 4:] = 1.0
    np.testing.assert_allclose(bench.interferogram(HENE), expected, atol=1e-9)


def test_the_bare_ccd_is_focused_on_nothing():
    assert michelson(focus=False).ccd.focus == 0.0
    assert michelson(arm=40 * mm).ccd.focus == pytest.approx(80 * mm)


def test_the_arm_grows_with_a_tall_sample():
    assert michelson().ccd.centre[2] == pytest.approx(2 * APERTURE)
    assert michelson(pixels=(16, 8)).ccd.centre[2] == pytest.approx(4 * APERTURE)
    assert michelson(sample=plate(8 * mm, 8 * mm).moved((0, 0, 10 * mm))).ccd.centre[2] == pytest.approx(
        30 * mm
    )


def test_a_surface_keeps_its_interface():
    dull = ft.Surface(plate(8 * mm, 8 * mm), ft.Mirror(0.25), "silicon")
    bench = michelson(sample=dull)
    sample, reference = bench.fields(HENE)
    np.testing.assert_allclose(abs(sample) / abs(reference), 0.5, rtol=1e-12)
    assert bench.scene.index("silicon") == 1


def test_a_sample_may_have_any_name():
    bench = michelson(sample=ft.Surface(plate(8 * mm, 8 * mm), ft.Mirror(), "reference"))
    assert np.bincount(bench.trace().detected.visits(bench.arms.reference.surface)).tolist() == [48, 48]


def test_trimesh_is_welcome():
    box = trimesh.creation.box(extents=(8 * mm, 8 * mm, 1 * mm))
    box.apply_translation((0.0, 0.0, -0.5 * mm))
    np.testing.assert_allclose(michelson(sample=box).interferogram(HENE), 1.0, atol=1e-8)


def test_light_that_bounces_twice_in_a_groove_returns_along_its_way():
    """A right-angled groove sends each ray back at the mirrored place; its path is that of the floor."""
    from fringetrace.geometry.shapes import extrude

    depth = 3 * mm
    groove = extrude([(-depth, 0.0), (0.0, -depth), (depth, 0.0)], 8 * mm)
    paths = michelson(sample=groove, aperture=4 * mm).trace().detected
    sample = paths.where(paths.visits(2) == 0)
    assert (sample.visits(1) == 2).all()
    column = sample.ray % 8
    np.testing.assert_allclose(sample.pixel[:, 1], column + 0.5, atol=1e-9)
    flat = michelson(aperture=4 * mm, arm=float(paths.ccd.centre[2])).trace().length.min()
    np.testing.assert_allclose(sample.length - flat, 2 * depth, atol=1e-15)


@pytest.mark.parametrize("tilt", [(0.1, 0.0), (0.0, -0.1), (0.07, 0.07)])
@pytest.mark.parametrize("piston", [0.0, 0.1, -0.1])
def test_the_most_tilted_reference_still_comes_back(tilt, piston):
    bench = michelson(reference_tilt=tilt, piston=piston * 2 * APERTURE)
    paths = bench.trace()
    at_mirror = paths.where(paths.visits(2) > 0)
    # all of it went through the splitter again: half to each side
    assert len(at_mirror) == 2 * 48
    assert (at_mirror.bounces == 3).all()
    assert paths.ledger().error < 1e-12


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"aperture": 0.0}, "michelson aperture: expected a positive length in metres, got 0"),
        ({"aperture": math.nan}, "michelson aperture: expected a positive length in metres, got nan"),
        ({"pixels": (0, 4)}, r"michelson pixels: expected positive whole \(rows, columns\), got \(0, 4\)"),
        ({"pixels": (4.5, 4)}, "michelson pixels: expected positive whole"),
        ({"pixels": (4, 4, 4)}, "michelson pixels: expected positive whole"),
        ({"rays": 0}, "michelson rays: expected a positive whole number, or a part of 1, got 0"),
        ({"rays": 1.5}, "michelson rays: expected a positive whole number, or a part of 1, got 1.5"),
        ({"arm": 1.9 * APERTURE}, "michelson arm: expected at least 2.0 times the aperture, 0.012 m, got"),
        ({"arm": math.nan}, "michelson arm: expected at least 2.0 times the aperture"),
        ({"reference_tilt": (0.08, 0.08)}, "michelson reference_tilt: expected up to 0.1 rad, got"),
        ({"reference_tilt": (math.nan, 0.0)}, "michelson reference_tilt: expected up to 0.1 rad, got"),
        ({"piston": 2 * mm}, "michelson piston: expected up to 0.1 times the arm, 0.0012 m, got 0.002"),
        ({"piston": math.inf}, "michelson piston: expected up to 0.1 times the arm"),
        (
            {"sample": plate(8 * mm, 8 * mm).moved((0, 0, 5 * mm)), "arm": 12 * mm},
            "michelson arm: expected at least 3.0 times the sample's height, 0.015 m, got 0.012",
        ),
    ],
)
def test_what_does_not_fit_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        michelson(**options)


def test_a_sample_that_is_no_mesh_is_refused():
    with pytest.raises(TypeError, match=r"expected a mesh with .*, or a pyvista\.PolyData, got str"):
        michelson(sample="step.stl")


GLASS = ft.Surface(plate(8 * mm, 8 * mm), ft.Dielectric(), "glass", back=1.5)
SLAB = plate(2 * mm, 2 * mm, 1 * mm)


@pytest.mark.parametrize(
    ("bench", "options", "message"),
    [
        (
            "michelson",
            {"compensator": True},
            "michelson compensator: expected one beside a SplitterPlate only",
        ),
        (
            "michelson",
            {"splitter": instruments.SplitterPlate(1 * mm), "arm": 20 * mm},
            "michelson arm: expected at least 4.0 times the aperture, 0.024 m, got 0.02",
        ),
        ("fizeau", {"gap": 0.0}, "fizeau gap: expected more than the sample's height, 0 m, and a plate of"),
        ("fizeau", {"gap": 1 * mm, "thickness": 0.0}, "fizeau gap: expected more than the sample's height"),
        ("fizeau", {"gap": math.inf}, "fizeau gap: expected more than the sample's height"),
        ("fizeau", {"gap": 1 * mm, "radius": 5 * mm}, "fizeau radius: expected over 0.00848528 m, got 0.005"),
        (
            "fizeau",
            {"gap": 1 * mm, "reference_tilt": (0.2, 0.0)},
            "fizeau reference_tilt: expected up to 0.1",
        ),
        ("fizeau", {"gap": 1 * mm, "rays": 1.5}, "fizeau rays: expected a positive whole number"),
        ("mach_zehnder", {}, "mach_zehnder index: expected that of what the mesh is filled with, got None"),
        (
            "mach_zehnder",
            {"sample": GLASS, "index": 1.5},
            "mach_zehnder index: expected None beside surfaces",
        ),
        (
            "mach_zehnder",
            {"sample": GLASS, "na": 0.7},
            "mach_zehnder na: expected a number up to 0.6247, got 0.7",
        ),
        (
            "mach_zehnder",
            {"sample": GLASS, "na": 0.0},
            "mach_zehnder na: expected a number up to 0.6247, got 0",
        ),
        ("mach_zehnder", {"sample": GLASS, "aperture": -1.0}, "mach_zehnder aperture: expected a positive"),
        (
            "mach_zehnder",
            {"sample": GLASS, "reference_tilt": (0, 1)},
            "mach_zehnder reference_tilt: expected",
        ),
        ("jamin_lebedeff", {"index": 1.5, "shear": 1 * mm}, "jamin_lebedeff shear: expected at least"),
        (
            "jamin_lebedeff",
            {"index": 1.5, "crystal": (1.5, 1.5)},
            "jamin_lebedeff crystal: expected two diff",
        ),
        (
            "jamin_lebedeff",
            {"index": 1.5, "pixels": (0, 4)},
            "jamin_lebedeff pixels: expected positive whole",
        ),
    ],
)
def test_what_does_not_fit_other_benches_is_refused(bench, options, message):
    options = {"sample": SLAB if bench[0] in "mj" else plate(8 * mm, 8 * mm), "aperture": APERTURE, **options}
    with pytest.raises(ValueError, match=message):
        getattr(instruments, bench)(options.pop("sample"), **options)


@pytest.mark.parametrize("bench", ["mach_zehnder", "jamin_lebedeff"])
def test_a_profile_is_given_over_the_image_of_every_bench(bench):
    """Light only where x > 0 and y < 0."""
    slab = plate(8 * mm, 8 * mm, 1 * mm).moved((0.0, 0.0, 0.5 * mm))
    instrument = getattr(instruments, bench)(
        slab, index=1.0, aperture=APERTURE, pixels=(6, 8),
        profile=lambda x, y: np.where((x > 0) & (y < 0), 1.0, 0.0),
    )  # fmt: skip
    expected = np.zeros((6, 8))
    expected[:3, 4:] = 1.0
    np.testing.assert_allclose(instrument.interferogram(HENE), expected, atol=1e-9)


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_the_fizeau_shows_a_step_where_it_stands():
    """Brighter and darker halves, by the sample's x; the profile too."""
    step = ft.shapes.step(8 * mm, 8 * mm, 1 * mm, 100 * nm)
    bench = instruments.fizeau(
        step, aperture=APERTURE, gap=1 * mm, pixels=(6, 12), max_bounces=9,
        profile=lambda x, y: np.where(y < 0, 1.0, 0.0),
    )  # fmt: skip
    image = bench.interferogram(HENE)
    np.testing.assert_allclose(image[3:], 0.0, atol=1e-9)
    assert np.ptp(image[:3, :7]) < 1e-6 < abs(image[0, 0] - image[0, 11])
    np.testing.assert_allclose(image[:3, 9:], image[0, 11], atol=1e-6)


def test_a_polarised_bench_has_fields_of_three_components():
    scalar, polarised = (
        instruments.mach_zehnder(
            plate(8 * mm, 8 * mm, 1 * mm), index=1.0, aperture=APERTURE, pixels=(3, 4),
            reference_tilt=(2e-5, 0.0), polarisation=jones,
        )
        for jones in (None, (0.6, 0.8j))
    )  # fmt: skip
    fields = polarised.fields(HENE)
    assert fields.shape == (2, 3, 3, 4)
    # columns, rows, normal: light in both arms comes with the state that it was given
    np.testing.assert_allclose(np.abs(fields[0, :, 1, 1]), [0.3, 0.4, 0.0], atol=1e-12)
    np.testing.assert_allclose((fields[0, 1] / fields[0, 0]).imag, 4 / 3, rtol=1e-9)
    np.testing.assert_allclose(polarised.interferogram(HENE), scalar.interferogram(HENE), atol=1e-9)
    assert polarised.field(HENE).shape == (3, 3, 4)
    rays = replace(polarised, method="rays")
    np.testing.assert_allclose(rays.stream_fields(HENE), rays.fields(HENE), rtol=0, atol=1e-12)


def test_a_bench_that_depends_on_the_wavelength_is_traced_once_for_each():
    bent = plate(8 * mm, 8 * mm, 1 * mm).moved(turn=ft.vectors.rotation((0, 1, 0), 0.1))
    straight, tilted = (
        instruments.mach_zehnder(slab, index="BK7", aperture=APERTURE, pixels=(3, 4))
        for slab in (plate(8 * mm, 8 * mm, 1 * mm), bent)
    )
    with pytest.raises(ValueError, match="trace wavelength: expected one, since BK7 is dispersive, got None"):
        straight.trace()
    for wavelength in (HENE, 500 * nm, HENE):
        straight.interferogram(wavelength)
        tilted.interferogram(wavelength)
    # straight on no wavelength goes another way: one trace for all; what is bent is traced again
    assert straight.traced == (HENE,)
    assert tilted.traced == (HENE, 500 * nm, HENE)
    assert tilted.trace() is tilted.trace(HENE)
    again = instruments.mach_zehnder(
        plate(8 * mm, 8 * mm, 1 * mm), index="BK7", aperture=APERTURE, pixels=(3, 4)
    )
    np.testing.assert_allclose(
        straight.interferogram(500 * nm), again.interferogram(500 * nm), rtol=0, atol=1e-6
    )
    assert instruments.michelson(plate(8 * mm, 8 * mm), aperture=APERTURE, pixels=(2, 2)).traced == ()


def test_an_arm_of_two_apertures_is_long_enough_in_any_unit():
    for unit in (ft.nm, ft.um, ft.mm, 1e-5):
        michelson(sample=plate(3 * unit, 3 * unit), aperture=2 * unit, arm=4 * unit)
