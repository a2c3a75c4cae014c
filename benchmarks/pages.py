"""Sections of a page between markers, so that several scripts can each write their own."""

from __future__ import annotations

from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"
ACCURACY, BUDGET = DOCS / "accuracy.md", DOCS / "budget.md"


def write(name: str, text: str, page: Path = ACCURACY) -> None:
    """Put a text between the markers of a section; a page without them gets them at its end."""
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    old = page.read_text(encoding="utf-8")
    if begin not in old:
        old = f"{old.rstrip()}\n\n{begin}\n{end}\n"
    before, rest = old.split(begin)
    _, after = rest.split(end)
    beside = page.with_suffix(".part")
    beside.write_text(f"{before}{begin}\n\n{text.strip()}\n\n{end}{after}", encoding="utf-8")
    beside.replace(page)
