"""Labelled arrays, and their files."""

import csv

import numpy as np
import pytest
import xarray

from fringetrace import labels


@pytest.fixture
def table():
    values = np.array([[0.1, 0.2, 1.0 / 3.0], [1e-300, -4.0, 5.0]])
    coordinates = {"x": ("x", [1.5, 2.5], {"units": "m"}), "y": ("y", [1.0, 2.0, 3.0]), "half": ("x", [1, 2])}
    return labels.labelled(values, ("x", "y"), coordinates, "height", {"units": "m"})


def test_names_and_units(table):
    assert table.dims == ("x", "y")
    assert table.name == "height"
    assert table.x.attrs["units"] == table.attrs["units"] == "m"
    both = labels.dataset({"a": ("x", [1.0])}, {"x": ("x", [2.0])}, {"title": "two"})
    assert both.a.sel(x=2.0) == 1.0
    assert both.attrs["title"] == "two"


def test_netcdf_comes_back(table, tmp_path):
    labels.write_netcdf(table, tmp_path / "table.nc")
    with xarray.open_dataarray(tmp_path / "table.nc", engine="h5netcdf") as stored:
        xarray.testing.assert_identical(stored.load(), table)
    assert [file.name for file in tmp_path.iterdir()] == ["table.nc"]


def test_csv_keeps_every_digit(table, tmp_path):
    labels.write_csv(table, tmp_path / "table.csv")
    with (tmp_path / "table.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["x", "y", "height"]
    assert [float(row["height"]) for row in rows] == table.values.ravel().tolist()
    assert [float(row["y"]) for row in rows] == [1.0, 2.0, 3.0] * 2


def test_nothing_is_left_of_what_fails(table, tmp_path):
    with pytest.raises(FileNotFoundError):
        labels.write_csv(table, tmp_path / "none" / "table.csv")
    (tmp_path / "table.csv").mkdir()
    with pytest.raises(OSError, match=r"table\.csv"):
        labels.write_csv(table, tmp_path / "table.csv")
    assert [file.name for file in tmp_path.iterdir()] == ["table.csv"]
