"""Parameter sweeps on local cores, an executor or a Dask cluster, with results kept on disk."""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import json
import multiprocessing
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fringetrace.core.units import Array

Cell = Mapping[str, Any]
CellResult = dict[str, Array]
# Where BLAS, OpenMP and numba read how many threads they may have.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
# What a function's one array is called in its file.
ALONE = "result"


def grid(**axes: Sequence[Any]) -> list[dict[str, Any]]:
    """Cartesian product of parameters; the last one varies fastest.

    Parameters
    ----------
    **axes : sequence
        Values of each parameter.

    Returns
    -------
    list of dict
    """
    return [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]


def _plain(value: Any, name: str) -> Any:
    """A parameter as JSON that names it and nothing else."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        return {"float": value.hex()}
    if isinstance(value, (list, tuple)):
        return [_plain(item, name) for item in value]
    if isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
        digest = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
        return {"array": digest, "shape": list(value.shape), "type": value.dtype.str}
    raise ValueError(
        f"sweep parameter {name}: expected numbers, text, tuples or arrays of them, got "
        f"{type(value).__name__}; give others to the function by functools.partial"
    )


def _named(function: Callable[..., Any]) -> str:
    """The name of a function, that of what is inside of partial ones."""
    while isinstance(function, partial):
        function = function.func
    return f"{function.__module__}.{function.__qualname__}"


def key(function: Callable[..., Any], cell: Cell) -> str:
    """File name of a sweep cell: digest of the function's name and its parameters.

    Parameters
    ----------
    function : callable
        Only its name counts, not its code, nor what `functools.partial` has bound to it.
    cell : dict

    Returns
    -------
    str

    Raises
    ------
    ValueError
        If a parameter is neither number, text, tuple nor array.
    """
    plain = {name: _plain(value, name) for name, value in cell.items()}
    text = json.dumps([_named(function), plain], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _arrays(result: Any) -> CellResult:
    """What a function gave, as arrays by name."""
    named = result if isinstance(result, Mapping) else {ALONE: result}
    arrays = {str(name): np.asarray(value) for name, value in named.items()}
    for name, value in arrays.items():
        if value.dtype.hasobject:
            raise TypeError(f"sweep result {name}: expected an array of numbers, got {named[name]!r}")
    return arrays


def _save(arrays: CellResult, path: Path) -> None:
    """Write beside the place, then move there: a file that is there is whole."""
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with beside.open("wb") as stream:
            np.savez(stream, **arrays)  # type: ignore[arg-type]
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def _load(path: Path) -> CellResult:
    with np.load(path, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}


def _call(function: Callable[..., Any], cell: Cell) -> CellResult:
    return _arrays(function(**cell))


@contextlib.contextmanager
def _workers(executor: Executor | None, scheduler: str | None, processes: int | None) -> Iterator[Executor]:
    """The given executor, or a cluster's, or one of this machine's cores."""
    if executor is not None and scheduler is not None:
        raise ValueError("sweep: expected an executor or a scheduler, got both")
    if executor is not None:
        yield executor
    elif scheduler is not None:
        try:
            from distributed import Client
        except ImportError as error:
            raise RuntimeError("sweep: a scheduler needs pip install 'fringetrace[cluster]'") from error
        connect: Any = Client  # without types
        with connect(scheduler) as client, client.get_executor() as cluster:
            yield cluster
    else:
        # a fork would copy the locks of threads that are not there
        context, cores = multiprocessing.get_context("spawn"), os.cpu_count() or 1
        with (
            _threads(max(1, cores // (processes or cores))),
            ProcessPoolExecutor(processes, mp_context=context) as pool,
        ):
            yield pool


@contextlib.contextmanager
def _threads(count: int) -> Iterator[None]:
    """So many threads for the linear algebra, and other loops, of processes that begin meanwhile.

    Libraries read these at their start, and else take a thread a core in each process.
    """
    unsaid = {name: str(count) for name in THREADS if name not in os.environ}
    os.environ.update(unsaid)
    try:
        yield
    finally:
        for name in unsaid:
            os.environ.pop(name, None)


def sweep(
    function: Callable[..., Any],
    cells: Sequence[Cell],
    folder: str | os.PathLike[str] | None = None,
    *,
    executor: Executor | None = None,
    scheduler: str | None = None,
    processes: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[CellResult]:
    """Call a function for each set of parameters, in parallel; results in the order of the parameters.

    With a folder each result is kept in a file of its own as soon as it is there, and cells whose file
    is there already are read, not computed: the same sweep goes on where it was stopped, however it
    was, and a longer one takes over what it can. A folder belongs to one function, as it is.

    Parameters
    ----------
    function : callable
        Called with a cell's parameters by name; gives an array, or a dict of arrays. Processes and
        clusters need one that can be pickled: defined at the top of a module.
    cells : sequence of dict
        Parameters by name; see `grid`.
    folder : path-like, optional
        Where results are kept; made if it is not there. Default: nowhere.
    executor : concurrent.futures.Executor, optional
        What calls the function, such as a ThreadPoolExecutor; the caller closes it.
    scheduler : str, optional
        Address of a Dask scheduler, such as "tcp://10.0.0.1:8786"; its workers need fringetrace.
    processes : int, optional
        Without either, processes of this machine; default one for each core. Each has its share of the
        cores for threads of its libraries.
    progress : callable, optional
        Called with (cells done, cells in all), those read from files first.

    Returns
    -------
    list of dict of array
        A function's one array is called "result".

    Raises
    ------
    ValueError
        If a parameter cannot be told by its value, or both an executor and a scheduler are given.
    RuntimeError
        If a scheduler is given but Dask is not installed; or a call failed, its process was killed, or its
        result is no array of numbers: it names the parameters, its cause is what happened, and what was
        done before is kept.
    """
    names = [key(function, cell) for cell in cells]
    place = None if folder is None else Path(folder)
    done: dict[str, CellResult] = {}
    if place is not None:
        place.mkdir(parents=True, exist_ok=True)
        done = {name: _load(place / f"{name}.npz") for name in names if (place / f"{name}.npz").exists()}
    missing = {name: cell for name, cell in zip(names, cells, strict=True) if name not in done}
    total = len(done) + len(missing)
    if progress is not None:
        progress(len(done), total)
    if missing:
        with _workers(executor, scheduler, processes) as workers:
            futures = {workers.submit(_call, function, cell): name for name, cell in missing.items()}
            for name, result in _as_they_come(futures, missing):
                done[name] = result
                if place is not None:
                    _save(result, place / f"{name}.npz")
                if progress is not None:
                    progress(len(done), total)
    return [done[name] for name in names]


def _said(cell: Cell) -> dict[str, Any]:
    """A cell in words: arrays by their shapes."""
    arrays = {name: value for name, value in cell.items() if isinstance(value, np.ndarray)}
    return {**cell, **{name: f"array {value.shape}" for name, value in arrays.items()}}


def _as_they_come(
    futures: dict[Future[CellResult], str], cells: Mapping[str, Cell]
) -> Iterator[tuple[str, CellResult]]:
    """Results with their names; after a failure, what has not begun is given up."""
    try:
        for future in as_completed(list(futures)):
            name = futures.pop(future)
            try:
                yield name, future.result()
            except Exception as error:
                raise RuntimeError(f"sweep: failed at {_said(cells[name])}: {error}") from error
    finally:
        for future in futures:
            future.cancel()
