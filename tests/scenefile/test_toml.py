"""TOML with its lines: each value knows where it stands, whatever way it is written."""

import re
import tomllib

import pytest
from hypothesis import given, settings, strategies as st

from fringetrace.scenefile.toml import Document, Place, choice, dump, parse

TEXT = '''\
# a comment with [brackets] and "quotes"
title = "a # b"
"quoted.key" = 1
a.b.c = 2

[table]  # another
list = [
    1, "]",  # ]
    [2, 3],
]
inline = { x = 1, y = { z = [1.5, 2] } }
many = """
[not.a.table]
x = 1 \\""" still""""
lone = \'\'\'
it's \\\'\'\'
day = 1979-05-27 07:32:00

[[point]]
x = 1
[point.pose]
angle = -1.5e-3
[[point]]
[[point.deep]]
y = true
[[point.deep]]
y = inf
'''


def paths(value, path=()):
    """Paths of all values."""
    if path:
        yield path
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in pairs:
        yield from paths(item, (*path, key))


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("title",), 2), (("quoted.key",), 3), (("a",), 4), (("a", "b", "c"), 4), (("table",), 6),
        (("table", "list"), 7), (("table", "list", 1), 8), (("table", "list", 2, 1), 9),
        (("table", "inline", "y", "z", 1), 11), (("table", "many"), 12), (("table", "lone"), 15),
        (("table", "day"), 17), (("point",), 19), (("point", 0, "x"), 20), (("point", 0, "pose"), 21),
        (("point", 0, "pose", "angle"), 22), (("point", 1), 23), (("point", 1, "deep", 0, "y"), 25),
        (("point", 1, "deep", 1), 26), (("point", 1, "deep", 1, "y"), 27),
    ],
)  # fmt: skip
def test_each_value_knows_its_line(path, line):
    assert parse(TEXT, "x.toml").lines[path] == line


def test_no_value_is_left_out_and_none_made_up():
    document = parse(TEXT, "x.toml")
    assert set(document.lines) == set(paths(document.values))


KEYS = st.text("ab.\"'# é", min_size=1, max_size=4)
LEAVES = st.one_of(
    st.integers(-9, 9), st.floats(allow_nan=False), st.booleans(), st.text("ab\"'#[]{}=,\n\\é", max_size=6)
)
VALUES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3), max_leaves=8
)


@settings(max_examples=150, deadline=None)
@given(st.dictionaries(KEYS, VALUES, max_size=4))
def test_what_is_written_is_read_again_with_a_line_for_each(values):
    text = dump(values)
    assert tomllib.loads(text) == values
    document = parse(text, "x.toml")
    assert set(document.lines) == set(paths(values))
    lines = text.split("\n")
    for path, line in document.lines.items():
        if isinstance(path[-1], str) and path[-1].isalpha() and path[-1].isascii():
            assert path[-1] in lines[line - 1]


@pytest.mark.parametrize(("text", "line"), [("a = 1\nb = = 2\n", 2), ("a = 1\n[b\n", 2), ("a = [1,\n", 2)])
def test_what_is_no_toml_is_refused_by_its_line(text, line):
    with pytest.raises(
        ValueError, match=rf"x\.toml:{line}: expected TOML, got something that does not parse"
    ):
        parse(text, "x.toml")


def test_an_error_stands_at_the_nearest_line_that_is_known():
    document = Document("x.toml", {}, {("a",): 3})
    assert str(document.error(("a", "b", 0), "no")) == "x.toml:3: no"
    assert str(document.error((), "no")) == "x.toml:1: no"


def test_a_wrong_word_is_shown_the_nearest_one_if_one_is_near():
    assert choice("Miror", ["Mirror", "Metal"]) == (
        "expected one of Mirror, Metal, got 'Miror', did you mean 'Mirror'?"
    )
    assert choice("zzz", ["Mirror"]) == "expected one of Mirror, got 'zzz'"


def test_files_outside_of_the_folder_are_refused(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "link").symlink_to(tmp_path)
    document = Document("x.toml", {}, {("file",): 7})
    place = Place(document, tmp_path / "in").at("file")
    assert place.file("deep/../a.stl") == (tmp_path / "in" / "a.stl").resolve()
    for name in ("../a.stl", str(tmp_path / "a.stl"), "link/a.stl", "/etc/passwd"):
        with pytest.raises(ValueError, match=r"x\.toml:7: file: expected a file in the folder of the scene"):
            place.file(name)
    assert Place(document, tmp_path / "in", outside=True).file("../a.stl") == (tmp_path / "a.stl").resolve()
    for name in ("", 3):
        with pytest.raises(ValueError, match=f"expected the name of a file, got {re.escape(repr(name))}"):
            place.file(name)
