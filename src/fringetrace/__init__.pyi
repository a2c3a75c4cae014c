from . import (
    accuracy as accuracy,
    field as field,
    geometry as geometry,
    instruments as instruments,
    optics as optics,
    phase as phase,
    rigorous as rigorous,
    scattering as scattering,
    scene as scene,
    scenefile as scenefile,
    tracing as tracing,
    validation as validation,
    views as views,
)
from .accuracy import Bounds as Bounds, Budget as Budget, bounds as bounds, budget as budget
from .core import (
    FringetraceWarning as FringetraceWarning,
    __version__ as __version__,
    degree as degree,
    mm as mm,
    nm as nm,
    sweeps as sweeps,
    tables as tables,
    um as um,
    vectors as vectors,
)
from .field import (
    Field as Field,
    Wavefronts as Wavefronts,
    complex_field as complex_field,
    irradiance as irradiance,
    mutual_intensity as mutual_intensity,
    reconstruct as reconstruct,
)
from .geometry import Mesh as Mesh, forms as forms, meshes as meshes, shapes as shapes
from .instruments import lenses as lenses, records as records, tiff as tiff
from .optics import (
    Absorber as Absorber,
    BeamSplitter as BeamSplitter,
    Dielectric as Dielectric,
    Metal as Metal,
    Mirror as Mirror,
    birefringent as birefringent,
    elements as elements,
    films as films,
    gratings as gratings,
    materials as materials,
    phase_plates as phase_plates,
    polarisers as polarisers,
)
from .rigorous import (
    Validity as Validity,
    cylinder_gratings as cylinder_gratings,
    cylinders as cylinders,
    mie as mie,
    validity as validity,
)
from .scattering import bsdf_tables as bsdf_tables, colour as colour
from .scene import (
    CCD as CCD,
    Beam as Beam,
    Gaussian as Gaussian,
    Line as Line,
    Scene as Scene,
    Spectrum as Spectrum,
    Surface as Surface,
)
from .tracing import (
    Fate as Fate,
    Ledger as Ledger,
    Paths as Paths,
    Rays as Rays,
    stream as stream,
    trace as trace,
)
