"""Stress tests of numerical stability: each figure of docs/accuracy.md, kept below its limit."""

import pytest
import stability


@pytest.mark.parametrize("name", stability.CASES)
def test_a_stress_stays_within_its_limit(name):
    _, case, limit = stability.CASES[name]
    figure = case()
    assert figure.astray == 0
    assert figure.worst <= limit


def test_the_reference_sees_an_error():
    # the same paths, a thousandth of a wave longer
    from dataclasses import replace

    import fringetrace as ft

    scene = ft.Scene([ft.Surface(ft.shapes.plate(1.0, 1.0), ft.Mirror())])
    paths = ft.trace(scene, ft.Rays([(0.1, 0.2, 1.0)], [(0.1, 0.0, -1.0)]), record=True)
    longer = replace(paths, length=paths.length + 1e-3 * stability.WAVE)
    assert stability.worst_length(paths, [0]) < 1e-8
    assert stability.worst_length(longer, [0]) == pytest.approx(1e-3, rel=1e-5)
