"""Lattices of rods of matter: traced, against closed forms."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from fringetrace import degree, nm, um
from fringetrace.optics.films import fresnel
from fringetrace.optics.materials.named_materials import KERATIN, MELANIN
from fringetrace.rigorous.cylinders import efficiencies
from fringetrace.scattering.detectors import Cones
from fringetrace.scattering.far_fields import FATES
from fringetrace.scattering.goniometer import brdf
from fringetrace.scattering.rod_lattice import RodLattice
from fringetrace.scattering.rod_studies import study

WAVE = [500 * nm]
STRAIGHT = Cones([0.0], 1 * degree)
ROUNDING = 1e-12  # sums of some hundred powers
CUT = 1e-5  # power in branches that are cut off


def powers(lattice, theta=0.0, rays=200, **options):
    table = brdf(
        lattice.scene, theta, STRAIGHT, WAVE, rays=(1, rays), method="power", **lattice.lighting, **options
    )
    assert table.attrs["power_unaccounted"] < ROUNDING
    return {name: table[name].values[:, 0] for name in FATES}


def s_reflectance(cosine, within, index):
    """Fresnel, E along the boundary."""
    return ((cosine - index * within) / (cosine + index * within)) ** 2


def test_a_host_alone_reflects_as_fresnel_says():
    theta = np.array([0.0, 30.0, 60.0]) * degree
    found = powers(RodLattice(3, 2, rod=1.5, host=1.5, cortex=100 * nm), theta)
    within = np.sqrt(1 - (np.sin(theta) / 1.5) ** 2)
    assert found["reflected"] == pytest.approx(s_reflectance(np.cos(theta), within, 1.5), rel=ROUNDING)
    assert found["missed"] == pytest.approx(0.0, abs=ROUNDING)
    assert found["transmitted"][0] == pytest.approx(0.96, rel=ROUNDING)


def absorbed(radius, index, rays):
    """By one rod of the light on it: T (1 - e) / (1 - R e), e what a chord leaves; mean over rays."""
    height = (np.arange(rays) + 0.5) / rays * 2 - 1
    cosine, within = np.sqrt(1 - height**2), np.sqrt(1 - (height / index.real) ** 2)
    back = s_reflectance(cosine, within, index.real)
    left = np.exp(-4 * np.pi * index.imag / WAVE[0] * 2 * radius * within)
    return np.mean((1 - back) * (1 - left) / (1 - back * left))


def one_rod(radius, index):
    return RodLattice(
        1, 1, radius=radius, pitch=3 * radius, length=2 * radius, rod=index, sides=36, exact=True
    )


def test_one_rod_absorbs_as_the_geometric_series_says():
    """Weakly: reflectances of the real index are then right to a part kappa^2, rays to a part kappa / 10."""
    index, radius = 1.5 + 1e-4j, 10 * um
    true = absorbed(radius, index, 2000)
    found = powers(one_rod(radius, index), rays=2000, min_amplitude=1e-4)
    assert found["absorbed"] == pytest.approx(true, rel=CUT)


def test_a_black_rod_reflects_as_fresnel_says_with_its_complex_index():
    """Nothing comes through: exp(-30) of the power is the most that any chord leaves."""
    index, height = 1.5 + 0.0879j, (np.arange(2000) + 0.5) / 1000 - 1
    true = np.mean(abs(fresnel(1.0, index, np.arcsin(abs(height))).rs) ** 2)
    found = powers(one_rod(10 * um, index), rays=2000, min_amplitude=1e-3)
    assert found["reflected"] + found["transmitted"] == pytest.approx(true, rel=1e-9)


def test_large_rods_absorb_as_the_rigorous_answer_says():
    """What rays lack are grazing waves at the rods' edges: a part of (k a)^(-2/3), and better."""
    index, lacking = 1.5 + 0.1j, []
    for size in (40, 160):
        radius = size / (2 * np.pi) * WAVE[0]
        true = efficiencies(radius, index, 1.0, WAVE[0], "s").absorption.item()
        lacking.append(true / powers(one_rod(radius, index), rays=1000)["absorbed"].item() - 1)
    assert 0 < lacking[1] < lacking[0] * 4 ** (-2 / 3)
    assert lacking[1] < 0.5 * 160 ** (-2 / 3)


@pytest.mark.filterwarnings("ignore:power is cut off")
def test_a_feather_keeps_its_power():
    kind = RodLattice(
        3, 3, pitch=150 * nm, arrangement="square", rod="melanin", host="keratin", cortex=100 * nm,
        channel=15 * nm, disorder=0.01, seed=2,
    )  # fmt: skip
    assert (kind.rod, kind.host) == (MELANIN, KERATIN)
    found = powers(kind, 0.3, min_amplitude=1e-2)
    assert 0.04 < found["reflected"] < 0.2  # the face alone sends 5 % back; no gain inside of rods
    assert found["transmitted"] > 0.1
    assert kind.front == pytest.approx(kind.centres[:, 1].max() + 165 * nm)
    assert [surface.name for surface in kind.scene.surfaces] == ["rods", "channels", "front", "walls"]


@pytest.mark.parametrize(("arrangement", "x"), [("square", 0.0), ("staggered", 0.0)])
def test_channels_are_amid_four_rods(arrangement, x):
    kind = RodLattice(2, 2, arrangement=arrangement, host=1.5, channel=10 * nm)
    assert kind.channels == pytest.approx(np.array([[x, 0.0]]), abs=1e-12 * kind.pitch)


def test_rods_of_several_media_in_one_study():
    axes = {"rod": [1.6 + 0.1j, 1.6], "exact": [False]}
    with ThreadPoolExecutor(1) as pool:
        table = study(
            RodLattice(2, 1, host=1.5, cortex=50 * nm), axes, [0.1], [0.1], WAVE, rays=50, method="power",
            executor=pool,
        )  # fmt: skip
    assert float(table.absorbed[0].sum()) > float(table.absorbed[1].sum())
    assert table.attrs["lattice_host"] == "n=1.5"


@pytest.mark.parametrize(
    ("changed", "error", "message"),
    [
        ({"cortex": -1.0, "host": 1.5}, ValueError, "lattice cortex: expected a length of at least 0"),
        ({"cortex": 1e-7}, ValueError, "lattice host: expected one for a cortex or channels to be in"),
        ({"channel": 0.0, "host": 1.5}, ValueError, "lattice channel: expected a positive length"),
        ({"rod": [1.5]}, TypeError, "lattice rod: expected a Material"),
    ],
)
def test_what_is_refused(changed, error, message):
    with pytest.raises(error, match=message):
        RodLattice(**changed)


def test_matter_may_not_overlap():
    with pytest.raises(ValueError, match="rods: expected them apart"):
        _ = RodLattice(rod=1.5, disorder=0.3).scene
