"""The page about other programs does what it says."""

import re
import runpy
from pathlib import Path

from matplotlib.image import imread

PAGE = Path(__file__).parents[1] / "docs" / "interop.md"


def test_the_snippets_run_one_after_the_other(tmp_path, monkeypatch):
    snippets = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(), flags=re.MULTILINE | re.DOTALL)
    (tmp_path / "page.py").write_text("\n".join(snippets))
    monkeypatch.chdir(tmp_path)
    left = runpy.run_path("page.py")
    assert len(snippets) == 8
    assert left["row"].dims == ("x",)
    assert left["surface"].mesh.bounds[1, 2] == left["z"].max()
    assert left["back"].attrs["wavelength_m"] == 632.8e-9
    assert {imread(name).ndim for name in ("maps.png", "spectra.png")} == {3}
