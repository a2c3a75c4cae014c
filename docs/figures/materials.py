"""Write the table of named materials in docs/materials.md: `python docs/figures/materials.py`."""

from __future__ import annotations

import pages

from fringetrace import nm
from fringetrace.optics.materials.material import Material
from fringetrace.optics.materials.named_materials import NAMED

# Hydrogen F and C, sodium D.
LINES = (486.13, 589.3, 656.27)


def index(material: Material, wavelength: float) -> str:
    """Index n + i kappa with five decimals."""
    value = material.index(wavelength * nm)
    return f"{value.real:.5f}" + (f" + {value.imag:.5f} i" if value.imag else "")


def row(material: Material) -> str:
    """One line of the table."""
    limits = "any" if material.range is None else " to ".join(f"{end / nm:.5g}" for end in material.range)
    cells = [f"`{material.name}`", *(index(material, line) for line in LINES), limits, material.source]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Put the table into the page."""
    head = ["name", *(f"{line:g} nm" for line in LINES), "range, nm", "source"]
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|", *map(row, NAMED)]
    pages.write("materials", "\n".join(lines), pages.DOCS / "materials.md")


if __name__ == "__main__":
    main()
