from .checks import aliasing as aliasing
from .coherent_sum import (
    Choice as Choice,
    PixelLight as PixelLight,
    choose as choose,
    chosen as chosen,
    complex_field as complex_field,
    irradiance as irradiance,
    light_on as light_on,
    mutual_intensity as mutual_intensity,
)
from .facet_waves import (
    FacetWaves as FacetWaves,
    reconstruct_facet_waves as reconstruct_facet_waves,
)
from .field import Field as Field
from .ray_sum import RaySum as RaySum, centred as centred, products as products
from .spectral_sum import TOLERANCE as TOLERANCE, spectrum as spectrum
from .wavefront.wavefronts import Wavefronts as Wavefronts, reconstruct as reconstruct
