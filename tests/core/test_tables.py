"""Labelled tables: units, NetCDF there and back, and the CSV files that people have."""

import csv

import numpy as np
import pytest
import xarray

from fringetrace import nm
from fringetrace.core import tables


def test_netcdf_there_and_back(tmp_path):
    axes = {"theta": (np.radians([0.0, 10.0]), "rad"), "wavelength": (np.array([400, 500, 600]) * nm, "m")}
    table = tables.labelled(np.arange(6.0).reshape(2, 3), axes, name="brdf", unit="1/sr", polarisation="none")
    tables.write_netcdf(table, tmp_path / "brdf.nc")
    back = tables.read_netcdf(tmp_path / "brdf.nc")
    assert back.identical(table)
    assert back.attrs == {"units": "1/sr", "polarisation": "none"}
    assert back["wavelength"].attrs == {"units": "m"}
    assert [path.name for path in tmp_path.iterdir()] == ["brdf.nc"]


@pytest.mark.parametrize(
    ("text", "scale"),
    [
        ("wavelength / nm,one\n400,0.25\n500,0.5\n", 1.0),
        ("Wavelength (nm);one\n500;0.5\n400;0.25\n", 1.0),
        ("# a spectrometer, 2013\nlambda [um]\tone\n0.4\t0.25\n0.5\t0.5\n", 1.0),
        ("\ufeffwavelength_nm, one\n400, 0.25\n\n500, 0.5\n", 1.0),
        ("wl,one\n400,25\n500,50\n", 1.0),
        ("wavelength / nm,one %\n400,25\n500,50\n", 1.0),
    ],
)
def test_files_as_people_have_them(tmp_path, text, scale):
    (tmp_path / "one.csv").write_text(text, encoding="utf-8")
    found = tables.read_csv(tmp_path / "one.csv")
    assert np.asarray(found["wavelength"]) == pytest.approx([400 * nm, 500 * nm], rel=1e-12)
    assert np.asarray(found) == pytest.approx(np.array([[0.25, 0.5]]) * scale, rel=1e-12)


def test_unit_and_percent_can_be_said(tmp_path):
    (tmp_path / "one.csv").write_text("x,one\n0.4,25\n0.5,50\n")
    found = tables.read_csv(tmp_path / "one.csv", unit="um", percent=True)
    assert np.asarray(found) == pytest.approx(np.array([[0.25, 0.5]]), rel=1e-12)
    assert np.asarray(found["wavelength"]) == pytest.approx([400 * nm, 500 * nm], rel=1e-12)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("wavelength,one\n400,1\n", "unit of column 'wavelength': expected one of pm, nm, .* got None"),
        ("wavelength / px,one\n400,1\n", "unit of column 'wavelength / px': expected one of pm, .* got 'px'"),
        ("wl,one\n400,1\n500,\n", "expected numbers, got 'nan' in row 2 of 'one'"),
        ("wl,one\n400,bright\n", "expected numbers, got 'bright' in row 1 of 'one'"),
        ("wl,one\n400,1\n400,2\n", "expected each wavelength once, got 400 twice"),
        ("wl\n400\n", "expected a column of wavelengths and others of values, got 'wl'"),
        ("", "expected a column of wavelengths and others of values, got ''"),
    ],
)
def test_files_that_do_not_say_what_they_are_are_refused(tmp_path, text, said):
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(ValueError, match=said):
        tables.read_csv(tmp_path / "bad.csv")


def test_other_axes_are_not_written(tmp_path):
    table = tables.labelled([1.0], {"theta": ([0.0], "rad")}, name="brdf", unit="1/sr")
    with pytest.raises(ValueError, match="spectra: expected axes sample and wavelength, got theta"):
        tables.write_csv(table, tmp_path / "no.csv")
    assert not list(tmp_path.iterdir())


@pytest.fixture
def table():
    values = np.array([[0.1, 0.2, 1.0 / 3.0], [1e-300, -4.0, 5.0]])
    coordinates = {"x": ("x", [1.5, 2.5], {"units": "m"}), "y": ("y", [1.0, 2.0, 3.0]), "half": ("x", [1, 2])}
    return tables.array(values, ("x", "y"), coordinates, "height", {"units": "m"})


def test_names_and_units(table):
    assert table.dims == ("x", "y")
    assert table.name == "height"
    assert table.x.attrs["units"] == table.attrs["units"] == "m"
    both = tables.labelled_dataset({"a": ("x", [1.0])}, {"x": ("x", [2.0])}, {"title": "two"})
    assert both.a.sel(x=2.0) == 1.0
    assert both.attrs["title"] == "two"


def test_arrays_of_more_coordinates_come_back(table, tmp_path):
    tables.write_netcdf(table, tmp_path / "table.nc")
    with xarray.open_dataarray(tmp_path / "table.nc", engine="h5netcdf") as stored:
        xarray.testing.assert_identical(stored.load(), table)
    assert [file.name for file in tmp_path.iterdir()] == ["table.nc"]


def test_csv_keeps_every_digit(table, tmp_path):
    tables.write_rows(table, tmp_path / "table.csv")
    with (tmp_path / "table.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["x", "y", "height"]
    assert [float(row["height"]) for row in rows] == table.values.ravel().tolist()
    assert [float(row["y"]) for row in rows] == [1.0, 2.0, 3.0] * 2


def test_nothing_is_left_of_what_fails(table, tmp_path):
    with pytest.raises(FileNotFoundError):
        tables.write_rows(table, tmp_path / "none" / "table.csv")
    (tmp_path / "table.csv").mkdir()
    with pytest.raises(OSError, match=r"table\.csv"):
        tables.write_rows(table, tmp_path / "table.csv")
    assert [file.name for file in tmp_path.iterdir()] == ["table.csv"]
