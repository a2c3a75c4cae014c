"""The batch of rays, a struct of arrays; launching one from a beam."""

from __future__ import annotations

from dataclasses import dataclass, fields
from numbers import Real
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from fringetrace.scene import Beam, as_names
from fringetrace.vectors import component, unit
from fringetrace.waves import Array, ComplexArray, FloatArray

# A field may point along its ray by as much: rounding.
TRANSVERSE = 1e-9


def _rows_of_three(value: npt.ArrayLike, what: str) -> FloatArray:
    try:
        rows = np.ascontiguousarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what}: expected numbers of shape (n, 3), got {error}") from error
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise ValueError(f"{what}: expected shape (n, 3), got {rows.shape}")
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(bad):
        raise ValueError(
            f"{what}: expected finite numbers, got NaN or infinity in {len(bad)} of {len(rows)} rays "
            f"(first: ray {bad[0]})"
        )
    return rows


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays to be traced.

    Parameters
    ----------
    origin : (n, 3) float64, metres
    direction : (n, 3) float64
        Scaled to unit length.
    length : (n,) float64, metres, optional
        Optical path that each ray brings along; default 0.
    amplitude : (n,) complex128, optional
        Default 1.
    area : float, m^2, optional
        Beam cross-section that one ray stands for. None: rays are just counted.
    passes : names of surfaces that the rays pass over on their first leg.
    polarisation : (n, 3) complex128, or (3,), optional
        The field's direction, across the ray; scaled to unit length. None: rays carry one number.

    Raises
    ------
    ValueError
        For shapes that differ, numbers that are not finite, directions of length 0, fields along a ray.
    """

    origin: FloatArray
    direction: FloatArray
    length: FloatArray | None = None
    amplitude: ComplexArray | None = None
    area: float | None = None
    passes: tuple[str, ...] = ()
    polarisation: ComplexArray | None = None

    def __post_init__(self) -> None:
        origin = _rows_of_three(self.origin, "Rays origin")
        direction = _rows_of_three(self.direction, "Rays direction")
        if len(origin) != len(direction):
            raise ValueError(
                f"Rays direction: expected one for each of {len(origin)} origins, got {len(direction)}"
            )
        still = np.flatnonzero(~direction.any(axis=1))
        if len(still):
            raise ValueError(f"Rays direction: expected a direction, got length 0 (first: ray {still[0]})")
        object.__setattr__(self, "origin", origin)
        object.__setattr__(self, "direction", unit(direction) if len(direction) else direction)
        object.__setattr__(self, "length", self._column(self.length, 0.0, np.float64, "length"))
        object.__setattr__(self, "amplitude", self._column(self.amplitude, 1.0, np.complex128, "amplitude"))
        object.__setattr__(self, "passes", as_names(self.passes))
        area = self.area
        if area is not None and not (isinstance(area, Real) and np.isfinite(area) and area > 0.0):
            raise ValueError(f"Rays area: expected a positive area in m^2, got {self.area!r}")
        if self.polarisation is not None:
            object.__setattr__(self, "polarisation", self._transverse(self.polarisation))

    def _transverse(self, value: npt.ArrayLike) -> ComplexArray:
        """A unit field across each ray."""
        what = "Rays polarisation"
        try:
            fields = np.broadcast_to(np.asarray(value, dtype=np.complex128), (len(self), 3))
        except (TypeError, ValueError) as error:
            raise ValueError(f"{what}: expected numbers of shape ({len(self)}, 3), got {error}") from error
        size = np.linalg.norm(fields, axis=1, keepdims=True)
        if not (np.isfinite(size) & (size > 0.0)).all():
            raise ValueError(f"{what}: expected finite fields other than 0, got others")
        fields = fields / size
        along = np.einsum("ij,ij->i", fields, self.direction)
        if (np.abs(along) > TRANSVERSE).any():
            ray = int(np.argmax(np.abs(along)))
            raise ValueError(
                f"{what}: expected fields across the rays, got {abs(along[ray]):.3g} along ray {ray}"
            )
        return np.asarray(fields - along[:, None] * self.direction, dtype=np.complex128)

    def _column(self, value: npt.ArrayLike | None, default: float, dtype: type, what: str) -> Array:
        if value is None:
            return np.full(len(self.origin), default, dtype=dtype)
        try:
            column: Array = np.array(value, dtype=dtype)
        except (TypeError, ValueError) as error:
            raise ValueError(f"Rays {what}: expected numbers of shape (n,), got {error}") from error
        if column.shape != (len(self.origin),):
            raise ValueError(f"Rays {what}: expected shape ({len(self.origin)},), got {column.shape}")
        if not np.isfinite(column).all():
            raise ValueError(f"Rays {what}: expected finite numbers, got NaN or infinity")
        return column

    def __len__(self) -> int:
        return len(self.origin)

    def part(self, start: int, stop: int) -> Rays:
        """The rays from `start` up to `stop`.

        Parameters
        ----------
        start, stop : int

        Returns
        -------
        Rays
            Views of the same arrays.
        """
        columns = {
            name: getattr(self, name)[start:stop] for name in ("origin", "direction", "length", "amplitude")
        }
        field = None if self.polarisation is None else self.polarisation[start:stop]
        return _trusted(**columns, area=self.area, passes=self.passes, polarisation=field)


def _trusted(**fields: object) -> Rays:
    """Rays from arrays that are known to be right, without another look at each number."""
    rays = object.__new__(Rays)
    for name, value in fields.items():
        object.__setattr__(rays, name, value)
    return rays


def _field(beam: Beam, count: int) -> ComplexArray | None:
    """The field of a beam, the same for all rays."""
    if beam.polarisation is None:
        return None
    u, v, _ = beam.axes
    return np.broadcast_to(beam.polarisation[0] * u + beam.polarisation[1] * v, (count, 3))


def launch(beam: Beam, start: int = 0, stop: int | None = None) -> Rays:
    """Rays of a beam, from the centres of its grid cells, row by row.

    Parameters
    ----------
    beam : Beam
    start, stop : int
        Which rays, in scan order (row * columns + column), as in a slice; default all.

    Returns
    -------
    Rays
        Amplitude is the beam's profile; a uniform beam has unit irradiance.

    Raises
    ------
    ValueError
        If the profile gives something other than one finite number a ray.
    """
    from fringetrace import bounces

    rows, columns = beam.shape
    start, stop, _ = slice(start, stop).indices(rows * columns)
    count = max(0, stop - start)
    u, v, n = beam.axes
    origin, direction = np.empty((count, 3)), np.empty((count, 3))
    bounces.launch(start, rows, columns, beam.centre, u, v, n, *beam.size, origin, direction)
    amplitude = np.broadcast_to(np.complex128(1.0), (count,))  # read-only, and takes no room
    if beam.profile is not None:
        offset = origin - beam.centre
        values = np.asarray(beam.profile(component(offset, u), component(offset, v)))
        if values.shape not in ((), (count,)) or not np.isfinite(values).all():
            raise ValueError(
                f"Beam profile: expected a finite amplitude for each of {count} rays, "
                f"got shape {values.shape} or others"
            )
        amplitude = np.array(np.broadcast_to(values, (count,)), dtype=np.complex128)
    return _trusted(
        origin=origin,
        direction=direction,
        length=np.zeros(count),
        amplitude=amplitude,
        area=beam.area,
        passes=beam.passes,
        polarisation=_field(beam, count),
    )


def launch_at(beam: Beam, column: FloatArray, row: FloatArray) -> Rays:
    """Rays of a beam from anywhere on its rectangle, all of amplitude 1.

    Parameters
    ----------
    beam : Beam
    column, row : (n,) float64
        In cells of the beam's grid: (0, 0) is the rectangle's corner, ray [i, j] of the grid starts
        at column j + 0.5, row i + 0.5.

    Returns
    -------
    Rays
    """
    rows, columns = beam.shape
    u, v, n = beam.axes
    x = (column / columns - 0.5) * beam.size[0]
    y = (row / rows - 0.5) * beam.size[1]
    origin = beam.centre + (x[:, None] * u + y[:, None] * v)
    return _trusted(
        origin=origin,
        direction=np.tile(n, (len(origin), 1)),
        length=np.zeros(len(origin)),
        amplitude=np.ones(len(origin), dtype=np.complex128),
        area=beam.area,
        passes=beam.passes,
        polarisation=_field(beam, len(origin)),
    )


@dataclass(frozen=True, eq=False)
class Tracks:
    """What is known of paths under way as well as of those that have ended, one row each.

    `lost` is the power given off on the way, `serial` numbers the paths as they are born.
    """

    lost: FloatArray
    amplitude: ComplexArray
    key: npt.NDArray[np.uint64]
    ray: npt.NDArray[np.int64]
    bounces: npt.NDArray[np.int32]
    reflections: npt.NDArray[np.int32]
    serial: npt.NDArray[np.int64]

    @property
    def columns(self) -> tuple[Array, ...]:
        """All columns, as the kernels take them."""
        return tuple(vars(self).values())


@dataclass(frozen=True, eq=False)
class Batch(Tracks):
    """Rays under way, changed in place by the bounce passes. Lengths in metres.

    `state` has the columns that `kernels` names: origin, direction, normal of the face last left,
    optical path, distance of the start from that face's edge. `last` is the triangle last left
    (-1: none), `came` (n, 3) the direction of the last leg that was longer than 0.
    """

    state: FloatArray
    last: npt.NDArray[np.int64]
    came: FloatArray


@dataclass(frozen=True, eq=False)
class Ends(Tracks):
    """Paths that have ended, and the reason."""

    origin: FloatArray
    direction: FloatArray
    length: FloatArray
    fate: npt.NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class Carried:
    """What rays carry through matter, beside a batch or its ends, row by row.

    Attributes
    ----------
    medium : (n,) int32
        Number of the medium that the ray is in, see `media.Optics`.
    index : (n,) float64
        Its real index for the ray: |Re k| / k0.
    fade : (n, 3) float64, or (0, 3) where no medium absorbs
        Im k / k0.
    lengths : (n, media) float64, metres
        Way in each medium.
    field : (n, 3) complex128, or (0, 3) where light is scalar
    dropped : (n,) float64
        Power of branches that were not followed.
    bend : (n,) float64
        Largest sin^2 of incidence at a boundary of media; 2 behind elements that depend on the wavelength.
    """

    medium: npt.NDArray[np.int32]
    index: FloatArray
    fade: FloatArray
    lengths: FloatArray
    field: ComplexArray
    dropped: FloatArray
    bend: FloatArray

    @property
    def columns(self) -> tuple[Array, ...]:
        """All columns, as the kernels take them."""
        return tuple(vars(self).values())

    @staticmethod
    def blank(rows: int, media: int, polarised: bool, fading: bool) -> Carried:
        """Room for so many rows, not filled in."""
        return Carried(
            medium=np.empty(rows, dtype=np.int32),
            index=np.empty(rows),
            fade=np.empty((rows if fading else 0, 3)),
            lengths=np.empty((rows, media)),
            field=np.empty((rows if polarised else 0, 3), dtype=np.complex128),
            dropped=np.empty(rows),
            bend=np.empty(rows),
        )

    def rows(self, which: Array | slice) -> Carried:
        """Some rows."""
        return Carried(*(column[which] if len(column) else column for column in vars(self).values()))

    def grown(self, rows: int) -> Carried:
        """The same rows in arrays with room for more."""
        larger = Carried.blank(rows, self.lengths.shape[1], len(self.field) > 0, len(self.fade) > 0)
        for column, wider in zip(self.columns, larger.columns, strict=True):
            wider[: len(column)] = column
        return larger


Table = TypeVar("Table", Batch, Ends)
TYPES = {
    "amplitude": np.complex128, "key": np.uint64, "ray": np.int64, "last": np.int64, "serial": np.int64,
    "bounces": np.int32, "reflections": np.int32, "fate": np.int8,
}  # fmt: skip


def blank(kind: type[Table], rows: int) -> Table:
    """Room for so many rows, not filled in."""
    wide = {"origin": (rows, 3), "direction": (rows, 3), "came": (rows, 3), "state": (rows, 12)}
    names = [column.name for column in fields(kind)]
    return kind(**{name: np.empty(wide.get(name, rows), TYPES.get(name, np.float64)) for name in names})


def part(table: Table, start: int, stop: int) -> Table:
    """Views of some rows."""
    return type(table)(**{name: column[start:stop] for name, column in vars(table).items()})


def grown(table: Table, rows: int) -> Table:
    """The same rows in arrays with room for more."""
    larger = blank(type(table), rows)
    for name, column in vars(table).items():
        getattr(larger, name)[: len(column)] = column
    return larger


def start(state: Batch, rays: Rays, first: int) -> None:
    """Fill the head of a batch with rays at their start.

    Parameters
    ----------
    state : Batch
        At least as many rows as there are rays.
    rays : Rays
    first : int
        Number of the first of them.
    """
    from fringetrace.bounces import begin

    begin(rays.origin, rays.direction, rays.length, first, state.columns)
