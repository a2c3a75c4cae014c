"""The commands for structural colour, as the command line calls them."""

import csv
from concurrent.futures import ThreadPoolExecutor

import pytest
import xarray

import fringetrace as ft
from fringetrace import cli, commands, exhibits, meshes, mm, nm, shapes, sweeps
from fringetrace.studies import Lattice

SHORT = ["--angles", "20 deg", "2", "--wavelengths", "400 nm", "600 nm", "5"]


@pytest.fixture
def rods(tmp_path):
    ft.meshes.save(Lattice(3, 2).mesh, tmp_path / "rods.ply", "um")
    return tmp_path / "rods.ply"


@pytest.mark.parametrize("extra", [["--rays", "1", "200"], ["--hemisphere", "3", "--method", "power"]])
def test_a_mesh_to_its_brdf(rods, tmp_path, capsys, extra):
    out = tmp_path / "out"
    assert cli.main(["brdf", str(rods), "--unit", "um", "--out", str(out), *SHORT, *extra]) == 0
    said = capsys.readouterr().out
    assert "rods.ply: 408 triangles" in said
    assert "reflected" in said
    # 65 nm at 600 nm: of prisms of 18 sides, 0.985 of it upwards
    assert "size parameter 0.67" in said
    assert "estimated from the mesh's parts" in said
    assert {file.name for file in out.iterdir()} == set(commands.FILES)
    with xarray.open_dataarray(out / "brdf.nc", engine="h5netcdf") as table:
        assert table.shape[0] == 2
        assert table.shape[4] == 5
        with (out / "brdf.csv").open() as file:
            assert [float(row["brdf"]) for row in csv.DictReader(file)] == table.values.ravel().tolist()
    assert (out / "spectra.png").read_bytes()[:4] == b"\x89PNG"


@pytest.fixture
def feathers(tmp_path):
    (tmp_path / "feathers.csv").write_text("wavelength / nm,blue\n400,0.4\n500,0.2\n600,0.1\n")
    return tmp_path / "feathers.csv"


def test_measured_spectra_are_laid_over(rods, feathers, tmp_path, capsys):
    out = tmp_path / "out"
    given = ["--unit", "um", "--out", str(out), *SHORT, "--rays", "1", "200", "--measured", str(feathers)]
    assert cli.main(["brdf", str(rods), *given]) == 0
    assert "spectra.png, measured.png" in capsys.readouterr().out
    assert {file.name for file in out.iterdir()} == {*commands.FILES, "measured.png"}
    feathers.write_text("blue\n1\n")
    assert cli.main(["brdf", str(rods), *given]) == cli.FAILURE
    assert "expected a column of wavelengths" in capsys.readouterr().err


def test_measured_spectra_beside_layers(feathers, tmp_path, capsys):
    given = ["--rod", "1.6", "--host", "1.5", "--method", "multilayer", "--measured", str(feathers), *SHORT]
    assert cli.main(["lattice", "--rows", "2", "--out", str(tmp_path / "out"), *given]) == 0
    assert "reflectance.csv, measured.png" in capsys.readouterr().out
    assert (tmp_path / "out" / "measured.png").read_bytes()[:4] == b"\x89PNG"


def test_lattices_in_one_call(tmp_path, capsys, monkeypatch):
    # processes start for seconds; test_sweeps has some
    monkeypatch.setattr(sweeps, "ProcessPoolExecutor", lambda *_, **__: ThreadPoolExecutor(1))
    out = tmp_path / "out"
    given = ["--columns", "3", "--rows", "2", "--pitch", "250 nm", "280 nm", "--disorder", "0", "0.1"]
    assert cli.main(["lattice", "--out", str(out), "--rays", "100", *SHORT, *given]) == 0
    said = capsys.readouterr().out
    assert "4 of pitch, disorder; columns 3, rows 2, radius 65 nm" in said
    assert "at worst: size parameter 0.681" in said
    with xarray.open_dataarray(out / "brdf.nc", engine="h5netcdf") as table:
        assert table.dims[:2] == ("pitch", "disorder")
        assert table.attrs["ray_error"] == 1.0
        assert table.pitch.values == pytest.approx([250e-9, 280e-9], rel=1e-12)
    assert len(list((out / "cells").iterdir())) == 4


def test_a_feather_by_rigorous_methods(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sweeps, "ProcessPoolExecutor", lambda *_, **__: ThreadPoolExecutor(1))
    given = [
        "lattice", "--columns", "3", "--rows", "2", "--pitch", "150 nm", "--arrangement", "square", *SHORT,
    ]  # fmt: skip
    given += ["--rod", "melanin", "--host", "1.55", "--cortex", "100 nm", "--channel", "10 nm"]
    assert cli.main([*given, "--method", "rods", "--out", str(tmp_path / "rods")]) == 0
    assert "not told by this method" in capsys.readouterr().out
    assert cli.main([*given, "--method", "multilayer", "--out", str(tmp_path / "layers")]) == 0
    assert "layers 0." in capsys.readouterr().out
    with (tmp_path / "layers" / commands.LAYERS).open() as file:
        lines = [float(line["reflectance"]) for line in csv.DictReader(file)]
    layers, rods = lines[: len(lines) // 2], lines[len(lines) // 2 :]
    assert layers == pytest.approx(rods, abs=0.05 * max(rods))  # what the two methods are apart
    several = [*given, "--seed", "1", "2", "--method", "multilayer", "--out", str(tmp_path / "none")]
    assert cli.main(several) == 2
    assert "--method multilayer: expected one lattice, got several of seed" in capsys.readouterr().err


def test_what_is_refused(rods, tmp_path, capsys):
    out = str(tmp_path / "out")
    given = ["brdf", str(rods), "--unit", "um", "--out", out]
    assert cli.main([*given, "--angles", "20 deg", "none"]) == 2
    assert "--angles: expected a whole number from 1, got 'none'" in capsys.readouterr().err
    assert cli.main([*given, "--method", "waves"]) == 2
    assert "method: expected one of rays" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_file_begun_is_a_file_that_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["init", "free"]) == 0
    text = capsys.readouterr().out
    (tmp_path / "my.toml").write_text(text.replace("[128, 128]", "[16, 16]").replace("[64, 64]", "[8, 8]"))
    assert cli.main(["run", "my.toml"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert said.out.startswith("scene        2 surfaces, 4 triangles; beams: 1 of 8 x 8 rays; 16 x 16 pixels")
    assert "\nbudget       of the image: hit " in said.out
    assert "\nwritten      fringetrace-my: field.nc, interferogram.png" in said.out
    assert (tmp_path / "fringetrace-my" / "paths.nc").is_file()


def test_a_scene_file_and_a_mesh_are_looked_at(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["init", "free"]) == 0
    text = capsys.readouterr().out.replace("[128, 128]", "[16, 16]").replace("[64, 64]", "[8, 8]")
    (tmp_path / "my.toml").write_text(text)
    arguments = [
        "view",
        "my.toml",
        "--html",
        "it.html",
        "--export",
        "it.vtp",
        "--colour",
        "phase",
        "--rays",
        "4",
    ]
    assert cli.main(arguments) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert said.out.startswith("scene        2 surfaces, ")
    assert "path ends of 1 beams\nwritten      it.html, it.vtp\n" in said.out
    assert "16 rays" in (tmp_path / "it.html").read_text("utf-8")
    meshes.save(shapes.plate(1 * mm, 1 * mm), tmp_path / "part.stl", unit="mm")
    assert cli.main(["view", "part.stl", "--unit", "mm", "--export", "part.glb"]) == 0
    assert capsys.readouterr().out == "scene        1 surfaces, no rays\nwritten      part.glb\n"
    shown = []
    monkeypatch.setattr(exhibits, "show", lambda scene, paths, **looks: shown.append((scene, looks)))
    assert cli.main(["view", "my.toml", "--wavelength", "500 nm"]) == 0
    assert shown[0][1]["wavelength"] == pytest.approx(500 * nm)
    assert shown[0][1]["image"].shape == (16, 16)
    assert capsys.readouterr().out == ""
    assert cli.main(["view", "my.toml", "--rays", "0"]) == cli.FAILURE
    assert "--rays: expected at least 1, got 0" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["init", "lens"], "fringetrace: template: expected one of free, "),
        (["run", "none.toml"], "none.toml"),
        (["run", "odd.toml"], "fringetrace: odd.toml:2: surfce: expected one of wavelengths, "),
        (
            ["run", "away.toml"],
            "fringetrace: away.toml:2: surface.mesh.file: expected a file in the folder of ",
        ),
        (["run", "away.toml", "--allow-outside"], "expected an existing file, got none there"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "odd.toml").write_text("\n[[surfce]]\n")
    (tmp_path / "away.toml").write_text(
        '[[surface]]\nmesh = { file = "../no.stl", unit = "m" }\ninterface = "Mirror"'
    )
    assert cli.main(arguments) == cli.FAILURE
    said = capsys.readouterr()
    assert message in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""
