"""Scenes at random against an oracle that shares no code with the engine.

    python benchmarks/random_scenes.py [--scenes 2000] [--rays 1000] [--first 0]

Faces that touch, nest, overlap, nearly touch, of any size and place, seen from near and far; see
`tests/random_scenes.py`. Prints every fault, and how many scenes of each kind have some.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))


def main() -> None:
    """Try all, print what is wrong; the exit code is 1 if something is."""
    from random_scenes import KINDS, tried

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=2000)
    parser.add_argument("--rays", type=int, default=1000, help="in each scene")
    parser.add_argument("--first", type=int, default=0, help="seed of the first scene")
    chosen = parser.parse_args()
    kinds, wrong = list(KINDS), Counter()
    for seed in range(chosen.first, chosen.first + chosen.scenes):
        faults = tried(seed, chosen.rays)[2]
        wrong[kinds[seed % len(kinds)]] += bool(faults)
        for fault in faults:
            print(fault, flush=True)
    for kind in kinds:
        print(f"{kind:20s} {wrong[kind]} with faults")
    sys.exit(bool(sum(wrong.values())))


if __name__ == "__main__":
    main()
