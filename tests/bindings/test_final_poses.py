# SPDX-License-Identifier: MIT OR Apache-2.0
"""Poses follow the calibration as the window that made them would."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.odometry.continuous.final_poses import FinalPoses
from bentwing.odometry.continuous.slow_states import N_STATES, SLICES


def test_poses_follow_to_where_a_window_with_the_other_calibration_puts_them(register):
    """All slow states are held where they were corrected to, and the window is solved again."""
    free = register()
    moved = np.zeros(N_STATES)
    moved[SLICES["latency"]] = 5e-4
    moved[SLICES["extrinsic_translation"]] = [2e-3, -1e-3, 1e-3]
    held = register(
        samples=free.samples,
        globals=free.globals,
        information=np.eye(N_STATES) * 1e14,
        offset=(-moved).tolist(),
    )
    correction = held.globals.moved_from(free.globals)
    assert correction == pytest.approx(moved, abs=2e-5)
    expected = free.samples.following(correction)
    shift = np.linalg.norm(held.samples.positions - free.samples.positions, axis=1)
    error = np.linalg.norm(held.samples.positions - expected.positions, axis=1)
    assert shift.max() > 1e-3
    assert error.max() < 0.1 * shift.max()


def test_final_poses_follow_as_the_samples_would(register, states):
    result = register()
    n = len(result.samples) - 30
    final = FinalPoses(result.samples, n, result.globals)
    assert final.by(result.globals)[0] == pytest.approx(result.samples.positions[:n])
    newer = states()
    correction = newer.moved_from(result.globals)
    moved = result.samples.following(correction)
    assert np.abs(moved.positions - result.samples.positions).max() > 1e-4
    positions, quats = final.by(newer)
    assert positions == pytest.approx(moved.positions[:n], abs=2e-5)
    turned = geometry.multiply(geometry.inverse(quats), moved.quats_xyzw[:n])
    assert np.abs(geometry.log(turned)).max() < 2e-5
