"""The commands for structural colour, as the command line calls them."""

import csv
from concurrent.futures import ThreadPoolExecutor

import pytest
import xarray

import fringetrace as ft
from fringetrace.cli import brdf_commands, command
from fringetrace.core import sweeps
from fringetrace.scattering.rod_lattice import RodLattice

SHORT = ["--angles", "20 deg", "2", "--wavelengths", "400 nm", "600 nm", "5"]


@pytest.fixture
def rods(tmp_path):
    ft.meshes.save(RodLattice(3, 2).mesh, tmp_path / "rods.ply", "um")
    return tmp_path / "rods.ply"


@pytest.mark.parametrize("extra", [["--rays", "1", "200"], ["--hemisphere", "3", "--method", "power"]])
def test_a_mesh_to_its_brdf(rods, tmp_path, capsys, extra):
    out = tmp_path / "out"
    assert command.main(["brdf", str(rods), "--unit", "um", "--out", str(out), *SHORT, *extra]) == 0
    said = capsys.readouterr().out
    assert "rods.ply: 408 triangles" in said
    assert "reflected" in said
    assert "size parameter 0.681, phase across inf rad: no ray method" in said  # 2 pi 65 / 600
    assert "of the mesh's smallest part" in said
    assert "\nbudget       hit " in said
    assert {file.name for file in out.iterdir()} == set(brdf_commands.FILES)
    with xarray.open_dataarray(out / "brdf.nc", engine="h5netcdf") as table:
        assert table.shape[0] == 2
        assert table.shape[4] == 5
        with (out / "brdf.csv").open() as file:
            assert [float(row["brdf"]) for row in csv.DictReader(file)] == table.values.ravel().tolist()
    assert (out / "spectra.png").read_bytes()[:4] == b"\x89PNG"


@pytest.fixture
def feathers(tmp_path):
    """In the form of pavo (R)."""
    rows = [f"{wl},{5 + (wl - 300) / 20:.2f},12.5" for wl in range(300, 701, 10)]
    (tmp_path / "feathers.csv").write_text("\n".join(['"wl","eye","stem"', *rows]))
    return str(tmp_path / "feathers.csv")


@pytest.mark.slow
def test_a_mesh_of_matter_in_polarised_light_beside_measured_spectra(rods, feathers, tmp_path, capsys):
    given = ["brdf", str(rods), "--unit", "um", *SHORT, "--rays", "1", "60", "--measured", feathers]
    given += ["--material", "1.7", "--around", "1.5"]
    tables = {}
    for polarisation in ("s", "p"):
        out = tmp_path / polarisation
        assert command.main([*given, "--polarisation", polarisation, "--out", str(out)]) == 0
        assert f"{brdf_commands.OVER}\n" in capsys.readouterr().out
        assert (out / brdf_commands.OVER).read_bytes()[:4] == b"\x89PNG"
        with xarray.open_dataarray(out / "brdf.nc", engine="h5netcdf") as table:
            tables[polarisation] = table.load()
    assert tables["s"].attrs["phase_across_rad"] == pytest.approx(2 * 2 * 3.14159 * 0.2 * 65 / 600, rel=1e-5)
    assert float(abs(tables["s"] - tables["p"]).max()) > 0.0


def test_lattices_in_one_call(tmp_path, capsys, monkeypatch):
    # processes start for seconds; test_sweeps has some
    monkeypatch.setattr(sweeps, "ProcessPoolExecutor", lambda *_, **__: ThreadPoolExecutor(1))
    out = tmp_path / "out"
    given = ["--columns", "3", "--rows", "2", "--pitch", "250 nm", "280 nm", "--disorder", "0", "0.1"]
    assert command.main(["lattice", "--out", str(out), "--rays", "100", *SHORT, *given]) == 0
    said = capsys.readouterr().out
    assert "4 of pitch, disorder; columns 3, rows 2, radius 65 nm" in said
    assert "at worst: size parameter 0.681" in said
    assert "\nbudget       of the first: hit " in said
    with xarray.open_dataarray(out / "brdf.nc", engine="h5netcdf") as table:
        assert table.dims[:2] == ("pitch", "disorder")
        assert table.attrs["ray_error"] == 1.0
        assert table.pitch.values == pytest.approx([250e-9, 280e-9], rel=1e-12)
    assert len(list((out / "cells").iterdir())) == 4


def test_a_feather_by_rigorous_methods(feathers, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sweeps, "ProcessPoolExecutor", lambda *_, **__: ThreadPoolExecutor(1))
    given = [
        "lattice", "--columns", "3", "--rows", "2", "--pitch", "150 nm", "--arrangement", "square", *SHORT,
    ]  # fmt: skip
    given += ["--rod", "melanin", "--host", "1.55", "--cortex", "100 nm", "--channel", "10 nm"]
    rods = [*given, "--method", "rods", "--polarisation", "p", "--out", str(tmp_path / "rods")]
    assert command.main(rods) == 0
    assert "not told by this method" in capsys.readouterr().out
    layered = [*given, "--method", "multilayer", "--measured", feathers, "--out", str(tmp_path / "layers")]
    assert command.main(layered) == 0
    said = capsys.readouterr().out
    assert "layers 0." in said
    assert f"{brdf_commands.LAYERS}, {brdf_commands.OVER}" in said
    with (tmp_path / "layers" / brdf_commands.LAYERS).open() as file:
        lines = [float(line["reflectance"]) for line in csv.DictReader(file)]
    layers, rods = lines[: len(lines) // 2], lines[len(lines) // 2 :]
    assert layers == pytest.approx(rods, abs=0.05 * max(rods))  # what the two methods are apart
    several = [*given, "--seed", "1", "2", "--method", "multilayer", "--out", str(tmp_path / "none")]
    assert command.main(several) == 2
    assert "--method multilayer: expected one lattice, got several of seed" in capsys.readouterr().err


def test_what_is_refused(rods, tmp_path, capsys):
    out = str(tmp_path / "out")
    given = ["brdf", str(rods), "--unit", "um", "--out", out]
    assert command.main([*given, "--angles", "20 deg", "none"]) == 2
    assert "--angles: expected a whole number from 1, got 'none'" in capsys.readouterr().err
    assert command.main([*given, "--method", "waves"]) == 2
    assert "method: expected one of rays" in capsys.readouterr().err
    assert command.main(["lattice", "--out", out, "--method", "waves"]) == 2
    said = capsys.readouterr().err
    assert "lattice study method: expected rays, diffraction, power or rods, got 'waves'" in said
    assert not (tmp_path / "out").exists()
