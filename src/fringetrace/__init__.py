"""Triangle meshes to full-field interferograms, with a phase you can trust.

>>> import fringetrace as ft
>>> from fringetrace import mm, nm
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from fringetrace.bounds import Bounds, bounds
from fringetrace.budget import Budget, budget
from fringetrace.field import complex_field, irradiance, mutual_intensity
from fringetrace.interfaces import Absorber, BeamSplitter, Dielectric, Metal, Mirror
from fringetrace.mesh import Mesh
from fringetrace.paths import Fate, Ledger, Paths
from fringetrace.rays import Rays
from fringetrace.scene import CCD, Beam, Gaussian, Scene, Surface
from fringetrace.trace import stream, trace
from fringetrace.validity import Validity, validity
from fringetrace.waves import degree, mm, nm, um

if TYPE_CHECKING:
    __version__: str
    from fringetrace import (
        bsdf,
        crystals,
        cylinders,
        elements,
        films,
        forms,
        frames,
        goniometer,
        gratings,
        instruments,
        lattices,
        lenses,
        materials,
        meshes,
        phase,
        plates,
        polarisers,
        records,
        scenes,
        shapes,
        spectra,
        spheres,
        studies,
        swatches,
        sweeps,
        tables,
        vectors,
        views,
    )
    from fringetrace.guards import FringetraceWarning

__all__ = [
    "CCD",
    "Absorber",
    "Beam",
    "BeamSplitter",
    "Bounds",
    "Budget",
    "Dielectric",
    "Fate",
    "FringetraceWarning",
    "Gaussian",
    "Ledger",
    "Mesh",
    "Metal",
    "Mirror",
    "Paths",
    "Rays",
    "Scene",
    "Surface",
    "Validity",
    "bounds",
    "bsdf",
    "budget",
    "complex_field",
    "crystals",
    "cylinders",
    "degree",
    "elements",
    "films",
    "forms",
    "frames",
    "goniometer",
    "gratings",
    "instruments",
    "irradiance",
    "lattices",
    "lenses",
    "materials",
    "meshes",
    "mm",
    "mutual_intensity",
    "nm",
    "phase",
    "plates",
    "polarisers",
    "records",
    "scenes",
    "shapes",
    "spectra",
    "spheres",
    "stream",
    "studies",
    "swatches",
    "sweeps",
    "tables",
    "trace",
    "um",
    "validity",
    "vectors",
    "views",
]

# rooms that are imported at first use
_ROOMS = (
    "bsdf", "crystals", "cylinders", "elements", "films", "forms", "frames", "goniometer",
    "gratings", "instruments", "lattices", "lenses", "materials", "meshes", "phase", "plates", "polarisers",
    "records", "scenes", "shapes", "spectra", "spheres", "studies", "swatches", "sweeps", "tables", "vectors",
    "views",
)  # fmt: skip


def __getattr__(name: str) -> Any:
    if name in _ROOMS:
        return import_module(f"fringetrace.{name}")
    if name == "FringetraceWarning":
        from fringetrace.guards import FringetraceWarning

        return FringetraceWarning
    if name == "__version__":
        from importlib.metadata import version

        return version("fringetrace")
    raise AttributeError(f"module 'fringetrace' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_ROOMS, "FringetraceWarning", "__version__"])
