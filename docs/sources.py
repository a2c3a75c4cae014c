"""Sources of the site beside its pages: the reference, written from the folders' doors, and the notebooks."""

from __future__ import annotations

import ast
import re
import shutil
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

DOCS = Path(__file__).parent
EXAMPLES = DOCS.parent / "examples"
SOURCE = DOCS.parent / "src" / "fringetrace"
# The order in which the reference lists the folders: as their imports, the command line first.
FOLDERS = (
    "cli", "scenefile", "validation", "views", "instruments", "scattering", "accuracy", "field", "tracing",
    "scene", "rigorous", "optics", "geometry", "phase", "core",
)  # fmt: skip


def exports(stub: Path) -> dict[str, str]:
    """Names that a door offers, each with the module that it comes from; a module comes from itself."""
    found = {}
    for node in ast.parse(stub.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom):
            for alias in node.names:
                found[alias.name] = node.module or alias.name
    return found


def modules(folder: str) -> list[str]:
    """Public modules of a folder: those that its door offers by name."""
    return sorted(
        name for name, origin in exports(SOURCE / folder / "__init__.pyi").items() if name == origin
    )


def summary(name: str) -> str:
    """First paragraph of a module's docstring, on one line."""
    return " ".join((import_module(name).__doc__ or "").split("\n\n")[0].split())


def page(name: str) -> str:
    """Page of a module, in reStructuredText."""
    return f"{name}\n{'=' * len(name)}\n\n.. automodule:: {name}\n   :members:\n"


def folder_page(folder: str) -> str:
    """Page of a folder: the names of its door, and links to its public modules, which document the rest."""
    own = set(modules(folder))
    elsewhere = sorted(
        name
        for name, origin in exports(SOURCE / folder / "__init__.pyi").items()
        if origin.split(".")[0] in own and name not in own
    )
    text = page(f"fringetrace.{folder}")
    if not own:
        return text
    rows = [f"- :doc:`{folder}.{each}`: {summary(f'fringetrace.{folder}.{each}')}" for each in sorted(own)]
    toctree = [".. toctree::", "   :hidden:", "", *(f"   {folder}.{each}" for each in sorted(own))]
    text += f"   :exclude-members: {', '.join(elsewhere)}\n"
    return "\n".join([text, "Modules", "-------", "", *rows, "", *toctree, ""])


def shortcuts() -> str:
    """Page of the names that `import fringetrace as ft` offers, each linked to where it is documented."""
    found = exports(SOURCE / "__init__.pyi")
    rows = ["| name | documented as |", "|---|---|"]
    for name in sorted((name for name in found if name not in FOLDERS), key=str.lower):
        rows.append(f"| `ft.{name}` | {{py:obj}}`fringetrace.{found[name]}.{name}` |")
    text = "After `import fringetrace as ft` these names are in `ft`, without their folder."
    return "\n".join(["# Shortcuts", "", text, "", *rows, ""])


def overview() -> str:
    """First page of the reference: the folders with their charters."""
    rows = ["| folder | what it is for |", "|---|---|"]
    rows += [f"| [`{each}`]({each}.rst) | {summary(f'fringetrace.{each}')} |" for each in FOLDERS]
    toctree = ["```{toctree}", ":hidden:", "shortcuts", *FOLDERS, "```"]
    text = "One page a folder; [shortcuts](shortcuts.md) lists the names that `ft.` offers without a folder."
    return "\n".join(["# Reference", "", text, "", *rows, "", *toctree, ""])


def renew(folder: Path, texts: dict[str, str]) -> None:
    """Let a folder hold these files and no others; those that are the same are not touched."""
    folder.mkdir(exist_ok=True)
    for old in {path.name for path in folder.iterdir()} - set(texts):
        (folder / old).unlink()
    for name, text in texts.items():
        file = folder / name
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def write_reference(app: Sphinx) -> None:
    """Write the pages of the reference."""
    texts = {f"{folder}.rst": folder_page(folder) for folder in FOLDERS}
    for folder in FOLDERS:
        texts |= {f"{folder}.{each}.rst": page(f"fringetrace.{folder}.{each}") for each in modules(folder)}
    renew(DOCS / "reference", texts | {"shortcuts.md": shortcuts(), "index.md": overview()})


def tidy_gallery(app: Sphinx) -> None:
    """Take away the pages of examples that are gone."""
    for page in (DOCS / "gallery").glob("[0-9]*"):
        if not (EXAMPLES / f"{page.name.split('.')[0]}.py").exists():
            page.unlink()


def copy_notebooks(app: Sphinx) -> None:
    """Bring the notebooks of examples/ to where Sphinx finds them, with a page that lists them."""
    texts = {path.name: path.read_text(encoding="utf-8") for path in EXAMPLES.glob("*.ipynb")}
    listed = ["```{toctree}", *sorted(name.removesuffix(".ipynb") for name in texts), "```"]
    index = ["# Notebooks", "", "From `examples/`, run when this site is built.", "", *listed, ""]
    renew(DOCS / "notebooks", texts | {"index.md": "\n".join(index)})


def escape(app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Keep |E| in docstrings from being read as a substitution; what stands in backticks is left alone."""
    for number, line in enumerate(lines):
        parts = re.split(r"(`+[^`]*`+)", line)
        parts[::2] = [part.replace("|", r"\|") for part in parts[::2]]
        lines[number] = "".join(parts)


def link(app: Sphinx, env: Any, node: Any, content: Any) -> Any:
    """Names in docstrings lead to what they name; those that name nothing of the reference stay code."""
    if node.get("reftype") != "obj":
        return None
    domain, target = env.domains["py"], node["reftarget"]
    known = [name for name in domain.objects if name == target or name.endswith(f".{target}")]
    near = [name for name in known if name.startswith(f"{node.get('py:module')}.")] or known
    if not near:
        return content
    shortest = min(near, key=lambda name: (name.count("."), name))
    return domain.resolve_xref(env, node["refdoc"], app.builder, "obj", shortest, node, content) or content


def leavings(block: Any, variables: dict[str, Any], settings: dict[str, Any]) -> str:
    """Take the pictures that an example left in its folder to the gallery; the text that shows them."""
    from sphinx_gallery.scrapers import figure_rst

    taken = []
    for picture in sorted(Path(variables["src_file"]).parent.glob("*.png")):
        taken.append(next(variables["image_path_iterator"]))
        shutil.move(picture, taken[-1])
    return figure_rst(taken, settings["src_dir"]) if taken else ""
