"""Compiled visibility of facets along a beam: which of them it may meet, and which part of each is lit."""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit, lean, part
from fringetrace.field.beam_tables import (
    BEGIN,
    BOUNDS,
    DEPTH,
    DROPPED,
    END,
    FLATTEST,
    FULL,
    LINES,
    SENSOR,
    START,
    D,
    P,
    U,
    V,
)
from fringetrace.field.polygon_kernels import (
    CORNERS,
    MANY,
    apart,
    area,
    box,
    clip,
    clipped,
    copied,
    sides,
)  # fmt: skip


@jit
def fill(corners, first, leaves, leaf, begin, boxes):
    """Fill the boxes of the tree over a surface; half widths below 0 where there is none."""
    lower, upper = np.full((2 * leaves, 3), np.inf), np.full((2 * leaves, 3), -np.inf)
    for i in range(leaf * leaves):
        node = leaves + i // leaf
        for c in range(9):
            value = corners[first + i, c]
            if value == value:  # not NaN, that of no facet
                lower[node, c % 3] = min(lower[node, c % 3], value)
                upper[node, c % 3] = max(upper[node, c % 3], value)
    for node in range(leaves - 1, 0, -1):
        for k in range(3):
            lower[node, k] = min(lower[2 * node, k], lower[2 * node + 1, k])
            upper[node, k] = max(upper[2 * node, k], upper[2 * node + 1, k])
    for node in range(1, 2 * leaves):
        full = lower[node, 0] <= upper[node, 0]
        for k in range(3):
            boxes[begin + node, k] = 0.5 * (lower[node, k] + upper[node, k]) if full else 0.0
            boxes[begin + node, 3 + k] = 0.5 * (upper[node, k] - lower[node, k]) if full else -1.0


@jit
def planes_of(corners, planes):
    """Planes n.p + c = 0 of facets, n of unit length."""
    for i in range(len(corners)):
        ax, ay, az = (
            corners[i, 3] - corners[i, 0], corners[i, 4] - corners[i, 1], corners[i, 5] - corners[i, 2],
        )  # fmt: skip
        bx, by, bz = (
            corners[i, 6] - corners[i, 0], corners[i, 7] - corners[i, 1], corners[i, 8] - corners[i, 2],
        )  # fmt: skip
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        planes[i, 0], planes[i, 1], planes[i, 2] = nx / length, ny / length, nz / length
        planes[i, 3] = 0.0
        for k in range(3):
            middle = (corners[i, k] + corners[i, 3 + k] + corners[i, 6 + k]) / 3.0
            planes[i, 3] -= planes[i, k] * middle


@part
def dot(frame, k, x, y, z):
    """Product of a vector of a frame with another one."""
    return frame[k] * x + frame[k + 1] * y + frame[k + 2] * z


@lean
def corridor(frame, left, right, low, high, table, row, query):
    """Part of a beam as `candidates` takes it, up to a target; without end for row -1."""
    for k in range(9):
        query[k] = frame[k]
    query[BOUNDS], query[BOUNDS + 1], query[BOUNDS + 2], query[BOUNDS + 3] = left, right, low, high
    for j in range(3):
        query[BEGIN + j] = frame[D + j] - frame[START + 1] * frame[U + j] - frame[START + 2] * frame[V + j]
        query[END + j] = 0.0
        if row >= 0:
            query[END + j] = frame[D + j] - table[row, DEPTH + 1] * frame[U + j]
            query[END + j] -= table[row, DEPTH + 2] * frame[V + j]
    query[BEGIN + 3], query[END + 3] = frame[START], table[row, DEPTH] if row >= 0 else np.inf


@part
def extent(query, k, x, y, z, boxes, row):
    """Least and largest coordinate of a box along an axis, from its centre less P."""
    a, b, c = query[k], query[k + 1], query[k + 2]
    middle = a * x + b * y + c * z
    half = abs(a) * boxes[row, 3] + abs(b) * boxes[row, 4] + abs(c) * boxes[row, 5]
    return middle - half, middle + half


@part
def inside(query, gap, boxes, row):
    """Whether a box reaches into part of a beam."""
    if boxes[row, 3] < 0.0:  # an empty one
        return False
    x, y, z = boxes[row, 0] - query[P], boxes[row, 1] - query[P + 1], boxes[row, 2] - query[P + 2]
    least, most = extent(query, U, x, y, z, boxes, row)
    if most < query[BOUNDS] or least > query[BOUNDS + 1]:
        return False
    least, most = extent(query, V, x, y, z, boxes, row)
    if most < query[BOUNDS + 2] or least > query[BOUNDS + 3]:
        return False
    _, most = extent(query, BEGIN, x, y, z, boxes, row)
    if most <= query[BEGIN + 3] + gap:
        return False
    least, _ = extent(query, END, x, y, z, boxes, row)
    return least <= query[END + 3] + gap


@lean
def candidates(query, gap, leaf, boxes, roots, stack, found):
    """Facets whose boxes reach into part of a beam; how many."""
    count = 0
    for tree in range(len(roots)):
        begin, leaves, first = roots[tree, 0], roots[tree, 1], roots[tree, 2]
        stack[0], waiting = 1, 1
        while waiting > 0:
            waiting -= 1
            node = stack[waiting]
            if not inside(query, gap, boxes, begin + node):
                continue
            if node < leaves:
                stack[waiting], stack[waiting + 1] = 2 * node + 1, 2 * node
                waiting += 2
                continue
            if count + leaf > len(found):
                return FULL
            for k in range(leaf):
                found[count, 0] = first + leaf * (node - leaves) + k
                count += 1
    return count


@part
def depth(frame, nx, ny, nz, c, table, row):
    """Write the depth at which a beam meets a plane n.p + c = 0; whether it does."""
    facing = dot(frame, D, nx, ny, nz)
    table[row, DEPTH] = -(dot(frame, P, nx, ny, nz) + c) / facing
    table[row, DEPTH + 1] = -dot(frame, U, nx, ny, nz) / facing
    table[row, DEPTH + 2] = -dot(frame, V, nx, ny, nz) / facing
    return np.isfinite(table[row, DEPTH] + table[row, DEPTH + 1] + table[row, DEPTH + 2])


@part
def project(frame, corners, tri, at):
    """Corners of a facet seen along a beam; least and largest s, and t."""
    for k in range(3):
        x = corners[tri, 3 * k] - frame[P]
        y = corners[tri, 3 * k + 1] - frame[P + 1]
        z = corners[tri, 3 * k + 2] - frame[P + 2]
        at[k, 0], at[k, 1] = dot(frame, U, x, y, z), dot(frame, V, x, y, z)
    return (
        min(at[0, 0], at[1, 0], at[2, 0]), max(at[0, 0], at[1, 0], at[2, 0]),
        min(at[0, 1], at[1, 1], at[2, 1]), max(at[0, 1], at[1, 1], at[2, 1]),
    )  # fmt: skip


@lean
def sight(
    frame, corners, planes, tri, polygon, count, query, edges, many, slack, at, lines, table, row
):  # fmt: skip
    """Whether a facet seen along a beam overlaps a polygon of it, with some sides; the facet as target."""
    left, right, low, high = project(frame, corners, tri, at)
    if not (left < query[BOUNDS + 1] - slack and right > query[BOUNDS] + slack):
        return False
    if not (low < query[BOUNDS + 3] - slack and high > query[BOUNDS + 2] + slack):
        return False
    if apart(edges, many, at, 3, slack) or sides(at, 3, lines) < 3 or apart(lines, 3, polygon, count, slack):
        return False
    for k in range(9):
        table[row, k] = lines[k // 3, k % 3]
    table[row, 9], table[row, 10], table[row, 11] = 0.0, 0.0, 1.0
    return depth(frame, planes[tri, 0], planes[tri, 1], planes[tri, 2], planes[tri, 3], table, row)


@lean
def sensor(frame, screen, table, row, reach):
    """The CCD as a target of a beam, and where the beam crosses its plane of focus; whether it faces it.

    `reach` (3, 3): affine functions for the coordinates along u and v, and for the depth, in metres. Light
    has to reach the CCD at its own plane, and to lie within its frame in the plane of focus.
    """
    nx, ny, nz = screen[3], screen[4], screen[5]
    facing = dot(frame, D, nx, ny, nz)
    if not facing < -FLATTEST:
        return False
    depth(frame, nx, ny, nz, -(screen[0] * nx + screen[1] * ny + screen[2] * nz), table, row)
    for k in range(3):
        reach[2, k] = table[row, DEPTH + k] + (screen[14] / facing if k == 0 else 0.0)
    for axis in range(2):
        x, y, z = screen[6 + 3 * axis], screen[7 + 3 * axis], screen[8 + 3 * axis]
        along = dot(frame, D, x, y, z)
        here = dot(frame, P, x, y, z) - (screen[0] * x + screen[1] * y + screen[2] * z)
        reach[axis, 0] = here + along * reach[2, 0]
        reach[axis, 1] = dot(frame, U, x, y, z) + along * reach[2, 1]
        reach[axis, 2] = dot(frame, V, x, y, z) + along * reach[2, 2]
        scale = 1.0 / np.sqrt(reach[axis, 1] ** 2 + reach[axis, 2] ** 2)
        for k in range(2):
            sign, line = 1.0 - 2.0 * k, 6 * axis + 3 * k
            table[row, line] = sign * scale * reach[axis, 1]
            table[row, line + 1] = sign * scale * reach[axis, 2]
            table[row, line + 2] = scale * (sign * reach[axis, 0] + screen[12 + axis])
    return True


@part
def around(frame, table, row, gap, lines):
    """The lines within which a beam meets a target: those around it, and that beyond which it is ahead."""
    for k in range(LINES):
        lines[k, 0], lines[k, 1], lines[k, 2] = (
            table[row, 3 * k],
            table[row, 3 * k + 1],
            table[row, 3 * k + 2],
        )
    lines[LINES, 0] = table[row, DEPTH + 1] - frame[START + 1]
    lines[LINES, 1] = table[row, DEPTH + 2] - frame[START + 2]
    lines[LINES, 2] = table[row, DEPTH] - frame[START] - gap


@lean
def halved(pieces, sizes, count):
    """Cut polygons of many corners in two, that cuts to come find room; how many there are then."""
    for k in range(count):
        corners = sizes[k, 0]
        if corners <= CORNERS // 2:
            continue
        if count == len(pieces):
            return FULL
        middle = corners // 2
        for i in range(middle, corners):
            pieces[count, i - middle, 0], pieces[count, i - middle, 1] = pieces[k, i, 0], pieces[k, i, 1]
        pieces[count, corners - middle, 0] = pieces[k, 0, 0]
        pieces[count, corners - middle, 1] = pieces[k, 0, 1]
        sizes[count, 0], sizes[k, 0] = corners - middle + 1, middle + 1
        count += 1
    return count


@lean
def subtract(pieces, sizes, count, lines, total, least, spare, rest):
    """Take from polygons what lies inside all of some lines; how many are left."""
    count = halved(pieces, sizes, count)
    if count == FULL:
        return FULL
    k = count
    while k > 0:
        k -= 1
        corners = sizes[k, 0]
        copied(pieces[k], corners, rest)
        kept = clipped(rest, corners, lines, total, spare)
        if kept < 3 or area(rest, kept) <= least:
            continue
        copied(pieces[k], corners, rest)
        # the last polygon, which has been looked at, takes the place of this one
        count -= 1
        copied(pieces[count], sizes[count, 0], pieces[k])
        sizes[k, 0] = sizes[count, 0]
        for i in range(total):
            a, b, c = lines[i, 0], lines[i, 1], lines[i, 2]
            outer = clip(rest, corners, -a, -b, -c, spare)
            if outer >= 3 and outer < CORNERS and area(spare, outer) > least:
                if count == len(pieces):
                    return FULL
                copied(spare, outer, pieces[count])
                sizes[count, 0] = outer
                count += 1
            corners = clip(rest, corners, a, b, c, spare)
            if corners < 3 or corners >= CORNERS:
                break
            copied(spare, corners, rest)
    return count


@lean
def shade(
    frame, table, row, tri, others, other, hider, limits, pieces, sizes, count, lines, spare, rest
):  # fmt: skip
    """Take from the lit pieces of a target what another hides (of two in one place the first); how many."""
    around(frame, others, other, limits.gap, lines)
    lines[LINES + 1, 0] = table[row, DEPTH + 1] - others[other, DEPTH + 1]
    lines[LINES + 1, 1] = table[row, DEPTH + 2] - others[other, DEPTH + 2]
    lines[LINES + 1, 2] = table[row, DEPTH] - others[other, DEPTH]
    lines[LINES + 1, 2] += limits.gap if hider < tri else -limits.gap
    return subtract(pieces, sizes, count, lines, LINES + 2, limits.area, spare, rest)


@lean
def targets(
    frame, polygon, count, last, leaf, corners, planes, surface, boxes, roots, screen, limits, room, table,
    number, found,
):  # fmt: skip
    """What a beam meets, near or far: the CCD if it faces it, and facets; how many."""
    query, edges, at, lines = room.query, room.edges, room.at, room.lines
    many = sides(polygon, count, edges)
    left, right, low, high = box(polygon, count)
    corridor(frame, left, right, low, high, table, -1, query)
    total = 0
    if sensor(frame, screen, table, 0, room.reach):
        number[0, 0] = SENSOR
        total = 1
    met = candidates(query, limits.gap, leaf, boxes, roots, room.stack, found)
    if met == FULL or total + met > len(table):
        return FULL
    for k in range(met):
        tri = found[k, 0]
        if tri != last and surface[tri] >= 0 and sight(
            frame, corners, planes, tri, polygon, count, query, edges, many, limits.slack, at, lines, table,
            total,
        ):  # fmt: skip
            number[total, 0] = tri
            total += 1
    return total


@lean
def reached(frame, polygon, count, row, limits, room, table, piece, power, strength):
    """Write the part of a beam that meets a target, if nothing hides it; its corners, 0 if there is none."""
    around(frame, table, row, limits.gap, room.lines)
    copied(polygon, count, piece)
    size = clipped(piece, count, room.lines, LINES + 1, room.spare)
    if size == MANY:
        power[DROPPED] += strength * area(polygon, count)
    elif size >= 3 and area(piece, size) <= limits.area:
        power[DROPPED] += strength * area(piece, size)
    elif size >= 3:
        return size
    return 0


@lean
def lit_of_few(
    frame, polygon, count, row, total, limits, room, table, number, pieces, sizes, power, strength
):
    """Pieces of a beam that reach one of its targets past all others; how many."""
    sizes[0, 0] = reached(frame, polygon, count, row, limits, room, table, pieces[0], power, strength)
    left = 1 if sizes[0, 0] > 0 else 0
    for k in range(total):
        if k != row and left > 0:
            left = shade(
                frame, table, row, number[row, 0], table, k, number[k, 0], limits, pieces, sizes, left,
                room.lines, room.spare, room.rest,
            )  # fmt: skip
    return left


@lean
def lit_of_many(
    frame, polygon, count, row, last, leaf, corners, planes, surface, boxes, roots, limits, room, table,
    number, found, pieces, sizes, power, strength,
):  # fmt: skip
    """Pieces of a beam that reach one of its targets past all others that the tree finds; how many."""
    lines, spare, rest, tri = room.lines, room.spare, room.rest, number[row, 0]
    edges, query, other, whole = room.edges, room.query, room.other, room.part
    size = reached(frame, polygon, count, row, limits, room, table, whole, power, strength)
    if size == 0:
        return 0
    copied(whole, size, pieces[0])
    sizes[0, 0], left = size, 1
    if row > 0 and number[0, 0] == SENSOR:
        left = shade(
            frame, table, row, tri, table, 0, SENSOR, limits, pieces, sizes, left, lines, spare, rest
        )
    many = sides(whole, size, edges)
    low_s, high_s, low_t, high_t = box(whole, size)
    corridor(frame, low_s, high_s, low_t, high_t, table, row, query)
    met = candidates(query, limits.gap, leaf, boxes, roots, room.stack, found)
    if met == FULL:
        return FULL
    for k in range(met):
        hider = found[k, 0]
        if hider != last and hider != tri and surface[hider] >= 0 and left > 0 and sight(
            frame, corners, planes, hider, whole, size, query, edges, many, limits.slack, room.at, lines,
            other, 0,
        ):  # fmt: skip
            left = shade(
                frame, table, row, tri, other, 0, hider, limits, pieces, sizes, left, lines, spare, rest
            )
    return left
