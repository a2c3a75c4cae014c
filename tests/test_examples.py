"""What examples have in common: short, titled as a gallery wants, one picture, no library of their own."""

import ast
import json
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPTS = sorted((ROOT / "examples").glob("*.py"))
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
MOST = 60  # lines


def imported(tree):
    """Names of the packages that a script imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield (node.module or "").partition(".")[0]


def test_there_are_examples_and_the_index_names_each():
    index = (ROOT / "examples" / "README.rst").read_text()
    assert re.findall(r"^- ``([^`]+)``", index, re.MULTILINE) == [f.name for f in [*SCRIPTS, *NOTEBOOKS]]
    assert len(SCRIPTS) > 10


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_script_is_short_titled_and_names_its_picture(script):
    text = script.read_text()
    assert len(text.splitlines()) <= MOST
    tree = ast.parse(text)
    start, title, underline, blank, first, *_ = ast.get_docstring(tree, clean=False).splitlines()
    assert (start, blank) == ("", "")
    assert title
    assert underline == "=" * len(title)
    assert first
    strings = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)]
    pictures = [s for s in strings if isinstance(s, str) and s.endswith(".png")]
    assert pictures == [f"{script.stem}.png"]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    known = {re.split(r"[<>=\[;]", name)[0].strip() for name in project["dependencies"]}
    assert set(imported(tree)) - sys.stdlib_module_names <= known | {"fringetrace"}


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda notebook: notebook.stem)
def test_a_notebook_is_kept_without_outputs(notebook):
    cells = [c for c in json.loads(notebook.read_text())["cells"] if c["cell_type"] == "code"]
    assert len(cells) > 3
    assert not any(cell["outputs"] or cell["execution_count"] for cell in cells)
