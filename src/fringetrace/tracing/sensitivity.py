"""Derivatives of optical paths and of ray directions with respect to surface positions."""

from __future__ import annotations

import numpy as np

from fringetrace.core import Array, FloatArray, dot
from fringetrace.tracing.segments import EXTENDED, Segments, SurfaceHits


def path_change(segments: Segments, hits: SurfaceHits, offset: Array) -> Array:
    """Change of the optical path due to a surface offset: -(n' d_out - n d_in) . offset.

    By Fermat's principle, errors of directions and of places along the surfaces do not count, to first order.

    Parameters
    ----------
    segments : Segments
        Of m paths.
    hits : SurfaceHits
        n hits of the same paths.
    offset : (n, 3), metres
        Of the hits from where they belong.

    Returns
    -------
    (m,) longdouble, metres
        Summed over the hits of each path.
    """
    after, before = (hits.path, hits.hit + 1), (hits.path, hits.hit)
    index, direction = segments.index, segments.direction
    turned = index[after][:, None] * direction[after] - index[before][:, None] * direction[before]
    change = np.zeros(len(index), dtype=EXTENDED)
    np.add.at(change, hits.path, -(turned * offset).sum(axis=1))
    return change


def leverage(segments: Segments, hits: SurfaceHits) -> FloatArray:
    """Change of ray direction per unit rotation of the surface at each hit: 2 off a mirror.

    From Snell's law, n' d' = n d + (n' c' - n c) nu, with cosines c to the normal nu.

    Parameters
    ----------
    segments : Segments
    hits : SurfaceHits
        n hits of the same paths.

    Returns
    -------
    (n,) float64
    """
    normal = hits.facet_normal
    after, before = (hits.path, hits.hit + 1), (hits.path, hits.hit)
    out, into = (
        segments.index[at] * dot(normal, segments.direction[at].astype(np.float64)) for at in (after, before)
    )
    return np.asarray(np.abs((out - into) / out), dtype=np.float64)
