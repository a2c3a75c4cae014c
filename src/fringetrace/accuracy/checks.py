"""Warnings about images that cannot be trusted: where, by how much, and the remedy."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray, FringetraceWarning, checked_wavelength
from fringetrace.scene import CCD, Beam, pixel_indices
from fringetrace.tracing import Paths

if TYPE_CHECKING:
    from fringetrace.accuracy.error_budget import Budget

# Facets may cost this many waves, at the rms.
COSTLY = 1.0 / 20.0
# So many pixels, as a part of those lit, may be without rays, or have fringes too fine for them.
FEW = 0.01
# Rays in a part of the image, at the least, that tell the slopes of its waves.
ENOUGH = 4
# Path keys that are looked at one by one: those with the most rays.
KEYS = 8
# A wave is at its focus where a ray tube's area, between its neighbours, touches this part of theirs, or
# where it has become so narrow as a part of the beam, and as narrow as diffraction lets it.
TOUCH, NARROW = 0.1, 0.1


def found(paths: Paths, wavelength: float, method: str = "auto") -> list[str]:
    """Find all problems: contradicting media, aliased fringes; starved pixels and folds of ray sums.

    Of the wavefront method, foci and cusps on the CCD.

    Parameters
    ----------
    paths : Paths
        Onto a CCD.
    wavelength : float, metres
    method : {"auto", "wavefront", "rays"}
        How the field is found, see `complex_field`. The wavefront method needs no ray in each pixel, and
        knows folds.

    Returns
    -------
    list of str
    """
    from fringetrace.field import chosen

    seen = paths.detected
    if len(seen) == 0:
        text = media_contradiction(paths)
        return [] if text is None else [text]
    texts = [media_contradiction(paths), aliasing(seen, wavelength)]
    if chosen(paths, method) == "rays":
        texts += [starvation(seen), folding(seen)]
    else:
        texts.append(focusing(seen, wavelength))
    return [text for text in texts if text is not None]


def check(paths: Paths, wavelength: float, method: str = "auto") -> None:
    """Warn of the problems that `found` finds.

    Parameters
    ----------
    paths, wavelength, method
        As there.

    Warns
    -----
    FringetraceWarning
    """
    for text in found(paths, wavelength, method):
        warnings.warn(text, FringetraceWarning, stacklevel=3)


def check_budget(budget: Budget) -> None:
    """Warn of costly facets.

    Parameters
    ----------
    budget : Budget
    """
    text = costly(budget)
    if text is not None:
        warnings.warn(text, FringetraceWarning, stacklevel=3)


def judge(paths: Paths, wavelength: float, method: str = "auto") -> tuple[Budget, list[str]]:
    """Error budget of an image, and all warnings.

    Parameters
    ----------
    paths, wavelength, method
        As in `found`.

    Returns
    -------
    Budget
    list of str
    """
    from fringetrace.accuracy.error_budget import budget

    costs = budget(paths, wavelength, method)
    return costs, [*found(paths, wavelength, method), *filter(None, [costly(costs)])]


def media_contradiction(paths: Paths) -> str | None:
    """Contradicting media: rays reach a boundary in another medium than it has on that side.

    Parameters
    ----------
    paths : Paths

    Returns
    -------
    str or None
    """
    if paths.contradictions is None or not paths.contradictions.any():
        return None
    worst = int(np.argmax(paths.contradictions))
    surface, number = paths.scene.surfaces[worst], int(paths.contradictions[worst])
    sides = " and ".join((side or paths.scene.around).name for side in (surface.front, surface.back))
    return (
        f"media contradict: {number:,} rays came to {surface.name!r}, between {sides} (front and back), in "
        f"another medium; close its mesh, turn its normals to the front, name the media of what lies "
        f"before it, or take the bodies apart where they overlap"
    )


def aliasing(paths: Paths, wavelength: float) -> str | None:
    """Aliased fringes: the phase between two waves changes by more than pi per pixel.

    Slopes are means over the rays of one path key, in parts of the image that are as small as the
    rays allow.

    Parameters
    ----------
    paths : Paths
        Detected.
    wavelength : float, metres

    Returns
    -------
    str or None
    """
    ccd = _ccd(paths)
    size = max(1, int(np.ceil(np.sqrt(ENOUGH * ccd.shape[0] * ccd.shape[1] / _rays(paths)))))
    rows, columns = (-(-n // size) for n in ccd.shape)
    at = pixel_indices(ccd, paths.pixel) // size
    part = at[:, 0] * columns + at[:, 1]
    kinds, which = np.unique(paths.key, return_inverse=True)
    if len(kinds) < 2:
        return None
    group, member, count = np.unique(
        part * len(kinds) + which.ravel(), return_inverse=True, return_counts=True
    )
    u, v, _ = ccd.axes
    step = np.zeros(rows * columns)
    for axis in (u, v):
        mean = np.bincount(member.ravel(), paths.gradient @ axis) / count
        low, high = np.full(len(step), np.inf), np.full(len(step), -np.inf)
        np.minimum.at(low, group // len(kinds), mean)
        np.maximum.at(high, group // len(kinds), mean)
        step = np.maximum(step, np.where(high > low, high - low, 0.0) * ccd.pitch)
    cycles = step / checked_wavelength(wavelength)
    bad = cycles > 0.5
    if bad.sum() <= FEW * len(np.unique(part)):
        return None
    worst = int(np.argmax(cycles))
    row, column = (n * size + size // 2 for n in divmod(worst, columns))
    number = min(int(bad.sum()) * size**2, ccd.shape[0] * ccd.shape[1])
    return (
        f"fringes alias: the phase steps by more than pi a pixel at {number:,} of "
        f"{ccd.shape[0] * ccd.shape[1]:,} pixels, by {2.0 * cycles[worst]:.3g} pi about [{row}, {column}]; "
        f"take {np.ceil(2.0 * cycles[worst]):.0f} times as many pixels along either axis, or less tilt"
    )


def starvation(paths: Paths) -> str | None:
    """Starved pixels: no ray, though pixels on both sides have some.

    Parameters
    ----------
    paths : Paths
        Detected.

    Returns
    -------
    str or None
    """
    ccd = _ccd(paths)
    holes, lit = np.zeros(ccd.shape, dtype=np.bool_), np.zeros(ccd.shape, dtype=np.bool_)
    row, column = pixel_indices(ccd, paths.pixel).T
    for some in _commonest(paths):
        bright = np.zeros(ccd.shape, dtype=np.bool_)
        bright[row[some], column[some]] = True
        lit |= bright
        holes |= _between(bright) & ~bright
    number, total = int(holes.sum()), int((lit | holes).sum())
    if number <= FEW * total:
        return None
    row, column = np.argwhere(holes)[0]
    wanted = ""
    if isinstance(paths.source, Beam):
        # a ray a pixel leaves holes where light spreads: two, and what is missing
        more = np.ceil(2.0 * np.sqrt(total / max(total - number, 1)))
        shape = (int(max(n, more * p)) for n, p in zip(paths.source.shape, ccd.shape, strict=True))
        wanted = "a beam of {} x {} rays, or ".format(*shape)
    return (
        f"pixels starve: {number:,} of {total:,} lit pixels got no ray of a wave that lights both their "
        f'sides, the first [{row}, {column}]; take {wanted}method="wavefront"'
    )


def folding(paths: Paths) -> str | None:
    """Folded wavefronts on the CCD: neighbouring rays arrive in reversed order.

    Where facets fold the light only cells across their edges are turned over, one cell wide: that is none.

    Parameters
    ----------
    paths : Paths
        Detected.

    Returns
    -------
    str or None
    """
    if not isinstance(paths.source, Beam):
        return None
    number, total, where = 0, 0, None
    for some in _commonest(paths):
        turned, known, pixel = _turned(paths.ray[some], paths.pixel[some], paths.source.shape)
        over, back = _broad(turned & known), _broad(~turned & known)
        if not (over.any() and back.any()):
            continue
        less = over if over.sum() < back.sum() else back
        number, total = number + int(less.sum()), total + int(known.sum())
        if where is None:
            where = np.floor(pixel[tuple(np.argwhere(less)[0])]).astype(int)
    if where is None:
        return None
    return (
        f"a wave folds over the CCD: {number:,} of its {total:,} cells of four rays arrive turned over, "
        f"the first at pixel [{where[0]}, {where[1]}]; a sum of rays lacks the phase of the caustic, -pi/2: "
        'take method="wavefront"'
    )


def focusing(paths: Paths, wavelength: float) -> str | None:
    """Foci and cusps on the CCD, where the irradiance of rays is infinite.

    A fold alone is none: the wavefront method knows its uniform form. Looked for in waves off forms.

    Parameters
    ----------
    paths : Paths
        Detected.
    wavelength : float, metres

    Returns
    -------
    str or None
    """
    if not isinstance(paths.source, Beam):
        return None
    number, where = 0, None
    for some in _commonest(paths):
        wave = paths.where(np.isin(np.arange(len(paths)), some))
        if not _smooth(wave):
            continue
        pixel = _grid(wave.ray, wave.pixel, paths.source.shape)
        singular = np.isfinite(pixel[..., 0]) if _narrowest(wave, wavelength) else _pinched(pixel)
        number += int(singular.sum())
        if where is None and singular.any():
            where = np.floor(pixel[tuple(np.argwhere(singular)[0])]).astype(int)
    if where is None:
        return None
    return (
        f"a wave comes to a focus or a cusp on the CCD: about {number:,} of its rays, the first at pixel "
        f"[{where[0]}, {where[1]}]; the light of rays is infinite there: take pixels away from it, or look "
        "at a plane before or beyond it"
    )


def costly(budget: Budget) -> str | None:
    """Costly facets: their path error exceeds a twentieth of a wave.

    Parameters
    ----------
    budget : Budget

    Returns
    -------
    str or None
    """
    if budget.facets <= COSTLY or budget.costliest is None:
        return None
    name, worst = budget.costliest
    finer = np.sqrt(budget.facets / COSTLY)
    return (
        f"facets cost {budget.facets:.2g} waves rms, over 1/20: those of {name!r} up to {worst:.2g}; if they "
        "stand for a smooth surface, give it a form, such as forms.Smooth(), or facets "
        f"{finer:.1f} times as small"
    )


def _ccd(paths: Paths) -> CCD:
    if paths.ccd is None:
        raise ValueError("guards: expected paths traced onto a CCD, got paths without one")
    return paths.ccd


def _rays(paths: Paths) -> int:
    """Rays of the commonest path key."""
    return int(np.unique(paths.key, return_counts=True)[1].max())


def _commonest(paths: Paths) -> Iterator[Array]:
    """The rows of each of the commonest path keys."""
    keys, count = np.unique(paths.key, return_counts=True)
    for kind in np.argsort(-count, kind="stable")[:KEYS]:
        yield np.flatnonzero(paths.key == keys[kind])


def _between(bright: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Pixels with light on both sides, in their row or in their column."""
    padded = np.pad(bright, 1)
    beside = padded[1:-1, :-2] & padded[1:-1, 2:]
    above = padded[:-2, 1:-1] & padded[2:, 1:-1]
    return np.asarray(beside | above)


def _turned(ray: Array, pixel: FloatArray, shape: tuple[int, int]) -> tuple[Array, Array, FloatArray]:
    """Of each cell of four rays: whether it arrives turned over, whether all four do arrive, and where."""
    grid = _grid(ray, pixel, shape)
    along = grid[:-1, 1:] - grid[:-1, :-1]
    up = grid[1:, :-1] - grid[:-1, :-1]
    area = along[..., 0] * up[..., 1] - along[..., 1] * up[..., 0]
    known = np.isfinite(area) & np.isfinite(grid[1:, 1:, 0])
    return np.nan_to_num(area) > 0.0, known, grid[:-1, :-1]


def _broad(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Cells in a square of 2 x 2 of the mask, with no thin lines."""
    square = mask[:-1, :-1] & mask[1:, :-1] & mask[:-1, 1:] & mask[1:, 1:]
    padded = np.pad(square, 1)
    return np.asarray(padded[:-1, :-1] | padded[1:, :-1] | padded[:-1, 1:] | padded[1:, 1:])


def _grid(ray: Array, pixel: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Where the rays of a beam arrive, (rows, columns, 2); NaN where they do not."""
    place = np.full((shape[0] * shape[1], 2), np.nan)
    place[ray] = pixel
    return place.reshape(*shape, 2)


def _smooth(wave: Paths) -> bool:
    """Whether paths of one key met a surface with a form, or come from none that has facets."""
    if wave.points is not None and wave.triangle is None:
        return True
    formed = [number for number, surface in enumerate(wave.scene.surfaces) if surface.form is not None]
    return any(wave.visits(number)[0] for number in formed)


def _narrowest(wave: Paths, wavelength: float) -> bool:
    """Whether light has narrowed, either way, to what diffraction leaves of it: width times aperture."""
    assert isinstance(wave.source, Beam)
    size = max(wave.source.size)
    for axis in _ccd(wave).axes[:2]:
        width, aperture = np.ptp(wave.origin @ axis), np.ptp(wave.gradient @ axis)
        if width < NARROW * size and width * aperture < wavelength < size * aperture:
            return True
    return False


def _pinched(pixel: FloatArray) -> npt.NDArray[np.bool_]:
    """Nodes of a beam's grid about which its map to the CCD is more singular than on a fold.

    The area of ray tubes is 0 without changing its sign, or changes it along the line on which it is 0:
    there that line and the direction in which tubes close are one (Whitney's cusp).
    """
    along, up = _differences(pixel, 1), _differences(pixel, 0)
    area = along[..., 0] * up[..., 1] - along[..., 1] * up[..., 0]
    found = np.zeros(area.shape, dtype=np.bool_)
    for axis in (0, 1):
        before, after = np.roll(area, 1, axis), np.roll(area, -1, axis)
        sign, low = np.sign(before), np.minimum(np.abs(before), np.abs(after))
        between = (np.sign(after) == sign) & (np.abs(area) <= low)
        with np.errstate(invalid="ignore", divide="ignore"):
            least = area - (after - before) ** 2 / (8.0 * (after - 2.0 * area + before))
        found |= between & (sign * least < TOUCH * np.maximum(np.abs(before), np.abs(after)))
    return found | _cusps(area, along, up)


def _cusps(area: FloatArray, along: FloatArray, up: FloatArray) -> npt.NDArray[np.bool_]:
    """Nodes at whose cell the area changes sign, and its slope along the direction that closes, too."""
    slope_up, slope_along = np.gradient(area)
    # columns of the adjugate: where the area is 0 both lie along the direction that closes
    closes = [up[..., k] * slope_along - along[..., k] * slope_up for k in (0, 1)]
    weight = [along[..., k] ** 2 + up[..., k] ** 2 for k in (0, 1)]
    found = np.zeros(area.shape, dtype=np.bool_)
    first = _corners(weight[0]).sum(axis=0) > _corners(weight[1]).sum(axis=0)
    slope = np.where(first, _corners(closes[0]), _corners(closes[1]))
    corner = _corners(area)
    both = (corner.min(axis=0) < 0.0) & (corner.max(axis=0) > 0.0)
    found[:-1, :-1] = both & (slope.min(axis=0) < 0.0) & (slope.max(axis=0) > 0.0)
    return found


def _corners(values: Array) -> Array:
    """(4, rows - 1, columns - 1): values at the corners of cells."""
    return np.stack([values[:-1, :-1], values[1:, :-1], values[:-1, 1:], values[1:, 1:]])


def _differences(values: FloatArray, axis: int) -> FloatArray:
    """Differences of fourth order from node to node; NaN at the rim."""
    beside, next_ = (np.roll(values, -n, axis) - np.roll(values, n, axis) for n in (1, 2))
    slope = (8.0 * beside - next_) / 12.0
    rows = np.arange(values.shape[axis])
    rim = (rows < 2) | (rows >= len(rows) - 2)
    return np.where(np.expand_dims(rim, tuple(k for k in range(3) if k != axis)), np.nan, slope)
