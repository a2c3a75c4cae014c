"""Make all figures of README and docs: every script that times, and every script that draws or tabulates.

python benchmarks/all.py --list                 name the parts
python benchmarks/all.py --write                make what was not made yet from the sources as they are
python benchmarks/all.py --write skips budget   make these parts, made before or not

What is done is kept in build/figures.json, with a digest of the sources: a run that was stopped goes on
where it stopped, a part at a time. Timed parts run alone; keep the machine quiet.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
DONE = ROOT / "build" / "figures.json"
# Scripts that time, and scripts that make tables or pictures; those that write in any case take no --write.
TIMED = ("tracing", "once", "scaling", "skips", "wavefront", "precision", "goniometer", "lenses")
MADE = (
    "stability", "budget", "shadowing", "benches", "rigorous", "study", "feathers", "colours", "verification",
)  # fmt: skip
DRAWN = ("how", "architecture", "views", "materials")


def parts() -> dict[str, list[str]]:
    """Command of each part, by its name."""
    scripts = [("benchmarks", name, ["--write"]) for name in TIMED]
    scripts += [("docs/figures", name, ["--write"]) for name in MADE]
    scripts += [("docs/figures", name, []) for name in DRAWN]
    there = [(f"{folder}/{name}.py", name, more) for folder, name, more in scripts]
    return {name: [sys.executable, script, *more] for script, name, more in there if (ROOT / script).exists()}


def digest() -> str:
    """Digest of all sources that figures depend on."""
    whole = hashlib.sha256()
    for folder in ("src", "benchmarks", "docs/figures", "tests/physics"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            whole.update(path.read_bytes())
    return whole.hexdigest()[:16]


def kept() -> dict[str, str]:
    """Which digest each part was last made from."""
    return json.loads(DONE.read_text(encoding="utf-8")) if DONE.exists() else {}


def make(name: str, command: list[str], now: str) -> bool:
    """Run a part; whether it went well."""
    start = time.perf_counter()
    print(f"{name}: {' '.join(command[1:])}", flush=True)
    well = subprocess.run(command, cwd=ROOT, check=False).returncode == 0
    print(f"{name}: {'done' if well else 'FAILED'} in {time.perf_counter() - start:.0f} s", flush=True)
    if well:
        DONE.parent.mkdir(exist_ok=True)
        beside = DONE.with_suffix(".part")
        beside.write_text(json.dumps(kept() | {name: now}, indent=1) + "\n", encoding="utf-8")
        beside.replace(DONE)
    return well


def main() -> int:
    """Make the parts that are asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", choices=[*parts(), []], metavar="PART", default=[])
    parser.add_argument("--list", action="store_true", help="name the parts, and which of them are done")
    parser.add_argument("--write", action="store_true", help="make them, and write them into README and docs")
    chosen = parser.parse_args()
    if unknown := set(chosen.parts) - set(parts()):
        parser.error(f"expected names of --list, got {', '.join(sorted(unknown))}")
    now, done = digest(), kept()
    if chosen.list or not chosen.write:
        for name, command in parts().items():
            print(f"{name:14} {'done' if done.get(name) == now else '-':5} {' '.join(command[1:])}")
        return 0
    wanted = chosen.parts or [name for name in parts() if done.get(name) != now]
    failed = [name for name in wanted if not make(name, parts()[name], now)]
    if failed:
        print(f"failed: {', '.join(failed)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
