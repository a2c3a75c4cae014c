"""Rays: origins, directions, amplitudes; launch from a beam."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, ComplexArray, FloatArray, component, described, filled, unit, value_text
from fringetrace.scene import Beam, as_names

# A field may point along its ray by as much: rounding.
TRANSVERSE = 1e-9


def _rows_of_three(value: npt.ArrayLike, what: str) -> FloatArray:
    try:
        rows = np.ascontiguousarray(filled(value))
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
    """Rays to trace: origins, directions, optical path lengths, amplitudes.

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

    def __repr__(self) -> str:
        count, bare = f"{len(self):,} rays", self.area is None
        return described(
            self,
            count if bare else f"{count} of {self.area:.6g} m^2 each",
            "" if self.polarisation is None else "polarised",
            f"passes {value_text(self.passes)}" if self.passes else "",
        )

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
            fields = np.broadcast_to(filled(value, np.complex128), (len(self), 3))
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
            column: Array = filled(value, dtype).copy()
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
        """Rays from `start` up to `stop`.

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
    """Launch rays of a beam from the centres of its grid cells, row by row.

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
    from fringetrace.tracing import kernels_rays

    rows, columns = beam.shape
    start, stop, _ = slice(start, stop).indices(rows * columns)
    count = max(0, stop - start)
    u, v, n = beam.axes
    origin, direction = np.empty((count, 3)), np.empty((count, 3))
    kernels_rays.launch(start, rows, columns, beam.centre, u, v, n, *beam.size, origin, direction)
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
    """Launch rays of a beam from any points of its rectangle, with amplitude 1.

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
