"""From things to TOML: what comes back is the same, to the last bit, or it is refused."""

import re
from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.core.units import ComplexArray, FloatArray
from fringetrace.geometry import forms, meshes
from fringetrace.geometry.mesh import Mesh
from fringetrace.optics import elements, gratings, materials, phase_plates, polarisers
from fringetrace.optics.films import Film
from fringetrace.optics.interfaces import Interface
from fringetrace.optics.materials.material import Material
from fringetrace.optics.materials.named_materials import CALCITE_E
from fringetrace.scene.sensor import CCD
from fringetrace.scene.sources import Beam, Profile
from fringetrace.scenefile.decode import decode
from fringetrace.scenefile.encode import Shelf, encode
from fringetrace.scenefile.toml import Place, dump, parse

SETTINGS = settings(max_examples=40, deadline=None)
NUMBER = st.floats(-1e3, 1e3, allow_subnormal=False)
LENGTH = st.floats(1e-7, 1e3)
VECTOR = st.tuples(NUMBER, NUMBER, NUMBER)
DIRECTION = VECTOR.filter(lambda v: max(map(abs, v)) > 1e-3)


def again(value, hint, folder):
    """What is read of what is written."""
    shelf = Shelf(folder / "it.toml")
    text = dump({"x": encode(value, hint, ("x",), shelf)})
    for name, write in shelf.files.items():
        write(folder / name)
    document = parse(text, "it.toml")
    return decode(document.values["x"], hint, Place(document, folder, False, ("x",)))


def same(one, other):
    """Whether two things are the same to the last bit."""
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.tobytes() == other.tobytes() and one.shape == other.shape
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if is_dataclass(one) and type(one).__eq__ is object.__eq__:
        names = [field.name for field in fields(one) if field.name not in ("source", "relief")]
        return type(one) is type(other) and all(same(getattr(one, n), getattr(other, n)) for n in names)
    return type(one) is type(other) and bool(one == other)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("scene")


@SETTINGS
@given(
    centre=VECTOR, direction=DIRECTION, size=st.tuples(LENGTH, LENGTH), waist=LENGTH,
    shape=st.tuples(st.integers(1, 9), st.integers(1, 9)), passes=st.lists(st.text(max_size=4), max_size=2),
    jones=st.none() | st.tuples(st.complex_numbers(max_magnitude=9), st.complex_numbers(max_magnitude=9)),
)  # fmt: skip
def test_beams_come_back(folder, centre, direction, size, waist, shape, passes, jones):
    if jones is not None and max(map(abs, jones)) < 1e-3:
        jones = None
    up = np.roll(np.eye(3)[int(np.argmin(np.abs(direction)))], 0)
    beam = Beam(centre, direction, up, size, shape, ft.Gaussian(waist), tuple(passes), jones)
    assert same(again(beam, Beam, folder), beam)


@SETTINGS
@given(normal=DIRECTION, pitch=LENGTH, focus=NUMBER)
def test_cameras_come_back(folder, normal, pitch, focus):
    up = np.eye(3)[int(np.argmin(np.abs(normal)))]
    ccd = CCD((0, 0, 1), normal, up, pitch, (3, 4), focus)
    assert same(again(ccd, CCD, folder), ccd)


INDEX = st.floats(0.1, 5.0)
MATERIALS = st.one_of(
    st.sampled_from(materials.NAMED),
    INDEX.map(materials.constant),
    st.builds(lambda n, k: materials.constant(complex(n, k), "mine"), INDEX, st.floats(0.0, 9.0)),
    st.builds(lambda a, b: materials.cauchy(a, b, name="mine"), INDEX, st.floats(0, 1e-14)),
    st.builds(lambda n, k: materials.tabulated([4e-7, 7e-7], [n, n], [k, 0.0]), INDEX, st.floats(0.0, 1.0)),
    st.builds(lambda a, k: materials.absorbing(materials.cauchy(a), k, 2.7e-7), INDEX, st.floats(0.0, 1.0)),
)  # fmt: skip


@SETTINGS
@given(MATERIALS)
def test_materials_come_back(folder, material):
    assert again(material, Material | None, folder) == material


@SETTINGS
@given(st.lists(st.tuples(MATERIALS, st.floats(0, 1e-5)), max_size=3))
def test_films_come_back(folder, layers):
    coated = ft.Dielectric("reflected", Film(tuple(layers)))
    assert again(coated, Interface | ft.Dielectric | ft.Metal, folder) == coated


FORMS = st.one_of(
    st.builds(forms.Sphere, VECTOR, LENGTH),
    st.builds(forms.Cylinder, VECTOR, DIRECTION, LENGTH),
    st.builds(forms.Conic, VECTOR, DIRECTION, LENGTH | st.just(np.inf), NUMBER, st.lists(NUMBER, max_size=2)),
    st.builds(lambda h, p: forms.HeightField(np.full((4, 5), h), p), NUMBER, LENGTH),
    st.builds(lambda p, o: forms.HeightField(np.zeros((4, 4)), p, o), st.tuples(LENGTH, LENGTH), VECTOR),
    st.builds(forms.Smooth, st.none() | st.lists(DIRECTION, min_size=3, max_size=9)),
)


@SETTINGS
@given(FORMS)
def test_forms_come_back(folder, form):
    assert same(again(form, forms.Form | None, folder), form)


PART, AMPLITUDES = st.floats(-1.0, 1.0), st.just((0.1j, 0.5, -0.5))
ELEMENTS = st.one_of(
    st.builds(elements.Annulus, VECTOR, st.just(0.0), LENGTH | st.just(np.inf)),
    st.builds(elements.IdealLens, VECTOR, DIRECTION, LENGTH),
    st.builds(polarisers.Polariser, DIRECTION, st.floats(0.0, 1.0)),
    st.builds(polarisers.wave_plate, DIRECTION, NUMBER, st.none() | LENGTH),
    st.builds(
        lambda axis, n, d: polarisers.Retarder(axis, polarisers.Birefringence(n, CALCITE_E.index, d)),
        DIRECTION, INDEX, LENGTH,
    ),
    st.builds(lambda axis, z: polarisers.JonesPlate([[z, 0], [0, 1j * z]], axis), DIRECTION, PART),
    st.builds(gratings.Grating, DIRECTION, LENGTH, st.just((-1, 0, 2)), st.none() | AMPLITUDES),
    st.builds(
        lambda x, up, p: phase_plates.PhasePlate(np.arange(20.0).reshape(4, 5), (0, 0, 0), x, up, p),
        st.just((0.3, 0.1, 0.2)), st.tuples(NUMBER, st.floats(5.0, 9.0), NUMBER), LENGTH,
    ),
)  # fmt: skip


@SETTINGS
@given(ELEMENTS)
def test_elements_come_back(folder, element):
    assert same(again(element, Interface | elements.Element, folder), element)


def test_large_arrays_stand_beside(tmp_path):
    shelf = Shelf(tmp_path / "it.toml")
    values = np.random.default_rng(1).normal(size=(5, 5))
    assert encode(values, FloatArray, ("form", "heights"), shelf) == {"file": "it.form-heights.npy"}
    assert encode(values[0], FloatArray, ("a",), shelf) == values[0].tolist()
    assert list(shelf.files) == ["it.form-heights.npy"]
    few = np.array([1.0 + 0.0j, -0.0 - 2.5j])
    assert encode(few, ComplexArray, ("a",), shelf) == ["1.0+0.0i", "-0.0-2.5i"]


def test_meshes_of_files_are_referred_to_with_their_moves(tmp_path):
    meshes.save(ft.shapes.step(2 * mm, 2 * mm, 0.1 * mm, 100 * nm), tmp_path / "step.stl", "mm")
    mesh = meshes.load(tmp_path / "step.stl", "mm").moved((0.1, 0, 0))
    mesh = mesh.moved((0, 0, 0.3), ft.vectors.rotation((1, 2, 3), 0.7))
    written = encode(mesh, Mesh, ("x",), Shelf(tmp_path / "it.toml"))
    assert (written["file"], written["unit"], len(written["pose"])) == ("step.stl", "mm", 2)
    assert same(again(mesh, Mesh, tmp_path), mesh)
    below = Shelf(tmp_path / "deep" / "it.toml")
    assert encode(mesh, Mesh, ("x",), below) == {"file": "it.x.npz", "unit": "m"}
    allowed = Shelf(tmp_path / "deep" / "it.toml", outside=True)
    assert encode(mesh, Mesh, ("x",), allowed)["file"] == "../step.stl"


@pytest.mark.parametrize("change", [lambda file: file.unlink(), lambda file: file.write_bytes(b"solid no")])
def test_meshes_whose_file_has_changed_stand_beside(tmp_path, change):
    file = tmp_path / "step.stl"
    meshes.save(ft.shapes.step(2 * mm, 2 * mm, 0.1 * mm, 100 * nm), file, "mm")
    mesh = meshes.load(file, "mm")
    change(file)
    assert encode(mesh, Mesh, ("x",), Shelf(tmp_path / "it.toml")) == {"file": "it.x.npz", "unit": "m"}
    assert same(again(mesh, Mesh, tmp_path).vertices, mesh.vertices)


def test_what_is_no_data_is_refused(tmp_path):
    shelf = Shelf(tmp_path / "it.toml")
    beam = Beam((0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 1), (2, 2), lambda x, y: x)
    message = "beam.0.profile: expected data that a scene file can hold, got the function <lambda>"
    with pytest.raises(ValueError, match=re.escape(message)):
        encode(beam, Beam, ("beam", 0), shelf)
    lens = phase_plates.zone_plate((0, 0, 0), (0, 0, 1), 0.1)
    with pytest.raises(ValueError, match=r"x\.gradient: expected data .*, got the function slopes"):
        encode(lens, elements.Element, ("x",), shelf)
    with pytest.raises(ValueError, match="x: expected data that a scene file can hold, got set"):
        encode({1}, Profile, ("x",), shelf)
