"""What a bench records: traced once, summed by arm, stepped without a new trace."""

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
import xarray

import fringetrace as ft
from fringetrace import instruments, mm, nm
from fringetrace.core import tables
from fringetrace.field.pixel_quadrature import mutual_products
from fringetrace.geometry.shapes import plate
from fringetrace.instruments.arms import Arms, path_slope
from fringetrace.instruments.interferometer import Interferometer

HENE = 632.8 * nm
# Path lengths of some 50 mm in float64, in radians at this wavelength, with room for a few roundings.
PHASE = 1e-8
# What the quadrature of a pixel may leave, radians.
QUADRATURE = 1e-6


@pytest.fixture
def bench():
    return instruments.michelson(
        plate(8 * mm, 8 * mm), aperture=6 * mm, pixels=(6, 8), reference_tilt=(2e-4, -1e-4)
    )


@pytest.fixture
def rays(bench):
    """The same, its light a ray sum."""
    return replace(bench, method="rays")


def test_it_is_traced_once(bench):
    done = []
    paths = bench.trace(progress=lambda *counts: done.append(counts), threads=1)
    assert done == [(48, 48)]
    assert bench.trace(progress=lambda *counts: done.append(counts)) is paths
    assert len(done) == 1


def test_the_fields_of_the_arms_add_up_to_the_field(rays):
    bench = rays
    sample, reference = bench.fields(HENE)
    np.testing.assert_allclose(abs(sample), 0.5, rtol=1e-12)
    np.testing.assert_allclose(abs(reference), 0.5, rtol=1e-12)
    np.testing.assert_allclose(bench.field(HENE), sample + reference, rtol=1e-12)
    np.testing.assert_allclose(bench.field(HENE, math.pi / 3), sample + np.exp(1j * math.pi / 3) * reference)
    np.testing.assert_allclose(bench.interferogram(HENE), abs(sample + reference) ** 2, rtol=1e-12)
    np.testing.assert_allclose(bench.interferogram(HENE, modulus=True), abs(sample + reference), rtol=1e-12)


def test_fringes_lose_their_visibility_over_a_pixel(bench):
    """A fringe of period P over pixels of p: sinc(p_x / P_x) sinc(p_y / P_y)."""
    mutual = bench.mutual(HENE)
    slope = np.array(path_slope(bench.arms.tilt))
    visibility = np.prod(np.sinc(slope * bench.ccd.pitch / HENE))
    # the tilted wave reaches all but the image's rim
    inner = (slice(None), slice(None), slice(1, -1), slice(1, -1))
    bright = math.cos(2 * math.hypot(*bench.arms.tilt))
    np.testing.assert_allclose(mutual[inner][0, 0], 0.25, rtol=QUADRATURE)
    np.testing.assert_allclose(mutual[inner][1, 1], 0.25 * bright, rtol=QUADRATURE)
    np.testing.assert_allclose(abs(mutual[inner][0, 1]), 0.25 * math.sqrt(bright) * visibility, rtol=1e-5)
    frames = bench.phase_steps(HENE)
    modulation = 0.5 * np.hypot(frames[0] - frames[2], frames[1] - frames[3])[1:-1, 1:-1]
    np.testing.assert_allclose(modulation, 2 * abs(mutual[inner][0, 1]), rtol=QUADRATURE)


@pytest.mark.filterwarnings("ignore:fringes alias")
def test_fields_are_kept_for_the_last_wavelength(bench):
    first = bench.fields(HENE)
    assert bench.fields(HENE) is first
    assert not np.allclose(bench.fields(532 * nm), first)
    np.testing.assert_array_equal(bench.fields(HENE), first)


@pytest.mark.parametrize("threads", [1, 2])
def test_streamed_fields_are_the_same(rays, threads):
    np.testing.assert_allclose(
        rays.stream_fields(HENE, threads=threads), rays.fields(HENE), rtol=0, atol=1e-12
    )


def test_streamed_fields_keep_no_paths(bench):
    seen = []
    bench.stream_fields(HENE, progress=lambda *counts: seen.append(counts))
    assert "paths" not in bench.derived
    assert seen


def test_light_that_meets_the_reference_twice_is_stepped_twice(bench):
    orders = np.array([1.0, 2.0, 0.5])[:, None, None] * np.ones((3, *bench.ccd.shape))
    bench.derived["light"] = {(HENE, "fields"): orders, (HENE, "mutual"): mutual_products(orders)}
    np.testing.assert_allclose(bench.field(HENE, math.pi / 2), 1.0 + 2.0j - 0.5)
    np.testing.assert_allclose(bench.interferogram(HENE, step=math.pi / 2), 0.5**2 + 2.0**2)


@pytest.mark.parametrize("steps", [0, 2])
def test_two_steps_are_refused(bench, steps):
    with pytest.raises(ValueError, match=f"phase steps: expected at least 3, got {steps}"):
        bench.phase_steps(HENE, steps)


def test_a_wavelength_that_is_none_is_refused(bench):
    with pytest.raises(ValueError, match="wavelength: expected a positive length"):
        bench.interferogram(0.0)


def test_a_height_needs_light_from_both_arms():
    beside = plate(1 * mm, 1 * mm).moved((10 * mm, 0.0, 0.0))
    dark = instruments.michelson(beside, aperture=6 * mm, pixels=(6, 8))
    assert np.isnan(dark.wrapped(HENE)).all()
    with pytest.raises(ValueError, match="path difference: expected pixels with light from both arms"):
        dark.height(HENE)


def test_the_carrier_is_the_phase_of_a_flat_sample(bench):
    flat = ft.phase.wrap(bench.wrapped(HENE) - bench.carrier(HENE))
    np.testing.assert_allclose(flat, 0.0, atol=QUADRATURE)
    np.testing.assert_allclose(bench.carrier(HENE)[[0, -1], [0, -1]].sum(), 0.0, atol=1e-12)


@pytest.mark.parametrize("steps", [3, 4, 5, 8])
def test_any_number_of_steps_gives_the_same_height(bench, steps):
    np.testing.assert_allclose(bench.height(HENE, steps), 0.0, atol=QUADRATURE * HENE)


def test_it_survives_a_pickle_without_its_paths(bench):
    image = bench.interferogram(HENE)
    copy = pickle.loads(pickle.dumps(bench))
    assert copy.derived == {}
    np.testing.assert_array_equal(copy.interferogram(HENE), image)


def test_sampled_paths_are_few_and_recorded(bench):
    paths = bench.sampled((2, 3))
    assert paths.ray.max() == 5
    assert paths.polyline(0).shape[1] == 3
    assert bench.derived == {}


def test_a_bench_can_be_built_from_any_scene(bench):
    other = Interferometer(bench.scene, bench.beam, bench.ccd, Arms(bench.arms.reference))
    assert other.arms.tilt == (0.0, 0.0)
    np.testing.assert_array_equal(other.carrier(HENE), 0.0)


# Shutters.


@pytest.mark.parametrize(("arm", "other"), [("reference", 0), ("sample", 1)])
def test_a_shut_arm_leaves_the_light_of_the_other_as_it_is(rays, arm, other):
    shut = rays.shut(arm)
    assert type(shut) is Interferometer
    assert shut.derived == {}
    # the same paths, to the bit, and the same light
    mine = rays.trace().visits(2) == other
    for column in ("ray", "length", "origin", "direction", "amplitude", "key"):
        np.testing.assert_array_equal(
            getattr(shut.trace().detected, column), getattr(rays.trace().where(mine).detected, column)
        )
    one = shut.fields(HENE)
    np.testing.assert_array_equal(one[other], rays.fields(HENE)[other])
    assert np.abs(one[other]).min() > 0.3
    np.testing.assert_array_equal(one[1 - other], 0.0)
    alone = np.abs(rays.fields(HENE)[other]) ** 2
    np.testing.assert_allclose(shut.interferogram(HENE), alone, rtol=1e-14)
    # steps move light that is not there, or all of it
    frames = shut.phase_steps(HENE)
    np.testing.assert_allclose(frames, np.broadcast_to(alone, frames.shape), rtol=1e-12)


@pytest.mark.parametrize(("arm", "other"), [("reference", 0), ("sample", 1)])
def test_by_the_wavefront_it_is_sampled_for_what_is_left(bench, arm, other):
    np.testing.assert_allclose(
        bench.shut(arm).mutual(HENE)[other, other], bench.mutual(HENE)[other, other], rtol=QUADRATURE
    )
    fields = bench.shut(arm).fields(HENE), bench.fields(HENE)
    np.testing.assert_allclose(fields[0][other], fields[1][other], atol=QUADRATURE)


def test_light_of_a_shut_arm_ends_at_the_shutter(bench):
    for arm in ("sample", "reference"):
        paths = bench.shut(arm).trace()
        ended = paths.fate == ft.Fate.ABSORBED
        np.testing.assert_array_equal(paths.bounces[ended], 2)  # the splitter, the shutter
        assert ended.sum() == np.prod(bench.beam.shape)
        assert len(paths) < len(bench.trace())
        assert len(bench.shut(arm).trace().detected) == np.prod(bench.beam.shape)
    with pytest.raises(ValueError, match="path difference: expected pixels with light from both arms"):
        bench.shut("reference").height(HENE)


def test_a_fizeau_is_blocked_at_its_sample():
    """What is left is what the reference face sends back."""
    one = instruments.fizeau(plate(8 * mm, 8 * mm), aperture=6 * mm, gap=1 * mm, pixels=(6, 8))
    alone = one.shut("sample").fields(HENE)
    np.testing.assert_array_equal(alone[0], one.fields(HENE)[0])
    np.testing.assert_array_equal(alone[1:], 0.0)
    with pytest.raises(
        ValueError, match="shut: expected an arm that light of the other does not pass, got 'r"
    ):
        one.shut("reference")


def test_arms_that_there_are_not_are_refused(bench):
    with pytest.raises(ValueError, match="shut: expected 'reference' or 'sample', got 'source'"):
        bench.shut("source")
    loose = Interferometer(bench.scene, bench.beam, bench.ccd, Arms(bench.arms.reference))
    with pytest.raises(ValueError, match=r"shut: expected an arm .*, got 'sample'"):
        loose.shut("sample")


def test_everything_labelled(rays, tmp_path):
    data = rays.dataset(HENE)
    np.testing.assert_array_equal(data.interferogram, rays.interferogram(HENE))
    np.testing.assert_array_equal(data.frames, rays.phase_steps(HENE))
    np.testing.assert_array_equal(data.wrapped_phase, rays.wrapped(HENE))
    np.testing.assert_array_equal(data.field_real + 1j * data.field_imag, rays.field(HENE))
    assert data.frames.dims == ("step", "y", "x")
    assert data.step.values == pytest.approx(np.arange(4) * math.pi / 2)
    # the reference's path rises with x as it is told to: the fringes in metres
    slope = path_slope(rays.arms.tilt)[0]
    turn = np.diff(np.unwrap(data.wrapped_phase.isel(y=3))) / np.diff(data.x)
    np.testing.assert_allclose(turn, 2 * math.pi / HENE * slope, rtol=1e-6)
    assert {name: data[name].attrs["units"] for name in ("x", "y", "step", "wrapped_phase")} == {
        "x": "m", "y": "m", "step": "rad", "wrapped_phase": "rad"
    }  # fmt: skip
    assert data.attrs["wavelength_m"] == HENE
    tables.write_netcdf(data, tmp_path / "bench.nc")
    xarray.testing.assert_identical(xarray.load_dataset(tmp_path / "bench.nc", engine="h5netcdf"), data)


def test_polarised_fields_have_components(rays):
    beam = replace(rays.beam, polarisation=(1.0, 1.0j))
    data = replace(rays, beam=beam).dataset(HENE)
    assert data.field_real.dims == ("component", "y", "x")
    assert data.field_imag.shape == (3, 6, 8)
