"""Coherent sum on the pixels: complex field, irradiance and mutual intensity of traced paths."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain, groupby

import numpy as np
import numpy.typing as npt

from fringetrace.core import ComplexArray, FloatArray, checked_wavelength
from fringetrace.scene import Beam, screen
from fringetrace.tracing import Paths, along, at_wavelength, join

# A wavefront is worth its while where so many rays of the beam share a facet, or facets are so few.
SHARING, FEW = 16, 64


def method_for(paths: Paths) -> str:
    """Method that "auto" stands for: wavefront or ray sum.

    "wavefront" for a `Beam` whose rays are at least `SHARING` times as many as the flat facets of the
    scene (coplanar triangles are one; surfaces with a form have none), or where those are `FEW`;
    else "rays", as behind elements that tear waves (pixels, stops).

    Parameters
    ----------
    paths : Paths

    Returns
    -------
    {"wavefront", "rays"}
    """
    from fringetrace.scene import group_facets

    if not isinstance(paths.source, Beam) or paths.ccd is None or torn(paths):
        return "rays"
    most = max(FEW, int(np.prod(paths.source.shape)) // SHARING)
    flat = [surface for surface in paths.scene.surfaces if surface.form is None]
    if sum(len(surface.mesh.faces) for surface in flat) > most:
        parts = group_facets(paths.scene)
        facets = [parts[i].max() + 1 for i, s in enumerate(paths.scene.surfaces) if s.form is None]
        if sum(facets) > most:
            return "rays"
    return "wavefront"


def torn(paths: Paths) -> str | None:
    """Name of a surface that tears wavefronts: an element that treats neighbouring rays differently.

    Parameters
    ----------
    paths : Paths

    Returns
    -------
    str or None
    """
    surfaces = paths.scene.surfaces
    return next((s.name for s in surfaces if getattr(s.interface, "waves", None) == "torn"), None)


def complex_field(
    paths: Paths | Iterable[Paths],
    wavelength: float,
    method: str = "auto",
    half_wave_loss: bool = True,
    groups: npt.ArrayLike | None = None,
) -> ComplexArray:
    """Complex field, averaged over each pixel of the CCD.

    Parameters
    ----------
    paths : Paths, or an iterable of them
        From `trace`, or chunk by chunk from `stream`; of several coherent beams, one after the other.
    wavelength : float, metres
        Vacuum wavelength. Another one needs no new trace, unless media bend it another way.
    method : {"auto", "wavefront", "rays"}
        "wavefront": neighbouring rays of a `Beam` with the same path span a sheet, whose mean field
        over each pixel is found; overlapping sheets add. See `irradiance`.
        "rays": the coherent sum E = sum of a exp(2 pi i OPL / wavelength) over the rays that fall
        in a pixel, each weighted with its beam area over the pixel's, so that a unit beam falling
        straight on the CCD gives |E|^2 = 1. Rays without an area have weight 1.
        "auto": the wavefront where it is worth its while, see `method_for`.
    half_wave_loss : bool
        False leaves out the factor -1 of each reflection off a mirror.
    groups : (paths,) int, optional
        A field for each group of paths, from 0 on; with "wavefront", paths of one key are of one group.

    Returns
    -------
    (rows, columns) complex128, or (groups, rows, columns)
        Of light with a polarisation (3, rows, columns), or (groups, 3, rows, columns): along the CCD's
        columns, rows and normal. A ray sum runs in the order of the rays: the same bits for any chunk size.

    Raises
    ------
    ValueError
        For a wavelength that is none, or goes another way than that of the trace; for an unknown method,
        paths without a CCD, or no paths at all;
        with "wavefront", for paths that are not of a beam; for groups that do not fit the paths.
    """
    wavelength = checked_wavelength(wavelength)
    method, parts = _method(paths, method, wavelength)
    if method == "wavefront":
        mean = _wavefront(parts, wavelength, groups, True, half_wave_loss)[0]
        return mean if groups is not None else np.ascontiguousarray(mean[0])
    if groups is None:
        return _sum(parts, wavelength, half_wave_loss)
    parts = list(parts)
    numbers = _numbers(parts, groups)
    count = max(int(number.max(initial=0)) for number in numbers) + 1
    member = [
        [part.where(number == g) for part, number in zip(parts, numbers, strict=True)] for g in range(count)
    ]
    return np.stack([_sum(group, wavelength, half_wave_loss) for group in member])


def mutual_intensity(
    paths: Paths | Iterable[Paths],
    wavelength: float,
    groups: npt.ArrayLike,
    method: str = "auto",
    half_wave_loss: bool = True,
) -> ComplexArray:
    """Mutual intensity E_m conj(E_n) of groups of paths, averaged over each pixel.

    What a camera sees of groups whose phases are stepped by d_m is the sum of J_mn exp(i (d_m - d_n)).

    Parameters
    ----------
    paths, wavelength, method, half_wave_loss
        As in `complex_field`.
    groups : (paths,) int
        The group of each path, from 0 on; with "wavefront", paths of one key are of one group.

    Returns
    -------
    (groups, groups, rows, columns) complex128
        Hermitian; irradiances on the diagonal. With "rays" a pixel has no inside: E_m conj(E_n).

    Raises
    ------
    ValueError
        As in `complex_field`.
    """
    wavelength = checked_wavelength(wavelength)
    method, parts = _method(paths, method, wavelength)
    if method == "wavefront":
        return _wavefront(parts, wavelength, groups, False, half_wave_loss)[1]
    return products(complex_field(parts, wavelength, method, half_wave_loss, groups))


def products(fields: ComplexArray) -> ComplexArray:
    """Products E_m conj(E_n) of fields, summed over the components of polarised light.

    Parameters
    ----------
    fields : (groups, rows, columns) complex128, or (groups, 3, rows, columns)

    Returns
    -------
    (groups, groups, rows, columns) complex128
    """
    from fringetrace.field.pixel_quadrature import mutual_products

    if fields.ndim == 3:
        return mutual_products(fields)
    return np.asarray(sum(mutual_products(fields[:, k]) for k in range(3)), dtype=np.complex128)


def irradiance(
    paths: Paths | Iterable[Paths], wavelength: float, method: str = "auto", half_wave_loss: bool = True
) -> FloatArray:
    """Irradiance |E|^2, averaged over each pixel of the CCD.

    Overlapping sheets add before the square is taken, at as many points of each pixel as their
    fringes ask for: the mean of |E|^2, not the square of the mean field.

    Parameters
    ----------
    paths, wavelength, method, half_wave_loss
        As in `complex_field`. The irradiances of beams that are not coherent with each other add.

    Returns
    -------
    (rows, columns) float64
        1 where a beam of unit irradiance falls straight on the CCD.

    Raises
    ------
    ValueError
        As in `complex_field`.
    """
    wavelength = checked_wavelength(wavelength)
    method, parts = _method(paths, method, wavelength)
    if method == "wavefront":
        mutual = _wavefront(parts, wavelength, None, False, half_wave_loss)[1]
        return np.ascontiguousarray(mutual[0, 0].real)
    squares = np.abs(_sum(parts, wavelength, half_wave_loss)) ** 2
    return np.asarray(squares if squares.ndim == 2 else squares.sum(axis=0), dtype=np.float64)


def chosen(paths: Paths, method: str) -> str:
    """Method of the coherent sum, with "auto" resolved.

    Parameters
    ----------
    paths : Paths
    method : {"auto", "wavefront", "rays"}

    Returns
    -------
    {"wavefront", "rays"}

    Raises
    ------
    ValueError
        For any other method, or for "wavefront" behind elements that tear waves.
    """
    if method not in ("auto", "wavefront", "rays"):
        raise ValueError(f"method: expected 'auto', 'wavefront' or 'rays', got {method!r}")
    tears = torn(paths)
    if method == "wavefront" and tears:
        raise ValueError(f"method: expected 'rays' behind {tears}, which tears wavefronts, got 'wavefront'")
    return method_for(paths) if method == "auto" else method


def _method(paths: Paths | Iterable[Paths], method: str, wavelength: float) -> tuple[str, Iterable[Paths]]:
    """The method, "auto" resolved, and the paths at a wavelength in parts, of which there is at least one."""
    rest = iter((paths,) if isinstance(paths, Paths) else paths)
    first = next(rest, None)
    if first is None:
        raise ValueError("field: expected at least one Paths, got none")
    if first.ccd is None:
        raise ValueError("field: expected paths traced onto a CCD, got paths without one")
    return chosen(first, method), (at_wavelength(part, wavelength) for part in chain([first], rest))


def _numbers(parts: list[Paths], groups: npt.ArrayLike) -> list[npt.NDArray[np.int64]]:
    """The group of each path of each part."""
    number, ends = np.asarray(groups), np.cumsum([len(part) for part in parts])
    whole = np.issubdtype(number.dtype, np.integer)
    if number.shape != (ends[-1],) or not whole or (number < 0).any():
        raise ValueError(
            f"groups: expected {ends[-1]} whole numbers from 0 on, one a path, got {number.dtype} "
            f"of shape {number.shape}"
        )
    return np.split(number.astype(np.int64), ends[:-1])


def _axes(paths: Paths) -> tuple[FloatArray, ...] | tuple[None]:
    """The CCD's columns, rows and normal, where light has a polarisation."""
    assert paths.ccd is not None
    return (None,) if paths.field is None else paths.ccd.axes


def _sum(parts: Iterable[Paths], wavelength: float, half_wave_loss: bool) -> ComplexArray:
    """The coherent sum over rays."""
    from fringetrace.field.ray_sum_kernels import gather

    total = np.empty((0, 0, 0), dtype=np.complex128)
    for part in parts:
        assert part.ccd is not None
        axes = _axes(part)
        if total.size == 0:
            total = np.zeros((len(axes), *part.ccd.shape), dtype=np.complex128)
        weight = 1.0 if part.area is None else part.area / part.ccd.pitch**2
        for image, axis in zip(total, axes, strict=True):
            amplitude = part.amplitude if axis is None else along(part, axis).amplitude
            gather(
                part.fate, part.origin, part.length, amplitude, part.reflections, half_wave_loss,
                screen(part.ccd), part.ccd.pitch, weight, wavelength, image,
            )  # fmt: skip
    return total if len(total) == 3 else total[0]


def _wavefront(
    parts: Iterable[Paths],
    wavelength: float,
    groups: npt.ArrayLike | None,
    carrier: bool,
    half_wave_loss: bool,
) -> tuple[ComplexArray, ComplexArray]:
    """Mean fields of groups, and means of their products, of all beams together."""
    parts = list(parts)
    if groups is None:
        groups = np.zeros(sum(len(part) for part in parts), dtype=np.int64)
    numbers = _numbers(parts, groups)
    seen = [_component(parts, numbers, axis, wavelength, carrier, half_wave_loss) for axis in _axes(parts[0])]
    if len(seen) == 1:
        return seen[0]
    return np.stack([mean for mean, _ in seen], axis=1), np.sum([mutual for _, mutual in seen], axis=0)


def _component(
    parts: list[Paths],
    numbers: list[npt.NDArray[np.int64]],
    axis: FloatArray | None,
    wavelength: float,
    carrier: bool,
    half_wave_loss: bool,
) -> tuple[ComplexArray, ComplexArray]:
    """`_wavefront` of a component of the field."""
    from fringetrace.field.wavefront import assemble

    lights, count = [], 1
    for _, chunks in groupby(zip(parts, numbers, strict=True), lambda part: id(part[0].source)):
        some, its = zip(*chunks, strict=True)
        number = np.concatenate(its)
        count = max(count, int(number.max(initial=0)) + 1)
        lights.append(assemble.light(join(some), number, half_wave_loss, axis))
    assert parts[0].ccd is not None
    return assemble.fields(lights, count, parts[0].ccd.shape, wavelength, carrier)
