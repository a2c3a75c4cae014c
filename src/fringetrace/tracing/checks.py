"""Warnings about traces: power cut off, media that contradict, open boundaries, paths that multiply."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from fringetrace.core import Array, FloatArray, short_repr, warn_once
from fringetrace.scene import Scene, openings
from fringetrace.tracing.fates import Fate
from fringetrace.tracing.paths import Paths

# This part of the incident power may be cut off without a warning.
CUT = 1e-6
# Paths multiply where so many are under way for each ray of a chunk, and so many in all: 100 MB.
EACH, CROWD = 64, 2**17
CUT_OFF, MULTIPLYING = "power is cut off", "paths multiply"


@dataclass(frozen=True, eq=False)
class Losses:
    """What a trace did not follow to its end, and where it met other media than expected.

    Attributes
    ----------
    scene : Scene
    incident : float
        Sum of |amplitude|^2 of the rays that were launched, as all powers here.
    bounced, faint : float
        Power cut off by the number of bounces, and by the least amplitude. Branches that an interface does
        not follow are left out on purpose, and not counted.
    where : (surfaces + 1,) float64
        Both, by the surface met last; in the last place that of rays which met none, or more than keys tell.
    brightest : float
        Power of the brightest path that was cut off.
    point : (3,) float64, metres
        Where.
    contradictions : (surfaces,) int64
        See `Paths`.
    max_bounces : int
        Where paths were cut off, if any.
    min_amplitude : float
    """

    scene: Scene
    incident: float
    bounced: float
    faint: float
    where: FloatArray
    brightest: float
    point: FloatArray
    contradictions: npt.NDArray[np.int64]
    max_bounces: int
    min_amplitude: float

    __repr__ = short_repr

    @staticmethod
    def of(paths: Paths) -> Losses:
        """Losses of all paths of a trace, or of a chunk."""
        surfaces, base = len(paths.scene.surfaces), len(paths.scene.digits) + 1
        rows = np.flatnonzero(paths.fate >= Fate.TRUNCATED)
        power = np.abs(paths.amplitude[rows]) ** 2
        bounced = paths.fate[rows] == Fate.TRUNCATED
        digit = (paths.key[rows] % np.uint64(base)).astype(np.int64) - 1
        digit[paths.bounces[rows] > int(64 / np.log2(base))] = -1  # beyond, keys are cut off in front
        last = np.array([*(number for number, _ in paths.scene.digits), surfaces])[digit]
        none = np.zeros(surfaces, dtype=np.int64)
        top = int(np.argmax(power)) if len(rows) else 0
        return Losses(
            scene=paths.scene,
            incident=paths.incident,
            bounced=float(power[bounced].sum()),
            faint=float(power[~bounced].sum()),
            where=np.asarray(np.bincount(last, power, surfaces + 1), dtype=np.float64),
            brightest=float(power[top]) if len(rows) else 0.0,
            point=paths.origin[rows[top]].copy() if len(rows) else np.full(3, np.nan),
            contradictions=none if paths.contradictions is None else paths.contradictions,
            max_bounces=int(paths.bounces[rows[bounced]].max(initial=0)),
            min_amplitude=paths.min_amplitude,
        )

    def __add__(self, other: Losses) -> Losses:
        """Losses of both, in one scene."""
        return replace(
            self,
            incident=self.incident + other.incident,
            bounced=self.bounced + other.bounced,
            faint=self.faint + other.faint,
            where=self.where + other.where,
            brightest=max(self.brightest, other.brightest),
            point=self.point if self.brightest >= other.brightest else other.point,
            contradictions=self.contradictions + other.contradictions,
            max_bounces=max(self.max_bounces, other.max_bounces),
        )

    @property
    def share(self) -> float:
        """Power cut off, relative to the incident power."""
        return (self.bounced + self.faint) / self.incident if self.incident else 0.0

    @property
    def problems(self) -> dict[str, str]:
        """All that there is to warn of: the text of each warning by its name."""
        texts = {
            CUT_OFF: power_cut(self),
            "media contradict": media_contradiction(self),
            "glass is open": open_boundary(self.scene),
        }
        return {name: text for name, text in texts.items() if text is not None}


def power_cut(losses: Losses) -> str | None:
    """Power cut off by the number of bounces or the least amplitude: over a millionth of the incident.

    Parameters
    ----------
    losses : Losses

    Returns
    -------
    str or None
    """
    if losses.share <= CUT:
        return None
    surfaces = losses.scene.surfaces
    worst = int(np.argmax(losses.where))
    behind = f", most of it behind {surfaces[worst].name!r}" if worst < len(surfaces) else ""
    place = ", ".join(f"{x:.4g}" for x in losses.point)
    parts = {
        f"after max_bounces={losses.max_bounces}": losses.bounced,
        f"below min_amplitude={losses.min_amplitude:g}": losses.faint,
    }
    causes = " and ".join(
        f"{power / losses.incident:.2g} {cause}" for cause, power in parts.items() if power > 0.0
    )
    remedy = "more bounces" if losses.bounced > losses.faint else "a smaller least amplitude"
    return (
        f"{CUT_OFF}: {causes}, as parts of the incident power{behind}, the brightest path at "
        f"({place}) m; allow {remedy}"
    )


def media_contradiction(losses: Losses) -> str | None:
    """Contradicting media: rays reach a boundary in another medium than it has on that side.

    Parameters
    ----------
    losses : Losses

    Returns
    -------
    str or None
    """
    if not losses.contradictions.any():
        return None
    worst = int(np.argmax(losses.contradictions))
    surface, number = losses.scene.surfaces[worst], int(losses.contradictions[worst])
    sides = " and ".join((side or losses.scene.around).name for side in (surface.front, surface.back))
    return (
        f"media contradict: {number:,} rays came to {surface.name!r}, between {sides} (front and back), in "
        f"another medium; close its mesh, turn its normals to the front, name the media of what lies "
        f"before it, or take the bodies apart where they overlap"
    )


def open_boundary(scene: Scene) -> str | None:
    """Open boundary: a surface between two media that would close but for a hole.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    str or None
    """
    found = openings(scene)
    if not found:
        return None
    largest = found[0]
    edges = ", ".join(f"{a}-{b}" for a, b in largest.edges[:4].tolist())
    place = ", ".join(f"{x:.4g}" for x in largest.centre)
    return (
        f"glass is open: {scene.surfaces[largest.surface].name!r} has a hole of {largest.area:.3g} m2 about "
        f"({place}) m, between the vertices {edges}{', ...' if len(largest.edges) > 4 else ''}"
        f"{f', and the scene has {len(found) - 1} more' if len(found) > 1 else ''}; close the mesh, or rays "
        "pass it without meeting a boundary"
    )


def warn_of_crowd(
    scene: Scene, surface: Array, launched: int, bounces: int, min_amplitude: float, given: set[str]
) -> None:
    """Warn, while they are traced, of paths that multiply.

    Parameters
    ----------
    scene : Scene
    surface : (n,) int
        The surface that each path under way met last.
    launched : int
        Of how many rays they are.
    bounces : int
        How many surfaces they have met.
    min_amplitude : float
    given : set of str
        See `warn_once`.

    Warns
    -----
    FringetraceWarning
    """
    count = len(surface)
    if MULTIPLYING in given:
        return
    name = scene.surfaces[int(np.bincount(surface).argmax())].name
    text = (
        f"{MULTIPLYING}: {launched:,} rays have become {count:,} paths after {bounces} surfaces, most "
        f"of them at {name!r}; allow fewer bounces, a larger least amplitude than {min_amplitude:g}, or "
        "follow one branch of a boundary"
    )
    warn_once({MULTIPLYING: text}, given)
