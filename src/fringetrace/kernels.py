"""Fused float64 passes over ray batches, compiled by numba at first use.

A body is a mesh moved and scaled by a power of two into the unit box; lengths in here are in
that unit unless said otherwise. `planes` has 16 numbers a triangle: its plane n.p + c = 0 with
n unit, then three edge planes whose value is the distance inside each edge.
"""

from __future__ import annotations

import numpy as np

from fringetrace.exact import decide, enters, inset, inverse, jit, part

# float32 resolves 2**-24 of the unit box; eight such steps separate a restart from its surface.
SHIFT = 2.0**-20
# Nearer than this to an edge, or to the start, float32 does not decide.
MARGIN = 8.0 * SHIFT
# A ray leaving flatter than this (cosine to the normal) grazes.
GRAZING = 0.125
# A fold with normals nearer than this (cosine) is gentle: a ray steeper than STEEP (cosine to the
# normal) cannot meet both of its faces, 26 degrees against 30.
GENTLE, STEEP = 0.9, 0.5
# On a body that the ray has not just left, Embree starts this far behind the ray.
BEHIND = 2.0**-18
# The second opinion on a suspicious answer comes from this far aside.
ASIDE = 2.0**-19

# Columns of a batch's `state`: origin, direction, normal of the face last left, optical path (metres),
# distance of the start from that face's nearest edge (unit box), cosine of the ray to that normal.
OX, OY, OZ, DX, DY, DZ, NX, NY, NZ, WAY, EDGE, LEAVING = range(12)
# Columns of `met`: path to what a ray meets next, the point (metres), the normal, distance from the edge.
PATH, PX, PY, PZ, FX, FY, FZ, RIM = range(8)

DETECTED, LEFT, ABSORBED, TRUNCATED, FAINT, ALIVE = 0, 1, 2, 3, 4, 5


@part
def restart(x, y, z, dx, dy, dz, nx, ny, nz, leaving, per):
    """A point `SHIFT` above the face that a ray leaves at the cosine `leaving`, one over `per`.

    Along the ray: aside, it would pass silhouettes on the wrong side. A grazing ray takes the
    rest along the normal.
    """
    if abs(leaving) > GRAZING:
        step = SHIFT * per
        return x + step * dx, y + step * dy, z + step * dz
    step = SHIFT / GRAZING
    side = (SHIFT if leaving > 0.0 else -SHIFT) - step * leaving
    return x + step * dx + side * nx, y + step * dy + side * ny, z + step * dz + side * nz


@part
def bounced(dx, dy, dz, nx, ny, nz, facing, steps):
    """A direction after reflection at a face that it meets at the cosine `facing`.

    Every eighth time, by the number of `steps`, a Newton step keeps the length at 1.
    """
    along = 2.0 * facing
    dx, dy, dz = dx - along * nx, dy - along * ny, dz - along * nz
    if steps & 7 == 0:
        scale = 1.5 - 0.5 * (dx * dx + dy * dy + dz * dz)
        dx, dy, dz = dx * scale, dy * scale, dz * scale
    return dx, dy, dz


@jit
def launch(first, rows, columns, centre, u, v, direction, width, height, start, along):
    """Origins and directions of a beam's rays from number `first` on: centres of its grid cells."""
    for i in range(len(start)):
        x = ((first + i) % columns + 0.5) / columns * width - 0.5 * width
        y = ((first + i) // columns + 0.5) / rows * height - 0.5 * height
        for k in range(3):
            start[i, k] = centre[k] + (x * u[k] + y * v[k])
            along[i, k] = direction[k]


@jit
def begin(
    start, along, length, first, state, lost, amplitude, key, ray, last, bounces, reflections, straight,
    serial,
):  # fmt: skip
    """Fill a batch with rays that have met nothing yet; the amplitude is that of the path alone."""
    for i in range(len(start)):
        state[i, OX], state[i, OY], state[i, OZ] = start[i, 0], start[i, 1], start[i, 2]
        state[i, DX], state[i, DY], state[i, DZ] = along[i, 0], along[i, 1], along[i, 2]
        state[i, NX], state[i, NY], state[i, NZ] = 0.0, 0.0, 0.0
        state[i, WAY], state[i, EDGE] = length[i], 0.0
        lost[i], amplitude[i], key[i] = 0.0, 1.0, 0
        ray[i], last[i], serial[i] = first + i, -1, i
        bounces[i], reflections[i], straight[i] = 0, 0, False


@jit
def aim(
    total, state, last, frame, first, stop, owner, members, flat, lower, upper, cull, met, triangle, fresh,
    origin32, direction32, sent,
):  # fmt: skip
    """Collect, in float32 and the unit box of a body, the rays that can meet it; return how many.

    `members` are the body's surfaces, in boxes `lower` to `upper`; from a `flat` one a ray does not
    come back to it. A ray that just left this body restarts `SHIFT` above its last triangle; one
    from outside starts at the bounding sphere. `cull`: leave out those that cannot meet anything.
    `fresh`: forget what each ray met before.
    """
    cx, cy, cz, scale, radius = frame[0], frame[1], frame[2], frame[3], frame[4]
    count = 0
    for row in range(total):
        if fresh:
            met[row, PATH], triangle[row] = np.inf, -1
        dx, dy, dz = state[row, DX], state[row, DY], state[row, DZ]
        x = (state[row, OX] - cx) * scale
        y = (state[row, OY] - cy) * scale
        z = (state[row, OZ] - cz) * scale
        own = first <= last[row] < stop
        step = 0.0
        if not own:
            along = x * dx + y * dy + z * dz
            qx, qy, qz = x - along * dx, y - along * dy, z - along * dz
            square = radius * radius - (qx * qx + qy * qy + qz * qz)
            if square < 0.0:
                continue
            reach = np.sqrt(square)
            if along > reach:
                continue
            step = -along - reach if along < -reach else -BEHIND
        if cull and (len(members) > 1 or (own and flat[0])):
            ix, iy, iz = inverse(dx), inverse(dy), inverse(dz)
            left = owner[last[row]] if own else -1
            hopeful = False
            for s in range(len(members)):
                if members[s] == left:
                    hopeful |= not flat[s]
                else:
                    hopeful |= enters(lower, upper, s, x, y, z, ix, iy, iz, np.inf) < np.inf
            if not hopeful:
                continue
        if own:
            nx, ny, nz = state[row, NX], state[row, NY], state[row, NZ]
            leaving = nx * dx + ny * dy + nz * dz
            state[row, LEAVING] = leaving
            x, y, z = restart(x, y, z, dx, dy, dz, nx, ny, nz, leaving, 1.0 / abs(leaving))
        else:
            x, y, z = x + step * dx, y + step * dy, z + step * dz
        origin32[count, 0], origin32[count, 1], origin32[count, 2] = x, y, z
        direction32[count, 0], direction32[count, 1], direction32[count, 2] = dx, dy, dz
        sent[count] = row
        count += 1
    return count


@jit
def suspect(sent, count, prim, state, last, first, stop, closed, radius, planes, origin32, leaving, asked):
    """List the rays whose answer wants other opinions, of those that are just `leaving` the body or not.

    Embree has holes at exact vertices, and float32 blurs the rim of an open body. Suspicious are
    misses of an open body, and, of rays that have not just left it, misses of a closed body from
    within its bounding sphere and hits on its inside. Returns how many.
    """
    found = 0
    inner = (1.0 - 1e-4) * radius * radius
    for i in range(count):
        row = np.uintp(sent[i])
        tri = prim[i]
        if (first <= last[row] < stop) != leaving:
            continue
        if closed and tri >= 0:
            facing = planes[tri, 0] * state[row, DX] + planes[tri, 1] * state[row, DY]
            if facing + planes[tri, 2] * state[row, DZ] <= 0.0:
                continue
        elif closed:
            if origin32[i, 0] ** 2 + origin32[i, 1] ** 2 + origin32[i, 2] ** 2 >= inner:
                continue
        elif tri >= 0:
            continue
        asked[found] = i
        found += 1
    return found


@jit
def beside(sent, asked, found, state, last, first, stop, origin32, turn, moved, heading):
    """Move suspicious rays `ASIDE`, across themselves, to the side `turn` (0, 1, 2: 120 degrees apart).

    Whichever way a rim runs, one of the three sides is well inside it. None goes through the face
    just left.
    """
    cos, sin = np.cos(2.0 * np.pi * turn / 3.0), np.sin(2.0 * np.pi * turn / 3.0)
    for i in range(found):
        row = np.uintp(sent[asked[i]])
        dx, dy, dz = state[row, DX], state[row, DY], state[row, DZ]
        # u and v across the ray, from the axis that it is least along
        if abs(dx) <= abs(dy) and abs(dx) <= abs(dz):
            ux, uy, uz = 0.0, dz, -dy
        elif abs(dy) <= abs(dz):
            ux, uy, uz = -dz, 0.0, dx
        else:
            ux, uy, uz = dy, -dx, 0.0
        size = ASIDE / np.sqrt(ux * ux + uy * uy + uz * uz)
        ux, uy, uz = ux * size, uy * size, uz * size
        vx, vy, vz = dy * uz - dz * uy, dz * ux - dx * uz, dx * uy - dy * ux
        ax, ay, az = cos * ux + sin * vx, cos * uy + sin * vy, cos * uz + sin * vz
        if first <= last[row] < stop:
            nx, ny, nz = state[row, NX], state[row, NY], state[row, NZ]
            up = ax * nx + ay * ny + az * nz
            if up * (nx * dx + ny * dy + nz * dz) < 0.0:
                ax, ay, az = ax - up * nx, ay - up * ny, az - up * nz
        moved[i, 0] = origin32[asked[i], 0] + ax
        moved[i, 1] = origin32[asked[i], 1] + ay
        moved[i, 2] = origin32[asked[i], 2] + az
        heading[i, 0], heading[i, 1], heading[i, 2] = dx, dy, dz


@jit
def softly(planes, tri, x, y, z, folds, margin):
    """Whether all edges of a triangle that a point is nearer to than `margin` have gentle folds (bits)."""
    for k in range(3):
        e = 4 * k + 4
        height = planes[tri, e] * x + planes[tri, e + 1] * y + planes[tri, e + 2] * z + planes[tri, e + 3]
        if height < margin and not (folds >> k) & 1:
            return False
    return True


@jit
def doubted(
    x, y, z, dx, dy, dz, row, own, guess, limit, leaving, last, state, straight, first, oriented, closed,
    frame, planes, corners, order, lower, upper,
):  # fmt: skip
    """Exact hit of a doubtful ray before `limit`: path, triangle, a point inside its edges."""
    radius, tolerance = frame[4], frame[6]
    along = x * dx + y * dy + z * dz
    start = 0.0
    if along < -2.0 * radius:  # far off: decide from near the body
        start = -along - 1.5 * radius
        x, y, z = x + start * dx, y + start * dy, z + start * dz
    bx, by, bz = dx, dy, dz
    skip = np.int64(-1)
    if own:
        skip = last[row] - first
    if last[row] < 0 or start > 0.0:
        side = 2
    elif own and oriented:
        side = 1 if leaving > 0.0 else -1
    else:
        side = 0
        if not straight[row]:  # it was reflected: undo that
            bx -= 2.0 * leaving * state[row, NX]
            by -= 2.0 * leaving * state[row, NY]
            bz -= 2.0 * leaving * state[row, NZ]
    path, tri = decide(
        x, y, z, dx, dy, dz, skip, guess, limit, side, bx, by, bz, planes, corners, order, lower, upper,
        tolerance,
    )  # fmt: skip
    if tri < 0 and side == -1 and closed and limit == np.inf:
        # along a face to the very edge of the next: from a little further inside it cannot be missed
        nx, ny, nz = state[row, NX], state[row, NY], state[row, NZ]
        x, y, z = x - 8.0 * tolerance * nx, y - 8.0 * tolerance * ny, z - 8.0 * tolerance * nz
        path, tri = decide(
            x, y, z, dx, dy, dz, skip, guess, limit, side, bx, by, bz, planes, corners, order, lower, upper,
            tolerance,
        )  # fmt: skip
    inside = np.inf
    if tri >= 0:
        x, y, z = x + path * dx, y + path * dy, z + path * dz
        for k in range(4, 16, 4):
            ex, ey, ez = planes[tri, k], planes[tri, k + 1], planes[tri, k + 2]
            height = ex * x + ey * y + ez * z + planes[tri, k + 3]
            inside = min(inside, height)
            if height < 0.0:
                x, y, z = x - height * ex, y - height * ey, z - height * ez
    return start + path, tri, x, y, z, inside


@jit
def measure(
    sent, count, prim, state, last, straight, first, stop, oriented, closed, frame, planes, gentle, corners,
    order, lower, upper, met, triangle,
):  # fmt: skip
    """Turn Embree's triangle numbers into float64 hits; decide the doubtful ones exactly.

    Keeps a hit where it is nearer than the one in `met`. Returns how many were doubtful.
    """
    # one long loop: numba counts references of every array that a function inside it takes
    cx, cy, cz, scale = frame[0], frame[1], frame[2], frame[3]
    unscale, sure = 1.0 / scale, 4.0 * frame[6]
    doubtful = 0
    for i in range(count):
        row = np.uintp(sent[i])
        guess = np.int64(prim[i])
        left = last[row]
        own = first <= left < stop
        if guess == -1 and not own:
            continue
        dx, dy, dz = state[row, DX], state[row, DY], state[row, DZ]
        x = (state[row, OX] - cx) * scale
        y = (state[row, OY] - cy) * scale
        z = (state[row, OZ] - cz) * scale
        leaving = state[row, NX] * dx + state[row, NY] * dy + state[row, NZ] * dz
        distance, px, py, pz, inside = np.inf, x, y, z, 0.0
        if guess >= 0:
            k = np.uintp(guess)
            facing = planes[k, 0] * dx + planes[k, 1] * dy + planes[k, 2] * dz
            height = planes[k, 0] * x + planes[k, 1] * y + planes[k, 2] * z + planes[k, 3]
            distance = -height * (1.0 / facing)
            px, py, pz = x + distance * dx, y + distance * dy, z + distance * dz
            inside = inset(planes, k, px, py, pz)
            doubt = not (distance > MARGIN and distance < 1e300)
            if inside <= MARGIN:
                steep = inside > sure and abs(facing) > STEEP
                doubt |= not (steep and softly(planes, guess, px, py, pz, gentle[k], MARGIN))
            doubt |= own and (guess == left - first or (closed and facing * leaving >= 0.0))
        else:
            doubt = guess == -2 or (own and closed and leaving < 0.0)
        near = own and state[row, EDGE] < frame[5]
        if near and abs(leaving) > STEEP:
            near = not softly(planes, left - first, x, y, z, gentle[left - first], frame[5])
        if doubt or near:
            # near an edge the step off the surface may have jumped something; beyond it Embree is
            # right, if the step went along the ray
            doubtful += 1
            local = not doubt and abs(leaving) > GRAZING
            exact, tri, ex, ey, ez, rest = doubted(
                x, y, z, dx, dy, dz, row, own, np.int64(-1) if local else guess,
                2.0 * MARGIN if local else np.inf, leaving, last, state, straight, first, oriented,
                closed, frame,
                planes, corners, order, lower, upper,
            )  # fmt: skip
            if tri >= 0 or not local:
                distance, guess, px, py, pz, inside = exact, tri, ex, ey, ez, rest
        if guess < 0 or not distance * unscale < met[row, PATH]:
            continue
        # rounding left the point a little off its plane: put it back
        k = np.uintp(guess)
        nx, ny, nz = planes[k, 0], planes[k, 1], planes[k, 2]
        height = nx * px + ny * py + nz * pz + planes[k, 3]
        met[row, PATH] = distance * unscale
        triangle[row] = first + guess
        met[row, PX] = cx + (px - height * nx) * unscale
        met[row, PY] = cy + (py - height * ny) * unscale
        met[row, PZ] = cz + (pz - height * nz) * unscale
        met[row, FX], met[row, FY], met[row, FZ] = nx, ny, nz
        met[row, RIM] = inside
    return doubtful


@part
def lands(screen, path, x, y, z, dx, dy, dz):
    """Path to the CCD if a ray reaches its front within `path` metres, else infinity."""
    x, y, z = x - screen[0], y - screen[1], z - screen[2]
    facing = dx * screen[3] + dy * screen[4] + dz * screen[5]
    reach = -(x * screen[3] + y * screen[4] + z * screen[5]) / facing
    if not (facing < 0.0 and reach > 0.0 and reach < path):
        return np.inf
    reach += screen[14] / facing  # back along the ray to the plane in focus
    u = (x + reach * dx) * screen[6] + (y + reach * dy) * screen[7] + (z + reach * dz) * screen[8]
    v = (x + reach * dx) * screen[9] + (y + reach * dy) * screen[10] + (z + reach * dz) * screen[11]
    inside = -screen[12] <= u < screen[12] and -screen[13] <= v < screen[13]
    return reach if inside else np.inf


@jit
def rebound(
    count, steps, prim, state, key, ray, last, straight, oriented, closed,
    frame, planes, gentle, corners, order, lower, upper, digit, base, screen, has_screen, max_bounces,
    end_origin, end_direction, end_length, end_key, end_ray, end_bounces, end_fate, ended, first, origin32,
    direction32,
):  # fmt: skip
    """`measure`, `interact` and `aim` in one, for a single body of ideal mirrors that all rays just left.

    Each has made `steps` bounces. `digit` is what a triangle adds to a key of that `base`.

    Returns how many rays go on, how many have ended, and how many hits were doubtful.
    """
    cx, cy, cz, scale = frame[0], frame[1], frame[2], frame[3]
    unscale, sure = 1.0 / scale, 4.0 * frame[6]
    kept, doubtful = 0, 0
    many = base > np.uint64(3)  # else there is one surface, and one digit
    for row in range(count):
        guess = np.int64(prim[row])
        gx, gy, gz = state[row, OX], state[row, OY], state[row, OZ]
        dx, dy, dz = state[row, DX], state[row, DY], state[row, DZ]
        x, y, z = (gx - cx) * scale, (gy - cy) * scale, (gz - cz) * scale
        leaving = state[row, LEAVING]
        distance, px, py, pz, inside, facing, inverted = np.inf, x, y, z, 0.0, 0.0, 0.0
        if guess >= 0:
            k = np.uintp(guess)
            facing = planes[k, 0] * dx + planes[k, 1] * dy + planes[k, 2] * dz
            height = planes[k, 0] * x + planes[k, 1] * y + planes[k, 2] * z + planes[k, 3]
            inverted = 1.0 / facing
            distance = -height * inverted
            px, py, pz = x + distance * dx, y + distance * dy, z + distance * dz
            inside = inset(planes, k, px, py, pz)
            doubt = not (distance > MARGIN and distance < 1e300)
            if inside <= MARGIN:
                steep = inside > sure and abs(facing) > STEEP
                doubt |= not (steep and softly(planes, guess, px, py, pz, gentle[k], MARGIN))
            doubt |= guess == last[row] or (closed and facing * leaving >= 0.0)
        else:
            doubt = guess == -2 or (closed and leaving < 0.0)
        near = state[row, EDGE] < frame[5]
        if near and abs(leaving) > STEEP:
            near = not softly(planes, last[row], x, y, z, gentle[last[row]], frame[5])
        if doubt or near:
            doubtful += 1
            k = np.uintp(last[row])
            state[row, NX], state[row, NY], state[row, NZ] = planes[k, 0], planes[k, 1], planes[k, 2]
            local = not doubt and abs(leaving) > GRAZING  # see `measure`
            exact, tri, ex, ey, ez, rest = doubted(
                x, y, z, dx, dy, dz, row, True, np.int64(-1) if local else guess,
                2.0 * MARGIN if local else np.inf, leaving, last, state, straight, 0, oriented, closed, frame,
                planes, corners, order, lower, upper,
            )  # fmt: skip
            if tri >= 0 or not local:
                distance, guess, px, py, pz, inside = exact, tri, ex, ey, ez, rest
                if guess >= 0:
                    k = np.uintp(guess)
                    facing = planes[k, 0] * dx + planes[k, 1] * dy + planes[k, 2] * dz
                    inverted = 1.0 / facing
        path = distance * unscale
        reach = np.inf
        if has_screen:
            reach = lands(screen, path if guess >= 0 else np.inf, gx, gy, gz, dx, dy, dz)
        fate = ALIVE
        if reach < np.inf:
            fate = DETECTED
        elif guess < 0:
            fate, reach = LEFT, 0.0
        elif steps >= max_bounces:
            fate, reach = TRUNCATED, 0.0
        if fate != ALIVE:
            end = ray[row] - first
            end_origin[end, 0] = gx + reach * dx
            end_origin[end, 1] = gy + reach * dy
            end_origin[end, 2] = gz + reach * dz
            end_direction[end, 0], end_direction[end, 1], end_direction[end, 2] = dx, dy, dz
            end_length[end], end_key[end], end_ray[end] = state[row, WAY] + reach, key[row], ray[row]
            end_bounces[end], end_fate[end] = steps, fate
            ended += 1
            continue
        k = np.uintp(guess)
        nx, ny, nz = planes[k, 0], planes[k, 1], planes[k, 2]
        height = nx * px + ny * py + nz * pz + planes[k, 3]
        x, y, z = px - height * nx, py - height * ny, pz - height * nz
        dx, dy, dz = bounced(dx, dy, dz, nx, ny, nz, facing, steps + 1)
        gx, gy, gz = cx + x * unscale, cy + y * unscale, cz + z * unscale
        state[kept, OX], state[kept, OY], state[kept, OZ] = gx, gy, gz
        state[kept, DX], state[kept, DY], state[kept, DZ] = dx, dy, dz
        state[kept, WAY], state[kept, EDGE] = state[row, WAY] + path, inside
        state[kept, LEAVING], last[kept] = -facing, guess
        key[kept] = key[row] * base + np.uint64(digit[k] if many else 1)
        ray[kept] = ray[row]
        x, y, z = restart(x, y, z, dx, dy, dz, nx, ny, nz, -facing, abs(inverted))
        origin32[kept, 0], origin32[kept, 1], origin32[kept, 2] = x, y, z
        direction32[kept, 0], direction32[kept, 1], direction32[kept, 2] = dx, dy, dz
        kept += 1
    return kept, ended, doubtful


@jit
def interact(
    count, state, lost, amplitude, key, ray, last, bounces, reflections, straight, serial, met, triangle,
    owner, reflection, transmission, plain, screen,
    has_screen, max_bounces, faint, end_origin, end_direction, end_length, end_lost, end_amplitude, end_key,
    end_ray, end_bounces, end_reflections, end_fate, end_serial, ended, first, serials,
):  # fmt: skip
    """Send each ray through what it met; write down those that end, close up the rest.

    A ray that splits goes on as its reflected branch; transmitted ones follow behind all rows.
    Ends go to row `ray - first`, or, if `first` is negative, one after the other from `ended` on.
    In a `plain` scene all surfaces reflect with -1: amplitudes follow from bounces. Returns how many
    rays go on, how many of them are new, how many have ended, and the next serial number.
    """
    base = np.uint64(2 * len(reflection) + 1)
    kept, born = 0, 0
    for row in range(count):
        x, y, z = state[row, OX], state[row, OY], state[row, OZ]
        dx, dy, dz = state[row, DX], state[row, DY], state[row, DZ]
        way, here, steps = state[row, WAY], key[row], bounces[row]
        before, gone, mirrored = 1.0 + 0.0j, 0.0, steps
        if not plain:
            before, gone, mirrored = amplitude[row], lost[row], reflections[row]
        fate = ALIVE
        through = False
        reach = np.inf
        if has_screen:
            reach = lands(screen, met[row, PATH], x, y, z, dx, dy, dz)
        if reach < np.inf:
            x, y, z = x + reach * dx, y + reach * dy, z + reach * dz
            way += reach
            fate = DETECTED
        elif triangle[row] < 0:
            fate = LEFT
        elif steps >= max_bounces:
            fate = TRUNCATED
        else:
            surface = owner[np.uintp(triangle[row])]
            x, y, z = met[row, PX], met[row, PY], met[row, PZ]
            nx, ny, nz = met[row, FX], met[row, FY], met[row, FZ]
            way += met[row, PATH]
            steps += 1
            here = here * base + np.uint64(2 * surface + 1)
            rx, ry, rz = bounced(dx, dy, dz, nx, ny, nz, nx * dx + ny * dy + nz * dz, steps)
            if not plain:
                r, t = reflection[surface], transmission[surface]
                r2, t2 = r.real * r.real + r.imag * r.imag, t.real * t.real + t.imag * t.imag
                power = before.real * before.real + before.imag * before.imag
                gone += power * (1.0 - r2 - t2)
                if r2 > 0.0 and t2 > 0.0:
                    new = count + born
                    born += 1
                    state[new, OX], state[new, OY], state[new, OZ] = x, y, z
                    state[new, DX], state[new, DY], state[new, DZ] = dx, dy, dz
                    state[new, NX], state[new, NY], state[new, NZ] = nx, ny, nz
                    state[new, WAY], state[new, EDGE], lost[new] = way, met[row, RIM], 0.0
                    amplitude[new], key[new], ray[new] = before * t, here + np.uint64(1), ray[row]
                    last[new], bounces[new], reflections[new] = triangle[row], steps, mirrored
                    straight[new], serial[new] = True, serials
                    serials += 1
                    # too faint to be followed: ends here, as a row of its own
                    if power * t2 < faint:
                        born -= 1
                        end_origin[ended, 0], end_origin[ended, 1], end_origin[ended, 2] = x, y, z
                        end_direction[ended, 0], end_direction[ended, 1] = dx, dy
                        end_direction[ended, 2] = dz
                        end_length[ended], end_lost[ended], end_amplitude[ended] = way, 0.0, before * t
                        end_key[ended], end_ray[ended] = here + np.uint64(1), ray[row]
                        end_bounces[ended], end_reflections[ended] = steps, mirrored
                        end_fate[ended], end_serial[ended] = FAINT, serials - 1
                        ended += 1
                if r2 > 0.0:
                    before = before * r
                    mirrored += 1 if t2 == 0.0 else 0
                    power *= r2
                elif t2 > 0.0:
                    before = before * t
                    rx, ry, rz = dx, dy, dz
                    here += np.uint64(1)
                    through = True
                    power *= t2
                else:
                    before = 0.0j
                    rx, ry, rz = dx, dy, dz
                    fate = ABSORBED
                if fate == ALIVE and power < faint:
                    fate = FAINT
            dx, dy, dz = rx, ry, rz
            if fate == ALIVE:
                state[kept, OX], state[kept, OY], state[kept, OZ] = x, y, z
                state[kept, DX], state[kept, DY], state[kept, DZ] = dx, dy, dz
                state[kept, NX], state[kept, NY], state[kept, NZ] = nx, ny, nz
                state[kept, WAY], state[kept, EDGE], last[kept] = way, met[row, RIM], triangle[row]
                key[kept], ray[kept], bounces[kept], serial[kept] = here, ray[row], steps, serial[row]
                if not plain:
                    lost[kept], amplitude[kept] = gone, before
                    reflections[kept], straight[kept] = mirrored, through
                kept += 1
                continue
        end = ray[row] - first if first >= 0 else ended
        end_origin[end, 0], end_origin[end, 1], end_origin[end, 2] = x, y, z
        end_direction[end, 0], end_direction[end, 1], end_direction[end, 2] = dx, dy, dz
        end_length[end], end_key[end], end_ray[end] = way, here, ray[row]
        end_bounces[end], end_fate[end], end_serial[end] = steps, fate, serial[row]
        if not plain:
            end_lost[end], end_amplitude[end], end_reflections[end] = gone, before, mirrored
        ended += 1
    for i in range(born):  # kept <= count: in order, nothing is overwritten before it is read
        new, to = count + i, kept + i
        state[to] = state[new]
        lost[to], amplitude[to] = lost[new], amplitude[new]
        key[to], ray[to], last[to], bounces[to] = key[new], ray[new], last[new], bounces[new]
        reflections[to], straight[to], serial[to] = reflections[new], straight[new], serial[new]
    return kept + born, born, ended, serials


@part
def place(screen, pitch, rows, columns, x, y, z):
    """CCD coordinates (row, column) in pixels of a point in its plane of focus."""
    x, y, z = x - screen[0], y - screen[1], z - screen[2]
    v = (x * screen[9] + y * screen[10] + z * screen[11]) / pitch + 0.5 * rows
    u = (x * screen[6] + y * screen[7] + z * screen[8]) / pitch + 0.5 * columns
    return v, u


@jit
def locate(screen, pitch, rows, columns, point, pixel):
    """`place` for points (n, 3)."""
    for i in range(len(point)):
        pixel[i, 0], pixel[i, 1] = place(screen, pitch, rows, columns, point[i, 0], point[i, 1], point[i, 2])


@jit
def gather(fate, point, length, amplitude, reflections, loss, screen, pitch, weight, period, total):
    """Add weight * amplitude * exp(2 pi i length / period) of detected rays to their pixels, in order.

    The remainder is exact, so long paths cost no digits. Without `loss` the -1 of each reflection
    is left out.
    """
    rows, columns = total.shape
    for i in range(len(fate)):
        if fate[i] != DETECTED:
            continue
        v, u = place(screen, pitch, rows, columns, point[i, 0], point[i, 1], point[i, 2])
        turn = 2.0 * np.pi * ((length[i] % period) / period)
        phasor = complex(np.cos(turn), np.sin(turn)) * weight
        if not loss and reflections[i] % 2 == 1:
            phasor = -phasor
        # a point on the rim may round to the pixel beyond it
        row, column = min(max(int(np.floor(v)), 0), rows - 1), min(max(int(np.floor(u)), 0), columns - 1)
        total[row, column] += amplitude[i] * phasor


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
