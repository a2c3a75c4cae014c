from . import bsdf_tables as bsdf_tables, colour as colour, rod_studies as rod_studies
from .detectors import (
    Cells as Cells,
    Cones as Cones,
    Detector as Detector,
    Pixels as Pixels,
    sides as sides,
    towards as towards,
)
from .far_fields import FarFieldOptions as FarFieldOptions, far_field as far_field
from .goniometer import (
    amplitudes as amplitudes,
    brdf as brdf,
    brdf_sampling_error as brdf_sampling_error,
    reciprocity as reciprocity,
    rounding_error as rounding_error,
)
from .illumination import Illumination as Illumination, footprint as footprint
from .rod_lattice import RodLattice as RodLattice
from .rod_solvers import (
    lattice_cylinders as lattice_cylinders,
    lattice_gratings as lattice_gratings,
    lattice_validity as lattice_validity,
)
from .rod_studies import cluster as cluster, specular as specular, study as study
