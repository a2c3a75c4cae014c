"""Compiled physics of a ray at a surface: reflection, Snell, Fresnel, absorption, the field as a vector.

Amplitudes are those of power: |amplitude|^2 is what a ray carries. In an absorbing medium a ray has the
complex wave vector k0 (index * direction + i fade), so that waves are inhomogeneous there as they are
behind a film: phases of parallel faces are exact. A `field` is a scalar and a vector, one of which is 0.
"""

from __future__ import annotations

import numpy as np

from fringetrace.core import part
from fringetrace.tracing.optics_table import OPAQUE, REFLECTED, TRANSMITTED

# Nearer to the normal than this (sine) there is no plane of incidence: any one will do.
STRAIGHT = 1e-12


@part
def square(value):
    """Squared magnitude of a complex number."""
    return value.real * value.real + value.imag * value.imag


@part
def reflected(dx, dy, dz, nx, ny, nz, facing, steps):
    """A direction after reflection at a face that it meets at the cosine `facing`.

    Every eighth time, by the number of `steps`, a Newton step keeps the length at 1.
    """
    along = 2.0 * facing
    dx, dy, dz = dx - along * nx, dy - along * ny, dz - along * nz
    if steps & 7 == 0:
        scale = 1.5 - 0.5 * (dx * dx + dy * dy + dz * dz)
        dx, dy, dz = dx * scale, dy * scale, dz * scale
    return dx, dy, dz


@part
def refracted(index, first, last, q1, q2, facing, d, f, n):
    """Direction, real index and fade of the wave beyond a boundary: what runs along it stays the same.

    `q1`, `q2` are the normal parts before and behind, in the sense of travel; `facing` the cosine.
    """
    (dx, dy, dz), (fx, fy, fz), (nx, ny, nz) = d, f, n
    sense = 1.0 if facing > 0.0 else -1.0
    deeper = sense * (q2 - q1)
    x, y, z = index * dx + deeper.real * nx, index * dy + deeper.real * ny, index * dz + deeper.real * nz
    size = np.sqrt(x * x + y * y + z * z)
    fade = deeper.imag
    fx, fy, fz = fx + fade * nx, fy + fade * ny, fz + fade * nz
    if last.imag == 0.0 and first.imag == 0.0:
        fx, fy, fz = 0.0, 0.0, 0.0
    scale = 1.0 / size if size > 0.0 else 0.0  # no light runs there
    # a wave that does not fade is as long as the index says
    plain = last.imag == 0.0 and fx == 0.0 and fy == 0.0 and fz == 0.0
    return (x * scale, y * scale, z * scale), (last.real if plain else size), (fx, fy, fz)


@part
def s_axis(dx, dy, dz, nx, ny, nz):
    """Unit vector of s light, across a ray and a normal; across the ray alone where these agree."""
    x, y, z = dy * nz - dz * ny, dz * nx - dx * nz, dx * ny - dy * nx
    size = x * x + y * y + z * z
    if size < STRAIGHT * STRAIGHT:
        x, y, z = (0.0, dz, -dy) if abs(dx) < 0.7 else (-dz, 0.0, dx)
    # rounding of a short product points anywhere
    along = x * dx + y * dy + z * dz
    x, y, z = x - along * dx, y - along * dy, z - along * dz
    size = 1.0 / np.sqrt(x * x + y * y + z * z)
    return x * size, y * size, z * size


@part
def to_s_p(ex, ey, ez, dx, dy, dz, sx, sy, sz):
    """Components of a field along s, and along p = d x s."""
    px, py, pz = dy * sz - dz * sy, dz * sx - dx * sz, dx * sy - dy * sx
    return ex * sx + ey * sy + ez * sz, ex * px + ey * py + ez * pz


@part
def from_s_p(s, p, dx, dy, dz, sx, sy, sz):
    """The field of two components."""
    px, py, pz = dy * sz - dz * sy, dz * sx - dx * sz, dx * sy - dy * sx
    return s * sx + p * px, s * sy + p * py, s * sz + p * pz


@part
def power(field, polarised):
    """Power of a ray."""
    scalar, ex, ey, ez = field
    return square(ex) + square(ey) + square(ez) if polarised else square(scalar)


@part
def strength(field, polarised):
    """Amplitude of a ray: its scalar field, or the size of its vector."""
    return complex(np.sqrt(power(field, polarised)), 0.0) if polarised else field[0]


@part
def scaled(field, factor):
    """A field times a factor."""
    scalar, ex, ey, ez = field
    return scalar * factor, ex * factor, ey * factor, ez * factor


@part
def branches(field, d, h, t, n, rs, rp, ts, tp, polarised):
    """The field that goes back along h, and that which goes on along t."""
    scalar, ex, ey, ez = field
    if not polarised:
        return (scalar * rs, ex, ey, ez), (scalar * ts, ex, ey, ez)
    sx, sy, sz = s_axis(d[0], d[1], d[2], n[0], n[1], n[2])
    s, p = to_s_p(ex, ey, ez, d[0], d[1], d[2], sx, sy, sz)
    hx, hy, hz = from_s_p(rs * s, rp * p, h[0], h[1], h[2], sx, sy, sz)
    tx, ty, tz = from_s_p(ts * s, tp * p, t[0], t[1], t[2], sx, sy, sz)
    return (0j, hx, hy, hz), (0j, tx, ty, tz)


@part
def followed(follow, returns, passes):
    """Power of the branches that are followed, what is absorbed behind the surface, what is left aside."""
    absorbed, dropped = 0.0, 0.0
    if follow & OPAQUE:
        absorbed, passes = passes, 0.0
    elif not follow & TRANSMITTED:
        dropped, passes = passes, 0.0
    if not follow & REFLECTED:
        dropped, returns = dropped + returns, 0.0
    return returns, passes, absorbed, dropped
