"""Once means once: no trace or reconstruction after the first image of a bench."""

import numpy as np
import pytest

import fringetrace as ft
from fringetrace import instruments, mm, nm
from fringetrace.field.wavefront import wavefronts
from fringetrace.geometry import forms, shapes
from fringetrace.instruments import interferometer

HENE = 632.8 * nm
WHITE = ft.Spectrum(np.linspace(500, 700, 20) * nm, np.ones(20))
# Sums in another order.
ROUNDING = 1e-12


@pytest.fixture
def counts(monkeypatch):
    """Traces of benches, and paths of which wavefronts are reconstructed."""
    traces, surveys = [], []
    trace, survey = interferometer.trace, wavefronts.survey

    def tracing(*given, **named):
        traces.append(given)
        return trace(*given, **named)

    def surveying(paths):
        surveys.append(paths)
        return survey(paths)

    monkeypatch.setattr(interferometer, "trace", tracing)
    monkeypatch.setattr(wavefronts, "survey", surveying)
    return traces, surveys


def hollow(**options):
    """A Michelson over a hollow mirror."""
    along = np.linspace(-4 * mm, 4 * mm, 17)
    mesh = shapes.height_map(-(along**2 + along[:, None] ** 2) / 40, along[1] - along[0])
    form = forms.Conic((0, 0, 0), (0, 0, -1), 20.0, -1.0)
    sample = ft.Surface(mesh, ft.Mirror(), "sample", form=form)
    return instruments.michelson(
        sample, aperture=6 * mm, pixels=(24, 24), reference_tilt=(1e-4, 0), method="wavefront", **options
    )


def test_a_bench_is_traced_and_reconstructed_once(counts):
    traces, surveys = counts
    bench = hollow()
    paths = bench.trace()
    bench.interferogram(HENE)
    bench.phase_steps(HENE)
    bench.mutual(HENE)
    bench.field(HENE)
    bench.height(HENE)
    bench.interferogram(WHITE)
    for wavelength in WHITE.wavelengths:
        bench.interferogram(wavelength)
    bench.budget(HENE)
    assert len(traces) == 1
    assert sum(one is paths for one in surveys) == 1
    # the budget asks coarser grids of rays, too
    assert len(surveys) <= 1 + 3
    assert sum(one.source.shape == paths.source.shape for one in surveys) == 1


def test_polarised_light_is_reconstructed_once(counts):
    _, surveys = counts
    flat = ft.Surface(shapes.plate(5 * mm, 5 * mm), ft.Metal(), "gold", back=ft.materials.GOLD)
    beam = ft.Beam((0, 0, 9 * mm), (0, 0, -1), (0, 1, 0), (3 * mm, 3 * mm), (6, 6), polarisation=(0.6, 0.8j))
    ccd = ft.CCD((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), 0.1 * mm, (40, 40))
    paths = ft.trace(ft.Scene([flat]), beam, ccd, wavelength=HENE)
    field = ft.complex_field(paths, HENE, "wavefront")
    assert field.shape == (3, 40, 40)
    power = (np.abs(field) ** 2).sum(axis=0)
    np.testing.assert_allclose(ft.irradiance(paths, HENE, "wavefront")[8:32, 8:32], power[8:32, 8:32])
    assert len(surveys) == 1


def test_a_spectrum_at_once_is_its_wavelengths_one_by_one():
    bench, light = hollow(), ft.Spectrum(np.array([520, 560, 700]) * nm, [1.0, 2.0, 1.0])
    together = bench.mutual(light)
    shares = list(zip(light.wavelengths, light.weights, strict=True))
    one_by_one = sum(share * bench.mutual(wavelength) for wavelength, share in shares)
    np.testing.assert_allclose(together, one_by_one, rtol=0, atol=ROUNDING)
