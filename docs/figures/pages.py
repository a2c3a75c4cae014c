"""Sections of a page between markers, so that several scripts can each write their own."""

from __future__ import annotations

import datetime
import os
import platform
from importlib.metadata import version
from pathlib import Path

DOCS = Path(__file__).parents[1]
ACCURACY, BUDGET = DOCS / "accuracy.md", DOCS / "budget.md"
LIBRARIES = ("numpy", "numba", "embreex")


def processor() -> str:
    """Name of the processor, as far as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def provenance() -> str:
    """Say on what machine, with what and when figures were made."""
    libraries = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    today = datetime.date.today().isoformat()
    return f"{today}; {os.cpu_count()} cores, {processor()}; Python {platform.python_version()}, {libraries}."


def write(name: str, text: str, page: Path = ACCURACY) -> None:
    """Put a text between the markers of a section, with machine and date below it.

    A page without the markers gets them at its end.
    """
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    old = page.read_text(encoding="utf-8")
    if begin not in old:
        old = f"{old.rstrip()}\n\n{begin}\n{end}\n"
    before, rest = old.split(begin)
    _, after = rest.split(end)
    beside = page.with_suffix(".part")
    made = f"*Made {provenance()}*"
    beside.write_text(f"{before}{begin}\n\n{text.strip()}\n\n{made}\n\n{end}{after}", encoding="utf-8")
    beside.replace(page)
