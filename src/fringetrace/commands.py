"""What the command does for structural colour and for scene files: files in, tables and figures out."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fringetrace.waves import FloatArray, degree, parse_angle, parse_length

if TYPE_CHECKING:
    from fringetrace.mesh import Mesh
    from fringetrace.paths import Paths
    from fringetrace.rods import Lattice
    from fringetrace.scene import Scene
    from fringetrace.tables import DataArray

# What there is to say, each under a word.
Lines = list[tuple[str, str]]
# Samples of a spectrum from 300 to 700 nm: one a nanometre.
WAVELENGTHS = ("300 nm", "700 nm", "401")
FILES = ("brdf.nc", "brdf.csv", "spectra.png")
LAYERS = "reflectance.csv"
MEASURED = "measured.png"
# Part of the largest extent up to which a part counts as flat.
FLAT = 1e-6


def brdf(
    mesh: Path,
    /,
    *,
    unit: str,
    out: Path | None = None,
    angles: tuple[str, str] = ("60 deg", "7"),
    wavelengths: tuple[str, str, str] = WAVELENGTHS,
    acceptance: str = "0.64 deg",
    rays: tuple[int, int] = (1, 2000),
    method: str = "rays",
    reflectance: float = 1.0,
    hemisphere: int = 0,
    feature: str | None = None,
    measured: Path | None = None,
    threads: int | None = None,
) -> Lines:
    """BRDF of a mesh of mirrors, its normal along z: spectra from each angle into each.

    Written to the folder OUT: brdf.nc (labelled, NetCDF), brdf.csv (a row for each pair of angles and
    wavelength), spectra.png.

    Parameters
    ----------
    mesh
        STL, PLY, OBJ or GLB file.
    unit
        Unit of the numbers in it: nm, um, mm, m, ...
    out
        Folder to write to. Default: fringetrace-brdf-NAME, in this folder.
    angles
        Largest angle in the x-z plane, of light and of observation, and how many from minus to plus.
    wavelengths
        First, last, how many.
    acceptance
        Half angle of the cone about each direction.
    rays
        Along y and along x. Rods along y need one along y.
    method
        rays, diffraction, or power (see `fringetrace.goniometer.brdf`).
    reflectance
        Of the mesh.
    hemisphere
        Observe the whole upper hemisphere instead: so many rings, four times as many sectors.
    feature
        Radius of the roundest small parts, to say what rays are worth. Default: half of the least extent
        of any connected part of the mesh.
    measured
        CSV file of measured reflectances, to be laid over the spectra towards the mirror's direction
        (measured.png); a column of wavelengths, then one a sample.
    threads
        Default: one for each core.
    """
    from fringetrace import goniometer, measurement, meshes
    from fringetrace.harmonics import CONDUCTOR
    from fringetrace.interfaces import Mirror
    from fringetrace.scene import Scene, Surface
    from fringetrace.validity import validity

    sample = meshes.load(mesh, unit=unit)
    radius = _extent(sample) / 2.0 if feature is None else parse_length(feature, "--feature")
    theta = _steps((f"-{angles[0]}", *angles), "--angles", parse_angle)
    detector: goniometer.Cells | goniometer.Cones = goniometer.Cones(
        theta, parse_angle(acceptance, "--acceptance")
    )
    if hemisphere:
        detector = goniometer.Cells(hemisphere, 4 * hemisphere)
    scene = Scene((Surface(sample, Mirror(reflectance), mesh.stem),))
    folder = Path(f"fringetrace-brdf-{mesh.stem}") if out is None else out
    with measurement.staged(folder) as part:
        table = goniometer.brdf(
            scene, theta, detector, _steps(wavelengths, "--wavelengths", parse_length), method=method,
            rays=rays, threads=threads,
        )  # fmt: skip
        worth = validity(radius, float(table.wavelength.max()), CONDUCTOR)
        table.attrs |= worth.attributes
        written = _write(table, part, measured)
    guess = "" if feature else f" (radius {radius:.3g} m estimated from the mesh's parts; --feature says it)"
    return [
        ("sample", f"{mesh.name}: {len(sample.faces):,} triangles"),
        *_powers(table),
        ("rays", f"{worth}{guess}"),
        ("written", f"{folder}: {', '.join(written)}"),
    ]


def lattice(
    *,
    out: Path = Path("fringetrace-lattice"),
    columns: tuple[int, ...] = (20,),
    rows: tuple[int, ...] = (4,),
    radius: tuple[str, ...] = ("65 nm",),
    pitch: tuple[str, ...] = ("280 nm",),
    arrangement: tuple[str, ...] = ("staggered",),
    disorder: tuple[float, ...] = (0.0,),
    seed: tuple[int, ...] = (0,),
    rod: str | None = None,
    host: str | None = None,
    cortex: str | None = None,
    channel: str | None = None,
    angles: tuple[str, str] = ("60 deg", "7"),
    wavelengths: tuple[str, str, str] = WAVELENGTHS,
    acceptance: str = "0.64 deg",
    rays: int = 2000,
    method: str = "rays",
    measured: Path | None = None,
    scheduler: str | None = None,
) -> Lines:
    """BRDF of lattices of rods, for every combination of the values given.

    What is done is kept in OUT/cells as it comes; the same command goes on where it was stopped.
    Written to the folder OUT: brdf.nc, brdf.csv, spectra.png.

    Parameters
    ----------
    out
        Folder to write to.
    columns, rows
        Of rods.
    radius, pitch
        Of rods, and from one to the next.
    arrangement
        square, staggered or hexagonal.
    disorder
        Root mean square of displacements, in pitches.
    seed
        Of the displacements.
    rod, host
        Index or material, such as melanin and keratin, of rods and of what is around them. Default: mirrors
        in a vacuum.
    cortex, channel
        Thickness of the host above the rods; radius of air channels amid them.
    angles, wavelengths, acceptance
        As in `fringetrace brdf`.
    method
        rays, diffraction or power, as in `fringetrace brdf`; rods: rigorous, light with its electric field
        along them; multilayer: specular reflectance of endless rows, as flat layers of effective index,
        beside the rigorous one, of one lattice: reflectance.csv alone.
    rays
        Across a lattice.
    measured
        CSV file of measured reflectances, as in `fringetrace brdf`.
    scheduler
        Address of a Dask scheduler. Default: this machine's cores.
    """
    from fringetrace import measurement, studies

    given: dict[str, Any] = {
        "columns": columns, "rows": rows, "radius": radius, "pitch": pitch, "arrangement": arrangement,
        "disorder": disorder, "seed": seed,
    }  # fmt: skip
    spoken = dict(given)
    for name in ("radius", "pitch"):
        given[name] = tuple(parse_length(value, f"--{name}") for value in given[name])
    matter = {
        "rod": _medium(rod), "host": _medium(host),
        "cortex": 0.0 if cortex is None else parse_length(cortex, "--cortex"),
        "channel": None if channel is None else parse_length(channel, "--channel"),
    }  # fmt: skip
    base = studies.Lattice(**{name: values[0] for name, values in given.items()}, **matter)
    axes = {name: values for name, values in given.items() if len(values) > 1}
    theta = _steps((f"-{angles[0]}", *angles), "--angles", parse_angle)
    waves = _steps(wavelengths, "--wavelengths", parse_length)
    if method == "multilayer":
        return _endless(base, axes, theta[theta >= 0.0], waves, out, measured)
    table = studies.study(
        base, axes, theta, theta, waves, rays=rays,
        half_angle=parse_angle(acceptance, "--acceptance"), method=method,
        folder=os.fspath(out / "cells"), scheduler=scheduler,
    )  # fmt: skip
    with measurement.staged(out) as part:
        written = _write(table, part, measured)
    count = int(np.prod([len(values) for values in axes.values()]))
    same = ", ".join(f"{name} {values[0]}" for name, values in spoken.items() if name not in axes)
    return [
        ("lattices", f"{count} of {', '.join(axes) or 'one kind'}; {same}"),
        *_powers(table),
        ("rays", f"at worst: {table.attrs['validity']}"),
        ("written", f"{out}: {', '.join(written)}"),
    ]


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
    from fringetrace import runs, scenes

    setup = scenes.load(scene, allow_outside=allow_outside)
    folder = Path(f"fringetrace-{scene.stem}") if out is None else out
    yield from runs.run(setup, folder)


def init(name: str, /) -> Iterator[tuple[str, str]]:
    """Print a scene file to begin with, as it runs: `fringetrace init michelson > my.toml`.

    Parameters
    ----------
    name
        A bench, such as michelson; or free, for surfaces, beams and a CCD of your own.
    """
    from fringetrace import templates

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
    """Look at a scene file, or at a mesh: in a window, or in files that say what they show.

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
    from fringetrace import exhibits

    at = None if wavelength is None else parse_length(wavelength, "--wavelength")
    seen, paths, looks = _seen(scene, unit, at, rays, allow_outside)
    looks |= {"colour": colour, "surfaces": surfaces}
    if not (png or html or export):
        exhibits.show(seen, paths, **looks)
        return []
    if png is not None:
        exhibits.picture(seen, paths, png, **looks)
    if html is not None:
        exhibits.page(seen, paths, html, title=scene.stem, **looks)
    if export is not None:
        exhibits.export(seen, paths, export, **looks)
    count = f"{sum(map(len, paths)):,} path ends of {len(paths)} beams" if paths else "no rays"
    return [
        ("scene", f"{len(seen.surfaces)} surfaces, {count}"),
        ("written", ", ".join(str(path) for path in (png, html, export) if path is not None)),
    ]


def _seen(
    path: Path, unit: str | None, wavelength: float | None, rays: int, allow_outside: bool
) -> tuple[Scene, list[Paths], dict[str, Any]]:
    """What a file has to show: a scene, paths, and how these are drawn."""
    from fringetrace import meshes, runs, scenes
    from fringetrace.interfaces import Mirror
    from fringetrace.scene import Scene, Surface

    if rays < 1:
        raise ValueError(f"--rays: expected at least 1, got {rays}")
    if path.suffix.lower() != ".toml":
        return Scene((Surface(meshes.load(path, unit=unit), Mirror(), path.stem),)), [], {}
    setup = scenes.load(path, allow_outside=allow_outside)
    if wavelength is None and setup.wavelengths:
        wavelength = setup.wavelengths[0]
    scene, paths, image, reference = runs.seen(setup, wavelength, rays)
    # as many as were traced are drawn
    looks = {
        "wavelength": wavelength,
        "image": image,
        "reference": reference,
        "most": rays**2 * max(1, len(paths)),
    }
    return scene, paths, looks


def _medium(text: str | None) -> Any:
    """A material's name, or an index; None for none."""
    try:
        return None if text is None else complex(text)
    except ValueError:
        return text


def _endless(
    base: Lattice,
    axes: dict[str, Any],
    theta: FloatArray,
    waves: FloatArray,
    out: Path,
    measured: Path | None,
) -> Lines:
    """Specular spectra of endless rows, layered and rigorous."""
    from fringetrace import measurement, studies, tables, views

    if axes:
        raise ValueError(f"--method multilayer: expected one lattice, got several of {', '.join(axes)}")
    methods = ("multilayer", "rods")
    both = [studies.specular(base, theta, waves, method=method) for method in methods]
    axes = {"method": (list(methods), ""), "theta_i": (theta, "rad"), "wavelength": (waves, "m")}
    table = tables.labelled([one.values for one in both], axes, name="reflectance", unit="1")
    with measurement.staged(out) as part:
        tables.write_rows(table, part / LAYERS)
        if measured is not None:
            first = table.isel(theta_i=0)
            title = f"light from {float(first.theta_i) / degree:.3g}°"
            ax = views.spectra(first, measured=tables.read_csv(measured), title=title)
            views.save(ax, part / MEASURED)
    top = [one.isel(one.argmax(...)) for one in both]
    said = (f"{float(one):.3g} at {float(one.wavelength) * 1e9:.4g} nm" for one in top)
    return [
        ("largest", "layers {}, rods {}".format(*said)),
        ("rays", str(both[0].attrs["validity"])),
        ("written", f"{out}: {LAYERS}" + (f", {MEASURED}" if measured else "")),
    ]


def _extent(mesh: Mesh) -> float:
    """Least extent along x, y or z of any connected part of a mesh that is not flat there, metres."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    count = len(mesh.vertices)
    ends = mesh.faces.ravel(), np.roll(mesh.faces, 1, axis=1).ravel()
    part = connected_components(coo_matrix((np.ones(len(ends[0])), ends), (count, count)), directed=False)[1]
    order = np.argsort(part, kind="stable")
    first = np.flatnonzero(np.diff(part[order], prepend=-1))
    reach = (f.reduceat(mesh.vertices[order], first) for f in (np.maximum, np.minimum))
    extent = np.subtract(*reach)
    return float(extent[extent > FLAT * extent.max()].min())


def _steps(given: tuple[str, str, str], what: str, parse: Any) -> FloatArray:
    """From first to last in equal steps."""
    first, last, count = given
    if not (count.isdigit() and int(count) > 0):
        raise ValueError(f"{what}: expected a whole number from 1, got {count!r}")
    return np.linspace(parse(first, what), parse(last, what), int(count))


def _write(table: DataArray, folder: Path, measured: Path | None) -> tuple[str, ...]:
    """brdf.nc, brdf.csv, spectra.png, and measured.png if there is something to lay over."""
    from fringetrace import tables, views

    overlaid = None if measured is None else tables.read_csv(measured)
    tables.write_netcdf(table, folder / "brdf.nc")
    tables.write_rows(table, folder / "brdf.csv")
    views.save(views.overview(table), folder / "spectra.png")
    if overlaid is None:
        return FILES
    views.save(views.mirror_spectra(table, overlaid), folder / MEASURED)
    return (*FILES, MEASURED)


def _powers(table: DataArray) -> Lines:
    """Where the power went at each incidence, and where the BRDF is largest."""
    shares = []
    for name in ("reflected", "transmitted", "missed", "absorbed", "truncated"):
        low, high = float(table[name].min()), float(table[name].max())
        if np.isnan(low):  # rigorous rods do not say
            continue
        shares.append(f"{name} {low:.2%}" + (f" to {high:.2%}" if high - low > 5e-5 else ""))
    top = table.isel(table.argmax(...))
    where = (
        f"{float(top):.4g} / sr at {float(top.wavelength) * 1e9:.4g} nm, "
        f"from {float(top.theta_i) / degree:.3g} to {float(top.theta_o) / degree:.3g} deg"
    )
    return [("power", ", ".join(shares) or "not told by this method"), ("largest", where)]
