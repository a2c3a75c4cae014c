"""Fates of a ray: detected, left, absorbed, truncated, faint."""

from __future__ import annotations

from enum import IntEnum


class Fate(IntEnum):
    """Fate of a path: why it ended."""

    DETECTED = 0
    LEFT = 1
    ABSORBED = 2
    TRUNCATED = 3
    FAINT = 4


# What becomes of a path; ALIVE: it goes on.
DETECTED, LEFT, ABSORBED, TRUNCATED, FAINT, ALIVE = 0, 1, 2, 3, 4, 5
