"""README and docs: Python blocks run or name what there is; links, files and functions named exist."""

import ast
import inspect
import re
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import fringetrace as ft

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "fringetrace"
README = (ROOT / "README.md").read_text(encoding="utf-8")
WRITTEN = [path for path in (ROOT / "docs").rglob("*.md") if path.parent.name in {"docs", "from"}]
PAGES = sorted([ROOT / "README.md", *WRITTEN])
BLOCK = re.compile(r"^```python( run)?\n(.*?)^```$", flags=re.DOTALL | re.MULTILINE)
NAMED = re.compile(r"`([\w/]+\.py): ([\w.]+)`")
LINK = re.compile(r"\]\((?!https?:|#)([^)#\s]+)")


def name(page):
    return str(page.relative_to(ROOT))


def blocks(page, run=False):
    """Text of the blocks of a page: those that run, or all."""
    return [text for mark, text in BLOCK.findall(page.read_text(encoding="utf-8")) if mark or not run]


def imported(tree, known):
    """Names that a block imports from the package, and those known before."""
    known = dict(known)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("fringetrace"):
            module = import_module(node.module)
            known |= {alias.asname or alias.name: getattr(module, alias.name) for alias in node.names}
    return known


def resolved(node, known):
    """What a dotted name stands for, as far as modules and classes tell; None if that is not known."""
    if isinstance(node, ast.Name):
        return known.get(node.id)
    owner = resolved(node.value, known) if isinstance(node, ast.Attribute) else None
    return getattr(owner, node.attr) if isinstance(owner, ModuleType | type) else None


def unknown_keywords(call, known):
    """Keywords of a call that what is called does not have."""
    called = resolved(call.func, known)
    if not callable(called):
        return set()
    parameters = inspect.signature(called).parameters.values()
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters):
        return set()
    return {keyword.arg for keyword in call.keywords} - {parameter.name for parameter in parameters} - {None}


def check(text, known):
    """Names and keywords of a block exist; what it has imported, for the next one."""
    tree = ast.parse(text)
    known = imported(tree, known)
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            resolved(node, known)  # AttributeError for what is not there
        if isinstance(node, ast.Call):
            assert unknown_keywords(node, known) == set(), ast.unparse(node)
    return known


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)], ids=name)
def test_python_in_the_docs_names_what_there_is(page):
    known = {"ft": ft}
    for text in blocks(page):
        known = check(text, known)


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, run=True)], ids=name)
def test_python_in_the_docs_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    for text in blocks(page, run=True):
        exec(compile(text, name(page), "exec"), names)


def test_a_wrong_name_is_seen():
    with pytest.raises(AttributeError, match=r"attribute '?mechelson"):
        check("ft.instruments.mechelson(sample)", {"ft": ft})
    with pytest.raises(AssertionError, match="aperture_"):
        check("ft.instruments.michelson(sample, aperture_=1)", {"ft": ft})


@pytest.mark.parametrize("page", [ROOT / "README.md", ROOT / "CONTRIBUTING.md"], ids=name)
def test_links_lead_to_files(page):
    links = LINK.findall(page.read_text(encoding="utf-8"))
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_readme_has_twelve_lines_of_python():
    (text,) = blocks(ROOT / "README.md")
    assert len([line for line in text.splitlines() if line]) == 12


def defined(tree):
    """Names of functions and classes in a module, methods after the name of their class."""
    found = set()
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
            found |= (
                {f"{node.name}.{each}" for each in defined(node)} if isinstance(node, ast.ClassDef) else set()
            )
    return found


def missing(page):
    """Functions that a page names as `file: function`, relative to the package, and that do not exist."""
    lost = []
    for file, function in NAMED.findall(page):
        source = PACKAGE / file
        if not source.exists() or function not in defined(ast.parse(source.read_text(encoding="utf-8"))):
            lost.append(f"{file}: {function}")
    return lost


def test_functions_named_by_the_architecture_exist():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    assert len(NAMED.findall(page)) > 60
    assert missing(page) == []


def test_a_missing_function_is_seen():
    page = "`core/units.py: parse_length`, `core/units.py: parse_lenght`, `core/unit.py: parse_length`"
    assert missing(page) == ["core/units.py: parse_lenght", "core/unit.py: parse_length"]


def test_folders_of_the_readme_are_those_of_the_package_with_their_charters():
    rows = re.findall(r"^\| \[`(\w+)`\]\(src/fringetrace/\w+\) \| (.*) \|$", README, flags=re.MULTILINE)
    folders = {
        init.parent.name: ast.get_docstring(ast.parse(init.read_text()))
        for init in PACKAGE.glob("*/__init__.py")
    }
    assert dict(rows) == folders
