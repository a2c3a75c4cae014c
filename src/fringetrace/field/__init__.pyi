from .coherent_sum import (
    chosen as chosen,
    complex_field as complex_field,
    irradiance as irradiance,
    mutual_intensity as mutual_intensity,
    products as products,
)
from .ray_sum import centred as centred
from .spectral_sum import TOLERANCE as TOLERANCE, spectrum as spectrum
from .wavefront import assemble as assemble
