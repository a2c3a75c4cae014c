"""The commands for scene files, as the command line calls them."""

import pytest

from fringetrace import mm, nm
from fringetrace.cli import command
from fringetrace.geometry import meshes, shapes
from fringetrace.views.scene3d import viewer


def test_a_file_begun_is_a_file_that_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert command.main(["init", "free"]) == 0
    text = capsys.readouterr().out
    (tmp_path / "my.toml").write_text(text.replace("[128, 128]", "[16, 16]").replace("[64, 64]", "[8, 8]"))
    assert command.main(["run", "my.toml"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert said.out.startswith("scene        2 surfaces, 4 triangles; beams: 1 of 8 x 8 rays; 16 x 16 pixels")
    assert "\nbudget       of the image: hit " in said.out
    assert "\nwritten      fringetrace-my: field.nc, interferogram.png" in said.out
    assert (tmp_path / "fringetrace-my" / "paths.nc").is_file()


def test_a_scene_file_and_a_mesh_are_looked_at(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert command.main(["init", "free"]) == 0
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
    assert command.main(arguments) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert said.out.startswith("scene        2 surfaces, ")
    assert "path ends of 1 beams\nwritten      it.html, it.vtp\n" in said.out
    assert "16 rays" in (tmp_path / "it.html").read_text("utf-8")
    meshes.save(shapes.plate(1 * mm, 1 * mm), tmp_path / "part.stl", unit="mm")
    assert command.main(["view", "part.stl", "--unit", "mm", "--export", "part.glb"]) == 0
    assert capsys.readouterr().out == "scene        1 surfaces, no rays\nwritten      part.glb\n"
    shown = []
    monkeypatch.setattr(viewer, "show", lambda scene, paths, **looks: shown.append((scene, looks)))
    assert command.main(["view", "my.toml", "--wavelength", "500 nm"]) == 0
    assert shown[0][1]["wavelength"] == pytest.approx(500 * nm)
    assert shown[0][1]["image"].shape == (16, 16)
    assert capsys.readouterr().out == ""
    assert command.main(["view", "my.toml", "--rays", "0"]) == command.FAILURE
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
    assert command.main(arguments) == command.FAILURE
    said = capsys.readouterr()
    assert message in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""
