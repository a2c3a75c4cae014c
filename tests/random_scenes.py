"""Scenes at random of what touches, nests, nearly touches, at any size and place, and an oracle for paths.

The oracle shares no code with the engine. It looks at recorded paths: no segment may cross a face, each hit
lies on its face, and where faces lie at one place a path crosses each that lets light through as often as it
has to, once, or twice where it is sent back. By brute force over all faces, in coordinates about the scene.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

import fringetrace as ft
from fringetrace import Fate
from fringetrace.core.vectors import rotation
from fringetrace.geometry import forms, shapes

EPS = float(np.finfo(np.float64).eps)
# Points are where they should be within so many roundings of the coordinates, faces are crossed or not
# where they are farther than that.
ROUNDINGS = 400.0
# Float32 may take a ray past a silhouette as near as this, relative to the scene: one that leaves a face
# flatly starts so far above it.
GRAZE = 2.0**-20
# A ray runs along a face if it does so to this cosine.
FLAT = 1e-4
PASS, BACK = ft.BeamSplitter(0.0, 1.0), ft.Mirror()
GLASS = ft.Dielectric("transmitted")


@dataclass
class Part:
    """A mesh before it is put in its place; a sphere where it has a form."""

    mesh: ft.Mesh
    interface: object = PASS
    front: float | None = None
    back: float | None = None
    sphere: tuple[tuple[float, float, float], float] | None = None


@dataclass
class Case:
    """A scene, rays, and what the oracle has to know of it; `media`: they fit together everywhere."""

    name: str
    scene: ft.Scene
    rays: ft.Rays
    spheres: dict[int, tuple[np.ndarray, float]]
    size: float
    media: bool
    depth: int
    faults: list[str] = field(default_factory=list)


def merged(*meshes):
    """Several meshes as one, none welded to another."""
    shift = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])[:-1]
    return ft.Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, shift, strict=True)]),
    )


def block(low, high):
    """A box between two corners."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    width, depth, height = high - low
    middle = 0.5 * (low + high)
    return shapes.plate(width, depth, height).moved((middle[0], middle[1], high[2]))


def inverted(mesh):
    return ft.Mesh(mesh.vertices, mesh.faces[:, ::-1])


def gap_of(rng):
    """None, or one from 1e-13 to 1e-2."""
    return 0.0 if rng.uniform() < 0.5 else float(10.0 ** rng.uniform(-13, -2))


def index_of(rng):
    return float(rng.choice([1.3, 1.5, 1.5, 1.9]))


def pile(rng):
    """Plates of glass, one on the other, shifted aside, as surfaces of their own."""
    z, parts = 0.0, []
    for _ in range(rng.integers(2, 5)):
        thick, aside = rng.uniform(0.05, 0.3), rng.uniform(-0.4, 0.4, 2) * rng.integers(0, 2)
        mesh = block((aside[0] - 0.5, aside[1] - 0.5, z), (aside[0] + 0.5, aside[1] + 0.5, z + thick))
        parts.append(Part(mesh, GLASS, back=index_of(rng)))
        z += thick + gap_of(rng)
    return parts, True


def pile_in_one_mesh(rng):
    parts, _ = pile(rng)
    return [Part(merged(*(part.mesh for part in parts)), GLASS, back=1.5)], True


def cemented(rng):
    """Open faces between media, all at one place or one behind the other."""
    indices = [1.0, *(index_of(rng) for _ in range(rng.integers(1, 4)))]
    z, parts = 0.0, []
    for front, back in pairwise(indices):
        parts.append(Part(shapes.plate(1.0, 1.0).moved((0, 0, z)), GLASS, front=front, back=back))
        z -= gap_of(rng)
    order = rng.permutation(len(parts))
    return [parts[k] for k in order], True


def stops(rng):
    """Windows of no thickness in the planes of the faces of a plate, partly over them."""
    parts = [Part(block((-0.5, -0.5, -0.2), (0.5, 0.5, 0.0)), GLASS, back=index_of(rng))]
    for _ in range(rng.integers(1, 4)):
        size, aside = rng.uniform(0.2, 1.5), rng.uniform(-0.5, 0.5, 2)
        place = (*aside, float(rng.choice([0.0, -0.2])))
        parts.append(Part(shapes.plate(size, size).moved(place)))
    return [parts[k] for k in rng.permutation(len(parts))], True


def on_a_mirror(rng):
    """A plate of glass, a window or both that lie on a mirror, sheet or solid."""
    mirror = shapes.plate(1.2, 1.2) if rng.uniform() < 0.5 else block((-0.6, -0.6, -0.3), (0.6, 0.6, 0.0))
    parts = [Part(mirror, BACK)]
    gap = gap_of(rng)
    if rng.uniform() < 0.7:
        parts.append(Part(block((-0.5, -0.5, gap), (0.5, 0.5, gap + 0.2)), GLASS, back=index_of(rng)))
    if rng.uniform() < 0.7:
        parts.append(Part(shapes.plate(0.7, 0.7)))
    return [parts[k] for k in rng.permutation(len(parts))], True


def windows(rng):
    """Sheets at one place, turned in their plane, wound either way; some in one mesh."""
    parts = []
    for _ in range(rng.integers(2, 6)):
        mesh = shapes.plate(*rng.uniform(0.4, 1.0, 2)).moved(turn=rotation((0, 0, 1), rng.uniform(0, 6)))
        parts.append(Part(inverted(mesh) if rng.uniform() < 0.5 else mesh))
    return parts, True


def doubled(rng):
    """A sheet or plate whose faces are there twice, or in both windings."""
    mesh = shapes.plate(1.0, 1.0)
    faces = mesh.faces[:, ::-1] if rng.uniform() < 0.5 else mesh.faces
    twice = ft.Mesh(mesh.vertices, np.concatenate([mesh.faces, faces]))
    if rng.uniform() < 0.5:
        twice = ft.Mesh(twice.vertices[twice.faces].reshape(-1, 3), np.arange(12).reshape(-1, 3))
    return [Part(twice, BACK if rng.uniform() < 0.5 else PASS)], True


def close_sheets(rng):
    """Sheets of one mesh that nearly touch, or do, open, with a fine one among them."""
    z, meshes = 0.0, []
    for _ in range(rng.integers(2, 5)):
        flat = shapes.plate(1.0, 1.0)
        fine = shapes.height_map(np.zeros((6, 6)), 0.2)
        meshes.append((flat if rng.uniform() < 0.5 else fine).moved((0, 0, z)))
        z -= float(10.0 ** rng.uniform(-12, -1))
    return [Part(merged(*meshes))], True


def bumpy_sheets(rng):
    """Rough open sheets, one behind the other, in one mesh."""
    meshes = [
        shapes.height_map(0.01 * rng.uniform(size=(7, 7)), 0.15).moved((0, 0, -0.05 * k)) for k in range(3)
    ]
    return [Part(merged(*meshes))], True


def ball_on_floor(rng):
    """A ball that stands on a block by a vertex, in one mesh or in two."""
    ball = shapes.icosphere(0.4, 2)
    ball = ball.moved((0, 0, -ball.vertices[:, 2].min() + gap_of(rng)))
    floor = block((-0.6, -0.6, -0.2), (0.6, 0.6, 0.0))
    if rng.uniform() < 0.5:
        return [Part(merged(ball, floor))], True
    return [Part(ball), Part(floor)], True


def t_junction(rng):
    """A plate in strips whose seams have vertices on one side only: one mesh, or a surface each."""
    count = int(rng.integers(2, 6))
    left = ft.Mesh([(-0.5, -0.5, 0), (0, -0.5, 0), (0, 0.5, 0), (-0.5, 0.5, 0)], [(0, 1, 2), (0, 2, 3)])
    y = np.sort(np.concatenate([[-0.5, 0.5], rng.uniform(-0.5, 0.5, count)]))
    strips = [
        ft.Mesh([(0, a, 0), (0.5, a, 0), (0.5, b, 0), (0, b, 0)], [(0, 1, 2), (0, 2, 3)])
        for a, b in pairwise(y)
    ]
    if rng.uniform() < 0.5:
        return [Part(merged(left, *strips), BACK)], True
    return [Part(mesh, BACK) for mesh in (left, *strips)], True


def shells(rng):
    """Balls of glass in one another, of facets or with forms, with gaps between them down to none."""
    form, radius, parts, outside = rng.uniform() < 0.6, 0.5, [], None
    for _ in range(rng.integers(2, 4)):
        inside = index_of(rng)
        sphere = ((0.0, 0.0, 0.0), radius) if form else None
        parts.append(Part(shapes.icosphere(radius, 2), GLASS, outside, inside, sphere))
        outside = inside
        radius -= gap_of(rng)
    return parts, True


def nested(rng):
    """A box of glass in another of another, flush with some of its sides."""
    low, high = rng.uniform(-0.4, -0.1, 3), rng.uniform(0.1, 0.4, 3)
    low[rng.uniform(size=3) < 0.4] = -0.5
    high[rng.uniform(size=3) < 0.4] = 0.5
    inner, outer = block(low, high), block((-0.5,) * 3, (0.5,) * 3)
    parts = [Part(outer, GLASS, back=1.5), Part(inner, GLASS, front=1.5, back=1.9)]
    return parts[:: int(rng.choice([1, -1]))], True


def crossed(rng):
    """Windows that run through each other, and rays through the line where they meet."""
    parts = []
    for _ in range(rng.integers(2, 5)):
        turn = rotation((0, 0, 1), rng.uniform(0, 3)) @ rotation((1, 0, 0), 0.5 * np.pi)
        parts.append(Part(shapes.plate(1.0, 1.0).moved(turn=turn)))
    return parts, True


KINDS: dict[str, Callable] = {
    "pile": pile,
    "pile in one mesh": pile_in_one_mesh,
    "cemented": cemented,
    "stops": stops,
    "on a mirror": on_a_mirror,
    "windows": windows,
    "doubled": doubled,
    "close sheets": close_sheets,
    "bumpy sheets": bumpy_sheets,
    "ball on floor": ball_on_floor,
    "T-junction": t_junction,
    "shells": shells,
    "nested": nested,
    "crossed": crossed,
}


def aims(rng, parts, count):
    """Points that rays are aimed at: anywhere, on faces, on edges, at vertices."""
    corners = np.concatenate([part.mesh.vertices[part.mesh.faces] for part in parts])
    some = corners[rng.integers(len(corners), size=count)]
    weight = rng.dirichlet((1, 1, 1), count)
    kind = rng.integers(4, size=count)
    weight[kind == 1, 2] = 0.0
    weight[kind == 2] = np.eye(3)[rng.integers(3, size=(kind == 2).sum())]
    weight /= weight.sum(axis=1, keepdims=True)
    target = np.einsum("nk,nkj->nj", weight, some)
    target[kind == 3] = rng.uniform(-0.5, 0.5, ((kind == 3).sum(), 3))
    return target


def case(seed: int, count: int = 1000, kind: str | None = None) -> Case:
    """A scene of a kind at random, and `count` rays."""
    rng = np.random.default_rng(seed)
    kind = kind or list(KINDS)[seed % len(KINDS)]
    parts, media = KINDS[kind](rng)
    size = float(10.0 ** rng.uniform(-9, 6))
    turn = np.eye(3) if rng.uniform() < 0.4 else rotation(rng.normal(size=3), rng.uniform(0, 6))
    offset = np.zeros(3)
    if rng.uniform() < 0.5:
        offset = rng.uniform(-1, 1, 3) * size * 10.0 ** rng.uniform(0, 8.3)
    surfaces, spheres = [], {}
    for k, part in enumerate(parts):
        mesh = ft.Mesh(part.mesh.vertices @ turn.T * size + offset, part.mesh.faces)
        form = None
        if part.sphere is not None:
            centre, radius = turn @ part.sphere[0] * size + offset, part.sphere[1] * size
            form, spheres[k] = forms.Sphere(centre, radius), (centre, radius)
        surfaces.append(
            ft.Surface(mesh, part.interface, f"{kind} {k}", form, front=part.front, back=part.back)
        )
    direction = rng.normal(size=(count, 3)) * [1, 1, 1 + 2 * rng.integers(2)]
    if rng.uniform() < 0.3:
        direction[:] = [0.0, 0.0, -1.0]
    if kind == "cemented":  # behind it is no vacuum, in which light starts
        direction[:, 2] = -np.abs(direction[:, 2])
    direction = direction @ turn.T
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    far = 2.0 if rng.uniform() < 0.5 else 10.0 ** rng.uniform(0.3, 9)
    target = aims(rng, parts, count) @ turn.T * size + offset
    rays = ft.Rays(target - far * size * direction, direction)
    depth = 60 if all(part.interface is not BACK for part in parts) else 12
    return Case(f"{kind} (seed {seed})", ft.Scene(surfaces), rays, spheres, size, media, depth)


@dataclass
class _Faces:
    """All faces of a scene, about an origin near it: corners, unit normals, inward normals of their edges."""

    corners: np.ndarray
    normal: np.ndarray
    inward: np.ndarray
    owner: np.ndarray
    first: np.ndarray
    formed: np.ndarray

    def heights(self, point):
        """(n, t) of points over the planes, and (n, t) how far inside the nearest edge they are."""
        step = point[:, None] - self.corners[None, :, 0]
        height = np.einsum("ntj,tj->nt", step, self.normal)
        inside = np.full(height.shape, np.inf)
        for k in range(3):
            step = point[:, None] - self.corners[None, :, k]
            inside = np.minimum(inside, np.einsum("ntj,tj->nt", step, self.inward[:, k]))
        return height, inside


def faces_of(case: Case, centre) -> _Faces:
    meshes = [surface.mesh for surface in case.scene.surfaces]
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in meshes]) - centre
    sides = np.roll(corners, -1, axis=1) - corners
    longest = np.argmax((sides**2).sum(axis=2), axis=1)
    each = np.arange(len(sides))
    normal = np.cross(sides[each, (longest + 1) % 3], sides[each, (longest + 2) % 3])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inward = np.cross(normal[:, None], sides)
    inward /= np.linalg.norm(inward, axis=2, keepdims=True)
    counts = [len(mesh.faces) for mesh in meshes]
    owner = np.repeat(np.arange(len(meshes)), counts)
    first = np.cumsum([0, *counts])[:-1]
    return _Faces(corners, normal, inward, owner, first, np.isin(owner, list(case.spheres)))


def judge(case: Case, paths: ft.Paths) -> list[str]:
    """What is wrong with recorded paths of a case: a line for each kind of fault, and how often."""
    centre = np.mean([surface.mesh.bounds.mean(axis=0) for surface in case.scene.surfaces], axis=0)
    faces = faces_of(case, centre)
    # of the coordinates as given, and of those of rays that come from far
    place = EPS * (np.abs(centre).max() + 2.0 * case.size)
    away = EPS * np.abs(paths.source.origin - centre).max(axis=1)
    judged = _Judge(
        case, paths, faces, paths.points - centre, ROUNDINGS * place, ROUNDINGS * place + 8.0 * away
    )
    return judged.all()


class _Judge:
    def __init__(self, case, paths, faces, points, tight, loose):
        self.case, self.paths, self.faces, self.points = case, paths, faces, points
        self.tight, self.loose = tight, loose[paths.ray]
        self.faults: list[str] = []

    def say(self, what, wrong, where):
        if wrong.any():
            rows = np.asarray(where)[wrong]
            self.faults.append(f"{self.case.name}: {what}: {int(wrong.sum())}, first: path {rows[0]}")

    def all(self):
        paths = self.paths
        if self.case.depth > 12:
            self.say("cut off", paths.fate == Fate.TRUNCATED, np.arange(len(paths)))
        if self.case.media and paths.contradictions is not None and paths.contradictions.any():
            self.media()
        if not paths.ledger().error < 1e-9:
            self.faults.append(f"{self.case.name}: ledger {paths.ledger().error:.2g}")
        self.hits()
        self.segments()
        self.places()
        return self.faults

    def media(self):
        """A path comes to boundaries in the medium that is there, unless it met an edge, to rounding."""
        paths, scene = self.paths, self.case.scene
        known = {None: 0}
        table = [
            [
                known.setdefault(None if m is None or m.name == "n=1" else m.name, len(known))
                for m in (s.front, s.back)
            ]
            for s in scene.surfaces
        ]
        sides = np.array(table)
        medium, on_edge = np.zeros(len(paths), int), np.zeros(len(paths), bool)
        direction, wrong = paths.source.direction[paths.ray].copy(), np.zeros(len(paths), bool)
        flattest = np.ones(len(paths))
        for k in range(int(paths.bounces.max(initial=0))):
            rows = np.flatnonzero(paths.bounces > k)
            step = self.points[rows, k + 1] - self.points[rows, k]
            length = np.linalg.norm(step, axis=1)
            if k:
                long = length > 1e3 * self.tight
                direction[rows[long]] = step[long] / length[long, None]
            surface = paths.surface[rows, k]
            face = self.faces.first[surface] + paths.triangle[rows, k]
            normal, corners = self.faces.normal[face], self.faces.corners[face]
            for number, (middle, _) in self.case.spheres.items():
                on = surface == number
                spoke = self.points[rows[on], k + 1] - self.middle(middle)
                normal[on] = spoke / np.linalg.norm(spoke, axis=1, keepdims=True)
            apart = self.points[rows, k + 1][:, None] - corners
            inside = np.einsum("nkj,nkj->nk", apart, self.faces.inward[face]).min(axis=1)
            facing = np.einsum("nj,nj->n", direction[rows], normal)
            flattest[rows] = np.clip(np.abs(facing), FLAT, flattest[rows])
            blur = self.loose[rows] / flattest[rows]  # of the point in the face
            on_edge[rows] |= (inside < 64.0 * self.tight + blur) & ~self.faces.formed[face]
            on_edge[rows] |= np.abs(facing) < 1e-6  # along a wall, to rounding
            silhouette = np.sqrt(64.0 * (self.tight + self.loose[rows]) / self.case.size)
            on_edge[rows] |= (np.abs(facing) < silhouette) & self.faces.formed[face]
            boundary = np.array([s.boundary for s in scene.surfaces])[surface]
            near = np.where(facing < 0.0, sides[surface, 0], sides[surface, 1])
            beyond = np.where(facing < 0.0, sides[surface, 1], sides[surface, 0])
            wrong[rows] |= boundary & (near != medium[rows]) & ~on_edge[rows]
            medium[rows] = np.where(boundary, beyond, medium[rows])
            back = np.array([s.interface is BACK for s in scene.surfaces])[surface]
            direction[rows[back]] -= 2.0 * facing[back, None] * normal[back]
        if all(len(surface.mesh.faces) == 2 for surface in scene.surfaces):  # light gets in from the side
            wrong &= paths.bounces >= len(scene.surfaces)
        for row in np.flatnonzero(wrong):  # past the edge of something that it should have met
            room = 64.0 * self.tight + self.loose[row] / flattest[row]
            height, inside = self.faces.heights(self.points[row, : paths.bounces[row] + 1])
            wrong[row] = not ((np.abs(height) < room) & (np.abs(inside) < room)).any()
        self.say("media contradict", wrong, np.arange(len(paths)))

    def hits(self):
        """Each lies on its face, or its sphere."""
        path, bounce = np.nonzero(self.paths.triangle >= 0)
        surface = self.paths.surface[path, bounce]
        face = self.faces.first[surface] + self.paths.triangle[path, bounce]
        point = self.points[path, bounce + 1]
        corners = self.faces.corners[face]
        height = np.einsum("nj,nj->n", point - corners[:, 0], self.faces.normal[face])
        inside = np.einsum("nkj,nkj->nk", point[:, None] - corners, self.faces.inward[face]).min(axis=1)
        off = (np.abs(height) > self.tight) | (inside < -self.tight - self.loose[path])
        for k, (middle, radius) in self.case.spheres.items():
            on, shift = surface == k, self.middle(middle)
            off[on] = np.abs(np.linalg.norm(point[on] - shift, axis=1) - radius) > self.tight
        self.say("hits off their faces", off, path)

    def middle(self, centre):
        """A sphere's centre in the coordinates of the points."""
        mean = np.mean([surface.mesh.bounds.mean(axis=0) for surface in self.case.scene.surfaces], axis=0)
        return centre - mean

    def ends(self, k):
        """Segments after k bounces: which paths have one, from where to where, and its direction."""
        paths = self.paths
        goes = (paths.bounces > k) | ((paths.bounces == k) & (paths.fate == Fate.LEFT))
        rows = np.flatnonzero(goes)
        start, final = self.points[rows, k], paths.bounces[rows] == k
        end = np.where(
            final[:, None], 0.0, np.nan_to_num(self.points[rows, min(k + 1, self.points.shape[1] - 1)])
        )
        out = 4.0 * self.case.size * paths.direction[rows]
        end = np.where(final[:, None], start + out, end)
        if k == 0:  # from near the scene
            along = paths.source.direction[paths.ray[rows]]
            way = np.einsum("nj,nj->n", end - start, along)
            begin = np.minimum(way, 5.0 * self.case.size)
            missed = final & (np.linalg.norm(start, axis=1) > 4.0 * self.case.size)
            ahead = -np.einsum("nj,nj->n", start, along)
            near = start + (ahead - 3.0 * self.case.size)[:, None] * along
            start = np.where(
                final[:, None], np.where(missed[:, None], near, start), end - begin[:, None] * along
            )
            end = np.where(missed[:, None], start + 6.0 * self.case.size * along, end)
        return rows, start, end

    def segments(self):
        """None crosses a face well inside it."""
        for k in range(int(self.paths.bounces.max(initial=0)) + 1):
            rows, start, end = self.ends(k)
            step = end - start
            length = np.linalg.norm(step, axis=1)
            long = length > 4.0 * self.tight
            rows, start, end, step, length = rows[long], start[long], end[long], step[long], length[long]
            if len(rows) == 0:
                continue
            room = (self.loose[rows] if k == 0 else np.full(len(rows), self.tight))[:, None]
            one, _ = self.faces.heights(start)
            two, _ = self.faces.heights(end)
            with np.errstate(all="ignore"):
                part = one / (one - two)
            through = (np.abs(one) > room) & (np.abs(two) > room) & (one * two < 0.0) & ~self.faces.formed
            ray, face = np.nonzero(through)
            point = start[ray] + part[ray, face, None] * step[ray]
            inside = np.einsum(
                "nkj,nkj->nk", point[:, None] - self.faces.corners[face], self.faces.inward[face]
            ).min(axis=1)
            steep = np.abs(np.einsum("nj,nj->n", step[ray], self.faces.normal[face])) / length[ray]
            grazes = inside * steep < GRAZE * self.case.size
            leak = inside > room[ray, 0] * (1.0 + 2.0 / steep)
            # past a silhouette, as far as float32 can tell, a ray goes in and out
            graze = np.zeros(len(rows))
            sense = np.sign(np.einsum("nj,nj->n", step[ray], self.faces.normal[face]))
            np.add.at(graze, ray[leak], np.where(grazes, sense, np.inf)[leak])
            leak &= (graze[ray] != 0.0) & ~((inside < GRAZE * self.case.size) & (steep < 0.05))
            self.say(f"segments {k} through faces", leak, rows[ray])
            for middle, radius in self.case.spheres.values():
                self.sphere(
                    k, rows, start, step / length[:, None], length, room[:, 0], self.middle(middle), radius
                )

    def sphere(self, k, rows, start, along, length, room, middle, radius):
        half = -np.einsum("nj,nj->n", start - middle, along)
        foot = start + half[:, None] * along - middle
        square = radius**2 - (foot**2).sum(axis=1)
        clear = square > 8.0 * radius * room
        chord = np.sqrt(np.where(clear, square, np.nan))
        steep = chord / radius
        for sign in (-1.0, 1.0):
            way = half + sign * chord
            with np.errstate(invalid="ignore"):
                leak = clear & (way > 4.0 * room / steep) & (way < length - 4.0 * room / steep)
            self.say(f"segments {k} through spheres", leak, rows)

    def places(self):
        """At each place a path crosses all that lets light through there, once, or twice if sent back."""
        paths = self.paths
        step = np.linalg.norm(np.diff(self.points, axis=1), axis=2)
        windows = [s.interface is not BACK for s in self.case.scene.surfaces]
        where: list[tuple[int, int, int]] = []
        for row in range(len(paths)):
            begin = 1
            for k in range(1, int(paths.bounces[row]) + 1):
                if k == paths.bounces[row] or step[row, k] > 4.0 * self.tight:
                    where.append((row, begin, k))
                    begin = k + 1
        if not where:
            return
        row, begin, end = np.array(where).T
        last = end == paths.bounces[row]
        going = np.where(
            last[:, None],
            paths.direction[row],
            self.points[row, np.minimum(end + 1, step.shape[1])] - self.points[row, end],
        )
        coming = np.where(
            (begin == 1)[:, None],
            paths.source.direction[paths.ray[row]],
            self.points[row, begin] - self.points[row, begin - 1],
        )
        ended = last & (paths.fate[row] != Fate.LEFT)
        height, inside = self.faces.heights(self.points[row, begin])
        slope = np.abs(coming @ self.faces.normal.T) / np.linalg.norm(coming, axis=1, keepdims=True)
        blur = self.loose[row][:, None] / np.maximum(slope, FLAT)  # of the first point, in each face
        apart = 64.0 * self.tight + np.where((begin == 1)[:, None], blur, 0.0)
        near = (np.abs(height) <= 5.0 * self.tight) & (inside > -apart) & ~self.faces.formed
        contains = near & (np.abs(height) <= 0.1 * self.tight) & (inside > apart)
        for way in (coming, going):  # what runs along a face need not cross it
            cosine = way @ self.faces.normal.T / np.linalg.norm(way, axis=1, keepdims=True)
            contains &= np.abs(cosine) > FLAT
        wrong = np.zeros(len(row), bool)
        for i in np.flatnonzero(~ended):
            met = self.paths.surface[row[i], begin[i] - 1 : end[i]]
            face = self.faces.first[met] + self.paths.triangle[row[i], begin[i] - 1 : end[i]]
            mirrored = not all(windows[m] for m in met)
            for f in np.flatnonzero(contains[i]):
                normal = self.faces.normal[f]
                # faces of one surface at one place are one, or as many as there are between roundings
                alike = near[i] & (self.faces.owner == self.faces.owner[f])
                most = int((alike & (self.faces.normal @ normal > 1.0 - 1e-6)).sum())
                same = (met == self.faces.owner[f]) & (self.faces.normal[face] @ normal > 1.0 - 1e-6)
                straight = (coming[i] @ normal) * (going[i] @ normal) > 0.0
                if not windows[self.faces.owner[f]]:
                    wrong[i] |= straight
                elif mirrored:
                    wrong[i] |= same.sum() > 2 * most or (most == 1 and same.sum() % 2 != straight)
                else:
                    wrong[i] |= not 1 <= same.sum() <= most or len(set(face[same])) < same.sum()
        self.say("faces at one place not crossed once", wrong, row)


def tried(seed: int, count: int = 1000, kind: str | None = None) -> tuple[Case, ft.Paths, list[str]]:
    """Trace a case and judge it."""
    some = case(seed, count, kind)
    paths = ft.trace(
        some.scene, some.rays, max_bounces=some.depth, min_amplitude=0.0, record=True, threads=1, warn=False
    )
    return some, paths, judge(some, paths)
