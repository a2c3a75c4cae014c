"""What the site shows besides pages: the reference, written from docstrings, and what examples leave."""

from __future__ import annotations

import re
import shutil
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fringetrace

if TYPE_CHECKING:
    from sphinx.application import Sphinx

DOCS = Path(__file__).parent
EXAMPLES = DOCS.parent / "examples"
# Rooms that one imports by name, beside those that `import fringetrace` offers.
FURTHER = (
    "detectors", "guards", "illumination", "lines", "precision", "rig", "rods", "single", "standards",
    "waves",
)  # fmt: skip


def page(name: str) -> str:
    """The page of the reference on a module, in reStructuredText."""
    return f"{name}\n{'=' * len(name)}\n\n.. automodule:: {name}\n   :members:\n"


def overview(rooms: list[str]) -> str:
    """The first page of the reference: each room with the first sentence of its docstring."""
    rows = [
        "| [`fringetrace`](fringetrace.rst) | What comes with `import fringetrace as ft`: `ft.` and a name. |"
    ]
    for room in rooms:
        text = (import_module(f"fringetrace.{room}").__doc__ or "").split("\n\n")[0]
        rows.append(f"| [`{room}`]({room}.rst) | {' '.join(text.split())} |")
    toctree = ["```{toctree}", ":hidden:", "fringetrace", *rooms, "```"]
    return "\n".join(["# Reference", "", "| | |", "|---|---|", *rows, "", *toctree, ""])


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
    rooms = sorted([*fringetrace._ROOMS, *FURTHER])
    pages = {f"{room}.rst": page(f"fringetrace.{room}") for room in rooms}
    renew(DOCS / "reference", pages | {"fringetrace.rst": page("fringetrace"), "index.md": overview(rooms)})


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
    for start in ("fringetrace", node.get("py:module")):
        target = f"{start}.{node['reftarget']}"
        found = env.domains["py"].resolve_xref(
            env, node.get("refdoc"), app.builder, "obj", target, node, content
        )
        if found:
            return found
    return content


def leavings(block: Any, variables: dict[str, Any], settings: dict[str, Any]) -> str:
    """Take the pictures that an example left in its folder to the gallery; the text that shows them."""
    from sphinx_gallery.scrapers import figure_rst

    taken = []
    for picture in sorted(Path(variables["src_file"]).parent.glob("*.png")):
        taken.append(next(variables["image_path_iterator"]))
        shutil.move(picture, taken[-1])
    return figure_rst(taken, settings["src_dir"]) if taken else ""
