"""From TOML to things: units, kinds, files, poses; and one line for all that can go wrong."""

import math
import re

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.core.units import ComplexArray, FloatArray
from fringetrace.geometry import forms, meshes
from fringetrace.geometry.mesh import Mesh
from fringetrace.optics import birefringent, phase_plates, polarisers
from fringetrace.optics.interfaces import Interface
from fringetrace.optics.materials.material import Material
from fringetrace.optics.materials.named_materials import BK7, CALCITE_O
from fringetrace.scene.model import Surface
from fringetrace.scene.sensor import CCD
from fringetrace.scene.sources import Profile
from fringetrace.scenefile.decode import Pose, decode
from fringetrace.scenefile.schema import Recipe
from fringetrace.scenefile.toml import Place, parse


@pytest.fixture
def read(tmp_path):
    """Decode the value of `x` in a text as some type."""
    meshes.save(ft.shapes.plate(2 * mm, 2 * mm), tmp_path / "plate.stl", "mm")
    np.save(tmp_path / "map.npy", np.arange(16.0).reshape(4, 4))
    np.save(tmp_path / "odd.npy", np.array([{}]), allow_pickle=True)
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "odd.glb").write_bytes(b'{"buffers": [{"uri": "../secret"}]}')
    (tmp_path / "odd.3mf").write_bytes(b"")
    (tmp_path / "glass.csv").write_text("wavelength (um),n\n0.4,1.5\n0.7,1.6\n")

    def decoded(text, hint, unit="", outside=False):
        document = parse(text, "x.toml")
        return decode(document.values["x"], hint, Place(document, tmp_path, outside, ("x",)), unit)

    return decoded


def test_numbers_have_units_or_are_in_si(read):
    assert read('x = "633 nm"', float, "m") == pytest.approx(633 * nm)
    assert read("x = 6.33e-7", float, "m") == 6.33e-7
    assert read('x = "180 deg"', float, "rad") == math.pi
    assert read("x = 3", float | None) == 3
    assert read("x = inf", float, "m") == math.inf
    assert read('x = "0.5-2i"', complex) == 0.5 - 2j
    assert read("x = true", bool) is True
    assert read('x = ["1 mm", 0.002]', tuple[float, ...], "m") == (1e-3, 0.002)
    np.testing.assert_array_equal(read('x = [[1, "0.5i"], [0, 1]]', ComplexArray), [[1, 0.5j], [0, 1]])
    np.testing.assert_array_equal(read('x = { file = "map.npy" }', FloatArray)[3], [12, 13, 14, 15])


def test_materials_are_names_indices_kinds_and_files(read):
    assert read('x = "bk7"', Material) is BK7
    assert read("x = 1.5", Material).index(1e-6) == 1.5
    assert read('x = "1.5+0.1i"', Material | complex | str).index(1e-6) == 1.5 + 0.1j
    assert read('x = { type = "cauchy", a = 1.5, terms = [1e-14] }', Material).index(1e-6) == pytest.approx(
        1.51
    )
    assert read('x = { file = "glass.csv" }', Material).index(0.55e-6) == pytest.approx(1.55)


def test_an_index_of_a_crystal_may_be_the_name_of_a_material(read):
    text = (
        'x = { type = "ShearPlate", axis = [1, 0, 1], thickness = "1 mm", ordinary = "calcite o", '
        "extraordinary = 1.5 }"
    )
    plate = read(text, ft.elements.Element)
    assert isinstance(plate, birefringent.ShearPlate)
    assert plate.ordinary(589 * nm) == CALCITE_O.index(589 * nm)
    assert plate.extraordinary == 1.5


def test_kinds_are_tables_or_names(read):
    assert read('x = "Mirror"', Interface) == ft.Mirror()
    assert read('x = { type = "Mirror", reflectance = 0.5 }', Interface) == ft.Mirror(0.5)
    assert read('x = { type = "Gaussian", waist = "1 mm" }', Profile) == ft.Gaussian(1e-3)
    half = read('x = { type = "wave_plate", axis = [1, 0, 0], waves = 0.5 }', ft.elements.Element)
    assert isinstance(half, polarisers.Retarder)
    assert half.retardance == math.pi
    slm = read(
        'x = { type = "PhasePlate", opd = { file = "map.npy" }, centre = [0, 0, 0], right = [1, 0, 0], '
        'up = [0, 1, 0], pitch = "1 mm" }',
        ft.elements.Element,
    )
    assert isinstance(slm.relief, phase_plates.SplineRelief)


def test_poses_act_in_turn_on_all_that_can_be_moved(read):
    ball = read(
        'x = { type = "Sphere", centre = [1, 0, 0], radius = 1, '
        'pose = [{ axis = [0, 0, 1], angle = "90 deg" }, '
        "{ offset = [0, 0, 3] }] }",
        forms.Form,
    )
    np.testing.assert_allclose(ball.centre, [0, 1, 3], atol=1e-15)
    turn = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"
    flat = read(f'x = {{ file = "plate.stl", unit = "mm", pose = {{ turn = {turn} }} }}', Mesh)
    np.testing.assert_allclose(np.ptp(flat.vertices, axis=0), [2e-3, 2e-3, 0], rtol=1e-12)
    assert [offset.tolist() for offset, _ in flat.source.moves] == [[0, 0, 0]]


def test_a_mesh_may_be_given_by_its_file_alone(read, tmp_path):
    meshes.save(ft.shapes.plate(1.0, 1.0), tmp_path / "p.npz", "m")
    with pytest.raises(ValueError, match=r"x\.toml:1: x: p\.npz unit: expected one of pm"):
        read('x = "p.npz"', Mesh)
    assert len(read('x = { file = "p.npz", unit = "m" }', Mesh).faces) == 2


SURFACE = 'mesh = { type = "plate", width = 1, height = 1 }\ninterface = "Mirror"\n'
MICHELSON = '[x]\ntype = "michelson"\nsample = { type = "plate", width = 1, height = 1 }\n'
ERRORS = {
    "unknown key": (
        '[x]\n\ninterfce = "Mirror"',
        Surface,
        "3: x.interfce: expected one of mesh, interface, name,"
        " form, front, back, pose, got 'interfce', did you mean 'interface'?",
    ),
    "missing key": ('[x]\ninterface = "Mirror"', Surface, "1: x: expected the key 'mesh', got interface"),
    "missing key of nothing": ("[x]", Surface, "1: x: expected the key 'mesh', got none"),
    "unknown kind": (
        f"[x]\n{SURFACE}".replace("Mirror", "Miror"),
        Surface,
        "3: x.interface: expected one of Mirror,",
    ),
    "unknown type": ('x = { type = "Spere" }', forms.Form, "1: x.type: expected one of Sphere,"),
    "no type": ("x = { radius = 1 }", forms.Form, "1: x: expected the key 'type', one of Sphere,"),
    "a number for a type": ("x = { type = 1 }", forms.Form, "1: x.type: expected one of Sphere,"),
    "no table wanted": ("x = { a = 1 }", int, "1: x: expected a whole number, got a table"),
    "refused value": (
        '[x]\ntype = "Mirror"\nreflectance = 2',
        Interface,
        "3: x.reflectance: Mirror reflectance: expected a number from 0 to 1, got 2",
    ),
    "refused kind": (
        '[x]\ntype = "BeamSplitter"\nreflection = 2',
        Interface,
        "1: x: BeamSplitter: expected |r + t|^2",
    ),
    "no pose": (
        'x = { type = "Mirror", pose = {} }',
        Interface,
        "1: x.pose: expected none for a Mirror, got one",
    ),
    "wrong turn": (
        f"[x]\n{SURFACE}[[x.pose]]\nturn = [[2]]",
        Surface,
        "4: x.pose: turn: expected a rotation matrix",
    ),
    "two turns": (
        f"[x]\n{SURFACE}pose = {{ angle = 1 }}",
        Surface,
        "4: x.pose: pose: expected a turn, or an axis",
    ),
    "unknown material": ('x = "BK8"', Material, "1: x: material: expected one of vacuum,"),
    "no index": ('x = "1.5+"', Material, "1: x: material: expected one of vacuum,"),
    "wrong unit": ('x = "3 deg"', (float, "m"), "1: x: expected a number and a unit such as '1 pm'"),
    "unit in vain": ('x = "3 mm"', float, "1: x: expected a number, got '3 mm'"),
    "no unit": ('x = "3"', (float, "rad"), "1: x: expected a number and a unit such as '1 deg'"),
    "text for a length": (
        'x = "wide"',
        (float, "m"),
        "1: x: expected a length ('1 nm', or a number of metres), got",
    ),
    "half a pixel": ("x = 1.5", int, "1: x: expected a whole number, got 1.5"),
    "truth for a number": (
        "x = true",
        (float, "rad"),
        "1: x: expected an angle ('1 deg', or radians), got True",
    ),
    "number for a truth": ("x = 1", bool, "1: x: expected true or false, got 1"),
    "number for text": ("x = 1", str, "1: x: expected text, got 1"),
    "a day": ("x = 1979-05-27", float, "1: x: expected a number, got datetime.date(1979, 5, 27)"),
    "wrong complex": ('x = "1+k"', complex, "1: x: expected a complex number ('0.5+0.5i'), got '1+k'"),
    "wrong length": ("x = [1, 2, 3]", tuple[int, int], "1: x: expected a list of 2, got a list of 3"),
    "list in vain": ("x = [1]", int, "1: x: expected a whole number, got a list of 1"),
    "in a list": ('x = [\n1,\n"2"]', tuple[int, ...], "3: x: expected a whole number, got '2'"),
    "ragged": ("x = [[1], [1, 2]]", FloatArray, "1: x: expected lists of equal lengths, got others"),
    "number for a list": ("x = 1", FloatArray, "1: x: expected a list, got 1"),
    "outside": (
        'x = { file = "../p.stl", unit = "mm" }',
        Mesh,
        "1: x.file: expected a file in the folder of the scene",
    ),
    "no file": ('x = { file = "none.stl", unit = "mm" }', Mesh, "none.stl: expected an existing file"),
    "file unit": (
        'x = { file = "plate.stl", unit = "ell" }',
        Mesh,
        "1: x.unit: plate.stl unit: expected one of pm",
    ),
    "number for a unit": ('x = { file = "plate.stl", unit = 1 }', Mesh, "1: x.unit: expected text, got 1"),
    "file key": (
        'x = { file = "plate.stl", unt = "mm" }',
        Mesh,
        "1: x.unt: expected one of file, unit, pose, got",
    ),
    "no mesh": (
        'x = { file = "notes.txt", unit = "mm" }',
        Mesh,
        "1: x.file: expected a file named .dat, .datx, .glb, .npz,",
    ),
    "parts elsewhere": (
        'x = { file = "odd.glb", unit = "mm" }',
        Mesh,
        "1: x.file: expected a mesh that is whole, got",
    ),
    "no array": (
        'x = { file = "notes.txt" }',
        FloatArray,
        "1: x.file: expected one named .npy, got 'notes.txt'",
    ),
    "objects": (
        'x = { file = "odd.npy" }',
        FloatArray,
        "1: x: Object arrays cannot be loaded when allow_pickle=False",
    ),
    "file in vain": ('x = { file = "map.npy" }', int, "1: x: expected a whole number, got a file"),
    "unknown bench": ('x = { type = "michelsen" }', Recipe, "1: x.type: expected one of "),
    "no bench": ("x = { aperture = 1 }", Recipe, "1: x: expected the key 'type', one of "),
    "bench argument": (f"{MICHELSON}apertur = 1", Recipe, "4: x.apertur: expected one of sample, aperture,"),
    "refused bench": (
        f"{MICHELSON}aperture = 1\narm = 1",
        Recipe,
        "5: x.arm: michelson arm: expected at least 2.0 times",
    ),
    "refused CCD": (
        "[x]\ncentre = [0, 0, 0]\nnormal = [0, 0, 1]\nup = [0, 1, 0]\nshape = [2, 2]\npitch = -1",
        CCD,
        "6: x.pitch: CCD pitch: expected a positive length in metres, got -1",
    ),
}


@pytest.mark.parametrize("case", ERRORS)
def test_what_is_not_as_expected_is_said_in_one_line(read, case):
    text, hint, message = ERRORS[case]
    hint, unit = hint if isinstance(hint, tuple) else (hint, "")
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        read(text, hint, unit)
    assert re.match(r"x\.toml:\d+: x", str(caught.value))


def test_other_kinds_of_meshes_are_read_where_files_elsewhere_are_allowed(read):
    with pytest.raises(ValueError, match=r"x: .*odd\.3mf.*does not parse|x: .*odd\.3mf"):
        read('x = { file = "odd.3mf", unit = "mm" }', Mesh, outside=True)


def test_a_pose_takes_one_turn():
    assert Pose().matrix is None
    with pytest.raises(ValueError, match="pose: expected a turn, or an axis and an angle, or neither"):
        Pose(turn=np.eye(3), axis=np.array([0, 0, 1.0]))
