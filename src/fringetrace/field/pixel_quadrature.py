"""Quadrature over pixels: means of fields and of their products, from as many points as they need."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray
from fringetrace.field.sample_points import ERROR, Edges, Samples, bands, gauss_order, samples

# A cosine's mean over c cycles is its centre less (2 pi c)^2 / 24 of it, to (2 pi c)^4 / 1920: up to so
# many cycles, and so large a correction, what remains is a tenth of ERROR (light bends along two axes,
# and more in places than a cosine does).
GENTLE = (192.0 * ERROR) ** 0.25 / (2.0 * np.pi)
BENT = (192.0 * ERROR) ** 0.5 / 24.0

T = TypeVar("T")
Orders = npt.NDArray[np.int64]


class Case(NamedTuple):
    """Wavelength (metres) and field component, and the image that it is added to with a weight."""

    wavelength: float
    component: int = 0
    weight: float = 1.0
    image: int = 0


class SampledLight(Protocol):
    """Protocol of fields of groups at sample points."""

    groups: int

    def at(self, points: Samples, slopes: bool) -> Any:
        """Part of the evaluation that is the same at all wavelengths."""

    def field(self, found: Any, case: Case) -> tuple[ComplexArray, FloatArray]:
        """Fields (groups, points), and slopes, see `fringes`: (points, 4), or (0, 4) if not wanted."""


def fringes(slope: FloatArray, carrier: bool) -> FloatArray:
    """Steepest change of optical path over each pixel and its neighbours.

    Parameters
    ----------
    slope : (rows, columns, 4) float64, metres a pixel
        Lowest and highest gradient of the path at the centres of the pixels, along x, then along y,
        of the waves that overlap there.
    carrier : bool
        Count the gradient itself, which a mean field needs; else only differences, which make fringes.

    Returns
    -------
    (rows, columns) float64, metres
        0 where there is no wave. The neighbours stand for what bends within a pixel.
    """
    spans = np.abs(slope) if carrier else slope[..., 1::2] - slope[..., ::2]
    steepest = np.where(np.isfinite(slope[..., 0]), spans.max(axis=-1), 0.0)
    return np.asarray(_around(steepest), dtype=np.float64)


def averaged(
    shape: tuple[int, int],
    light: SampledLight,
    cases: Sequence[Case],
    carrier: bool,
    cuts: Edges | None = None,
    more: int = 0,
    rows: tuple[int, int] | None = None,
) -> ComplexArray:
    """Means over the pixels of the fields of groups, or of their products.

    Where light is even its value at the centre will do, with a quarter of a quarter of its curvature:
    the mean of f over a pixel is f + (f_xx + f_yy) / 24 to fourth order (Euler and Maclaurin).
    Elsewhere there are as many sample points as the fringes ask for, or what bends as they do. What
    waves bring to a point is found once for all cases.

    Parameters
    ----------
    shape : (rows, columns)
        Of the CCD.
    light : SampledLight
    cases : sequence of Case
    carrier : bool
        Means of the fields, for which pixels are sampled for the whole slope of the phase; else means of
        E_m conj(E_n), for which only fringes between waves are resolved.
    cuts : Edges, optional
        Edges of sheets.
    more : int
        Points along either axis beyond those asked for, in every pixel: to see what they are worth.
    rows : (first, after the last), optional
        Of pixels that are wanted; default: all.

    Returns
    -------
    (images, groups, rows, columns) complex128, or (images, groups, groups, rows, columns)
        The same bits for any number of cores. Irradiances are on the diagonal of products.
    """
    from fringetrace.field import pixel_kernels

    top, stop = (0, shape[0]) if rows is None else rows
    cut = _around(_crossed(shape, cuts)[top:stop])
    centres = _centres(cut.shape, top, light)
    groups = (light.groups,) if carrier else (light.groups, light.groups)
    images = 1 + max(case.image for case in cases)
    total = np.zeros((images, int(np.prod(groups)), *cut.shape), dtype=np.complex128)
    orders = np.zeros((len(cases), *cut.shape), dtype=np.int8)
    slopes: list[FloatArray] = []
    for order, case in zip(orders, cases, strict=True):
        parts = _each(lambda found, case=case: light.field(found, case), centres)  # type: ignore[misc]
        field = np.concatenate([f for f, _ in parts], axis=1).reshape(-1, *cut.shape)
        if not slopes or any(old is not new for old, (_, new) in zip(slopes, parts, strict=True)):
            slopes = [slope for _, slope in parts]
            steepest = fringes(np.concatenate(slopes).reshape(*cut.shape, 4), carrier)
        order[:] = _planned(field, steepest / case.wavelength, cut, carrier, more)
        pixel_kernels.add_even(field, order, case.weight, not carrier, total[case.image])

    def sampled(band: tuple[int, int]) -> None:
        mine = slice(*band)
        for order in _distinct(orders[:, mine].astype(np.int64)):
            points = samples(order, top + band[0], cuts)
            found = light.at(points, False)
            for its, case in zip(orders[:, mine], cases, strict=True):
                here = (its == order) & (order > 0)
                if here.any():
                    field, _ = light.field(found, case)
                    points.add_means(field, here, case.weight, not carrier, total[case.image, ..., mine, :])

    _each(sampled, bands(orders.max(axis=0).astype(np.int64)))
    return total.reshape(-1, *groups, *cut.shape)


def _planned(
    field: ComplexArray, cycles: FloatArray, cut: npt.NDArray[np.bool_], carrier: bool, more: int
) -> Orders:
    """Gauss points that each pixel asks for; none where its centre and the curvature there will do."""
    from fringetrace.field import pixel_kernels

    bend, value = pixel_kernels.largest(field, True)
    even = (cycles <= GENTLE) & ~cut & _small(bend, value)
    if carrier:
        even &= _small(*pixel_kernels.largest(field, False))
    if more:
        even[:] = False
    cycles = np.maximum(cycles, np.where(cut, 0.0, _swing(bend, value)))
    return np.where(even, 0, gauss_order(cycles) + more)


def _distinct(orders: Orders) -> Iterator[Orders]:
    """The orders (rows, columns) that each pixel has in some case (cases, rows, columns): least first."""
    none = np.iinfo(orders.dtype).max
    orders = np.where(orders > 0, orders, none)
    while True:
        least = orders.min(axis=0)
        if (least == none).all():
            return
        yield np.where(least == none, 0, least)
        orders[orders == least] = none


def mutual_products(field: ComplexArray) -> ComplexArray:
    """Products E_m conj(E_n) of fields.

    Parameters
    ----------
    field : (groups, ...) complex128

    Returns
    -------
    (groups, groups, ...) complex128
    """
    return np.asarray(field[:, None] * np.conj(field[None]), dtype=np.complex128)


def _small(bend: FloatArray, value: FloatArray) -> npt.NDArray[np.bool_]:
    """Where a correction (rows, columns) is a small part of the largest value around; not at the rim."""
    small = np.zeros(value.shape, dtype=np.bool_)
    small[1:-1, 1:-1] = (_around(bend) <= BENT * _around(value))[1:-1, 1:-1]
    return small


def _swing(bend: FloatArray, value: FloatArray) -> FloatArray:
    """Cycles a pixel of a cosine that bends as much: (2 pi c)^2 / 24 of the largest value around."""
    part = np.divide(bend, value := _around(value), out=np.zeros_like(value), where=value > 0.0)
    return np.asarray(np.sqrt(24.0 * _around(part)) / (2.0 * np.pi), dtype=np.float64)


def _crossed(shape: tuple[int, int], cuts: Edges | None) -> npt.NDArray[np.bool_]:
    """Pixels that an edge crosses."""
    crossed = np.zeros(shape, dtype=np.bool_)
    if cuts is not None:
        crossed.ravel()[cuts.pixel] = True
    return crossed


def _around(values: Array) -> Array:
    """The largest value of each pixel and its neighbours."""
    rows, columns = values.shape
    padded = np.pad(values, 1)
    wide = np.maximum(np.maximum(padded[:, :columns], padded[:, 1:-1]), padded[:, 2:])
    return np.asarray(np.maximum(np.maximum(wide[:rows], wide[1:-1]), wide[2:]))


def _centres(shape: tuple[int, int], top: int, light: SampledLight) -> list[Any]:
    """What waves bring to the centres of pixels, band by band."""
    order = np.ones(shape, dtype=np.int64)
    return _each(lambda band: light.at(samples(order[slice(*band)], top + band[0]), True), bands(order))


def _each(work: Callable[[Any], T], parts: Sequence[Any]) -> list[T]:
    """Results of all parts, in their order, worked on by all cores."""
    with ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="fringetrace") as pool:
        return list(pool.map(work, parts))
