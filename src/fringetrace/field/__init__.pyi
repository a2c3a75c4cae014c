from .coherent_sum import (
    PixelLight as PixelLight,
    chosen as chosen,
    complex_field as complex_field,
    irradiance as irradiance,
    light_on as light_on,
    mutual_intensity as mutual_intensity,
)
from .field import Field as Field
from .ray_sum import RaySum as RaySum, centred as centred, products as products
from .spectral_sum import TOLERANCE as TOLERANCE, spectrum as spectrum
from .wavefront.wavefronts import Wavefronts as Wavefronts, reconstruct as reconstruct
