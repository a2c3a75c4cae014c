"""Error budget of an image, by cause, in waves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fringetrace.accuracy.checks import found
from fringetrace.core import Array, FloatArray, checked_wavelength, short_repr, warn_once
from fringetrace.scene import Beam
from fringetrace.tracing import Paths, at_wavelength, retrace

# Rays along the longer side that are followed again, bounce by bounce; prime: not in step with facets.
PROBES = 53
# So many paths tell how a wave narrows; narrower than this part it is at its focus.
ENOUGH, NARROWEST = 9, 1e-3
# Rays along the longer side of the finest grid that is halved for the wavefront method.
FINEST = 128
# Fewer rays are doubled first: a quarter of them would have too few neighbours for the method's order.
FEWEST = 20
# Facets may cost this many waves, at the rms.
COSTLY = 1.0 / 20.0
# What the terms say of themselves.
CAUSES = {
    "hit": "rounding of hits and paths in float64",
    "facets": "facets off the smooth surface they stand for",
    "sampling": "too few rays",
    "pixels": "the mean over each pixel",
    "total": "root of the sum of squares",
}


@dataclass(frozen=True)
class Budget:
    """Error budget: rms error in waves by cause, over the light on the CCD.

    A field E that is off by e counts as (rms of |e|) / (rms of |E|) / 2 pi waves: the rms error of
    phase, weighted with the irradiance, if phase is what is off.

    Attributes
    ----------
    hit : float
        Rounding of float64 in hit points, directions and optical paths, along the bounces.
    facets : float
        Facets off the smooth surface that they may stand for; 0 for flat parts, and where a form is given.
        Where facets are the surface, as those of a prism, this term means nothing.
    sampling : float
        The number of rays: a grid with half of them either way makes another image. With "facets", light
        that none of the rays found.
    pixels : float
        The mean over each pixel: more points in it, or the phase slope times what a ray is off its centre;
        0 with "facets", which need no points.
    wavelength : float, metres
    method : str
        How the field was found, see `complex_field`.
    costliest : (surface name, float), optional
        The surface whose facets cost most, and their largest error of path on it in waves.
    """

    hit: float
    facets: float
    sampling: float
    pixels: float
    wavelength: float
    method: str
    costliest: tuple[str, float] | None = None

    __repr__ = short_repr

    @property
    def total(self) -> float:
        """Total error: root of the sum of squares."""
        return math.hypot(self.hit, self.facets, self.sampling, self.pixels)

    def __str__(self) -> str:
        head = f"error budget in waves of {self.wavelength * 1e9:.5g} nm, rms, {self.method}"
        rows = (f"  {name:<9} {getattr(self, name):8.1e}  {why}" for name, why in CAUSES.items())
        return "\n".join([head, *rows])

    @property
    def line(self) -> str:
        """The budget on one line."""
        return ", ".join(f"{name} {getattr(self, name):.1e}" for name in CAUSES) + " waves rms"


def budget(paths: Paths, wavelength: float, method: str = "auto") -> Budget:
    """Error budget of an image: rounding, facets, ray sampling and pixel quadrature; see `Budget`.

    Parameters
    ----------
    paths : Paths
        Of a `Beam` onto a CCD, from `trace`. Some more rays are traced through the same scene.
    wavelength : float, metres
    method : {"auto", "wavefront", "rays"}
        As for `complex_field`.

    Returns
    -------
    Budget

    Raises
    ------
    ValueError
        For paths without a CCD or not of a beam, a wavelength that is none, an unknown method.

    Warns
    -----
    FringetraceWarning
        Of all that `accuracy.check` warns of, and of costly facets; of each once.
    """
    costs, problems = judge(paths, wavelength, method)
    warn_once(problems, paths.warned)
    return costs


def judge(paths: Paths, wavelength: float, method: str = "auto") -> tuple[Budget, dict[str, str]]:
    """Error budget of an image, and all that there is to warn of, without a warning.

    Parameters
    ----------
    paths, wavelength, method
        As in `budget`.

    Returns
    -------
    Budget
    dict of str to str
        The text of each warning by its name.

    Raises
    ------
    ValueError
        As `budget`.
    """
    costs = _budget(paths, wavelength, method)
    facets = costly(costs)
    problems = found(paths, wavelength, method)
    return costs, problems if facets is None else problems | {"facets cost": facets}


def _budget(paths: Paths, wavelength: float, method: str) -> Budget:
    from fringetrace.accuracy import sampling
    from fringetrace.field import chosen

    paths = at_wavelength(paths, checked_wavelength(wavelength))
    if paths.ccd is None:
        raise ValueError("budget: expected paths traced onto a CCD, got paths without one")
    if not isinstance(paths.source, Beam):
        raise ValueError(f"budget: expected paths of a Beam, got those of {type(paths.source).__name__}")
    method = chosen(paths, method)
    probes = again(paths, _within(paths.source.shape, PROBES), record=True).detected
    facets, costliest = facet_error(probes, wavelength)
    if method == "rays":
        rays = sampling.count_error(paths, wavelength)
        pixel = sampling.offset_error(paths, wavelength)
    elif method == "facets":
        rays, pixel = sampling.missed_error(paths), 0.0
    else:
        grids = list(_halved(paths))
        steps = math.log2(max(paths.source.shape) / max(_shape(grids[0])))
        rays = sampling.sampling_error(grids, wavelength, steps)
        pixel = sampling.quadrature_error(grids[0], wavelength)
    return Budget(hit_error(probes, wavelength), facets, rays, pixel, wavelength, method, costliest)


def costly(budget: Budget) -> str | None:
    """Costly facets: their path error exceeds a twentieth of a wave.

    Parameters
    ----------
    budget : Budget

    Returns
    -------
    str or None
    """
    if budget.facets <= COSTLY or budget.costliest is None:
        return None
    name, worst = budget.costliest
    finer = np.sqrt(budget.facets / COSTLY)
    return (
        f"facets cost {budget.facets:.2g} waves rms, over 1/20: those of {name!r} up to {worst:.2g}; if they "
        "stand for a smooth surface, give it a form, such as forms.Smooth(), or facets "
        f"{finer:.1f} times as small"
    )


def again(paths: Paths, shape: tuple[int, int], record: bool = False) -> Paths:
    """Trace the same beam with another grid of rays.

    Parameters
    ----------
    paths : Paths
        Of a `Beam`.
    shape : (rows, columns)
    record : bool

    Returns
    -------
    Paths
        Followed for as many bounces as any path of `paths` that reached the CCD, and as faint.
    """
    assert isinstance(paths.source, Beam)
    return retrace(paths, replace(paths.source, shape=shape), record=record)


def _shape(paths: Paths) -> tuple[int, int]:
    assert isinstance(paths.source, Beam)
    return paths.source.shape


def _within(shape: tuple[int, int], most: int) -> tuple[int, int]:
    """A grid of the same proportions, with so many rays along its longer side at most."""
    part = min(1.0, most / max(shape))
    rows, columns = (max(1, round(part * n)) for n in shape)
    return rows, columns


def _halved(paths: Paths) -> Iterator[Paths]:
    """Three grids of rays, each with half as many either way as the one before."""
    shape = _within(_shape(paths), FINEST)
    if max(shape) < FEWEST:
        shape = 2 * shape[0], 2 * shape[1]
    yield paths if shape == _shape(paths) else again(paths, shape, paths.points is not None)
    for part in (2, 4):
        fewer = (max(1, round(shape[0] / part)), max(1, round(shape[1] / part)))
        yield again(paths, fewer, paths.points is not None)


def _rms(values: Array, weight: Array) -> float:
    total = float(weight.sum())
    return math.sqrt(float((weight * values**2).sum()) / total) if total > 0.0 else 0.0


def hit_error(paths: Paths, wavelength: float) -> float:
    """Rounding error of the optical paths in waves; see `path_errors.rounding`.

    Parameters
    ----------
    paths : Paths
        Detected, traced with record=True.
    wavelength : float, metres

    Returns
    -------
    float, waves, rms over the power
    """
    from fringetrace.accuracy.path_errors import rounding

    return _rms(rounding(paths) / wavelength, np.abs(paths.amplitude) ** 2)


def facet_error(paths: Paths, wavelength: float) -> tuple[float, tuple[str, float] | None]:
    """Facet error: path error of flat facets against the smooth surface behind them, in waves.

    A facet that stands off by s makes a path longer by s (n' d' - n d) along its normal: 2 s cos(incidence)
    off a mirror. One that leans by e turns the ray by g e, 2 e off a mirror: after a way of L it lands
    g e L beside its place, where the true wave, narrowing to a part m of its width, is behind or ahead
    by n' L (g e)^2 / 2 m.

    Parameters
    ----------
    paths : Paths
        Of a `Beam`, detected, traced with record=True.
    wavelength : float, metres

    Returns
    -------
    float, waves, rms over the power
        Of both, as the root of the sum of squares.
    (name, float) or None
        The surface that costs most, and the largest error of a path by it, in waves.
    """
    from fringetrace.accuracy.path_errors import flattening
    from fringetrace.tracing import Segments, leverage, path_change, surface_hits

    segments = Segments.of(paths)
    onward = np.cumsum(segments.length.astype(np.float64)[:, ::-1], axis=1)[:, ::-1]
    narrow = narrowing(paths)
    stood, leant = np.zeros(len(paths)), np.zeros(len(paths))
    worst: dict[str, float] = {}
    for hits in surface_hits(paths):
        offset, lean = flattening(hits)
        off = np.asarray(path_change(segments, hits, offset), dtype=np.float64)
        way = np.abs(onward[hits.path, hits.hit + 1]) / narrow[hits.path]
        turned = leverage(segments, hits) ** 2 * (lean**2).sum(axis=1)
        turned *= 0.5 * segments.index[hits.path, hits.hit + 1]
        beside = np.bincount(hits.path, way * turned, len(paths))
        stood, leant = stood + off, leant + beside
        worst[hits.surface.name] = float(np.hypot(off, beside).max() / wavelength)
    costliest = max(worst.items(), key=lambda item: item[1], default=None)
    return _rms(np.hypot(stood, leant) / wavelength, np.abs(paths.amplitude) ** 2), costliest


def narrowing(paths: Paths) -> FloatArray:
    """Width of the light of each path key on the CCD, relative to its width in the beam.

    Parameters
    ----------
    paths : Paths
        Of a `Beam`, detected.

    Returns
    -------
    (m,) float64
        Root of the determinant of the best linear map; 1 where there are too few paths to tell.
    """
    assert isinstance(paths.source, Beam)
    width, height = paths.source.size
    rows, columns = paths.source.shape
    row, column = np.divmod(paths.ray, columns)
    start = np.stack([column * (width / columns), row * (height / rows)], axis=1)
    part = np.ones(len(paths))
    _, which, count = np.unique(paths.key, return_inverse=True, return_counts=True)
    for kind in np.flatnonzero(count >= ENOUGH):
        mine = np.flatnonzero(which == kind)
        at, end = start[mine] - start[mine].mean(axis=0), paths.pixel[mine] * _pitch(paths)
        area = np.linalg.det(np.linalg.lstsq(at, end - end.mean(axis=0), rcond=None)[0])
        part[mine] = max(math.sqrt(abs(area)), NARROWEST) if np.ptp(at, axis=0).all() else 1.0
    return part


def _pitch(paths: Paths) -> float:
    assert paths.ccd is not None
    return paths.ccd.pitch
