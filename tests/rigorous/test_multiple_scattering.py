import numpy as np
import pytest

from fringetrace.rigorous import multiple_scattering
from fringetrace.rigorous.cylinders import Cylinders, scatter
from fringetrace.rigorous.cylindrical_waves import CONDUCTOR

RESIDUAL = 1e-10  # iteration ends at 1e-12 of the right side; the matrix may stretch that


@pytest.mark.parametrize("index", [1.3 + 0.05j, CONDUCTOR])
@pytest.mark.parametrize("shift", [0.0, 0.5])
def test_iteration_on_a_grid_is_elimination(monkeypatch, index, shift):
    centres = [(i + shift * (j % 2), 0.9 * j) for i in range(6) for j in range(3)]
    rods = Cylinders(centres, 0.3, index)
    eliminated = scatter(rods, 1.0, [0.3, 1.0], "p", orders=6).exciting
    monkeypatch.setattr(multiple_scattering, "_DENSE", 1)
    monkeypatch.setattr(multiple_scattering, "_LARGEST", 1)  # no way back
    iterated = scatter(rods, 1.0, [0.3, 1.0], "p", orders=6).exciting
    assert abs(iterated - eliminated).max() < RESIDUAL * abs(eliminated).max()


def test_no_grid_is_seen_in_disorder(monkeypatch):
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.arange(6.0), np.arange(4.0))
    centres = np.stack([x.ravel(), y.ravel()], 1) + rng.uniform(-0.1, 0.1, (24, 2))
    monkeypatch.setattr(multiple_scattering, "_LARGEST", 100)
    with pytest.raises(ValueError, match=r"at most 100 unknowns off a grid, got \d+ \(24 cylinders of"):
        scatter(Cylinders(centres, 0.3, 1.5), 0.2)
