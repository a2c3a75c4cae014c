import os
import pickle
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from fringetrace import Mesh, mm, nm, um
from fringetrace.geometry import meshes, shapes
from fringetrace.geometry.mesh import as_mesh

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "meshes"
# STL, PLY and GLB hold float32 numbers: half a unit in the last place of 24 bits.
FLOAT32 = 2.0**-24
# A few roundings of float64.
ROUNDING = 1e-15

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def same_faces(mesh, other, tolerance):
    """Equal corners in the same order, within a part of the whole mesh's size."""
    apart = np.abs(mesh.vertices[mesh.faces] - other.vertices[other.faces])
    return bool(apart.max() <= tolerance * np.ptp(other.bounds, axis=0).max())


# Loading and saving


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".glb", ".STL"])
def test_what_was_saved_is_loaded(tmp_path, suffix):
    mesh = shapes.height_map(np.random.default_rng(1).normal(size=(6, 9)) * um, 2 * um)
    meshes.save(mesh, tmp_path / f"map{suffix}", "um")
    again = meshes.load(tmp_path / f"map{suffix}", unit="um")
    assert same_faces(again, mesh, ROUNDING if suffix == ".obj" else FLOAT32)
    assert len(again.vertices) == len(mesh.vertices)
    assert again.name == f"map{suffix}"
    assert [file.name for file in tmp_path.iterdir()] == [f"map{suffix}"]


@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("in", 0.0254)])
def test_the_unit_is_that_of_the_numbers_in_the_file(tmp_path, unit, metres):
    file = tmp_path / "one.obj"
    file.write_text(TRIANGLE + "f 1 2 3\n")
    mesh = meshes.load(str(file), unit=unit)
    assert mesh.vertices.tolist() == [[0, 0, 0], [metres, 0, 0], [0, metres, 0]]
    meshes.save(mesh, file, unit)
    assert meshes.load(file, unit=unit).vertices.tolist() == mesh.vertices.tolist()


def test_rods_of_nanometres_in_a_file_of_metres_stay_apart(tmp_path):
    # 10 nm facets are finer than the 1e-8 at which trimesh would merge vertices
    rods = shapes.rod_lattice(3, 2, 30 * nm, 70 * nm, 0.5 * um)
    for suffix in (".stl", ".ply", ".glb"):
        meshes.save(rods, tmp_path / f"rods{suffix}", "m")
        again = meshes.load(tmp_path / f"rods{suffix}", unit="m")
        assert len(again.vertices) == len(rods.vertices)
        assert trimesh.Trimesh(again.vertices, again.faces, process=False).is_watertight


def test_an_ascii_stl_is_welded_and_keeps_its_faces_in_order(tmp_path):
    corners = [[(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 0), ("-0", 1, 0)]]
    facets = [
        "facet normal 0 0 1\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*corner) for corner in facet)
        + "endloop\nendfacet\n"
        for facet in corners
    ]
    file = tmp_path / "text.stl"
    file.write_text("solid text\n" + "".join(facets) + "endsolid text\n")
    mesh = meshes.load(file, unit="mm")
    assert mesh.faces.tolist() == [[0, 1, 2], [1, 3, 2]]
    assert mesh.vertices[mesh.faces] / mm == pytest.approx(np.array(corners, dtype=float))


def test_faces_without_area_are_dropped(tmp_path):
    file = tmp_path / "flat.obj"
    file.write_text(TRIANGLE + "v 2 0 0\nf 1 2 4\nf 1 2 3\nf 1 1 2\n")
    assert meshes.load(file, unit="m").faces.tolist() == [[0, 1, 2]]
    file.write_text(TRIANGLE + "v 2 0 0\nf 1 2 4\nf 1 1 2\n")
    with pytest.raises(ValueError, match=r"flat.obj faces: .* got 2 of 2 without \(faces 0, 1\)"):
        meshes.load(file, unit="m")


def test_polygons_of_an_obj_are_cut_into_triangles(tmp_path):
    file = tmp_path / "quad.obj"
    file.write_text(
        "mtllib none.mtl\nusemtl a\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1 4//1\n"
    )
    mesh = meshes.load(file, unit="m")
    assert len(mesh.faces) == 2
    assert trimesh.Trimesh(mesh.vertices, mesh.faces).area == pytest.approx(2)


def test_parts_stand_where_the_file_puts_them(tmp_path):
    # one geometry, shown three times: as it is, turned by 90 degrees about x, mirrored at x = 0
    triangle = trimesh.Trimesh([[1, 0, 0], [2, 0, 0], [1, 1, 0]], [[0, 1, 2]], process=False)
    turned = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 5], [0, 0, 0, 1.0]])
    scene = trimesh.Scene()
    for name, pose in (("here", np.eye(4)), ("turned", turned), ("mirrored", np.diag([-1.0, 1, 1, 1]))):
        scene.add_geometry(triangle, node_name=name, geom_name="part", transform=pose)
    file = tmp_path / "parts.glb"
    file.write_bytes(scene.export(file_type="glb"))
    mesh = meshes.load(file, unit="m")
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    seen = dict(zip(map(tuple, a.tolist()), np.cross(b - a, c - a).tolist(), strict=True))
    # mirrored, the triangle still shows its front to +z, from another first corner
    assert seen == {(1, 0, 0): [0, 0, 1], (1, 0, 5): [0, -1, 0], (-1, 1, 0): [0, 0, 1]}


def test_objects_of_an_obj_are_one_mesh(tmp_path):
    file = tmp_path / "two.obj"
    file.write_text(f"o a\n{TRIANGLE}f 1 2 3\no b\nv 1 1 0\nf 2 4 3\n")
    mesh = meshes.load(file, unit="m")
    assert len(mesh.vertices) == 4
    assert len(mesh.faces) == 2


def test_a_mesh_file_needs_a_unit(tmp_path):
    file = tmp_path / "one.obj"
    file.write_text(TRIANGLE + "f 1 2 3\n")
    with pytest.raises(ValueError, match=r"one.obj unit: expected one of pm, nm, .* got None"):
        meshes.load(file)
    with pytest.raises(ValueError, match=r"one.obj unit: expected one of pm, nm, .* got 'inch'"):
        meshes.load(file, unit="inch")


def test_unknown_files(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"nowhere.stl: expected an existing file, got none there"):
        meshes.load(tmp_path / "nowhere.stl", unit="mm")
    with pytest.raises(FileNotFoundError, match=r"nowhere.dat: expected an existing file"):
        meshes.load(tmp_path / "nowhere.dat")
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(FileNotFoundError, match=r"folder.ply: expected an existing file"):
        meshes.load(tmp_path / "folder.ply", unit="mm")
    with pytest.raises(
        ValueError, match=r"drawing.svg: expected a file named .*\.obj, .*\.stl.* got '\.svg'"
    ):
        meshes.load(tmp_path / "drawing.svg", unit="mm")
    with pytest.raises(ValueError, match=r"drawing: expected a file named .* got 'no suffix'"):
        meshes.load(tmp_path / "drawing", unit="mm")


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".glb"])
@pytest.mark.parametrize(
    "content", [b"", b"this is no mesh at all " * 9, bytes(range(256))], ids=["empty", "text", "bytes"]
)
def test_files_that_hold_no_mesh(tmp_path, suffix, content):
    file = tmp_path / f"bad{suffix}"
    file.write_bytes(content)
    with pytest.raises(ValueError, match=rf"bad{suffix}: expected"):
        meshes.load(file, unit="mm")


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".glb"])
def test_files_cut_short(tmp_path, suffix):
    whole, cut = tmp_path / f"whole{suffix}", tmp_path / f"cut{suffix}"
    meshes.save(shapes.icosphere(1 * mm, 2), whole, "mm")
    cut.write_bytes(whole.read_bytes()[:-100])
    with pytest.raises(ValueError, match=rf"cut{suffix}: expected"):
        meshes.load(cut, unit="mm")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TRIANGLE, "bad.obj: expected triangles, got a file without any"),
        (TRIANGLE + "f 1 2 9\n", "bad.obj: expected OBJ data, got something that does not parse"),
        (TRIANGLE.replace("1 0 0", "1 zero 0") + "f 1 2 3\n", "bad.obj: expected OBJ data, got something"),
        (
            TRIANGLE.replace("1 0 0", "1 nan 0") + "f 1 2 3\n",
            "bad.obj vertices: expected finite numbers, got NaN",
        ),
        (
            TRIANGLE.replace("1 0 0", "1 inf 0") + "f 1 2 3\n",
            "bad.obj vertices: expected finite numbers, got NaN",
        ),
        (TRIANGLE + "f -3 -2 -1\n", "bad.obj: expected vertex numbers from 1 up, got 'f -3 -2 -1' in line 4"),
        (TRIANGLE + "f 0 1 2\n", "bad.obj: expected vertex numbers from 1 up, got 'f 0 1 2' in line 4"),
    ],
)
def test_objs_that_are_wrong(tmp_path, text, message):
    file = tmp_path / "bad.obj"
    file.write_text(text)
    with pytest.raises(ValueError, match=message):
        meshes.load(file, unit="mm")


def test_a_cloud_of_points_is_no_mesh(tmp_path):
    file = tmp_path / "cloud.ply"
    file.write_bytes(trimesh.PointCloud(np.eye(3)).export(file_type="ply"))
    with pytest.raises(ValueError, match=r"cloud.ply: expected triangles, got a file without any"):
        meshes.load(file, unit="mm")


def test_files_that_cannot_be_written(tmp_path):
    plate = shapes.plate(1 * mm, 1 * mm)
    with pytest.raises(ValueError, match=r"plate.step: expected a file named .*\.stl, got '\.step'"):
        meshes.save(plate, tmp_path / "plate.step", "mm")
    with pytest.raises(ValueError, match=r"plate.stl unit: expected one of .* got 'inch'"):
        meshes.save(plate, tmp_path / "plate.stl", "inch")
    with pytest.raises(FileNotFoundError, match="nowhere"):
        meshes.save(plate, tmp_path / "nowhere" / "plate.stl", "mm")
    assert list(tmp_path.iterdir()) == []


def test_nothing_half_written(tmp_path, monkeypatch):
    file = tmp_path / "plate.stl"
    file.write_text("kept")

    def refuse(*_):
        raise PermissionError("no")

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(PermissionError, match="no"):
        meshes.save(shapes.plate(1 * mm, 1 * mm), file, "mm")
    assert file.read_text() == "kept"
    assert len(list(tmp_path.iterdir())) == 1


# The elevation sample


def test_the_elevation_sample_is_scaled():
    z, pitch = meshes.elevation_sample(2 * um, 10 * mm)
    assert z.shape == (344, 403)
    assert (z.min(), z.max()) == (0, 2 * um)
    assert pitch * 402 == pytest.approx(10 * mm)
    # whole metres of 236 to 1076 above the sea, north at the top
    metres = 236 + z / (2 * um) * 840
    assert np.abs(metres - metres.round()).max() < 1e-9
    from matplotlib import cbook

    assert np.array_equal(metres.round()[::-1], cbook.get_sample_data("jacksboro_fault_dem.npz")["elevation"])


@pytest.mark.parametrize(("relief", "aperture", "what"), [(0.0, 1.0, "relief"), (1.0, -1.0, "aperture")])
def test_the_elevation_sample_has_a_size(relief, aperture, what):
    with pytest.raises(ValueError, match=f"{what}: expected a positive length in metres, got"):
        meshes.elevation_sample(relief, aperture)


@pytest.mark.parametrize("spec", [None, "elsewhere"])
def test_matplotlib_without_its_samples(tmp_path, monkeypatch, spec):
    import importlib.machinery
    import importlib.util

    found = spec and importlib.machinery.ModuleSpec("matplotlib", None, origin=str(tmp_path / "__init__.py"))
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: found)
    with pytest.raises(FileNotFoundError, match=r"jacksboro_fault_dem.npz: expected an existing file"):
        meshes.elevation_sample(1 * um, 1 * mm)


def test_heavy_libraries_are_imported_at_first_use():
    code = (
        "import sys, fringetrace as ft; ft.meshes.elevation_sample(1e-6, 1e-2);"
        "ft.Surface(ft.shapes.icosphere(1.0, 1), ft.Mirror());"
        "print({'trimesh', 'prysm', 'matplotlib', 'pyvista'} & set(sys.modules))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "set()"


# Heights above points


@settings(max_examples=30, deadline=None)
@given(
    arrays(np.float64, st.tuples(st.integers(2, 6), st.integers(2, 6)), elements=st.floats(-5, 5, width=32)),
    st.floats(0, 1),
    st.floats(0, 1),
)
def test_heights_are_exact_at_samples_and_linear_between(z, u, v):
    mesh = shapes.height_map(z * um, 1 * um)
    rows, columns = z.shape
    x, y = (np.arange(columns) - (columns - 1) / 2) * um, (np.arange(rows) - (rows - 1) / 2) * um
    assert np.array_equal(meshes.interpolate_height(mesh, x, y[:, None]), z * um)
    # in the last cell: cut from its first sample to its last
    a, b, c, d = z[-2, -2], z[-2, -1], z[-1, -1], z[-1, -2]
    expected = a + u * (b - a) + v * (c - b) if u >= v else a + v * (d - a) + u * (c - d)
    height = meshes.interpolate_height(mesh, x[-2] + u * um, y[-2] + v * um)
    assert height.shape == ()
    assert height / um == pytest.approx(expected, abs=1e-8)  # EDGE of a height difference of 10


def test_holes_and_surroundings_have_no_height():
    z = np.zeros((5, 5))
    z[2, 2] = np.nan
    mesh = shapes.height_map(z, 1.0)
    x = np.array([-2.5, -2.0, -0.9, -0.25, 0.0, 0.25, 0.9, 2.0, 2.5, np.nan])
    height = meshes.interpolate_height(mesh, x, np.zeros(10))
    assert np.isfinite(height).tolist() == [
        False,
        True,
        False,
        False,
        False,
        False,
        False,
        True,
        False,
        False,
    ]
    # two corners of the hole keep their triangle
    assert np.isfinite(meshes.interpolate_height(mesh, [-0.9, 0.9], [0.9, 0.9])).tolist() == [True, True]
    assert meshes.interpolate_height(mesh, np.zeros((0, 3)), 0.0).shape == (0, 3)


def test_the_topmost_face_counts_and_walls_do_not():
    ball = shapes.icosphere(1.0, 4)
    x = np.linspace(-0.9, 0.9, 7)
    assert (meshes.interpolate_height(ball, x, 0.1) > 0).all()
    step = shapes.step(2.0, 2.0, edge=0.5, rise=0.25)
    assert meshes.interpolate_height(step, [0.4, 0.5, 0.6], 0.0).tolist() == [0, 0.25, 0.25]
    inside = Mesh(ball.vertices, ball.faces[:, ::-1])  # turned inside out: the same heights
    expected = meshes.interpolate_height(ball, x, 0.1)
    assert meshes.interpolate_height(inside, x, 0.1) == pytest.approx(expected, rel=1e-12)


def test_heights_do_not_depend_on_the_scale():
    rng = np.random.default_rng(2)
    mesh = shapes.height_map(rng.normal(size=(20, 30)), 1.0)
    x, y = rng.uniform(-16, 16, 500), rng.uniform(-11, 11, 500)
    height = meshes.interpolate_height(mesh, x, y)
    small = meshes.interpolate_height(Mesh(mesh.vertices * 2.0**-40, mesh.faces), x * 2.0**-40, y * 2.0**-40)
    assert np.array_equal(small * 2.0**40, height, equal_nan=True)


# The sample files


@pytest.fixture(scope="module")
def samples():
    return runpy.run_path(str(SAMPLES / "make.py"))


def test_the_sample_files_are_those_that_the_script_makes(samples, tmp_path):
    samples["main"](tmp_path)
    made = {file.name for file in tmp_path.iterdir()}
    assert made == {file.name for file in SAMPLES.iterdir() if file.suffix in meshes.WRITTEN}
    for name, mesh, unit in samples["samples"]():
        assert (SAMPLES / name).stat().st_size < 200_000
        kept, fresh = (meshes.load(folder / name, unit=unit) for folder in (SAMPLES, tmp_path))
        # cosines may differ by a rounding from one machine to the next
        assert same_faces(kept, fresh, 4 * FLOAT32)
        assert same_faces(kept, mesh, 4 * FLOAT32)
        assert f"| `{name}` | {unit} |" in (SAMPLES / "README.md").read_text()


def test_what_the_sample_files_hold():
    def load(name, unit):
        return meshes.load(SAMPLES / name, unit=unit)

    def height(mesh, x, y=0.0):
        return meshes.interpolate_height(mesh, x, y)

    assert height(load("step.stl", "mm"), [0, 2 * mm]) / nm == pytest.approx([0, 100])
    assert height(load("plate_tilted.ply", "mm"), 4 * mm) / um == pytest.approx(2)
    # the corners are 4 sqrt(2) mm from the middle of a mirror of 1 m radius
    deep = 1 - np.sqrt(1 - 2 * (4 * mm) ** 2)
    assert np.ptp(load("sphere_cap.stl", "mm").bounds[:, 2]) == pytest.approx(deep, rel=1e-6)
    assert height(load("gaussian_bump.ply", "um"), [0, 64 * um]) / nm == pytest.approx(
        [500, 500 * np.exp(-0.5 * (64 / 60) ** 2)]
    )
    treads = np.linspace(-0.4, 0.4, 5) * mm
    assert height(load("staircase.glb", "um"), treads) / nm == pytest.approx(79.1 * np.arange(5), rel=1e-6)
    for name, unit in (("wedge.stl", "mm"), ("rods_20x4.ply", "um")):
        mesh = load(name, unit)
        assert trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).is_watertight
    assert len(load("corner_cube.obj", "mm").faces) == 96


def test_an_archive_keeps_every_bit_and_where_it_came_from(tmp_path):
    mesh = shapes.icosphere(1e-3 / 3.0, 2).moved((0.1, 0.2, 0.3))
    meshes.save(mesh, tmp_path / "ball.npz", "m")
    back = meshes.load(tmp_path / "ball.npz", "m")
    assert back.vertices.tobytes() == mesh.vertices.tobytes()
    assert back.faces.tobytes() == mesh.faces.tobytes()
    assert (back.source.path, back.source.unit) == (str((tmp_path / "ball.npz").resolve()), "m")
    assert len(back.moved((1.0, 0.0, 0.0)).source.moves) == 1
    assert pickle.loads(pickle.dumps(back)).source.path == back.source.path


@pytest.mark.parametrize("content", [{}, {"vertices": np.array([{}])}])
def test_an_archive_of_something_else_is_refused(tmp_path, content):
    np.savez(tmp_path / "odd.npz", **content)
    with pytest.raises(ValueError, match=r"odd\.npz: expected an archive of vertices and faces, got"):
        meshes.load(tmp_path / "odd.npz", "m")


# To other libraries


def test_a_mesh_comes_back_from_other_libraries_as_it_was():
    mesh = shapes.icosphere(1e-3 / 3.0, 2)
    for other in (meshes.to_trimesh(mesh), meshes.to_pyvista(mesh)):
        back = as_mesh(other)
        assert back.vertices.tobytes() == mesh.vertices.tobytes()
        assert back.faces.tobytes() == mesh.faces.tobytes()


def test_what_is_given_is_a_copy_with_name_and_unit():
    mesh = shapes.plate(2.0, 1.0, 0.5)
    solid, data = meshes.to_trimesh(mesh), meshes.to_pyvista(mesh)
    solid.vertices[:] = 0.0
    data.points[:] = 0.0
    assert mesh.bounds[1].tolist() == [1.0, 0.5, 0.0]
    assert (solid.units, solid.metadata["name"]) == ("meters", mesh.name)
    assert (data.field_data["unit"][0], data.field_data["name"][0]) == ("m", mesh.name)
    assert meshes.to_pyvista(mesh).volume == pytest.approx(1.0)
    assert meshes.to_trimesh(mesh).volume == pytest.approx(1.0)
