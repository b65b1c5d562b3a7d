# SPDX-License-Identifier: MIT OR Apache-2.0
"""When an estimate that is not good sends bentwing to look for another set-up of the head."""

from __future__ import annotations

import pytest

from bentwing.evaluate.verdict import Evidence, verdict_of
from bentwing.run.first_pass import blames_head

LOST = Evidence("lost", 0.5, (), {"seconds": 9.0})


@pytest.mark.parametrize(
    ("evidence", "blames"),
    [
        ([LOST], True),
        ([LOST, Evidence("gyro_limit", 0.02, (), {"share": 2.0})], True),
        ([LOST, Evidence("gyro_limit", 0.2, (), {"share": 20.0})], False),
        ([LOST, Evidence("imu_period", 0.04, (), {"rate": 25.0})], True),
        ([LOST, Evidence("imu_period", 0.1, (), {"rate": 10.0})], False),
        ([LOST, Evidence("point_order", 0.6)], False),
        ([Evidence("breaks", 1.0, (), {"n": 1})], False),
    ],
)
def test_only_a_head_is_looked_for_that_may_be_to_blame(evidence, blames):
    assert blames_head(verdict_of(evidence)) is blames
