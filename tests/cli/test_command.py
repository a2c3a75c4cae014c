"""The command: what it writes and says, and one clear line for all that can go wrong."""

import contextlib
import io
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest
import tifffile
import xarray
from matplotlib.image import imread

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.cli import command as cli
from fringetrace.geometry import meshes
from fringetrace.geometry.shapes import plate, step

FILES = {"frames.tif", "height.png", "interferogram.png", "interferogram.tif", "result.nc"}
QUICK = ["--pixels", "24", "--no-picture"]


def saved_step(folder):
    meshes.save(step(6 * mm, 4 * mm, 1 * mm, 100 * nm), folder / "step.stl", unit="mm")
    return folder / "step.stl"


@pytest.fixture
def sample(tmp_path):
    return saved_step(tmp_path)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """One run that several tests look at: its folder and what it said."""
    folder = tmp_path_factory.mktemp("run")
    file, said = saved_step(folder), io.StringIO()
    arguments = [file, "--unit", "mm", "--out", folder / "out", "--wavelength", "532 nm", *QUICK]
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        assert cli.main(["interferogram", *map(os.fspath, arguments)]) == 0
    return folder / "out", said.getvalue()


@pytest.fixture
def command(capsys):
    """Run the command in this process; give its code, its output and its errors."""

    def run(*arguments):
        code = cli.main([os.fspath(argument) for argument in arguments])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


def process(*arguments, **options):
    """Run the installed command in a process of its own."""
    script = Path(sysconfig.get_path("scripts"), "fringetrace")
    text = [os.fspath(argument) for argument in (script, *arguments)]
    return subprocess.run(text, capture_output=True, text=True, timeout=120, **options)


def test_it_writes_all_files_and_says_what_it_did(run):
    out, said = run
    assert {file.name for file in out.iterdir()} == FILES
    for word in (
        "step.stl: 6 triangles", "highest point to z = 0", "image 6 mm x 4 mm", "24 x 16 pixels of 250 um",
        "10 fringes across", "384 rays", "3,456 segments", "rays/s", "detected 50.0000%", "left 50.0000%",
        "waves rms", "away from steps", "65535 counts", str(out),
    ):  # fmt: skip
        assert word in said, word
    assert float(re.search(r"unaccounted for (\S+)", said)[1]) < 1e-12


def test_the_files_agree_with_each_other(run):
    folder, _ = run
    with xarray.open_dataset(folder / "result.nc", engine="h5netcdf") as data:
        assert data.attrs["wavelength_m"] == pytest.approx(532 * nm)
        image, height = data["interferogram"].values, data["height"].values
    counts = tifffile.imread(folder / "interferogram.tif")
    np.testing.assert_allclose(counts[::-1] / 65535, image, atol=1e-5)
    # the step is up, to the right: x = 1 mm of -3 ... 3
    rise = height[:, 17:].mean() - height[:, :15].mean()
    assert rise == pytest.approx(100 * nm, abs=0.1 * nm)
    for name in ("interferogram.png", "height.png"):
        assert imread(folder / name)[:, :, :3].std() > 0.1


def test_options_reach_the_bench(command, sample, tmp_path):
    code, said, _ = command(
        "interferogram", sample, "--unit", "mm", "--out", tmp_path, "--pixels", "20", "--rays", "2",
        "--steps", "5", "--aperture", "3 mm", "--tilt", "50 urad", "--threads", "1", "--no-picture",
    )  # fmt: skip
    assert code == 0
    assert "1,040 rays" in said
    assert "image 3 mm x 1.95 mm, 20 x 13 pixels of 150 um" in said
    assert "tilted by 50 urad" in said
    assert tifffile.imread(tmp_path / "frames.tif").shape == (5, 13, 20)


def test_fringes_that_alias_are_warned_of(command, sample, tmp_path):
    options = ["--unit", "mm", "--out", tmp_path, "--tilt", "2 mrad", *QUICK]
    code, said, errors = command("interferogram", sample, *options)
    assert (code, errors) == (0, "")
    # 1.58 fringes a pixel of 250 um
    assert "note         fringes alias" in said
    assert "by 3.16 pi about" in said


def test_the_error_budget_is_one_line(run):
    _, said = run
    line = next(line for line in said.splitlines() if line.startswith("budget"))
    terms = re.findall(r"(\w+) (\d\.\de[-+]\d\d)", line)
    assert [name for name, _ in terms] == ["hit", "facets", "sampling", "pixels", "total"]
    assert float(dict(terms)["hit"]) < 1e-9
    assert "note" not in said


def test_steps_that_one_wavelength_cannot_tell_are_named(command, tmp_path):
    meshes.save(step(6 * mm, 6 * mm, 1 * mm, 300 * nm), tmp_path / "high.ply", unit="m")
    options = ["--unit", "m", "--out", tmp_path / "out", *QUICK]
    assert (
        "pixels off by whole half wavelengths" in command("interferogram", tmp_path / "high.ply", *options)[1]
    )


def test_a_run_replaces_the_one_before_in_the_folder_named_after_the_mesh(
    command, sample, run, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "fringetrace-step"
    shutil.copytree(run[0], out)
    code, _, errors = command("interferogram", sample, "--unit", "mm", "--wavelength", "600 nm", *QUICK)
    assert (code, errors) == (0, "")
    with xarray.open_dataset(out / "result.nc", engine="h5netcdf") as data:
        assert data.attrs["wavelength_m"] == pytest.approx(600 * nm)
    assert {file.name for file in out.iterdir()} == FILES


def test_the_demo_says_how_it_scaled_the_relief(command, tmp_path):
    code, said, errors = command("demo", "--out", tmp_path, "--pixels", "64", "--no-picture")
    assert (code, errors) == (0, "")
    assert "matplotlib's elevation map, 344 x 403, every second sample, relief scaled to 2 um" in said
    assert {file.name for file in tmp_path.iterdir()} == FILES


@pytest.mark.slow
def test_the_demo_comes_back_within_a_thousandth_of_a_wave(tmp_path):
    done = process("demo", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    made = {file.name for file in (tmp_path / "fringetrace-demo").iterdir()}
    missing = ft.views.opengl()
    assert made == FILES | (set() if missing else {"scene.png"})
    with xarray.open_dataset(tmp_path / "fringetrace-demo" / "result.nc", engine="h5netcdf") as data:
        assert data.attrs["residual_rms_m"] < 632.8 * nm / 1000
        assert np.isfinite(data["residual"]).all()


def test_the_height_as_files_of_zygo(command, sample, tmp_path):
    out = tmp_path / "out"
    given = ["interferogram", sample, "--unit", "mm", "--out", out, *QUICK, "--zygo"]
    code, said, _ = command(*given, "dat", "datx")
    assert code == 0
    assert "height.dat, height.datx, height.png" in said
    with xarray.open_dataset(out / "result.nc", engine="h5netcdf") as data:
        height, pitch = data.height.values, data.attrs["pixel_pitch_m"]
    for kind, error in (("dat", 632.8 * nm / 131072), ("datx", 1e-12 * nm)):
        z, found = meshes.read_height_map(out / f"height.{kind}")
        np.testing.assert_allclose(z, height, rtol=0, atol=error)
        assert found == pytest.approx(pitch, rel=1e-7)
    code, _, error = command(*given, "x3p")
    assert (code, error) == (2, "fringetrace: --zygo: expected dat or datx, got 'x3p'\n")


@pytest.mark.slow
@pytest.mark.skipif("FRINGETRACE_DATA" not in os.environ, reason="needs the folder FRINGETRACE_DATA")
def test_a_measured_surface_goes_through_like_any_mesh(command, tmp_path):
    file = Path(os.environ["FRINGETRACE_DATA"], "metropro-1.dat")
    code, said, errors = command("interferogram", file, "--out", tmp_path, "--no-picture")
    assert (code, errors) == (0, "")
    assert "metropro-1.dat" in said
    with xarray.open_dataset(tmp_path / "result.nc", engine="h5netcdf") as data:
        # exact off flat facets: what is left is their slope and curvature within a pixel
        assert data.attrs["residual_rms_away_from_steps_m"] < 632.8 * nm / 10_000
        assert np.isfinite(data["residual"]).all()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="takes the loader of Linux")
def test_without_opengl_all_but_the_picture_is_there(sample, tmp_path):
    libraries = tmp_path / "libraries"
    libraries.mkdir()
    for name in ("libEGL.so.1", "libEGL.so", "libGL.so.1", "libGL.so", "libX11.so.6", "libOSMesa.so.8"):
        shutil.copy(np._core._multiarray_umath.__file__, libraries / name)
    done = process(
        "interferogram", sample, "--unit", "mm", "--pixels", "24", "--out", tmp_path / "out",
        env={**os.environ, "LD_LIBRARY_PATH": os.fspath(libraries)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert {file.name for file in (tmp_path / "out").iterdir()} == FILES
    assert "no scene.png 3D pictures need OpenGL libraries" in done.stdout
    assert "apt-get install libegl1 libgl1-mesa-dri" in done.stdout


def test_help_and_version_are_quick_and_complete(command):
    code, said, _ = command("--help")
    assert code == 0
    assert "interferogram" in said
    assert "demo" in said
    code, said, _ = command("interferogram", "--help")
    for option in (
        "--unit",
        "--wavelength",
        "--pixels",
        "--out",
        "--aperture",
        "--tilt",
        "--rays",
        "--threads",
    ):
        assert option in said
    assert command("demo", "--help")[0] == 0
    assert command("--version")[1].strip() == ft.__version__


def test_long_work_shows_a_progress_bar(capsys, monkeypatch):
    monkeypatch.setattr(cli, "PATIENCE", -1.0)
    monkeypatch.setenv("FORCE_COLOR", "1")
    with cli._progress("tracing") as advance:
        advance(1, 4)
        advance(4, 4)
    assert "tracing" in capsys.readouterr().err


def test_short_work_shows_none(capsys):
    with cli._progress("tracing") as advance:
        advance(1, 4)
    assert capsys.readouterr().err == ""


@pytest.fixture
def odd_files(tmp_path):
    """Files that are no meshes, or meshes of which nothing can be seen from above in the middle."""
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "broken.stl").write_bytes(b"solid nonsense")
    upright = plate(1.0, 1.0).moved(turn=ft.vectors.rotation((1, 0, 0), np.pi / 2))
    meshes.save(upright, tmp_path / "wall.ply", "m")
    two = [plate(1.0, 1.0).moved((x, 0.0, 0.0)) for x in (-1.0, 1.0)]
    vertices, faces = [mesh.vertices for mesh in two], [two[0].faces, two[1].faces + 4]
    meshes.save(ft.Mesh(np.concatenate(vertices), np.concatenate(faces)), tmp_path / "apart.ply", "m")


ERRORS = {
    "unknown file": (["missing.stl", "--unit", "mm"], "missing.stl: expected an existing file"),
    "unknown kind": (["notes.txt", "--unit", "mm"], "notes.txt: expected a file named"),
    "no unit": (["step.stl"], "unit: expected one of pm, nm"),
    "unknown unit": (["step.stl", "--unit", "furlong"], "unit: expected one of pm, nm"),
    "wavelength 0": (["step.stl", "--unit", "mm", "--wavelength", "0 nm"], "wavelength: expected a positive"),
    "bare wavelength": (
        ["step.stl", "--unit", "mm", "--wavelength", "633"],
        "--wavelength: expected a number and",
    ),
    "no pixels": (["step.stl", "--unit", "mm", "--pixels", "0"], "--pixels: expected at least 1, got 0"),
    "no rays": (
        ["step.stl", "--unit", "mm", "--rays", "0"],
        "rays: expected a positive whole number, or a part of 1, got 0",
    ),
    "few steps": (["step.stl", "--unit", "mm", "--steps", "2"], "--steps: expected at least 3, got 2"),
    "no threads": (["step.stl", "--unit", "mm", "--threads", "0"], "threads: expected a whole number"),
    "no aperture": (
        ["step.stl", "--unit", "mm", "--aperture", "0 mm"],
        "--aperture: expected a positive length",
    ),
    "bare aperture": (
        ["step.stl", "--unit", "mm", "--aperture", "8"],
        "--aperture: expected a number and a unit",
    ),
    "bare tilt": (["step.stl", "--unit", "mm", "--tilt", "3"], "--tilt: expected a number and a unit"),
    "great tilt": (
        ["step.stl", "--unit", "mm", "--tilt", "20 deg"],
        "reference_tilt: expected up to 0.1 rad",
    ),
    "out is a file": (["step.stl", "--unit", "mm", "--out", "notes.txt"], "notes.txt"),
    "out below a file": (["step.stl", "--unit", "mm", "--out", "notes.txt/out"], "Not a directory"),
    "nothing to see": (["wall.ply", "--unit", "m"], "wall.ply: expected a surface across z"),
    "beside the mesh": (
        ["apart.ply", "--unit", "m", "--aperture", "1 mm"],
        "expected pixels with light from both arms",
    ),
    "not a number": (["step.stl", "--unit", "mm", "--pixels", "many"], "many"),
    "unknown option": (["step.stl", "--unit", "mm", "--colour", "red"], "--colour"),
    "no mesh": ([], "MESH"),
    "broken file": (["broken.stl", "--unit", "mm"], "broken.stl"),
}


@pytest.mark.usefixtures("sample", "odd_files")
@pytest.mark.parametrize("case", ERRORS)
def test_an_error_is_one_clear_line_and_leaves_nothing(case, command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    arguments, message = ERRORS[case]
    code, _, errors = command("interferogram", *arguments, "--no-picture")
    assert code == 2
    assert errors.startswith("fringetrace: ")
    assert errors.count("\n") == 1
    assert message in errors
    assert {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == before


def test_an_error_is_found_before_anything_is_traced(command, sample, tmp_path, monkeypatch):
    traced = "fringetrace.instruments.interferometer.trace"
    monkeypatch.setattr(traced, lambda *args, **options: pytest.fail("traced"))
    (tmp_path / "out").write_text("")
    for options in (["--out", tmp_path / "out"], ["--steps", "2"], ["--wavelength", "0 nm"]):
        assert command("interferogram", sample, "--unit", "mm", *options)[0] == 2


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_the_right_to_write_is_refused(command, sample, tmp_path):
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    code, _, errors = command("interferogram", sample, "--unit", "mm", "--out", closed, *QUICK)
    assert code == 2
    assert "Permission denied" in errors


def test_a_failure_on_the_way_leaves_nothing_half_written(command, sample, tmp_path, monkeypatch):
    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fringetrace.validation.measurement.write_measurement", full)
    code, _, errors = command("interferogram", sample, "--unit", "mm", "--out", tmp_path / "out", *QUICK)
    assert code == 2
    assert "No space left on device" in errors
    assert not (tmp_path / "out").exists()


def test_an_interrupt_ends_it_quietly(command, sample, tmp_path, monkeypatch):
    def interrupted(*args, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("fringetrace.instruments.interferometer.trace", interrupted)
    out = tmp_path / "out"
    assert command("interferogram", sample, "--unit", "mm", "--out", out, *QUICK)[::2] == (130, "")
    assert not out.exists()


def test_a_bench_says_what_methods_need_and_writes_it_down(command, tmp_path):
    out = tmp_path / "out"
    code, said, errors = command("bench", "--quick", "--scenes", "valley", "--out", out)
    assert (code, errors) == (0, "")
    assert {file.name for file in out.iterdir()} == {"work_precision.json", "work_precision.png"}
    table = [line for line in said.splitlines() if line.startswith("| valley of two mirrors")]
    assert [row.split("|")[2].strip() for row in table] == [
        "float32, facets", "rays, facets", "wavefront, facets",
    ]  # fmt: skip
    assert "work_precision.png" in said


def test_a_bench_of_unknown_scenes_is_refused(command, tmp_path):
    code, said, errors = command("bench", "--scenes", "step", "lens", "--out", tmp_path / "out")
    assert (code, said) == (2, "")
    assert "scenes: expected some of paraboloid" in errors
    assert "got 'lens'" in errors
    assert not (tmp_path / "out").exists()


def test_a_bench_that_fails_leaves_nothing(command, tmp_path, monkeypatch):
    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("fringetrace.validation.work_precision.write", full)
    code, _, errors = command("bench", "--quick", "--scenes", "tilt", "--out", tmp_path / "out")
    assert code == 2
    assert "No space left on device" in errors
    assert not (tmp_path / "out").exists()


def test_it_fails_as_a_command_of_its_own(tmp_path):
    done = process("interferogram", "missing.stl", "--unit", "mm", cwd=tmp_path)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert not done.stdout
