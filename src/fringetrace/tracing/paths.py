"""Traced paths: ends and fates, optical path lengths and amplitudes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from html import escape
from typing import Any

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray, described, length_text
from fringetrace.scene import CCD, Beam, Scene, pixels
from fringetrace.tracing.fates import Fate
from fringetrace.tracing.ledger import Ledger
from fringetrace.tracing.rays import Rays


@dataclass(frozen=True, eq=False)
class Paths:
    """Traced paths: one row per end, sorted by ray; a ray that splits has several.

    Attributes
    ----------
    ray : (m,) int64
        Number of the ray in its batch, or in its beam's scan order.
    fate : (m,) int8
        A `Fate`.
    bounces : (m,) int32
        Surfaces met: reflections and transmissions.
    reflections : (m,) int32
        How many of them were reflections off mirrors.
    length : (m,) float64, metres
        Optical path up to the last hit, or to the CCD (to the plane that it is focused on).
    origin : (m, 3) float64, metres
        The last hit, or the point in the CCD's plane.
    direction : (m, 3) float64, unit
        Direction in which the path went on, or arrived.
    amplitude : (m,) complex128
        Launched amplitude times that of every surface on the way; 0 where absorbed.
    lost : (m,) float64
        Power absorbed on the way, relative to unit amplitude.
    key : (m,) uint64
        Names the sequence of surfaces and branches; equal sequences have equal keys.
    area : float or None, m^2
        Beam cross-section that each ray stands for.
    incident : float
        Sum of |amplitude|^2 of the rays that were launched.
    segments : int
        Ray segments traced.
    doubtful : int
        Hits that were decided exactly.
    surface, triangle : (m, b) int64, or None unless recorded
        Surface and its triangle at each bounce, padded with -1.
    points : (m, b + 2, 3) float64, metres, or None unless recorded
        Start, hits, and the end on the CCD, padded with NaN.
    branch : (m, b) int8, or None unless recorded
        Branch taken at each hit: 0 reflected (or absorbed), 1 transmitted, 2 and more the further ones of
        an element, whose first is 1; padded with -1.
    media : (m, b + 1) int32, or None unless recorded among media
        Number of the medium on each segment, padded with -1.
    indices : (m, b + 1) float64, or None unless recorded among media
        Real refractive index for the ray on each segment, |Re k| / k0; padded with NaN.
    departures : (m, b + 1, 3) float64, metres, or None unless recorded among thin elements
        Where light went on from the start and each hit: beside it, where an element displaced it.
    advances : (m, b) float64, metres, or None unless recorded among thin elements
        Optical path that an element added at each hit; padded with 0.
    wavelength : float or None, metres
        That of the trace, where the scene has media; None: any.
    medium : (m,) int32
        Number of the medium where the path ended, see `media.materials`. This and what follows is None
        where light meets nothing but constant amplitudes in a vacuum.
    index : (m,) float64
        Real refractive index there.
    lengths : (m, media) float64, metres
        Way in each medium.
    field : (m, 3) complex128, or None where light has no polarisation
        The field as a vector; `amplitude` is then its size.
    dropped : (m,) float64
        Power of branches that were not followed, relative to unit amplitude.
    bend : (m,) float64
        Largest sin^2 of incidence at a boundary of media; 2 behind elements that depend on the wavelength.
    contradictions : (surfaces,) int64
        How often rays came to a boundary in another medium than it has on that side.
    scene, source, ccd
        What was traced.
    min_amplitude : float
        Branches below this part of the launched amplitude were not followed.
    """

    ray: npt.NDArray[np.int64]
    fate: npt.NDArray[np.int8]
    bounces: npt.NDArray[np.int32]
    reflections: npt.NDArray[np.int32]
    length: FloatArray
    origin: FloatArray
    direction: FloatArray
    amplitude: ComplexArray
    lost: FloatArray
    key: npt.NDArray[np.uint64]
    area: float | None
    incident: float
    segments: int
    doubtful: int
    scene: Scene
    source: Beam | Rays
    ccd: CCD | None
    surface: npt.NDArray[np.int64] | None = None
    triangle: npt.NDArray[np.int64] | None = None
    points: FloatArray | None = None
    branch: npt.NDArray[np.int8] | None = None
    media: npt.NDArray[np.int32] | None = None
    indices: FloatArray | None = None
    departures: FloatArray | None = None
    advances: FloatArray | None = None
    wavelength: float | None = None
    medium: npt.NDArray[np.int32] | None = None
    index: FloatArray | None = None
    lengths: FloatArray | None = None
    field: ComplexArray | None = None
    dropped: FloatArray | None = None
    bend: FloatArray | None = None
    contradictions: npt.NDArray[np.int64] | None = None
    min_amplitude: float = 1e-6
    # what is worked out from the paths once, such as their wavefronts
    derived: dict[str, Any] = dataclasses.field(default_factory=dict, init=False, repr=False)

    def __repr__(self) -> str:
        found = [(fate.name.lower(), int((self.fate == fate).sum())) for fate in Fate]
        fates = ", ".join(f"{count:,} {name}" for name, count in found if count)
        ends = self.detected if len(self.detected) else self
        return described(
            self,
            f"{len(self):,} paths: {fates}" if len(self) else "no paths",
            _range_text("{} to {} bounces", self.bounces, str),
            _range_text("optical paths {} to {}", ends.length, length_text),
            "" if self.wavelength is None else f"at {length_text(self.wavelength)}",
            "recorded" if self.points is not None else "",
            "polarised" if self.field is not None else "",
        )

    def _repr_html_(self) -> str:
        return f"<div>{escape(repr(self))}</div>{self.ledger()._repr_html_()}"

    def __len__(self) -> int:
        return len(self.ray)

    @property
    def warned(self) -> set[str]:
        """Names of the warnings that were given of these paths, and of others of the same trace."""
        given: set[str] = self.derived.setdefault("warned", set())
        return given

    def where(self, mask: Array) -> Paths:
        """Subset of the paths.

        Parameters
        ----------
        mask : (m,) bool, or indices

        Returns
        -------
        Paths
            The incident power, segments and doubtful hits stay those of the whole trace.
        """
        chosen = {name: getattr(self, name)[mask] for name in COLUMNS if getattr(self, name) is not None}
        return self.changed(**chosen)

    def changed(self, **columns: Any) -> Paths:
        """The same paths with other columns; what was warned of is not warned of again."""
        paths = replace(self, **columns)
        paths.derived["warned"] = self.warned
        return paths

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)} | {"derived": {}}

    @cached_property
    def detected(self) -> Paths:
        """Paths that reached the CCD."""
        seen = self.fate == Fate.DETECTED
        return self if seen.all() else self.where(seen)

    @cached_property
    def pixel(self) -> FloatArray:
        """CCD coordinates (row, column) in pixels, (m, 2) float64; NaN where not detected.

        Pixel [i, j] spans [i, i+1) x [j, j+1).
        """
        pixel = np.full((len(self), 2), np.nan)
        if self.ccd is not None:
            seen = np.flatnonzero(self.fate == Fate.DETECTED)
            pixel[seen] = pixels(self.ccd, self.origin[seen])
        pixel.setflags(write=False)  # kept
        return pixel

    @property
    def starts(self) -> FloatArray | None:
        """Start points of segments, if recorded, (m, b + 1, 3) float64, metres; padded with NaN."""
        if self.departures is not None or self.points is None:
            return self.departures
        return self.points[:, :-1]

    @property
    def gradient(self) -> FloatArray:
        """Gradient of the optical path at each end, index times direction, (m, 3) float64."""
        return self.direction if self.index is None else self.index[:, None] * self.direction

    def sequence(self, row: int) -> list[tuple[int, bool]]:
        """Surfaces that a path met, and whether it was transmitted (decoded from its key).

        Parameters
        ----------
        row : int

        Returns
        -------
        list of (surface number, transmitted)

        Raises
        ------
        IndexError
            If there is no such path.
        ValueError
            If the path has too many bounces for a 64-bit key to tell.
        """
        row = self._row(row, "sequence")
        digits = self._digits(self.key[row : row + 1], self.bounces[row : row + 1])[0]
        return [self.scene.digits[int(d) - 1] for d in digits]

    def visits(self, surface: int) -> npt.NDArray[np.int64]:
        """Number of times each path met a surface.

        Parameters
        ----------
        surface : int

        Returns
        -------
        (m,) int64

        Raises
        ------
        ValueError
            If there is no such surface, or a path has too many bounces for its key to tell.
        """
        count = len(self.scene.surfaces)
        if not 0 <= surface < count:
            raise ValueError(f"visits surface: expected a number from 0 to {count - 1}, got {surface}")
        digits, which = self.kinds()
        mine = [number for number, (there, _) in enumerate(self.scene.digits, start=1) if there == surface]
        return np.asarray(np.isin(digits, mine).sum(axis=1)[which], dtype=np.int64)

    def kinds(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Surface sequences among the paths (decoded from their keys), and which each path took.

        Returns
        -------
        digits : (kinds, b) int64
            For each bounce the number, from 1 on, of surface and branch in `Scene.digits`; padded with -1.
        which : (m,) int64

        Raises
        ------
        ValueError
            If a path has too many bounces for its key to tell.
        """
        # digits are never 0: equal keys mean equal numbers of bounces
        kinds = np.unique(self.key)
        which = np.searchsorted(kinds, self.key)
        bounces = np.zeros(len(kinds), dtype=np.int64)
        bounces[which] = self.bounces
        return self._digits(kinds, bounces), which

    def _row(self, row: int, what: str) -> int:
        """A row counted from the start; a negative one is counted from the end."""
        if not -len(self) <= row < len(self):
            raise IndexError(f"{what} row: expected one of {len(self)} paths, got {row}")
        return row % len(self)

    def _digits(self, keys: Array, bounces: Array) -> Array:
        """Digits of keys, one for each bounce, padded with -1."""
        base = len(self.scene.digits) + 1
        most, depth = int(64 / np.log2(base)), int(bounces.max(initial=0))
        if depth > most:
            raise ValueError(
                f"path key: expected at most {most} bounces among {len(self.scene.surfaces)} surfaces to "
                f"tell their sequence, got {depth}; trace with record=True and read Paths.surface"
            )
        digits = np.full((len(keys), depth), -1, dtype=np.int64)
        rest = keys.copy()
        for back in range(1, depth + 1):
            rows = np.flatnonzero(bounces >= back)
            digits[rows, bounces[rows] - back] = (rest[rows] % np.uint64(base)).astype(np.int64)
            rest[rows] //= np.uint64(base)
        return digits

    def polyline(self, row: int) -> FloatArray:
        """Points of a path.

        Parameters
        ----------
        row : int

        Returns
        -------
        (k, 3) float64, metres
            Start, each hit, and the point on the CCD if it got there; where a thin element displaced the
            light, the point behind it too.

        Raises
        ------
        IndexError
            If there is no such path.
        ValueError
            If the trace did not record them.
        """
        if self.points is None:
            raise ValueError("polyline: expected paths traced with record=True, got paths without points")
        row = self._row(row, "polyline")
        points = self.points[row]
        if self.departures is not None:
            left = np.concatenate([self.departures[row], points[-1:]])
            shown = np.stack([np.ones(len(points), dtype=bool), (left != points).any(axis=1)], axis=1)
            points = np.stack([points, left], axis=1)[shown]
        return np.asarray(points[np.isfinite(points[:, 0])], dtype=np.float64)

    def ledger(self) -> Ledger:
        """Power ledger by fate; it adds up to the incident power for all paths of a trace.

        Returns
        -------
        Ledger
        """
        unit = 1.0 if self.area is None else self.area
        power = np.abs(self.amplitude) ** 2
        # numpy adds by pairs: one after the other, as bincount does, a million paths lose four digits
        ended = {fate: float(power[self.fate == fate].sum()) * unit for fate in Fate}
        dropped = 0.0 if self.dropped is None else float(self.dropped.sum()) * unit
        return Ledger(
            incident=self.incident * unit,
            detected=ended[Fate.DETECTED],
            left=ended[Fate.LEFT],
            absorbed=float(self.lost.sum() * unit),
            truncated=ended[Fate.TRUNCATED] + ended[Fate.FAINT] + dropped,
        )


COLUMNS = (
    "ray", "fate", "bounces", "reflections", "length", "origin", "direction", "amplitude", "lost", "key",
    "surface", "triangle", "points", "branch", "media", "indices", "departures", "advances",
    "medium", "index", "lengths", "field", "dropped", "bend",
)  # fmt: skip
# Columns with an entry for each hit, and what stands where there is none.
RECORDED = {
    "surface": -1, "triangle": -1, "points": np.nan, "branch": -1, "media": -1, "indices": np.nan,
    "departures": np.nan, "advances": 0.0,
}  # fmt: skip


def _padded(columns: Sequence[Array], width: int, fill: float) -> Array:
    """Arrays of different widths, one below the other."""
    total = sum(len(column) for column in columns)
    table = np.full((total, width, *columns[0].shape[2:]), fill, dtype=columns[0].dtype)
    row = 0
    for column in columns:
        table[row : row + len(column), : column.shape[1]] = column
        row += len(column)
    return table


def _summed(counts: Sequence[npt.NDArray[np.int64] | None]) -> npt.NDArray[np.int64] | None:
    known = [count for count in counts if count is not None]
    return np.sum(known, axis=0) if known else None


def join(parts: Iterable[Paths]) -> Paths:
    """Concatenate paths of consecutive rays of one source.

    Parameters
    ----------
    parts : iterable of Paths
        In the order of their rays; at least one.

    Returns
    -------
    Paths

    Raises
    ------
    ValueError
        If there are none, or some know what others do not (one trace was recorded, another was not).
    """
    parts = list(parts)
    if not parts:
        raise ValueError("join: expected at least one Paths, got none")
    if len(parts) == 1:
        return parts[0]
    columns: dict[str, Any] = {}
    for name in COLUMNS:
        arrays = [getattr(part, name) for part in parts]
        known = sum(array is not None for array in arrays)
        if not known:
            continue
        if known < len(arrays):
            raise ValueError(
                f"join: expected parts of one trace, got {name} in {known} of {len(arrays)} of them"
            )
        if name in RECORDED:
            columns[name] = _padded(arrays, max(array.shape[1] for array in arrays), RECORDED[name])
        else:
            columns[name] = np.concatenate(arrays)
    first = parts[0]
    return first.changed(
        **columns,
        incident=sum(part.incident for part in parts),
        segments=sum(part.segments for part in parts),
        doubtful=sum(part.doubtful for part in parts),
        contradictions=_summed([part.contradictions for part in parts]),
    )


def _range_text(text: str, values: Array, write: Callable[[Any], str]) -> str:
    """Text with the least and the greatest of some values; nothing, if there are none."""
    return text.format(write(values.min()), write(values.max())) if len(values) else ""
