"""Files of other programs, read back."""

import json
import struct

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm, views
from fringetrace.geometry.shapes import plate


@pytest.fixture(scope="module")
def scene():
    return ft.Scene([
        ft.Surface(plate(4 * mm, 4 * mm), ft.Mirror(0.5), "floor"),
        ft.Surface(plate(4 * mm, 4 * mm).moved([0, 0, 9 * mm]), ft.Absorber(), "lid"),
    ])  # fmt: skip


@pytest.fixture(scope="module")
def paths(scene):
    start = [[x * mm, 0, 3 * mm] for x in (-1, 0, 1)]
    return ft.trace(scene, ft.Rays(start, [[0, 0, -1.0]] * 3), record=True)


def test_vtp_holds_all_numbers(scene, paths, tmp_path):
    import pyvista

    views.export(scene, paths, tmp_path / "it.vtp", wavelength=2.5 * nm)
    mesh = pyvista.read(tmp_path / "it.vtp")
    cells = mesh.cell_data
    assert (mesh.n_cells, mesh.n_lines) == (7, 3)
    assert list(mesh.field_data["surfaces"]) == ["floor", "lid"]
    np.testing.assert_array_equal(cells["surface"], [-1, -1, -1, 0, 0, 1, 1])
    np.testing.assert_array_equal(cells["ray"], [0, 1, 2, -1, -1, -1, -1])
    np.testing.assert_array_equal(cells["bounces"][:3], 2)
    np.testing.assert_array_equal(cells["fate"][:3], ft.Fate.ABSORBED)
    np.testing.assert_allclose(cells["power"][:3], 0.0)
    np.testing.assert_allclose(cells["optical_path"][:3], 12 * mm)
    np.testing.assert_allclose(mesh.get_cell(1).points / mm, [[0, 0, 3], [0, 0, 0], [0, 0, 9]], atol=1e-12)
    np.testing.assert_allclose(mesh.point_data["optical_path"][3:6] / mm, [0, 3, 12])
    np.testing.assert_array_equal(mesh.point_data["bounce"][3:6], [0, 1, 2])
    # 4.8e6 waves of 2.5 nm, and half a turn at the mirror
    np.testing.assert_allclose(np.cos(2 * np.pi * cells["phase"][:3]), -1.0, rtol=1e-6)
    assert np.isnan(cells["phase"][3:]).all()


def test_ply_holds_surfaces_and_coloured_tubes(scene, paths, tmp_path):
    import pyvista

    views.export(scene, paths, tmp_path / "it.ply", colour="bounce", tubes=0.1 * mm)
    mesh = pyvista.read(tmp_path / "it.ply")
    np.testing.assert_allclose(np.array(mesh.bounds) / mm, [-2, 2, -2, 2, 0, 9], atol=1e-6)
    inside = np.flatnonzero(np.abs(mesh.points[:, 1]) < 0.11 * mm)
    assert {tuple(c) for c in mesh["RGB"][inside].tolist()} == {(0x44, 0x01, 0x54), (0x21, 0x91, 0x8C)}
    assert {tuple(c) for c in np.delete(mesh["RGB"], inside, axis=0).tolist()} == {(184,) * 3, (72,) * 3}


def test_glb_holds_named_surfaces_and_lines_with_y_upwards(scene, paths, tmp_path):
    import trimesh

    views.export(scene, paths, tmp_path / "it.glb", colour="fate")
    found = trimesh.load(tmp_path / "it.glb")
    np.testing.assert_allclose(found.bounds / mm, [[-2, 0, -2], [2, 9, 2]], atol=1e-6)
    assert set(found.geometry) == {"floor", "lid", "rays, where paths end, 0"}
    raw = (tmp_path / "it.glb").read_bytes()
    tree = json.loads(raw[20 : 20 + struct.unpack("<I", raw[12:16])[0]])
    (wires,) = [mesh["primitives"][0] for mesh in tree["meshes"] if mesh["name"].startswith("rays")]
    assert wires["mode"] == 1  # pairs of points
    assert tree["accessors"][wires["attributes"]["POSITION"]]["count"] == 2 * 6
    assert found.geometry["floor"].visual.material.baseColorFactor.tolist() == [184, 184, 184, 255]


@pytest.mark.parametrize("suffix", ["vtp", "ply", "glb"])
def test_surfaces_go_without_rays(scene, tmp_path, suffix):
    views.export(scene, None, tmp_path / f"it.{suffix}")
    assert [file.name for file in tmp_path.iterdir()] == [f"it.{suffix}"]


def test_another_kind_of_file_is_refused(scene, tmp_path):
    with pytest.raises(ValueError, match=r"export: expected a file named \*\.glb, .*, got 'it\.step'"):
        views.export(scene, None, tmp_path / "it.step")
    assert not list(tmp_path.iterdir())
