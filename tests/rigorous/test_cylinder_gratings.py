import math

import numpy as np
import pytest
from rods import feather, keratin, melanin

from fringetrace import nm
from fringetrace.optics.materials.named_materials import KERATIN, MELANIN
from fringetrace.rigorous.cylinder_gratings import CylinderGratings, Row, diffract, reflectance_spectrum
from fringetrace.rigorous.cylindrical_waves import CONDUCTOR

BALANCE = 1e-10  # power, and reciprocity: rounding of a stack
ROW = Row(80 * nm, 50 * nm, 1.75)


def clear(**changes):
    """Two staggered rows of clear rods, wide enough for several orders."""
    rows = [Row(200 * nm, 150 * nm, 1.9), Row(520 * nm, 110 * nm, 1.0, 260 * nm)]
    return CylinderGratings(
        **{"pitch": 700 * nm, "thickness": 700 * nm, "rows": rows, "host": 1.5, "back": 1.3, **changes}
    )


@pytest.mark.parametrize("polarisation", ["s", "p"])
@pytest.mark.parametrize("index", [1.9, CONDUCTOR])
def test_clear_lattices_keep_power(polarisation, index):
    lattice = clear(rows=[Row(200 * nm, 150 * nm, index), Row(520 * nm, 110 * nm, 1.0, 260 * nm)])
    wavelength, angle = np.meshgrid([450 * nm, 633 * nm, 900 * nm], [0.0, 0.4, 1.2])
    found = diffract(lattice, wavelength, angle, polarisation)
    assert found.reflectance.shape == (3, 3, len(found.orders))
    total = found.reflectance.sum(-1) + found.transmittance.sum(-1)
    np.testing.assert_allclose(total, 1, rtol=BALANCE)
    assert np.all((found.reflectance > 1e-6).sum(-1)[0, :2] > 1)  # orders do leave


@pytest.mark.parametrize("polarisation", ["s", "p"])
def test_reciprocity_of_a_reflected_order(polarisation):
    lattice = clear(rows=[Row(200 * nm, 150 * nm, 1.9 + 0.2j), Row(520 * nm, 110 * nm, 1.0, 260 * nm)])
    wavelength, there = 500 * nm, 0.3
    back = math.asin(math.sin(there) - wavelength / (700 * nm))
    one, other = (diffract(lattice, wavelength, angle, polarisation) for angle in (there, -back))
    order = int(np.flatnonzero(one.orders == -1)[0])
    assert one.reflectance[order] == pytest.approx(other.reflectance[order], rel=BALANCE)
    assert one.reflectance[order] > 1e-4


def test_zero_order_transmission_is_the_same_from_both_sides():
    rows = [Row(200 * nm, 150 * nm, 1.9 + 0.1j), Row(520 * nm, 110 * nm, 1.0, 260 * nm)]
    upside = [Row(700 * nm - row.depth, row.radius, row.index, row.offset) for row in rows]
    one = diffract(clear(rows=rows, back=1.0), 800 * nm, 0.2, "p")
    other = diffract(clear(rows=upside, back=1.0), 800 * nm, -0.2, "p")
    middle = len(one.orders) // 2
    assert one.transmittance[middle] == pytest.approx(other.transmittance[middle], rel=BALANCE)
    assert abs(one.reflectance[middle] / other.reflectance[middle] - 1) > 0.01


def test_a_lattice_without_rows_is_a_film():
    # a soap film at 45 degrees
    film = CylinderGratings(500 * nm, 300 * nm, [], 1.33, 1.0, 1.0)
    for polarisation, expected in (("s", 0.156811922), ("p", 0.008708218)):
        for method in ("rods", "multilayer"):
            found = reflectance_spectrum(film, 500 * nm, math.pi / 4, polarisation, method)
            assert found.reflectance == pytest.approx(expected, abs=6e-10)


def test_matched_rods_are_not_seen():
    found = reflectance_spectrum(CylinderGratings(200 * nm, 160 * nm, [ROW], 1.75, 1.75), 500 * nm, 0.3)
    assert found.reflectance < 1e-25
    assert found.transmittance == pytest.approx(1, rel=BALANCE)


def test_where_rows_are_cut_does_not_matter():
    # period doubled: every second rod is another one, at the same place
    one = CylinderGratings(200 * nm, 400 * nm, [ROW, Row(250 * nm, 60 * nm, 1.3, 40 * nm)], 1.55)
    shifted = CylinderGratings(
        200 * nm, 400 * nm, [Row(80 * nm, 50 * nm, 1.75, 30 * nm), Row(250 * nm, 60 * nm, 1.3, 70 * nm)], 1.55
    )
    wavelength = np.array([350, 500]) * nm
    for polarisation in ("s", "p"):
        a, b = (diffract(each, wavelength, 0.5, polarisation) for each in (one, shifted))
        np.testing.assert_allclose(a.reflectance, b.reflectance, rtol=1e-9, atol=1e-14)


def test_grazing_orders_are_finite_and_continuous():
    # at 500 nm the first orders graze in air; across it powers move by the root of the detuning
    lattice = CylinderGratings(500 * nm, 300 * nm, [Row(150 * nm, 100 * nm, 1.8)], 1.0)
    found = reflectance_spectrum(lattice, np.array([1 - 1e-8, 1.0, 1 + 1e-8]) * 500 * nm, 0.0, "s")
    assert np.ptp(found.reflectance) < 1e-2
    np.testing.assert_allclose(found.reflectance + found.transmittance, 1, rtol=1e-6)


def test_unpolarised_is_the_mean():
    lattice, wavelength = feather(160, 170, 100, 110, 33, 2), np.array([450, 500]) * nm
    for method in ("rods", "multilayer"):
        e, h, both = (
            reflectance_spectrum(lattice, wavelength, 0.2, polarisation, method)
            for polarisation in ("s", "p", "unpolarised")
        )
        np.testing.assert_allclose(both.reflectance, (e.reflectance + h.reflectance) / 2)
        np.testing.assert_allclose(both.transmittance, (e.transmittance + h.transmittance) / 2)


def test_indices_may_depend_on_wavelength():
    wavelength = 480 * nm
    fixed = feather(160, 170, 100, 110, 0, 2, melanin(wavelength), keratin(wavelength))
    assert reflectance_spectrum(feather(160, 170, 100, 110, 0, 2), wavelength) == reflectance_spectrum(
        fixed, wavelength
    )
    named = feather(160, 170, 100, 110, 0, 2, MELANIN.index, KERATIN.index)
    found = reflectance_spectrum(named, np.array([wavelength])).reflectance
    np.testing.assert_allclose(found, reflectance_spectrum(fixed, wavelength).reflectance, rtol=BALANCE)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"pitch": 0.0}, "Lattice: expected positive lengths in metres, got pitch 0.0"),
        (
            {"rows": [Row(80 * nm, 120 * nm, 1.5)]},
            r"Row: expected a radius up to half the pitch, got 1\.2\d*e-07 m",
        ),
        (
            {"rows": [Row(20 * nm, 50 * nm, 1.5)]},
            "Row: expected cylinders inside the slab, got one at depth 2e-08",
        ),
        ({"rows": [ROW, ROW]}, "Lattice: expected rows at different depths, got two at the same"),
    ],
)
def test_lattice_rejects(change, message):
    with pytest.raises(ValueError, match=message):
        CylinderGratings(**{"pitch": 200 * nm, "thickness": 400 * nm, "rows": [ROW], "host": 1.5, **change})


def test_spectrum_rejects():
    lattice = CylinderGratings(200 * nm, 160 * nm, [ROW], 1.5)
    with pytest.raises(ValueError, match="Method: expected 'rods' or 'multilayer', got 'rays'"):
        reflectance_spectrum(lattice, 500 * nm, method="rays")
    with pytest.raises(ValueError, match="Polarisation: expected 's' or 'p', got 'TE'"):
        reflectance_spectrum(lattice, 500 * nm, polarisation="TE")
    with pytest.raises(ValueError, match=r"Wavelength: expected positive lengths in metres, got 0\.0"):
        reflectance_spectrum(lattice, 0.0)
    with pytest.raises(ValueError, match="Host: expected a positive real refractive index"):
        reflectance_spectrum(CylinderGratings(200 * nm, 160 * nm, [ROW], 1.5 + 0.1j), 500 * nm)
    metal = CylinderGratings(200 * nm, 160 * nm, [Row(80 * nm, 50 * nm, CONDUCTOR)], 1.5)
    with pytest.raises(ValueError, match="Method 'multilayer': expected finite refractive indices"):
        reflectance_spectrum(metal, 500 * nm, method="multilayer")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"wavelength": np.inf}, "Wavelength: expected positive lengths in metres, got inf"),
        ({"wavelength": []}, r"Wavelength: expected at least one, got shape \(0,\)"),
        ({"angle": np.nan}, "Angle of incidence: expected finite angles in radians, got nan"),
        ({"orders": -1}, "Orders: expected a whole number of at least 0, got -1"),
        ({"harmonics": 2.5}, "Harmonics: expected a whole number of at least 0, got 2.5"),
    ],
)
def test_diffract_refuses(options, message):
    lattice = CylinderGratings(1e-6, 3e-6, [Row(1e-6, 2e-7, 1.5)], 1.0)
    with pytest.raises(ValueError, match=message):
        diffract(lattice, **{"wavelength": 5e-7, **options})


def test_rows_need_an_index():
    with pytest.raises(ValueError, match="Index: expected a refractive index n"):
        diffract(CylinderGratings(1e-6, 3e-6, [Row(1e-6, 2e-7, None)], 1.0), 5e-7)
    with pytest.raises(ValueError, match="Lattice: expected positive lengths in metres, got pitch inf"):
        CylinderGratings(np.inf, 3e-6, [], 1.0)


def test_counts_may_be_of_any_type_of_integer():
    lattice = CylinderGratings(1e-6, 3e-6, [Row(1e-6, 2e-7, 1.5)], 1.0)
    plain = diffract(lattice, 5e-7, orders=9, harmonics=0)
    other = diffract(lattice, 5e-7, orders=np.uint64(9), harmonics=np.int8(0))
    assert np.array_equal(other.transmitted, plain.transmitted)
