"""What a beam's grid sees: names at its nodes, witnesses between them, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from taped import tape, traced

import fringetrace as ft
from fringetrace import mm, um
from fringetrace.field.wavefront import visibility
from fringetrace.geometry import shapes


def test_without_features_nothing_is_added():
    found = visibility.survey(traced())
    assert len(found.names) == 1
    assert len(found.at) == 49
    assert len(found.witnesses.wave) == 0
    assert found.shape == (7, 7)
    assert found.corners(0).all()
    assert found.cells(0).shape == (6, 6)
    assert (found.keys == found.paths.key[0]).all()


def test_a_wire_between_the_nodes_has_witnesses():
    """At x = 0.2 mm: 3.4 cells."""
    found = visibility.survey(traced(tape(0.2 * mm)))
    assert found.corners(0).all()
    dark = found.witnesses.part(~found.witnesses.lit)
    assert len(dark.wave) > 6
    half = 0.5 * 20 * um / (0.5 * mm)
    assert (np.abs(dark.begin[:, 0] - 3.4) < half).all()
    assert (np.abs(dark.end[:, 0] - 3.4) < half).all()
    bright = found.witnesses.part(found.witnesses.lit)
    assert (np.abs(bright.begin[:, 0] - 3.4) > half).all()
    # from rim to rim
    assert dark.begin[:, 1].min() < 0.01
    assert dark.end[:, 1].max() > 5.99


def test_a_sequence_that_no_node_has_is_named():
    """A slit at the centres of cells, 0.25 mm: the beam's rays pass, the nodes' do not."""
    half = shapes.plate(9 * mm, 20 * mm)
    screens = [
        ft.Surface(half.moved((0.25 * mm + side * 4.51 * mm, 0, 7 * mm)), ft.Absorber(), f"screen {side}")
        for side in (-1, 1)
    ]
    paths = traced(*screens)
    found = visibility.survey(paths)
    assert len(found.names) == 1
    assert len(found.rows[0]) == 0
    assert found.paths.ray[found.first[0]] >= 49
    assert found.keys[0] in paths.detected.key
    assert found.cells(0)[:, 2:5].all()
    assert not found.cells(0)[:, [0, 5]].any()


def test_where_the_paths_met_something_else_the_centre_is_asked():
    """Of the beam's own rays one is left out: the cell's centre is traced anew, and is like its corners."""
    paths = traced()
    found = visibility.survey(paths.where(paths.ray != 14))
    assert found.at[49:] == pytest.approx(np.array([[2.5, 2.5]]))
    assert len(found.witnesses.wave) == 0


def test_witnesses_are_looked_at_no_farther_apart_than_asked():
    begin, end = np.array([[0.0, 0.0], [2.0, 2.0]]), np.array([[1.0, 0.25], [2.0, 2.0]])
    witnesses = visibility.Witnesses(np.array([3, 1]), begin, end, np.array([True, False]))
    row, at = witnesses.points(0.3)
    assert row.tolist() == [0] * 5 + [1]
    assert at[0] == pytest.approx(begin[0])
    assert at[4] == pytest.approx(end[0])
    assert at[5] == pytest.approx(begin[1])
    assert np.abs(np.diff(at[:5], axis=0)).max() <= 0.3


def test_witnesses_are_numbered_anew():
    at = np.arange(6.0).reshape(3, 2)
    witnesses = visibility.Witnesses(np.array([3, 1, 0]), at, at, np.ones(3, dtype=bool))
    some = witnesses.numbered([1, 3])
    assert some.wave.tolist() == [1, 0]
    assert (some.begin == at[:2]).all()
    assert len(visibility.Witnesses.joined([some, witnesses]).wave) == 5
    assert len(visibility.Witnesses.joined([]).numbered([]).wave) == 0


def test_a_mask_is_widened_to_all_neighbours():
    mask = np.zeros((4, 5), dtype=bool)
    mask[0, 1] = True
    assert visibility.widened(mask).sum() == 6


def test_what_is_refused():
    paths = traced()
    with pytest.raises(ValueError, match="paths traced onto a CCD, got paths without one"):
        visibility.survey(replace(paths, ccd=None))
    with pytest.raises(ValueError, match="paths of a Beam, got those of Rays"):
        visibility.survey(replace(paths, source=ft.Rays([(0, 0, 0)], [(0, 0, 1)])))
