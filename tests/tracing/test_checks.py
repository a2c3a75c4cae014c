"""Warnings of a trace: each names the place, the number and the remedy, and comes once."""

import re
import warnings

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import degree, mm, nm, scattering, shapes
from fringetrace.tracing import join
from fringetrace.tracing.checks import CUT, EACH, Losses, warn_of_crowd

BALL = shapes.icosphere(1 * mm, 2)
BEAM = ft.Beam((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), (1 * mm, 1 * mm), (20, 20))
CCD = ft.CCD((0, 0, -5 * mm), (0, 0, 1), (0, 1, 0), 0.05 * mm, (40, 40))
FOLLOWED = {"max_bounces": 60, "min_amplitude": 1e-4}


def ball(mesh=BALL, name="ball", **kind):
    return ft.Surface(mesh, ft.Dielectric(**kind), name, back=1.5)


def flipped(mesh=BALL):
    return ft.Mesh(mesh.vertices, mesh.faces[:, ::-1])


def given(run):
    """The names of the warnings, in turn."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run()
    assert all(issubclass(one.category, ft.FringetraceWarning) for one in caught)
    assert all(one.filename == __file__ for one in caught)
    return [re.match(r"[\w ]+", str(one.message)).group() for one in caught]


def mirrors(reflectance):
    """Two plates face to face, between which light goes to and fro."""
    low, high = shapes.plate(9 * mm, 9 * mm), flipped(shapes.plate(9 * mm, 9 * mm)).moved((0, 0, 1 * mm))
    return ft.Scene([ft.Surface(m, ft.Mirror(reflectance), n) for m, n in ((low, "low"), (high, "high"))])


INSIDE = ft.Rays([(0, 0, 0.5 * mm)] * 2, [(0, 0, -1)] * 2)


RUNS = {
    "trace": lambda scene: ft.trace(scene, INSIDE, max_bounces=7),
    "recorded": lambda scene: ft.trace(scene, INSIDE, max_bounces=7, record=True),
    "stream": lambda scene: list(ft.stream(scene, INSIDE, max_bounces=7)),
    "chunks": lambda scene: join(list(ft.stream(scene, INSIDE, max_bounces=7, chunk=1))),
}


@pytest.mark.parametrize("run", RUNS)
def test_power_that_is_cut_off_is_told(run):
    text = (
        r"power is cut off: 1 after max_bounces=7, .* behind 'low', .* at \(0, 0, 0\) m; allow more bounces"
    )
    with pytest.warns(ft.FringetraceWarning, match=text) as told:
        RUNS[run](mirrors(1.0))
    assert len(told) == 1


@pytest.mark.parametrize("more", [False, True])
def test_a_millionth_may_be_cut_off(more):
    """0.25^n of the power is left after n mirrors: at 10 bounces 9.5e-7, at 9 four times that."""
    bounces = 9 if more else 10
    paths = ft.trace(mirrors(0.25), INSIDE, max_bounces=bounces, min_amplitude=0.0, warn=False)
    assert Losses.of(paths).share == pytest.approx(0.25**bounces, rel=1e-12)
    assert (Losses.of(paths).share > CUT) == more
    assert ("power is cut off" in Losses.of(paths).problems) == more


def test_light_below_the_least_amplitude_is_told():
    with pytest.warns(ft.FringetraceWarning, match=r"off: 0\.062 below min_amplitude=0\.3, .* smaller least"):
        ft.trace(mirrors(0.25), INSIDE, min_amplitude=0.3)


def test_branches_left_out_on_purpose_are_not_told():
    paths = ft.trace(ft.Scene([ball(follow="transmitted")]), BEAM)
    assert paths.ledger().truncated > 0.05 * paths.ledger().incident


def test_rays_of_no_bounce_at_all():
    with pytest.warns(
        ft.FringetraceWarning, match=r"power is cut off: 1 after max_bounces=0, .* power, the br"
    ):
        ft.trace(mirrors(1.0), INSIDE, max_bounces=0)


def test_keys_too_long_to_tell_name_no_surface():
    with pytest.warns(
        ft.FringetraceWarning, match=r"max_bounces=200, as parts of the incident power, the bright"
    ):
        ft.trace(mirrors(1.0), INSIDE, max_bounces=200)


CONTRADICTIONS = {
    "flipped": [ball(flipped())],
    "overlapping": [ball(), ball(BALL.moved((0, 0, 0.7 * mm)), "other")],
    "within": [ball(), ball(shapes.icosphere(0.4 * mm, 2), "other")],
    "open": [
        ball(ft.Mesh(BALL.vertices, BALL.faces[BALL.vertices[BALL.faces][:, :, 2].min(axis=1) < 0.9 * mm]))
    ],
}


@pytest.mark.parametrize("case", CONTRADICTIONS)
def test_media_that_contradict_are_told(case):
    scene = ft.Scene(CONTRADICTIONS[case])
    with pytest.warns(ft.FringetraceWarning) as told:
        paths = ft.trace(scene, BEAM, **FOLLOWED)
    texts = [str(one.message) for one in told]
    worst = scene.surfaces[int(np.argmax(paths.contradictions))].name
    (text,) = [text for text in texts if text.startswith("media contradict")]
    assert f"{paths.contradictions.max():,} rays came to '{worst}'" in text


def test_doubled_faces_are_told():
    assert "media contradict" in given(lambda: ft.trace(ft.Scene([ball(), ball()]), BEAM, max_bounces=5))


def test_a_hole_is_told_with_its_edges():
    corners = BALL.faces[0]
    holed = ball(ft.Mesh(BALL.vertices, BALL.faces[1:]))
    with pytest.warns(ft.FringetraceWarning, match="glass is open: 'ball' has a hole of .* m2 about") as told:
        ft.trace(ft.Scene([holed]), ft.Rays([(0, 0, 5 * mm)], [(0, 1, 0)]))
    edges = re.search(r"vertices ([\d, -]+); close the mesh", str(told[0].message)).group(1)
    assert {frozenset(map(int, edge.split("-"))) for edge in edges.split(", ")} == {
        frozenset((int(corners[k]), int(corners[k - 1]))) for k in range(3)
    }


def test_paths_that_multiply_are_told_while_they_do():
    plates = [
        ft.Surface(
            shapes.plate(1.0, 1.0).moved((0, 0, -k / 10)),
            ft.BeamSplitter(0.5**0.5 * 1j, 0.5**0.5),
            f"plate {k}",
        )
        for k in range(8)
    ]
    ray = ft.Rays([(0, 0, 1.0)], [(0.001, 0, -1.0)])
    with pytest.warns(ft.FringetraceWarning) as told:
        ft.trace(ft.Scene(plates), ray, max_bounces=20, min_amplitude=0.0)
    texts = [str(one.message) for one in told]
    assert re.match(
        r"paths multiply: 1 rays have become 1\d\d,\d\d\d paths after \d+ surfaces, most of them at 'plate "
        r"\d'; "
        "allow fewer bounces, a larger least amplitude than 0, or follow one branch",
        texts[0],
    )
    assert [text[:5] for text in texts] == ["paths", "power"]


def test_a_crowd_is_told_once():
    known = set()
    surface = np.zeros(EACH, dtype=np.int32)
    told = given(lambda: [warn_of_crowd(mirrors(1.0), surface, 1, 9, 0.1, known) for _ in range(2)])
    assert told == ["paths multiply"]


def test_each_comes_once_of_the_same_paths():
    """Of a flipped ball, by a trace and all that is made of it."""
    scene = ft.Scene([ball(flipped())])

    def run():
        paths = ft.trace(scene, BEAM, CCD, wavelength=500 * nm, **FOLLOWED)
        for _ in range(2):
            ft.irradiance(paths, 500 * nm, "rays")
            ft.complex_field(paths.detected, 500 * nm, "rays")
            ft.budget(paths, 500 * nm, "rays")
            ft.accuracy.check(paths, 500 * nm, "rays")

    told = given(run)
    assert "media contradict" in told
    assert len(told) == len(set(told))


def test_nothing_is_told_where_nothing_is_wanted():
    scene = ft.Scene([ball(flipped(ft.Mesh(BALL.vertices, BALL.faces[1:])))])
    ft.trace(scene, BEAM, max_bounces=2, warn=False)
    list(ft.stream(scene, BEAM, max_bounces=2, warn=False))
    known = {"power is cut off", "glass is open"}
    assert given(lambda: ft.trace(scene, BEAM, max_bounces=2, warn=known)) == ["media contradict"]
    assert given(lambda: ft.trace(scene, BEAM, max_bounces=2, warn=known)) == []


def test_a_ball_in_order_has_nothing_to_tell():
    ft.trace(ft.Scene([ball()]), BEAM, **FOLLOWED)


@pytest.mark.parametrize("what", ["brdf", "amplitudes"])
def test_a_goniometer_tells_once_of_all_its_directions(what):
    rods = shapes.rod_lattice(2, 2, 65 * nm, 280 * nm, 2000 * nm)
    scene = ft.Scene([ft.Surface(rods, ft.Mirror(), "rods")])
    detector = scattering.Cones(np.array([0.0, 0.3]), 5 * degree)
    run = getattr(scattering, what)
    told = given(lambda: run(scene, [0.0, 0.2, 0.4], detector, [500 * nm], rays=(1, 300), max_bounces=1))
    assert told == ["power is cut off"]
