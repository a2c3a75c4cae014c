"""Scene files as wholes: what is read, what is written, what is refused, and the examples of the page."""

import os
import re
from pathlib import Path

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.geometry import forms, meshes
from fringetrace.scenefile import files
from fringetrace.scenefile.run import run

PAGE = Path(__file__).resolve().parents[2] / "docs" / "scenes.md"
EXAMPLES = re.findall(r"^```toml\n(.*?)^```", PAGE.read_text(), flags=re.DOTALL | re.MULTILINE)
MIRROR = '[[surface]]\nmesh = { type = "plate", width = 1, height = 1 }\ninterface = "Mirror"\n'


@pytest.mark.parametrize("text", EXAMPLES, ids=["bench", "free"])
def test_the_examples_of_the_page_run(text, tmp_path):
    experiment = files.parse_experiment(text, "my.toml", tmp_path)
    said = dict(run(experiment, tmp_path / "out"))
    written = {file.name for file in (tmp_path / "out").iterdir()}
    for name in experiment.outputs:
        stem, _, suffix = name.partition(".")
        assert any(re.fullmatch(rf"{stem}(-\d+(\.\d+)?nm)?\.{suffix}", file) for file in written), name
    assert {"scene", "traced", "power", "budget", "written"} <= set(said)
    assert float(re.search(r"unaccounted for (\S+)", said["power"])[1]) < 1e-12


def test_the_message_of_the_page_is_the_one_that_is_said(tmp_path):
    shown = re.search(r"^my\.toml:12: .*$", PAGE.read_text(), flags=re.MULTILINE)[0]
    text = "\n" * 9 + MIRROR.replace("interface", "interfce")
    with pytest.raises(ValueError, match=re.escape(shown)):
        files.parse_experiment(text, "my.toml", tmp_path)


def written(scene, path):
    files.save(scene, path)
    return files.load(path)


def test_a_scene_comes_back_to_the_last_bit(tmp_path):
    meshes.save(ft.shapes.step(2 * mm, 2 * mm, 0.1 * mm, 100 * nm), tmp_path / "step.stl", "mm")
    turn = ft.vectors.rotation((1, 2, 3), 0.3)
    ball = ft.Surface(
        ft.shapes.icosphere(mm, 1), ft.Dielectric(), "ball", forms.Sphere((0, 0, 0), mm), back="BK7"
    ).moved((0.1, 0.2, 0.3), turn)
    stepped = ft.Surface(meshes.load(tmp_path / "step.stl", "mm"), ft.Mirror(0.9), "step").moved(
        (0, 0, 1), turn
    )
    scene = ft.Scene((ball, stepped), medium=1.33)
    back = written(scene, tmp_path / "it.toml").scene
    assert back.medium == scene.medium
    for one, other in zip(scene.surfaces, back.surfaces, strict=True):
        assert one.mesh.vertices.tobytes() == other.mesh.vertices.tobytes()
        assert one.mesh.faces.tobytes() == other.mesh.faces.tobytes()
        assert (one.interface, one.name, one.front, one.back) == (
            other.interface, other.name, other.front, other.back,
        )  # fmt: skip
    assert back.surfaces[0].form.centre.tobytes() == ball.form.centre.tobytes()
    assert {file.name for file in tmp_path.iterdir()} == {"it.toml", "it.surface-0-mesh.npz", "step.stl"}
    rays = ft.Rays(np.array([[0.1, 0.2, 1.0]]), np.array([[0, 0, -1.0]]))
    ends = [ft.trace(each, rays, wavelength=550 * nm).length.tobytes() for each in (scene, back)]
    assert ends[0] == ends[1]


def test_a_bench_comes_back_by_its_arguments(tmp_path):
    surface = ft.Surface(ft.shapes.plate(2 * mm, 2 * mm), ft.Mirror(0.5), "flat")
    recipe = files.Recipe(
        "michelson", {"sample": surface, "aperture": mm, "pixels": (3, 4), "profile": ft.Gaussian(mm)}
    )
    experiment = files.Experiment((633 * nm,), ("height.nc",), steps=5, bench=recipe)
    back = written(experiment, tmp_path / "it.toml")
    assert (back.wavelengths, back.outputs, back.steps) == (experiment.wavelengths, experiment.outputs, 5)
    one, other = recipe.bench, back.bench.bench
    for mine, its in zip(one.scene.surfaces, other.scene.surfaces, strict=True):
        assert mine.mesh.vertices.tobytes() == its.mesh.vertices.tobytes()
        assert mine.interface == its.interface
    assert (one.ccd.shape, one.ccd.pitch, one.beam.size) == (
        other.ccd.shape,
        other.ccd.pitch,
        other.beam.size,
    )
    assert back.scene is other.scene


def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "it.toml"
    path.write_text("before")
    replaced = []

    def broken(mesh, file, unit):
        replaced.append(file)
        raise OSError("disk full")

    monkeypatch.setattr(meshes, "save", broken)
    scene = ft.Scene([ft.Surface(ft.shapes.plate(1.0, 1.0), ft.Mirror())])
    with pytest.raises(OSError, match="disk full"):
        files.save(scene, path)
    assert replaced
    assert path.read_text() == "before"
    assert os.listdir(tmp_path) == ["it.toml"]


def test_files_outside_are_read_where_that_is_allowed(tmp_path):
    meshes.save(ft.shapes.plate(1.0, 1.0), tmp_path / "p.stl", "m")
    (tmp_path / "in").mkdir()
    file = tmp_path / "in" / "it.toml"
    file.write_text('[[surface]]\nmesh = { file = "../p.stl", unit = "m" }\ninterface = "Mirror"\n')
    with pytest.raises(ValueError, match=r"it\.toml:2: surface\.mesh\.file: expected a file in the folder"):
        files.load(file)
    assert len(files.load(file, allow_outside=True).surface) == 1


SAMPLE = 'sample = { type = "plate", width = 1, height = 1 }'
ERRORS = {
    "nothing": ("", "my.toml:1: expected a bench, or at least one surface, got neither"),
    "both": (
        MIRROR + '[bench]\ntype = "michelson"\naperture = 1\n' + SAMPLE,
        "my.toml:1: surface: expected none beside a bench, which brings its own, got some",
    ),
    "unknown output": ('outputs = ["x.png"]\n' + MIRROR, "1: outputs: expected one of int"),
    "no steps": ('\noutputs = ["height.png"]\n' + MIRROR, "2: outputs: expected a bench for"),
    "few steps": ("steps = 2\n" + MIRROR, "my.toml:1: steps: expected at least 3, got 2"),
    "wavelength": ('wavelengths = ["0 nm"]\n' + MIRROR, "wavelength: expected a positive length in metres"),
    "unknown table": (MIRROR + "[camera]", "my.toml:4: camera: expected one of wavelengths, outputs,"),
}  # fmt: skip


@pytest.mark.parametrize("case", ERRORS)
def test_wholes_that_make_no_sense_are_refused(case, tmp_path):
    text, message = ERRORS[case]
    with pytest.raises(ValueError, match=re.escape(message)):
        files.parse_experiment(text, "my.toml", tmp_path)


def test_what_is_no_text_or_no_scene_is_refused(tmp_path):
    (tmp_path / "it.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ValueError, match=r"it\.toml: expected TOML in UTF-8, got other bytes"):
        files.load(tmp_path / "it.toml")
    with pytest.raises(TypeError, match="scene file: expected an Experiment or a Scene, got dict"):
        files.save({}, tmp_path / "it.toml")
