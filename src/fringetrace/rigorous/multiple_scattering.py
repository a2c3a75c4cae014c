"""Multiple scattering between many cylinders: the linear system of exciting amplitudes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fringetrace.core import Array, ComplexArray, FloatArray
from fringetrace.rigorous.cylindrical_waves import outgoing_waves

_DENSE = 400  # unknowns up to which elimination is as quick as iteration
_FEW = 16  # centres that are never taken for a lattice
_LARGEST = 6000  # unknowns whose matrix (600 MB) may still be eliminated
_RESIDUAL = 1e-12  # relative, at which iteration ends
_ON_GRID = 1e-9  # of a step, that centres may be off their grid by rounding


def solve(
    centres: FloatArray, k: float, response: ComplexArray, weight: FloatArray, incident: ComplexArray
) -> ComplexArray:
    """Exciting amplitudes a of a_j = incident_j + sum_l G_jl S_l a_l (Twersky 1952).

    G is Graf's addition theorem, H_{m-n}(k R_jl) exp(i (m - n) phi_jl) from order m of l to order n of j.
    The unknowns are a / |H_n(k a)|, which keeps orders of any height near one another in size.

    Parameters
    ----------
    centres : (n, 2) float64, metres
    k : float, 1/m
        Wavenumber in the host.
    response, weight : (n, 2 N + 1)
        S_n and |H_n(k a)| of each cylinder.
    incident : (q, n, 2 N + 1) complex128
        Incident waves about each centre.

    Returns
    -------
    (q, n, 2 N + 1) complex128

    Raises
    ------
    ValueError
        If there are too many unknowns and the centres lie on no grid, or iteration did not converge.
    """
    if len(centres) == 1:
        return incident
    right, sources = incident / weight, response * weight
    grid = _grid(centres) if right[0].size > _DENSE and len(centres) > _FEW else None
    if grid is not None:
        system = _convolution(grid, k, weight, sources)
        found = [each for each in (_iterate(system, one) for one in right) if each is not None]
        if len(found) == len(right):
            return np.stack(found) * weight
    if right[0].size > _LARGEST:
        raise ValueError(
            f"Cylinders: expected at most {_LARGEST} unknowns off a grid, got {right[0].size} "
            f"({len(centres)} cylinders of {response.shape[-1]} orders)"
        )
    matrix = np.eye(right[0].size) - _coupling(centres, k, weight, sources)
    solved = np.linalg.solve(matrix, right.reshape(len(right), -1).T).T
    return np.asarray(solved.reshape(right.shape) * weight, np.complex128)


def _coupling(centres: FloatArray, k: float, weight: FloatArray, sources: ComplexArray) -> ComplexArray:
    """The dense matrix of G S in scaled unknowns, rows (cylinder j, order n), columns (l, m)."""
    count = weight.shape[-1]
    wave = outgoing_waves(centres[:, None] - centres, k, count - 1)
    order = np.arange(count)
    block = wave[:, :, order - order[:, None] + count - 1]  # j, l, n, m
    block /= weight[:, None, :, None]
    block *= sources[None, :, None, :]
    return block.transpose(0, 2, 1, 3).reshape(weight.size, weight.size)


def _grid(centres: FloatArray) -> tuple[Array, FloatArray] | None:
    """Places of the centres on a rectangular grid, (n, 2) int64, and its steps; None if there is none."""
    places, steps = [], []
    for values in centres.T:
        span = np.ptp(values)
        unique = np.unique(np.round((values - values.min()) / span, 9)) if span > 0 else np.zeros(1)
        step = span / round(1.0 / np.diff(unique).min()) if len(unique) > 1 else 1.0
        place = np.round((values - values.min()) / step)
        if abs(values - values.min() - place * step).max() > _ON_GRID * step:
            return None
        places.append(place.astype(np.int64))
        steps.append(step)
    found = np.stack(places, 1)
    return (found, np.array(steps)) if np.prod(found.max(0) + 1) <= 8 * len(centres) else None


def _convolution(
    grid: tuple[Array, FloatArray], k: float, weight: FloatArray, sources: ComplexArray
) -> Callable[[ComplexArray], ComplexArray]:
    """The map a -> a - G S a on a grid, where G is a convolution (FFT), in scaled unknowns."""
    from scipy import fft
    from scipy.spatial import cKDTree

    (places, steps), count = grid, weight.shape[-1]
    shape = [fft.next_fast_len(2 * int(most) + 1) for most in places.max(0)]
    lags = [np.arange(s) - s * (np.arange(s) > s // 2) for s in shape]
    apart = np.asarray(cKDTree(places * steps).query(places * steps, 2)[0])[:, 1]
    nearest = (1.0 - _ON_GRID) * apart.min()
    lag = np.stack(np.meshgrid(*lags, indexing="ij"), -1) * steps
    lag[np.hypot(*np.moveaxis(lag, -1, 0)) < nearest] = 0.0  # between places of which one is empty
    kernel = fft.fft2(outgoing_waves(lag, k, count - 1), axes=(0, 1))
    order = np.arange(count)
    kernel = np.ascontiguousarray(kernel[..., order - order[:, None] + count - 1])
    at = tuple(places.T)

    def residual(unknown: ComplexArray) -> ComplexArray:
        field = np.zeros((*shape, count), np.complex128)
        field[at] = sources * unknown.reshape(weight.shape)
        met = fft.ifft2((kernel @ fft.fft2(field, axes=(0, 1))[..., None])[..., 0], axes=(0, 1))
        return np.asarray(unknown - (met[at] / weight).ravel())

    return residual


def _iterate(system: Callable[[ComplexArray], ComplexArray], right: ComplexArray) -> ComplexArray | None:
    """Solution of system(a) = right by GMRES, or None if it does not converge."""
    from scipy.sparse.linalg import LinearOperator, gmres

    operator = LinearOperator((right.size, right.size), matvec=system, dtype=np.complex128)
    found, failed = gmres(operator, right.ravel(), rtol=_RESIDUAL, atol=0.0, restart=150, maxiter=4)
    return None if failed else np.asarray(found).reshape(right.shape)
