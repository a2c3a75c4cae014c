from . import detection as detection
from .checks import CUT as CUT, CUT_OFF as CUT_OFF, Losses as Losses
from .detection import components as components, landed as landed, project as project
from .fates import DETECTED as DETECTED, Fate as Fate
from .intersect.bodies import Float32 as Float32, float32_hits as float32_hits
from .intersect.exact import LEAF as LEAF, arrange as arrange
from .ledger import Ledger as Ledger
from .optics_table import constants as constants, needs as needs, plain as plain, scene_media as scene_media
from .paths import Paths as Paths, join as join
from .ray_query import retrace as retrace
from .rays import Rays as Rays, launch as launch, launch_at as launch_at
from .rewavelength import at_wavelength as at_wavelength
from .segments import (
    EXTENDED as EXTENDED,
    Segments as Segments,
    SurfaceHits as SurfaceHits,
    surface_hits as surface_hits,
    surface_phase as surface_phase,
)
from .sensitivity import leverage as leverage, path_change as path_change
from .tracer import stream as stream, trace as trace
