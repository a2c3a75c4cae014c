"""How the site is built: python -m sphinx -W --keep-going docs build/docs.

Pages are Markdown, the reference comes from docstrings, the gallery from examples/, which are run.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import fringetrace

if TYPE_CHECKING:
    from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
# FAST shows examples without running them: for a look at pages.
FAST = "FRINGETRACE_DOCS_FAST" in os.environ

project = "fringetrace"
author = "The fringetrace developers"
version = release = fringetrace.__version__
extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["gallery/*.ipynb", "gallery/*.py", "**.part"]
nitpicky = True
nitpick_ignore = [("py:class", "numpy.longdouble")]
html_theme = "furo"
html_title = f"fringetrace {release}"
html_copy_source = False

myst_heading_anchors = 3
nb_execution_mode = "off" if FAST else "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300

# Docstrings say shapes and units in words: types stay as they are written.
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
default_role = "py:obj"

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"/\d\d_",
    "within_subsection_order": "FileNameSortKey",
    "image_scrapers": ("sources.leavings",),
    "reset_modules": (),
    "capture_repr": (),
    "download_all_examples": False,
    "write_computation_times": False,
    "plot_gallery": not FAST,
}


def setup(app: Sphinx) -> None:
    """Connect what writes the reference and makes links of the names in docstrings."""
    import sources

    app.connect("builder-inited", sources.write_reference, priority=100)
    app.connect("builder-inited", sources.copy_notebooks, priority=100)
    app.connect("builder-inited", sources.tidy_gallery, priority=100)
    app.connect("autodoc-process-docstring", sources.escape, priority=100)
    app.connect("missing-reference", sources.link)
