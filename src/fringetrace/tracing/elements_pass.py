"""The pass of rays through thin elements: each is asked for the branches of the rays that stand at it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fringetrace.core import Array, ComplexArray, FloatArray, dot
from fringetrace.tracing.batch import Batch, copy_rows
from fringetrace.tracing.fates import ABSORBED, ALIVE, FAINT

if TYPE_CHECKING:
    from fringetrace.optics import Branch, Element
    from fringetrace.tracing.plan import Plan
    from fringetrace.tracing.record import Record
    from fringetrace.tracing.workspace import Workspace


def _power(field: ComplexArray) -> FloatArray:
    squares = field.real**2 + field.imag**2
    return np.asarray(squares if field.ndim == 1 else squares.sum(axis=1), dtype=np.float64)


def act(plan: Plan, space: Workspace, number: int, element: Element, record: Record | None) -> None:
    """Send the rays that stand at an element through it.

    Parameters
    ----------
    plan : Plan
    space : Workspace
        Whose rays stand at what they met; their fates are updated.
    number : int
        Of the element's surface.
    element : Element
    record : Record, optional
        Of this chunk.
    """
    from fringetrace.optics import IncidentRays

    batch, light = space.batch, space.light
    assert light is not None
    surface = plan.engine.owner[batch.last[: space.count]]
    rows = np.flatnonzero((surface == number) & (space.fate[: space.count] == ALIVE))
    if len(rows) == 0:
        return
    table = batch.state[rows]
    rays = IncidentRays(
        point=table[:, :3], direction=table[:, 3:6], normal=table[:, 6:9], index=light.real_index[rows],
        field=light.field[rows] if plan.optics.polarised else batch.amplitude[rows],
        wavelength=plan.optics.wavelength,
    )  # fmt: skip
    branches = element.act(rays)
    batch.lost[rows] += _power(rays.field) - sum(_power(branch.field) for branch in branches)
    if element.chromatic:
        light.bend[rows] = 2.0
    digit = np.uint64(2 * len(plan.scene.surfaces) + 1 + _further(plan, number))
    for further, branch in enumerate(branches[1:]):
        lit = np.flatnonzero(_power(branch.field) > 0.0)
        to = _cloned(space, rows[lit])
        space.batch.key[to] += digit + np.uint64(further) - np.uint64(2 * number + 2)
        if record is not None:
            record.born(space.batch.serial[rows[lit]])
        _write(plan, space, to, _part(branch, lit), record)
    _write(plan, space, rows, branches[0], record)


def _further(plan: Plan, number: int) -> int:
    """How many digits there are of further branches of elements before this one."""
    return sum(element.branches - 1 for k, element in plan.optics.elements.items() if k < number)


def _part(branch: Branch, rows: Array) -> Branch:
    """A branch of some of the rays."""
    from fringetrace.optics import Branch

    some = (None if column is None else column[rows] for column in vars(branch).values())
    return Branch(*some)  # type: ignore[arg-type]


def _cloned(space: Workspace, rows: Array) -> Array:
    """Copies of rows behind all others."""
    first, count = space.count, len(rows)
    space.room(first + count)
    batch, light = space.batch, space.light
    assert light is not None
    to = np.arange(first, first + count)
    copy_rows(batch, rows, to)
    copy_rows(light, rows, to)
    batch.lost[to], light.dropped[to] = 0.0, 0.0
    batch.serial[to] = np.arange(space.serials, space.serials + count)
    space.count, space.serials = first + count, space.serials + count
    return to


def _turn(batch: Batch, rows: Array, direction: FloatArray) -> None:
    """Let rows go on in other directions; those that turn back have not gone through what they met."""
    from fringetrace.tracing.intersect.coincident import turned_back

    normal = batch.state[rows, 6:9]
    ahead, now = dot(batch.state[rows, 3:6], normal) > 0.0, dot(direction, normal) > 0.0
    turned_back(batch.crossed, rows[ahead != now], batch.last)
    batch.state[rows, 3:6] = direction


def _write(plan: Plan, space: Workspace, rows: Array, branch: Branch, record: Record | None) -> None:
    """Let rows go on as a branch says, row by row."""
    batch, light, field = space.batch, space.light, branch.field
    assert light is not None
    power = _power(field)
    if field.ndim == 2:
        light.field[rows] = field
        batch.amplitude[rows] = np.sqrt(power)
    else:
        batch.amplitude[rows] = field
    if branch.direction is not None:
        _turn(batch, rows, branch.direction)
    if branch.point is not None:
        batch.state[rows, :3] = branch.point
    if branch.path is not None:
        batch.state[rows, 9] += branch.path
        if record is not None:
            record.write(batch.serial[rows], advance=branch.path)
    dark = np.where(power > 0.0, FAINT, ABSORBED)
    space.fate[rows] = np.where((power > 0.0) & (power >= plan.limits.faint), ALIVE, dark)
