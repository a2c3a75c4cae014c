"""The package as a whole: light to import, folders with doors, each heavy library in one file."""

import ast
import re
import subprocess
import sys
from graphlib import TopologicalSorter
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

import pytest

import fringetrace as ft

ROOT = Path(__file__).resolve().parents[1]
HOME = Path(ft.__file__).parent
FILES = {
    path.relative_to(HOME).with_suffix("").as_posix(): ast.parse(path.read_text())
    for path in sorted(HOME.rglob("*.py"))
}
# What commands and scripts import before they know what they need.
FILES_TO_START = (
    ".scene.model", ".geometry.shapes", ".tracing.tracer", ".phase.heights", ".instruments.michelson_bench",
    ".scattering.goniometer", ".scattering.colour", ".scattering.bsdf_tables",
    ".cli.scene_commands", ".cli.brdf_commands",
)  # fmt: skip
FOLDERS = sorted(path.parent.name for path in HOME.glob("*/__init__.py"))
# What a table of libraries calls by another name than an import statement.
MODULE = {"scikit-image": "skimage", "pyyaml": "yaml", "colour-science": "colour"}
HEAVY = [
    "numba", "embreex", "trimesh", "prysm", "scipy", "skimage", "matplotlib", "pyvista", "vtk", "vtkmodules",
    "finufft", "distributed", "dask", "xarray", "h5netcdf", "h5py", "pandas", "tifffile", "cyclopts", "rich",
    "PIL", "yaml", "colour", "tomlkit", "plotly",
]  # fmt: skip


def at_run_time(tree):
    """All nodes but those for type checkers only."""
    if isinstance(tree, ast.If) and ast.unparse(tree.test) == "TYPE_CHECKING":
        return
    yield tree
    for node in ast.iter_child_nodes(tree):
        yield from at_run_time(node)


def imported(tree):
    """Names of the top packages that a module imports anywhere."""
    names = set()
    for node in at_run_time(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names.add((node.module or "").partition(".")[0])
    return names


def libraries():
    """The table of CONTRIBUTING: the libraries that only these files import."""
    text = (ROOT / "CONTRIBUTING.md").read_text()
    rows = re.findall(r"^\| `([\w/]+)\.py` \| ([^|]*) \|$", text, flags=re.MULTILINE)
    return {file: {MODULE.get(name, name) for name in re.findall(r"[\w-]+", cell)} for file, cell in rows}


@pytest.mark.parametrize(
    "place",
    ["", *(f".{folder}" for folder in FOLDERS), *FILES_TO_START],
)
def test_importing_loads_nothing_heavy(place):
    code = f"import fringetrace{place}, sys; print(*sys.modules)"
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
    assert [name for name in ft.__all__ if name.startswith("_")] == ["__version__"]


def test_what_is_not_there_says_so():
    with pytest.raises(AttributeError, match=r"fringetrace .*lens"):
        ft.lens


def test_the_version_is_that_of_the_metadata():
    assert ft.__version__ == version("fringetrace")
    assert re.fullmatch(r"\d+\.\d+\.\d+", ft.__version__)


def test_the_types_are_shipped():
    assert (Path(ft.__file__).parent / "py.typed").is_file()


def imports(tree):
    """Modules of the package that a file imports anywhere, with the names taken from them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "fringetrace":
            yield node.module, [alias.name for alias in node.names]


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_door_says_what_its_folder_is_for_and_offers_what_it_promises(folder):
    door = import_module(f"fringetrace.{folder}")
    assert door.__doc__.strip().endswith(".")
    assert "\n\n" not in door.__doc__.strip()
    for name in door.__all__:
        assert getattr(door, name) is not None, name
        assert not name.startswith("_") or name == "__version__"


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_name_of_a_door_hides_a_file(folder):
    door = import_module(f"fringetrace.{folder}")
    files = {path.stem for path in (HOME / folder).glob("*.py")}
    hidden = [
        name for name in door.__all__ if name in files and not isinstance(getattr(door, name), ModuleType)
    ]
    assert hidden == []


def test_across_folders_only_doors_are_imported():
    assert not {
        (file, module)
        for file, tree in FILES.items()
        for module, _ in imports(tree)
        if module.count(".") > 1 and module.split(".")[1] != file.split("/")[0]
    }


def test_no_files_import_each_other_in_a_ring():
    arrows = {}
    for file, tree in FILES.items():
        for module, names in imports(tree):
            path = "/".join(module.split(".")[1:])
            arrows.setdefault(file, set()).update({path, *(f"{path}/{name}" for name in names)} & set(FILES))
    TopologicalSorter(arrows).prepare()  # raises CycleError, with the ring


def test_each_heavy_library_is_imported_by_its_file_alone():
    declared = libraries()
    known = set().union(*declared.values())
    assert len(known) > 8
    assert {"numba", "embreex", "trimesh", "pyvista", "matplotlib", "skimage", "xarray"} <= known
    assert set(declared) <= set(FILES)
    for file, tree in FILES.items():
        assert imported(tree) & (known | set(HEAVY)) == declared.get(file, set()), file


def test_nothing_but_the_command_prints():
    calls = {
        file: [
            node.lineno
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "print"
        ]
        for file, tree in FILES.items()
        if not file.startswith("cli/")
    }
    assert not {file: lines for file, lines in calls.items() if lines}


def test_nothing_changes_anything_at_module_level():
    assert not {
        file for file, tree in FILES.items() if any(isinstance(node, ast.Global) for node in ast.walk(tree))
    }


# Names with two homes: functions of views are called what they draw, verbs act on nouns of their module.
SHARED = {"brdf", "height", "work_precision", "save", "load"}


def test_no_two_public_things_share_a_name():
    homes = {}
    for door in HOME.glob("*/__init__.pyi"):
        for node in ast.parse(door.read_text()).body:
            for alias in node.names:
                homes.setdefault(alias.name, set()).add(f"{door.parent.name}.{node.module}")
    for file, tree in FILES.items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes.setdefault(node.name, set()).add(file.replace("/", "."))
    assert {name: home for name, home in homes.items() if len(home) > 1 and name not in SHARED} == {}
