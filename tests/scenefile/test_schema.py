"""The words of scene files: all of them read off the package itself."""

import inspect

import pytest

from fringetrace import instruments
from fringetrace.geometry import forms, mesh, shapes
from fringetrace.geometry.mesh import Mesh
from fringetrace.instruments.interferometer import Interferometer
from fringetrace.optics import films, interfaces, polarisers
from fringetrace.optics.materials.material import Material
from fringetrace.scene import model, sensor, sources
from fringetrace.scenefile.schema import Recipe, call, concrete, kinds, members, parameters

HINTS = {name: parameter.hint for name, parameter in parameters(model.Surface).items()}
EVERY = [
    kind
    for some in ([Mesh], [Interferometer], [Material], *(members(hint) for hint in HINTS.values()))
    for kind in kinds(some).values()
]


def test_units_are_those_of_the_docstrings():
    assert {name: p.unit for name, p in parameters(sources.Beam).items()} == {
        "centre": "m", "direction": "", "up": "", "size": "m", "shape": "", "profile": "m", "passes": "",
        "polarisation": "",
    } | {"profile": ""}  # fmt: skip
    units = {name: p.unit for name, p in parameters(instruments.michelson).items()}
    assert (units["aperture"], units["reference_tilt"], units["rays"]) == ("m", "rad", "")
    assert parameters(forms.Conic)["radius"].unit == "m"
    assert parameters(forms.Conic)["terms"].unit == ""  # m^-3 and so on
    assert parameters(films.Film)["layers"].unit == "m"


@pytest.mark.parametrize("kind", EVERY, ids=lambda kind: kind.__name__)
def test_every_parameter_of_every_kind_is_documented_by_name(kind):
    text = inspect.getdoc(kind)
    assert text
    for name in parameters(kind):
        assert name in text, name


def test_benches_and_shapes_are_found_by_what_they_return():
    benches = kinds([Interferometer])
    assert benches["michelson"] is instruments.michelson
    public = [getattr(instruments, name) for name in instruments.__all__]
    made = [f for f in public if inspect.isfunction(f) and f.__annotations__["return"] == "Interferometer"]
    assert list(benches.values()) == made
    assert kinds([Mesh])["rod_lattice"] is shapes.rod_lattice
    assert "load" not in kinds([Mesh]) | kinds([Material])


def test_kinds_are_those_that_a_parameter_takes():
    assert set(kinds(members(HINTS["form"]))) == {"Sphere", "Cylinder", "Conic", "HeightField", "Smooth"}
    found = kinds(members(HINTS["interface"]))
    assert found["Mirror"] is interfaces.Mirror
    assert found["wave_plate"] is polarisers.wave_plate
    assert not {"Sphere", "IncidentRays", "Branch", "IndexFormula", "Film"} & set(found)
    assert "Gaussian" in kinds(members(parameters(sources.Beam)["profile"].hint))


def test_alternatives_are_listed_without_none():
    assert members(int | None) == (int,)
    assert members(int | float | None) == (int, float)
    assert concrete(members(sensor.CCD | None)) == [sensor.CCD]


def test_all_further_arguments_are_a_list():
    several = parameters(kinds([Material])["cauchy"])["terms"]
    assert several.several
    assert not several.required
    made = call(kinds([Material])["cauchy"], {"a": 1.5, "terms": (1e-14,), "name": "x"})
    assert made.index(1e-6) == pytest.approx(1.51)


def test_a_recipe_makes_its_bench_once():
    recipe = Recipe("michelson", {"sample": mesh.Mesh(*_square()), "aperture": 1.0, "pixels": (2, 2)})
    assert recipe.bench is recipe.bench
    assert recipe.bench.ccd.shape == (2, 2)


def _square():
    flat = shapes.plate(2.0, 2.0)
    return flat.vertices, flat.faces


def test_a_recipe_of_nothing_known_is_refused():
    with pytest.raises(ValueError, match=r"bench type: expected one of .*, did you mean 'michelson'\?"):
        Recipe("michelsen", {})
    with pytest.raises(ValueError, match=r"michelson apertur: expected one of .*, did you mean 'aperture'\?"):
        Recipe("michelson", {"apertur": 1.0})
