"""Run time against error, as `fringetrace bench` has it.

python benchmarks/precision.py [--quick]   print the table
python benchmarks/precision.py --write     and write its section of docs/accuracy.md, with the picture
"""

from __future__ import annotations

import sys

import pages

from fringetrace import views
from fringetrace.validation import work_precision

PICTURE = "images/work_precision.png"

SECTION = """## Run time against error

What a method needs for how small an error, on scenes whose field on every pixel is known in closed
form: made by `benchmarks/precision.py --write`, on your machine by `fringetrace bench`.

- Phase error: of the mean field of each pixel, absolute, in waves of 632.8 nm, rms over the pixels, each
  weighted with its irradiance.
- Irradiance error: rms over the pixels, relative to the mean. The ray sum squares the mean field, which is
  less where phases differ within a pixel; and it adds fields by beam area, so that light concentrated g
  times comes out as g squared (the paraboloid 2.8, the sphere 0.5).
- Seconds: trace and field, on {cores} cores.
- "float32" adds up paths in single precision, with Embree's distances, and sums rays.
- "facets" are the mesh as it is, "form" is the surface that it stands for. The wavefront method's meshes
  grow with its rays where facets stand for a curved surface: each facet is a plane mirror to it.

The most exact run of each:

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
