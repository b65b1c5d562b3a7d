# SPDX-License-Identifier: MIT OR Apache-2.0
import pytest

from bentwing.recording.losses import losses


@pytest.mark.parametrize(
    ("counts", "expected"),
    [
        ({"imu.samples": 4012, "imu.nan": 4012}, ["4,012 of 4,012 IMU samples are not a number"]),
        (
            {"lidar.messages": 5, "lidar.broken_messages": 195},
            ["195 of 200 lidar messages could not be read"],
        ),
        (
            {"imu.samples": 10, "imu.backwards_stamps": 90},
            ["90 of 100 IMU messages have stamps going backwards"],
        ),
        (
            {"lidar.returns": 1000, "lidar.zero": 700, "lidar.inf": 200},
            [
                "200 of 1,000 lidar returns are infinite",
                "700 of 1,000 lidar returns are zero",
            ],
        ),
        (
            {"lidar.returns": 100, "preprocess.range": 60},
            ["60 lidar returns are outside of the payload's min_range and max_range"],
        ),
        ({"lidar.returns": 1000, "lidar.zero": 70, "imu.samples": 5000, "imu.nan": 3}, []),
        ({}, []),
    ],
)
def test_what_was_lost_is_named_with_its_share_where_it_matters(counts, expected):
    assert losses(counts) == expected
