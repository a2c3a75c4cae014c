"""The pupil: which directions pass."""

import numpy as np
import pytest
from meetings import meeting

from fringetrace.optics.pupils import Pupil


@pytest.mark.parametrize(("aperture", "passes"), [(0.49, False), (0.51, True)])
def test_rays_pass_by_index_times_sine(aperture, passes):
    """30 degrees in air; the same in glass counts for more."""
    direction = (0.5, 0.0, np.sqrt(0.75))
    (branch,) = Pupil((0, 0, 1), aperture).act(meeting(direction))
    assert bool(np.abs(branch.field).sum() > 0) == passes
    (branch,) = Pupil((0, 0, 1), aperture).act(meeting(direction, index=1.5))
    assert not np.abs(branch.field).any()
    assert branch.direction is None


def test_it_turns_with_its_axis():
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    np.testing.assert_allclose(Pupil((0, 0, 1), 0.2).moved((1, 2, 3), turn).axis, [1.0, 0.0, 0.0])


@pytest.mark.parametrize("aperture", [0.0, -1.0])
def test_an_aperture_that_is_none_is_refused(aperture):
    with pytest.raises(ValueError, match="Pupil aperture: expected a positive number, got"):
        Pupil((0, 0, 1), aperture)
