"""Groups of paths whose fields are kept apart."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def grouped(groups: npt.ArrayLike, paths: int) -> npt.NDArray[np.int64]:
    """Group of each path.

    Parameters
    ----------
    groups : (paths,) int
    paths : int

    Returns
    -------
    (paths,) int64

    Raises
    ------
    ValueError
        If they are no whole numbers from 0 on, one a path.
    """
    number = np.asarray(groups)
    whole = np.issubdtype(number.dtype, np.integer)
    if number.shape != (paths,) or not whole or (number < 0).any():
        raise ValueError(
            f"groups: expected {paths} whole numbers from 0 on, one a path, got {number.dtype} "
            f"of shape {number.shape}"
        )
    return number.astype(np.int64)
