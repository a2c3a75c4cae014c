from . import checks as checks
from .checks import check as check
from .error_budget import Budget as Budget, budget as budget, hit_error as hit_error, judge as judge
from .ray_bounds import Bounds as Bounds, bounds as bounds
