"""Run time beside raw embreex: ratios of medians, measured in one run.

    python benchmarks/tracing.py [--rays 1e6] [--json FILE] [--write]

`--write` puts the figures between the marks in README.md and docs/engine.md, all from this run.

Raw embreex is `EmbreeScene.run` on the float32 rays that the trace recorded, pass by pass, on all
triangles in one scene: no path, no point, no reflection, triangle numbers only. Ours gives, for the
same rays, path, optical path in float64 and position. A ratio of 1 is the speed of raw embreex.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import scenes
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

import fringetrace as ft

ROUNDS = 3
ROOT = Path(__file__).resolve().parents[1]


def seconds(work) -> float:
    """How long a call takes."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def raw(scene: ft.Scene, rays: scenes.Segments, centre_scale_mesh: tuple, chunk: int):
    """A call that runs recorded rays through embreex alone."""
    vertices, faces, _, _ = centre_scale_mesh
    embree = EmbreeScene(robust=True)
    TriangleMesh(embree, vertices, faces)
    embree.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def run() -> None:
        for origin, direction in rays:
            for i in range(0, len(origin), chunk):
                embree.run(origin[i : i + chunk], direction[i : i + chunk])

    return run


def compare(name: str, scene: ft.Scene, paths: ft.Paths, ours: dict) -> dict:
    """Medians of raw embreex (in chunks and at once) and of our calls, taken in turn."""
    mesh = scenes.joint(scene)
    rays = scenes.segments(paths, mesh[2], mesh[3])
    count = sum(len(origin) for origin, _ in rays)
    calls = {
        "raw, chunks": raw(scene, rays, mesh, 16384),
        "raw, at once": raw(scene, rays, mesh, 1 << 40),
        **ours,
    }
    for call in calls.values():
        call()
    times: dict = {label: [] for label in calls}
    for _ in range(ROUNDS):
        for label, call in calls.items():
            times[label].append(seconds(call))
    median = {label: statistics.median(values) for label, values in times.items()}
    base = min(median["raw, chunks"], median["raw, at once"])
    return {
        "scene": name,
        "segments": count,
        "rays": paths.source.shape[0] * paths.source.shape[1],
        "decided exactly, part": paths.doubtful / paths.segments,
        "raw ns/segment": base / count * 1e9,
        **{f"{label}: ratio to raw": base / median[label] for label in ours},
        **{f"{label}: seconds": median[label] for label in ours},
    }


def bouncing(make, side: int) -> dict:
    """12 bounces among mirrors, on one thread and on two."""
    scene, beam = make()
    beam = replace(beam, shape=(side, side))
    paths = ft.trace(scene, beam, record=True, warn=False)
    assert paths.ledger().error < 1e-12
    return compare(
        make.__name__,
        scene,
        paths,
        {
            "1 thread": lambda: ft.trace(scene, beam, threads=1, warn=False),
            "2 threads": lambda: ft.trace(scene, beam, threads=2, warn=False),
        },
    )


def matter(side: int) -> dict:
    """The same 12 bounces among mirrors, rods of glass (reflected light alone), and gold."""
    scene, beam = scenes.rods()
    mesh, beam = scene.surfaces[0].mesh, replace(beam, shape=(side, side))
    glass = ft.Scene([ft.Surface(mesh, ft.Dielectric("reflected"), "glass", back=1.5)])
    gold = ft.Scene([ft.Surface(mesh, ft.Metal(), "gold", back="gold")])
    polarised = replace(beam, polarisation=(1.0, 1j))
    paths = ft.trace(glass, beam, min_amplitude=0.0, record=True)
    assert paths.ledger().error < 1e-12

    def run(scene: ft.Scene, beam: ft.Beam):
        return lambda: ft.trace(scene, beam, wavelength=600e-9, min_amplitude=0.0, threads=1, warn=False)

    return compare(
        "matter",
        glass,
        paths,
        {
            "mirrors": run(scene, beam),
            "glass, scalar": run(glass, beam),
            "glass, polarised": run(glass, polarised),
            "gold, polarised": run(gold, polarised),
        },
    )


def interferogram(side: int) -> dict:
    """The Michelson, both arms, ray sum, one ray a pixel: trace and field."""
    bench = scenes.michelson(side)
    paths = ft.trace(bench.scene, bench.beam, bench.ccd, record=True)

    def image(threads: int):
        chunks = ft.stream(bench.scene, bench.beam, bench.ccd, threads=threads)
        return np.abs(ft.complex_field(chunks, 633e-9, "rays")) ** 2

    return compare(
        "michelson", bench.scene, paths, {"1 thread": lambda: image(1), "2 threads": lambda: image(2)}
    )


def start_up() -> dict:
    """Import beside what it rests on, and the demo the second time, each in a process of its own."""

    def fresh(*command: str) -> float:
        return seconds(lambda: subprocess.run(command, check=True, capture_output=True))

    code = {"import numpy, embreex": [], "import fringetrace": []}
    lines = {
        "import numpy, embreex": "import numpy, embreex, embreex.rtcore_scene",
        "import fringetrace": "import fringetrace",
    }
    for _ in range(2 * ROUNDS):
        for label, line in lines.items():
            code[label].append(fresh(sys.executable, "-c", line))
    median = {label: statistics.median(values) for label, values in code.items()}
    with tempfile.TemporaryDirectory() as folder:
        demo = [
            fresh(str(Path(sys.executable).with_name("fringetrace")), "demo", "--out", folder)
            for _ in range(3)
        ]
    return {
        **median,
        "import ratio": median["import fringetrace"] / median["import numpy, embreex"],
        "first demo, s": demo[0],
        "second demo, s": min(demo[1:]),
    }


MEMORY = """
import sys
from dataclasses import replace

import numpy as np
import scenes
import fringetrace as ft

def peak():
    # of this program alone: what getrusage gives is handed on by the one that started it
    return next(int(line.split()[1]) / 1024 for line in open("/proc/self/status") if line.startswith("VmHWM"))

bench = scenes.michelson(1024)

def image(side):
    beam = replace(bench.beam, shape=(side, side))
    return ft.complex_field(ft.stream(bench.scene, beam, bench.ccd), 633e-9, "rays")

image(256)
before = peak()
field = image(int(sys.argv[1]))
print(before, peak(), field.nbytes / 2**20)
"""


def memory(rays: float) -> dict:
    """Peak memory of a process that streams rays through the Michelson into a field, MiB."""
    side = int(np.ceil(np.sqrt(rays)))
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    done = subprocess.run(
        [sys.executable, "-c", MEMORY, str(side)], check=True, capture_output=True, text=True, env=environment
    )
    before, after, field = (float(word) for word in done.stdout.split())
    return {
        "rays": side**2,
        "peak, MiB": after,
        "of which the program and 65k rays, MiB": before,
        "of which the field, MiB": field,
    }


def counted(number: float) -> str:
    """A number of rays in words of the table."""
    return f"{number / 1e6:.3g}M" if number >= 1e6 else f"{number / 1e3:.3g}k"


def share(part: float) -> str:
    """A part as a percentage of two digits."""
    return f"{100 * part:.2g}"


def table(results: dict) -> str:
    """The figures of a whole run as rows of Markdown."""
    traced = [results[name] for name in ("rods", "corner_cube", "michelson")]
    rods, cube, michelson = (
        f"{one['1 thread: ratio to raw']:.2f} / {one['2 threads: ratio to raw']:.2f}" for one in traced
    )
    count, memory, matter = counted(traced[0]["rays"]), results["memory"], results["matter"]
    kinds = ("mirrors", "glass, scalar", "glass, polarised", "gold, polarised")
    costs = " / ".join(f"{1.0 / matter[f'{kind}: ratio to raw']:.2f}" for kind in kinds)
    rows = [
        (f"`benchmarks/tracing.py`, {os.cpu_count()} cores", ""),
        ("---", "---"),
        (
            f"first 12 bounces in a box of 80 rods, {count} rays, path, optical path and position out: speed "
            "beside raw embreex on the same rays, 1 / 2 threads",
            rods,
        ),
        ("the same in a corner cube of 1e7 wavelengths with two wedged plates, 22k triangles", cube),
        (
            f"Michelson, both arms, {count} rays onto as many pixels, ray sum: beside raw embreex on all its "
            "segments",
            michelson,
        ),
        (
            "cost of a bounce in that box, 1 thread, times raw embreex's: mirrors / glass (reflected light), "
            "a number a ray / the field as a vector / gold",
            costs,
        ),
        (
            "hits that float64 decides alone, in these three",
            ", ".join(f"{share(one['decided exactly, part'])} %" for one in traced),
        ),
        ("`import fringetrace` beside `import numpy, embreex`", f"{results['start']['import ratio']:.2f}"),
        ("a second `fringetrace demo`", f"{results['start']['second demo, s']:.1f} s"),
        (f"peak memory for {counted(memory['rays'])} rays into a field", f"{memory['peak, MiB']:.0f} MiB"),
    ]
    return "\n".join(f"| {' | '.join(row)} |".replace("  |", " |") for row in rows)


def doubts(results: dict) -> str:
    """The range of what is decided exactly, for a sentence."""
    parts = [results[name]["decided exactly, part"] for name in ("rods", "corner_cube", "michelson")]
    return f"{share(min(parts))} to {share(max(parts))} %"


def between(text: str, name: str, words: str) -> str:
    """A text with `words` between its marks called `name`."""
    begin, end = f"<!-- {name} -->", f"<!-- /{name} -->"
    if text.count(begin) != 1 or text.count(end) != 1:
        raise SystemExit(f"expected the marks {begin} and {end} once each")
    head, _, rest = text.partition(begin)
    return head + begin + words + end + rest.partition(end)[2]


def write(results: dict, root: Path) -> None:
    """Put the figures of a whole run into the README and the docs."""
    for place, name, words in (
        ("README.md", "tracing", f"\n{table(results)}\n"),
        ("docs/engine.md", "doubts", doubts(results)),
    ):
        path = root / place
        beside = path.with_name(path.name + ".new")
        beside.write_text(between(path.read_text(), name, words))
        beside.replace(path)


def main() -> None:
    """Run all, print all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rays", type=float, default=1e6, help="rays in each timed scene")
    parser.add_argument("--stream", type=float, default=1e7, help="rays of the memory test")
    parser.add_argument("--json", type=Path, help="file to write the figures to")
    parser.add_argument("--only", choices=["rods", "corner_cube", "michelson", "matter", "start", "memory"])
    parser.add_argument("--write", action="store_true", help="put the figures into README.md and docs")
    parser.add_argument("--root", type=Path, default=ROOT, help="folder of the README that is written to")
    chosen = parser.parse_args()
    if chosen.write and chosen.only:
        parser.error("--write: expected a run of all parts, got --only")
    side = round(np.sqrt(chosen.rays))
    parts = {
        "rods": lambda: bouncing(scenes.rods, side),
        "corner_cube": lambda: bouncing(scenes.corner_cube, side),
        "michelson": lambda: interferogram(side),
        "matter": lambda: matter(max(1, side // 2)),
        "start": start_up,
        "memory": lambda: memory(chosen.stream),
    }
    results = {}
    for name, part in parts.items():
        if chosen.only in (None, name):
            results[name] = part()
            print(f"\n{name}")
            for label, value in results[name].items():
                print(f"  {label:45s} {value if isinstance(value, (str, int)) else format(value, '.3f')}")
    if chosen.write:
        write(results, chosen.root)
    if chosen.json:
        chosen.json.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
