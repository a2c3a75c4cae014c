"""3D pictures: what is drawn, in a process that may crash; and what is said when it does."""

import os
import shutil
import sys

import numpy as np
import pytest
from matplotlib.image import imread

import fringetrace as ft
from fringetrace import drawing, instruments, mm, nm, um, views
from fringetrace.shapes import height_map, plate

linux = pytest.mark.skipif(sys.platform != "linux", reason="takes the loader of Linux")


@pytest.fixture(scope="module")
def missing():
    return views.opengl()


@pytest.fixture(scope="module")
def bench():
    z = 500 * nm * np.random.default_rng(3).random((9, 9))
    return instruments.michelson(height_map(z, 1 * mm), aperture=6 * mm, pixels=(6, 8))


@pytest.fixture(scope="module")
def paths(bench):
    return bench.sampled((4, 4))


@pytest.mark.parametrize(
    ("length", "unit"),
    [
        (12.0, "m"),
        (1.0, "m"),
        (0.02, "mm"),
        (1e-3, "mm"),
        (5e-5, "µm"),
        (3e-9, "nm"),
        (2e-14, "pm"),
        (0.0, "m"),
    ],
)
def test_units_leave_a_few_digits_before_the_point(length, unit):
    name, metres = drawing.unit_of(length)
    assert name == unit
    assert drawing.unit_of(-length) == (name, metres)
    assert metres == {"m": 1, "mm": mm, "µm": um, "nm": nm, "pm": 1e-12}[unit]


def test_the_two_arms_are_two_routes_of_different_rays(bench, paths):
    sketch = drawing._drawing(bench.scene, paths, "route", "sample")
    assert [name for name, _ in sketch["routes"]] == [
        "splitter, sample, splitter",
        "splitter, reference, splitter",
    ]
    starts = [{tuple(line[0]) for line in lines} for _, lines in sketch["routes"]]
    assert [len(start) for start in starts] == [8, 8]
    assert not starts[0] & starts[1]


def test_lines_end_on_the_chip_and_not_in_its_plane_of_focus(bench, paths):
    assert bench.ccd.focus != 0.0
    for _, lines in drawing._drawing(bench.scene, paths, "route", None)["routes"]:
        for line in lines:
            np.testing.assert_allclose(line[-1][2], bench.ccd.centre[2], rtol=1e-12)
            np.testing.assert_allclose(line[0][0], bench.beam.centre[0], rtol=1e-12)


def test_light_that_leaves_is_drawn_a_bit_on():
    scene = ft.Scene([ft.Surface(plate(1 * mm, 1 * mm), ft.Mirror(), "floor")])
    rays = ft.Rays([[0, 0, 1 * mm], [5 * mm, 0, 1 * mm]], [[0, 0, -1.0], [0, 0, -1.0]])
    sketch = drawing._drawing(scene, ft.trace(scene, rays, record=True), "route", None)
    routes = dict(sketch["routes"])
    assert set(routes) == {"floor", "straight"}
    assert routes["floor"][0][:, 2] == pytest.approx([1 * mm, 0, 0.3 * mm])
    assert routes["straight"][0][:, 2] == pytest.approx([1 * mm, 0.7 * mm])
    assert "source" not in sketch
    assert "CCD" not in sketch


def test_more_routes_than_colours_share_the_last(monkeypatch, bench, paths):
    monkeypatch.setattr(drawing, "COLOURS", ("#000000", "#777777"))
    names = [name for name, _ in drawing._drawing(bench.scene, paths, "route", None)["routes"]]
    assert names == ["splitter, sample, splitter", "other paths"]


def test_a_picture_needs_recorded_paths(bench, tmp_path):
    with pytest.raises(ValueError, match="expected paths traced with record=True"):
        views.picture(bench.scene, bench.trace(), tmp_path / "scene.png")


def test_an_unknown_way_of_colouring_is_refused(bench, paths, tmp_path):
    with pytest.raises(ValueError, match="colour: expected 'route' or 'length', got 'red'"):
        views.picture(bench.scene, paths, tmp_path / "scene.png", colour="red")
    with pytest.raises(ValueError, match="expected one surface called 'lens'"):
        views.picture(bench.scene, paths, tmp_path / "scene.png", relief="lens")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize(
    "options", [{"relief": "sample"}, {"colour": "length"}, {"size": (400, 300)}], ids=lambda o: next(iter(o))
)
def test_a_picture_shows_something(missing, bench, paths, tmp_path, options):
    if missing:
        pytest.skip(missing)
    views.picture(bench.scene, paths, tmp_path / "scene.png", **options)
    assert [file.name for file in tmp_path.iterdir()] == ["scene.png"]
    width, height = options.get("size", (1600, 1000))
    image = imread(tmp_path / "scene.png")[:, :, :3]
    assert image.shape == (height, width, 3)
    coloured = np.ptp(image, axis=2) > 0.2
    assert 0.005 < coloured.mean() < 0.5
    assert (image[:, [0, -1]] == 1.0).all()  # white all round: nothing is cut off


@pytest.mark.slow
def test_a_scene_without_rays_can_be_drawn(missing, bench, tmp_path):
    if missing:
        pytest.skip(missing)
    views.picture(bench.scene, None, tmp_path / "scene.png")
    assert np.ptp(imread(tmp_path / "scene.png")[:, :, :3]) > 0.5


def test_a_crash_names_the_packages_to_install():
    with pytest.raises(RuntimeError, match="apt-get install libegl1 libgl1-mesa-dri"):
        drawing._child("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")


def test_any_other_failure_is_passed_on():
    with pytest.raises(RuntimeError, match="3D picture: ZeroDivisionError: division by zero"):
        drawing._child("1 / 0")
    with pytest.raises(RuntimeError, match="3D picture: failed"):
        drawing._child("raise SystemExit(3)")


def test_a_picture_that_hangs_is_given_up(monkeypatch):
    monkeypatch.setattr(drawing, "SECONDS", 0.5)
    with pytest.raises(RuntimeError, match=r"gave up after 0\.5 s"):
        drawing._child("import time; time.sleep(60)")


@pytest.fixture
def without_opengl(monkeypatch, tmp_path_factory):
    """OpenGL libraries that have nothing in them: any shared library, under their names."""
    folder = tmp_path_factory.mktemp("libraries")
    for name in ("libEGL.so.1", "libEGL.so", "libGL.so.1", "libGL.so", "libX11.so.6", "libOSMesa.so.8"):
        shutil.copy(np._core._multiarray_umath.__file__, folder / name)
    monkeypatch.setenv("LD_LIBRARY_PATH", os.fspath(folder))


@linux
@pytest.mark.slow
def test_without_opengl_it_says_what_to_install(without_opengl, bench, paths, tmp_path):
    assert "apt-get install libegl1 libgl1-mesa-dri" in views.opengl()
    with pytest.raises(RuntimeError, match="apt-get install libegl1 libgl1-mesa-dri"):
        views.picture(bench.scene, paths, tmp_path / "scene.png")
    with pytest.raises(RuntimeError, match="apt-get install libegl1 libgl1-mesa-dri"):
        views.show(bench.scene, paths)
    assert not list(tmp_path.iterdir())
