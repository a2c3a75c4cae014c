"""Results of a scene are made once, by whoever asks first, and do not travel with it."""

import copy
import pickle
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

import fringetrace as ft
from fringetrace import shapes
from fringetrace.scene import once_per_scene

calls = []


@once_per_scene
def counted(scene: ft.Scene, power: int = 1) -> list[int]:
    """How many surfaces, to some power."""
    calls.append((scene, power))
    time.sleep(0.01)
    return [len(scene.surfaces) ** power]


@once_per_scene
def doubled(scene: ft.Scene) -> int:
    return 2 * counted(scene)[0]


@once_per_scene
def failing(scene: ft.Scene) -> int:
    calls.append(scene)
    raise ValueError("failing: no result")


@pytest.fixture
def scene():
    calls.clear()
    return ft.Scene([ft.Surface(shapes.plate(1.0, 1.0), ft.Mirror())] * 2)


def test_a_result_is_made_once_for_each_set_of_arguments(scene):
    assert counted(scene) is counted(scene, 1) is counted(scene, power=1)
    assert counted(scene, 3) == [8]
    assert [power for _, power in calls] == [1, 3]
    assert counted.__doc__ == "How many surfaces, to some power."


def test_scenes_have_results_of_their_own(scene):
    other = ft.Scene(scene.surfaces[:1])
    assert (counted(scene), counted(other)) == ([2], [1])


def test_a_result_may_be_made_from_another(scene):
    assert doubled(scene) == 4
    assert len(calls) == 1


def test_threads_share_one_result(scene):
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: counted(scene), range(32)))
    assert len(calls) == 1
    assert all(one is found[0] for one in found)


def test_what_fails_is_not_kept(scene):
    for _ in range(2):
        with pytest.raises(ValueError, match="failing: no result"):
            failing(scene)
    assert len(calls) == 2


@pytest.mark.parametrize("travel", [copy.deepcopy, lambda scene: pickle.loads(pickle.dumps(scene))])
def test_results_do_not_travel(scene, travel):
    first = counted(scene)
    other = travel(scene)
    assert counted(other) == first
    assert counted(other) is not first
    assert counted(scene) is first
    assert len(calls) == 2
