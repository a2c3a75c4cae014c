"""Beam tracing against rays: each ray that reaches the CCD lies in one footprint of its way."""

from dataclasses import replace

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, um
from fringetrace.field.beam_tables import DERIVATIVES, GRADIENT, PATH, S, T, X, Y
from fringetrace.field.beam_tracing import SLIVER, follow_beam
from fringetrace.geometry import shapes

# Rays may lie on either side of an edge that is nearer than this (pixels).
EDGE = 1e-6
# Paths of some 0.1 m agree to a rounding of each of a dozen steps (metres).
STEPS = 12 * 0.1 * 2.0**-52


def relief(seed, height, holes=False, solid=False):
    """A rough height field of 4 mm, with holes, or closed below."""
    rng = np.random.default_rng(seed)
    mesh = shapes.height_map(height * rng.uniform(-1.0, 0.0, (9, 9)), 0.5 * mm)
    faces = mesh.faces
    if holes:
        faces = faces[rng.uniform(size=len(faces)) > 0.2]
    if solid:
        faces = np.concatenate([faces, shapes.plate(4 * mm, 4 * mm).faces[:, ::-1] + len(mesh.vertices)])
        low = shapes.plate(4 * mm, 4 * mm).moved((0, 0, -2 * height)).vertices
        return ft.Mesh(np.concatenate([mesh.vertices, low]), faces)
    return ft.Mesh(mesh.vertices, faces)


def bench(mesh, rays=61, **more):
    bench = ft.instruments.michelson(
        mesh, aperture=4.2 * mm, reference_tilt=(1e-4, 2e-4), pixels=(32, 32), **more
    )
    return bench, replace(bench.beam, shape=(rays, rays))


SCENES = {
    "gentle": lambda seed: relief(seed, 1 * um),
    "steep": lambda seed: relief(seed, 0.4 * mm),
    "holes over a floor": lambda seed: relief(seed, 0.2 * mm, holes=True, solid=True),
    "balls": lambda seed: shapes.icosphere((0.5 + 0.1 * seed) * mm, 1),
    "crossing": lambda seed: crossing(relief(seed, 0.1 * mm), relief(seed + 9, 0.1 * mm)),
}


def crossing(one, other):
    """Two meshes through each other."""
    faces = np.concatenate([one.faces, other.faces + len(one.vertices)])
    return ft.Mesh(np.concatenate([one.vertices, other.vertices]), faces)


def containing(prints, number, at):
    """How far inside a footprint a point lies, in pixels; negative outside."""
    corners = prints.corners[prints.first[number] : prints.first[number + 1]]
    side = np.roll(corners, -1, axis=0) - corners
    across = side[:, 0] * (at[1] - corners[:, 1]) - side[:, 1] * (at[0] - corners[:, 0])
    turn = np.sign((side[:, 0] * np.roll(side[:, 1], -1) - side[:, 1] * np.roll(side[:, 0], -1)).sum())
    length = np.linalg.norm(side, axis=1)
    return (turn * across[length > 0.0] / length[length > 0.0]).min()


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", SCENES)
def test_each_ray_lies_in_one_footprint_of_its_way(name, seed):
    made, beam = bench(SCENES[name](seed))
    paths = ft.trace(made.scene, beam, made.ccd).detected
    prints = follow_beam(made.scene, beam, made.ccd, 12, 1e-6)
    row, column = np.divmod(paths.ray, beam.shape[1])
    s = ((column + 0.5) / beam.shape[1] - 0.5) * beam.size[0]
    t = ((row + 0.5) / beam.shape[0] - 0.5) * beam.size[1]
    rows = np.random.default_rng(seed).choice(len(paths), min(len(paths), 400), replace=False)
    for i in rows:
        at = paths.pixel[i, ::-1]
        off = at - prints.wave[:, [X, Y]]
        place = prints.wave[:, [S, T]] + np.stack(
            [
                (prints.wave[:, DERIVATIVES + 2 * k : DERIVATIVES + 2 * k + 2] * off).sum(axis=1)
                for k in (0, 1)
            ],
            axis=1,
        )
        same = np.abs(place - (s[i], t[i])).max(axis=1) < EDGE * made.ccd.pitch
        mine = np.flatnonzero(same & (prints.key == paths.key[i]))
        depth = np.array([containing(prints, n, at) for n in mine])
        assert (depth > -EDGE).any()
        assert (depth > EDGE).sum() <= 1
        n = mine[np.argmax(depth)]
        path = prints.wave[n, PATH] + prints.wave[n, GRADIENT : GRADIENT + 2] @ off[n]
        assert abs(path - paths.length[i]) < STEPS + EDGE * made.ccd.pitch


@pytest.mark.parametrize("name", SCENES)
def test_power_is_where_rays_say_it_is(name):
    made, beam = bench(SCENES[name](3), rays=251)
    ledger = ft.trace(made.scene, beam, made.ccd).ledger()
    prints = follow_beam(made.scene, beam, made.ccd, 12, 1e-6)
    total = prints.detected + prints.left + prints.absorbed + prints.truncated
    incident = beam.size[0] * beam.size[1]
    assert total == pytest.approx(incident, rel=1e-12)
    assert prints.dropped < 100.0 * SLIVER * incident
    # of 63,001 rays some thousand pass an edge of facets, and count whole or not at all
    for item in ("detected", "left"):
        assert getattr(prints, item) == pytest.approx(getattr(ledger, item), abs=2e-3 * incident)


def test_footprints_are_the_same_bits_for_any_number_of_threads(monkeypatch):
    made, beam = bench(relief(4, 0.1 * mm))
    tables = []
    for threads in (1, 3):
        monkeypatch.setattr("os.cpu_count", lambda threads=threads: threads)
        tables.append(follow_beam(made.scene, beam, made.ccd, 12, 1e-6))
    assert tables[0].corners.tobytes() == tables[1].corners.tobytes()
    assert tables[0].wave.tobytes() == tables[1].wave.tobytes()


def test_a_face_that_is_there_twice_is_met_once():
    single = relief(5, 0.1 * mm)
    doubled = ft.Mesh(single.vertices, np.concatenate([single.faces, single.faces[:, ::-1]]))
    powers = []
    for mesh in (single, doubled):
        made, beam = bench(mesh)
        prints = follow_beam(made.scene, beam, made.ccd, 12, 1e-6)
        powers.append((prints.detected, prints.left, prints.truncated))
    assert powers[1] == pytest.approx(powers[0], abs=SLIVER * beam.size[0] * beam.size[1])
