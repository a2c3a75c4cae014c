"""Intersection with exact forms: hits on facets are moved onto the form behind them.

Facets and form stand apart by the sag of the facets, so three things have to be told from true hits.
A ray that has just left a form may cross facets before it is clear of them: such a crossing leads
back to the point it started from. A ray may cross a facet where the form is not. And a flat chord
of a hollow, or a graze of a rim, may lie between facets and form, where no facet is crossed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray, dot
from fringetrace.geometry import Fit, LevelFit, Meeting
from fringetrace.scene import Scene, once_per_scene
from fringetrace.tracing.batch import Batch
from fringetrace.tracing.intersect.bodies import Body
from fringetrace.tracing.intersect.coincident import BACK, COLUMNS, COUNT, FIRST
from fringetrace.tracing.intersect.embree import Engine, Hits, find as find_facets

# A crossing that leads back to within this part of the body's size of the start is the start.
START = 1e-9
# Room in front of the form, in sags of the facets, from which its facet is looked for.
REACH = 2.0
# A facet stands for the form no farther along a ray than this many of its longest sides.
SIDES = 2.0
# A ray crosses so many facets that lead nowhere before it is given up.
CROSSINGS = 64
# Where a bent form is not met from the nearest guess, guesses are this part of a side apart.
APART = 0.25
# Rays from farther than this many radii of a body's sphere are followed from near it: their paths have no
# digits left for a form.
FAR = 64.0
# Rays that leave more steeply (cosine to the normal) come out from behind the facets at once.
FLAT = 0.5


@dataclass(frozen=True, eq=False)
class Formed:
    """Surface with a form, alone in its body: the fit, and the longest side of its faces in metres."""

    surface: int
    body: Body
    fit: Fit
    side: float


@once_per_scene
def formed(scene: Scene, engine: Engine) -> tuple[Formed, ...]:
    """Surfaces of a scene that have a form, fitted once and kept with the scene.

    Parameters
    ----------
    scene : Scene
    engine : Engine
        In which each of them has a body of its own.

    Returns
    -------
    tuple of Formed
    """
    found = []
    for i, surface in enumerate(scene.surfaces):
        if surface.fit is None:
            continue
        body = next(body for body in engine.bodies if body.surfaces == (i,))
        body.prepare()
        corners = surface.mesh.corners
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        found.append(Formed(i, body, surface.fit, float(sides.max())))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class _Rays:
    """Some rays of a batch as a form sees them.

    `own` tells whether they have just left the form, `leaving` on which side of it: 1 where the
    ray goes along the gradient, -1 against it. `up` is the normal there, to the side that they went to.
    `shift` (n,) metres is how far along the ray `origin` lies; `near`: it may lie between form and facets.
    """

    origin: FloatArray
    direction: FloatArray
    last: npt.NDArray[np.int64]
    own: npt.NDArray[np.bool_]
    leaving: FloatArray
    up: FloatArray
    shift: FloatArray
    near: npt.NDArray[np.bool_]

    def part(self, rows: Array) -> _Rays:
        """Some of them."""
        return _Rays(*(column[rows] for column in vars(self).values()))


def _seen(form: Formed, batch: Batch, rows: Array) -> _Rays:
    state, body = batch.state[rows], form.body
    last = batch.last[rows] - body.first
    own = (last >= 0) & (last < len(body.faces))
    along = np.where(own, form.fit.along[np.where(own, last, 0)], 0)
    facing = np.sign(np.einsum("ij,ij->i", state[:, 6:9], state[:, 3:6]))
    up = facing[:, None] * state[:, 6:9]
    origin, direction, radius = state[:, :3], state[:, 3:6], body.frame[4] / body.frame[3]
    ahead = dot(body.frame[:3] - origin, direction)
    shift = np.where(ahead > FAR * radius, ahead - 4.0 * radius, 0.0)
    return _Rays(
        origin + shift[:, None] * direction, direction, np.where(own, last, -1), own & (along != 0),
        facing * along, up, shift, own & (along != 0),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Touch:
    """Rays that start on a form which is not what they have just left: rows, hits at 0, place in the list.

    `back` is -1 where a ray does not go through it, see `coincident.onward`.
    """

    rows: npt.NDArray[np.int64]
    met: Meeting
    back: npt.NDArray[np.int64]


def _touching(form: Formed, engine: Engine, batch: Batch, chosen: Array, rays: _Rays) -> _Touch:
    """Which rays start on a form that they have not just left."""
    body, last = form.body, batch.last[chosen]
    room = np.where(last >= 0, engine.grain[engine.owner[last]], 0.0) + 2.0 * engine.grain[form.surface]
    rows = np.flatnonzero(_inside(form, rays.origin) & (rays.last < 0) & (rays.shift == 0.0))
    some = rays.part(rows)
    if isinstance(form.fit, LevelFit):
        with np.errstate(all="ignore"):
            value, gradient, _ = form.fit.form.level(some.origin, some.direction)
            steep = np.sqrt(dot(gradient, gradient))
            near = (np.abs(value) <= room[rows] * steep) & (steep > 0.0)
            value = value / steep
        rows, some, normal = rows[near], some.part(near), gradient[near] / steep[near, None]
        face = _facet(form, some.origin, normal, REACH * form.fit.sag + START / body.frame[3])
        kept = face >= 0
        rows, some, normal, face = rows[kept], some.part(kept), normal[kept], face[kept]
        place = some.origin - value[near][kept, None] * normal
    else:
        face = _facet(form, some.origin, some.direction, SIDES * form.side)
        rows, some, face = rows[face >= 0], some.part(face >= 0), face[face >= 0]
        rays.near[rows], rays.last[rows] = True, face
        facet = form.body.planes[face, :3] * form.fit.along[face][:, None]
        side = np.sign(dot(facet, some.direction))
        there = form.fit.meet(some.origin, some.direction, np.zeros(len(rows)), side, face)
        kept = np.abs(there.path) * np.abs(dot(there.normal, some.direction)) <= room[rows]
        rows, place, normal, face = rows[kept], there.point[kept], there.normal[kept], there.face[kept]
    on = form.fit.along[face] != 0
    rows, met = rows[on], Meeting(np.zeros(on.sum()), place[on], normal[on], face[on])
    return _Touch(rows, met, _onward(form, engine, batch, chosen[rows], met))


def _inside(form: Formed, point: FloatArray) -> npt.NDArray[np.bool_]:
    """Which points (n, 3) are in the box around a form, little larger than it and its facets."""
    body = form.body
    local, room = (point - body.frame[:3]) * body.frame[3], REACH * form.fit.sag * body.frame[3]
    return np.asarray(((local >= body.boxes[0][0] - room) & (local <= body.boxes[1][0] + room)).all(axis=1))


def _facet(form: Formed, point: FloatArray, direction: FloatArray, reach: float) -> npt.NDArray[np.int64]:
    """Facets (n,) of a form within `reach` of points, either way along directions; -1 where there is none."""
    none, start = np.full(len(point), -1), point + reach * direction
    return _first(form, start, -direction, none, np.full(len(point), 2.0 * reach))[1]


def _onward(form: Formed, engine: Engine, batch: Batch, rows: Array, met: Meeting) -> npt.NDArray[np.int64]:
    """Whether rays go through a form that they start on; see `coincident.onward`."""
    came, direction = batch.came[rows], batch.state[rows, 3:6]
    front = met.normal * form.fit.along[met.face][:, None]
    facing = dot(front, direction)
    source, solid = ~came.any(axis=1), form.body.closed or engine.sides[form.surface, 0] >= 0
    toward = np.where(source, -1.0, dot(front, came))
    back = np.zeros(len(rows), dtype=np.int64)
    body, crossed = form.body, batch.crossed[rows]
    for k in range(FIRST, COLUMNS):
        known = (k < FIRST + crossed[:, COUNT]) & (crossed[:, k] >= body.first) & (crossed[:, k] < body.stop)
        face = np.where(known, crossed[:, k] - body.first, 0)
        back[known & (form.fit.along[face] != 0)] = k
    onward = facing * toward * np.where(back > 0, -1.0, 1.0) > 0.0
    return np.where(onward & (solid | ~source | (back > 0)), back, -1)


def _first(form: Formed, start: FloatArray, direction: FloatArray, skip: Array, limit: Array) -> tuple[
    FloatArray, npt.NDArray[np.int64]
]:  # fmt: skip
    """First facets that rays cross, exactly: path in metres, and the face, -1 if none before `limit`."""
    from fringetrace.tracing.intersect import exact

    body, tree = form.body, form.body.tree
    centre, scale = body.frame[:3], body.frame[3]
    path, face = exact.first_hits(
        (start - centre) * scale, direction, skip, limit * scale, body.planes,
        (tree.corners, tree.order, tree.lower, tree.upper), body.frame[6],
    )  # fmt: skip
    return path / scale, face


def _false(form: Formed, rays: _Rays, crossed: FloatArray, side: FloatArray, met: Meeting) -> Array:
    """Which crossings of facets, at `crossed` metres, lead to no hit of the form."""
    near = START / form.body.frame[3]
    # the start itself is a crossing in the sense in which the ray leaves
    same = rays.own & (side == rays.leaving)
    least = np.where(same, np.maximum(0.5 * crossed, near), 0.0)
    return ~((met.path > least) & (np.abs(met.path - crossed) <= SIDES * form.side))


def _nearby(
    form: Formed, rays: _Rays, path: FloatArray, side: FloatArray, face: Array, steps: range
) -> Meeting:
    """First hits of a form from several guesses along each ray: it may bend within a facet's length."""
    best = _nothing(len(path))
    for step in steps:
        guess = path + step * APART * form.side
        met = form.fit.meet(rays.origin, rays.direction, guess, side, face)
        true = (met.path > 0.0) & (met.path < best.path) & (np.abs(met.path - guess) <= form.side)
        _keep(best, np.flatnonzero(true), met, true)
    return best


def _nothing(count: int) -> Meeting:
    return Meeting(np.full(count, np.inf), np.zeros((count, 3)), np.zeros((count, 3)), np.full(count, -1))


def _keep(best: Meeting, rows: Array, met: Meeting, chosen: Array) -> None:
    for column, found in zip(vars(best).values(), vars(met).values(), strict=True):
        column[rows] = found[chosen]


def _through_facets(form: Formed, rays: _Rays, crossed: FloatArray, face: Array) -> Meeting:
    """Hits of the form that the facets lead to, the first of each ray, from the first facet crossed on."""
    best = _nothing(len(face))
    rows = np.flatnonzero(face >= 0)
    crossed, face = crossed.copy(), face.copy()
    entering = np.where(rays.own, -rays.leaving, 0.0)
    for _ in range(CROSSINGS):
        some = rays.part(rows)
        along = form.fit.along[face[rows]]
        facing = np.einsum("ij,ij->i", form.body.planes[face[rows], :3], some.direction)
        side = np.sign(facing) * np.where(along == 0, 1, along)
        met = form.fit.meet(some.origin, some.direction, crossed[rows], side, face[rows])
        entering[rows] = np.where(entering[rows] == 0.0, side, entering[rows])
        false = _false(form, some, crossed[rows], side, met) & (along != 0)
        again = np.flatnonzero(false & (side == entering[rows]))
        if len(again) and not form.fit.complete:
            few = some.part(again)
            steps = range(-4, 9)
            second = _nearby(form, few, crossed[rows[again]], side[again], face[rows[again]], steps)
            found = np.isfinite(second.path)
            _keep(met, again[found], second, found)
            false[again[found]] = False
        flat = np.flatnonzero(along == 0)  # a face that is none of the form's counts as it is
        met.path[flat] = crossed[rows[flat]]
        met.point[flat] = some.origin[flat] + met.path[flat, None] * some.direction[flat]
        met.normal[flat] = form.body.planes[face[rows[flat]], :3]
        met.face[flat] = face[rows[flat]]
        true = ~false
        _keep(best, rows[true], met, true)
        rows, some = rows[false], some.part(false)
        if len(rows) == 0:
            break
        start = some.origin + crossed[rows, None] * some.direction
        onward, face[rows] = _first(form, start, some.direction, face[rows], np.full(len(rows), np.inf))
        crossed[rows] += onward
        rows = rows[face[rows] >= 0]
    return best


def _between(form: Formed, rays: _Rays, best: Meeting) -> None:
    """Hits of the form before those found, where a facet is near though the ray crosses none."""
    near = START / form.body.frame[3]
    for sense in (-1.0, 1.0):
        # a line crosses a quadric once in each sense: not again where it started, nor where it is found
        found = np.isfinite(best.path) & (form.fit.along[best.face] != 0)
        found &= np.einsum("ij,ij->i", best.normal, rays.direction) * sense > 0.0
        untried = ~found if form.fit.complete else rays.near
        rows = np.flatnonzero(untried & ~(rays.own & (rays.leaving == sense)))
        if isinstance(form.fit, LevelFit) and form.fit.complete:
            rows = rows[_beside(form, form.fit, rays.part(rows), sense)]
        some, side = rays.part(rows), np.full(len(rows), sense)
        met = form.fit.meet(some.origin, some.direction, np.zeros(len(rows)), side, some.last)
        wanted = (met.path > 0.0) & (met.path < best.path[rows] * (1.0 - START))
        kept = np.flatnonzero(wanted)
        reach = REACH * form.fit.sag + near
        start, down = met.point[kept] + reach * met.normal[kept], -met.normal[kept]
        nothing = np.full(len(kept), -1)
        _, face = _first(form, start, down, nothing, np.full(len(kept), 2.0 * reach))
        there = (face >= 0) & (form.fit.along[face] != 0)
        kept, face = kept[there], face[there]
        met.face[kept] = face
        _keep(best, rows[kept], met, kept)


def _beside(form: Formed, fit: LevelFit, rays: _Rays, sense: float) -> npt.NDArray[np.bool_]:
    """Whether rays meet a quadric, in a sense, where its facets are, or at least in the box around them."""
    body = form.body
    centre, room = body.frame[:3], 2.0 * REACH * fit.sag
    nearest = dot(centre - rays.origin, rays.direction)
    start = rays.origin + nearest[:, None] * rays.direction
    way = fit.guess(start, rays.direction, np.full(len(start), sense))
    lower, upper = (corner[0] / body.frame[3] for corner in body.boxes)
    with np.errstate(invalid="ignore"):
        place = start + way[:, None] * rays.direction - centre
    return np.asarray(((place >= lower - room) & (place <= upper + room)).all(axis=1))


def _hidden(form: Formed, rays: _Rays, crossed: FloatArray, crossing: Array, best: Meeting) -> None:
    """Hits of a bent form by rays that left it behind its facets and are long in coming out."""
    flat = np.abs(np.einsum("ij,ij->i", rays.up, rays.direction)) < FLAT
    rows = np.flatnonzero(rays.own & flat & (crossed > APART * form.side))
    reach = REACH * form.fit.sag + START / form.body.frame[3]
    above = rays.origin[rows] + reach * rays.up[rows]
    limit = np.full(len(rows), reach)
    _, face = _first(form, above, -rays.up[rows], np.full(len(rows), -1), limit)
    outward = np.einsum("ij,ij->i", form.body.planes[crossing[rows], :3], rays.direction[rows])
    emerging = (crossing[rows] >= 0) & (
        np.sign(outward) * form.fit.along[crossing[rows]] == rays.leaving[rows]
    )
    rows = rows[(face >= 0) | emerging]
    if len(rows) == 0:
        return
    few = rays.part(rows)
    found = _nearby(form, few, np.zeros(len(rows)), -few.leaving, few.last, range(1, 17))
    nearer = found.path < best.path[rows]
    _keep(best, rows[nearer], found, nearer)


def _passing(form: Formed, batch: Batch, rows: int, within: FloatArray) -> npt.NDArray[np.bool_]:
    """Which rays pass the box around a form before they have gone so far, in metres, or little farther."""
    body = form.body
    centre, scale = body.frame[:3], body.frame[3]
    room = (2.0 * REACH * form.fit.sag + SIDES * form.side) * scale
    origin, direction = (batch.state[:rows, :3] - centre) * scale, batch.state[:rows, 3:6]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        one, other = (
            (corner[0] - origin) / direction for corner in (body.boxes[0] - room, body.boxes[1] + room)
        )
    along = np.isnan(one) | np.isnan(other)  # in the plane of a side
    enter = np.where(along, -np.inf, np.minimum(one, other)).max(axis=1)
    leave = np.where(along, np.inf, np.maximum(one, other)).min(axis=1)
    return np.asarray((leave >= np.maximum(enter, 0.0)) & (enter <= within * scale + room))


def _refined(
    form: Formed, engine: Engine, batch: Batch, rows: int, facets: Hits, within: FloatArray
) -> tuple[Array, Meeting, Array]:
    """Rows of the batch that meet a form before they have gone `within` metres, where, and place in the list.

    The place is that of the form in the list of faces crossed, where a ray starts on it.
    """
    wanted = _passing(form, batch, rows, within)
    if not form.fit.complete:
        last = batch.last[:rows] - form.body.first
        own = (last >= 0) & (last < len(form.body.faces))
        wanted &= own | (facets.triangle[:rows] >= 0) | _inside(form, batch.state[:rows, :3])
    chosen = np.flatnonzero(wanted)
    rays = _seen(form, batch, chosen)
    touch = _touching(form, engine, batch, chosen, rays)
    # it is left already, or met at once
    on, up = touch.rows, touch.met.normal
    ahead = np.sign(dot(up, rays.direction[on]))
    rays.own[on], rays.near[on], rays.last[on] = True, True, touch.met.face
    rays.leaving[on], rays.up[on] = ahead, ahead[:, None] * up
    face, crossed = facets.triangle[chosen], facets.met[chosen, 0] - rays.shift
    face = np.where(face >= 0, face - form.body.first, -1)
    best = _through_facets(form, rays, crossed, face)
    _between(form, rays, best)
    if not form.fit.complete:
        _hidden(form, rays, crossed, face, best)
    best.path[:] += rays.shift
    at_once = touch.back >= 0
    _keep(best, on[at_once], touch.met, at_once)
    back = np.zeros(len(chosen), dtype=np.int64)
    back[on[at_once]] = touch.back[at_once]
    hit = np.isfinite(best.path)
    return chosen[hit], Meeting(*(column[hit] for column in vars(best).values())), back[hit]


def find(
    engine: Engine,
    forms: tuple[Formed, ...],
    batch: Batch,
    rows: int,
    hits: Hits,
    passed: frozenset[int] = frozenset(),
    medium: Array | None = None,
) -> int:
    """Find the nearest hit of each ray, on the exact form where there is one, into `hits`.

    Parameters
    ----------
    engine : Engine
        In which surfaces with a form have a body of their own.
    forms : tuple of Formed
    batch, rows, hits, passed, medium
        See `fringetrace.tracing.intersect.embree.find`.

    Returns
    -------
    int
        How many rays were decided exactly.
    """
    from fringetrace.tracing.intersect.kernels import preferred

    everything = frozenset(range(len(engine.offset)))
    doubtful = find_facets(engine, batch, rows, hits, passed | {form.surface for form in forms}, medium)
    facets, contact = Hits.blank(rows), engine.contact(batch, medium)
    crossed_back = batch.crossed[:rows, BACK].copy()
    for form in forms:
        if form.surface in passed:
            continue
        doubtful += find_facets(engine, batch, rows, facets, everything - {form.surface}, medium)
        # no farther than what is met already, and as far where both may be at one place
        within = hits.met[:rows, 0] * (1.0 + START) + START / form.body.frame[3]
        chosen, met, back = _refined(form, engine, batch, rows, facets, within)
        along = form.fit.along[met.face]
        back = np.where((along == 0) & (met.path == 0.0), batch.crossed[chosen, BACK], back)
        normal = met.normal * np.where(along == 0, 1, along)[:, None]
        number = form.body.first + met.face
        first = preferred(chosen, batch.state, hits.met, hits.triangle, contact, normal, number, met.path)
        chosen, face, number = chosen[first], met.face[first], number[first]
        hits.met[chosen, 0] = met.path[first]
        hits.met[chosen, 1:4] = met.point[first]
        hits.met[chosen, 4:7] = normal[first]
        local = (met.point[first] - form.body.frame[:3]) * form.body.frame[3]
        edges = form.body.planes[face].reshape(-1, 4, 4)[:, 1:]
        inside = np.einsum("nek,nk->ne", edges[:, :, :3], local) + edges[:, :, 3]
        hits.met[chosen, 7] = inside.min(axis=1)
        hits.triangle[chosen] = number
        crossed_back[chosen] = back[first]
    batch.crossed[:rows, BACK] = crossed_back
    return doubtful
