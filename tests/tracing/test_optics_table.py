"""Media of a scene as the kernels read them, what they ask for, what they refuse; other wavelengths."""

import math
import pickle

import glass
import numpy as np
import pytest

import fringetrace as ft
from fringetrace import nm, um
from fringetrace.geometry import forms, shapes
from fringetrace.instruments import Arms, Interferometer, Mark
from fringetrace.optics import materials, polarisers
from fringetrace.optics.films import Film
from fringetrace.optics.materials.dispersion import IndexTable
from fringetrace.tracing.optics_table import needs, optics, plain, scene_media as media_of
from fringetrace.tracing.rewavelength import at_wavelength

PLATE = shapes.plate(1, 1)


def scene(interface=None, medium=None, **sides):
    return ft.Scene([ft.Surface(PLATE, interface or ft.Dielectric(), "face", **sides)], medium=medium)


def test_media_by_number():
    one = ft.Scene(
        [
            ft.Surface(PLATE, ft.Dielectric(), "a", back="BK7"),
            ft.Surface(PLATE.moved((0, 0, -1)), ft.Dielectric(), "b", front="BK7", back=1.33),
        ],
        medium="air",
    )
    assert media_of(one) == (materials.AIR, materials.BK7, materials.constant(1.33))
    found = optics(one, 600 * nm, False)
    assert found.surfaces.front.tolist() == [0, 1]
    assert found.surfaces.back.tolist() == [1, 2]
    assert found.surfaces.media[1] == materials.BK7.index(600 * nm)
    assert found.surfaces.k0 == pytest.approx(2 * math.pi / 600e-9)
    assert not found.fading
    assert optics(scene(back="gold", interface=ft.Metal()), 600 * nm, False).fading
    # of one index: one medium
    assert len(media_of(scene(front=1.0, back=1.5))) == 2


def test_where_light_meets_nothing_but_constants_in_a_vacuum():
    mirrors = ft.Scene([ft.Surface(PLATE, ft.Mirror())])
    assert plain(mirrors, False)
    assert optics(mirrors, 500 * nm, False).vacuum
    assert plain(ft.Scene(mirrors.surfaces, medium=1.0), False)
    assert not plain(mirrors, True)
    assert not plain(ft.Scene(mirrors.surfaces, medium=1.33), False)
    assert not plain(ft.Scene(mirrors.surfaces, medium="air"), False)
    assert not plain(scene(back=1.5), False)
    assert not plain(ft.Scene([ft.Surface(PLATE, polarisers.Polariser((1, 0, 0)))]), False)


@pytest.mark.parametrize(
    ("which", "why"),
    [
        (scene(back=1.5), None),
        (scene(back="BK7"), "BK7 is dispersive"),
        (scene(back=1.5, medium="water"), "water is dispersive"),
        (scene(back=materials.constant(1.5 + 1j, "tar")), "tar absorbs"),
        (scene(ft.Dielectric(film=Film([(1.38, 1e-7)])), back=1.5), "face has a film"),
        (
            ft.Scene([ft.Surface(PLATE, ft.gratings.Grating((1, 0, 0), 1e-5, (0, 1)), "ruling")]),
            "ruling depends on it",
        ),
        (ft.Scene([ft.Surface(PLATE, ft.Mirror())]), None),
    ],
)
def test_what_needs_a_wavelength(which, why):
    assert needs(which) == why
    rays = glass.aimed(0.1)
    if why is None:
        ft.trace(which, rays)
    else:
        with pytest.raises(ValueError, match=f"trace wavelength: expected one, since {why}, got None"):
            ft.trace(which, rays)
    ft.trace(which, rays, wavelength=500 * nm)


@pytest.mark.parametrize("wavelength", [0.0, -1e-7, math.nan, math.inf, "red"])
def test_no_wavelength(wavelength):
    with pytest.raises((ValueError, TypeError), match="wavelength"):
        ft.trace(scene(back=1.5), glass.aimed(0.1), wavelength=wavelength)


def test_outside_of_a_material():
    with pytest.raises(ValueError, match="chitin: expected 400 nm to 700 nm, got 900 nm"):
        ft.trace(scene(back="chitin"), glass.aimed(0.1), wavelength=900 * nm)


@pytest.mark.parametrize("index", [1e-8, 1e8, 1e300, 1e-200j])
def test_indices_beyond_numbers(index):
    with pytest.raises(ValueError, match=r"expected an index of magnitude 1e-07 to 1e\+07, got"):
        ft.trace(scene(back=index), glass.aimed(0.1), wavelength=500 * nm)
    with pytest.raises(ValueError, match=r"expected an index of magnitude 1e-07 to 1e\+07, got"):
        ft.trace(
            scene(ft.Dielectric(film=Film([(index, 1e-9)])), back=1.5), glass.aimed(0.1), wavelength=500 * nm
        )


def test_an_element_that_wants_polarised_light():
    plate = ft.Scene([ft.Surface(PLATE, ft.birefringent.ShearPlate((1, 0, 1), 1e-3, 1.66, 1.49), "shear")])
    with pytest.raises(ValueError, match="shear: expected light with a polarisation, got a scalar beam"):
        ft.trace(plate, glass.aimed(0.1))


# Other wavelengths


def slab(n="BK7", film=None, tilt=0.0):
    """What a slab does to a ray that comes at an angle."""
    return glass.stack(["air", n, "air"], [100 * um], films=[film, None])


def test_paths_that_need_no_change_are_the_same():
    without = ft.trace(ft.Scene([ft.Surface(PLATE, ft.Mirror())]), glass.aimed(0.0), wavelength=500 * nm)
    assert at_wavelength(without, 600 * nm) is without
    paths = ft.trace(slab(), glass.aimed(0.0), wavelength=500 * nm)
    assert at_wavelength(paths, 500 * nm) is paths
    with pytest.raises(ValueError, match="wavelength"):
        at_wavelength(paths, -1.0)
    none = ft.trace(glass.stack([1.0, 1.5]), glass.aimed(0.5))
    assert at_wavelength(none, 600 * nm) is none


def onto(scene, angle, wavelength):
    ccd = ft.CCD((0, 0, -0.1), (0, 0, 1), (0, 1, 0), 0.1, (3, 3))
    return ft.trace(scene, glass.aimed(angle), ccd, wavelength=wavelength)


def test_light_that_is_bent_wants_a_new_trace():
    paths = onto(slab(), 0.3, 500 * nm)
    with pytest.raises(
        ValueError, match=r"expected that of the trace, 5e-07 m, since .* is dispersive and light is bent"
    ):
        ft.complex_field(paths, 600 * nm, "rays")
    # what is bent, but not seen, does not matter
    aside = ft.trace(slab(), glass.aimed(0.3), wavelength=500 * nm)
    assert at_wavelength(aside, 600 * nm).wavelength == 600 * nm


@pytest.mark.parametrize("seed", range(5))
def test_straight_on_but_for_rounding_is_straight_on(seed):
    turn = ft.vectors.rotation(np.random.default_rng(seed).normal(size=3), seed + 0.3)
    turned = ft.Scene([surface.moved(turn=turn) for surface in slab().surfaces], medium="air")
    down = turn @ np.array([0.0, 0.0, -1.0])
    ccd = ft.CCD(0.2 * down, -down, turn @ (0, 1, 0), 0.1, (3, 3))
    one, other = (ft.trace(turned, ft.Rays([-down], [down]), ccd, wavelength=w) for w in (500 * nm, 600 * nm))
    again = at_wavelength(one, 600 * nm)
    for key in np.intersect1d(one.key, other.key):
        np.testing.assert_allclose(again.length[again.key == key], other.length[other.key == key], rtol=1e-14)
        np.testing.assert_allclose(
            again.amplitude[again.key == key], other.amplitude[other.key == key], rtol=1e-12
        )


def test_more_bounces_than_a_key_tells():
    paths = ft.trace(
        glass.stack([1.0, 1.5, 1.0], [1e-3]),
        glass.aimed(0.3),
        wavelength=500 * nm,
        min_amplitude=1e-40,
        max_bounces=60,
    )
    assert paths.bounces.max() > 40
    assert at_wavelength(paths, 600 * nm).wavelength == 600 * nm


def test_a_film_that_is_not_the_same_from_behind():
    """Between equal media a key does not tell from which side light came."""
    film = Film([(2.3, 40 * nm), (1.38, 90 * nm)])
    paths = ft.trace(
        glass.stack([1.0, 1.0], films=[film]), glass.aimed(0.0, upwards=True), wavelength=600 * nm
    )
    with pytest.raises(
        ValueError, match="face 0 has a film that is not the same from behind, between equal media"
    ):
        at_wavelength(paths, 500 * nm)
    alike = Film([(2.3, 40 * nm), (1.38, 90 * nm), (2.3, 40 * nm)])
    one, other = (
        ft.trace(glass.stack([1.0, 1.0], films=[alike]), glass.aimed(0.0, upwards=True), wavelength=w)
        for w in (600 * nm, 500 * nm)
    )
    np.testing.assert_allclose(at_wavelength(one, 500 * nm).amplitude, other.amplitude, rtol=1e-13)


def test_films_are_met_from_behind():
    """Between two media a key does tell."""
    film = Film([(2.3, 40 * nm), (1.38 + 0.1j, 90 * nm)])
    behind = ft.Scene(glass.stack(["air", "BK7"], films=[film]).surfaces, medium="BK7")
    for upwards, there in ((True, behind), (False, glass.stack(["air", "BK7"], films=[film]))):
        one, other = (
            ft.trace(there, glass.aimed(0.0, upwards=upwards), wavelength=w) for w in (600 * nm, 500 * nm)
        )
        np.testing.assert_allclose(at_wavelength(one, 500 * nm).amplitude, other.amplitude, rtol=1e-13)


def test_contradicting_media_want_a_new_trace():
    ball = ft.Surface(
        shapes.icosphere(0.5, 1), ft.Dielectric(), "ball", forms.Sphere((0, 0, 0), 0.5), back="BK7"
    )
    with pytest.warns(ft.FringetraceWarning, match="media contradict: 1 rays came to 'ball'"):
        paths = ft.trace(ft.Scene([ball]), ft.Rays([(0, 0, 0)], [(0, 0, 1)]), wavelength=500 * nm)
    with pytest.raises(ValueError, match="rays came to surfaces in media that these do not have there"):
        at_wavelength(paths, 600 * nm)


# The nouns


@pytest.mark.parametrize(
    ("kind", "sides", "error", "message"),
    [
        (
            ft.Dielectric(),
            {},
            ValueError,
            "face: expected a medium in front of a Dielectric or behind it, got none",
        ),
        (ft.Metal(), {}, ValueError, "face: expected a medium in front of a Metal or behind it, got none"),
        (ft.Mirror(), {"front": 1.5}, ValueError, "face front: expected no medium beside a Mirror, got one"),
        (ft.Dielectric(), {"back": object()}, TypeError, "face back: expected a Material"),
        (ft.Dielectric(), {"back": "glas"}, ValueError, "expected"),
    ],
)
def test_media_of_a_surface(kind, sides, error, message):
    with pytest.raises(error, match=message):
        ft.Surface(PLATE, kind, "face", **sides)


def test_media_of_a_scene():
    with pytest.raises(TypeError, match="Scene medium: expected a Material"):
        ft.Scene([ft.Surface(PLATE, ft.Mirror())], medium=[1.5])
    there = scene(back="BK7", medium="water")
    again = pickle.loads(pickle.dumps(there))
    assert again.around == materials.WATER
    assert again.surfaces[0].back == materials.BK7
    moved = there.surfaces[0].moved((0, 0, 1))
    assert moved.back == materials.BK7


@pytest.mark.parametrize(
    "value", [(1, 0, 0), (0, 0), (math.nan, 1), "xy", None.__class__, 3.0, (math.inf, 0)]
)
def test_bad_polarisation_of_a_beam(value):
    with pytest.raises(ValueError, match="Beam polarisation: expected"):
        ft.Beam((0, 0, 1), (0, 0, -1), (0, 1, 0), (1, 1), (2, 2), polarisation=value)


def test_polarisation_of_a_beam():
    """Along its columns and rows."""
    beam = ft.Beam((0, 0, 1), (0, 0, -1), (0, 1, 0), (1, 1), (2, 2), polarisation=(3, 4j))
    np.testing.assert_allclose(beam.polarisation, (0.6, 0.8j), rtol=1e-15)
    from fringetrace.tracing.rays import launch, launch_at

    u, v, _ = beam.axes
    for rays in (launch(beam), launch_at(beam, np.ones(4), np.ones(4))):
        np.testing.assert_allclose(rays.polarisation, np.tile(0.6 * u + 0.8j * v, (4, 1)), rtol=1e-15)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ([[0, 0, 1.0]], "Rays polarisation: expected fields across the rays, got 1 along ray 0"),
        ([[0, 0, 0]], "Rays polarisation: expected finite fields other than 0, got others"),
        ([[math.nan, 0, 0]], "Rays polarisation: expected finite fields other than 0, got others"),
        ([[1, 0]], r"Rays polarisation: expected numbers of shape \(1, 3\), got"),
        ("along", r"Rays polarisation: expected numbers of shape \(1, 3\), got"),
    ],
)
def test_bad_polarisation_of_rays(value, message):
    with pytest.raises(ValueError, match=message):
        ft.Rays([(0, 0, 1)], [(0, 0, -1)], polarisation=value)


def test_polarisation_of_rays():
    rays = ft.Rays(np.zeros((3, 3)), np.tile([0, 0, 1.0], (3, 1)), polarisation=(3, 4j, 1e-10))
    np.testing.assert_allclose(rays.polarisation, np.tile([0.6, 0.8j, 0], (3, 1)), rtol=0, atol=1e-15)
    assert rays.part(1, 3).polarisation.shape == (2, 3)


@pytest.mark.parametrize("value", ["films", 1.5])
def test_films_of_boundaries(value):
    with pytest.raises(TypeError, match="Dielectric film: expected None or a Film, got"):
        ft.Dielectric(film=value)
    with pytest.raises(TypeError, match="Metal film: expected None or a Film, got"):
        ft.Metal(film=value)


def test_branches_to_follow():
    with pytest.raises(
        ValueError,
        match=r"Dielectric follow: expected one of \('both', 'reflected', 'transmitted'\), got 'none'",
    ):
        ft.Dielectric("none")


# Glass whose index is that of air, to so much, at 600 nm; and a film that lets all light of 600 nm through.
NEAR = materials.Material("near air", IndexTable((0.5, 0.6, 0.7), (1.5, 1.0 + 1e-7, 1.5)))
LIKE = materials.Material("like air", IndexTable((0.5, 0.59, 0.61, 0.7), (1.5, 1.0, 1.0, 1.5)))
QUARTER = Film([(math.sqrt(1.5), 600 * nm / 4 / math.sqrt(1.5))])


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (lambda: glass.stack([1.0, NEAR, 1.0], [100 * um]), "branches that it cut off have up to 0.2 of"),
        (lambda: glass.stack([1.0, LIKE, 1.0], [100 * um]), "face 0 sends back no light at all"),
        (lambda: glass.stack([1.0, 1.5], films=[QUARTER]), "branches that it cut off have up to 0.0"),
    ],
)
def test_branches_that_were_dark_want_a_new_trace(scene, message):
    """Else a sweep of wavelengths from one trace would lose what is dark at the first one, without a word."""
    paths = ft.trace(scene(), glass.aimed(0.0), wavelength=600 * nm)
    with pytest.raises(ValueError, match=f"expected that of the trace, 6e-07 m, since {message}"):
        at_wavelength(paths, 500 * nm)
    bright = ft.trace(scene(), glass.aimed(0.0), wavelength=500 * nm)
    assert len(bright) > len(paths) - (paths.fate == ft.Fate.FAINT).sum()
    assert at_wavelength(bright, 510 * nm).wavelength == 510 * nm


def test_branches_that_drift_want_no_new_trace():
    """Light to and fro in a slab fades away at any wavelength: what is cut off is as faint there."""
    paths = ft.trace(slab(), glass.aimed(0.0), wavelength=500 * nm, min_amplitude=1e-6)
    assert (paths.fate == ft.Fate.FAINT).any()
    assert at_wavelength(paths, 700 * nm).wavelength == 700 * nm


@pytest.mark.parametrize("amplitude", [1e-9, 1.0, 1e6])
def test_what_is_dark_is_relative_to_the_light(amplitude):
    ray = ft.Rays([(0, 0, 0.1)], [(0, 0, -1)], amplitude=[amplitude])
    drifting = ft.trace(slab(), ray, wavelength=500 * nm, min_amplitude=1e-6)
    assert at_wavelength(drifting, 700 * nm).wavelength == 700 * nm
    dark = ft.trace(glass.stack([1.0, 1.5], films=[QUARTER]), ray, wavelength=600 * nm)
    with pytest.raises(ValueError, match="branches that it cut off"):
        at_wavelength(dark, 500 * nm)


def test_an_interferometer_traces_again_where_branches_were_dark():
    """An etalon swept from the wavelength at which its coating is dark is as bright as traced at each."""
    plate = glass.stack([1.0, 1.5], films=[QUARTER])
    beam = ft.Beam((0, 0, 0.01), (0, 0, -1), (0, 1, 0), (1e-3, 1e-3), (8, 8))
    ccd = ft.CCD((0, 0, 0.02), (0, 0, -1), (0, 1, 0), 1e-4, (8, 8))
    swept = Interferometer(plate, beam, ccd, Arms(Mark(0)))
    for wavelength in (600 * nm, 500 * nm, 550 * nm):
        fresh = Interferometer(plate, beam, ccd, Arms(Mark(0)))
        np.testing.assert_allclose(swept.fields(wavelength), fresh.fields(wavelength), atol=1e-12)
    assert swept.traced == (600 * nm, 500 * nm)
