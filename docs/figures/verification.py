"""What the physics tests compare with what, and how far off they were: measured while the tests run.

python docs/figures/verification.py           print the tables
python docs/figures/verification.py --write   and write them into docs/verification.md

No error is typed in. A plugin listens to the comparisons that each test makes (`assert a < b`,
`pytest.approx`, `numpy.testing.assert_allclose`); of those that `verification.csv` names, the one nearest to
its tolerance is shown.
"""

from __future__ import annotations

import ast
import csv
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

import mpmath
import numpy as np
import pages
import pytest

TESTS = Path(__file__).parents[2] / "tests" / "physics"
# Section, system, truth, test, unit (unless relative), and a part of the statement that is meant.
SYSTEMS = Path(__file__).with_suffix(".csv")
# pytest compares arrays and sequences number by number, with this.
Scalar = type(pytest.approx(1.0))
# How pytest writes numbers.
NUMBERS = {"np": np, "mpf": mpmath.mpf}


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


def asking() -> str:
    """The statement of the test that is asking."""
    frame: FrameType | None = sys._getframe(1)
    while frame and TESTS not in Path(frame.f_code.co_filename).parents:
        frame = frame.f_back
    return statement(frame.f_code.co_filename, frame.f_lineno) if frame else ""


class Meter:
    """A pytest plugin: readings by test."""

    def __init__(self) -> None:
        self.readings: dict[str, list[Reading]] = defaultdict(list)
        self.test = ""

    def keep(self, error: float, allowed: float, relative: bool, where: str) -> None:
        """Keep what held."""
        if self.test and where and 0.0 <= error <= allowed < math.inf:
            self.readings[self.test].append(Reading(float(error), float(allowed), bool(relative), where))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        """Listen while a test runs."""
        test = getattr(item, "originalname", item.name).removeprefix("test_")
        self.test = f"{item.path.stem.removeprefix('test_')}::{test}"
        with self.listening():
            result = yield
        self.test = ""
        return result

    def pytest_assertion_pass(self, item: pytest.Item, lineno: int, orig: str, expl: str) -> None:
        """`assert error < allowed` of two numbers."""
        sides = re.fullmatch(r"(.+?) <=? (.+)", expl.partition("\n")[0])
        if sides:
            try:
                error, allowed = (float(eval(side, NUMBERS)) for side in sides.groups())
            except (SyntaxError, NameError, TypeError, ValueError, AttributeError):
                return
            # a library's own assertions are heard too, with line numbers of another file
            text = "assert " + ast.unparse(ast.parse(f"({orig}\n)", mode="eval"))
            where = statement(str(item.path), lineno)
            self.keep(error, allowed, False, where if where.startswith(text) else "")

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Hear each number that pytest.approx and assert_allclose compare."""
        equal, close = Scalar.__eq__, np.testing.assert_allclose

        def heard(approx: Any, actual: Any) -> bool:
            same = equal(approx, actual)
            if same and np.ndim(actual) == 0 and isinstance(approx.expected, int | float | complex):
                relative = not approx.abs and approx.expected != 0
                scale = abs(approx.expected) if relative else 1.0
                self.keep(abs(actual - approx.expected) / scale, approx.tolerance / scale, relative, asking())
            return same

        def checked(actual: Any, desired: Any, rtol: float = 1e-7, atol: float = 0.0, **options: Any) -> None:
            close(actual, desired, rtol, atol, **options)
            size = abs(np.asarray(desired))
            off, size, margin = np.broadcast_arrays(abs(np.asarray(actual) - desired), size, atol)
            allowed = margin + rtol * size
            for worst in np.argwhere(off == np.nanmax(off, initial=0.0))[:1]:
                at, relative = tuple(worst), not margin.any()
                scale = size[at] if relative and size[at] else 1.0
                self.keep(off[at] / scale, allowed[at] / scale, relative, asking())

        listen = {"target": Scalar, "attribute": "__eq__", "new": heard}
        with mock.patch.object(**listen), mock.patch.object(np.testing, "assert_allclose", checked):
            yield


def measure(names: list[str]) -> dict[str, list[Reading]]:
    """Run tests, each a room of tests::its name, and return what they read."""
    meter = Meter()
    found = [name.split("::") for name in names]
    with tempfile.TemporaryDirectory() as folder:
        sys.pycache_prefix = folder  # tests compiled before have no hook
        options = ["-q", "-p", "no:cacheprovider", "-o", "enable_assertion_pass_hook=true"]
        tests = [f"{TESTS}/test_{room}.py::test_{test}" for room, test in found]
        code = pytest.main([*options, *tests], [meter])
    if code != 0:
        raise SystemExit(f"Tests: expected all to pass, got exit code {code}")
    return meter.readings


def chosen(row: dict[str, str], readings: dict[str, list[Reading]]) -> Reading:
    """The comparison of a row: in the statement that it names, what came nearest to its tolerance."""
    found = [each for each in readings[row["test"]] if row["statement"] in each.statement]
    if not found:
        raise SystemExit(f"{row['test']}: expected a comparison with {row['statement']!r}, got none")
    return max(found, key=lambda each: each.error / each.allowed if each.allowed else 0.0)


def table(rows: list[dict[str, str]], readings: dict[str, list[Reading]]) -> str:
    """The page's tables, one a section, in Markdown."""
    lines: list[str] = []
    for row in rows:
        if f"## {row['section']}" not in lines:
            lines += ["", f"## {row['section']}", "", "| system | truth | off by | allowed | of | test |"]
            lines += ["|---|---|---|---|---|---|"]
        reading = chosen(row, readings)
        room, test = row["test"].split("::")
        of = "itself" if reading.relative else row["unit"]
        numbers = f"{reading.error:.1e} | {reading.allowed:.1e}"
        lines.append(f"| {row['system']} | {row['truth']} | {numbers} | {of} | `{room}`: {test} |")
    return "\n".join(lines)


def main() -> None:
    """Run the tests of the table, and print or write it."""
    with SYSTEMS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file, delimiter=";"))
    text = table(rows, measure([row["test"] for row in rows]))
    if "--write" in sys.argv[1:]:
        pages.write("verification", text, pages.DOCS / "verification.md")
    print(text)


if __name__ == "__main__":
    main()
