"""Compiled passes of the tracing loop: rays bounce, split, end, and close up.

`interact` is the general pass. Where light meets nothing but constant amplitudes in a vacuum,
`light_columns` is None, and numba leaves out all that is about media. `rebound` is the same pass for ideal
mirrors in one body, together with its search for hits: a third more time without it.

Kernels take tables as plain tuples and name their columns inside: numba would pickle the classes of
named tuples into its cache, and fail to load it once they have another place.
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit
from fringetrace.optics import bare, coated
from fringetrace.tracing.batch import Batch, Ends, Light
from fringetrace.tracing.fates import ABSORBED, ALIVE, FAINT
from fringetrace.tracing.intersect.coincident import BACK, COUNT, FIRST, hand_on
from fringetrace.tracing.intersect.kernels import (  # fmt: skip
    EDGE,
    LEAVING,
    MARGIN,
    NX,
    NY,
    NZ,
    crossing,
    crowded,
    restart,
    reviewed,
    unsure,
)
from fringetrace.tracing.kernels_boundary import (
    branches,
    followed,
    power,
    reflected,
    refracted,
    scaled,
    square,
    strength,
)
from fringetrace.tracing.kernels_rays import (
    fate_ahead,
    latest,
    read_hit,
    read_ray,
    write_end,
    write_last,
    write_matter,
    write_path,
    write_power,
    write_ray,
    write_vector,
)
from fringetrace.tracing.optics_table import BOUNDARY, CONSTANT, SurfaceTable
from fringetrace.tracing.plan import TraceLimits


@jit
def compact(batch_columns, light_columns, start, stop, to, why, end_columns, end_light_columns, ended):
    """Move the rows of a batch from `start` to `stop` up to row `to`, but for those that end here.

    `why` is what becomes of each. Returns how many rows of the batch and of the ends are filled.
    """
    batch, ends = Batch(*batch_columns), Ends(*end_columns)
    state, last, came, crossed = batch.state, batch.last, batch.came, batch.crossed
    key, ray, bounces, serial = batch.key, batch.ray, batch.bounces, batch.serial
    lost, amplitude, reflections = batch.lost, batch.amplitude, batch.reflections
    origin, direction, length, fate = ends.origin, ends.direction, ends.length, ends.fate
    end_key, end_ray, end_bounces, end_serial = ends.key, ends.ray, ends.bounces, ends.serial
    end_lost, end_amplitude, end_reflections = ends.lost, ends.amplitude, ends.reflections
    if light_columns is not None:
        light, end_light = Light(*light_columns), Light(*end_light_columns)
        fading, polarised = len(light.fade) > 0, len(light.field) > 0
        medium, indices, lengths = light.medium, light.real_index, light.lengths
        fades, fields, dropped, bend = light.fade, light.field, light.dropped, light.bend
        end_medium, end_indices, end_lengths = end_light.medium, end_light.real_index, end_light.lengths
        end_fades, end_fields = end_light.fade, end_light.field
        end_dropped, end_bend = end_light.dropped, end_light.bend
    for row in range(start, stop):  # to <= start: nothing is overwritten before it is read
        here, number, steps, name = key[row], ray[row], bounces[row], serial[row]
        gone, value, mirrored = lost[row], amplitude[row], reflections[row]
        if why[row] != ALIVE:
            x, y, z, dx, dy, dz, way = read_ray(state, row)
            write_end(origin, direction, length, fate, ended, x, y, z, dx, dy, dz, way, why[row])
            write_path(end_key, end_ray, end_bounces, end_serial, ended, here, number, steps, name)
            write_power(end_lost, end_amplitude, end_reflections, ended, gone, value, mirrored)
            if light_columns is not None:
                write_matter(
                    end_medium, end_indices, end_dropped, end_bend, ended, medium[row], indices[row],
                    dropped[row], bend[row],
                )  # fmt: skip
                for m in range(lengths.shape[1]):
                    end_lengths[ended, m] = lengths[row, m]
                for k in range(fades.shape[1] if fading else 0):
                    end_fades[ended, k] = fades[row, k]
                for k in range(fields.shape[1] if polarised else 0):
                    end_fields[ended, k] = fields[row, k]
            ended += 1
            continue
        if to < row:
            for k in range(state.shape[1]):
                state[to, k] = state[row, k]
            for k in range(FIRST + crossed[row, COUNT]):
                crossed[to, k] = crossed[row, k]
            write_last(last, came, to, last[row], came[row, 0], came[row, 1], came[row, 2])
            write_path(key, ray, bounces, serial, to, here, number, steps, name)
            write_power(lost, amplitude, reflections, to, gone, value, mirrored)
            if light_columns is not None:
                write_matter(
                    medium, indices, dropped, bend, to, medium[row], indices[row], dropped[row], bend[row]
                )
                for m in range(lengths.shape[1]):
                    lengths[to, m] = lengths[row, m]
                for k in range(fades.shape[1] if fading else 0):
                    fades[to, k] = fades[row, k]
                for k in range(fields.shape[1] if polarised else 0):
                    fields[to, k] = fields[row, k]
        to += 1
    return to, ended


@jit
def interact(
    count, batch_columns, light_columns, met, triangle, owner, surface_columns, limit_columns, end_columns,
    end_light_columns, ended, first, serials, why, parent, contradictions,
):  # fmt: skip
    """Send each ray to what it meets and on from there; write down those that end, close up the rest.

    A ray that splits goes on as its reflected branch; transmitted ones follow behind all rows, `parent`
    is filled with the row (as it was) that each of them comes from, and they are numbered from `serials` on.
    Rays at elements stand where they came, as they came. Ends go to row `ray - first`, or, if `first` is
    negative, one after the other from `ended` on. `contradictions` counts, for each surface, the rays that
    came in another medium than it has there. Where all surfaces are `ideal` amplitudes follow from bounces.
    Returns how many rays go on, how many have ended, and the next serial number.
    """
    # not taken apart further: numba counts references to arrays that are handed to other functions in
    # loops and branches, 100 ns a ray
    batch, ends = Batch(*batch_columns), Ends(*end_columns)
    surfaces, limits = SurfaceTable(*surface_columns), TraceLimits(*limit_columns)
    screen, has_screen, most = limits.screen, limits.has_screen, limits.max_bounces
    state, last, came, crossed = batch.state, batch.last, batch.came, batch.crossed
    key, ray, bounces, serial = batch.key, batch.ray, batch.bounces, batch.serial
    lost, amplitude, reflections = batch.lost, batch.amplitude, batch.reflections
    end_origin, end_direction, end_length, end_fate = ends.origin, ends.direction, ends.length, ends.fate
    end_key, end_ray, end_bounces, end_serial = ends.key, ends.ray, ends.bounces, ends.serial
    end_lost, end_amplitude, end_reflections = ends.lost, ends.amplitude, ends.reflections
    kind, reflection, transmission = surfaces.kind, surfaces.reflection, surfaces.transmission
    ideal, faint = surfaces.ideal, limits.faint
    base = np.uint64(limits.key_base)
    polarised, fading = False, False
    if light_columns is not None:
        light, end_light = Light(*light_columns), Light(*end_light_columns)
        fading, polarised = len(light.fade) > 0, len(light.field) > 0
        medium, indices, lengths = light.medium, light.real_index, light.lengths
        fades, fields, dropped, bend = light.fade, light.field, light.dropped, light.bend
        end_medium, end_indices, end_lengths = end_light.medium, end_light.real_index, end_light.lengths
        end_fades, end_fields = end_light.fade, end_light.field
        end_dropped, end_bend = end_light.dropped, end_light.bend
        front_of, back_of, media, follow = surfaces.front, surfaces.back, surfaces.media, surfaces.follow
        film, layers = surfaces.film, surfaces.film[0]
    kept, born = 0, 0
    for row in range(count):
        x, y, z, dx, dy, dz, way = read_ray(state, row)
        px, py, pz, nx, ny, nz, path, rim = read_hit(met, row)
        here, steps, number, name = key[row], bounces[row], ray[row], serial[row]
        value, field, gone, mirrored = 1.0 + 0.0j, (1.0 + 0.0j, 0j, 0j, 0j), 0.0, steps
        if not ideal:
            value, gone, mirrored = amplitude[row], lost[row], reflections[row]
            if polarised:
                if light_columns is not None:
                    field = 0j, fields[row, 0], fields[row, 1], fields[row, 2]
            else:
                field = value, 0j, 0j, 0j
        k, gone_through = triangle[row], False
        fate, reach = fate_ahead(screen, has_screen, most, steps, k >= 0, path, x, y, z, dx, dy, dz)
        step = path if fate == ALIVE else reach
        if light_columns is None:
            way += step
        else:
            inside, index, aside, steepest = medium[row], indices[row], dropped[row], bend[row]
            f = (0.0, 0.0, 0.0)
            if fading:
                f = fades[row, 0], fades[row, 1], fades[row, 2]
            lengths[row, inside] += step
            way += step * index
            fade = f[0] * dx + f[1] * dy + f[2] * dz
            if fade > 0.0:  # below by rounding alone: waves in passive media do not grow along the ray
                factor = np.exp(-surfaces.k0 * fade * step)
                gone += power(field, polarised) * (1.0 - factor * factor)
                field = scaled(field, factor)
                value = strength(field, polarised)
        if fate == ALIVE:
            surface = owner[np.uintp(k)]
            x, y, z, steps = px, py, pz, steps + 1
            here = here * base + np.uint64(2 * surface + 1)
            bx, by, bz = latest(path, dx, dy, dz, came[row, 0], came[row, 1], came[row, 2])
            facing = nx * dx + ny * dy + nz * dz
            h = reflected(dx, dy, dz, nx, ny, nz, facing, steps)
            t = dx, dy, dz
            back, through, returns, passes = field, field, 1.0, 0.0
            if light_columns is None:
                if not ideal:
                    r, s = reflection[surface], transmission[surface]
                    back, through = (field[0] * r, 0j, 0j, 0j), (field[0] * s, 0j, 0j, 0j)
                    returns, passes = square(back[0]), square(through[0])
                    gone += square(field[0]) - returns - passes
                    mirrored += returns > 0.0 and passes == 0.0
            else:
                d, n, front = (dx, dy, dz), (nx, ny, nz), facing < 0.0
                fade = f[0] * nx + f[1] * ny + f[2] * nz
                beyond, q1 = inside, complex(index * abs(facing), -fade if front else fade)
                rs, ts, q2 = reflection[surface], transmission[surface], q1
                rp, tp = -rs, ts
                if kind[surface] == BOUNDARY:
                    mine, beyond = front_of[surface], back_of[surface]
                    mine, beyond = (mine, beyond) if front else (beyond, mine)
                    contradictions[surface] += inside != mine
                    steepest = max(steepest, 1.0 - facing * facing)
                    inner, outer = media[inside], media[beyond]
                    if layers[surface + 1] > layers[surface]:
                        rs, rp, ts, tp, q2 = coated(film, surface, front, inner, outer, q1, surfaces.k0)
                    else:
                        rs, rp, ts, tp, q2 = bare(inner, outer, q1)
                beside, u = index, f
                if q1 != q2:
                    t, beside, u = refracted(index, media[inside], media[beyond], q1, q2, facing, d, f, n)
                back, through = branches(field, d, h, t, n, rs, rp, ts, tp, polarised)
                passes, returns = power(through, polarised), power(back, polarised)
                spent = power(field, polarised) - passes - returns
                returns, passes, absorbed, skipped = followed(follow[surface], returns, passes)
                gone, aside = gone + spent + absorbed, aside + skipped
                mirrored += kind[surface] == CONSTANT and returns > 0.0 and passes == 0.0
            if returns > 0.0:
                if passes > 0.0:
                    new = count + born
                    if light_columns is not None:
                        write_matter(medium, indices, dropped, bend, new, beyond, beside, 0.0, steepest)
                        for m in range(lengths.shape[1]):
                            lengths[new, m] = lengths[row, m]
                        if fading:
                            write_vector(fades, new, u[0], u[1], u[2])
                        if polarised:
                            write_vector(fields, new, through[1], through[2], through[3])
                    write_ray(state, new, x, y, z, t[0], t[1], t[2], nx, ny, nz, way, rim)
                    write_last(last, came, new, k, bx, by, bz)
                    if path > 0.0:
                        crossed[new, COUNT], crossed[new, BACK], crossed[new, FIRST] = 1, 0, k
                    else:
                        hand_on(crossed, row, new, k)
                    write_path(
                        key, ray, bounces, serial, new, here + np.uint64(1), number, steps, serials + born
                    )
                    sent = strength(through, polarised)
                    write_power(lost, amplitude, reflections, new, 0.0, sent, mirrored)
                    why[new] = FAINT if passes < faint else ALIVE
                    parent[born], born = row, born + 1
                (dx, dy, dz), field = h, back
                if light_columns is not None and fading:
                    f = f[0] - 2.0 * fade * nx, f[1] - 2.0 * fade * ny, f[2] - 2.0 * fade * nz
                fate = FAINT if returns < faint else ALIVE
            elif passes > 0.0:
                here, gone_through = here + np.uint64(1), True
                (dx, dy, dz), field = t, through
                if light_columns is not None:
                    inside, index, f = beyond, beside, u
                fate = FAINT if passes < faint else ALIVE
            else:
                field, fate = (0j, 0j, 0j, 0j), ABSORBED
            value = strength(field, polarised)
        if fate == ALIVE:
            if path > 0.0:
                crossed[kept, COUNT], crossed[kept, BACK], crossed[kept, FIRST] = gone_through, 0, k
            else:
                hand_on(crossed, row, kept, k if gone_through else -1)
            write_ray(state, kept, x, y, z, dx, dy, dz, nx, ny, nz, way, rim)
            write_last(last, came, kept, k, bx, by, bz)
            write_path(key, ray, bounces, serial, kept, here, number, steps, name)
            if not ideal:
                write_power(lost, amplitude, reflections, kept, gone, value, mirrored)
            if light_columns is not None:
                write_matter(medium, indices, dropped, bend, kept, inside, index, aside, steepest)
                if kept < row:
                    for m in range(lengths.shape[1]):
                        lengths[kept, m] = lengths[row, m]
                if fading:
                    write_vector(fades, kept, f[0], f[1], f[2])
                if polarised:
                    write_vector(fields, kept, field[1], field[2], field[3])
            kept += 1
            continue
        end = number - first if first >= 0 else ended
        x, y, z = x + reach * dx, y + reach * dy, z + reach * dz
        write_end(end_origin, end_direction, end_length, end_fate, end, x, y, z, dx, dy, dz, way, fate)
        write_path(end_key, end_ray, end_bounces, end_serial, end, here, number, steps, name)
        if not ideal:
            write_power(end_lost, end_amplitude, end_reflections, end, gone, value, mirrored)
        if light_columns is not None:
            write_matter(end_medium, end_indices, end_dropped, end_bend, end, inside, index, aside, steepest)
            for m in range(lengths.shape[1]):
                end_lengths[end, m] = lengths[row, m]
            if fading:
                write_vector(end_fades, end, f[0], f[1], f[2])
            if polarised:
                write_vector(end_fields, end, field[1], field[2], field[3])
        ended += 1
    kept, ended = compact(
        batch_columns, light_columns, count, count + born, kept, why, end_columns, end_light_columns, ended
    )
    return kept, ended, serials + born


@jit
def rebound(
    count, steps, prim, batch_columns, contact, body, digit, limit_columns, end_columns, first, origin32,
    direction32,
):  # fmt: skip
    """`measure`, `interact` and `aim` in one, for a single body of ideal mirrors that all rays just left.

    Each has made `steps` bounces. `digit` is what a triangle adds to a key.

    Returns how many rays go on, how many have ended, and how many hits were doubtful.
    """
    batch, ends, limits = Batch(*batch_columns), Ends(*end_columns), TraceLimits(*limit_columns)
    screen, has_screen, most = limits.screen, limits.has_screen, limits.max_bounces
    key, ray, state, last, came = batch.key, batch.ray, batch.state, batch.last, batch.came
    end_key, end_ray, end_bounces = ends.key, ends.ray, ends.bounces
    origin, direction, length, end_fate = ends.origin, ends.direction, ends.length, ends.fate
    _, _, oriented, closed, frame, planes, _, crowd, _ = body
    cx, cy, cz, scale = frame[0], frame[1], frame[2], frame[3]
    unscale, margin, crowds = 1.0 / scale, frame[5], len(crowd) > 0
    base = np.uint64(limits.key_base)
    kept, ended, doubtful = 0, 0, 0
    many = base > np.uint64(3)  # else there is one surface, and one digit
    for row in range(count):
        guess = np.int64(prim[row])
        gx, gy, gz, dx, dy, dz, way = read_ray(state, row)
        x, y, z = (gx - cx) * scale, (gy - cy) * scale, (gz - cz) * scale
        leaving, edge = state[row, LEAVING], state[row, EDGE]
        facing, inverted, path, px, py, pz, rim = 0.0, 0.0, np.inf, x, y, z, np.inf
        if guess >= 0:
            k = np.uintp(guess)
            facing, inverted, path, px, py, pz, rim = crossing(planes, k, x, y, z, dx, dy, dz)
        doubt = unsure(guess, guess == last[row], path, facing, True, leaving, closed)
        look = doubt or rim <= MARGIN or edge < margin
        if crowds and not look:
            look = (guess >= 0 and crowded(crowd, guess, px, py, pz)) or crowded(crowd, last[row], x, y, z)
        if look:
            unclear, guess, (path, px, py, pz, rim), _ = reviewed(
                (x, y, z, dx, dy, dz), (came[row, 0], came[row, 1], came[row, 2]),
                (state[row, NX], state[row, NY], state[row, NZ]), last[row], leaving, edge, guess, facing,
                (path, px, py, pz, rim), doubt, row, contact, body,
            )  # fmt: skip
            doubtful += unclear
            if guess >= 0:
                k = np.uintp(guess)
                facing = planes[k, 0] * dx + planes[k, 1] * dy + planes[k, 2] * dz
                inverted = 1.0 / facing
        path = path * unscale if guess >= 0 else np.inf
        fate, reach = fate_ahead(screen, has_screen, most, steps, guess >= 0, path, gx, gy, gz, dx, dy, dz)
        if fate != ALIVE:
            end = ray[row] - first
            end_key[end], end_ray[end], end_bounces[end] = key[row], ray[row], steps
            gx, gy, gz, way = gx + reach * dx, gy + reach * dy, gz + reach * dz, way + reach
            write_end(origin, direction, length, end_fate, end, gx, gy, gz, dx, dy, dz, way, fate)
            ended += 1
            continue
        if not oriented or crowds:  # nobody else asks from where a ray came
            came[kept, 0], came[kept, 1], came[kept, 2] = latest(
                path, dx, dy, dz, came[row, 0], came[row, 1], came[row, 2]
            )
        k = np.uintp(guess)
        nx, ny, nz = planes[k, 0], planes[k, 1], planes[k, 2]
        height = nx * px + ny * py + nz * pz + planes[k, 3]
        x, y, z = px - height * nx, py - height * ny, pz - height * nz
        dx, dy, dz = reflected(dx, dy, dz, nx, ny, nz, facing, steps + 1)
        gx, gy, gz = cx + x * unscale, cy + y * unscale, cz + z * unscale
        write_ray(state, kept, gx, gy, gz, dx, dy, dz, nx, ny, nz, way + path, rim)
        state[kept, LEAVING], last[kept] = -facing, guess
        key[kept], ray[kept] = key[row] * base + np.uint64(digit[k] if many else 1), ray[row]
        x, y, z = restart(x, y, z, dx, dy, dz, nx, ny, nz, -facing, abs(inverted))
        origin32[kept, 0], origin32[kept, 1], origin32[kept, 2] = x, y, z
        direction32[kept, 0], direction32[kept, 1], direction32[kept, 2] = dx, dy, dz
        kept += 1
    return kept, ended, doubtful
