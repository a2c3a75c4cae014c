"""Compiled rules for faces that lie at the same place: which of them a ray meets next, or that it meets none.

Where faces touch, no distance tells their order. A ray keeps a list of the faces that it has crossed at
the point where it stands (`crossed`), so that it crosses each once, and back again only after a
reflection. Of several faces the media decide: first comes what leaves a solid, then what has no media
(what lets light through before what does not), then what enters a solid; a boundary that does not have
the ray's medium on its near side comes last.
"""

from __future__ import annotations

from fringetrace.core import jit, lean

# Columns of `crossed`: how many faces are listed, which of them is crossed back next (0: none), the list.
COUNT, BACK, FIRST, COLUMNS = 0, 1, 2, 16
# Faces of one surface whose normals agree so well (cosine) are one sheet.
SHEET = 1.0 - 1e-9
# A ray along a plane, to this cosine, does not cross it.
ALONG = 1e-15
# So near to its edge (in the unit box of its body) a face need not be the one that a ray meets: at a seam.
SEAM = 1e-7
# The rank of a boundary that does not have the ray's medium on its near side.
STRANGE = 5
# Direction that tells one side of a plane from the other for faces that differ in nothing else: a
# generic one, across which nobody lays planes.
ONE, TWO, THREE = 0.6180339887, 0.5436890127, 0.5671432904


@lean
def rank(sides, surface, medium, facing):
    """Place of a face in the order of faces at one point, for a ray in a medium that meets it from a side.

    Of solids in one another the inner ones are left first: last what leads into the scene's medium, 0.
    """
    front, back = sides[surface, 0], sides[surface, 1]
    if front < 0:
        return 1 - front
    if medium != (front if facing < 0.0 else back):
        return STRANGE
    if front == back:  # it changes nothing, and is out of the way
        return -1
    if facing < 0.0:
        return STRANGE - 1
    return 1 if front == 0 else 0


@lean
def sooner(sides, medium, one, other):
    """Whether a ray meets one of two faces at the same place first.

    Each is its surface, the cosine of the ray to its normal, the normal, the path to it as rounded, and
    its number.
    """
    surface, facing, (nx, ny, nz), path, triangle = one
    mine = rank(sides, surface, medium, facing)
    theirs = rank(sides, other[0], medium, other[1])
    if mine != theirs:
        return mine < theirs
    if surface == other[0]:
        return path < other[3] or (path == other[3] and triangle < other[4])
    upward = facing * (nx * ONE + ny * TWO + nz * THREE) > 0.0
    return (surface < other[0]) == upward


@lean
def along(planes, tri, x, y, z):
    """Component of a vector along the normal of a triangle."""
    return planes[tri, 0] * x + planes[tri, 1] * y + planes[tri, 2] * z


@lean
def onward(tri, left, facing, side, rim, came, row, contact, planes):
    """Whether a ray goes through a face that its start touches; -1: no, else where it is in the list, or 0.

    `left` is the face of this body that the ray has just left, or -1. `rim`: the start is near the edge of
    the face, so that another one of its solid may be the one that the ray meets. `side` is the side of
    oriented faces that the ray is on (1: before, -1: behind) or 0 where only the direction `came` tells,
    in which it reached the point; `came` is 0 for a source, which is before all faces, and does not meet
    open sheets without media.
    """
    owner, sides, _, medium, crossed, first, oriented, closed = contact
    surface, back, region = owner[first + tri], 0, side
    if abs(facing) < ALONG or (rim and rank(sides, surface, medium[row], facing) == STRANGE):
        return -1
    bx, by, bz = came
    source = bx == 0.0 and by == 0.0 and bz == 0.0
    for k in range(FIRST, FIRST + crossed[row, COUNT]):
        other = crossed[row, k] - first
        if other < 0 or other >= len(planes) or owner[first + other] != surface:
            continue
        if side == 0 and oriented:  # behind the latest one
            region = 1 if along(planes, other, bx, by, bz) > 0.0 else -1
        if along(planes, other, planes[tri, 0], planes[tri, 1], planes[tri, 2]) > SHEET:
            back = k
    if region != 0 and facing * region >= 0.0:
        return -1
    if source and back == 0 and not closed and sides[surface, 0] < 0:
        return -1
    toward = -1.0 if source else along(planes, tri, bx, by, bz)
    if back > 0:
        return back if facing * toward < 0.0 else -1
    if left >= 0 and abs(along(planes, tri, planes[left, 0], planes[left, 1], planes[left, 2])) > SHEET:
        region = 0  # both sides of a sheet: a region without room
    return 0 if region != 0 or facing * toward > 0.0 else -1


@lean
def cross(crossed, row, triangle):
    """Enter a face that a ray goes through into its list, or take it off if the ray goes back through it."""
    count, back = crossed[row, COUNT], crossed[row, BACK]
    crossed[row, BACK] = 0
    if back > 0:
        for k in range(back, FIRST + count - 1):
            crossed[row, k] = crossed[row, k + 1]
        crossed[row, COUNT] = count - 1
        return
    if FIRST + count == COLUMNS:  # the oldest is forgotten
        for k in range(FIRST, COLUMNS - 1):
            crossed[row, k] = crossed[row, k + 1]
        count -= 1
    crossed[row, FIRST + count] = triangle
    crossed[row, COUNT] = count + 1


@lean
def hand_on(crossed, row, to, triangle):
    """Hand the list of a row on to another, which goes through a triangle as well; -1: it is sent back."""
    for k in range(FIRST + crossed[row, COUNT]):
        crossed[to, k] = crossed[row, k]
    if triangle >= 0:
        cross(crossed, to, triangle)
    else:
        crossed[to, BACK] = 0


@jit
def turned_back(crossed, rows, last):
    """Take back that rays went through the faces that they met last: they were sent back from there."""
    for row in rows:
        count = crossed[row, COUNT]
        if count > 0 and crossed[row, FIRST + count - 1] == last[row]:
            crossed[row, COUNT] = count - 1
        else:
            cross(crossed, row, last[row])
