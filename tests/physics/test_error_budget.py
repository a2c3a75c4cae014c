"""Each term of the error budget against the true error: never below by a factor 2, nor above by 10."""

import budget as cases
import pytest

SLOW = {"between plates", "relief of the demo, 1 ray a pixel"} | {
    name for name in cases.CASES if name.startswith("spherical wave")
}
NAMES = [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in cases.CASES]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.filterwarnings("ignore:(fringes alias|facets cost)")
def test_a_term_is_near_the_true_error(name):
    rows = list(cases.CASES[name][2]())
    assert len(rows) > 1
    assert [row for row in rows if not row.holds] == []
    assert min(row.truth for row in rows) > 0.0


def test_each_term_has_three_scenes_and_more():
    for term in ("hit", "facets", "sampling", "pixels"):
        assert sum(term in kind for kind, _, _ in cases.CASES.values()) >= 3


@pytest.mark.parametrize("factor", [0.4, 11.0])
def test_the_comparison_sees_an_estimate_that_is_off(factor):
    assert cases.Row("", 1e-3, 1e-3).holds
    assert not cases.Row("", 1e-3, factor * 1e-3).holds
