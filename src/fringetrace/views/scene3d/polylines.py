"""Ray polylines to draw: a sample of paths with optical path and phase at each point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray, checked_wavelength, path_phase, short_repr
from fringetrace.instruments import Mark
from fringetrace.scene import CCD, Beam
from fringetrace.tracing import Fate, Paths, Segments, at_wavelength, surface_phase

# Routes that have a name of their own; one more is for all the rest.
ROUTES = 6
# Where the light is chosen from that is drawn: a fixed seed, so that a picture can be made again.
SEED = 0
# The wavelengths that a slider goes through, parts of that of the picture.
RANGE = 0.8, 1.25


@dataclass(frozen=True, eq=False)
class Strands:
    """Ray polylines: m paths of k points each (start, hits, end), padded with NaN or -1.

    Attributes
    ----------
    points : (m, k, 3) float64, metres
        The last one is on the chip itself, or a bit on where light left.
    starts : (m, k - 1, 3) float64, metres
        Where each segment starts: beside its point, where an element displaced the light.
    opl : (m, k) float64, metres
        Optical path from the start, at the wavelength of the picture; on the chip that to its plane of focus.
    phase : (w, m, k) float64, turns from 0 to 1
        At each wavelength, with what surfaces turned it by so far. Thin elements, films and boundaries are
        known by what they do in all: it stands behind the last one.
    steps : (m, k) int64
        How often a phase step turns the light up to there.
    wavelengths : (w,) float64, metres
        Empty: there is no phase. Those that need no new trace.
    chosen : int
        Which of them is that of the picture.
    surface : (m, k - 2) int64
        Number of each surface met.
    through : (m, k - 2) bool
        Whether light went on through it.
    index : (m, k - 1) float64
        Real refractive index along each segment.
    row, beam, ray, fate, bounces, route : (m,) int64
    power : (m,) float64
        With which the path ends, relative to unit amplitude.
    surfaces, routes : tuple of str
        Names.
    rays : int
        Rays that there are; as many as differ in `beam` and `ray` are shown.
    focused : bool
        Whether the CCD is focused on another plane than its own.
    """

    points: FloatArray
    starts: FloatArray
    opl: FloatArray
    phase: FloatArray
    steps: npt.NDArray[np.int64]
    wavelengths: FloatArray
    chosen: int
    surface: npt.NDArray[np.int64]
    through: npt.NDArray[np.bool_]
    index: FloatArray
    row: npt.NDArray[np.int64]
    beam: npt.NDArray[np.int64]
    ray: npt.NDArray[np.int64]
    fate: npt.NDArray[np.int64]
    bounces: npt.NDArray[np.int64]
    route: npt.NDArray[np.int64]
    power: FloatArray
    surfaces: tuple[str, ...]
    routes: tuple[str, ...]
    rays: int
    focused: bool = False

    __repr__ = short_repr

    def __len__(self) -> int:
        return len(self.ray)

    @property
    def shown(self) -> int:
        """Numbers of the rays that are shown."""
        return len(np.unique(np.stack([self.beam, self.ray]), axis=1).T)

    @property
    def caption(self) -> str:
        """Caption: number of rays, and how many of them are shown."""
        return f"{self.shown:,} of {self.rays:,} rays" if self.shown < self.rays else f"{self.rays:,} rays"

    def legs(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Path and bounce of every segment, from start [path, bounce] to point [path, bounce + 1].

        Returns
        -------
        path, bounce : (legs,) int64
        """
        path, bounce = np.nonzero(np.isfinite(self.points[:, 1:, 0]))
        return path, bounce


def strands(
    parts: Paths | Sequence[Paths],
    wavelength: float | None = None,
    *,
    most: int = 1000,
    every: bool = False,
    reference: Mark | None = None,
    sweep: int = 1,
    onward: float = 0.0,
) -> Strands:
    """Ray polylines of a sample of paths.

    Parameters
    ----------
    parts : Paths, or a sequence of them
        Traced with record=True; several beams through one scene.
    wavelength : float, metres, optional
        None: that of the trace; if it has none there is no phase.
    most : int
        Rays to show; a fixed sample if there are more.
    every : bool
        Also paths that do not reach the CCD, though others do, and all paths of rays that split. Else one
        path of each ray: they share legs, and colours would hide.
    reference : Mark, optional
        What a phase step turns; None: all light.
    sweep : int
        Wavelengths at which phases are wanted, over `RANGE`; those of them that need no new trace.
    onward : float, metres
        How far light that left is drawn.

    Returns
    -------
    Strands

    Raises
    ------
    ValueError
        If there are no paths, or none with points; for a wavelength that takes a new trace.
    """
    parts = [parts] if isinstance(parts, Paths) else list(parts)
    if not parts:
        raise ValueError("rays to draw: expected at least one Paths, got none")
    if any(paths.points is None for paths in parts):
        raise ValueError("picture: expected paths traced with record=True, got paths without points")
    if most < 1:
        raise ValueError(f"rays to draw: expected at least 1, got {most}")
    rays = [len(np.unique(paths.ray)) for paths in parts]
    routes, named = _routes(parts)
    found = []
    for number, (paths, route) in enumerate(zip(parts, named, strict=True)):
        share = max(1, most * rays[number] // max(1, sum(rays)))
        rows = _sampled(paths, route, share, every)
        found.append(_strands(paths.where(rows), wavelength, reference, sweep, onward))
        columns: dict[str, Any] = {"row": rows, "beam": np.full(len(rows), number), "route": route[rows]}
        found[-1] = replace(found[-1], **columns, routes=routes, rays=sum(rays))
    return _joined(found)


def _routes(parts: Sequence[Paths]) -> tuple[tuple[str, ...], list[npt.NDArray[np.int64]]]:
    """Names of the sequences of surfaces that light took, the most common ones first, and who took which."""
    names = [surface.name for surface in parts[0].scene.surfaces]
    met: dict[str, int] = {}
    kinds = []
    for paths in parts:
        assert paths.surface is not None
        seen = paths.fate == Fate.DETECTED
        shown = seen if seen.any() else np.ones(len(paths), dtype=bool)
        some, which = np.unique(paths.surface, axis=0, return_inverse=True)
        texts = [", ".join(names[surface] for surface in kind if surface >= 0) or "straight" for kind in some]
        count = np.bincount(which.ravel()[shown], minlength=len(some))
        for text, number in zip(texts, count, strict=True):
            met[text] = met.get(text, 0) + int(number)
        kinds.append((texts, which.ravel()))
    order = sorted(met, key=lambda text: -met[text])
    routes = (*order[:ROUTES], *(["other paths"] if len(order) > ROUTES else []))
    place = {text: min(number, ROUTES) for number, text in enumerate(order)}
    return routes, [np.array([place[t] for t in texts], dtype=np.int64)[which] for texts, which in kinds]


def _sampled(paths: Paths, route: npt.NDArray[np.int64], most: int, every: bool) -> npt.NDArray[np.int64]:
    """Rows of some rays; each ray on one path, and those in turn on one after the other, unless `every`."""
    seen = paths.fate == Fate.DETECTED
    rows = np.flatnonzero(seen) if seen.any() and not every else np.arange(len(paths))
    rays, which = np.unique(paths.ray[rows], return_inverse=True)
    if len(rays) > most:
        chosen = np.sort(np.random.default_rng(SEED).choice(len(rays), most, replace=False))
        kept = np.isin(which, chosen)
        rows, which = rows[kept], np.searchsorted(chosen, which[kept])
    if every or not len(rows):
        return rows
    order = np.lexsort((route[rows], which))
    rows, which = rows[order], which[order]
    first = np.flatnonzero(np.diff(which, prepend=-1))
    count = np.diff(first, append=len(which))
    return np.asarray(rows[first + np.arange(len(first)) % count], dtype=np.int64)


def _strands(
    paths: Paths, wavelength: float | None, reference: Mark | None, sweep: int, onward: float
) -> Strands:
    """All of some paths of one beam."""
    if wavelength is not None:
        paths = at_wavelength(paths, checked_wavelength(wavelength))
    surface = paths.surface
    assert surface is not None
    base = paths.wavelength if wavelength is None else wavelength
    wavelengths, chosen = _sweep(paths, base, sweep)
    segments, launched = Segments.of(paths), getattr(paths.source, "length", None)
    brought = 0.0 if launched is None else launched[paths.ray]
    opl = segments.optical_path(brought)
    phases = []
    for one in wavelengths:
        there = at_wavelength(paths, float(one))
        turns = path_phase(Segments.of(there).optical_path(brought), one)
        turns = turns + surface_phase(there, segments.through)
        phases.append(np.mod(turns / (2.0 * np.pi), 1.0))
    phase = np.stack(phases) if phases else np.empty((0, *opl.shape))
    points, starts, beyond = _ended(paths, onward)
    opl[beyond] += onward * segments.index[beyond[0], beyond[1] - 1]
    return Strands(
        points=points, starts=starts, opl=np.where(np.isfinite(points[..., 0]), opl, np.nan), phase=phase,
        steps=_steps(paths, reference), wavelengths=wavelengths, chosen=chosen, surface=surface,
        through=segments.through, index=segments.index, row=np.arange(len(paths)),
        beam=np.zeros(len(paths), dtype=np.int64),
        ray=paths.ray, fate=paths.fate.astype(np.int64), bounces=paths.bounces.astype(np.int64),
        route=np.zeros(len(paths), dtype=np.int64), power=np.abs(paths.amplitude) ** 2,
        surfaces=tuple(surface.name for surface in paths.scene.surfaces), routes=(), rays=0,
        focused=isinstance(paths.ccd, CCD) and paths.ccd.focus != 0.0,
    )  # fmt: skip


def _sweep(paths: Paths, base: float | None, count: int) -> tuple[FloatArray, int]:
    """Wavelengths of a slider, that of the picture among them; it alone where others go another way."""
    if base is None:
        return np.empty(0), 0
    low, high = (base * end for end in RANGE)
    if count < 2:
        return np.array([base]), 0
    try:
        for end in (low, high):
            at_wavelength(paths, end)
    except ValueError:
        return np.array([base]), 0
    below = max(1, round((count - 1) * (base - low) / (high - low)))
    above = max(1, count - 1 - below)
    steps = [np.linspace(low, base, below + 1), np.linspace(base, high, above + 1)[1:]]
    return np.concatenate(steps), below


def _steps(paths: Paths, reference: Mark | None) -> npt.NDArray[np.int64]:
    """How often a phase step turns the light at each point."""
    assert paths.points is not None
    assert paths.surface is not None
    steps = np.ones(paths.points.shape[:2], dtype=np.int64)
    if reference is None:
        return steps
    met = np.cumsum(paths.surface == reference.surface, axis=1) > 0
    steps[:, 0] = 0
    steps[:, 1:-1] = met
    steps[:, -1] = met.any(axis=1)
    count: npt.NDArray[np.int64] = reference.sense * reference.count(paths)
    return np.asarray(steps * count[:, None], dtype=np.int64)


def _ended(paths: Paths, onward: float) -> tuple[FloatArray, FloatArray, tuple[Array, Array]]:
    """Points with ends on the chip itself (not in its plane of focus), or a bit on where light left."""
    assert paths.points is not None
    points = paths.points.copy()
    end = np.isfinite(points[..., 0]).sum(axis=1) - 1
    if isinstance(paths.ccd, CCD):
        seen = np.flatnonzero(paths.fate == Fate.DETECTED)
        ccd, direction = paths.ccd, paths.direction[seen]
        last = points[seen, end[seen]]
        back = ccd.focus / (direction @ ccd.axes[2])  # to the plane of focus, as it was
        points[seen, end[seen]] = last - back[:, None] * direction
    left = np.flatnonzero(paths.fate == Fate.LEFT)
    beyond = left, end[left] + 1
    assert paths.starts is not None
    starts = np.where(np.isfinite(paths.starts), paths.starts, points[:, :-1])
    points[beyond] = starts[left, end[left]] + onward * paths.direction[left]
    return points, starts, beyond


def _joined(parts: Sequence[Strands]) -> Strands:
    """Strands of several beams as one."""
    if len(parts) == 1:
        return parts[0]
    width = max(part.points.shape[1] for part in parts)
    columns: dict[str, Any] = {}
    for name in (field.name for field in fields(Strands)):
        arrays = [getattr(part, name) for part in parts]
        if not isinstance(arrays[0], np.ndarray) or name == "wavelengths":
            continue
        axis = 1 if name == "phase" else 0
        missing = [width - part.points.shape[1] for part in parts]
        padded = [_padded(one, axis + 1, more, name) for one, more in zip(arrays, missing, strict=True)]
        columns[name] = np.concatenate(padded, axis=axis)
    return replace(parts[0], **columns)


def _padded(array: Array, axis: int, more: int, name: str) -> Array:
    if array.ndim <= axis or not more:
        return array
    blank = np.nan if array.dtype.kind == "f" else -1 if name == "surface" else 0
    return np.pad(array, [(0, more if at == axis else 0) for at in range(array.ndim)], constant_values=blank)


def start_of(source: Any, points: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Start, direction and width of the light of a source.

    Parameters
    ----------
    source : Beam or Rays
    points : (m, k, 3) float64, metres
        Of its strands.

    Returns
    -------
    centre : (3,) float64, metres
    direction : (3,) float64
        Of length 0 where light goes anywhere.
    size : float, metres
    """
    if isinstance(source, Beam):
        return source.centre, source.direction, float(np.hypot(*source.size))
    starts, legs = points[:, 0], points[:, 1] - points[:, 0]
    with np.errstate(invalid="ignore"):
        mean = np.nan_to_num(legs / np.linalg.norm(legs, axis=1, keepdims=True)).mean(axis=0)
    return starts.mean(axis=0), mean, float(np.linalg.norm(np.ptp(starts, axis=0)))
