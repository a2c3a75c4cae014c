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

# float32 resolves 2**-24 of the unit box; eight such steps separate a restart from its surface.
SHIFT = 2.0**-20
# Nearer than this to an edge, or to the start, float32 does not decide.
MARGIN = 8.0 * SHIFT
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
    active, total, origin, direction, last, normal, frame, first, stop, path, triangle, fresh, origin32,
    direction32, sent,
):  # fmt: skip
    """Collect, in float32 and the unit box of a body, the rays that can meet it; return how many.

    A ray that just left this body restarts `SHIFT` above its last triangle; one from outside
    starts at the bounding sphere. `fresh`: forget what each ray met before.
    """
    cx, cy, cz, scale, radius = frame[0], frame[1], frame[2], frame[3], frame[4]
    count = 0
    for i in range(total):
        row = np.uintp(active[i])
        if fresh:
            path[row], triangle[row] = np.inf, -1
        dx, dy, dz = direction[row, 0], direction[row, 1], direction[row, 2]
        x = (origin[row, 0] - cx) * scale
        y = (origin[row, 1] - cy) * scale
        z = (origin[row, 2] - cz) * scale
        along = x * dx + y * dy + z * dz
        qx, qy, qz = x - along * dx, y - along * dy, z - along * dz
        square = radius * radius - (qx * qx + qy * qy + qz * qz)
        if square < 0.0:
            continue
        reach = np.sqrt(square)
        if along > reach:
            continue
        if first <= last[row] < stop:
            # along the ray: aside, it would pass silhouettes on the wrong side; a grazing one
            # takes the rest along the normal
            nx, ny, nz = normal[row, 0], normal[row, 1], normal[row, 2]
            leaving = nx * dx + ny * dy + nz * dz
            step = SHIFT / max(abs(leaving), 0.125)
            side = (SHIFT if leaving > 0.0 else -SHIFT) - step * leaving
            x += step * dx + side * nx
            y += step * dy + side * ny
            z += step * dz + side * nz
        else:
            step = -along - reach if along < -reach else -BEHIND
            x += step * dx
            y += step * dy
            z += step * dz
        origin32[count, 0], origin32[count, 1], origin32[count, 2] = x, y, z
        direction32[count, 0], direction32[count, 1], direction32[count, 2] = dx, dy, dz
        sent[count] = active[i]
        count += 1
    return count


@jit
def suspect(sent, count, prim, direction, last, first, stop, closed, planes, origin32, direction32, asked):
    """Move to the front, a little aside, the rays whose answer wants a second opinion.

    These are misses of an open body, and first hits on the inside of a closed one: Embree has
    holes at exact vertices.
    """
    found = 0
    for i in range(count):
        row = np.uintp(sent[i])
        tri = prim[i]
        if closed:
            if tri < 0 or first <= last[row] < stop:
                continue
            facing = (
                planes[tri, 0] * direction[row, 0]
                + planes[tri, 1] * direction[row, 1]
                + planes[tri, 2] * direction[row, 2]
            )
            if facing <= 0.0:
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
            cost = girth(order, lower, upper, start, start + half) + girth(order, lower, upper, start + half, stop)
            if cost < cheapest:
                cheapest, axis = cost, k
        if axis != 2:
            select(order, middle[axis], start, stop, start + half)
        stack.append((start, half))
        stack.append((start + half, half))
    return order


@jit
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


@jit
def inset(planes, tri, x, y, z):
    """Distance inside the nearest edge of a triangle; negative outside."""
    a = planes[tri, 4] * x + planes[tri, 5] * y + planes[tri, 6] * z + planes[tri, 7]
    b = planes[tri, 8] * x + planes[tri, 9] * y + planes[tri, 10] * z + planes[tri, 11]
    c = planes[tri, 12] * x + planes[tri, 13] * y + planes[tri, 14] * z + planes[tri, 15]
    least = a if a < b else b
    return least if least < c else c


@jit
def enters(lower, upper, node, x, y, z, ix, iy, iz, nearest):
    """Path at which a ray enters a box, or infinity if it does not before `nearest`."""
    ax, bx = (lower[node, 0] - x) * ix, (upper[node, 0] - x) * ix
    ay, by = (lower[node, 1] - y) * iy, (upper[node, 1] - y) * iy
    az, bz = (lower[node, 2] - z) * iz, (upper[node, 2] - z) * iz
    begin, end = min(ax, bx), max(ax, bx)
    begin, end = max(begin, min(ay, by)), min(end, max(ay, by))
    begin, end = max(begin, min(az, bz)), min(end, max(az, bz))
    return begin if begin <= end and end >= -1e-9 and begin <= nearest else np.inf


@jit
def inverse(component):
    """1 / component, finite: a slab that a ray runs along is entered nowhere or everywhere."""
    return 1.0 / component if abs(component) > 1e-200 else 1e200


@jit
def decide(
    x, y, z, dx, dy, dz, skip, guess, side, bx, by, bz, planes, corners, order, lower, upper, tolerance
):  # fmt: skip
    """First hit of a ray in float64 alone, by a bounding volume tree; (inf, -1) if none.

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
    nearest, best = np.inf, -1
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
def doubted(x, y, z, dx, dy, dz, row, own, guess, last, first, normal, straight, leaving, oriented, frame,
            planes, corners, order, lower, upper):  # fmt: skip
    """Exact hit of a doubtful ray: its path and triangle, and a point put back inside its edges."""
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
        x, y, z, dx, dy, dz, skip, guess, side, bx, by, bz, planes, corners, order, lower, upper, tolerance
    )
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
    sent, count, prim, origin, direction, last, normal, edge, straight, frame, first, stop, oriented, closed,
    planes, corners, order, lower, upper, path, triangle, point, facet, rim,
):  # fmt: skip
    """Turn Embree's triangle numbers into float64 hits; decide the doubtful ones exactly.

    Keeps a hit where it is nearer than `path` (metres). Returns how many were doubtful.
    """
    cx, cy, cz, scale, restart = frame[0], frame[1], frame[2], frame[3], frame[5]
    unscale = 1.0 / scale
    doubtful = 0
    for i in range(count):
        row = np.uintp(sent[i])
        dx, dy, dz = direction[row, 0], direction[row, 1], direction[row, 2]
        x = (origin[row, 0] - cx) * scale
        y = (origin[row, 1] - cy) * scale
        z = (origin[row, 2] - cz) * scale
        left = last[row]
        own = first <= left < stop
        leaving = normal[row, 0] * dx + normal[row, 1] * dy + normal[row, 2] * dz
        guess = np.int64(prim[i])
        distance, px, py, pz, inside = np.inf, x, y, z, 0.0
        if guess >= 0:
            tri = np.uintp(guess)
            facing = planes[tri, 0] * dx + planes[tri, 1] * dy + planes[tri, 2] * dz
            height = planes[tri, 0] * x + planes[tri, 1] * y + planes[tri, 2] * z + planes[tri, 3]
            distance = -height / facing
            px, py, pz = x + distance * dx, y + distance * dy, z + distance * dz
            inside = inset(planes, tri, px, py, pz)
            doubt = not (inside > MARGIN and distance > MARGIN and distance < 1e300)
            doubt |= own and (edge[row] < restart or guess == left - first)
            doubt |= own and oriented and facing * leaving >= 0.0
        else:
            doubt = guess == -2 or (own and (edge[row] < restart or (closed and leaving < 0.0)))
        if doubt:
            doubtful += 1
            distance, guess, px, py, pz, inside = doubted(
                x, y, z, dx, dy, dz, row, own, guess, last, first, normal, straight, leaving, oriented,
                frame, planes, corners, order, lower, upper,
            )  # fmt: skip
        if guess < 0 or not distance * unscale < path[row]:
            continue
        tri = np.uintp(guess)
        # rounding left the point a little off its plane: put it back
        nx, ny, nz = planes[tri, 0], planes[tri, 1], planes[tri, 2]
        height = nx * px + ny * py + nz * pz + planes[tri, 3]
        path[row] = distance * unscale
        triangle[row] = first + guess
        point[row, 0] = cx + (px - height * nx) * unscale
        point[row, 1] = cy + (py - height * ny) * unscale
        point[row, 2] = cz + (pz - height * nz) * unscale
        facet[row, 0], facet[row, 1], facet[row, 2] = nx, ny, nz
        rim[row] = inside
    return doubtful


@jit
def land(screen, row, path, origin, direction, length, fate):
    """End a ray on the CCD if it reaches its front before `path` metres; say whether it did."""
    dx, dy, dz = direction[row, 0], direction[row, 1], direction[row, 2]
    x, y, z = origin[row, 0] - screen[0], origin[row, 1] - screen[1], origin[row, 2] - screen[2]
    facing = dx * screen[3] + dy * screen[4] + dz * screen[5]
    if not facing < 0.0:
        return False
    reach = -(x * screen[3] + y * screen[4] + z * screen[5]) / facing
    if not (reach > 0.0 and reach < path):
        return False
    reach += screen[14] / facing  # back along the ray to the plane in focus
    u = (x + reach * dx) * screen[6] + (y + reach * dy) * screen[7] + (z + reach * dz) * screen[8]
    v = (x + reach * dx) * screen[9] + (y + reach * dy) * screen[10] + (z + reach * dz) * screen[11]
    if not (-screen[12] <= u < screen[12] and -screen[13] <= v < screen[13]):
        return False
    origin[row, 0] += reach * dx
    origin[row, 1] += reach * dy
    origin[row, 2] += reach * dz
    length[row] += reach
    fate[row] = DETECTED
    return True


@jit
def interact(
    active, count, rows, origin, direction, length, amplitude, bounces, reflections, key, fate, ray, last,
    normal, edge, straight, lost, parent, path, triangle, point, facet, rim, owner, reflection, transmission,
    plain, screen, has_screen, max_bounces, faint,
):  # fmt: skip
    """Send each active ray through what it met; return how many go on (kept in `active`) and all rows.

    A ray that splits goes on as its reflected branch; the transmitted one gets a new row. In a
    `plain` scene all surfaces reflect with -1: amplitudes are left alone.
    """
    base = np.uint64(2 * len(reflection) + 1)
    kept, top = 0, rows
    for i in range(count):
        row = np.uintp(active[i])
        if has_screen and land(screen, row, path[row], origin, direction, length, fate):
            continue
        if triangle[row] < 0:
            fate[row] = LEFT
            continue
        if bounces[row] >= max_bounces:
            fate[row] = TRUNCATED
            continue
        surface = owner[np.uintp(triangle[row])]
        nx, ny, nz = facet[row, 0], facet[row, 1], facet[row, 2]
        dx, dy, dz = direction[row, 0], direction[row, 1], direction[row, 2]
        origin[row, 0], origin[row, 1], origin[row, 2] = point[row, 0], point[row, 1], point[row, 2]
        normal[row, 0], normal[row, 1], normal[row, 2] = nx, ny, nz
        last[row], edge[row] = triangle[row], rim[row]
        length[row] += path[row]
        bounces[row] += 1
        stem = key[row] * base + np.uint64(2 * surface + 1)
        reflects = True
        if not plain:
            r, t = reflection[surface], transmission[surface]
            r2, t2 = r.real * r.real + r.imag * r.imag, t.real * t.real + t.imag * t.imag
            before = amplitude[row]
            power = before.real * before.real + before.imag * before.imag
            lost[row] += power * (1.0 - r2 - t2)
            reflects = r2 > 0.0
            if t2 > 0.0:
                branch = row
                if reflects:
                    branch = np.uintp(top)
                    top += 1
                    origin[branch, 0], origin[branch, 1], origin[branch, 2] = point[row, 0], point[row, 1], point[row, 2]
                    direction[branch, 0], direction[branch, 1], direction[branch, 2] = dx, dy, dz
                    normal[branch, 0], normal[branch, 1], normal[branch, 2] = nx, ny, nz
                    last[branch], edge[branch], length[branch] = last[row], edge[row], length[row]
                    bounces[branch], reflections[branch] = bounces[row], reflections[row]
                    ray[branch], parent[branch], lost[branch] = ray[row], active[i], 0.0
                key[branch] = stem + np.uint64(1)
                amplitude[branch] = before * t
                straight[branch] = True
                fate[branch] = ALIVE if power * t2 >= faint else FAINT
            elif not reflects:
                key[row] = stem
                amplitude[row] = 0.0
                fate[row] = ABSORBED
                continue
            if reflects:
                amplitude[row] = before * r
                fate[row] = ALIVE if power * r2 >= faint else FAINT
                reflections[row] += 1 if t2 == 0.0 else 0
        if reflects:
            key[row] = stem
            straight[row] = False
            along = 2.0 * (nx * dx + ny * dy + nz * dz)
            dx, dy, dz = dx - along * nx, dy - along * ny, dz - along * nz
            # one Newton step keeps the length at 1 over thousands of bounces
            scale = 1.5 - 0.5 * (dx * dx + dy * dy + dz * dz)
            direction[row, 0], direction[row, 1], direction[row, 2] = dx * scale, dy * scale, dz * scale
        if fate[row] == ALIVE:
            active[kept] = active[i]
            kept += 1
    return kept, top


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
