"""Commands for scene files: `run`, `init` and `view`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fringetrace.cli.brdf_commands import Lines
from fringetrace.core import parse_length

if TYPE_CHECKING:
    from fringetrace.scene import Scene
    from fringetrace.tracing import Paths


def run(scene: Path, /, *, out: Path | None = None, allow_outside: bool = False) -> Iterator[tuple[str, str]]:
    """Trace a scene file, and write the outputs that it asks for.

    Interferograms as PNG, 16-bit TIFF and NetCDF, the complex field, the paths, a picture of the scene; of
    benches phase-stepped frames and heights, too. Says what was traced, where the power went, the error
    budget, and whatever there is to warn of. No code runs from a scene file.

    Parameters
    ----------
    scene
        TOML file, see `fringetrace init`.
    out
        Folder to write to. Default: fringetrace-NAME, after the scene file, in this folder.
    allow_outside
        Let it name meshes and other files that are not in its own folder.
    """
    from fringetrace import scenefile
    from fringetrace.scenefile import run

    experiment = scenefile.load(scene, allow_outside=allow_outside)
    folder = Path(f"fringetrace-{scene.stem}") if out is None else out
    yield from run.run(experiment, folder)


def init(name: str, /) -> Iterator[tuple[str, str]]:
    """Print a template of a scene file: `fringetrace init michelson > my.toml`.

    Parameters
    ----------
    name
        A bench, such as michelson; or free, for surfaces, beams and a CCD of your own.
    """
    from fringetrace.scenefile import templates

    yield "", templates.template(name)


def view(
    scene: Path,
    /,
    *,
    png: Path | None = None,
    html: Path | None = None,
    export: Path | None = None,
    unit: str | None = None,
    wavelength: str | None = None,
    colour: str = "route",
    rays: int = 12,
    surfaces: str = "interface",
    allow_outside: bool = False,
) -> Lines:
    """View a scene file or a mesh in 3D: in a window, or as picture, HTML page or 3D file.

    Parameters
    ----------
    scene
        TOML file, see `fringetrace init`; or a mesh file, with --unit.
    png
        Picture to write.
    html
        Page for a browser to write; it needs neither network nor server (pip install 'fringetrace[html]').
    export
        Surfaces and rays for other programs: a .glb, .ply or .vtp file to write, in metres.
    unit
        Unit of the numbers in a mesh file: nm, um, mm, m, ...
    wavelength
        Of phases and of the image on the CCD. Default: the first of the scene file.
    colour
        Of rays: route, beam, bounce, length, phase, fate or power.
    rays
        Along the longer side of each beam.
    surfaces
        Coloured by interface, or by name.
    allow_outside
        Let a scene file name meshes and other files that are not in its own folder.
    """
    from fringetrace.views import viewer

    at = None if wavelength is None else parse_length(wavelength, "--wavelength")
    seen, paths, looks = _seen(scene, unit, at, rays, allow_outside)
    looks |= {"colour": colour, "surfaces": surfaces}
    if not (png or html or export):
        viewer.show(seen, paths, **looks)
        return []
    if png is not None:
        viewer.picture(seen, paths, png, **looks)
    if html is not None:
        viewer.page(seen, paths, html, title=scene.stem, **looks)
    if export is not None:
        viewer.export(seen, paths, export, **looks)
    count = f"{sum(map(len, paths)):,} path ends of {len(paths)} beams" if paths else "no rays"
    return [
        ("scene", f"{len(seen.surfaces)} surfaces, {count}"),
        ("written", ", ".join(str(path) for path in (png, html, export) if path is not None)),
    ]


def _seen(
    path: Path, unit: str | None, wavelength: float | None, rays: int, allow_outside: bool
) -> tuple[Scene, list[Paths], dict[str, Any]]:
    """What a file has to show: a scene, paths, and how these are drawn."""
    from fringetrace import scenefile
    from fringetrace.geometry import meshes
    from fringetrace.optics import Mirror
    from fringetrace.scene import Scene, Surface
    from fringetrace.scenefile import run

    if rays < 1:
        raise ValueError(f"--rays: expected at least 1, got {rays}")
    if path.suffix.lower() != ".toml":
        return Scene((Surface(meshes.load(path, unit=unit), Mirror(), path.stem),)), [], {}
    experiment = scenefile.load(path, allow_outside=allow_outside)
    if wavelength is None and experiment.wavelengths:
        wavelength = experiment.wavelengths[0]
    scene, paths, image, reference = run.scene_to_draw(experiment, wavelength, rays)
    # as many as were traced are drawn
    looks = {
        "wavelength": wavelength,
        "image": image,
        "reference": reference,
        "most": rays**2 * max(1, len(paths)),
    }
    return scene, paths, looks
