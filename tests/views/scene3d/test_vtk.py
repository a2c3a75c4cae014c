"""3D pictures: what is drawn, in a process that may crash; and what is said when it does."""

import os
import shutil
import sys

import numpy as np
import pytest
from matplotlib.image import imread

import fringetrace as ft
from fringetrace import instruments, mm, nm, um, views
from fringetrace.core import units
from fringetrace.geometry.shapes import height_map, icosphere, plate
from fringetrace.views.scene3d import subprocess, viewer, vtk

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
    name, metres = units.unit_of(length)
    assert name == unit
    assert units.unit_of(-length) == (name, metres)
    assert metres == {"m": 1, "mm": mm, "µm": um, "nm": nm, "pm": 1e-12}[unit]


def test_a_picture_needs_recorded_paths(bench, tmp_path):
    with pytest.raises(ValueError, match="expected paths traced with record=True"):
        views.picture(bench.scene, bench.trace(), tmp_path / "scene.png")


def test_an_unknown_way_of_colouring_is_refused(bench, paths, tmp_path):
    with pytest.raises(ValueError, match=r"colour: expected 'route', .* or 'power', got 'red'"):
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
        subprocess.child("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")


def test_any_other_failure_is_passed_on():
    with pytest.raises(RuntimeError, match="3D picture: ZeroDivisionError: division by zero"):
        subprocess.child("1 / 0")
    with pytest.raises(RuntimeError, match="3D picture: failed"):
        subprocess.child("raise SystemExit(3)")


def test_a_picture_that_hangs_is_given_up(monkeypatch):
    monkeypatch.setattr(subprocess, "SECONDS", 0.5)
    with pytest.raises(RuntimeError, match=r"gave up after 0\.5 s"):
        subprocess.child("import time; time.sleep(60)")


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


class Seen:
    """What a view looks like: its picture, and where points of the scene are in it."""

    def __init__(self, view, size=(800, 600)):
        self.plotter = vtk.empty(size)
        vtk.draw(self.plotter, view)
        self.metres = view.stage.metres
        self.image = np.asarray(self.plotter.screenshot(return_img=True))[..., :3].astype(int)

    def place(self, point):
        """Row and column of a point of the scene."""
        renderer = self.plotter.renderer
        renderer.SetWorldPoint(*np.asarray(point) / self.metres, 1.0)
        renderer.WorldToDisplay()
        x, y, _ = renderer.GetDisplayPoint()
        return self.image.shape[0] - 1 - round(y), round(x)

    def at(self, point):
        """Colour at a point of the scene."""
        return self.image[self.place(point)]

    def near(self, point, colour, pixels=3):
        """Whether a colour is there, within some pixels: lines are thin."""
        row, column = self.place(point)
        part = self.image[row - pixels : row + pixels + 1, column - pixels : column + pixels + 1]
        wanted = [int(colour[at : at + 2], 16) for at in (1, 3, 5)]
        return bool((np.abs(part - wanted).sum(axis=2) < 150).any())


@pytest.fixture(scope="module")
def camera():
    """A mirror below a CCD that looks down at it, and rays straight down and up again."""
    mirror = ft.Surface(plate(4 * mm, 4 * mm), ft.Mirror(), "mirror")
    glass = ft.Surface(icosphere(0.5 * mm, 2).moved([6 * mm, 0, 2 * mm]), ft.Dielectric(), "ball", back=1.5)
    ccd = ft.CCD([0, 6 * mm, 6 * mm], [0, -1, 0], [0, 0, 1], 1 * mm, (4, 4))
    rays = ft.Rays([[-1 * mm, -1 * mm, 6 * mm], [1 * mm, -1 * mm, 6 * mm]], [[0, 0, -1.0], [0, 0, -1.0]])
    scene = ft.Scene([mirror, glass])
    return scene, ft.trace(scene, rays, ccd, wavelength=600 * nm, record=True)


@pytest.mark.slow
def test_the_ccd_shows_its_image_the_right_way_up(missing, camera):
    if missing:
        pytest.skip(missing)
    image = np.zeros((4, 4))
    image[0, :] = 0.5  # the lowest row,
    image[3, 3] = 1.0  # and the corner at the end of u and v
    scene, paths = camera
    seen = Seen(viewer.scene_view(scene, paths, image=image))
    u, v, _ = paths.ccd.axes
    for row in range(4):
        for column in range(4):
            spot = paths.ccd.centre + (column - 1.5) * mm * u + (row - 1.5) * mm * v
            assert abs(seen.at(spot) - 255 * image[row, column]).max() < 12, (row, column)


@pytest.mark.slow
def test_rays_have_their_colours_where_they_are(missing, camera):
    if missing:
        pytest.skip(missing)
    scene, paths = camera
    middle, moved = np.array([1 * mm, -1 * mm, 1 * mm]), np.array([-3 * mm, -1 * mm, 1 * mm])
    whole = Seen(viewer.scene_view(scene, paths, colour="fate"))
    assert whole.near(middle, "#E69F00")
    apart = Seen(viewer.scene_view(scene, paths, colour="bounce", explode=(-4 * mm, 0, 0)))
    assert apart.near(middle, "#440154")
    assert apart.near(moved, "#FDE725")
    first = Seen(viewer.scene_view(scene, paths, colour="bounce", explode=(-4 * mm, 0, 0), upto=0))
    assert first.near(middle, "#440154")
    assert not first.near(moved, "#FDE725")


@pytest.mark.slow
def test_glass_is_seen_through_and_a_plane_cuts(missing, camera):
    if missing:
        pytest.skip(missing)
    scene, _ = camera
    ball, floor = np.array([6 * mm, 0, 2 * mm]), np.array([-1.5 * mm, 0.5 * mm, 0])
    whole = Seen(viewer.scene_view(scene, None))
    assert 60 < whole.at(ball).min() < 245  # white behind green of low opacity
    assert whole.at(floor).max() < 230
    cut = Seen(viewer.scene_view(scene, None, clip=((1, 0, 0), (3 * mm, 0, 0))))
    assert cut.at(ball).min() > 200
    assert (cut.at(floor) == whole.at(floor)).all()


def test_a_window_needs_a_display(missing, bench, paths, monkeypatch):
    if missing:
        pytest.skip(missing)
    monkeypatch.setattr(subprocess, "opengl", lambda: None)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(RuntimeError, match="a window needs a display"):
        views.show(bench.scene, paths)
