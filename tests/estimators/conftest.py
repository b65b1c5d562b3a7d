# SPDX-License-Identifier: MIT OR Apache-2.0
"""What every estimator is fed in its contract: the first seconds of a flight through an office.

NDT odometry and the Kalman filter cannot register the single planes of a 2D scanner: they are given a
VLP-16 instead.
"""

from __future__ import annotations

import functools
from collections import Counter
from types import SimpleNamespace
from typing import TYPE_CHECKING, NamedTuple

import pytest

from bentwing import odometry
from bentwing.odometry.continuous.settings import ContinuousSettings
from bentwing.odometry.kalman import KalmanSettings
from bentwing.odometry.ndt import NdtSettings
from bentwing.recording import LidarBatch, Payload, Recording
from bentwing.recording.preprocess import preprocess

if TYPE_CHECKING:
    from pydantic import BaseModel

LENGTH = 11.0  # s; the rest at the start is over after four
THINNING = 3  # every third point, for speed

SLOW_STATES = frozenset({"latency", "extrinsic_rotation", "gyro_bias", "accel_bias"})


class Case(NamedTuple):
    """An estimator in its contract.

    Attributes
    ----------
    settings : quick ones that still go through all of its parts
    head : of the simulation
    estimated : slow states that it estimates, at least
    needs_imu : whether it refuses a payload without an IMU
    """

    settings: BaseModel
    head: str
    estimated: frozenset[str] = frozenset()
    needs_imu: bool = False


CASES = {
    "continuous": Case(
        ContinuousSettings(window=3.0, registration={"max_outer": 2}), "hokuyo-spin", SLOW_STATES
    ),
    "kalman": Case(KalmanSettings(rehearsal=6.0), "vlp16-fixed", SLOW_STATES, needs_imu=True),
    "ndt": Case(NdtSettings(max_points=1000), "vlp16-fixed"),
}


@pytest.fixture(scope="session")
def heads(simulated):
    """Return the payload and the batches of the flight by the name of the estimator."""
    return functools.cache(lambda name: _flown(simulated("office", 22.0, head=CASES[name].head)))


@pytest.fixture
def head(heads, name):
    """The payload and the batches of the flight."""
    return heads(name)


def _flown(folder):
    payload = Payload.load(folder / "payload.yaml")
    with Recording(folder / "recording.bag", payload) as recording:
        stream = preprocess(recording.batches(0.0, LENGTH), payload, Counter())
        batches = [
            b.where(slice(None, None, THINNING)) if isinstance(b, LidarBatch) else b for b in stream
        ]
    return SimpleNamespace(payload=payload, batches=batches)


@pytest.fixture(scope="session")
def quick():
    """Settings by the name of the estimator."""
    return {name: case.settings for name, case in CASES.items()}


@pytest.fixture
def case(name):
    """What the contract has to know of the estimator."""
    return CASES[name]


@pytest.fixture(params=sorted(odometry.ESTIMATORS))
def name(request):
    """Of the estimator."""
    return request.param


@pytest.fixture(scope="session")
def run(heads):
    """Feed an estimator and return its result."""

    def feed(name, *, batches=None, threads=1, settings=None):
        head = heads(name)
        engine = odometry.create(name, head.payload, settings or CASES[name].settings, threads)
        for batch in head.batches if batches is None else batches:
            engine.feed(batch)
        return engine.result()

    return feed


@pytest.fixture(scope="session")
def plain_run(run):
    """The result of an estimator with one thread, computed once."""
    return functools.cache(lambda name: run(name))
