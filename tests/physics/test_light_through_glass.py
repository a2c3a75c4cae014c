"""Fields behind glass by the wavefront method: fringes of slabs and wedges, other wavelengths, the budget."""

import math

import budget as cases
import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm, um
from fringetrace.accuracy.error_budget import facet_error, hit_error
from fringetrace.accuracy.path_errors import rounding
from fringetrace.accuracy.ray_bounds import bounds
from fringetrace.accuracy.sampling import quadrature_error, sampling_error
from fringetrace.core.vectors import rotation
from fringetrace.geometry import forms, shapes
from fringetrace.optics.films import Film
from fringetrace.optics.interfaces import reflect
from fringetrace.tracing.rewavelength import at_wavelength
from fringetrace.tracing.segments import Segments

HENE = cases.HENE
# Means over pixels are good to 1e-6 of the field.
PIXEL = 5e-6
# A path of some centimetres, rounded, in radians; several of them.
PHASE = 1e-9
REPHASED = 1e-12


def face(z, tilt, interface=None, **media):
    """A large plate at height z, leaning about y."""
    plate = shapes.plate(0.2, 0.2).moved(turn=rotation((0.0, 1.0, 0.0), tilt)).moved((0.0, 0.0, z))
    return ft.Surface(plate, interface or ft.Dielectric(), f"at {z / mm:g} mm", **media)


def wedge(n, thickness, tilt=0.0, apex=0.0, around=1.0):
    """Two plane faces with glass between them."""
    top, bottom = (0.5 * thickness, tilt), (-0.5 * thickness, tilt + apex)
    faces = [face(*top, front=around, back=n), face(*bottom, front=n, back=around)]
    return ft.Scene(faces, medium=around)


def lit(polarisation=None, size=12 * mm, shape=(8, 8)):
    return ft.Beam((0, 0, 20 * mm), (0, 0, -1), (0, 1, 0), (size, size), shape, polarisation=polarisation)


def screen(pixels=16, pitch=100 * um):
    return ft.CCD((0, 0, -20 * mm), (0, 0, 1), (0, 1, 0), pitch, (pixels, pixels))


def plane_waves(scene, n, around, bounces, absorbing=0.0):
    """Scalar waves behind two faces: (wave vector, constant, amplitude), by phases that agree on the faces.

    On a plane N.x = h a wave exp(i (k.x + c)) goes on as one of k' = k + a N: c' = c - a h.
    """
    planes = []
    for surface in scene.surfaces:
        a, b, c = surface.mesh.vertices[surface.mesh.faces[0]]
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        planes.append((normal, normal @ a))

    def refract(k, plane, index):
        normal, _ = plane
        along = k - (k @ normal) * normal
        return along + np.sign(k @ normal) * math.sqrt(index**2 - along @ along) * normal

    def step(wave, plane, index):
        """Reflected and transmitted waves, s amplitudes of E."""
        k, c, a = wave
        normal, height = plane
        through, back = refract(k, plane, index), reflect(k[None], normal[None])[0]
        p, q = abs(k @ normal), abs(through @ normal)
        return (
            (back, c - (back - k) @ normal * height, a * (p - q) / (p + q)),
            (through, c - (through - k) @ normal * height, a * 2.0 * math.sqrt(p * q) / (p + q)),
        )

    wave = (np.array([0.0, 0.0, -around]), around * 20 * mm, 1.0)
    found, inside = [], step(wave, planes[0], n)[1]
    for _ in range(bounces):
        back, through = step(inside, planes[1], around)
        found.append(through)
        inside = step(back, planes[0], around)[0]
    return found


def averaged(waves, ccd, around, points=10):
    """Mean irradiance over each pixel of plane waves, by Gauss's points."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    rows, columns = ccd.shape
    x = ((np.arange(columns)[:, None] + 0.5 + 0.5 * nodes).ravel() - 0.5 * columns) * ccd.pitch
    # the CCD looks up: its columns run along normal x up
    place = ccd.centre + x[:, None] * ccd.axes[0]
    field = np.zeros(len(x), dtype=complex)
    for k, c, a in waves:
        # per area of the beam: light that arrives aslant is spread over more of the CCD
        field += (
            a
            * math.sqrt(around / -k[2])
            * math.sqrt(abs(k[2]) / around) ** 2
            * np.exp(2j * math.pi / HENE * (place @ k + c))
        )
    line = (np.abs(field) ** 2).reshape(columns, points) @ (0.5 * weights)
    return np.tile(line, (rows, 1))


@pytest.mark.parametrize(("n", "tilt"), [(1.5, 0.0), (2.0, 0.8)])
def test_fringes_of_equal_inclination(tilt, n):
    """A tilted slab lets through what Airy's sum says, everywhere."""
    thickness = 200 * um
    scene = wedge(n, thickness * math.cos(tilt), tilt)
    r = (math.cos(tilt) - math.sqrt(n**2 - math.sin(tilt) ** 2)) / (
        math.cos(tilt) + math.sqrt(n**2 - math.sin(tilt) ** 2)
    )
    depth = 200 * um * math.cos(tilt) ** 2  # faces stand z apart along the vertical
    turn = 4 * math.pi / HENE * depth * math.sqrt(n**2 - math.sin(tilt) ** 2)
    airy = 1.0 / (1.0 + 4.0 * r**2 / (1.0 - r**2) ** 2 * math.sin(0.5 * turn) ** 2)
    paths = ft.trace(scene, lit(), screen(), min_amplitude=1e-6, max_bounces=40)
    np.testing.assert_allclose(ft.irradiance(paths, HENE, "wavefront"), airy, rtol=0, atol=PIXEL)
    # light across the plane of tilt is s light
    polarised = ft.trace(scene, lit((0.0, 1.0)), screen(), min_amplitude=1e-6, max_bounces=40)
    np.testing.assert_allclose(
        ft.irradiance(polarised, HENE, "wavefront"),
        ft.irradiance(paths, HENE, "wavefront"),
        rtol=0,
        atol=1e-12,
    )


@pytest.mark.parametrize("around", [1.0, 1.33])
@pytest.mark.filterwarnings("ignore:fringes alias")
def test_fringes_of_equal_thickness(around):
    """A wedge of 0.5 mrad, between the two plane waves and more that go through it."""
    scene = wedge(1.5, 1 * mm, 0.01, 5e-4, around)
    paths = ft.trace(scene, lit(), screen(), min_amplitude=1e-7)
    waves = plane_waves(scene, 1.5, around, 6)
    expected = averaged(waves, screen(), around)
    assert np.ptp(expected) > 0.01
    np.testing.assert_allclose(ft.irradiance(paths, HENE, "wavefront"), expected, rtol=0, atol=PIXEL)


def test_irradiance_of_polarised_light_is_that_of_its_components():
    """And that of unpolarised light the mean of any two that are at right angles."""
    scene, ccd = wedge(1.8, 0.3 * mm, 0.7, 2e-4), screen(4)
    states = [(1.0, 1.0), (1.0, -1.0), (1.0, 0.0), (0.0, 1.0)]
    images = []
    for state in states:
        paths = ft.trace(scene, lit(state, shape=(4, 4)), ccd, min_amplitude=1e-6)
        images.append(ft.irradiance(paths, HENE, "wavefront"))
        field = ft.complex_field(paths, HENE, "wavefront")
        assert field.shape == (3, 4, 4)
        # light comes straight down: there is no field along it
        assert np.abs(field[2]).max() < 1e-3 * np.abs(field).max()
    sums = [images[k] + images[k + 1] for k in (0, 2)]
    np.testing.assert_allclose(sums[1], sums[0], rtol=0, atol=PIXEL)
    assert np.abs(images[2] - images[3]).max() > 0.05


def test_both_methods_agree_on_an_absorbing_slab():
    """Waves fade aslant: the index that bends them is not the material's."""
    for n, thickness in ((1.5 + 1e-4j, 0.1 * mm), (1.5 + 0.3j, 0.3 * um), (0.3 + 2j, 50 * nm)):
        scene = wedge(n, thickness, 0.5)
        paths = ft.trace(scene, lit(), screen(8, 250 * um), wavelength=HENE, min_amplitude=1e-8)
        # a ray in the middle of each pixel
        ccd = screen(12, 250 * um)
        some = ft.trace(scene, lit(size=6 * mm, shape=(24, 24)), ccd, wavelength=HENE, min_amplitude=1e-8)
        rays = ft.complex_field(some, HENE, "rays")[3:-3, 3:-3]
        waves = ft.complex_field(paths, HENE, "wavefront")
        assert np.ptp(np.abs(waves)) < PIXEL
        np.testing.assert_allclose(rays, waves[0, 0], rtol=0, atol=1e-4 * np.abs(waves).max())


# Another wavelength


@pytest.mark.parametrize("state", [None, (1.0, 0.5j)])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_another_wavelength_needs_no_new_trace_where_nothing_is_bent(state):
    """Dispersive, absorbing, coated, turned: straight through, each path as a new trace has it."""
    turn = rotation((1.0, 2.0, 3.0), 0.7)
    film = Film([(1.38, 100 * nm), (2.3, 60 * nm)])
    surfaces = [
        ft.Surface(shapes.plate(0.1, 0.1), ft.Dielectric(film=film), "front", back="BK7"),
        ft.Surface(
            shapes.plate(0.1, 0.1).moved((0, 0, -2 * mm)),
            ft.Dielectric(),
            "glue",
            front="BK7",
            back=1.6 + 1e-5j,
        ),
        ft.Surface(
            shapes.plate(0.1, 0.1).moved((0, 0, -3 * mm)),
            ft.Metal(film),
            "gold",
            front=1.6 + 1e-5j,
            back="gold",
        ),
    ]
    scene = ft.Scene([surface.moved(turn=turn) for surface in surfaces], medium="air")
    beam = ft.Beam(
        turn @ (0, 0, 10 * mm),
        turn @ (0, 0, -1),
        turn @ (0, 1, 0),
        (1 * mm, 1 * mm),
        (3, 3),
        polarisation=state,
    )
    ccd = ft.CCD(turn @ (0, 0, 12 * mm), turn @ (0, 0, -1), turn @ (0, 1, 0), 1 * mm, (3, 3))
    one, other = (ft.trace(scene, beam, ccd, wavelength=w, min_amplitude=1e-9) for w in (500 * nm, 640 * nm))
    again = at_wavelength(one, 640 * nm)
    assert again.wavelength == 640 * nm
    keys = np.intersect1d(one.key, other.key)
    assert len(keys) > 8
    for key in keys:
        a, b = again.where(again.key == key), other.where(other.key == key)
        np.testing.assert_allclose(a.length, b.length, rtol=REPHASED)
        np.testing.assert_allclose(a.index, b.index, rtol=REPHASED)
        # phases of films and metals are not in the path
        np.testing.assert_allclose(a.amplitude, b.amplitude, rtol=1e-11, atol=1e-15)
        if state is not None:
            np.testing.assert_allclose(a.field, b.field, rtol=1e-11, atol=1e-15)
    both = [ft.complex_field(paths, 640 * nm, "rays") for paths in (one, other)]
    # branches too faint at one of the two are missing there
    np.testing.assert_allclose(*both, rtol=0, atol=1e-6)
    assert np.abs(both[0] - ft.complex_field(one, 500 * nm, "rays")).max() > 0.1


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_a_prism_of_one_index_serves_all_wavelengths():
    scene = wedge(1.5, 1 * mm, 0.4, 0.1)
    one = ft.trace(scene, lit(), screen(), wavelength=500 * nm)
    other = ft.trace(scene, lit(), screen(), wavelength=600 * nm)
    fields = [ft.complex_field(paths, 600 * nm, "rays") for paths in (one, other)]
    assert (fields[0] == fields[1]).all()


# The error budget


def lens(focal, cells, exact):
    """Light in glass meets a hyperboloid: all of it goes to the focus. Paths on a plane at 0.4 f."""
    n = 1.5
    half = 0.08 * focal
    along = np.linspace(-half, half, cells)
    radius, conic = (n - 1.0) * focal, -(n**2)
    square = along**2 + along[:, None] ** 2
    height = square / (radius * (1.0 + np.sqrt(1.0 - (1.0 + conic) * square / radius**2)))
    mesh = shapes.height_map(height, 2.0 * half / (cells - 1))
    form = forms.Conic((0, 0, 0), (0, 0, 1), radius, conic) if exact else None
    scene = ft.Scene([ft.Surface(mesh, ft.Dielectric("transmitted"), "lens", form, back=1.0)], medium=n)
    beam = ft.Beam((0, 0, 0.1 * focal), (0, 0, -1), (0, 1, 0), (0.12 * focal, 0.12 * focal), (35, 33))
    ccd = ft.CCD((0, 0, -0.4 * focal), (0, 0, 1), (0, 1, 0), focal / 64, (64, 64))
    paths = ft.trace(scene, beam, ccd, record=True).detected
    away = np.hypot(np.hypot(paths.origin[:, 0], paths.origin[:, 1]), 0.6 * focal)
    return paths, paths.length - (n * 0.1 * focal + focal - away)


@pytest.mark.parametrize("cells", [17, 65])
def test_facets_of_a_lens_cost_what_the_budget_says(cells):
    """A convex lens, its vertex away from the light: z = -h(r) behind, so the mesh hangs upside down."""
    paths, error = lens(50 * mm, cells, False)
    assert len(paths) == 35 * 33
    row = cases.Row("", cases.rms(error) / HENE, facet_error(paths, HENE)[0])
    assert row.holds, row


@pytest.mark.parametrize("focal", [1e-3, 1.0, 1e3])
def test_rounding_at_a_lens_is_what_the_budget_says(focal):
    paths, error = lens(focal, 17, True)
    # the closed form is rounded as well: to one part in 1e16 of its length, the paths' error is as large
    row = cases.Row("", cases.rms(error) / HENE, hit_error(paths, HENE))
    assert 0.1 * row.truth <= row.estimate <= 10.0 * row.truth, row


def test_sampling_of_a_lens_is_what_the_budget_says():
    """Wavefront method: a converging wave behind a lens, of 12 x 12 rays; the truth has 64 x 64."""

    def seen(rays):
        beam = ft.Beam((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), (3 * mm, 3 * mm), (rays, rays))
        ccd = ft.CCD((0, 0, -20 * mm), (0, 0, 1), (0, 1, 0), 100 * um, (12, 12))
        return ft.trace(scene, beam, ccd)

    scene = lens(50 * mm, 17, True)[0].scene
    grids = [seen(rays) for rays in (24, 12, 6)]
    truth = cases.off(*(ft.complex_field(seen(rays), HENE, "wavefront") for rays in (12, 64)))
    estimate = math.hypot(sampling_error(grids, HENE, -1.0), quadrature_error(grids[1], HENE))
    row = cases.Row("", truth, estimate)
    assert row.holds, row


def test_pixels_behind_a_tilted_face():
    """A plane wave, bent at one face: the mean over a pixel is a sinc, and its error the estimated one."""
    scene = ft.Scene([face(0.0, 0.05, front=1.5, back=1.0)], medium=1.5)
    bent = math.asin(1.5 * math.sin(0.05)) - 0.05
    ccd = screen(16, 10 * um)
    paths = ft.trace(scene, lit(), ccd)
    field = ft.complex_field(paths, HENE, "wavefront")
    cycles = math.sin(bent) * 10 * um / HENE
    step = field[0, 1:] / field[0, :-1]
    np.testing.assert_allclose(np.abs(np.angle(step)), abs(2 * math.pi * cycles), rtol=0, atol=1e-5)
    q, p = math.cos(bent + 0.05), 1.5 * math.cos(0.05)
    through = 2.0 * math.sqrt(p * q) / (p + q)
    # wider behind the face, and aslant on the CCD
    spread = math.cos(0.05) / math.cos(bent + 0.05) * math.cos(bent)
    expected = through * math.sqrt(spread) * np.sinc(cycles)
    off = np.abs(field) / expected - 1.0
    row = cases.Row("", math.sqrt((off**2).mean()) / (2 * math.pi), quadrature_error(paths, HENE))
    assert row.truth < 1e-6
    assert row.holds, row


def test_bounds_hold_at_a_lens():
    """Rounding of rays that are refracted once stays within what is promised of it."""
    paths, error = lens(1.0, 17, True)
    limits = bounds(paths)
    assert (np.abs(error) <= 10.0 * limits.length + 1e-15).all()
    assert limits.length.max() < 1e-13


def test_indices_of_recorded_paths():
    """On each segment that of the medium; in an absorbing one that of the wave."""
    scene = wedge(1.5 + 0.3j, 1 * um, 0.5)
    paths = ft.trace(scene, lit(), screen(), wavelength=HENE, record=True).detected
    along = Segments.of(paths).index
    once = paths.bounces == 2
    np.testing.assert_allclose(along[once][:, [0, 2]], 1.0, rtol=0, atol=1e-14)
    kz = np.sqrt((1.5 + 0.3j) ** 2 - math.sin(0.5) ** 2)
    np.testing.assert_allclose(along[once][:, 1], math.hypot(kz.real, math.sin(0.5)), rtol=1e-14)
    assert np.abs(rounding(paths)).max() < 1e-15


def test_an_absorbing_wedge_is_darker_where_it_is_thicker():
    """Straight through a wedge: the brightness follows the way in the glass, not that of one ray."""
    faces = wedge(1.5 + 2e-5j, 1 * mm, 0.0, 0.1).surfaces
    scene = ft.Scene(
        [ft.Surface(f.mesh, ft.Dielectric("transmitted"), f.name, front=f.front, back=f.back) for f in faces]
    )
    ccd = screen(8, 1 * mm)
    image = ft.irradiance(ft.trace(scene, lit(), ccd, wavelength=HENE), HENE, "wavefront")
    fine = ft.trace(scene, lit(shape=(1, 2000)), ccd, wavelength=HENE).detected
    x, bright = fine.pixel[:, 1], np.abs(fine.amplitude) ** 2
    mean = np.array([bright[(x >= k) & (x < k + 1)].mean() for k in range(8)])
    assert np.ptp(mean) > 0.1
    # by how much a beam is wider behind the wedge is the same everywhere; 160 rays to a pixel
    part = image / mean
    np.testing.assert_allclose(part, part.mean(), rtol=1e-4)
