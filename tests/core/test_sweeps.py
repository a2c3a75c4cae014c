"""Sweeps: any function over any table, kept, gone on with."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
import pytest
from swept import dies_once, max_of

from fringetrace.core import sweeps

CELLS = sweeps.grid(x=[1.0, 2.0, 3.0], n=[1, 4])


def powers(x, n, *, offset=0.0):
    return {"power": np.array([x**n + offset]), "root": np.array([x ** (1.0 / n)])}


def fails_at_three(x, n):
    if x == 3.0:
        raise ArithmeticError("three is too many")
    return np.array(x + n)


@pytest.fixture
def threads():
    with ThreadPoolExecutor(2) as pool:
        yield pool


def test_a_grid_is_every_combination():
    assert CELLS[:3] == [{"x": 1.0, "n": 1}, {"x": 1.0, "n": 4}, {"x": 2.0, "n": 1}]
    assert len(CELLS) == 6


def test_results_come_in_the_order_of_the_cells(threads):
    said = []
    done = sweeps.sweep(powers, CELLS, executor=threads, progress=lambda *counts: said.append(counts))
    assert [result["power"].item() for result in done] == [1.0, 1.0, 2.0, 16.0, 3.0, 81.0]
    assert said == [(k, 6) for k in range(7)]


def test_processes_give_the_same():
    assert sweeps.sweep(max_of, [], processes=1) == []
    done = sweeps.sweep(max_of, [{"values": (1.0, 5.0)}, {"values": np.arange(4.0)}], processes=1)
    assert [result["result"].item() for result in done] == [5.0, 3.0]


def test_what_is_kept_is_not_computed_again(tmp_path, threads):
    calls = []

    def counted(x, n):
        calls.append((x, n))
        return powers(x, n)

    first = sweeps.sweep(counted, CELLS[:4], tmp_path, executor=threads)
    again = sweeps.sweep(counted, CELLS, tmp_path, executor=threads)
    assert len(calls) == len(set(calls)) == 6
    assert again[:4] == first
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".npz"] * 6


def test_equal_cells_are_computed_once(tmp_path, threads):
    done = sweeps.sweep(powers, [CELLS[0], dict(reversed(CELLS[0].items()))], tmp_path, executor=threads)
    assert len(list(tmp_path.iterdir())) == 1
    assert done[0] == done[1]


def test_what_a_partial_binds_does_not_name_a_cell():
    assert sweeps.key(partial(powers, offset=2.0), CELLS[0]) == sweeps.key(powers, CELLS[0])
    assert sweeps.key(max_of, CELLS[0]) != sweeps.key(powers, CELLS[0])
    assert sweeps.key(powers, {"x": 1}) != sweeps.key(powers, {"x": 1.0})
    assert sweeps.key(powers, {"x": np.float64(0.1)}) == sweeps.key(powers, {"x": 0.1})
    assert sweeps.key(powers, {"x": np.arange(3)}) != sweeps.key(powers, {"x": np.arange(3.0)})


def test_a_failure_names_its_cell_and_keeps_the_others(tmp_path, threads):
    with pytest.raises(RuntimeError, match=r"failed at {'x': 3.0, 'n': 1}: three is too many") as caught:
        sweeps.sweep(fails_at_three, [*CELLS[:4], CELLS[4]], tmp_path, executor=threads)
    assert isinstance(caught.value.__cause__, ArithmeticError)
    assert 2 <= len(list(tmp_path.iterdir())) <= 4


def test_what_cannot_be_told_by_its_value(threads):
    with pytest.raises(ValueError, match=r"sweep parameter x: expected numbers, text, .* got object"):
        sweeps.sweep(powers, [{"x": object(), "n": 1}], executor=threads)
    with pytest.raises(RuntimeError, match="expected an array of numbers") as caught:
        sweeps.sweep(lambda: [object()], [{}], executor=threads)
    assert isinstance(caught.value.__cause__, TypeError)
    with pytest.raises(ValueError, match="expected an executor or a scheduler, got both"):
        sweeps.sweep(powers, CELLS, executor=threads, scheduler="tcp://localhost:1")


def test_without_dask(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(RuntimeError, match=r"pip install 'fringetrace\[cluster\]'"):
        sweeps.sweep(powers, CELLS, scheduler="tcp://localhost:1")


SWEEP = """
import sys, time
from concurrent.futures import ThreadPoolExecutor
import numpy as np
from fringetrace import sweeps

def walk(seed):
    time.sleep(0.1)
    with open(sys.argv[2], "a") as log:
        log.write(f"{seed}\\n")
    return np.random.default_rng(seed).standard_normal(1000).cumsum()

with ThreadPoolExecutor(1) as pool:
    sweeps.sweep(walk, sweeps.grid(seed=range(12)), sys.argv[1], executor=pool)
"""


def test_a_killed_sweep_goes_on_where_it_stopped(tmp_path):
    """Killed at any moment: the same bits in the end, and no finished cell is computed twice."""

    def run(folder, log):
        return subprocess.Popen([sys.executable, "-c", SWEEP, str(tmp_path / folder), str(tmp_path / log)])

    victim = run("killed", "log")
    while len(list((tmp_path / "killed").glob("[!.]*.npz"))) < 4:
        assert victim.poll() is None
        time.sleep(0.01)
    victim.send_signal(signal.SIGKILL)
    assert victim.wait() == -signal.SIGKILL
    before = {path.name for path in (tmp_path / "killed").glob("[!.]*.npz")}
    assert 4 <= len(before) < 12
    computed = (tmp_path / "log").read_text().split()
    assert run("killed", "log").wait() == 0
    assert run("whole", "other").wait() == 0
    again = (tmp_path / "log").read_text().split()[len(computed) :]
    assert len(again) == 12 - len(before)
    for path in (tmp_path / "whole").iterdir():
        with np.load(path) as one, np.load(tmp_path / "killed" / path.name) as other:
            assert one["result"].tobytes() == other["result"].tobytes()


def test_a_killed_worker_is_told_of_and_the_next_call_goes_on(tmp_path, monkeypatch):
    for name in sweeps.THREADS:
        monkeypatch.delenv(name, raising=False)
    cells = sweeps.grid(x=[1.0, 2.0], marks=[str(tmp_path)])
    with pytest.raises(RuntimeError, match=r"sweep: failed at {'x': .*}: .* process .* terminated abruptly"):
        sweeps.sweep(dies_once, cells, tmp_path / "kept", processes=1)
    assert len(list((tmp_path / "kept").glob("*.npz"))) == 1
    said = []
    done = sweeps.sweep(
        dies_once, cells, tmp_path / "kept", processes=1, progress=lambda *counts: said.append(counts)
    )
    assert said == [(1, 2), (2, 2)]
    found = [result["result"].tolist() for result in done]
    assert [values[0] for values in found] == [1.0, 4.0]
    # one process may use all cores; the environment here is as before
    assert {*found[0][1:], *found[1][1:]} == {os.cpu_count()}
    assert not set(sweeps.THREADS) & set(os.environ)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of tornado and dask
def test_a_cluster_gives_the_same_though_a_worker_is_killed(tmp_path):
    distributed = pytest.importorskip("distributed")
    cells = sweeps.grid(x=[1.0, 2.0, 3.0], marks=[str(tmp_path)])
    with distributed.LocalCluster(1, threads_per_worker=1, dashboard_address=None) as cluster:
        done = sweeps.sweep(dies_once, cells, tmp_path / "kept", scheduler=cluster.scheduler_address)
    assert (tmp_path / "died").exists()
    assert [result["result"][0].item() for result in done] == [1.0, 4.0, 9.0]
