"""Validity of ray optics for round parts: size parameter, phase across, expected error."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fringetrace.rigorous.cylindrical_waves import Index, indices_at

# Laws of rays against the rigorous answer, k a = 8 to 250, fitted in docs/rigorous.md
_OPAQUE = 2.4  # over k a: light that two conducting discs reflect
_CLEAR = 3.0  # over sqrt(k a): light through and off one clear rod, at more than 3 degrees from straight on
_DARK = 0.01  # of the light passes straight through a rod that counts as opaque
_ROUGH, _NONE = 0.1, 0.5  # errors from which rays are a rough model, and none


@dataclass(frozen=True)
class Validity:
    """Validity of ray optics for a rod or a sphere.

    Attributes
    ----------
    size_parameter : float
        k a, the circumference in wavelengths of the host.
    phase : float, radians
        2 k (m - 1) a: what light through the middle gains on light beside it; infinite for a conductor.
    ray_error : float
        Estimate of the error of rays, rms over directions, over the rigorous amplitude, at most 1.
    label : str
        The same in words.
    """

    size_parameter: float
    phase: float
    ray_error: float
    label: str

    @property
    def attributes(self) -> dict[str, float | str]:
        """The numbers and the verdict as attributes of a table."""
        return {
            "size_parameter": self.size_parameter, "phase_across_rad": self.phase,
            "ray_error": self.ray_error, "validity": str(self),
        }  # fmt: skip

    def __str__(self) -> str:
        return f"size parameter {self.size_parameter:.3g}, phase across {self.phase:.3g} rad: {self.label}"


def validity(radius: float, wavelength: float, index: Index, host: Index = 1.0) -> Validity:
    """Validity of ray optics for a round part of a scene.

    The error is that of the coherent sum of rays in the far field, by laws measured against the rigorous
    answer (docs/rigorous.md): 2.4 / (k a) for light reflected off opaque rods, 3 / sqrt(k a) for clear ones,
    whose shadow edges, rainbows and surface waves rays leave out.

    Parameters
    ----------
    radius, wavelength : float, metres
        The wavelength in vacuum.
    index : complex, or function of the wavelength in metres
        n + i kappa; `fringetrace.rigorous.cylindrical_waves.CONDUCTOR` for a perfect conductor.
    host : float, or function of the wavelength in metres

    Returns
    -------
    Validity

    Raises
    ------
    ValueError
        If radius or wavelength is not positive.
    """
    if not (radius > 0 and wavelength > 0):
        raise ValueError(
            f"Validity: expected positive lengths in metres, got radius {radius}, wavelength {wavelength}"
        )
    within, around = (complex(indices_at(v, np.asarray(wavelength))) for v in (index, host))
    size = 2.0 * math.pi * around.real * radius / wavelength
    phase = 2.0 * size * (within.real / around.real - 1.0)
    opaque = math.isinf(within.real) or math.exp(-8.0 * math.pi * within.imag * radius / wavelength) < _DARK
    error = min(1.0, _OPAQUE / size if opaque else _CLEAR / math.sqrt(size))
    return Validity(size, phase, error, _label(error, abs(phase)))


def _label(error: float, phase: float) -> str:
    """The error in words."""
    if error < _ROUGH:
        return f"rays hold to about {100 * error:.2g} %"
    if error < _NONE:
        return f"rays are a rough model, about {100 * error:.2g} % off"
    weak = " beyond a kinematic (Bragg) model" if phase < 1.0 else ""
    return f"no ray method is right here{weak}; take a rigorous one"
