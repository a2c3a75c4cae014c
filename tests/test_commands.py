"""The commands on scene files, as they are called."""

import pytest

from fringetrace import cli


def test_a_file_begun_is_a_file_that_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["init", "free"]) == 0
    text = capsys.readouterr().out
    (tmp_path / "my.toml").write_text(text.replace("[128, 128]", "[16, 16]"))
    assert cli.main(["run", "my.toml"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert said.out.startswith(
        "scene        2 surfaces, 4 triangles; beams: 1 of 64 x 64 rays; 16 x 16 pixels"
    )
    assert "\nbudget       of the image: hit " in said.out
    assert "\nwritten      fringetrace-my: field.nc, interferogram.png" in said.out
    assert (tmp_path / "fringetrace-my" / "paths.nc").is_file()


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
