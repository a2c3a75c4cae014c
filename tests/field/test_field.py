"""Fields as a noun: of paths, as arrays, labelled, and what is refused."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm, um
from fringetrace.geometry import shapes

HENE = 632.8 * nm
CCD = ft.CCD((1 * mm, 2 * mm, 3 * mm), (0, 1, 1), (0, 1, -1), 5 * um, (4, 6), focus=2 * mm)


def noise(*shape):
    rng = np.random.default_rng(4)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def traced():
    mirror = ft.Surface(shapes.plate(10 * mm, 10 * mm), ft.Mirror())
    beam = ft.Beam((0, 0, 9 * mm), (0, 0, -1), (0, 1, 0), (3 * mm, 3 * mm), (6, 6))
    ccd = ft.CCD((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), 0.1 * mm, (40, 40))
    return ft.trace(ft.Scene([mirror]), beam, ccd)


@pytest.mark.parametrize("method", ["wavefront", "rays"])
def test_the_field_of_paths_is_their_complex_field(method):
    paths = traced()
    field = ft.Field.of(paths, HENE, method, half_wave_loss=False)
    assert np.array_equal(field, ft.complex_field(paths, HENE, method, half_wave_loss=False))
    assert (field.plane, field.wavelength, field.components) == (paths.ccd, HENE, ())
    assert np.array_equal(ft.Field.of(iter([paths]), HENE, method), ft.complex_field(paths, HENE, method))


def test_numpy_takes_it_for_its_values():
    values = noise(4, 6)
    field = ft.Field(values, CCD, HENE)
    assert np.array_equal(np.abs(field), np.abs(values))
    assert np.array_equal(np.exp(1j) * np.asarray(field), np.exp(1j) * values)
    assert np.asarray(field) is field.values
    assert np.array(field) is not field.values
    assert np.asarray(field, dtype=np.complex64).dtype == np.complex64


def test_irradiance_adds_up_over_components():
    values = noise(3, 4, 6)
    field = ft.Field(values, CCD, HENE)
    assert field.components == ("x", "y", "normal")
    np.testing.assert_array_equal(field.irradiance, (np.abs(values) ** 2).sum(axis=0))
    assert ft.Field(values[:2], CCD, HENE).components == ("x", "y")
    np.testing.assert_array_equal(ft.Field(values[0], CCD, HENE).irradiance, np.abs(values[0]) ** 2)


def test_it_says_what_it_is():
    assert repr(ft.Field(noise(4, 6), CCD, HENE)) == "Field(4 x 6 pixels of 5 um at 632.8 nm)"
    polarised = ft.Field(noise(2, 4, 6), CCD, HENE)
    assert repr(polarised) == "Field(4 x 6 pixels of 5 um at 632.8 nm, components x, y)"


def test_a_field_does_not_change():
    field = ft.Field(noise(4, 6), CCD, HENE)
    with pytest.raises(FrozenInstanceError):
        field.wavelength = 500 * nm


# Labelled


@pytest.mark.parametrize("shape", [(4, 6), (2, 4, 6), (3, 4, 6)])
def test_a_labelled_field_is_read_back(shape):
    field = ft.Field(noise(*shape), CCD, HENE)
    table = field.to_xarray()
    assert table.dims == (*(["component"] if len(shape) == 3 else []), "y", "x")
    assert float(table.x[1] - table.x[0]) == pytest.approx(5 * um)
    assert float(table.y.mean()) == pytest.approx(0.0, abs=1e-18)
    for again in (ft.Field.from_xarray(table), ft.Field.from_xarray(table.transpose("x", ...))):
        assert np.array_equal(again, field)
        assert again.wavelength == HENE
        for name in ("centre", "normal", "up"):
            np.testing.assert_array_equal(getattr(again.plane, name), getattr(CCD, name))
        assert replace(again.plane, centre=CCD.centre).shape == CCD.shape
        assert (again.plane.pitch, again.plane.focus) == (CCD.pitch, CCD.focus)


def test_tables_that_are_no_field():
    table = ft.Field(noise(4, 6), CCD, HENE).to_xarray()
    with pytest.raises(ValueError, match="field table: expected axes y and x, or component, y and x, got y"):
        ft.Field.from_xarray(table[:, 0])
    del table.attrs["up"]
    with pytest.raises(ValueError, match=r"field table: expected attributes wavelength_m.* missing \['up'\]"):
        ft.Field.from_xarray(table)


# What is refused


@pytest.mark.parametrize("shape", [(6, 4), (4, 4, 6), (1, 4, 6), (24,)])
def test_values_that_do_not_fit_the_plane(shape):
    with pytest.raises(ValueError, match=r"Field values: expected shape \(4, 6\), or 2 or 3 components"):
        ft.Field(noise(*shape), CCD, HENE)


def test_values_that_are_not_finite():
    values = noise(4, 6)
    values[1, 2] = np.nan
    with pytest.raises(ValueError, match="Field values: expected finite numbers, got NaN or infinity"):
        ft.Field(values, CCD, HENE)


def test_wavelengths_and_planes_that_are_none():
    with pytest.raises(ValueError, match="wavelength: expected a positive length in metres"):
        ft.Field(noise(4, 6), CCD, -HENE)
    with pytest.raises(TypeError, match="Field plane: expected a CCD, got tuple"):
        ft.Field(noise(4, 6), (4, 6), HENE)
