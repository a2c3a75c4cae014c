"""Compiled kernels of rays in matter: Snell, Fresnel, films, absorption, polarisation vectors.

The counterpart of `bounces` for scenes with media. Amplitudes are those of power: |amplitude|^2 is what a
ray carries. In an absorbing medium a ray has the complex wave vector k0 (index * direction + i fade), so
that waves are inhomogeneous there as they are behind a film: phases of parallel faces are exact.
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit, part
from fringetrace.optics import bare, coated
from fringetrace.tracing.fates import ABSORBED, ALIVE, FAINT
from fringetrace.tracing.intersect.kernels import DX, DY, DZ, NX, NY, NZ
from fringetrace.tracing.kernels_mirrors import (  # fmt: skip
    ahead,
    bounced,
    conclude,
    depart,
    fated,
    follows,
    label,
    latest,
    square,
    under_way,
    weigh,
)

# What a surface is: of constant amplitudes, or a boundary between two media.
CONSTANT, BOUNDARY = 0, 1
# What is followed from a boundary: bits. What is not, is lost to the metal behind it if that is OPAQUE.
REFLECTED, TRANSMITTED, OPAQUE = 1, 2, 4
# Flatter to the normal than this (sine) no plane of incidence is told: any one will do.
STRAIGHT = 1e-12


@part
def sideways(dx, dy, dz, nx, ny, nz):
    """Unit vector of s light, perpendicular to ray and normal; any across the ray at normal incidence."""
    x, y, z = dy * nz - dz * ny, dz * nx - dx * nz, dx * ny - dy * nx
    size = x * x + y * y + z * z
    if size < STRAIGHT * STRAIGHT:
        x, y, z = (0.0, dz, -dy) if abs(dx) < 0.7 else (-dz, 0.0, dx)
    # rounding of a short product points anywhere
    along = x * dx + y * dy + z * dz
    x, y, z = x - along * dx, y - along * dy, z - along * dz
    size = 1.0 / np.sqrt(x * x + y * y + z * z)
    return x * size, y * size, z * size


@part
def split(ex, ey, ez, dx, dy, dz, sx, sy, sz):
    """Field components along s, and along p = d x s."""
    px, py, pz = dy * sz - dz * sy, dz * sx - dx * sz, dx * sy - dy * sx
    return ex * sx + ey * sy + ez * sz, ex * px + ey * py + ez * pz


@part
def made(s, p, dx, dy, dz, sx, sy, sz):
    """Field vector of its s and p components."""
    px, py, pz = dy * sz - dz * sy, dz * sx - dx * sz, dx * sy - dy * sx
    return s * sx + p * px, s * sy + p * py, s * sz + p * pz


@part
def power(field, polarised):
    """Power of a ray; its field is a scalar and a vector, one of which is 0."""
    scalar, ex, ey, ez = field
    return square(ex) + square(ey) + square(ez) if polarised else square(scalar)


@part
def damped(field, factor):
    """Field multiplied by a factor."""
    scalar, ex, ey, ez = field
    return scalar * factor, ex * factor, ey * factor, ez * factor


@part
def bent(index, first, last, q1, q2, facing, d, f, n):
    """Refracted direction, real index and decay of the wave behind a boundary (Snell's law).

    `q1`, `q2` are the normal parts before and behind, in the sense of travel; `facing` the cosine.
    """
    (dx, dy, dz), (fx, fy, fz), (nx, ny, nz) = d, f, n
    sense = 1.0 if facing > 0.0 else -1.0
    deeper = sense * (q2 - q1)
    x, y, z = index * dx + deeper.real * nx, index * dy + deeper.real * ny, index * dz + deeper.real * nz
    size = np.sqrt(x * x + y * y + z * z)
    fade = deeper.imag
    fx, fy, fz = fx + fade * nx, fy + fade * ny, fz + fade * nz
    if last.imag == 0.0 and first.imag == 0.0:
        fx, fy, fz = 0.0, 0.0, 0.0
    scale = 1.0 / size if size > 0.0 else 0.0  # no light runs there
    # a wave that does not fade is as long as the index says
    plain = last.imag == 0.0 and fx == 0.0 and fy == 0.0 and fz == 0.0
    return (x * scale, y * scale, z * scale), (last.real if plain else size), (fx, fy, fz)


@part
def parted(field, d, h, t, n, rs, rp, ts, tp, polarised):
    """Reflected and transmitted field vectors, along the directions h and t."""
    scalar, ex, ey, ez = field
    if not polarised:
        return (scalar * rs, ex, ey, ez), (scalar * ts, ex, ey, ez)
    sx, sy, sz = sideways(d[0], d[1], d[2], n[0], n[1], n[2])
    s, p = split(ex, ey, ez, d[0], d[1], d[2], sx, sy, sz)
    hx, hy, hz = made(rs * s, rp * p, h[0], h[1], h[2], sx, sy, sz)
    tx, ty, tz = made(ts * s, tp * p, t[0], t[1], t[2], sx, sy, sz)
    return (0j, hx, hy, hz), (0j, tx, ty, tz)


@part
def field_of(light, amplitude, row, polarised):
    """Field of a row as a scalar and as a vector; one of the two is 0."""
    field = light[4]
    if polarised:
        return 0j, field[row, 0], field[row, 1], field[row, 2]
    return amplitude[row], 0j, 0j, 0j


@part
def carry(light, amplitude, row, carried, polarised):
    """Write the field of a row; a vector's amplitude is its length."""
    field = light[4]
    amplitude[row], ex, ey, ez = carried
    if polarised:
        field[row, 0], field[row, 1], field[row, 2] = ex, ey, ez
        amplitude[row] = np.sqrt(square(ex) + square(ey) + square(ez))


@part
def immerse(light, row, number, index, fades, fading):
    """Write the medium of a row, its real index and its decay."""
    medium, indices, fade = light[0], light[1], light[2]
    medium[row], indices[row] = number, index
    if fading:
        fade[row, 0], fade[row, 1], fade[row, 2] = fades


@part
def fading_of(light, row, fading):
    """Decay of a row: imaginary part of its wave vector, over k0."""
    fade = light[2]
    if fading:
        return fade[row, 0], fade[row, 1], fade[row, 2]
    return 0.0, 0.0, 0.0


@part
def copied(source, row, target, to, polarised, fading):
    """Copy the state of a row in matter to a row of the same or another table."""
    medium, indices, fade, lengths, field, dropped, bend = source
    medium_to, indices_to, fade_to, lengths_to, field_to, dropped_to, bend_to = target
    medium_to[to], indices_to[to] = medium[row], indices[row]
    dropped_to[to], bend_to[to] = dropped[row], bend[row]
    for m in range(lengths.shape[1]):
        lengths_to[to, m] = lengths[row, m]
    for k in range(3):
        if polarised:
            field_to[to, k] = field[row, k]
        if fading:
            fade_to[to, k] = fade[row, k]


@jit
def begin(light, count, index, ex, ey, ez):
    """Initialise a table with rays in the scene's medium."""
    medium, indices, fade, lengths, field, dropped, bend = light
    medium[:count], indices[:count], dropped[:count], bend[:count] = 0, index, 0.0, 0.0
    fade[:count], lengths[:count] = 0.0, 0.0
    if len(field) > 0:
        for row in range(count):
            field[row, 0], field[row, 1], field[row, 2] = ex, ey, ez


@jit
def arrive(count, batch, light, met, triangle, limits, k0, ends, end_light, ended):
    """Move each ray to its hit; record those that end before.

    Rows that go on close up: they stand at the point, with the normal and the triangle there, and have
    the direction that they came in. Returns how many there are, and how many have ended.
    """
    lost, amplitude, key, ray, bounces, reflections, serial, state, last, came = batch
    end_lost, end_amplitude, end_key, end_ray, end_bounces, end_reflections, end_serial = ends[:7]
    end_origin, end_direction, end_length, end_fate = ends[7:]
    screen, has_screen, max_bounces = limits
    indices, lengths = light[1], light[3]
    fading, polarised = len(light[2]) > 0, len(light[4]) > 0
    kept = 0
    for row in range(count):
        x, y, z, dx, dy, dz, way = under_way(state, row)
        px, py, pz, nx, ny, nz, path, rim = ahead(met, row)
        steps, gone = bounces[row], lost[row]
        fate, reach = fated(
            screen, has_screen, max_bounces, steps, triangle[row] >= 0, path, x, y, z, dx, dy, dz
        )
        step = path if fate == ALIVE else reach
        lengths[row, light[0][row]] += step
        way += step * indices[row]
        fx, fy, fz = fading_of(light, row, fading)
        fade = fx * dx + fy * dy + fz * dz
        if fade > 0.0:  # below by rounding alone: waves in passive media do not grow along the ray
            field, factor = field_of(light, amplitude, row, polarised), np.exp(-k0 * fade * step)
            gone += power(field, polarised) * (1.0 - factor * factor)
            carry(light, amplitude, row, damped(field, factor), polarised)
        if fate != ALIVE:
            x, y, z = x + reach * dx, y + reach * dy, z + reach * dz
            label(end_key, end_ray, end_bounces, ended, key[row], ray[row], steps)
            conclude(end_origin, end_direction, end_length, end_fate, ended, x, y, z, dx, dy, dz, way, fate)
            weigh(end_lost, end_amplitude, end_reflections, ended, gone, amplitude[row], reflections[row])
            end_serial[ended] = serial[row]
            copied(light, row, end_light, ended, polarised, fading)
            ended += 1
            continue
        bx, by, bz = latest(path, dx, dy, dz, came[row, 0], came[row, 1], came[row, 2])
        depart(state, kept, px, py, pz, dx, dy, dz, nx, ny, nz, way, rim)
        follows(came, last, serial, kept, bx, by, bz, triangle[row], serial[row])
        label(key, ray, bounces, kept, key[row], ray[row], steps + 1)
        weigh(lost, amplitude, reflections, kept, gone, amplitude[row], reflections[row])
        copied(light, row, light, kept, polarised, fading)
        kept += 1
    return kept, ended


@part
def duplicate(batch, light, row, to, number, polarised, fading):
    """Copy a row that splits; the copy has lost nothing yet, and a serial number of its own."""
    lost, amplitude, key, ray, bounces, reflections, serial, state, last, came = batch
    for k in range(state.shape[1]):
        state[to, k] = state[row, k]
    follows(came, last, serial, to, came[row, 0], came[row, 1], came[row, 2], last[row], number)
    label(key, ray, bounces, to, key[row] + np.uint64(1), ray[row], bounces[row])
    weigh(lost, amplitude, reflections, to, 0.0, amplitude[row], reflections[row])
    copied(light, row, light, to, polarised, fading)
    light[5][to] = 0.0


@part
def turn(state, row, d):
    """Write a new direction."""
    state[row, DX], state[row, DY], state[row, DZ] = d


@part
def allowed(follow, returns, passes):
    """Power of the branches that are followed, absorbed behind the surface, and truncated."""
    absorbed, dropped = 0.0, 0.0
    if follow & OPAQUE:
        absorbed, passes = passes, 0.0
    elif not follow & TRANSMITTED:
        dropped, passes = passes, 0.0
    if not follow & REFLECTED:
        dropped, returns = dropped + returns, 0.0
    return returns, passes, absorbed, dropped


@part
def facing_of(state, row):
    """Direction of a row, normal at its hit, and the cosine between them."""
    dx, dy, dz = state[row, DX], state[row, DY], state[row, DZ]
    nx, ny, nz = state[row, NX], state[row, NY], state[row, NZ]
    return (dx, dy, dz), (nx, ny, nz), nx * dx + ny * dy + nz * dz


@part
def sent(state, light, amplitude, row, d, medium, index, fade, field, brightness, faint, polarised, fading):
    """Write the direction and medium of a branch; whether it is bright enough to follow."""
    turn(state, row, d)
    immerse(light, row, medium, index, fade, fading)
    carry(light, amplitude, row, field, polarised)
    return FAINT if brightness < faint else ALIVE


@jit
def meet(
    count, batch, light, owner, optics, film, k0, base, faint, first, why, parent, contradictions
):  # fmt: skip
    """Reflect, transmit or split each ray at its surface.

    The transmitted branch of a ray that splits follows behind all rows; `parent` is filled with the row
    that each of them comes from; they are numbered from `first` on. `why` is what becomes of each row;
    `contradictions` counts, for each surface, the rays that came in another medium than it has there.
    Returns how many were born.
    """
    # not taken apart further: helpers that branch over arrays would count references, 170 ns a ray
    lost, amplitude, key, _, bounces, reflections, _, state, last, _ = batch
    kind, reflection, transmission, before, behind, media, follow = optics
    fading, polarised = len(light[2]) > 0, len(light[4]) > 0
    born = 0
    for row in range(count):
        surface = owner[np.uintp(last[row])]
        d, n, facing = facing_of(state, row)
        front, here, index = facing < 0.0, light[0][row], light[1][row]
        f, field = fading_of(light, row, fading), field_of(light, amplitude, row, polarised)
        fade = f[0] * n[0] + f[1] * n[1] + f[2] * n[2]
        beyond, q1 = here, complex(index * abs(facing), -fade if front else fade)
        rs, ts, q2 = reflection[surface], transmission[surface], q1
        rp, tp = -rs, ts
        if kind[surface] == BOUNDARY:
            mine, beyond = before[surface], behind[surface]
            mine, beyond = (mine, beyond) if front else (beyond, mine)
            contradictions[surface] += here != mine
            light[6][row] = max(light[6][row], 1.0 - facing * facing)
            inner, outer = media[here], media[beyond]
            if film[0][surface + 1] > film[0][surface]:
                rs, rp, ts, tp, q2 = coated(film, surface, front, inner, outer, q1, k0)
            else:
                rs, rp, ts, tp, q2 = bare(inner, outer, q1)
        t, beside, u = d, index, f
        if q1 != q2:
            t, beside, u = bent(index, media[here], media[beyond], q1, q2, facing, d, f, n)
        h = bounced(d[0], d[1], d[2], n[0], n[1], n[2], facing, bounces[row])
        back, through = parted(field, d, h, t, n, rs, rp, ts, tp, polarised)
        passes, returns = power(through, polarised), power(back, polarised)
        gone = power(field, polarised) - passes - returns
        returns, passes, absorbed, dropped = allowed(follow[surface], returns, passes)
        lost[row], light[5][row] = lost[row] + gone + absorbed, light[5][row] + dropped
        reflections[row] += kind[surface] == CONSTANT and returns > 0.0 and passes == 0.0
        key[row] = key[row] * base + np.uint64(2 * surface + 1)
        to, why[row] = row, ABSORBED
        if returns > 0.0:
            if passes > 0.0:
                to, parent[born], born = count + born, row, born + 1
                duplicate(batch, light, row, to, first + born - 1, polarised, fading)
            f = f[0] - 2.0 * fade * n[0], f[1] - 2.0 * fade * n[1], f[2] - 2.0 * fade * n[2]
            why[row] = sent(
                state, light, amplitude, row, h, here, index, f, back, returns, faint, polarised, fading
            )
        elif passes > 0.0:
            key[row] += np.uint64(1)
        if passes > 0.0:
            why[to] = sent(
                state, light, amplitude, to, t, beyond, beside, u, through, passes, faint, polarised, fading
            )
        elif returns == 0.0:
            carry(light, amplitude, row, (0j, 0j, 0j, 0j), polarised)
    return born


@jit
def leave(count, batch, light, why, ends, end_light, ended):
    """Record the rays that ended at surfaces, and compact the rest.

    Returns how many go on, and how many have ended.
    """
    lost, amplitude, key, ray, bounces, reflections, serial, state, last, came = batch
    end_lost, end_amplitude, end_key, end_ray, end_bounces, end_reflections, end_serial = ends[:7]
    end_origin, end_direction, end_length, end_fate = ends[7:]
    fading, polarised = len(light[2]) > 0, len(light[4]) > 0
    kept = 0
    for row in range(count):
        if why[row] != ALIVE:
            x, y, z, dx, dy, dz, way = under_way(state, row)
            label(end_key, end_ray, end_bounces, ended, key[row], ray[row], bounces[row])
            conclude(
                end_origin, end_direction, end_length, end_fate, ended, x, y, z, dx, dy, dz, way, why[row]
            )
            weigh(
                end_lost, end_amplitude, end_reflections, ended, lost[row], amplitude[row], reflections[row]
            )
            end_serial[ended] = serial[row]
            copied(light, row, end_light, ended, polarised, fading)
            ended += 1
            continue
        if kept < row:
            for k in range(state.shape[1]):
                state[kept, k] = state[row, k]
            follows(
                came, last, serial, kept, came[row, 0], came[row, 1], came[row, 2], last[row], serial[row]
            )
            label(key, ray, bounces, kept, key[row], ray[row], bounces[row])
            weigh(lost, amplitude, reflections, kept, lost[row], amplitude[row], reflections[row])
            copied(light, row, light, kept, polarised, fading)
        kept += 1
    return kept, ended
