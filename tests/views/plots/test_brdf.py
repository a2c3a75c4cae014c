"""BRDFs: what is drawn where, at which wavelength, with which colours and units."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from fringetrace import nm, views
from fringetrace.core import tables

AXES = ("theta_i", "phi_i", "theta_o", "phi_o", "wavelength")
W = np.array([400, 500, 600]) * nm


def brdf(theta_i, theta_o, phi_o=(0.0,), wavelengths=W, **lengths):
    """A table whose values are all different."""
    axes = {
        **{name: (values, "m") for name, values in lengths.items()}, "theta_i": (np.radians(theta_i), "rad"),
        "phi_i": ([0.0], "rad"), "theta_o": (np.radians(theta_o), "rad"),
        "phi_o": (np.radians(phi_o), "rad"), "wavelength": (wavelengths, "m"),
    }  # fmt: skip
    shape = [len(values) for values, _ in axes.values()]
    values = np.arange(float(np.prod(shape))).reshape(shape)
    return tables.labelled(values, axes, name="brdf", unit="sr-1")


PLANE = brdf([-20, 0, 20], [-30, -10, 10, 30])
DOME = brdf([-40], [22.5, 67.5], [45, 135, 225, 315])


def polar():
    return Figure().add_subplot(projection="polar")


def bar(ax):
    """Label of the colour bar beside."""
    return ax.child_axes[0].get_ylabel()


def test_a_heat_map_has_the_light_upwards_and_the_eye_to_the_right():
    ax = Figure().add_subplot()
    assert views.brdf(PLANE, ax, wavelength=490 * nm, title="Lattice") is ax
    (drawn,) = ax.collections
    np.testing.assert_array_equal(drawn.get_array(), PLANE[:, 0, :, 0, 1])
    corners = drawn.get_coordinates()
    np.testing.assert_allclose(corners[0, 0], [-40, -30])
    np.testing.assert_allclose(corners[-1, -1], [40, 30])
    assert (ax.get_xlabel(), ax.get_ylabel()) == (
        r"$\theta_o$ (to the eye) / °", r"$\theta_i$ (to the light) / °"
    )  # fmt: skip
    assert ax.get_title() == "Lattice, λ = 500 nm"
    assert bar(ax) == "BRDF / sr⁻¹"
    assert (drawn.get_cmap().name, drawn.get_clim()[0]) == ("viridis", 0.0)


def test_one_wavelength_needs_no_choice():
    assert views.brdf(PLANE.isel(wavelength=[2])).get_title() == "λ = 600 nm"
    assert views.brdf(PLANE.isel(wavelength=2, drop=True), title="all").get_title() == "all"


def test_lobes_stand_on_the_plane_with_the_light_on_the_rim():
    ax = polar()
    assert views.polar(PLANE, ax, wavelength=400 * nm) is ax
    lines, dots = ax.lines[:3], ax.lines[3:]
    for line, values in zip(lines, PLANE[:, 0, :, 0, 0], strict=True):
        np.testing.assert_allclose(line.get_data(), [np.radians([-30, -10, 10, 30]), values])
    top = ax.get_ylim()[1]
    for dot, start, line in zip(dots, (-20, 0, 20), lines, strict=True):
        np.testing.assert_allclose(np.ravel(dot.get_data()), [np.radians(start), top])
        assert dot.get_color() == line.get_color()
    legend = ax.get_legend()
    assert legend.get_title().get_text() == "BRDF / sr⁻¹, light from"
    assert [text.get_text() for text in legend.get_texts()] == [rf"$\theta_i$ = {a}°" for a in ("−20", 0, 20)]
    # the normal up, +x to the right
    up, right = ax.transData.transform([[0.0, top], [np.pi / 2, top]])
    foot = ax.transData.transform([0.0, 0.0])
    assert up[1] > foot[1]
    assert up[0] == pytest.approx(foot[0])
    assert right[0] > foot[0]
    assert ax.get_title() == "λ = 400 nm"
    assert views.polar(PLANE.isel(theta_i=1), wavelength=400 * nm).lines[0].get_label() == r"$\theta_i$ = 0°"


def test_a_hemisphere_is_a_map_seen_from_above():
    ax = views.polar(DOME, wavelength=600 * nm, title="Dome")
    (drawn,) = ax.collections
    np.testing.assert_array_equal(drawn.get_array(), DOME[0, 0, :, :, 2])
    corners = drawn.get_coordinates()
    np.testing.assert_allclose(corners[0, 0], [0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(corners[-1, -1], [2 * np.pi, 90.0])
    assert ax.get_ylim() == (0.0, 90.0)
    # light from -40 degrees comes from the other side
    np.testing.assert_allclose(np.ravel(ax.lines[0].get_data()), [np.pi, 40.0])
    assert bar(ax) == "BRDF / sr⁻¹"
    assert drawn.get_cmap().name == "viridis"


def test_a_spectrogram_is_the_table_from_one_direction():
    ax = Figure().add_subplot()
    assert views.spectrogram(PLANE.isel(theta_i=2), ax, title="20°", top=7.0) is ax
    (drawn,) = ax.collections
    np.testing.assert_array_equal(drawn.get_array(), PLANE[2, 0, :, 0])
    assert drawn.get_clim() == (0.0, 7.0)
    assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_title()) == ("wavelength / nm", "observed at / °", "20°")
    corners = drawn.get_coordinates()
    np.testing.assert_allclose([corners[0, 0], corners[-1, -1]], [[350, -40], [650, 40]])
    assert views.spectrogram(0.0 * PLANE.isel(theta_i=0)).collections[0].get_clim() == (0.0, 1.0)


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda: views.brdf(PLANE), "wavelength: expected one from 400 to 600 nm, got None"),
        (lambda: views.brdf(PLANE, wavelength=300 * nm), "expected one from 400 to 600 nm, got 300 nm"),
        (lambda: views.brdf(DOME, wavelength=W[0]), r"expected one phi_o, got 4; choose, .*isel\(phi_o=0\)"),
        (lambda: views.brdf(PLANE.isel(theta_i=0), wavelength=W[0]), "table: expected axes theta_i, theta_o"),
        (lambda: views.brdf(PLANE.isel(theta_i=[0]), wavelength=W[0]), "theta_i: expected 1 increasing"),
        (lambda: views.spectrogram(PLANE), "table: expected one theta_i, got 3"),
        (lambda: views.polar(PLANE, Figure().add_subplot(), wavelength=W[0]), "expected polar ones"),
        (lambda: views.polar(brdf([0], [-9, 9], [0, 90]), wavelength=W[0]), "from 0 up beside several phi_o"),
        (lambda: views.polar(brdf(range(8), [0, 1]), wavelength=W[0]), "polar: expected at most 7 curves"),
    ],
)  # fmt: skip
def test_what_cannot_be_drawn_says_what_to_choose(draw, message):
    with pytest.raises(ValueError, match=message):
        draw()


def titles(figure):
    return [ax.get_title() for ax in figure.axes if ax.get_title()]


def test_an_overview_has_a_panel_for_each_incidence_and_parameter():
    table = brdf([-20, 0, 20], [-30, 0, 30], pitch=[200 * nm, 300 * nm])
    figure = views.overview(table)
    assert titles(figure)[::5] == [r"pitch 200 nm, $\theta_i$ = −20°", r"pitch 300 nm, $\theta_i$ = 20°"]
    panels = [ax for ax in figure.axes if ax.get_title()]
    np.testing.assert_array_equal(panels[4].collections[0].get_array(), table[1, 1, 0, :, 0])
    assert len({panel.collections[0].get_clim() for panel in panels}) == 1
    # numbers below every column
    assert [bool(ax.xaxis.get_tick_params()["labelbottom"]) for ax in panels] == [False] * 2 + [True] * 4
    assert titles(views.overview(0.0 * table)) == titles(figure)


def test_spectra_towards_the_mirror_with_measured_ones_over():
    sample = tables.labelled(
        [[0.3, 0.3]], {"sample": (["a"], ""), "wavelength": (W[:2], "m")}, name="r", unit="1"
    )
    table = brdf([-20, 0, 20], [-30, -21, 2, 19, 30])
    table[0] += 100.0
    figure = views.mirror_spectra(table, sample)
    assert titles(figure) == [
        rf"$\theta_i$ = {start}°, $\theta_o$ = {end}°" for start, end in (("−20", 19), (0, 2), (20, "−21"))
    ]
    panels = [ax for ax in figure.axes if ax.get_title()]
    for ax, row, ring in zip(panels, table, (3, 2, 1), strict=True):
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), row[0, ring, 0])
        np.testing.assert_allclose(ax.lines[1].get_ydata(), 0.3 / np.pi)
        # the highest may be in any panel
        assert ax.get_ylim()[1] > max(line.get_ydata().max() for other in panels for line in other.lines)
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["model", "a / π"]
    assert (figure.get_supxlabel(), figure.get_supylabel()) == ("wavelength / nm", "BRDF / sr⁻¹")
    assert not views.mirror_spectra(table).legends
    # in the hemisphere the mirror of -40 degrees is at 40, towards +x
    assert titles(views.mirror_spectra(brdf([-40], [20, 45], [0, 180]))) == [
        r"$\theta_i$ = −40°, $\theta_o$ = 45°"
    ]
