import math

import numpy as np
import pytest

from fringetrace import nm
from fringetrace.rigorous.effective_medium import effective_index, stack_powers

PRINTED = 6e-10


@pytest.mark.parametrize(
    ("wavelength", "normal", "s", "p"),
    [(450, 0.034445990, 0.188938334, 0.010883952), (600, 0.058295763, 0.033697372, 0.001644528)],
)
def test_soap_film(wavelength, normal, s, p):
    def reflectance(angle, polarisation):
        return stack_powers([300 * nm], [1.33], 1.0, 1.0, wavelength * nm, angle, polarisation).reflectance

    assert reflectance(0.0, "s") == pytest.approx(normal, abs=PRINTED)
    assert reflectance(math.pi / 4, "s") == pytest.approx(s, abs=PRINTED)
    assert reflectance(math.pi / 4, "p") == pytest.approx(p, abs=PRINTED)


def test_stacks_agree_with_tmm():
    tmm = pytest.importorskip("tmm")
    index, thickness = [1.56, 2.0 + 0.1j, 1.3], [65, 140, 90]
    for polarisation in ("s", "p"):
        found = stack_powers(thickness, index, 1.0, 1.5, 500.0, 0.6, polarisation)
        expected = tmm.coh_tmm(polarisation, [1.0, *index, 1.5], [math.inf, *thickness, math.inf], 0.6, 500.0)
        assert found.reflectance == pytest.approx(expected["R"], rel=1e-12)
        assert found.transmittance == pytest.approx(expected["T"], rel=1e-12)


def test_clear_stacks_keep_power():
    wavelength = np.linspace(400, 700, 7)
    index = np.stack([1.56 + 0 * wavelength, 1.0 + 10 / wavelength], -1)
    found = stack_powers([65, 140], index, np.ones(7), 1.5 * np.ones(7), wavelength, 0.3, "p")
    np.testing.assert_allclose(found.reflectance + found.transmittance, 1, rtol=1e-12)


def test_thick_metal_is_opaque():
    """A millimetre of silver: exp(-1e5) of the light would overflow as a cosine."""
    found = stack_powers([1.0, 1e-3], [1.5, 0.05 + 3.9j], 1.0, 1.5, 500 * nm, 0.3, "s")
    assert 0.9 < found.reflectance < 1.0
    assert found.transmittance == 0.0


def test_effective_index_lies_between_the_wiener_bounds():
    fraction, index = np.array([0.4, 0.6]), np.array([1.75 + 0j, 1.55])
    e, h = (effective_index(fraction, index, p).real for p in ("s", "p"))
    assert (fraction @ index.real**-2) ** -0.5 < h < fraction @ index.real < e < 1.75
    np.testing.assert_allclose(effective_index(fraction, np.array([1.3 + 0.1j] * 2), "s"), 1.3 + 0.1j)


def test_polarisation_is_checked():
    with pytest.raises(ValueError, match="Polarisation: expected 's' or 'p', got 'TE'"):
        effective_index(np.ones(1), np.ones(1, complex), "TE")
    with pytest.raises(ValueError, match="Polarisation: expected 's' or 'p', got 'TE'"):
        stack_powers([1.0], [1.5], 1.0, 1.0, 1.0, 0.0, "TE")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"index": [math.nan]}, "Layers: expected a refractive index n"),
        ({"index": [None]}, "Layers: expected a refractive index n"),
        ({"front": 0.0}, "Front: expected a refractive index n"),
        ({"back": math.nan}, "Back: expected a refractive index n"),
        ({"wavelength": 0.0}, "Wavelength: expected positive lengths in metres, got 0"),
        ({"wavelength": [5e-7, math.inf]}, "Wavelength: expected positive lengths in metres, got inf"),
        ({"angle": math.nan}, "Angle of incidence: expected finite angles in radians, got nan"),
        ({"thickness": [-1.0]}, "Layers: expected thicknesses of 0 or more metres"),
        ({"thickness": [1.0, 1.0]}, "Layers: expected thicknesses of 0 or more metres"),
    ],
)
def test_stack_refuses(change, message):
    light = {"thickness": [1e-7], "index": [1.5], "front": 1.0, "back": 1.5, "wavelength": 5e-7, "angle": 0.1}
    with pytest.raises(ValueError, match=message):
        stack_powers(**{**light, **change}, polarisation="s")


def test_no_layers_are_a_bare_face():
    bare, one = (stack_powers([0.0] * n, [1.3] * n, 1.0, 1.5, 5e-7, [0.1, 0.2], "p") for n in (0, 1))
    np.testing.assert_allclose(bare, one, rtol=1e-14)


def test_effective_index_refuses_none():
    with pytest.raises(ValueError, match="Layers: expected a refractive index n"):
        effective_index([0.5, 0.5], [1.0, math.nan], "s")
