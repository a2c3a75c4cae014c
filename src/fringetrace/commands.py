"""The commands on scene files: run one, or begin one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path


def run(scene: Path, /, *, out: Path | None = None, allow_outside: bool = False) -> Iterator[str]:
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
    from fringetrace import runs, scenes

    setup = scenes.load(scene, allow_outside=allow_outside)
    folder = Path(f"fringetrace-{scene.stem}") if out is None else out
    for what, text in runs.run(setup, folder):
        yield f"{what:<12} {text}"


def init(name: str, /) -> Iterator[str]:
    """Print a scene file to begin with, as it runs: `fringetrace init michelson > my.toml`.

    Parameters
    ----------
    name
        A bench, such as michelson; or free, for surfaces, beams and a CCD of your own.
    """
    from fringetrace import templates

    yield templates.template(name).rstrip()
