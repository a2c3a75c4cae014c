from .heights import (
    height as height,
    optical_path as optical_path,
    remove_mean as remove_mean,
    remove_plane as remove_plane,
    synthetic_wavelength as synthetic_wavelength,
    two_wavelength as two_wavelength,
    unwrap as unwrap,
    wrap as wrap,
)
from .stepping import (
    carre as carre,
    four_step as four_step,
    hariharan as hariharan,
    least_squares as least_squares,
    modulation as modulation,
    n_bucket as n_bucket,
    stoilov as stoilov,
    three_step as three_step,
)
