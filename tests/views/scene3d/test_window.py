"""The window: sliders, keys and clicks re-phase what is drawn, and nothing is traced."""

import numpy as np
import pytest

from fringetrace import instruments, mm, nm, views
from fringetrace.geometry.shapes import plate
from fringetrace.views.scene3d import viewer, vtk, window


@pytest.fixture(scope="module")
def opened():
    missing = views.opengl()
    if missing:
        pytest.skip(missing)
    bench = instruments.michelson(
        plate(8 * mm, 8 * mm), aperture=6 * mm, pixels=(6, 8), reference_tilt=(200e-6, 0.0)
    )
    view = viewer._interactive(bench, None, {"wavelength": 633 * nm, "colour": "phase"})
    return window.furnish(view, vtk.empty((800, 600)))


@pytest.mark.slow
def test_sliders_change_what_is_drawn(opened):
    legs, strands = opened.rays.n_lines, opened.view.strands
    before = opened.rays["value"].copy()
    opened.step(90.0)
    turned = np.mod(opened.rays["value"] - before, 1.0)
    assert set(np.round(turned, 9)) == {0.0, 0.25}
    np.testing.assert_array_equal(opened.pixels["image"], opened.view.frames[3].ravel())
    opened.wavelength(1e9 * strands.wavelengths[4] + 1.0)
    assert opened.view.wavelength == 4
    opened.upto(1.0)
    assert opened.rays.n_lines == legs // 2
    opened.explode(1.0)
    opened.pick(7)
    assert "picked" in opened.plotter.actors
    assert "path" in opened.plotter.actors
    opened.next_colour()
    assert opened.view.colour == "fate"
    opened.toggle_plane()
    opened.toggle_plane()
    assert not opened.planes


class Picker:
    def __init__(self, cell):
        self.cell = cell

    def GetDataSet(self):
        return None if self.cell is None else self

    def GetCellId(self):
        return self.cell


@pytest.mark.slow
def test_a_click_reads_a_ray_and_beside_it_none(opened):
    opened.picked = -1
    opened.clicked(Picker(None))
    opened.clicked(Picker(10**6))
    assert opened.picked == -1
    opened.clicked(Picker(5))
    assert opened.picked == opened.rays.cell_data["strand"][5]
