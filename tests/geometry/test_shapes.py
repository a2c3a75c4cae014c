import math

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from fringetrace import Mesh, mm, nm, um
from fringetrace.geometry import shapes
from fringetrace.optics.interfaces import reflect

# Areas and volumes are sums over the faces of numbers that are each right to 1e-16.
ROUNDING = 1e-12

finite_or_hole = st.one_of(st.floats(-1, 1, width=32), st.just(math.nan))
open_range = st.floats(0.01, 100)


def solid(mesh: Mesh) -> trimesh.Trimesh:
    """The mesh as trimesh sees it: an independent judge of areas, volumes and closedness."""
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


def normals(mesh: Mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


def is_closed_and_outward(mesh: Mesh) -> bool:
    body = solid(mesh)
    return bool(body.is_watertight and body.is_winding_consistent and body.volume > 0)


# Height maps


def test_a_height_map_stands_where_its_samples_are():
    z = np.arange(12.0).reshape(3, 4)
    mesh = shapes.height_map(z, (2.0, 10.0))
    assert np.array_equal(mesh.vertices[:, 2], z.ravel())
    assert mesh.vertices[:4, 0].tolist() == [-3, -1, 1, 3]
    assert mesh.vertices[::4, 1].tolist() == [-10, 0, 10]
    # cell by cell, two triangles each, both begin at the cell's first sample
    assert mesh.faces[:2].tolist() == [[0, 1, 5], [0, 5, 4]]
    assert mesh.faces[-2:].tolist() == [[6, 7, 11], [6, 11, 10]]
    assert shapes.height_map(z, [2.0, 10.0]).vertices.tolist() == mesh.vertices.tolist()


@settings(max_examples=60, deadline=None)
@given(arrays(np.float64, st.tuples(st.integers(2, 7), st.integers(2, 7)), elements=finite_or_hole))
def test_every_face_looks_up_and_they_cover_the_valid_cells(z):
    valid = ~np.isnan(z)
    corners = valid[:-1, :-1].astype(int) + valid[:-1, 1:] + valid[1:, 1:] + valid[1:, :-1]
    triangles = 2 * (corners == 4).sum() + (corners == 3).sum()
    if triangles == 0:
        with pytest.raises(ValueError, match="expected three valid neighbours somewhere"):
            shapes.height_map(z, 1.0)
        return
    mesh = shapes.height_map(z, (0.5, 2.0))
    up = normals(mesh)[:, 2]
    assert len(mesh.faces) == triangles
    assert (up == 1.0).all()  # twice the area of half a cell of 0.5 x 2
    assert len(mesh.vertices) == valid.sum()


@pytest.mark.parametrize("missing", range(4))
def test_three_of_four_samples_keep_their_triangle(missing):
    z = np.zeros((2, 2))
    z.flat[missing] = np.nan
    mesh = shapes.height_map(z, 1.0)
    assert len(mesh.faces) == 1
    assert normals(mesh)[0].tolist() == [0, 0, 1]
    assert np.sort(mesh.faces[0]).tolist() == [0, 1, 2]


@pytest.mark.parametrize("shape", [(1, 5), (5, 1), (0, 0), (4,), (2, 2, 2)])
def test_a_height_map_needs_two_by_two(shape):
    with pytest.raises(ValueError, match=r"height map: expected 2 x 2 samples or more, got shape \("):
        shapes.height_map(np.zeros(shape), 1.0)


@pytest.mark.parametrize("pitch", [0.0, -1.0, math.inf, math.nan, "1 um", (1.0, 0.0), (-1.0, 1.0)])
def test_a_pitch_is_a_positive_length(pitch):
    with pytest.raises(ValueError, match="height map pitch: expected a positive length in metres, got"):
        shapes.height_map(np.zeros((2, 2)), pitch)


def test_a_pitch_is_one_length_or_two():
    with pytest.raises(ValueError, match="height map pitch: expected one length or two, got 3"):
        shapes.height_map(np.zeros((2, 2)), (1.0, 1.0, 1.0))


def test_infinite_heights_are_no_holes():
    with pytest.raises(
        ValueError, match="height map vertices: expected finite numbers, got NaN or infinity in 1"
    ):
        shapes.height_map([[0.0, 1.0], [math.inf, 0.0]], 1.0)


# Plates and steps


def test_a_plate_faces_up():
    mesh = shapes.plate(4 * mm, 2 * mm)
    assert len(mesh.faces) == 2
    assert np.array_equal(mesh.bounds, [[-2 * mm, -1 * mm, 0], [2 * mm, 1 * mm, 0]])
    assert (normals(mesh)[:, 2] > 0).all()
    assert solid(mesh).area == pytest.approx(8 * mm * mm, rel=ROUNDING)


def test_a_thick_plate_is_a_box_below_its_face():
    mesh = shapes.plate(4 * mm, 2 * mm, thickness=1 * um)
    assert is_closed_and_outward(mesh)
    assert solid(mesh).volume == pytest.approx(8e-6 * 1e-6, rel=ROUNDING)
    assert len(mesh.faces) == 12
    assert mesh.bounds[:, 2].tolist() == [-1 * um, 0]
    assert (mesh.vertices[mesh.faces[:2], 2] == 0).all()
    assert (normals(mesh)[:2, 2] > 0).all()


@pytest.mark.parametrize(
    ("call", "what"),
    [
        (lambda: shapes.plate(0.0, 1.0), "plate width"),
        (lambda: shapes.plate(1.0, -1.0), "plate height"),
        (lambda: shapes.plate(1.0, 1.0, 0.0), "plate thickness"),
        (lambda: shapes.step(-1.0, 1.0, 0.0, 1.0), "step width"),
        (lambda: shapes.step(1.0, math.nan, 0.0, 1.0), "step height"),
        (lambda: shapes.staircase(0.0, 1.0, 3, 1.0), "staircase width"),
        (lambda: shapes.staircase(1.0, math.inf, 3, 1.0), "staircase height"),
        (lambda: shapes.extrude([(0, 0), (1, 0)], 0.0), "extrusion depth"),
        (lambda: shapes.icosphere(-1.0, 1), "icosphere radius"),
        (lambda: shapes.corner_cube(0.0), "corner cube size"),
        (lambda: shapes.rod_lattice(1, 1, 0.0, 1.0, 1.0), "rod radius"),
        (lambda: shapes.rod_lattice(1, 1, 1.0, 0.0, 1.0), "rod pitch"),
        (lambda: shapes.rod_lattice(1, 1, 1.0, 1.0, "1 um"), "rod length"),
    ],
)
def test_lengths_are_positive(call, what):
    with pytest.raises(ValueError, match=f"{what}: expected a positive length in metres, got"):
        call()


@pytest.mark.parametrize(
    ("call", "what", "least"),
    [
        (lambda: shapes.staircase(1.0, 1.0, 1, 1.0), "staircase treads", 2),
        (lambda: shapes.icosphere(1.0, -1), "icosphere subdivisions", 0),
        (lambda: shapes.corner_cube(1.0, 0), "corner cube subdivisions", 1),
        (lambda: shapes.rod_lattice(0, 1, 1.0, 1.0, 1.0), "rod columns", 1),
        (lambda: shapes.rod_lattice(1, 2.0, 1.0, 1.0, 1.0), "rod rows", 1),
        (lambda: shapes.rod_lattice(1, 1, 1.0, 1.0, 1.0, sides=2), "rod sides", 3),
    ],
)
def test_counts_are_whole_numbers(call, what, least):
    with pytest.raises(ValueError, match=f"{what}: expected a whole number from {least}, got"):
        call()


@pytest.mark.parametrize("rise", [100 * nm, -100 * nm])
def test_a_step_is_one_sheet(rise):
    mesh = shapes.step(10 * mm, 6 * mm, edge=1 * mm, rise=rise)
    assert len(mesh.vertices) == 8
    assert solid(mesh).euler_number == 1  # a sheet without holes
    low, riser, high = mesh.faces.reshape(3, -1)
    assert (mesh.vertices[low, 2] == 0).all()
    assert (mesh.vertices[low, 0] <= 1 * mm).all()
    assert (mesh.vertices[riser, 0] == 1 * mm).all()
    assert (mesh.vertices[high, 2] == rise).all()
    assert (mesh.vertices[high, 0] >= 1 * mm).all()
    assert solid(mesh).area == pytest.approx(60 * mm * mm + 6 * mm * abs(rise), rel=ROUNDING)
    facing = normals(mesh)
    assert (facing[[0, 1, 4, 5], 2] > 0).all()
    assert (facing[2:4, 0] * rise < 0).all()  # the riser is seen from the lower side


@pytest.mark.parametrize("edge", [-0.5, 0.5, 3.0, math.nan])
def test_the_edge_is_on_the_mirror(edge):
    with pytest.raises(ValueError, match=r"step edge: expected within 0.5 m of the centre, got"):
        shapes.step(1.0, 1.0, edge, 0.1)


@pytest.mark.parametrize("rise", [0.0, math.inf, math.nan])
def test_a_step_rises(rise):
    with pytest.raises(ValueError, match="step rise: expected a length in metres other than 0, got"):
        shapes.step(1.0, 1.0, 0.0, rise)
    with pytest.raises(ValueError, match="staircase rise: expected a length in metres other than 0, got"):
        shapes.staircase(1.0, 1.0, 3, rise)


def test_a_staircase_goes_up_tread_by_tread():
    mesh = shapes.staircase(10.0, 2.0, treads=4, rise=0.5)
    treads = mesh.vertices[mesh.faces.reshape(7, 2, 3)[::2]]
    for i, tread in enumerate(treads):
        assert (tread[..., 2] == 0.5 * i).all()
        assert np.ptp(tread[..., 0]) == pytest.approx(2.5)
    assert solid(mesh).area == pytest.approx(10 * 2 + 3 * 0.5 * 2, rel=ROUNDING)
    assert solid(mesh).euler_number == 1


# Extrusions


def test_the_front_of_an_extrusion_is_to_the_left():
    # up the z axis: left of somebody who sees x to the right and z up is -x
    mesh = shapes.extrude([(0, 0), (0, 1), (3, 1)], 2.0)
    assert normals(mesh)[:, [0, 2]].tolist() == [[-2, 0], [-2, 0], [0, 6], [0, 6]]
    assert mesh.bounds[:, 1].tolist() == [-1, 1]


def test_segments_keep_their_numbers():
    line = np.array([(0, 0), (1, 2), (3, 2), (4, -1), (1, -2)], dtype=float)
    for closed in (False, True):
        for points in (line, line[::-1]):
            mesh = shapes.extrude(points, 1.0, closed=closed)
            ends = np.roll(points, -1, axis=0)
            for i in range(len(points) - (not closed)):
                seen = mesh.vertices[mesh.faces[2 * i : 2 * i + 2]].reshape(-1, 3)[:, [0, 2]]
                assert {tuple(p) for p in seen.tolist()} == {tuple(points[i]), tuple(ends[i])}


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(0.3, 3.0), min_size=6, max_size=24), st.booleans(), open_range)
def test_a_closed_extrusion_is_a_solid(radii, clockwise, depth):
    # at 60 degrees a spoke or less the polygon sees its origin: certainly simple
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    x, z = np.array(radii) * np.cos(angle), np.array(radii) * np.sin(angle)
    area = 0.5 * abs(x @ np.roll(z, -1) - z @ np.roll(x, -1))
    points = np.stack([x, z], axis=1)[:: -1 if clockwise else 1]
    mesh = shapes.extrude(points, depth, closed=True)
    assert is_closed_and_outward(mesh)
    assert solid(mesh).euler_number == 2
    assert solid(mesh).volume == pytest.approx(area * depth, rel=ROUNDING)
    assert len(mesh.faces) == 4 * len(radii) - 4


def test_a_comb_is_filled():
    # many reflex corners on one line, the hard case for clipping ears
    teeth = [(x, z) for i in range(20) for x, z in ((2 * i, 1), (2 * i, 0), (2 * i + 1, 0), (2 * i + 1, 1))]
    mesh = shapes.extrude([(0, 2), *teeth, (39, 2)], 1.0, closed=True)
    assert is_closed_and_outward(mesh)
    assert solid(mesh).volume == pytest.approx(39 + 20, rel=ROUNDING)


def test_a_line_that_comes_back_makes_a_tube():
    square = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]
    mesh = shapes.extrude(square, 1.0)
    assert len(mesh.vertices) == 8
    assert solid(mesh).euler_number == 0
    assert (
        np.einsum("ij,ij->i", normals(mesh), mesh.vertices[mesh.faces].mean(axis=1) - [0.5, 0, 0.5]) < 0
    ).all()


@pytest.mark.parametrize(
    ("polyline", "closed", "message"),
    [
        ([(0, 0)], False, r"extrusion: expected points of shape \(k, 2\), k from 2, got \(1, 2\)"),
        ([(0, 0), (1, 0)], True, r"extrusion: expected points of shape \(k, 2\), k from 3, got \(2, 2\)"),
        ([(0, 0, 0), (1, 0, 0)], False, r"k from 2, got \(2, 3\)"),
        ([(0, 0), (math.nan, 0)], False, "extrusion: expected finite points, got NaN or infinity"),
        (
            [(0, 0), (1, 0), (1, 0)],
            False,
            "expected points that differ from the next, got two alike at point 1",
        ),
        ([(0, 0), (1, 0), (1, 1), (0, 0)], True, "differ from the next, got two alike at point 3"),
        ([(0, 0), (2, 2), (2, 0), (0, 2)], True, "does not meet itself, got segments 0 and 2"),
        ([(0, 0), (1, 0), (2, 0)], True, "does not meet itself, got segments 1 and 2"),
    ],
)
def test_lines_that_cannot_be_swept(polyline, closed, message):
    with pytest.raises(ValueError, match=message):
        shapes.extrude(polyline, 1.0, closed=closed)


# Spheres, corners, rods


@pytest.mark.parametrize("level", range(5))
def test_an_icosphere_is_that_of_trimesh(level):
    mesh = shapes.icosphere(2.0, level)
    rival = trimesh.creation.icosphere(subdivisions=level, radius=2.0)
    assert len(mesh.faces) == 20 * 4**level
    assert len(mesh.vertices) == 10 * 4**level + 2
    assert is_closed_and_outward(mesh)
    assert solid(mesh).euler_number == 2
    assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(2.0, rel=1e-15)
    assert solid(mesh).volume == pytest.approx(rival.volume, rel=ROUNDING)


@pytest.mark.parametrize("count", [1, 5])
def test_a_corner_cube_is_open_towards_111(count):
    mesh = shapes.corner_cube(3.0, count)
    assert len(mesh.faces) == 6 * count**2
    assert len(mesh.vertices) == 3 * count**2 + 3 * count + 1
    assert solid(mesh).euler_number == 1
    assert solid(mesh).area == pytest.approx(27, rel=ROUNDING)
    assert mesh.bounds.tolist() == [[0, 0, 0], [3, 3, 3]]
    facing = normals(mesh)
    for axis, part in enumerate(np.split(np.arange(len(mesh.faces)), 3)):
        assert (mesh.vertices[mesh.faces[part], axis] == 0).all()
        assert (facing[part, axis] > 0).all()
        assert (np.delete(facing[part], axis, axis=1) == 0).all()


def test_a_corner_cube_sends_light_back():
    facing = normals(shapes.corner_cube(1.0))
    direction = np.array([[-0.36, -0.48, -0.8]])
    for normal in facing[::2]:
        direction = reflect(direction, normal[None] / np.linalg.norm(normal))
    assert direction[0].tolist() == [0.36, 0.48, 0.8]


@pytest.mark.parametrize("sides", [3, 4, 18])
def test_rods_are_closed_prisms(sides):
    mesh = shapes.rod_lattice(3, 4, 65 * nm, 280 * nm, 1 * um, sides=sides)
    base = 0.5 * sides * (65 * nm) ** 2 * math.sin(2 * math.pi / sides)
    assert is_closed_and_outward(mesh)
    assert solid(mesh).euler_number == 2 * 12
    assert len(mesh.faces) == 12 * (4 * sides - 4)
    assert solid(mesh).volume == pytest.approx(12 * base * 1 * um, rel=1e-11)  # differences of places
    for rod in np.split(mesh.faces, 12):
        assert solid(Mesh(mesh.vertices, rod)).volume == pytest.approx(base * 1 * um, rel=1e-11)


@pytest.mark.parametrize("stagger", [True, False])
def test_triangles_of_rods_can_be_decoded(stagger):
    columns, rows, sides, radius, pitch = 5, 4, 18, 0.0065, (0.028, 0.03)
    mesh = shapes.rod_lattice(columns, rows, radius, pitch, 1.0, sides=sides, stagger=stagger)
    rod, facet = shapes.rod_of_triangle(np.arange(len(mesh.faces)), sides)
    assert np.array_equal(np.bincount(rod), np.full(20, 4 * sides - 4))
    corners = mesh.vertices[mesh.faces]
    for triangle in range(0, len(mesh.faces), 7):
        column, row = divmod(int(rod[triangle]), rows)
        shift = 0.5 if stagger and row % 2 else 0.0
        across = corners[triangle][:, [0, 2]] - [(column + shift) * pitch[0], row * pitch[1]]
        if facet[triangle] == -1:
            assert np.ptp(corners[triangle][:, 1]) == 0
            continue
        ends = np.radians(20.0 * (facet[triangle] + np.array([1, 2])))
        seen = np.unique(across.round(12), axis=0)
        expected = np.unique((radius * np.stack([np.cos(ends), np.sin(ends)], axis=1)).round(12), axis=0)
        assert seen == pytest.approx(expected, abs=1e-11)
    # eighteen sides put the facets at multiples of 20 degrees
    tilt = np.degrees(np.arctan2(*normals(mesh)[facet >= 0][:, [2, 0]].T))
    assert np.abs(tilt - 10 - 20 * np.round((tilt - 10) / 20)).max() < 1e-9


def test_rods_of_one_triangle():
    rod, facet = shapes.rod_of_triangle(68 * 7 + 35)
    assert (int(rod), int(facet)) == (7, 17)
    rod, facet = shapes.rod_of_triangle([36, 67, 68])
    assert rod.tolist() == [0, 0, 1]
    assert facet.tolist() == [-1, -1, 0]
