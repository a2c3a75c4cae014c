"""Ray query: further rays through the scene of traced paths."""

from __future__ import annotations

from fringetrace.scene import Beam
from fringetrace.tracing.fates import Fate
from fringetrace.tracing.paths import Paths
from fringetrace.tracing.rays import Rays
from fringetrace.tracing.tracer import trace


def retrace(
    paths: Paths,
    source: Beam | Rays,
    *,
    record: bool = False,
    max_bounces: int | None = None,
    min_amplitude: float | None = None,
) -> Paths:
    """Trace further rays through the scene of paths, onto their CCD, at their wavelength; warn of nothing.

    Parameters
    ----------
    paths : Paths
    source : Beam or Rays
    record : bool
        Keep every hit.
    max_bounces : int, optional
        Default: as many as any of `paths` has that reached the CCD.
    min_amplitude : float, optional
        Default: that of `paths`.

    Returns
    -------
    Paths
    """
    if max_bounces is None:
        max_bounces = int(paths.bounces[paths.fate == Fate.DETECTED].max(initial=0))
    return trace(
        paths.scene, source, paths.ccd, wavelength=paths.wavelength, max_bounces=max_bounces,
        min_amplitude=paths.min_amplitude if min_amplitude is None else min_amplitude,
        record=record, warn=False,
    )  # fmt: skip
