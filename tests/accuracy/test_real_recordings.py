# SPDX-License-Identifier: MIT OR Apache-2.0
"""A real recording: a Velodyne HDL-32E that drives 11 m into a parking hall, without IMU."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.thickness import wall_thickness
from bentwing.map.read import read_points
from bentwing.run.pipeline import map_recording

pytestmark = pytest.mark.slow

# KISS-ICP with voxels of 0.5 m and deskewing: turn 82 in the frame of turn 0, 8.2 s earlier.
KISS_ICP_END, KISS_ICP_YAW = (11.1, 0.0, 0.0), np.radians(1.4)


@pytest.fixture(scope="module")
def garage(shared_data, tmp_path_factory):
    out = tmp_path_factory.mktemp("garage")
    map_recording(shared_data / "garage_hdl32.bag", None, out, refine=False, threads=2)
    return out


def test_the_run_is_complete(garage):
    record = json.loads((garage / "run.json").read_text())
    assert record["complete"]
    assert record["counts"]["lidar.messages"] == 83
    assert record["counts"]["map.points"] > 1_000_000


def test_the_drive_ends_where_kiss_icp_ends(garage):
    """Two ways of odometry that agree within 0.3 m over 11 m are both not lost."""
    trajectory, _ = read_tum(garage / "trajectory.txt")
    positions, (start, end) = trajectory.interpolate(np.array([0.0, 8.2]))
    moved = geometry.rotate(geometry.inverse(start), positions[1] - positions[0])
    assert moved == pytest.approx(KISS_ICP_END, abs=0.3)
    turn = geometry.log(geometry.multiply(geometry.inverse(start), end))
    assert turn[2] == pytest.approx(KISS_ICP_YAW, abs=np.radians(1.0))
    assert np.abs(turn[:2]).max() < np.radians(1.5)


def test_walls_are_as_thin_as_the_scanner_measures(garage):
    """The data sheet says 2 cm; a second wall beside the first would be thicker."""
    thickness = wall_thickness(read_points(garage / "map.laz"))
    assert thickness.median < 0.03
    assert thickness.p75 < 0.05
