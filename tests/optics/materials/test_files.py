"""Files of refractive indices: what is read, and what is said of bad ones."""

import numpy as np
import pytest

from fringetrace import nm, um
from fringetrace.optics.materials import files
from fringetrace.optics.materials.dispersion import IndexFormula, IndexTable
from fringetrace.optics.materials.named_materials import load

PAGE = """
REFERENCES: |
    A. Author. <i>J. Opt.</i>
    <b>1</b> (1999)
DATA:
  - type: formula 2
    wavelength_range: 0.3 2.5
    coefficients: 0 1.03961212 0.00600069867 0.231792344 0.0200179144 1.01046945 103.560653
  - type: tabulated k
    data: |
        0.4 1e-8
        0.8 3e-8
"""


def written(folder, name, text):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        "wavelength (nm),n,k\n400,1.5,0.1\n600,1.4,0.2\n",
        "# a remark\nwavelength_nm;n;kappa\n400; 1.5; 0.1\n\n600; 1.4; 0.2 # the end\n",
        "wl,n,k\n400 1.5 0.1\n600\t1.4\t0.2\n",
    ],
)
def test_csv_with_its_unit(tmp_path, text):
    unit = "nm" if text.startswith("wl") else None
    n, kappa, _ = files.read_index_csv(written(tmp_path, "a.csv", text), unit)
    assert n.wavelength == kappa.wavelength == pytest.approx((0.4, 0.6), rel=1e-15)
    assert (n.value, kappa.value) == ((1.5, 1.4), (0.1, 0.2))


def test_csv_without_words(tmp_path):
    path = written(tmp_path, "glass.csv", "0.4,1.5\n0.6,1.4\n")
    glass = load(path, unit="um")
    assert (glass.name, glass.kappa) == ("glass", None)
    assert glass.index(0.5 * um) == pytest.approx(1.45)


def test_page_of_refractiveindex_info(tmp_path):
    path = written(tmp_path, "page.yml", PAGE)
    n, kappa, source = files.read_yaml(path)
    assert isinstance(n, IndexFormula)
    assert isinstance(kappa, IndexTable)
    assert source == "A. Author. J. Opt. 1 (1999)"
    glass = load(path, name="glass")
    assert glass.index(587.5618 * nm).real == pytest.approx(1.5168, abs=0.5e-5)
    assert glass.index(600 * nm).imag == pytest.approx(2e-8)
    assert glass.range == pytest.approx((400 * nm, 800 * nm))


def test_tables_of_both(tmp_path):
    text = "DATA:\n  - type: tabulated nk\n    data: |\n        0.4 1.5 0.1\n        0.8 1.7 0.3\n"
    assert load(written(tmp_path, "a.yaml", text)).index(0.6 * um) == pytest.approx(1.6 + 0.2j)


def test_short_formula_7(tmp_path):
    text = "DATA:\n  - {type: formula 7, wavelength_range: 1 2, coefficients: 3.4}\n"
    assert load(written(tmp_path, "a.yml", text)).index(1.5 * um) == 3.4


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("400,1.5\n600,1.4\n", None, r"bad.csv unit of the wavelength: expected one of pm, .* got None"),
        ("wavelength (nm),n\n400,1\n500,1\n", "um", "the file says 'nm', got 'um'"),
        ("wavelength (parsec),n\n400,1\n500,1\n", None, "bad.csv unit of the wavelength: .* got 'parsec'"),
        ("400,1.5\n600,x\n", "nm", r"bad.csv line 2: expected numbers, got '600,x'"),
        ("400,1.5\n600\n", "nm", r"bad.csv line 2: expected 2 or 3 columns in each, got '600'"),
        ("1,2,3,4\n", "nm", "bad.csv line 1: expected 2 or 3 columns"),
        ("", "nm", "bad.csv: expected lines of numbers, got none"),
        ("600,1.5\n400,1.4\n", "nm", "bad.csv column n: table: expected wavelengths that rise .* in row 1"),
    ],
)
def test_bad_csv(tmp_path, text, unit, message):
    with pytest.raises(ValueError, match=message):
        load(written(tmp_path, "bad.csv", text), unit=unit)


FORMULA = "DATA:\n  - type: formula 2\n    wavelength_range: 0.3 2.5\n    coefficients: 0 1 0.01\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [", "bad.yml: expected YAML, got"),
        ("1", "bad.yml DATA: expected a list of formulas and tables, got None"),
        ("DATA: []", r"bad.yml DATA: expected a list of formulas and tables, got \[\]"),
        ("DATA: [1]", r"bad.yml DATA\[0\] type: expected 'formula 1' to 'formula 9' .* got None"),
        (FORMULA.replace("formula 2", "formula 12"), r"DATA\[0\] type: .* got 'formula 12'"),
        (FORMULA.replace("coefficients", "numbers"), r"DATA\[0\]: expected the key 'coefficients', got"),
        (FORMULA.replace("0 1 0.01", "0 1 x"), r"DATA\[0\] coefficients: expected numbers, got '0 1 x'"),
        (FORMULA.replace("0 1 0.01", "0 1"), r"DATA\[0\]: dispersion formula 2: expected 1, 3, .* got 2"),
        (FORMULA.replace("0.3 2.5", "0.3"), r"DATA\[0\] wavelength_range: expected 2 numbers, got 0.3"),
        (FORMULA + FORMULA.replace("DATA:\n", ""), r"DATA\[1\]: expected one n, got another"),
        ("DATA:\n  - {type: tabulated n, data: 1 2 3}", r"DATA\[0\] data line 1: expected 2 columns"),
        ("DATA:\n  - {type: tabulated n}", r"DATA\[0\] data: expected lines of numbers, got none"),
        ("DATA:\n  - {type: tabulated k, data: 1 2}", r"DATA\[0\] data: table: expected as many"),
        ("DATA:\n  - type: tabulated k\n    data: |\n      1 0.1\n      2 0.1", "n, got kappa alone"),
    ],
)
def test_bad_pages(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        load(written(tmp_path, "bad.yml", text))


def test_other_files(tmp_path):
    with pytest.raises(ValueError, match=r"expected a .csv, .txt, .yml or .yaml file, got '.json'"):
        load(tmp_path / "a.json")
    with pytest.raises(ValueError, match=r"expected no unit .* got 'nm'"):
        load(tmp_path / "a.yml", unit="nm")
    with pytest.raises(FileNotFoundError, match=r"a\.yml"):
        load(tmp_path / "a.yml")


def test_what_is_read_is_float64(tmp_path):
    n, *_ = files.read_index_csv(written(tmp_path, "a.csv", "0.1,1\n0.3,2\n"), "um")
    assert n.at(np.array([0.2])).dtype == np.float64
