# SPDX-License-Identifier: MIT OR Apache-2.0
"""The truth of a simulated recording makes a map that lies on the true surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.map import surface_error
from bentwing.evaluate.simulated import Truth, in_flight


@pytest.mark.parametrize(("head", "sigma"), [("hokuyo-spin", 0.01), ("vlp16-motor", 0.02)])
def test_the_best_map_is_as_thin_as_the_ranges_allow(simulated, head, sigma):
    """Beams that meet a surface at a slant are nearer to it than their ranges are wrong."""
    truth = Truth(simulated("office", 22.0, head=head))
    error = surface_error(truth.distances(truth.best_points))
    assert len(truth.best_points) > 50_000
    assert 0.3 * sigma < error.std < sigma
    assert abs(error.bias) < 0.1 * sigma
    assert error.n_excluded < 0.01 * error.n_points


def test_the_best_map_is_compared_with_itself(simulated):
    truth = Truth(simulated("office", 22.0))
    assert truth.map_error(truth.best_points).best_ratio == 1.0


def test_flight_is_the_time_away_from_the_first_place():
    times = np.arange(6.0)
    x = np.array([0.0, 0.05, 0.5, 3.0, 0.2, 0.02])
    still = np.tile([0.0, 0.0, 0.0, 1.0], (6, 1))
    moving = Trajectory(times, np.column_stack([x, 0 * x, 0 * x]), still)
    assert in_flight(moving) == (2.0, 4.0)
    with pytest.raises(InputError, match="does not move"):
        in_flight(Trajectory(times, np.zeros((6, 3)), still))
