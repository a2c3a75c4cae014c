"""Scenes at random against an oracle that shares no code with the engine; 2,000 of them in benchmarks."""

from dataclasses import replace

import numpy as np
import pytest
import random_scenes

import fringetrace as ft


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", random_scenes.KINDS)
def test_no_path_differs_from_what_the_oracle_allows(kind, seed):
    _, paths, faults = random_scenes.tried(seed, 150, kind)
    assert faults == []
    assert paths.bounces.max() > 0


def test_the_oracle_sees_a_face_that_is_passed_over():
    some = random_scenes.case(0, 100, "windows")
    whole = random_scenes.tried(0, 100, "windows")[1]
    without = ft.trace(ft.Scene(some.scene.surfaces[1:]), some.rays, max_bounces=60, record=True, warn=False)
    shifted = np.where(without.surface >= 0, without.surface + 1, -1)
    assert whole.bounces.sum() > without.bounces.sum()
    faults = random_scenes.judge(some, replace(without, surface=shifted))
    assert any("not crossed once" in fault or "through faces" in fault for fault in faults)
