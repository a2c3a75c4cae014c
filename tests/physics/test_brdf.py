"""The BRDF of samples known in closed form: mirrors, grooves, a Lambertian dome, two discs."""

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import degree, nm, um
from fringetrace.scattering import detectors, goniometer
from fringetrace.scattering.detectors import far_lengths

WAVES = np.linspace(400, 700, 31) * nm
ROUNDING = 1e-10  # of sums of thousands of phasors at paths of some hundred waves, at their peak


def plate(reflectance=0.8):
    return ft.Scene([ft.Surface(ft.shapes.plate(20 * um, 10 * um), ft.Mirror(reflectance))])


@pytest.mark.parametrize("half_angle", [1e-2, 1e-4, 1e-6])
def test_a_mirror_is_a_delta_over_the_cosine(half_angle):
    """f dOmega cos(theta_o) = R in the specular direction, however small dOmega; 0 in others."""
    theta = -35 * degree
    looks = goniometer.Cones([-theta, -theta + 3 * half_angle], half_angle)
    table = goniometer.brdf(plate(), theta, looks, 500 * nm, method="power", rays=(8, 8))
    f = table.values[0, 0, :, 0, 0]
    assert f[0] * np.pi * np.sin(half_angle) ** 2 * np.cos(theta) == pytest.approx(0.8, rel=1e-12)
    assert f[1] == 0.0
    assert table.absorbed.item() == pytest.approx(0.2, rel=1e-12)


@pytest.mark.parametrize("count", [128, 256])
def test_a_mirror_of_finite_size_has_the_lobe_of_a_slit(count):
    """A cos(i)/cos(o) R/lambda^2 sinc^2(D (sin i + sin o)/lambda), of `count` rays their grating's."""
    incidence = -20 * degree
    theta = np.array([0, 10, 11, 12, 20, 30]) * degree
    looks = goniometer.Cones(theta, 0.5 * degree)
    table = goniometer.brdf(plate(), incidence, looks, WAVES, method="diffraction", rays=(64, count))
    x = 20 * um * (np.sin(theta) + np.sin(incidence))[:, None] / WAVES
    area = 20 * um * 10 * um * np.cos(incidence)
    peak = 0.8 * area / (np.cos(theta)[:, None] * WAVES**2)
    grating = np.sinc(x) / np.sinc(x / count)
    f = table.values[0, 0, :, 0]
    assert f == pytest.approx(peak * grating**2, rel=1e-9, abs=ROUNDING * peak.max())
    assert (abs(f - peak * np.sinc(x) ** 2) < (0.36 / count**2 + ROUNDING) * peak).all()


def grooves(count, width, height):
    """V-grooves of 90 degrees, tops at z = 0."""
    x = 0.5 * width * np.arange(-count, count + 1)
    z = np.where(np.arange(2 * count + 1) % 2, -0.5 * width, 0.0)
    return ft.Scene([ft.Surface(ft.shapes.extrude(np.stack([x, z], axis=1), height), ft.Mirror())])


@pytest.mark.parametrize("count", [1, 5])
def test_grooves_send_light_back(count):
    """A groove of width w lit at angle t sends w (cos t - sin t) back, all in phase with its apex.

    Together they are a grating: light from the next groove comes 2 w sin t later.
    """
    width, height, tangent, rays = 6 * um, 2 * um, 0.25, 400
    theta = np.arctan(tangent)  # of the rays of a groove, 3 in 4 come back
    looks = goniometer.Cones([theta], 1 * degree)
    table = goniometer.brdf(
        grooves(count, width, height), theta, looks, WAVES, rays=(1, count * rays), centre=(0, 0, 0),
        aperture=(count * width, height),
    )  # fmt: skip
    back = height * width * (np.cos(theta) - np.sin(theta))
    turn = np.pi * 2.0 * width * np.sin(theta) / WAVES
    together = np.sin(count * turn) / np.sin(turn)
    area = count * width * height * np.cos(theta)
    truth = (back * together / WAVES) ** 2 / (area * np.cos(theta))
    assert table.values.ravel() == pytest.approx(truth, abs=ROUNDING * truth.max())
    assert table.ray_count.item() == count * rays * 3 // 4


def test_grooves_are_reciprocal():
    """From t to -t by one bounce or by three, and back; from t to t by two."""
    theta = np.array([-30, -10, 10, 30]) * degree
    looks = goniometer.Cones(theta, 2 * degree)
    scene = grooves(3, 6 * um, 2 * um)
    table = goniometer.brdf(scene, theta, looks, WAVES, rays=(1, 4000), aperture=(40 * um, 2 * um))
    assert goniometer.reciprocity(table) < 4 / 4000 * 18 / 40 * 10  # two edges of six flanks, a ray each
    half = goniometer.brdf(
        scene, theta, looks, WAVES, rays=(1, 4000), aperture=(40 * um, 2 * um), reciprocal=True
    )
    assert goniometer.reciprocity(half) == 0.0
    assert abs(half - table).max() <= goniometer.reciprocity(table) * table.max()


def test_a_groove_of_gold_is_reciprocal():
    """Off both flanks, aslant: s becomes s and p on the way, and does not go back as it came; their sum does.

    Measured 7e-4, the rays at the edges of what both flanks reflect: one in some 1000 of either way.
    """
    x, z = np.array([-1.0, 0.1, 1.0]) * 3 * um, np.array([0.0, -1.0, 0.1]) * 3 * um
    profile = np.stack([x, z], axis=1)
    gold = ft.Scene([ft.Surface(ft.shapes.extrude(profile, 60 * um), ft.Metal(), back=0.18344 + 3.4332j)])
    there = detectors.towards(15 * degree, 60 * degree)
    out = -there
    for slope in np.diff(profile, axis=0):
        normal = np.array([-slope[1], 0.0, slope[0]]) / np.linalg.norm(slope)
        out = out - 2.0 * (out @ normal) * normal
    theta = np.array([15 * degree, np.arccos(out[2])])
    phi = np.array([60 * degree, np.arctan2(out[1], out[0])])
    looked = [goniometer.Cones([t], degree, [p]) for t, p in zip(theta, phi, strict=True)]
    given = {"wavelengths": 600 * nm, "method": "power", "rays": (1, 4000), "aperture": (8 * um, 1 * um)}
    f = {}
    for polarisation in ("s", "unpolarised"):
        tables = [
            goniometer.brdf(gold, ([t], [p]), looks, polarisation=polarisation, **given)
            for t, p, looks in zip(theta, phi, looked[::-1], strict=True)
        ]
        f[polarisation] = [table.item() for table in tables]
    one, other = f["unpolarised"]
    assert one > 0.0
    assert one == pytest.approx(other, rel=2e-3)
    assert abs(f["s"][0] / f["s"][1] - 1.0) > 0.01


def lambertian(radius, rings, sectors):
    """A dome whose tangent at r is that of half the angle asin(r/radius): even light goes as cosines."""
    edge = np.linspace(0.0, 0.5 * np.pi, rings + 1)
    r = radius * np.sin(edge)
    z = -np.concatenate([[0.0], np.cumsum(np.diff(r) * np.tan(0.25 * (edge[1:] + edge[:-1])))])
    turn = 2.0 * np.pi * np.arange(sectors) / sectors
    ring = np.stack(
        np.broadcast_arrays(r[1:, None] * np.cos(turn), r[1:, None] * np.sin(turn), z[1:, None]), -1
    )
    vertices = np.concatenate([[[0.0, 0.0, 0.0]], ring.reshape(-1, 3)])
    here = np.arange(sectors)
    there = (here + 1) % sectors
    faces = [np.stack([0 * here, 1 + here, 1 + there], axis=1)]
    for k in range(rings - 1):
        a, b = 1 + k * sectors, 1 + (k + 1) * sectors
        faces += [np.stack([a + here, b + here, b + there], 1), np.stack([a + here, b + there, a + there], 1)]
    return ft.Scene([ft.Surface(ft.Mesh(vertices, np.concatenate(faces)), ft.Mirror(0.6))])


def test_a_dome_that_scatters_as_lambert_said():
    """f = rho / pi in every cell of the hemisphere."""
    side = 600
    looks = goniometer.Cells(6, 8)
    table = goniometer.brdf(
        lambertian(1e-3, 48, 64),
        0.0,
        looks,
        500 * nm,
        method="power",
        rays=(side, side),
        aperture=(2e-3, 2e-3),
    )
    f = table.values[0, 0, :, :, 0] / (1.0 - table.missed.item())
    rays = side**2 * looks.projected / 4.0
    # as many rays as cross a cell's rim, two in three of them by chance
    assert (
        abs(f * np.pi / 0.6 - 1.0) < 4.0 * (4.0 * np.sqrt(rays)) ** 0.5 / rays + 2.0 / np.sqrt(rays)
    ).all()
    assert (f * looks.projected).sum() == pytest.approx(0.6, rel=1e-12)
    assert table.collected.item() == pytest.approx(table.reflected.item(), rel=1e-12)
    assert table.power_unaccounted < 1e-12


# Two conducting discs of radius 5 at (0, 0) and (13, -4), light along -z, out at 60 degrees from +x: by discs
# met the optical path between planes through the origin, and d(theta)/dx (computed in 2D, 12 digits).
DISCS = {
    (0,): (-9.659258262891, 0.4141104722),
    (1,): (-8.695156647753, 0.4141104722),
    (0, 1): (-1.607015862292, 4.565122879),
    (1, 0): (1.738174599374, 2.451761383),
    (0, 1, 0): (4.536115344406, 15.67927453),
    (1, 0, 1): (4.917873538738, 13.77123123),
    (0, 1, 0, 1): (7.245220100950, 84.78546654),
    (1, 0, 1, 0): (9.959834448030, 31.19344062),
}
LONG = [(0, 1, 0, 1, 0), (1, 0, 1, 0, 1)]
WAVE = -3.513934 + 9.276179j  # of all of them, at a wavelength of 0.5 (geometrical optics, 7 digits)
OUT = 30 * degree  # from +z


def discs():
    """Bare tubes of 720 facets, each with its cylinder behind it."""
    angle = 2.0 * np.pi * np.arange(720) / 720
    circle = 5.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    surfaces = []
    for k, (x, z) in enumerate(((0.0, 0.0), (13.0, -4.0))):
        tube = ft.shapes.extrude(circle + np.array([x, z]), 2.0, closed=True)
        caps = np.ptp(tube.vertices[tube.faces][..., 1], axis=1) < 1e-12
        cylinder = ft.forms.Cylinder((x, 0, z), (0, 1, 0), 5.0)
        surfaces.append(
            ft.Surface(ft.Mesh(tube.vertices, tube.faces[~caps]), ft.Mirror(), f"disc {k}", cylinder)
        )
    return ft.Scene(surfaces)


def come_down(scene, x):
    """Paths of rays that come down at x from z = 20, how far they turn past OUT, and the discs they met."""
    origin = np.stack([x, 0.0 * x, 0.0 * x + 20.0], axis=1)
    rays = ft.Rays(origin, np.tile([0.0, 0.0, -1.0], (len(x), 1)))
    paths = ft.trace(scene, rays, record=True)
    turn = np.arctan2(paths.direction[:, 0], paths.direction[:, 2]) - OUT
    return paths, turn, [tuple(row[row >= 0].tolist()) for row in paths.surface]


def test_two_discs():
    """Every ray that leaves at one angle, by the discs it met; their sum is that of geometrical optics."""
    scene, where = discs(), [(1.2, 1.4, 21), (4.0, 4.7, 1401), (9.3, 10.1, 1601), (14.2, 14.4, 21)]
    x = np.concatenate([np.linspace(*some) for some in where])
    names = [*DISCS, *LONG]
    _, turn, met = come_down(scene, x)
    crossing = np.flatnonzero((turn[1:] * turn[:-1] < 0.0) & (abs(turn[1:] - turn[:-1]) < 1.0))
    found = {met[i]: i for i in crossing if met[i] == met[i + 1]}
    low, high = (x[[found[name] + k for name in names]] for k in (0, 1))
    for _ in range(4):
        grid = np.linspace(low, high, 18)
        turn = come_down(scene, grid.ravel())[1].reshape(grid.shape)
        last = (np.sign(turn) == np.sign(turn[0])).sum(axis=0) - 1
        low, high = (grid[last + k, np.arange(len(names))] for k in (0, 1))
    (_, before, _), (_, after, _) = come_down(scene, low), come_down(scene, high)
    spread = abs((after - before) / (high - low))
    ends, _, met = come_down(scene, low + (high - low) * before / (before - after))
    assert met == names
    out = np.array([np.sin(OUT), 0.0, np.cos(OUT)])
    lengths = far_lengths(ends, np.arange(len(ends)), np.zeros(3), out) - 20.0
    truth = np.array(list(DISCS.values()))
    assert lengths[: len(truth)] == pytest.approx(truth[:, 0], abs=1e-11)  # the table's digits, and ten more
    assert spread[: len(truth)] == pytest.approx(
        truth[:, 1], rel=1e-6
    )  # a slope over 3e-9 of angles to 1e-15
    k = 2.0 * np.pi / 0.5
    sign = np.array([(-1.0) ** len(name) for name in names])
    wave = (
        (sign * spread**-0.5 * np.exp(1j * k * lengths)).sum()
        * np.sqrt(0.5 * np.pi * k)
        * np.exp(0.25j * np.pi)
    )
    assert abs(wave - WAVE) < 2e-6 * abs(WAVE)
