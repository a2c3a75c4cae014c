"""Make the sample meshes of this folder again: ``python meshes/make.py [FOLDER]``."""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fringetrace import Mesh, mm, nm, um
from fringetrace.core.vectors import rotation
from fringetrace.geometry import meshes, shapes

ARCSEC = np.pi / 648000


def sphere_cap() -> Mesh:
    """Square piece, 8 mm wide, of a concave mirror of 1 m radius: 16 um deep in the corners."""
    pitch = 0.2 * mm
    along = (np.arange(41) - 20) * pitch
    squared = along**2 + along[:, None] ** 2
    # 1 - sqrt(1 - s) without its loss of digits
    return shapes.height_map(squared / (1.0 + np.sqrt(1.0 - squared)), pitch)


def gaussian_bump() -> Mesh:
    """A bump of 500 nm, sigma 60 um, in a field of 512 um."""
    pitch = 8 * um
    along = (np.arange(65) - 32) * pitch
    squared = along**2 + along[:, None] ** 2
    return shapes.height_map(500 * nm * np.exp(-squared / (2 * (60 * um) ** 2)), pitch)


def wedge() -> Mesh:
    """A plate of 10 mm by 10 mm by 1 mm whose lower face is tilted by 10 seconds of arc."""
    thin, thick = -1 * mm, -1 * mm - 10 * mm * np.tan(10 * ARCSEC)
    outline = [(-5 * mm, 0.0), (5 * mm, 0.0), (5 * mm, thick), (-5 * mm, thin)]
    return shapes.extrude(outline, 10 * mm, closed=True)


def samples() -> Iterator[tuple[str, Mesh, str]]:
    """File name, mesh, unit of the file."""
    yield "step.stl", shapes.step(10 * mm, 10 * mm, edge=1 * mm, rise=100 * nm), "mm"
    yield "plate_tilted.ply", shapes.plate(10 * mm, 10 * mm).moved(turn=rotation([0, 1, 0], -0.5e-3)), "mm"
    yield "sphere_cap.stl", sphere_cap(), "mm"
    yield "gaussian_bump.ply", gaussian_bump(), "um"
    yield "staircase.glb", shapes.staircase(1 * mm, 1 * mm, treads=5, rise=79.1 * nm), "um"
    yield "wedge.stl", wedge(), "mm"
    yield "corner_cube.obj", shapes.corner_cube(10 * mm, subdivisions=4), "mm"
    yield "rods_20x4.ply", shapes.rod_lattice(20, 4, 65 * nm, 280 * nm, 5.6 * um), "um"


def main(folder: Path) -> None:
    """Write all of them into a folder."""
    for name, mesh, unit in samples():
        meshes.save(mesh, folder / name, unit)
        print(f"{name}: {len(mesh.faces)} triangles, in {unit}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
