"""Compiled beam tracing: a collimated beam cut by the facets it meets into ever smaller beams.

A beam keeps its cross-section as a convex polygon in coordinates (s, t) of the source. Behind plane
mirrors it comes from the mirror image of the source: a point of it is P + s U + t V + r D, with its path
W + r, where P, U, V, D are the source's centre and axes, mirrored; r is the depth. Facets seen along the
beam are triangles in (s, t), and their depth is an affine function of them: what is lit, and what lies in
the shadow, are polygons, exact but for rounding (Heckbert and Hanrahan, SIGGRAPH 1984).

What is `lean` makes no table: it returns `FULL` where one is too small, to be called again with a larger one.
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import grown, jit, lean, part
from fringetrace.field.beam_tables import (
    ABSORBED,
    DEPTH,
    DERIVATIVES,
    DETECTED,
    FEW,
    FRAME,
    FULL,
    GRADIENT,
    IMAGINARY,
    LEFT,
    LINES,
    PATH,
    QUERY,
    REAL,
    SENSOR,
    START,
    TARGET,
    TRUNCATED,
    WAVE,
    Beams,
    D,
    FootprintTables,
    P,
    Room,
    S,
    T,
    U,
    V,
    W,
    X,
)
from fringetrace.field.polygon_kernels import (
    CORNERS,
    area,
    copied,
    grown_polygons,
)  # fmt: skip
from fringetrace.field.visibility_kernels import (
    dot,
    lit_of_few,
    lit_of_many,
    targets,
)


@lean
def record(frame, pitch, shape, screen, reach, piece, corners, amplitude, key, out, count):
    """Write a beam that falls on the CCD."""
    begin = out.end[count - 1, 0] if count > 0 else 0
    s, t, wave = 0.0, 0.0, out.wave
    for i in range(corners):
        s, t = s + piece[i, 0] / corners, t + piece[i, 1] / corners
        for axis in range(2):
            at = reach[axis, 0] + reach[axis, 1] * piece[i, 0] + reach[axis, 2] * piece[i, 1]
            out.corners[begin + i, axis] = at / pitch + 0.5 * shape[1 - axis]
    for axis in range(2):
        at = reach[axis, 0] + reach[axis, 1] * s + reach[axis, 2] * t
        wave[count, X + axis] = at / pitch + 0.5 * shape[1 - axis]
        e = 6 + 3 * axis
        wave[count, GRADIENT + axis] = pitch * dot(frame, D, screen[e], screen[e + 1], screen[e + 2])
    wave[count, PATH] = frame[W] + reach[2, 0] + reach[2, 1] * s + reach[2, 2] * t
    det = reach[0, 1] * reach[1, 2] - reach[0, 2] * reach[1, 1]
    spread = 1.0 / np.sqrt(abs(det))
    wave[count, REAL], wave[count, IMAGINARY] = amplitude.real * spread, amplitude.imag * spread
    wave[count, S], wave[count, T], scale = s, t, pitch / det
    wave[count, DERIVATIVES], wave[count, DERIVATIVES + 1] = scale * reach[1, 2], -scale * reach[0, 2]
    wave[count, DERIVATIVES + 2], wave[count, DERIVATIVES + 3] = -scale * reach[1, 1], scale * reach[0, 1]
    out.end[count, 0], out.key[count, 0] = begin + corners, key


@lean
def mirrored(frames, row, nx, ny, nz, c):
    """Reflect a frame in the plane n.p + c = 0."""
    for k in (P, U, V, D):
        x, y, z = frames[row, k], frames[row, k + 1], frames[row, k + 2]
        twice = 2.0 * (nx * x + ny * y + nz * z + (c if k == P else 0.0))
        frames[row, k], frames[row, k + 1] = x - twice * nx, y - twice * ny
        frames[row, k + 2] = z - twice * nz


@lean
def onward(frame, table, row, piece, corners, amplitude, last, bounces, key, beams, waiting):
    """Put a beam that goes on from a target among those waiting."""
    for k in range(START):
        beams.frame[waiting, k] = frame[k]
    for k in range(3):
        beams.frame[waiting, START + k] = table[row, DEPTH + k]
    copied(piece, corners, beams.polygon[waiting])
    state = beams.state
    state[waiting, 0], state[waiting, 1], state[waiting, 2], state[waiting, 3] = corners, last, bounces, key
    beams.amplitude[waiting, 0], beams.amplitude[waiting, 1] = amplitude.real, amplitude.imag


@lean
def branch(
    frame, table, row, tri, whose, planes, optics, piece, corners, amplitude, bounces, key, beams, waiting,
    power,
):  # fmt: skip
    """The reflected and the transmitted branch of a beam that meets a facet; how many beams wait."""
    incident = area(piece, corners) * square(amplitude)
    if bounces >= optics.most:
        power[TRUNCATED] += incident
        return waiting
    absorbed = 1.0
    for through in range(2):
        by = optics.transmission[whose] if through == 1 else optics.reflection[whose]
        share = square(by)
        absorbed -= share
        if share > 0.0 and share * square(amplitude) < optics.faint:
            power[TRUNCATED] += incident * share
        elif share > 0.0:
            name = key * optics.base + 2 * whose + 1 + through
            onward(frame, table, row, piece, corners, amplitude * by, tri, bounces + 1, name, beams, waiting)
            if through == 0:
                nx, ny, nz, c = planes[tri, 0], planes[tri, 1], planes[tri, 2], planes[tri, 3]
                mirrored(beams.frame, waiting, nx, ny, nz, c)
            waiting += 1
    power[ABSORBED] += incident * max(absorbed, 0.0)
    return waiting


@part
def square(value):
    """Squared magnitude of a complex number."""
    return value.real * value.real + value.imag * value.imag


@jit
def tables():
    """Tables to work in."""
    return Room(
        np.empty((CORNERS, 3)), np.empty((LINES + 2, 3)), np.empty((3, 2)), np.empty((3, 3)),
        np.empty((CORNERS, 2)), np.empty((CORNERS, 2)), np.empty((CORNERS, 2)), np.empty((1, TARGET)),
        np.empty(QUERY), np.empty(64, np.int64),
    )  # fmt: skip


@jit
def roomy(beams, waiting, out, done):
    """Tables with room for so many beams that wait, and so many footprints."""
    while waiting > len(beams.state):
        beams = Beams(
            grown(beams.frame), grown_polygons(beams.polygon), grown(beams.state), grown(beams.amplitude)
        )
    while done > len(out.key):
        out = FootprintTables(out.corners, grown(out.end), grown(out.wave), grown(out.key))
    while CORNERS * done > len(out.corners):
        out = FootprintTables(grown(out.corners), out.end, out.wave, out.key)
    return beams, out


@jit
def follow(source, section, leaf, facets, optics, limits, screen, pitch, shape):
    """Follow a beam through all facets to the CCD.

    `source` (1, FRAME) is its frame, `section` (4, 2) the rectangle it fills, `leaf` the facets in a leaf.
    Returns its footprints on the CCD (the last rows of their tables are blank), how many, and the power (5,)
    that was detected, left, was absorbed, was truncated, and of that which left what was dropped as too
    narrow, in m^2 of the source.
    """
    corners, planes, surface, boxes, roots = facets
    room, power = tables(), np.zeros(5)
    found, hiding = np.empty((256, 1), np.int64), np.empty((256, 1), np.int64)
    table, number = np.empty((256, TARGET)), np.empty((256, 1), np.int64)
    pieces, sizes = np.empty((16, CORNERS, 2)), np.empty((16, 1), np.int64)
    polygon, frame = np.empty((CORNERS, 2)), np.empty(FRAME)
    beams = Beams(
        np.empty((64, FRAME)), np.empty((64, CORNERS, 2)), np.empty((64, 4), np.int64), np.empty((64, 2))
    )
    out = FootprintTables(
        np.empty((1024, 2)), np.empty((256, 1), np.int64), np.empty((256, WAVE)), np.empty((256, 1), np.int64)
    )
    for k in range(3):
        table[0, DEPTH + k] = source[START + k]
    onward(source, table, 0, section, len(section), complex(1.0, 0.0), -1, 0, 0, beams, 0)
    waiting, done = 1, 0
    while waiting > 0:
        waiting -= 1
        state = beams.state
        count, last, bounces, key = state[waiting, 0], state[waiting, 1], state[waiting, 2], state[waiting, 3]
        for k in range(FRAME):
            frame[k] = beams.frame[waiting, k]
        copied(beams.polygon[waiting], count, polygon)
        amplitude = complex(beams.amplitude[waiting, 0], beams.amplitude[waiting, 1])
        gone, strength = area(polygon, count), square(amplitude)
        total = FULL
        while total == FULL:
            total = targets(
                frame, polygon, count, last, leaf, corners, planes, surface, boxes, roots, screen, limits,
                room, table, number, found,
            )  # fmt: skip
            if total == FULL:
                found, table, number = grown(found), grown(table), grown(number)
        for row in range(total):
            left = FULL
            while left == FULL:
                if total <= FEW:
                    left = lit_of_few(
                        frame, polygon, count, row, total, limits, room, table, number, pieces, sizes, power,
                        strength,
                    )  # fmt: skip
                else:
                    left = lit_of_many(
                        frame, polygon, count, row, last, leaf, corners, planes, surface, boxes, roots,
                        limits, room, table, number, hiding, pieces, sizes, power, strength,
                    )  # fmt: skip
                if left == FULL:
                    hiding, pieces, sizes = grown(hiding), grown_polygons(pieces), grown(sizes)
            tri = number[row, 0]
            beams, out = roomy(beams, waiting + 2 * left, out, done + left)
            for k in range(left):
                size = area(pieces[k], sizes[k, 0])
                gone -= size
                if tri == SENSOR:
                    power[DETECTED] += size * strength
                    record(
                        frame,
                        pitch,
                        shape,
                        screen,
                        room.reach,
                        pieces[k],
                        sizes[k, 0],
                        amplitude,
                        key,
                        out,
                        done,
                    )
                    done += 1
                else:
                    waiting = branch(
                        frame, table, row, tri, surface[tri], planes, optics, pieces[k], sizes[k, 0],
                        amplitude, bounces, key, beams, waiting, power,
                    )  # fmt: skip
        power[LEFT] += gone * strength
    return out, done, power
