from .coplanar import planes as planes
from .derived import once_per_scene as once_per_scene
from .facet_groups import group_facets as group_facets
from .model import Scene as Scene, Surface as Surface
from .open_edges import Opening as Opening, openings as openings
from .sensor import (
    CCD as CCD,
    crop as crop,
    cross as cross,
    pixel_centres as pixel_centres,
    pixel_indices as pixel_indices,
    pixels as pixels,
    screen as screen,
)
from .sensor_kernels import lands as lands, place as place
from .sources import Beam as Beam, Gaussian as Gaussian, Profile as Profile, as_names as as_names
from .spectrum import Line as Line, Spectrum as Spectrum
