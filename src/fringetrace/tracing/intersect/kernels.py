"""Compiled hit kernels: rays for Embree, doubt about its answers, measurement in float64.

A body is a mesh moved and scaled by a power of two into the unit box; lengths in here are in
that unit unless said otherwise. `planes` has 16 numbers a triangle: its plane n.p + c = 0 with
n unit, then three edge planes whose value is the distance inside each edge. A `body` is what
`bodies.Body.packed` makes of it.

Functions that take arrays within a loop over rays are inlined and without branches (`part`), or called for
few of the rays: numba counts references to arrays at each call, and threads wait for each other there.
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit, lean, part
from fringetrace.tracing.intersect.coincident import BACK, sooner
from fringetrace.tracing.intersect.exact import beside, decide, enters, inset, inverse

# float32 resolves 2**-24 of the unit box; eight such steps separate a restart from its surface.
SHIFT = 2.0**-20
# Nearer than this to an edge, or to the start, float32 does not decide.
MARGIN = 8.0 * SHIFT
# A ray leaving flatter than this (cosine to the normal) grazes.
GRAZING = 0.125
# Flatter to a face than this (cosine) a ray in float32 may cross its plane beside what `GROWN` adds to it.
SLANTED = 2.0**-5
# Flatter to a face than this (cosine) float32 knows the path to it to less than 2**-13 of the box.
FLAT = 2.0**-10
# Paths that agree to this part of them are the same, as far as roundings tell.
TIE = 2.0**-49
# A fold with normals nearer than this (cosine) is gentle: a ray steeper than STEEP (cosine to the
# normal) cannot meet both of its faces, 26 degrees against 30.
GENTLE, STEEP = 0.9, 0.5
# On a body that the ray has not just left, Embree starts this far behind the ray; behind a ray that grazes
# farther, up to one over `LEAST` times.
BEHIND, LEAST = 2.0**-18, 2.0**-10
# Embree is given triangles that are larger by this on all sides: it has holes at vertices, and blurs rims.
GROWN = SHIFT

# Columns of a batch's `state`: origin, direction, normal of the face last left, optical path (metres),
# distance of the start from that face's nearest edge (unit box), cosine of the ray to that normal.
OX, OY, OZ, DX, DY, DZ, NX, NY, NZ, WAY, EDGE, LEAVING = range(12)
# Columns of `met`: path to what a ray meets next, the point (metres), the normal, distance from the edge.
PATH, PX, PY, PZ, FX, FY, FZ, RIM = range(8)


@part
def restart(x, y, z, dx, dy, dz, nx, ny, nz, leaving, per):
    """Start point `SHIFT` above the face that a ray leaves at the cosine `leaving`, one over `per`.

    Along the ray: aside, it would pass silhouettes on the wrong side. A grazing ray takes the
    rest along the normal.
    """
    if abs(leaving) > GRAZING:
        step = SHIFT * per
        return x + step * dx, y + step * dy, z + step * dz
    step = SHIFT / GRAZING
    side = (SHIFT if leaving > 0.0 else -SHIFT) - step * leaving
    return x + step * dx + side * nx, y + step * dy + side * ny, z + step * dz + side * nz


@jit
def aim(
    total, state, last, frame, first, stop, owner, members, flat, lower, upper, cull, met, triangle, fresh,
    origin32, direction32, sent,
):  # fmt: skip
    """Collect the rays that can meet a body, in float32 and its unit box; their number.

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
            if along < -reach:
                step = -along - reach
            else:
                step = -BEHIND
                if last[row] >= 0:  # faces may lie on the one that it left, and it may graze them
                    cosine = abs(state[row, NX] * dx + state[row, NY] * dy + state[row, NZ] * dz)
                    step /= min(max(cosine / GRAZING, LEAST), 1.0)
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


@lean
def softly(planes, tri, x, y, z, folds, margin):
    """Whether all edges of a triangle within `margin` of a point have gentle folds (bits)."""
    for k in range(3):
        e = 4 * k + 4
        height = planes[tri, e] * x + planes[tri, e + 1] * y + planes[tri, e + 2] * z + planes[tri, e + 3]
        if height < margin and not (folds >> k) & 1:
            return False
    return True


@part
def crossing(planes, tri, x, y, z, dx, dy, dz):
    """Intersection of a ray with a triangle's plane: cosine, its reciprocal, path, point, edge distance.

    The rim is the distance of the point inside the nearest edge.
    """
    facing = planes[tri, 0] * dx + planes[tri, 1] * dy + planes[tri, 2] * dz
    height = planes[tri, 0] * x + planes[tri, 1] * y + planes[tri, 2] * z + planes[tri, 3]
    inverted = 1.0 / facing
    path = -height * inverted
    px, py, pz = x + path * dx, y + path * dy, z + path * dz
    return facing, inverted, path, px, py, pz, inset(planes, tri, px, py, pz)


@part
def unsure(guess, again, path, facing, own, leaving, closed):
    """Whether float32 is in doubt, edges aside; `again`: it names the triangle just left.

    A guess of -1 is a miss, of -2 no answer.
    """
    if guess < 0:
        return (guess < -1) | (own & closed & (leaving < 0.0))
    measurable = (path > MARGIN) & (path < 1e300) & (abs(facing) > FLAT)
    return (not measurable) | (own & (again | (closed & (facing * leaving >= 0.0))))


@lean
def clamped(planes, tri, x, y, z):
    """Point moved back inside the edges of a triangle, and how far inside it was."""
    rim = np.inf
    for k in range(4, 16, 4):
        ex, ey, ez = planes[tri, k], planes[tri, k + 1], planes[tri, k + 2]
        height = ex * x + ey * y + ez * z + planes[tri, k + 3]
        rim = min(rim, height)
        if height < 0.0:
            x, y, z = x - height * ex, y - height * ey, z - height * ez
    return x, y, z, rim


@jit
def decided(ray, came, normal, left, leaving, guess, limit, row, contact, body):
    """Exact hit of a doubtful ray before `limit`: triangle, (path, point inside its edges, rim), back.

    `back` is the place of the triangle in the list of faces that the ray has crossed, see `coincident`.
    """
    first, _, oriented, closed, frame, planes, _, _, tree = body
    owner, sides, grain, medium, crossed, last = contact
    x, y, z, dx, dy, dz = ray
    radius, tolerance = frame[4], frame[6]
    along = x * dx + y * dy + z * dz
    start = 0.0
    if along < -2.0 * radius:  # far off: decide from near the body
        start = -along - 1.5 * radius
        x, y, z = x + start * dx, y + start * dy, z + start * dz
    side = 0
    if start > 0.0:
        side = 2
    elif left == -2:
        side = 1
    elif left >= 0 and oriented:
        side = 1 if leaving > 0.0 else -1
    if left == -1:
        tolerance += grain[owner[last[row]]] * frame[3]
    skip = left if left >= 0 else np.int64(-1)
    table = (owner, sides, grain, medium, crossed, first, oriented, closed)
    path, tri, back = decide(
        (x, y, z, dx, dy, dz), skip, guess, limit, side, came, row, table, planes, tree, tolerance
    )
    if tri < 0 and side == -1 and closed and limit == np.inf:
        # along a face to the very edge of the next: from a little further inside it cannot be missed
        nx, ny, nz = normal
        x, y, z = x - 8.0 * tolerance * nx, y - 8.0 * tolerance * ny, z - 8.0 * tolerance * nz
        path, tri, back = decide(
            (x, y, z, dx, dy, dz), skip, guess, limit, side, came, row, table, planes, tree, tolerance
        )
    rim = np.inf
    if tri >= 0:
        x, y, z, rim = clamped(planes, tri, x + path * dx, y + path * dy, z + path * dz)
    return tri, (start + path, x, y, z, rim), back


@lean
def crowded(crowd, tri, x, y, z):
    """Whether a point of a triangle is where others are near it that share no edge with it."""
    if crowd[tri, 0] > x or crowd[tri, 1] > y or crowd[tri, 2] > z:
        return False
    return crowd[tri, 3] >= x and crowd[tri, 4] >= y and crowd[tri, 5] >= z


@jit
def reviewed(ray, came, normal, left, leaving, edge, guess, facing, hit, doubt, row, contact, body):
    """Review of a hit in doubt or near an edge: whether float32 is in doubt, triangle, hit, back.

    `left` is the triangle of this body that the ray just left, at the cosine `leaving` and `edge` away
    from its nearest edge; -1: one of another body, -2: none. `hit` is path, point and rim.
    """
    frame, planes, gentle, crowd = body[4], body[5], body[6], body[7]
    x, y, z = ray[0], ray[1], ray[2]
    _, px, py, pz, rim = hit
    if guess >= 0 and rim <= MARGIN:
        steep = rim > 4.0 * frame[6] and abs(facing) > STEEP
        doubt |= not (steep and softly(planes, guess, px, py, pz, gentle[guess], MARGIN))
    near = left >= 0 and edge < frame[5]
    if near and abs(leaving) > STEEP:
        near = not softly(planes, left, x, y, z, gentle[left], frame[5])
    if len(crowd) > 0:
        doubt |= guess >= 0 and crowded(crowd, guess, px, py, pz)
        near |= left >= 0 and crowded(crowd, left, x, y, z)
    if not (doubt or near):
        return False, guess, hit, 0
    # near an edge the step off the surface may have jumped something; beyond it Embree is right, if the
    # step went along the ray
    local = not doubt and abs(leaving) > GRAZING
    limit = 2.0 * MARGIN if local else np.inf
    tri, exact, back = decided(
        ray, came, normal, left, leaving, np.int64(-1) if local else guess, limit, row, contact, body
    )
    if tri >= 0 or not local:
        return True, tri, exact, back
    return True, guess, hit, 0


@lean
def nearer(state, row, met, triangle, contact, normal, facing, number, path):
    """Whether a hit comes before the one in `met`: at the same place the faces decide, not the rounding.

    `path` is in metres, `number` that of the triangle.
    """
    owner, sides, grain, medium, _, _ = contact
    other, mine, theirs = met[row, PATH], owner[number], owner[triangle[row]]
    if path > 0.0 and other > 0.0:
        tie = (grain[mine] + grain[theirs] + TIE * path) / abs(facing)
        if abs(path - other) > tie:
            return path < other
    elif path != other:
        return path < other
    fx, fy, fz = met[row, FX], met[row, FY], met[row, FZ]
    faced = fx * state[row, DX] + fy * state[row, DY] + fz * state[row, DZ]
    here = (np.int64(mine), facing, normal, path, np.int64(number))
    there = (np.int64(theirs), faced, (fx, fy, fz), other, np.int64(triangle[row]))
    return sooner(sides, medium[row], here, there)


@jit
def preferred(rows, state, met, triangle, contact, normals, numbers, paths):
    """Whether hits of some rows, of triangles with `numbers`, come before those in `met`; see `nearer`."""
    better = np.zeros(len(rows), np.bool_)
    for i in range(len(rows)):
        row = rows[i]
        if not met[row, PATH] < np.inf:
            better[i] = paths[i] < np.inf
            continue
        normal = (normals[i, 0], normals[i, 1], normals[i, 2])
        facing = normal[0] * state[row, DX] + normal[1] * state[row, DY] + normal[2] * state[row, DZ]
        better[i] = nearer(state, row, met, triangle, contact, normal, facing, numbers[i], paths[i])
    return better


@lean
def overlooked(guess, facing, leaving, x, y, z, closed, radius, planes, tree):
    """Whether float32 may have passed over a face of a body that a ray comes to, in its unit box.

    The ray leaves a face of another body at the cosine `leaving`; 0: it is a source's.
    """
    if x * x + y * y + z * z > radius * radius:
        return closed and guess >= 0 and facing > 0.0  # out of what it never went into
    if leaving == 0.0 or abs(leaving) > SLANTED:
        return False
    return beside(planes, tree[1], tree[2], tree[3], x, y, z, MARGIN)


@jit
def measure(sent, count, prim, state, last, came, contact, body, met, triangle):
    """Measure Embree's hits in float64; decide the doubtful ones exactly.

    Keeps a hit where it is nearer than the one in `met`. Returns how many were doubtful.
    """
    first, stop, _, closed, frame, planes, _, crowd, tree = body
    cx, cy, cz, scale = frame[0], frame[1], frame[2], frame[3]
    unscale, margin, many = 1.0 / scale, frame[5], len(crowd) > 0
    crossed, slack = contact[4], 2.0 * contact[2].max()
    doubtful = 0
    for i in range(count):
        row = np.uintp(sent[i])
        guess = np.int64(prim[i])
        own = first <= last[row] < stop
        dx, dy, dz = state[row, DX], state[row, DY], state[row, DZ]
        nx, ny, nz = state[row, NX], state[row, NY], state[row, NZ]
        x = (state[row, OX] - cx) * scale
        y = (state[row, OY] - cy) * scale
        z = (state[row, OZ] - cz) * scale
        leaving = nx * dx + ny * dy + nz * dz
        left = last[row] - first if own else np.int64(-1 if last[row] >= 0 else -2)
        edge = state[row, EDGE] if own else np.inf
        facing, path, px, py, pz, rim = 0.0, np.inf, x, y, z, np.inf
        back = 0
        if guess >= 0:
            k = np.uintp(guess)
            facing, _, path, px, py, pz, rim = crossing(planes, k, x, y, z, dx, dy, dz)
        if own:
            doubt = unsure(guess, guess == left, path, facing, own, leaving, closed)
        else:
            strange = overlooked(guess, facing, leaving, x, y, z, closed, frame[4], planes, tree)
            if guess < 0 and not strange:
                continue
            doubt = strange or unsure(guess, guess == left, path, facing, own, leaving, closed)
        look = doubt or rim <= MARGIN or edge < margin
        if many and not look:
            look = (guess >= 0 and crowded(crowd, guess, px, py, pz)) or (
                left >= 0 and crowded(crowd, left, x, y, z)
            )
        if look:
            unclear, guess, (path, px, py, pz, rim), back = reviewed(
                (x, y, z, dx, dy, dz), (came[row, 0], came[row, 1], came[row, 2]), (nx, ny, nz), left,
                leaving, edge, guess, facing, (path, px, py, pz, rim), doubt, row, contact, body,
            )  # fmt: skip
            doubtful += unclear
        if guess < 0:
            continue
        # rounding left the point a little off its plane: put it back
        k = np.uintp(guess)
        nx, ny, nz = planes[k, 0], planes[k, 1], planes[k, 2]
        length, other, facing = path * unscale, met[row, PATH], nx * dx + ny * dy + nz * dz
        if length >= other and (length - other) * abs(facing) > slack + TIE * length and other > 0.0:
            continue  # as `nearer` says, at less cost
        if other < np.inf and not nearer(
            state, row, met, triangle, contact, (nx, ny, nz), facing, first + guess, length
        ):
            continue
        if path == 0.0:
            crossed[row, BACK] = back
        height = nx * px + ny * py + nz * pz + planes[k, 3]
        triangle[row] = first + guess
        met[row, PATH], met[row, RIM] = path * unscale, rim
        met[row, PX] = cx + (px - height * nx) * unscale
        met[row, PY] = cy + (py - height * ny) * unscale
        met[row, PZ] = cz + (pz - height * nz) * unscale
        met[row, FX], met[row, FY], met[row, FZ] = nx, ny, nz
    return doubtful
