"""Time and memory of an interferogram over the number of triangles: a coin with a rim and a star.

Each size runs in a process of its own, through the parts of `fringetrace interferogram`: load, trace,
waves off facets, frames, budget. Seconds are those of the processor, of all threads.

    python benchmarks/scaling.py [--most 2000000] [--write]
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

HENE = 632.8e-9
SIZES = (10, 30, 100, 300, 1129, 2523)
DOCS = Path(__file__).parent.parent / "docs"


def coin(count: int, relief: float = 1e-6, width: float = 12e-3) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a disc with a raised rim, and a star with sloping flanks, on a square grid."""
    at = np.linspace(-0.5 * width, 0.5 * width, count)
    x, y = np.meshgrid(at, at)
    radius, part = np.hypot(x, y), np.arctan2(y, x) / (2.0 * np.pi / 5.0) + 0.5
    edge = (0.7 - 0.84 * np.abs(part % 1.0 - 0.5)) * 0.5 * width
    star = 0.8 * np.clip((edge - radius) / (0.125 * width), 0.0, 1.0)
    z = relief * np.where(radius > 0.44 * width, 1.0, star)
    middle = 0.5 * (at[1:] + at[:-1])
    row, column = np.nonzero(np.hypot(middle[None, :], middle[:, None]) < 0.5 * width)
    first = row * count + column
    quad = np.stack([first, first + 1, first + count + 1, first + count], axis=1)
    faces = np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), faces


def measured(path: str) -> dict[str, float]:
    """Seconds of each part of the work on a file, and its memory, in this process."""
    import fringetrace as ft
    from fringetrace.cli import command

    laps: dict[str, float] = {}
    start = time.process_time()

    def lap(what: str) -> None:
        nonlocal start
        laps[what], start = time.process_time() - start, time.process_time()

    mesh = ft.meshes.load(path, unit="mm")
    bench, _ = command._bench(mesh, None, HENE, command.Settings())
    lap("load")
    paths = bench.trace()
    lap("trace")
    ft.field.reconstruct_facet_waves(paths)
    lap("waves")
    bench.phase_steps(HENE)
    lap("frames")
    bench.budget(HENE)
    lap("budget")
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return {"triangles": len(mesh.faces), **laps, "memory": memory}


def apart(count: int, folder: str) -> dict[str, float]:
    """`measured` for a size, in a process of its own."""
    import trimesh

    path = Path(folder) / "coin.stl"
    vertices, faces = coin(count)
    trimesh.Trimesh(1e3 * vertices, faces, process=False).export(path)
    command = [sys.executable, __file__, "--one", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def table(rows: list[dict[str, float]]) -> str:
    """The rows as a table in Markdown."""
    names = ["load", "trace", "waves", "frames", "budget"]
    lines = ["| triangles | " + " | ".join(f"{n}, s" for n in names) + " | all, s | memory, GB |"]
    lines.append("|---:" * (len(names) + 3) + "|")
    for row in rows:
        times = [row[name] for name in names]
        cells = [f"{row['triangles']:,.0f}", *(f"{t:.2f}" for t in times), f"{sum(times):.1f}"]
        lines.append("| " + " | ".join([*cells, f"{row['memory']:.2f}"]) + " |")
    return "\n".join(lines)


def plot(rows: list[dict[str, float]], path: Path) -> None:
    """Seconds over triangles, each part a line, beside n log n."""
    import matplotlib.pyplot as plt

    count = np.array([row["triangles"] for row in rows])
    figure, axes = plt.subplots(figsize=(6.0, 4.0), layout="constrained")
    for name in ("load", "trace", "waves", "frames", "budget"):
        axes.loglog(count, [row[name] for row in rows], "o-", label=name)
    rise = count * np.log(count)
    axes.loglog(count, rows[-1]["waves"] * rise / rise[-1], "k:", label="n log n")
    axes.set(xlabel="triangles", ylabel="seconds of a core", title="A relief on 512 x 512 pixels")
    axes.legend()
    figure.savefig(path, dpi=150)


def main() -> None:
    """Run all sizes, print the table, write it into the docs if asked to."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--most", type=float, default=2.1e6, help="triangles, at most")
    options.add_argument("--write", action="store_true", help="put table and plot into the docs")
    options.add_argument("--one", help=argparse.SUPPRESS)
    given = options.parse_args()
    if given.one:
        print(json.dumps(measured(given.one)))
        return
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        apart(SIZES[0], folder)  # compiles
        for count in SIZES:
            if 0.5 * np.pi * count**2 <= given.most:
                rows.append(apart(count, folder))
                print(table(rows[-1:]).splitlines()[-1], flush=True)
    print(table(rows))
    if given.write:
        sys.path.insert(0, str(DOCS / "figures"))
        import pages

        pages.write("scaling", table(rows), DOCS / "wavefront.md")
        plot(rows, DOCS / "images" / "scaling.png")


if __name__ == "__main__":
    main()
