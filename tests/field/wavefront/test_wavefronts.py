"""Wavefronts: plane and curved waves, groups, several beams, what is kept, what is refused."""

from dataclasses import replace

import arrivals
import numpy as np
import pytest

import fringetrace as ft
from fringetrace import mm, nm
from fringetrace.field import Wavefronts, reconstruct
from fringetrace.field.wavefront import wavefronts
from fringetrace.geometry import forms, shapes

HENE = 632.8 * nm
# What quadrature may be off.
ERROR = 1e-6
# Sums in another order.
ROUNDING = 1e-13


def traced(form=None, y=0.0, gold=False, **options):
    """A plane mirror, by facets or by a form, lit on 3 mm of a CCD of 4 mm."""
    mesh, back = shapes.plate(10 * mm, 10 * mm), ft.materials.GOLD if gold else None
    flat = ft.Surface(mesh, ft.Metal() if gold else ft.Mirror(), "flat", form=form, back=back)
    beam = ft.Beam((0, y, 9 * mm), (0, 0, -1), (0, 1, 0), (3 * mm, 3 * mm), (6, 6), **options)
    ccd = ft.CCD((0, 0, 5 * mm), (0, 0, -1), (0, 1, 0), 0.1 * mm, (40, 40))
    return ft.trace(ft.Scene([flat]), beam, ccd, wavelength=HENE)


PLANE = forms.Conic((0, 0, 0), (0, 0, 1), np.inf)
SQUARE = np.pad(np.ones((30, 30)), 5)


def test_facets_make_plane_waves_and_forms_curved_sheets():
    flat, curved = reconstruct(traced()), reconstruct(traced(PLANE))
    assert isinstance(flat, Wavefronts)
    assert (len(flat.plane), len(flat.curved)) == (1, 0)
    assert (len(curved.plane), len(curved.curved)) == (0, 1)
    # a beam's cell of half a millimetre is 25 pixels
    assert curved.curved[0].unit == pytest.approx(25.0)
    assert curved.nbytes > flat.nbytes
    for one in (flat, curved):
        length = np.hypot(*(one.segments[:, 2:] - one.segments[:, :2]).T).sum()
        assert length == pytest.approx(4 * 30, rel=1e-6)


def test_wavefronts_say_what_they_are():
    assert repr(reconstruct(traced())) == "Wavefronts(1 plane, 0 curved, at any wavelength)"
    assert repr(reconstruct(traced(gold=True))) == "Wavefronts(1 plane, 0 curved, at 632.8 nm)"


@pytest.mark.parametrize("form", [None, PLANE])
def test_a_beam_brings_its_light(form):
    one = reconstruct(traced(form))
    assert one.irradiance(HENE) == pytest.approx(SQUARE, abs=ERROR)
    turn = np.exp(2j * np.pi * np.fmod(14 * mm, HENE) / HENE)
    assert one.complex_field(HENE) == pytest.approx(-turn * SQUARE, abs=ERROR)


@pytest.mark.parametrize("form", [None, PLANE])
def test_half_wave_loss_may_be_left_out(form):
    one = reconstruct(traced(form))
    field = one.complex_field(HENE)
    assert one.complex_field(HENE, half_wave_loss=False) == pytest.approx(-field, abs=ROUNDING)
    assert np.abs(field).max() > 0.9


def test_arrivals_without_facets_are_sheets():
    paths = traced()
    beam, ccd = replace(paths.source, centre=(0, 0, 9 * mm)), paths.ccd
    one = reconstruct(arrivals.reflected(beam, ccd, arrivals.plane(0.0)))
    assert one.plane == ()
    assert len(one.segments) == 0
    whole, middle = reconstruct(paths).complex_field(HENE), (slice(6, 34), slice(6, 34))
    for loss, sign in ((True, 1.0), (False, -1.0)):
        field = one.complex_field(HENE, half_wave_loss=loss)
        assert field[middle] == pytest.approx(sign * whole[middle], abs=ERROR)


def test_groups_of_several_beams_are_kept_apart():
    """Two beams a millimetre apart, in phase: where both fall, four times the light of one."""
    low, high = traced(y=-0.5 * mm), traced(PLANE, y=0.5 * mm)
    both = reconstruct([low, high])
    assert both.paths == len(low) + len(high)
    groups = np.repeat([0, 1], [len(low), len(high)])
    mutual = both.mutual_intensity(HENE, groups)
    row = np.arange(40)
    under, over = (((row >= at) & (row < at + 30)) * 1.0 for at in (0, 10))
    column = ((row >= 5) & (row < 35)) * 1.0
    assert mutual[0, 0] == pytest.approx(np.outer(under, column), abs=ERROR)
    assert mutual[1, 1] == pytest.approx(np.outer(over, column), abs=ERROR)
    assert mutual[0, 1] == pytest.approx(np.outer(under * over, column), abs=ERROR)
    assert both.irradiance(HENE) == pytest.approx(np.outer((under + over) ** 2, column), abs=4 * ERROR)


def test_a_spectrum_is_the_sum_of_its_wavelengths():
    one = reconstruct(traced(PLANE))
    groups = np.zeros(one.paths, dtype=int)
    light = ft.Spectrum(np.array([500, 633, 700]) * nm, [1.0, 2.0, 1.0])
    shares = list(zip(light.wavelengths, light.weights, strict=True))
    expected = sum(share * one.irradiance(w) for w, share in shares)
    np.testing.assert_allclose(one.irradiance(light), expected, rtol=0, atol=ROUNDING)
    mutual = one.mutual_intensity(light, groups)
    np.testing.assert_allclose(mutual[0, 0], expected, rtol=0, atol=ROUNDING)


def test_components_of_polarised_light_are_those_of_its_field():
    """Off a metal straight on: the Jones vector, turned over; as much light as is reflected."""
    jones = np.array([1.0, 1.0j]) / np.sqrt(2.0)
    for form in (None, PLANE):
        paths = traced(form, gold=True, polarisation=jones)
        one = reconstruct(paths)
        assert one.components == 3
        field = one.complex_field(HENE)
        assert field.shape == (3, 40, 40)
        lit = field[:, 20, 20]
        assert abs(lit[0]) == pytest.approx(abs(lit[1]), rel=ERROR)
        assert abs(lit[2]) < ERROR
        power = np.abs(paths.amplitude[paths.fate == ft.Fate.DETECTED][0]) ** 2
        assert one.irradiance(HENE) == pytest.approx(power * SQUARE, abs=ERROR)
        groups = np.ones(len(paths), dtype=int)
        assert one.complex_field(HENE, groups).shape == (2, 3, 40, 40)
        assert one.mutual_intensity(HENE, groups)[1, 1] == pytest.approx(power * SQUARE, abs=ERROR)


# What is kept


def counted(monkeypatch):
    """How often a survey is made."""
    calls, survey = [], wavefronts.survey

    def counting(paths):
        calls.append(paths)
        return survey(paths)

    monkeypatch.setattr(wavefronts, "survey", counting)
    return calls


def test_wavefronts_are_reconstructed_once(monkeypatch):
    calls, paths = counted(monkeypatch), traced(PLANE)
    for wavelength in (HENE, 500 * nm):
        ft.complex_field(paths, wavelength, "wavefront")
        ft.irradiance(paths, wavelength, "wavefront")
        ft.mutual_intensity(paths, wavelength, np.zeros(len(paths), dtype=int), "wavefront")
    assert len(calls) == 1
    assert reconstruct(paths) is reconstruct(paths, 400 * nm)


def test_polarised_light_is_reconstructed_once(monkeypatch):
    calls, paths = counted(monkeypatch), traced(gold=True, polarisation=(1.0, 0.0))
    ft.complex_field(paths, HENE, "wavefront")
    ft.irradiance(paths, HENE, "wavefront")
    assert len(calls) == 1


def test_wavefronts_that_need_more_memory_are_not_kept(monkeypatch):
    monkeypatch.setattr(wavefronts, "KEPT", 1000)
    paths = traced(PLANE)
    assert reconstruct(paths) is not reconstruct(paths)
    assert "wavefronts" not in paths.derived


def test_without_memory_for_the_centres_of_pixels_the_image_is_the_same(monkeypatch):
    expected = reconstruct(traced(PLANE)).irradiance(HENE)
    monkeypatch.setattr(wavefronts, "CENTRES", 0)
    one = reconstruct(traced(PLANE))
    assert np.array_equal(one.irradiance(HENE), expected)
    assert one.derived == {}


# What is refused


def test_other_wavelengths_where_the_scene_depends_on_it():
    one = reconstruct(traced(gold=True))
    assert one.wavelength == HENE
    with pytest.raises(ValueError, match=r"wavelength: expected 6\.328e-07 m, that of the wavefronts"):
        one.irradiance(500 * nm)


def test_groups_that_do_not_fit():
    one = reconstruct(traced())
    with pytest.raises(ValueError, match=f"groups: expected {one.paths} whole numbers from 0 on"):
        one.mutual_intensity(HENE, [0.5])


def test_what_is_refused():
    paths = traced()
    with pytest.raises(ValueError, match="paths traced onto a CCD, got paths without one"):
        reconstruct(replace(paths, ccd=None))
    with pytest.raises(ValueError, match="paths of a Beam, got those of Rays"):
        reconstruct(replace(paths, source=ft.Rays([(0, 0, 0)], [(0, 0, 1)])))
    with pytest.raises(ValueError, match="reconstruct: expected at least one Paths, got none"):
        reconstruct([])
