# SPDX-License-Identifier: MIT OR Apache-2.0
"""Times made for real clouds, compared with those that the clouds have."""

from __future__ import annotations

import itertools
from collections import Counter

import numpy as np
import pytest

from bentwing.recording.containers.source import open_source
from bentwing.recording.messages import wire_clouds
from bentwing.recording.messages.point_cloud2 import columns, time_field
from bentwing.recording.point_times import decide
from bentwing.recording.sweep_stamps import SweepStamps
from bentwing.recording.turn_finding import Sweep, find_turn

N_CLOUDS, N_STAMPS = 8, 70
# File, topic, sense of the turn, and how far off they are, s, rms.
REAL = {
    "HDL-32E": ("garage_hdl32.bag", "/velodyne_points", -1, 1.5e-4),
    "HDL-64E": ("drive_hdl64/start_16m.bag", "/velodyne_points", 1, 1e-5),
    # Beams look 3° aside of the rotor, which the order of the points shows.
    "OS1-64": ("packets/ouster_os1_64.mcap", "/os1_cloud_node/points", -1, 3e-4),
}


def clouds_of(path, topic):
    source = open_source([path])
    try:
        messages = list(itertools.islice(source.messages({topic}), N_STAMPS))
        clouds = [wire_clouds.point_cloud(raw, cdr=source.cdr) for _, _, raw in messages]
        return clouds, [recorder_ns for _, recorder_ns, _ in messages]
    finally:
        source.close()


@pytest.mark.parametrize(("file", "topic", "sense", "worst"), REAL.values(), ids=REAL)
def test_made_times_are_those_that_the_clouds_have(shared_data, file, topic, sense, worst):
    clouds, recorder_ns = clouds_of(shared_data / file, topic)
    stamps = SweepStamps.of([cloud.stamp_ns for cloud in clouds], recorder_ns, None)
    seen = [columns(cloud, Counter()) for cloud in clouds[:N_CLOUDS]]
    own = decide(time_field(clouds[0]), seen[0].raw_times, clouds[0].stamp_ns, stamps.period)
    found = find_turn([Sweep(cols.points, cols.ring) for cols in seen], stamps)
    assert found.sense == sense
    for cloud, cols in zip(clouds, seen, strict=False):
        off = found.offsets(cols.points, cols.ring) - own.offsets(cols.raw_times, cloud.stamp_ns)
        # What all have in common is a latency, of the part of the turn in which nothing returned.
        assert np.std(off) < worst
        assert abs(np.mean(off)) < found.unseen * found.turn / (2 * np.pi) + 1e-3
