"""Sheets off flat facets: a plane wave for each sequence of facets, and its region of the beam."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from fringetrace.paths import Paths
from fringetrace.quadrature import Samples, averaged, edges
from fringetrace.rays import launch_at
from fringetrace.scene import CCD, Beam, Scene
from fringetrace.sheets import checked, landed
from fringetrace.trace import trace
from fringetrace.vectors import frame
from fringetrace.waves import Array, ComplexArray, FloatArray, checked_wavelength

# Normals and heights of facets this near (relative to the mesh) are those of one plane.
COPLANAR = 1e-9
# Rays at the rim of the beam start this part of a cell inside it.
RIM = 1e-9
# A side is halved this often to find where an edge crosses it: to 2e-10 of a cell.
HALVINGS = 32
# A chord is an edge if the light changes within this part of its cell, on both sides of it.
STRAIGHT = 1e-7
# Silhouettes, which single rays pass or hit, are known to this part of the scene's size.
FUZZ = 1e-8
# A chord shorter than this part of its cell is not looked at.
SHORT = 1e-4
# Where several edges meet, cells are quartered this often; what is left is 1e-6 of a cell's area.
DEPTH = 10
# Where along a chord it is looked at.
ALONG = (0.21, 0.5, 0.83)
CORNERS = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])


@dataclass(frozen=True, eq=False)
class Probe:
    """A way to ask which sequences of facets the light takes from a point of the beam."""

    scene: Scene
    beam: Beam
    ccd: CCD
    planes: list[npt.NDArray[np.int64]]
    keys: npt.NDArray[np.uint64]
    bounces: int

    @property
    def fuzz(self) -> FloatArray:
        """How well edges are known, in cells of the beam's grid: along columns, along rows."""
        bounds = np.stack([surface.mesh.bounds for surface in self.scene.surfaces])
        size = float((bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)).max())
        cells = np.array(self.beam.shape[::-1]) / np.array(self.beam.size)
        return np.asarray(FUZZ * size * cells, dtype=np.float64)

    def paths(self, at: FloatArray) -> tuple[Paths, Array, npt.NDArray[np.uint64]]:
        """Paths from points (n, 2) of the beam's grid, which of them cross the CCD's plane, their names."""
        limits = RIM, np.array(self.beam.shape[::-1]) - RIM
        inside = np.clip(at, *limits)
        rays = launch_at(self.beam, inside[:, 0], inside[:, 1])
        paths = trace(self.scene, rays, self.ccd, max_bounces=self.bounces, record=True)
        rows, _, _ = landed(paths, self.ccd)
        rows = rows[np.isin(paths.key[rows], self.keys)]
        return paths, rows, self._names(paths, rows)

    def _names(self, paths: Paths, rows: Array) -> npt.NDArray[np.uint64]:
        """A number for each sequence of branches and planes (a 64-bit hash)."""
        assert paths.surface is not None
        assert paths.triangle is not None
        names = paths.key[rows].copy()
        for bounce in range(paths.surface.shape[1]):
            # the table is as wide as its longest path
            there = np.flatnonzero(paths.bounces[rows] > bounce)
            surface, triangle = paths.surface[rows[there], bounce], paths.triangle[rows[there], bounce]
            plane = np.zeros(len(there), dtype=np.uint64)
            for number in np.unique(surface):
                mine = surface == number
                plane[mine] = self.planes[number][triangle[mine]]
            names[there] = _mixed(names[there] * np.uint64(0x9E3779B97F4A7C15) + plane + np.uint64(1))
        return names

    def lit(self, at: FloatArray, names: npt.NDArray[np.uint64]) -> npt.NDArray[np.bool_]:
        """Whether light takes a sequence (n,) from a point (n, 2)."""
        if len(at) == 0:
            return np.zeros(0, dtype=np.bool_)
        paths, rows, found = self.paths(at)
        ray = paths.ray[rows]
        lit = np.zeros(len(at), dtype=np.bool_)
        lit[ray[found == names[ray]]] = True
        return lit


@dataclass(frozen=True, eq=False)
class Wave:
    """A plane wave off a sequence of facets.

    Attributes
    ----------
    name : int
    key : int
        Of its paths.
    origin : (2,) float64, pixels
        Column and row coordinate of a ray in the plane of focus.
    matrix : (2, 2) float64
        From steps of the beam's grid (column, row) to pixels (column, row).
    start : (2,) float64
        That ray's place on the beam's grid.
    path : float, metres
        Its optical path.
    gradient : (2,) float64, metres a pixel
    amplitude : complex
    reflections : int
        Off mirrors.
    """

    name: np.uint64
    key: int
    origin: FloatArray
    matrix: FloatArray
    start: FloatArray
    path: float
    gradient: FloatArray
    amplitude: complex
    reflections: int

    def to_pixels(self, at: FloatArray) -> FloatArray:
        """Points (..., 2) of the beam's grid on the CCD."""
        return np.asarray(self.origin + (at - self.start) @ self.matrix.T, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Region:
    """Where on the beam's grid a wave starts: cells from `low` on, and pieces of cells, see `raster`.

    `segments` are the region's edges on the beam's grid, (n, 2, 2).
    """

    low: tuple[int, int]
    kind: npt.NDArray[np.int64]
    begin: npt.NDArray[np.int64]
    pieces: FloatArray
    segments: FloatArray


def _mixed(number: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    """Numbers scattered over 64 bits, one to one (Steele, Lea and Flood, OOPSLA 2014)."""
    number = (number ^ (number >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    number = (number ^ (number >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return number ^ (number >> np.uint64(31))


def coplanar(scene: Scene) -> list[npt.NDArray[np.int64]]:
    """Which triangles of each surface lie in one plane.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    list of (triangles,) int64
        A number for the plane of each triangle, one array a surface.
    """
    planes = []
    for surface in scene.surfaces:
        mesh = surface.mesh
        a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        size = float(np.ptp(mesh.bounds, axis=0).max())
        height = np.einsum("ij,ij->i", normal, a - mesh.bounds.mean(axis=0)) / size
        # off the middle between round numbers, where most designs have their planes
        rounded = np.floor(np.column_stack([normal, height]) / COPLANAR + 0.377).astype(np.int64)
        planes.append(np.unique(rounded, axis=0, return_inverse=True)[1].ravel())
    return planes


def _wave(paths: Paths, row: int, name: np.uint64, start: FloatArray, beam: Beam, ccd: CCD) -> Wave:
    """The plane wave that a ray belongs to: what its reflections make of a step across the beam."""
    assert paths.surface is not None
    assert paths.triangle is not None
    assert paths.points is not None
    u, v, n = frame(beam.direction, beam.up, "Beam")
    across = np.stack([u * beam.size[0] / beam.shape[1], v * beam.size[1] / beam.shape[0]], axis=1)
    direction = n
    bounces = int(paths.bounces[row])
    points = paths.points[row]
    for bounce in range(bounces):
        mesh = paths.scene.surfaces[paths.surface[row, bounce]].mesh
        a, b, c = mesh.vertices[mesh.faces[paths.triangle[row, bounce]]]
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        onward = paths.direction[row]
        if bounce + 1 < bounces:
            onward = points[bounce + 2] - points[bounce + 1]
            onward = onward / np.linalg.norm(onward)
        turned = direction - 2.0 * (direction @ normal) * normal
        if np.linalg.norm(onward - turned) < np.linalg.norm(onward - direction):
            direction = turned
            across = across - 2.0 * np.outer(normal, normal @ across)
    right, up, facing = frame(ccd.normal, ccd.up, "CCD")
    # along the rays into the plane of focus
    across = across - np.outer(direction, (facing @ across) / (facing @ direction))
    _, point, length = landed(paths.where(np.array([row])), ccd)
    axes = np.stack([right, up]) / ccd.pitch
    matrix = axes @ across
    spread = abs(float(np.linalg.det(matrix)))
    size = np.sqrt(beam.area / ccd.pitch**2 / spread) if spread > 0.0 else 0.0
    return Wave(
        name=name,
        key=int(paths.key[row]),
        origin=axes @ (point[0] - ccd.centre) + 0.5 * np.array(ccd.shape[::-1]),
        matrix=matrix,
        start=start,
        path=float(length[0]),
        gradient=np.array([direction @ right, direction @ up]) * ccd.pitch,
        amplitude=complex(paths.amplitude[row]) * size,
        reflections=int(paths.reflections[row]),
    )


def _crossings(probe: Probe, bright: FloatArray, dark: FloatArray, names: Array, size: float) -> FloatArray:
    """Where between lit and dark points (n, 2), a side apart, the light ends: by halving."""
    # neighbouring cells of a wave share their side
    bits = np.column_stack([np.column_stack([bright, dark]).view(np.int64), names.view(np.int64)])
    _, first, again = np.unique(bits, axis=0, return_index=True, return_inverse=True)
    bright, dark, names = bright[first], dark[first], names[first]
    for _ in range(HALVINGS + round(np.log2(size))):
        middle = 0.5 * (bright + dark)
        lit = probe.lit(middle, names)[:, None]
        bright, dark = np.where(lit, middle, bright), np.where(lit, dark, middle)
    return np.asarray(0.5 * (bright + dark)[again.ravel()], dtype=np.float64)


def _chords(probe: Probe, low: FloatArray, size: float, lit: Array, names: Array) -> tuple[FloatArray, Array]:
    """Chords (n, 2, 2) across cells that an edge crosses once, lit to their left; and which are edges."""
    sides = lit != np.roll(lit, -1, axis=1)
    first, second = np.argmax(sides, axis=1), 3 - np.argmax(sides[:, ::-1], axis=1)
    rows = np.arange(len(low))
    side = np.stack([first, second], axis=1)
    a, b = (low[:, None] + size * CORNERS[(side + step) % 4] for step in (0, 1))
    from_a = lit[rows[:, None], side][..., None]
    bright, dark = (np.where(from_a, x, y).reshape(-1, 2) for x, y in ((a, b), (b, a)))
    chord = _crossings(probe, bright, dark, np.repeat(names, 2), size).reshape(-1, 2, 2)
    # corners go counter-clockwise: those from `first` + 1 to `second` lie right of the chord
    right = lit[rows, (first + 1) % 4]
    chord[right] = chord[right, ::-1]
    along = chord[:, 1] - chord[:, 0]
    length = np.linalg.norm(along, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        left = np.stack([-along[:, 1], along[:, 0]], axis=1) / length[:, None]
        left *= (STRAIGHT * size + np.abs(left) @ probe.fuzz)[:, None]
    straight = np.ones(len(low), dtype=np.bool_)
    look = np.flatnonzero(length > SHORT * size)
    for f in ALONG:
        point = chord[look, 0] + f * along[look]
        straight[look] &= probe.lit(point + left[look], names[look])
        straight[look] &= ~probe.lit(point - left[look], names[look])
    return chord, straight


@dataclass(frozen=True, eq=False)
class Pieces:
    """Parts of cells of the beam's grid: wave, cell, place, size, and the chord (NaN: all lit)."""

    wave: npt.NDArray[np.int64]
    cell: npt.NDArray[np.int64]
    low: FloatArray
    size: FloatArray
    chord: FloatArray


def _pieces(probe: Probe, names: Array, wave: Array, cell: Array, lit: Array) -> Pieces:
    """Cells cut along the chords between lit and dark corners; quartered where no single chord will do."""
    columns = probe.beam.shape[1]
    low = np.stack([cell % columns, cell // columns], axis=1).astype(np.float64)
    done: list[tuple[Array, Array, FloatArray, FloatArray, FloatArray]] = []
    for depth in range(DEPTH + 1):
        size = 0.5**depth
        crossed = (lit != np.roll(lit, -1, axis=1)).sum(axis=1)
        once = np.flatnonzero(crossed == 2)
        chord, straight = _chords(probe, low[once], size, lit[once], names[wave[once]])
        if depth == DEPTH:
            straight[:] = True
        good = once[straight]
        done.append((wave[good], cell[good], low[good], np.full(len(good), size), chord[straight]))
        rest = crossed == 4
        rest[once[~straight]] = True
        # a corner may poke into a cell next to one with all its own corners dark, or lit
        rest |= (crossed == 0) & _beside(wave, low / size, rest)
        full = np.flatnonzero((crossed == 0) & lit[:, 0] & (~rest | (depth == DEPTH)))
        blank = np.full((len(full), 2, 2), np.nan)
        done.append((wave[full], cell[full], low[full], np.full(len(full), size), blank))
        if depth == DEPTH or not rest.any():
            break
        wave, cell, low, lit = _quarters(probe, names, wave[rest], cell[rest], low[rest], size, lit[rest])
    return Pieces(*(np.concatenate(column) for column in zip(*done, strict=True)))


def _beside(wave: Array, at: FloatArray, chosen: Array) -> npt.NDArray[np.bool_]:
    """Cells of a wave (at whole coordinates) that touch a chosen one."""
    column, row = np.rint(at).astype(np.int64).T
    stride, tall = column.max(initial=0) + 3, row.max(initial=0) + 3
    number = (wave * tall + row + 1) * stride + column + 1
    steps = np.array([i * stride + j for i in (-1, 0, 1) for j in (-1, 0, 1)])
    return np.isin(number, (number[chosen][:, None] + steps).ravel())


def _quarters(
    probe: Probe, names: Array, wave: Array, cell: Array, low: FloatArray, size: float, lit: Array
) -> tuple[Array, Array, FloatArray, Array]:
    """Four quarters of cells, with which of their corners are lit."""
    nodes = np.zeros((len(low), 3, 3), dtype=np.bool_)  # [row, column]
    nodes[:, 0, 0], nodes[:, 0, 2], nodes[:, 2, 2], nodes[:, 2, 0] = lit.T
    new = np.array([(1, 0), (0, 1), (1, 1), (2, 1), (1, 2)])  # column, row
    at = (low[:, None] + 0.5 * size * new).reshape(-1, 2)
    nodes[:, new[:, 1], new[:, 0]] = probe.lit(at, np.repeat(names[wave], len(new))).reshape(-1, len(new))
    corner = [np.stack([nodes[:, j, i], nodes[:, j, i + 1], nodes[:, j + 1, i + 1], nodes[:, j + 1, i]], 1)
              for j in (0, 1) for i in (0, 1)]  # fmt: skip
    place = [low + 0.5 * size * np.array((i, j)) for j in (0, 1) for i in (0, 1)]
    return np.tile(wave, 4), np.tile(cell, 4), np.concatenate(place), np.concatenate(corner)


def _widened(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """A mask and all its neighbours."""
    rows, columns = mask.shape
    wide = np.pad(mask, 1)
    window = range(3)
    return np.asarray(np.any([wide[i : i + rows, j : j + columns] for i in window for j in window], axis=0))


def _near(wave: Wave, row: Array, column: Array, ccd: CCD) -> npt.NDArray[np.bool_]:
    """Cells of the beam's grid whose light may fall on the CCD."""
    at = np.stack([column, row], axis=-1)[:, None] + CORNERS
    x, y = np.moveaxis(wave.to_pixels(at), -1, 0)
    rows, columns = ccd.shape
    across = (x.max(axis=1) > 0) & (x.min(axis=1) < columns)
    return np.asarray(across & (y.max(axis=1) > 0) & (y.min(axis=1) < rows))


def waves(paths: Paths) -> Iterator[tuple[Wave, Region]]:
    """Plane waves on a CCD off the facets of a scene, and the regions of the beam they come from.

    Rays are traced anew: from the nodes of the beam's grid, and along the sides of cells where the
    corners disagree. Facets that no node of the grid lights are not seen.

    Parameters
    ----------
    paths : Paths
        Of a `Beam` onto a CCD; sequences of surfaces that are missing here are left out.

    Yields
    ------
    Wave, Region
    """
    ccd, beam = checked(paths)
    rows, _, _ = landed(paths, ccd)
    keys, bounces = np.unique(paths.key[rows]), int(paths.bounces[rows].max(initial=0))
    probe = Probe(paths.scene, beam, ccd, coplanar(paths.scene), keys, bounces)
    tall, wide = beam.shape[0] + 1, beam.shape[1] + 1
    nodes = np.stack([np.tile(np.arange(wide), tall), np.repeat(np.arange(tall), wide)], 1).astype(np.float64)
    traced, rows, found = probe.paths(nodes)
    names, first = np.unique(found, return_index=True)
    limits = RIM, np.array(beam.shape[::-1]) - RIM
    starts = np.clip(nodes[traced.ray[rows[first]]], *limits)
    all_waves = [
        _wave(traced, int(rows[at]), name, start, beam, ccd)
        for at, name, start in zip(first, names, starts, strict=True)
    ]
    order = np.argsort(found, kind="stable")
    groups = np.split(traced.ray[rows][order], np.searchsorted(found[order], names)[1:])
    number, cell, lit = [], [], []
    for index, (wave, ray) in enumerate(zip(all_waves, groups, strict=True)):
        if wave.amplitude == 0:
            continue
        grid = np.zeros((tall, wide), dtype=np.bool_)
        grid.ravel()[ray] = True
        corners = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=-1)
        row, column = np.nonzero(_widened(np.asarray(corners.any(axis=-1))))
        near = _near(wave, row, column, ccd)
        row, column = row[near], column[near]
        number.append(np.full(len(row), index))
        cell.append(row * beam.shape[1] + column)
        lit.append(corners[row, column])
    if not number:
        return
    pieces = _pieces(probe, names, np.concatenate(number), np.concatenate(cell), np.concatenate(lit))
    order = np.lexsort((pieces.cell, pieces.wave))
    cuts = np.searchsorted(pieces.wave[order], np.arange(len(all_waves) + 1))
    for index, wave in enumerate(all_waves):
        mine = order[cuts[index] : cuts[index + 1]]
        if len(mine):
            yield wave, _region(pieces, mine, beam)


def _region(pieces: Pieces, mine: Array, beam: Beam) -> Region:
    """The region of one wave, from its pieces in the order of their cells."""
    row, column = np.divmod(pieces.cell[mine], beam.shape[1])
    low_s, low_t = int(column.min()), int(row.min())
    shape = int(row.max()) + 1 - low_t, int(column.max()) + 1 - low_s
    local = (row - low_t) * shape[1] + column - low_s
    whole = (pieces.size[mine] == 1.0) & np.isnan(pieces.chord[mine, 0, 0])
    kind = np.zeros(shape, dtype=np.int64)
    kind.ravel()[local] = np.where(whole, 1, 2)
    begin = np.searchsorted(local, np.arange(shape[0] * shape[1] + 1)).astype(np.int64)
    chord = pieces.chord[mine]
    a, b = chord[:, 0, 1] - chord[:, 1, 1], chord[:, 1, 0] - chord[:, 0, 0]
    c = a * chord[:, 0, 0] + b * chord[:, 0, 1]
    line = np.where(np.isnan(c)[:, None], (0.0, 0.0, -1.0), np.stack([a, b, c], axis=1))
    table = np.column_stack([pieces.low[mine], pieces.size[mine], line])
    tall, wide = beam.shape
    rim = []
    for at_rim, ends in (
        (column.min() == 0, ((0, 0), (0, tall))), (column.max() == wide - 1, ((wide, 0), (wide, tall))),
        (row.min() == 0, ((0, 0), (wide, 0))), (row.max() == tall - 1, ((0, tall), (wide, tall))),
    ):  # fmt: skip
        if at_rim:
            rim.append(ends)
    segments = np.concatenate([chord[~np.isnan(c)], np.array(rim, dtype=np.float64).reshape(-1, 2, 2)])
    return Region((low_s, low_t), kind, begin, table, segments)


def _profile(beam: Beam, wave: Wave, points: Samples) -> ComplexArray:
    """The beam's profile where the light of sample points starts."""
    if beam.profile is None:
        return np.array([wave.amplitude])
    at = np.stack([points.x, points.y], axis=1) - wave.origin
    column, row = (at @ np.linalg.inv(wave.matrix).T + wave.start).T
    x = (column / beam.shape[1] - 0.5) * beam.size[0]
    y = (row / beam.shape[0] - 0.5) * beam.size[1]
    return np.asarray(wave.amplitude * beam.profile(x, y), dtype=np.complex128)


def _window(wave: Wave, region: Region, points: Samples) -> npt.NDArray[np.int64]:
    """Pixels of a band that a wave may reach: first and last row, first and last column."""
    tall, wide = region.kind.shape
    at = wave.to_pixels(np.array(region.low) + CORNERS * (wide, tall))
    (left, low), (right, high) = np.floor(at.min(axis=0)), np.floor(at.max(axis=0)) + 1
    rows = (len(points.first) - 1) // points.columns
    window = np.array([low - points.top, high - points.top, left, right])
    limits = [rows, rows, points.columns, points.columns]
    return np.asarray(np.clip(window, 0, limits), dtype=np.int64)


def fields(
    paths: Paths, wavelength: float, groups: npt.NDArray[np.int64], *, carrier: bool, half_wave_loss: bool
) -> tuple[ComplexArray, ComplexArray]:
    """Means over each pixel of the fields of groups, exact off flat facets but for the quadrature.

    Parameters
    ----------
    paths : Paths
        Of a `Beam`, onto a CCD; see `waves`.
    wavelength, groups, carrier, half_wave_loss
        As in `sheets.fields`.

    Returns
    -------
    mean : (groups, rows, columns) complex128
    mutual : (groups, groups, rows, columns) complex128

    Raises
    ------
    ValueError
        If the source is no beam, or there is no CCD, or the wavelength is none.
    """
    ccd, beam = checked(paths)
    period = checked_wavelength(wavelength)
    _, first = np.unique(paths.key, return_index=True)
    member = dict(zip(paths.key[first].tolist(), groups[first].tolist(), strict=True))
    parts = [
        (
            wave if half_wave_loss else replace(wave, amplitude=wave.amplitude * (-1) ** wave.reflections),
            region,
        )
        for wave, region in waves(paths)
    ]
    count = int(groups.max(initial=0)) + 1

    def light(points: Samples, slope: FloatArray) -> ComplexArray:
        from fringetrace import raster

        field = points.blank(count)
        for wave, region in parts:
            window = _window(wave, region, points)
            if window[0] < window[1] and window[2] < window[3]:
                back = wave.matrix @ wave.start  # to the corner of the beam's grid
                raster.spread_flat(
                    np.linalg.inv(wave.matrix), wave.origin - back, wave.path - wave.gradient @ back,
                    wave.gradient, _profile(beam, wave, points), region.kind, *region.low, region.begin,
                    region.pieces, period, points.first, points.x, points.y, points.where_x, points.where_y,
                    points.columns, field[member[wave.key]], slope, window,
                )  # fmt: skip
        return field

    drawn = [wave.to_pixels(region.segments).reshape(-1, 4) for wave, region in parts]
    cuts = edges(np.concatenate([np.empty((0, 4)), *drawn]), ccd.shape)
    return averaged(ccd.shape, light, period, carrier, cuts)
