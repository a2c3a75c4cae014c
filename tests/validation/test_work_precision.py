"""Work-precision runs: errors against known fields, how they fall, what is written. No time decides."""

import json
import math

import numpy as np
import pages
import pytest
import skips
from matplotlib.image import imread

import fringetrace as ft
from fringetrace import views
from fringetrace.validation import work_precision
from fringetrace.validation.standards import STANDARDS
from fringetrace.validation.work_precision import METHODS, StandardRun, irradiance_error, phase_error

BY_NAME = {method.name: method for method in METHODS}
PIXELS, CELLS = 16, 8
# A pixel's mean may be off so much, of the irradiance; and so many waves a field of that accuracy.
QUADRATURE = 1e-6


def runs(name, method, counts, cells=CELLS, pixels=PIXELS):
    standard = STANDARDS[name](pixels, cells)
    used = standard if BY_NAME[method].form else standard.faceted()
    truth = standard.truth()
    return [work_precision.run_standard(used, truth, BY_NAME[method], count) for count in counts]


def test_errors_are_what_they_say():
    truth = np.array([[1.0, 2.0j], [0.5, 1 + 1j]])
    tenth = truth * np.exp(2j * math.pi * 0.1)
    assert phase_error(truth, truth) == 0.0
    assert phase_error(tenth, truth) == pytest.approx(0.1, rel=1e-12)
    # amplitude alone is no phase
    assert phase_error(3.0 * truth, truth) == pytest.approx(0.0, abs=1e-15)
    # one pixel of four off by a tenth, weighted with its power
    one = truth.copy()
    one[0, 1] *= np.exp(2j * math.pi * 0.1)
    assert phase_error(one, truth) == pytest.approx(0.1 * math.sqrt(4 / 7.25), rel=1e-12)
    # a phase at random is off by 1 / sqrt(12) of a wave, as no light at all
    turns = np.exp(2j * math.pi * (np.arange(1000) + 0.5) / 1000)
    assert phase_error(turns, np.ones(1000)) == pytest.approx(phase_error(0 * turns, np.ones(1000)), rel=1e-5)
    assert irradiance_error(np.array([1.0, 3.0]), np.array([2.0, 2.0])) == 0.5


@pytest.mark.parametrize("name", ["tilt", "step", "valley", "corner_cube"])
def test_the_wavefront_method_is_exact_on_flat_facets(name):
    (run,) = runs(name, "wavefront, facets", [6])
    assert run.waves < QUADRATURE
    assert run.irradiance < 10 * QUADRATURE  # edges of six sectors in the corner cube
    assert run.rays == 36
    assert run.seconds > 0.0


@pytest.mark.parametrize("name", ["tilt", "valley", "corner_cube", "newton"])
def test_the_ray_sum_gets_better_with_more_rays(name):
    # the phase of 16 times as many: random ones would gain 4, regular ones more. The irradiance need not
    # get better where phases differ within a pixel: a sum knows the square of the mean field alone
    coarse, fine = runs(name, "rays, facets", [48, 192], cells=64)
    assert fine.waves < coarse.waves / 2.5


def test_single_precision_has_a_floor():
    ours, theirs = (runs("valley", method, [256])[0] for method in ("rays, facets", "float32, facets"))
    # 7 m of path: half a rounding of float32 is .38 waves
    assert theirs.waves > 0.05
    assert ours.waves < 0.01


@pytest.mark.parametrize("name", ["paraboloid", "sphere"])
def test_facets_are_off_by_their_sag(name):
    """The error of facets falls as the square of their side, that of the form is not theirs."""
    few, many = (runs(name, "rays, facets", [128], cells)[0].waves for cells in (6, 24))
    (form,) = (run.waves for run in runs(name, "rays, form", [128], 6))
    assert few > 2 * many
    assert form < 0.5 * few


@pytest.mark.parametrize("name", ["paraboloid", "sphere", "newton"])
def test_the_wavefront_off_forms_is_of_fourth_order(name):
    # pixels small enough for a mean field: a wave has its phase all the way around on larger ones
    coarse, fine, finest = runs(name, "wavefront, form", [5, 10, 40], pixels=48)
    # 2^4 = 16, less what the rim weighs
    assert coarse.waves / fine.waves > 8
    assert finest.waves < QUADRATURE
    assert finest.irradiance < QUADRATURE


def some(seconds=0.1):
    return [
        StandardRun("a", "rays, facets", 64, 12, seconds, 1e-2, 1e-1),
        StandardRun("a", "rays, facets", 256, 12, 4 * seconds, 5e-3, 5e-2),
        StandardRun("a", "wavefront, form", 64, 12, seconds, 1e-6, 1e-7),
        StandardRun("b", "rays, facets", 64, 12, seconds, 2e-2, 2e-1),
    ]


def test_the_table_has_the_best_run_of_each():
    lines = work_precision.markdown_table(some()).splitlines()
    assert lines[2:] == [
        "| a | rays, facets | 256 | 0.400 | 5.0e-03 | 5.0e-02 |",
        "| a | wavefront, form | 64 | 0.100 | 1.0e-06 | 1.0e-07 |",
        "| b | rays, facets | 64 | 0.100 | 2.0e-02 | 2.0e-01 |",
    ]


def test_all_runs_and_the_machine_are_written(tmp_path):
    work_precision.write(some(), tmp_path)
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(work_precision.FILES)
    content = json.loads((tmp_path / "work_precision.json").read_text())
    assert content["runs"] == [vars(run) for run in some()]
    assert content["wavelength_m"] == pytest.approx(632.8e-9)
    assert content["fringetrace"] == ft.__version__
    assert {"machine", "system", "cores", "python", "numpy", "numba", "embreex"} < set(content)
    assert imread(tmp_path / "work_precision.png")[:, :, :3].std() > 0.05


def test_the_picture_has_a_pair_of_axes_for_each_scene():
    figure = views.comparison(work_precision.panels(some()))
    axes = figure.axes
    assert len(axes) == 4
    assert [ax.get_xlabel() for ax in axes] == ["seconds", "rays"] * 2
    for ax in axes:
        assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    np.testing.assert_allclose(axes[0].lines[0].get_data(), [[0.1, 0.4], [1e-2, 5e-3]])
    np.testing.assert_allclose(axes[1].lines[0].get_data(), [[64, 256], [1e-2, 5e-3]])
    # a method has its colour in every panel
    assert axes[2].lines[0].get_color() == axes[0].lines[0].get_color() != axes[0].lines[1].get_color()
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["rays, facets", "wavefront, form"]


def test_a_picture_of_nothing_is_refused():
    with pytest.raises(ValueError, match="comparison: expected at least one panel, got none"):
        views.comparison({})


def test_unknown_scenes_are_refused():
    with pytest.raises(ValueError, match=r"scenes: expected some of paraboloid, .* got 'lens'"):
        work_precision.checked_standards(["step", "lens"])


def test_a_quick_bench_runs_each_method_that_suits():
    seen = []
    done = list(work_precision.runs(["valley"], quick=True, progress=lambda *counts: seen.append(counts)))
    flat = [method for method in METHODS if not method.form]
    assert [(run.method, run.rays) for run in done] == [(m.name, n**2) for m in flat for n in m.quick]
    assert {run.standard for run in done} == {"valley of two mirrors"}
    assert seen == [(i + 1, len(done)) for i in range(len(done))]


# The scripts that write docs/accuracy.md.


def test_sections_are_written_each_on_its_own(tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "provenance", lambda: "here, today")
    page = tmp_path / "page.md"
    page.write_text("# Page\n\n<!-- one -->\n\nold\n\n<!-- end of one -->\n\nby hand\n")
    pages.write("one", "new\n", page)
    pages.write("two", "more", page)
    pages.write("two", "other", page)
    assert page.read_text() == (
        "# Page\n\n<!-- one -->\n\nnew\n\n*Made here, today*\n\n<!-- end of one -->\n\nby hand\n\n"
        "<!-- two -->\n\nother\n\n*Made here, today*\n\n<!-- end of two -->\n"
    )
    assert [file.name for file in tmp_path.iterdir()] == ["page.md"]


DEAR = ("culled", "rephased", "unreached")  # over a second each
SKIPS = [
    pytest.param(name, marks=pytest.mark.slow if name in DEAR else ())
    for name in skips.SKIPS
    if name != "imported"
]


@pytest.mark.parametrize("name", SKIPS)
@pytest.mark.filterwarnings("ignore:(power is cut off|fringes alias)")
def test_a_skip_changes_no_result(name):
    case = skips.SKIPS[name](24)
    on, off = case.on(), case.off()
    assert on
    assert sum(column.size for column in on) > 60
    for one, other in zip(on, off, strict=True):
        if one.dtype.kind in "iu":
            np.testing.assert_array_equal(one, other)
        else:
            scale = math.sqrt(np.mean(np.abs(other) ** 2))
            # roundings, of a path of some micrometres to metres; of a phase 2 pi / wavelength more
            assert math.sqrt(np.mean(np.abs(one - other) ** 2)) < 1e-8 * scale


def test_results_are_told_apart():
    a = [np.array([1.0, 2.0]), np.array([1, 2])]
    assert skips.same(a, [column.copy() for column in a]) == "to the bit"
    assert skips.same(a, [a[0] * (1 + 1e-9), a[1]]) == "to 1e-09 rms"
    assert skips.same(a, [a[0], a[1] + 1]) == "no"


def test_hooks_that_are_gone_are_missed():
    with pytest.raises(LookupError, match=r"nothing_like_that in one of tracing\.tracer"):
        skips.without(lambda: [], "nothing_like_that", lambda real: real, "tracing.tracer")()
