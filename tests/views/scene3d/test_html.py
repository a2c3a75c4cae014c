"""Pages for a browser: nothing from outside, all data inside; and a browser that draws one."""

import base64
import json
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.image import imread

import fringetrace as ft
from fringetrace import instruments, mm, nm, views
from fringetrace.geometry.shapes import plate
from fringetrace.views.scene3d import html, viewer

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
# A proxy that is not there: no address but files can be reached.
OFFLINE = ["--proxy-server=127.0.0.1:9", "--host-resolver-rules=MAP * ~NOTFOUND"]
SOFTWARE = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]


@pytest.fixture(scope="module")
def bench():
    return instruments.michelson(
        plate(8 * mm, 8 * mm), aperture=6 * mm, pixels=(6, 8), reference_tilt=(200e-6, 0.0)
    )


@pytest.fixture(scope="module")
def written(bench, tmp_path_factory):
    path = tmp_path_factory.mktemp("pages") / "it.html"
    views.page(bench, None, path, title="Arms & <ends>", wavelength=633 * nm, colour="phase")
    assert [file.name for file in path.parent.iterdir()] == ["it.html"]
    return path


def unpacked(packed):
    kind, text = packed
    return np.frombuffer(base64.b64decode(text), dtype=f"<{kind}")


def data_of(path):
    return json.loads(re.search(r'id="data">(.*?)</script>', path.read_text("utf-8"), re.S)[1])


def test_a_page_loads_nothing_and_names_no_address(written):
    from plotly.offline import get_plotlyjs

    text = written.read_text("utf-8")
    assert get_plotlyjs() in text
    own = re.sub(r'(id="data">).*?(</script>)', r"\1\2", text.replace(get_plotlyjs(), ""), flags=re.S)
    assert not re.search(r"https?:|//\w|\bsrc=|\bhref=|@import|url\(", own)
    assert "default-src 'none'" in own
    assert "<title>Arms &amp; &lt;ends&gt;</title>" in own
    assert "108 rays" in own


def test_a_page_holds_legs_phases_and_every_path_in_words(bench, written):
    data = data_of(written)
    rays = data["rays"]
    view = viewer.scene_view(bench, None, wavelength=633 * nm, sweep=viewer.SWEEP)
    path, bounce = view.strands.legs()
    np.testing.assert_array_equal(unpacked(rays["path"]), path)
    ends = unpacked(rays["ends"]).reshape(-1, 2, 3) * view.stage.metres
    np.testing.assert_allclose(ends[:, 1], view.strands.points[path, bounce + 1], atol=1e-9)
    turns = unpacked(rays["phase"]).reshape(viewer.SWEEP, -1) / 256
    off = turns - view.strands.phase[:, path, bounce + 1]
    assert np.abs(off - np.round(off)).max() <= 0.5 / 256 + 1e-9
    assert rays["wavelengths"][rays["chosen"]] == 633 * nm
    assert len(rays["texts"]) == len(view.strands)
    assert rays["texts"][5] == views.describe_path(bench.sampled((9, 12)), int(view.strands.row[5]), 633 * nm)
    assert set(rays["ways"]) == {"route", "beam", "bounce", "length", "phase", "fate", "power"}
    assert rays["ways"]["length"]["title"] == "optical path / mm"
    assert rays["ways"]["route"]["names"][0].startswith("splitter, sample")
    frames = unpacked(data["frames"]).reshape(12, 6, 8) / 255
    expected = bench.phase_steps(633 * nm, 12)
    np.testing.assert_allclose(frames, expected / expected.max(), atol=0.5 / 255 + 1e-9)
    names = [trace["name"] for trace in data["figure"]["data"] if "name" in trace]
    assert {"splitter (beam splitter)", "sample (mirror)", "CCD", "source", "rays"} <= set(names)
    axes = data["figure"]["layout"]["scene"]
    assert [axes[f"{x}axis"]["title"]["text"] for x in "xyz"] == ["x / mm", "y / mm", "z / mm"]


def test_a_scene_without_rays_is_a_page_too(bench, tmp_path):
    views.page(bench.scene, None, tmp_path / "it.html")
    data = data_of(tmp_path / "it.html")
    assert "rays" not in data
    assert len(data["figure"]["data"]) == 3 + 1


def test_an_image_of_many_pixels_is_binned_and_keeps_its_mean():
    rng = np.random.default_rng(1)
    image = rng.random((1, 100, 250))
    binned = viewer._binned(image)
    assert binned.shape == (1, 96, 96)
    np.testing.assert_allclose(viewer._binned(np.ones((1, 100, 250))), 1.0)


def test_a_surface_of_many_triangles_is_simpler_and_says_so(monkeypatch):
    monkeypatch.setattr(html, "FACES", 100)
    ball = ft.shapes.icosphere(1 * mm, 2)
    view = viewer.scene_view(ft.Scene([ft.Surface(ball, ft.Mirror(), "ball")]))
    solid = html.contents(view)["figure"]["data"][0]
    found = re.fullmatch(r"ball \(mirror\), (\d+) of 320 triangles", solid["name"])
    assert 50 < int(found[1]) <= 100


def test_without_plotly_it_says_what_to_install(bench, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly.offline", None)
    with pytest.raises(ImportError, match=r"pip install 'fringetrace\[html\]'"):
        views.page(bench.scene, None, tmp_path / "it.html")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_browser_without_a_network_draws_it(written, tmp_path):
    if CHROMIUM is None:
        pytest.skip("needs chromium")
    command = [
        CHROMIUM, "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", *SOFTWARE, *OFFLINE,
        f"--user-data-dir={tmp_path / 'profile'}", "--window-size=1000,700", "--virtual-time-budget=3000",
        f"--screenshot={tmp_path / 'it.png'}", f"file://{written}#ray=3&explode=5",
    ]  # fmt: skip
    subprocess.run(command, check=True, capture_output=True, timeout=300)
    image = imread(tmp_path / "it.png")[..., :3]
    scene = image[100:, :600]
    red, green, blue = np.moveaxis(scene, 2, 0)
    assert ((red > 0.7) & (green > 0.4) & (green < 0.85) & (blue < 0.45)).sum() > 50  # the source
    assert (scene.max(axis=2) < 0.05).sum() > 100  # the ray clicked on, and the scale bar
    panel = image[100:400, 720:]
    assert 0.02 < (panel.max(axis=2) < 0.5).mean() < 0.5  # its path in words
