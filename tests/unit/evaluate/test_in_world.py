# SPDX-License-Identifier: MIT OR Apache-2.0
"""A run is compared in the world, whatever it calls its IMU's axes and its clock."""

from __future__ import annotations

import json
from dataclasses import replace

import laspy
import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.errors import InputError
from bentwing.base.mount import FixedMount, Pose
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.simulated import Truth, world_error

TURN = geometry.exp(np.array([0.3, -1.2, 2.0]))
ELSEWHERE = geometry.exp(np.array([0.0, 0.1, 0.8])), np.array([3.0, -1.0, 0.5])


@pytest.fixture(scope="module")
def truth(simulated):
    return Truth(simulated("office", 22.0))


@pytest.fixture
def run(truth, tmp_path):
    """Writes the run of the truth, with its IMU's frame turned, in a frame of its own."""

    def write(*, late=0.0, stretched=1.0, off=0.0, kept=1.0):
        path = truth.trajectory
        n = int(kept * len(path))
        R, t = geometry.to_matrices(ELSEWHERE[0]), ELSEWHERE[1]
        quats = geometry.multiply(ELSEWHERE[0], geometry.multiply(path.quats_xyzw, TURN))
        positions = stretched * path.positions @ R.T + t
        written = Trajectory(path.times[:n] + late, positions[:n], quats[:n])
        written.write_tum(tmp_path / "trajectory.txt", truth.origin_ns)
        mount = truth.calibration.mount.T_imu_lidar
        turned = Pose(np.zeros(3), geometry.inverse(TURN)) @ mount
        found = replace(truth.calibration, mount=FixedMount(turned))
        record = {"kind": "bentwing run", "calibration": found.to_json()}
        (tmp_path / "run.json").write_text(json.dumps(record))
        table = laspy.LasData(laspy.LasHeader(version="1.4", point_format=6))
        points = truth.best_points.copy()
        points[::5, 2] += off
        table.header.scales = [1e-4] * 3
        table.xyz = points @ R.T + t
        table.gps_time = np.linspace(late, late + path.times[-1], len(points))
        table.write(tmp_path / "map.laz")
        return tmp_path

    return write


def test_a_run_that_calls_its_axes_otherwise_is_right(truth, run):
    error = world_error(truth, run())
    assert error.path < 1e-6
    assert error.covered == 1.0
    best = np.percentile(abs(truth.distances(truth.best_points)), 90)
    assert error.map == pytest.approx(best, rel=0.1)
    assert error.astray < 0.01


@pytest.mark.parametrize("late", [0.73, -2.9, 1.7e9])
def test_a_run_on_another_clock_is_right_where_clocks_do_not_count(truth, run, late):
    folder = run(late=late)
    error = world_error(truth, folder, any_clock=True)
    assert error.clock == pytest.approx(-late, abs=2e-4 if late < 1e6 else 2e-2)
    assert error.path < 1e-3


def test_a_clock_that_is_late_counts_where_clocks_have_to_agree(truth, run):
    folder = run(late=0.5)
    assert world_error(truth, folder).path > 0.1


def test_a_stretched_path_and_a_doubled_wall_are_off(truth, run):
    assert world_error(truth, run(stretched=1.05)).path > 0.03
    error = world_error(truth, run(off=0.12))
    assert error.path < 1e-6
    assert error.map > 0.1


def test_a_run_that_ends_early_covers_less_of_the_flight(truth, run):
    assert 0.4 < world_error(truth, run(kept=0.6)).covered < 0.7


def test_a_run_without_poses_in_flight_cannot_be_compared(truth, run):
    with pytest.raises(InputError, match="share 0 stamps"):
        world_error(truth, run(kept=0.1))
