"""Vectors of shape (n, 3) in float64, rotations, and the axes of rectangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fringetrace.core.units import Array, FloatArray, filled

# A matrix that changes lengths by more than this part was not meant as a rotation.
STRETCH = 1e-9
# What rounding leaves of a length of 1, or of a right angle: scaling again would only change last bits.
ROUNDED = 4.0 * float(np.finfo(np.float64).eps)


def checked_vector(value: npt.ArrayLike, what: str) -> FloatArray:
    """Checked finite vector of three components.

    Parameters
    ----------
    value : (3,) array-like
    what : str
        The name used in the error message.

    Returns
    -------
    (3,) float64

    Raises
    ------
    ValueError
        If it is not three numbers, or one is not finite.
    """
    try:
        vector = filled(value).copy()
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what}: expected 3 numbers, got {value!r}") from error
    if vector.shape != (3,):
        raise ValueError(f"{what}: expected 3 numbers, got shape {vector.shape}")
    if not np.isfinite(vector).all():
        raise ValueError(f"{what}: expected finite numbers, got {vector.tolist()}")
    return vector


def checked_direction(value: npt.ArrayLike, what: str) -> FloatArray:
    """Checked direction, scaled to unit length; unit vectors stay the same to the last bit.

    Parameters
    ----------
    value : (3,) array-like
    what : str
        The name used in the error message.

    Returns
    -------
    (3,) float64, unit

    Raises
    ------
    ValueError
        If it has no length, is not finite, or is not a vector.
    """
    vector = checked_vector(value, what)
    # scale by the largest component first: squares of tiny directions underflow
    largest = float(np.abs(vector).max())
    if largest == 0.0:
        raise ValueError(f"{what}: expected a direction, got a vector of length 0")
    if 0.5 < largest < 2.0 and abs(float(np.linalg.norm(vector)) - 1.0) <= ROUNDED:
        return vector
    vector = vector / largest
    return np.asarray(vector / np.linalg.norm(vector), dtype=np.float64)


def unit(vectors: FloatArray) -> FloatArray:
    """Vectors scaled to unit length.

    Parameters
    ----------
    vectors : (n, 3) float64
        None may have length 0.

    Returns
    -------
    (n, 3) float64, unit
    """
    scaled = vectors / np.abs(vectors).max(axis=-1, keepdims=True)
    return np.asarray(scaled / np.linalg.norm(scaled, axis=-1, keepdims=True), dtype=np.float64)


def component(vectors: FloatArray, axis: FloatArray) -> FloatArray:
    """Components of vectors along one axis.

    Parameters
    ----------
    vectors : (n, 3) float64
    axis : (3,) float64

    Returns
    -------
    (n,) float64
        The same bits for each row, whatever the others: a matrix product's depend on how many there are.
    """
    return np.asarray(np.einsum("ij,j->i", vectors, axis), dtype=np.float64)


def dot(a: Array, b: Array) -> Array:
    """Scalar products of rows, without conjugation.

    Parameters
    ----------
    a, b : (n, 3) float64 or complex128

    Returns
    -------
    (n,) float64 or complex128
    """
    return np.asarray(np.einsum("ij,ij->i", a, b))


def frame(normal: npt.ArrayLike, up: npt.ArrayLike, what: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Axes (u, v) of a rectangle seen along its normal n; (v, u, n) is right-handed.

    u = normal x up is to the right of somebody who looks along `normal` with `up` up;
    v is `up` without its part along `normal`.

    Parameters
    ----------
    normal : (3,) array-like
    up : (3,) array-like
        Any direction that is not along `normal`.
    what : str
        The name used in the error message.

    Returns
    -------
    u, v, n : (3,) float64, unit
        Axis of the columns, axis of the rows, the normal.

    Raises
    ------
    ValueError
        If `up` is along `normal`, or either is no direction.
    """
    n = checked_direction(normal, f"{what} normal")
    guide = checked_direction(up, f"{what} up")
    u = np.cross(n, guide)
    if np.linalg.norm(u) < 1e-8:
        raise ValueError(
            f"{what} up: expected a direction across the normal {n.tolist()}, got {guide.tolist()}"
        )
    u = checked_direction(u, f"{what} u")
    return u, np.cross(u, n), n


def checked_rotation(value: npt.ArrayLike, what: str) -> FloatArray:
    """Checked rotation matrix.

    Parameters
    ----------
    value : (3, 3) array-like
    what : str
        The name used in the error message.

    Returns
    -------
    (3, 3) float64

    Raises
    ------
    ValueError
        If the shape is wrong, or the matrix would change lengths or swap left and right.
    """
    matrix = filled(value)
    if matrix.shape != (3, 3):
        raise ValueError(f"{what}: expected a rotation matrix of shape (3, 3), got shape {matrix.shape}")
    stretch = np.abs(matrix @ matrix.T - np.eye(3)).max()
    if not (stretch < STRETCH and np.linalg.det(matrix) > 0.0):
        raise ValueError(f"{what}: expected a rotation matrix, got {matrix.tolist()}")
    return matrix


def rotation(axis: npt.ArrayLike, angle: float) -> FloatArray:
    """Rotation matrix about an axis, right-handed (Rodrigues).

    Parameters
    ----------
    axis : (3,) array-like
    angle : float, radians

    Returns
    -------
    (3, 3) float64
    """
    x, y, z = checked_direction(axis, "rotation axis")
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # 1 - cos written as 2 sin^2 keeps the digits of small tilts
    half = np.sin(0.5 * angle)
    return np.asarray(
        np.eye(3) + np.sin(angle) * cross + 2.0 * half * half * (cross @ cross), dtype=np.float64
    )
