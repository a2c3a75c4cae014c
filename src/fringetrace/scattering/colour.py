"""Colorimetry: CIE illuminants and observers, spectrum to XYZ, Lab and sRGB; measured spectra as files."""

from __future__ import annotations

import difflib
import re
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import (
    Array,
    FloatArray,
    FringetraceWarning,
    filled,
    nm,
    read_csv as load,
    um,
    write_csv as save,
)

__all__ = [
    "chromaticity", "illuminant", "lab", "load", "luminance", "observer", "resolving_wavelengths", "save",
    "srgb", "weights", "white", "xyz",
]  # fmt: skip

# A lamp by name, or as wavelengths (metres) and relative power.
Illuminant = str | tuple[npt.ArrayLike, npt.ArrayLike]

# The CIE's observers run from 360 to 830 nm; lamps are tabulated every 5 nm. One step of zeros at both
# ends makes the trapezium rule the CIE's plain sum.
FIRST, LAST, STEP = 360.0, 830.0, 5.0
# Spectra have to cover this, nm: 0.3 % of the light that an eye sees in D65 is outside.
NEEDED = (400.0, 700.0)
OBSERVERS = {2: "CIE 1931 2 Degree Standard Observer", 10: "CIE 1964 10 Degree Standard Observer"}
DAYLIGHT = {"D50": 5000.0, "D55": 5500.0, "D65": 6500.0, "D75": 7500.0}
# The second radiation constant, m K: the temperatures of daylight were named when it was 1.4380e-2.
RADIATION, RADIATION_THEN = 1.4388e-2, 1.4380e-2
# Lumens a watt at 540 THz, which defines the candela.
EFFICACY = 683.0
# Every second sample may stand off the cubic through the others by this part of white, in the mean:
# fringes of full contrast with some nine samples each.
COARSE = 0.03
# Samples a fringe, at 400 nm.
PER_FRINGE = 6
GAMUTS = ("clip", "desaturate", "linear")


def _colour() -> Any:
    """colour-science, imported at first use; what it changes on its way in is put back."""
    with np.printoptions(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import colour
    return colour


def _checked(wavelengths: npt.ArrayLike) -> FloatArray:
    """Wavelengths in nm, once they are known to be increasing and to cover what is seen."""
    found = filled(wavelengths) / nm
    if found.ndim != 1 or len(found) < 4:
        raise ValueError(f"wavelengths: expected shape (n,) with n of at least 4, got {found.shape}")
    if not (np.isfinite(found).all() and (np.diff(found) > 0.0).all()):
        raise ValueError("wavelengths: expected finite, increasing lengths in metres, got others")
    low, high = NEEDED
    if not (found[0] <= low * (1.0 + 1e-9) and found[-1] >= high * (1.0 - 1e-9)):
        raise ValueError(
            f"wavelengths: expected to reach from {low:g} nm to {high:g} nm, "
            f"got {found[0]:g} nm to {found[-1]:g} nm"
        )
    return found


def _lamps() -> dict[str, Any]:
    """Tables of lamps that cover what is seen."""
    every = _colour().SDS_ILLUMINANTS
    return {name: every[name] for name in every if every[name].wavelengths[-1] >= 780.0}


def _tabulated(name: str) -> tuple[FloatArray, FloatArray]:
    """Wavelengths in nm and relative power of a lamp; D and A go on to 830 nm by their formulas."""
    colour, lamps = _colour(), _lamps()
    if name not in lamps:
        near = difflib.get_close_matches(name, [*lamps, "E"], 3) or ["D65", "A", "E", "5000 K"]
        raise ValueError(f"illuminant: expected a name such as {', '.join(near)}, got {name!r}")
    table = lamps[name]
    if name in DAYLIGHT:
        point = colour.temperature.CCT_to_xy_CIE_D(DAYLIGHT[name] * RADIATION / RADIATION_THEN)
        formula = colour.sd_CIE_illuminant_D_series(point)
    elif name == "A":
        formula = colour.sd_CIE_standard_illuminant_A(colour.SpectralShape(300, LAST, STEP))
    else:
        return table.wavelengths, table.values
    beyond = formula.wavelengths > table.wavelengths[-1]
    return (
        np.concatenate([table.wavelengths, formula.wavelengths[beyond]]),
        np.concatenate([table.values, formula.values[beyond]]),
    )


def illuminant(light: Illuminant, wavelengths: npt.ArrayLike) -> FloatArray:
    """Relative spectral power of an illuminant; those of the CIE are 100 at 560 nm.

    Parameters
    ----------
    light : str or (wavelengths, power)
        "D65", "A", "E" (equal energy), "FL2", "LED-B3" and others of colour-science's tables; "5000 K", a
        black body; or a table of one's own (metres, any unit), 0 outside.
    wavelengths : (n,) array-like, metres

    Returns
    -------
    (n,) float64
        Linear between entries, as CIE 15 has it. Tables of the CIE that end below 830 nm go on: D by its
        components, A by its formula, the rest with their last value.

    Raises
    ------
    ValueError
        If the name is unknown, or the table is none.
    """
    at = filled(wavelengths)
    if not isinstance(light, str):
        own, power = (filled(part) for part in light)
        if own.ndim != 1 or own.shape != power.shape or not (np.diff(own) > 0.0).all() or power.min() < 0.0:
            raise ValueError("illuminant: expected increasing wavelengths and as many powers, none negative")
        return np.interp(at, own, power, left=0.0, right=0.0)
    if light == "E":
        return np.full(at.shape, 100.0)
    kelvin = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*K\s*", light)
    if kelvin and float(kelvin[1]) > 0.0:
        planck, temperature = _colour().colorimetry.planck_law, float(kelvin[1])
        power = planck(at, temperature) / planck(560.0 * nm, temperature)
        return np.reshape(100.0 * power, at.shape)
    return np.interp(at / nm, *_tabulated(light))


def observer(degrees: int, wavelengths: npt.ArrayLike) -> FloatArray:
    """Colour-matching functions of a CIE standard observer.

    Parameters
    ----------
    degrees : {2 (CIE 1931), 10 (CIE 1964)}
    wavelengths : (n,) array-like, metres

    Returns
    -------
    (n, 3) float64
        x, y, z; linear between the CIE's entries (1 nm), 0 outside of 360 nm to 830 nm.
    """
    if degrees not in OBSERVERS:
        raise ValueError(f"observer: expected 2 or 10 degrees, got {degrees!r}")
    table = _colour().MSDS_CMFS[OBSERVERS[degrees]]
    at = filled(wavelengths) / nm
    columns = [np.interp(at, table.wavelengths, column, left=0.0, right=0.0) for column in table.values.T]
    return np.stack(columns, axis=-1)


def _lagrange(points: FloatArray, samples: FloatArray) -> tuple[Array, list[FloatArray]]:
    """The first of four samples about each point, and the parts of all four in the cubic through them."""
    x = np.clip(points, samples[0], samples[-1])
    first = np.clip(np.searchsorted(samples, x, side="right") - 2, 0, len(samples) - 4)
    nodes = [samples[first + one] for one in range(4)]
    parts = [
        np.prod([(x - far) / (near - far) for far in (*nodes[:one], *nodes[one + 1 :])], axis=0)
        for one, near in enumerate(nodes)
    ]
    return first, parts


def _spread(points: FloatArray, values: FloatArray, samples: FloatArray) -> FloatArray:
    """Weights of samples, (samples, columns), from those of points between them."""
    first, parts = _lagrange(points, samples)
    weights = np.zeros((len(samples), values.shape[1]))
    for one, part in enumerate(parts):
        np.add.at(weights, first + one, part[:, None] * values)
    return weights


def _sums(samples: FloatArray, light: Illuminant | None, degrees: int) -> FloatArray:
    """(n, 3): samples (nm) times these add up to the integrals of x, y, z times light, over nm."""
    inside = samples[(samples > FIRST) & (samples < LAST)]
    points = np.union1d(np.arange(FIRST - STEP, LAST + 2.0 * STEP, STEP), inside)
    gaps = np.diff(points)
    widths = 0.5 * (np.append(gaps, 0.0) + np.append(0.0, gaps))
    power = np.ones(len(points)) if light is None else illuminant(light, points * nm)
    return _spread(points, observer(degrees, points * nm) * (widths * power)[:, None], samples)


def weights(wavelengths: npt.ArrayLike, illuminant: Illuminant = "D65", observer: int = 2) -> FloatArray:
    """Tristimulus weights: X, Y, Z are the samples of a reflectance times these.

    The integral is a sum over the CIE's 5 nm and all samples together (trapezium rule); between its
    samples a reflectance is Lagrange's cubic (as in ASTM E2022), beyond them it keeps its last value
    (CIE 15). Samples at the CIE's 5 nm thus give the CIE's sum, at 1 nm that over 1 nm.

    Parameters
    ----------
    wavelengths : (n,) array-like, metres
        Increasing, not necessarily evenly; at least from 400 nm to 700 nm.
    illuminant : str or (wavelengths, power)
        See `illuminant`.
    observer : {2, 10}

    Returns
    -------
    (n, 3) float64
        Their sum over Y is 1: white is what reflects everything.

    Raises
    ------
    ValueError
        If wavelengths fall short of what is seen, or the lamp or observer is unknown.
    """
    sums = _sums(_checked(wavelengths), illuminant, observer)
    brightness = sums[:, 1].sum()
    if not brightness > 0.0:
        raise ValueError("illuminant: expected light between 360 nm and 830 nm, got none")
    return np.asarray(sums / brightness)


def resolving_wavelengths(path: float = 0.0) -> FloatArray:
    """Wavelengths that resolve the fringes of an optical path difference.

    Parameters
    ----------
    path : float, metres
        The largest optical path difference of waves that interfere, 2 n d cos(theta) for a film.

    Returns
    -------
    (n,) float64, metres
        From 360 nm to 830 nm, even, at most 5 nm apart, and at 400 nm at least 6 to a fringe.
        Fringes are lambda^2 / path apart.
    """
    if not (np.isfinite(path) and path >= 0.0):
        raise ValueError(f"path: expected a length in metres, 0 or more, got {path!r}")
    step = min(STEP * nm, (0.4 * um) ** 2 / (PER_FRINGE * path)) if path else STEP * nm
    count = int(np.ceil(round((LAST - FIRST) * nm / step, 9)))
    return np.linspace(FIRST, LAST, count + 1) * nm


def _warn(values: FloatArray, samples: FloatArray, weights: FloatArray) -> None:
    """Warn of spectra in which samples are not what their neighbours let expect: fringes may alias."""
    if len(samples) < 8:
        return
    first, parts = _lagrange(samples[1::2], samples[::2])
    half = values[..., ::2]
    off = abs(values[..., 1::2] - sum(part * half[..., first + one] for one, part in enumerate(parts)))
    share = np.abs(weights[1::2, 1])
    mean = np.asarray(off @ (share / share.sum()))
    if many := int((mean > COARSE).sum()):
        warnings.warn(
            f"colours: {many} of {mean.size} spectra are sampled too coarsely "
            f"({np.median(np.diff(samples)):.3g} nm): from sample to sample they are off the cubic through "
            f"their neighbours by {mean.max():.2g} of white in the mean, and fringes may alias; "
            "take the wavelengths of spectra.samples(path)",
            FringetraceWarning,
            stacklevel=3,
        )


def xyz(
    reflectance: npt.ArrayLike, wavelengths: npt.ArrayLike, illuminant: Illuminant = "D65", observer: int = 2
) -> FloatArray:
    """CIE XYZ of reflectances (or transmittances); a perfect reflector has Y = 1.

    Of a BRDF in 1/sr give pi times it, for white is the Lambertian 1/pi. See `weights` for the integral.

    Parameters
    ----------
    reflectance : (..., n) array-like
    wavelengths : (n,) array-like, metres
        Increasing, at least from 400 nm to 700 nm.
    illuminant : str or (wavelengths, power)
        See `illuminant`.
    observer : {2, 10}, degrees

    Returns
    -------
    (..., 3) float64

    Raises
    ------
    ValueError
        If shapes do not agree, numbers are not finite, or see `weights`.

    Warns
    -----
    FringetraceWarning
        If samples do not follow from their neighbours: steps of wavelength have to be well below
        lambda^2 / D, D being the optical path difference, else fringes alias.
    """
    values = filled(reflectance)
    found = _checked(wavelengths)
    if values.ndim == 0 or values.shape[-1] != len(found):
        raise ValueError(f"reflectance: expected shape (..., {len(found)}), got {values.shape}")
    if not np.isfinite(values).all():
        raise ValueError(
            f"reflectance: expected finite numbers, got {int((~np.isfinite(values)).sum())} others"
        )
    sums = weights(wavelengths, illuminant, observer)
    _warn(values, found, sums)
    return np.asarray(values @ sums)


def white(illuminant: Illuminant = "D65", observer: int = 2) -> FloatArray:
    """CIE XYZ of the white point of an illuminant: (3,) float64, with Y = 1."""
    return np.asarray(weights(resolving_wavelengths(), illuminant, observer).sum(axis=0))


def luminance(radiance: npt.ArrayLike, wavelengths: npt.ArrayLike, observer: int = 2) -> FloatArray:
    """Luminance of a spectral radiance in cd/m^2: 683 lm/W times its integral with y.

    Parameters
    ----------
    radiance : (..., n) array-like, W/(m^2 sr m)
        Per metre of wavelength: 1e9 times that per nm.
    wavelengths : (n,) array-like, metres
    observer : {2, 10}

    Returns
    -------
    (...) float64, cd/m^2
        Of a spectral irradiance, W/(m^2 m): lux.
    """
    sums = _sums(_checked(wavelengths), None, observer)[:, 1]
    return np.asarray(EFFICACY * nm * (filled(radiance) @ sums))


def chromaticity(xyz: npt.ArrayLike) -> FloatArray:
    """CIE chromaticity x, y of X, Y, Z.

    Parameters
    ----------
    xyz : (..., 3) array-like

    Returns
    -------
    (..., 2) float64, NaN for black
    """
    values = filled(xyz)
    total = values.sum(axis=-1, keepdims=True)
    lit = total > 0.0
    return np.where(lit, values[..., :2] / np.where(lit, total, 1.0), np.nan)


def lab(xyz: npt.ArrayLike, illuminant: Illuminant = "D65", observer: int = 2) -> FloatArray:
    """CIE 1976 L*a*b* of X, Y, Z.

    Parameters
    ----------
    xyz : (..., 3) array-like, white has Y = 1
    illuminant, observer : those of the white

    Returns
    -------
    (..., 3) float64
        L from 0 to 100 (white), a, b.
    """
    colour = _colour()
    return np.asarray(colour.XYZ_to_Lab(np.asarray(xyz), chromaticity(white(illuminant, observer))))


def srgb(xyz: npt.ArrayLike, gamut: str = "clip", illuminant: Illuminant = "D65") -> FloatArray:
    """Screen colours (sRGB, IEC 61966-2-1) of X, Y, Z, with a choice of gamut mapping.

    Parameters
    ----------
    xyz : (..., 3) array-like, white has Y = 1
    gamut : {"clip", "desaturate", "linear"}
        What becomes of colours that no screen shows. "clip": each of linear R, G, B is cut to [0, 1].
        "desaturate": mixed with the grey of the same Y (1, if above it) until all lie in [0, 1].
        "linear": nothing; linear values, neither cut nor encoded.
    illuminant : str or (wavelengths, power)
        The lamp to which the eye is adapted: its white becomes that of the screen (Bradford). D65 changes
        nothing.

    Returns
    -------
    (..., 3) float64
        In [0, 1], encoded; times 255, rounded, they are bytes.
    """
    if gamut not in GAMUTS:
        raise ValueError(f"gamut: expected one of {', '.join(GAMUTS)}, got {gamut!r}")
    colour, values = _colour(), filled(xyz)
    if illuminant != "D65":
        seen, shown = white(illuminant), white("D65")
        adaptation = colour.adaptation.matrix_chromatic_adaptation_VonKries(seen, shown, transform="Bradford")
        values = values @ adaptation.T
    linear = values @ colour.RGB_COLOURSPACES["sRGB"].matrix_XYZ_to_RGB.T
    if gamut == "linear":
        return np.asarray(linear)
    if gamut == "desaturate":
        linear = _desaturated(linear, values[..., 1:2])
    return np.asarray(colour.models.eotf_inverse_sRGB(np.clip(linear, 0.0, 1.0)))


def _desaturated(linear: FloatArray, luminance: FloatArray) -> FloatArray:
    """Linear RGB mixed with grey of its luminance, as little as will do."""
    grey, chroma = np.clip(luminance, 0.0, 1.0), linear - luminance
    room = np.where(chroma > 0.0, 1.0 - grey, grey)
    part = np.where(np.abs(chroma) > room, room / np.where(chroma == 0.0, 1.0, np.abs(chroma)), 1.0)
    return np.asarray(grey + part.min(axis=-1, keepdims=True) * chroma)
