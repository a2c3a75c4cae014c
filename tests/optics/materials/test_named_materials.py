"""Materials by name, each beside published values."""

import pickle

import numpy as np
import pytest

from fringetrace import nm
from fringetrace.optics import materials as m

# Lines of helium (d), hydrogen (F, C) and sodium (D).
D, F, C, SODIUM = 587.5618 * nm, 486.1327 * nm, 656.2725 * nm, 589.3 * nm

PUBLISHED = [  # index, its last printed digit
    (m.VACUUM, D, 1.0, 1e-15),
    (m.AIR, SODIUM, 1.0002772, 1e-7),  # Ciddor: standard air, (n - 1) 1e8 = 27717
    (m.WATER, SODIUM, 1.33336, 2e-5),  # IAPWS: 1.33336 at 20 C
    (m.BK7, D, 1.51680, 1e-5), (m.BK7, F, 1.52238, 1e-5), (m.BK7, C, 1.51432, 1e-5),  # SCHOTT's data sheet
    (m.SF11, D, 1.78472, 1e-5), (m.SF11, F, 1.80651, 1e-5), (m.SF11, C, 1.77596, 1e-5),  # the same
    (m.FUSED_SILICA, D, 1.458464, 1e-6), (m.FUSED_SILICA, F, 1.463126, 1e-6),  # Malitson's table
    (m.FUSED_SILICA, C, 1.456367, 1e-6),
    (m.CALCITE_O, SODIUM, 1.6584, 1e-4), (m.CALCITE_E, SODIUM, 1.4864, 3e-4),  # handbooks
    (m.QUARTZ_O, SODIUM, 1.54424, 5e-5), (m.QUARTZ_E, SODIUM, 1.55335, 5e-5),
    (m.GOLD, 633 * nm, 0.18344 + 3.43324j, 1e-5),  # between two of Johnson and Christy's
    (m.SILVER, 548.6 * nm, 0.06 + 3.586j, 1e-12), (m.ALUMINIUM, 563.57 * nm, 1.0728 + 6.7839j, 1e-12),
    (m.CHITIN, 400 * nm, 1.572, 1e-3), (m.CHITIN, 500 * nm, 1.552, 1e-3), (m.CHITIN, 600 * nm, 1.541, 1e-3),
    (m.KERATIN, 400 * nm, 1.569, 1e-3), (m.KERATIN, 500 * nm, 1.556, 1e-3),
    (m.KERATIN, 600 * nm, 1.548, 1e-3),
]  # fmt: skip

TISSUE = [  # nm, chitin, keratin, melanin
    (400, 1.572000, 1.568812, 1.796125 + 0.127288j),
    (450, 1.560457, 1.561086, 1.765037 + 0.105770j),
    (500, 1.552200, 1.555560, 1.742800 + 0.087890j),
    (550, 1.546091, 1.551471, 1.726347 + 0.073032j),
    (600, 1.541444, 1.548361, 1.713833 + 0.060686j),
    (700, 1.534959, 1.544020, 1.696367 + 0.041902j),
]


@pytest.mark.parametrize(("material", "wavelength", "index", "digit"), PUBLISHED)
def test_published_values(material, wavelength, index, digit):
    assert material.index(wavelength) == pytest.approx(index, abs=digit)


@pytest.mark.parametrize(("wavelength", "chitin", "keratin", "melanin"), TISSUE)
def test_tissue(wavelength, chitin, keratin, melanin):
    for material, printed in ((m.CHITIN, chitin), (m.KERATIN, keratin), (m.MELANIN, melanin)):
        got = material.index(wavelength * nm)
        assert got.real == pytest.approx(complex(printed).real, abs=0.51e-6)
        assert got.imag == pytest.approx(complex(printed).imag, abs=0.51e-6)


@pytest.mark.parametrize("material", m.NAMED, ids=lambda material: material.name)
def test_named_materials(material):
    assert m.named(material.name.upper().replace(" ", "-")) is material
    assert pickle.loads(pickle.dumps(material)) == material
    assert hash(material) == hash(pickle.loads(pickle.dumps(material)))
    assert material.dispersive == (material is not m.VACUUM)
    assert (material.source != "") == material.dispersive
    if material.range is not None:
        low, high = material.range
        ends = material.index(np.array([low, high]))
        assert np.isfinite(ends).all()
        for outside in (low * (1 - 1e-9), high * (1 + 1e-9)):
            message = rf"{material.name}: expected .* nm to .* nm, got .* nm \(not extrapolated\)"
            with pytest.raises(ValueError, match=message):
                material.index(outside)


def test_what_stands_for_a_material():
    assert m.as_material(m.BK7) is m.BK7
    assert m.as_material("N-BK7") is m.BK7
    assert m.as_material("aluminum") is m.ALUMINIUM
    assert m.as_material(np.float64(1.5)) == m.constant(1.5)
    assert m.as_material(1.5 + 0.1j).index(D) == 1.5 + 0.1j
    assert m.as_material(1.5 + 0.1j).name == "n=1.5+0.1i"


@pytest.mark.parametrize("value", [None, True, [1.5], b"BK7"])
def test_what_does_not(value):
    with pytest.raises(TypeError, match=r"lens: expected a Material, an index n \+ i kappa or a name, got"):
        m.as_material(value, "lens")


def test_the_nearest_name():
    with pytest.raises(ValueError, match=r"expected one of vacuum, air, .* got 'BK8'; did you mean 'BK7'"):
        m.named("BK8")
    with pytest.raises(ValueError, match="got 'silvre'; did you mean 'silver'"):
        m.as_material("silvre")
