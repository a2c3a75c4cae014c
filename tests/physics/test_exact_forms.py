"""Mirrors with an exact form behind their facets: closed forms, and no ray lost between form and facets."""

import math

import mpmath
import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm
from fringetrace.geometry import forms, shapes

MIRROR = ft.Mirror()
# Some hundred roundings of float64, relative to the path.
ROUNDING = 1e-13
# A path of a metre is known to this, as a mirror of a metre should be.
EQUAL = 1e-12


def inverted(mesh):
    return ft.Mesh(mesh.vertices, mesh.faces[:, ::-1])


def ball(radius, level, inside=False, centre=(0.0, 0.0, 0.0), name="ball", form=True):
    mesh = shapes.icosphere(radius, level).moved(centre)
    exact = forms.Sphere(centre, radius) if form else None
    return ft.Surface(inverted(mesh) if inside else mesh, MIRROR, name, form=exact)


def directions(rng, count):
    d = rng.normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def momentum(origin, direction):
    """Distance of lines from the origin."""
    return np.linalg.norm(np.cross(origin, direction), axis=1)


def bowl(function, half, cells):
    """Mesh of a height z = function(r^2) over a square."""
    pitch = 2.0 * half / cells
    along = (np.arange(cells + 1) - 0.5 * cells) * pitch
    square = along**2 + along[:, None] ** 2
    return shapes.height_map(function(square), pitch), function(square), pitch


def to_point(paths, point):
    """Optical path to a point, and how far the rays pass from it."""
    offset = point - paths.origin
    along = np.einsum("ij,ij->i", offset, paths.direction)
    return paths.length + np.linalg.norm(offset, axis=1), np.linalg.norm(
        offset - along[:, None] * paths.direction, axis=1
    )


@pytest.mark.parametrize("kind", ["conic", "aspheric", "height field"])
def test_a_parabola_has_equal_paths_to_its_focus(kind):
    mesh, heights, pitch = bowl(lambda square: square / 4.0, 0.4, 16)  # focal length 1 m
    form = {
        "conic": forms.Conic((0, 0, 0), (0, 0, 1), 2.0, conic=-1.0),
        "aspheric": forms.Conic((0, 0, 0), (0, 0, 1), 2.0, conic=-1.0, terms=(0.0,)),
        "height field": forms.HeightField(heights, pitch),
    }[kind]
    beam = ft.Beam((0, 0, 1.5), (0, 0, -1), (0, 1, 0), (0.75, 0.75), (60, 61))
    with_form = ft.trace(ft.Scene([ft.Surface(mesh, MIRROR, form=form)]), beam)
    path, aside = to_point(with_form, np.array([0.0, 0.0, 1.0]))
    assert (with_form.bounces == 1).all()
    assert np.abs(path - 2.5).max() < EQUAL
    assert aside.max() < EQUAL
    plain, _ = to_point(ft.trace(ft.Scene([ft.Surface(mesh, MIRROR)]), beam), np.array([0.0, 0.0, 1.0]))
    assert np.abs(plain - 2.5).max() > 1e-4


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_an_ellipsoid_sends_light_from_focus_to_focus_again_and_again():
    a, b = 1.0, 0.8
    c = math.sqrt(a * a - b * b)
    sphere = shapes.icosphere(1.0, 3)
    mesh = inverted(ft.Mesh(sphere.vertices * np.array([a, b, b]), sphere.faces))
    form = forms.Conic((-a, 0, 0), (1, 0, 0), b * b / a, conic=-((c / a) ** 2))
    rng = np.random.default_rng(3)
    start = np.tile([-c, 0.0, 0.0], (2000, 1))
    rays = ft.Rays(start, directions(rng, 2000))
    scene = ft.Scene([ft.Surface(mesh, MIRROR, form=form)])
    for bounces in (1, 2, 3, 4):
        paths = ft.trace(scene, rays, max_bounces=bounces)
        assert (paths.bounces == bounces).all()
        focus = np.array([c if bounces % 2 else -c, 0.0, 0.0])
        path, aside = to_point(paths, focus)
        assert np.abs(path - 2 * a * bounces).max() < EQUAL
        assert aside.max() < EQUAL


# h, crossing of the axis from the vertex, path from the centre's plane to the paraxial focus; R = 100
SPHERE = [
    (1, 49.997499812, 149.999999750),
    (10, 49.748109237, 149.997512299),
    (30, 47.585758164, 149.805389391),
    (50, 42.264973081, 148.568224125),
]
PRINTED = 5e-10


@pytest.mark.parametrize(("height", "crossing", "length"), SPHERE)
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_aberration_of_a_spherical_mirror(height, crossing, length):
    surface = ball(100.0, 3, inside=True)
    rays = ft.Rays([(height, 0.0, 0.0)], [(0.0, 0.0, 1.0)])
    paths = ft.trace(ft.Scene([surface]), rays, max_bounces=1)
    (x, _, z), (dx, _, dz) = paths.origin[0], paths.direction[0]
    assert 100.0 - (z - x / dx * dz) == pytest.approx(crossing, abs=PRINTED)
    assert paths.length[0] + math.hypot(x, z - 50.0) == pytest.approx(length, abs=PRINTED)


def test_a_corner_cube_returns_light_exactly():
    cube = shapes.corner_cube(1.0)
    rng = np.random.default_rng(5)
    count = 1000
    direction = -np.ones(3) / math.sqrt(3.0) + 0.05 * rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    start = rng.uniform(0.2, 0.3, (count, 3)) - 0.5 * direction
    paths = ft.trace(ft.Scene([ft.Surface(cube, MIRROR)]), ft.Rays(start, direction))
    thrice = paths.bounces == 3
    assert thrice.mean() > 0.9
    assert np.abs(paths.direction + direction)[thrice].max() < 1e-15
    back = paths.length + np.einsum("ij,ij->i", start - paths.origin, paths.direction)
    assert np.abs(back + 2 * np.einsum("ij,ij->i", start, direction))[thrice].max() < 1e-15 * 16


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_error_of_facets_falls_as_the_square_and_is_the_sag():
    rays = ft.Rays(np.zeros((20_000, 3)), directions(np.random.default_rng(7), 20_000))
    table = {3: 4.528e-3, 4: 1.138e-3, 5: 2.848e-4}  # largest sag of the unit icosphere
    for level, sag in table.items():
        plain = ft.trace(ft.Scene([ball(1.0, level, True, form=False)]), rays, max_bounces=1)
        exact = ft.trace(ft.Scene([ball(1.0, level, True)]), rays, max_bounces=1)
        assert (1.0 - plain.length).max() == pytest.approx(sag, rel=0.02)
        assert np.abs(exact.length - 1.0).max() < 2**-51


def discs():
    """Two mirrors of radius 5 at (0, 0) and (13, -4) of the x-z plane, as polygons with 24 sides."""
    angle = np.arange(24) * 2 * math.pi / 24
    circle = 5.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    surfaces = []
    for i, (x, z) in enumerate([(0.0, 0.0), (13.0, -4.0)]):
        mesh = shapes.extrude(circle, 2.0, closed=True).moved((x, 0.0, z))
        form = forms.Cylinder((x, 0.0, z), (0, 1, 0), 5.0)
        surfaces.append(ft.Surface(mesh, MIRROR, f"disc {i}", form=form))
    return ft.Scene(surfaces)


def lit(scene, x):
    """Paths of rays that come down at the places x."""
    x = np.atleast_1d(x)
    start = np.stack([x, np.full_like(x, 0.123), np.full_like(x, 20.0)], axis=1)
    return ft.trace(
        scene, ft.Rays(start, np.tile([0.0, 0.0, -1.0], (len(x), 1))), record=True, max_bounces=30
    )


OUT = math.radians(60.0)
# sequence, optical path from plane to plane through the origin, dtheta / dx
DISCS = [
    ((0,), -9.659258262891, 0.4141104722),
    ((1,), -8.695156647753, 0.4141104722),
    ((0, 1), -1.607015862292, 4.565122879),
    ((1, 0), 1.738174599374, 2.451761383),
    ((0, 1, 0), 4.536115344406, 15.67927453),
    ((1, 0, 1), 4.917873538738, 13.77123123),
    ((0, 1, 0, 1), 7.245220100950, 84.78546654),
    ((1, 0, 1, 0), 9.959834448030, 31.19344062),
]


def off(paths):
    """Sine and cosine of the angle between the way out and 60 degrees."""
    dx, dz = paths.direction[:, 0], paths.direction[:, 2]
    return dz * math.cos(OUT) - dx * math.sin(OUT), dx * math.cos(OUT) + dz * math.sin(OUT)


def follows(paths, sequence):
    """Which paths met just these surfaces."""
    padded = np.full(max(paths.surface.shape[1], len(sequence)), -1)
    padded[: len(sequence)] = sequence
    if paths.surface.shape[1] < len(sequence):
        return np.zeros(len(paths), dtype=bool)
    return (paths.surface == padded).all(axis=1)


def aimed(scene, sequence):
    """Where a ray has to start to leave at 60 degrees after a sequence of discs."""
    low, high = -5.0, 18.0
    for _ in range(12):
        x = np.linspace(low, high, 20_001 if high - low > 1 else 101)
        paths = lit(scene, x)
        sine, cosine = off(paths)
        right = follows(paths, sequence) & (cosine > 0)
        turns = np.flatnonzero(right[:-1] & right[1:] & (sine[:-1] * sine[1:] <= 0))
        low, high = x[turns[0]], x[turns[0] + 1]
        if high - low < 1e-9:
            break
    (a, b) = off(lit(scene, [low, high]))[0]
    return low - a * (high - low) / (b - a)


@pytest.mark.parametrize(("sequence", "length", "spread"), DISCS)
def test_two_discs_scatter_as_printed(sequence, length, spread):
    scene = discs()
    x = aimed(scene, sequence)
    paths = lit(scene, x)
    assert follows(paths, sequence).all()
    along = np.array([math.cos(OUT), 0.0, math.sin(OUT)])
    assert paths.length[0] - 20.0 - along @ paths.origin[0] == pytest.approx(length, abs=6e-13)
    # sixth order difference of the angle over x
    weights = np.array([-1, 9, -45, 0, 45, -9, 1]) / 60.0
    step = 1e-3 / spread
    sine, cosine = off(lit(scene, x + step * np.arange(-3, 4)))
    assert abs(weights @ np.arctan2(sine, cosine) / step) == pytest.approx(spread, rel=5e-10)


@pytest.mark.parametrize("level", [1, 3])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_rays_whisper_along_a_sphere(level):
    # chords from a hundredth of the facets' sag to a diameter; the cosine at the wall stays what it is
    rng = np.random.default_rng(11)
    count, bounces = 3000, 60
    spoke = directions(rng, count)
    tangent = np.cross(spoke, directions(rng, count))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    cosine = 10.0 ** rng.uniform(-5.0, 0.0, count)
    direction = np.sqrt(1.0 - cosine**2)[:, None] * tangent - cosine[:, None] * spoke
    paths = ft.trace(
        ft.Scene([ball(1.0, level, inside=True)]),
        ft.Rays(spoke * (1.0 - 1e-14), direction),
        max_bounces=bounces,
    )
    assert (paths.fate == ft.Fate.TRUNCATED).all()
    assert (paths.bounces == bounces).all()
    # a coordinate's rounding tilts the ray by as much, and its chord 2 cos by that over the cosine
    each = np.abs(paths.length / (2.0 * bounces) - cosine) * cosine
    assert each.max() < 64 * bounces * 2**-53
    assert np.abs(np.linalg.norm(paths.origin, axis=1) - 1.0).max() < 2**-50


@pytest.mark.parametrize("radius", [0.5, 0.99, 0.9999])
@pytest.mark.filterwarnings("ignore:power is cut off")
def test_rays_between_shells_nearer_than_their_sag(radius):
    rng = np.random.default_rng(13)
    count, bounces = 1000, 100
    scene = ft.Scene([ball(1.0, 3, inside=True, name="outer"), ball(radius, 3, name="inner")])
    rays = ft.Rays(directions(rng, count) * rng.uniform(radius, 1.0, count)[:, None], directions(rng, count))
    paths = ft.trace(scene, rays, max_bounces=bounces, record=True)
    aside = momentum(rays.origin, rays.direction)
    inner = aside < radius
    chord = 2.0 * np.sqrt(1.0 - aside**2)
    chord[inner] = 0.5 * chord[inner] - np.sqrt(radius**2 - aside[inner] ** 2)
    first = np.linalg.norm(paths.points[:, 1] - paths.points[:, 0], axis=1)
    assert (paths.bounces == bounces).all()
    alternate = (paths.surface[:, 1:] != paths.surface[:, :-1]).all(axis=1)
    clear = np.abs(aside - radius) > 1e-9
    assert (alternate == inner)[clear].all()
    assert (paths.surface[~inner & clear] == 0).all()
    worst = np.abs(paths.length - first - (bounces - 1) * chord) * np.abs(aside - radius) ** 0.5
    assert worst[clear].max() < 1e-11


def test_a_ball_casts_the_shadow_of_its_form():
    rng = np.random.default_rng(17)
    count = 20_000
    aside = np.concatenate([1.0 - 10.0 ** rng.uniform(-9, -2, count // 2), rng.uniform(0, 1.1, count // 2)])
    turn = rng.uniform(0.0, 2.0 * math.pi, count)
    start = np.stack([aside * np.cos(turn), aside * np.sin(turn), np.full(count, 5.0)], axis=1)
    scene = ft.Scene([ball(1.0, 2)])
    paths = ft.trace(scene, ft.Rays(start, np.tile([0.0, 0.0, -1.0], (count, 1))))
    assert (paths.bounces == (aside < 1.0)).all()
    met = aside < 1.0
    cosine = np.sqrt(1.0 - aside[met] ** 2)
    assert (np.abs(paths.length[met] - 5.0 + cosine) * cosine).max() < 2**-50
    out = 2.0 * cosine**2 - 1.0  # reflected by twice the angle
    assert np.abs(paths.direction[met, 2] - out).max() < 2**-48


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_light_splits_at_both_sides_of_a_form():
    # a ball of splitter: reflected once, or through, and then out or on inside along equal chords
    mesh = shapes.icosphere(1.0, 2)
    scene = ft.Scene([ft.Surface(mesh, ft.BeamSplitter(), form=forms.Sphere((0, 0, 0), 1.0))])
    aside = np.random.default_rng(19).uniform(0.0, 0.999, 500)
    start = np.stack([aside, 0 * aside, np.full_like(aside, 5.0)], axis=1)
    paths = ft.trace(
        scene, ft.Rays(start, np.tile([0.0, 0.0, -1.0], (500, 1))), max_bounces=6, min_amplitude=0.0
    )
    half = np.sqrt(1.0 - aside[paths.ray] ** 2)
    assert len(paths) == 7 * 500  # out after 1 to 6 bounces, and still inside
    assert np.abs(paths.length - (5.0 - half) - 2.0 * half * (paths.bounces - 1)).max() < 1e-12
    assert paths.ledger().error < 1e-12


def test_an_asphere_where_mpmath_finds_it():
    radius, conic, terms = -0.3, -0.6, (0.4, -3.0)
    mesh, _, _ = bowl(
        lambda q: q / radius / (1 + np.sqrt(1 - (1 + conic) * q / radius**2)) + 0.4 * q**2 - 3.0 * q**3,
        0.12,
        12,
    )
    scene = ft.Scene([ft.Surface(mesh, MIRROR, form=forms.Conic((0, 0, 0), (0, 0, 1), radius, conic, terms))])
    rng = np.random.default_rng(23)
    start = np.concatenate([rng.uniform(-0.1, 0.1, (40, 2)), np.full((40, 1), 0.2)], axis=1)
    rays = ft.Rays(start, np.array([0.0, 0.0, -1.0]) + 0.05 * rng.normal(size=(40, 3)))
    paths = ft.trace(scene, rays)
    assert (paths.bounces == 1).all()
    with mpmath.workdps(40):

        def height(q):
            c, k = 1 / mpmath.mpf(radius), mpmath.mpf(conic)
            sag = c * q / (1 + mpmath.sqrt(1 - (1 + k) * c * c * q))
            return sag + mpmath.mpf(terms[0]) * q**2 + mpmath.mpf(terms[1]) * q**3

        for i in range(40):
            o = [mpmath.mpf(v) for v in rays.origin[i]]
            d = [mpmath.mpf(v) for v in rays.direction[i]]
            scale = mpmath.sqrt(sum(v * v for v in d))
            d = [v / scale for v in d]
            at = lambda t, o=o, d=d: [o[k] + t * d[k] for k in range(3)]  # noqa: E731
            root = mpmath.findroot(
                lambda t, at=at: at(t)[2] - height(at(t)[0] ** 2 + at(t)[1] ** 2), mpmath.mpf(paths.length[i])
            )
            p = at(root)
            slope = mpmath.diff(height, p[0] ** 2 + p[1] ** 2)
            n = [-2 * slope * p[0], -2 * slope * p[1], mpmath.mpf(1)]
            size = mpmath.sqrt(sum(v * v for v in n))
            along = sum(d[k] * n[k] for k in range(3)) / size
            out = [d[k] - 2 * along * n[k] / size for k in range(3)]
            assert abs(paths.length[i] - root) < 1e-15
            assert max(abs(paths.direction[i, k] - out[k]) for k in range(3)) < 1e-14


def test_a_height_field_comes_nearer_as_the_fourth_power():
    def wave(x, y):
        return 20e-6 * np.sin(2 * math.pi * x / 4e-3) * np.cos(2 * math.pi * y / 5e-3 + 0.3)

    worst = []
    start = np.concatenate(
        [np.random.default_rng(29).uniform(-3 * mm, 3 * mm, (4000, 2)), np.full((4000, 1), 0.01)], 1
    )
    for cells in (32, 64):
        pitch = 8 * mm / cells
        along = (np.arange(cells + 1) - 0.5 * cells) * pitch
        heights = wave(along, along[:, None])
        form = forms.HeightField(heights, pitch)
        scene = ft.Scene([ft.Surface(shapes.height_map(heights, pitch), MIRROR, form=form)])
        paths = ft.trace(scene, ft.Rays(start, np.tile([0.0, 0.0, -1.0], (4000, 1))))
        assert (paths.bounces == 1).all()
        worst.append(np.abs(0.01 - paths.length - wave(start[:, 0], start[:, 1])).max())
    assert worst[0] / worst[1] > 14.0


def test_ends_of_a_rod_stay_flat():
    angle = np.arange(12) * 2 * math.pi / 12
    rod = shapes.extrude(np.stack([np.cos(angle), np.sin(angle)], axis=1), 4.0, closed=True)
    form = forms.Cylinder((0, 0, 0), (0, 1, 0), 1.0)
    # the ends: two fans
    rim = [np.flatnonzero(rod.vertices[:, 1] == y) for y in np.unique(rod.vertices[:, 1])]
    fans = []
    for ring in rim:
        order = ring[np.argsort(np.arctan2(rod.vertices[ring, 2], rod.vertices[ring, 0]))]
        fans += [(order[0], order[i], order[i + 1]) for i in range(1, len(order) - 1)]
    capped = ft.Mesh(rod.vertices, np.concatenate([rod.faces, fans]))
    rays = ft.Rays([(0.3, 5.0, 0.2), (0.3, 0.1, 5.0)], [(0, -1, 0), (0, 0, -1)])
    paths = ft.trace(ft.Scene([ft.Surface(capped, MIRROR, form=form)]), rays)
    assert paths.length == pytest.approx([3.0, 5.0 - math.sqrt(1 - 0.09)], rel=1e-15)


def test_the_flat_back_of_a_lens_stays_flat():
    # a cap of few facets and the fan behind it in one mesh: all vertices lie on the sphere
    angle = np.arange(8) * 2 * math.pi / 8
    rim = np.stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), np.full(8, math.sqrt(1 - 0.09))], axis=1)
    vertices = np.concatenate([rim, [(0.0, 0.0, 1.0)]])
    cap = [(i, (i + 1) % 8, 8) for i in range(8)]
    back = [(0, i + 1, i) for i in range(1, 7)]
    surface = ft.Surface(ft.Mesh(vertices, cap + back), MIRROR, form=forms.Sphere((0, 0, 0), 1.0))
    rays = ft.Rays([(0.1, 0.05, 2.0), (0.1, 0.05, 0.0)], [(0, 0, -1), (0, 0, 1)])
    paths = ft.trace(ft.Scene([surface]), rays)
    assert paths.length == pytest.approx([2.0 - math.sqrt(1 - 0.0125), math.sqrt(1 - 0.09)], rel=1e-15)


@pytest.mark.parametrize("form", ["height field", pytest.param("smooth", marks=pytest.mark.slow)])
def test_no_ray_falls_through_waves(form):
    # 20 facets a wave, slopes up to 32 degrees
    rng = np.random.default_rng(37)
    cells, count = 80, 10_000
    pitch = 2.0 / cells
    x = (np.arange(cells + 1) - 0.5 * cells) * pitch
    heights = 0.05 * np.sin(4 * math.pi * x)[None, :] * np.cos(4 * math.pi * x)[:, None]
    exact = forms.HeightField(heights, pitch) if form == "height field" else forms.Smooth()
    scene = ft.Scene([ft.Surface(shapes.height_map(heights, pitch), MIRROR, form=exact)])
    start = np.concatenate([rng.uniform(-0.6, 0.6, (count, 2)), np.full((count, 1), 0.2)], axis=1)
    steep = np.stack([*rng.normal(0, 0.5, (2, count)), -np.ones(count)], axis=1)
    paths = ft.trace(scene, ft.Rays(start, steep), max_bounces=60)
    down = paths.direction[:, 2] < 0.0
    with np.errstate(divide="ignore"):
        reach = (-0.1 - paths.origin[:, 2]) / paths.direction[:, 2]
    landing = paths.origin + reach[:, None] * paths.direction
    assert not (down & (np.abs(landing[:, :2]).max(axis=1) < 0.97)).any()


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_results_with_forms_do_not_depend_on_threads_or_chunks():
    rng = np.random.default_rng(31)
    rays = ft.Rays(rng.uniform(-0.3, 0.3, (1000, 3)), directions(rng, 1000))
    scene = ft.Scene([ball(1.0, 2, inside=True), ball(0.1, 1, name="core")])
    one = ft.trace(scene, rays, threads=1, chunk=1000)
    other = ft.trace(scene, rays, threads=3, chunk=71)
    assert (one.length == other.length).all()
    assert (one.origin == other.origin).all()
    assert (one.direction == other.direction).all()
