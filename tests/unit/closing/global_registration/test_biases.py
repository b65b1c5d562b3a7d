# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base.calibration import Calibration
from bentwing.base.estimate import Estimate
from bentwing.base.mount import FixedMount, Pose
from bentwing.base.trajectory import Trajectory
from bentwing.base.window_record import WindowRecord
from bentwing.closing.global_registration.biases import drift_of, has_inertial_states


def estimate(windows, std):
    level = Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    calibration = Calibration(
        0.0, FixedMount(level), np.full(3, 0.02), np.zeros(3), np.array([0.0, 0.0, 9.8]), std
    )
    return Estimate(
        Trajectory(np.arange(2.0), np.zeros((2, 3)), np.eye(4)[[3, 3]]), calibration, windows
    )


def window(time, bias, std):
    return WindowRecord(
        time=time, gyro_bias=[bias] * 3, std={"gyro_bias": [std] * 3},
        n_surfels=0, n_matches=0, inlier_share=None, residual_rms=None,
        iterations=1, converged=True, degenerate=False,
    )  # fmt: skip


def test_only_what_is_known_as_well_as_at_the_end_is_history():
    # Until the head turns the bias is a guess; its jump at 10 s is knowledge, not drift.
    windows = [window(5.0, 0.5, 1.0), window(10.0, 0.01, 1.5e-3), window(20.0, 0.02, 1e-3)]
    drift = drift_of(
        estimate(windows, {"gyro_bias": [1e-3] * 3}), "gyro_bias", np.array([0.0, 15.0, 30.0])
    )
    assert drift[:, 0] == pytest.approx([-0.01, -0.005, 0.0])


def test_without_windows_a_bias_is_constant():
    assert not drift_of(estimate([], {}), "gyro_bias", np.arange(3.0)).any()


def test_an_estimate_without_imu_has_no_inertial_states():
    assert not has_inertial_states(estimate([], {"latency": [1e-4]}))
    assert has_inertial_states(estimate([], {"gyro_bias": [1e-4] * 3}))
