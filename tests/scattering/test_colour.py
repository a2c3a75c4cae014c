"""Spectra to colour: what is taken, what is refused, what is warned of, and files."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fringetrace import FringetraceWarning, nm, um
from fringetrace.core import tables
from fringetrace.scattering import colour

W = colour.resolving_wavelengths()
# X, Y, Z of fringes without a warning are known this well, where samples are taken as advised.
SAMPLED = 6e-4
ROUNDING = 1e-12


def fringes(path, wavelengths):
    return np.sin(np.pi * path / wavelengths) ** 2


def test_white_is_one_whatever_the_samples():
    for at in (W, W[::2], np.sort(np.random.default_rng(1).uniform(390, 710, 80)) * nm):
        white = np.ones((2, 3, len(at)))
        assert colour.xyz(white, at)[..., 1] == pytest.approx(np.ones((2, 3)), rel=ROUNDING)
        assert colour.xyz(0.5 * white, at, "A", 10)[..., 1] == pytest.approx(0.5, rel=ROUNDING)


def test_a_cubic_costs_nothing_between_the_samples():
    # the sum over 5 nm of a cubic, whatever coarser samples it is given by
    def cubic(at):
        x = (at - 550 * nm) / (200 * nm)
        return 0.5 + 0.2 * x - 0.1 * x**2 + 0.1 * x**3

    fine = colour.xyz(cubic(W), W)
    coarse = np.append(np.arange(360, 830, 20), 830) * nm
    assert colour.xyz(cubic(coarse), coarse) == pytest.approx(fine, rel=1e-11)


def test_colours_are_linear_in_light():
    rng = np.random.default_rng(2)
    one, other = (rng.uniform(0.4, 0.42, len(W)) for _ in range(2))
    both = colour.xyz(one + 2 * other, W)
    assert both == pytest.approx(colour.xyz(one, W) + 2 * colour.xyz(other, W), rel=ROUNDING)


@pytest.mark.parametrize("step", [1, 5, 10])
def test_what_aliases_is_warned_of(step):
    at, fine = np.arange(360, 831, step) * nm, np.arange(360, 830.01, 0.1) * nm
    coarse, exact = colour.weights(at), colour.weights(fine)
    warned = 0
    for path in np.geomspace(2, 400, 50) * um:
        if abs(fringes(path, at) @ coarse - fringes(path, fine) @ exact).max() > SAMPLED:
            warned += 1
            with pytest.warns(FringetraceWarning, match=f"1 of 1 spectra are .* coarsely .{step} nm"):
                colour.xyz(fringes(path, at), at)
    assert warned > 5


@given(st.floats(0.0, 60.0))
def test_the_samples_that_are_advised_are_not_warned_of(path):
    at = colour.resolving_wavelengths(path * um)
    assert colour.xyz(fringes(path * um, at), at).shape == (3,)
    assert at[[0, -1]] == pytest.approx([360 * nm, 830 * nm], rel=ROUNDING)
    assert np.diff(at).max() <= 5.0000001 * nm


def test_a_lamp_of_ones_own():
    narrow = ([549 * nm, 550 * nm, 551 * nm], [0.0, 1.0, 0.0])
    at = np.arange(360, 830.1, 0.25) * nm
    found = colour.chromaticity(colour.xyz(np.ones(len(at)), at, narrow))
    assert found == pytest.approx(
        colour.chromaticity(colour.observer(2, [550 * nm]))[0], rel=1e-4
    )  # a mean over 1 nm
    assert colour.illuminant(narrow, [500 * nm, 549.5 * nm]) == pytest.approx([0.0, 0.5])


def test_lamps_of_the_cie_are_100_at_560_nm():
    for name in ("D65", "D50", "A", "E", "3000 K"):
        assert colour.illuminant(name, [560 * nm])[0] == pytest.approx(100.0, rel=ROUNDING)


def test_the_gamut_rules():
    wild = colour.xyz(fringes(550 * nm, W), W)  # violet, beyond every screen
    linear = colour.srgb(wild, "linear")
    assert linear.min() < 0.0
    assert colour.srgb(wild) == pytest.approx(
        colour.srgb(np.linalg.solve(M, np.clip(linear, 0, 1))), abs=1e-7
    )
    grey = colour.srgb(wild, "desaturate")
    assert 0.0 <= grey.min() < 1e-9
    assert luma(grey) == pytest.approx(wild[1], rel=1e-3)  # the matrix of the standard has four digits
    bright = colour.srgb([3.0, 2.0, 1.0], "desaturate")
    assert bright == pytest.approx([1.0, 1.0, 1.0])
    tame = colour.srgb([0.3, 0.3, 0.3], "desaturate")
    assert tame == pytest.approx(colour.srgb([0.3, 0.3, 0.3]), rel=ROUNDING)


M = colour.srgb(np.eye(3), "linear").T


def luma(encoded):
    """Y of an encoded colour, by the inverse of IEC 61966-2-1."""
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return np.linalg.solve(M, linear)[1]


def test_an_eye_adapts_to_its_lamp():
    lamp = colour.white("A")
    orange, neutral = colour.srgb(lamp), colour.srgb(lamp, illuminant="A")
    assert orange[2] < 0.6
    assert neutral == pytest.approx(colour.srgb(colour.white()), abs=1e-6)


def test_white_has_no_chroma_in_lab():
    for lamp, degrees in (("D65", 2), ("A", 2), ("FL2", 10)):
        white = colour.white(lamp, degrees)
        assert colour.lab(white, lamp, degrees) == pytest.approx([100.0, 0.0, 0.0], abs=1e-9)
    assert colour.lab([0.0, 0.0, 0.0]) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def test_black_has_no_chromaticity():
    assert np.isnan(colour.chromaticity([[0.0, 0.0, 0.0]])).all()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((np.ones(3), W[:3]), r"wavelengths: expected shape \(n,\) with n of at least 4"),
        ((np.ones(95), W[::-1]), "wavelengths: expected finite, increasing lengths"),
        ((np.ones(9), np.linspace(450, 700, 9) * nm), "expected to reach from 400 nm to 700 nm, got 450 nm"),
        ((np.ones(9), np.linspace(400, 700, 9)), "expected to reach"),
        ((np.ones(94), W), r"reflectance: expected shape \(\.\.\., 95\), got \(94,\)"),
        ((np.full(95, np.nan), W), "reflectance: expected finite numbers, got 95 others"),
        ((np.ones(95), W, "D66"), "illuminant: expected a name such as .*D65.*, got 'D66'"),
        ((np.ones(95), W, "0 K"), "illuminant: expected a name"),
        ((np.ones(95), W, ([1, 0], [1, 1])), "illuminant: expected increasing wavelengths"),
        ((np.ones(95), W, ([1, 2], [1, -1])), "illuminant: .* none negative"),
        ((np.ones(95), W, ([1e-6, 2e-6], [1, 1])), "illuminant: expected light between"),
        ((np.ones(95), W, "D65", 5), "observer: expected 2 or 10 degrees, got 5"),
    ],
)
def test_what_makes_no_sense_is_refused(arguments, said):
    with pytest.raises(ValueError, match=said):
        colour.xyz(*arguments)


def test_an_unknown_gamut_or_path_is_refused():
    with pytest.raises(ValueError, match="gamut: expected one of clip, desaturate, linear, got 'cut'"):
        colour.srgb([1, 1, 1], "cut")
    with pytest.raises(ValueError, match="path: expected a length in metres, 0 or more, got -1"):
        colour.resolving_wavelengths(-1)


def test_the_library_leaves_no_traces():
    # colour-science changes how numpy prints when it is imported, and may warn
    code = (
        "import numpy, warnings; from fringetrace import colour;"
        "old = numpy.get_printoptions(), warnings.filters[:]; colour.white();"
        "assert old == (numpy.get_printoptions(), warnings.filters[:])"
    )
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True
    )
    assert run.stderr == ""


def test_spectra_on_file_come_back(tmp_path):
    rng = np.random.default_rng(3)
    axes = {"sample": (["blue", "green"], ""), "wavelength": (np.arange(300, 701) * nm, "m")}
    feathers = tables.labelled(rng.uniform(0, 1, (2, 401)), axes, name="reflectance", unit="1")
    colour.save(feathers, tmp_path / "feathers.csv")
    head = (tmp_path / "feathers.csv").read_text().splitlines()[0]
    assert head == "wl,blue,green"
    back = colour.load(tmp_path / "feathers.csv")
    assert back.dims == ("sample", "wavelength")
    assert list(back["sample"].values) == ["blue", "green"]
    assert np.asarray(back) == pytest.approx(np.asarray(feathers), rel=1e-9)  # ten digits
    assert np.asarray(back["wavelength"]) == pytest.approx(np.asarray(feathers["wavelength"]), rel=1e-9)
    assert list(tmp_path.iterdir()) == [tmp_path / "feathers.csv"]
