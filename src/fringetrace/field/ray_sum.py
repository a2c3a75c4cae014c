"""Ray sum: coherent sum of rays on the pixels, each at the centre of its part of a pixel."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, FloatArray
from fringetrace.field.groups import grouped
from fringetrace.field.pixel_quadrature import mutual_products
from fringetrace.scene import Spectrum, screen
from fringetrace.tracing import Paths, components


@dataclass(frozen=True, eq=False)
class RaySum:
    """Ray sum on the pixels: E = sum of a exp(2 pi i OPL / wavelength) over rays.

    A sum runs in the order of the rays: the same bits for any chunk size.

    Attributes
    ----------
    parts : iterable of Paths
        At the wavelength at which it is evaluated, onto one CCD; at least one.
    """

    parts: Iterable[Paths]

    def complex_field(
        self, wavelength: float, groups: npt.ArrayLike | None = None, half_wave_loss: bool = True
    ) -> ComplexArray:
        """Complex field: sum of the rays in each pixel, see `complex_field`.

        Parameters
        ----------
        wavelength : float, metres
        groups : (paths,) int, optional
            A field for each group of paths, from 0 on.
        half_wave_loss : bool
            False leaves out the factor -1 of each reflection off a mirror.

        Returns
        -------
        (rows, columns) complex128, or (3, rows, columns); with groups an axis more in front

        Raises
        ------
        ValueError
            For groups that do not fit.
        """
        if groups is None:
            return _summed(self.parts, wavelength, half_wave_loss)
        parts = list(self.parts)
        ends = np.cumsum([len(part) for part in parts])
        number = grouped(groups, int(ends[-1]))
        numbers = np.split(number, ends[:-1])
        member = [
            [part.where(its == g) for part, its in zip(parts, numbers, strict=True)]
            for g in range(int(number.max(initial=0)) + 1)
        ]
        return np.stack([_summed(group, wavelength, half_wave_loss) for group in member])

    def mutual_intensity(
        self, light: float | Spectrum, groups: npt.ArrayLike, half_wave_loss: bool = True
    ) -> ComplexArray:
        """Mutual intensity E_m conj(E_n) of the ray sums of groups, at one wavelength."""
        assert not isinstance(light, Spectrum)
        return products(self.complex_field(light, groups, half_wave_loss))

    def irradiance(self, light: float | Spectrum, half_wave_loss: bool = True) -> FloatArray:
        """Irradiance |E|^2 of the ray sum, at one wavelength."""
        assert not isinstance(light, Spectrum)
        squares = np.abs(self.complex_field(light, None, half_wave_loss)) ** 2
        return np.asarray(squares if squares.ndim == 2 else squares.sum(axis=0), dtype=np.float64)


def _summed(parts: Iterable[Paths], wavelength: float, half_wave_loss: bool) -> ComplexArray:
    """The coherent sum over rays."""
    from fringetrace.field.ray_sum_kernels import gather

    total = np.empty((0, 0, 0), dtype=np.complex128)
    for part in parts:
        assert part.ccd is not None
        amplitudes = components(part, part.ccd)
        if total.size == 0:
            total = np.zeros((len(amplitudes), *part.ccd.shape), dtype=np.complex128)
        weight = 1.0 if part.area is None else part.area / part.ccd.pitch**2
        for image, amplitude in zip(total, amplitudes, strict=True):
            gather(
                part.fate, part.origin, part.length, amplitude, part.reflections, half_wave_loss,
                screen(part.ccd), part.ccd.pitch, weight, wavelength, image,
            )  # fmt: skip
    return total if len(total) == 3 else total[0]


def products(fields: ComplexArray) -> ComplexArray:
    """Products E_m conj(E_n) of fields, summed over the components of polarised light.

    Parameters
    ----------
    fields : (groups, rows, columns) complex128, or (groups, 3, rows, columns)

    Returns
    -------
    (groups, groups, rows, columns) complex128
    """
    if fields.ndim == 3:
        return mutual_products(fields)
    return np.asarray(sum(mutual_products(fields[:, k]) for k in range(3)), dtype=np.complex128)


def centred(paths: Paths, parts: int = 1) -> Paths:
    """Continue paths, as plane waves, to the centres of the pixels (or parts of them) they fall in.

    A ray that lands beside the centre brings the phase of where it landed; summed as it is, a
    tilted wave would be sampled on a grid other than that of the pixels.

    Parameters
    ----------
    paths : Paths
        All of them detected.
    parts : int
        Parts of a pixel along either axis.

    Returns
    -------
    Paths
        With other lengths, L + d . (centre - point), and otherwise the same.

    Raises
    ------
    ValueError
        If the paths were traced without a CCD.
    """
    if paths.ccd is None:
        raise ValueError("centred: expected paths traced onto a CCD, got paths without one")
    u, v, _ = paths.ccd.axes
    fine = paths.pixel * parts
    shift = (np.floor(fine) + 0.5 - fine) * (paths.ccd.pitch / parts)
    continued = shift[:, 0] * (paths.gradient @ v) + shift[:, 1] * (paths.gradient @ u)
    return replace(paths, length=paths.length + continued)
