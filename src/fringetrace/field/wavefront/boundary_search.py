"""Boundary search: cells of the beam's grid cut along the edges of a surface sequence, by new rays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray
from fringetrace.field.wavefront.probe import Probe
from fringetrace.field.wavefront.quadtree import (
    COARSE,
    CORNERS,
    PIXEL,
    STRAIGHT,
    Pieces,
    Squares,
    allowed,
    denied,
    quarters,
)
from fringetrace.field.wavefront.visibility import Witnesses

# Where an edge crosses a side is found to this part of a cell,
FINE = 2.5e-10
# and where it crosses a cell, to this part of what it may be off.
FINER = 0.05
# Rays sent at a time in search of edges, and along a line: a trace of fewer takes as long.
RAYS, MOST = 1024, 63
# A chord shorter than this part of its cell is not looked at.
SHORT = 1e-4
# Where several edges meet, cells are quartered this often; what is left is 1e-6 of a cell's area.
DEPTH = 10
# Where something hides between corners, down to this part of a cell.
HIDDEN = 0.5**8
# A bent edge is halved this often.
BENDS = 9
# Chords of a bent edge are no steeper than this to its first one's axis: else it turns a corner.
STEEP = 4.0
# Where along a chord it is looked at.
ALONG = (0.21, 0.5, 0.83)


def _ends(probe: Probe, bright: FloatArray, dark: FloatArray, names: Array, goal: float) -> FloatArray:
    """Where between lit and dark points (n, 2) the light ends, to a part `goal` of their distance."""
    width, rows = 1.0, np.arange(len(bright))
    while len(rows) and width > goal:
        count = int(np.clip(RAYS // len(rows), 1, MOST))
        f = np.arange(count + 2)[:, None] / (count + 1)
        at = bright[:, None] * (1.0 - f) + dark[:, None] * f
        lit = probe.lit(at[:, 1:-1].reshape(-1, 2), np.repeat(names, count)).reshape(-1, count)
        last = np.argmin(np.column_stack([lit, np.zeros(len(lit), dtype=np.bool_)]), axis=1)
        bright, dark = at[rows, last], at[rows, last + 1]
        width /= count + 1
    return 0.5 * (bright + dark)


def _crossings(probe: Probe, bright: FloatArray, dark: FloatArray, names: Array, size: float) -> FloatArray:
    """Where between lit and dark points (n, 2), a side apart, the light ends."""
    # neighbouring cells of a wave share their side
    bits = np.column_stack([np.column_stack([bright, dark]).view(np.int64), names.view(np.int64)])
    _, first, again = np.unique(bits, axis=0, return_index=True, return_inverse=True)
    found = _ends(probe, bright[first], dark[first], names[first], FINE / size)
    return np.asarray(found[again.ravel()], dtype=np.float64)


def _chords(probe: Probe, squares: Squares, names: Array) -> FloatArray:
    """Chords (n, 2, 2) across squares that an edge crosses once, lit to their left."""
    lit = squares.lit
    sides = lit != np.roll(lit, -1, axis=1)
    first, second = np.argmax(sides, axis=1), 3 - np.argmax(sides[:, ::-1], axis=1)
    rows = np.arange(len(lit))
    side = np.stack([first, second], axis=1)
    a, b = (squares.low[:, None] + squares.size * CORNERS[(side + step) % 4] for step in (0, 1))
    from_a = lit[rows[:, None], side][..., None]
    bright, dark = (np.where(from_a, x, y).reshape(-1, 2) for x, y in ((a, b), (b, a)))
    chord = _crossings(probe, bright, dark, np.repeat(names, 2), squares.size).reshape(-1, 2, 2)
    # corners go counter-clockwise: those from `first` + 1 to `second` lie right of the chord
    right = lit[rows, (first + 1) % 4]
    chord[right] = chord[right, ::-1]
    return chord


def _straight(
    probe: Probe, chord: FloatArray, names: Array, scale: FloatArray, size: float
) -> npt.NDArray[np.bool_]:
    """Which chords are edges: the light changes near them, on both sides."""
    along = chord[:, 1] - chord[:, 0]
    length = np.linalg.norm(along, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        left = np.stack([-along[:, 1], along[:, 0]], axis=1) / length[:, None]
        left *= (allowed(length, scale, size) + np.abs(left) @ probe.fuzz)[:, None]
    straight = np.ones(len(chord), dtype=np.bool_)
    look = np.flatnonzero(length > SHORT * size)
    point = chord[look, None, 0] + np.array(ALONG)[:, None] * along[look, None]
    both = np.stack([point + left[look, None], point - left[look, None]], axis=1)
    lit = probe.lit(both.reshape(-1, 2), np.repeat(names[look], 2 * len(ALONG))).reshape(-1, 2, len(ALONG))
    straight[look] = lit[:, 0].all(axis=1) & ~lit[:, 1].any(axis=1)
    return straight


def main_axis(chord: FloatArray) -> npt.NDArray[np.int64]:
    """Axis (0 columns, 1 rows) that chords lie closer to."""
    along = np.abs(chord[:, 1] - chord[:, 0])
    return (along[:, 1] > along[:, 0]).astype(np.int64)


def _middles(
    probe: Probe, squares: Squares, chord: FloatArray, axis: Array, names: Array
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Where across the middle of chords the edge is, and whether it is there."""
    along = chord[:, 1] - chord[:, 0]
    rows, across = np.arange(len(chord)), 1 - axis
    length = np.linalg.norm(along, axis=1)
    step = np.zeros_like(along)
    step[rows, across] = 0.5 * length * np.where(along[rows, axis] > 0.0, 1.0, -1.0) * np.where(axis, -1, 1)
    middle = chord.mean(axis=1)
    ends = np.stack([middle + step, middle - step])
    bright, dark = ends = np.clip(ends, squares.low, squares.low + squares.size)
    lit, unlit = probe.lit(ends.reshape(-1, 2), np.tile(names, 2)).reshape(2, -1)
    there = lit & ~unlit
    off = np.clip(PIXEL / squares.scale, STRAIGHT, COARSE)
    goal = max(FINER * float((off / np.maximum(length, off)).min(initial=1.0)), FINE)
    middle[there] = _ends(probe, bright[there], dark[there], names[there], goal)
    return middle, there


def _gentle(chord: FloatArray, axis: Array) -> npt.NDArray[np.bool_]:
    """Chords that lie more along an axis than across it."""
    along, rows = np.abs(chord[:, 1] - chord[:, 0]), np.arange(len(chord))
    return np.asarray(along[rows, 1 - axis] <= STEEP * along[rows, axis])


def _bent(probe: Probe, squares: Squares, names: Array, last: bool) -> tuple[Pieces, npt.NDArray[np.bool_]]:
    """Pieces of squares that an edge crosses once, halved where it bends; and where it does not work."""
    chord = _chords(probe, squares, names)
    axis, owner = main_axis(chord), np.arange(len(chord))
    failed = np.zeros(len(chord), dtype=np.bool_)
    found = []
    for level in range(BENDS + 1):
        own = names[owner]
        straight = _straight(probe, chord, own, squares.scale[owner], squares.size)
        straight |= level == BENDS or last
        found.append((owner[straight], chord[straight], np.full(straight.sum(), level)))
        owner, chord = owner[~straight], chord[~straight]
        middle, there = _middles(probe, squares.part(owner), chord, axis[owner], names[owner])
        there &= _gentle(chord, axis[owner])
        failed[owner[~there]] = True
        there &= ~failed[owner]
        owner, chord, middle = owner[there], chord[there], middle[there]
        if len(owner) == 0:
            break
        begin, end = np.moveaxis(chord, 1, 0)
        chord = np.concatenate([np.stack([begin, middle], axis=1), np.stack([middle, end], axis=1)])
        owner = np.tile(owner, 2)
    owner, chord, halvings = (np.concatenate(column) for column in zip(*found, strict=True))
    good = ~failed[owner]
    return _strips(squares, axis, owner[good], chord[good], halvings[good]), failed


def _strips(squares: Squares, axis: Array, owner: Array, chord: FloatArray, level: Array) -> Pieces:
    """A square with a straight chord whole; else strips across the chords of its edge, and what is beside."""
    low, high = squares.low[owner], squares.low[owner] + squares.size
    rows = np.arange(len(owner))
    along, across = axis[owner], 1 - axis[owner]
    bent = level > 0
    ends = np.sort(chord[rows, :, along], axis=1)
    # lit on the left: above in a strip along columns that goes on, below in one along rows
    forth = chord[rows, 1, along] > chord[rows, 0, along]
    above = forth != (along == 1)
    height = chord[rows, :, across]
    low[rows[bent], along[bent]], high[rows[bent], along[bent]] = ends[bent].T
    up, down = bent & above, bent & ~above
    low[up, across[up]] = height[up].min(axis=1)
    high[down, across[down]] = height[down].max(axis=1)
    parts = [Pieces(squares.wave[owner], squares.cell[owner], low, high, chord)]
    # the rectangles at either end of a bent edge
    least, most = np.full(len(axis), np.inf), np.full(len(axis), -np.inf)
    np.minimum.at(least, owner[bent], ends[bent, 0])
    np.maximum.at(most, owner[bent], ends[bent, 1])
    for corner, limit in ((0, least), (2, most)):
        which = np.flatnonzero(np.isfinite(limit) & squares.lit[:, corner])
        low, high = squares.low[which], squares.low[which] + squares.size
        (high if corner == 0 else low)[np.arange(len(which)), axis[which]] = limit[which]
        there = (high > low).all(axis=1)
        which, low, high = which[there], low[there], high[there]
        blank = np.full((len(which), 2, 2), np.nan)
        parts.append(Pieces(squares.wave[which], squares.cell[which], low, high, blank))
    return Pieces.joined(parts)


def cut(probe: Probe, names: Array, squares: Squares, witnesses: Witnesses | None = None) -> Pieces:
    """Cells cut along the edges between lit and dark corners; quartered where one edge is not enough.

    Parameters
    ----------
    probe : Probe
    names : (waves,) uint64
        Of the sequences that `squares.wave` counts.
    squares : Squares
    witnesses : Witnesses, optional
        Of these sequences, for what hides between the corners.

    Returns
    -------
    Pieces
        Of what is lit, in no order.
    """
    done: list[Pieces] = []
    finest = 0.5**DEPTH
    while True:
        last = squares.size <= finest
        crossed = (squares.lit != np.roll(squares.lit, -1, axis=1)).sum(axis=1)
        once = np.flatnonzero(crossed == 2)
        some = squares.part(once)
        bent, failed = _bent(probe, some, names[some.wave], last)
        full = squares.part(np.flatnonzero((crossed == 0) & squares.lit[:, 0]))
        pieces = Pieces.joined([bent, full.whole])
        if last:
            return Pieces.joined([*done, pieces])
        rest = crossed == 4
        rest[once[failed]] = True
        if witnesses is not None and len(rest) and squares.size > HIDDEN:
            rest |= denied(probe, names, squares, pieces, witnesses)
        # a corner may poke into a cell next to one with all its own corners dark, or lit
        rest |= (crossed == 0) & squares.beside(rest)
        done.append(pieces.part(~np.isin(pieces.numbers(squares.size), squares.numbers[rest])))
        if not rest.any():
            return Pieces.joined(done)
        squares = quarters(probe, names, squares.part(rest))
