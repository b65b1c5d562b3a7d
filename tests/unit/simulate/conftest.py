# SPDX-License-Identifier: MIT OR Apache-2.0
import functools

import numpy as np
import pytest

from bentwing.simulate.records import CloudRecord, ScanRecord
from bentwing.simulate.scenario import Scenario
from bentwing.simulate.simulation import prepare

WINDOW = (12.0, 13.0)
"""s, in flight."""


@functools.cache
def recorded(head="hokuyo-spin", *, seed=0, noiseless=True, events=()):
    """A setup, and what its sensors send during `WINDOW`."""
    scenario = Scenario(
        scene="office", head=head, duration=24.0, seed=seed, noiseless=noiseless, events=events
    )
    setup = prepare(scenario)
    records = [r for _, _, part in setup.sensors.stream(*WINDOW) for r in part]
    return setup, records


def lidar_points(records):
    """Points (N, 3) in the lidar frame and their stamps, as a reader would get them."""
    points, stamps = [], []
    for record in records:
        if isinstance(record, ScanRecord):
            beam = np.arange(len(record.ranges))
            ok = np.isfinite(record.ranges)
            angle = record.angle_min + record.angle_increment * beam[ok]
            xy = np.column_stack([np.cos(angle), np.sin(angle)])
            fan = np.column_stack([xy, np.zeros(len(xy))])
            points.append(record.ranges[ok, None].astype(np.float64) * fan)
            stamps.append(record.stamp + record.time_increment * beam[ok])
        elif isinstance(record, CloudRecord):
            xyz = np.column_stack([record.points[c] for c in "xyz"]).astype(np.float64)
            points.append(xyz)
            stamps.append(record.stamp + record.points["time"].astype(np.float64))
    return np.vstack(points), np.concatenate(stamps)


@pytest.fixture
def rng():
    return np.random.default_rng(1)
