"""Fused float64 passes over ray batches, compiled by numba at first use.

A body is a mesh moved and scaled by a power of two into the unit box; lengths in here are in
that unit unless said otherwise. `planes` has 16 numbers a triangle: its plane n.p + c = 0 with
n unit, then three edge planes whose value is the distance inside each edge.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

jit: Any = njit(nogil=True, cache=True, error_model="numpy")
part: Any = njit(nogil=True, cache=True, error_model="numpy", forceinline=True)

# float32 resolves 2**-24 of the unit box; eight such steps separate a restart from its surface.
SHIFT = 2.0**-20
# Nearer than this to an edge, or to the start, float32 does not decide.
MARGIN = 8.0 * SHIFT
# A ray leaving flatter than this (cosine to the normal) grazes.
GRAZING = 0.125
# On a body that the ray has not just left, Embree starts this far behind the ray.
BEHIND = 2.0**-18
# The second opinion on a suspicious answer comes from this far aside.
ASIDE = 2.0**-19

# Triangles in a leaf of the exact tree.
LEAF = 4

DETECTED, LEFT, ABSORBED, TRUNCATED, FAINT, ALIVE = 0, 1, 2, 3, 4, 5


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
def aim(
    total, origin, direction, last, normal, frame, first, stop, path, triangle, fresh, origin32, direction32, sent
):  # fmt: skip
    """Collect, in float32 and the unit box of a body, the rays that can meet it; return how many.

    A ray that just left this body restarts `SHIFT` above its last triangle; one from outside
    starts at the bounding sphere. `fresh`: forget what each ray met before.
    """
    cx, cy, cz, scale, radius = frame[0], frame[1], frame[2], frame[3], frame[4]
    count = 0
    for row in range(total):
        if fresh:
            path[row], triangle[row] = np.inf, -1
        dx, dy, dz = direction[row, 0], direction[row, 1], direction[row, 2]
        x = (origin[row, 0] - cx) * scale
        y = (origin[row, 1] - cy) * scale
        z = (origin[row, 2] - cz) * scale
        if first <= last[row] < stop:
            # along the ray: aside, it would pass silhouettes on the wrong side; a grazing one
            # takes the rest along the normal
            nx, ny, nz = normal[row, 0], normal[row, 1], normal[row, 2]
            leaving = nx * dx + ny * dy + nz * dz
            if abs(leaving) > GRAZING:
                step = SHIFT / abs(leaving)
                x, y, z = x + step * dx, y + step * dy, z + step * dz
            else:
                step = SHIFT / GRAZING
                side = (SHIFT if leaving > 0.0 else -SHIFT) - step * leaving
                x, y, z = x + step * dx + side * nx, y + step * dy + side * ny, z + step * dz + side * nz
        else:
            along = x * dx + y * dy + z * dz
            qx, qy, qz = x - along * dx, y - along * dy, z - along * dz
            square = radius * radius - (qx * qx + qy * qy + qz * qz)
            if square < 0.0:
                continue
            reach = np.sqrt(square)
            if along > reach:
                continue
            step = -along - reach if along < -reach else -BEHIND
            x, y, z = x + step * dx, y + step * dy, z + step * dz
        origin32[count, 0], origin32[count, 1], origin32[count, 2] = x, y, z
        direction32[count, 0], direction32[count, 1], direction32[count, 2] = dx, dy, dz
        sent[count] = row
        count += 1
    return count


@jit
def suspect(
    sent, count, prim, direction, last, first, stop, closed, radius, planes, origin32, direction32, asked
):  # fmt: skip
    """Move to the front, a little aside, the rays whose answer wants a second opinion.

    Embree has holes at exact vertices. Suspicious are misses of an open body, and, of rays that
    have not just left it, misses of a closed body from within its bounding sphere and hits on
    its inside.
    """
    found = 0
    inner = (1.0 - 1e-4) * radius * radius
    for i in range(count):
        row = np.uintp(sent[i])
        tri = prim[i]
        if closed:
            if first <= last[row] < stop:
                continue
            dx, dy, dz = direction[row, 0], direction[row, 1], direction[row, 2]
            if tri >= 0:
                if planes[tri, 0] * dx + planes[tri, 1] * dy + planes[tri, 2] * dz <= 0.0:
                    continue
            elif origin32[i, 0] ** 2 + origin32[i, 1] ** 2 + origin32[i, 2] ** 2 >= inner:
                continue
        elif tri >= 0:
            continue
        origin32[found, 0] = origin32[i, 0] + 0.61 * ASIDE
        origin32[found, 1] = origin32[i, 1] - 0.47 * ASIDE
        origin32[found, 2] = origin32[i, 2] + 0.64 * ASIDE
        direction32[found, 0] = direction32[i, 0]
        direction32[found, 1] = direction32[i, 1]
        direction32[found, 2] = direction32[i, 2]
        asked[found] = i
        found += 1
    return found


@jit
def select(order, keys, start, stop, middle):
    """Reorder order[start:stop] so that the keys before `middle` are none larger than those after."""
    low, high = start, stop - 1
    while low < high:
        pivot = keys[order[(low + high) // 2]]
        i, j = low, high
        while i <= j:
            while keys[order[i]] < pivot:
                i += 1
            while keys[order[j]] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            break


@jit
def girth(order, lower, upper, start, stop):
    """Half the surface of the box around some triangles, times their number."""
    x, y, z = 0.0, 0.0, 0.0
    if stop > start:
        low, high = lower[:, order[start]].copy(), upper[:, order[start]].copy()
        for i in range(start, stop):
            for k in range(3):
                low[k] = min(low[k], lower[k, order[i]])
                high[k] = max(high[k], upper[k, order[i]])
        x, y, z = high[0] - low[0], high[1] - low[1], high[2] - low[2]
    return (x * y + y * z + z * x) * (stop - start)


@jit
def arrange(lower, upper, middle, leaves):
    """Order of triangles for a complete binary tree: halved across the axis with the least surface.

    `lower`, `upper`, `middle` are (3, t): the triangles' boxes and their centres.
    """
    count = lower.shape[1]
    order = np.arange(count)
    stack = [(0, LEAF * leaves)]
    while len(stack) > 0:
        start, size = stack.pop()
        half = size // 2
        stop = min(start + size, count)
        # the halves of a node are full from the left: what is missing is missing at the end
        if size <= LEAF or stop - start <= half:
            if size > LEAF and stop > start:
                stack.append((start, half))
            continue
        cheapest, axis = np.inf, 0
        for k in range(3):
            select(order, middle[k], start, stop, start + half)
            cost = girth(order, lower, upper, start, start + half) + girth(
                order, lower, upper, start + half, stop
            )
            if cost < cheapest:
                cheapest, axis = cost, k
        if axis != 2:
            select(order, middle[axis], start, stop, start + half)
        stack.append((start, half))
        stack.append((start + half, half))
    return order


@part
def permute(x, y, z, axis):
    """Coordinates with `axis` last (cyclic)."""
    if axis == 0:
        return y, z, x
    if axis == 1:
        return z, x, y
    return x, y, z


@jit
def crosses(corners, tri, x, y, z, axis, shear_x, shear_y):
    """Whether a line goes through a triangle: watertight, shared edges decide alike on both sides.

    Source: Woop, Benthin, Wald, J. Comput. Graph. Tech. 2 (2013) 65, in float64.
    """
    ax, ay, az = permute(corners[tri, 0] - x, corners[tri, 1] - y, corners[tri, 2] - z, axis)
    bx, by, bz = permute(corners[tri, 3] - x, corners[tri, 4] - y, corners[tri, 5] - z, axis)
    cx, cy, cz = permute(corners[tri, 6] - x, corners[tri, 7] - y, corners[tri, 8] - z, axis)
    ax, ay = ax - shear_x * az, ay - shear_y * az
    bx, by = bx - shear_x * bz, by - shear_y * bz
    cx, cy = cx - shear_x * cz, cy - shear_y * cz
    u = cx * by - cy * bx
    v = ax * cy - ay * cx
    w = bx * ay - by * ax
    if (u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0):
        return False
    return u + v + w != 0.0


@part
def inset(planes, tri, x, y, z):
    """Distance inside the nearest edge of a triangle; negative outside."""
    a = planes[tri, 4] * x + planes[tri, 5] * y + planes[tri, 6] * z + planes[tri, 7]
    b = planes[tri, 8] * x + planes[tri, 9] * y + planes[tri, 10] * z + planes[tri, 11]
    c = planes[tri, 12] * x + planes[tri, 13] * y + planes[tri, 14] * z + planes[tri, 15]
    least = a if a < b else b
    return least if least < c else c


@part
def enters(lower, upper, node, x, y, z, ix, iy, iz, nearest):
    """Path at which a ray enters a box, or infinity if it does not before `nearest`."""
    if lower[node, 0] > upper[node, 0]:  # an empty one
        return np.inf
    ax, bx = (lower[node, 0] - x) * ix, (upper[node, 0] - x) * ix
    ay, by = (lower[node, 1] - y) * iy, (upper[node, 1] - y) * iy
    az, bz = (lower[node, 2] - z) * iz, (upper[node, 2] - z) * iz
    begin, end = min(ax, bx), max(ax, bx)
    begin, end = max(begin, min(ay, by)), min(end, max(ay, by))
    begin, end = max(begin, min(az, bz)), min(end, max(az, bz))
    return begin if begin <= end and end >= -1e-9 and begin <= nearest else np.inf


@part
def inverse(component):
    """1 / component, finite: a slab that a ray runs along is entered nowhere or everywhere."""
    return 1.0 / component if abs(component) > 1e-200 else 1e200


@jit
def decide(
    x, y, z, dx, dy, dz, skip, guess, limit, side, bx, by, bz, planes, corners, order, lower, upper, tolerance
):  # fmt: skip
    """First hit of a ray in float64 alone, by a bounding volume tree; triangle -1 if none before `limit`.

    `skip` is the triangle just left, `guess` one that is likely hit (or below 0). A face that
    the start touches is hit at 0 if the ray goes on through it: seen from the region it travels
    in (`side` = +-1: before or behind oriented faces), or, for side = 0, in the sense in which
    it came, along b. side = 2: a source, which touches nothing.
    """
    magnitude = max(abs(dx), abs(dy), abs(dz))
    axis = 0 if abs(dx) == magnitude else (1 if abs(dy) == magnitude else 2)
    px, py, pz = permute(dx, dy, dz, axis)
    shear_x, shear_y = px / pz, py / pz
    ix, iy, iz = inverse(dx), inverse(dy), inverse(dz)
    nearest, best = limit, -1
    leaves = len(lower) // 2
    stack = np.empty(64, np.int64)
    stack[0] = 1
    depth = 1
    first = guess >= 0 and guess != skip
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if first:  # bounds the search before it begins
            begin, end = -1, 0
            depth += 1
        else:
            if enters(lower, upper, node, x, y, z, ix, iy, iz, nearest) == np.inf:
                continue
            if node < leaves:
                left = enters(lower, upper, 2 * node, x, y, z, ix, iy, iz, nearest)
                right = enters(lower, upper, 2 * node + 1, x, y, z, ix, iy, iz, nearest)
                near = 2 * node if left <= right else 2 * node + 1
                if max(left, right) < np.inf:
                    stack[depth] = 4 * node + 1 - near
                    depth += 1
                if min(left, right) < np.inf:
                    stack[depth] = near
                    depth += 1
                continue
            begin = LEAF * (node - leaves)
            end = begin + LEAF
        for slot in range(begin, end):
            tri = guess if first else order[slot]
            if tri < 0 or tri == skip:
                continue
            nx, ny, nz = planes[tri, 0], planes[tri, 1], planes[tri, 2]
            height = nx * x + ny * y + nz * z + planes[tri, 3]
            facing = nx * dx + ny * dy + nz * dz
            if side != 2 and abs(height) <= tolerance and inset(planes, tri, x, y, z) >= -tolerance:
                onward = facing * side < 0.0 if side != 0 else facing * (nx * bx + ny * by + nz * bz) > 0.0
                if not onward:
                    continue
                path = 0.0
            else:
                if facing == 0.0:
                    continue
                path = -height / facing
                if not (path > 0.0 and path <= nearest):
                    continue
                if not crosses(corners, tri, x, y, z, axis, shear_x, shear_y):
                    continue
            if path < nearest or (path == nearest and tri < best):
                nearest, best = path, tri
        first = False
    return nearest, best


@jit
def doubted(
    x, y, z, dx, dy, dz, row, own, guess, limit, leaving, last, normal, straight, first, oriented, frame,
    planes, corners, order, lower, upper,
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
            bx -= 2.0 * leaving * normal[row, 0]
            by -= 2.0 * leaving * normal[row, 1]
            bz -= 2.0 * leaving * normal[row, 2]
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
    sent, count, prim, origin, direction, last, normal, edge, straight, first, stop, oriented, closed, frame,
    planes, corners, order, lower, upper, path, triangle, point, facet, rim,
):  # fmt: skip
    """Turn Embree's triangle numbers into float64 hits; decide the doubtful ones exactly.

    Keeps a hit where it is nearer than `path` (metres). Returns how many were doubtful.
    """
    # one long loop: numba counts references of every array that a function inside it takes
    cx, cy, cz, scale = frame[0], frame[1], frame[2], frame[3]
    unscale = 1.0 / scale
    doubtful = 0
    for i in range(count):
        row = np.uintp(sent[i])
        guess = np.int64(prim[i])
        left = last[row]
        own = first <= left < stop
        if guess == -1 and not own:
            continue
        dx, dy, dz = direction[row, 0], direction[row, 1], direction[row, 2]
        x = (origin[row, 0] - cx) * scale
        y = (origin[row, 1] - cy) * scale
        z = (origin[row, 2] - cz) * scale
        leaving = normal[row, 0] * dx + normal[row, 1] * dy + normal[row, 2] * dz
        distance, px, py, pz, inside = np.inf, x, y, z, 0.0
        if guess >= 0:
            k = np.uintp(guess)
            facing = planes[k, 0] * dx + planes[k, 1] * dy + planes[k, 2] * dz
            height = planes[k, 0] * x + planes[k, 1] * y + planes[k, 2] * z + planes[k, 3]
            distance = -height / facing
            px, py, pz = x + distance * dx, y + distance * dy, z + distance * dz
            inside = inset(planes, k, px, py, pz)
            doubt = not (inside > MARGIN and distance > MARGIN and distance < 1e300)
            doubt |= own and (guess == left - first or (oriented and facing * leaving >= 0.0))
        else:
            doubt = guess == -2 or (own and closed and leaving < 0.0)
        near = own and edge[row] < frame[5]
        if doubt or near:
            # near an edge the step off the surface may have jumped something; beyond it Embree is
            # right, if the step went along the ray
            doubtful += 1
            local = not doubt and abs(leaving) > GRAZING
            exact, tri, ex, ey, ez, rest = doubted(
                x, y, z, dx, dy, dz, row, own, np.int64(-1) if local else guess,
                2.0 * MARGIN if local else np.inf, leaving, last, normal, straight, first, oriented, frame,
                planes, corners, order, lower, upper,
            )  # fmt: skip
            if tri >= 0 or not local:
                distance, guess, px, py, pz, inside = exact, tri, ex, ey, ez, rest
        if guess < 0 or not distance * unscale < path[row]:
            continue
        # rounding left the point a little off its plane: put it back
        k = np.uintp(guess)
        nx, ny, nz = planes[k, 0], planes[k, 1], planes[k, 2]
        height = nx * px + ny * py + nz * pz + planes[k, 3]
        path[row] = distance * unscale
        triangle[row] = first + guess
        point[row, 0] = cx + (px - height * nx) * unscale
        point[row, 1] = cy + (py - height * ny) * unscale
        point[row, 2] = cz + (pz - height * nz) * unscale
        facet[row, 0], facet[row, 1], facet[row, 2] = nx, ny, nz
        rim[row] = inside
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
def interact(
    count, origin, direction, normal, length, edge, lost, amplitude, key, ray, last, bounces, reflections,
    straight, serial, path, triangle, point, facet, rim, owner, reflection, transmission, plain, screen,
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
        x, y, z = origin[row, 0], origin[row, 1], origin[row, 2]
        dx, dy, dz = direction[row, 0], direction[row, 1], direction[row, 2]
        way, here, steps = length[row], key[row], bounces[row]
        before, gone, mirrored = 1.0 + 0.0j, 0.0, steps
        if not plain:
            before, gone, mirrored = amplitude[row], lost[row], reflections[row]
        fate = ALIVE
        through = False
        reach = np.inf
        if has_screen:
            reach = lands(screen, path[row], x, y, z, dx, dy, dz)
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
            x, y, z = point[row, 0], point[row, 1], point[row, 2]
            nx, ny, nz = facet[row, 0], facet[row, 1], facet[row, 2]
            way += path[row]
            steps += 1
            here = here * base + np.uint64(2 * surface + 1)
            along = 2.0 * (nx * dx + ny * dy + nz * dz)
            rx, ry, rz = dx - along * nx, dy - along * ny, dz - along * nz
            # one Newton step keeps the length at 1 over thousands of bounces
            scale = 1.5 - 0.5 * (rx * rx + ry * ry + rz * rz)
            rx, ry, rz = rx * scale, ry * scale, rz * scale
            if not plain:
                r, t = reflection[surface], transmission[surface]
                r2, t2 = r.real * r.real + r.imag * r.imag, t.real * t.real + t.imag * t.imag
                power = before.real * before.real + before.imag * before.imag
                gone += power * (1.0 - r2 - t2)
                if r2 > 0.0 and t2 > 0.0:
                    new = count + born
                    born += 1
                    origin[new, 0], origin[new, 1], origin[new, 2] = x, y, z
                    direction[new, 0], direction[new, 1], direction[new, 2] = dx, dy, dz
                    normal[new, 0], normal[new, 1], normal[new, 2] = nx, ny, nz
                    length[new], edge[new], lost[new] = way, rim[row], 0.0
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
                origin[kept, 0], origin[kept, 1], origin[kept, 2] = x, y, z
                direction[kept, 0], direction[kept, 1], direction[kept, 2] = dx, dy, dz
                normal[kept, 0], normal[kept, 1], normal[kept, 2] = nx, ny, nz
                length[kept], edge[kept], last[kept] = way, rim[row], triangle[row]
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
        for k in range(3):
            origin[to, k], direction[to, k], normal[to, k] = origin[new, k], direction[new, k], normal[new, k]
        length[to], edge[to], lost[to], amplitude[to] = length[new], edge[new], lost[new], amplitude[new]
        key[to], ray[to], last[to], bounces[to] = key[new], ray[new], last[new], bounces[new]
        reflections[to], straight[to], serial[to] = reflections[new], straight[new], serial[new]
    return kept + born, born, ended, serials


@jit
def gather(row, column, length, amplitude, period, total):
    """Add amplitude * exp(2 pi i length / period) to the pixels, in the order of the rays.

    The remainder is exact, so long paths cost no digits.
    """
    rows, columns = total.shape
    for i in range(len(length)):
        v, u = int(row[i]), int(column[i])
        turn = 2.0 * np.pi * ((length[i] % period) / period)
        phasor = complex(np.cos(turn), np.sin(turn))
        total[min(v, rows - 1), min(u, columns - 1)] += amplitude[i] * phasor
