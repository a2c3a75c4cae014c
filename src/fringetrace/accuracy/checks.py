"""Warnings about images that cannot be trusted: where, by how much, and the remedy."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray, warn_once
from fringetrace.scene import CCD, Beam, pixel_indices
from fringetrace.tracing import Losses, Paths

# So many pixels, as a part of those lit, may be without rays.
FEW = 0.01
# Path keys that are looked at one by one: those with the most rays.
KEYS = 8
# A wave is at its focus where a ray tube's area, between its neighbours, touches this part of theirs, or
# where it has become so narrow as a part of the beam, and as narrow as diffraction lets it.
TOUCH, NARROW = 0.1, 0.1


def found(paths: Paths, wavelength: float, method: str = "auto") -> dict[str, str]:
    """Find all problems of a trace and of its image: the text of each warning by its name.

    Of any trace those of `fringetrace.tracing.checks`: power cut off, contradicting media, open boundaries.
    Of light on a CCD aliased fringes, and starved pixels and folds of ray sums, or foci and cusps.

    Parameters
    ----------
    paths : Paths
    wavelength : float, metres
    method : {"auto", "wavefront", "rays"}
        How the field is found, see `complex_field`. The wavefront method needs no ray in each pixel, and
        knows folds.

    Returns
    -------
    dict of str to str
    """
    from fringetrace.field import aliasing, chosen

    problems, seen = Losses.of(paths).problems, paths.detected
    if paths.ccd is None or len(seen) == 0:
        return problems
    texts = {"fringes alias": aliasing(paths, wavelength)}
    method = chosen(paths, method)
    if method == "rays":
        texts |= {"pixels starve": starvation(seen), "a wave folds": folding(seen)}
    elif method == "wavefront":
        texts["a wave comes to a focus"] = focusing(seen, wavelength)
    return problems | {name: text for name, text in texts.items() if text is not None}


def check(paths: Paths, wavelength: float, method: str = "auto") -> None:
    """Warn of the problems that `found` finds, of each once.

    Parameters
    ----------
    paths, wavelength, method
        As there.

    Warns
    -----
    FringetraceWarning
    """
    known = paths.derived.setdefault("checked", set())
    if (wavelength, method) not in known:
        known.add((wavelength, method))
        warn_once(found(paths, wavelength, method), paths.warned)


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


def _ccd(paths: Paths) -> CCD:
    if paths.ccd is None:
        raise ValueError("checks: expected paths traced onto a CCD, got paths without one")
    return paths.ccd


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
