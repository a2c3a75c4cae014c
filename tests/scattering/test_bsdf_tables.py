"""Tables of BRDFs: between their entries, on a sphere, and in the files of a renderer."""

import numpy as np
import pytest

from fringetrace import nm
from fringetrace.scattering import bsdf_tables

THETA = np.linspace(0, np.pi / 2, 13)
PHI = np.linspace(-np.pi, np.pi, 49)
WAVELENGTHS = np.array([360, 460, 600, 830]) * nm
RHO = np.array([0.2, 0.4, 0.6, 0.9])


def law(theta_i, phi_i, theta_o, phi_o):
    """Smooth, and different in every angle."""
    return np.cos(theta_i) * np.sin(2 * theta_o) ** 2 * (2 + np.cos(phi_o - 2 * phi_i)) * np.sin(theta_i)


def anisotropic(theta=THETA, phi_i=PHI[::2], phi_o=PHI):
    grid = np.meshgrid(theta, phi_i, theta, phi_o, indexing="ij")
    return bsdf_tables.brdf_table(law(*grid)[..., None] * RHO, theta, phi_i, theta, phi_o, WAVELENGTHS)


def lambertian(rho=RHO):
    values = np.broadcast_to(np.asarray(rho) / np.pi, (3, 1, 3, 2, len(rho)))
    return bsdf_tables.brdf_table(
        values, [0, 0.7, np.pi / 2], [0], [0, 0.7, np.pi / 2], [-np.pi, np.pi], WAVELENGTHS
    )


def directions(count=300, seed=1):
    rng = np.random.default_rng(seed)
    found = rng.normal(size=(2, count, 3))
    found[..., 2] = abs(found[..., 2])
    return found / np.linalg.norm(found, axis=-1, keepdims=True)


def angles(w):
    return np.arccos(w[..., 2]), np.arctan2(w[..., 1], w[..., 0])


def test_entries_are_met_and_between_them_it_is_linear():
    table = anisotropic()
    theta, phi = THETA[4], PHI[6]
    wi = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    exact = law(theta, phi, theta, phi) * RHO
    assert bsdf_tables.lookup(table, wi, wi) == pytest.approx(exact, rel=1e-12)
    wi, wo = directions()
    found = bsdf_tables.lookup(table, wi, wo)
    # half the second derivative, (h / 2)^2 of each: 10 and 10 of theta_o, 12 of phi_i, 3 of phi_o
    bound = 0.5 * (
        14 * (THETA[1] / 2) ** 2 + 12 * (PHI[2] - PHI[0]) ** 2 / 4 + 3 * (PHI[1] - PHI[0]) ** 2 / 4
    )
    assert abs(found - law(*angles(wi), *angles(wo))[:, None] * RHO).max() < bound


def test_a_finer_table_is_better_as_the_square():
    wi, wo = directions()
    exact = law(*angles(wi), *angles(wo))[:, None] * RHO
    errors = []
    for n in (1, 2):
        phi = np.linspace(-np.pi, np.pi, 16 * n + 1)
        table = anisotropic(np.linspace(0, np.pi / 2, 8 * n + 1), phi, phi)
        errors.append(np.sqrt(np.mean((bsdf_tables.lookup(table, wi, wo) - exact) ** 2)))
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.2)


def test_azimuth_goes_round():
    # without the entry at pi that repeats the one at -pi
    open_, closed = anisotropic(phi_i=PHI[:-1:2], phi_o=PHI[:-1]), anisotropic()
    wi, wo = directions()
    assert bsdf_tables.lookup(open_, wi, wo) == pytest.approx(bsdf_tables.lookup(closed, wi, wo), rel=1e-12)


def test_an_isotropic_surface_may_be_turned():
    grid = np.meshgrid(THETA, [0.0], THETA, PHI, indexing="ij")
    table = bsdf_tables.brdf_table(law(*grid)[..., None] * RHO, THETA, [0.0], THETA, PHI, WAVELENGTHS)
    wi, wo = directions()
    c, s = np.cos(0.8), np.sin(0.8)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    once, turned = bsdf_tables.lookup(table, wi, wo), bsdf_tables.lookup(table, wi @ turn.T, wo @ turn.T)
    assert turned == pytest.approx(once, rel=1e-9)


def test_there_is_no_light_below():
    up, down = [0, 0, 1.0], [0, 0.6, -0.8]
    for wi, wo in ((up, down), (down, up)):
        assert (bsdf_tables.lookup(lambertian(), wi, wo) == 0.0).all()


def test_a_lambertian_sphere_is_lamberts():
    light = np.array([0.6, 0.0, 0.8])
    image = bsdf_tables.shaded_sphere(lambertian(), 3 * light, pixels=64)
    side = (np.arange(64) + 0.5) / 32 - 1
    x, y = np.meshgrid(side, side)
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
    on = x**2 + y**2 < 1
    exact = np.maximum(0.6 * x + 0.8 * z, 0)[..., None] * RHO / np.pi
    assert np.isnan(image[~on]).all()
    assert image[on] == pytest.approx(exact[on], rel=1e-12)
    assert image[32, 50, 0] > image[32, 14, 0]  # lit from the right


def test_what_is_no_brdf_is_refused(tmp_path):
    good, path = lambertian(), tmp_path / "bad.bsdf"
    up = np.array([0, 0, 1.0])
    with pytest.raises(ValueError, match=r"BRDF: expected axes theta_i, .*, got phi_i"):
        bsdf_tables.lookup(good.transpose("phi_i", ...), up, up)
    with pytest.raises(ValueError, match="BRDF: expected finite values, got 36 others"):
        bsdf_tables.lookup(good * np.array([np.nan, np.nan, 1, 1]), up, up)
    with pytest.raises(ValueError, match="BRDF: expected increasing theta_o"):
        bsdf_tables.lookup(good.isel(theta_o=[1, 0, 2]), up, up)
    with pytest.raises(ValueError, match=r"BRDF: expected theta_i from 0 to pi/2, got 0 to 1.6"):
        bsdf_tables.lookup(good.assign_coords(theta_i=[0, 1, 1.6]), up, up)
    with pytest.raises(ValueError, match="BRDF: expected increasing theta_o"):
        bsdf_tables.mitsuba(good.isel(theta_o=[1, 0, 2]), path)
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def renderer():
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_spectral")
    return mitsuba


def interaction(mi, wi, wavelengths):
    si = mi.SurfaceInteraction3f()
    si.wi, si.wavelengths = mi.Vector3f(*map(float, wi)), wavelengths
    return si


def test_mitsuba_reads_the_same_numbers(renderer, tmp_path):
    mi, shown = renderer, [360.0, 460.0, 600.0, 715.0]
    rho = np.interp(shown, WAVELENGTHS / nm, RHO)
    wi, wo = directions(100)
    table = anisotropic()
    exact = bsdf_tables.lookup(table, wi, wo) / RHO * rho * wo[:, 2:]
    errors = []
    for n in (1, 2):
        bsdf_tables.mitsuba(table, tmp_path / f"{n}.bsdf", 12 * n, (4 * n + 1, 12 * n + 1))
        material = mi.load_dict({"type": "measured", "filename": str(tmp_path / f"{n}.bsdf")})
        found = [
            np.ravel(material.eval(mi.BSDFContext(), interaction(mi, i, shown), mi.Vector3f(*map(float, o))))
            for i, o in zip(wi, wo, strict=True)
        ]
        errors.append(np.sqrt(np.mean((np.array(found) - exact) ** 2)))
    assert errors[1] < 0.08 * exact.max()
    assert errors[0] / errors[1] > 2.5  # linear interpolation: 4, less for the kinks of the table
    assert sorted(path.name for path in tmp_path.iterdir()) == ["1.bsdf", "2.bsdf"]


def test_mitsuba_draws_directions_without_bias(renderer, tmp_path):
    mi, rng = renderer, np.random.default_rng(5)
    bsdf_tables.mitsuba(lambertian(), tmp_path / "flat.bsdf", pixels=64)
    material = mi.load_dict({"type": "measured", "filename": str(tmp_path / "flat.bsdf")})
    si = interaction(mi, [np.sin(0.7), 0.0, np.cos(0.7)], list(WAVELENGTHS / nm))
    weights = []
    for _ in range(3000):
        sample, weight = material.sample(mi.BSDFContext(), si, 0.5, mi.Point2f(*rng.random(2)))
        weights.append(np.ravel(weight))
        if sample.wo.z <= 0.0:  # below the surface: no light, and no chance
            continue
        assert sample.pdf == pytest.approx(material.pdf(mi.BSDFContext(), si, sample.wo), rel=1e-3)
    spread = np.std(weights, axis=0) / np.sqrt(len(weights))
    assert abs(np.mean(weights, axis=0) - RHO).max() < 4 * spread.max() + 0.01  # 64 half vectors: 1 %


def test_mitsuba_renders_the_sphere(renderer, tmp_path):
    mi = renderer
    bsdf_tables.mitsuba(lambertian(), tmp_path / "flat.bsdf")
    known = {"type": "spectrum", "value": list(zip(WAVELENGTHS / nm, RHO, strict=True))}
    images = []
    for material in (
        {"type": "measured", "filename": str(tmp_path / "flat.bsdf")},
        {"type": "diffuse", "reflectance": known},
    ):
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "direct"},
                "light": {
                    "type": "directional",
                    "direction": [-0.6, 0.0, -0.8],
                    "irradiance": {"type": "d65"},
                },
                "sensor": {
                    "type": "orthographic",
                    "to_world": mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
                    "film": {
                        "type": "hdrfilm",
                        "width": 24,
                        "height": 24,
                        "pixel_format": "xyz",
                        "rfilter": {"type": "box"},
                    },
                    "sampler": {"type": "independent", "sample_count": 64},
                },
                "ball": {"type": "sphere", "bsdf": material},
            }
        )
        images.append(np.array(mi.render(scene, seed=1)))
    measured, diffuse = images
    lit = diffuse[..., 1] > 0.3 * diffuse[..., 1].max()
    assert lit.sum() > 150
    assert measured[lit] == pytest.approx(diffuse[lit], rel=0.03)  # the same samples of the same rays
