"""Run time against error, as `fringetrace bench` has it.

python benchmarks/precision.py [--quick]   print the table
python benchmarks/precision.py --write     and write its section of docs/accuracy.md, with the picture
"""

from __future__ import annotations

import sys
from pathlib import Path

from fringetrace import views
from fringetrace.validation import work_precision

sys.path.insert(0, str(Path(__file__).parents[1] / "docs" / "figures"))
import pages

PICTURE = "images/work_precision.png"

SECTION = """## Run time against error

The table shows the run time that each method needs for a given error, on scenes with closed-form fields.
`benchmarks/precision.py --write` made it; `fringetrace bench` makes it on your machine.

- Phase error: rms over the pixels of the phase error of the mean field, absolute, in waves of 632.8 nm,
  weighted with the irradiance.
- Irradiance error: rms over the pixels, relative to the mean. The ray sum squares the mean field, which is
  too small where phases differ within a pixel. It also adds fields by beam area, so that light concentrated g
  times counts as g squared (the paraboloid 2.8, the sphere 0.5).
- Seconds: trace and field, on {cores} cores.
- "float32" sums path lengths in single precision, with Embree's distances, and sums rays.
- "facets" uses the mesh as it is, "form" the surface behind it. Where facets approximate a curved
  surface, the meshes of the wavefront method grow with its rays: to it, each facet is a plane mirror.

The most accurate run of each method:

{table}

![Phase error against seconds and against rays, a pair of axes for each scene]({picture})
"""


def main() -> None:
    """Print the table; write the section if asked to."""
    done = []
    for run in work_precision.runs(quick="--quick" in sys.argv[1:]):
        done.append(run)
        print(
            f"{run.standard:32}{run.method:20}{run.rays:9d}{run.seconds:10.4f} s"
            f"{run.waves:10.1e} waves{run.irradiance:10.1e}",
            flush=True,
        )
    table = work_precision.markdown_table(done)
    print(table)
    if "--write" in sys.argv[1:]:
        views.save(views.comparison(work_precision.panels(done)), pages.ACCURACY.parent / PICTURE)
        text = SECTION.format(cores=work_precision.machine()["cores"], table=table, picture=PICTURE)
        pages.write("precision", text)


if __name__ == "__main__":
    main()
