"""Plots with real units: extents, scales, labels, and files that are whole or not there."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from fringetrace import mm, nm, um, views

IMAGE = np.arange(12.0).reshape(3, 4) / 11
MAPS = (views.interferogram, views.height, views.residual, views.phase)


def shown(ax):
    """The image of some axes and its colour bar."""
    return ax.images[0], ax.images[0].colorbar


@pytest.mark.parametrize("view", MAPS, ids=lambda view: view.__name__)
def test_every_view_has_units_a_scale_bar_and_a_colour_bar(view):
    ax = view(IMAGE, 0.5 * mm)
    image, bar = shown(ax)
    assert image.get_extent() == pytest.approx([-1.0, 1.0, -0.75, 0.75])
    assert image.origin == "lower"
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x / mm", "y / mm")
    assert " / " in bar.ax.get_ylabel()
    assert [artist.txt_label.get_text() for artist in ax.artists] == ["0.2 mm"]


@pytest.mark.parametrize("view", MAPS, ids=lambda view: view.__name__)
def test_every_view_draws_on_the_axes_it_is_given(view):
    ax = Figure().add_subplot()
    assert view(IMAGE, 2 * um, ax, title="here") is ax
    assert ax.get_title().startswith("here")
    assert ax.get_xlabel() == "x / µm"


@pytest.mark.parametrize("view", MAPS, ids=lambda view: view.__name__)
def test_views_leave_no_global_figures(view):
    from matplotlib import pyplot

    before = pyplot.get_fignums()
    view(IMAGE, 2 * um)
    assert pyplot.get_fignums() == before


@pytest.mark.parametrize(
    ("pitch", "label"), [(1 * mm, "0.5 mm"), (3 * mm, "2 mm"), (7 * um, "5 µm"), (40 * nm, "20 nm")]
)
def test_the_scale_bar_is_a_round_part_of_the_width(pitch, label):
    (bar,) = views.interferogram(IMAGE, pitch).artists
    assert bar.txt_label.get_text() == label


def test_the_grey_scale_starts_in_the_dark():
    image, _ = shown(views.interferogram(0.5 + IMAGE / 2, mm, wavelength=632.8 * nm, title="step"))
    assert image.get_clim() == (0.0, 1.0)
    assert image.axes.get_title() == "step, λ = 632.8 nm"
    assert views.interferogram(IMAGE, mm, wavelength=532 * nm).get_title() == "λ = 532 nm"


def test_heights_are_in_their_own_unit():
    image, bar = shown(views.height(IMAGE * 350 * nm, mm))
    assert bar.ax.get_ylabel() == "height / nm"
    np.testing.assert_allclose(image.get_array(), IMAGE * 350)


def test_what_is_unknown_is_masked():
    holed = IMAGE.copy()
    holed[1, 1] = np.nan
    for view in (views.height, views.residual, views.phase):
        assert shown(view(holed, mm))[0].get_array().mask.sum() == 1
        assert shown(view(np.full((2, 2), np.nan), mm))[0].get_array().mask.all()


def test_a_residual_is_symmetric_about_zero_and_names_its_rms():
    values = np.array([[3.0, -1.0], [0.0, 1.0]]) * nm
    ax = views.residual(values, mm, wavelength=500 * nm)
    image, bar = shown(ax)
    low, high = image.get_clim()
    assert low == -high
    assert 2.9 < high <= 3.0
    assert bar.ax.get_ylabel() == "residual / nm"
    assert ax.get_title() == "rms 1.66 nm = 0.0033 λ"
    assert views.residual(np.zeros((2, 2)), mm).get_title() == "rms 0 nm"


def test_a_phase_is_cyclic():
    image, bar = shown(views.phase(IMAGE, mm))
    assert image.get_clim() == pytest.approx((-np.pi, np.pi))
    first, last = image.get_cmap()([0.0, 1.0])
    np.testing.assert_allclose(first, last, atol=0.02)
    assert [tick.get_text() for tick in bar.ax.get_yticklabels()] == ["−π", "0", "π"]


@pytest.mark.parametrize("shape", [(4,), (2, 2, 2), (0, 3)])
def test_an_image_that_is_none_is_refused(shape):
    with pytest.raises(ValueError, match=r"image: expected shape \(rows, columns\), got"):
        views.interferogram(np.zeros(shape), mm)


@pytest.mark.parametrize("pitch", [0.0, -1.0, np.nan])
def test_a_pitch_that_is_none_is_refused(pitch):
    with pytest.raises(ValueError, match="pitch: expected a positive length in metres"):
        views.interferogram(IMAGE, pitch)


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_saving(tmp_path, suffix):
    file = tmp_path / f"view{suffix}"
    ax = views.phase(IMAGE, mm)
    views.save(ax, file)
    assert file.stat().st_size > 1000
    if suffix == ".png":
        pixels = imread(file)
        assert pixels.shape[1] == 7 * 150
        assert np.ptp(pixels[:, :, 0]) > 0.5
        views.save(ax.figure, file, dpi=50)
        assert imread(file).shape[1] == 7 * 50
    assert [path.name for path in tmp_path.iterdir()] == [file.name]


def test_a_save_that_fails_leaves_what_was_there(tmp_path):
    file = tmp_path / "view.png"
    file.write_bytes(b"before")

    class Broken:
        def savefig(self, path, **options):
            path.write_bytes(b"half")
            raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        views.save(Broken(), file)
    assert file.read_bytes() == b"before"
    assert [path.name for path in tmp_path.iterdir()] == ["view.png"]


def test_maps_name_what_colours_they_have():
    """Grey, and maps that are even to any eye; a cyclic one for what is cyclic."""
    names = [shown(view(IMAGE, mm))[0].get_cmap().name for view in MAPS]
    assert names == ["gray", "viridis", "PuOr", "twilight"]


def test_maps_beside_one_another_keep_out_of_each_other():
    """Nothing that is written reaches into other axes, or out of the figure."""
    figure = Figure(figsize=(13, 9), layout="compressed")
    axes = [view(IMAGE, mm, ax) for view, ax in zip(MAPS, figure.subplots(2, 2).flat, strict=True)]
    figure.draw_without_rendering()
    boxes = [ax.get_tightbbox() for ax in axes]
    assert all(figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1 for box in boxes)
    assert all(figure.bbox.y0 <= box.y0 and box.y1 <= figure.bbox.y1 for box in boxes)
    assert not [(a, b) for a in boxes for b in boxes if a is not b and a.overlaps(b)]
