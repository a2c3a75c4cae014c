"""Scene files run: what is written agrees with the same calls in Python."""

import numpy as np
import pytest
import tifffile
import xarray

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.scenefile import files, run
from fringetrace.tracing.tracer import trace

LIGHT = """
wavelengths = ["500 nm", "600 nm"]
outputs = ["interferogram.nc", "interferogram.tif", "field.nc", "paths.nc"]
medium = %s
[[surface]]
mesh = { type = "plate", width = "4 mm", height = "4 mm" }
interface = { type = "Mirror", reflectance = 0.81 }
pose = { axis = [0, 1, 0], angle = "0.2 mrad" }
[[beam]]
centre = [0, 0, "1 mm"]
direction = [0, 0, -1]
up = [0, 1, 0]
size = ["1 mm", "1 mm"]
shape = [8, 8]
%s
[[beam]]
centre = [0, 0, "1.5 mm"]
direction = [0, 0, -1]
up = [0, 1, 0]
size = ["1 mm", "1 mm"]
shape = [8, 8]
%s
[ccd]
centre = [0, 0, "3 mm"]
normal = [0, 0, -1]
up = [0, 1, 0]
pitch = "0.25 mm"
shape = [6, 4]
"""


def recorded(folder, medium='"vacuum"', polarisation=""):
    experiment = files.parse_experiment(LIGHT % (medium, polarisation, polarisation), "it.toml", folder)
    return experiment, list(run.run(experiment, folder / "out"))


def dataset(path):
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        return data.load()


def test_the_files_hold_what_python_gives(tmp_path):
    experiment, said = recorded(tmp_path)
    paths = [trace(experiment.scene, beam, experiment.ccd) for beam in experiment.beam]
    image = np.stack([ft.irradiance(paths, w) for w in (500 * nm, 600 * nm)])
    light = dataset(tmp_path / "out" / "interferogram.nc")
    np.testing.assert_array_equal(light["interferogram"], image)
    np.testing.assert_allclose(light["wavelength"], [500 * nm, 600 * nm], rtol=1e-15)
    np.testing.assert_allclose(light["x"], np.array([-0.375, -0.125, 0.125, 0.375]) * mm, rtol=1e-12)
    field = dataset(tmp_path / "out" / "field.nc")
    np.testing.assert_array_equal(field["field_real"][1], ft.complex_field(paths, 600 * nm).real)
    scale = max(1.0, image.max())
    counts = tifffile.imread(tmp_path / "out" / "interferogram.tif")
    np.testing.assert_allclose(counts[:, ::-1] * (scale / 65535), image, atol=0.5001 * scale / 65535)
    ends = dataset(tmp_path / "out" / "paths.nc")
    np.testing.assert_array_equal(ends["length"], np.concatenate([each.length for each in paths]))
    np.testing.assert_array_equal(ends["beam"], np.repeat([0, 1], [len(each) for each in paths]))
    assert [text.partition(":")[0] for what, text in said if what == "budget"] == ["beam 0", "beam 1"] * 2


def test_dispersive_scenes_are_traced_at_each_wavelength(tmp_path):
    recorded(tmp_path, '"water"')
    ends = dataset(tmp_path / "out" / "paths.nc")
    assert np.unique(ends["wavelength"]).tolist() == pytest.approx([500 * nm, 600 * nm])
    lengths = [ends["length"][ends["wavelength"] == w].max() for w in np.unique(ends["wavelength"])]
    assert lengths[0] > lengths[1]


def test_light_with_a_polarisation_has_components(tmp_path):
    recorded(tmp_path, polarisation='polarisation = [1, "1i"]')
    field = dataset(tmp_path / "out" / "field.nc")
    assert field["field_real"].dims == ("wavelength", "component", "y", "x")


def test_outputs_of_a_bench(tmp_path):
    text = """
    wavelengths = ["500 nm"]
    outputs = ["frames.tif", "height.nc", "height.dat", "height.datx", "field.nc"]
    steps = 5
    [bench]
    type = "michelson"
    aperture = "1 mm"
    pixels = [6, 8]
    reference_tilt = ["50 urad", 0]
    sample = { type = "plate", width = "2 mm", height = "2 mm" }
    """
    experiment = files.parse_experiment(text, "it.toml", tmp_path)
    list(run.run(experiment, tmp_path / "out"))
    assert tifffile.imread(tmp_path / "out" / "frames.tif").shape == (5, 6, 8)
    bench = experiment.bench.bench
    height = dataset(tmp_path / "out" / "height.nc")["height"][0]
    np.testing.assert_array_equal(height, bench.height(500 * nm, 5))
    for kind in ("dat", "datx"):
        z, pitch = ft.meshes.read_height_map(tmp_path / "out" / f"height.{kind}")
        np.testing.assert_allclose(z, height, rtol=0, atol=500 * nm / 131072)  # half a count
        assert pitch == pytest.approx(bench.ccd.pitch, rel=1e-7)
    field = dataset(tmp_path / "out" / "field.nc")["field_imag"][0]
    np.testing.assert_array_equal(field, bench.field(500 * nm).imag)


@pytest.mark.parametrize("missing", [None, "no OpenGL here"])
def test_a_picture_is_drawn_or_it_is_said_why_not(tmp_path, monkeypatch, missing):
    def picture(scene, paths, path):
        assert paths.points is not None
        if missing:
            raise RuntimeError(missing)
        path.write_bytes(b"picture")

    monkeypatch.setattr(ft.views, "picture", picture)
    asked = '"interferogram.nc", "interferogram.tif", "field.nc", "paths.nc"'
    text = (LIGHT % ('"water"', "", "")).replace(asked, '"scene.png"')
    said = dict(run.run(files.parse_experiment(text, "it.toml", tmp_path), tmp_path / "out"))
    assert (tmp_path / "out" / "scene.png").exists() == (missing is None)
    assert said.get("no scene.png") == missing


def test_a_scene_without_a_camera_gives_its_paths(tmp_path):
    text = LIGHT[: LIGHT.index("[ccd]")].replace(
        '"interferogram.nc", "interferogram.tif", "field.nc", "paths.nc"', '"paths.nc"'
    )
    said = dict(
        run.run(files.parse_experiment(text % ('"air"', "", ""), "it.toml", tmp_path), tmp_path / "out")
    )
    assert "budget" not in said
    assert len(dataset(tmp_path / "out" / "paths.nc")["ray"]) == 2 * 2 * 64


def test_what_cannot_run_is_refused_and_nothing_is_left(tmp_path):
    text = LIGHT % ('"vacuum"', "", "")
    light = text.replace('wavelengths = ["500 nm", "600 nm"]', "")
    dark = text[: text.index("[[beam]]")]
    blind = text[: text.index("[ccd]")]
    for some, message in (
        (light, "wavelengths: expected at least one to run a scene, got none"),
        (dark, "beam: expected at least one to run a scene, got none"),
        (blind, r"ccd: expected one for interferogram\.nc, got none"),
        (text.replace('"500 nm"', '"50 nm"').replace('"vacuum"', '"water"'), "water: expected 182 nm"),
    ):
        with pytest.raises(ValueError, match=message):
            list(run.run(files.parse_experiment(some, "it.toml", tmp_path), tmp_path / "out"))
        assert not (tmp_path / "out").exists()
