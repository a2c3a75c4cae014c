"""Labelled tables: units, NetCDF there and back, and the CSV files that people have."""

import numpy as np
import pytest

from fringetrace import nm, tables


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
