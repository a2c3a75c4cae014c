"""Films: what they hold, shapes of what comes out, and what is refused."""

import math
import pickle

import numpy as np
import pytest

from fringetrace import nm
from fringetrace.optics import films, materials
from fringetrace.optics.films import Film


def test_layers():
    film = Film([("chitin", 65 * nm), (1.0, 140 * nm), (materials.GOLD, 0)])
    assert [material.name for material, _ in film.layers] == ["chitin", "n=1", "gold"]
    assert film.thickness.tolist() == [65 * nm, 140 * nm, 0.0]
    assert film.reversed().thickness.tolist() == [0.0, 140 * nm, 65 * nm]
    assert film.reversed().reversed() == film
    assert pickle.loads(pickle.dumps(film)) == film
    assert hash(film) == hash(film.reversed().reversed())
    assert film.dispersive
    assert not Film([(1.5, 1e-7)]).dispersive
    wave = np.array([[450.0], [500.0]]) * nm
    assert film.indices(wave).shape == (2, 1, 3)
    assert (film.indices(wave)[..., 0] == materials.CHITIN.index(wave)).all()
    assert film.indices(500 * nm).shape == (3,)


def test_quarter_waves():
    film = films.quarter_wave_stack(2.3, "fused silica", 2, 550 * nm)
    assert [material.name for material, _ in film.layers] == ["n=2.3", "fused silica"] * 2 + ["n=2.3"]
    assert film.thickness * film.indices(550 * nm).real == pytest.approx(550 * nm / 4, rel=1e-15)


def test_shapes_are_broadcast():
    angle, wave = np.linspace(0.0, 1.0, 4), np.linspace(450.0, 650.0, 3)[:, None] * nm
    film = Film([("chitin", 100 * nm)])
    for answer in (films.coefficients, films.reflectance, films.transmittance):
        got = answer(film, "air", "BK7", angle, wave)
        for part in got:
            assert part.shape == (3, 4)
        one = answer(film, "air", "BK7", float(angle[2]), float(wave[1, 0]))
        assert np.shape(one[0]) == ()
        assert [part[1, 2] for part in got] == list(one)
    assert films.fresnel(1.0, np.array([1.5, 1.6])[:, None], angle).rs.shape == (2, 4)


def test_no_layers_are_a_bare_face():
    one, other = (films.coefficients(film, 1.0, 1.5, 0.5, 500 * nm) for film in (None, Film()))
    assert one == other == films.fresnel(1.0, 1.5, 0.5)
    assert films.coefficients(Film([(2.0, 0.0)]), 1.0, 1.5, 0.5, 500 * nm).rs == pytest.approx(
        one.rs, rel=1e-14
    )


@pytest.mark.parametrize(
    ("layer", "error", "message"),
    [
        (1.5, ValueError, r"Film layer 0: expected \(material, thickness\), got 1.5"),
        ((1.5,), ValueError, r"Film layer 0: expected \(material, thickness\), got \(1.5,\)"),
        ((1.5, -1e-9), ValueError, "Film layer 0: expected a thickness of 0 or more metres, got -1e-09"),
        ((1.5, math.nan), ValueError, "Film layer 0: expected a thickness of 0 or more metres, got nan"),
        ((1.5, "65 nm"), ValueError, "Film layer 0: expected a thickness of 0 or more metres, got '65 nm'"),
        ((None, 1e-9), TypeError, "Film layer 0: expected a Material"),
    ],
)
def test_bad_layers(layer, error, message):
    with pytest.raises(error, match=message):
        Film([layer])


@pytest.mark.parametrize("angle", [-0.1, 1.6, math.nan])
def test_bad_angles(angle):
    with pytest.raises(ValueError, match="angle of incidence: expected 0 to pi/2 radians, got"):
        films.coefficients(None, 1.0, 1.5, angle, 500 * nm)
    with pytest.raises(ValueError, match="angle of incidence: expected 0 to pi/2 radians, got"):
        films.fresnel(1.0, 1.5, angle)


def test_outside_of_a_material():
    with pytest.raises(ValueError, match="chitin: expected 400 nm to 700 nm, got 1000 nm"):
        films.reflectance(Film([("chitin", 1e-7)]), 1.0, 1.5, 0.0, 1000 * nm)
    with pytest.raises(ValueError, match="n=1: expected a positive wavelength, got -500 nm"):
        films.reflectance(None, 1.0, 1.5, 0.0, -500 * nm)


@pytest.mark.parametrize("pairs", [-1, 1.5])
def test_bad_pairs(pairs):
    with pytest.raises(ValueError, match="quarter-wave stack: expected 0 or more pairs, got"):
        films.quarter_wave_stack(2.3, 1.38, pairs, 550 * nm)


@pytest.mark.parametrize("index", [math.nan, math.inf, 0.0, complex(1.0, math.nan)])
def test_fresnel_refuses_what_is_no_index(index):
    for first, last in ((index, 1.5), (1.5, np.array([1.0, index]))):
        with pytest.raises(ValueError, match="fresnel: expected finite indices n"):
            films.fresnel(first, last, 0.1)
