from . import run as run, templates as templates
from .files import (
    OUTPUTS as OUTPUTS,
    Experiment as Experiment,
    load as load,
    parse_experiment as parse_experiment,
    save as save,
)
from .schema import Recipe as Recipe
