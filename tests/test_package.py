"""The package as a whole: light to import, each heavy library in the hands of one room, nothing printed."""

import ast
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import fringetrace as ft

ROOT = Path(__file__).resolve().parents[1]
ROOMS = {path.stem: ast.parse(path.read_text()) for path in Path(ft.__file__).parent.glob("*.py")}
# What a table of libraries calls by another name than an import statement.
MODULE = {"scikit-image": "skimage", "pyyaml": "yaml", "colour-science": "colour"}
HEAVY = [
    "numba", "embreex", "trimesh", "prysm", "scipy", "skimage", "matplotlib", "pyvista", "vtk", "vtkmodules",
    "finufft", "distributed", "dask", "xarray", "h5netcdf", "h5py", "pandas", "tifffile", "cyclopts", "rich",
    "PIL", "yaml", "colour", "tomlkit", "plotly",
]  # fmt: skip


def imported(tree):
    """Names of the top packages that a module imports anywhere."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names.add((node.module or "").partition(".")[0])
    return names


def room_map():
    """The map of CONTRIBUTING: the libraries that only one room imports."""
    text = (ROOT / "CONTRIBUTING.md").read_text()
    rows = re.findall(r"^\| `(\w+)` \|[^|]*\|([^|]*)\|$", text, flags=re.MULTILINE)
    return {room: {MODULE.get(name, name) for name in re.findall(r"[\w-]+", cell)} for room, cell in rows}


@pytest.mark.parametrize(
    "room",
    [
        "",
        ".scene",
        ".shapes",
        ".trace",
        ".phase",
        ".instruments",
        ".goniometer",
        ".commands",
        ".reflectances",
        ".spectra",
        ".bsdf",
    ],
)
def test_importing_loads_nothing_heavy(room):
    code = f"import fringetrace{room}, sys; print(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True
    )
    assert not set(HEAVY) & set(run.stdout.split())
    assert run.stderr == ""


def test_all_that_is_promised_is_there():
    assert sorted(ft.__all__) == sorted(set(ft.__all__))
    for name in ft.__all__:
        assert getattr(ft, name) is not None
        assert name in dir(ft)
    assert not [name for name in ft.__all__ if name.startswith("_")]


def test_what_is_not_there_says_so():
    with pytest.raises(AttributeError, match="module 'fringetrace' has no attribute 'lens'"):
        ft.lens


def test_the_version_is_that_of_the_metadata():
    assert ft.__version__ == version("fringetrace")
    assert re.fullmatch(r"\d+\.\d+\.\d+", ft.__version__)


def test_the_types_are_shipped():
    assert (Path(ft.__file__).parent / "py.typed").is_file()


def test_the_map_names_every_room():
    assert set(room_map()) == set(ROOMS) - {"__init__"}


def test_each_heavy_library_is_imported_by_its_room_alone():
    declared = room_map()
    libraries = set().union(*declared.values())
    assert len(libraries) > 8
    assert {"numba", "embreex", "trimesh", "pyvista", "matplotlib", "skimage", "xarray"} <= libraries
    for room, tree in ROOMS.items():
        assert imported(tree) & (libraries | set(HEAVY)) == declared.get(room, set()), room


def test_no_room_but_the_command_prints():
    calls = {
        room: [
            node.lineno
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "print"
        ]
        for room, tree in ROOMS.items()
        if room != "cli"
    }
    assert not {room: lines for room, lines in calls.items() if lines}


def test_no_room_changes_anything_at_module_level():
    assert not {
        room for room, tree in ROOMS.items() if any(isinstance(node, ast.Global) for node in ast.walk(tree))
    }
