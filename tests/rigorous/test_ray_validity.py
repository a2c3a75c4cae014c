import math

import numpy as np
import pytest

from fringetrace import nm, um
from fringetrace.rigorous import validity
from fringetrace.rigorous.cylindrical_waves import CONDUCTOR


def test_a_melanin_rod_is_no_case_for_rays():
    found = validity(65 * nm, 500 * nm, 1.7428 + 0.0879j, 1.55556)
    assert found.size_parameter == pytest.approx(2 * math.pi * 1.55556 * 65 / 500)
    assert found.phase == pytest.approx(2 * 2 * math.pi * (1.7428 - 1.55556) * 65 / 500)
    assert found.ray_error == 1.0
    assert str(found).startswith("size parameter 1.27, phase across 0.306 rad: no ray method is right here")
    assert "kinematic" in found.label


def test_laws():
    mirror = validity(10 * um, 500 * nm, CONDUCTOR)
    assert mirror.phase == math.inf
    assert mirror.ray_error == pytest.approx(2.4 / (2 * math.pi * 20))
    assert mirror.label == "rays hold to about 1.9 %"
    glass = validity(10 * um, 500 * nm, 1.5)
    assert glass.ray_error == pytest.approx(3 / math.sqrt(2 * math.pi * 20))
    assert glass.label == "rays are a rough model, about 27 % off"
    black = validity(10 * um, 500 * nm, lambda wavelength: 1.5 + 1j)
    assert black.ray_error == mirror.ray_error


def test_a_strong_small_rod_has_no_kinematic_model():
    assert "kinematic" not in validity(100 * nm, 500 * nm, 3.0).label


@pytest.mark.parametrize(("radius", "wavelength"), [(0.0, 1.0), (1.0, -1.0), (np.nan, 1.0)])
def test_validity_rejects(radius, wavelength):
    with pytest.raises(ValueError, match="Validity: expected positive lengths in metres, got radius"):
        validity(radius, wavelength, 1.5)
