"""Compiled access to the tables of rays: launching them, reading and writing rows, sorting their ends."""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit, part
from fringetrace.scene import lands
from fringetrace.tracing.batch import Batch
from fringetrace.tracing.fates import ALIVE, DETECTED, LEFT, TRUNCATED
from fringetrace.tracing.intersect.coincident import BACK, COUNT
from fringetrace.tracing.intersect.kernels import (  # fmt: skip
    DX,
    DY,
    DZ,
    EDGE,
    FX,
    FY,
    FZ,
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
def read_ray(state, row):
    """Where a ray of a batch starts, its direction, and its optical path up to there."""
    return (
        state[row, OX], state[row, OY], state[row, OZ], state[row, DX], state[row, DY], state[row, DZ],
        state[row, WAY],
    )  # fmt: skip


@part
def read_hit(met, row):
    """The point that a ray meets next, the normal there, the path to it, and its distance from the edge."""
    return (
        met[row, PX], met[row, PY], met[row, PZ], met[row, FX], met[row, FY], met[row, FZ], met[row, PATH],
        met[row, RIM],
    )  # fmt: skip


@part
def write_ray(state, row, x, y, z, dx, dy, dz, nx, ny, nz, way, edge):
    """Write a ray that leaves a face, into row `row` of a batch."""
    state[row, OX], state[row, OY], state[row, OZ] = x, y, z
    state[row, DX], state[row, DY], state[row, DZ] = dx, dy, dz
    state[row, NX], state[row, NY], state[row, NZ] = nx, ny, nz
    state[row, WAY], state[row, EDGE] = way, edge


@part
def write_end(origin, direction, length, fate, row, x, y, z, dx, dy, dz, way, why):
    """Write where a path ended, and why."""
    origin[row, 0], origin[row, 1], origin[row, 2] = x, y, z
    direction[row, 0], direction[row, 1], direction[row, 2] = dx, dy, dz
    length[row], fate[row] = way, why


@part
def write_path(key, ray, bounces, serial, row, here, number, steps, name):
    """Write which path a row of a batch or of the ends is."""
    key[row], ray[row], bounces[row], serial[row] = here, number, steps, name


@part
def write_power(lost, amplitude, reflections, row, gone, value, mirrored):
    """Write what a path has given off and kept."""
    lost[row], amplitude[row], reflections[row] = gone, value, mirrored


@part
def write_last(last, came, row, triangle, bx, by, bz):
    """Write which triangle a ray has left, and from where it came to it."""
    last[row], came[row, 0], came[row, 1], came[row, 2] = triangle, bx, by, bz


@part
def write_matter(medium, index, dropped, bend, row, number, real, aside, steepest):
    """Write in which medium a ray is, its index there, what was not followed, how steeply it was bent."""
    medium[row], index[row], dropped[row], bend[row] = number, real, aside, steepest


@part
def write_vector(table, row, x, y, z):
    """Write three numbers."""
    table[row, 0], table[row, 1], table[row, 2] = x, y, z


@part
def latest(path, dx, dy, dz, bx, by, bz):
    """From where a ray comes to a face: along its segment; if that has no length, as it came before."""
    far = path > 0.0
    return (dx if far else bx), (dy if far else by), (dz if far else bz)


@part
def fate_ahead(screen, has_screen, max_bounces, steps, meets, path, x, y, z, dx, dy, dz):
    """What becomes of a ray before it meets a face `path` metres ahead (if any), and its path to the CCD."""
    if has_screen:
        reach = lands(screen, path, x, y, z, dx, dy, dz)
        if reach < np.inf:
            return DETECTED, reach
    if not meets:
        return LEFT, 0.0
    return (TRUNCATED if steps >= max_bounces else ALIVE), 0.0


@jit
def begin(start, along, length, first, columns):
    """Fill a batch with rays that have met nothing yet; the amplitude is that of the path alone."""
    batch = Batch(*columns)
    state, last, came, crossed = batch.state, batch.last, batch.came, batch.crossed
    key, ray, bounces, serial = batch.key, batch.ray, batch.bounces, batch.serial
    lost, amplitude, reflections = batch.lost, batch.amplitude, batch.reflections
    for i in range(len(start)):
        x, y, z, dx, dy, dz = start[i, 0], start[i, 1], start[i, 2], along[i, 0], along[i, 1], along[i, 2]
        write_ray(state, i, x, y, z, dx, dy, dz, 0.0, 0.0, 0.0, length[i], 0.0)
        write_last(last, came, i, -1, 0.0, 0.0, 0.0)
        crossed[i, COUNT], crossed[i, BACK] = 0, 0
        write_path(key, ray, bounces, serial, i, np.uint64(0), first + i, 0, i)
        write_power(lost, amplitude, reflections, i, 0.0, 1.0, 0)


@jit
def sort(ray, first, count):
    """Order that sorts ends by their ray, those of one ray as they come (a counting sort)."""
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
