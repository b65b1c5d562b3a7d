# SPDX-License-Identifier: MIT OR Apache-2.0
"""A unit as it is made is found from the flight, and does not lead it astray."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bentwing.evaluate.simulated import Truth
from bentwing.evaluate.trajectory import absolute_error
from bentwing.recording import ImuBatch

from .conftest import CASES

# What the unit reads of a rate: a scale of 1 % about the axis of the spin, and axes that lean.
GYRO = np.array([[1.006, 0.002, 0.004], [-0.004, 0.995, -0.005], [0.006, 0.003, 1.01]])


def read_by(matrix, batches):
    """Return the batches as a unit with this response of its gyro would have measured them."""
    return [
        replace(b, gyro=np.ascontiguousarray(b.gyro @ matrix.T)) if isinstance(b, ImuBatch) else b
        for b in batches
    ]


@pytest.fixture(scope="module")
def flown(run, heads):
    return run("continuous", batches=read_by(GYRO, heads("continuous").batches))


def test_the_scale_about_the_axis_of_the_spin_is_found(flown):
    unit, std = flown.calibration.unit, flown.calibration.std
    assert unit.main_axis == 2
    # The length of what the inverse makes of the main axis; the frame of the unit turns it to z.
    scale = np.linalg.norm(np.linalg.inv(GYRO)[:, 2]) - 1.0
    assert unit.gyro[2, 2] == pytest.approx(scale, abs=max(4 * std["gyro_scale"][2], 3e-4))
    assert std["gyro_scale"][2] < 5e-4


def test_a_scale_of_a_hundredth_costs_no_accuracy(flown, plain_run, simulated):
    truth = Truth(simulated("office", 22.0)).trajectory
    errors = [
        absolute_error(estimate.trajectory, truth).position.rmse
        for estimate in (flown, plain_run("continuous"))
    ]
    assert errors[0] < 1.5 * errors[1] + 1e-3


def test_a_frozen_unit_stays_as_the_payload_has_it(run, heads):
    names = ("gyro_scale", "gyro_misalignment", "g_sensitivity", "accel_scale")
    settings = {"window": 3.0, "registration": {"max_outer": 1}, "frozen": names}
    head = heads("continuous")
    estimate = run(
        "continuous",
        batches=[b for b in head.batches if len(b.times) and b.times[-1] < 9.0],
        settings=type(CASES["continuous"].settings)(**settings),
    )
    unit = estimate.calibration.unit
    assert not unit.gyro.any()
    assert not unit.g_sensitivity.any()
    assert not np.diag(unit.accel).any()
    assert unit.accel.any()
    assert not set(names) & set(estimate.calibration.std)
