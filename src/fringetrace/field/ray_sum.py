"""Ray sum: rays moved to the centre of their part of a pixel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fringetrace.tracing import Paths


def centred(paths: Paths, parts: int = 1) -> Paths:
    """Continue paths, as plane waves, to the centres of the pixels (or parts of them) they fall in.

    A ray that lands beside the centre brings the phase of where it landed; summed as it is, a
    tilted wave would be sampled on a grid other than that of the pixels.

    Parameters
    ----------
    paths : Paths
        All of them detected.
    parts : int
        Parts of a pixel along either axis.

    Returns
    -------
    Paths
        With other lengths, L + d . (centre - point), and otherwise the same.

    Raises
    ------
    ValueError
        If the paths were traced without a CCD.
    """
    if paths.ccd is None:
        raise ValueError("centred: expected paths traced onto a CCD, got paths without one")
    u, v, _ = paths.ccd.axes
    fine = paths.pixel * parts
    shift = (np.floor(fine) + 0.5 - fine) * (paths.ccd.pitch / parts)
    continued = shift[:, 0] * (paths.gradient @ v) + shift[:, 1] * (paths.gradient @ u)
    return replace(paths, length=paths.length + continued)
