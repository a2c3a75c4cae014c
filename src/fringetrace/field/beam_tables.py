"""Tables of beam tracing: columns of beams, of what they may meet, and of waves on the CCD."""

from __future__ import annotations

from typing import NamedTuple

from fringetrace.core import Array

# Columns of a beam's frame: P, U, V, D, the path at depth 0, and the depth where it starts as an affine
# function of s and t.
P, U, V, D, W, START = 0, 3, 6, 9, 12, 13
FRAME = 16
# Columns of what a beam may meet: four lines around it, and its depth as an affine function.
LINES, DEPTH, TARGET = 4, 12, 15
# Columns of part of a beam as `candidates` takes it: P, U, V; bounds in s and t; normals of the surfaces
# where it begins and ends, each with its height over P.
BOUNDS, BEGIN, END, QUERY = 9, 13, 17, 21
# Columns of a wave on the CCD: x, y (pixels), path there, its gradient (metres a pixel), amplitude, s and t
# there, and their derivatives along x and y (metres a pixel).
X, Y, PATH, GRADIENT, REAL, IMAGINARY, S, T, DERIVATIVES, WAVE = 0, 1, 2, 3, 5, 6, 7, 8, 9, 13
# Where power goes.
DETECTED, LEFT, ABSORBED, TRUNCATED, DROPPED = 0, 1, 2, 3, 4
# Of so few things ahead each may hide the others; of more the tree tells which do.
FEW = 12
# Returned where a table is too small.
FULL = -1
# The CCD among the facets.
SENSOR = -1
# Light that meets the CCD's plane flatter than this (cosine) goes along it.
FLATTEST = 1e-9


class Facets(NamedTuple):
    """The facets of a scene, in the order of the leaves of a tree of boxes over each surface.

    Corners (n, 9) in metres, planes n.p + c = 0 (n, 4), surfaces (n,), below 0 where a leaf is not full. The
    boxes (m, 6) are centres and half widths, those of a complete binary tree. `roots` (surfaces, 3): the box
    before the first, the number of leaves, the first facet.
    """

    corners: Array
    planes: Array
    surface: Array
    boxes: Array
    roots: Array


class Tolerances(NamedTuple):
    """Least area (m^2) of a beam; what sides may overlap by rounding, and facets lie apart by it (m)."""

    area: float
    slack: float
    gap: float


class Interfaces(NamedTuple):
    """Amplitudes (surfaces,) of both branches, base of path keys, most bounces, least squared amplitude."""

    reflection: Array
    transmission: Array
    base: int
    most: int
    faint: float


class Beams(NamedTuple):
    """Beams waiting to be followed: frames, polygons, (corners, last facet, bounces, key), amplitudes."""

    frame: Array
    polygon: Array
    state: Array
    amplitude: Array


class FootprintTables(NamedTuple):
    """Beams on the CCD: corners (pixels), where those of each end, waves, keys."""

    corners: Array
    end: Array
    wave: Array
    key: Array


class Room(NamedTuple):
    """Tables to work in, of one thread."""

    edges: Array
    lines: Array
    at: Array
    reach: Array
    spare: Array
    rest: Array
    part: Array
    other: Array
    query: Array
    stack: Array
