from . import lenses as lenses, records as records, tiff as tiff
from .arms import Arms as Arms, Mark as Mark, path_slope as path_slope
from .beam_splitters import (
    SplitterPlate as SplitterPlate,
    anti_reflecting as anti_reflecting,
    semi_reflecting as semi_reflecting,
)
from .fizeau_bench import fizeau as fizeau
from .interferometer import Interferometer as Interferometer
from .jamin_lebedeff_bench import jamin_lebedeff as jamin_lebedeff
from .layout import TILT as TILT
from .mach_zehnder_bench import mach_zehnder as mach_zehnder
from .michelson_bench import michelson as michelson
from .recording import step_axis as step_axis
