"""The two scenes of the 2013 study as extrusions, against an exact tracer's tables (tests/data).

The tables hold 2D float64 traces, in scene units; here x stays x and the study's y becomes z.
"""

from pathlib import Path

import numpy as np
import pytest

import fringetrace as ft
from fringetrace.scattering import goniometer
from fringetrace.tracing import detection

DATA = Path(__file__).parents[1] / "data"
UNIT = 10e-6  # metres to a scene unit of the lattice
OPL = 1e-11  # scene units, in paths of 45: some tens of float64 roundings in each of 24 bounces
INTENSITY = 1e-9  # of sums up to 1000: what OPL to 1e-13 leaves at wavelengths of 0.03
DEPTH = 1.0  # of the extrusions, scene units


def lift(plane):
    """Points or directions (n, 2) of the study's plane in space."""
    return np.insert(np.asarray(plane, dtype=float), 1, 0.0, axis=1)


def segment(ends, name, scale=1.0):
    """A mirror standing on a segment (x1, y1, x2, y2)."""
    return ft.Surface(ft.shapes.extrude(np.reshape(ends, (2, 2)) * scale, DEPTH * scale), ft.Mirror(), name)


@pytest.fixture(scope="module")
def michelson():
    return np.load(DATA / "scene_a.npz")


@pytest.fixture(scope="module")
def lattice():
    return np.load(DATA / "scene_b_far.npz")


def trace_michelson(data, beam):
    """Paths of one beam of fig 2.3 on its CCD of 100 pixels."""
    surfaces = [segment(ends, f"segment {i}") for i, ends in enumerate(data["objs"])]
    splitter = int(data["bs_index"])
    low, high = data["ccd"][1], data["ccd"][3]
    pitch = (high - low) / int(data["npix"])
    ccd = ft.CCD(
        (data["ccd"][0], 0.0, 0.5 * (low + high)), (-1, 0, 0), (0, 0, 1), pitch, (int(data["npix"]), 1)
    )
    rays = ft.Rays(lift(data[f"{beam}_org"]), lift(data[f"{beam}_dir"]), passes=(f"segment {splitter}",))
    return ft.trace(ft.Scene(surfaces), rays, ccd, record=True)


@pytest.mark.parametrize("beam", ["meas", "ref"])
def test_michelson_ray_by_ray(michelson, beam):
    paths = trace_michelson(michelson, beam)
    segments = michelson[f"{beam}_hit_seg"]
    width = segments.shape[1]
    surface = np.full((len(paths), max(width, paths.surface.shape[1])), -1)
    surface[:, : paths.surface.shape[1]] = paths.surface
    assert np.array_equal(surface[:, :width], segments)
    assert np.array_equal(paths.bounces, michelson[f"{beam}_nhit"])
    pixel = michelson[f"{beam}_pixel"]
    seen = pixel >= 0
    assert seen.sum() > 50
    assert np.array_equal(paths.fate == ft.Fate.DETECTED, seen)
    assert np.abs(paths.length[seen] - michelson[f"{beam}_opl"][seen]).max() < OPL
    assert np.array_equal(np.floor(paths.pixel[seen, 0]), pixel[seen])


@pytest.mark.parametrize(("name", "loss"), [("intensity", False), ("intensity_kpi", True)])
def test_michelson_interferogram(michelson, name, loss):
    wavelength = float(michelson["lamda"])
    field = sum(
        ft.complex_field(trace_michelson(michelson, beam), wavelength, half_wave_loss=loss)
        for beam in ("meas", "ref")
    )
    assert np.abs(np.abs(field[:, 0]) - michelson[name]).max() < INTENSITY
    assert np.ptp(michelson[name]) > 1.0  # there are fringes to be wrong about


@pytest.fixture(scope="module")
def lattice_paths(lattice):
    """Paths of the 2000 rays at each of the 7 angles of incidence."""
    rods = ft.shapes.rod_lattice(20, 4, 0.0065 * UNIT, 0.028 * UNIT, 0.2 * UNIT)
    scene = ft.Scene([ft.Surface(rods.moved((0.727 * UNIT, 0.0, 0.0)), ft.Mirror(), "rods")])
    return [
        ft.trace(
            scene,
            ft.Rays(lift(lattice["org"][i] * UNIT), lift(lattice["dir"][i])),
            max_bounces=lattice["hit_seg"].shape[2],
            record=True,
        )
        for i in range(len(lattice["theta"]))
    ]


def test_lattice_ray_by_ray(lattice, lattice_paths):
    compared = 0
    for i, paths in enumerate(lattice_paths):
        stable = lattice["stable_1e_6"][i]
        facet = np.full(lattice["hit_seg"].shape[1:], -1)
        rod, side = ft.shapes.rod_of_triangle(paths.triangle)
        hit = paths.triangle >= 0
        facet[:, : hit.shape[1]] = np.where(hit, rod * 18 + side, -1)
        assert np.array_equal(facet[stable], lattice["hit_seg"][i][stable])
        assert np.array_equal(paths.bounces[stable], lattice["nhit"][i][stable])
        assert np.abs(paths.length / UNIT - lattice["opl_last"][i])[stable].max() < OPL
        compared += stable.sum()
    assert compared == 13967


def far_ccd(data, out, shape=(1, 1)):
    """The study's one-pixel CCD at angle `out`, square."""
    x1, z1, x2, z2 = data["ccd"][out] * UNIT
    width = np.hypot(x2 - x1, z2 - z1)
    angle = np.deg2rad(data["theta"][out])
    normal = (-np.sin(angle), 0.0, -np.cos(angle))
    return ft.CCD((0.5 * (x1 + x2), 0.0, 0.5 * (z1 + z2)), normal, (0, 1, 0), width, shape)


def test_lattice_detections(lattice, lattice_paths):
    agreed = 0
    for i, paths in enumerate(lattice_paths):
        stable = lattice["stable_1e_6"][i]
        for out in range(7):
            seen = detection.project(paths, far_ccd(lattice, out))
            hits = (seen.fate == ft.Fate.DETECTED) & (seen.bounces > 0)
            truth = lattice["det_nrefl"][i, out] > 0
            # the last digits decide at the very rim of the pixel
            rim = np.minimum(lattice["det_s"][i, out], 1.0 - lattice["det_s"][i, out]) < 1e-9
            same = stable & ~(truth & rim)
            assert np.array_equal(hits[same], truth[same])
            both = same & hits
            assert np.abs(seen.length / UNIT - lattice["det_opl"][i, out])[both].max(initial=0.0) < OPL
            agreed += both.sum()
    assert agreed > 5000


@pytest.mark.parametrize(
    ("name", "most", "loss"),
    [
        ("amp_le1", 1, False),
        ("amp_le2", 2, False),
        ("amp_all", 99, False),
        ("amp_le1_kpi", 1, True),
        ("amp_le2_kpi", 2, True),
        ("amp_all_kpi", 99, True),
    ],
)
def test_lattice_spectra(lattice, lattice_paths, name, most, loss):
    wavelengths = lattice["lam_nm"][::80] * 1e-9
    compared = 0
    for i, paths in enumerate(lattice_paths):
        stable = lattice["stable_1e_6"][i]
        for out in range(7):
            truth = lattice["det_nrefl"][i, out]
            if (~stable & (truth > 0)).any():
                continue  # a ray whose path hangs on the last digits contributes
            seen = detection.project(paths, far_ccd(lattice, out))
            chosen = seen.where((seen.bounces > 0) & (seen.bounces <= most) & stable)
            sums = [abs(ft.complex_field(chosen, w, half_wave_loss=loss)[0, 0]) for w in wavelengths]
            assert np.abs(np.array(sums) - lattice[name][i, out, ::80]).max() < INTENSITY
            compared += 1
    assert compared > 30


def lattice_amplitudes(data, most, loss):
    """|sums| of the goniometer in the study's place: [ti, to, wavelength]."""
    rods = ft.shapes.rod_lattice(20, 4, 0.0065 * UNIT, 0.028 * UNIT, 0.2 * UNIT)
    scene = ft.Scene([ft.Surface(rods.moved((0.727 * UNIT, 0.0, 0.0)), ft.Mirror(), "rods")])
    theta = np.deg2rad(data["theta"])

    def source(angle, _):
        i = int(np.argmin(abs(theta - angle)))
        return ft.Rays(lift(data["org"][i] * UNIT), lift(data["dir"][i]))

    sums = goniometer.amplitudes(
        scene, theta, goniometer.Pixels(theta, 25 * UNIT, 0.56 * UNIT), data["lam_nm"] * 1e-9, source=source,
        centre=(1.0 * UNIT, 0.0, 0.042 * UNIT), max_reflections=most, half_wave_loss=loss,
    )  # fmt: skip
    return np.abs(sums.values[:, 0, :, 0])


@pytest.mark.parametrize("loss", [False, True])
@pytest.mark.parametrize(("name", "most"), [("le1", 1), ("le2", 2), ("all", None)])
def test_the_study_s_spectra(lattice, name, most, loss):
    """Fig 3.5 and 3.6 done again: 49 pairs, 401 wavelengths, all rays, 7,699 of which arrive."""
    truth = lattice[f"amp_{name}{'_kpi' if loss else ''}"]
    assert truth.shape == (7, 7, 401)
    assert np.abs(lattice_amplitudes(lattice, most, loss) - truth).max() < INTENSITY
