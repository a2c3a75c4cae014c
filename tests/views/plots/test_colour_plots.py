"""Pictures of colour: what is drawn where, and in which colour."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from fringetrace import nm
from fringetrace.core import tables
from fringetrace.scattering import colour
from fringetrace.views.plots import colour_plots

W = colour.resolving_wavelengths()
WHITE = colour.white()


def axes():
    return Figure().add_subplot()


def test_swatches_show_their_colours_and_names():
    ax = axes()
    assert colour_plots.swatches([WHITE, 0 * WHITE], ["snow", "coal"], ax) is ax
    assert np.asarray(ax.images[0].get_array())[0] == pytest.approx(
        np.array([[1, 1, 1], [0, 0, 0]]), abs=1e-3
    )
    assert [text.get_text() for text in ax.get_xticklabels()] == ["snow", "coal"]
    with pytest.raises(ValueError, match="labels: expected 2, one a colour, got 1"):
        colour_plots.swatches([WHITE, WHITE], ["snow"])
    with pytest.raises(ValueError, match=r"colours: expected X, Y, Z of shape \(n, 3\), got \(3,\)"):
        colour_plots.swatches(WHITE, ["snow"])


def test_a_strip_has_its_colours_at_their_places():
    ax = colour_plots.strip([WHITE, 0 * WHITE, WHITE], [0.0, 1.0, 3.0], label="thickness / nm")
    (mesh,) = ax.collections
    assert np.asarray(mesh.get_coordinates()[0, :, 0]) == pytest.approx([-0.5, 0.5, 2.0, 4.0])
    assert np.asarray(mesh.get_array()).reshape(-1, 3)[1] == pytest.approx(0.0)
    assert ax.get_xlabel() == "thickness / nm"
    with pytest.raises(ValueError, match="places: expected 2 increasing numbers"):
        colour_plots.strip([WHITE, WHITE], [1.0, 0.0])


def test_angles_go_up_with_the_light_and_right_with_the_eye():
    xyz = np.zeros((2, 3, 3))
    xyz[1, 0] = WHITE
    ax = colour_plots.angles(xyz, np.radians([0, 10]), np.radians([0, 20, 40]), axes())
    (mesh,) = ax.collections
    assert np.asarray(mesh.get_coordinates()[-1, -1]) == pytest.approx([50.0, 15.0])
    assert np.asarray(mesh.get_array()).reshape(2, 3, 3)[1, 0] == pytest.approx(1.0, abs=1e-3)
    with pytest.raises(ValueError, match="theta_o: expected 3 increasing"):
        colour_plots.angles(xyz, [0, 1], [0, 1])


def test_a_mirrored_sphere_has_the_colour_of_each_angle():
    theta = np.radians([0.0, 90.0])
    picture = colour_plots.mirrored([0 * WHITE, WHITE], theta, pixels=101)
    assert picture[50, 50] == pytest.approx(0.0, abs=1e-12)
    assert picture[50, 75] == pytest.approx(WHITE * np.arcsin(50 / 101) / (np.pi / 2))
    assert np.isnan(picture[0, 0]).all()
    ax = colour_plots.draw_sphere(picture, title="ball")
    shown = np.asarray(ax.images[0].get_array())
    assert shown[0, 0] == pytest.approx(colour_plots.BEHIND)
    assert shown[50, 75] == pytest.approx(colour.srgb(picture[50, 75]))
    assert ax.images[0].origin == "lower"


def test_spectra_with_measured_ones_laid_over():
    sample = tables.labelled(
        [np.full(3, 0.3)],
        {"sample": (["feather"], ""), "wavelength": (np.array([400, 500, 600]) * nm, "m")},
        name="reflectance", unit="1",
    )  # fmt: skip
    ax = colour_plots.coloured_spectra(
        [np.full(95, 0.5), np.full(95, 0.2)], W, labels=["a", "b"], measured=sample
    )
    assert [line.get_label() for line in ax.lines] == ["a", "b", "feather"]
    assert ax.lines[2].get_xdata() == pytest.approx([400, 500, 600])
    (rainbow,) = ax.child_axes
    colours = np.asarray(rainbow.collections[0].get_array()).reshape(-1, 3)
    at = np.linspace(360, 830, 401)[:-1]
    assert colours[np.searchsorted(at, 620)].argmax() == 0
    assert colours[np.searchsorted(at, 530)].argmax() == 1
    assert colours[np.searchsorted(at, 450)].argmax() == 2
    with pytest.raises(ValueError, match="expected as many values as the 95 wavelengths"):
        colour_plots.coloured_spectra(np.ones(3), W)
