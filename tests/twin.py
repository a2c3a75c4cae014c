"""The engine's brute-force twin: every triangle, in float64, no tree and no float32.

It shares no code with the engine: Moeller and Trumbore's test here, planes there.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numba import njit

from fringetrace import Fate

# A crossing counts this part of a triangle outside it: neighbours must not let a ray through between
# them because each rounds its own way.
RIM = 1e-12
# Two hits this near to each other, relative to the path up to there, are a tie at a shared edge.
TIE = 1e-12


jit = njit(cache=True, nogil=True, error_model="numpy")
part = njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
# Triangles in a box, and boxes in a larger one: most are passed by.
RUN, BOXES = 4, 64


@part
def _crossing(ox, oy, oz, dx, dy, dz, corners, k, rim):
    """Path at which a line crosses triangle k, or infinity (Moeller and Trumbore, 1997)."""
    ax, ay, az = corners[k, 0, 0], corners[k, 0, 1], corners[k, 0, 2]
    ux, uy, uz = corners[k, 1, 0] - ax, corners[k, 1, 1] - ay, corners[k, 1, 2] - az
    vx, vy, vz = corners[k, 2, 0] - ax, corners[k, 2, 1] - ay, corners[k, 2, 2] - az
    px, py, pz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
    det = ux * px + uy * py + uz * pz
    sx, sy, sz = ox - ax, oy - ay, oz - az
    a = (sx * px + sy * py + sz * pz) / det
    qx, qy, qz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
    b = (dx * qx + dy * qy + dz * qz) / det
    inside = a >= -rim and b >= -rim and a + b <= 1.0 + rim
    return (vx * qx + vy * qy + vz * qz) / det if inside else np.inf


@part
def _entry(ox, oy, oz, fx, fy, fz, box, g):
    """Path at which a line enters box g, infinity where it passes by; (fx, fy, fz) is 1 / direction."""
    x, u = (box[g, 0] - ox) * fx, (box[g, 3] - ox) * fx
    y, v = (box[g, 1] - oy) * fy, (box[g, 4] - oy) * fy
    z, w = (box[g, 2] - oz) * fz, (box[g, 5] - oz) * fz
    begin = max(max(min(x, u), min(y, v)), min(z, w))
    end = min(min(max(x, u), max(y, v)), max(z, w))
    return np.inf if begin > end or end < 0.0 else begin


@jit
def _first_hits(origin, direction, left, guess, corners, inner, outer, slack, rim, path, triangle):
    for i in range(len(origin)):
        ox, oy, oz = origin[i, 0], origin[i, 1], origin[i, 2]
        dx, dy, dz = direction[i, 0], direction[i, 1], direction[i, 2]
        fx, fy, fz = 1.0 / dx, 1.0 / dy, 1.0 / dz
        best, which = np.inf, -1
        if guess[i] >= 0 and guess[i] != left[i]:
            t = _crossing(ox, oy, oz, dx, dy, dz, corners, guess[i], rim)
            if slack < t < best:
                best, which = t, guess[i]
        for h in range(len(outer)):
            entry = _entry(ox, oy, oz, fx, fy, fz, outer, h)
            if entry == np.inf or entry > best:
                continue
            for g in range(h * BOXES, min((h + 1) * BOXES, len(inner))):
                entry = _entry(ox, oy, oz, fx, fy, fz, inner, g)
                if entry == np.inf or entry > best:
                    continue
                for k in range(g * RUN, min((g + 1) * RUN, len(corners))):
                    t = _crossing(ox, oy, oz, dx, dy, dz, corners, k, rim)
                    if slack < t < best and k != left[i]:
                        best, which = t, k
        path[i], triangle[i] = best, which


def _boxes(low, high, run):
    """Boxes (g, 6) around runs of boxes, in the order of the mesh: their lower and upper corners."""
    start = np.arange(0, len(low), run)
    return np.hstack([np.minimum.reduceat(low, start), np.maximum.reduceat(high, start)])


def nearest(corners, origin, direction, left, slack=0.0, guess=None):
    """First crossing of each ray, over all triangles but the one left.

    Parameters
    ----------
    corners : (t, 3, 3) float64, metres
    origin, direction : (n, 3) float64
    left : (n,) int
        Triangle that the ray starts on; -1: none.
    slack : float, metres
        Crossings nearer than this do not count.
    guess : (n,) int, optional
        Triangle to begin with: the others only have to be looked at up to there. -1: none.

    Returns
    -------
    path : (n,) float64, metres; inf: none
    triangle : (n,) int64; -1: none
    """
    origin, direction = (np.ascontiguousarray(rows, dtype=np.float64) for rows in (origin, direction))
    left, guess = (
        np.ascontiguousarray(rows, dtype=np.int64)
        for rows in (left, np.full(len(origin), -1) if guess is None else guess)
    )
    path, triangle = np.empty(len(origin)), np.empty(len(origin), dtype=np.int64)
    corners = np.ascontiguousarray(corners)
    inner = _boxes(corners.min(axis=1), corners.max(axis=1), RUN)
    # wider than any rounding, and no ray starts on a face
    wide = 1e-6 * (inner[:, 3:] - inner[:, :3]).max(axis=1, keepdims=True)
    inner += np.hstack([-wide, -wide, -wide, wide, wide, wide])
    outer = _boxes(inner[:, :3], inner[:, 3:], BOXES)

    def some(rows):
        _first_hits(
            origin[rows], direction[rows], left[rows], guess[rows], corners, inner, outer, slack, RIM,
            path[rows], triangle[rows],
        )  # fmt: skip

    middle = len(origin) // 2
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(some, (slice(0, middle), slice(middle, None))))
    return path, triangle


@dataclass(frozen=True)
class Verdict:
    """What the twin says of recorded paths: counts, and the largest errors relative to the path.

    `distance` is off along the ray, `aside` is how far from the reflected ray a hit lies. `wrong` are
    hits at another place than the twin's: (path, bounce, triangle, the twin's triangle); `graze` is how far
    from an edge of the nearer triangle the ray passes there, relative to the scene.
    """

    bounces: int = 0
    itself: int = 0
    ties: int = 0
    distance: float = 0.0
    aside: float = 0.0
    graze: float = 0.0
    wrong: tuple[tuple[int, int, int, int], ...] = ()

    def __add__(self, other):
        counts = [getattr(self, name) + getattr(other, name) for name in ("bounces", "itself", "ties")]
        worst = [max(getattr(self, name), getattr(other, name)) for name in ("distance", "aside", "graze")]
        return Verdict(*counts, *worst, self.wrong + other.wrong)


def corners_of(scene):
    """Corners (t, 3, 3) of all triangles of a scene, and the number of each surface's first.

    Each triangle begins with the corner opposite its longest side: the sides that meet there give the
    normal with the most digits.
    """
    meshes = [surface.mesh for surface in scene.surfaces]
    first = np.cumsum([0] + [len(mesh.faces) for mesh in meshes])[:-1]
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in meshes])
    opposite = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1), axis=2)
    turn = (opposite.argmax(axis=1)[:, None] + np.arange(3)) % 3
    return np.take_along_axis(corners, turn[:, :, None], axis=1), first


def _from_the_rim(corners, point):
    """Distance of points (n, 3) from the nearest side of their triangles (n, 3, 3)."""
    side = np.roll(corners, -1, axis=1) - corners
    reach = point[:, None] - corners
    along = np.clip((reach * side).sum(axis=2) / (side * side).sum(axis=2), 0.0, 1.0)
    return np.linalg.norm(reach - along[:, :, None] * side, axis=2).min(axis=1)


def _reflect(direction, rows, normal):
    d = direction[rows]
    direction[rows] = d - 2.0 * np.einsum("ij,ij->i", d, normal)[:, None] * normal


def judge(paths, begin=0, slack=1e-13):
    """Find every segment of recorded paths again, each from its recorded start.

    Directions are reflected here, one bounce after the other, off the recorded triangles; those of
    segments that are not very short are read off their ends, because at grazing incidence a rounding
    of the direction moves the hit far. Where a path left, the twin must find nothing.

    Parameters
    ----------
    paths : Paths
        Of mirrors, recorded.
    begin : int
        Leave out the segments before this one, from the path that errors are relative to as well.
    slack : float
        Part of the scene's size below which a crossing is the start itself.

    Returns
    -------
    Verdict
    """
    corners, first = corners_of(paths.scene)
    size = np.ptp(corners.reshape(-1, 3), axis=0).max()
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    triangle = np.where(paths.triangle >= 0, paths.triangle + first[paths.surface], -1)
    triangle = np.pad(triangle, ((0, 0), (1, 1)), constant_values=-1)
    direction = paths.source.direction[paths.ray].copy()
    way = np.zeros(len(paths))
    verdict = Verdict()
    for k in range(int(paths.bounces.max(initial=0)) + 1):
        rows = np.flatnonzero((paths.bounces > k) | ((paths.bounces == k) & (paths.fate == Fate.LEFT)))
        left, mine = triangle[rows, k], triangle[rows, k + 1]
        met = mine >= 0
        start, d = paths.points[rows, k], direction[rows]
        step = np.where(met[:, None], paths.points[rows, k + 1] - start, 0.0)
        length = np.linalg.norm(step, axis=1)
        way[rows] += length
        if k < begin:
            way[:] = 0.0
            _reflect(direction, rows[met], normal[mine[met]])
            continue
        aside = (
            np.linalg.norm(step - np.einsum("ij,ij->i", step, d)[:, None] * d, axis=1)[met] / way[rows[met]]
        )
        long = length > 1e-6 * size
        seen = d.copy()
        seen[long] = step[long] / length[long, None]
        path, twins = nearest(corners, start, seen, left, slack * size, guess=mine)
        off = np.full(len(rows), np.inf)
        both = met & (twins >= 0)
        off[both] = np.abs(path - length)[both] / way[rows[both]]
        off[~met & (twins < 0)] = 0.0
        wrong = (off > TIE) & (mine != twins)
        nearer = np.where(met & (length < path), mine, twins)[wrong]
        reach = np.where(met, np.minimum(length, path), path)[wrong]
        graze = _from_the_rim(corners[nearer], start[wrong] + reach[:, None] * seen[wrong]) / size
        verdict += Verdict(
            bounces=int(met.sum()),
            itself=int(((mine == left) & met).sum()),
            ties=int((~wrong & (mine != twins)).sum()),
            distance=float(off[~wrong].max(initial=0.0)),
            aside=float(aside.max(initial=0.0)),
            graze=float(graze.max(initial=0.0)),
            wrong=tuple((int(rows[j]), k, int(mine[j]), int(twins[j])) for j in np.flatnonzero(wrong)),
        )
        _reflect(direction, rows[met], normal[mine[met]])
    return verdict
