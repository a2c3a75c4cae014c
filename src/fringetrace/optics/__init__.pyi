from . import (
    birefringent as birefringent,
    elements as elements,
    films as films,
    gratings as gratings,
    interfaces as interfaces,
    materials as materials,
    phase_plates as phase_plates,
    polarisers as polarisers,
)
from .birefringent import ShearPlate as ShearPlate
from .elements import (
    Branch as Branch,
    Element as Element,
    IncidentRays as IncidentRays,
    InterfaceKind as InterfaceKind,
    RealIndex as RealIndex,
)
from .film_kernels import (
    bare as bare,
    coated as coated,
    normal_part as normal_part,
    shares as shares,
    stacks as stacks,
)
from .films import Film as Film, coefficients as coefficients
from .interfaces import (
    Absorber as Absorber,
    BeamSplitter as BeamSplitter,
    ConstantInterface as ConstantInterface,
    Dielectric as Dielectric,
    Interface as Interface,
    Metal as Metal,
    Mirror as Mirror,
    refract as refract,
)
from .materials.material import Material as Material
from .materials.named_materials import VACUUM as VACUUM, as_material as as_material
from .phase_plates import PhasePlate as PhasePlate
from .polarisation import (
    JONES as JONES,
    Polarisation as Polarisation,
    PolarisationLike as PolarisationLike,
    PolarisationName as PolarisationName,
    check_polarisation as check_polarisation,
    checked_jones as checked_jones,
    jones_states as jones_states,
)
from .polarisers import Polariser as Polariser, Retarder as Retarder, wave_plate as wave_plate
from .pupils import Pupil as Pupil
