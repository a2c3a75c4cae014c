from . import (
    cylinder_gratings as cylinder_gratings,
    cylinders as cylinders,
    effective_medium as effective_medium,
    mie as mie,
)
from .cylinder_gratings import reflectance_spectrum as reflectance_spectrum
from .cylinders import Cylinders as Cylinders, differential_width as differential_width, scatter as scatter
from .cylindrical_waves import CONDUCTOR as CONDUCTOR, Index as Index
from .ray_validity import Validity as Validity, validity as validity
