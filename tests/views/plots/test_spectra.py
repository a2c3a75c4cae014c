"""Curves: spectra over their colours with measured ones laid over, run time against error."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from fringetrace import nm, views
from fringetrace.core import tables
from fringetrace.views.plots import spectra

W = np.linspace(400, 700, 7) * nm
MEASURED = tables.labelled(
    [np.full(3, 0.5), np.full(3, 0.25)],
    {"sample": (["blue", "green"], ""), "wavelength": (np.array([450, 500, 550]) * nm, "m")},
    name="reflectance", unit="1",
)  # fmt: skip
WORK = {
    "rays": np.array([[10.0, 100.0], [0.1, 0.5], [1e-2, 1e-3]]),
    "waves": np.array([[4.0], [0.2], [1e-6]]),
}


def brdf(count=2, unit="1/sr"):
    axes = {"theta_o": (np.radians(np.arange(count) * 10.0 - 10.0), "rad"), "wavelength": (W, "m")}
    values = np.arange(count * len(W)).reshape(count, -1) / 10.0
    return tables.labelled(values, axes, name="brdf", unit=unit)


def axes():
    return Figure().add_subplot()


def colours(ax):
    """The strip's colours."""
    (strip,) = ax.child_axes
    return np.asarray(strip.collections[0].get_array()).reshape(-1, 3)


def test_spectra_are_curves_over_their_colours():
    ax, table = axes(), brdf()
    assert views.spectra(table, ax, title="here") is ax
    assert [line.get_label() for line in ax.lines] == [r"$\theta_o$ = −10°", r"$\theta_o$ = 0°"]
    for line, values in zip(ax.lines, table.values, strict=True):
        np.testing.assert_allclose(line.get_xdata(), [400, 450, 500, 550, 600, 650, 700])
        np.testing.assert_array_equal(line.get_ydata(), values)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("wavelength / nm", "BRDF / sr⁻¹")
    assert ax.get_xlim() == pytest.approx((400, 700))
    assert ax.get_title() == "here"
    strip, at = colours(ax), np.linspace(400, 700, 401)[:-1]
    assert [strip[np.searchsorted(at, seen)].argmax() for seen in (450, 530, 620)] == [2, 1, 0]
    # the strip is below 0, where no curve is
    assert ax.transData.inverted().transform(ax.transAxes.transform((0, 0.05)))[1] < 0.0


def test_measured_reflectances_lie_over_a_reflectance_as_they_are():
    ax = views.spectra(brdf(1, "1").isel(theta_o=0), measured=MEASURED)
    assert ax.get_ylabel() == "brdf"
    model, *over = ax.lines
    assert model.get_label() == "model"
    assert [line.get_label() for line in over] == ["blue", "green"]
    assert [line.get_linestyle() for line in over] == ["--", ":"]
    assert {line.get_color() for line in over} == {"black"}
    np.testing.assert_allclose(over[0].get_data(), [[450, 500, 550], [0.5, 0.5, 0.5]])
    assert ax.get_xlim() == pytest.approx((400, 700))


@pytest.mark.parametrize("unit", ["1/sr", "sr-1"])
def test_over_a_brdf_white_is_lambertian(unit):
    ax = views.spectra(brdf(1, unit), measured=MEASURED)
    assert ax.get_ylabel() == "BRDF / sr⁻¹"
    assert ax.lines[1].get_label() == "blue / π"
    np.testing.assert_allclose(ax.lines[1].get_ydata(), 0.5 / np.pi)


def test_curves_are_told_apart_by_any_eye():
    """Okabe and Ito's colours, at most seven."""
    ax = views.spectra(brdf(7))
    styles = {(line.get_color(), line.get_linestyle()) for line in ax.lines}
    assert len(styles) == 7
    assert {colour for colour, _ in styles} == {colour for colour, _, _ in spectra.STYLES}
    with pytest.raises(ValueError, match="spectra: expected at most 7 curves, got 8; choose some"):
        views.spectra(brdf(8))


def test_a_single_wavelength_is_no_spectrum():
    with pytest.raises(ValueError, match="spectra: expected a table over at least 2 wavelengths, got fewer"):
        views.spectra(brdf().isel(wavelength=[0]))


def test_black_light_has_a_black_strip():
    table = tables.labelled([1.0, 1.0], {"wavelength": (np.array([100, 200]) * nm, "m")}, name="r", unit="1")
    assert (colours(views.spectra(table)) == 0.0).all()


@pytest.mark.parametrize(("against", "row"), [("seconds", 1), ("rays", 0)])
def test_run_time_against_error(against, row):
    ax = axes()
    assert views.work_precision(WORK, ax, against=against, title="Sphere") is ax
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert (ax.get_xlabel(), ax.get_ylabel()) == (against, "phase error / waves")
    for line, (name, curve) in zip(ax.lines, WORK.items(), strict=True):
        np.testing.assert_array_equal(line.get_data(), curve[[row, 2]])
        assert line.get_label() == name
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["rays", "waves"]
    assert ax.get_title() == "Sphere"


def test_colours_keep_to_their_names():
    (alone,) = views.work_precision({"waves": WORK["waves"]}, order=list(WORK), legend=False).lines
    assert alone.get_color() == views.work_precision(WORK).lines[1].get_color()
    assert alone.axes.get_legend() is None


def test_work_that_cannot_be_drawn():
    with pytest.raises(ValueError, match="work_precision: expected at least one curve, got none"):
        views.work_precision({})
    with pytest.raises(ValueError, match="against: expected seconds or rays, got 'hours'"):
        views.work_precision(WORK, against="hours")


def test_cells_reach_halfway_to_their_neighbours():
    assert spectra.cell_edges([0.0, 1.0, 3.0], 3, "x").tolist() == [-0.5, 0.5, 2.0, 4.0]
    for places in ([1.0], [1.0, 1.0], [2.0, 1.0]):
        with pytest.raises(ValueError, match=r"x: expected \d increasing numbers \(at least 2\)"):
            spectra.cell_edges(places, len(places), "x")
