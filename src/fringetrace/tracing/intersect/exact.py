"""Exact first hits in float64: bounding volume tree and watertight triangle test, compiled.

What float32 leaves in doubt is decided here. `planes` has 16 numbers a triangle: its plane
n.p + c = 0 with n unit, then three edge planes whose value is the distance inside each edge.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fringetrace.core import jit, lean, part
from fringetrace.tracing.intersect.coincident import SEAM, SHEET, onward, sooner

# Flatter to a face than this (cosine) no crack beside it is looked for.
FLAT = 0.01
# A ray slides along a face, and does not cross it, if its cosine to the normal is under so many roundings.
SLIDE = 64.0
# What a ray does with a triangle: passes it, meets it, or passes it by no more than roundings.
MISSED, MET, CRACK = 0, 1, 2
# Triangles in a leaf of the tree.
LEAF = 4


@jit
def select(order, keys, start, stop, middle):
    """Quickselect: reorder order[start:stop] so that the keys before `middle` are the smallest."""
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
def arrange(middle, leaves):
    """Triangle order of a complete binary tree: halved across the longest extent of the centres.

    `middle` is (3, t).
    """
    count = middle.shape[1]
    order = np.arange(count)
    stack = [(0, LEAF * leaves)]
    while len(stack) > 0:
        start, size = stack.pop()
        half = size // 2
        stop = min(start + size, count)
        if size <= LEAF or stop <= start:
            continue
        # the halves of a node are full from the left: what is missing is missing at the end
        if stop - start > half:
            widest, axis = -1.0, 0
            for k in range(3):
                low, high = np.inf, -np.inf
                for i in range(start, stop):
                    value = middle[k, order[i]]
                    low, high = min(low, value), max(high, value)
                if high - low > widest:
                    widest, axis = high - low, k
            select(order, middle[axis], start, stop, start + half)
            stack.append((start + half, half))
        stack.append((start, half))
    return order


@part
def permute(x, y, z, axis):
    """Permute coordinates cyclically, `axis` last."""
    if axis == 0:
        return y, z, x
    if axis == 1:
        return z, x, y
    return x, y, z


@lean
def crosses(corners, tri, x, y, z, axis, shear_x, shear_y):
    """Watertight line-triangle test: both sides of a shared edge decide alike.

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


@lean
def hidden(planes, corners, tri, left, dx, dy, dz, tolerance):
    """Whether a triangle lies wholly on the other side of the plane of `left` than the ray that leaves this.

    Not so for two layers of a sheet.
    """
    nx, ny, nz, c = planes[left, 0], planes[left, 1], planes[left, 2], planes[left, 3]
    if abs(nx * planes[tri, 0] + ny * planes[tri, 1] + nz * planes[tri, 2]) > SHEET:
        return False
    sense = 1.0 if nx * dx + ny * dy + nz * dz > 0.0 else -1.0
    for k in (0, 3, 6):
        height = nx * corners[tri, k] + ny * corners[tri, k + 1] + nz * corners[tri, k + 2] + c
        if sense * height > tolerance:
            return False
    return True


@part
def enters(lower, upper, node, x, y, z, ix, iy, iz, nearest):
    """Path length at which a ray enters a box, or infinity if not before `nearest`."""
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
    """Finite reciprocal of a direction component, for slab tests."""
    return 1.0 / component if abs(component) > 1e-200 else 1e200


@part
def sheared(dx, dy, dz):
    """Axis that a direction is most along, and its slopes against that, as `crosses` takes them."""
    magnitude = max(abs(dx), abs(dy), abs(dz))
    axis = 0 if abs(dx) == magnitude else (1 if abs(dy) == magnitude else 2)
    px, py, pz = permute(dx, dy, dz, axis)
    return axis, px / pz, py / pz


@lean
def beside(planes, order, lower, upper, x, y, z, margin):
    """Whether a point lies in the box of some triangles and within `margin` of the plane of one."""
    leaves, node = len(lower) // 2, 1
    while node > 0:
        inside = lower[node, 0] <= x <= upper[node, 0] and lower[node, 1] <= y <= upper[node, 1]
        inside = inside and lower[node, 2] <= z <= upper[node, 2]
        if inside and node < leaves:
            node = 2 * node
            continue
        for slot in range(LEAF * (node - leaves), LEAF * (node - leaves + 1) if inside else 0):
            tri = order[slot]
            if tri >= 0:
                height = planes[tri, 0] * x + planes[tri, 1] * y + planes[tri, 2] * z + planes[tri, 3]
                if abs(height) <= margin:
                    return True
        while node & 1:  # up to the next branch on the right
            node >>= 1
        node += node > 0
    return False


@lean
def descend(lower, upper, node, x, y, z, ix, iy, iz, nearest, stack, depth):
    """Put those children of a node that a ray enters on the stack, the nearer one on top; its new depth."""
    left = enters(lower, upper, 2 * node, x, y, z, ix, iy, iz, nearest)
    right = enters(lower, upper, 2 * node + 1, x, y, z, ix, iy, iz, nearest)
    near = 2 * node if left <= right else 2 * node + 1
    if max(left, right) < np.inf:
        stack[depth] = 4 * node + 1 - near
        depth += 1
    if min(left, right) < np.inf:
        stack[depth] = near
        depth += 1
    return depth


@lean
def tried(ray, sheer, tri, skip, nearest, side, came, row, contact, planes, corners, tolerance):
    """What a ray does with a triangle (`MISSED`, `MET`, `CRACK`), path, its rounding, cosine, and back.

    `back` is the place of the triangle in the list of faces that the ray has crossed, see `coincident`.
    """
    x, y, z, dx, dy, dz = ray
    height = planes[tri, 0] * x + planes[tri, 1] * y + planes[tri, 2] * z + planes[tri, 3]
    facing = planes[tri, 0] * dx + planes[tri, 1] * dy + planes[tri, 2] * dz
    here = side != 2 and abs(height) <= tolerance
    aside = inset(planes, tri, x, y, z) if here else -np.inf
    if aside >= -tolerance:
        back = onward(tri, skip, facing, side, aside <= SEAM, came, row, contact, planes)
        if back < 0 or (skip >= 0 and hidden(planes, corners, tri, skip, dx, dy, dz, tolerance)):
            return MISSED, 0.0, 0.0, facing, 0
        return MET, 0.0, 0.0, facing, back
    if abs(facing) < SLIDE * tolerance:
        return MISSED, 0.0, 0.0, facing, 0
    path, tie = -height / facing, 2.0 * tolerance / abs(facing)
    if not (path > 0.0 and nearest > 0.0 and path <= nearest + tie):
        return MISSED, path, tie, facing, 0
    if crosses(corners, tri, x, y, z, sheer[0], sheer[1], sheer[2]):
        return MET, path, tie, facing, 0
    if contact[7] or here or (abs(side) == 1 and facing * side >= 0.0):  # a closed body has no cracks
        return MISSED, path, tie, facing, 0
    aside = inset(planes, tri, x + path * dx, y + path * dy, z + path * dz)
    return (CRACK if aside >= -tolerance / max(abs(facing), FLAT) else MISSED), path, tie, facing, 0


@jit
def decide(ray, skip, guess, limit, side, came, row, contact, planes, tree, tolerance):
    """First hit of a ray in float64: path length, triangle, place in the list of faces crossed.

    The triangle is -1 if there is none before `limit`. `skip` is the triangle just left, `guess` one that
    is likely hit (or below 0). A face that the start touches is hit at 0 if the ray goes on through it, see
    `coincident.onward`; `side` = 2: it touches nothing. A line that passes a triangle of an open body by no
    more than `tolerance` meets it if nothing else is there: it is in a crack between faces.
    """
    x, y, z, dx, dy, dz = ray
    owner, sides, medium, first = contact[0], contact[1], contact[3][row], contact[5]
    corners, order, lower, upper = tree
    sheer, ix, iy, iz = sheared(dx, dy, dz), inverse(dx), inverse(dy), inverse(dz)
    nearest, best, best_back = limit, np.int64(-1), 0
    beside, rim = limit, np.int64(-1)
    hit: Any = (np.int64(0), 0.0, (0.0, 0.0, 0.0), limit, np.int64(-1))
    leaves = len(lower) // 2
    stack = np.empty(64, np.int64)
    stack[0] = 1
    depth = 1
    start = guess >= 0 and guess != skip
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if start:  # bounds the search before it begins
            begin, end = -1, 0
            depth += 1
        else:
            if enters(lower, upper, node, x, y, z, ix, iy, iz, nearest) == np.inf:
                continue
            if node < leaves:
                depth = descend(lower, upper, node, x, y, z, ix, iy, iz, nearest, stack, depth)
                continue
            begin = LEAF * (node - leaves)
            end = begin + LEAF
        for slot in range(begin, end):
            tri = guess if start else np.int64(order[slot])
            if tri < 0 or tri == skip:
                continue
            what, path, tie, facing, back = tried(
                ray, sheer, tri, skip, nearest, side, came, row, contact, planes, corners, tolerance
            )
            if what == CRACK:
                if path < beside - tie or (path <= beside + tie and facing < 0.0):
                    beside, rim = path, tri
            elif what == MET and path <= nearest + tie:
                normal = planes[tri, 0], planes[tri, 1], planes[tri, 2]
                found = (np.int64(owner[first + tri]), facing, normal, path, tri)
                if path < nearest - tie or (
                    path < nearest if best < 0 else sooner(sides, medium, found, hit)
                ):
                    nearest, best, best_back, hit = path, tri, back, found
        start = False
    if rim >= 0 and beside < nearest - 64.0 * tolerance:
        return beside, rim, 0
    return nearest, best, best_back


@jit
def first_hits(start, direction, skip, limit, planes, tree, tolerance):
    """First hits of rays beyond their starts, in float64: path and triangle, -1 if none before `limit`.

    `start` (n, 3), `limit` (n,) in the unit box; `skip` (n,) is a triangle to be passed over.
    """
    path, triangle = np.empty(len(start)), np.empty(len(start), np.int64)
    contact = (
        np.zeros(len(planes), np.int32), np.full((1, 2), -1, np.int32), np.zeros(1), np.zeros(1, np.int32),
        np.zeros((1, 3), np.int32), 0, True, True,
    )  # fmt: skip
    for i in range(len(start)):
        ray = (start[i, 0], start[i, 1], start[i, 2], direction[i, 0], direction[i, 1], direction[i, 2])
        path[i], triangle[i], _ = decide(
            ray, skip[i], np.int64(-1), limit[i], 2, (0.0, 0.0, 0.0), 0, contact, planes, tree, tolerance
        )
    return path, triangle
