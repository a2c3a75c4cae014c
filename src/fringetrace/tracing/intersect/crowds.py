"""Compiled loops over the faces of a body: which float32 cannot tell apart, which are to close its gaps."""

from __future__ import annotations

import numpy as np

from fringetrace.core import jit
from fringetrace.tracing.intersect.exact import LEAF
from fringetrace.tracing.intersect.kernels import MARGIN

# Faces that share an edge at more than this angle (sine) part fast enough to be told by that edge.
FOLD = 1e-3


@jit
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


@jit
def close(planes, corners, one, other, points, cut):
    """Whether a triangle comes near to another, farther than `MARGIN` from the edges of that.

    `points` and `cut` are room for 9 corners.
    """
    count = 3
    for i in range(3):
        for axis in range(3):
            points[i, axis] = corners[other, 3 * i + axis]
    for e in (4, 8, 12, 0, 16):
        sign = -1.0 if e == 16 else 1.0
        k, less = e % 16, -MARGIN if e in (4, 8, 12) else MARGIN
        nx, ny, nz = sign * planes[one, k], sign * planes[one, k + 1], sign * planes[one, k + 2]
        count = clipped(points, count, cut, nx, ny, nz, sign * planes[one, k + 3] + less)
        if count == 0:
            return False
        points, cut = cut, points
    return True


@jit
def folded(planes, one, other):
    """Whether two faces that share an edge lie on one another."""
    cosine = 0.0
    for k in range(3):
        cosine += planes[one, k] * planes[other, k]
    return cosine < 0.0 and 1.0 - cosine * cosine < FOLD * FOLD


@jit
def near(planes, corners, order, lower, upper, beside):
    """For each triangle the box (t, 6) of where others are near to it; from infinity on where none is.

    `beside` (t, 3) are the triangles across its edges.
    """
    count, leaves = len(planes), len(lower) // 2
    boxes = np.empty((count, 6))
    stack = np.empty(64, np.int64)
    low, high = np.empty(3), np.empty(3)
    points, cut = np.empty((9, 3)), np.empty((9, 3))
    for tri in range(count):
        for k in range(3):
            low[k] = min(corners[tri, k], corners[tri, k + 3], corners[tri, k + 6]) - MARGIN
            high[k] = max(corners[tri, k], corners[tri, k + 3], corners[tri, k + 6]) + MARGIN
            boxes[tri, k], boxes[tri, k + 3] = np.inf, -np.inf
        stack[0] = 1
        depth = 1
        while depth > 0:
            depth -= 1
            node = stack[depth]
            apart = False
            for k in range(3):
                apart |= lower[node, k] > high[k] or upper[node, k] < low[k]
            if apart:
                continue
            if node < leaves:
                stack[depth], stack[depth + 1] = 2 * node, 2 * node + 1
                depth += 2
                continue
            for slot in range(LEAF * (node - leaves), LEAF * (node - leaves) + LEAF):
                other = np.int64(order[slot])
                if other < 0 or other == tri:
                    continue
                joined = other == beside[tri, 0] or other == beside[tri, 1] or other == beside[tri, 2]
                if joined and not folded(planes, tri, other):
                    continue
                if not close(planes, corners, tri, other, points, cut):
                    continue
                for k in range(3):
                    boxes[tri, k] = min(
                        boxes[tri, k],
                        min(corners[other, k], corners[other, k + 3], corners[other, k + 6]) - 2.0 * MARGIN,
                    )
                    boxes[tri, k + 3] = max(
                        boxes[tri, k + 3],
                        max(corners[other, k], corners[other, k + 3], corners[other, k + 6]) + 2.0 * MARGIN,
                    )
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
