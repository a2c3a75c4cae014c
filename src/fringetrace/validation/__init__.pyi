from . import measurement as measurement, work_precision as work_precision
from .measurement import Measurement as Measurement
from .standards import STANDARDS as STANDARDS
