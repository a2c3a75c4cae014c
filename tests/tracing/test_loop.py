"""The passes through matter: branches, keys, records, chunks and threads, ledgers, contradictions."""

import math
import pickle

import glass
import numpy as np
import pytest
from columns import BARE
from hypothesis import example, given, settings, strategies as st

import fringetrace as ft
from fringetrace import Fate, nm, um
from fringetrace.geometry import forms, shapes
from fringetrace.optics.films import Film
from fringetrace.tracing.checks import Losses
from fringetrace.tracing.detection import project
from fringetrace.tracing.paths import COLUMNS, join

# Rays are cut off on purpose: what becomes of them is looked at here, that it is warned of in `test_checks`.
pytestmark = pytest.mark.filterwarnings("ignore:power is cut off")

LEDGER = 1e-12
MATTER = ("medium", "index", "lengths", "field", "dropped", "bend")


def globe(index=1.5, interface=None, radius=0.5, centre=(0.0, 0.0, 0.0), name="ball", front=None, level=2):
    mesh = shapes.icosphere(radius, level).moved(centre)
    return ft.Surface(
        mesh, interface or ft.Dielectric(), name, forms.Sphere(centre, radius), front=front, back=index
    )


def beam(side=9, polarisation=None, profile=None, size=1.4):
    return ft.Beam(
        (0, 0, 2.0),
        (0.05, 0.02, -1),
        (0, 1, 0),
        (size, size),
        (side, side),
        profile,
        polarisation=polarisation,
    )


def crowd():
    """A ball in an absorbing shell's place, a splitter, a mirror, a film, a metal: all branches at once."""
    film = Film([(2.3, 60 * nm), (1.38, 95 * nm)])
    return ft.Scene(
        [
            globe(1.5 + 1e-8j, radius=0.4),
            ft.Surface(shapes.plate(3.0, 3.0).moved((0, 0, 1.0)), ft.BeamSplitter(), "splitter"),
            ft.Surface(
                shapes.plate(3.0, 3.0).moved((0, 0, -1.0)), ft.Dielectric(film=film), "coat", back="BK7"
            ),
            ft.Surface(
                shapes.plate(3.0, 3.0).moved((0, 0, -1.5)), ft.Metal(), "gold", front="BK7", back="gold"
            ),
        ],
        medium="air",
    )


def same(one, other, names=COLUMNS):
    for name in names:
        a, b = getattr(one, name), getattr(other, name)
        assert (a is None) == (b is None), name
        if a is not None:
            np.testing.assert_array_equal(a, b, err_msg=name)


@pytest.mark.parametrize(("polarisation", "record"), [(None, True), ((1.0, 0.3j), False)])
def test_same_bits_for_any_chunk_and_number_of_threads(polarisation, record):
    scene, light = crowd(), beam(5, polarisation, ft.Gaussian(0.7))
    settings = {"wavelength": 600 * nm, "max_bounces": 7, "min_amplitude": 1e-3}
    whole = ft.trace(scene, light, record=record, threads=1, chunk=1000, **settings)
    assert len(whole) > 200
    assert whole.ledger().error < LEDGER
    for chunk, threads in ((1, 2), (11, 1)):
        other = ft.trace(scene, light, record=record, threads=threads, chunk=chunk, **settings)
        same(whole, other)
        assert other.segments == whole.segments
        np.testing.assert_array_equal(other.contradictions, whole.contradictions)
    bare = ft.trace(scene, light, record=not record, **settings)
    same(whole, bare, (*BARE, "medium", "index", "lengths", "dropped", "bend"))


def test_stream_join_where_and_pickle():
    scene, light = crowd(), beam(7, (1.0, 1j))
    settings = {"wavelength": 600 * nm, "max_bounces": 6, "min_amplitude": 1e-2}
    whole = ft.trace(scene, light, **settings)
    parts = list(ft.stream(scene, light, chunk=10, **settings))
    assert len(parts) == 5
    same(join(parts), whole)
    assert join(parts).incident == whole.incident
    some = whole.where(whole.fate == Fate.LEFT)
    for name in MATTER:
        np.testing.assert_array_equal(getattr(some, name), getattr(whole, name)[whole.fate == Fate.LEFT])
    again = pickle.loads(pickle.dumps(whole))
    same(again, whole)
    assert again.wavelength == whole.wavelength
    assert again.sequence(3) == whole.sequence(3)


def test_no_rays_at_all():
    for field in (None, np.empty((0, 3))):
        rays = ft.Rays(np.empty((0, 3)), np.empty((0, 3)), polarisation=field)
        paths = ft.trace(crowd(), rays, wavelength=600 * nm, record=True)
        assert len(paths) == 0
        assert paths.lengths.shape == (0, 4)
        assert (paths.field is None) == (field is None)


def test_keys_and_records_tell_the_same():
    paths = ft.trace(crowd(), beam(5), wavelength=600 * nm, max_bounces=6, min_amplitude=1e-2, record=True)
    visits = [paths.visits(k) for k in range(4)]
    for row in range(len(paths)):
        told = paths.sequence(row)
        recorded = paths.surface[row][paths.surface[row] >= 0]
        assert [k for k, _ in told] == recorded.tolist()
        assert len(told) == paths.bounces[row]
        assert [told_k for told_k, _ in told].count(2) == visits[2][row]
        assert paths.reflections[row] == 0  # the only mirror is of metal
        points = paths.polyline(row)
        assert len(points) == 1 + paths.bounces[row] + (paths.fate[row] == Fate.DETECTED)
        if paths.fate[row] == Fate.LEFT:
            way = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
            assert paths.lengths[row].sum() == pytest.approx(way, rel=1e-13)


def test_lengths_in_each_medium_make_the_path():
    """Where waves do not fade the optical path is the sum of index times way."""
    scene = ft.Scene([globe(1.5), globe(1.8, centre=(0, 0, -1.2), name="other")], medium=1.2)
    paths = ft.trace(scene, beam(), min_amplitude=1e-3)
    assert paths.lengths.shape[1] == 3
    np.testing.assert_allclose(paths.lengths @ [1.2, 1.5, 1.8], paths.length, rtol=1e-14)
    assert (paths.bend <= 1.0).all()
    assert paths.bend.max() > 0.9


@pytest.mark.parametrize("polarisation", [None, (0.6, 0.8j)])
def test_what_is_not_followed_is_truncated(polarisation):
    light = beam(9, polarisation)
    both = ft.trace(ft.Scene([globe()]), light, min_amplitude=0.0, max_bounces=3)
    for follow, through in (("reflected", False), ("transmitted", True)):
        paths = ft.trace(
            ft.Scene([globe(1.5, ft.Dielectric(follow))]), light, min_amplitude=0.0, max_bounces=3
        )
        ledger = paths.ledger()
        assert ledger.error < LEDGER
        assert ledger.truncated > 0.01 * ledger.incident
        assert abs(ledger.absorbed) < LEDGER * ledger.incident
        assert len(paths) == 81
        assert {t for row in range(81) for _, t in paths.sequence(row)} == {through}
        # what is followed is the same as where both are
        rows = [
            np.flatnonzero((both.ray == ray) & (both.key == key))[0]
            for ray, key in zip(paths.ray, paths.key, strict=True)
        ]
        np.testing.assert_array_equal(paths.amplitude, both.amplitude[rows])
        np.testing.assert_array_equal(paths.length, both.length[rows])


def test_total_reflection_where_only_transmitted_light_is_followed():
    """There is none: the ray ends, its power is dropped."""
    scene = ft.Scene(
        [ft.Surface(shapes.plate(1, 1), ft.Dielectric("transmitted"), "face", back=1.0)], medium=1.5
    )
    paths = ft.trace(scene, glass.aimed(1.0))
    assert paths.fate.tolist() == [Fate.ABSORBED]
    assert paths.amplitude.tolist() == [0.0]
    assert paths.ledger().truncated == pytest.approx(1.0, abs=LEDGER)
    assert paths.ledger().error < LEDGER


def test_least_amplitude_and_most_bounces():
    scene = glass.stack([1.0, 1.5, 1.0], [0.01])
    for least in (1e-2, 1e-4, 1e-8):
        paths = ft.trace(scene, glass.aimed(0.0), min_amplitude=least, max_bounces=60)
        faint = paths.fate == Fate.FAINT
        assert faint.sum() >= 1
        assert (np.abs(paths.amplitude[faint]) < least).all()
        assert (np.abs(paths.amplitude[~faint]) >= least).all()
        assert paths.ledger().error < LEDGER
        assert paths.ledger().truncated == pytest.approx((np.abs(paths.amplitude[faint]) ** 2).sum())
    for most in range(4):
        paths = ft.trace(scene, glass.aimed(0.0), max_bounces=most, min_amplitude=0.0)
        assert paths.bounces.max() == most
        assert ((paths.bounces == most) == (paths.fate == Fate.TRUNCATED)).any()
        assert (paths.bounces[paths.fate == Fate.TRUNCATED] == most).all()
        assert paths.ledger().error < LEDGER


def test_amplitudes_are_relative_to_what_is_launched():
    scene = glass.stack([1.0, 1.5 + 1e-6j, 1.0], [10 * um])
    one, many = (
        ft.trace(
            scene,
            ft.Rays([(0, 0, 1)], [(0.1, 0, -1)], amplitude=[a], polarisation=[(0, 1, 0)]),
            wavelength=600 * nm,
        )
        for a in (1.0, 30j)
    )
    np.testing.assert_allclose(many.field, 30j * one.field, rtol=1e-15)
    np.testing.assert_allclose(many.amplitude, 30 * one.amplitude, rtol=1e-15)
    np.testing.assert_allclose(many.lost, 900 * one.lost, rtol=1e-15)
    assert many.ledger().error < LEDGER


@pytest.mark.parametrize("polarisation", [None, (1.0, 1.0)])
def test_a_beam_in_a_dense_medium_that_absorbs(polarisation):
    """Damping along the way, to the CCD as well; path in vacuum wavelengths."""
    scene = ft.Scene(
        [ft.Surface(shapes.plate(1, 1).moved((0, 0, -1.0)), ft.Mirror(), "m")], medium=1.33 + 2e-8j
    )
    light = ft.Beam((0, 0, 1.0), (0, 0, -1), (0, 1, 0), (0.1, 0.1), (2, 2), polarisation=polarisation)
    ccd = ft.CCD((0, 0, 0.5), (0, 0, -1), (0, 1, 0), 0.1, (2, 2))
    paths = ft.trace(scene, light, ccd, wavelength=600 * nm)
    k0 = 2 * math.pi / (600 * nm)
    assert (paths.fate == Fate.DETECTED).all()
    np.testing.assert_allclose(paths.length, 1.33 * 3.5, rtol=1e-15)
    expected = math.exp(-k0 * 2e-8 * 3.5)
    if polarisation is None:
        np.testing.assert_allclose(paths.amplitude, -expected, rtol=1e-14)
    else:
        np.testing.assert_allclose(
            paths.field,
            -expected * np.tile(light.polarisation @ light.axes[:2], (4, 1)),
            rtol=1e-14,
            atol=1e-16,
        )
    assert paths.ledger().error < LEDGER
    assert paths.ledger().absorbed == pytest.approx(0.01 * (1.0 - expected**2), rel=1e-12)


def test_contradictions_are_counted_and_told():
    # rays start inside of what they take for a vacuum
    with pytest.warns(ft.FringetraceWarning, match="media contradict: 1 rays came to 'ball'"):
        inside = ft.trace(ft.Scene([globe()]), ft.Rays([(0, 0, 0)], [(0, 0, 1.0)]))
    assert inside.contradictions.tolist() == [1]
    text = Losses.of(inside).problems["media contradict"]
    assert text == (
        "media contradict: 1 rays came to 'ball', between vacuum and n=1.5 (front and back), in another "
        "medium; close its mesh, turn its normals to the front, name the media of what lies before it, or "
        "take the "
        "bodies apart where they overlap"
    )
    # normals the wrong way round
    mesh = shapes.icosphere(0.5, 2)
    turned = ft.Scene(
        [ft.Surface(ft.Mesh(mesh.vertices, mesh.faces[:, ::-1]), ft.Dielectric(), "inside out", back=1.5)]
    )
    with pytest.warns(ft.FringetraceWarning, match="media contradict: .* rays came to 'inside out'"):
        paths = ft.trace(turned, ft.Rays([(0, 0, 2.0)], [(0, 0, -1.0)]))
    assert paths.contradictions[0] > 0
    assert paths.ledger().error < LEDGER
    # overlapping bodies
    two = ft.Scene([globe(), globe(1.8, centre=(0, 0, -0.5), name="other")])
    with pytest.warns(ft.FringetraceWarning, match="media contradict: .* rays came to '(ball|other)'"):
        paths = ft.trace(two, ft.Rays([(0.1, 0, 2.0)], [(0, 0, -1.0)]))
    assert paths.contradictions.sum() > 0
    # well set
    fine = ft.trace(ft.Scene([globe(1.5), globe(1.8, centre=(0, 0, -1.2), name="other")], medium=1.2), beam())
    assert not fine.contradictions.any()
    assert "media contradict" not in Losses.of(fine).problems
    # of one index, by another name
    named = ft.trace(ft.Scene([globe(1.5, front=1.0)]), beam())
    assert not named.contradictions.any()
    assert Losses.of(ft.trace(ft.Scene([ft.Surface(mesh, ft.Mirror())]), beam())).problems == {}


def test_a_ball_in_a_ball_needs_its_media_named():
    shell = ft.Scene([globe(1.5), globe(1.33, radius=0.3, front=1.5, name="core")])
    assert not ft.trace(shell, beam(), max_bounces=20, min_amplitude=1e-3).contradictions.any()
    plain = ft.Scene([globe(1.5), globe(1.33, radius=0.3, name="core")])
    with pytest.warns(ft.FringetraceWarning, match="media contradict: .* rays came to '(ball|core)'"):
        assert ft.trace(plain, beam(), max_bounces=20, min_amplitude=1e-3).contradictions[1] > 0


@pytest.mark.parametrize("polarisation", [None, (1.0, 0.5)])
def test_projected_light_is_that_of_a_trace_to_the_ccd(polarisation):
    scene = ft.Scene([globe("BK7")], medium="water")
    light = beam(9, polarisation)
    ccd = ft.CCD((0, 0, -2.0), (0, 0, 1), (0, 1, 0), 0.1, (30, 30), focus=-0.1)
    there = ft.trace(scene, light, ccd, wavelength=600 * nm)
    later = project(ft.trace(scene, light, wavelength=600 * nm), ccd)
    for name in ("fate", "length", "origin", "lengths", "field", "amplitude"):
        if getattr(there, name) is not None:
            np.testing.assert_allclose(getattr(later, name), getattr(there, name), rtol=1e-14, atol=1e-14)
    murky = ft.Scene([globe()], medium=ft.materials.constant(1.3 + 1e-9j, "murk"))
    paths = ft.trace(murky, light, wavelength=600 * nm)
    with pytest.raises(ValueError, match="project: expected a transparent medium, got murk"):
        project(paths, ccd)


def test_mirrors_and_splitters_in_a_medium_as_in_a_vacuum():
    """The same amplitudes by the way through matter as by that without, scalar and polarised."""
    mirror = ft.Surface(shapes.plate(3, 3).moved((0, 0, -1)), ft.Mirror(0.9), "m")
    surfaces = (crowd().surfaces[1], mirror)
    plain = ft.trace(ft.Scene(surfaces), beam(), max_bounces=8)
    dense = ft.trace(ft.Scene(surfaces, medium=1.5), beam(), max_bounces=8)
    same(plain, dense, ("fate", "bounces", "reflections", "key", "ray"))
    np.testing.assert_allclose(dense.amplitude, plain.amplitude, rtol=1e-14)
    np.testing.assert_allclose(dense.length, 1.5 * plain.length, rtol=1e-14)
    np.testing.assert_allclose(dense.lost, plain.lost, rtol=1e-12, atol=1e-15)
    field = ft.trace(ft.Scene(surfaces), beam(9, (1.0, 0.0)), max_bounces=8)
    np.testing.assert_allclose(field.amplitude, np.abs(plain.amplitude), rtol=1e-13)


def test_reversing_a_path_gives_it_back():
    """Source and exit change places: the same way, the same optical path, the transposed Jones matrix."""
    random = np.random.default_rng(1)
    film = Film([(2.3, 60 * nm), (1.38 + 0.1j, 95 * nm)])
    scene = ft.Scene(
        [globe(1.5, ft.Dielectric(film=film)), globe(1.8, centre=(0.1, 0, -1.2), name="other")], medium=1.2
    )
    start, direction = np.array([0.21, 0.13, 2.0]), np.array([0.05, 0.02, -1.0])
    direction /= np.linalg.norm(direction)
    u = np.cross(direction, random.normal(size=3))
    basis = np.stack([u / np.linalg.norm(u), np.cross(direction, u / np.linalg.norm(u))])
    settings = {"wavelength": 600 * nm, "max_bounces": 5, "min_amplitude": 1e-5}
    scalar = ft.trace(scene, ft.Rays([start], [direction]), **settings)
    fields = [ft.trace(scene, ft.Rays([start], [direction], polarisation=[e]), **settings) for e in basis]
    tried = 0
    for row in np.flatnonzero((scalar.fate == Fate.LEFT) & (np.abs(scalar.amplitude) > 1e-3)):
        end = scalar.origin[row] + 1.5 * scalar.direction[row]
        out = -scalar.direction[row]
        v = np.cross(out, random.normal(size=3))
        states = np.stack([v / np.linalg.norm(v), np.cross(out, v / np.linalg.norm(v))])
        key = tuple(reversed(scalar.sequence(row)))
        back = ft.trace(scene, ft.Rays([end], [out]), **settings)
        its = next(
            k for k in range(len(back)) if tuple(back.sequence(k)) == key and back.fate[k] == Fate.LEFT
        )
        np.testing.assert_allclose(back.direction[its], -direction, rtol=0, atol=1e-10)
        ahead = (start - back.origin[its]) @ -direction
        assert back.length[its] + 1.2 * ahead == pytest.approx(scalar.length[row] + 1.2 * 1.5, rel=1e-12)
        assert back.amplitude[its] == pytest.approx(scalar.amplitude[row], rel=1e-9)
        matrix = np.array([[states[j] @ fields[i].field[row] for i in (0, 1)] for j in (0, 1)])
        other = np.array(
            [
                [
                    basis[i] @ ft.trace(scene, ft.Rays([end], [out], polarisation=[e]), **settings).field[its]
                    for e in states
                ]
                for i in (0, 1)
            ]
        )
        np.testing.assert_allclose(other, matrix.T, rtol=0, atol=1e-9)
        tried += 1
    assert tried > 3


indices = st.floats(1.0, 3.0)


@given(
    first=indices, second=indices, around=indices,
    state=st.tuples(st.floats(-1, 1), st.floats(0.01, 1), st.floats(0, 6)),
    film=st.lists(st.tuples(indices, st.floats(0.0, 500.0)), max_size=2), polarised=st.booleans(),
    slope=st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
)  # fmt: skip
@example(
    first=1.5, second=1.0, around=1.0, state=(0.0, 1.0, 0.0), film=[], polarised=False, slope=(0.0, -2e-313)
)
@settings(max_examples=15)
def test_power_adds_up(first, second, around, state, film, polarised, slope):
    """In lossless scenes nothing is absorbed, at any angle, state and index."""
    coat = Film([(n, d * nm) for n, d in film])
    scene = ft.Scene(
        [globe(first, ft.Dielectric(film=coat)), globe(second, centre=(0, 0, -1.2), name="other")],
        medium=around,
    )
    jones = (state[0], state[1] * np.exp(1j * state[2])) if polarised else None
    light = ft.Beam((0, 0, 2.0), (*slope, -1.0), (0, 1, 0), (1.5, 1.5), (4, 4), polarisation=jones)
    paths = ft.trace(scene, light, wavelength=600 * nm, min_amplitude=1e-3, max_bounces=10)
    ledger = paths.ledger()
    assert ledger.error < LEDGER
    assert abs(ledger.absorbed) < LEDGER * ledger.incident


def test_keys_of_further_branches():
    """Digits of an element with several branches stand behind those of all surfaces; records follow."""
    orders = ft.gratings.Grating((1, 0, 0), 20 * um, (-1, 0, 1, 2))
    reflecting = ft.gratings.Grating((1, 0, 0), 30 * um, (0, 1), reflects=True)
    shear = ft.birefringent.ShearPlate((1, 0, 1), 1e-3, 1.66, 1.49)
    plates = [shapes.plate(3, 3).moved((0, 0, 0.5 - 0.25 * k)) for k in range(3)]
    surfaces = [
        ft.Surface(plate, element, f"element {k}")
        for k, (plate, element) in enumerate(zip(plates, (orders, shear, reflecting), strict=True))
    ]
    scene = ft.Scene(surfaces)
    assert len(scene.digits) == 6 + 3 + 1 + 1
    paths = ft.trace(scene, beam(3, (1.0, 0.4j)), wavelength=600 * nm, max_bounces=4, record=True)
    assert paths.ledger().error < LEDGER
    assert len(np.unique(paths.key)) > 20
    for row in range(len(paths)):
        told, recorded = paths.sequence(row), paths.surface[row][paths.surface[row] >= 0]
        assert [k for k, _ in told] == recorded.tolist()
        # one more point where the shear plate displaces light
        assert len(paths.polyline(row)) == 1 + len(told) + recorded.tolist().count(1)
    for k in range(3):
        expected = (paths.surface == k).sum(axis=1)
        np.testing.assert_array_equal(paths.visits(k), expected)
    for chunk in (1, 4):
        same(
            paths,
            ft.trace(
                scene, beam(3, (1.0, 0.4j)), wavelength=600 * nm, max_bounces=4, record=True, chunk=chunk
            ),
        )
    # neighbours of one key took the same branch: a direction each
    first = paths.where(paths.bounces >= 1)
    for key in np.unique(first.key):
        ways = first.direction[first.key == key]
        assert np.ptp(ways, axis=0).max() < 1e-12


numbers = st.one_of(
    st.floats(1e-3, 5.0),
    st.sampled_from([1.0, 1.5, 1e-6, 1e6, 1e-3j, 1e3j, 1e6j, 1.5 + 1e-12j, 0.2 + 3.4j, 1 + 1e4j]),
)


@given(
    one=numbers, two=numbers, around=numbers, turned=st.booleans(), formed=st.booleans(),
    metal=st.booleans(),
    film=st.lists(st.tuples(numbers, st.sampled_from([0.0, 1e-12, 1e-7, 1e-3, 10.0])), max_size=2),
    wavelength=st.sampled_from([1e-12, 1e-9, 5e-7, 1.0, 1e6]),
    jones=st.sampled_from([None, (1, 0), (1, 1j), (1e-100, 1e-100)]),
    start=st.sampled_from([(0.0, 0, 2), (0.0, 0, 0), (0.5, 0, 0.0), (0.0, 0, 0.5), (0.0, 0.0, -0.7)]),
    way=st.sampled_from([(0.0, 0, -1), (1.0, 0, 0), (0.3, 0.2, -1), (0.25, 0, -1), (1e-9, 0, -1)]),
)  # fmt: skip
@settings(max_examples=20)
@pytest.mark.filterwarnings("ignore:media contradict")
def test_nothing_crashes(one, two, around, turned, formed, metal, film, wavelength, jones, start, way):
    """Bodies that overlap, normals inside out, any index and wavelength, rays on faces and in glass."""
    mesh = shapes.icosphere(0.5, 1)
    if turned:
        mesh = ft.Mesh(mesh.vertices, mesh.faces[:, ::-1])
    coat = Film(film)
    form = forms.Sphere((0, 0, 0), 0.5) if formed else None
    kind = ft.Metal(coat) if metal else ft.Dielectric(film=coat)
    surfaces = [
        ft.Surface(mesh, kind, "one", form, back=one),
        ft.Surface(shapes.icosphere(0.5, 1).moved((0, 0, -0.5)), ft.Dielectric(), "two", back=two),
    ]
    light = ft.Beam(start, way, (0, 1, 0), (1.2, 1.2), (3, 3), polarisation=jones)
    paths = ft.trace(
        ft.Scene(surfaces, medium=around), light, wavelength=wavelength, max_bounces=6, record=True
    )
    for name in ("amplitude", "length", "lost", "direction", "origin", "index", "lengths", "dropped", "bend"):
        assert np.isfinite(getattr(paths, name)).all(), name
    if paths.field is not None:
        assert np.isfinite(paths.field).all()
    np.testing.assert_allclose(np.linalg.norm(paths.direction, axis=1), 1.0, rtol=0, atol=1e-9)
    if not any(complex(n).imag for n in (one, two, around, *(n for n, _ in film))):
        assert paths.ledger().error < LEDGER


def test_waves_in_absorbing_rods_bring_no_power_of_their_own():
    # a wave that fades along a face, taken as endless, was reflected with more power than it brought
    rods = ft.shapes.rod_lattice(2, 2, 65e-9, 150e-9, 2e-6)
    rods = rods.moved(-rods.bounds.mean(axis=0))
    scene = ft.Scene([ft.Surface(rods, ft.Dielectric(), back=1.74 + 0.088j)], medium=1.555)
    beam = ft.Beam((0, 0, 1e-6), (0, 0, -1), (0, 1, 0), (0.25e-6, 0.1e-6), (1, 40))
    paths = ft.trace(scene, beam, wavelength=500e-9, max_bounces=60, min_amplitude=1e-3)
    ledger = paths.ledger()
    assert ledger.error < 1e-12
    assert (np.abs(paths.amplitude) <= 1.0).all()
    assert 0.2 * ledger.incident < ledger.absorbed < ledger.incident
    assert ledger.truncated < 1e-3 * ledger.incident
