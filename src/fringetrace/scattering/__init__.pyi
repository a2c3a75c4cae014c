from . import bsdf_tables as bsdf_tables, colour as colour, rod_studies as rod_studies
from .detectors import (
    Cells as Cells,
    Cones as Cones,
    Detector as Detector,
    Pixels as Pixels,
    sides as sides,
    towards as towards,
)
from .far_fields import far_field as far_field
from .goniometer import (
    amplitudes as amplitudes,
    brdf as brdf,
    reciprocity as reciprocity,
    rounding_error as rounding_error,
    sampling_error as sampling_error,
)
from .illumination import Setup as Setup, footprint as footprint
from .rod_lattice import Lattice as Lattice
from .rod_studies import Polarised as Polarised, cluster as cluster, specular as specular, study as study
