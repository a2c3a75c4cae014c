"""Representations: short, useful, and never the numbers of an array."""

import re
import warnings
from dataclasses import dataclass, fields, is_dataclass, replace
from importlib import import_module
from inspect import isclass
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.core import described, length_text, short_repr, value_text
from fringetrace.field import Field, reconstruct, reconstruct_facet_waves
from fringetrace.instruments import Arms, Mark
from fringetrace.rigorous import mie

FOLDERS = sorted(path.parent.name for path in Path(ft.__file__).parent.glob("*/__init__.py"))
LONGEST = 300
BENCH = ft.instruments.michelson(
    ft.shapes.plate(8 * mm, 8 * mm), aperture=6 * mm, reference_tilt=(2e-4, 0.0), pixels=(6, 8)
)


def structured(thing):
    """Whether something is a class with named fields."""
    return isclass(thing) and (is_dataclass(thing) or hasattr(thing, "_fields"))


def offered():
    """Public classes with fields that doors offer, themselves or in a module."""
    found = {}
    for folder in FOLDERS:
        door = import_module(f"fringetrace.{folder}")
        for value in (getattr(door, name) for name in door.__all__):
            names = vars(value).items() if isinstance(value, ModuleType) else [("", value)]
            for name, each in names:
                if structured(each) and not name.startswith("_"):
                    found[each.__qualname__] = each
    return found


OFFERED = offered()


def things():
    """One of each class that has a representation of its own."""
    paths, surface = BENCH.trace(), BENCH.scene.surfaces[1]
    yield from (BENCH, BENCH.scene, surface, surface.mesh, BENCH.beam, BENCH.ccd)
    yield from (paths, paths.ledger(), reconstruct(paths), ft.Rays(np.zeros((9, 3)), np.ones((9, 3))))
    yield from (Field.of(paths, 500 * nm), reconstruct_facet_waves(paths))
    yield from (ft.materials.BK7, ft.films.quarter_wave_stack(2.3, 1.4, 9, 500 * nm))
    yield ft.films.fresnel(1.0, 1.5, np.linspace(0, 1, 50))
    yield mie.efficiencies(1e-7, 1.5, 1.0, 5e-7)


with warnings.catch_warnings():  # the fringes of so few pixels alias
    warnings.simplefilter("ignore", ft.FringetraceWarning)
    THINGS = {type(thing).__name__: thing for thing in things()}


def check(text):
    assert len(text) < LONGEST
    assert "\n" not in text
    assert not re.search(r"array\(|\[\[|0x[0-9a-f]{6}", text)


@pytest.mark.parametrize("name", OFFERED)
def test_no_public_class_shows_arrays(name):
    """Fields filled with large arrays, long texts and long tuples."""
    kind = OFFERED[name]
    if kind.__repr__ is not short_repr and name in THINGS:
        return  # has one of its own, see below
    names = [field.name for field in fields(kind)] if is_dataclass(kind) else kind._fields
    annotations = kind.__annotations__
    large = {n: np.full((1000, 3), 1.0 / 3.0) if "Array" in str(annotations[n]) else 1.0 / 3.0 for n in names}
    if hasattr(kind, "_fields"):
        thing = kind(**large)
    else:
        thing = object.__new__(kind)
        for field, value in large.items():
            object.__setattr__(thing, field, value)
    check(repr(thing))


@pytest.mark.parametrize("name", THINGS)
def test_those_with_their_own_are_short_too(name):
    check(repr(THINGS[name]))
    assert repr(THINGS[name]).startswith(f"{name}(")


def test_an_interferometer_says_its_arms_its_pixels_and_whether_it_is_traced():
    fresh = replace(BENCH)
    assert repr(fresh) == (
        "Interferometer(reference 'reference' tilted by (200, 0) urad, sample 'sample', "
        "8 x 6 pixels of 750 um, 8 x 6 rays, not traced)"
    )
    fresh.trace()
    assert "traced at any wavelength" in repr(fresh)


def test_paths_say_how_many_what_became_of_them_and_how_long_they_are():
    paths = BENCH.trace()
    assert repr(paths) == (
        "Paths(192 paths: 96 detected, 96 left, 3 to 3 bounces, optical paths 24 mm to 24 mm)"
    )
    assert repr(paths.where(paths.bounces > 99)) == "Paths(no paths)"
    assert "<th>detected</th>" in paths._repr_html_()
    assert "50.0" in paths.ledger()._repr_html_()


def test_a_scene_says_its_surfaces():
    expected = "Scene(3 surfaces: splitter (BeamSplitter), sample (Mirror), reference (Mirror))"
    assert repr(BENCH.scene) == expected
    many = ft.Scene([replace(BENCH.scene.surfaces[1], name=f"s{i}") for i in range(100)], medium="water")
    assert repr(many).startswith("Scene(100 surfaces: s0 (Mirror), ")
    assert repr(many).endswith("..., in water)")


def test_values_in_few_characters():
    assert value_text(np.array([0.0, -0.0, -1.0])) == "(0, 0, -1)"
    assert value_text(np.zeros((3, 4))) == "<(3, 4) float64>"
    assert value_text(np.array(0.25)) == "0.25"
    assert value_text(1.0 / 3.0) == "0.333333"
    assert value_text(np.float32(0.5)) == "0.5"
    assert value_text(1.5 + 0.25j) == "1.5+0.25j"
    assert value_text(True) == "True"
    assert value_text(np.int64(7)) == "7"
    assert value_text((1, "two")) == "(1, 'two')"
    assert value_text((1,)) == "(1,)"
    assert value_text(list(range(9))) == "<9 items>"
    assert value_text({1: 2}) == "<1 items>"
    assert value_text(value_text) == "value_text"
    assert value_text(Arms(Mark(2))) == "Arms(reference=Mark(surface=2))"
    assert len(value_text("long" * 100)) == 60


@dataclass
class Thing:
    """Something with a default."""

    first: float
    second: float = 2.0

    __repr__ = short_repr


def test_defaults_are_left_out():
    assert repr(Thing(1.0)) == "Thing(first=1)"
    assert repr(Thing(1.0, 3.0)) == "Thing(first=1, second=3)"
    assert described(Thing(1.0), "one", "", "two") == "Thing(one, two)"
    assert len(described(Thing(1.0), "x" * 1000)) < LONGEST


@pytest.mark.parametrize(
    ("metres", "text"), [(15.62e-6, "15.62 um"), (0.0, "0 m"), (-2e-3, "-2 mm"), (np.inf, "inf m")]
)
def test_lengths_have_a_fitting_unit(metres, text):
    assert length_text(metres) == text
