"""Images with names, units, and coordinates in metres; there and back through NetCDF."""

import numpy as np
import pytest
import xarray

from fringetrace import mm, nm, um
from fringetrace.core import tables
from fringetrace.instruments import records

HEIGHT = np.arange(6.0).reshape(2, 3) * nm


def test_pixels_have_coordinates_in_metres_from_the_middle():
    data = records.dataset({"height": HEIGHT}, 2 * um)
    assert data.height.dims == ("y", "x")
    assert data.x.values == pytest.approx([-2 * um, 0.0, 2 * um])
    assert data.y.values == pytest.approx([-1 * um, 1 * um])
    assert {data[name].attrs["units"] for name in ("x", "y", "height")} == {"m"}
    assert data.height.sel(y=1 * um, x=2 * um, method="nearest") == HEIGHT[1, 2]
    assert data.attrs["pixel_pitch_m"] == 2 * um
    assert "row 0 has the smallest y" in data.attrs["convention"]


def test_further_axes_and_attributes():
    frames = np.ones((4, 2, 3))
    axes = {"step": (np.arange(4) * np.pi / 2, "rad")}
    data = records.dataset({"frames": (("step",), frames), "own": HEIGHT}, mm, axes, wavelength_m=532 * nm)
    assert data.frames.dims == ("step", "y", "x")
    assert data.step.attrs["units"] == "rad"
    assert data.attrs["wavelength_m"] == 532 * nm
    assert data.own.attrs == {}


def test_netcdf_there_and_back(tmp_path):
    holed = np.where(HEIGHT > 0.0, HEIGHT, np.nan)
    data = records.dataset({"height": holed, "field_imag": HEIGHT}, um, wavelength_m=633 * nm)
    tables.write_netcdf(data, tmp_path / "maps.nc")
    xarray.testing.assert_identical(xarray.load_dataset(tmp_path / "maps.nc", engine="h5netcdf"), data)


@pytest.mark.parametrize(
    "images",
    [
        {},
        {"height": np.zeros(3)},
        {"height": HEIGHT, "residual": HEIGHT.T},
        {"frames": np.zeros((4, 2, 3))},
        {"frames": (("step",), HEIGHT)},
    ],
)
def test_images_that_are_not_of_one_ccd(images):
    with pytest.raises(ValueError, match=r"images: expected \(rows, columns\) after their axes, all alike"):
        records.dataset(images, um)
