"""What the physics tests compare with what, and how far off they were: measured while the tests run.

python benchmarks/verification.py           print the table
python benchmarks/verification.py --write   and write it into docs/verification.md

No error is typed in. A plugin listens to the comparisons of each test (`assert a < b`, `pytest.approx`,
`numpy.testing.assert_allclose`) and keeps the one that came nearest to its tolerance.
"""

from __future__ import annotations

import ast
import math
import re
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any
from unittest import mock

import numpy as np
import pages
import pytest

# pytest compares arrays and sequences number by number too
Scalar = type(pytest.approx(1.0))
TESTS = Path(__file__).parents[1] / "tests" / "physics"


@dataclass(frozen=True)
class Reading:
    """One comparison that held: how far off, how much was allowed, whether relative, the statement."""

    error: float
    allowed: float
    relative: bool
    statement: str


@cache
def statements(path: str) -> list[tuple[int, int, str]]:
    """First line, last line and text of each simple statement of a file."""
    text = Path(path).read_text(encoding="utf-8")
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Assert | ast.Expr)]
    return [(node.lineno, node.end_lineno or node.lineno, ast.unparse(node)) for node in nodes]


def statement(path: str, line: int) -> str:
    """The statement of a file that a line belongs to."""
    return next((text for first, last, text in statements(path) if first <= line <= last), "")


def asking() -> tuple[str, int]:
    """File and line of the test that is asking."""
    frame: FrameType | None = sys._getframe(1)
    while frame and TESTS not in Path(frame.f_code.co_filename).parents:
        frame = frame.f_back
    return (frame.f_code.co_filename, frame.f_lineno) if frame else ("", 0)


class Meter:
    """A pytest plugin: readings by test."""

    def __init__(self) -> None:
        self.readings: dict[str, list[Reading]] = defaultdict(list)
        self.test = ""

    def keep(self, error: float, allowed: float, relative: bool, where: tuple[str, int]) -> None:
        """Keep what held."""
        if self.test and 0.0 <= error <= allowed < math.inf:
            self.readings[self.test].append(
                Reading(float(error), float(allowed), relative, statement(*where) if where[1] else "")
            )

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        """Listen while a test runs."""
        self.test = f"{item.path.stem}::{getattr(item, 'originalname', item.name)}"
        with self.listening():
            result = yield
        self.test = ""
        return result

    def pytest_assertion_pass(self, item: pytest.Item, lineno: int, orig: str, expl: str) -> None:
        """`assert error < allowed` of two numbers."""
        sides = re.fullmatch(r"(.+?) <=? (.+)", expl.partition("\n")[0])
        if sides:
            try:
                error, allowed = (float(eval(side, {"np": np})) for side in sides.groups())
            except (SyntaxError, NameError, TypeError, ValueError, AttributeError):
                return
            self.keep(error, allowed, False, (str(item.path), lineno))

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Hear each number that pytest.approx and assert_allclose compare."""
        equal, close = Scalar.__eq__, np.testing.assert_allclose

        def heard(approx: Any, actual: Any) -> bool:
            same = equal(approx, actual)
            if same and np.ndim(actual) == 0 and isinstance(approx.expected, int | float | complex):
                relative = approx.abs is None and approx.expected != 0
                scale = abs(approx.expected) if relative else 1.0
                self.keep(abs(actual - approx.expected) / scale, approx.tolerance / scale, relative, asking())
            return same

        def checked(actual: Any, desired: Any, rtol: float = 1e-7, atol: float = 0.0, **options: Any) -> None:
            close(actual, desired, rtol, atol, **options)
            off, size = abs(np.asarray(actual) - desired), abs(np.asarray(desired))
            off, size = np.broadcast_arrays(np.nan_to_num(off), size)
            allowed = atol + rtol * size
            worst = (np.unravel_index((off / np.where(allowed > 0, allowed, 1)).argmax(), off.shape)) if off.size else ()
            if off.size:
                relative = np.all(atol == 0)
                scale = (size[worst] or 1.0) if relative else 1.0
                self.keep(off[worst] / scale, np.broadcast_to(allowed, off.shape)[worst] / scale, bool(relative), asking())

        with mock.patch.object(Scalar, "__eq__", heard), mock.patch.object(np.testing, "assert_allclose", checked):
            yield


def measure(names: list[str]) -> dict[str, list[Reading]]:
    """Run tests, and return what they read."""
    meter = Meter()
    with tempfile.TemporaryDirectory() as folder:
        sys.pycache_prefix = folder  # tests compiled before have no hook
        options = ["-q", "-p", "no:cacheprovider", "-o", "enable_assertion_pass_hook=true"]
        code = pytest.main([*options, *names], plugins=[meter])
    if code != 0:
        raise SystemExit(f"Tests: expected all to pass, got exit code {code}")
    return meter.readings


if __name__ == "__main__":
    import json
    r = measure(sys.argv[2:])
    Path(sys.argv[1]).write_text(json.dumps({k: [[x.error, x.allowed, x.relative, x.statement] for x in v] for k, v in r.items()}))
