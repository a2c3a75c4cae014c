"""What scenes and benches bring to be looked at."""

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import instruments, mm, nm
from fringetrace.geometry.shapes import plate
from fringetrace.optics.elements import IdealLens
from fringetrace.views.scene3d import layout, palette, viewer


@pytest.fixture(scope="module")
def bench():
    return instruments.michelson(plate(8 * mm, 8 * mm), aperture=6 * mm, pixels=(6, 8))


def test_a_bench_brings_rays_image_and_reference(bench):
    view = viewer.scene_view(bench, wavelength=633 * nm, step=0.5)
    assert view.strands.caption == "108 rays"
    assert view.strands.steps.max() == 1
    (chip,) = [panel for panel in view.stage.panels if panel.name == "CCD"]
    np.testing.assert_array_equal(chip.image, bench.interferogram(633 * nm, step=0.5))
    assert [panel.name for panel in view.stage.panels] == ["source", "CCD"]
    np.testing.assert_array_equal(
        chip.corners[0], bench.ccd.centre - 3 * mm * bench.ccd.axes[0] - 2.25 * mm * bench.ccd.axes[1]
    )
    assert len(view.stage.arrows) == 1


def test_names_stand_clear_of_each_other(bench):
    labels = layout.labels(viewer.scene_view(bench).stage)
    assert [name for name, _, _ in labels] == ["splitter", "sample", "reference", "source", "CCD"]
    right, up, _ = layout.axes_of_view()
    flat = np.array([(spot @ right, spot @ up) for _, spot, _ in labels])
    apart = np.linalg.norm(flat[:, None] - flat[None], axis=2)
    assert apart[np.triu_indices(5, 1)].min() > 1 * mm


def test_the_scale_bar_is_a_round_part_of_the_width(bench):
    found = viewer.scene_view(bench).stage
    assert found.bar_label == "5 mm"
    assert np.linalg.norm(found.bar[1] - found.bar[0]) == pytest.approx(5 * mm)


def test_legs_part_along_what_is_least(bench):
    view = viewer.scene_view(bench, explode=0.5)
    assert np.flatnonzero(view.shift).tolist() == [1]
    np.testing.assert_array_equal(viewer.scene_view(bench, explode=(0, 0, 1 * mm)).shift, [0, 0, 1 * mm])


def test_surfaces_look_like_what_they_do():
    square = plate(1 * mm, 1 * mm)
    kinds = {
        "mirror": ft.Mirror(), "beam splitter": ft.BeamSplitter(), "absorber": ft.Absorber(),
        "thin element": IdealLens((0, 0, 0), (0, 0, 1), 1 * mm),
    }  # fmt: skip
    looks = {name: palette.look(ft.Surface(square, kind)) for name, kind in kinds.items()}
    assert [look[0] for look in looks.values()] == list(kinds)
    glass = palette.look(ft.Surface(square, ft.Dielectric(), back=1.5))
    assert (glass[0], palette.look(ft.Surface(square, ft.Metal(), back=0.1 + 3j))[0]) == ("glass", "metal")
    assert glass[2] < 0.5 < looks["mirror"][2]
    assert (
        viewer.scene_view(ft.Scene([ft.Surface(square, ft.Mirror(), "one")]), surfaces="name").stage.legend[
            0
        ][0]
        == "one"
    )


def test_phases_are_coloured_in_a_circle(bench):
    view = viewer.scene_view(bench, wavelength=633 * nm, colour="phase")
    table = palette.scale(view.strands, "phase", "mm", mm).table().astype(int)
    steps = np.abs(np.diff(table, axis=0, append=table[:1])).sum(axis=1)
    assert steps.max() < 16  # no seam where it closes
    here = palette.values(view.strands, "phase", mm)
    later = palette.values(view.strands, "phase", mm, step=np.pi / 2)
    path, bounce = view.strands.legs()
    turned = view.strands.steps[path, bounce + 1][:, None]
    np.testing.assert_allclose(np.mod(later - here, 1.0), 0.25 * turned * np.ones(2), atol=1e-12)


def test_what_does_not_fit_is_refused(bench):
    with pytest.raises(ValueError, match="colour: expected a wavelength for 'phase', got None"):
        viewer.scene_view(bench, colour="phase")
    with pytest.raises(ValueError, match="surfaces: expected 'interface' or 'name', got 'kind'"):
        viewer.scene_view(bench, surfaces="kind")
    with pytest.raises(ValueError, match=r"image: expected that of the CCD, shape \(6, 8\), got \(8, 6\)"):
        viewer.scene_view(bench, image=np.zeros((8, 6)))
    with pytest.raises(ValueError, match="image: expected paths traced onto a CCD"):
        viewer.scene_view(bench.scene, image=np.zeros((6, 8)))
