from . import run as run, templates as templates
from .files import OUTPUTS as OUTPUTS, Setup as Setup, load as load, parsed as parsed, save as save
from .schema import Recipe as Recipe
