"""Zygo's files: read as they are, written so that others read them, and there and back."""

import os
import struct
from pathlib import Path

import h5py
import numpy as np
import pytest
from prysm.interferogram import Interferogram

from fringetrace import nm, um
from fringetrace.geometry import meshes, zygo

# A few roundings of float64.
ROUNDING = 1e-15
# Half a count of a MetroPro file, in wavelengths; and float32's half unit in the last place.
COUNT, FLOAT32 = 0.5 * 0.5 / 32768, 2.0**-24
MAP = np.array([[100.0, -20.5, np.nan, 3.0], [0.0, 1e4, 1e-3, -7.25]]) * nm


def metropro(counts, *, pitch=2.0**-20, sign=0, resolution=1):
    """A MetroPro file of whole counts, laid out as in Zygo's reference guide; one count is 2**-37 m."""
    rows, columns = counts.shape
    header = bytearray(834)
    struct.pack_into(">IHI", header, 0, 0x881B036F, 1, len(header))
    struct.pack_into(">5HHI", header, 48, 0, 0, columns, rows, 1, 255, 2 * counts.size)
    struct.pack_into(">4HI", header, 64, 0, 0, columns, rows, 4 * counts.size)
    # interferometric scale factor, wavelength, numerical aperture, obliquity, magnification, pitch
    struct.pack_into(">6f", header, 164, 0.5, 2.0**-21, 0.0, 1.0, 0.0, pitch)
    struct.pack_into(">H", header, 218, resolution)
    struct.pack_into(">H", header, 232, sign)
    return bytes(header) + np.zeros(counts.shape, ">u2").tobytes() + counts.astype(">i4").tobytes()


INVALID = 2147483640
COUNTS = np.array([[100, 200, INVALID], [-400, 500, 600]])


def test_a_metropro_file_is_read_in_metres_from_below(tmp_path):
    file = tmp_path / "map.dat"
    file.write_bytes(metropro(COUNTS))
    z, pitch = zygo.read_height_map(file)
    assert z.dtype == np.float64
    assert pitch == 2.0**-20
    # the file's first row is the top of the picture
    assert z / 2.0**-37 == pytest.approx(np.array([[-400, 500, 600], [100, 200, np.nan]]), nan_ok=True)


def test_a_metropro_file_may_count_downwards(tmp_path):
    file = tmp_path / "map.dat"
    file.write_bytes(metropro(COUNTS, sign=1, resolution=0))
    z, _ = zygo.read_height_map(str(file))
    assert z[0] / 2.0**-34 == pytest.approx([400, -500, -600])


def test_a_metropro_file_is_a_mesh_with_holes(tmp_path):
    file = tmp_path / "map.DAT"
    file.write_bytes(metropro(COUNTS))
    assert meshes.read_height_map is zygo.read_height_map
    for mesh in (meshes.load(file), meshes.load(file, unit="mm")):  # it knows its own unit
        assert len(mesh.faces) == 3
        assert mesh.name == "map.DAT"
        assert mesh.bounds[:, 0].tolist() == [-(2.0**-20), 2.0**-20]
        assert mesh.bounds[:, 2] == pytest.approx([-400 * 2.0**-37, 600 * 2.0**-37])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (metropro(COUNTS)[:-1], "map.dat: expected a whole MetroPro file, got one that does not parse"),
        (metropro(COUNTS)[:300], "map.dat: expected a whole MetroPro file"),
        (metropro(COUNTS, resolution=7), "map.dat: expected a whole MetroPro file"),
        (metropro(COUNTS, pitch=0.0), "map.dat: expected a calibrated map, got a lateral resolution of 0 m"),
        (b"", "map.dat: expected a MetroPro file, got one that begins with b''"),
        (b"1.0 2.0 3.0", "map.dat: expected a MetroPro file, got one that begins with b'1.0 '"),
    ],
)
def test_metropro_files_that_are_wrong(tmp_path, content, message):
    file = tmp_path / "map.dat"
    file.write_bytes(content)
    with pytest.raises(ValueError, match=message):
        meshes.load(file)


def test_other_files_are_no_height_maps(tmp_path):
    file = tmp_path / "map.txt"
    file.write_text("1 2 3")
    with pytest.raises(ValueError, match=r"map.txt: expected a height map named .dat or .datx, got '.txt'"):
        zygo.read_height_map(file)


def test_a_map_that_somebody_measured():
    folder = os.environ.get("FRINGETRACE_DATA")
    if not folder:
        pytest.skip("FRINGETRACE_DATA names no folder of measured data")
    file = Path(folder) / "metropro-1.dat"
    z, pitch = zygo.read_height_map(file)
    assert z.shape == (480, 640)
    assert pitch == pytest.approx(1.098 * um, abs=0.0005 * um)
    assert np.nanmax(z) - np.nanmin(z) == pytest.approx(1.363 * um, abs=0.0005 * um)
    assert np.nanstd(z) == pytest.approx(75.3 * nm, abs=0.05 * nm)
    # the numbers themselves, straight from the file: counts of half a wavelength over 32768, top row first
    content = file.read_bytes()
    scale, wavelength = struct.unpack_from(">2f", content, 164)
    counts = np.frombuffer(content, ">i4", 480 * 640, len(content) - 4 * 480 * 640).reshape(480, 640)
    expected = np.where(counts < INVALID, counts * (scale * wavelength / 32768), np.nan)[::-1]
    assert np.allclose(z, expected, rtol=ROUNDING, atol=0, equal_nan=True)

    mesh = meshes.load(file)
    assert len(mesh.vertices) == np.isfinite(z).sum()
    column, row = (np.arange(640) - 319.5) * pitch, (np.arange(480) - 239.5) * pitch
    seen = meshes.interpolate_height(mesh, column[::5], row[::5, None])
    assert np.array_equal(seen, z[::5, ::5], equal_nan=True)


def test_the_measured_map_goes_there_and_back(tmp_path):
    folder = os.environ.get("FRINGETRACE_DATA")
    if not folder:
        pytest.skip("FRINGETRACE_DATA names no folder of measured data")
    z, pitch = zygo.read_height_map(Path(folder) / "metropro-1.dat")
    for name in ("again.dat", "again.datx"):
        zygo.write_height_map(z, pitch, tmp_path / name, wavelength=570 * nm)
        again, same = zygo.read_height_map(tmp_path / name)
        assert same == pitch
        assert np.allclose(again, z, rtol=ROUNDING, atol=0, equal_nan=True)  # the same counts, or nm


@pytest.mark.parametrize(("suffix", "error"), [(".dat", COUNT * 632.8 * nm), (".datx", 0.0), (".DATX", 0.0)])
def test_what_was_written_is_read(tmp_path, suffix, error):
    file = tmp_path / f"map{suffix}"
    meshes.write_height_map(MAP, 2 * um, file)
    z, pitch = zygo.read_height_map(file)
    np.testing.assert_allclose(z, MAP, rtol=ROUNDING, atol=error)
    assert pitch == pytest.approx(2 * um, rel=FLOAT32 if suffix == ".dat" else 0, abs=0)
    assert [path.name for path in tmp_path.iterdir()] == [file.name]
    assert meshes.load(file).bounds[1, 2] == pytest.approx(np.nanmax(MAP), rel=1e-6)


@pytest.mark.parametrize("suffix", [".dat", ".datx"])
def test_prysm_finds_heights_pitch_and_wavelength(tmp_path, suffix):
    """The top row first, in nanometres; millimetres and micrometres, as prysm has them."""
    zygo.write_height_map(MAP, 2 * um, tmp_path / f"map{suffix}", wavelength=532 * nm)
    found = Interferogram.from_zygo_dat(tmp_path / f"map{suffix}")
    np.testing.assert_allclose(found.data, MAP[::-1] / nm, rtol=ROUNDING, atol=COUNT * 532)
    assert found.dx == pytest.approx(2e-3, rel=FLOAT32)
    assert found.wavelength == pytest.approx(0.532, rel=FLOAT32)


def mx(path, values, unit="NanoMeters", pitches=(2e-6, 2e-6), **attributes):
    """A file of Mx, as prysm and SurfaceTopography read them."""
    zygo.write_height_map(np.zeros(np.shape(values)), pitches[0], path, wavelength=600 * nm)
    with h5py.File(path, "r+") as file:
        (surface,) = file["Data/Surface"].values()
        surface[...] = values
        surface.attrs["Unit"] = np.array([unit], h5py.string_dtype())
        for name, value in attributes.items():
            surface.attrs[name.replace("_", " ")] = [value]
        converter = surface.attrs["Y Converter"]
        converter["Parameters"][0][1] = pitches[1]
        surface.attrs.modify("Y Converter", converter)
    return path


def test_an_mx_file_may_count_fringes(tmp_path):
    """A fringe is half a wave of height, times the obliquity of a Mirau objective."""
    file = mx(tmp_path / "map.datx", [[1.0, 2.0], [-1, 1e38]], "Fringes", No_Data=1e38, Obliquity_Factor=1.1)
    z, pitch = zygo.read_height_map(file)
    assert z == pytest.approx(np.array([[-1.0, np.nan], [1.0, 2.0]]) * 0.5 * 1.1 * 600 * nm, nan_ok=True)
    assert pitch == 2 * um


def test_mx_files_that_are_wrong(tmp_path):
    file = tmp_path / "map.datx"
    for content, message in (
        (b"", "map.datx: expected a Mx file, got one that begins with b''"),
        (b"\x89HDF\r\n\x1a\n", "map.datx: expected a whole Mx file, got one that does not parse"),
    ):
        file.write_bytes(content)
        with pytest.raises(ValueError, match=message):
            zygo.read_height_map(file)
    with pytest.raises(ValueError, match=r"does not parse: .*unit"):
        zygo.read_height_map(mx(file, [[0.0]], "Parsecs"))
    with pytest.raises(ValueError, match="does not parse: pixels of 2e-06 m x 3e-06 m, which are no squares"):
        zygo.read_height_map(mx(file, [[0.0]], pitches=(2e-6, 3e-6)))


def test_what_cannot_be_written(tmp_path):
    for z, name, message in (
        (np.zeros(3), "map.dat", r"height map: expected shape \(rows, columns\), got \(3,\)"),
        (MAP, "map.xyz", "map.xyz: expected a file named .dat or .datx, got '.xyz'"),
        (MAP, "map", "map: expected a file named .dat or .datx, got 'no suffix'"),
        (MAP * 1e7, "map.dat", "expected at most what 2147483640 counts say, got 100 m; write a .datx"),
        (np.zeros((1, 65536)), "map.dat", "expected at most 65535 rows and columns, got 1 x 65536"),
    ):
        with pytest.raises(ValueError, match=message):
            zygo.write_height_map(z, um, tmp_path / name)
    with pytest.raises(ValueError, match="pitch: expected a positive length"):
        zygo.write_height_map(MAP, -1.0, tmp_path / "map.dat")
    assert not list(tmp_path.iterdir())
