# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from bentwing.recording import EncoderBatch, ImuBatch, LidarBatch, Payload
from bentwing.recording.preprocess import preprocess
from bentwing.recording.preprocess.ranges import within_range
from bentwing.recording.preprocess.self_hits import outside_boxes


def lidar(times, ranges=5.0):
    times = np.asarray(times, float)
    points = np.zeros((len(times), 3))
    points[:, 0] = ranges
    return LidarBatch(points, times, np.arange(len(times), dtype=np.float32))


def encoder(times, speed=2.0):
    times = np.asarray(times, float)
    return EncoderBatch(times, speed * times)


def run(batches, **payload):
    counts = Counter()
    return list(preprocess(batches, Payload(**payload), counts)), counts


def lidar_times(batches):
    times = [batch.times for batch in batches if isinstance(batch, LidarBatch)]
    return np.concatenate([np.zeros(0), *times])


def test_ranges_are_inclusive_at_both_ends():
    points = np.array([[0.29, 0, 0], [0.3, 0, 0], [0, 30.0, 0], [0, 0, 30.01]])
    np.testing.assert_array_equal(within_range(points, 0.3, 30.0), [False, True, True, False])


def test_points_in_any_box_are_self_hits():
    hits = Payload(
        self_hits=[
            {"box": {"min": [-1, -1, -1], "max": [0, 0, 0]}},
            {"box": {"min": [0, 0, 0], "max": [1, 1, 1]}},
        ]
    ).self_hits
    points = np.array([[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5], [0.5, -0.5, 0.5], [2, 2, 2]])
    np.testing.assert_array_equal(outside_boxes(points, hits), [False, False, True, True])


def test_filters_drop_and_count():
    ranges = np.array([0.1, 0.5, 5.0, 500.0])
    hits = [{"box": {"min": [0.4, -1, -1], "max": [0.6, 1, 1]}}]
    batches, counts = run([lidar(np.arange(4), ranges)], self_hits=hits)
    np.testing.assert_array_equal(lidar_times(batches), [2])
    np.testing.assert_array_equal(batches[0].intensity, [2])
    assert counts == {"preprocess.range": 2, "preprocess.self_hits": 1}


def test_imu_batches_pass_through():
    imu = ImuBatch(np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)))
    assert run([imu])[0] == [imu]


def test_a_batch_with_nothing_left_disappears():
    assert run([lidar([0.0], 1000.0)])[0] == []


def test_points_wait_for_the_encoder_and_get_its_angle():
    first, second = encoder([0.0, 0.1]), encoder([0.2, 0.3])
    points = lidar([0.05, 0.15, 0.25])
    batches, counts = run([first, points, second], encoder={})
    assert [type(batch).__name__ for batch in batches] == [
        "EncoderBatch", "EncoderBatch", "LidarBatch",
    ]  # fmt: skip
    np.testing.assert_allclose(batches[-1].angles, [0.1, 0.3, 0.5])
    assert counts["preprocess.no_encoder_angle"] == 0


def test_a_delay_of_the_encoder_is_taken_off():
    points = lidar([0.05, 0.15, 0.25])
    batches, _ = run([encoder([0.0, 0.1, 0.2, 0.3]), points], encoder={"delay": 0.01})
    np.testing.assert_allclose(batches[-1].angles, [0.08, 0.28, 0.48])


def test_points_before_and_after_the_encoder_are_dropped_and_counted():
    batches, counts = run([encoder([0.1, 0.2]), lidar([0.05, 0.15, 0.25])], encoder={})
    np.testing.assert_allclose(lidar_times(batches), [0.15])
    assert counts["preprocess.no_encoder_angle"] == 2


def test_points_in_a_gap_of_the_encoder_are_dropped():
    stream = [encoder([0.0, 0.1]), encoder([1.0, 1.1]), lidar([0.05, 0.5, 1.05])]
    batches, counts = run(stream, encoder={})
    np.testing.assert_allclose(lidar_times(batches), [0.05, 1.05])
    assert counts["preprocess.no_encoder_angle"] == 1


def test_a_silent_encoder_does_not_hold_points_for_ever():
    stream = [lidar(start + np.linspace(0, 0.09, 10)) for start in np.arange(0, 30, 0.1)]
    counts = Counter()
    pulled = list(preprocess(iter(stream), Payload(encoder={}), counts))
    assert pulled == []
    assert counts["preprocess.no_encoder_angle"] == 3000


@pytest.mark.parametrize("delay", [0, 1, 5])
def test_angles_are_right_over_a_long_run(delay):
    """The encoder's batches may come some slots after the points they belong to."""
    slots = np.arange(0, 20, 0.1)
    points = [lidar(start + np.linspace(0, 0.099, 20)) for start in slots]
    angles = [encoder(start + np.arange(0, 0.1, 0.01), 3.0) for start in slots]
    stream = [batch for pair in zip(points[delay:], angles, strict=False) for batch in pair]
    stream = points[:delay] + stream
    batches, counts = run(stream, encoder={})
    for batch in batches:
        if isinstance(batch, LidarBatch):
            np.testing.assert_allclose(batch.angles, 3.0 * batch.times, atol=1e-9)
    dropped = counts["preprocess.no_encoder_angle"]
    assert len(lidar_times(batches)) + dropped == 4000
    assert dropped <= 20 * delay + 2
