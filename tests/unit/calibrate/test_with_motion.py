# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a flight tells of the head, as a payload."""

from dataclasses import replace

import numpy as np
import pytest

from bentwing.base.mount import MotorErrors
from bentwing.base.range_bias import RangeBias
from bentwing.calibrate.outcome import with_motion
from bentwing.recording import Payload
from bentwing.recording.described import described_calibration

PAYLOAD = Payload.model_validate({"imu": {}, "T_imu_lidar": {}})


def flown(payload, ranges, **std):
    return replace(described_calibration(payload), ranges=ranges, std={"latency": [1e-4], **std})


def test_ranges_that_were_found_are_written_with_their_deviation_and_read_back(tmp_path):
    found = flown(PAYLOAD, RangeBias(-0.0287, 9.4e-4), range_offset=[1e-3], range_grazing=[8e-5])
    with_motion(PAYLOAD, found).save(tmp_path / "payload.yaml")
    again = Payload.load(tmp_path / "payload.yaml")
    assert described_calibration(again).ranges == found.ranges
    assert again.calibration.std["range_offset"] == pytest.approx((1e-3,))


def test_ranges_that_do_not_show_are_left_as_they_were_described():
    assert with_motion(PAYLOAD, flown(PAYLOAD, RangeBias())).lidar.ranges is None
    known = Payload.model_validate({**PAYLOAD.model_dump(), "lidar": {"ranges": {"offset": 0.01}}})
    assert with_motion(known, flown(known, RangeBias(0.01))).lidar.ranges == known.lidar.ranges


def test_how_a_motor_turns_is_written_with_its_deviation_and_read_back(tmp_path):
    payload = Payload.model_validate({"imu": {}, "encoder": {"T_imu_motor": {}}})
    drawn = flown(payload, RangeBias(), motor_wobble=[1e-5] * 8)
    wobble = np.array([[1e-4, 2e-4, 3e-4, 4e-4], [5e-4, 6e-4, 7e-4, 8e-4]])
    errors = MotorErrors(np.array([1e-3, -2e-3]), wobble)
    found = replace(drawn, mount=replace(drawn.mount, errors=errors))
    with_motion(payload, found).save(tmp_path / "payload.yaml")
    again = Payload.load(tmp_path / "payload.yaml")
    assert described_calibration(again).mount == found.mount
    assert again.calibration.std["motor_wobble"] == (1e-5,) * 8
