# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np

from bentwing.base.trajectory import Trajectory
from bentwing.report.sections import tiles


def test_the_way_from_one_run_to_the_next_is_not_flown():
    times = np.concatenate([np.arange(0.0, 60.0, 0.01), np.arange(70.0, 100.0, 0.01)])
    positions = np.c_[times, 0 * times, 0 * times]
    positions[times >= 70.0] += [500.0, 0.0, 0.0]
    quats = np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1))
    shown = tiles(
        {"timings": {"total": 45.0}}, Trajectory(times, positions, quats), np.empty((0, 3)), None
    )
    assert "<b>90 m</b><span>length of the way" in shown
    assert "1:30" in shown
