"""Compiled kernels of the tracing loop for mirrors: launch, reflect, split, end, sort.

A `batch` is the columns of `rays.Batch`, `ends` those of `rays.Ends`, in their order.
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit, part
from fringetrace.scene import lands
from fringetrace.tracing.fates import ABSORBED, ALIVE, DETECTED, FAINT, LEFT, TRUNCATED
from fringetrace.tracing.intersect.kernels import (  # fmt: skip
    DX,
    DY,
    DZ,
    EDGE,
    FX,
    FY,
    FZ,
    LEAVING,
    MARGIN,
    NX,
    NY,
    NZ,
    OX,
    OY,
    OZ,
    PATH,
    PX,
    PY,
    PZ,
    RIM,
    WAY,
    crossing,
    restart,
    reviewed,
    unsure,
)


@jit
def launch(first, rows, columns, centre, u, v, direction, width, height, start, along):
    """Origins and directions of a beam's rays from number `first` on: centres of its grid cells."""
    for i in range(len(start)):
        x = ((first + i) % columns + 0.5) / columns * width - 0.5 * width
        y = ((first + i) // columns + 0.5) / rows * height - 0.5 * height
        for k in range(3):
            start[i, k] = centre[k] + (x * u[k] + y * v[k])
            along[i, k] = direction[k]


@part
def under_way(state, row):
    """Start point, direction and optical path so far of a ray of a batch."""
    return (
        state[row, OX], state[row, OY], state[row, OZ], state[row, DX], state[row, DY], state[row, DZ],
        state[row, WAY],
    )  # fmt: skip


@part
def ahead(met, row):
    """Next hit of a ray: point, normal, path length, distance from the edge."""
    return (
        met[row, PX], met[row, PY], met[row, PZ], met[row, FX], met[row, FY], met[row, FZ], met[row, PATH],
        met[row, RIM],
    )  # fmt: skip


@part
def depart(state, row, x, y, z, dx, dy, dz, nx, ny, nz, way, edge):
    """Write a ray that leaves a face into row `row` of a batch."""
    state[row, OX], state[row, OY], state[row, OZ] = x, y, z
    state[row, DX], state[row, DY], state[row, DZ] = dx, dy, dz
    state[row, NX], state[row, NY], state[row, NZ] = nx, ny, nz
    state[row, WAY], state[row, EDGE] = way, edge


@part
def conclude(origin, direction, length, fate, row, x, y, z, dx, dy, dz, way, why):
    """Write the end of a path into row `row` of the ends."""
    origin[row, 0], origin[row, 1], origin[row, 2] = x, y, z
    direction[row, 0], direction[row, 1], direction[row, 2] = dx, dy, dz
    length[row], fate[row] = way, why


@part
def label(key, ray, bounces, row, here, number, steps):
    """Write path key, ray number and bounces of a path."""
    key[row], ray[row], bounces[row] = here, number, steps


@part
def weigh(lost, amplitude, reflections, row, gone, left, mirrored):
    """Write lost power, amplitude and reflections of a path."""
    lost[row], amplitude[row], reflections[row] = gone, left, mirrored


@part
def latest(path, dx, dy, dz, bx, by, bz):
    """Direction from which a ray reaches a face: along its segment, or as before if that has no length."""
    far = path > 0.0
    return (dx if far else bx), (dy if far else by), (dz if far else bz)


@part
def follows(came, last, serial, row, bx, by, bz, met, number):
    """Write previous direction, triangle and serial number of a row."""
    came[row, 0], came[row, 1], came[row, 2] = bx, by, bz
    last[row], serial[row] = met, number


@jit
def begin(start, along, length, first, batch):
    """Initialise a batch with rays that have met nothing; the amplitude is relative to the launched one."""
    lost, amplitude, key, ray, bounces, reflections, serial, state, last, came = batch
    for i in range(len(start)):
        x, y, z, dx, dy, dz = start[i, 0], start[i, 1], start[i, 2], along[i, 0], along[i, 1], along[i, 2]
        depart(state, i, x, y, z, dx, dy, dz, 0.0, 0.0, 0.0, length[i], 0.0)
        follows(came, last, serial, i, dx, dy, dz, -1, i)
        label(key, ray, bounces, i, np.uint64(0), first + i, 0)
        weigh(lost, amplitude, reflections, i, 0.0, 1.0, 0)


@part
def bounced(dx, dy, dz, nx, ny, nz, facing, steps):
    """Reflected direction at a face with the cosine of incidence `facing`.

    Every eighth time, by the number of `steps`, a Newton step keeps the length at 1.
    """
    along = 2.0 * facing
    dx, dy, dz = dx - along * nx, dy - along * ny, dz - along * nz
    if steps & 7 == 0:
        scale = 1.5 - 0.5 * (dx * dx + dy * dy + dz * dz)
        dx, dy, dz = dx * scale, dy * scale, dz * scale
    return dx, dy, dz


@part
def fated(screen, has_screen, max_bounces, steps, meets, path, x, y, z, dx, dy, dz):
    """Fate of a ray before it meets a face `path` metres ahead (if any), and its path to the CCD."""
    if has_screen:
        reach = lands(screen, path, x, y, z, dx, dy, dz)
        if reach < np.inf:
            return DETECTED, reach
    if not meets:
        return LEFT, 0.0
    return (TRUNCATED if steps >= max_bounces else ALIVE), 0.0


@part
def square(value):
    """Squared magnitude of a complex number."""
    return value.real * value.real + value.imag * value.imag


@part
def onward(before, r, t, faint):
    """Branch that continues from a surface: amplitude, whether transmitted, fate."""
    through = not square(r) > 0.0
    left = before * t if through else before * r
    if through and not square(t) > 0.0:
        return left, False, ABSORBED
    return left, through, FAINT if square(left) < faint else ALIVE


@jit
def rebound(
    count, steps, prim, batch, body, digit, base, limits, ends, first, origin32, direction32
):  # fmt: skip
    """Fused `measure`, `interact` and `aim` for a single body of ideal mirrors that all rays just left.

    Each has made `steps` bounces. `digit` is what a triangle adds to a key of that `base`.

    Returns how many rays go on, how many have ended, and how many hits were doubtful.
    """
    key, ray, state, last, came = batch
    end_key, end_ray, end_bounces, end_origin, end_direction, end_length, end_fate = ends
    screen, has_screen, max_bounces = limits
    _, _, oriented, closed, frame, planes, _, _ = body
    cx, cy, cz, scale = frame[0], frame[1], frame[2], frame[3]
    unscale, margin = 1.0 / scale, frame[5]
    kept, ended, doubtful = 0, 0, 0
    many = base > np.uint64(3)  # else there is one surface, and one digit
    for row in range(count):
        guess = np.int64(prim[row])
        gx, gy, gz, dx, dy, dz, way = under_way(state, row)
        x, y, z = (gx - cx) * scale, (gy - cy) * scale, (gz - cz) * scale
        leaving, edge = state[row, LEAVING], state[row, EDGE]
        facing, inverted, path, px, py, pz, rim = 0.0, 0.0, np.inf, x, y, z, np.inf
        if guess >= 0:
            k = np.uintp(guess)
            facing, inverted, path, px, py, pz, rim = crossing(planes, k, x, y, z, dx, dy, dz)
        doubt = unsure(guess, guess == last[row], path, facing, True, leaving, closed)
        if doubt or rim <= MARGIN or edge < margin:
            unclear, guess, (path, px, py, pz, rim) = reviewed(
                (x, y, z, dx, dy, dz), (came[row, 0], came[row, 1], came[row, 2]),
                (state[row, NX], state[row, NY], state[row, NZ]), last[row], leaving, edge, guess, facing,
                (path, px, py, pz, rim), doubt, body,
            )  # fmt: skip
            doubtful += unclear
            if guess >= 0:
                k = np.uintp(guess)
                facing = planes[k, 0] * dx + planes[k, 1] * dy + planes[k, 2] * dz
                inverted = 1.0 / facing
        path = path * unscale if guess >= 0 else np.inf
        fate, reach = fated(screen, has_screen, max_bounces, steps, guess >= 0, path, gx, gy, gz, dx, dy, dz)
        if fate != ALIVE:
            gx, gy, gz, way = gx + reach * dx, gy + reach * dy, gz + reach * dz, way + reach
            end = ray[row] - first
            label(end_key, end_ray, end_bounces, end, key[row], ray[row], steps)
            conclude(end_origin, end_direction, end_length, end_fate, end, gx, gy, gz, dx, dy, dz, way, fate)
            ended += 1
            continue
        if not oriented:  # nobody else asks from where a ray came
            came[kept, 0], came[kept, 1], came[kept, 2] = latest(
                path, dx, dy, dz, came[row, 0], came[row, 1], came[row, 2]
            )
        k = np.uintp(guess)
        nx, ny, nz = planes[k, 0], planes[k, 1], planes[k, 2]
        height = nx * px + ny * py + nz * pz + planes[k, 3]
        x, y, z = px - height * nx, py - height * ny, pz - height * nz
        dx, dy, dz = bounced(dx, dy, dz, nx, ny, nz, facing, steps + 1)
        gx, gy, gz = cx + x * unscale, cy + y * unscale, cz + z * unscale
        depart(state, kept, gx, gy, gz, dx, dy, dz, nx, ny, nz, way + path, rim)
        state[kept, LEAVING], last[kept] = -facing, guess
        key[kept], ray[kept] = key[row] * base + np.uint64(digit[k] if many else 1), ray[row]
        x, y, z = restart(x, y, z, dx, dy, dz, nx, ny, nz, -facing, abs(inverted))
        origin32[kept, 0], origin32[kept, 1], origin32[kept, 2] = x, y, z
        direction32[kept, 0], direction32[kept, 1], direction32[kept, 2] = dx, dy, dz
        kept += 1
    return kept, ended, doubtful


@jit
def close_up(batch, start, born, to, faint, ends, ended):
    """Move the last `born` rows of a batch, from `start` on, to row `to`; faint ones end here.

    Returns how many rows of the batch and of the ends are filled.
    """
    lost, amplitude, key, ray, bounces, reflections, serial, state, last, came = batch
    end_lost, end_amplitude, end_key, end_ray, end_bounces, end_reflections, end_serial = ends[:7]
    end_origin, end_direction, end_length, end_fate = ends[7:]
    for old in range(start, start + born):  # to <= start: in order, nothing is overwritten before it is read
        if square(amplitude[old]) < faint:
            x, y, z, dx, dy, dz, way = under_way(state, old)
            label(end_key, end_ray, end_bounces, ended, key[old], ray[old], bounces[old])
            weigh(end_lost, end_amplitude, end_reflections, ended, 0.0, amplitude[old], reflections[old])
            conclude(end_origin, end_direction, end_length, end_fate, ended, x, y, z, dx, dy, dz, way, FAINT)
            end_serial[ended] = serial[old]
            ended += 1
            continue
        for k in range(state.shape[1]):
            state[to, k] = state[old, k]
        follows(came, last, serial, to, came[old, 0], came[old, 1], came[old, 2], last[old], serial[old])
        label(key, ray, bounces, to, key[old], ray[old], bounces[old])
        weigh(lost, amplitude, reflections, to, 0.0, amplitude[old], reflections[old])
        to += 1
    return to, ended


@jit
def interact(
    count, batch, met, triangle, owner, reflection, transmission, plain, limits, faint, ends, ended, first,
    serials,
):  # fmt: skip
    """Reflect, transmit or split each ray at its hit; record those that end, compact the rest.

    A ray that splits goes on as its reflected branch; transmitted ones follow behind all rows.
    Ends go to row `ray - first`, or, if `first` is negative, one after the other from `ended` on.
    In a `plain` scene all surfaces reflect with -1: amplitudes follow from bounces. Returns how many
    rays go on, how many have ended, and the next serial number.
    """
    lost, amplitude, key, ray, bounces, reflections, serial, state, last, came = batch
    end_lost, end_amplitude, end_key, end_ray, end_bounces, end_reflections, end_serial = ends[:7]
    end_origin, end_direction, end_length, end_fate = ends[7:]
    screen, has_screen, max_bounces = limits
    base = np.uint64(2 * len(reflection) + 1)
    kept, born = 0, 0
    for row in range(count):
        x, y, z, dx, dy, dz, way = under_way(state, row)
        here, steps, number = key[row], bounces[row], ray[row]
        before, gone, mirrored = 1.0 + 0.0j, 0.0, steps
        if not plain:
            before, gone, mirrored = amplitude[row], lost[row], reflections[row]
        px, py, pz, nx, ny, nz, path, rim = ahead(met, row)
        k = triangle[row]
        fate, reach = fated(screen, has_screen, max_bounces, steps, k >= 0, path, x, y, z, dx, dy, dz)
        if fate == ALIVE:
            surface, through = owner[np.uintp(k)], False
            x, y, z, way, steps = px, py, pz, way + path, steps + 1
            here = here * base + np.uint64(2 * surface + 1)
            bx, by, bz = latest(path, dx, dy, dz, came[row, 0], came[row, 1], came[row, 2])
            if not plain:
                r, t = reflection[surface], transmission[surface]
                r2, t2 = square(r), square(t)
                gone += square(before) * (1.0 - r2 - t2)
                if r2 > 0.0 and t2 > 0.0:
                    new = count + born
                    depart(state, new, x, y, z, dx, dy, dz, nx, ny, nz, way, rim)
                    follows(came, last, serial, new, bx, by, bz, k, serials + born)
                    label(key, ray, bounces, new, here + np.uint64(1), number, steps)
                    weigh(lost, amplitude, reflections, new, 0.0, before * t, mirrored)
                    born += 1
                before, through, fate = onward(before, r, t, faint)
                mirrored += r2 > 0.0 and t2 == 0.0
            if through:
                here += np.uint64(1)
            elif fate != ABSORBED:
                dx, dy, dz = bounced(dx, dy, dz, nx, ny, nz, nx * dx + ny * dy + nz * dz, steps)
        if fate == ALIVE:
            depart(state, kept, x, y, z, dx, dy, dz, nx, ny, nz, way, rim)
            follows(came, last, serial, kept, bx, by, bz, k, serial[row])
            label(key, ray, bounces, kept, here, number, steps)
            if not plain:
                weigh(lost, amplitude, reflections, kept, gone, before, mirrored)
            kept += 1
            continue
        x, y, z, way = x + reach * dx, y + reach * dy, z + reach * dz, way + reach
        end = number - first if first >= 0 else ended
        label(end_key, end_ray, end_bounces, end, here, number, steps)
        conclude(end_origin, end_direction, end_length, end_fate, end, x, y, z, dx, dy, dz, way, fate)
        end_serial[end] = serial[row]
        if not plain:
            weigh(end_lost, end_amplitude, end_reflections, end, gone, before, mirrored)
        ended += 1
    kept, ended = close_up(batch, count, born, kept, faint, ends, ended)
    return kept, ended, serials + born


@jit
def sort(ray, first, count):
    """Stable counting sort of path ends by ray."""
    place = np.zeros(count + 1, np.int64)
    for i in range(len(ray)):
        place[ray[i] - first + 1] += 1
    for k in range(count):
        place[k + 1] += place[k]
    order = np.empty(len(ray), np.int64)
    for i in range(len(ray)):
        k = ray[i] - first
        order[place[k]] = i
        place[k] += 1
    return order
