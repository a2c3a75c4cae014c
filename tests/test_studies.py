"""Lattices of rods: where they stand, and studies of them."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray

import fringetrace as ft
from fringetrace import degree, nm
from fringetrace.goniometer import Cones, brdf
from fringetrace.studies import Lattice, study

WAVES = np.linspace(400, 600, 5) * nm
THETA = np.array([-20, 20]) * degree


def test_the_staggered_one_is_that_of_shapes():
    mesh, known = Lattice(4, 3).mesh, ft.shapes.rod_lattice(4, 3, 65 * nm, 280 * nm, 2e-6)
    assert np.array_equal(mesh.faces, known.faces)
    offset = mesh.vertices - known.vertices
    assert np.ptp(offset, axis=0) == pytest.approx(0.0, abs=1e-12 * 280 * nm)


@pytest.mark.parametrize(("arrangement", "neighbours"), [("square", 4), ("hexagonal", 6), ("staggered", 2)])
def test_how_many_neighbours_are_a_pitch_away(arrangement, neighbours):
    places = Lattice(7, 7, arrangement=arrangement).centres
    apart = np.linalg.norm(places[:, None] - places, axis=2) / (280 * nm)
    assert (abs(apart - 1.0) < 1e-9).sum(axis=1).max() == neighbours
    assert places.min(axis=0) == pytest.approx(-places.max(axis=0))


def test_rows_may_be_any_distance_apart():
    assert np.ptp(Lattice(2, 3, spacing=100 * nm).centres[:, 1]) == pytest.approx(200 * nm)


def test_disorder_is_seeded_and_of_its_size():
    kind = Lattice(60, 60, disorder=0.1, seed=3)
    moved = (kind.centres - Lattice(60, 60).centres) / kind.pitch
    assert moved.std(axis=0) == pytest.approx(0.1, rel=4 / np.sqrt(2 * 3600))  # four sigma
    assert np.array_equal(kind.centres, Lattice(60, 60, disorder=0.1, seed=3).centres)
    assert not np.array_equal(kind.centres, Lattice(60, 60, disorder=0.1, seed=4).centres)


def test_a_study_is_a_brdf_of_each(tmp_path):
    base, axes = Lattice(4, 2), {"pitch": [250 * nm, 280 * nm], "arrangement": ["square", "hexagonal"]}
    said = []
    with ThreadPoolExecutor(1) as pool:
        table = study(
            base, axes, THETA, THETA, WAVES, rays=200, folder=tmp_path, executor=pool,
            progress=lambda *counts: said.append(counts),
        )  # fmt: skip
    assert said[-1] == (4, 4)
    assert table.dims == ("pitch", "arrangement", "theta_i", "phi_i", "theta_o", "phi_o", "wavelength")
    assert table.attrs["lattice_rows"] == 2
    one = brdf(
        Lattice(4, 2, pitch=280 * nm, arrangement="square").scene, THETA, Cones(THETA, 1 * degree), WAVES,
        rays=(1, 200),
    )  # fmt: skip
    same = table.sel(pitch=280 * nm, arrangement="square")
    assert same.values.tobytes() == one.values.tobytes()
    assert np.array_equal(same.reflected, one.reflected)
    assert len(list(tmp_path.iterdir())) == 4
    table.to_netcdf(tmp_path / "study.nc", engine="h5netcdf")
    with xarray.open_dataarray(tmp_path / "study.nc", engine="h5netcdf") as stored:
        assert np.array_equal(stored, table)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"arrangement": "cubic"}, "arrangement: expected one of square, staggered, hexagonal, got 'cubic'"),
        ({"columns": 0}, "lattice columns: expected a whole number from 1, got 0"),
        ({"rows": 2.5}, "lattice rows: expected a whole number from 1, got 2.5"),
        ({"pitch": -1.0}, "lattice pitch: expected a positive length"),
        ({"spacing": 0.0}, "lattice spacing: expected a positive length"),
        ({"disorder": -0.1}, "lattice disorder: expected a number of at least 0, got -0.1"),
    ],
)
def test_what_is_refused(changed, message):
    with pytest.raises(ValueError, match=message):
        Lattice(**changed)


def test_a_study_of_what_is_not_there():
    with pytest.raises(ValueError, match=r"lattice study: expected parameters among columns, .* got 'index'"):
        study(Lattice(), {"index": [1.5]}, THETA, THETA, WAVES)
