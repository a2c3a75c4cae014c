"""Commands for structural colour: `brdf` of a mesh, `lattice` for rod lattices."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fringetrace.core import FloatArray, FringetraceWarning, degree, parse_angle, parse_length, staged

if TYPE_CHECKING:
    from xarray import DataArray

    from fringetrace.geometry import Mesh
    from fringetrace.optics import PolarisationName
    from fringetrace.scattering import Detector, RodLattice
    from fringetrace.scene import Scene

# What there is to say, each under a word.
Lines = list[tuple[str, str]]
# Samples of a spectrum from 300 to 700 nm: one a nanometre.
WAVELENGTHS = ("300 nm", "700 nm", "401")
FILES = ("brdf.nc", "brdf.csv", "spectra.png")
LAYERS, OVER = "reflectance.csv", "measured.png"
# Least amplitudes of branches: of rays that split at each boundary, and of others.
SPLIT, FAINT = 1e-3, 1e-6


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
    material: str | None = None,
    around: str | None = None,
    polarisation: str | None = None,
    hemisphere: int = 0,
    feature: str | None = None,
    measured: Path | None = None,
    threads: int | None = None,
) -> Lines:
    """BRDF of a mesh of mirrors or matter, its normal along z: spectra between all pairs of angles.

    Written to the folder OUT: brdf.nc (labelled, NetCDF), brdf.csv (a row for each pair of angles and
    wavelength), spectra.png; measured.png, if spectra are to be laid over.

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
        rays, diffraction, or power (see `fringetrace.scattering.brdf`).
    reflectance
        Of mirrors.
    material
        Index or material, such as melanin, of what the mesh encloses. Default: mirrors.
    around
        Of what is around it, such as keratin. Default: a vacuum.
    polarisation
        s, p or unpolarised (see `fringetrace.scattering.brdf`). Default: light of one number a ray.
    hemisphere
        Observe the whole upper hemisphere instead: so many rings, four times as many sectors.
    feature
        Radius of the roundest small parts, to say what rays are worth. Default: half the breadth of the
        smallest connected part of the mesh.
    measured
        CSV file of measured reflectances, of the form that pavo writes, see `fringetrace.tables.read_csv`.
    threads
        Default: one for each core.
    """
    from fringetrace import scattering
    from fringetrace.geometry import meshes
    from fringetrace.rigorous import CONDUCTOR, validity

    sample = meshes.load(mesh, unit=unit)
    radius = None if feature is None else parse_length(feature, "--feature")
    theta = _steps((f"-{angles[0]}", *angles), "--angles", parse_angle)
    detector: scattering.Cells | scattering.Cones = scattering.Cones(
        theta, parse_angle(acceptance, "--acceptance")
    )
    if hemisphere:
        detector = scattering.Cells(hemisphere, 4 * hemisphere)
    over = _measured(measured)
    scene = _scene(sample, reflectance, _medium(material), _medium(around))
    folder = Path(f"fringetrace-brdf-{mesh.stem}") if out is None else out
    with staged(folder) as part:
        options: dict[str, Any] = {
            "method": method, "rays": rays, "polarisation": polarisation, "threads": threads,
            "min_amplitude": SPLIT if scene.surfaces[0].boundary else FAINT,
        }  # fmt: skip
        with warnings.catch_warnings(record=True) as given:  # they are said as notes
            warnings.simplefilter("always", FringetraceWarning)
            table = scattering.brdf(
                scene, theta, detector, _steps(wavelengths, "--wavelengths", parse_length), **options
            )
        if radius is not None:
            table.attrs |= validity(radius, float(table.wavelength.max()), CONDUCTOR).attributes
        files = _write(table, part, over)
    guess = "" if feature else " (of the mesh's smallest part; --feature says it)"
    return [
        ("sample", f"{mesh.name}: {len(sample.faces):,} triangles"),
        *_powers(table),
        _budget(table, scene, detector, options),
        *(("note", str(one.message)) for one in given),
        ("rays", f"{table.attrs['validity']}{guess}"),
        ("written", f"{folder}: {', '.join(files)}"),
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
    polarisation: Literal["s", "p", "unpolarised"] | None = None,
    measured: Path | None = None,
    scheduler: str | None = None,
) -> Lines:
    """BRDF of rod lattices, for every combination of the given values.

    What is done is kept in OUT/cells as it comes; the same command goes on where it was stopped.
    Written to the folder OUT: brdf.nc, brdf.csv, spectra.png.

    Parameters
    ----------
    out
        Folder to write to.
    columns
        Rods in a row.
    rows
        Of rods.
    radius
        Of rods.
    pitch
        From one rod to the next.
    arrangement
        square, staggered or hexagonal.
    disorder
        Root mean square of displacements, in pitches.
    seed
        Of the displacements.
    rod
        Index or material, such as melanin, of rods. Default: mirrors.
    host
        Index or material, such as keratin, of what is around them. Default: a vacuum.
    cortex
        Thickness of the host above the rods.
    channel
        Radius of air channels amid the rods.
    angles
        As in `fringetrace brdf`.
    wavelengths
        First, last, how many.
    acceptance
        Half angle of the cone about each direction.
    method
        rays, diffraction or power, as in `fringetrace brdf`; rods: rigorous; multilayer: specular
        reflectance of endless rows, as flat layers of effective index, beside the rigorous one, of one
        lattice: reflectance.csv alone.
    polarisation
        s (the field along the rods), p or unpolarised. Default: s; of multilayer: unpolarised.
    measured
        As in `fringetrace brdf`.
    rays
        Across a lattice.
    scheduler
        Address of a Dask scheduler. Default: this machine's cores.
    """
    from fringetrace import scattering

    given: dict[str, Any] = {
        "columns": columns, "rows": rows, "radius": radius, "pitch": pitch, "arrangement": arrangement,
        "disorder": disorder, "seed": seed,
    }  # fmt: skip
    matter: dict[str, Any] = {"rod": rod, "host": host, "cortex": cortex, "channel": channel}
    base, axes = _lattices(given, matter)
    theta = _steps((f"-{angles[0]}", *angles), "--angles", parse_angle)
    waves = _steps(wavelengths, "--wavelengths", parse_length)
    over = _measured(measured)
    if method == "multilayer":
        return _endless(base, axes, (theta[theta >= 0.0], waves), polarisation or "unpolarised", over, out)
    options: dict[str, Any] = {
        "rays": rays, "half_angle": parse_angle(acceptance, "--acceptance"), "method": method,
        "polarisation": polarisation or "s",
    }  # fmt: skip
    table = scattering.study(
        base, axes, theta, theta, waves, folder=os.fspath(out / "cells"), scheduler=scheduler, **options
    )
    with staged(out) as part:
        files = _write(table, part, over)
    count = int(np.prod([len(values) for values in axes.values()]))
    named = [f"{name} {values[0]}" for name, values in given.items() if name not in axes]
    named += [f"{name} {value}" for name, value in matter.items() if value]
    return [
        ("lattices", f"{count}{' of ' if axes else ''}{', '.join(axes)}; {', '.join(named)}"),
        *_powers(table),
        *_first(base, table, axes, theta, options),
        ("rays", f"at worst: {table.attrs['validity']}"),
        ("written", f"{out}: {', '.join(files)}"),
    ]


def _medium(text: str | None) -> Any:
    """A material's name, or an index; None for none."""
    try:
        return None if text is None else complex(text)
    except ValueError:
        return text


def _lattices(given: dict[str, Any], matter: dict[str, Any]) -> tuple[RodLattice, dict[str, Any]]:
    """The first lattice, and the values of what has several."""
    from fringetrace.scattering import RodLattice

    lengths = {"radius", "pitch"}
    values: dict[str, Any] = {
        name: tuple(parse_length(one, f"--{name}") for one in some) if name in lengths else some
        for name, some in given.items()
    }
    cortex, channel = matter["cortex"], matter["channel"]
    base = RodLattice(
        **{name: some[0] for name, some in values.items()}, rod=_medium(matter["rod"]),
        host=_medium(matter["host"]), cortex=0.0 if cortex is None else parse_length(cortex, "--cortex"),
        channel=None if channel is None else parse_length(channel, "--channel"),
    )  # fmt: skip
    return base, {name: some for name, some in values.items() if len(some) > 1}


def _endless(
    base: RodLattice, axes: dict[str, Any], along: tuple[FloatArray, FloatArray],
    polarisation: PolarisationName, over: DataArray | None, out: Path,
) -> Lines:  # fmt: skip
    """Specular spectra of endless rows, layered and rigorous."""
    from fringetrace import scattering, views
    from fringetrace.core import tables

    if axes:
        raise ValueError(f"--method multilayer: expected one lattice, got several of {', '.join(axes)}")
    (theta, waves), methods, files = along, ("multilayer", "rods"), [LAYERS]
    both = [scattering.specular(base, *along, method=method, polarisation=polarisation) for method in methods]
    axes = {"method": (list(methods), ""), "theta_i": (theta, "rad"), "wavelength": (waves, "m")}
    table = tables.labelled([one.values for one in both], axes, name="reflectance", unit="1")
    with staged(out) as part:
        tables.write_rows(table, part / LAYERS)
        if over is not None:
            first = table.isel(theta_i=0)
            title = f"light from {float(first.theta_i) / degree:.3g}°"
            views.save(views.spectra(first, measured=over, title=title), part / OVER)
            files.append(OVER)
    top = [one.isel(one.argmax(...)) for one in both]
    said = (f"{float(one):.3g} at {float(one.wavelength) * 1e9:.4g} nm" for one in top)
    return [
        ("largest", "layers {}, rods {}".format(*said)),
        ("rays", str(both[0].attrs["validity"])),
        ("written", f"{out}: {', '.join(files)}"),
    ]


def _steps(given: tuple[str, str, str], what: str, parse: Any) -> FloatArray:
    """From first to last in equal steps."""
    first, last, count = given
    if not (count.isdigit() and int(count) > 0):
        raise ValueError(f"{what}: expected a whole number from 1, got {count!r}")
    return np.linspace(parse(first, what), parse(last, what), int(count))


def _scene(sample: Mesh, reflectance: float, material: Any, around: Any) -> Scene:
    """A mesh of mirrors, or of matter."""
    from fringetrace.optics import Dielectric, Mirror
    from fringetrace.scene import Scene, Surface

    if material is None:
        return Scene((Surface(sample, Mirror(reflectance), sample.name),), medium=around)
    return Scene((Surface(sample, Dielectric(), sample.name, back=material),), medium=around)


def _measured(file: Path | None) -> DataArray | None:
    """Measured spectra, or none."""
    from fringetrace.core import tables

    return None if file is None else tables.read_csv(file)


def _write(table: DataArray, folder: Path, over: DataArray | None) -> list[str]:
    """brdf.nc, brdf.csv, spectra.png, and measured.png where there are measured spectra: what was written."""
    from fringetrace import views
    from fringetrace.core import tables

    tables.write_netcdf(table, folder / "brdf.nc")
    tables.write_rows(table, folder / "brdf.csv")
    views.save(views.overview(table), folder / "spectra.png")
    if over is None:
        return [*FILES]
    views.save(views.mirror_spectra(table, over), folder / OVER)
    return [*FILES, OVER]


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


def _budget(table: DataArray, scene: Scene, detector: Detector, options: dict[str, Any]) -> tuple[str, str]:
    """What rounding and the number of rays cost a BRDF; facets are the sample."""
    from fringetrace import scattering

    shortest, theta = float(table.wavelength.min()), float(table.theta_i[len(table.theta_i) // 2])
    hit = scattering.rounding_error(scene, theta, shortest, **options)
    sampling = scattering.brdf_sampling_error(table, scene, detector, **options)
    return "budget", f"hit {hit:.1e} waves rms; half the rays change the BRDF by {sampling:.1%} rms"


def _first(
    base: RodLattice, table: DataArray, axes: dict[str, Any], theta: FloatArray, options: dict[str, Any]
) -> Lines:
    """The budget of the first of some lattices, unless it was found without rays."""
    from fringetrace import scattering
    from fringetrace.scattering import rod_studies

    if options["method"] == "rods":
        return []
    given = {
        "method": options["method"], "rays": (1, options["rays"]), "max_bounces": rod_studies.BOUNCES,
        "min_amplitude": rod_studies.FAINT, "polarisation": rod_studies.TRACED[options["polarisation"]],
        **base.lighting,
    }  # fmt: skip
    one = table.isel(dict.fromkeys(axes, 0))
    name, text = _budget(one, base.scene, scattering.Cones(theta, options["half_angle"]), given)
    return [(name, f"of the first: {text}" if axes else text)]
