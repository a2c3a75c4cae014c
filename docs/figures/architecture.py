"""Figure of docs/architecture.md: its three chains of functions, drawn from the page's own tables.

python docs/figures/architecture.py   writes docs/images/architecture.png
"""

from __future__ import annotations

import re
import textwrap
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

DOCS = Path(__file__).parents[1]
CHAIN = re.compile(r"^## (One .*?)\n(.*?)(?=^## )", flags=re.DOTALL | re.MULTILINE)
STEP = re.compile(r"^\| ([^|]+) \| `([\w/]+)/(\w+\.py: [\w.]+)` \|$", flags=re.MULTILINE)
LINE = 34  # characters of a box's text on a line
WIDTH, HEIGHT, STRIDE = 0.94, 0.84, 1.0  # of a box, and from box to box; columns are 1 wide
COLOURS = {
    "geometry": "#E69F00", "scene": "#CC79A7", "instruments": "#7A5195", "tracing": "#0072B2",
    "field": "#009E73", "phase": "#D55E00", "scattering": "#A6761D", "views": "#666666",
}  # fmt: skip


def chains(page: str) -> list[tuple[str, list[tuple[str, str, str]]]]:
    """Title and steps (result, folder, function) of each chain on the page."""
    return [(title, STEP.findall(text)) for title, text in CHAIN.findall(page)]


def box(axes: Any, column: int, row: int, step: tuple[str, str, str]) -> None:
    """Draw one step: its result above the function that gives it, in the colour of the function's folder."""
    result, folder, function = step
    colour = COLOURS[folder.split("/")[0]]
    x, y = column + 0.5, -row * STRIDE
    style = "round,pad=0,rounding_size=0.03"
    corner = (x - WIDTH / 2, y - HEIGHT / 2)
    axes.add_patch(FancyBboxPatch(corner, WIDTH, HEIGHT, style, facecolor="white", edgecolor=colour, lw=1.4))
    axes.text(x, y + 0.18, textwrap.fill(result, LINE), ha="center", va="center", fontsize=9.5)
    name = f"{folder}/{function}".replace(": ", ":\n")
    axes.text(x, y - 0.23, name, ha="center", va="center", fontsize=8.5, family="monospace", color=colour)


def draw(axes: Any, page: str) -> int:
    """Draw all chains side by side; the number of rows that they take."""
    found = chains(page)
    for column, (title, steps) in enumerate(found):
        axes.text(column + 0.5, 0.75, title, ha="center", fontsize=11, weight="bold")
        for row, step in enumerate(steps):
            box(axes, column, row, step)
            if row:
                ends = {"xytext": (column + 0.5, HEIGHT / 2 - row * STRIDE + STRIDE - HEIGHT)}
                arrow = {"arrowstyle": "-|>", "color": "black", "shrinkA": 0, "shrinkB": 0}
                axes.annotate("", (column + 0.5, HEIGHT / 2 - row * STRIDE), arrowprops=arrow, **ends)
    rows = max(len(steps) for _, steps in found)
    axes.set(xlim=(0, len(found)), ylim=(0.5 - rows * STRIDE, 1.1))
    axes.axis("off")
    return rows


if __name__ == "__main__":
    page = (DOCS / "architecture.md").read_text(encoding="utf-8")
    figure = Figure(figsize=(9, 12.5), layout="constrained")
    draw(figure.subplots(), page)
    part = DOCS / "images" / "architecture.png.part"
    figure.savefig(part, format="png", dpi=110)
    part.replace(DOCS / "images" / "architecture.png")
