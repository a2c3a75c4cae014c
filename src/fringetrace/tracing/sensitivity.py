"""Derivatives of the optical path with respect to hit points."""

from __future__ import annotations

import numpy as np

from fringetrace.core import Array, FloatArray
from fringetrace.tracing.paths import Paths
from fringetrace.tracing.segments import EXTENDED, Met, facing, indices


def shifted(paths: Paths, bounces: Met, offset: Array, turn: Array) -> Array:
    """Change of the optical path due to a surface offset: -(n' d_out - n d_in) . offset.

    Parameters
    ----------
    paths : Paths
        Traced with record=True.
    bounces : Met
    offset : (n, 3), metres
        Of the hits from where they belong.
    turn : (m, b + 1, 3)
        Directions of the segments, see `legs`.

    Returns
    -------
    (m,) longdouble, metres
        Summed over the bounces of each path. By Fermat's principle, what directions and places
        along the surfaces err does not count, to first order.
    """
    index = indices(paths)
    after, before = (bounces.path, bounces.bounce + 1), (bounces.path, bounces.bounce)
    turned = index[after][:, None] * turn[after] - index[before][:, None] * turn[before]
    error = np.zeros(len(paths), dtype=EXTENDED)
    np.add.at(error, bounces.path, -(turned * offset).sum(axis=1))
    return error


def leverage(bounces: Met, direction: FloatArray, index: FloatArray) -> FloatArray:
    """Change of ray direction per unit rotation of the surface at each hit: 2 off a mirror.

    From Snell's law, n' d' = n d + (n' c' - n c) nu, with cosines c to the normal nu.

    Parameters
    ----------
    bounces : Met
    direction : (m, b + 1, 3) float64
    index : (m, b + 1) float64

    Returns
    -------
    (n,) float64
    """
    normal = facing(bounces)
    after, before = (bounces.path, bounces.bounce + 1), (bounces.path, bounces.bounce)
    out = index[after] * np.einsum("ni,ni->n", direction[after], normal)
    into = index[before] * np.einsum("ni,ni->n", direction[before], normal)
    return np.asarray(np.abs((out - into) / out), dtype=np.float64)
