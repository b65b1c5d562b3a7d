# SPDX-License-Identifier: MIT OR Apache-2.0
"""The Kalman filter with a motor-turned and a fixed VLP-16, on whole flights.

The bounds are about twice what it reaches.
"""

from __future__ import annotations

from collections import Counter

import pytest

from bentwing import odometry
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.trajectory import absolute_error
from bentwing.recording import Payload, Recording
from bentwing.recording.preprocess import preprocess
from bentwing.simulate import Scenario, simulate

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("scene", "head", "seed", "rmse", "worst"),
    [
        ("office", "vlp16-motor", 21, 0.007, 0.025),
        ("office", "vlp16-motor", 1, 0.007, 0.025),
        ("courtyard", "vlp16-motor", 2, 0.008, 0.03),
        ("office", "vlp16-fixed", 1, 0.008, 0.03),
    ],
)
def test_a_flight_is_followed_within_millimetres(made_once, scene, head, seed, rmse, worst):
    scenario = Scenario(scene=scene, head=head, motor_rate=6.2832, duration=26.0, seed=seed)
    folder = made_once(f"kalman-{scene}-{head}-{seed}", lambda out: simulate(scenario, out))
    payload = Payload.load(folder / "payload.yaml")
    engine = odometry.create("kalman", payload, None, 1)
    with Recording(folder / "recording.bag", payload) as recording:
        truth, _ = read_tum(folder / "truth_trajectory.txt", recording.clock.start_ns)
        for batch in preprocess(recording.batches(), payload, Counter()):
            engine.feed(batch)
    error = absolute_error(engine.result().trajectory, truth).position
    assert error.rmse < rmse
    assert error.maximum < worst
