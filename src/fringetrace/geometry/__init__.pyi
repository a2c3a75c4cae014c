from . import forms as forms, meshes as meshes, shapes as shapes
from .circles import check_circles_apart as check_circles_apart
from .facet_sag import standoff as standoff
from .forms import Conic as Conic, Cylinder as Cylinder, Form as Form, Sphere as Sphere
from .implicit import Fit as Fit, LevelFit as LevelFit, Meeting as Meeting
from .mesh import Mesh as Mesh, as_mesh as as_mesh
from .meshes import interpolate_height as interpolate_height
from .pn_triangles import Patches as Patches
from .shapes import (
    height_map as height_map,
    icosphere as icosphere,
    plate as plate,
    rod_lattice as rod_lattice,
)
from .topology import (
    IndexArray as IndexArray,
    MeshEdges as MeshEdges,
    Topology as Topology,
    connected as connected,
    directed_edges as directed_edges,
    weld as weld,
)
from .triangles import breadth as breadth
from .zygo import write_height_map as write_height_map
