from . import sweeps as sweeps, tables as tables, vectors as vectors
from .compiled import grown as grown, jit as jit, lean as lean, part as part
from .files import staged as staged, whole as whole
from .represent import (
    described as described,
    length_text as length_text,
    short_repr as short_repr,
    value_text as value_text,
)
from .sweeps import grid as grid, sweep as sweep
from .tables import (
    Coordinates as Coordinates,
    array as array,
    read_csv as read_csv,
    write_csv as write_csv,
)
from .units import (
    Array as Array,
    ComplexArray as ComplexArray,
    FloatArray as FloatArray,
    checked_angles as checked_angles,
    checked_length as checked_length,
    checked_lengths as checked_lengths,
    checked_wavelength as checked_wavelength,
    checked_wavelengths as checked_wavelengths,
    checked_whole as checked_whole,
    degree as degree,
    filled as filled,
    mm as mm,
    nm as nm,
    parse_angle as parse_angle,
    parse_length as parse_length,
    path_phase as path_phase,
    um as um,
    unit_length as unit_length,
    unit_of as unit_of,
    wavenumber as wavenumber,
)
from .vectors import (
    ROUNDED as ROUNDED,
    checked_direction as checked_direction,
    checked_rotation as checked_rotation,
    checked_vector as checked_vector,
    component as component,
    dot as dot,
    frame as frame,
    rotation as rotation,
    unit as unit,
)
from .version import __version__ as __version__
from .warnings import FringetraceWarning as FringetraceWarning, warn as warn, warn_once as warn_once
