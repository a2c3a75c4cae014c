"""Compiled loops over the faces of a body: which float32 cannot tell apart, which are to close its gaps."""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit, lean
from fringetrace.tracing.intersect.exact import LEAF
from fringetrace.tracing.intersect.kernels import MARGIN

# Faces that share an edge at more than this angle (sine) part fast enough to be told by that edge.
FOLD = 1e-3


@lean
def clipped(points, count, cut, nx, ny, nz, c):
    """Cut a polygon (the first `count` rows) down to n.p + c >= 0, into `cut`; how many corners it has."""
    kept = 0
    for i in range(count):
        k = (i + 1) % count
        here = nx * points[i, 0] + ny * points[i, 1] + nz * points[i, 2] + c
        there = nx * points[k, 0] + ny * points[k, 1] + nz * points[k, 2] + c
        if here >= 0.0:
            for axis in range(3):
                cut[kept, axis] = points[i, axis]
            kept += 1
        if (here >= 0.0) != (there >= 0.0):
            part = here / (here - there)
            for axis in range(3):
                cut[kept, axis] = points[i, axis] + part * (points[k, axis] - points[i, axis])
            kept += 1
    return kept


@lean
def outside(corners, other, nx, ny, nz, c):
    """Whether all corners of a triangle have n.p + c < 0."""
    for k in (0, 3, 6):
        if nx * corners[other, k] + ny * corners[other, k + 1] + nz * corners[other, k + 2] + c >= 0.0:
            return False
    return True


@lean
def bounding(planes, one, e):
    """The e-th of five half-spaces n.p + c >= 0: `MARGIN` inside the edges of a triangle, about its plane."""
    k, sign = (4 * e + 4, 1.0) if e < 3 else (0, 7.0 - 2.0 * e)
    less = -MARGIN if e < 3 else MARGIN
    return (
        sign * planes[one, k],
        sign * planes[one, k + 1],
        sign * planes[one, k + 2],
        (sign * planes[one, k + 3] + less),
    )


@lean
def close(planes, corners, one, other, points, cut):
    """Whether a triangle comes near to another, farther than `MARGIN` from the edges of that.

    `points` and `cut` are room for 9 corners.
    """
    for e in range(5):  # most are beyond one of them
        nx, ny, nz, c = bounding(planes, one, e)
        if outside(corners, other, nx, ny, nz, c):
            return False
    count = 3
    for i in range(3):
        for axis in range(3):
            points[i, axis] = corners[other, 3 * i + axis]
    for e in range(5):
        nx, ny, nz, c = bounding(planes, one, e)
        count = clipped(points, count, cut, nx, ny, nz, c)
        if count == 0:
            return False
        points, cut = cut, points
    return True


@lean
def folded(planes, one, other):
    """Whether two faces that share an edge lie on one another."""
    cosine = 0.0
    for k in range(3):
        cosine += planes[one, k] * planes[other, k]
    return cosine < 0.0 and 1.0 - cosine * cosine < FOLD * FOLD


@lean
def extent(corners, tri, room, box, row):
    """Write the box of a triangle, larger by `room` on all sides, into a row of a table."""
    for k in range(3):
        box[row, k] = min(corners[tri, k], corners[tri, k + 3], corners[tri, k + 6]) - room
        box[row, k + 3] = max(corners[tri, k], corners[tri, k + 3], corners[tri, k + 6]) + room


@lean
def apart(one, i, other, k):
    """Whether two boxes, rows of tables, have no point in common."""
    far = False
    for axis in range(3):
        far |= one[i, axis] > other[k, axis + 3] or other[k, axis] > one[i, axis + 3]
    return far


@lean
def gather(lower, upper, leaf, stack, found):
    """List the leaves of the tree that come within `MARGIN` of a node; how many, or -1: `found` is full."""
    leaves, count, depth = len(lower) // 2, 0, 1
    stack[0] = 1
    while depth > 0:
        depth -= 1
        node = stack[depth]
        far = False
        for k in range(3):
            far |= lower[node, k] > upper[leaf, k] + MARGIN or upper[node, k] < lower[leaf, k] - MARGIN
        if far:
            continue
        if node < leaves:
            stack[depth], stack[depth + 1] = 2 * node, 2 * node + 1
            depth += 2
            continue
        if count == len(found):
            return -1
        found[count] = node - leaves
        count += 1
    return count


@jit
def near(planes, corners, order, lower, upper, beside):
    """For each triangle the box (t, 6) of where others are near to it; from infinity on where none is.

    `beside` (t, 3) are the triangles across its edges.
    """
    boxes, leaves = np.empty((len(planes), 6)), len(lower) // 2
    stack, found = np.empty(64, np.int64), np.empty(64, np.int64)
    mine, theirs = np.empty((LEAF, 6)), np.empty((1, 6))
    points, cut = np.empty((9, 3)), np.empty((9, 3))
    for leaf in range(leaves):
        for i in range(LEAF):
            tri = np.int64(order[LEAF * leaf + i])
            if tri < 0:
                continue
            extent(corners, tri, MARGIN, mine, i)
            for k in range(3):
                boxes[tri, k], boxes[tri, k + 3] = np.inf, -np.inf
        count = gather(lower, upper, leaves + leaf, stack, found)
        while count < 0:
            found = np.empty(2 * len(found), np.int64)
            count = gather(lower, upper, leaves + leaf, stack, found)
        for slot in range(LEAF * count):
            other = np.int64(order[LEAF * found[slot // LEAF] + slot % LEAF])
            if other < 0:
                continue
            extent(corners, other, 0.0, theirs, 0)
            for i in range(LEAF):
                tri = np.int64(order[LEAF * leaf + i])
                if tri < 0 or tri == other or apart(mine, i, theirs, 0):
                    continue
                joined = other == beside[tri, 0] or other == beside[tri, 1] or other == beside[tri, 2]
                if (joined and not folded(planes, tri, other)) or not close(
                    planes, corners, tri, other, points, cut
                ):
                    continue
                for k in range(3):
                    boxes[tri, k] = min(boxes[tri, k], theirs[0, k] - 2.0 * MARGIN)
                    boxes[tri, k + 3] = max(boxes[tri, k + 3], theirs[0, k + 3] + 2.0 * MARGIN)
    return boxes


@jit
def spared(beside):
    """Triangles (t,) that need not grow to close the gaps at their edges: all around them others do.

    `beside` (t, 3) are the triangles across the edges, -1 where there is none.
    """
    chosen = np.zeros(len(beside), np.bool_)
    for tri in range(len(beside)):
        free = True
        for k in range(3):
            free &= beside[tri, k] >= 0 and not chosen[beside[tri, k]]
        chosen[tri] = free
    return chosen
